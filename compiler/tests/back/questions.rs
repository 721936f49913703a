//! Questions at the end of a script's image.

use std::hash::Hasher;

use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::question::{ExtendedImage, QuestionError, extend};
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_testkit::{Program, Recorder};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry, Image, Outcome, Sizes, Vm};

use super::machine::{FULL, TINY, build};

const SCRIPT: &str = "n = 3 t = {.a = 1} name = \"b\" f = nil\n\
    s = stigmergy.create(1)\n\
    function twice(x) { return 2 * x }\n\
    function unused(x) { return function(y) { return x + y } }\n\
    function init() { s.put(\"k\", twice(n)) neighbors.broadcast(\"m\", t.a) f = twice }\n\
    function step() { n = n + 1 log(name, n) }\n";

fn extended(
    compiled: &Compiled,
    profile: NumberProfile,
    questions: &[&str],
) -> Result<ExtendedImage, QuestionError> {
    let image = compiled.image.as_deref().unwrap();
    extend(&compiled.sources, image, &Program::options(profile), questions)
}

/// Numbers of strings, globals and functions remain, and every image passes the verifier.
#[test]
fn questions_extend_the_image_of_the_script() {
    let questions =
        ["\"aa\"", "unused(1)", "led(3)", "function(x) { return t.zz }", "s.get(\"q\")"];
    for profile in [TINY, FULL] {
        let compiled = build(SCRIPT, profile);
        let mut before = compiled.symbols.clone().unwrap();
        for count in 1..=questions.len() {
            let found = extended(&compiled, profile, &questions[..count]).unwrap();
            load(&found.image, profile);
            let now = found.symbols;
            assert_eq!(now.globals, before.globals);
            assert!(now.strings.starts_with(&before.strings));
            assert!(now.imports.starts_with(&before.imports));
            let names = |symbols: &bittybuzz_compiler::symbols::Symbols| -> Vec<(String, u32)> {
                let functions = symbols.functions.iter();
                functions.map(|function| (function.name.clone(), function.offset)).collect()
            };
            assert!(
                names(&now).starts_with(&names(&before))
                    && now.functions.len() > before.functions.len()
            );
            before = now;
        }
        let added = ["aa", "zz", "get", "q"];
        assert!(before.strings.ends_with(&added.map(str::to_owned)), "{:?}", before.strings);
    }
}

#[test]
fn a_script_of_another_text_is_refused() {
    let [one, other] = [SCRIPT, "n = 4"].map(|script| build(script, FULL));
    let options = Program::options(FULL);
    let of =
        |sources: &SourceMap, image: &[u8]| extend(sources, image, &options, &["1"]).unwrap_err();
    assert_eq!(of(&one.sources, other.image.as_ref().unwrap()), QuestionError::OtherImage);
    assert_eq!(of(&SourceMap::default(), one.image.as_ref().unwrap()), QuestionError::NoSource);
}

/// Any text is a question or a mistake with a sentence.
#[test]
fn no_text_is_a_defect() {
    const WORDS: [&str; 40] = [
        "n",
        "t",
        "s",
        "f",
        "name",
        "twice",
        "unused",
        "led",
        "self",
        "id",
        "nil",
        "3",
        "-1.5",
        "\"k\"",
        "\"new\"",
        "(",
        ")",
        "{",
        "}",
        "[",
        "]",
        ".",
        ",",
        "=",
        "==",
        "+",
        "*",
        "not ",
        "and ",
        "or ",
        "function",
        "return ",
        "if",
        "while",
        "for",
        "var ",
        ".a",
        "\n",
        "neighbors",
        "math",
    ];
    let mut state = 11_u32;
    let mut below = |limit: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % limit
    };
    for profile in [TINY, FULL] {
        let compiled = build(SCRIPT, profile);
        let mut valid = 0;
        for _ in 0..4000 {
            let count = 1 + below(7);
            let words = (0..count).map(|_| WORDS[below(40) as usize]);
            let question: String = words.collect();
            match extended(&compiled, profile, &["n", &question]) {
                Ok(found) => {
                    load(&found.image, profile);
                    valid += 1;
                }
                Err(error) => {
                    let text = error.to_string();
                    let is_wrong =
                        matches!(error, QuestionError::OtherImage | QuestionError::NoSource);
                    assert!(!is_wrong && text.len() > 20, "{question}: {text}");
                }
            }
        }
        assert!(valid > 100, "{valid} valid questions");
    }
}

