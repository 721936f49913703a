//! Files that programs make: images, symbols, objects, firmware and recordings.

use bittybuzz_random::Random;

use super::Entry;
use crate::bases::{Bases, SCENARIO, SCRIPT};
use crate::case::Case;
use crate::mutation::{
    any_mutated, any_truncated, below, changed_text, mutated, noise, one, truncated,
};

pub const KINDS: &[Entry] = &[
    ("image-mutated", |bases, random, _| {
        let image = mutated(random, &bases.image);
        image_call(bases, random, image)
    }),
    ("image-noise", |bases, random, _| {
        let head = below(random, 12);
        let image = [&bases.image[..head], &noise(random, 600)].concat();
        image_call(bases, random, image)
    }),
    ("image-truncated", |bases, random, _| {
        let image = truncated(random, &bases.image);
        image_call(bases, random, image)
    }),
    ("symbols-mutated", |bases, random, _| {
        let symbols = mutated(random, &bases.symbols);
        symbols_call(bases, random, symbols)
    }),
    ("symbols-words", |bases, random, _| {
        let words = [
            "{",
            "}",
            "[",
            "]",
            ",",
            ":",
            "\"",
            "-1",
            "1e99",
            "null",
            "4294967296",
            "\"\\u001b[2J\"",
        ];
        let symbols = String::from_utf8_lossy(&bases.symbols).into_owned();
        let symbols = changed_text(random, &symbols, &words);
        symbols_call(bases, random, symbols.into_bytes())
    }),
    ("symbols-truncated", |bases, random, _| {
        let symbols = truncated(random, &bases.symbols);
        symbols_call(bases, random, symbols)
    }),
    ("object-mutated", |bases, random, _| {
        let object = any_mutated(random, &bases.objects);
        object_call(random, object)
    }),
    ("object-truncated", |bases, random, _| {
        let object = any_truncated(random, &bases.objects);
        object_call(random, object)
    }),
    ("elf-mutated", |_, random, _| {
        let firmware = mutated(random, &elf());
        firmware_call(random, "f.elf", firmware)
    }),
    ("hex-mutated", |_, random, _| {
        let firmware = mutated(random, &hex());
        firmware_call(random, "f.hex", firmware)
    }),
    ("recording-mutated", |bases, random, _| {
        let recording = any_mutated(random, &bases.recordings);
        Case::new(["view", "r.bbr", "--no-browser"]).with("r.bbr", recording)
    }),
    ("recording-truncated", |bases, random, _| {
        let recording = any_truncated(random, &bases.recordings);
        Case::new(["view", "r.bbr", "--no-browser"]).with("r.bbr", recording)
    }),
    ("recording-bomb", |_, random, _| {
        let bomb = bomb(random);
        Case::new(["view", "r.bbr", "--no-browser"]).with("r.bbr", bomb)
    }),
];

/// Returns a call that reads the image `i.bbi`.
fn image_call(bases: &Bases, random: &mut Random, image: Vec<u8>) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["disasm", "i.bbi"][..],
            &["disasm", "i.bbi", "--robot", "kilobot"],
            &["run", "i.bbi", "--robot", "kilobot", "--steps", "3"],
            &["run", "i.bbi", "--steps", "2", "--json"],
            &["flash", "i.bbi", "--robot", "crazyflie", "--dry-run"],
            &["sim", "s.toml", "--headless"],
        ],
    );
    let scenario = SCENARIO.replace("s.bzz", "i.bbi");
    let case = Case::new(arguments).with("i.bbi", image).with("s.toml", scenario);
    if random.chance(0.5) { case.with("i.sym", bases.symbols.clone()) } else { case }
}

/// Returns a call that reads the symbols `i.sym`.
fn symbols_call(bases: &Bases, random: &mut Random, symbols: Vec<u8>) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["disasm", "i.bbi"][..],
            &["run", "i.bbi", "--robot", "kilobot", "--steps", "3"],
            &["trace", "-", "--robot", "kilobot", "--script", "i.sym"],
        ],
    );
    let mut case = Case::new(arguments).with("i.bbi", bases.image.clone()).with("i.sym", symbols);
    case.stdin = b"ir 080100abcd060708090afeff\n".repeat(3);
    case
}

