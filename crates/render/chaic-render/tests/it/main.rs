//! Integration tests of `chaic-render`.

mod catalogue;
mod fuzz;
mod geometry;
mod golden;
mod images;
