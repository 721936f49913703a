//! Examples of the Kilobot, built with squeeze and without: both images do the same in each step (tests/hil/tests/squeezed.rs).
//!
//! The image without squeeze runs on a chip with more flash where it does not fit the Kilobot's.

use super::kilobots::{examples, keeps_pace};
use crate::Verdict;
use anyhow::Result;
use bittybuzz_builds::board::{KILOBOT, target_of};
use bittybuzz_builds::cargo_test::image_tests;
use bittybuzz_builds::elf;
use bittybuzz_builds::shell::{Invocation, root, target};
use bittybuzz_vm_core::Parts;
use fs_err as fs;
use std::path::{Path, PathBuf};

/// Bytes of flash that a Kilobot has.
const FLASH: u64 = 0x8000;

/// The example that CI tries: its image fits a Kilobot without squeeze.
pub const SAMPLE: &str = "examples/kilobot/random_walk.bzz";

/// One example for each set of parts of the machine, of those that complete a step in each tick.
pub fn items() -> Vec<String> {
    let mut sets: Vec<Parts> = Vec::new();
    let is_new = |example: &String| {
        let script = root().join(example);
        let parts = KILOBOT.parts(Some(&script)).ok();
        let is_paced = fs::read_to_string(&script).is_ok_and(|text| keeps_pace(&text));
        match parts {
            Some(parts) if is_paced && !sets.contains(&parts) => {
                sets.push(parts);
                true
            }
            _ => false,
        }
    };
    examples().into_iter().filter(is_new).collect()
}

/// Compares the two images of an example.
pub fn run(example: &str) -> Result<Verdict> {
    let folder = target()?.join("soak/squeezed");
    fs::create_dir_all(&folder)?;
    let squeezed = build(example, &folder.join("squeezed.elf"), true)?;
    let plain = build(example, &folder.join("plain.elf"), false)?;
    let squeezed_bytes = elf::footprint(&squeezed)?.flash;
    let plain_bytes = elf::footprint(&plain)?.flash;
    let chip = if plain_bytes > FLASH { "atmega1284p" } else { "atmega328p" };
    let output = image_tests(&["squeezed::", "--ignored", "--nocapture"])?
        .env("BITTYBUZZ_SQUEEZED", &squeezed.display().to_string())
        .env("BITTYBUZZ_PLAIN", &plain.display().to_string())
        .env("BITTYBUZZ_PLAIN_CHIP", chip)
        .output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout);
    let compared = printed.lines().find_map(|line| line.strip_prefix("compared: "));
    Ok(match compared {
        Some(compared) if output.status.success() => Verdict::Shown(format!(
            "{squeezed_bytes} bytes and {plain_bytes} on an {chip}: {compared}"
        )),
        _ => Verdict::Missing(printed.into_owned()),
    })
}

/// Builds an example into that file.
fn build(example: &str, file: &Path, is_squeezed: bool) -> Result<PathBuf> {
    let line = Invocation::cargo(&[&["build", "--release"], &KILOBOT.alone()[..]].concat())
        .env("BBZ_SCRIPT", &root().join(example).display().to_string())
        .env("BBZ_PARTS", "used");
    let line = if is_squeezed { line } else { line.env("BBZ_SQUEEZE", "off") };
    line.in_workspace(KILOBOT.folder).unannounced().run()?;
    let image = KILOBOT.image_in(&target_of(KILOBOT.folder));
    fs::copy(&image, file)?;
    Ok(file.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_set_of_parts_has_one_example() {
        let parts = |example: &String| KILOBOT.parts(Some(&root().join(example))).unwrap();
        let items = items();
        let sets: Vec<Parts> = items.iter().map(parts).collect();
        assert!(sets.len() > 3, "{items:?}");
        assert!(
            examples()
                .iter()
                .filter(|example| *example != "examples/dice.bzz")
                .all(|example| { sets.iter().filter(|set| **set == parts(example)).count() == 1 })
        );
    }
}
