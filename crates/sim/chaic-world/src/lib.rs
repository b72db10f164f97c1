//! Simulated world of an episode: initial setup, rules, state and the frame-by-frame update.
//!
//! **What it is**: [`Setup`] is the initial condition of an episode and [`State`] its current
//! state. [`Rules`] holds the constants. [`World`] steps the episode frame by frame and records
//! what happens as [`Event`]s.
//!
//! **What it is not**: it reads no files, renders no images, computes no scores and reads no clock.
//! It takes actions and returns outcomes; agents live in other crates.
//!
//! **Invariants**
//! - The next state depends on the setup, the rules, the state and the submitted actions only.
//! - [`State`] is complete: a world restored from a snapshot continues bit-identically.
//! - Besides the state, only the list of pending events changes. The other fields are the setup, the rules
//!   and values derived from them.

mod floors;
mod setup;
mod state;

mod random;

mod rules;

mod event;
mod posture;
mod shape;

mod collide;
mod fall;
mod probe;

mod act;
mod aside;
mod goal;
mod granted_state;
mod place;
mod tick;
mod view;
mod world;

pub use event::{Event, EventKind};
pub use posture::{Arm, Posture};
pub use rules::{CollisionResponse, Durations, JointLift, ReachReference, Rules};
pub use setup::{
    AgentSpec, Floor, FloorMaterial, ObjectSpec, Opening, Room, RoomKind, Setup, SetupError, Wall,
};
pub use shape::{Block, Surface, blocks_of, non_colliding_blocks, top_surfaces};
pub use state::{
    ActionStep, Activity, AgentState, JointCarry, LastProgress, ObjectLocation, ObjectState,
    PROGRESS_M, Phase, RandomDrawCounts, STUCK_AFTER_FRAMES, State,
};
pub use view::episode_stream;
pub use world::{Snapshot, SnapshotError, SubmitError, World};
