//! One episode as a loop: who takes part, what each of them perceives, and what comes of what they
//! choose.
//!
//! **What it is**: where minds and world meet. An [`Env`] has a [`Seat`] for everybody in an episode,
//! driven by a mind or by the caller. It renders what those perceive whose action has ended,
//! resolves the pixels they point at, submits what they choose, and tells all that happened as
//! [`trace::Record`]s. [`run_loop`] is the loop itself, which audits run with decisions of a trace;
//! a [`Playback`] shows a trace frame by frame.
//! [`minds`] says where minds come from by name, [`rules`] by which rules they and the world go.
//!
//! An [`EnvBatch`] is many of them at once.
//!
//! A learner that drives the helper itself, beside the rule-based partner of the task:
//!
//! ```
//! use chaic_env::rules::RuleSet;
//! use chaic_env::{Appearance, Env, EpisodeConfig, Flow, Minds, RewardWeights, Seat};
//! use chaic_core::observation::{Grants, Senses};
//! use chaic_core::{Action, AgentId};
//!
//! let episode = chaic_episodes::find_episode("low_target/train/00")?;
//! let config = EpisodeConfig {
//!     episode: &episode,
//!     seed: 0,
//!     rules: RuleSet::PAPER,
//!     helper: "learner",
//!     partner: None,
//!     image_size: Some(64),
//!     appearance: Appearance::Canonical,
//! };
//! let senses = Senses { image_size: 64, rgb: true, depth: true, ids: false, film: None };
//! let helper = Some(Seat::of_caller(Grants::NONE, senses));
//! let mut env = Env::new(config, Minds { helper, partner: None })?;
//! let briefing = env.briefing(AgentId::HELPER);
//! assert!(briefing.goal.is_none(), "nobody tells a helper what the partner wants");
//!
//! while env.advance(Some(90))? == Flow::Waits {
//!     let reward = env.reward(AgentId::HELPER).map(|terms| terms.weigh(&RewardWeights::STANDARD));
//!     let seen = env.observe(AgentId::HELPER).expect("it waits");
//!     assert_eq!(seen.images.rgb.as_ref().map(Vec::len), Some(3 * 64 * 64));
//!     // A policy would decide by `seen`, and learn by `reward`.
//!     assert!(reward.is_none_or(|r| r < 10.0));
//!     env.submit(AgentId::HELPER, Action::TurnLeft);
//! }
//! println!("{} of {} delivered", env.score().done, env.score().total);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **What it is not**: it knows no files, scores of many episodes, plots or video, and it decides
//! for nobody.
//!
//! **Invariants**
//! - What an agent gets is its briefing and its observations, made here and nowhere else, and what
//!   it is granted stands in the header of the trace.
//! - What happens depends on episode, seed, rules and choices only: not on the clock, not on how
//!   often the loop was stopped and gone on with.
//! - All who wait in one frame choose before any of them acts.

mod batch;
mod config;
mod digest;
mod env;
mod error;
mod key;
pub mod minds;
mod observer;
mod playback;
mod reseeded;
mod reward;
pub mod rules;
mod run_loop;
mod seat;
pub mod trace;
mod track;

pub use batch::{EnvBatch, ImageLayout, Slot};
pub use chaic_render::{Appearance, ImagesMut};
pub use config::{EpisodeConfig, header_of, world_of};
pub use digest::Digest;
pub use env::{Env, EnvSnapshot, Flow};
pub use error::{EnvError, Result};
pub use key::{RunKey, slug};
pub use observer::{Glimpse, Observer};
pub use playback::Playback;
pub use reseeded::seeded_by_episode;
pub use reward::{RewardTerms, RewardWeights, Totals};
pub use run_loop::{Choice, Players, run_loop};
pub use seat::{Driver, Idle, Minds, Seat, seats, world_seed};
pub use track::{Track, TrackInfo};

/// The version of the program, as it stands in run folders and traces.
pub const CHAIC_VERSION: &str = env!("CARGO_PKG_VERSION");
