//! Reads a `.bo` file: the number of strings, the strings, the instructions. All integers are
//! little-endian.

use crate::bo::error::{BoCause, BoError};
use crate::bo::instruction::{BoAction, BoInstruction, OperandForm, TABLE};
use crate::include::SOURCE_BYTES_MAX;

/// A `.bo` file whose numbers are all in range. The combined effect of its instructions is not
/// checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Bo {
    /// Strings by number.
    pub strings: Vec<String>,
    /// Instructions in the order of the file.
    pub code: Vec<BoInstruction>,
    /// Length of the file in bytes.
    pub length: usize,
}

impl Bo {
    /// Reads a file.
    pub fn read(bytes: &[u8]) -> Result<Bo, BoError> {
        if bytes.len() > SOURCE_BYTES_MAX {
            return Err(BoError { offset: SOURCE_BYTES_MAX, cause: BoCause::TooLarge });
        }
        let mut reader = BoReader { bytes, at: 0 };
        let strings = reader.strings()?;
        let raw = reader.instructions()?;
        let mut code = Vec::with_capacity(raw.len());
        for &Raw { offset, mnemonic, form, argument } in &raw {
            let fail = |cause| Err(BoError { offset, cause });
            let number = argument as i32;
            let action = match form {
                OperandForm::Plain(action) => action,
                OperandForm::Float(make) => make(f32::from_bits(argument)),
                OperandForm::Int(make) => make(number),
                OperandForm::String(make) => match usize::try_from(number) {
                    Ok(string) if string < strings.len() => make(string),
                    _ => return fail(BoCause::UnknownString(number)),
                },
                OperandForm::Locals(make) => match u32::try_from(number) {
                    Ok(locals) => make(locals),
                    Err(_) => return fail(BoCause::NegativeLocal(number)),
                },
                OperandForm::Address(make) => {
                    let to = usize::try_from(number).ok();
                    match to.and_then(|to| raw.binary_search_by_key(&to, |raw| raw.offset).ok()) {
                        Some(index) => make(index),
                        None => return fail(BoCause::UnknownAddress(number)),
                    }
                }
            };
            code.push(BoInstruction { offset, mnemonic, action });
        }
        Ok(Bo { strings, code, length: bytes.len() })
    }

    /// Returns the action of an instruction, or `Nop` after the last one.
    pub fn action(&self, at: usize) -> BoAction {
        self.code.get(at).map_or(BoAction::Nop, |instruction| instruction.action)
    }

    /// Returns the offset of an instruction, or the length of the file after the last one.
    pub fn offset(&self, at: usize) -> usize {
        self.code.get(at).map_or(self.length, |instruction| instruction.offset)
    }

    /// Returns an error at an instruction.
    pub fn error(&self, at: usize, cause: BoCause) -> BoError {
        BoError { offset: self.offset(at), cause }
    }

    /// Returns the text of a string.
    pub fn string(&self, number: usize) -> &str {
        self.strings.get(number).map_or("", String::as_str)
    }
}

/// An instruction before addresses are resolved.
#[derive(Clone, Copy)]
struct Raw {
    offset: usize,
    mnemonic: &'static str,
    form: OperandForm,
    argument: u32,
}

struct BoReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl BoReader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let taken = self.bytes.get(self.at..)?.first_chunk::<N>()?;
        self.at += N;
        Some(*taken)
    }

    fn strings(&mut self) -> Result<Vec<String>, BoError> {
        let count = self
            .take()
            .map(u16::from_le_bytes)
            .ok_or(BoError { offset: 0, cause: BoCause::NoStringCount })?;
        let mut strings = Vec::with_capacity(usize::from(count));
        for number in 0..usize::from(count) {
            let offset = self.at;
            let rest = &self.bytes[offset..];
            let Some(length) = rest.iter().position(|byte| *byte == 0) else {
                return Err(BoError { offset, cause: BoCause::StringCut(number) });
            };
            let Ok(text) = std::str::from_utf8(&rest[..length]) else {
                return Err(BoError { offset, cause: BoCause::StringNotUtf8(number) });
            };
            strings.push(text.to_owned());
            self.at += length + 1;
        }
        Ok(strings)
    }

    fn instructions(&mut self) -> Result<Vec<Raw>, BoError> {
        let mut raw = Vec::new();
        loop {
            let offset = self.at;
            let Some([opcode]) = self.take() else { return Ok(raw) };
            let Some(&(mnemonic, form)) = TABLE.get(usize::from(opcode)) else {
                return Err(BoError { offset, cause: BoCause::UnknownOpcode(opcode) });
            };
            let argument = match form {
                OperandForm::Plain(_) => 0,
                _ => self
                    .take()
                    .map(u32::from_le_bytes)
                    .ok_or(BoError { offset, cause: BoCause::ArgumentCut(mnemonic) })?,
            };
            raw.push(Raw { offset, mnemonic, form, argument });
        }
    }
}
