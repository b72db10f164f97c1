//! What a mind and the world say to each other.
//!
//! **What it is**: the vocabulary that every room of chaic shares. Frames of reference
//! ([`geom`]), handles ([`ids`]), the catalogue of object classes ([`catalogue`]), what bodies
//! can do ([`capability`]), the tasks ([`task`]), what an agent may do ([`action`]), what it
//! is told before ([`briefing`]) and during an episode ([`observation`]), the [`agent::Agent`]
//! trait, and the named random streams ([`rng`]).
//!
//! **What it is not**: it holds no state of a world, reads no files and makes no pixels.
//!
//! **Invariants**
//! - Every type here is plain data; nothing in it can reach a world.
//! - What a helper may not know is a separate type ([`observation::Granted`]) that the runner
//!   fills on request and writes into the trace. An agent can't obtain it otherwise.

pub mod geom;
pub mod ids;

pub mod capability;
pub mod catalogue;
mod impairment;
pub mod task;

pub mod action;
pub mod agent;
pub mod briefing;
pub mod observation;

pub mod rng;

pub use action::{Action, FailureReason, Hand, Outcome, ResolvedAction, Target};
pub use agent::{Agent, AgentError};
pub use briefing::Briefing;
pub use catalogue::{ClassInfo, Role};
pub use glam::{Quat, Vec2, Vec3};
pub use ids::{AgentId, ClassId, EntityId, Frame};
pub use observation::Observation;
pub use task::TaskId;
