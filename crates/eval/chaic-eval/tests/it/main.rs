//! Integration tests of `chaic-eval`.

mod color_only;
mod helpers;
mod hidden;
mod openings;
