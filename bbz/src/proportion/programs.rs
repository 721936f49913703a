//! Scripts, and what compilers make of them: images, symbols, Buzz object files, hex and ELF.

use std::path::Path;

use bittybuzz_compiler::bo;
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::disasm::disassemble;
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_isp::program;

use super::{CONSTANT, LIMITS, Limits};
use crate::report::MESSAGES_MAX;

/// A token of one byte becomes nodes of the compiler with their places and types, and a mistake
/// becomes a message: up to 250 bytes. A script has at most 1 MiB.
const SCRIPTS: Limits = Limits { per_byte: 256, constant: CONSTANT };

/// An instruction of one byte becomes a line of text, and a statement that the compiler reads: up to
/// 1130 bytes.
const OBJECTS: Limits = Limits { per_byte: 1200, constant: 2 * CONSTANT };

fn build(text: &str) {
    let files = MemoryFiles::default();
    let loader = IncludeLoader::new(&files);
    let compiled = compile(Path::new("s.bzz"), text.to_owned(), &loader, &Options::default());
    let renderer = Renderer::new(&compiled.sources);
    // Each shows its line, which may be the whole text.
    for one in compiled.diagnostics.iter().take(MESSAGES_MAX) {
        renderer.text(one, ColorChoice::Never);
    }
}

#[test]
fn scripts_of_any_shape() {
    let check = |shape: &str, size, make: &dyn Fn(usize) -> String| {
        SCRIPTS.check(shape, size, make, build);
    };
    check("statements", 500, &|n| "x = 1\n".repeat(n));
    check("globals", 300, &|n| (0..n).map(|i| format!("g{i} = {i}\n")).collect());
    check("functions", 200, &|n| (0..n).map(|i| format!("function f{i}() {{ }}\n")).collect());
    check("calls of nothing", 300, &|n| (0..n).map(|i| format!("u{i}()\n")).collect());
    check("nested blocks", 2000, &|n| "if(1) { ".repeat(n) + &"}".repeat(n));
    check("nested brackets", 5000, &|n| format!("x = {}1{}", "(".repeat(n), ")".repeat(n)));
    check("nested tables", 5000, &|n| format!("x = {}", "{ .a = ".repeat(n)));
    check("operators", 3000, &|n| format!("x = 1{}", " + x".repeat(n)));
    check("minus signs", 5000, &|n| format!("x = {}1", "- ".repeat(n)));
    check("a long name", 50_000, &|n| format!("{} = 1", "x".repeat(n)));
    check("a long string", 50_000, &|n| format!("x = \"{}\"", "a".repeat(n)));
    check("an open string", 50_000, &|n| format!("x = \"{}", "a".repeat(n)));
    check("strings", 500, &|n| (0..n).map(|i| format!("x = \"s{i}\"\n")).collect());
    check("a table", 500, &|n| {
        format!("x = {{ {} }}", (0..n).map(|i| format!(".k{i} = 1, ")).collect::<String>())
    });
    check("bytes that are no tokens", 20_000, &|n| "$".repeat(n));
    check("comments", 20_000, &|n| "# c\n".repeat(n));
    check("else if", 500, &|n| "if(x) y = 1 ".to_owned() + &"else if(x) y = 2 ".repeat(n));
    check("indices", 1000, &|n| format!("x = y{}", ".z".repeat(n)));
    check("local variables", 100, &|n| {
        let each = (0..n).map(|i| format!("var v{i} = {i} "));
        format!("function f() {{ {} }}", each.collect::<String>())
    });
    check("captured variables", 100, &|n| {
        let variables = (0..n).map(|i| format!("var v{i} = {i} ")).collect::<String>();
        let uses = (0..n).map(|i| format!("x = v{i} ")).collect::<String>();
        format!("function f() {{ {variables} g = function() {{ {uses} }} }}")
    });
    check("parameters", 200, &|n| {
        let names: Vec<String> = (0..n).map(|i| format!("p{i}")).collect();
        format!("function f({}) {{ }}\nf({})", names.join(", "), "1, ".repeat(n) + "1")
    });
}

#[test]
fn images_of_any_shape() {
    let read = |bytes: &[u8]| drop(disassemble(bytes, None));
    LIMITS.check("zeros", 10_000, |n| vec![0; n], read);
    LIMITS.check("ones", 10_000, |n| vec![0xff; n], read);
    let files = MemoryFiles::default();
    let text = "function step() { log(1) }\n".to_owned();
    let loader = IncludeLoader::new(&files);
    let image = compile(Path::new("s.bzz"), text, &loader, &Options::default()).image.unwrap();
    for byte in [0, 1, 0x40, 0x80, 0xff] {
        let long = |n| [image.as_slice(), &vec![byte; n]].concat();
        LIMITS.check("bytes after an image", 5000, long, read);
    }
}

