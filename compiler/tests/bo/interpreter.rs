//! The virtual machine of the reference implementation, as far as these tests need it: it runs the `.bo` file itself,
//! with the locals, calls and closures that the file's own machine has.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use bittybuzz_compiler::ast::{BinaryOp, UnaryOp};
use bittybuzz_compiler::bo::instruction::BoAction;
use bittybuzz_compiler::bo::read::Bo;

/// Instructions before a program counts as endless, and calls inside each other.
const BUDGET: usize = 50_000;
const DEPTH: usize = 30;

#[derive(Debug, Clone)]
enum Value {
    Nil,
    Int(i32),
    Float(f32),
    String(String),
    Table(Rc<RefCell<Vec<(Value, Value)>>>),
    Closure { start: usize, captured: Rc<Vec<Value>> },
    Native(String),
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// A run-time error.
    Fault,
    /// Too long or too deep.
    Limit,
    /// Something that this machine does not have.
    Unsupported,
}

/// What a program did.
#[derive(Debug)]
pub struct Trace {
    /// Calls of native functions that record, as [`crate::bo::machine::Run::lines`] has them.
    pub lines: Vec<String>,
    /// Globals that hold plain values, as [`crate::bo::machine::Run::globals`] has them.
    pub globals: Vec<(String, String)>,
    /// Why it ended before its end.
    pub stop: Option<Stop>,
}

/// Runs the global code of a file, which must be readable.
pub fn run(bytes: &[u8]) -> Trace {
    let bo = Bo::read(bytes).expect("a file that can be read");
    let mut machine = Machine { bo: &bo, globals: HashMap::new(), lines: Vec::new(), left: BUDGET };
    let stop = machine.call(0, None, 0).err();
    let plain = |value: &Value| match value {
        Value::Nil => Some("nil".to_owned()),
        Value::Int(value) => Some(value.to_string()),
        Value::Float(value) => Some(format!("{value:?}")),
        Value::String(text) => Some(format!("{text:?}")),
        Value::Table(_) | Value::Closure { .. } | Value::Native(_) => None,
    };
    let globals = machine.globals.iter();
    let globals = globals.filter_map(|(name, value)| Some((name.clone(), plain(value)?))).collect();
    Trace { lines: machine.lines, globals, stop }
}

struct Machine<'a> {
    bo: &'a Bo,
    globals: HashMap<String, Value>,
    lines: Vec<String>,
    left: usize,
}

type Run<T> = Result<T, Stop>;

fn is_true(value: &Value) -> bool {
    !matches!(value, Value::Nil | Value::Int(0))
}

fn truth(value: bool) -> Value {
    Value::Int(i32::from(value))
}

fn same_key(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::String(a), Value::String(b)) => a == b,
        _ => number(a).is_ok_and(|a| number(b).is_ok_and(|b| a == b)),
    }
}

fn number(value: &Value) -> Run<f32> {
    match value {
        Value::Int(value) => Ok(*value as f32),
        Value::Float(value) => Ok(*value),
        _ => Err(Stop::Fault),
    }
}

fn is_key(key: &Value) -> Run<()> {
    match key {
        Value::Int(_) | Value::Float(_) | Value::String(_) => Ok(()),
        _ => Err(Stop::Fault),
    }
}

