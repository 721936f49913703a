//! The state that the checks of expressions share while they visit a script. Its methods are spread
//! over the files of the checks: [`super::walk`] visits the expressions, [`super::calls`] checks
//! calls, [`super::values`] checks values.

use std::collections::BTreeSet;

use bittybuzz_vm_core::builtin::Library;

use crate::check::host::HostField;
use crate::check::names::Meanings;
use crate::check::reach;
use crate::check::shapes::{MissingField, Shapes};
use crate::check::static_type::StaticType;
use crate::check::suggest::{self, Advice};
use crate::check::tree::{CheckedExpr, CheckedExprKind, FunctionId, NameId, ResolvedScript};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;
use crate::source::Span;

/// The state of the checks of expressions.
pub struct Checker<'a> {
    pub program: &'a ResolvedScript,
    pub meanings: &'a Meanings<'a>,
    pub profile: NumberProfile,
    /// The function that is being visited.
    pub function: FunctionId,
    /// The functions that may run.
    running: BTreeSet<FunctionId>,
    /// The types of variables, and the keys of tables.
    shapes: Shapes<'a>,
    /// True for an argument of `log`, which joins its arguments.
    pub in_log: bool,
    pub diagnostics: Vec<Diagnostic>,
    /// Names that are certainly not nil at the current place, because a condition around it tests
    /// them.
    pub guarded: Vec<NameId>,
    /// Names that were reported as never assigned, because one message per name is enough.
    pub reported: BTreeSet<NameId>,
    /// The number of unknown names for which the checker may still search for a suggestion.
    searches_left: usize,
}

/// The maximum number of unknown names for which the checker searches for a suggestion. Each search
/// compares every name of the script, and people read only the first messages.
const SEARCHES_MAX: usize = 100;

impl<'a> Checker<'a> {
    /// Creates the state before the first expression.
    pub fn new(
        program: &'a ResolvedScript,
        meanings: &'a Meanings<'a>,
        profile: NumberProfile,
    ) -> Self {
        Checker {
            program,
            meanings,
            profile,
            function: FunctionId::GLOBAL,
            running: reach::running(program),
            shapes: Shapes::new(program, meanings),
            in_log: false,
            diagnostics: Vec::new(),
            guarded: Vec::new(),
            reported: BTreeSet::new(),
            searches_left: SEARCHES_MAX,
        }
    }

    /// Adds a diagnostic.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Returns a diagnostic about a call of a function that does not exist. It is only a warning in a
    /// function that nothing calls: published libraries have such functions, and the scripts that
    /// include them run.
    pub fn unknown_function(
        &self,
        code: DiagnosticCode,
        span: Span,
        message: String,
    ) -> Diagnostic {
        if self.running.contains(&self.function) {
            return Diagnostic::new(code, span, message);
        }
        let message = format!("{message}; nothing calls the function around it");
        Diagnostic::new(DiagnosticCode::UnknownFunctionUnused, span, message)
    }

    /// Returns a suggestion for a name that nothing defines.
    pub fn likely_name(&mut self, name: &str) -> Option<Advice> {
        self.searches_left = self.searches_left.checked_sub(1)?;
        if self.shapes.is_field_of_self(name, self.function) {
            return Some(Advice::likely(format!("self.{name}")));
        }
        suggest::for_name(name, self.program, self.function, self.meanings.robots())
    }

    /// Returns the table of a field that a robot's table certainly does not have.
    pub fn host_field(&self, object: &CheckedExpr, key: &str) -> Option<HostField<'a>> {
        let program: &'a ResolvedScript = self.program;
        let field = program.host.unknown_field(program, object, key)?;
        (!self.program.hidden.is_lost(key)).then_some(field)
    }

    /// Returns the type of a value, if it is certain unless it is nil.
    pub fn kind(&self, expr: &CheckedExpr) -> Option<StaticType> {
        self.shapes.kind(expr, self.function, self.meanings)
    }

    /// Returns the field if no table of the script has it, and the name of its table.
    pub fn missing_field(
        &self,
        object: &CheckedExpr,
        key: &str,
    ) -> Option<(MissingField<'a>, &'a str)> {
        // A key may be in source with syntax errors.
        if self.program.hidden.is_any() {
            return None;
        }
        let missing = self.shapes.missing_field(object, key, self.function)?;
        let program: &'a ResolvedScript = self.program;
        let table = match object.kind {
            CheckedExprKind::Name(name) => &program.name(name).text,
            CheckedExprKind::Local(local) => &program.function(self.function).local(local).name,
            _ => return None,
        };
        Some((missing, table))
    }

    /// Returns true if a condition around the current place ensures that the name is not nil.
    pub fn is_guarded(&self, name: NameId) -> bool {
        self.guarded.contains(&name)
    }

    /// Returns true if the library may have this member through source with syntax errors.
    pub fn may_be_member(&self, library: Library, key: &str) -> bool {
        let hidden = &self.program.hidden;
        hidden.is_lost(key) || library.global_name().is_some_and(|library| hidden.is_lost(library))
    }
}
