//! Agents: the simulated people and the helpers without networks.
//!
//! **What it is**: a [`PlanningAgent`] joins five parts. [`perception`] detects objects, [`memory`]
//! maps them, and [`behavior`] tracks the actions of other agents. A [`decision::Policy`] chooses
//! the next plan, and [`execution`] turns it into actions. Policies may use [`belief`], which infers
//! a partner's goal and limits, and [`team`], which plans for both people. [`partners`] are part of
//! the benchmark's definition; [`helpers`] are the agents under evaluation. Both are the same type
//! with different data.
//!
//! **What it is not**: it holds no world state and renders nothing; it never depends on
//! `chaic-world` or `chaic-render`.
//!
//! **Invariants**
//! - An agent's only inputs are its briefing, its observations and its grants.
//! - The same briefing and observations lead to the same actions on every machine. Random numbers
//!   come from [`chaic_core::rng::RngStream`], nothing reads a clock, and no hash map is iterated.
//!
//! ```
//! use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
//! use chaic_agents::{HelperInfo, PlannerRules};
//! let rhp = HelperInfo::find_helper("rhp").expect("it is in the table");
//! let agent = (rhp.make)(PlannerRules::paper(), &GroundTruthPerceptionFactory);
//! assert!(agent.sensors().depth);
//! assert!((rhp.grants)(PlannerRules::paper()).ids);
//! ```

pub mod track;

pub mod perception;
pub mod rules;

pub mod mapping;
pub mod planning;

pub mod memory;

pub mod behavior;
pub mod belief;
pub mod perception_factory;

pub mod decision;
pub mod execution;

pub mod team;

pub mod policies;

pub mod planning_agent;

pub mod helpers;
pub mod partners;

mod child;

#[cfg(test)]
mod test_support;

pub use helpers::{HELPERS, HelperInfo};
pub use partners::{child, partner, partner_grants};
pub use planning_agent::PlanningAgent;
pub use rules::PlannerRules;
pub use track::{Intent, TrackId};
