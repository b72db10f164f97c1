//! Integration tests of `chaic-world`.

mod common;

mod actions;
mod compat;
mod determinism;
mod impairments;
mod random;
mod watches;
