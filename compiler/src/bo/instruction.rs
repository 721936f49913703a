//! The instructions of the Buzz virtual machine, as encoded in `.bo` files.

use crate::ast::{BinaryOp, UnaryOp};

/// The action of an instruction. The notation shows the stack before and after, with its top on the
/// right. Strings, and places in the code, are given by their numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
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
pub enum Form {
    /// No argument.
    Plain(Action),
    /// A binary32 float.
    Float(fn(f32) -> Action),
    /// An integer.
    Int(fn(i32) -> Action),
    /// Number of a string.
    String(fn(usize) -> Action),
    /// The number of a local, or a number of locals.
    Locals(fn(u32) -> Action),
    /// The offset of an instruction from the start of the file.
    Address(fn(usize) -> Action),
}

/// The mnemonic and the form of every instruction, indexed by opcode.
pub const TABLE: [(&str, Form); 47] = {
    use Form::{Address, Float, Int, Locals, Plain, String};
    const fn binary(op: BinaryOp) -> Form {
        Plain(Action::Binary(op))
    }
    const fn unary(op: UnaryOp) -> Form {
        Plain(Action::Unary(op))
    }
    [
        ("nop", Plain(Action::Nop)),
        ("done", Plain(Action::Done)),
        ("pushnil", Plain(Action::PushNil)),
        ("dup", Plain(Action::Dup)),
        ("pop", Plain(Action::Pop)),
        ("ret0", Plain(Action::Ret0)),
        ("ret1", Plain(Action::Ret1)),
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
        ("gload", Plain(Action::Gload)),
        ("gstore", Plain(Action::Gstore)),
        ("pusht", Plain(Action::PushT)),
        ("tput", Plain(Action::Tput)),
        ("tget", Plain(Action::Tget)),
        ("callc", Plain(Action::Callc)),
        ("calls", Plain(Action::Calls)),
        ("pushf", Float(Action::PushF)),
        ("pushi", Int(Action::PushI)),
        ("pushs", String(Action::PushS)),
        ("pushcn", Address(Action::PushCn)),
        ("pushcc", Int(Action::PushCc)),
        ("pushl", Address(Action::PushL)),
        ("lload", Locals(Action::Lload)),
        ("lstore", Locals(Action::Lstore)),
        ("lremove", Locals(Action::Lremove)),
        ("jump", Address(Action::Jump)),
        ("jumpz", Address(Action::Jumpz)),
        ("jumpnz", Address(Action::Jumpnz)),
    ]
};

/// An instruction with its place in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruction {
    /// Offset of the opcode from the start of the file.
    pub offset: usize,
    /// The name in assembly text.
    pub mnemonic: &'static str,
    /// The action. Jumps and functions refer to the number of an instruction, not to its offset.
    pub action: Action,
}