#[test]
fn symbols_of_any_shape() {
    let files = MemoryFiles::default();
    let text = "x = 1\nfunction f(a) { return a }\nfunction step() { log(f(x)) }\n".to_owned();
    let loader = IncludeLoader::new(&files);
    let compiled = compile(Path::new("s.bzz"), text, &loader, &Options::default());
    let symbols = compiled.symbols.unwrap();
    let read = |text: &str| drop(Symbols::from_json(text).map(|symbols| symbols.to_json()));
    let with = |change: &dyn Fn(&mut Symbols)| {
        let mut symbols = symbols.clone();
        change(&mut symbols);
        symbols.to_json()
    };
    let strings = |n| with(&|symbols| symbols.strings = vec!["a".to_owned(); n]);
    LIMITS.check("strings", 5000, strings, read);
    let globals = |n| with(&|symbols| symbols.globals = vec!["a".to_owned(); n]);
    LIMITS.check("globals", 5000, globals, read);
    LIMITS.check("nested lists", 20_000, |n| "[".repeat(n), read);
    LIMITS.check("a long string", 50_000, |n| format!("{{\"a\":\"{}", "x".repeat(n)), read);
}

#[test]
fn object_files_of_any_shape() {
    const MORSE: &[u8] = include_bytes!("../../../tests/fuzz-bodies/seeds/morse.bo");
    let read = |bytes: &[u8]| {
        let _ = bo::import(Path::new("s.bo"), bytes, None, &Options::default());
        let _ = bo::disassemble(bytes);
    };
    OBJECTS.check("zeros", 5000, |n| vec![0; n], read);
    OBJECTS.check("a count of strings", 5000, |n| [vec![0xff, 0xff], vec![b'a'; n]].concat(), read);
    let strings = |n: usize| {
        let count = (n as u16).to_le_bytes();
        [count.to_vec(), b"a\0".repeat(n)].concat()
    };
    OBJECTS.check("strings", 5000, strings, read);
    for code in [0, 1, 5, 20] {
        let long = |n| [MORSE, &vec![code; n]].concat();
        OBJECTS.check("code after a script", 3000, long, read);
    }
}

/// The `.bdb` files next to object files.
#[test]
fn debug_files_of_any_shape() {
    // The global assignment `x = 1`, with an instruction at offset 5.
    const GLOBAL: &[u8] = &[
        0x01, 0x00, 0x78, 0x00, 0x00, 0x25, 0x00, 0x00, 0x00, 0x00, 0x24, 0x01, 0x00, 0x00, 0x00,
        0x1d, 0x01,
    ];
    let record = |offset: u32, line: u64, file: &str| {
        let mut bytes = offset.to_le_bytes().to_vec();
        bytes.extend(line.to_le_bytes());
        bytes.extend(1u64.to_le_bytes());
        bytes.extend((file.len() as u16).to_le_bytes());
        bytes.extend(file.bytes());
        bytes
    };
    let read = |bytes: &[u8]| {
        drop(bo::import(Path::new("s.bo"), GLOBAL, Some(bytes), &Options::default()));
    };
    LIMITS.check("records", 2000, |n| record(5, 1, "s.bzz").repeat(n), read);
    let files = |n| (0..n).flat_map(|i| record(5, 1, &format!("{i}.bzz"))).collect::<Vec<u8>>();
    LIMITS.check("files", 2000, files, read);
    LIMITS.check(
        "lines",
        2000,
        |n| (0..n as u64).flat_map(|i| record(5, i, "")).collect::<Vec<u8>>(),
        read,
    );
    LIMITS.check("long names", 10, |n| record(5, 1, &"x".repeat(60_000)).repeat(n), read);
    LIMITS.check("zeros", 10_000, |n| vec![0; n], read);
}

#[test]
fn programs_of_any_shape() {
    let read = |bytes: &[u8]| drop(program::read(bytes));
    let line = |n| b":0100000000FF\n".repeat(n);
    LIMITS.check("lines at one place", 2000, line, read);
    let lines = |n: usize| {
        let record = |at: usize| {
            let at = at % 0x1_0000;
            let sum = (1 + (at >> 8) + (at & 0xff)) % 256;
            format!(":01{at:04X}0000{:02X}\n", (256 - sum) % 256).into_bytes()
        };
        (0..n).flat_map(record).collect::<Vec<u8>>()
    };
    LIMITS.check("lines of one byte", 2000, lines, read);
    LIMITS.check("a long line", 20_000, |n| [b":".as_slice(), &vec![b'0'; n]].concat(), read);
    let elf = |n| [b"\x7fELF\x01\x01\x01".as_slice(), &vec![0xff; n]].concat();
    LIMITS.check("ELF", 20_000, elf, read);
}
