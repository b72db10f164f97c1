//! Helpers that learn to choose plans or actions, and their trainings.
//!
//! **What it is**: [`actor_critic`] is the interface of policy networks, [`candidate_scorer`] a
//! network for any number of candidates, [`ppo`] proximal policy optimization. [`features`] encodes a
//! decision between plans; predictions of the [`opponent`] model and earlier decisions may extend it.
//! [`policy`] lets a network drive an agent, [`policy_kind`] lists networks by their inputs, and
//! [`rollout`] plays episodes. [`cloning`] learns from an expert whose choices [`demonstrations`]
//! keeps, and [`train`] has the trainers. [`visual`] has policies that read images, and [`partner`]
//! has policies of partners. [`helpers`] registers policies as helpers and partners of a run, and
//! [`bundled`] lists the policies that are part of chaic. [`toy`] has tasks with a known best return,
//! which test the learner.
//!
//! **What it is not**: it knows no rules of tasks. Perception, memory and execution of plans are
//! those of `chaic-agents`; a learned helper has no other inputs.
//!
//! **Invariants**
//! - Rewards are ground truth that no helper observes; only trainings use them.
//! - Equal configurations and seeds give bit-identical weights on any machine and number of
//!   threads.

pub mod actor_critic;
pub mod candidate_scorer;
pub mod ppo;
pub mod scales;

pub mod opponent;

mod decision_memory;
pub mod features;

pub mod cloning;
pub mod demonstrations;
mod plan_history;
pub mod policy;
pub mod policy_kind;
mod reward_config;
pub mod rollout;
pub mod rollout_config;
pub mod train;

pub mod visual;

pub mod partner;

pub mod bundled;
pub mod helpers;
mod loaded_policy;

pub mod toy;

#[cfg(test)]
mod test_support;
