//! Integration tests of `chaic-env`.

mod batch;
mod env;
mod granted_state;
