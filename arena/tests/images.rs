//! Robots that run a foreign image, up to the moment at which an emulator starts.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use crate::script;
use bittybuzz_arena::run::{Program, Setup, SetupError, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};

/// Processors in the header of an ELF file.
const ARM: u16 = 40;
const X86_64: u16 = 62;

/// A segment of a file: address, content, and the bytes that it occupies in memory.
type Segment<'a> = (u32, &'a [u8], u32);

/// The vector table of an image at the start of the flash: the end of the RAM, and a function
/// behind the table.
const VECTORS: [u8; 16] = *b"\x00\x00\x02\x20\x09\x40\x00\x08\xfe\xe7\xfe\xe7\x00\x00\x00\x00";

/// The address at which Bitcraze's bootloader starts an image.
const APPLICATION: u32 = 0x0800_4000;

/// A folder with images that work, or do not for one reason each.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = script::folder("images", &[("s.bzz", "function step() { }\n")]);
    let code = (APPLICATION, &VECTORS[..], 16);
    // No RAM for 128 KiB and a byte, and no flash after 1 MiB.
    let greedy = (0x2000_0000, &[][..], 0x2_0001);
    let far = (0x0810_0000 - 8, &VECTORS[..], 16);
    let mut no_function = VECTORS;
    no_function[4] = 0x08;
    let mut no_stack = VECTORS;
    no_stack[3] = 0x08;
    for (name, content) in [
        ("good.elf", elf(ARM, &[code])),
        ("foreign.elf", elf(X86_64, &[code])),
        ("elsewhere.elf", elf(ARM, &[(0x0800_8000, &VECTORS[..], 16)])),
        ("ram.elf", elf(ARM, &[(0x2000_0000, &VECTORS[..], 16)])),
        ("greedy.elf", elf(ARM, &[code, greedy])),
        ("far.elf", elf(ARM, &[code, far])),
        ("function.elf", elf(ARM, &[(APPLICATION, &no_function[..], 16)])),
        ("stack.elf", elf(ARM, &[(APPLICATION, &no_stack[..], 16)])),
        ("short.elf", elf(ARM, &[(APPLICATION, &VECTORS[..6], 6)])),
        ("image.bin", VECTORS.to_vec()),
    ] {
        fs::write(folder.join(name), content).unwrap();
    }
    folder
});

