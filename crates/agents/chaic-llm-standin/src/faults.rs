//! Faults of endpoints.

use std::io::{self, Write as _};
use std::net::TcpStream;
use std::str::FromStr;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::completion;
use crate::http::{head, write_response};
use crate::script::Question;

/// Length of an oversized answer, bytes.
const HUGE_LEN: usize = 10 << 20;
/// Interval between two bytes of a slow answer.
const DRIP_INTERVAL: Duration = Duration::from_millis(20);

/// Kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// The connection is reset, and new connections are refused for a moment.
    Refused,
    /// The connection is reset.
    Reset,
    /// There is no response.
    Timeout,
    /// The response arrives byte by byte.
    SlowDrip,
    /// Status 429 with a `retry-after` header.
    TooManyWithWait,
    /// Status 429.
    TooMany,
    /// Status 500.
    Internal,
    /// Status 503.
    Unavailable,
    /// Empty body.
    Empty,
    /// Truncated JSON.
    Truncated,
    /// JSON that is not a completion.
    WrongSchema,
    /// A plan that is not in the list.
    PlanNotListed,
    /// A body of ten mebibytes.
    Huge,
    /// Bytes that are not UTF-8.
    InvalidUtf8,
}

impl FaultKind {
    /// All kinds.
    pub const ALL: [FaultKind; 14] = [
        FaultKind::Refused,
        FaultKind::Reset,
        FaultKind::Timeout,
        FaultKind::SlowDrip,
        FaultKind::TooManyWithWait,
        FaultKind::TooMany,
        FaultKind::Internal,
        FaultKind::Unavailable,
        FaultKind::Empty,
        FaultKind::Truncated,
        FaultKind::WrongSchema,
        FaultKind::PlanNotListed,
        FaultKind::Huge,
        FaultKind::InvalidUtf8,
    ];

    /// Returns the name in commands.
    pub fn name(self) -> &'static str {
        match self {
            FaultKind::Refused => "refused",
            FaultKind::Reset => "reset",
            FaultKind::Timeout => "timeout",
            FaultKind::SlowDrip => "slow-drip",
            FaultKind::TooManyWithWait => "429-with-wait",
            FaultKind::TooMany => "429",
            FaultKind::Internal => "500",
            FaultKind::Unavailable => "503",
            FaultKind::Empty => "empty",
            FaultKind::Truncated => "truncated",
            FaultKind::WrongSchema => "wrong-schema",
            FaultKind::PlanNotListed => "plan-not-listed",
            FaultKind::Huge => "huge",
            FaultKind::InvalidUtf8 => "invalid-utf8",
        }
    }

    /// Sends a faulty response; returns whether the connection stays open.
    pub(crate) fn send(
        self,
        stream: &mut TcpStream,
        question: &Question,
        stall: Duration,
    ) -> io::Result<bool> {
        let complete = || completion(question, &question.answer()).to_string();
        match self {
            // Handled before the request is read.
            FaultKind::Refused | FaultKind::Reset => Ok(false),
            FaultKind::Timeout => {
                std::thread::sleep(stall);
                Ok(false)
            }
            FaultKind::SlowDrip => {
                let body = complete();
                stream.write_all(head(200, &[], body.len()).as_bytes())?;
                let start = Instant::now();
                for byte in body.as_bytes() {
                    if start.elapsed() > stall {
                        break;
                    }
                    stream.write_all(&[*byte])?;
                    std::thread::sleep(DRIP_INTERVAL);
                }
                Ok(false)
            }
            FaultKind::TooManyWithWait => {
                write_response(stream, 429, &[("retry-after", "1")], b"{\"error\":{}}")
            }
            FaultKind::TooMany => write_response(stream, 429, &[], b"slow down"),
            FaultKind::Internal => write_response(stream, 500, &[], b"<h1>internal error</h1>"),
            FaultKind::Unavailable => write_response(stream, 503, &[], b""),
            FaultKind::Empty => write_response(stream, 200, &[], b""),
            FaultKind::Truncated => {
                let body = complete();
                let part = &body.as_bytes()[..body.len() / 2];
                // Bodies of odd length also have a content length that is too large.
                if body.len() % 2 == 0 {
                    return write_response(stream, 200, &[], part);
                }
                stream.write_all(head(200, &[], body.len()).as_bytes())?;
                stream.write_all(part)?;
                Ok(false)
            }
            FaultKind::WrongSchema => {
                let body = json!({ "choices": "none", "greeting": ["hello"] });
                write_response(stream, 200, &[], body.to_string().as_bytes())
            }
            FaultKind::PlanNotListed => {
                let text = question.format_answer(9999, "There is a plan that nobody listed.");
                let body = completion(question, &text).to_string();
                write_response(stream, 200, &[], body.as_bytes())
            }
            FaultKind::Huge => {
                let body = completion(question, &"x".repeat(HUGE_LEN)).to_string();
                // The client may close the connection before the end.
                write_response(stream, 200, &[], body.as_bytes()).map(|_| false)
            }
            FaultKind::InvalidUtf8 => {
                let mut body = complete().into_bytes();
                let middle = body.len() / 2;
                body[middle] = 0xff;
                write_response(stream, 200, &[], &body)
            }
        }
    }
}

