//! Tests of simavr's instructions against squeeze's interpreter, which proves squeeze's output. The
//! two models of the AVR share no code.
//!
//! `avr-as` assembles the machine code, so a third program reads the instructions' texts.

use std::fmt::Write;
use std::fs;
use std::process::Command;

use bittybuzz_chips::Random;
use bittybuzz_kilobot_board::Kilobot;
use bittybuzz_squeeze::proof::cpu::{Cpu, DataSpace, Successor};
use bittybuzz_squeeze::proof::decode::{AsmOperation, decode};

use super::*;

/// The number of states in which each instruction is executed.
const STATES: u64 = 60;
/// The middle of the addresses to which pointers and the stack point.
const MIDDLE: u16 = 0x400;

/// Mixes the bits of a number.
fn mix(value: u64) -> u64 {
    Random::new(value).bits()
}

/// Returns instructions with all kinds of operands.
fn texts() -> Vec<String> {
    let mut texts = Vec::new();
    let mut random = 1;
    let mut below = |limit: u64| {
        random = mix(random);
        random % limit
    };
    for round in 0..4 {
        for name in
            ["add", "adc", "sub", "sbc", "and", "or", "eor", "cp", "cpc", "mov", "cpse", "mul"]
        {
            texts.push(format!("{name} r{}, r{}", below(32), below(32)));
        }
        for name in ["subi", "sbci", "andi", "ori", "cpi", "ldi", "sbr", "cbr"] {
            texts.push(format!("{name} r{}, {}", 16 + below(16), below(256)));
        }
        for name in
            ["com", "neg", "inc", "dec", "lsr", "ror", "asr", "swap", "lsl", "rol", "tst", "clr"]
        {
            texts.push(format!("{name} r{}", below(32)));
        }
        texts.push(format!("ser r{}", 16 + below(16)));
        texts.push(format!("muls r{}, r{}", 16 + below(16), 16 + below(16)));
        texts.push(format!("mulsu r{}, r{}", 16 + below(8), 16 + below(8)));
        texts.push(format!("movw r{}, r{}", 2 * below(16), 2 * below(16)));
        for name in ["adiw", "sbiw"] {
            texts.push(format!("{name} r{}, {}", 24 + 2 * below(4), below(64)));
        }
        for name in ["bst", "bld", "sbrs", "sbrc"] {
            texts.push(format!("{name} r{}, {}", below(32), below(8)));
        }
        for flag in ["c", "z", "n", "v", "s", "h", "t", "i"] {
            texts.extend([format!("se{flag}"), format!("cl{flag}")]);
        }
        // A register below r26, because X, Y and Z are r26 to r31.
        let register = below(26);
        for pointer in ["X", "X+", "-X", "Y", "Y+", "-Y", "Z", "Z+", "-Z"] {
            texts.push(format!("ld r{register}, {pointer}"));
            texts.push(format!("st {pointer}, r{}", below(32)));
        }
        for pointer in ["Y", "Z"] {
            texts.push(format!("ldd r{}, {pointer}+{}", below(32), below(64)));
            texts.push(format!("std {pointer}+{}, r{}", below(64), below(32)));
        }
        texts.push(format!("lds r{}, {}", below(32), 0x300 + below(0x200)));
        texts.push(format!("sts {}, r{}", 0x300 + below(0x200), below(32)));
        for pointer in ["Z", "Z+"] {
            texts.push(format!("lpm r{register}, {pointer}"));
        }
        texts.push(format!("push r{}", below(32)));
        texts.push(format!("pop r{}", below(32)));
        for address in [61, 62, 63] {
            texts.push(format!("in r{}, {address}", below(32)));
        }
        texts.push(format!("out 63, r{}", below(32)));
        if round == 0 {
            texts.extend(["lpm", "nop"].map(str::to_owned));
        }
    }
    texts
}

/// The RAM and flash of squeeze's interpreter.
struct Memory<'a> {
    data: Vec<u8>,
    flash: &'a [u8],
}

impl DataSpace for Memory<'_> {
    fn load(&mut self, address: u16) -> u8 {
        self.data[usize::from(address)]
    }

    fn store(&mut self, address: u16, value: u8) {
        self.data[usize::from(address)] = value;
    }

    fn load_flash(&mut self, address: u16) -> u8 {
        self.flash[usize::from(address)]
    }

    fn pop(&mut self, address: u16) -> u8 {
        self.data[usize::from(address)]
    }

    fn push(&mut self, address: u16, value: u8) {
        self.data[usize::from(address)] = value;
    }

    fn special(&mut self, name: &'static str) {
        panic!("{name} is not compared");
    }
}

