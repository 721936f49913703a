//! Reading bytes, and writing them as text.

use bittybuzz_compiler::bo::disassemble;
use bittybuzz_compiler::bo::error::BoCause;
use bittybuzz_compiler::bo::read::Bo;

use crate::bo::assembler::assemble;
use crate::bo::vectors::{self, ALL};

/// The instructions of the assembly text, each with the argument that the listing shows.
fn instructions(assembly: &str) -> Vec<&str> {
    assembly.lines().filter(|line| !line.starts_with(['!', '\'', '@'])).collect()
}

#[test]
fn vectors_hold_the_instructions_of_their_assembly_text() {
    for vector in ALL {
        let bo = Bo::read(vector.bytes).expect(vector.script);
        let strings = vector.assembly.lines().filter_map(|line| line.strip_prefix('\''));
        assert!(bo.strings.iter().map(String::as_str).eq(strings), "{}", vector.script);
        let listing = disassemble(vector.bytes).expect(vector.script);
        let expected = instructions(vector.assembly);
        assert_eq!(listing.lines().count(), expected.len(), "{}", vector.script);
        for (line, expected) in listing.lines().zip(expected) {
            let (_, instruction) = line.split_once(": ").expect(line);
            let shown = instruction.split("  # ").next().unwrap_or_default();
            // A label stands for an offset.
            match expected.split_once(" @") {
                Some((mnemonic, _)) => assert_eq!(shown.split(' ').next(), Some(mnemonic)),
                None => assert_eq!(shown, expected, "{}", vector.script),
            }
        }
    }
}

/// The assembler of these tests must be right before anything else here is.
#[test]
fn assembler_makes_the_bytes_of_the_vectors() {
    for vector in ALL {
        assert_eq!(assemble(vector.assembly), vector.bytes, "{}", vector.script);
    }
}

#[test]
fn listing_shows_offsets_arguments_and_strings() {
    assert_eq!(
        disassemble(vectors::LITERALS.bytes).expect("a vector"),
        "13: nop
14: pushs 0  # \"a\"
19: pushf 2.5
24: gstore
25: pushs 1  # \"b\"
30: pushi -3
35: gstore
36: pushs 2  # \"c\"
41: pushs 3  # \"hi\"
46: gstore
47: pushs 4  # \"d\"
52: pushnil
53: gstore
54: done
"
    );
    let jumps = disassemble(vectors::IF_ELSE.bytes).expect("a vector");
    assert!(jumps.contains("\n19: jumpz 40\n"), "{jumps}");
    assert!(jumps.contains("\n35: jump 51\n"), "{jumps}");
}

/// It jumps to itself, calls nothing and pushes a string that it does not have.
#[test]
fn instruction_test_is_read_up_to_its_string() {
    let error = Bo::read(vectors::INSTRUCTION_TEST).expect_err("there is no string");
    assert_eq!(error.cause, BoCause::UnknownString(0));
    assert_eq!(vectors::INSTRUCTION_TEST[error.offset], 0x25);
    // With an integer in its place all the rest can be read.
    let mut bytes = vectors::INSTRUCTION_TEST.to_vec();
    bytes[error.offset] = 0x24;
    let listing = disassemble(&bytes).expect("instructions");
    assert_eq!(listing.lines().count(), 51);
    assert!(listing.starts_with("2: nop\n3: done\n4: pushnil\n5: pop\n6: pushi 66\n"), "{listing}");
    let end = "80: pushi 0\n85: pushcn 2\n90: pushcc 2\n95: pushl 2\n100: lload 0\n";
    assert!(listing.ends_with(end), "{listing}");
}

#[test]
fn text_of_strings_is_kept() {
    let bytes = assemble("!3 / 'h\u{e9} / ' a b  / ' / nop / done");
    let bo = Bo::read(&bytes).expect("a program");
    assert_eq!(bo.strings, ["h\u{e9}", " a b ", ""]);
}