impl FromStr for FaultKind {
    type Err = String;

    fn from_str(text: &str) -> Result<FaultKind, String> {
        let found = FaultKind::ALL.into_iter().find(|k| k.name() == text);
        found.ok_or_else(|| {
            let names = FaultKind::ALL.map(FaultKind::name).join(", ");
            format!("unknown fault `{text}`; expected one of {names}")
        })
    }
}

/// Checks that the rates of all faults together are at most 1: a request has one fault at most.
///
/// # Errors
/// If they are more.
pub fn check_rates(faults: &[(FaultKind, f64)]) -> Result<(), String> {
    /// Maximum rounding error of a sum.
    const TOLERANCE: f64 = 1e-9;
    let total: f64 = faults.iter().map(|(_, rate)| rate).sum();
    if total > 1.0 + TOLERANCE {
        return Err("the rates of all --fault options add up to more than 1; lower them".to_owned());
    }
    Ok(())
}

/// Random draw for one request.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// Seed of the server.
    pub seed: u64,
    /// Index of the request.
    pub index: u64,
}

impl Draw {
    /// Returns the fault of the request, if any.
    pub fn fault(self, faults: &[(FaultKind, f64)]) -> Option<FaultKind> {
        let mut remaining = self.unit();
        faults.iter().find_map(|(kind, rate)| {
            let is_hit = remaining < *rate;
            remaining -= rate;
            is_hit.then_some(*kind)
        })
    }

    /// Returns a number in [0, 1) by splitmix64.
    fn unit(self) -> f64 {
        let mut z =
            self.seed.wrapping_add(self.index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_occur_at_their_rates() {
        let faults = [(FaultKind::Reset, 0.2), (FaultKind::Empty, 0.1)];
        let drawn: Vec<_> =
            (0..10_000).map(|index| Draw { seed: 1, index }.fault(&faults)).collect();
        let n = |kind| drawn.iter().filter(|d| **d == kind).count();
        assert!((1_900..2_100).contains(&n(Some(FaultKind::Reset))));
        assert!((900..1_100).contains(&n(Some(FaultKind::Empty))));
        for kind in FaultKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
    }

    #[test]
    fn rates_beyond_1_are_refused() {
        let rates = |rates: &[f64]| -> Vec<(FaultKind, f64)> {
            rates.iter().map(|rate| (FaultKind::Reset, *rate)).collect()
        };
        for allowed in [&[1.0][..], &[0.1; 10], &[0.7, 0.1, 0.1, 0.1]] {
            assert_eq!(check_rates(&rates(allowed)), Ok(()), "{allowed:?}");
        }
        for refused in [&[0.6, 0.5][..], &[1.0, 0.001]] {
            assert!(check_rates(&rates(refused)).is_err(), "{refused:?}");
        }
    }
}
