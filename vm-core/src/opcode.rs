//! The instruction set. Every opcode stands here once, with its byte, operand, stack effect and
//! meaning. Compiler, verifier, interpreter, disassembler and documentation all use this table.
//!
//! # Encoding
//! | first byte | form |
//! |---|---|
//! | `0x00..=0x3f` | plain: no operand |
//! | `0x40..=0x7f` | narrow: one signed byte follows |
//! | `0x80..=0xbf` | short: the operand is in the byte itself, see [`Short`] |
//! | `0xc0..=0xff` | wide: the narrow opcode with bit 7 set, a signed little-endian 16-bit operand follows |
//!
//! Some opcodes are followed by one more byte or by a literal word of the profile, see [`Trailer`].
//! A jump operand counts from the byte after the whole instruction.
//!
//! # Stack effects
//! `a b -- c` means that b is on top and popped first. `locals` are addressed from the frame's
//! record: parameter i of n is at offset `i - n`, and the slots above the record are at 1, 2, ...
//! (see `machine/mod.rs`).

/// The bytes after opcode and operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trailer {
    /// No bytes.
    None,
    /// One byte: an argument count, see [`DROP_RESULT`].
    Arguments,
    /// One byte: the number of captured values that are popped.
    Captures,
    /// One signed byte.
    Immediate,
    /// Three bytes: the byte that [`relation_of_local`] reads, and a signed number of two bytes.
    LocalImmediate,
    /// A literal of the profile: 2 bytes in `tiny`, 4 in `full`, little-endian.
    Word,
    /// The upper two bytes of a literal whose others are zero.
    Half,
}

impl Trailer {
    /// Returns the number of bytes in a profile whose literals have `word_bytes`.
    pub const fn length(self, word_bytes: usize) -> usize {
        match self {
            Trailer::None => 0,
            Trailer::Arguments | Trailer::Captures | Trailer::Immediate => 1,
            Trailer::Half => 2,
            Trailer::LocalImmediate => 3,
            Trailer::Word => word_bytes,
        }
    }
}

/// The bit of an argument count that drops the result instead of pushing it.
pub const DROP_RESULT: u8 = 0x80;

/// The meaning of an operand. The numbers from [`Operand::Global`] to [`Operand::String`] are the
/// positions of their counts in an image's header. The verifier compares operands from
/// [`Operand::Global`] to [`Operand::Count`] with a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Operand {
    /// The instruction has no operand.
    None = 0,
    /// An integer value.
    Int = 1,
    /// Distance of a jump.
    Jump = 2,
    /// Offset of a local from the frame record.
    Local = 3,
    /// Number of a global.
    Global = 4,
    /// Number of a script function.
    Function = 5,
    /// Number of an imported robot function.
    Robot = 6,
    /// Number of a string.
    String = 7,
    /// Number of a built-in, [`crate::builtin`].
    Builtin = 8,
    /// Number of a library value, [`crate::builtin::Library`].
    Library = 9,
    /// Count of arguments.
    Count = 10,
    /// Number of a captured value.
    Capture = 11,
    /// Count of parameters of the function that holds the instruction.
    Parameters = 12,
}

/// Returns the row of a plain or narrow opcode.
pub fn info(opcode: u8) -> Option<&'static OpcodeInfo> {
    TABLE.iter().find(|info| info.byte == opcode)
}

/// A row of the instruction table.
#[derive(Debug, Clone, Copy)]
pub struct OpcodeInfo {
    /// The name that the disassembler prints.
    pub name: &'static str,
    /// First byte in plain or narrow form.
    pub byte: u8,
    /// Meaning of the operand.
    pub operand: Operand,
    /// The bytes after opcode and operand.
    pub trailer: Trailer,
    /// The number of values that are popped, without the arguments and captures that operand or
    /// trailer count.
    pub pops: u8,
    /// The number of values that are pushed.
    pub pushes: u8,
    /// One line of explanation.
    pub meaning: &'static str,
}

