//! The pairs of brackets, found before parsing. After an error, the parser continues after the
//! closing bracket.

use crate::token::{FixedToken, Token, TokenKind};

/// The partner of every bracket.
pub(super) struct Brackets {
    /// For each token the position of its partner; [`NONE`] for brackets without a partner and for
    /// other tokens.
    partner: Vec<u32>,
    /// For each token, true if the parser takes the token for the beginning of a statement block.
    blocks: Vec<bool>,
    /// The last `}` without a partner.
    last_stray_brace: Option<usize>,
}

const NONE: u32 = u32::MAX;

impl Brackets {
    pub(super) fn new(tokens: &[Token]) -> Self {
        let mut partner = vec![NONE; tokens.len()];
        let mut open: Vec<(usize, TokenKind)> = Vec::new();
        let mut last_stray_brace = None;
        for (position, token) in tokens.iter().enumerate() {
            let wanted = match &token.kind {
                TokenKind::FileStart => {
                    open.push((position, TokenKind::FileEnd));
                    continue;
                }
                TokenKind::Fixed(fixed) => match fixed.closing() {
                    Some(closing) => {
                        open.push((position, TokenKind::Fixed(closing)));
                        continue;
                    }
                    None => &token.kind,
                },
                TokenKind::FileEnd => &token.kind,
                _ => continue,
            };
            if let Some(opening) = Self::close(&mut open, wanted)
                && let [Some(a), Some(b)] = [opening, position].map(|i| u32::try_from(i).ok())
            {
                partner[opening] = b;
                partner[position] = a;
            } else if *wanted == TokenKind::Fixed(FixedToken::CloseBrace) {
                last_stray_brace = Some(position);
            }
        }
        Brackets { blocks: vec![false; tokens.len()], partner, last_stray_brace }
    }

    /// Pops the bracket that `closing` closes from the stack. A `}` also closes forgotten
    /// parentheses inside its block, and the end of a file closes all brackets that are open in the
    /// file. A stray `)` or `]` closes nothing else.
    fn close(open: &mut Vec<(usize, TokenKind)>, closing: &TokenKind) -> Option<usize> {
        let wanted = match closing {
            TokenKind::FileEnd => open.iter().rposition(|(_, kind)| *kind == TokenKind::FileEnd)?,
            TokenKind::Fixed(FixedToken::CloseBrace) => {
                let weak = |kind: &TokenKind| {
                    matches!(
                        kind,
                        TokenKind::Fixed(FixedToken::CloseParen | FixedToken::CloseBracket)
                    )
                };
                open.iter().rposition(|(_, kind)| !weak(kind)).filter(|i| open[*i].1 == *closing)?
            }
            TokenKind::Fixed(FixedToken::CloseParen | FixedToken::CloseBracket) => {
                open.len().checked_sub(1).filter(|i| open[*i].1 == *closing)?
            }
            _ => return None,
        };
        let opening = open[wanted].0;
        open.truncate(wanted);
        Some(opening)
    }

    /// Returns the position of the bracket that pairs with the one at `position`. The begin and the
    /// end of an included file are a pair as well.
    pub(super) fn partner(&self, position: usize) -> Option<usize> {
        self.partner.get(position).filter(|partner| **partner != NONE).map(|p| *p as usize)
    }

    /// Returns true if a `}` after `position` has no partner, which means that a `{` is missing
    /// somewhere.
    pub(super) fn lack_opening_brace(&self, position: usize) -> bool {
        self.last_stray_brace.is_some_and(|stray| stray > position)
    }

    pub(super) fn mark_block(&mut self, position: usize) {
        if let Some(block) = self.blocks.get_mut(position) {
            *block = true;
        }
    }

    pub(super) fn is_block(&self, position: usize) -> bool {
        self.blocks.get(position) == Some(&true)
    }
}
