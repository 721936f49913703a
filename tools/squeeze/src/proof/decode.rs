//! Decodes instructions for the execution in the proof.
//!
//! This decoder shares nothing with the rest of the crate, so that a mistake cannot affect both in
//! the same way.

use std::fmt;

/// Bits of SREG (AVR instruction set manual, "Status Register").
pub mod flag {
    /// Carry.
    pub const C: u8 = 0;
    /// Zero.
    pub const Z: u8 = 1;
    /// Negative.
    pub const N: u8 = 2;
    /// Two's complement overflow.
    pub const V: u8 = 3;
    /// Sign, N ⊕ V.
    pub const S: u8 = 4;
    /// Half carry.
    pub const H: u8 = 5;
    /// The bit that `bst` and `bld` copy.
    pub const T: u8 = 6;
    /// The interrupt enable bit.
    pub const I: u8 = 7;
}

/// Arithmetic on two registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairOperation {
    /// `add`
    Add,
    /// `adc`
    Adc,
    /// `sub`
    Sub,
    /// `sbc`
    Sbc,
    /// `and`
    And,
    /// `or`
    Or,
    /// `eor`
    Eor,
    /// `cp`
    Cp,
    /// `cpc`
    Cpc,
}

/// Arithmetic on one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Single {
    /// `com`
    Com,
    /// `neg`
    Neg,
    /// `inc`
    Inc,
    /// `dec`
    Dec,
    /// `lsr`
    Lsr,
    /// `ror`
    Ror,
    /// `asr`
    Asr,
    /// `swap`
    Swap,
}

/// Signs of the factors of a product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Product {
    /// `mul`
    Unsigned,
    /// `muls`
    Signed,
    /// `mulsu`
    Mixed,
}

/// A pointer in a pair of registers, and its change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pointer {
    /// The lower register: 26, 28 or 30.
    pub pair: u8,
    /// Bytes added to the address.
    pub displacement: u8,
    /// The pointer is decremented first.
    pub decrements: bool,
    /// The pointer is incremented afterwards.
    pub increments: bool,
}

/// The place where control goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JumpTarget {
    /// A label.
    Label(String),
    /// An address in flash.
    Address(u16),
    /// A label and a number of bytes after it: LLVM's form of `.+2` in an asm! block.
    Behind(String, u16),
}

/// An instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AsmOperation {
    /// Arithmetic on two registers.
    Pair(PairOperation, u8, u8),
    /// Arithmetic on a register and a constant: `subi`, `sbci`, `andi`, `ori`, `cpi`.
    Constant(PairOperation, u8, u8),
    /// Arithmetic on one register.
    Single(Single, u8),
    /// A product in r1:r0.
    Multiply(Product, u8, u8),
    /// `adiw`, and `sbiw` if true.
    Word(u8, u8, bool),
    /// `mov`
    Copy(u8, u8),
    /// `movw`
    CopyPair(u8, u8),
    /// `ldi`
    Load(u8, u8),
    /// `ld`, `ldd`
    Read(u8, Pointer),
    /// `st`, `std`
    Write(Pointer, u8),
    /// `lds`
    ReadAt(u8, u16),
    /// `sts`
    WriteAt(u16, u8),
    /// `lpm`
    ReadFlash(u8, Pointer),
    /// `in`
    In(u8, u8),
    /// `out`
    Out(u8, u8),
    /// `sbi`, and `cbi` if false.
    Bit(u8, u8, bool),
    /// `sbis`, and `sbic` if false.
    SkipIo(u8, u8, bool),
    /// `sbrs`, and `sbrc` if false.
    SkipBit(u8, u8, bool),
    /// `cpse`
    SkipEqual(u8, u8),
    /// `bst`
    Store(u8, u8),
    /// `bld`
    Restore(u8, u8),
    /// `bset`, and `bclr` if false.
    Flag(u8, bool),
    /// `brbs`, and `brbc` if false.
    Branch(u8, bool, JumpTarget),
    /// `rjmp`, and `jmp` if true.
    Jump(JumpTarget, bool),
    /// `rcall`, and `call` if true.
    Call(JumpTarget, bool),
    /// `icall`
    CallPointer,
    /// `ijmp`
    JumpPointer,
    /// `ret`
    Return,
    /// `reti`
    ReturnFromInterrupt,
    /// `push`
    Push(u8),
    /// `pop`
    Pop(u8),
    /// `nop`
    Nop,
    /// `sleep`, `wdr`, `break`
    Special(&'static str),
}

