//! The decoder from halfwords to operations (ARMv6-M A5).

use crate::registers::Register;

/// The operation of an instruction. In [`Op`], `d` is the destination; `b` and `c` are source
/// registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Operation {
    /// The code is no instruction of ARMv6-M.
    Undefined,
    // d = b; d = b shifted by imm, which is not 0; with flags.
    MovReg,
    LslImm,
    LsrImm,
    AsrImm,
    // With flags: d = b + c, b - c, b + imm, b - imm.
    AddReg,
    SubReg,
    AddImm,
    SubImm,
    // d = imm with flags; flags of d - imm.
    MovImm,
    CmpImm,
    // Data processing, d op= b.
    And,
    Eor,
    LslReg,
    LsrReg,
    AsrReg,
    Adc,
    Sbc,
    Ror,
    Tst,
    Rsb,
    Cmp,
    Cmn,
    Orr,
    Mul,
    Bic,
    Mvn,
    // High registers, without flags except for the comparison.
    AddHigh,
    AddPc,
    CmpHigh,
    MovHigh,
    // A move from the PC, or to the SP.
    MovSpecial,
    MovPc,
    Bx,
    Blx,
    // d = word at imm from the aligned PC. The second one has the word itself in imm, because it is
    // in the flash.
    LdrLiteral,
    Constant,
    // Address b + c.
    StrReg,
    StrhReg,
    StrbReg,
    LdrsbReg,
    LdrReg,
    LdrhReg,
    LdrbReg,
    LdrshReg,
    // Address b + imm.
    StrImm,
    LdrImm,
    StrbImm,
    LdrbImm,
    StrhImm,
    LdrhImm,
    // d = aligned PC + imm, SP + imm; SP += imm, SP -= imm.
    Adr,
    AddSp,
    SpUp,
    SpDown,
    Sxth,
    Sxtb,
    Uxth,
    Uxtb,
    // Several registers, encoded for `list` and `more_cycles`.
    Push,
    Pop,
    PopPc,
    // imm: the new PRIMASK.
    Cps,
    Rev,
    Rev16,
    Revsh,
    Breakpoint,
    Nop,
    Wfe,
    Wfi,
    Sev,
    // Several registers from address b on, encoded as above.
    Stm,
    Ldm,
    // imm: the number of halfwords to be added to the PC.
    BranchEq,
    BranchNe,
    BranchCs,
    BranchCc,
    BranchMi,
    BranchPl,
    BranchVs,
    BranchVc,
    BranchHi,
    BranchLs,
    BranchGe,
    BranchLt,
    BranchGt,
    BranchLe,
    SupervisorCall,
    Branch,
    // An instruction of 32 bits; imm as before.
    BranchLink,
    // d: register; imm: special register.
    Mrs,
    Msr,
    Barrier,
}

/// A decoded instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Op {
    pub kind: Operation,
    pub d: Register,
    pub b: Register,
    pub c: Register,
    pub imm: u32,
}

impl Op {
    pub const UNDEFINED: Op = Op::new(Operation::Undefined, 0, 0, 0, 0);

    const fn new(kind: Operation, d: u16, b: u16, c: u16, imm: u32) -> Op {
        Op { kind, d: Register::of(d), b: Register::of(b), c: Register::of(c), imm }
    }

    /// Returns an operation on several registers.
    const fn several(kind: Operation, b: u16, list: u32, cycles: u32) -> Op {
        Op::new(kind, 0, b, 0, list | cycles << 16)
    }

    /// Returns the registers as bits, bit 8 for LR.
    pub const fn list(&self) -> u32 {
        self.imm & 0x1ff
    }

    /// Returns the cycles in addition to the first one, for an instruction with several registers.
    pub const fn more_cycles(&self) -> u32 {
        self.imm >> 16
    }
}

