//! The Buzz compiler: from the text of a script to diagnostics, an image and its symbols.
//!
//! [`parser::parse`] reads a script with everything that it includes and gives the syntax tree. All errors that
//! can be found are found in one run, each with a [`codes::Code`], a place and help; [`render`] writes them for
//! people and for programs, [`mod@explain`] explains a code.

pub mod allow;
pub mod ast;
pub mod bo;
pub mod check;
pub mod codegen;
pub mod codes;
pub mod compile;
pub mod diagnostic;
pub mod disasm;
pub mod explain;
pub mod fit;
pub mod image;
pub mod include;
pub mod lexer;
pub mod parser;
pub mod refusal;
pub mod render;
pub mod source;
pub mod strings;
pub mod symbols;
pub mod token;