/// A reason why a line cannot be decoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum UnknownLine {
    /// The instruction is not supported.
    Instruction(String),
    /// The instruction does not accept the operand.
    Operand(String),
}

impl fmt::Display for UnknownLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            UnknownLine::Instruction(name) => write!(f, "the instruction `{name}` is not known"),
            UnknownLine::Operand(text) => write!(f, "the operand `{text}` is not known"),
        }
    }
}

/// Decodes an instruction. `name` is in lower case.
pub fn decode(name: &str, operands: &str) -> Result<AsmOperation, UnknownLine> {
    let parts: Vec<&str> = match operands.trim() {
        "" => Vec::new(),
        operands => operands.split(',').map(str::trim).collect(),
    };
    let wrong = || UnknownLine::Operand(operands.to_owned());
    let count = |wanted: usize| if parts.len() == wanted { Ok(()) } else { Err(wrong()) };
    let register =
        |number: usize| parts.get(number).and_then(|part| register(part)).ok_or_else(wrong);
    let upper =
        |number: usize| register(number).and_then(|r| if r >= 16 { Ok(r) } else { Err(wrong()) });
    let even = |number: usize| {
        register(number).and_then(|r| if r % 2 == 0 { Ok(r) } else { Err(wrong()) })
    };
    let value = |number: usize| parts.get(number).and_then(|part| evaluate(part)).ok_or_else(wrong);
    let byte = |number: usize| {
        value(number)
            .and_then(|v| if (-128..256).contains(&v) { Ok(v as u8) } else { Err(wrong()) })
    };
    let below = |number: usize, limit: i64| {
        value(number).and_then(|v| if (0..limit).contains(&v) { Ok(v as u8) } else { Err(wrong()) })
    };
    let address = |number: usize| value(number).and_then(|v| u16::try_from(v).map_err(|_| wrong()));
    let target = || target(parts.first().copied().unwrap_or("")).ok_or_else(wrong);
    let pointer = |number: usize, takes_displacement: bool| {
        parts.get(number).and_then(|part| pointer(part, takes_displacement)).ok_or_else(wrong)
    };
    let pair = |kind: PairOperation| {
        count(2).and(Ok(AsmOperation::Pair(kind, register(0)?, register(1)?)))
    };
    let constant =
        |kind: PairOperation| count(2).and(Ok(AsmOperation::Constant(kind, upper(0)?, byte(1)?)));
    let single = |kind: Single| count(1).and(Ok(AsmOperation::Single(kind, register(0)?)));
    let twice = |kind: PairOperation| {
        count(1).and(Ok(AsmOperation::Pair(kind, register(0)?, register(0)?)))
    };
    let plain = |op: AsmOperation| count(0).and(Ok(op));
    let branch =
        |bit: u8, is_set: bool| count(1).and(Ok(AsmOperation::Branch(bit, is_set, target()?)));
    let range = |number: usize, low: u8, high: u8| {
        register(number).and_then(|r| if (low..=high).contains(&r) { Ok(r) } else { Err(wrong()) })
    };
    match name {
        "add" => pair(PairOperation::Add),
        "adc" => pair(PairOperation::Adc),
        "sub" => pair(PairOperation::Sub),
        "sbc" => pair(PairOperation::Sbc),
        "and" => pair(PairOperation::And),
        "or" => pair(PairOperation::Or),
        "eor" => pair(PairOperation::Eor),
        "cp" => pair(PairOperation::Cp),
        "cpc" => pair(PairOperation::Cpc),
        "lsl" => twice(PairOperation::Add),
        "rol" => twice(PairOperation::Adc),
        "tst" => twice(PairOperation::And),
        "clr" => twice(PairOperation::Eor),
        "subi" => constant(PairOperation::Sub),
        "sbci" => constant(PairOperation::Sbc),
        "andi" => constant(PairOperation::And),
        "ori" | "sbr" => constant(PairOperation::Or),
        "cpi" => constant(PairOperation::Cp),
        "cbr" => count(2).and(Ok(AsmOperation::Constant(PairOperation::And, upper(0)?, !byte(1)?))),
        "com" => single(Single::Com),
        "neg" => single(Single::Neg),
        "inc" => single(Single::Inc),
        "dec" => single(Single::Dec),
        "lsr" => single(Single::Lsr),
        "ror" => single(Single::Ror),
        "asr" => single(Single::Asr),
        "swap" => single(Single::Swap),
        "mul" => {
            count(2).and(Ok(AsmOperation::Multiply(Product::Unsigned, register(0)?, register(1)?)))
        }
        "muls" => count(2).and(Ok(AsmOperation::Multiply(Product::Signed, upper(0)?, upper(1)?))),
        "mulsu" => count(2).and(Ok(AsmOperation::Multiply(
            Product::Mixed,
            range(0, 16, 23)?,
            range(1, 16, 23)?,
        ))),
        "adiw" | "sbiw" => {
            count(2)?;
            match even(0)? {
                pair @ 24.. => Ok(AsmOperation::Word(pair, below(1, 64)?, name == "sbiw")),
                _ => Err(wrong()),
            }
        }
        "mov" => count(2).and(Ok(AsmOperation::Copy(register(0)?, register(1)?))),
        "movw" => count(2).and(Ok(AsmOperation::CopyPair(even(0)?, even(1)?))),
        "ldi" => count(2).and(Ok(AsmOperation::Load(upper(0)?, byte(1)?))),
        "ser" => count(1).and(Ok(AsmOperation::Load(upper(0)?, 0xff))),
        "ld" => count(2).and(Ok(AsmOperation::Read(register(0)?, pointer(1, false)?))),
        "ldd" => count(2).and(Ok(AsmOperation::Read(register(0)?, pointer(1, true)?))),
        "st" => count(2).and(Ok(AsmOperation::Write(pointer(0, false)?, register(1)?))),
        "std" => count(2).and(Ok(AsmOperation::Write(pointer(0, true)?, register(1)?))),
        "lds" => count(2).and(Ok(AsmOperation::ReadAt(register(0)?, address(1)?))),
        "sts" => count(2).and(Ok(AsmOperation::WriteAt(address(0)?, register(1)?))),
        "lpm" if parts.is_empty() => {
            let pointer =
                Pointer { pair: 30, displacement: 0, decrements: false, increments: false };
            Ok(AsmOperation::ReadFlash(0, pointer))
        }
        "lpm" => match pointer(1, false)? {
            at if at.pair == 30 && !at.decrements => {
                count(2).and(Ok(AsmOperation::ReadFlash(register(0)?, at)))
            }
            _ => Err(wrong()),
        },
        "in" => count(2).and(Ok(AsmOperation::In(register(0)?, below(1, 64)?))),
        "out" => count(2).and(Ok(AsmOperation::Out(below(0, 64)?, register(1)?))),
        "sbi" | "cbi" => {
            count(2).and(Ok(AsmOperation::Bit(below(0, 32)?, below(1, 8)?, name == "sbi")))
        }
        "sbis" | "sbic" => {
            count(2).and(Ok(AsmOperation::SkipIo(below(0, 32)?, below(1, 8)?, name == "sbis")))
        }
        "sbrs" | "sbrc" => {
            count(2).and(Ok(AsmOperation::SkipBit(register(0)?, below(1, 8)?, name == "sbrs")))
        }
        "cpse" => count(2).and(Ok(AsmOperation::SkipEqual(register(0)?, register(1)?))),
        "bst" => count(2).and(Ok(AsmOperation::Store(register(0)?, below(1, 8)?))),
        "bld" => count(2).and(Ok(AsmOperation::Restore(register(0)?, below(1, 8)?))),
        "bset" | "bclr" => count(1).and(Ok(AsmOperation::Flag(below(0, 8)?, name == "bset"))),
        "breq" => branch(flag::Z, true),
        "brne" => branch(flag::Z, false),
        "brcs" | "brlo" => branch(flag::C, true),
        "brcc" | "brsh" => branch(flag::C, false),
        "brmi" => branch(flag::N, true),
        "brpl" => branch(flag::N, false),
        "brvs" => branch(flag::V, true),
        "brvc" => branch(flag::V, false),
        "brlt" => branch(flag::S, true),
        "brge" => branch(flag::S, false),
        "brhs" => branch(flag::H, true),
        "brhc" => branch(flag::H, false),
        "brts" => branch(flag::T, true),
        "brtc" => branch(flag::T, false),
        "brie" => branch(flag::I, true),
        "brid" => branch(flag::I, false),
        "rjmp" | "jmp" => count(1).and(Ok(AsmOperation::Jump(target()?, name == "jmp"))),
        "rcall" | "call" => count(1).and(Ok(AsmOperation::Call(target()?, name == "call"))),
        "icall" => plain(AsmOperation::CallPointer),
        "ijmp" => plain(AsmOperation::JumpPointer),
        "ret" => plain(AsmOperation::Return),
        "reti" => plain(AsmOperation::ReturnFromInterrupt),
        "push" => count(1).and(Ok(AsmOperation::Push(register(0)?))),
        "pop" => count(1).and(Ok(AsmOperation::Pop(register(0)?))),
        "nop" => plain(AsmOperation::Nop),
        "sleep" => plain(AsmOperation::Special("sleep")),
        "wdr" => plain(AsmOperation::Special("wdr")),
        "break" => plain(AsmOperation::Special("break")),
        _ => match set_or_clear(name) {
            Some((bit, is_set)) => plain(AsmOperation::Flag(bit, is_set)),
            None => Err(UnknownLine::Instruction(name.to_owned())),
        },
    }
}