macro_rules! opcodes {
    ($($name:ident = $byte:literal, $operand:ident, $trailer:ident, $pops:literal -- $pushes:literal, $meaning:literal;)*) => {
        $(#[doc = $meaning] pub const $name: u8 = $byte;)*

        /// Every instruction, by byte.
        pub const TABLE: &[OpcodeInfo] = &[$(OpcodeInfo {
            name: stringify!($name), byte: $byte, operand: Operand::$operand, trailer: Trailer::$trailer,
            pops: $pops, pushes: $pushes, meaning: $meaning,
        },)*];
    };
}

opcodes! {
    // Plain.
    NIL = 0x1f, None, None, 0 -- 1, "-- nil";
    NOT = 0x20, None, None, 1 -- 1, "a -- 1 if a is false, else 0";
    LT = 0x21, None, None, 2 -- 1, "a b -- a < b";
    EQ = 0x22, None, None, 2 -- 1, "a b -- a == b";
    LE = 0x23, None, None, 2 -- 1, "a b -- a <= b";
    GT = 0x24, None, None, 2 -- 1, "a b -- a > b";
    NE = 0x25, None, None, 2 -- 1, "a b -- a != b";
    GE = 0x26, None, None, 2 -- 1, "a b -- a >= b";
    TRUTH = 0x27, None, None, 1 -- 1, "a -- 0 if a is false, else 1";
    UNSET = 0x28, None, None, 0 -- 1, "-- unset: stands for an argument that the caller did not pass";
    DUP = 0x29, None, None, 1 -- 2, "a -- a a";
    FLOAT_HALF = 0x2a, None, Half, 0 -- 1, "-- float literal that two bytes hold: shorter in `full`";
    FLOAT = 0x2b, None, Word, 0 -- 1, "-- float literal";
    INT_WORD = 0x2c, None, Word, 0 -- 1, "-- integer literal that needs a whole word";
    NEG = 0x2d, None, None, 1 -- 1, "a -- -a";
    BNOT = 0x2e, None, None, 1 -- 1, "a -- !a";
    TABLE_NEW = 0x2f, None, None, 0 -- 1, "-- {}";
    INDEX_INIT = 0x30, None, None, 3 -- 1, "t k v -- t: t[k] = v";
    INDEX_METHOD = 0x31, None, None, 2 -- 2, "t k -- t t[k]: the function is not bound, CALL_METHOD passes t";
    ROBOT_ID = 0x32, None, None, 0 -- 1, "-- id of this robot";

    // Arithmetic that is rare, next to the frequent one below.
    BAND = 0x33, None, None, 2 -- 1, "a b -- a & b";
    BOR = 0x34, None, None, 2 -- 1, "a b -- a | b";
    SHL = 0x35, None, None, 2 -- 1, "a b -- a << b";
    SHR = 0x36, None, None, 2 -- 1, "a b -- a >> b: arithmetic";
    POW = 0x37, None, None, 2 -- 1, "a b -- a ^ b: a float";

    // Plain and frequent: next to those with an operand, so that the interpreter finds all of them by one table.
    POP = 0x38, None, None, 1 -- 0, "a --";
    ADD = 0x39, None, None, 2 -- 1, "a b -- a + b";
    SUB = 0x3a, None, None, 2 -- 1, "a b -- a - b";
    MUL = 0x3b, None, None, 2 -- 1, "a b -- a * b";
    DIV = 0x3c, None, None, 2 -- 1, "a b -- a / b: integers truncate";
    MOD = 0x3d, None, None, 2 -- 1, "a b -- a % b: Euclidean";
    INDEX_GET = 0x3e, None, None, 2 -- 1, "t k -- t[k]";
    INDEX_SET = 0x3f, None, None, 3 -- 0, "t k v --: t[k] = v";

    // Narrow, or wide with bit 7.
    INT = 0x40, Int, None, 0 -- 1, "-- operand";
    STRING = 0x41, String, None, 0 -- 1, "-- constant string";
    FUNCTION = 0x42, Function, None, 0 -- 1, "-- script function that captures nothing";
    BUILTIN = 0x43, Builtin, None, 0 -- 1, "-- built-in function";
    ROBOT = 0x44, Robot, None, 0 -- 1, "-- robot function";
    LIBRARY = 0x45, Library, None, 0 -- 1, "-- library such as `math`";
    LOCAL_GET = 0x46, Local, None, 0 -- 1, "-- local; a fault if it is an argument that was not passed";
    LOCAL_SET = 0x47, Local, None, 1 -- 0, "a --: local = a";
    GLOBAL_GET = 0x48, Global, None, 0 -- 1, "-- global";
    GLOBAL_SET = 0x49, Global, None, 1 -- 0, "a --: global = a";
    CAPTURE_GET = 0x4a, Capture, None, 0 -- 1, "-- captured value";
    FIELD_GET = 0x4b, String, None, 1 -- 1, "t -- t.name";
    FIELD_SET = 0x4c, String, None, 2 -- 0, "t v --: t.name = v";
    FIELD_INIT = 0x4d, String, None, 2 -- 1, "t v -- t: t.name = v";
    FIELD_METHOD = 0x4e, String, None, 1 -- 2, "t -- t t.name: not bound, CALL_METHOD passes t";
    CALL = 0x4f, Count, None, 1 -- 1, "f args -- result";
    CALL_METHOD = 0x50, Count, None, 2 -- 1, "t f args -- result: self is t";
    CALL_FUNCTION = 0x51, Function, None, 0 -- 1, "args -- result: exactly as many arguments as parameters";
    CALL_BUILTIN = 0x52, Builtin, Arguments, 0 -- 1, "args -- result";
    CALL_ROBOT = 0x53, Robot, Arguments, 0 -- 1, "args -- result";
    CLOSURE = 0x54, Function, Captures, 0 -- 1, "captured -- closure; self comes first if the function uses it";
    RETURN = 0x55, Parameters, None, 1 -- 0, "a --: leaves the function with a";
    RETURN_NIL = 0x56, Parameters, None, 0 -- 0, "--: leaves the function with nil";
    POP_N = 0x57, Count, None, 0 -- 0, "pops as many values as the operand says";
    ADD_INT = 0x58, Int, None, 1 -- 1, "a -- a + operand";
    LOCAL_ADD = 0x59, Local, Immediate, 0 -- 0, "--: local = local + immediate";
    JUMP = 0x5a, Jump, None, 0 -- 0, "--";
    JUMP_FALSE = 0x5b, Jump, None, 1 -- 0, "a --: jumps if a is nil or 0";
    JUMP_TRUE = 0x5c, Jump, None, 1 -- 0, "a --: jumps if a is neither nil nor 0";
    AND = 0x5d, Jump, None, 1 -- 0, "a --: if a is false, puts 0 and jumps";
    OR = 0x5e, Jump, None, 1 -- 0, "a --: if a is true, puts 1 and jumps";
    JUMP_LOCAL = 0x5f, Jump, LocalImmediate, 0 -- 0, "--: jumps if the relation holds between local and immediate";
    // Relations: the low bits say for which [`order`]s they hold.
    JUMP_LT = 0x61, Jump, None, 2 -- 0, "a b --: jumps if a < b";
    JUMP_EQ = 0x62, Jump, None, 2 -- 0, "a b --: jumps if a == b";
    JUMP_LE = 0x63, Jump, None, 2 -- 0, "a b --: jumps if a <= b";
    JUMP_GT = 0x64, Jump, None, 2 -- 0, "a b --: jumps if a > b";
    JUMP_NE = 0x65, Jump, None, 2 -- 0, "a b --: jumps if a != b";
    JUMP_GE = 0x66, Jump, None, 2 -- 0, "a b --: jumps if a >= b";
    JUMP_NOT_GE = 0x69, Jump, None, 2 -- 0, "a b --: jumps unless a >= b";
    JUMP_NOT_GT = 0x6b, Jump, None, 2 -- 0, "a b --: jumps unless a > b";
    JUMP_NOT_LE = 0x6c, Jump, None, 2 -- 0, "a b --: jumps unless a <= b";
    JUMP_NOT_LT = 0x6e, Jump, None, 2 -- 0, "a b --: jumps unless a < b (differs from JUMP_GE for NaN)";
    JUMP_LT_INT = 0x71, Jump, Immediate, 1 -- 0, "a --: jumps if a < immediate";
    JUMP_EQ_INT = 0x72, Jump, Immediate, 1 -- 0, "a --: jumps if a == immediate";
    JUMP_LE_INT = 0x73, Jump, Immediate, 1 -- 0, "a --: jumps if a <= immediate";
    JUMP_GT_INT = 0x74, Jump, Immediate, 1 -- 0, "a --: jumps if a > immediate";
    JUMP_NE_INT = 0x75, Jump, Immediate, 1 -- 0, "a --: jumps if a != immediate";
    JUMP_GE_INT = 0x76, Jump, Immediate, 1 -- 0, "a --: jumps if a >= immediate";
    JUMP_NOT_GE_INT = 0x79, Jump, Immediate, 1 -- 0, "a --: jumps unless a >= immediate";
    JUMP_NOT_GT_INT = 0x7b, Jump, Immediate, 1 -- 0, "a --: jumps unless a > immediate";
    JUMP_NOT_LE_INT = 0x7c, Jump, Immediate, 1 -- 0, "a --: jumps unless a <= immediate";
    JUMP_NOT_LT_INT = 0x7e, Jump, Immediate, 1 -- 0, "a --: jumps unless a < immediate";
}

/// The order of two values as a bit. An instruction that compares has a bit for each order in which
/// its relation holds. `EQ` and `NE` distinguish only equal values from others.
pub mod order {
    /// The first is less.
    pub const LESS: u8 = 1;
    /// They are equal.
    pub const EQUAL: u8 = 2;
    /// The first is greater.
    pub const GREATER: u8 = 4;
    /// One of them is NaN, so they have no order. Only jumps `unless` have this bit.
    pub const NONE: u8 = 8;
}

/// The difference between the opcode of a jump that compares with an immediate integer and that of
/// the jump that compares two values.
pub const WITH_INT: u8 = JUMP_EQ_INT - JUMP_EQ;

/// Returns the meaning of the first byte after [`JUMP_LOCAL`]. Its upper four bits are the low bits
/// of the jump that compares with an immediate integer; its lower four bits are the local, encoded
/// as in the short form of `LOCAL_GET`.
pub const fn relation_of_local(byte: u8) -> (u8, i16) {
    (JUMP_LT_INT & 0xf0 | byte >> 4, (byte & 0x0f) as i16 + SHORT_LOCAL_GET.low)
}

/// Returns the byte that [`relation_of_local`] reads, if the local can be encoded in it.
pub fn local_with_relation(jump: u8, local: i16) -> Option<u8> {
    let number = u8::try_from(local - SHORT_LOCAL_GET.low).ok()?;
    if number < SHORT_LOCAL_GET.count { Some(jump << 4 | number) } else { None }
}

/// The bit that turns a narrow opcode into its wide form.
pub const WIDE: u8 = 0x80;

/// A range of bytes that hold their operand themselves: `first + n` for operand `low + n`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Short {
    /// The narrow opcode that it abbreviates.
    pub opcode: u8,
    /// Byte of the smallest operand.
    pub first: u8,
    /// Smallest operand.
    pub low: i16,
    /// The number of operands with a short form.
    pub count: u8,
}

