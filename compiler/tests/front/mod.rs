//! Tests of the front end: lexer, parser, includes, rendering, explanations.

mod errors;
mod explanations;
mod grammar;
mod includes;
mod lexer;
mod missing;
mod mistakes;
mod properties;
mod rendering;
mod support;
mod warnings;
