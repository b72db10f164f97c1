//! Integration tests of `chaic-world`.

mod common;

mod actions;
mod compat;
mod determinism;
mod granted;
mod impairments;
mod joint_carry;
mod limits;
mod positions;
mod random;
mod supports;
mod watches;