/// `LOCAL_GET -4..=11`.
pub const SHORT_LOCAL_GET: Short = Short { opcode: LOCAL_GET, first: 0x80, low: -4, count: 16 };
/// `INT -1..=14`.
pub const SHORT_INT: Short = Short { opcode: INT, first: 0x90, low: -1, count: 16 };
/// `GLOBAL_GET 0..=15`.
pub const SHORT_GLOBAL_GET: Short = Short { opcode: GLOBAL_GET, first: 0xa0, low: 0, count: 16 };
/// `GLOBAL_SET 0..=7`.
pub const SHORT_GLOBAL_SET: Short = Short { opcode: GLOBAL_SET, first: 0xb0, low: 0, count: 8 };
/// `RETURN 0..=3`.
pub const SHORT_RETURN: Short = Short { opcode: RETURN, first: 0xb8, low: 0, count: 4 };
/// `RETURN_NIL 0..=3`.
pub const SHORT_RETURN_NIL: Short = Short { opcode: RETURN_NIL, first: 0xbc, low: 0, count: 4 };

/// Every short form, by first byte.
pub const SHORTS: [Short; 6] = [
    SHORT_LOCAL_GET,
    SHORT_INT,
    SHORT_GLOBAL_GET,
    SHORT_GLOBAL_SET,
    SHORT_RETURN,
    SHORT_RETURN_NIL,
];

