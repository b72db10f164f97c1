//! Integration tests of `chaic-render-gpu`.

mod common;

mod agreement;
mod limits;
