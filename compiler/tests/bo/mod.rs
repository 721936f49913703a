//! Tests of the `.bo` importer.
//!
//! Its inputs come from three places: files that the reference compiler wrote ([`vectors`]), assembly text put into
//! bytes here ([`assembler`]), and scripts compiled as the reference compiler does it ([`reference`], itself tested
//! against the vectors). What imported programs do is compared with written expectations and with what the file does in
//! its own machine ([`interpreter`]).

mod assembler;
mod closures;
mod debugging;
mod equivalence;
mod interpreter;
mod machine;
mod malformed;
mod properties;
mod reading;
mod reference;
mod running;
mod vectors;
