//! The pairs of brackets, found before parsing. After an error, the parser continues after the
//! closing bracket.

use crate::steps;
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
        let mut open = OpenBrackets::default();
        let mut last_stray_brace = None;
        for (position, token) in tokens.iter().enumerate() {
            steps::take(1);
            let wanted = match &token.kind {
                TokenKind::FileStart => {
                    open.push(position, TokenKind::FileEnd);
                    continue;
                }
                TokenKind::Fixed(fixed) => match fixed.closing() {
                    Some(closing) => {
                        open.push(position, TokenKind::Fixed(closing));
                        continue;
                    }
                    None => &token.kind,
                },
                TokenKind::FileEnd => &token.kind,
                _ => continue,
            };
            if let Some(opening) = open.close(wanted)
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

/// The brackets that are open at a token.
#[derive(Default)]
struct OpenBrackets {
    /// For each bracket its position, and the token that closes it.
    all: Vec<(usize, TokenKind)>,
    /// Indices in `all` of the braces and of the beginnings of files. A list of their own keeps the
    /// search for them short after many parentheses.
    blocks: Vec<usize>,
}

impl OpenBrackets {
    fn push(&mut self, position: usize, closing: TokenKind) {
        if !matches!(closing, TokenKind::Fixed(FixedToken::CloseParen | FixedToken::CloseBracket)) {
            self.blocks.push(self.all.len());
        }
        self.all.push((position, closing));
    }

    /// Removes the bracket that `closing` closes, and those inside it, and returns its position. A
    /// `}` also closes forgotten parentheses inside its block, and the end of a file closes all
    /// brackets that are open in the file. A stray `)` or `]` closes nothing else.
    fn close(&mut self, closing: &TokenKind) -> Option<usize> {
        let is_wanted = |index: &usize| self.all[*index].1 == *closing;
        let wanted = match closing {
            TokenKind::FileEnd => self.blocks.iter().copied().rfind(is_wanted)?,
            TokenKind::Fixed(FixedToken::CloseBrace) => {
                self.blocks.last().copied().filter(is_wanted)?
            }
            TokenKind::Fixed(FixedToken::CloseParen | FixedToken::CloseBracket) => {
                self.all.len().checked_sub(1).filter(is_wanted)?
            }
            _ => return None,
        };
        let opening = self.all[wanted].0;
        self.all.truncate(wanted);
        while self.blocks.pop_if(|index| *index >= wanted).is_some() {
            steps::take(1);
        }
        Some(opening)
    }
}
