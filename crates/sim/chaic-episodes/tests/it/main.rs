//! Integration tests of `chaic-episodes`.

mod bundle;
mod decoys;
mod file;
mod generators;