/// Returns the machine code of each instruction, with two others of one word after it.
fn assemble(texts: &[String]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let [source, object, binary] = ["a.s", "a.o", "a.bin"].map(|name| folder.path().join(name));
    let mut assembly = String::new();
    for (number, text) in texts.iter().enumerate() {
        let _ = writeln!(assembly, "\t.org {}\n\t{text}\n\tnop\n\tnop", number * 8);
    }
    let _ = writeln!(assembly, "\t.org {}", texts.len() * 8);
    fs::write(&source, assembly).unwrap();
    let assembler =
        Command::new("avr-as").arg("-mmcu=atmega328p").arg("-o").arg(&object).arg(&source).status();
    assert!(assembler.unwrap().success());
    let copy =
        Command::new("avr-objcopy").args(["-O", "binary"]).arg(&object).arg(&binary).status();
    assert!(copy.unwrap().success());
    fs::read(&binary).unwrap()
}

#[test]
fn simavr_and_the_proof_agree_on_every_instruction() {
    let texts = texts();
    let code = assemble(&texts);
    assert!(code.len() <= SimavrChip::Atmega328p.flash_size());
    let mut core = AvrCore::new(SimavrChip::Atmega328p);
    core.write_flash(0, &code);
    let flash = core.flash().to_vec();
    let ram: Vec<u8> = (0..DATA as u64).map(|place| mix(place) as u8).collect();
    let mut board = Kilobot::new(1);
    for (number, text) in texts.iter().enumerate() {
        let (name, operands) = text.split_once(' ').unwrap_or((text, ""));
        let op = decode(name, operands).unwrap_or_else(|error| panic!("{text}: {error}"));
        let length =
            if matches!(op, AsmOperation::ReadAt(..) | AsmOperation::WriteAt(..)) { 4 } else { 2 };
        for state in 0..STATES {
            let random = |place: u64| {
                let bits = mix(state << 32 ^ (number as u64) << 40 ^ mix(place));
                // Values at the limits would be rare otherwise.
                if bits & 0x300 == 0 {
                    [0, 1, 0x7f, 0x80, 0xff][(bits >> 16) as usize % 5]
                } else {
                    bits as u8
                }
            };
            let mut registers: [u8; 32] = std::array::from_fn(|place| random(place as u64));
            if matches!(
                op,
                AsmOperation::Read(..) | AsmOperation::Write(..) | AsmOperation::ReadFlash(..)
            ) {
                for pair in [26, 28, 30] {
                    registers[pair] ^= MIDDLE as u8;
                    registers[pair + 1] = (MIDDLE >> 8) as u8 | registers[pair + 1] & 1;
                }
            }
            let flags = random(100);
            let stack = MIDDLE + u16::from(random(101));
            let pc = (number * 8) as u32;

            core.data().copy_from_slice(&ram);
            core.data()[..32].copy_from_slice(&registers);
            core.set_stack_pointer(stack);
            core.avr.sreg = std::array::from_fn(|bit| flags >> bit & 1);
            core.avr.pc = pc;
            let before = core.cycle();
            core.run(&mut board, 1);
            let after = (core.avr.pc, core.cycle() - before);
            let simavr_flags = (0..8).fold(0, |all, bit| all | core.avr.sreg[bit] << bit);

            let mut memory = Memory { data: ram.clone(), flash: &flash };
            let mut cpu = Cpu { registers, flags, stack, cycles: 0 };
            let control = cpu.execute(&op, &mut memory);
            let skipped = if control == Successor::Skip { 2 } else { 0 };

            let context = format!("{text} in state {state}: {registers:x?}, SREG {flags:#04x}");
            assert_eq!(core.data()[..32], cpu.registers, "{context}");
            assert_eq!(simavr_flags, cpu.flags, "{context}");
            assert_eq!(core.stack_pointer(), cpu.stack, "{context}");
            assert_eq!(after, (pc + length + skipped, u64::from(cpu.cycles)), "{context}");
            assert!(
                core.data()[usize::from(RAM)..] == memory.data[usize::from(RAM)..],
                "{context}"
            );
        }
    }
}

#[test]
fn a_larger_chip_has_flash_where_the_smaller_one_repeats_its_own() {
    // jmp 0x9000
    const JUMP: [u8; 4] = [0x0c, 0x94, 0x00, 0x48];
    for (chip, pc) in [(SimavrChip::Atmega328p, 0x1000), (SimavrChip::Atmega1284p, 0x9000)] {
        let mut core = AvrCore::new(chip);
        core.write_flash(0, &JUMP);
        core.run(&mut Kilobot::new(1), 1);
        assert_eq!(core.pc(), pc, "{chip:?}");
        core.write_flash(usize::from(pc), &JUMP);
        assert_eq!(core.flash()[usize::from(pc)..][..4], JUMP);
    }
}
