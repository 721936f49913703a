//! What scripts log. Text is made of it only when it is shown.

/// A line that a script has logged, or printed with a function of its robot.
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    /// When.
    pub tick: u64,
    /// Values, which follow each other without a gap.
    pub pieces: Vec<Piece>,
}

/// A value that was logged.
#[derive(Debug, Clone, PartialEq)]
pub enum Piece {
    /// nil
    Nil,
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
    /// A constant string of the script, by its number.
    Constant(u16),
    /// The bytes of a string that was made at run time.
    Text(Vec<u8>),
    /// A table with so many entries.
    Table(usize),
    /// A function.
    Function,
}
