//! Modules before and after. That the module of the playground does the same is checked by running it (playground/tests).

use crate::order::neighbors;
use crate::renumber::Functions;
use crate::tighten::tightened;
use wasm_encoder::{
    CodeSection, ConstExpr, CustomSection, ElementSection, Elements, EntityType, ExportKind,
    ExportSection, Function, FunctionSection, ImportSection, InstructionSink, Module, NameMap,
    NameSection, RefType, StartSection, TableSection, TableType, TypeSection, ValType,
};
use wasmparser::{ElementItems, Operator, Parser, Payload};

/// A function without locals.
fn function(write: impl FnOnce(&mut InstructionSink<'_>)) -> Function {
    let mut function = Function::new([]);
    let mut sink = function.instructions();
    write(&mut sink);
    sink.end();
    function
}

/// A module that imports function 0 and defines the others. It exports each by its number and has all of them in a table.
fn module(functions: &[Function]) -> Module {
    let (mut types, mut imports) = (TypeSection::new(), ImportSection::new());
    types.ty().function([], [ValType::I32]);
    types.ty().function([], []);
    imports.import("page", "clock", EntityType::Function(0));
    let (mut numbers, mut exports, mut code) =
        (FunctionSection::new(), ExportSection::new(), CodeSection::new());
    for (number, function) in (1..).zip(functions) {
        numbers.function(0);
        exports.export(&number.to_string(), ExportKind::Func, number);
        code.function(function);
    }
    let size = functions.len() as u64 + 1;
    let (mut tables, mut elements) = (TableSection::new(), ElementSection::new());
    tables.table(TableType {
        element_type: RefType::FUNCREF,
        minimum: size,
        maximum: None,
        table64: false,
        shared: false,
    });
    let all: Vec<u32> = (0..=functions.len() as u32).collect();
    elements.active(None, &ConstExpr::i32_const(0), Elements::Functions(all.into()));
    let mut module = Module::new();
    module.section(&types).section(&imports).section(&numbers).section(&tables);
    module.section(&exports).section(&elements).section(&code);
    module
}

/// The text of each function, with the text of each that it calls in its place. The second list has those of the table.
fn meanings(module: &[u8]) -> (Vec<(String, String)>, Vec<String>) {
    let (mut bodies, mut exports, mut table) = (Vec::new(), Vec::new(), Vec::new());
    for payload in Parser::new(0).parse_all(module) {
        match payload.unwrap() {
            Payload::CodeSectionEntry(body) => bodies.push(body),
            Payload::ExportSection(all) => exports.extend(all.into_iter().map(Result::unwrap)),
            Payload::ElementSection(all) => {
                for element in all {
                    let ElementItems::Functions(functions) = element.unwrap().items else {
                        panic!("the table has functions")
                    };
                    table.extend(functions.into_iter().map(Result::unwrap));
                }
            }
            _ => {}
        }
    }
    fn meaning(number: u32, bodies: &[wasmparser::FunctionBody<'_>]) -> String {
        let Some(defined) = number.checked_sub(1) else { return "clock".to_owned() };
        let operators = bodies[defined as usize].get_operators_reader().unwrap();
        let text = operators.into_iter().map(|operator| match operator.unwrap() {
            Operator::Call { function_index } if function_index != number => {
                format!("[{}]", meaning(function_index, bodies))
            }
            Operator::Call { .. } => "[itself]".to_owned(),
            other => format!("{other:?} "),
        });
        text.collect()
    }
    let named = exports.iter().map(|one| (one.name.to_owned(), meaning(one.index, &bodies)));
    (named.collect(), table.iter().map(|number| meaning(*number, &bodies)).collect())
}

fn count(module: &[u8]) -> usize {
    Functions::of(module).unwrap().bodies.len()
}

#[test]
fn equal_functions_become_one_and_so_do_their_callers() {
    let one = || function(|body| _ = body.i32_const(1));
    let calls = |number| function(move |body| _ = body.call(number).i32_const(2).i32_add());
    let before = module(&[one(), calls(1), calls(3), one(), calls(4), calls(0), calls(7)]).finish();
    let after = tightened(before.clone()).unwrap();
    assert_eq!(meanings(&after), meanings(&before));
    // Functions 1 and 4 are equal, then their callers 2 and 5; 7 calls itself.
    assert_eq!((count(&before), count(&after)), (7, 5));
}

#[test]
fn functions_of_other_types_are_not_equal() {
    let mut types = TypeSection::new();
    types.ty().function([ValType::I32], []);
    types.ty().function([ValType::I64], []);
    let (mut numbers, mut code) = (FunctionSection::new(), CodeSection::new());
    numbers.function(0).function(1);
    code.function(&function(|_| ())).function(&function(|_| ()));
    let mut module = Module::new();
    module.section(&types).section(&numbers).section(&code);
    assert_eq!(count(&tightened(module.finish()).unwrap()), 2);
}

#[test]
fn the_first_function_stays_the_first() {
    let mut types = TypeSection::new();
    types.ty().function([], []);
    let (mut numbers, mut code) = (FunctionSection::new(), CodeSection::new());
    numbers.function(0).function(0).function(0);
    let adds = |number: i32, times| {
        function(move |body| {
            (0..times).for_each(|_| _ = body.i32_const(number).i32_const(number).i32_add().drop())
        })
    };
    code.function(&adds(1, 9)).function(&adds(100, 9)).function(&adds(1, 10));
    let mut module = Module::new();
    module.section(&types).section(&numbers).section(&StartSection { function_index: 1 });
    let before = module.section(&code).clone().finish();
    let after = tightened(before).unwrap();
    let mut starts =
        Parser::new(0).parse_all(&after).filter_map(|payload| match payload.unwrap() {
            Payload::StartSection { func, .. } => Some(func),
            _ => None,
        });
    // Function 2 stands next to function 0, which it resembles.
    assert_eq!(starts.next(), Some(2));
}

#[test]
fn similar_functions_stand_next_to_each_other() {
    let texts = [
        "the robot turns left",
        "a message arrives",
        "the robot turns right",
        "a message is lost",
        "?",
    ];
    let bodies: Vec<&[u8]> = texts.iter().map(|text| text.as_bytes()).collect();
    assert_eq!(neighbors(&bodies), [0, 2, 1, 3, 4]);
    assert_eq!(neighbors(&[]), []);
}

#[test]
fn modules_with_names_and_other_files_are_refused() {
    let mut names = NameSection::new();
    let mut functions = NameMap::new();
    functions.append(1, "one");
    names.functions(&functions);
    let mut named = module(&[function(|body| _ = body.i32_const(1))]);
    let named = named.section(&names).clone().finish();
    assert!(tightened(named).unwrap_err().to_string().contains("strip them"));
    let mut debug = module(&[]);
    let info = CustomSection { name: ".debug_info".into(), data: [1].as_slice().into() };
    assert!(tightened(debug.section(&info).clone().finish()).is_err());
    assert!(tightened(b"no module".to_vec()).is_err());
    let whole = module(&[function(|body| _ = body.call(9))]).finish();
    assert!(tightened(whole).is_err(), "a call of a function that does not exist");
}
