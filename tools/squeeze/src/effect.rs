//! The reads and writes of each instruction, from the AVR instruction set manual.

use crate::listing::AsmInstruction;

/// A set of registers and flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Set(u64);

impl Set {
    /// The empty set.
    pub const EMPTY: Set = Set(0);
    /// All registers and flags.
    pub const ALL: Set = Set(u64::MAX);
    /// The carry flag.
    pub const C: Set = Set(1 << 32);
    /// The zero flag.
    pub const Z: Set = Set(1 << 33);
    /// The flags negative, overflow, sign and half carry.
    pub const REST: Set = Set(1 << 34);
    /// The T flag, which `bst` and `bld` copy.
    pub const T: Set = Set(1 << 35);
    /// The flags that arithmetic sets.
    pub const FLAGS: Set = Set(7 << 32);
    /// The registers that a function may leave changed: r0, r18 to r27, r30, r31, and flags
    /// (AVR-GCC ABI, "Call-used registers").
    pub const CALL_USED: Set = Set(0xf_cffc_0001);
    /// The registers of results: r18 to r25.
    pub const RESULTS: Set = Set(0x3fc_0000);

    /// Returns the set of a register.
    pub const fn register(number: u8) -> Set {
        Set(1 << (number & 31))
    }

    /// Returns the set of a register and the next one.
    pub const fn pair(number: u8) -> Set {
        Set::register(number).or(Set::register(number + 1))
    }

    /// Returns the union.
    pub const fn or(self, other: Set) -> Set {
        Set(self.0 | other.0)
    }

    /// Returns the intersection.
    pub const fn and(self, other: Set) -> Set {
        Set(self.0 & other.0)
    }

    /// Returns the difference.
    pub const fn without(self, other: Set) -> Set {
        Set(self.0 & !other.0)
    }

    /// Returns true if the intersection is empty.
    pub const fn is_apart(self, other: Set) -> bool {
        self.0 & other.0 == 0
    }

    /// Returns the registers of the set, a bit for each.
    pub const fn register_bits(self) -> u32 {
        self.0 as u32
    }

    /// Returns the numbers of the registers of the set.
    pub fn registers(self) -> impl Iterator<Item = u8> {
        (0..32).filter(move |number| self.0 & 1 << number != 0)
    }
}

/// The effect of an instruction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InstructionEffect {
    /// Registers and flags on which the instruction depends.
    pub reads: Set,
    /// Registers and flags that the instruction sets.
    pub writes: Set,
    /// The instruction has another effect, or reads memory, so that it must not be removed.
    pub acts: bool,
}

