//! `bbz flash` with a fake probe-rs: not tried on hardware.
#![cfg(unix)]

use crate::support;
use crate::support::Folder;
use crate::support::elf;
use crate::support::elf::Segment;
use crate::support::probe_rs;
use std::process::Command;

const SCRIPT: &str = "function step() { led(1) }\n";
const FLASH: [&str; 4] = ["flash", "s.bzz", "--robot", "crazyflie"];

/// Firmware for the layout of the Crazyflie: vector table, variables with their start values, a script.
fn firmware() -> Vec<u8> {
    elf::arm(&[
        Segment { at: 0x0800_4000, runs_at: 0x0800_4000, bytes: &[0; 64] },
        Segment { at: 0x0800_4040, runs_at: 0x2000_0000, bytes: &[1; 8] },
        Segment { at: 0x0808_0000, runs_at: 0x0808_0000, bytes: &[2; 16] },
    ])
}

#[test]
fn only_the_script_is_written() {
    let folder = Folder::with("flash_script", "s.bzz", SCRIPT);
    probe_rs::install(&folder, "cp \"$file\" written.bin");
    let outcome = probe_rs::bbz(&folder, &FLASH);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    assert!(outcome.stdout.ends_with("is on the Crazyflie 2.1, which restarts\n"));
    let calls = probe_rs::calls(&folder);
    // One sector is written after the other, so that one of them holds a script whenever the power
    // fails.
    let [first, second] = &calls[..] else { panic!("{calls:?}") };
    let (options, file) = first.rsplit_once(' ').unwrap();
    let download = "download --non-interactive --chip STM32F405RG --verify";
    assert_eq!(options, format!("{download} --binary-format bin --base-address 0x08080000"));
    let second = second.rsplit_once(' ').unwrap();
    let reset = format!("{download} --reset --binary-format bin --base-address 0x080a0000");
    assert_eq!(second, (reset.as_str(), file));
    assert!(!std::path::Path::new(file).exists(), "left behind: {file}");
    // The length, then the image from `bbz build`, and the mark at the end.
    folder.bbz(&["build", "s.bzz", "--robot", "crazyflie"]);
    let image = folder.read("s.bbi");
    let length = u32::try_from(image.len()).unwrap().to_le_bytes();
    let written = folder.read("written.bin");
    assert_eq!(written.len(), 4096);
    assert!(written.starts_with(&[&length[..], &image].concat()));
    assert_eq!(written[4088..4092], 1_u32.to_le_bytes());
    // An image is flashed unchanged.
    assert_eq!(probe_rs::bbz(&folder, &["flash", "s.bbi", "--robot", "crazyflie"]).status, Some(0));
    assert_eq!(folder.read("written.bin"), written);
}

/// The shell places links under the name that would follow from the process id, which `exec` keeps:
/// another user could do the same in a shared folder.
#[test]
fn a_link_in_the_temporary_folder_is_not_followed() {
    let folder = Folder::with("flash_link", "s.bzz", SCRIPT);
    folder.write("victim", "kept");
    std::fs::create_dir(folder.path("tmp")).unwrap();
    probe_rs::install(&folder, "");
    let link = "ln -s ../victim tmp/bbz-$$-s-script.bin && exec \"$@\"";
    let bbz = probe_rs::command(&folder, &FLASH);
    let program = bbz.get_program().to_owned();
    let mut shell = Command::new("sh");
    shell.args(["-c", link, "sh"]).arg(program).args(FLASH).current_dir(folder.path(""));
    shell.envs(bbz.get_envs().filter_map(|(name, value)| Some((name, value?))));
    shell.env("TMPDIR", folder.path("tmp"));
    let outcome = support::finish(shell.spawn().unwrap());
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert_eq!(probe_rs::calls(&folder).len(), 2);
    assert_eq!(folder.read("victim"), b"kept");
}