/// Decodes instructions such as `sec` and `clz`.
fn set_or_clear(name: &str) -> Option<(u8, bool)> {
    let (is_set, letter) = match name.strip_prefix("se") {
        Some(letter) => (true, letter),
        None => (false, name.strip_prefix("cl")?),
    };
    let bit = ["c", "z", "n", "v", "s", "h", "t", "i"].iter().position(|other| *other == letter)?;
    Some((bit as u8, is_set))
}

fn register(operand: &str) -> Option<u8> {
    match operand {
        "__tmp_reg__" => Some(0),
        "__zero_reg__" => Some(1),
        _ => operand.strip_prefix('r')?.parse().ok().filter(|number| *number < 32),
    }
}

fn pointer(operand: &str, takes_displacement: bool) -> Option<Pointer> {
    let decrements = operand.starts_with('-');
    let rest = operand.trim_start_matches('-');
    let pair = match rest.chars().next()? {
        'X' => 26,
        'Y' => 28,
        'Z' => 30,
        _ => return None,
    };
    let behind = &rest[1..];
    let plain = Pointer { pair, displacement: 0, decrements, increments: false };
    match (takes_displacement, decrements, behind) {
        (false, _, "") => Some(plain),
        (false, false, "+") => Some(Pointer { increments: true, ..plain }),
        (true, false, _) if pair != 26 => {
            let displacement = evaluate(behind.strip_prefix('+')?)?;
            let displacement = u8::try_from(displacement).ok().filter(|at| *at < 64)?;
            Some(Pointer { displacement, ..plain })
        }
        _ => None,
    }
}

