//! Parses named functions and lambdas.

use super::{Parse, Parser};
use crate::ast::{Expr, ExprKind, Function, Ident, StmtKind};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::token::{FixedToken, TokenKind};

impl Parser<'_> {
    /// `function name(params) "docstring" { body }`
    pub(super) fn function_statement(&mut self) -> Parse<StmtKind> {
        let start = self.advance().span;
        if self.at(FixedToken::OpenParen) {
            return self.function_without_name(start);
        }
        let name = self.name("the name of the function")?;
        if matches!(self.fixed(), Some(FixedToken::Dot | FixedToken::OpenBracket)) {
            return self.function_in_table(name, start);
        }
        if self.blocks > 0 {
            self.complain(
                Diagnostic::new(
                    DiagnosticCode::NestedFunction,
                    name.span,
                    format!("the function `{}` is defined inside a block", name.name),
                )
                .label("named functions stand outside of all braces")
                .help(format!("make it a lambda: `var {} = function(...) {{ ... }}`", name.name)),
            );
            let function = self.function(start, true)?;
            let value = Some(self.expr(ExprKind::Lambda(function), start));
            return Ok(StmtKind::Var { name, value });
        }
        let function = self.function(start, true)?;
        Ok(StmtKind::Function { name, function })
    }

    /// Keeps a lambda without a name as a statement, so that its body is checked.
    fn function_without_name(&mut self, start: Span) -> Parse<StmtKind> {
        let diagnostic = Diagnostic::new(
            DiagnosticCode::FunctionWithoutName,
            start,
            "this function has no name",
        )
        .label("expected a name after `function`")
        .help("name it: `function f(...)`; or store it: `f = function(...) { ... }`");
        self.report(diagnostic);
        let target = self.error_here();
        let function = self.function(start, true)?;
        Ok(StmtKind::Assign { target, value: self.expr(ExprKind::Lambda(function), start) })
    }

    /// Parses `function t.f() {}`, which means `t.f = function() {}`.
    fn function_in_table(&mut self, name: Ident, start: Span) -> Parse<StmtKind> {
        let mut target = Expr { kind: ExprKind::Name(name.name), span: name.span };
        while self.at(FixedToken::Dot) {
            let kind = self.field(target)?;
            target = self.expr(kind, name.span);
            self.grow(self.height)?;
        }
        let written = self.sources.text(target.span);
        let diagnostic = Diagnostic::new(
            DiagnosticCode::UnexpectedToken,
            target.span,
            "the name of a function cannot have a dot or a bracket",
        )
        .help(format!("store a lambda: `{written} = function(...) {{ ... }}`"));
        let reported = self.report(diagnostic);
        if !self.at(FixedToken::OpenParen) {
            return Err(reported);
        }
        let function = self.function(start, true)?;
        Ok(StmtKind::Assign { target, value: self.expr(ExprKind::Lambda(function), start) })
    }

    /// `function(params) { body }`
    pub(super) fn lambda(&mut self) -> Parse<Expr> {
        let start = self.advance().span;
        if let TokenKind::Name(_) = self.kind() {
            let diagnostic = self.unexpected("`(`").help(
                "a function inside an expression has no name; it is known by the variable that \
                 it is stored in",
            );
            self.complain(diagnostic);
            self.advance();
        }
        let function = self.function(start, false)?;
        Ok(self.expr(ExprKind::Lambda(function), start))
    }

    /// Parses the parameters and the body.
    fn function(&mut self, start: Span, named: bool) -> Parse<Function> {
        if !self.at(FixedToken::OpenParen) {
            let mut diagnostic = self.unexpected("`(`");
            if self.at(FixedToken::OpenBrace) {
                diagnostic = diagnostic
                    .help("parameters stand in parentheses, also if there are none: `f()`");
            }
            return Err(self.report(diagnostic));
        }
        let (name, errors) = (self.position.saturating_sub(1), self.diagnostics.len());
        self.open();
        let params = self.enclosed("`,` or `)`", |parser| {
            parser.list(FixedToken::CloseParen, Self::parameter)
        })?;
        if self.found_error_since(errors) {
            // The list of parameters may be incomplete, so the arguments in calls of that function
            // cannot be checked.
            self.lose(name);
        }
        let mut help = "the body of a function stands in braces";
        if let TokenKind::Str(_) = self.kind() {
            if named {
                // The docstring has no effect.
                self.advance();
            } else {
                help = "only named functions have a docstring; write a comment with `#`";
            }
        }
        let body = if self.at(FixedToken::OpenBrace) {
            self.block()?
        } else {
            let diagnostic = self.unexpected("`{`").help(help);
            let reported = self.report(diagnostic);
            self.block_without_brace().ok_or(reported)?
        };
        Ok(Function { params: params.unwrap_or_default(), body, span: self.span_since(start) })
    }

    fn parameter(&mut self) -> Parse<Ident> {
        let parameter = self.name("the name of a parameter")?;
        if self.at(FixedToken::Assign) {
            let diagnostic = self
                .unexpected("`,` or `)`")
                .help("parameters have no default values; every call passes all arguments");
            return Err(self.report(diagnostic));
        }
        Ok(parameter)
    }

    /// Parses a name that is about to be defined.
    pub(super) fn name(&mut self, expected: &str) -> Parse<Ident> {
        let token = self.token();
        if let TokenKind::Name(name) = &token.kind {
            self.advance();
            return Ok(Ident { name: name.clone(), span: token.span });
        }
        let diagnostic = self.unexpected(expected);
        match token.kind {
            TokenKind::Fixed(keyword) if keyword.is_keyword() && !token.is_separated() => {
                let name = keyword.text().to_owned();
                let help = format!("`{name}` is a keyword; choose another name");
                self.complain(diagnostic.help(help));
                self.advance();
                Ok(Ident { name, span: token.span })
            }
            _ => Err(self.report(diagnostic)),
        }
    }
}
