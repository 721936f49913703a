//! `bbz build`, and the uses of the files that it writes.

use crate::support::Folder;
use bittybuzz_vm_core::Parts;
use serde_json::Value;

const SCRIPT: &str =
    "word = \"hello\"\nfunction init() { log(word, id) }\nfunction step() { led(7 / (id - 1)) }\n";

#[test]
fn writes_image_and_symbols_that_run() {
    let folder = Folder::with("build", "s.bzz", SCRIPT);
    let built = folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]);
    assert_eq!((built.status, built.stderr.as_str()), (Some(0), ""));
    let bytes = folder.read("s.bbi").len();
    for part in ["s.bbi", &format!("{bytes} bytes"), "Kilobot", "28160"] {
        assert!(built.stdout.contains(part), "{}", built.stdout);
    }
    assert_eq!(folder.names(), ["s.bbi", "s.bzz", "s.sym"]);
    folder
        .bbz(&["run", "s.bbi", "--robot", "kilobot", "--id", "2", "--steps", "1"])
        .succeeds_with("hello2\nled(7)\n");
    // Text, place and calls come from the symbols.
    let fault = folder.bbz(&["run", "s.bbi", "--steps", "1"]);
    assert_eq!((fault.status, fault.stdout.as_str()), (Some(1), "hello1\n"));
    fault.reports(&["error[R0005]", "--> s.bzz:3:23", "led(7 / (id - 1))", "in `step`"]);
}

#[test]
fn the_output_may_be_a_name_an_image_or_a_folder() {
    let folder = Folder::with("build_output", "s.bzz", SCRIPT);
    std::fs::create_dir(folder.path("out")).unwrap();
    for (output, base) in [
        ("v1.2", "v1.2"),
        ("named.bbi", "named"),
        ("out", "out/s"),
        ("out/", "out/s"),
        ("out/x", "out/x"),
    ] {
        let built = folder.bbz(&["build", "s.bzz", "--robot", "kilobot", "-o", output]);
        assert_eq!(built.status, Some(0), "{}", built.stderr);
        for suffix in ["bbi", "sym"] {
            let path = folder.path(&format!("{base}.{suffix}"));
            assert!(path.is_file(), "{output}: {}", path.display());
            std::fs::remove_file(path).unwrap();
        }
    }
    assert_eq!(folder.names(), ["out", "s.bzz"]);
}

/// A Kilobot sends two frames per second. In `tiny` a table of two numbers takes four frames.
#[test]
fn the_costs_of_messages_are_listed() {
    let script = "t = {}\nfunction step() { t.n = t\n neighbors.broadcast(\"p\", {.x = 1, .y = 2})\n \
                  if(id) neighbors.broadcast(\"q\", t) }\n";
    let folder = Folder::with("build_messages", "s.bzz", script);
    let built = folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]);
    let lines: Vec<&str> = built.stdout.lines().skip(1).collect();
    assert_eq!(
        lines,
        [
            "messages:",
            "  s.bzz:3 broadcast \"p\": 4 frames, 2 s of the Kilobot's air, in every step",
            "  s.bzz:4 broadcast \"q\": 2 to 8 frames, 1 s to 4 s of the Kilobot's air, \
             at most in every step",
        ]
    );
    built.reports(&["warning[W0227]", "4 frames", "2 s"]);
    let printed = folder.bbz(&["build", "s.bzz", "--robot", "kilobot", "--json"]);
    let result: Value = serde_json::from_str(&printed.stdout).unwrap();
    let message = &result["messages"][1];
    assert_eq!(message["frames"], serde_json::json!([2, 8]));
    assert_eq!(message["air_seconds"], serde_json::json!([1.0, 4.0]));
    assert_eq!((&message["name"], &message["line"]), (&"\"q\"".into(), &4.into()));
    assert_eq!((&message["period_steps"], &message["is_certain"]), (&1.into(), &false.into()));
}

