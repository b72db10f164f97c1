//! Is what is hidden hidden? `cargo run --release -p chaic-eval --example noninterference -- 10000`.
//!
//! Plays so many pairs of generated episodes (outside every named split) that differ in the
//! partner's goal or constraint alone, watched by each built-in helper and by a prober that tries
//! every action on every target, by both rule sets, with a partner that acts; `-- 10000 4000` leaves
//! the first 4,000 out. Prints what each observer was told without being able to see or feel it;
//! exits with 1 if there is anything.

use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::minds::{BuiltIn, Helper, Helpers as _};
use chaic_env::rules::RuleSet;
use chaic_episodes::{Episode, Split, episodes};
use chaic_eval::audit::{Pair, Partner, Prober, Secret, compare};

/// The first of the generated seeds that are looked at.
const FIRST_SEED: u64 = 500_000;
/// Long enough for the partner to take and deliver, frames.
const FRAMES: u32 = 1500;
/// Side of the images, pixels.
const IMAGE_SIZE: u32 = 64;
/// Who watches, by turns: seven, so that all meet all eight tasks.
const OBSERVERS: [&str; 7] =
    ["rhp", "random", "follow", "blind prober", "seeing prober", "pointing prober", "rhp"];

fn observer(name: &str, episode: &Episode, rules: &RuleSet) -> Helper {
    let n_things = episode.setup().things.len();
    let prober = |sees, grants| Helper { mind: Box::new(Prober::new(sees, n_things)), grants };
    match name {
        "blind prober" => prober(false, Grants::IDS),
        "seeing prober" => prober(true, Grants::IDS),
        "pointing prober" => prober(true, Grants::NONE),
        name => BuiltIn.make(name, rules.planner).expect("it is a built-in helper"),
    }
}

/// The k-th pair: how many observations were the same, and what was found.
fn one(k: usize) -> Result<(usize, Option<String>), Box<dyn std::error::Error + Send + Sync>> {
    let tasks: Vec<TaskId> = TaskId::paper().collect();
    let (task, round) = (tasks[k % tasks.len()], k / tasks.len());
    let seed = FIRST_SEED + round as u64;
    let episode = episodes(&Split::Generated(seed..seed + 1), task).next().expect("one seed")?;
    let name = OBSERVERS[k % OBSERVERS.len()];
    let (rules_name, rules) =
        [("paper", RuleSet::PAPER), ("compat", RuleSet::COMPAT)][round / 2 % 2];
    let secret = Secret::ALL[round % 2];
    let (partner, frames, image_size) = (Partner::Acts, FRAMES, IMAGE_SIZE);
    let pair = Pair { episode: &episode, secret, partner, rules, frames, image_size };
    let verdict = compare(&pair, &|| observer(name, &episode, &rules), None)?;
    let text = |f| format!("{}, {name}, {secret:?}, {rules_name}: {f}", episode.id());
    Ok((verdict.compared, verdict.finding.map(text)))
}

fn main() -> ExitCode {
    let argument = |k: usize| std::env::args().nth(k).and_then(|text| text.parse().ok());
    let (n, first): (usize, usize) = (argument(1).unwrap_or(200), argument(2).unwrap_or(0));
    let next = AtomicUsize::new(first);
    let (compared, findings) = (AtomicUsize::new(0), Mutex::new(vec![]));
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= n {
                        break;
                    }
                    let finding = match one(k) {
                        Ok((same, finding)) => {
                            compared.fetch_add(same, Ordering::Relaxed);
                            finding
                        }
                        Err(error) => Some(format!("pair {k} can't be played: {error}")),
                    };
                    if let Some(finding) = finding {
                        eprintln!("{finding}");
                        findings.lock().unwrap_or_else(|e| e.into_inner()).push(finding);
                    }
                    if (k + 1).is_multiple_of(500) {
                        eprintln!("{} of {n} pairs", k + 1);
                    }
                }
            });
        }
    });
    let findings = findings.into_inner().unwrap_or_else(|e| e.into_inner());
    let compared = compared.into_inner();
    let n = n.saturating_sub(first);
    println!("{n} pairs, {compared} observations the same, {} findings", findings.len());
    ExitCode::from(u8::from(!findings.is_empty()))
}