/// Returns an ELF file of 32 bits.
fn elf(machine: u16, segments: &[Segment<'_>]) -> Vec<u8> {
    const HEADER: u32 = 52;
    const PROGRAM_HEADER: u32 = 32;
    let mut file = b"\x7fELF\x01\x01\x01".to_vec();
    file.resize(16, 0);
    for half in [2, machine] {
        file.extend(half.to_le_bytes());
    }
    for word in [1, APPLICATION, HEADER, 0, 0] {
        file.extend(word.to_le_bytes());
    }
    let count = segments.len() as u16;
    for half in [HEADER as u16, PROGRAM_HEADER as u16, count, 0, 0, 0] {
        file.extend(half.to_le_bytes());
    }
    let mut at = HEADER + PROGRAM_HEADER * u32::from(count);
    for (address, content, bytes) in segments {
        let length = content.len() as u32;
        for word in [1, at, *address, *address, length, *bytes, 5, 4] {
            file.extend(word.to_le_bytes());
        }
        at += length;
    }
    segments.iter().for_each(|(_, content, _)| file.extend(*content));
    file
}

/// A world with a group of Crazyflies; the case goes on in line 8.
const GROUP: &str = "[world]\nsize = [2000, 2000]\nduration = 10\n[[robots]]\nrobot = \"crazyflie\"\nbackend = \"firmware\"\ncount = 2\n";

fn parse(text: &str) -> Result<Scenario, Vec<ScenarioError>> {
    Scenario::parse(text, "s.toml", &FOLDER, &[], &bittybuzz_robot_models::all())
}

/// `8:1: message | help`, a line for each error.
fn printed(errors: &[ScenarioError]) -> String {
    let text = |error: &ScenarioError| {
        let place = error.place.as_ref().unwrap();
        let help = error.help().unwrap_or_default();
        format!("{}:{}: {error} | {help}\n", place.line, place.column)
    };
    errors.iter().map(text).collect()
}

fn set_up(text: &str) -> Result<Setup, Vec<ScenarioError>> {
    let scenario = parse(text)?;
    let program = |(group, script): (&Group, Option<&Path>)| {
        script
            .map_or_else(|| Program::empty(group), |script| script::program(script, group).unwrap())
    };
    let programs: Vec<Program> = scenario.programs().map(program).collect();
    Setup::new(scenario, programs).map_err(|error| match error {
        SetupError::Scenario(errors) => errors,
        SetupError::Refused { cause, .. } => panic!("{cause:?}"),
    })
}

#[track_caller]
fn assert_error(case: &str, place: &str, expected: &[&str]) {
    let errors = set_up(&[GROUP, case].concat()).err().unwrap_or_default();
    let text = printed(&errors);
    assert!(text.starts_with(&format!("{place}: ")) && errors.len() == 1, "{case}: {text}");
    for part in expected {
        assert!(text.contains(part), "{case}: {text}\nlacks {part}");
    }
}

#[test]
fn a_group_with_an_image_has_doors_and_no_script() {
    let setup = set_up(&[GROUP, "image = \"good.elf\"\ndoor = 19850\n"].concat()).unwrap();
    let group = &setup.scenario.groups[0];
    let image = group.backend.image().unwrap();
    assert_eq!((group.script.as_ref(), image.path.as_path()), (None, &*FOLDER.join("good.elf")));
    let door = image.door.as_ref().unwrap();
    assert_eq!([door.port(0), door.port(1)], [19850, 19851]);
    // Any place in the flash at which the chip or Bitcraze's bootloader starts.
    set_up(&[GROUP, "image = \"good.elf\"\n"].concat()).unwrap();
}

#[test]
fn an_image_that_cannot_run_is_refused() {
    for (file, expected) in [
        ("none.elf", &["cannot use the image `none.elf`: there is no such file"][..]),
        (".", &["it is a folder"]),
        ("image.bin", &["not a 32-bit ELF file", "not a .bin or .hex"]),
        ("s.bzz", &["not a 32-bit ELF file", "firmware for the robot's chip"]),
        ("foreign.elf", &["not for a little-endian ARM"]),
        ("elsewhere.elf", &["starts at 0x08008000", "0x08004000"]),
        ("ram.elf", &["nothing for the flash at 0x08000000"]),
        ("greedy.elf", &["needs memory from 0x20000000 to 0x20020001, which the chip does not"]),
        ("far.elf", &["needs memory from 0x080ffff8 to 0x08100008"]),
        ("function.elf", &["no vector table is at 0x08004000", "0x20020000 and 0x08004008"]),
        ("stack.elf", &["no vector table is at 0x08004000", "0x08020000 and 0x08004009"]),
        ("short.elf", &["no vector table is at 0x08004000", "0x20020000 and 0x00000000"]),
    ] {
        assert_error(&format!("image = \"{file}\"\n"), "8:9", expected);
    }
}

#[test]
fn keys_without_effect_on_an_image_are_refused() {
    for (case, place, expected) in [
        ("script = \"s.bzz\"\n", "9:10", &["`script` has no effect on robots", "runs scripts"][..]),
        ("firmware = \"good.elf\"\n", "9:12", &["`firmware` has no effect", "leave out"]),
        ("profile = \"full\"\n", "9:11", &["`profile` has no effect"]),
        ("settings = [\"height_mm=300\"]\n", "9:12", &["`settings` has no effect"]),
        ("on_fault = \"stop\"\n", "9:12", &["`on_fault` cannot be had"]),
        ("present = false\n", "9:11", &["`present = false` cannot be had"]),
        ("door = 0\n", "9:8", &["`door` cannot be 0", "from 1 to 65535"]),
        ("door = 65536\n", "9:8", &["`door` cannot be 65536"]),
        ("door = 65535\n", "9:8", &["the last robot would have port 65536", "1 to 65535"]),
        ("door = \"a\"\n", "9:8", &["`door` must be"]),
        (
            "model = { fidelity = \"flight\", wind = 500 }\n",
            "9:9",
            &["`wind` has no effect on robots with an `image`"],
        ),
        ("[[event]]\nat = 1\nmove = \"all\"\nby = [1, 1]\n", "11:8", &["`move` has no effect"]),
        ("[[event]]\nat = 1\nrestart = \"all\"\n", "11:11", &["`restart` cannot be had"]),
        ("[[event]]\nat = 1\ndisplace = 0\nby = [1, 1]\n", "11:12", &["poses from outside"]),
        ("[[expect]]\nat = 1\nvalue = \"neighbors\"\nequals = 1\n", "11:9", &["cannot be seen"]),
    ] {
        assert_error(&format!("image = \"good.elf\"\n{case}"), place, expected);
    }
}

/// The project's firmware flies in calm air by poses from outside, and does not avoid other robots.
#[test]
fn keys_without_effect_on_firmware_that_flies_are_refused() {
    let group = "script = \"s.bzz\"\nfirmware = \"good.elf\"\n";
    for (model, expected) in [
        ("avoidance = 100", "`avoidance` cannot be had"),
        ("wind = 100", "`wind` cannot be had"),
        ("positioning = \"flow\"", "`positioning = \"flow\"` cannot be had"),
    ] {
        let model = format!("model = {{ fidelity = \"flight\", {model} }}\n");
        assert_error(&format!("{group}{model}"), "10:9", &[expected]);
    }
    let flight = format!("{group}model = {{ fidelity = \"flight\" }}\n");
    set_up(&[GROUP, &flight].concat()).unwrap();
    let event = "[[event]]\nat = 1\nmove = \"all\"\nby = [1, 1]\n";
    assert_error(&[&flight, event].concat(), "13:8", &["`move` has no effect"]);
    // On the ground a robot can be moved, and has no air around it.
    set_up(&[GROUP, group, "model = { avoidance = 100 }\n", event].concat()).unwrap();
}

#[test]
fn images_and_doors_need_the_right_robots() {
    let group = "script = \"s.bzz\"\nfirmware = \"good.elf\"\ndoor = 19850\n";
    assert_error(group, "10:8", &["`door` means nothing without `image`"]);
    let vm = GROUP.replace("\"firmware\"", "\"vm\"");
    for world in [&vm, &GROUP.replace("backend = \"firmware\"\n", "")] {
        let text = printed(&parse(&format!("{world}image = \"good.elf\"\n")).unwrap_err());
        assert!(text.contains("`image` means nothing without `backend = \"firmware\"`"), "{text}");
    }
    for robot in ["zooids", "kilobot"] {
        let group = GROUP.replace("crazyflie", robot);
        let text = printed(&parse(&format!("{group}image = \"good.elf\"\n")).unwrap_err());
        assert!(text.contains(&format!("8:9: a `{robot}` runs no foreign `image`")), "{text}");
    }
}

#[test]
fn groups_with_images_fit_together() {
    let first = "image = \"good.elf\"\ndoor = 19850\n";
    let second = "[[robots]]\nrobot = \"crazyflie\"\nbackend = \"firmware\"\n";
    assert_error(
        &format!("{first}{second}image = \"good.elf\"\ndoor = 19851\n"),
        "14:8",
        &["two robots would have a door at port 19851", "the other is in line 9"],
    );
    set_up(&format!("{GROUP}{first}{second}image = \"good.elf\"\ndoor = 19852\n")).unwrap();
    assert_error(
        &format!("{first}{second}image = \"far.elf\"\n"),
        "13:9",
        &["another firmware than those of line 4", "the same `image`"],
    );
    // One that runs scripts and one that does not, although their file is the same.
    let text = format!("{GROUP}{first}{second}firmware = \"good.elf\"\nscript = \"s.bzz\"\n");
    let text = printed(&parse(&text).unwrap_err());
    assert!(text.contains("12:11: these robots run another firmware"), "{text}");
}

/// Without an emulator program, the place of the image is that of the error.
#[test]
fn an_emulator_that_is_missing_is_an_error_at_the_image() {
    let setup = set_up(&[GROUP, "image = \"good.elf\"\n"].concat()).unwrap();
    let setup = setup.emulated_by("crazyflie", FOLDER.join("no-emulator"));
    let error = Simulation::new(Arc::new(setup), 1, 1).err().unwrap();
    let text = printed(&[error]);
    assert!(text.starts_with("8:9: cannot start the emulator"), "{text}");
}
