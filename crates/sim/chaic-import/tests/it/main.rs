//! Integration tests of `chaic-import`.

mod original;
mod samples;
