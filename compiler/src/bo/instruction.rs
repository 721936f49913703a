//! The instructions of the Buzz virtual machine, as encoded in `.bo` files.

use crate::ast::{BinaryOp, UnaryOp};

/// The action of an instruction. The notation shows the stack before and after, with its top on the
/// right. Strings, and places in the code, are given by their numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BoAction {
    /// No effect; the first one ends the registration of the named functions.
    Nop,
    /// Ends the global code.
    Done,
    /// `-- nil`
    PushNil,
    /// `a -- a a`
    Dup,
    /// `a --`
    Pop,
    /// Returns nil.
    Ret0,
    /// `a --`: returns a.
    Ret1,
    /// `a b -- c`. `land` and `lor` evaluate both sides.
    Binary(BinaryOp),
    /// `a -- b`
    Unary(UnaryOp),
    /// `name -- value`
    Gload,
    /// `name value --`
    Gstore,
    /// `-- {}`
    PushT,
    /// `t k v --`: `t[k] = v`
    Tput,
    /// `t k -- t[k]`
    Tget,
    /// `self f arguments count -- result`
    Callc,
    /// A swarm call, which the Buzz compiler never makes.
    Calls,
    /// `-- float`
    PushF(f32),
    /// `-- integer`
    PushI(i32),
    /// `-- string`
    PushS(usize),
    /// `-- named function`
    PushCn(usize),
    /// `-- native function`, by its number in the machine.
    PushCc(i32),
    /// `-- lambda`, which gets a copy of the locals.
    PushL(usize),
    /// `-- local`
    Lload(u32),
    /// `a --`: local = a
    Lstore(u32),
    /// Removes this number of locals, the last ones first.
    Lremove(u32),
    /// `--`: jumps.
    Jump(usize),
    /// `a --`: jumps if a is nil or 0.
    Jumpz(usize),
    /// `a --`: jumps if a is neither nil nor 0.
    Jumpnz(usize),
}

/// The argument after an opcode in the file, and the action of the instruction.
#[derive(Debug, Clone, Copy)]
pub enum OperandForm {
    /// No argument.
    Plain(BoAction),
    /// A binary32 float.
    Float(fn(f32) -> BoAction),
    /// An integer.
    Int(fn(i32) -> BoAction),
    /// Number of a string.
    String(fn(usize) -> BoAction),
    /// The number of a local, or a number of locals.
    Locals(fn(u32) -> BoAction),
    /// The offset of an instruction from the start of the file.
    Address(fn(usize) -> BoAction),
}

/// The mnemonic and the form of every instruction, indexed by opcode.
pub const TABLE: [(&str, OperandForm); 47] = {
    use OperandForm::{Address, Float, Int, Locals, Plain, String};
    const fn binary(op: BinaryOp) -> OperandForm {
        Plain(BoAction::Binary(op))
    }
    const fn unary(op: UnaryOp) -> OperandForm {
        Plain(BoAction::Unary(op))
    }
    [
        ("nop", Plain(BoAction::Nop)),
        ("done", Plain(BoAction::Done)),
        ("pushnil", Plain(BoAction::PushNil)),
        ("dup", Plain(BoAction::Dup)),
        ("pop", Plain(BoAction::Pop)),
        ("ret0", Plain(BoAction::Ret0)),
        ("ret1", Plain(BoAction::Ret1)),
        ("add", binary(BinaryOp::Add)),
        ("sub", binary(BinaryOp::Sub)),
        ("mul", binary(BinaryOp::Mul)),
        ("div", binary(BinaryOp::Div)),
        ("mod", binary(BinaryOp::Mod)),
        ("pow", binary(BinaryOp::Pow)),
        ("unm", unary(UnaryOp::Negate)),
        ("land", binary(BinaryOp::And)),
        ("lor", binary(BinaryOp::Or)),
        ("lnot", unary(UnaryOp::Not)),
        ("band", binary(BinaryOp::BitAnd)),
        ("bor", binary(BinaryOp::BitOr)),
        ("bnot", unary(UnaryOp::BitNot)),
        ("lshift", binary(BinaryOp::ShiftLeft)),
        ("rshift", binary(BinaryOp::ShiftRight)),
        ("eq", binary(BinaryOp::Eq)),
        ("neq", binary(BinaryOp::NotEq)),
        ("gt", binary(BinaryOp::Greater)),
        ("gte", binary(BinaryOp::GreaterEq)),
        ("lt", binary(BinaryOp::Less)),
        ("lte", binary(BinaryOp::LessEq)),
        ("gload", Plain(BoAction::Gload)),
        ("gstore", Plain(BoAction::Gstore)),
        ("pusht", Plain(BoAction::PushT)),
        ("tput", Plain(BoAction::Tput)),
        ("tget", Plain(BoAction::Tget)),
        ("callc", Plain(BoAction::Callc)),
        ("calls", Plain(BoAction::Calls)),
        ("pushf", Float(BoAction::PushF)),
        ("pushi", Int(BoAction::PushI)),
        ("pushs", String(BoAction::PushS)),
        ("pushcn", Address(BoAction::PushCn)),
        ("pushcc", Int(BoAction::PushCc)),
        ("pushl", Address(BoAction::PushL)),
        ("lload", Locals(BoAction::Lload)),
        ("lstore", Locals(BoAction::Lstore)),
        ("lremove", Locals(BoAction::Lremove)),
        ("jump", Address(BoAction::Jump)),
        ("jumpz", Address(BoAction::Jumpz)),
        ("jumpnz", Address(BoAction::Jumpnz)),
    ]
};

/// An instruction with its place in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoInstruction {
    /// Offset of the opcode from the start of the file.
    pub offset: usize,
    /// The name in assembly text.
    pub mnemonic: &'static str,
    /// The action. Jumps and functions refer to the number of an instruction, not to its offset.
    pub action: BoAction,
}