impl Machine<'_> {
    /// Runs from an instruction to the end of the function; the global code has no locals.
    fn call(&mut self, start: usize, locals: Option<Vec<Value>>, depth: usize) -> Run<Value> {
        if depth > DEPTH {
            return Err(Stop::Limit);
        }
        let mut locals = locals;
        let mut stack: Vec<Value> = Vec::new();
        let mut pc = start;
        loop {
            self.left = self.left.checked_sub(1).ok_or(Stop::Limit)?;
            let action = self.bo.action(pc);
            pc += 1;
            let mut pop = || stack.pop().ok_or(Stop::Fault);
            let pushed = match action {
                BoAction::Nop => continue,
                BoAction::Done | BoAction::Ret0 => return Ok(Value::Nil),
                BoAction::Ret1 => return pop(),
                BoAction::PushNil => Value::Nil,
                BoAction::PushI(value) => Value::Int(value),
                BoAction::PushF(value) => Value::Float(value),
                BoAction::PushS(number) => Value::String(self.bo.string(number).to_owned()),
                BoAction::PushT => Value::Table(Rc::default()),
                BoAction::PushCn(start) => {
                    Value::Closure { start, captured: Rc::new(vec![Value::Nil]) }
                }
                // The captured values are all locals that exist, extra arguments included.
                BoAction::PushL(start) => {
                    let captured = locals.clone().unwrap_or_else(|| vec![Value::Nil]);
                    Value::Closure { start, captured: Rc::new(captured) }
                }
                BoAction::Dup => stack.last().cloned().ok_or(Stop::Fault)?,
                BoAction::Pop => {
                    pop()?;
                    continue;
                }
                BoAction::Unary(op) => match (op, pop()?) {
                    (UnaryOp::Not, value) => truth(!is_true(&value)),
                    (UnaryOp::Negate, Value::Int(value)) => Value::Int(value.wrapping_neg()),
                    (UnaryOp::Negate, Value::Float(value)) => Value::Float(-value),
                    (UnaryOp::BitNot, Value::Int(value)) => Value::Int(!value),
                    _ => return Err(Stop::Fault),
                },
                BoAction::Binary(op) => {
                    let right = pop()?;
                    binary(op, pop()?, right)?
                }
                BoAction::Gload => match pop()? {
                    Value::String(name) => self.global(&name),
                    _ => return Err(Stop::Fault),
                },
                BoAction::Gstore => {
                    let value = pop()?;
                    let Value::String(name) = pop()? else { return Err(Stop::Fault) };
                    self.globals.insert(name, value);
                    continue;
                }
                BoAction::Tget => {
                    let key = pop()?;
                    is_key(&key)?;
                    let Value::Table(table) = pop()? else { return Err(Stop::Fault) };
                    let table = table.borrow();
                    let found = table.iter().find(|(known, _)| same_key(known, &key));
                    found.map_or(Value::Nil, |(_, value)| value.clone())
                }
                BoAction::Tput => {
                    let (value, key) = (pop()?, pop()?);
                    is_key(&key)?;
                    let table = pop()?;
                    put(&table, key, value)?;
                    continue;
                }
                BoAction::Callc => {
                    let Value::Int(count) = pop()? else { return Err(Stop::Fault) };
                    let first = stack.len().checked_sub(count as usize).ok_or(Stop::Fault)?;
                    let arguments = stack.split_off(first);
                    let callee = stack.pop().ok_or(Stop::Fault)?;
                    stack.pop().ok_or(Stop::Fault)?;
                    self.call_value(callee, arguments, depth)?
                }
                BoAction::Lload(number) => {
                    let locals = locals.as_ref().ok_or(Stop::Unsupported)?;
                    locals.get(number as usize).cloned().ok_or(Stop::Fault)?
                }
                BoAction::Lstore(number) => {
                    let value = pop()?;
                    let locals = locals.as_mut().ok_or(Stop::Unsupported)?;
                    let number = number as usize;
                    locals.resize(locals.len().max(number + 1), Value::Nil);
                    locals[number] = value;
                    continue;
                }
                BoAction::Lremove(count) => {
                    let locals = locals.as_mut().ok_or(Stop::Unsupported)?;
                    let left = locals.len().checked_sub(count as usize).ok_or(Stop::Fault)?;
                    locals.truncate(left);
                    continue;
                }
                BoAction::Jump(to) => {
                    pc = to;
                    continue;
                }
                BoAction::Jumpz(to) | BoAction::Jumpnz(to) => {
                    if is_true(&pop()?) == matches!(action, BoAction::Jumpnz(_)) {
                        pc = to;
                    }
                    continue;
                }
                BoAction::Calls | BoAction::PushCc(_) => return Err(Stop::Unsupported),
            };
            stack.push(pushed);
        }
    }

    fn global(&self, name: &str) -> Value {
        match self.globals.get(name) {
            Some(value) => value.clone(),
            None if matches!(name, "record" | "f" | "log" | "isnil" | "size" | "foreach") => {
                Value::Native(name.to_owned())
            }
            None => Value::Nil,
        }
    }

    fn call_value(&mut self, callee: Value, arguments: Vec<Value>, depth: usize) -> Run<Value> {
        match callee {
            Value::Closure { start, captured } => {
                let mut locals = captured.to_vec();
                locals.extend(arguments);
                self.call(start, Some(locals), depth + 1)
            }
            Value::Native(name) => self.native(&name, arguments, depth),
            _ => Err(Stop::Fault),
        }
    }

    fn native(&mut self, name: &str, arguments: Vec<Value>, depth: usize) -> Run<Value> {
        match (name, arguments.as_slice()) {
            ("isnil", [value]) => Ok(truth(matches!(value, Value::Nil))),
            ("size", [Value::Table(table)]) => Ok(Value::Int(table.borrow().len() as i32)),
            ("log", _) => {
                self.lines.push(arguments.iter().map(text).collect());
                Ok(Value::Nil)
            }
            ("foreach", [Value::Table(table), function]) => {
                let entries = table.borrow().clone();
                for (key, value) in entries {
                    self.call_value(function.clone(), vec![key, value], depth)?;
                }
                Ok(Value::Nil)
            }
            ("record" | "f", _) => {
                let texts: Vec<String> = arguments.iter().map(text).collect();
                self.lines.push(format!("{name}({})", texts.join(", ")));
                Ok(Value::Nil)
            }
            _ => Err(Stop::Unsupported),
        }
    }
}

