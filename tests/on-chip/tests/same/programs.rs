//! What chips run: the conformance scripts, and programs that the generator makes up.

use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader, MemoryFiles};
use bittybuzz_compiler::profile::NumberProfile;
use bittybuzz_on_chip::Header;
use bittybuzz_tests::{bbz, compiler, files, generator};
use std::ops::Range;
use std::path::Path;

/// Where they are.
pub const CONFORMANCE: &str = "tests/conformance";

/// Instructions of a slice: each program has one of these. With one instruction, the place of every instruction counts.
const BUDGETS: [u16; 6] = [1, 2, 3, 7, 31, 1000];
/// Instructions after which a program is given up.
const INSTRUCTIONS_MAX: u32 = 300_000;

/// An image, and how to run it.
pub struct Program {
    pub name: String,
    pub header: Header,
    pub image: Vec<u8>,
}

impl Program {
    fn new(name: String, number: usize, image: Vec<u8>) -> Program {
        let budget = BUDGETS[number % BUDGETS.len()];
        let length = u16::try_from(image.len()).expect("an image has less than 64 kB");
        // Slices that wait are short ones.
        let slices = INSTRUCTIONS_MAX / u32::from(budget) + 100;
        Program { name, header: Header { length, budget, slices }, image }
    }

    /// Bytes in a batch.
    pub fn size(&self) -> usize {
        Header::LENGTH + self.image.len()
    }
}

/// The names of the conformance scripts, each with its program if it compiles.
pub fn conformance(full: bool) -> Vec<(String, Option<Program>)> {
    let options = Options {
        profile: Some(if full { NumberProfile::Full } else { NumberProfile::Tiny }),
        robots: bittybuzz_robot_files::all_shipped(),
        ..Options::default()
    };
    let loader =
        IncludeLoader { folders: vec![bbz::root().join("lib")], ..IncludeLoader::new(&DiskFiles) };
    let paths = files::with_extension(CONFORMANCE, "bzz");
    let programs = paths.iter().enumerate().map(|(number, path)| {
        let compiled = compile(&bbz::root().join(path), files::read(path), &loader, &options);
        let name = name(path).to_owned();
        (name.clone(), compiled.image.map(|image| Program::new(name, number, image)))
    });
    programs.collect()
}

/// A script's file without folder and ending.
fn name(path: &str) -> &str {
    let stem = Path::new(path).file_stem().and_then(|stem| stem.to_str());
    stem.unwrap_or(path)
}

/// The programs of these seeds.
pub fn generated(full: bool, seeds: Range<u64>) -> Vec<Result<Program, String>> {
    let seeds: Vec<u64> = seeds.collect();
    files::in_parallel(&seeds, |seed| {
        let options = generator::Options { seed: *seed, full, hide_literals: false };
        let text = generator::program(options);
        let compiled = compiler::compile(text, full, &MemoryFiles::default());
        let mut errors = compiled.diagnostics.iter();
        let error = errors.find(|diagnostic| diagnostic.severity() == Severity::Error);
        let image = compiled.image.ok_or_else(|| format!("seed {seed}: {error:?}"))?;
        Ok(Program::new(format!("seed {seed}"), *seed as usize, image))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_compiler::disasm::disassemble;
    use bittybuzz_vm_core::builtin::{self, Feature, Library};
    use bittybuzz_vm_core::opcode;
    use std::collections::BTreeSet;

    #[test]
    fn every_instruction_and_built_in_occurs() {
        let images = [false, true].into_iter().flat_map(|full| generated(full, 0..300));
        let text: String =
            images.flatten().map(|program| disassemble(&program.image, None)).collect();
        // After the instruction at its position, and after a semicolon what it refers to.
        let words: BTreeSet<&str> = text.split_whitespace().collect();
        // The compiler makes no use of it.
        let made = opcode::TABLE.iter().filter(|info| info.name != "DUP");
        let missing: Vec<&str> =
            made.map(|info| info.name).filter(|name| !words.contains(name)).collect();
        assert_eq!(missing, [""; 0]);
        let features = [Feature::Core, Feature::Maths, Feature::Strings];
        let known = builtin::TABLE.iter().filter(|info| features.contains(&info.feature));
        let missing: Vec<String> =
            known.map(full_name).filter(|name| !words.contains(name.as_str())).collect();
        assert_eq!(missing, [""; 0]);
    }

    fn full_name(info: &builtin::BuiltinInfo) -> String {
        match (info.library, info.library.global_name()) {
            (Library::Rng, _) => format!("math.rng.{}", info.name),
            (_, Some(library)) => format!("{library}.{}", info.name),
            (_, None) => info.name.to_owned(),
        }
    }
}
