//! Helpers that learn to choose plans or single actions, and how they learn.
//!
//! **What it is**: [`actor_critic`] is what all networks do that choose and value, [`choice_network`] one for any number of
//! choices, [`ppo`] makes them better by what came of their choices (proximal policy optimization).
//! [`features`] says what a choice between plans is seen as, which [`opponent`] may add to, who tells what the partner is
//! about; [`policy`] lets a network drive a mind and keeps what happened, [`rollout`] plays episodes with it, [`rewards`] says
//! what came of them, [`cloning`] learns from a teacher, and [`train`] has the loops. [`primitive`] has policies of single
//! actions from images. [`helpers`] makes either a helper of a run. [`toy`] has tasks whose best return is known, for tests of the
//! learner itself.
//!
//! **What it is not**: it knows no rules of tasks. Perception, memory and the carrying out of plans are those of
//! `chaic-agents`; a learned helper sees what its mind sees and remembers, and nothing else.
//!
//! **Invariants**
//! - Rewards are facts of the world that no helper is told; they are for training alone, and leave with the
//!   episode.
//! - The same configuration and seed give the same weights, bit for bit, on any machine and number of threads.

pub mod actor_critic;
pub mod choice_network;
pub mod ppo;
pub mod scales;

pub mod opponent;

pub mod features;

pub mod cloning;
pub mod play_rules;
pub mod policy;
pub mod rewards;
pub mod rollout;
pub mod train;

pub mod primitive;

pub mod helpers;

pub mod toy;
