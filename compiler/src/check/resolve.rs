//! Resolves names: assigns every name to a parameter or variable of a function, a captured value,
//! or a global.
//!
//! A `var` inside a function or block is local until its block ends. Every other name is global,
//! also that of a `var` at the top level. A lambda sees the locals of the functions around it and
//! copies those that it uses.

use crate::ast;
use crate::ast::UnaryOp;
use crate::check::tree::{
    CheckedBlock, CheckedBranch, CheckedExpr, CheckedExprKind, CheckedFunction, CheckedLink,
    CheckedStmt, CheckedStmtKind, FunctionId, Local, LocalId, LocalKind, ResolvedScript,
};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::limits::PARAMETERS_MAX;
use crate::source::Span;

/// Resolves a script.
pub fn resolve(script: &ast::Script) -> (ResolvedScript, Vec<Diagnostic>) {
    let span = match (script.stmts.first(), script.stmts.last()) {
        (Some(first), Some(last)) => first.span.to(last.span),
        _ => Span::default(),
    };
    let mut resolver = Resolver {
        program: ResolvedScript::default(),
        contexts: vec![Context::new(FunctionId::GLOBAL)],
        diagnostics: Vec::new(),
    };
    resolver.program.functions.push(CheckedFunction { span, ..CheckedFunction::default() });
    // Functions exist before the first global line runs, so their names get the first numbers.
    for stmt in &script.stmts {
        if let ast::StmtKind::Function { name, .. } = &stmt.kind {
            resolver.program.intern(&name.name);
        }
    }
    let body = resolver.stmts(&script.stmts);
    resolver.program.functions[0].body = body;
    (resolver.program, resolver.diagnostics)
}

/// Adds a function to a script that is already resolved. The names, functions and locals that are known
/// keep their numbers.
pub fn add(program: &mut ResolvedScript, name: &str, function: &ast::Function) -> Vec<Diagnostic> {
    let (contexts, diagnostics) = (Vec::new(), Vec::new());
    let mut resolver = Resolver { program: std::mem::take(program), contexts, diagnostics };
    let id = resolver.new_function(Some(name.to_owned()), function, None);
    resolver.program.added.push(id);
    *program = resolver.program;
    resolver.diagnostics
}

/// The state of one function while its body is resolved.
struct Context {
    function: FunctionId,
    /// The names of each open block, innermost block last.
    blocks: Vec<Vec<(String, Binding)>>,
}

#[derive(Clone, Copy)]
enum Binding {
    Local(LocalId),
    /// A variable whose initial value is being evaluated. The variable is nil until then.
    Unborn,
}

impl Context {
    fn new(function: FunctionId) -> Self {
        Context { function, blocks: vec![Vec::new()] }
    }

    fn find(&self, name: &str) -> Option<Binding> {
        let names = self.blocks.iter().rev().flat_map(|block| block.iter().rev());
        names.into_iter().find(|(bound, _)| bound == name).map(|(_, binding)| *binding)
    }
}

struct Resolver {
    program: ResolvedScript,
    /// The enclosing functions, outermost first. Each is a lambda in the one before it.
    contexts: Vec<Context>,
    diagnostics: Vec<Diagnostic>,
}

/// The reason why there is always an innermost function.
const FUNCTION_OPEN: &str = "the script is resolved inside the global code or a function";

impl Resolver {
    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    fn context(&self) -> &Context {
        self.contexts.last().expect(FUNCTION_OPEN)
    }

    fn context_mut(&mut self) -> &mut Context {
        self.contexts.last_mut().expect(FUNCTION_OPEN)
    }

    fn function(&mut self) -> &mut CheckedFunction {
        let id = self.context().function;
        &mut self.program.functions[id.0]
    }

    /// Returns true if the current place belongs to the global code, inside a block or not.
    fn is_global_code(&self) -> bool {
        self.context().function == FunctionId::GLOBAL
    }

    /// Returns true if a `var` here declares a global.
    fn is_top_level(&self) -> bool {
        self.is_global_code() && self.context().blocks.len() == 1
    }

