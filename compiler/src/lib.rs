//! The Buzz compiler: from the text of a script to diagnostics, an image and its symbols.
//!
//! [`parser::parse`] reads a script with everything that it includes and gives the syntax tree. All errors that
//! can be found are found in one run, each with a [`codes::Code`], a place and help.

pub mod ast;
pub mod codes;
pub mod diagnostic;
pub mod include;
pub mod lexer;
pub mod parser;
pub mod source;
pub mod token;
