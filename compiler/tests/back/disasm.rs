//! The disassembler: names what the numbers stand for, and takes any bytes.

use bittybuzz_compiler::disasm::disassemble;
use bittybuzz_vm_core::image::Image;
use proptest::prelude::*;

use crate::back::machine::{FULL, TINY, at_least, image, listing};

const SCRIPT: &str = "
function step() {
  var n = 1
  while(n < 300) { n = n + 1 }
  if(n) led(n, 300)
  math.max(n, 2.5)
  t.f(n)
}
t = { .f = function(x) { log(\"x\", x, string.length(\"ab\")) } }
";

#[test]
fn everything_is_named() {
    let (bytes, symbols) = image(SCRIPT, FULL);
    let text = listing(&bytes, &symbols);
    let expected = [
        "profile      full",
        "features     strings",
        "step         step",
        "import 0     led",
        "string 12    \"ab\"",
        "function 0: global code, 0 parameters, 2 slots",
        "LOCAL_ADD 1 1",
        " LT 1 300",
        "INT 300",
        "CALL_ROBOT 0 2 drop",
        "; led",
        "; 2.5",
        "CALL_BUILTIN 25 2 drop",
        "; math.max",
        "FIELD_METHOD 13",
        "; \"f\"",
        "; string.length",
        "; lambda at test.bzz:9",
        "[test.bzz:4:9]",
    ];
    for part in expected {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn jumps_show_their_target() {
    let (bytes, symbols) = image(SCRIPT, FULL);
    let text = listing(&bytes, &symbols);
    let line = |name: &str| {
        let found = text.lines().find(|line| line.contains(name));
        found.unwrap_or_else(|| panic!("{name}\n{text}")).to_owned()
    };
    let back = line("JUMP_LOCAL");
    let target = back.split("JUMP_LOCAL ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    assert!(line(&format!(" {target}: ")).contains("LOCAL_ADD"), "{text}");
}

#[test]
fn names_are_not_needed() {
    let (bytes, _) = image(SCRIPT, FULL);
    let text = disassemble(&bytes, None);
    assert!(text.contains("function 1: function 1"));
    assert!(text.contains("robot function 0x"));
    // The image has the text itself.
    assert!(text.contains("\"ab\""));
    let (bytes, _) = image("t = { .field = 1 }", TINY);
    assert!(disassemble(&bytes, None).contains("; string 12"));
}

#[test]
fn classes_of_values_that_are_sent() {
    let script = "neighbors.broadcast(\"t\", id) s = stigmergy.create(1) s.put(1, nil)";
    let (bytes, symbols) = image(script, TINY);
    let text = disassemble(&bytes, Some(&symbols));
    let classes: Vec<&str> = text.lines().filter(|line| line.starts_with("classes")).collect();
    let expected = ["classes      \"t\": numbers", "classes      other names: nil"];
    assert_eq!(classes, expected);
}

#[test]
fn symbols_of_another_image_are_ignored() {
    let (bytes, _) = image(SCRIPT, FULL);
    let (_, other) = image("x = 1", TINY);
    assert!(disassemble(&bytes, Some(&other)).contains("CALL_ROBOT"));
}

#[test]
fn bytes_without_an_image_are_reported() {
    assert!(disassemble(&[], None).starts_with("not an image"));
    assert!(disassemble(b"hello, world", None).starts_with("not an image"));
}

#[test]
fn overlapping_functions_are_listed_once() {
    let (mut bytes, _) = image("function step() { log(1) } function init() { log(2) }", TINY);
    let table = usize::from(Image::new(bytes.as_slice()).header().unwrap().functions_at());
    // The second of three functions starts after the end of the image.
    bytes[table + 2..table + 4].copy_from_slice(&[0xff, 0xff]);
    assert!(disassemble(&bytes, None).contains("function 1 starts after its end"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: at_least(500), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        disassemble(&bytes, None);
        let header = [&[0xb5, 0x02][..], &bytes].concat();
        disassemble(&header, None);
        let full = [&[0xb5, 0xfa][..], &bytes].concat();
        disassemble(&full, None);
    }

    #[test]
    fn damaged_images(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), cut in any::<prop::sample::Index>()) {
        let (mut bytes, symbols) = image(SCRIPT, FULL);
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        disassemble(&bytes, Some(&symbols));
        bytes.truncate(cut.index(bytes.len()));
        disassemble(&bytes, Some(&symbols));
    }
}
