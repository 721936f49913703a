//! Typical mistakes of people who come from other languages: each gets exactly the messages that name it, with the right
//! cure, and none that only follows from it.

use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_robot_files::all_shipped;
use std::path::Path;

/// A script, and for each message its code, the text that it marks, and a part of its help.
type Case = (&'static str, &'static [(&'static str, &'static str, &'static str)]);

const CASES: &[Case] = &[
    (
        "function step() {\n  if(neighbors.count() > 2 {\n    log(1)\n  }\n}\n",
        &[("E0202", "", "write `)` before the `{`")],
    ),
    (
        "t = {.a=1}\nforeach(t, function(k, v): log(k, v))\n",
        &[("E0101", ":", "blocks stand in braces")],
    ),
    ("t = {\"a\": 1, \"b\": 2}\nlog(t.a)\n", &[("E0220", "\"a\"", "write `.a = value`")]),
    ("name = \"robot \" + id\nlog(name)\n", &[("W0301", "\"robot \" + id", "string.concat")]),
    ("log(\"robot \" + id)\n", &[("W0301", "\"robot \" + id", "separate them by commas")]),
    ("log(f\"robot {id}\")\n", &[("E0201", "\"robot {id}\"", "`log` joins its arguments")]),
    (
        "x = 1\nif(x == 1) {\n  log(\"a\")\nelse {\n  log(\"b\")\n}\n",
        &[("E0202", "else", "write `} else`")],
    ),
    (
        "function f(x) {\n  if(x) {\n    log(1)\n  else {\n    log(2)\n  }\n}\nf(1)\n",
        &[("E0202", "else", "write `} else`")],
    ),
    // Here two statements stand after an `if` without braces.
    (
        "function f(x) {\n  if(x) log(1)\n  log(2)\n  else log(3)\n}\nf(1)\n",
        &[("E0222", "else", "only one statement belongs to an `if`")],
    ),
    ("x = 1\ny = x > 0 ? 1 : 2\nlog(y)\n", &[("E0101", "?", "use `if(condition)")]),
    ("x = 0\nif(!x) log(\"zero\")\n", &[("W0108", "!x", "the word `not`")]),
    ("x = 0\nif(x == 0 and !x) log(\"zero\")\n", &[("W0108", "!x", "the word `not`")]),
    ("x = 0\nwhile(!x) { x = 1 }\n", &[("W0108", "!x", "the word `not`")]),
    ("on = 0\nfunction step() { on = !on log(on) }\n", &[("W0108", "!on", "the word `not`")]),
    ("x = 5 mod 2\nlog(x)\n", &[("E0106", "mod", "is `%`")]),
    ("x = 5\nif(x mod 2 == 1) log(x)\n", &[("E0106", "mod", "is `%`")]),
    (
        "t = {}\nt.f = function(a) { return a }\nlog(t:f(1))\n",
        &[("E0101", ":", "with a dot: `t.f(1)`")],
    ),
    (
        "t = {.x = 1}\nt.get = function() { return x }\nlog(t.get())\n",
        &[("W0201", "x", "did you mean `self.x`?")],
    ),
    (
        "t = {.x = 1}\nt.get = function(self) { return self.x }\nlog(t.get())\n",
        &[("E0408", "self", "remove it")],
    ),
    ("t = {.a = 1}\nlog(\"n \", #t)\n", &[("E0202", "", "`#` begins a comment")]),
    ("led(#FF0000)\n", &[("E0202", "", "`#` begins a comment")]),
    ("t = {.a = 1}\nlog(t.size())\n", &[("W0208", "size", "`size(t)`")]),
    ("t = {.a = 1}\nlog(t.length)\n", &[("W0208", "length", "`size(t)`")]),
    ("t = {}\nt.append(3)\nlog(size(t))\n", &[("W0208", "append", "`t[size(t)] = value`")]),
    ("t = {}\nt.pos.x = 3\n", &[("W0208", "pos", "")]),
    ("s = \"hello\"\nlog(s[0])\n", &[("W0301", "s[0]", "string.sub")]),
    (
        "function twice(x) {\n  x * 2\n}\nlog(twice(3))\n",
        &[("E0214", "x * 2", "write `return` before it")],
    ),
    (
        "function twice(x) {\n  return x * 2\n}\ny = twice\nlog(y + 1)\n",
        &[("W0301", "y + 1", "call the function")],
    ),
    (
        "Count = 0\nfunction step() {\n  count = count + 1\n  log(Count)\n}\n",
        &[("W0219", "count", "did you mean `Count`?")],
    ),
    (
        "function step() {\n  neighbors.broadcast(3)\n}\n",
        &[("E0403", "neighbors.broadcast(3)", "topic, value")],
    ),
    (
        "function got(t, v, r) { log(v) }\nfunction init() {\n  neighbors.listen(\"a\", got(\"a\", 1, 2))\n  neighbors.broadcast(\"a\", 1)\n}\n",
        &[("W0306", "got(\"a\", 1, 2)", "pass the function itself")],
    ),
    (
        "v = stigmergy.create(1)\nfunction step() {\n  v.set(\"a\", 1)\n  log(v.fetch(\"a\"))\n}\n",
        &[("W0208", "set", "did you mean `put`?"), ("W0208", "fetch", "did you mean `get`?")],
    ),
    (
        "v = stigmergy.create(1)\nfunction step() {\n  v[id] = 3\n  log(v[id])\n}\n",
        &[("W0208", "v[id]", "`get(key)`"), ("W0208", "v[id]", "`put(key, value)`")],
    ),
    (
        "v = stigmergy.create(1)\nv.put(id)\nlog(v.get(), v.size(1))\n",
        &[
            ("W0205", "v.put(id)", "v.put(key, value)"),
            ("W0205", "v.get()", "v.get(key)"),
            ("W0206", "v.size(1)", "v.size()"),
        ],
    ),
    ("s = swarm.create(1)\ns.select()\n", &[("W0205", "s.select()", "s.select(c)")]),
    (
        "function init() {\n  neighbors.listen(\"color\", function(t, v, r) { log(v) })\n}\n\
         function step() {\n  neighbors.broadcast(\"colour\", 1)\n}\n",
        &[("W0229", "\"color\"", "did you mean `\"colour\"`?")],
    ),
    (
        "function step() {\n  neighbors.listen(\"alarm\", function(t, v, r) { log(v) })\n}\n",
        &[("W0229", "\"alarm\"", "`neighbors.broadcast(\"alarm\", value)`")],
    ),
    // A topic that is computed, a function that sends any topic, and a library alone.
    (
        "function init() {\n  neighbors.listen(\"a\", function(t, v, r) { log(v) })\n}\n\
         function step() {\n  neighbors.broadcast(string.tostring(id), 1)\n}\n",
        &[],
    ),
    (
        "function init() {\n  neighbors.listen(\"a\", function(t, v, r) { log(v) })\n}\n\
         function step() {\n  var send = neighbors.broadcast\n  send(\"a\", 1)\n}\n",
        &[],
    ),
    (
        "function listen() {\n  neighbors.listen(\"a\", function(t, v, r) { log(v) })\n}\nlisten()\n",
        &[],
    ),
    ("log(neighbors[0].distance)\n", &[("W0208", "neighbors[0]", "`neighbors.get(id)`")]),
    ("log(neighbors)\nneighbors.cuont()\n", &[("E0410", "cuont", "did you mean")]),
    (
        "neighbors.foreach(function(rid, data) { log(data.angle, data.range) })\n",
        &[("W0222", "angle", "`azimuth`"), ("W0222", "range", "`distance`")],
    ),
    // The range of a Zooid's wheels is in that of no motor, and 300 is in that of no robot.
    ("set_motor(300, 0)\n", &[("W0315", "300", "duty")]),
    ("set_motor(0, -101)\n", &[("W0315", "-101", "duty")]),
    ("set_motor(-100, 100)\nset_motor(255, 0)\n", &[]),
    ("set_motor(0, 250 + 50)\n", &[("W0315", "250 + 50", "duty")]),
    ("v = stigmergy.create(1)\nv[\"a\"] = 3\n", &[("W0208", "\"a\"", "`put(key, value)`")]),
    ("s = swarm.create(1)\nif(s.in) log(\"in\")\n", &[("W0223", "s.in", "did you mean `in()`?")]),
    (
        "function step() {\n  var i\n  for(i = 0, i < neighbors.count(), i = i + 1) {\n    log(neighbors.get(i).distance)\n  }\n}\n",
        &[("W0312", "i", "neighbors.foreach")],
    ),
    (
        "function step() {\n  var done = 0\n  while(not done) {\n    log(\"waiting\")\n  }\n}\n",
        &[("W0313", "not done", "`if` once per step")],
    ),
    (
        "function step() {\n  while(neighbors.count() == 0) delay(100)\n}\n",
        &[("W0313", "neighbors.count() == 0", "`if`")],
    ),
    ("while(1) {}\n", &[("W0313", "1", "")]),
    (
        "function count() { return 3 }\ncount = 0\nfunction step() {\n  count = count + 1\n}\n",
        &[("W0204", "count", "another name")],
    ),
    (
        "function step() { log(1) }\nstep = function() { log(2) }\n",
        &[("W0204", "step", "another name")],
    ),
    ("x = 10 / 4\nif(x == 2.5) log(\"half\")\n", &[("W0305", "x == 2.5", "`10.0 / 4`")]),
    (
        "log(math.sin(90), math.cos(180.0))\n",
        &[("W0314", "90", "1.5708"), ("W0314", "180.0", "3.1416")],
    ),
    (
        "t = map({.a=1}, (k, v) => v * 2)\nlog(t.a)\n",
        &[("E0106", "=>", "`function(x) { return ... }`")],
    ),
    (
        "x = 1\nswitch(x) {\n  case 1: log(\"one\")\n  break\n}\n",
        &[("E0217", "switch", "`else if`")],
    ),
    (
        "import \"vec2.bzz\"\nlog(math.vec2.length(math.vec2.new(1,2)))\n",
        &[("E0217", "import", "`include")],
    ),
    (
        "function step() {\n  log(\"a\" \"b\")\n  neighbors.broadcast(\"k\" 3)\n}\n",
        &[("E0201", "\"b\"", "write `,`"), ("E0201", "3", "write `,`")],
    ),
    ("x = 5 − 3\nlog(x)\n", &[("E0101", "−", "write `-`")]),
    ("x = 5\nif(x ≥ 3) log(x)\n", &[("E0101", "≥", "write `>=`")]),
    ("i = 0\ndo {\n  i = i + 1\n} while(i < 3)\nlog(i)\n", &[("E0217", "do", "`while(condition)")]),
];

fn compiled(script: &str) -> Compiled {
    let files = MemoryFiles::default();
    let options = Options { robots: all_shipped(), ..Options::default() };
    let loader = IncludeLoader::new(&files);
    compile(Path::new("s.bzz"), script.to_owned(), &loader, &options)
}

fn shown(script: &str, found: &Diagnostic) -> String {
    let marked = script.get(found.span.start as usize..found.span.end as usize).unwrap_or("?");
    format!("{} `{marked}` {:?}", found.code.text(), found.help)
}

#[test]
fn each_mistake_gets_its_cure_and_nothing_else() {
    let mut wrong = Vec::new();
    for (script, expected) in CASES {
        let found = compiled(script).diagnostics;
        let is_right = found.len() == expected.len()
            && found.iter().zip(*expected).all(|(found, (code, marked, help))| {
                let text = &script[found.span.start as usize..found.span.end as usize];
                found.code.text() == *code
                    && text == *marked
                    && found.help.as_deref().unwrap_or_default().contains(help)
            });
        if !is_right {
            let found: Vec<String> = found.iter().map(|found| shown(script, found)).collect();
            wrong.push(format!("{script}{}", found.join("\n")));
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n\n{}", wrong.len(), wrong.join("\n\n"));
}

/// Scripts that look like these mistakes and are right.
#[test]
fn right_scripts_get_no_message() {
    for script in [
        "x = 6\ny = !x & 255\nlog(y, !x)\n",
        "mask = 3\nfunction step() { mask = !mask log(mask) }\n",
        "t = {.n = 1}\nt.size = function() { return self.n }\nlog(t.size())\n",
        "function add(t, k, v) { t[k] = v }\nt = {}\nadd(t, \"length\", 3)\nlog(t.length)\n",
        "t = {}\nfunction f(x) { x.length = 1 }\nf(t)\nlog(t.length)\n",
        "t = {}\nt[string.concat(\"len\", \"gth\")] = 1\nlog(t.length)\n",
        "s = \"a\"\ns = {.x = 1}\nlog(s.x)\n",
        "function a() { step = b }\nfunction b() { step = a }\nfunction step() { a() }\n",
        "i = 0\nwhile(i < 3) i = i + 1\n",
        "function f() { while(1) { if(rand() < 5) return } }\nf()\n",
        "n = 0\nfunction more() { n = n + 1 }\nwhile(n < 3) more()\n",
        "t = {.n = 0}\nwhile(t.n < 3) { t.n = t.n + 1 }\n",
        "function step() { var i = 0 while(i < neighbors.count()) { i = i + 1 } log(i) }\n",
        "x = 10.0 / 4\nif(x == 2.5) log(\"half\")\n",
        "log(math.sin(6.28), math.cos(-3))\n",
        "s = swarm.create(1)\nif(s.in()) log(\"in\")\n",
        "function make() { return function(t, v, r) { log(t, v, r) } }\nneighbors.listen(\"a\", make())\n",
        "mod = 3\nlog(mod)\n",
        "x = nil\nfunction step() { if(x == nil) x = \"a\" log(x) }\n",
    ] {
        let found = compiled(script).diagnostics;
        let found: Vec<String> = found.iter().map(|found| shown(script, found)).collect();
        assert!(found.is_empty(), "{script}{}", found.join("\n"));
    }
}
