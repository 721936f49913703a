//! Tests of the page's server, and of pages in frames.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod door;
mod frames;
mod session;
