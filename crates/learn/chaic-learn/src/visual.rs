//! Visual policies: the paper's RL baseline, which reads color, depth, a map and the agent's own
//! state (appendix on learning).
//!
//! [`actions`] has the action spaces, [`observation`] the input, [`network`] the network, [`helper`]
//! the agent, and [`train`] the training by proximal policy optimization, with the paper's
//! hyperparameters by default.

pub mod actions;
pub mod network;
pub mod observation;

pub mod helper;

mod config;
mod env_runner;
pub mod train;
