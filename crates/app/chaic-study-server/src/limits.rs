//! Limits of the server. Each limit applies to one request, one participant or all participants
//! together.

use std::time::Duration;

/// Maximum size of a request's body, bytes: several hundred decisions.
pub const MAX_BODY_BYTES: usize = 1 << 20;
/// Maximum size of a request's line and headers, bytes. Browsers send less than 2 KiB.
pub const MAX_HEADER_BYTES: usize = 16 << 10;
/// Maximum number of open connections: five for each of 100 participants.
pub const MAX_CONNECTIONS: usize = 512;
/// Maximum number of records of a participant: about five decisions a second for two hours.
pub const MAX_RECORDS: usize = 40_000;
/// Maximum size of a participant's file, bytes. A participation has a few hundred kilobytes.
pub const MAX_FILE_BYTES: usize = 16 << 20;
/// Maximum number of participants per slot: nine drop-outs for each who finishes.
pub const PARTICIPANTS_PER_SLOT: usize = 10;
/// Time in which a client must send line and headers of its next request.
pub const HEADER_TIMEOUT: Duration = Duration::from_secs(30);
/// Time in which a request must be answered, including the transfer of its body.
pub const REQUEST_TIMEOUT: Duration = Duration::from_secs(60);
/// Time in which a client must accept an answer: 100 kbit/s suffice for the page of 1.5 MB.
pub const WRITE_TIMEOUT: Duration = Duration::from_secs(120);
/// Time for which the end of the server waits for requests in progress.
pub const STOP_TIMEOUT: Duration = Duration::from_secs(10);
/// Threads that write files.
pub const WRITER_THREADS: usize = 16;
/// Additional threads that simulate, if helpers of the study are other processes.
pub const WAITING_THREADS: usize = 32;
/// Rate of requests of one participant. The page sends one request at a time, with all waiting
/// records.
pub const PARTICIPANT_RATE: RateLimit = RateLimit { burst: 100, per_sec: 20 };
/// Rate of new participants: a school class that begins at once, then five a second.
pub const ENTRY_RATE: RateLimit = RateLimit { burst: 200, per_sec: 5 };

/// Maximum size of the body of a turn, bytes: a plan has less than 200 characters.
pub const MAX_TURN_BYTES: usize = 4 << 10;
/// Maximum number of frames of a turn: a second at the highest speed.
pub const MAX_TURN_FRAMES: u32 = 240;
/// Maximum side of a picture, and the step between valid sides, pixels. Helpers see pictures of the
/// largest size.
pub const VIEW_PX: [u32; 2] = [512, 64];
/// Rate of turns of one participant. The page asks for at most 14 pictures a second.
pub const TURN_RATE: RateLimit = RateLimit { burst: 60, per_sec: 20 };
/// Maximum number of episodes in memory: see the measured size of an episode in docs/studies.md.
pub const MAX_SESSIONS: usize = 200;
/// Time without a turn after which an episode leaves the memory, seconds.
pub const SESSION_IDLE_SECS: u64 = 300;
/// Interval of the search for such episodes.
pub const IDLE_INTERVAL: Duration = Duration::from_secs(30);
/// Simulated time after which the trace of a running episode is stored, also without a decision, frames.
pub const RECORD_FRAMES: u32 = 15;

/// Limit of a request rate.
#[derive(Clone, Copy, Debug)]
pub struct RateLimit {
    /// Maximum number at once.
    pub burst: u64,
    /// Number per second in the long run.
    pub per_sec: u64,
}
