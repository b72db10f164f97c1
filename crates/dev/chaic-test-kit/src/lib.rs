//! Common parts of tests, benches and examples of several crates: handmade worlds ([`scenes`]), and
//! random and hostile inputs with checks of their images ([`hostile`]).
//!
//! **What it is not**: part of a program; only tests, benches and examples depend on it.

pub mod hostile;
pub mod scenes;

pub use chaic_render::View;
