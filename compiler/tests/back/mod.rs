//! Tests of the back end: from scripts to diagnostics, images and symbols, and what the virtual machine makes of
//! the images.

mod asm;
mod beginnings;
mod calls;
mod captures;
mod classes;
mod control;
mod diagnostics;
mod disasm;
mod fit;
mod folding;
mod help;
mod host_tables;
mod image;
mod libraries;
mod locals;
mod machine;
mod messages;
mod mutants;
mod parts;
mod questions;
mod random_scripts;
mod robots;
mod scripts;
mod stigmergies;
mod symbols;
mod unknown_names;
mod unreached_calls;