    /// Returns the names of the innermost block.
    fn block_names(&mut self) -> &mut Vec<(String, Binding)> {
        self.context_mut().blocks.last_mut().expect("a function's own block is never closed")
    }

    fn bind(&mut self, name: &str, binding: Binding) {
        self.block_names().push((name.to_owned(), binding));
    }

    fn declare(&mut self, name: &ast::Ident, kind: LocalKind) -> LocalId {
        let function = self.function();
        function.locals.push(Local { name: name.name.clone(), span: name.span, kind });
        LocalId(function.locals.len() - 1)
    }

    /// Returns the binding of a name at the current place, or `None` for a global. If the name
    /// belongs to an enclosing function, the value is captured.
    fn find(&mut self, name: &str) -> Option<Binding> {
        let owner =
            (0..self.contexts.len()).rev().find(|&at| self.contexts[at].find(name).is_some())?;
        let mut binding = self.contexts[owner].find(name)?;
        for at in owner + 1..self.contexts.len() {
            let Binding::Local(outer) = binding else { return Some(binding) };
            let creator = self.contexts[at - 1].function;
            let span = self.program.function(creator).local(outer).span;
            let function = &mut self.program.functions[self.contexts[at].function.0];
            let known = function.captures.iter().position(|capture| *capture == outer);
            let index = known.unwrap_or_else(|| {
                function.captures.push(outer);
                function.captures.len() - 1
            });
            let is_it = |local: &Local| matches!(local.kind, LocalKind::Captured { index: i, .. } if i == index);
            let local = function.locals.iter().position(is_it).unwrap_or_else(|| {
                let kind = LocalKind::Captured { index, assigned: false };
                function.locals.push(Local { name: name.to_owned(), span, kind });
                function.locals.len() - 1
            });
            binding = Binding::Local(LocalId(local));
        }
        Some(binding)
    }

    fn stmts(&mut self, stmts: &[ast::Stmt]) -> Vec<CheckedStmt> {
        let mut resolved = Vec::with_capacity(stmts.len());
        let mut ended: Option<Span> = None;
        for stmt in stmts {
            // A named function is defined even if control never reaches it.
            let runs = !matches!(stmt.kind, ast::StmtKind::Function { .. });
            if let Some(end) = ended
                && runs
            {
                self.report(
                    Diagnostic::new(
                        DiagnosticCode::Unreachable,
                        stmt.span,
                        "this code can never run",
                    )
                    .label("unreachable")
                    .related(end, "the function is left here"),
                );
                ended = None;
            }
            self.stmt(stmt, &mut resolved);
            if resolved.last().is_some_and(|last| runs && leaves(last)) {
                ended = Some(stmt.span);
            }
        }
        resolved
    }

    fn block(&mut self, block: &ast::Block) -> CheckedBlock {
        self.context_mut().blocks.push(Vec::new());
        let stmts = self.stmts(&block.stmts);
        self.context_mut().blocks.pop();
        CheckedBlock { stmts, span: block.span }
    }

    fn stmt(&mut self, stmt: &ast::Stmt, out: &mut Vec<CheckedStmt>) {
        let span = stmt.span;
        match &stmt.kind {
            ast::StmtKind::Var { name, value } => out.push(self.var(name, value.as_ref(), span)),
            ast::StmtKind::Function { name, function } => self.named_function(name, function),
            ast::StmtKind::If { branches, otherwise } => {
                let resolved = branches.iter().map(|branch| CheckedBranch {
                    condition: self.expr(&branch.condition),
                    then: self.block(&branch.then),
                });
                let branches = resolved.collect();
                let otherwise = otherwise
                    .as_ref()
                    .map_or_else(CheckedBlock::default, |block| self.block(block));
                out.push(CheckedStmt { kind: CheckedStmtKind::If { branches, otherwise }, span });
            }
            ast::StmtKind::While { condition, body } => {
                let condition = self.expr(condition);
                let body = self.block(body);
                out.push(CheckedStmt {
                    kind: CheckedStmtKind::While { condition, body, update: None },
                    span,
                });
            }
            ast::StmtKind::For { init, condition, update, body } => {
                self.stmt(init, out);
                let condition = self.expr(condition);
                let mut updates = Vec::new();
                self.stmt(update, &mut updates);
                let update = updates.pop().map(Box::new);
                let body = self.block(body);
                out.push(CheckedStmt {
                    kind: CheckedStmtKind::While { condition, body, update },
                    span,
                });
            }
            ast::StmtKind::Return { value } => {
                let value = value.as_ref().map(|value| self.expr(value));
                out.push(CheckedStmt { kind: CheckedStmtKind::Return(value), span });
            }
            ast::StmtKind::Assign { target, value } => {
                out.push(self.assign(target, value, span));
            }
            ast::StmtKind::Call(call) => {
                let call = self.expr(call);
                out.push(CheckedStmt { kind: CheckedStmtKind::Call(call), span });
            }
        }
    }

