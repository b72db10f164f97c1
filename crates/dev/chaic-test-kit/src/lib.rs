//! What tests, benches and examples of several crates share: hand-made worlds to look at
//! ([`scenes`]), and random and hostile ones with what must hold of their pictures ([`hostile`]).
//!
//! **What it is not**: part of any program; nothing depends on it but tests, benches and examples.

pub mod hostile;
pub mod scenes;

pub use chaic_render::View;
