//! Parses a text that stands alone, outside of a script: an expression, or statements.

use std::collections::BTreeSet;

use super::{Parse, Parser};
use crate::ast::{Block, Function, Stmt, StmtKind};
use crate::codes::DiagnosticCode;
use crate::diagnostic::{Diagnostic, Severity};
use crate::lexer::lex;
use crate::source::{FileId, SourceMap, Span};
use crate::token::{Token, TokenKind};

/// A text that stands alone, as the body of a function without parameters.
pub struct Alone {
    /// The function. That of an expression consists of a `return`.
    pub function: Function,
    /// True if the text is an expression, and no statements.
    pub is_expression: bool,
    /// The strings of the text.
    pub strings: BTreeSet<String>,
}

/// Parses a file of `sources` that stands alone: an expression, or statements.
pub fn parse_alone(sources: &SourceMap, file: FileId) -> Result<Alone, Vec<Diagnostic>> {
    let text = &sources.file(file).text;
    let mut found = Vec::new();
    let tokens = lex(file, text, &mut found);
    if has_errors(&found) {
        return Err(found);
    }
    if let Some(include) = tokens.iter().find(|token| matches!(token.kind, TokenKind::Include(_))) {
        let message = "only a script can include a file";
        return Err(vec![Diagnostic::new(DiagnosticCode::IncludeMisplaced, include.span, message)]);
    }
    let span = Span { file, start: 0, end: text.len() as u32 };
    let alone = |stmts, strings, is_expression| {
        let body = Block { stmts, span };
        let function = Function { params: Vec::new(), body, span };
        Alone { function, is_expression, strings }
    };
    let expression = expression(&tokens, sources);
    let not_expression = match expression {
        Ok((value, strings)) => {
            let stmt = Stmt { kind: StmtKind::Return { value: Some(value) }, span };
            return Ok(alone(vec![stmt], strings, true));
        }
        Err(diagnostics) => diagnostics,
    };
    let mut parser = Parser::new(&tokens, sources);
    let stmts = parser.statements(false);
    if !has_errors(&parser.diagnostics) {
        return Ok(alone(stmts, parser.strings, false));
    }
    // The reading that gets further is most likely the one that is meant.
    let first = |found: &[Diagnostic]| found.iter().map(|one| one.span.start).min();
    let is_further = first(&parser.diagnostics) > first(&not_expression);
    Err(if is_further { parser.diagnostics } else { not_expression })
}

fn expression(
    tokens: &[Token],
    sources: &SourceMap,
) -> Result<(crate::ast::Expr, BTreeSet<String>), Vec<Diagnostic>> {
    let mut parser = Parser::new(tokens, sources);
    let value: Parse<_> = parser.condition();
    if let (Ok(_), false) = (&value, parser.at_end()) {
        let span = parser.span();
        let message = format!("`{}` cannot follow the expression before it", sources.text(span));
        parser.diagnostics.push(Diagnostic::new(DiagnosticCode::UnexpectedToken, span, message));
    }
    match value {
        Ok(value) if !has_errors(&parser.diagnostics) => Ok((value, parser.strings)),
        _ => Err(parser.diagnostics),
    }
}

fn has_errors(found: &[Diagnostic]) -> bool {
    found.iter().any(|one| one.severity() == Severity::Error)
}
