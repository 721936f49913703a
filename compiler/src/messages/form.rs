//! The form of a value in a message: the bytes that it takes, and if it fits a frame.

use std::collections::BTreeMap;

use crate::check::tree::{
    CheckedBranch, CheckedExpr, CheckedExprKind, CheckedFunction, CheckedStmt, CheckedStmtKind,
    FunctionId, LocalId, ResolvedScript, each_expr, each_stmt,
};
use crate::codegen::classes::{Classes, ValueClasses};
use crate::constant::ConstantNumber;
use crate::messages::size::ContentSizes;
use crate::profile::NumberProfile;

/// The most bytes of a string in a message.
const TEXT_MAX: usize = u8::MAX as usize;

/// The forms that a value may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Form {
    /// The fewest bytes in a content.
    pub least: usize,
    /// The most bytes in a content; `None` if there is no limit.
    pub most: Option<usize>,
    /// True if the value may fit a frame: nil, a number or a constant string.
    pub may_be_plain: bool,
    /// True if the value may need a content.
    pub may_be_long: bool,
    may_be_nil: bool,
    may_be_other: bool,
}

impl Form {
    const fn long(least: usize, most: Option<usize>) -> Self {
        Form {
            least,
            most,
            may_be_plain: false,
            may_be_long: true,
            may_be_nil: false,
            may_be_other: true,
        }
    }

    fn or(self, other: Form) -> Form {
        Form {
            least: self.least.min(other.least),
            most: self.most.zip(other.most).map(|(a, b)| a.max(b)),
            may_be_plain: self.may_be_plain || other.may_be_plain,
            may_be_long: self.may_be_long || other.may_be_long,
            may_be_nil: self.may_be_nil || other.may_be_nil,
            may_be_other: self.may_be_other || other.may_be_other,
        }
    }

    /// Returns the bytes of an element of a table with this value: none if the value is nil,
    /// because such an element does not exist.
    fn element(self, key: usize) -> (usize, Option<usize>) {
        let least = if self.may_be_nil { 0 } else { key + self.least };
        let most = if self.may_be_other { self.most.map(|most| key + most) } else { Some(0) };
        (least, most)
    }
}

/// Determines the forms of values.
pub struct Forms<'a> {
    pub program: &'a ResolvedScript,
    pub profile: NumberProfile,
    pub sizes: ContentSizes,
    pub classes: ValueClasses<'a>,
}

/// A key of a table literal, in the form that the machine gives it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Key<'a> {
    Text(&'a str),
    Int(i32),
    Float(u32),
}

impl<'a> Forms<'a> {
    /// Returns the form of an expression's value where a message is sent at `place`.
    pub fn of(
        &mut self,
        function: FunctionId,
        expr: &'a CheckedExpr,
        place: &'a CheckedExpr,
    ) -> Form {
        match &expr.kind {
            CheckedExprKind::Table(entries) => {
                let mut elements = BTreeMap::new();
                if self.literal(function, entries, place, &mut elements) {
                    return self.table(&elements);
                }
            }
            CheckedExprKind::Local(local) => {
                if let Some(form) = self.variable(function, *local, place) {
                    return form;
                }
            }
            _ => {}
        }
        let classes = self.classes.expression(function, expr);
        self.of_classes(classes)
    }

    fn of_classes(&self, classes: Classes) -> Form {
        let sizes = &self.sizes;
        let plain = |size, is_nil| Form {
            least: size,
            most: Some(size),
            may_be_plain: true,
            may_be_long: false,
            may_be_nil: is_nil,
            may_be_other: !is_nil,
        };
        let text = Form {
            // The machine may already know the text as a string of the script.
            may_be_plain: true,
            ..Form::long(sizes.text, Some(sizes.text + TEXT_MAX))
        };
        let forms = [
            (Classes::NIL, plain(sizes.nil, true)),
            (Classes::NUMBER | Classes::STRING, plain(sizes.word, false)),
            (Classes::TEXT, text),
            (Classes::FUNCTION, Form::long(sizes.function, Some(sizes.function))),
            (Classes::TABLE | Classes::OBJECT, Form::long(sizes.table, None)),
        ];
        let possible = forms.into_iter().filter(|(class, _)| classes.has(*class));
        possible.map(|(_, form)| form).reduce(Form::or).unwrap_or(Form {
            least: sizes.nil,
            most: None,
            may_be_plain: true,
            may_be_long: true,
            may_be_nil: true,
            may_be_other: true,
        })
    }

    fn table(&self, elements: &BTreeMap<Key<'a>, (usize, Option<usize>)>) -> Form {
        let least = elements.values().map(|(least, _)| least).sum::<usize>();
        let most = elements.values().try_fold(0, |sum, (_, most)| Some(sum + (*most)?));
        Form::long(self.sizes.table + least, most.map(|most| self.sizes.table + most))
    }

    /// Adds the elements of a table literal. Returns false if a key is unknown.
    fn literal(
        &mut self,
        function: FunctionId,
        entries: &'a [(CheckedExpr, CheckedExpr)],
        place: &'a CheckedExpr,
        elements: &mut BTreeMap<Key<'a>, (usize, Option<usize>)>,
    ) -> bool {
        for (key, value) in entries {
            let Some(key) = key_of(key, self.profile) else { return false };
            // If two entries have the same key, the last one counts.
            elements.insert(key, self.of(function, value, place).element(self.sizes.word));
        }
        true
    }

