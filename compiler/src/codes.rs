//! The codes of every diagnostic. `docs/diagnostics.md` explains each; a test checks that none is missing there.

use crate::diagnostic::Severity;

macro_rules! codes {
    ($($variant:ident = $text:literal, $title:literal;)*) => {
        /// A kind of error (`E....`) or warning (`W....`). The number never changes its meaning.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Code { $(#[doc = $title] $variant,)* }

        impl Code {
            /// Every code, in order.
            pub const ALL: &'static [Code] = &[$(Code::$variant,)*];

            /// As it is printed: `E0201`.
            pub fn text(self) -> &'static str {
                match self { $(Code::$variant => $text,)* }
            }

            /// One line that names the kind of mistake.
            pub fn title(self) -> &'static str {
                match self { $(Code::$variant => $title,)* }
            }
        }
    };
}

codes! {
    // Characters and tokens: E01..
    UnknownCharacter = "E0101", "a character that Buzz does not use";
    // Syntax: E02..
    // Includes: E03..
    // Names, functions and arguments: E04..
    // Literals and types: E05..
    // Limits of the image and of the robot: E06..
    // Warnings: W01.. syntax, W02.. names, W03.. values
}

impl Code {
    pub fn severity(self) -> Severity {
        if self.text().starts_with('W') { Severity::Warning } else { Severity::Error }
    }
}