#[test]
fn profiles_are_built_as_asked() {
    let folder = Folder::with("build_profile", "s.bzz", SCRIPT);
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]).status, Some(0));
    folder
        .bbz(&["run", "s.bbi", "--profile", "tiny"])
        .fails_with(3, &["full profile", "--profile"]);
    let tiny = folder.bbz(&["build", "s.bzz", "--robot", "crazyflie", "--profile", "tiny"]);
    assert_eq!(tiny.status, Some(0));
    folder
        .bbz(&["run", "s.bbi", "--profile", "full"])
        .fails_with(3, &["tiny profile", "--profile"]);
    // The image decides.
    folder.bbz(&["run", "s.bbi", "--id", "2", "--steps", "1"]).succeeds_with("hello2\nled(7)\n");
}

#[test]
fn a_failed_build_changes_no_file() {
    let folder = Folder::with("build_failure", "s.bzz", "log(\n");
    folder.write("s.bbi", "an older image");
    folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]).fails_with(2, &["error[E", "s.bzz:"]);
    folder.write("s.bzz", SCRIPT);
    let nowhere = ["build", "s.bzz", "--robot", "kilobot", "-o", "no/such/folder"];
    folder.bbz(&nowhere).fails_with(3, &["cannot write", "no/such"]);
    // The image cannot replace a folder, although the symbols could be written.
    std::fs::create_dir(folder.path("d.bbi")).unwrap();
    folder.bbz(&["build", "s.bzz", "--robot", "kilobot", "-o", "d.bbi"]);
    folder.bbz(&["build", "s.bzz", "--robot", "kilobot", "-o", "d"]).fails_with(3, &["d.bbi"]);
    assert_eq!(folder.read("s.bbi"), b"an older image");
    let left: Vec<String> =
        folder.names().into_iter().filter(|name| name.contains(".bbi.")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn scripts_that_exceed_a_robot_are_not_built() {
    let folder = Folder::with("build_refused", "s.bzz", "takeoff(100)\n");
    folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]).fails_with(2, &["takeoff", "Kilobot"]);
    folder.bbz(&["build", "s.bzz"]).fails_with(3, &["--robot"]);
    folder
        .bbz(&["build", "s.bzz", "--robot", "kilobott"])
        .fails_with(3, &["kilobott", "`kilobot`"]);
    assert_eq!(folder.names(), ["s.bzz"]);
}

#[test]
fn json_has_sizes_or_errors() {
    let folder = Folder::with("build_json", "s.bzz", SCRIPT);
    let built = folder.bbz(&["build", "s.bzz", "--robot", "kilobot", "--json"]);
    assert_eq!((built.status, built.stderr.as_str()), (Some(0), ""));
    let result: Value = serde_json::from_str(&built.stdout).unwrap();
    assert_eq!(result["errors"], 0);
    assert_eq!(result["image"]["path"], "s.bbi");
    assert_eq!(result["image"]["bytes"], folder.read("s.bbi").len());
    assert_eq!(result["image"]["profile"], "tiny");
    assert_eq!(result["image"]["flash_budget"], 28160);

    folder.write("s.bzz", "log(\ntakeoff(1\n");
    let failed = folder.bbz(&["build", "s.bzz", "--robot", "kilobot", "--json"]);
    assert_eq!((failed.status, failed.stderr.as_str()), (Some(2), ""));
    let result: Value = serde_json::from_str(&failed.stdout).unwrap();
    assert_eq!(result["image"], Value::Null);
    let diagnostics = result["diagnostics"].as_array().unwrap();
    assert_eq!(result["errors"], diagnostics.len());
    assert!(diagnostics[0]["code"].as_str().unwrap().starts_with('E'));
    assert_eq!(diagnostics[0]["file"], "s.bzz");
    assert!(diagnostics[0]["line"].is_u64());
}

