//! Shared types of agents and worlds.
//!
//! **What it is**: the data types that all crates of chaic use.
//! - Scene: coordinate frames ([`geom`]), ids ([`ids`]), the [`catalogue`] of object classes.
//! - People and tasks: body capabilities ([`capability`]), the tasks ([`task`]).
//! - Agents: the [`agent::Agent`] trait, actions ([`action`]), the [`briefing`] before an episode,
//!   the [`observation`] during it, and the content of a memory for drawings ([`memory_view`]).
//! - Random numbers: named streams ([`rng`]).
//!
//! **What it is not**: it holds no world state, reads no files and renders no images.
//!
//! **Invariants**
//! - Every type here is plain data and cannot access a world.
//! - Hidden information is in a separate type ([`observation::GrantedInfo`]). The runner fills it
//!   on request and writes it into the trace; an agent cannot obtain it otherwise.

pub mod geom;
pub mod ids;

pub mod capability;
pub mod catalogue;
pub mod task;

pub mod action;
pub mod agent;
pub mod briefing;
pub mod memory_view;
pub mod observation;

pub mod rng;

pub use action::{Action, FailureReason, Hand, Outcome, ResolvedAction, Target};
pub use agent::{Agent, AgentError};
pub use briefing::Briefing;
pub use catalogue::{ClassInfo, Role};
pub use glam::{Quat, Vec2, Vec3};
pub use ids::{AgentId, ClassId, EntityId, FRAMES_PER_SECOND, Frame};
pub use observation::Observation;
pub use task::TaskId;