fn put(table: &Value, key: Value, value: Value) -> Run<()> {
    let Value::Table(entries) = table else { return Err(Stop::Fault) };
    // A closure becomes a method of the table that it is stored in.
    let value = match value {
        Value::Closure { start, captured } => {
            let mut captured = captured.to_vec();
            captured[0] = table.clone();
            Value::Closure { start, captured: Rc::new(captured) }
        }
        plain => plain,
    };
    let mut entries = entries.borrow_mut();
    let known = entries.iter().position(|(known, _)| same_key(known, &key));
    match (known, value) {
        (Some(at), Value::Nil) => drop(entries.remove(at)),
        // Not as in the reference: an entry keeps its place, as this project promises.
        (Some(at), value) => entries[at].1 = value,
        (None, Value::Nil) => {}
        (None, value) => entries.push((key, value)),
    }
    Ok(())
}

fn binary(op: BinaryOp, left: Value, right: Value) -> Run<Value> {
    if matches!(op, BinaryOp::And | BinaryOp::Or) {
        let (left, right) = (is_true(&left), is_true(&right));
        return Ok(truth(if op == BinaryOp::And { left && right } else { left || right }));
    }
    if let Some(order) = compare(op, &left, &right) {
        return order;
    }
    if let (Value::Int(left), Value::Int(right)) = (&left, &right) {
        let (left, right) = (*left, *right);
        let shift = u32::try_from(right).ok().filter(|shift| *shift < 32);
        return Ok(Value::Int(match op {
            BinaryOp::Add => left.wrapping_add(right),
            BinaryOp::Sub => left.wrapping_sub(right),
            BinaryOp::Mul => left.wrapping_mul(right),
            BinaryOp::Div | BinaryOp::Mod if right == 0 => return Err(Stop::Fault),
            BinaryOp::Div => left.wrapping_div(right),
            BinaryOp::Mod => left.wrapping_rem_euclid(right),
            BinaryOp::BitAnd => left & right,
            BinaryOp::BitOr => left | right,
            BinaryOp::ShiftLeft => left << shift.ok_or(Stop::Fault)?,
            BinaryOp::ShiftRight => left >> shift.ok_or(Stop::Fault)?,
            _ => return Err(Stop::Unsupported),
        }));
    }
    let (left, right) = (number(&left)?, number(&right)?);
    Ok(Value::Float(match op {
        BinaryOp::Add => left + right,
        BinaryOp::Sub => left - right,
        BinaryOp::Mul => left * right,
        BinaryOp::Div => left / right,
        _ => return Err(Stop::Unsupported),
    }))
}

/// The result of a comparison; `None` if the operation is none. As this project defines it: different types are
/// unequal.
fn compare(op: BinaryOp, left: &Value, right: &Value) -> Option<Run<Value>> {
    use std::cmp::Ordering::{Equal, Greater, Less};
    let holds: fn(std::cmp::Ordering) -> bool = match op {
        BinaryOp::Eq => |order| order == Equal,
        BinaryOp::NotEq => |order| order != Equal,
        BinaryOp::Less => |order| order == Less,
        BinaryOp::LessEq => |order| order != Greater,
        BinaryOp::Greater => |order| order == Greater,
        BinaryOp::GreaterEq => |order| order != Less,
        _ => return None,
    };
    let order = match (left, right) {
        (Value::Nil, Value::Nil) => Some(Equal),
        (Value::Nil, _) => Some(Less),
        (_, Value::Nil) => Some(Greater),
        (Value::String(left), Value::String(right)) => Some(left.cmp(right)),
        (Value::Table(left), Value::Table(right)) if Rc::ptr_eq(left, right) => Some(Equal),
        _ => match (number(left), number(right)) {
            (Ok(left), Ok(right)) => left.partial_cmp(&right),
            _ => None,
        },
    };
    Some(match (order, op) {
        (Some(order), _) => Ok(truth(holds(order))),
        (None, BinaryOp::Eq) => Ok(truth(false)),
        (None, BinaryOp::NotEq) => Ok(truth(true)),
        (None, _) => Err(Stop::Fault),
    })
}

/// As [`crate::bo::machine`] writes arguments.
fn text(value: &Value) -> String {
    match value {
        Value::Nil => "nil".to_owned(),
        Value::Int(value) => value.to_string(),
        Value::Float(value) => format!("{value:?}"),
        Value::String(text) => text.clone(),
        Value::Table(entries) => format!("table of {}", entries.borrow().len()),
        Value::Closure { .. } | Value::Native(_) => "function".to_owned(),
    }
}