/// Returns true if an instruction that begins with `first` has a second halfword (A5.1).
pub const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// Decodes the instruction that begins with `first`; `second` is used only if the instruction has
/// 32 bits.
pub fn decode(first: u16, second: u16) -> Op {
    if is_wide(first) {
        return wide(first, second).unwrap_or(Op::UNDEFINED);
    }
    let (d, b, c) = (first & 7, first >> 3 & 7, first >> 6 & 7);
    let imm5 = u32::from(first >> 6 & 0x1f);
    let imm8 = u32::from(first & 0xff);
    let d8 = first >> 8 & 7;
    match first >> 11 {
        // LSL by 0 is a move. A field of 0 in the others means a shift by 32.
        0b00000 if imm5 == 0 => Op::new(Operation::MovReg, d, b, 0, 0),
        0b00000 => Op::new(Operation::LslImm, d, b, 0, imm5),
        0b00001 => Op::new(Operation::LsrImm, d, b, 0, if imm5 == 0 { 32 } else { imm5 }),
        0b00010 => Op::new(Operation::AsrImm, d, b, 0, if imm5 == 0 { 32 } else { imm5 }),
        0b00011 => match first >> 9 & 3 {
            0 => Op::new(Operation::AddReg, d, b, c, 0),
            1 => Op::new(Operation::SubReg, d, b, c, 0),
            2 => Op::new(Operation::AddImm, d, b, 0, u32::from(c)),
            _ => Op::new(Operation::SubImm, d, b, 0, u32::from(c)),
        },
        0b00100 => Op::new(Operation::MovImm, d8, 0, 0, imm8),
        0b00101 => Op::new(Operation::CmpImm, d8, 0, 0, imm8),
        0b00110 => Op::new(Operation::AddImm, d8, d8, 0, imm8),
        0b00111 => Op::new(Operation::SubImm, d8, d8, 0, imm8),
        0b01000 if first & 1 << 10 == 0 => Op::new(data_processing(first), d, b, 0, 0),
        0b01000 => high_registers(first).unwrap_or(Op::UNDEFINED),
        0b01001 => Op::new(Operation::LdrLiteral, d8, 0, 0, 4 * imm8),
        0b01010 | 0b01011 => {
            let kind = match first >> 9 & 7 {
                0 => Operation::StrReg,
                1 => Operation::StrhReg,
                2 => Operation::StrbReg,
                3 => Operation::LdrsbReg,
                4 => Operation::LdrReg,
                5 => Operation::LdrhReg,
                6 => Operation::LdrbReg,
                _ => Operation::LdrshReg,
            };
            Op::new(kind, d, b, c, 0)
        }
        0b01100 => Op::new(Operation::StrImm, d, b, 0, 4 * imm5),
        0b01101 => Op::new(Operation::LdrImm, d, b, 0, 4 * imm5),
        0b01110 => Op::new(Operation::StrbImm, d, b, 0, imm5),
        0b01111 => Op::new(Operation::LdrbImm, d, b, 0, imm5),
        0b10000 => Op::new(Operation::StrhImm, d, b, 0, 2 * imm5),
        0b10001 => Op::new(Operation::LdrhImm, d, b, 0, 2 * imm5),
        // Relative to SP.
        0b10010 => Op::new(Operation::StrImm, d8, 13, 0, 4 * imm8),
        0b10011 => Op::new(Operation::LdrImm, d8, 13, 0, 4 * imm8),
        0b10100 => Op::new(Operation::Adr, d8, 0, 0, 4 * imm8),
        0b10101 => Op::new(Operation::AddSp, d8, 0, 0, 4 * imm8),
        0b10110 | 0b10111 => miscellaneous(first).unwrap_or(Op::UNDEFINED),
        0b11000 => Op::several(Operation::Stm, d8, imm8, imm8.count_ones()),
        0b11001 => Op::several(Operation::Ldm, d8, imm8, imm8.count_ones()),
        0b11010 | 0b11011 => match first >> 8 & 0xf {
            0xe => Op::UNDEFINED,
            0xf => Op::new(Operation::SupervisorCall, 0, 0, 0, imm8),
            condition => {
                let offset = i32::from(first as u8 as i8);
                Op::new(BRANCHES[usize::from(condition)], 0, 0, 0, offset as u32)
            }
        },
        0b11100 => {
            let offset = (i32::from(first) << 21) >> 21;
            Op::new(Operation::Branch, 0, 0, 0, offset as u32)
        }
        _ => Op::UNDEFINED,
    }
}

/// The branches by the number of their condition (A6.3).
const BRANCHES: [Operation; 14] = [
    Operation::BranchEq,
    Operation::BranchNe,
    Operation::BranchCs,
    Operation::BranchCc,
    Operation::BranchMi,
    Operation::BranchPl,
    Operation::BranchVs,
    Operation::BranchVc,
    Operation::BranchHi,
    Operation::BranchLs,
    Operation::BranchGe,
    Operation::BranchLt,
    Operation::BranchGt,
    Operation::BranchLe,
];

fn data_processing(first: u16) -> Operation {
    const KINDS: [Operation; 16] = [
        Operation::And,
        Operation::Eor,
        Operation::LslReg,
        Operation::LsrReg,
        Operation::AsrReg,
        Operation::Adc,
        Operation::Sbc,
        Operation::Ror,
        Operation::Tst,
        Operation::Rsb,
        Operation::Cmp,
        Operation::Cmn,
        Operation::Orr,
        Operation::Mul,
        Operation::Bic,
        Operation::Mvn,
    ];
    KINDS[usize::from(first >> 6 & 0xf)]
}

fn high_registers(first: u16) -> Option<Op> {
    let (d, b) = (first & 7 | first >> 4 & 8, first >> 3 & 0xf);
    Some(match first >> 8 & 3 {
        0 if d == 15 => Op::new(Operation::AddPc, d, b, 0, 0),
        0 => Op::new(Operation::AddHigh, d, b, 0, 0),
        1 => Op::new(Operation::CmpHigh, d, b, 0, 0),
        2 if d == 15 => Op::new(Operation::MovPc, d, b, 0, 0),
        2 if d == 13 || b == 15 => Op::new(Operation::MovSpecial, d, b, 0, 0),
        2 => Op::new(Operation::MovHigh, d, b, 0, 0),
        _ if first & 7 != 0 => return None,
        _ if first & 1 << 7 == 0 => Op::new(Operation::Bx, 0, b, 0, 0),
        _ => Op::new(Operation::Blx, 0, b, 0, 0),
    })
}

