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
//! **What it is not**: it knows no files, scores of many episodes, plots or video, and it decides
//! for nobody.
//!
//! **Invariants**
//! - What an agent gets is its briefing and its observations, made here and nowhere else, and what
//!   it is granted stands in the header of the trace.
//! - What happens depends on episode, seed, rules and choices only: not on the clock, not on how
//!   often the loop was stopped and gone on with.
//! - All who wait in one frame choose before any of them acts.

mod config;
mod digest;
mod env;
mod error;
mod key;
pub mod minds;
mod observer;
mod playback;
pub mod rules;
mod run_loop;
mod seat;
pub mod trace;

pub use chaic_render::Appearance;
pub use config::{EpisodeConfig, header_of, world_of};
pub use digest::Digest;
pub use env::{Env, Flow};
pub use error::{EnvError, Result};
pub use key::{RunKey, slug};
pub use observer::{Glimpse, Observer};
pub use playback::Playback;
pub use run_loop::{Choice, Decide, run_loop};
pub use seat::{Driver, Idle, Minds, Seat, seats, world_seed};

/// The version of the program, as it stands in run folders and traces.
pub const CHAIC_VERSION: &str = env!("CARGO_PKG_VERSION");
