//! Non-interference test on many episodes: `cargo run --release -p chaic-eval --example
//! noninterference -- 10000`.
//!
//! Plays pairs of generated episodes (outside every named split) that differ only in the partner's
//! goal or constraint, with an acting partner and both rule sets. Observers are the built-in
//! helpers, and probe agents that try every action on every target. The first argument is the
//! number of pairs; `-- 10000 4000` skips the first 4,000.
//!
//! Prints information that an observer received without being able to see or touch its cause; exits
//! with 1 if there is any.

use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::{BuiltInHelpers, Helper, HelperRegistry as _};
use chaic_env::rules::RuleSet;
use chaic_episodes::{Episode, Split, episodes};
use chaic_eval::audit::{HiddenProperty, PartnerMode, ProbeAgent, RunPair, compare};

/// First generated seed.
const FIRST_SEED: u64 = 500_000;
/// Number of frames: enough for the partner to take and deliver.
const FRAMES: u32 = 1500;
/// Side of the images, pixels.
const IMAGE_SIZE: u32 = 64;
/// Observers in turn: seven, so that each meets all eight tasks.
const OBSERVERS: [&str; 7] = [
    "rhp",
    "random",
    "follow",
    "infer",
    "blind probe agent",
    "seeing probe agent",
    "pointing probe agent",
];

fn observer(name: &str, episode: &Episode, rules: &RuleSet) -> Helper {
    let n_objects = episode.setup().things.len();
    let probe = |has_camera, grants| Helper {
        agent: Box::new(ProbeAgent::new(has_camera, n_objects)),
        grants,
    };
    match name {
        "blind probe agent" => probe(false, Grants::IDS),
        "seeing probe agent" => probe(true, Grants::IDS),
        "pointing probe agent" => probe(true, Grants::NONE),
        name => BuiltInHelpers.make(name, rules.planner).expect("it is a built-in helper"),
    }
}

/// Compares pair `k`; returns the number of equal observations and the violation, if any.
fn compare_pair(
    k: usize,
) -> Result<(usize, Option<String>), Box<dyn std::error::Error + Send + Sync>> {
    let tasks: Vec<TaskId> = TaskId::paper().collect();
    let (task, round) = (tasks[k % tasks.len()], k / tasks.len());
    let seed = FIRST_SEED + round as u64;
    let episode = episodes(&Split::Generated(seed..seed + 1), task).next().expect("one seed")?;
    let name = OBSERVERS[k % OBSERVERS.len()];
    let (rules_name, rules) =
        [("paper", RuleSet::PAPER), ("compat", RuleSet::COMPAT)][round / 2 % 2];
    let secret = HiddenProperty::ALL[round % 2];
    let (partner, frames, image_size) = (PartnerMode::Acts, FRAMES, IMAGE_SIZE);
    let pair = RunPair { episode: &episode, secret, partner, rules, frames, image_size };
    let result = compare(&pair, &|| observer(name, &episode, &rules), None)?;
    let text = |f| format!("{}, {name}, {secret:?}, {rules_name}: {f}", episode.id());
    Ok((result.compared, result.violation.map(text)))
}

fn main() -> ExitCode {
    let argument = |k: usize| std::env::args().nth(k).and_then(|text| text.parse().ok());
    let (n, first): (usize, usize) = (argument(1).unwrap_or(200), argument(2).unwrap_or(0));
    let next = AtomicUsize::new(first);
    let (compared, violations) = (AtomicUsize::new(0), Mutex::new(vec![]));
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= n {
                        break;
                    }
                    let violation = match compare_pair(k) {
                        Ok((n_equal, violation)) => {
                            compared.fetch_add(n_equal, Ordering::Relaxed);
                            violation
                        }
                        Err(error) => Some(format!("pair {k} can't be played: {error}")),
                    };
                    if let Some(violation) = violation {
                        eprintln!("{violation}");
                        violations.lock().unwrap_or_else(|e| e.into_inner()).push(violation);
                    }
                    if (k + 1).is_multiple_of(500) {
                        eprintln!("{} of {n} pairs", k + 1);
                    }
                }
            });
        }
    });
    let violations = violations.into_inner().unwrap_or_else(|e| e.into_inner());
    let compared = compared.into_inner();
    let n = n.saturating_sub(first);
    println!("{n} pairs, {compared} equal observations, {} violations", violations.len());
    ExitCode::from(u8::from(!violations.is_empty()))
}
