//! Server of a study with people: serves its page, gives out slots and stores records.
//!
//! **What it is**: a [`StudyServer`] answers the requests of the page of a study. `store` has the participants
//! with their slots and files, independent of HTTP and of a clock (time is a parameter); `routes` translates
//! requests. If the simulator of the study runs on the server, `sessions` has the episodes that participants
//! play: the same `chaic_web::LiveSession` as in a page.
//!
//! **What it is not**: it exports nothing, knows no names of participants and writes no log of requests.
//!
//! **Invariants**
//! - A record is on the disk before its request is answered. A repeated request changes nothing.
//! - The files contain no token, no address and no time. The folder holds digests of tokens.
//! - If the simulator runs on the server, no answer before the end of an episode has its id, its goal or its trace.
//! - No part of a request becomes a path, except a valid participant code.

mod access;
mod app;
mod error;
mod limits;
mod log;
mod picture;
mod play_routes;
mod refusal;
mod routes;
mod server;
mod sessions;
mod store;
mod token_bucket;
mod write_timeout;

pub use app::{Clock, Reporter};
pub use error::{Result, ServerError};
pub use limits::{
    ENTRY_RATE, MAX_BODY_BYTES, MAX_SESSIONS, MAX_TURN_BYTES, MAX_TURN_FRAMES, PARTICIPANT_RATE,
    RateLimit, SESSION_IDLE_SECS, TURN_RATE,
};
pub use refusal::Refusal;
pub use server::{ServerOptions, StudyServer};
pub use sessions::AdvanceRequest;
pub use store::ParticipantCounts;
