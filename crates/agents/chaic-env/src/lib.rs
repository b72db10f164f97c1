//! Environment loop of an episode: observations, actions, rewards and records of all agents.
//!
//! **What it is**: the place where agents and world meet. An [`Env`] has an [`AgentSlot`] for each person
//! of an episode, controlled by an agent or by the caller. It renders the observations of agents whose
//! action has ended, resolves the pixels in their actions, submits the actions, and emits
//! [`trace::Record`]s. A [`Playback`] re-simulates a trace, to show or to verify it; [`narration`]
//! describes it in words. [`helper_registry`] creates helpers by name; [`rules`] holds the rules of world
//! and planners. An [`EnvBatch`] runs many environments in parallel.
//!
//! A learner that controls the helper next to the rule-based partner of the task:
//!
//! ```
//! use chaic_core::observation::{Grants, SensorConfig};
//! use chaic_core::{Action, AgentId};
//! use chaic_env::{AdvanceOutcome, AgentSlot, Env, EpisodeAgents, EpisodeConfig, RewardWeights};
//!
//! let episode = chaic_episodes::find_episode("low_target/train/00")?;
//! let config = EpisodeConfig { image_size: Some(64), ..EpisodeConfig::new(&episode, "learner") };
//! let sensors =
//!     SensorConfig { image_size: 64, rgb: true, depth: true, ids: false, frame_history: None };
//! let helper = Some(AgentSlot::external(Grants::NONE, sensors));
//! let mut env = Env::new(config, EpisodeAgents { helper, partner: None })?;
//! let briefing = env.briefing(AgentId::HELPER);
//! assert!(briefing.goal.is_none(), "the partner's goal is hidden");
//!
//! while env.advance(Some(90))? == AdvanceOutcome::NeedsAction {
//!     let terms = env.reward(AgentId::HELPER);
//!     let reward = terms.map(|terms| terms.weighted_sum(&RewardWeights::STANDARD));
//!     let observation = env.observe(AgentId::HELPER).expect("the helper waits");
//!     assert_eq!(observation.images.rgb.as_ref().map(Vec::len), Some(3 * 64 * 64));
//!     // A policy would choose by `observation` and learn from `reward`.
//!     assert!(reward.is_none_or(|r| r < 10.0));
//!     env.submit(AgentId::HELPER, Action::TurnLeft);
//! }
//! println!("{} of {} delivered", env.score().done, env.score().total);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **What it is not**: it reads no files, computes no scores over episodes, draws no plots or videos, and
//! makes no decisions.
//!
//! **Invariants**
//! - An agent receives its briefing and its observations only, and this crate creates both. The header of
//!   the trace records its grants.
//! - An episode depends on setup, seed, rules and actions only, not on the clock or on interruptions of
//!   the loop.
//! - All agents that wait in a frame choose before any of them acts.

mod agent_slot;
mod batch;
mod config;
mod continuation;
mod digest;
mod env;
mod error;
pub mod helper_registry;
mod key;
pub mod narration;
mod observer;
pub mod partner_suite;
mod playback;
pub mod recording;
mod rerun;
mod reseeded;
mod reward;
pub mod rules;
mod step;
pub mod trace;
mod track;
mod turn;

pub use agent_slot::{AgentSlot, Driver, EpisodeAgents, NoopAgent, agent_slots, world_seed};
pub use batch::{EnvBatch, ImageLayout, SlotId};
pub use chaic_render::{Appearance, ImagesMut};
pub use config::{EpisodeConfig, trace_header};
pub use continuation::{ContinuationError, Successors, continue_with};
pub use digest::Digest;
pub use env::{AdvanceOutcome, Env, EnvSnapshot};
pub use error::{EnvError, Result};
pub use key::{RunKey, slug};
pub use observer::{ObservationRenderer, RenderedObservation};
pub use playback::Playback;
pub use rerun::{AgentRerun, RerunMoment, RerunStatus};
pub use reseeded::seeded_by_episode;
pub use reward::{RewardTerms, RewardTracker, RewardWeights};
pub use track::{Track, TrackInfo};

/// Program version, as in run folders and traces.
pub const CHAIC_VERSION: &str = env!("CARGO_PKG_VERSION");
