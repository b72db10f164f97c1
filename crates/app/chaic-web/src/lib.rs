//! Replays in a browser: re-simulates a trace, draws it and describes it in words.
//!
//! **What it is**: the module that the pages of `chaic view` load. A [`ReplayPlayer`] replays the whole
//! trace once when it is opened, compares the digest of each decision with the recorded one, and then
//! shows any frame. `bindings` exports it to JavaScript.
//!
//! **What it is not**: it reads no files, uses no network and no threads, and contains no page; the
//! elements of the page are in `web/`.

#[cfg(target_arch = "wasm32")]
mod bindings;
mod player;
mod timeline;

pub use player::{DrawnImage, FrameState, PlayerError, ReplayInfo, ReplayPlayer};
pub use timeline::{Activity, ActivityKind, Delivery, StoryLine, Timeline};
