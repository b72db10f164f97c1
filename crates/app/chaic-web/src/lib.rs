//! Replays and play in a browser.
//!
//! **What it is**: the module that the pages of chaic load. A [`ReplayPlayer`] re-simulates a trace in
//! steps, compares the digest of each decision with the recorded one, and shows any verified frame.
//! Partner and helper run again beside it, for drawings of what they know. A [`LiveSession`] runs an
//! episode in which a person controls an agent, from the start or from a frame of a trace; the server of
//! a study uses it too. `bindings` exports both to JavaScript.
//!
//! **What it is not**: it reads no files, uses no network and no threads, and contains no page; the
//! elements of the page are in `web/`.

#[cfg(target_arch = "wasm32")]
mod bindings;
mod drawing;
mod keyframes;
mod limits;
mod live;
mod memory_history;
mod player;
mod timeline;

pub use drawing::{CanvasLabel, DrawnImage, DrawnMap};
pub use limits::{Limit, TaskObject};
pub use live::{
    InputLevel, LiveConfig, LiveError, LiveInfo, LiveInput, LiveSession, LiveState, LiveStatus,
    PERSON,
};
pub use memory_history::{MemoryState, PlacedObject, RerunInfo};
pub use player::{DecisionLine, FrameState, PlayerError, ReplayInfo, ReplayPlayer, RerunState};
pub use timeline::{Activity, Delivery, StoryLine, Timeline};
