//! Every built-in function and operator with arguments of every type: one script for each combination.

/// What every script begins with.
const PRELUDE: &str = "\
function same(x) { return x }
function show(x) {
  if(isnil(x)) { log(\"nil\") }
  else if(isint(x)) { log(\"integer \", x) }
  else if(isfloat(x)) { log(\"float \", x) }
  else if(isstring(x)) { log(\"string \", x) }
  else { log(type(x)) }
}
function f(a, b, c) { return 1 }
t = { .0 = 4, .1 = 5, .x = \"y\" }
v = stigmergy.create(1)
v.put(3, 33)
s = swarm.create(1)
";

/// Values, as scripts write them.
const VALUES: [&str; 12] =
    ["nil", "0", "3", "(-2)", "2000000000", "2.5", "0.0", "\"\"", "\"ab\"", "\"12\"", "t", "f"];

/// Values for the functions of three arguments.
const FEW_VALUES: [&str; 8] = ["nil", "0", "3", "(-2)", "2.5", "\"ab\"", "t", "f"];

/// Functions and the numbers of arguments with which they are called. Those with random results are left out.
const FUNCTIONS: &[(&str, &[usize])] = &[
    ("size", &[0, 1]),
    ("type", &[0, 1]),
    ("isnil", &[0, 1]),
    ("isint", &[0, 1]),
    ("isfloat", &[0, 1]),
    ("isstring", &[0, 1]),
    ("istable", &[0, 1]),
    ("isclosure", &[0, 1]),
    ("isuserdata", &[1]),
    ("int", &[0, 1]),
    ("float", &[0, 1]),
    ("clone", &[1]),
    ("foreach", &[1, 2]),
    ("map", &[1, 2]),
    ("filter", &[1, 2]),
    ("reduce", &[2, 3]),
    ("math.abs", &[0, 1]),
    ("math.sqrt", &[0, 1]),
    ("math.log", &[0, 1]),
    ("math.log2", &[1]),
    ("math.log10", &[1]),
    ("math.exp", &[1]),
    ("math.sin", &[1]),
    ("math.cos", &[1]),
    ("math.tan", &[1]),
    ("math.asin", &[1]),
    ("math.acos", &[1]),
    ("math.atan", &[1, 2]),
    ("math.floor", &[0, 1]),
    ("math.ceil", &[1]),
    ("math.round", &[1]),
    ("math.min", &[1, 2]),
    ("math.max", &[1, 2]),
    ("math.rng.setseed", &[0, 1]),
    ("string.length", &[0, 1]),
    ("string.concat", &[1, 2, 3]),
    ("string.sub", &[1, 2, 3]),
    ("string.toint", &[0, 1]),
    ("string.tofloat", &[1]),
    ("string.tostring", &[1]),
    ("neighbors.count", &[0, 1]),
    ("neighbors.get", &[0, 1]),
    ("neighbors.ignore", &[0, 1]),
    ("neighbors.listen", &[1, 2]),
    ("neighbors.broadcast", &[1, 2]),
    ("neighbors.foreach", &[0, 1]),
    ("neighbors.map", &[1]),
    ("neighbors.filter", &[1]),
    ("neighbors.reduce", &[1, 2]),
    ("neighbors.kin", &[0]),
    ("swarm.create", &[0, 1]),
    ("swarm.id", &[0, 1]),
    ("s.in", &[0, 1]),
    ("s.join", &[0, 1]),
    ("s.select", &[0, 1]),
    ("s.exec", &[0, 1]),
    ("s.others", &[1]),
    ("stigmergy.create", &[0, 1]),
    ("v.put", &[1, 2]),
    ("v.get", &[0, 1]),
    ("v.size", &[0, 1]),
    ("v.foreach", &[0, 1]),
    ("v.map", &[1]),
    ("v.reduce", &[1, 2]),
    ("v.onconflict", &[0, 1]),
    ("v.onconflictlost", &[0, 1]),
];

/// Operators of two operands: those with a number, and those that are conditions.
const OPERATORS: [&str; 10] = ["+", "-", "*", "/", "%", "^", "&", "|", "<<", ">>"];
const CONDITIONS: [&str; 8] = ["<", "<=", ">", ">=", "==", "!=", "and", "or"];

/// Statements about one value `$`, and their names.
const STATEMENTS: [(&str, &str); 9] = [
    ("negation", "show(-$)"),
    ("!", "show(!$)"),
    ("not", "if(not $) { log(\"yes\") } else { log(\"no\") }"),
    ("if", "if($) { log(\"yes\") } else { log(\"no\") }"),
    ("t[]", "show(t[$])"),
    ("t[] =", "t[$] = 9\nlog(size(t))"),
    (".x", "show($.x)"),
    (".x =", "x = $\nx.x = 1\nlog(\"ok\")"),
    ("call", "x = $\nx(1, 2, 3)\nlog(\"ok\")"),
];

/// The scripts about a function, an operator or a statement.
pub struct Subject {
    pub name: &'static str,
    pub scripts: Vec<String>,
}

/// Returns everything with all its arguments.
pub fn subjects() -> Vec<Subject> {
    let functions = FUNCTIONS.iter().map(|(name, counts)| {
        let lists = counts.iter().flat_map(|count| lists(*count));
        let scripts = lists.map(|list| script(&format!("show({name}({}))", list.join(", "))));
        Subject { name, scripts: scripts.collect() }
    });
    let operators = OPERATORS.iter().map(|name| {
        let pairs = lists(2).into_iter();
        let scripts = pairs.map(|pair| script(&format!("show({} {name} {})", pair[0], pair[1])));
        Subject { name, scripts: scripts.collect() }
    });
    let conditions = CONDITIONS.iter().map(|name| {
        let scripts = lists(2).into_iter().map(|pair| {
            let condition = format!("{} {name} {}", pair[0], pair[1]);
            script(&format!("if({condition}) {{ log(\"yes\") }} else {{ log(\"no\") }}"))
        });
        Subject { name, scripts: scripts.collect() }
    });
    let statements = STATEMENTS.iter().map(|(name, text)| {
        let values = lists(1).into_iter();
        Subject {
            name,
            scripts: values.map(|value| script(&text.replace('$', &value[0]))).collect(),
        }
    });
    functions.chain(operators).chain(conditions).chain(statements).collect()
}

fn script(statement: &str) -> String {
    format!("{PRELUDE}{statement}\nlog(\"end\")\n")
}

/// Returns every list of that many arguments. The compiler does not know their values.
fn lists(count: usize) -> Vec<Vec<String>> {
    let values = if count > 2 { &FEW_VALUES[..] } else { &VALUES };
    let mut lists = vec![Vec::new()];
    for _ in 0..count {
        let longer = |list: &Vec<String>, value| [&list[..], &[format!("same({value})")]].concat();
        lists = lists
            .iter()
            .flat_map(|list| values.iter().map(move |value| longer(list, value)))
            .collect();
    }
    lists
}
