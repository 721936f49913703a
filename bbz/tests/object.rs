//! Object files of the reference implementation (`.bo`), with and without their debug file.

use crate::support::Folder;

/// An object file: its strings, then instructions.
fn object(strings: &[&str], code: &[&[u8]]) -> Vec<u8> {
    let mut bytes = (strings.len() as u16).to_le_bytes().to_vec();
    for string in strings {
        bytes.extend(string.bytes());
        bytes.push(0);
    }
    bytes.extend(code.concat());
    bytes
}

/// An instruction with an argument.
fn with(opcode: u8, argument: i32) -> Vec<u8> {
    [&[opcode], &argument.to_le_bytes()[..]].concat()
}

const NOP: &[u8] = &[0];
const DONE: &[u8] = &[1];
const PUSH_NIL: &[u8] = &[2];
const POP: &[u8] = &[4];
const MOD: &[u8] = &[11];
const LOAD_GLOBAL: &[u8] = &[28];
const STORE_GLOBAL: &[u8] = &[29];
const CALL: &[u8] = &[33];
const PUSH_INT: u8 = 36;
const PUSH_STRING: u8 = 37;

/// The output of the Buzz compiler for `log(7)`.
fn logs() -> Vec<u8> {
    object(
        &["log"],
        &[
            NOP,
            PUSH_NIL,
            &with(PUSH_STRING, 0),
            LOAD_GLOBAL,
            &with(PUSH_INT, 7),
            &with(PUSH_INT, 1),
            CALL,
            POP,
            DONE,
        ],
    )
}

/// The output of the Buzz compiler for `y = 1 % x`.
fn faults() -> Vec<u8> {
    object(
        &["y", "x"],
        &[
            NOP,
            &with(PUSH_STRING, 0),
            &with(PUSH_INT, 1),
            &with(PUSH_STRING, 1),
            LOAD_GLOBAL,
            MOD,
            STORE_GLOBAL,
            DONE,
        ],
    )
}

/// Offset of `MOD` in this output: the count, two strings, then the instructions before.
const MOD_AT: u32 = 2 + 4 + 1 + 5 + 5 + 5 + 1;

/// An entry of a debug file.
fn place(offset: u32, line: u64, column: u64, file: &str) -> Vec<u8> {
    let mut bytes = offset.to_le_bytes().to_vec();
    bytes.extend(line.to_le_bytes());
    bytes.extend(column.to_le_bytes());
    bytes.extend((file.len() as u16).to_le_bytes());
    bytes.extend(file.bytes());
    bytes
}

#[test]
fn object_files_run_and_build_like_scripts() {
    let folder = Folder::with("object", "s.bo", "");
    folder.write("s.bo", logs());
    folder.bbz(&["check", "s.bo"]).succeeds_with("");
    folder.bbz(&["run", "s.bo"]).succeeds_with("7\n");
    folder.bbz(&["run", "s.bo", "--profile", "tiny"]).succeeds_with("7\n");
    assert_eq!(folder.bbz(&["build", "s.bo", "--robot", "kilobot"]).status, Some(0));
    folder.bbz(&["run", "s.bbi"]).succeeds_with("7\n");
    let listing = folder.bbz(&["disasm", "s.bo"]);
    assert_eq!((listing.status, listing.stderr.as_str()), (Some(0), ""));
    assert!(listing.stdout.contains("callc"), "{}", listing.stdout);
}

#[test]
fn a_fault_names_the_instruction_or_with_the_debug_file_the_script() {
    let folder = Folder::with("object_fault", "s.bo", "");
    folder.write("s.bo", faults());
    let message = "cannot take an integer modulo nil";
    // Line 6 of the listing: nop, pushs, pushi, pushs, gload, mod.
    let plain = folder.bbz(&["run", "s.bo"]);
    plain.fails_with(1, &["error[R0001]", message, "--> s.bo:6:", "mod"]);
    folder.write("script.bzz", "# comment\ny = 1 % x\n");
    folder.write("s.bdb", place(MOD_AT, 2, 6, "script.bzz"));
    let debugged = folder.bbz(&["run", "s.bo"]);
    debugged.fails_with(1, &["error[R0001]", message, "--> script.bzz:2:6", "y = 1 % x"]);
}

#[test]
fn damaged_object_files_are_refused() {
    let folder = Folder::new("object_refused");
    let good = logs();
    for bytes in [&b""[..], b"\x01", b"log(1)\n", &good[..good.len() - 1], &good[..good.len() - 8]]
    {
        folder.write("s.bo", bytes);
        for command in ["run", "check"] {
            folder.bbz(&[command, "s.bo"]).fails_with(3, &["`s.bo` cannot be used"]);
        }
    }
    // A damaged debug file is not an error.
    folder.write("s.bo", &good);
    folder.write("s.bdb", "nonsense");
    let outcome = folder.bbz(&["run", "s.bo"]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), "7\n"));
    outcome.reports(&["warning: `s.bo`"]);
}
