//! The Buzz compiler: turns the text of a script into diagnostics, an image and its symbols.
//!
//! [`parser::parse`] reads a script with everything that it includes and returns the syntax tree.
//! One run finds all errors that can be found. Each error has a [`codes::DiagnosticCode`], a place and help.
//! [`render`] prints errors as text or JSON, [`mod@explain`] explains a code.

pub mod allow;
pub mod asm;
pub mod ast;
pub mod bo;
pub mod check;
pub mod codegen;
pub mod codes;
pub mod comments;
pub mod compile;
pub mod constant;
pub mod diagnostic;
pub mod disasm;
pub mod explain;
pub mod fit;
pub mod image;
pub mod include;
mod layout;
pub mod lexer;
pub mod limits;
pub mod literals;
pub mod messages;
pub mod parser;
pub mod profile;
pub mod question;
pub mod refusal;
pub mod render;
pub mod source;
mod steps;
pub mod stigmergies;
pub mod strings;
pub mod symbols;
pub mod token;