    fn var(&mut self, name: &ast::Ident, value: Option<&ast::Expr>, span: Span) -> CheckedStmt {
        self.refuse_self(name);
        if self.is_top_level() {
            let id = self.program.intern(&name.name);
            self.program.names[id.0].writes.push(name.span);
            let target = CheckedExpr { kind: CheckedExprKind::Name(id), span: name.span };
            let nil = CheckedExpr { kind: CheckedExprKind::Nil, span };
            let value = value.map_or(nil, |value| self.expr(value));
            return CheckedStmt { kind: CheckedStmtKind::Assign { target, value }, span };
        }
        if let Some(earlier) = self.visible_local(&name.name) {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::DuplicateVariable,
                    name.span,
                    format!("there is already a local variable `{}` here", name.name),
                )
                .label("declared a second time")
                .related(earlier, "first declared here")
                .help("choose another name, or assign it without `var`"),
            );
        }
        self.bind(&name.name, Binding::Unborn);
        let value = value.map(|value| self.expr(value));
        self.block_names().pop();
        let local = self.declare(name, LocalKind::Variable);
        self.bind(&name.name, Binding::Local(local));
        CheckedStmt { kind: CheckedStmtKind::Var { local, value }, span }
    }

    /// Returns the declaration of the visible local variable of that name, also that of an
    /// enclosing function.
    fn visible_local(&self, name: &str) -> Option<Span> {
        self.contexts.iter().rev().find_map(|context| match context.find(name)? {
            Binding::Local(local) => {
                Some(self.program.function(context.function).local(local).span)
            }
            Binding::Unborn => None,
        })
    }

    fn refuse_self(&mut self, name: &ast::Ident) {
        if name.name == "self" {
            self.report(self_assigned(name.span));
        }
    }

    fn assign(&mut self, target: &ast::Expr, value: &ast::Expr, span: Span) -> CheckedStmt {
        let target = match &target.kind {
            ast::ExprKind::Name(name) => self.assigned_name(name, target.span),
            _ => self.expr(target),
        };
        let value = self.expr(value);
        CheckedStmt { kind: CheckedStmtKind::Assign { target, value }, span }
    }

    fn assigned_name(&mut self, name: &str, span: Span) -> CheckedExpr {
        if name == "self" {
            self.report(self_assigned(span));
            return CheckedExpr { kind: CheckedExprKind::Error, span };
        }
        let kind = match self.find(name) {
            Some(Binding::Local(local)) => {
                self.note_captured_assignment(local, span);
                CheckedExprKind::Local(local)
            }
            // Assignments are statements, so this one is in a lambda within the variable's initial
            // value.
            Some(Binding::Unborn) => {
                self.report(own_initializer(name, span));
                CheckedExprKind::Error
            }
            None => {
                let id = self.program.intern(name);
                self.program.names[id.0].writes.push(span);
                CheckedExprKind::Name(id)
            }
        };
        CheckedExpr { kind, span }
    }

    fn note_captured_assignment(&mut self, local: LocalId, span: Span) {
        let variable = &mut self.function().locals[local.0];
        // The function's own variables and parameters are no copies.
        let LocalKind::Captured { assigned, .. } = &mut variable.kind else { return };
        let first = !*assigned;
        *assigned = true;
        let (name, declared) = (variable.name.clone(), variable.span);
        if first {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::CaptureAssigned,
                    span,
                    format!("this changes only this call's copy of `{name}`"),
                )
                .label("the change is lost when the function returns")
                .related(declared, "the variable that was copied when the function was created")
                .help("to keep a changing value, capture a table and change a field of it"),
            );
        }
    }

    fn named_function(&mut self, name: &ast::Ident, function: &ast::Function) {
        let outer = std::mem::take(&mut self.contexts);
        let id = self.new_function(Some(name.name.clone()), function, None);
        self.contexts = outer;
        let name_id = self.program.intern(&name.name);
        self.program.names[name_id.0].definitions.push((id, name.span));
    }

    fn new_function(
        &mut self,
        name: Option<String>,
        function: &ast::Function,
        creator: Option<FunctionId>,
    ) -> FunctionId {
        let id = FunctionId(self.program.functions.len());
        self.program.functions.push(CheckedFunction {
            name,
            span: function.span,
            parameters: function.params.len(),
            creator,
            ..CheckedFunction::default()
        });
        self.contexts.push(Context::new(id));
        if let Some(excess) = function.params.get(PARAMETERS_MAX) {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::TooManyParameters,
                    excess.span,
                    format!("a function can have at most {PARAMETERS_MAX} parameters"),
                )
                .label("one too many")
                .help("pass a table"),
            );
        }
        for (number, parameter) in function.params.iter().enumerate() {
            if parameter.name == "self" {
                let next = function.params.get(number + 1).map(|next| next.span.start);
                let rest = Span { end: next.unwrap_or(parameter.span.end), ..parameter.span };
                self.report(
                    self_assigned(parameter.span)
                        .help("remove it: a function that is called as `t.f()` finds `t` in `self`")
                        .edit(rest, ""),
                );
            }
            let earlier = function.params.iter().take(number).find(|p| p.name == parameter.name);
            if let Some(earlier) = earlier {
                self.report(
                    Diagnostic::new(
                        DiagnosticCode::DuplicateParameter,
                        parameter.span,
                        format!("two parameters are called `{}`", parameter.name),
                    )
                    .label("used a second time")
                    .related(earlier.span, "first used here"),
                );
            }
            let local = self.declare(parameter, LocalKind::Parameter(number));
            self.bind(&parameter.name, Binding::Local(local));
        }
        // The body and the parameters share one block, so a `var` cannot take a parameter's name.
        let body = self.stmts(&function.body.stmts);
        self.contexts.pop();
        self.program.functions[id.0].body = body;
        id
    }

    fn boxed(&mut self, expr: &ast::Expr) -> Box<CheckedExpr> {
        Box::new(self.expr(expr))
    }

    fn expr(&mut self, expr: &ast::Expr) -> CheckedExpr {
        let (mut kind, span) = (self.expr_kind(expr), expr.span);
        // The span of the last operation is that of the whole chain, parentheses included.
        if let CheckedExprKind::Chain { links, .. } = &mut kind
            && let Some(last) = links.last_mut()
        {
            last.span = span;
        }
        CheckedExpr { kind, span }
    }

    fn expr_kind(&mut self, expr: &ast::Expr) -> CheckedExprKind {
        match &expr.kind {
            ast::ExprKind::Nil => CheckedExprKind::Nil,
            ast::ExprKind::Int(value) => CheckedExprKind::Int(*value),
            ast::ExprKind::Float(value) => CheckedExprKind::Float(*value),
            ast::ExprKind::Str(text) => CheckedExprKind::Str(text.clone()),
            ast::ExprKind::Name(name) => self.name_read(name, expr.span),
            ast::ExprKind::Field { object, key } => CheckedExprKind::Field {
                object: self.boxed(object),
                key: key.name.clone(),
                key_span: key.span,
            },
            ast::ExprKind::Index { object, index } => {
                let (object, index) = (self.boxed(object), self.boxed(index));
                // `t["x"]` is equivalent to `t.x`.
                match index.kind {
                    CheckedExprKind::Str(key) => {
                        CheckedExprKind::Field { object, key, key_span: index.span }
                    }
                    _ => CheckedExprKind::Index { object, index },
                }
            }
            ast::ExprKind::Call { callee, args } => {
                let callee = self.callee(callee);
                let args = args.iter().map(|arg| self.expr(arg)).collect();
                CheckedExprKind::Call { callee: Box::new(callee), args }
            }
            ast::ExprKind::Table(fields) => {
                CheckedExprKind::Table(fields.iter().map(|field| self.field(field)).collect())
            }
            ast::ExprKind::Lambda(function) => {
                let creator = self.contexts.last().map(|context| context.function);
                CheckedExprKind::Lambda(self.new_function(None, function, creator))
            }
            ast::ExprKind::Unary { op: UnaryOp::Plus, operand } => self.expr(operand).kind,
            ast::ExprKind::Unary { op, operand } => {
                CheckedExprKind::Unary { op: *op, operand: self.boxed(operand) }
            }
            ast::ExprKind::Chain { first, links } => {
                let first = self.boxed(first);
                let links = links.iter().map(|link| CheckedLink {
                    op: link.op,
                    right: self.expr(&link.right),
                    span: link.span,
                });
                CheckedExprKind::Chain { first, links: links.collect() }
            }
            ast::ExprKind::Paren(inner) => self.expr(inner).kind,
            ast::ExprKind::Error => CheckedExprKind::Error,
        }
    }

    fn field(&mut self, field: &ast::TableField) -> (CheckedExpr, CheckedExpr) {
        let kind = match &field.key {
            ast::FieldKey::Name(name) => CheckedExprKind::Str(name.clone()),
            ast::FieldKey::Int(value) => CheckedExprKind::Int(*value),
            ast::FieldKey::Float(value) => CheckedExprKind::Float(*value),
        };
        (CheckedExpr { kind, span: field.key_span }, self.expr(&field.value))
    }

    fn callee(&mut self, callee: &ast::Expr) -> CheckedExpr {
        let resolved = self.expr(callee);
        // Direct calls are counted separately from other uses of a name.
        if let CheckedExprKind::Name(id) = resolved.kind {
            let name = &mut self.program.names[id.0];
            name.reads.pop();
            name.calls.push(resolved.span);
        }
        resolved
    }

    fn name_read(&mut self, name: &str, span: Span) -> CheckedExprKind {
        if name == "self" {
            if self.is_global_code() {
                self.report(self_is_nil(span, "outside functions `self` is always nil"));
                return CheckedExprKind::Nil;
            }
            self.function().uses_self = true;
            return CheckedExprKind::SelfValue;
        }
        match self.find(name) {
            Some(Binding::Local(local)) => CheckedExprKind::Local(local),
            Some(Binding::Unborn) => {
                self.report(own_initializer(name, span));
                CheckedExprKind::Nil
            }
            None => {
                let id = self.program.intern(name);
                self.program.names[id.0].reads.push(span);
                CheckedExprKind::Name(id)
            }
        }
    }
}

