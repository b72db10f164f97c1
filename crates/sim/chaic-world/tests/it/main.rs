//! Integration tests of `chaic-world`.

mod common;

mod actions;
mod compat;
mod determinism;
mod granted;
mod impairments;
mod random;
mod watches;
