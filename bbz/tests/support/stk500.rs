//! A simulated programmer on a pseudo-terminal, with an ATmega328P: the STK500's protocol (Atmel
//! AVR061), and memory with the properties of the data sheet (28.8): a chip erase clears flash,
//! EEPROM and lock bits, and writing to flash only changes ones to zeros.

use std::fs::File;
use std::io::{Read, Write};
use std::sync::{Arc, Mutex};
use std::thread;

use nix::pty::{OpenptyResult, openpty};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

const PAGE: usize = 128;

/// The chip.
pub struct Chip {
    pub flash: Vec<u8>,
    pub eeprom: Vec<u8>,
    pub lock: u8,
    /// The number of pages of flash that can be written before the programmer fails.
    pub pages_left: usize,
}

impl Chip {
    pub fn erased() -> Self {
        Chip { flash: vec![0xff; 0x8000], eeprom: vec![0xff; 0x400], lock: 0xff, pages_left: 1000 }
    }

    /// Executes an instruction of serial programming (data sheet, table 28-18).
    fn instruct(&mut self, instruction: [u8; 4]) -> u8 {
        match instruction {
            [0xac, 0x80, ..] => {
                *self = Chip { pages_left: self.pages_left, ..Chip::erased() };
                0
            }
            [0x30, _, at, _] => [0x1e, 0x95, 0x0f][usize::from(at)],
            [0x58, 0, ..] => self.lock,
            _ => 0,
        }
    }
}

/// The programmer; it ends with the test's process.
pub struct Programmer {
    pub port: String,
    pub chip: Arc<Mutex<Chip>>,
    // Kept open, so that a program can connect at any time.
    _end: File,
}

impl Programmer {
    pub fn with(chip: Chip) -> Self {
        let OpenptyResult { master, slave } = openpty(None, None).unwrap();
        let mut mode = tcgetattr(&slave).unwrap();
        cfmakeraw(&mut mode);
        tcsetattr(&slave, SetArg::TCSANOW, &mode).unwrap();
        let port = nix::unistd::ttyname(&slave).unwrap().display().to_string();
        let chip = Arc::new(Mutex::new(chip));
        let shared = Arc::clone(&chip);
        thread::spawn(move || serve(File::from(master), &shared));
        Programmer { port, chip, _end: File::from(slave) }
    }
}

const SYNCHRONIZE: u8 = 0x30;
/// The number of requests to synchronize of which the last is answered.
const REQUESTS: usize = 3;
const END: u8 = 0x20;
const IN_SYNC: u8 = 0x14;
const OK: u8 = 0x10;
const FAILED: u8 = 0x11;

fn serve(mut line: File, chip: &Mutex<Chip>) {
    let mut address = 0;
    // The requests to synchronize since the last answer.
    let mut requests = 0;
    let mut copy = line.try_clone().unwrap();
    let mut take = |length: usize| {
        let mut bytes = vec![0; length];
        copy.read_exact(&mut bytes).map(|()| bytes)
    };
    while let Ok(command) = take(1) {
        let chip = || chip.lock().unwrap();
        let answer = match command[0] {
            // Commands: synchronize, begin, end.
            SYNCHRONIZE | 0x50 | 0x51 => Some(vec![]),
            // Command: read a parameter of the programmer.
            0x41 => take(1).ok().map(|_| vec![2]),
            // Command: select the chip.
            0x42 => take(20).ok().map(|_| vec![]),
            0x45 => {
                let length = take(1).unwrap()[0];
                take(usize::from(length) - 1).ok().map(|_| vec![])
            }
            0x56 => take(4).ok().map(|i| vec![chip().instruct([i[0], i[1], i[2], i[3]])]),
            0x55 => take(2).ok().map(|low| {
                address = usize::from(u16::from_le_bytes([low[0], low[1]]));
                vec![]
            }),
            0x75 => Some(vec![0x1e, 0x95, 0x0f]),
            0x64 => {
                let head = take(3).unwrap();
                let bytes = take(usize::from(u16::from_be_bytes([head[0], head[1]]))).unwrap();
                write(&mut chip(), head[2], address, &bytes)
            }
            0x74 => {
                let head = take(3).unwrap();
                let length = usize::from(u16::from_be_bytes([head[0], head[1]]));
                let chip = chip();
                let (memory, at) = match head[2] {
                    b'F' => (&chip.flash, 2 * address),
                    _ => (&chip.eeprom, address),
                };
                Some(memory[at..at + length].to_vec())
            }
            other => panic!("avrdude sends {other:#04x}"),
        };
        assert_eq!(take(1).unwrap(), [END], "after {:#04x}", command[0]);
        // avrdude begins with three requests to synchronize. It discards what comes within 0.25 s of the first two, and waits for the
        // answer to the third. On a busy computer an answer to the others may come later, and would pass for that of the next command.
        if command[0] == SYNCHRONIZE {
            requests += 1;
            if requests < REQUESTS {
                continue;
            }
        }
        requests = 0;
        let reply = match answer {
            Some(answer) => [&[IN_SYNC][..], &answer, &[OK]].concat(),
            None => vec![IN_SYNC, FAILED],
        };
        line.write_all(&reply).unwrap();
    }
}

fn write(chip: &mut Chip, memory: u8, address: usize, bytes: &[u8]) -> Option<Vec<u8>> {
    if memory == b'E' {
        chip.eeprom[address..address + bytes.len()].copy_from_slice(bytes);
        return Some(vec![]);
    }
    assert!(bytes.len() <= PAGE, "{} bytes", bytes.len());
    chip.pages_left = chip.pages_left.checked_sub(1)?;
    for (old, new) in chip.flash[2 * address..].iter_mut().zip(bytes) {
        *old &= new;
    }
    Some(vec![])
}