/// Returns a call that reads the object `o.bo`.
fn object_call(random: &mut Random, object: Vec<u8>) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["check", "o.bo"][..],
            &["build", "o.bo", "--robot", "kilobot", "-o", "out"],
            &["run", "o.bo", "--steps", "3"],
            &["disasm", "o.bo"],
        ],
    );
    let case = Case::new(arguments).with("o.bo", object).writing("out.bbi").writing("out.sym");
    if random.chance(0.3) { case.with("o.bdb", noise(random, 200)) } else { case }
}

/// Returns a call that reads firmware.
fn firmware_call(random: &mut Random, name: &str, firmware: Vec<u8>) -> Case {
    let robot = one(random, &["kilobot", "crazyflie", "zooids"]);
    let build = ["build", "s.bzz", "--robot", robot, "--firmware", name, "-o", "out"];
    let flash = ["flash", "s.bzz", "--robot", robot, "--firmware", name, "--dry-run"];
    let case = if random.chance(0.5) { Case::new(build) } else { Case::new(flash) };
    let outputs = ["out", "out.bbi", "out.sym", "out.elf", "out.hex"];
    let case = case.with("s.bzz", SCRIPT).with(name, firmware);
    outputs.into_iter().fold(case, Case::writing)
}

/// Returns an executable for ARM with one segment (ELF specification, figures 1-3 and 2-1).
fn elf() -> Vec<u8> {
    let mut file = b"\x7fELF\x01\x01\x01".to_vec();
    file.resize(16, 0);
    // Type and machine, then entry, tables, flags, and sizes of the headers.
    file.extend([2, 0, 40, 0].iter());
    for word in [1_u32, 0, 52, 0, 0] {
        file.extend(word.to_le_bytes());
    }
    for half in [52_u16, 32, 1, 40, 0, 0] {
        file.extend(half.to_le_bytes());
    }
    for word in [1_u32, 84, 0x0800_0000, 0x0800_0000, 256, 256, 5, 4] {
        file.extend(word.to_le_bytes());
    }
    file.extend((0..=255).collect::<Vec<u8>>());
    file
}

/// Returns a program in the format of Intel.
fn hex() -> Vec<u8> {
    let mut text = String::new();
    for line in 0..16_u16 {
        let address = line * 16;
        let [high, low] = address.to_be_bytes();
        let data: Vec<u8> = (0..16).map(|byte| byte * 3).collect();
        let bytes = [&[16, high, low, 0][..], &data].concat();
        let sum = bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)).wrapping_neg();
        let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        text += &format!(":{digits}{sum:02X}\n");
    }
    (text + ":00000001FF\n").into_bytes()
}

/// Returns a small recording that promises much: many robots, obstacles and samples.
fn bomb(random: &mut Random) -> Vec<u8> {
    let mut file = b"bbzrec\x04".to_vec();
    let many = || [1_u64 << 16, 1 << 20, 1 << 32, u64::MAX];
    let number = many()[below(random, 4)];
    for _ in 0..3 {
        put(&mut file, 100);
    }
    match random.below(4) {
        // Robots that the file has, and empty samples after them.
        0 => {
            let count = 1 << (10 + below(random, 9));
            put(&mut file, count);
            (0..count).for_each(|_| file.extend([0, 0]));
            file.extend([0, 0, 0]);
            (0..300).for_each(|_| file.extend([1, 0]));
        }
        // Robots that it does not have.
        1 => put(&mut file, number),
        2 => {
            file.push(0);
            put(&mut file, number);
        }
        _ => {
            file.extend([0, 0, 0, 0]);
            (0..1 << (10 + below(random, 9))).for_each(|_| file.extend([1, 0]));
        }
    }
    file
}

/// Writes a number in LEB128.
fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}
