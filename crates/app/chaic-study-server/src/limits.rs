//! Limits of the server. Each bounds what one request, one participant or all together can use.

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
/// Time for which the end of the server waits for requests in progress.
pub const STOP_TIMEOUT: Duration = Duration::from_secs(10);
/// Threads that write files.
pub const WRITER_THREADS: usize = 16;
/// Requests of one participant. The page sends one at a time, with all records that wait.
pub const PARTICIPANT_RATE: Rate = Rate { burst: 100, per_sec: 20 };
/// New participants: a class that begins at once, then five a second.
pub const ENTRY_RATE: Rate = Rate { burst: 200, per_sec: 5 };

/// Limit of a rate.
#[derive(Clone, Copy, Debug)]
pub struct Rate {
    /// Maximum number at once.
    pub burst: u64,
    /// Number per second in the long run.
    pub per_sec: u64,
}
