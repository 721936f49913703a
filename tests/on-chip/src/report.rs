//! What is told of each image.

use bittybuzz_vm_core::{Fault, ImageError};

/// How an image ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Every entry returned.
    Complete,
    /// It needs more slices than the batch allows.
    GivenUp,
    /// A run-time error.
    Fault(Fault),
    /// It does not load.
    Refused(ImageError),
}

/// What is told of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Report {
    /// Of all that it did.
    pub hash: u32,
    /// How many slices it took.
    pub slices: u32,
    /// How it ended.
    pub end: End,
}

impl Report {
    /// Bytes of a line.
    pub const LENGTH: usize = 22;

    /// As a chip tells it: hash, slices and end in hexadecimal digits, and a newline.
    pub fn line(&self) -> [u8; Report::LENGTH] {
        let mut line = [b' '; Report::LENGTH];
        put(&mut line, 0, self.hash, 8);
        put(&mut line, 9, self.slices, 8);
        put(&mut line, 18, u32::from(self.end_code()), 3);
        line[Report::LENGTH - 1] = b'\n';
        line
    }

    /// Its digits: kind, and the number of the fault or refusal.
    fn end_code(&self) -> u16 {
        match self.end {
            End::Complete => 0x000,
            End::GivenUp => 0x100,
            End::Fault(fault) => 0x200 | fault.code as u16,
            End::Refused(error) => 0x300 | u16::from(error.to_code().0),
        }
    }
}

fn put(line: &mut [u8], at: usize, mut number: u32, digits: usize) {
    for place in line.iter_mut().skip(at).take(digits).rev() {
        let digit = number as u8 & 15;
        *place = if digit < 10 { b'0' + digit } else { b'a' - 10 + digit };
        number >>= 4;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_vm_core::{FaultCode, Type};

    #[test]
    fn a_line_has_every_digit() {
        let fault = Fault {
            code: FaultCode::OutOfMemory,
            position: 1,
            operands: [Type::Nil; 2],
            detail: 0,
        };
        let report = Report { hash: 0x0123_cdef, slices: 0x4567_89ab, end: End::Fault(fault) };
        assert_eq!(&report.line(), b"0123cdef 456789ab 20a\n");
        let report = Report { end: End::Refused(ImageError::TooManyJumps(7)), ..report };
        assert_eq!(&report.line(), b"0123cdef 456789ab 310\n");
    }
}
