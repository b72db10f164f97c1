//! The state of an episode as plain data, and its rules.
//!
//! **What it is**: [`Setup`] says how an episode begins, [`State`] how it stands, [`Rules`] by
//! which constants it goes on, [`World`] runs it frame by frame and tells what happened as
//! [`Event`]s.
//!
//! **What it is not**: it reads no files, makes no pixels, keeps no scores and knows no clock.
//! It doesn't know what an agent thinks; it takes actions and returns outcomes.
//!
//! **Invariants**
//! - The next state depends on the setup, the rules, the state and the submitted actions only.
//! - [`State`] is the whole truth: restoring a snapshot continues to the same bits.
//! - Everything else a [`World`] holds is derived from the setup and never changes.

mod setup;
mod state;

mod luck;

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
mod place;
mod tick;
mod view;
mod world;

pub use event::{Event, EventKind};
pub use luck::Draws;
pub use posture::{Arm, Posture};
pub use rules::{Blocking, Durations, JointLift, ReachTo, Rules};
pub use setup::{
    Floor, FloorMaterial, Opening, Person, Room, RoomKind, Setup, SetupError, Thing, Wall,
};
pub use shape::{Block, Surface, blocks_of, ghosts_of, top_surfaces};
pub use state::{
    Activity, JointCarry, LastProgress, PROGRESS_M, PersonState, Phase, Place, STUCK_AFTER_FRAMES,
    State, Step, ThingState,
};
pub use view::episode_stream;
pub use world::{Snapshot, SnapshotError, SubmitError, World};
