//! Numbers that the global code of a script assigns to its globals as literals.

use std::collections::BTreeMap;

use crate::ast::{Expr, ExprKind, StmtKind};
use crate::parser::parse_again;
use crate::source::{SourceMap, Span};

/// A number that the global code of a script assigns to a global.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GlobalLiteral {
    /// True for a number with a point or an exponent, such as `1.0`.
    pub is_float: bool,
    /// The place of the assignment.
    pub span: Span,
}

/// Returns the globals to which the global code of a script assigns a number, outside of functions
/// and blocks, with the first assignment. A global that gets integers and floats there is left out.
pub fn global_literals(sources: &SourceMap) -> BTreeMap<String, GlobalLiteral> {
    // Images have no source.
    if sources.files().next().is_none() {
        return BTreeMap::new();
    }
    let parsed = parse_again(sources.clone());
    let mut literals: BTreeMap<String, Option<GlobalLiteral>> = BTreeMap::new();
    for stmt in &parsed.script.stmts {
        let (name, value) = match &stmt.kind {
            StmtKind::Var { name, value: Some(value) } => (&name.name, value),
            StmtKind::Assign { target: Expr { kind: ExprKind::Name(name), .. }, value } => {
                (name, value)
            }
            _ => continue,
        };
        let is_float = match unwrapped(value).kind {
            ExprKind::Int(_) => false,
            ExprKind::Float(_) => true,
            _ => continue,
        };
        let literal = GlobalLiteral { is_float, span: stmt.span };
        let known = literals.entry(name.clone()).or_insert(Some(literal));
        *known = known.filter(|known| known.is_float == is_float);
    }
    literals.into_iter().filter_map(|(name, literal)| Some((name, literal?))).collect()
}

/// Returns an expression without the parentheses around it.
fn unwrapped(mut expr: &Expr) -> &Expr {
    while let ExprKind::Paren(inner) = &expr.kind {
        expr = inner;
    }
    expr
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_literals_of_the_global_code() {
        let text = "A = 5\nvar B = 0.5\nC = (-3) # three\nD = 1\nD = 1.5\nE = 1 + 2\nF = \"5\"\n\
            G = 1e3\nif(A) H = 2\nA = 6\nt = {}\nt.x = 4\nfunction step() { I = 3 }\n";
        let mut sources = SourceMap::default();
        sources.add("s.bzz", text.to_owned());
        let found = global_literals(&sources);
        let kinds: Vec<(&str, bool)> =
            found.iter().map(|(name, literal)| (name.as_str(), literal.is_float)).collect();
        assert_eq!(kinds, [("A", false), ("B", true), ("C", false), ("G", true)]);
        assert_eq!(sources.line_column(found["C"].span).line, 3);
        assert!(global_literals(&SourceMap::default()).is_empty());
    }
}
