//! Server of a study with people: serves its page, gives out slots and stores records.
//!
//! **What it is**: a [`StudyServer`] answers the requests of the page of a study. `store` has the participants
//! with their slots and files, without HTTP and with time as a parameter; `routes` translates requests.
//!
//! **What it is not**: it runs no episodes, exports nothing, knows no names of participants and writes no log
//! of requests. The page contains the episodes with their goals.
//!
//! **Invariants**
//! - A record is on the disk before its request is answered. A repeated request changes nothing.
//! - The files contain no token, no address and no time. The folder holds digests of tokens.
//! - No part of a request becomes a path, except a valid participant code.

mod access;
mod error;
mod limits;
mod log;
mod refusal;
mod routes;
mod server;
mod store;
mod token_bucket;

pub use error::{Result, ServerError};
pub use limits::{ENTRY_RATE, MAX_BODY_BYTES, PARTICIPANT_RATE, Rate};
pub use routes::{Clock, Reporter};
pub use server::{ServerOptions, StudyServer};
pub use store::Counts;