/// Returns true if control never continues after the statement.
pub fn leaves(stmt: &CheckedStmt) -> bool {
    let block_leaves = |block: &CheckedBlock| block.stmts.iter().any(leaves);
    match &stmt.kind {
        CheckedStmtKind::Return(_) => true,
        CheckedStmtKind::If { branches, otherwise } => {
            branches.iter().all(|branch| block_leaves(&branch.then)) && block_leaves(otherwise)
        }
        _ => false,
    }
}

/// Returns the warning for a `self` that is always nil.
pub fn self_is_nil(span: Span, message: &str) -> Diagnostic {
    Diagnostic::new(DiagnosticCode::SelfIsNil, span, message)
        .label("nil")
        .help("`self` is the table `t` inside a function called as `t.f()`")
}

fn self_assigned(span: Span) -> Diagnostic {
    Diagnostic::new(DiagnosticCode::SelfAssigned, span, "`self` cannot be declared or assigned")
        .label("`self` is set by the call `t.f()`")
        .help("use another name")
}

fn own_initializer(name: &str, span: Span) -> Diagnostic {
    Diagnostic::new(
        DiagnosticCode::OwnInitializer,
        span,
        format!("`{name}` is nil while its own first value is computed"),
    )
    .label("nil here")
    .help(
        "give the new variable another name; a function that calls itself must be a named function or stand in a \
         global or a field",
    )
}
