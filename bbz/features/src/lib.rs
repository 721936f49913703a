//! Gives shared crates one set of features in all builds of tests.
//!
//! Cargo compiles a crate once for each set of its features, and with it all crates that use it. The
//! packages of a build decide the features, so that tests of the whole workspace, the book and the Python
//! module would compile the same crates three times, for several minutes. This crate has no code: it is
//! in each of these builds and asks for all features that any of them needs. `cargo xtask ci python`
//! names the crates that differ, with the features to add in `Cargo.toml`.
//!
//! Programs and modules that users build do not depend on it, so that they have the features that they
//! ask for themselves.
