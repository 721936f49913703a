//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod documents;
mod fragmentation;
mod machine;
mod message_content;
mod message_properties;
mod message_waiting;
mod number;
mod number_float16;
mod number_format;
mod number_maths;
mod number_mixed;
mod number_profile;
mod number_rng;
mod seal;
mod slices;
mod verifier;
mod wire_format;