/// An instruction with its operand, whatever its form in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decoded {
    /// Plain or narrow opcode.
    pub opcode: u8,
    /// Operand, 0 if there is none.
    pub operand: i16,
    /// Bytes of opcode and operand, without the trailer.
    pub length: u8,
}

/// Decodes one instruction from its first three bytes. The bytes after the end of the code are
/// arbitrary.
#[hot]
pub const fn decode(bytes: [u8; 3]) -> Decoded {
    let [byte, low, high] = bytes;
    let (opcode, zero) = match byte {
        0x00..=0x3f => return Decoded { opcode: byte, operand: 0, length: 1 },
        0x40..=0x7f => return Decoded { opcode: byte, operand: low as i8 as i16, length: 2 },
        0xc0..=0xff => {
            let operand = i16::from_le_bytes([low, high]);
            return Decoded { opcode: byte & !WIDE, operand, length: 3 };
        }
        // These are constants, because a reference would make the AVR keep the table in RAM.
        0x80..=0x8f => const { zero(SHORT_LOCAL_GET) },
        0x90..=0x9f => const { zero(SHORT_INT) },
        0xa0..=0xaf => const { zero(SHORT_GLOBAL_GET) },
        0xb0..=0xb7 => const { zero(SHORT_GLOBAL_SET) },
        0xb8..=0xbb => const { zero(SHORT_RETURN) },
        0xbc..=0xbf => const { zero(SHORT_RETURN_NIL) },
    };
    Decoded { opcode, operand: byte.wrapping_sub(zero) as i8 as i16, length: 1 }
}

