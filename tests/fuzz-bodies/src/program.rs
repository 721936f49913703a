//! Programs made of instructions. Whatever bytes decide, the verifier's rules are kept, so that every input gets to
//! the machine. Most instructions also find values of the kind that they are for, so that programs run for a while.

mod kind;
mod writer;

use bittybuzz_compiler::asm::Shape;
use bittybuzz_compiler::image::{EntryPoint, ImageContent, LibraryRow};
use bittybuzz_compiler::strings::StringTable;
use bittybuzz_vm_core::builtin::{self, Feature, Library};
use writer::Writer;

use crate::choices::Choices;

const STRINGS: [&str; 6] = ["", "a", "f", "key", "text of more than one cell", "zebra"];
/// Name hashes of robot functions; the host of these tests treats them in four ways.
const IMPORTS: [u16; 5] = [0, 1, 2, 3, 64];

/// What all functions know of the program.
struct Program {
    full: bool,
    features: u8,
    shapes: Vec<Shape>,
    globals: usize,
    strings: usize,
}

/// The image of the program that the bytes decide on.
pub fn image(choices: &mut Choices<'_>) -> Vec<u8> {
    let form = choices.byte();
    let full = form & 1 != 0;
    let script_hash = u32::from_le_bytes([(); 4].map(|()| choices.byte()));
    let strings = StringTable::new(STRINGS);
    let features = Feature::Maths as u8 | if full { Feature::Strings as u8 } else { 0 };
    let mut shapes = vec![Shape::default()];
    for _ in 0..form >> 3 & 3 {
        let shape = choices.byte();
        shapes.push(Shape {
            parameters: usize::from(shape & 3),
            captures: shape & 4 != 0,
            uses_self: shape & 8 != 0,
        });
    }
    let program = Program {
        full,
        features,
        globals: 3 + usize::from(form >> 5),
        strings: usize::from(builtin::string::COUNT) + strings.script().len(),
        shapes,
    };
    let entries = [(); 4].map(|()| program.entry(choices.byte()).to_count());
    let libraries = (0..choices.below(6)).map(|_| program.library_row(choices)).collect();
    let functions = program.shapes.iter().enumerate().map(|(number, shape)| {
        let writer = Writer::new(&program, *shape, choices);
        if number == 0 { writer.global_code() } else { writer.some_function() }
    });
    let parts = ImageContent {
        full,
        features,
        script_hash,
        entries,
        globals: program.globals,
        stigmergies: None,
        imports: IMPORTS.to_vec(),
        order: form & 2 != 0,
        text: form & 4 != 0,
        libraries,
        classes: Vec::new(),
        functions: functions.collect(),
        strings,
    };
    parts.write().expect("a small program fits an image").bytes
}

impl Program {
    fn entry(&self, choice: u8) -> EntryPoint {
        let number = usize::from(choice >> 2);
        match choice & 3 {
            0 => EntryPoint::None,
            // Mostly one that holds a function.
            1 if number < 56 => EntryPoint::Global(2),
            1 => EntryPoint::Global((number % self.globals) as u16),
            _ => match number % self.shapes.len() {
                function if self.shapes[function].captures => EntryPoint::None,
                function => EntryPoint::Function(function as u16),
            },
        }
    }

    fn library_row(&self, choices: &mut Choices<'_>) -> LibraryRow {
        LibraryRow {
            library: choices.below(Library::ALL.len()) as u8,
            string: choices.below(self.strings) as u16,
            builtin: self.builtin(choices).number,
        }
    }

    /// A built-in that this build of the machine has.
    fn builtin(&self, choices: &mut Choices<'_>) -> &'static builtin::BuiltinInfo {
        let chosen = choices.below(builtin::TABLE.len());
        let mut from_there = builtin::TABLE[chosen..].iter().chain(builtin::TABLE);
        let there = from_there.find(|info| info.feature as u8 & !self.features == 0);
        there.expect("the core is always there")
    }
}