#[test]
fn symbols_that_do_not_belong_to_the_image_are_ignored_with_a_warning() {
    let folder = Folder::with("symbols", "s.bzz", SCRIPT);
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]).status, Some(0));
    let own = folder.read("s.sym");
    folder.write("other.bzz", "log(1)\n");
    assert_eq!(folder.bbz(&["build", "other.bzz", "--robot", "kilobot"]).status, Some(0));
    let run = || folder.bbz(&["run", "s.bbi", "--id", "2", "--steps", "0"]);
    for (symbols, reason) in [
        (folder.read("other.sym"), "belongs to script"),
        (own[..own.len() / 2].to_vec(), "not a symbol file"),
        (b"{\"format\":999}".to_vec(), "format 999, newer than format"),
        (b"{\"format\":0}".to_vec(), "format 0, older than format"),
        (b"\xff\xfe".to_vec(), "cannot read"),
        (Vec::new(), "not a symbol file"),
    ] {
        folder.write("s.sym", symbols);
        let outcome = run();
        assert_eq!(outcome.status, Some(0), "{reason}");
        // The tiny image carries no text.
        assert_eq!(outcome.stdout, "[string 12]2\n", "{reason}");
        outcome.reports(&["warning: ", "s.sym", reason]);
    }
    // Missing symbols are no mistake; a fault then has a position.
    std::fs::remove_file(folder.path("s.sym")).unwrap();
    run().succeeds_with("[string 12]2\n");
    let fault = folder.bbz(&["run", "s.bbi", "--steps", "1"]);
    assert_eq!(fault.status, Some(1));
    fault.reports(&["error[R0005]", "position"]);
}

#[test]
fn an_image_with_text_needs_no_symbols_for_it() {
    let script = "log(\"\", \"a\", string.length(\"abc\"))\n";
    let folder = Folder::with("text_in_image", "s.bzz", script);
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]).status, Some(0));
    std::fs::remove_file(folder.path("s.sym")).unwrap();
    folder.bbz(&["run", "s.bbi"]).succeeds_with("a3\n");
}

#[test]
fn without_its_source_a_fault_has_only_its_place() {
    let folder = Folder::with("no_source", "s.bzz", SCRIPT);
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]).status, Some(0));
    std::fs::remove_file(folder.path("s.bzz")).unwrap();
    folder.bbz(&["run", "s.bbi", "--steps", "1"]).reports(&["error[R0005]", "--> s.bzz:3:23"]);
    // The script was changed and is shorter now.
    folder.write("s.bzz", "\n");
    folder.bbz(&["run", "s.bbi", "--steps", "1"]).reports(&["error[R0005]", "--> s.bzz:3:23"]);
}

#[test]
fn disassembly_shows_the_names_of_the_symbols() {
    let folder = Folder::with("disasm", "s.bzz", SCRIPT);
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]).status, Some(0));
    for arguments in [&["disasm", "s.bzz"][..], &["disasm", "s.bbi"]] {
        let outcome = folder.bbz(arguments);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        for part in ["CALL_ROBOT", "led", "step", "word"] {
            assert!(outcome.stdout.contains(part), "{part}: {}", outcome.stdout);
        }
    }
    folder.write("s.bzz", "log(\n");
    folder.bbz(&["disasm", "s.bzz"]).fails_with(2, &["error[E"]);
}

/// A program of 100 bytes with a place for a script after it, as Intel hex, in the form of the
/// firmware's build.
fn program(parts: Parts) -> String {
    program_with(parts, b"another script")
}

/// A program of 100 bytes with this script.
fn program_with(parts: Parts, own: &[u8]) -> String {
    let section = bittybuzz_robot_spec::script_section(parts, own).expect("it is short");
    let bytes: Vec<u8> = (0..100).chain(section).collect();
    let lines = bytes.chunks(32).enumerate().map(|(line, bytes)| {
        let offset = (line * 32) as u16;
        let record = [&[bytes.len() as u8], &offset.to_be_bytes()[..], &[0], bytes].concat();
        let sum = record.iter().fold(0_u8, |sum, byte| sum.wrapping_sub(*byte));
        let digits: String =
            record.iter().chain([&sum]).map(|byte| format!("{byte:02X}")).collect();
        format!(":{digits}\r\n")
    });
    lines.chain([":00000001FF\r\n".to_owned()]).collect()
}