#[test]
fn firmware_comes_before_the_script() {
    let folder = Folder::with("flash_firmware", "s.bzz", SCRIPT);
    folder.write("robot", firmware());
    probe_rs::install(&folder, "");
    let outcome = probe_rs::bbz(&folder, &[&FLASH[..], &["--firmware", "robot"]].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let calls = probe_rs::calls(&folder);
    assert_eq!(calls.len(), 3);
    assert_eq!(
        calls[0],
        "download --non-interactive --chip STM32F405RG --verify --binary-format elf robot"
    );
    assert!(calls[2].contains("--reset --binary-format bin --base-address 0x080a0000"));
}

/// A Zooid has no verifier. The same image gets another seal for firmware with other memory.
#[test]
fn a_zooids_script_is_sealed() {
    let folder = Folder::with("flash_sealed", "s.bzz", SCRIPT);
    let shipped = include_str!("../../robots/zooids/robot.toml");
    folder.write("smaller.toml", shipped.replace("slots = 372", "slots = 371"));
    probe_rs::install(&folder, "cp \"$file\" written.bin");
    assert_eq!(folder.bbz(&["build", "s.bzz", "--robot", "zooids"]).status, Some(0));
    let image = folder.read("s.bbi");
    let [for_shipped, for_smaller] = ["zooids", "smaller.toml"].map(|robot| {
        let outcome = probe_rs::bbz(&folder, &["flash", "s.bbi", "--robot", robot]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        let written = folder.read("written.bin");
        // Length and checksum, then the image, and a seal of 30 bytes.
        let length = u16::try_from(image.len() + 30).unwrap().to_le_bytes();
        assert_eq!(written[..2], length);
        assert_eq!(written.len(), 4 + image.len() + 30);
        written[4..].to_vec()
    });
    assert!(for_shipped.starts_with(&image) && for_smaller.starts_with(&image));
    let check = for_shipped.len() - 2;
    assert_eq!(for_shipped[..check], for_smaller[..check]);
    assert_ne!(for_shipped[check..], for_smaller[check..]);
}

/// Settings have a page of their own; settings that are not given are erased.
#[test]
fn settings_are_written() {
    const ZOOIDS: [&str; 4] = ["flash", "s.bzz", "--robot", "zooids"];
    let folder = Folder::with("flash_settings", "s.bzz", SCRIPT);
    probe_rs::install(&folder, "case \"$file\" in *-settings.bin) cp \"$file\" set.bin;; esac");
    let outcome = probe_rs::bbz(&folder, &[&ZOOIDS[..], &["--set", "range_mm=300"]].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let calls = probe_rs::calls(&folder);
    assert_eq!(calls.len(), 2);
    assert!(calls[0].contains("--chip STM32F051C8"), "{}", calls[0]);
    assert!(calls[0].contains("--verify --binary-format bin --base-address 0x0800f800"));
    assert!(calls[1].contains("--reset --binary-format bin --base-address 0x0800ec00"));
    assert_eq!(folder.read("set.bin"), [0xff, 0xff, 0xff, 0xff, 0x2c, 0x01, 0xd3, 0xfe]);
    let both = ["--set", "range_mm=1", "--set", "minimum_duty=24"];
    assert_eq!(probe_rs::bbz(&folder, &[&ZOOIDS[..], &both].concat()).status, Some(0));
    assert_eq!(folder.read("set.bin"), [24, 0, 0xe7, 0xff, 1, 0, 0xfe, 0xff]);
    let range = "the value is no whole number from 1 to ";
    for (wrong, reason) in [
        ("range_mm", "it is not of the form NAME=NUMBER"),
        ("range_mm=", range),
        ("range_mm=0", range),
        ("range_mm=65535", range),
        ("range_mm=-1", range),
        ("range_mm=1.5", range),
        ("minimum_duty=61", range),
        ("range=1", "no setting has this name"),
        ("=1", "no setting has this name"),
    ] {
        let outcome = probe_rs::bbz(&folder, &[&ZOOIDS[..], &["--set", wrong]].concat());
        assert_eq!(outcome.status, Some(3));
        let error = format!("the Zooid does not take the setting `{wrong}`: {reason}");
        assert!(outcome.stderr.contains(&error), "{}", outcome.stderr);
        assert!(outcome.stderr.contains("minimum_duty=1 to minimum_duty=60"), "{}", outcome.stderr);
    }
    let twice = ["--set", "range_mm=1", "--set", "range_mm=2"];
    let outcome = probe_rs::bbz(&folder, &[&ZOOIDS[..], &twice].concat());
    assert_eq!(outcome.status, Some(3));
    let error = "the setting `range_mm=2`: it is given twice";
    assert!(outcome.stderr.contains(error), "{}", outcome.stderr);
    let outcome = probe_rs::bbz(&folder, &[&FLASH[..], &["--set", "x=1"]].concat());
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stderr.contains("height_mm=200 to height_mm=65534"), "{}", outcome.stderr);
    let kilobot =
        ["flash", "s.bzz", "--robot", "kilobot", "--programmer", "usbasp", "--set", "x=1"];
    let outcome = probe_rs::bbz(&folder, &kilobot);
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stderr.contains("has no [[setting]]"), "{}", outcome.stderr);
}

/// The id has a sector of its own, and is written before the robot restarts.
#[test]
fn an_id_is_assigned() {
    let folder = Folder::with("flash_id", "s.bzz", SCRIPT);
    probe_rs::install(&folder, "case \"$file\" in *-id.bin) cp \"$file\" id.bin;; esac");
    let outcome = probe_rs::bbz(&folder, &[&FLASH[..], &["--id", "4660"]].concat());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let calls = probe_rs::calls(&folder);
    assert_eq!(calls.len(), 3);
    assert!(calls[0].contains("--verify --binary-format bin --base-address 0x080e0000"));
    assert!(calls[2].contains("--reset --binary-format bin --base-address 0x080a0000"));
    // 4660 is 0x1234, followed by its complement.
    assert_eq!(folder.read("id.bin"), [0x34, 0x12, 0xcb, 0xed]);
    let shipped = include_str!("../../robots/crazyflie/robot.toml");
    let without = shipped.replace("id = { address", "# {");
    folder.write("without.toml", without);
    let flash = |robot, id| folder.bbz(&["flash", "s.bzz", "--robot", robot, "--id", id]);
    flash("without.toml", "7").fails_with(3, &["no place for an id", "[layout]"]);
    flash("crazyflie", "65536").fails_with(3, &["--id", "65536"]);
}

#[test]
fn a_dry_run_only_prints_the_calls() {
    let folder = Folder::with("flash_dry", "s.bzz", SCRIPT);
    folder.write("my robot", firmware());
    probe_rs::install(&folder, "");
    let dry = [&FLASH[..], &["--firmware", "my robot", "--dry-run"]].concat();
    let outcome = probe_rs::bbz(&folder, &dry);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(lines.len(), 3);
    assert!(lines[0].starts_with("probe-rs download --non-interactive --chip STM32F405RG "));
    assert!(lines[0].ends_with(" 'my robot'"), "{lines:?}");
    assert!(lines[1..].iter().all(|line| line.ends_with("-s-script.bin")), "{lines:?}");
    assert_eq!(probe_rs::calls(&folder), [""; 0]);
    assert_eq!(folder.names(), ["my robot", "probe-rs", "s.bzz"]);
}

#[test]
fn unsuitable_scripts_are_not_written() {
    let folder = Folder::with("flash_checks", "s.bzz", SCRIPT);
    probe_rs::install(&folder, "");
    let flash = |arguments: &[&str]| probe_rs::bbz(&folder, &[&["flash"], arguments].concat());
    folder.write("wrong.bzz", "forwards()\n");
    flash(&["wrong.bzz", "--robot", "crazyflie"]).fails_with(2, &["forwards", "wrong.bzz:1:1"]);
    folder.bbz(&["build", "s.bzz", "--robot", "crazyflie", "--profile", "tiny", "-o", "tiny"]);
    flash(&["tiny.bbi", "--robot", "crazyflie"])
        .fails_with(3, &["`tiny.bbi` was built for the tiny profile", "Crazyflie"]);
    folder.write("zooid.bzz", "log(greyCode(3))\n");
    folder.bbz(&["build", "zooid.bzz", "--robot", "zooids", "--profile", "full"]);
    flash(&["zooid.bbi", "--robot", "crazyflie"])
        .fails_with(3, &["calls a function that the robot does not have"]);
    folder.write("cut.bbi", "bbi");
    flash(&["cut.bbi", "--robot", "crazyflie"]).fails_with(3, &["`cut.bbi` is not an image"]);
    let other = include_str!("../../robots/kilobot/robot.toml").replace("ATmega328P", "ATmega1280");
    folder.write("other.toml", other);
    flash(&["s.bzz", "--robot", "other.toml"]).fails_with(3, &["Kilobot cannot be", "yet"]);
    flash(&["s.bzz"]).fails_with(3, &["--robot"]);
    flash(&["none.bzz", "--robot", "crazyflie"]).fails_with(3, &["there is no file `none.bzz`"]);
    assert_eq!(probe_rs::calls(&folder), [""; 0]);
}

#[test]
fn a_script_needs_room() {
    let folder = Folder::with("flash_room", "s.bzz", SCRIPT);
    let shipped = include_str!("../../robots/crazyflie/robot.toml");
    let small = shipped.replace(
        "script = { address = 0x0808_0000, size = 0x4_0000 }\nscript_log = true\n",
        "script = { address = 0x0808_0000, size = 0x200 }\n",
    );
    assert_ne!(small, shipped);
    folder.write("small.toml", small);
    let fits = folder.bbz(&["flash", "s.bzz", "--robot", "small.toml", "--dry-run"]);
    assert_eq!(fits.status, Some(0), "{}", fits.stderr);
    let many: String = (0..100).map(|n| format!("log(\"text number {n}\")\n")).collect();
    folder.write("long.bzz", many);
    let flash = |file, robot| folder.bbz(&["flash", file, "--robot", robot, "--dry-run"]);
    flash("long.bzz", "small.toml").fails_with(2, &["E0607", "the Crazyflie 2.1 has room for 256"]);
    folder.bbz(&["build", "long.bzz", "--robot", "crazyflie"]);
    flash("long.bbi", "small.toml")
        .fails_with(3, &["`long.bbi`: the image has ", "the Crazyflie 2.1 has room for 256"]);
}

/// The robot that an image was built for has more memory than the one that it is to be written to.
#[test]
fn an_image_needs_memory() {
    let folder = Folder::new("flash_memory");
    let shipped = include_str!("../../robots/crazyflie/robot.toml");
    let slots = shipped.lines().find(|line| line.starts_with("slots = ")).unwrap_or_default();
    let small = shipped.replace(slots, "slots = 40");
    assert_ne!(small, shipped);
    folder.write("small.toml", small);
    let globals: String = (0..30).map(|n| format!("global{n} = {n}\n")).collect();
    let many = format!("{globals}function step() {{ log(global0, global29) }}\n");
    let long = "1 - (x - ".repeat(20) + "x" + &")".repeat(20);
    let deep = format!(
        "x = 1\nfunction inner() {{ return {long} }}\n\
        function outer() {{ return {} }}\nfunction step() {{ x = outer() }}\n",
        long.replacen("(x - x)", "(x - inner())", 1)
    );
    for (name, script, code, message) in [
        ("many", many, "E0606", "30 globals need 46 slots of memory, the Crazyflie 2.1 has 40"),
        ("deep", deep, "E0609", "` -> `outer"),
    ] {
        let (source, image) = (format!("{name}.bzz"), format!("{name}.bbi"));
        folder.write(&source, script);
        for command in [&["check"][..], &["build"], &["flash", "--dry-run"]] {
            let arguments = [command, &[source.as_str(), "--robot", "small.toml"]].concat();
            folder.bbz(&arguments).fails_with(2, &[code, message, &source]);
        }
        assert_eq!(folder.bbz(&["build", &source, "--robot", "crazyflie"]).status, Some(0));
        let flash = |robot| folder.bbz(&["flash", &image, "--robot", robot, "--dry-run"]);
        assert_eq!(flash("crazyflie").status, Some(0));
        flash("small.toml").fails_with(3, &[&format!("`{image}`: "), message, "help"]);
    }
}

#[test]
fn other_firmware_is_not_written() {
    let folder = Folder::with("flash_other", "s.bzz", SCRIPT);
    probe_rs::install(&folder, "");
    let mut damaged = firmware();
    damaged.truncate(60);
    let at = |at| elf::arm(&[Segment { at, runs_at: at, bytes: &[0; 64] }]);
    let long = elf::arm(&[
        Segment { at: 0x0800_4000, runs_at: 0x0800_4000, bytes: &[0; 64] },
        Segment { at: 0x0809_fff0, runs_at: 0x0809_fff0, bytes: &[0; 0x2_0011] },
    ]);
    let mut host = firmware();
    host[18] = 3; // e_machine: EM_386
    let cases = [
        ("text", b"firmware".to_vec(), "is no ELF file"),
        ("damaged", damaged, "is no ELF file"),
        ("host", host, "is for another processor"),
        ("boot", at(0x0800_0000), "has 64 bytes for 0x08000000, which is no place for firmware"),
        ("long", long, "has 131089 bytes for 0x0809fff0"),
        ("ram", at(0x2000_0000), "has 64 bytes for 0x20000000"),
        ("late", at(0x0800_8000), "has nothing for 0x08004000"),
    ];
    for (name, bytes, message) in cases {
        folder.write(name, bytes);
        probe_rs::bbz(&folder, &[&FLASH[..], &["--firmware", name]].concat())
            .fails_with(3, &[&format!("`{name}` {message}"), "help"]);
    }
    assert_eq!(probe_rs::calls(&folder), [""; 0]);
}

#[test]
fn failures_of_probe_rs_have_advice() {
    let folder = Folder::with("flash_fails", "s.bzz", SCRIPT);
    let missing = folder.command(&FLASH).env("PATH", folder.path("")).spawn().unwrap();
    support::finish(missing)
        .fails_with(3, &["probe-rs is not installed", "cargo install probe-rs-tools --locked"]);
    // The message of probe-rs 0.32.
    probe_rs::install(&folder, "echo 'Error: No connected probes were found.' >&2; exit 1");
    probe_rs::bbz(&folder, &FLASH)
        .fails_with(3, &["Error: No connected probes", "no debug probe is connected", "udev"]);
    probe_rs::install(&folder, "echo 'Error: on fire' >&2; exit 1");
    probe_rs::bbz(&folder, &FLASH)
        .fails_with(3, &["Error: on fire", "probe-rs has failed", "messages above"]);
    // The script is not written after the firmware could not be written.
    folder.write("robot", firmware());
    folder.write("calls", "");
    probe_rs::bbz(&folder, &[&FLASH[..], &["--firmware", "robot"]].concat());
    assert_eq!(probe_rs::calls(&folder).len(), 1);
}

/// The real probe-rs, if it is installed, accepts the calls and the addresses; it simulates a probe
/// and a chip.
#[test]
fn the_real_probe_rs_takes_the_calls() {
    if Command::new("probe-rs").arg("--version").output().is_err() {
        eprintln!("skipped: probe-rs is not installed");
        return;
    }
    let folder = Folder::with("flash_real", "s.bzz", SCRIPT);
    folder.write("robot", firmware());
    // A type of probe without a USB device; with --dry-run it is never accessed.
    probe_rs::install(
        &folder,
        "PATH=\"${PATH#*:}\" exec probe-rs \"$@\" --dry-run --probe 1d50:6018:127.0.0.1:4455",
    );
    let outcome = probe_rs::bbz(&folder, &[&FLASH[..], &["--firmware", "robot"]].concat());
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
}
