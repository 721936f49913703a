//! Values as `log` prints them, on this computer and told by a robot.

use bittybuzz_vm_core::number::{format_float, format_int};

/// A value that is printed.
#[derive(Debug, Clone, PartialEq)]
pub enum Printed {
    Nil,
    Int(i32),
    Float(f32),
    /// The bytes of a string.
    Text(Vec<u8>),
    /// A table with so many entries.
    Table(usize),
    Function,
}

impl Printed {
    /// Appends what is printed. Values of one `log` follow each other without a gap.
    pub fn append_to(&self, line: &mut Vec<u8>) {
        match self {
            Printed::Nil => line.extend(b"[nil]"),
            Printed::Int(value) => format_int(*value, &mut |byte| line.push(byte)),
            Printed::Float(value) => format_float(*value, &mut |byte| line.push(byte)),
            Printed::Text(text) => line.extend(text),
            Printed::Table(size) => line.extend(format!("[table with {size} elems]").bytes()),
            Printed::Function => line.extend(b"[closure]"),
        }
    }
}

/// What stands for a constant string whose text is not known.
pub fn unknown_string(number: u16) -> Vec<u8> {
    format!("[string {number}]").into_bytes()
}