/// Returns the opcode of a short form, and the byte that operand 0 has or would have.
const fn zero(form: Short) -> (u8, u8) {
    (form.opcode, form.first.wrapping_sub(form.low as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_is_sorted_and_unique() {
        assert!(TABLE.windows(2).all(|pair| pair[0].byte < pair[1].byte));
        assert!(TABLE.iter().all(|info| info.byte < 0x80));
        for info in TABLE {
            assert_eq!(info.byte >= 0x40, info.operand != Operand::None, "{}", info.name);
        }
    }

    #[test]
    fn short_forms_cover_their_range_exactly() {
        let mut next = 0x80u16;
        for form in SHORTS {
            assert_eq!(u16::from(form.first), next);
            for n in 0..form.count {
                let decoded = decode([form.first + n, 0xff, 0xff]);
                assert_eq!(decoded.opcode, form.opcode);
                assert_eq!(decoded.operand, form.low + i16::from(n));
                assert_eq!(decoded.length, 1);
            }
            next += u16::from(form.count);
        }
        assert_eq!(next, 0xc0);
    }

    #[test]
    fn operands_are_signed() {
        assert_eq!(decode([INT, 0x80, 0]), Decoded { opcode: INT, operand: -128, length: 2 });
        assert_eq!(
            decode([INT | WIDE, 0x34, 0x92]),
            Decoded { opcode: INT, operand: -28108, length: 3 }
        );
    }
}
