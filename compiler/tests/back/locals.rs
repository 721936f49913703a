//! Locals among the symbols: the names that are live at each instruction are those of the source's scopes.

use bittybuzz_compiler::asm::HEADER_BYTES;
use bittybuzz_compiler::symbols::{LocalPlace, Symbols};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::Image;
use bittybuzz_vm_core::opcode::{self, Decoded};

use crate::back::machine::{FULL, TINY, image};

/// Begins the expectation of a line: the sets of live names at its instructions, in the order of the code.
const EXPECTED: &str = "#:";

/// Offsets of all instructions from the start of the code.
fn instructions(image: &[u8], profile: NumberProfile) -> Vec<usize> {
    let header = Image::new(image).header().expect("is an image");
    let (code, functions) = (usize::from(header.code_at()), usize::from(header.functions_at()));
    let word_bytes = if profile == FULL { 4 } else { 2 };
    let starts: Vec<usize> = (0..usize::from(header.functions()))
        .map(|number| functions + 2 * number)
        .map(|at| usize::from(u16::from_le_bytes([image[at], image[at + 1]])))
        .collect();
    let ends = starts.iter().skip(1).copied().chain([image.len() - code]);
    let mut found = Vec::new();
    for (start, end) in starts.iter().zip(ends) {
        let mut at = start + HEADER_BYTES;
        while at < end {
            found.push(at);
            let byte = |offset| image.get(code + at + offset).copied().unwrap_or(0);
            let Decoded { opcode, length, .. } = opcode::decode([byte(0), byte(1), byte(2)]);
            let trailer = opcode::info(opcode).expect("is an opcode").trailer;
            at += usize::from(length) + trailer.length(word_bytes);
        }
    }
    found
}

/// The live names at an instruction, sorted.
fn names(symbols: &Symbols, at: usize) -> String {
    let mut names: Vec<&str> =
        symbols.locals(at as u32).iter().map(|local| local.name.as_str()).collect();
    names.sort_unstable();
    names.join(" ")
}

/// Compares the live names at each instruction of a script with its lines.
fn check(script: &str) {
    for profile in [TINY, FULL] {
        let (image, symbols) = image(script, profile);
        let mut found: Vec<Vec<String>> = vec![Vec::new(); script.lines().count()];
        for at in instructions(&image, profile) {
            let place = symbols.position(at as u32).expect("is known");
            let sets = &mut found[place.line as usize - 1];
            let live = names(&symbols, at);
            if sets.last() != Some(&live) {
                sets.push(live);
            }
        }
        for (number, (line, found)) in script.lines().zip(found).enumerate() {
            let expected: Vec<String> = match line.split_once(EXPECTED) {
                Some((_, sets)) => sets.split('|').map(|set| set.trim().to_owned()).collect(),
                None => Vec::new(),
            };
            assert_eq!(found, expected, "line {} of\n{script}", number + 1);
        }
    }
}

#[test]
fn blocks_end_their_variables() {
    check(
        "function f(a, b) {
           var x = a      #: a b
           if(b) {        #: a b x
             var y = x    #: a b x
             log(y)       #: a b x y
           } else {       #: a b x y | a b x
             var z = b    #: a b x
             var y = z    #: a b x z
             log(y)       #: a b x y z
           }              #: a b x y z
           log(x)         #: a b x
         }                #: a b x
         f(1, 2)          #:
         if(f) {
           var inside = 1 #:
           log(inside)    #: inside
         }                #: inside |",
    );
}

#[test]
fn loops_begin_and_end_their_variables_in_each_round() {
    check(
        "function f(n) {
           var i = 0                   #: n
           while(i < n) {              #: i n
             var square = i * i        #: i n
             i = i + square + 1        #: i n square
           }                           #: i n square
           for(i = 0, i < n, i = i + 1) { #: i n
             var twice = i + i         #: i n
             log(twice)                #: i n twice
           }                           #: i n twice
           return i                    #: i n
         }
         log(f(3))                     #:",
    );
}

#[test]
fn code_after_a_return_has_the_variables_of_its_block() {
    check(
        "function f(p) {
           if(p) {         #: p
             var q = p     #: p
             return q      #: p q
           }
           var empty       #: p
           var r = 1       #: empty p
           return r        #: empty p r
         }
         log(f(0))         #:",
    );
}

#[test]
fn lambdas_know_what_they_capture() {
    check(
        "function make(n) {
           var k = n            #: n
           var other = k        #: k n
           return function(m) { #: k n other
             var sum = k + m    #: k m
             return sum         #: k m sum
           }
         }
         t = {}                 #:
         t.f = function(a) {    #:
           log(self, a)         #: a self
         }                      #: a self
         t.f(make(1))           #:
         foreach(t, function(key, value) { #:
           var both = value     #: key value
           log(key, both)       #: both key value
         })                     #: | both key value",
    );
}

#[test]
fn a_captured_value_that_is_assigned_moves_to_the_frame() {
    let script = "function make() {
           var c = 1
           return function() {
             c = c + 1
             return c
           }
         }
         log(make())";
    let (image, symbols) = image(script, TINY);
    let all = instructions(&image, TINY);
    let inner = symbols.functions.last().expect("the lambda").offset as usize;
    let places: Vec<LocalPlace> = all
        .iter()
        .filter(|at| **at > inner)
        .flat_map(|at| symbols.locals(*at as u32).into_iter().map(|local| local.place))
        .collect();
    // The closure is in slot 1, so the copy is in slot 2.
    assert_eq!(places[0], LocalPlace::Capture(0));
    assert!(places.len() > 2 && places[1..].iter().all(|place| *place == LocalPlace::Frame(2)));
}

#[test]
fn places_are_those_of_the_frame() {
    let script = "function f(a, b) {
           var x = a
           var y = b
           return x + y
         }
         log(f(1, 2))";
    let (_, symbols) = image(script, FULL);
    let f = symbols.functions.iter().find(|function| function.name == "f").expect("is there");
    let places: Vec<(&str, LocalPlace)> =
        f.locals.iter().map(|local| (local.name.as_str(), local.place)).collect();
    let frame = LocalPlace::Frame;
    // Parameters are below the record, variables above.
    assert_eq!(places, [("a", frame(-2)), ("b", frame(-1)), ("x", frame(1)), ("y", frame(2))]);
}