#[derive(Default)]
struct Sum(u64);

impl Hasher for Sum {
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

fn digest<P: Profile>(vm: &Vm<P, &[u8], 2000>) -> u64 {
    let mut sum = Sum::default();
    vm.hash_state(&mut sum);
    sum.finish()
}

fn loaded<P: Profile>(image: &[u8]) -> Box<Vm<P, &[u8], 2000>> {
    let mut vm = Box::new(Vm::new());
    vm.set_network_capacity(Sizes { neighbors: 2, bearings: true, entries: 4, swarms: 1 });
    vm.load(Image::new(image), |_| true).unwrap();
    vm
}

/// Loads an image, which the verifier must accept.
fn load(image: &[u8], profile: NumberProfile) {
    match profile {
        NumberProfile::Tiny => drop(loaded::<Tiny>(image)),
        NumberProfile::Full => drop(loaded::<Full>(image)),
    }
}

fn ask<P: Profile>(profile: NumberProfile) {
    let compiled = build(SCRIPT, profile);
    let extended = |questions: &[&str]| extended(&compiled, profile, questions).unwrap();
    let mut host = Recorder::with_symbols(compiled.symbols.clone().unwrap());
    let mut vm = loaded::<P>(compiled.image.as_ref().unwrap());
    for entry in [Entry::Global, Entry::Init, Entry::Step] {
        assert!(vm.begin(entry));
        assert_eq!(vm.run(&mut host, 10_000), Outcome::Done);
    }
    let before = digest(&vm);
    let two = extended(&["n + 1", "name = \"c\""]);
    let lambda = extended(&["n + 1", "name = \"c\"", "f = function() { return name }"]);
    let other = build("n = 4 m = 5 function step() { n = m }", profile).image.unwrap();
    // An image of another script, and the script itself, extend nothing.
    for image in [&other, compiled.image.as_ref().unwrap()] {
        assert_eq!(vm.call_added(&loaded::<P>(image), &mut host, 1000), None);
    }
    let first = extended(&["n + 1"]);
    let outcome = vm.call_added(&loaded::<P>(&first.image), &mut host, 1000);
    assert_eq!((outcome, digest(&vm)), (Some(Outcome::Done), before));
    assert_eq!(host.lines().last().unwrap(), "5");
    // A question that runs out of instructions leaves no trace.
    let outcome = vm.call_added(&loaded::<P>(&first.image), &mut host, 1);
    assert_eq!((outcome, digest(&vm)), (Some(Outcome::Pending), before));
    // Of several questions that an image adds, the machine calls the first.
    for image in [&two.image, &lambda.image] {
        let outcome = vm.call_added(&loaded::<P>(image), &mut host, 1000);
        assert_eq!(outcome, Some(Outcome::Done));
    }
    // The machine has kept the last program, and goes on.
    assert!(vm.begin(Entry::Step));
    assert_eq!(vm.run(&mut host, 10_000), Outcome::Done);
    assert_eq!(vm.call_added(&loaded::<P>(&lambda.image), &mut host, 1000), None);
    // No question interrupts a step.
    assert!(vm.begin(Entry::Step));
    assert_eq!(vm.call_added(&loaded::<P>(&first.image), &mut host, 1000), None);
}

#[test]
fn machines_keep_their_state() {
    ask::<Tiny>(TINY);
    ask::<Full>(FULL);
}