fn target(operand: &str) -> Option<JumpTarget> {
    let is_label = operand.starts_with(|c: char| c.is_alphabetic() || matches!(c, '_' | '.' | '$'))
        && operand.chars().all(is_of_symbol)
        && !operand.ends_with('.');
    if is_label {
        return Some(JumpTarget::Label(operand.to_owned()));
    }
    if let Some(value) = number(operand) {
        return u16::try_from(value).ok().map(JumpTarget::Address);
    }
    let (label, bytes) = operand.split_once('+')?;
    let JumpTarget::Label(label) = target(label)? else { return None };
    let bytes = bytes
        .split('+')
        .try_fold(0_u16, |sum, part| Some(sum + u16::from(part.parse::<u8>().ok()?)));
    bytes.filter(|bytes| bytes % 2 == 0).map(|bytes| JumpTarget::Behind(label, bytes))
}

fn is_of_symbol(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '.' | '$')
}

fn number(text: &str) -> Option<i64> {
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        // The assembler reads a leading zero as octal.
        None if text.len() > 1 && text.starts_with('0') => None,
        None => text.parse().ok(),
    }
}

/// Evaluates an expression. The address of a symbol depends only on its name.
fn evaluate(text: &str) -> Option<i64> {
    let text = text.trim();
    for (prefix, shift) in [("lo8(", 0), ("hi8(", 8)] {
        if let Some(inner) = text.strip_prefix(prefix) {
            return Some(evaluate(inner.strip_suffix(')')?)? >> shift & 0xff);
        }
    }
    for prefix in ["gs(", "pm("] {
        if let Some(inner) = text.strip_prefix(prefix) {
            return evaluate(inner.strip_suffix(')')?).map(|address| address >> 1);
        }
    }
    if let Some(inner) = text.strip_prefix("-(") {
        return evaluate(inner.strip_suffix(')')?).map(|value| -value);
    }
    if let Some(inner) = text.strip_prefix('(') {
        return evaluate(inner.strip_suffix(')')?);
    }
    if let Some(value) = number(text).or_else(|| Some(-number(text.strip_prefix('-')?)?)) {
        return Some(value);
    }
    let (symbol, offset) = match text.rfind(['+', '-']) {
        Some(at) => (&text[..at], text[at..].trim_start_matches('+').parse::<i64>().ok()?),
        None => (text, 0),
    };
    match target(symbol.trim())? {
        JumpTarget::Label(symbol) => Some(i64::from(address(&symbol)) + offset),
        JumpTarget::Address(_) | JumpTarget::Behind(..) => None,
    }
}

