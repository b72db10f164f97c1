//! Integration tests of `chaic-learn`.

mod learning;
mod old_keys;
mod opponent;
mod partner;
mod policies;
mod ppo_reference;
mod settings;
mod training;