    /// Returns the form of a table in a local variable that holds only one literal, whose elements
    /// are known: the function changes them by constant keys, and nothing else has the table.
    fn variable(&mut self, id: FunctionId, local: LocalId, place: &'a CheckedExpr) -> Option<Form> {
        let program = self.program;
        let function = program.function(id);
        let block = declaring_block(&function.body, local)?;
        let (declared, rest) = block.split_first()?;
        let CheckedStmtKind::Var { value: Some(value), .. } = &declared.kind else { return None };
        let CheckedExprKind::Table(entries) = &value.kind else { return None };
        if is_captured(program, id, local) || !is_kept(function, local, place) {
            return None;
        }
        let mut elements = BTreeMap::new();
        if !self.literal(id, entries, place, &mut elements) {
            return None;
        }
        // An assignment on the way to the message is certain; the effect of any other is possible.
        let before = rest.iter().take_while(|stmt| !contains(stmt, place));
        let certain: Vec<*const CheckedStmt> = before.map(std::ptr::from_ref).collect();
        let mut changes = Vec::new();
        each_stmt(&function.body, &mut |stmt| {
            if let Some((key, value)) = changed_element(stmt, local) {
                changes.push((key, value, certain.contains(&std::ptr::from_ref(stmt))));
            }
        });
        for (key, value, is_certain) in changes {
            let key = key.of(self.profile)?;
            let (least, most) = self.of(id, value, place).element(self.sizes.word);
            let before = elements.get(&key).copied();
            let (known_least, known_most) = before.unwrap_or((0, Some(0)));
            let least = match before {
                None if is_certain => least,
                _ => known_least.min(least),
            };
            elements.insert(key, (least, known_most.zip(most).map(|(a, b)| a.max(b))));
        }
        Some(self.table(&elements))
    }
}

/// The key of an assignment.
enum ChangedKey<'a> {
    Field(&'a str),
    Index(&'a CheckedExpr),
}

impl<'a> ChangedKey<'a> {
    fn of(self, profile: NumberProfile) -> Option<Key<'a>> {
        match self {
            ChangedKey::Field(key) => Some(Key::Text(key)),
            ChangedKey::Index(index) => key_of(index, profile),
        }
    }
}

/// Returns key and value of an assignment to an element of the table in `local`.
fn changed_element(stmt: &CheckedStmt, local: LocalId) -> Option<(ChangedKey<'_>, &CheckedExpr)> {
    let CheckedStmtKind::Assign { target, value } = &stmt.kind else { return None };
    match &target.kind {
        CheckedExprKind::Field { object, key, .. } if is_local(object, local) => {
            Some((ChangedKey::Field(key), value))
        }
        CheckedExprKind::Index { object, index } if is_local(object, local) => {
            Some((ChangedKey::Index(index), value))
        }
        _ => None,
    }
}

fn key_of(key: &CheckedExpr, profile: NumberProfile) -> Option<Key<'_>> {
    if let CheckedExprKind::Str(text) = &key.kind {
        return Some(Key::Text(text));
    }
    Some(match key.number(profile)? {
        ConstantNumber::Int(number) => Key::Int(number),
        // A float that is an integer is the same key as that integer.
        ConstantNumber::Float(number) if number as i32 as f32 == number => Key::Int(number as i32),
        ConstantNumber::Float(number) => Key::Float(number.to_bits()),
    })
}

/// Returns the statements from the declaration of a variable to the end of its block; `None` if the
/// local is no variable.
fn declaring_block(stmts: &[CheckedStmt], local: LocalId) -> Option<&[CheckedStmt]> {
    let declares = |stmt: &CheckedStmt| matches!(stmt.kind, CheckedStmtKind::Var { local: declared, .. } if declared == local);
    if let Some(at) = stmts.iter().position(declares) {
        return stmts.get(at..);
    }
    stmts.iter().find_map(|stmt| match &stmt.kind {
        CheckedStmtKind::If { branches, otherwise } => branches
            .iter()
            .find_map(|CheckedBranch { then, .. }| declaring_block(&then.stmts, local))
            .or_else(|| declaring_block(&otherwise.stmts, local)),
        CheckedStmtKind::While { body, .. } => declaring_block(&body.stmts, local),
        _ => None,
    })
}

/// Returns true if a lambda has the variable, too.
fn is_captured(program: &ResolvedScript, function: FunctionId, local: LocalId) -> bool {
    program
        .functions
        .iter()
        .any(|inner| inner.creator == Some(function) && inner.captures.contains(&local))
}

/// Returns true if the function only changes single elements of the table in a variable and sends
/// it at `place`, so that nothing else has the table.
fn is_kept(function: &CheckedFunction, local: LocalId, place: &CheckedExpr) -> bool {
    let (mut uses, mut known) = (0, 0);
    each_expr(&function.body, &mut |expr| {
        uses += usize::from(is_local(expr, local));
    });
    each_stmt(&function.body, &mut |stmt| {
        known += usize::from(changed_element(stmt, local).is_some());
    });
    if let CheckedExprKind::Call { args, .. } = &place.kind {
        known += args.iter().filter(|arg| is_local(arg, local)).count();
    }
    uses == known
}

fn is_local(expr: &CheckedExpr, local: LocalId) -> bool {
    matches!(expr.kind, CheckedExprKind::Local(used) if used == local)
}

/// Returns true if an expression of the statement is `place` itself.
fn contains(stmt: &CheckedStmt, place: &CheckedExpr) -> bool {
    let mut found = false;
    each_expr(std::slice::from_ref(stmt), &mut |expr| found |= std::ptr::eq(expr, place));
    found
}
