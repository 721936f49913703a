//! Buzz assembly text to the bytes of a `.bo` file, as the reference assembler does it.

use std::collections::HashMap;

use bittybuzz_compiler::bo::instruction::{OperandForm, TABLE};

/// Assembles a text whose lines may also be separated by ` / `.
pub fn assemble(text: &str) -> Vec<u8> {
    let lines = text.lines().flat_map(|line| line.split(" / "));
    assemble_lines(lines.map(|line| line.trim_start_matches([' ', '\t'])))
}

/// Assembles lines.
pub fn assemble_lines<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut labels = HashMap::new();
    let mut fixups: Vec<(usize, String)> = Vec::new();
    for line in lines {
        if let Some(string) = line.strip_prefix('\'') {
            bytes.extend(string.as_bytes());
            bytes.push(0);
            continue;
        }
        let line = line.trim_end();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if let Some(count) = line.strip_prefix('!') {
            bytes.extend(count.parse::<u16>().expect("a string count").to_le_bytes());
        } else if let Some(label) = line.strip_prefix('@') {
            labels.insert(label.to_owned(), bytes.len());
        } else {
            let (mnemonic, argument) = line.split_once(' ').unwrap_or((line, ""));
            let opcode = TABLE.iter().position(|(name, _)| *name == mnemonic);
            let opcode = opcode.unwrap_or_else(|| panic!("no instruction `{mnemonic}`"));
            bytes.push(opcode as u8);
            match (TABLE[opcode].1, argument.strip_prefix('@')) {
                (OperandForm::Plain(_), _) => assert_eq!(argument, "", "{line}"),
                (_, Some(label)) => {
                    fixups.push((bytes.len(), label.to_owned()));
                    bytes.extend([0; 4]);
                }
                (OperandForm::Float(_), None) => {
                    bytes.extend(argument.parse::<f32>().expect("a float").to_le_bytes());
                }
                (_, None) => {
                    bytes.extend(argument.parse::<i32>().expect("an integer").to_le_bytes());
                }
            }
        }
    }
    for (at, label) in fixups {
        let target = *labels.get(&label).unwrap_or_else(|| panic!("no label `{label}`"));
        bytes[at..at + 4].copy_from_slice(&(target as i32).to_le_bytes());
    }
    bytes
}
