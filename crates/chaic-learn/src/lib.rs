//! Helpers that learn to choose plans, and how they learn.
//!
//! **What it is**: [`features`] says what a choice is seen as, [`choice_network`] is the network that
//! chooses and values, [`policy`] lets it drive a mind and keeps what happened, [`rollout`] plays episodes with
//! it, [`rewards`] says what came of them, [`opponent`] tells what the partner is about, [`helpers`] makes it a helper of a run; [`ppo`] makes it better by what came of them (proximal policy
//! optimization), [`cloning`] learns from a teacher, and [`train`] has the loops.
//! [`toy`] has tasks whose best return is known, for tests of the learner itself.
//!
//! **What it is not**: it knows no rules of tasks and no pixels. Perception, memory and the carrying out of plans
//! are those of `chaic-agents`; a learned helper sees what its mind remembers and nothing else.
//!
//! **Invariants**
//! - Rewards are facts of the world that no helper is told; they are for training alone, and leave with the
//!   episode.
//! - The same configuration and seed give the same weights, bit for bit, on any machine and number of threads.

pub mod choice_network;
pub mod scales;

pub mod opponent;

pub mod features;
pub mod ppo;

pub mod cloning;
pub mod policy;
pub mod rewards;
pub mod rollout;

pub mod helpers;

pub mod toy;
pub mod train;
