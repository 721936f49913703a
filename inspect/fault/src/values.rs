//! The values that an instruction used: those of the variables and table entries in its source
//! text.

use bittybuzz_compiler::ast::{Expr, ExprKind, StmtKind};
use bittybuzz_inspect::{FrameFunction, Inspection, Named, Object, ObjectId, ScriptValue};

use crate::description::FaultValue;
use crate::operand;

/// The most values of an instruction, those of its first names.
const VALUES_MAX: usize = 8;

/// The most entries of a table, and characters of a string, that are written.
const ENTRIES_MAX: usize = 6;
const CHARACTERS_MAX: usize = 60;

/// Returns the values of an instruction. `marked` is its source text, and `content` is that of the
/// machine at that moment.
pub fn of(marked: &str, content: &Inspection) -> Vec<FaultValue> {
    let Some((text, stmt)) = operand::parsed(marked) else { return Vec::new() };
    let mut reader = Reader { text: &text, content, found: Vec::new() };
    match &stmt.kind {
        // The marked text is the value of the assignment that was put before it.
        StmtKind::Assign { value, .. } if text != marked => reader.read(value),
        StmtKind::Assign { target, value } => {
            reader.read(target);
            reader.read(value);
        }
        StmtKind::Call(call) => reader.read(call),
        _ => {}
    }
    reader.found
}

struct Reader<'a> {
    /// The text to which the spans of the tree refer.
    text: &'a str,
    content: &'a Inspection,
    found: Vec<FaultValue>,
}

impl Reader<'_> {
    /// Adds the values of the names and entries in an expression, an entry before its table.
    fn read(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Name(_) => self.add(expr),
            ExprKind::Field { object, .. } => {
                self.add(expr);
                self.read(object);
            }
            ExprKind::Index { object, index } => {
                self.add(expr);
                self.read(index);
                self.read(object);
            }
            ExprKind::Call { callee, args } => {
                self.read(callee);
                args.iter().for_each(|argument| self.read(argument));
            }
            ExprKind::Table(fields) => fields.iter().for_each(|field| self.read(&field.value)),
            ExprKind::Unary { operand, .. } => self.read(operand),
            ExprKind::Chain { first, links } => {
                self.read(first);
                links.iter().for_each(|link| self.read(&link.right));
            }
            ExprKind::Paren(inner) => self.read(inner),
            // The body of a lambda has not run.
            ExprKind::Lambda(_)
            | ExprKind::Nil
            | ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::Error => {}
        }
    }

    fn add(&mut self, expr: &Expr) {
        let name = &self.text[expr.span.start as usize..expr.span.end as usize];
        let is_known = self.found.iter().any(|known| known.name == name);
        if is_known || self.found.len() == VALUES_MAX {
            return;
        }
        if let Some(value) = self.value(expr).and_then(|value| self.written(&value, true)) {
            self.found.push(FaultValue { name: name.to_owned(), value });
        }
    }

    /// Returns the value of a name, an entry or a constant; `None` if it is not known.
    fn value(&self, expr: &Expr) -> Option<ScriptValue> {
        match &expr.kind {
            ExprKind::Name(name) => self.variable(name),
            ExprKind::Field { object, key } => {
                self.entry(&self.value(object)?, &ScriptValue::String(key.name.clone()))
            }
            ExprKind::Index { object, index } => {
                self.entry(&self.value(object)?, &self.value(index)?)
            }
            ExprKind::Paren(inner) => self.value(inner),
            ExprKind::Nil => Some(ScriptValue::Nil),
            ExprKind::Int(number) => Some(ScriptValue::Int(i32::try_from(*number).ok()?)),
            ExprKind::Float(number) => Some(ScriptValue::Float(*number as f32)),
            ExprKind::Str(text) => Some(ScriptValue::String(text.clone())),
            _ => None,
        }
    }

    /// Returns the value of a local of the innermost function, or else of a global.
    fn variable(&self, name: &str) -> Option<ScriptValue> {
        let mut frames = self.content.frames.iter();
        let innermost = frames.find(|frame| matches!(frame.function, FrameFunction::Script { .. }));
        let locals = innermost.map_or(&[][..], |frame| &frame.locals);
        let found = locals.iter().chain(&self.content.globals).find(|known| known.name == name);
        found.map(|Named { value, .. }| value.clone())
    }

    /// Returns an entry of a table: nil if the table has none with that key.
    fn entry(&self, table: &ScriptValue, key: &ScriptValue) -> Option<ScriptValue> {
        let ScriptValue::Table(id) = table else { return None };
        let Some(Object::Table { entries, left_out }) = self.content.objects.get(id) else {
            return None;
        };
        match entries.iter().find(|(known, _)| known == key) {
            Some((_, value)) => Some(value.clone()),
            None if *left_out == 0 => Some(ScriptValue::Nil),
            None => None,
        }
    }

    /// Writes a value; `None` for a function or a library, which has only a name.
    fn written(&self, value: &ScriptValue, unfolds: bool) -> Option<String> {
        Some(match value {
            ScriptValue::Nil => "nil".to_owned(),
            ScriptValue::Unset => "not passed".to_owned(),
            ScriptValue::Int(number) => number.to_string(),
            // With a point, so that 3.0 differs from 3.
            ScriptValue::Float(number) => format!("{number:?}"),
            ScriptValue::String(text) => quoted(text),
            ScriptValue::UnknownString(number) => format!("string {number}"),
            ScriptValue::Table(id) if unfolds => self.table(*id),
            ScriptValue::Table(_) => "{…}".to_owned(),
            ScriptValue::Swarm(number) => format!("swarm {number}"),
            ScriptValue::Stigmergy(number) => format!("stigmergy {number}"),
            ScriptValue::Closure(_)
            | ScriptValue::Function(_)
            | ScriptValue::Builtin(_)
            | ScriptValue::RobotFunction(_)
            | ScriptValue::Library(_) => return None,
        })
    }

    fn table(&self, id: ObjectId) -> String {
        let Some(Object::Table { entries, left_out }) = self.content.objects.get(&id) else {
            return "{…}".to_owned();
        };
        let shown = entries.iter().take(ENTRIES_MAX).map(|(key, value)| {
            let key = match key {
                ScriptValue::String(name) => format!(".{name}"),
                key => format!(".{}", self.written(key, false).unwrap_or_default()),
            };
            let value = self.written(value, false).unwrap_or_else(|| "function".to_owned());
            format!("{key} = {value}")
        });
        let mut parts: Vec<String> = shown.collect();
        if entries.len() > ENTRIES_MAX || *left_out > 0 {
            parts.push("…".to_owned());
        }
        format!("{{{}}}", parts.join(", "))
    }
}

fn quoted(text: &str) -> String {
    let shown: String = text.chars().take(CHARACTERS_MAX).collect();
    let rest = if shown.len() < text.len() { "…" } else { "" };
    format!("\"{}{rest}\"", crate::printable(&shown))
}