/// Decodes the miscellaneous 16-bit instructions (A5.2.5).
fn miscellaneous(first: u16) -> Option<Op> {
    let (d, b) = (first & 7, first >> 3 & 7);
    let stack = 4 * u32::from(first & 0x7f);
    let list = u32::from(first & 0x1ff);
    let count = list.count_ones();
    Some(match first >> 5 & 0x7f {
        0b000_0000..=0b000_0011 => Op::new(Operation::SpUp, 0, 0, 0, stack),
        0b000_0100..=0b000_0111 => Op::new(Operation::SpDown, 0, 0, 0, stack),
        0b001_0000..=0b001_0111 => {
            let kinds = [Operation::Sxth, Operation::Sxtb, Operation::Uxth, Operation::Uxtb];
            Op::new(kinds[usize::from(first >> 6 & 3)], d, b, 0, 0)
        }
        0b010_0000..=0b010_1111 => Op::several(Operation::Push, 0, list, count),
        0b011_0011 if first & 0xf == 2 => {
            Op::new(Operation::Cps, 0, 0, 0, u32::from(first >> 4 & 1))
        }
        0b101_0000 | 0b101_0001 => Op::new(Operation::Rev, d, b, 0, 0),
        0b101_0010 | 0b101_0011 => Op::new(Operation::Rev16, d, b, 0, 0),
        0b101_0110 | 0b101_0111 => Op::new(Operation::Revsh, d, b, 0, 0),
        0b110_0000..=0b110_0111 => Op::several(Operation::Pop, 0, list & 0xff, count),
        0b110_1000..=0b110_1111 => Op::several(Operation::PopPc, 0, list & 0xff, count + 2),
        0b111_0000..=0b111_0111 => Op::new(Operation::Breakpoint, 0, 0, 0, 0),
        0b111_1000..=0b111_1111 => {
            let kind = match first & 0xff {
                0x20 => Operation::Wfe,
                0x30 => Operation::Wfi,
                0x40 => Operation::Sev,
                hint if hint & 0xf == 0 => Operation::Nop,
                _ => return None,
            };
            Op::new(kind, 0, 0, 0, 0)
        }
        _ => return None,
    })
}

/// Decodes a 32-bit instruction (A5.3).
fn wide(first: u16, second: u16) -> Option<Op> {
    if first >> 11 != 0b11110 || second & 0x8000 == 0 {
        return None;
    }
    if second & 0xd000 == 0xd000 {
        let (s, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
        let (i1, i2) = (!(j1 ^ s) & 1, !(j2 ^ s) & 1);
        let bits = u32::from(s) << 24
            | u32::from(i1) << 23
            | u32::from(i2) << 22
            | u32::from(first & 0x3ff) << 12
            | u32::from(second & 0x7ff) << 1;
        let offset = ((bits << 7) as i32) >> 8;
        return Some(Op::new(Operation::BranchLink, 0, 0, 0, offset as u32));
    }
    let special = u32::from(second & 0xff);
    Some(match first {
        0xf380..=0xf38f if second >> 8 == 0x88 => {
            Op::new(Operation::Msr, first & 0xf, 0, 0, special)
        }
        0xf3ef if second >> 12 == 8 => Op::new(Operation::Mrs, second >> 8 & 0xf, 0, 0, special),
        0xf3bf if matches!(second & 0xfff0, 0x8f40 | 0x8f50 | 0x8f60) => {
            Op::new(Operation::Barrier, 0, 0, 0, 0)
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_have_the_assemblers_range() {
        // b . ; beq .+4; bl .+0x104; bl .-4 (GNU assembler 2.40)
        assert_eq!(decode(0xe7fe, 0), Op::new(Operation::Branch, 0, 0, 0, -2_i32 as u32));
        assert_eq!(decode(0xd000, 0), Op::new(Operation::BranchEq, 0, 0, 0, 0));
        assert_eq!(decode(0xf000, 0xf880), Op::new(Operation::BranchLink, 0, 0, 0, 0x80));
        assert_eq!(decode(0xf7ff, 0xfffc), Op::new(Operation::BranchLink, 0, 0, 0, -4_i32 as u32));
    }

    #[test]
    fn instructions_beyond_armv6m_are_undefined() {
        for (first, second) in [
            (0xb108, 0),      // cbz
            (0xbf08, 0),      // it eq
            (0xde00, 0),      // udf
            (0xf8d1, 0x0004), // ldr.w
            (0xf3af, 0x8002), // wfe.w
            (0xe8c1, 0x0f50), // strexh
        ] {
            assert_eq!(decode(first, second).kind, Operation::Undefined, "{first:#x}");
        }
    }
}