#[test]
fn a_script_is_put_into_firmware() {
    let folder = Folder::with("build_hex", "s.bzz", "function step() { led(1) }");
    folder.write("firmware.hex", program(Parts::NONE));
    let line = ["build", "s.bzz", "--robot", "kilobot", "--firmware", "firmware.hex", "-o", "out"];
    let built = folder.bbz(&line);
    assert_eq!((built.status, built.stderr.as_str()), (Some(0), ""));
    assert!(built.stdout.contains("out.hex"), "{}", built.stdout);
    let text = String::from_utf8(folder.read("out.hex")).unwrap();
    let mut bytes = Vec::new();
    for record in ihex::Reader::new(&text) {
        if let ihex::Record::Data { offset, value } = record.unwrap() {
            assert_eq!(usize::from(offset), bytes.len(), "no gaps");
            bytes.extend(value);
        }
    }
    let image = folder.read("out.bbi");
    assert_eq!(bytes[..100], (0..100).collect::<Vec<u8>>());
    assert_eq!(bittybuzz_robot_spec::find_script_section(&bytes), Ok((100, Parts::NONE)));
    assert_eq!(bytes[108..108 + image.len()], image);
    // The script can be exchanged again.
    folder.write("s.bzz", "function step() { led(2) }");
    let line = ["build", "s.bzz", "--robot", "kilobot", "--firmware", "out.hex", "-o", "next"];
    assert_eq!(folder.bbz(&line).status, Some(0));
    assert_eq!(folder.read("next.hex").len(), folder.read("out.hex").len());
    let before = ["out.hex", "out.bbi", "out.sym"].map(|name| folder.read(name));
    let line = ["build", "s.bzz", "--robot", "kilobot", "--firmware", "out.hex", "-o", "out"];
    folder.bbz(&line).fails_with(3, &["`out.hex` is read by this command"]);
    assert_eq!(["out.hex", "out.bbi", "out.sym"].map(|name| folder.read(name)), before);
}

#[test]
fn unsuitable_firmware_is_refused() {
    let folder = Folder::with("build_no_hex", "s.bzz", "function step() { led(1) }");
    let whole = program(Parts::NONE);
    let gap = whole.lines().skip(1).map(|line| format!("{line}\n")).collect::<String>();
    let damaged = whole.replacen("00", "01", 2);
    for (content, says) in [
        ("", "neither an ELF nor an Intel hex file"),
        ("\u{7f}ELF", "neither an ELF nor an Intel hex file"),
        (":00000001FF", "no place for a script"),
        (&gap, "no bytes at 0x0000"),
        (&damaged, "no Intel hex file"),
    ] {
        folder.write("firmware.hex", content);
        folder
            .bbz(&["build", "s.bzz", "--robot", "kilobot", "--firmware", "firmware.hex"])
            .fails_with(3, &["firmware.hex", says, "cargo xtask build kilobot"]);
    }
    // The program's own script is an image of version 1: magic, form, features, hash.
    folder.write("firmware.hex", program_with(Parts::NONE, &[0xb5, 0x01, 0, 1, 2, 3, 4]));
    folder.bbz(&["build", "s.bzz", "--robot", "kilobot", "--firmware", "firmware.hex"]).fails_with(
        3,
        &["built by another version", "version 1", "version 2", "build the firmware again"],
    );
    folder.write("firmware.hex", &whole);
    folder.write("n.bzz", "function step() {\n  neighbors.broadcast(\"a\", 1)\n}");
    folder
        .bbz(&["build", "n.bzz", "--robot", "kilobot", "--firmware", "firmware.hex"])
        .fails_with(3, &["without `messages`", "`step`", "n.bzz:2", "--script"]);
    folder
        .bbz(&["build", "s.bzz", "--robot", "zooids", "--firmware", "firmware.hex"])
        .fails_with(3, &["Zooid", "bbz flash"]);
    assert_eq!(folder.names(), ["firmware.hex", "n.bzz", "s.bzz"]);
}