/// Returns an address for a symbol, above the chip's registers.
fn address(symbol: &str) -> u16 {
    // FNV-1a.
    let hash = symbol.bytes().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    });
    0x0800 + (hash ^ hash >> 32) as u16 % 0x7000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_text_is_an_error() {
        let instruction = |name: &str| Err(UnknownLine::Instruction(name.to_owned()));
        assert_eq!(decode("fmul", "r16, r17"), instruction("fmul"));
        assert_eq!(decode("sep", ""), instruction("sep"));
        for (name, operands) in [
            ("ldi", "r15, 1"),
            ("ldi", "r16"),
            ("ldi", "r16, lo8(.+6)"),
            ("ldi", "r16, 256"),
            ("movw", "r25, r2"),
            ("adiw", "r22, 1"),
            ("ld", "r2, X+1"),
            ("ldd", "r2, X+1"),
            ("ldd", "r2, Y+64"),
            ("lpm", "r2, X"),
            ("in", "r2, 64"),
            ("in", "r2, 077"),
            ("rjmp", ".+2"),
            ("rjmp", ""),
            ("mov", "r1, r32"),
            ("ret", "r1"),
            ("sbrc", "r1, 8"),
        ] {
            let error = decode(name, operands);
            assert_eq!(error, Err(UnknownLine::Operand(operands.to_owned())), "{name} {operands}");
        }
    }

    #[test]
    fn expressions_have_values() {
        let value = |text| evaluate(text).unwrap();
        assert_eq!(value("-3"), -3);
        assert_eq!(value("0x3f"), 63);
        assert_eq!(value("a+8") - value("a"), 8);
        assert_eq!(value("a-8") - value("a"), -8);
        assert_eq!(value("lo8(-(a+8))"), -value("a+8") & 0xff);
        assert_eq!(value("hi8(-(a+8))"), (-value("a+8") >> 8) & 0xff);
        assert_ne!(value("a"), value("b"));
        assert_eq!(evaluate(".+6"), None);
        assert_eq!(evaluate("lo8(a"), None);
    }

    #[test]
    fn other_names_of_an_instruction_mean_the_same() {
        for (other, name, operands, same) in [
            ("clr", "eor", "r3", "r3, r3"),
            ("lsl", "add", "r3", "r3, r3"),
            ("rol", "adc", "r3", "r3, r3"),
            ("tst", "and", "r3", "r3, r3"),
            ("ser", "ldi", "r16", "r16, 255"),
            ("cbr", "andi", "r16, 1", "r16, 254"),
            ("sei", "bset", "", "7"),
            ("clt", "bclr", "", "6"),
        ] {
            assert_eq!(decode(other, operands), decode(name, same), "{other}");
        }
    }
}
