//! Low-pass filters.
