//! Integration tests of `chaic-env`.

mod batch;
mod env;
mod forecast;
mod granted_state;
mod rewards;
