//! Polynomials of degree 7.