impl InstructionEffect {
    /// Returns the effect of an instruction that does not branch; `None` for an unknown one.
    pub fn of(code: &AsmInstruction) -> Option<InstructionEffect> {
        let mut operands = code.operands.split(',').map(str::trim);
        let (first, second) = (operands.next().unwrap_or(""), operands.next().unwrap_or(""));
        let one = || register(first).map(Set::register);
        let two = || Some((one()?, register(second).map(Set::register)?));
        let effect =
            |reads: Set, writes: Set| Some(InstructionEffect { reads, writes, acts: false });
        let acts = |reads: Set, writes: Set| Some(InstructionEffect { reads, writes, acts: true });
        let no_carry = Set::Z.or(Set::REST);
        // These instructions can only clear Z, so they read it, too.
        let with_carry = Set::C.or(Set::Z);
        match code.name.as_str() {
            "mov" => two().and_then(|(to, from)| effect(from, to)),
            "movw" => effect(Set::pair(register(second)?), Set::pair(register(first)?)),
            "ldi" => effect(Set::EMPTY, one()?),
            "clr" => effect(Set::EMPTY, one()?.or(no_carry)),
            "eor" | "sub" if first == second => {
                let flags = if code.name == "eor" { no_carry } else { Set::FLAGS };
                effect(Set::EMPTY, one()?.or(flags))
            }
            "and" | "or" | "eor" => {
                two().and_then(|(to, from)| effect(to.or(from), to.or(no_carry)))
            }
            "add" | "sub" => two().and_then(|(to, from)| effect(to.or(from), to.or(Set::FLAGS))),
            "adc" => two().and_then(|(to, from)| effect(to.or(from).or(Set::C), to.or(Set::FLAGS))),
            "sbc" => {
                two().and_then(|(to, from)| effect(to.or(from).or(with_carry), to.or(Set::FLAGS)))
            }
            "cp" => two().and_then(|(one, other)| effect(one.or(other), Set::FLAGS)),
            "cpc" => {
                two().and_then(|(one, other)| effect(one.or(other).or(with_carry), Set::FLAGS))
            }
            "cpi" => effect(one()?, Set::FLAGS),
            "subi" | "com" | "neg" | "lsl" | "lsr" | "asr" => effect(one()?, one()?.or(Set::FLAGS)),
            "sbci" => effect(one()?.or(with_carry), one()?.or(Set::FLAGS)),
            "rol" | "ror" => effect(one()?.or(Set::C), one()?.or(Set::FLAGS)),
            "andi" | "ori" | "inc" | "dec" => effect(one()?, one()?.or(no_carry)),
            "tst" => effect(one()?, no_carry),
            "swap" => effect(one()?, one()?),
            "bst" => effect(one()?, Set::T),
            "bld" => effect(one()?.or(Set::T), one()?),
            "mul" | "muls" | "mulsu" => {
                let result = Set::pair(0).or(Set::C).or(Set::Z);
                two().and_then(|(one, other)| effect(one.or(other), result))
            }
            "adiw" | "sbiw" => {
                let pair = Set::pair(register(first)?);
                effect(pair, pair.or(Set::FLAGS))
            }
            "push" => acts(one()?, Set::EMPTY),
            "pop" => acts(Set::EMPTY, one()?),
            "in" if number(second) == Some(0x3f) => acts(Set::FLAGS.or(Set::T), one()?),
            "in" | "lds" => acts(Set::EMPTY, one()?),
            "out" if number(first) == Some(0x3f) => {
                acts(register(second).map(Set::register)?, Set::FLAGS.or(Set::T))
            }
            "out" | "sts" => acts(register(second).map(Set::register)?, Set::EMPTY),
            "ld" | "ldd" | "lpm" if !second.is_empty() => {
                let (reads, writes) = pointer(second)?;
                acts(reads, writes.or(one()?))
            }
            "st" | "std" => {
                let (reads, writes) = pointer(first)?;
                acts(reads.or(register(second).map(Set::register)?), writes)
            }
            "nop" | "cli" | "sei" | "sleep" | "wdr" | "sbi" | "cbi" | "sbic" | "sbis" => {
                acts(Set::EMPTY, Set::EMPTY)
            }
            "breq" | "brne" => acts(Set::Z, Set::EMPTY),
            "brcs" | "brcc" | "brlo" | "brsh" => acts(Set::C, Set::EMPTY),
            "brlt" | "brge" | "brmi" | "brpl" | "brvs" | "brvc" => acts(Set::REST, Set::EMPTY),
            "brts" | "brtc" => acts(Set::T, Set::EMPTY),
            "sbrc" | "sbrs" => acts(one()?, Set::EMPTY),
            "cpse" => two().and_then(|(one, other)| acts(one.or(other), Set::EMPTY)),
            "rjmp" => acts(Set::EMPTY, Set::EMPTY),
            _ => None,
        }
    }
}

/// Returns the registers that an address reads and writes.
fn pointer(operand: &str) -> Option<(Set, Set)> {
    let pair = match operand.trim_start_matches('-').chars().next()? {
        'X' => Set::pair(26),
        'Y' => Set::pair(28),
        'Z' => Set::pair(30),
        _ => return None,
    };
    let moves = operand.starts_with('-') || operand.ends_with('+');
    Some((pair, if moves { pair } else { Set::EMPTY }))
}

/// Parses a number, also in the forms that a programmer may write.
pub fn number(operand: &str) -> Option<u16> {
    match operand.strip_prefix("0x").or_else(|| operand.strip_prefix("0X")) {
        Some(digits) => u16::from_str_radix(digits, 16).ok(),
        None => operand.parse().ok(),
    }
}

/// Parses the number of a register.
pub fn register(operand: &str) -> Option<u8> {
    operand.strip_prefix('r')?.parse().ok().filter(|number| *number < 32)
}
