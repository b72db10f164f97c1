//! Integration tests of `chaic-learn`.

mod old_keys;
mod opponent;
mod ppo_reference;
mod training;
