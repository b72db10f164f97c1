//! Many episodes in one process, with its memory, descriptors and threads.

use std::ffi::OsString;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use chaic_sandbox::Launcher;
use clap::Args;

use crate::process_status::{descriptors, memory_kib, threads};
use crate::scenario::{GENERATE, prepare, shorten, words};

/// Largest growth of memory in the second half, per cent.
const MAX_GROWTH_PERCENT: f64 = 5.0;
/// Time between two samples.
const PERIOD: Duration = Duration::from_millis(200);

/// Options of `soak`.
#[derive(Args)]
pub struct SoakOptions {
    /// Number of episode runs, 40 to 20000: half of them without a helper and half with RHP.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(40..=20_000))]
    episodes: u32,
    /// Duration of an episode in frames, 1 to 3000.
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=3000))]
    frames: u32,
}

/// State of the process after a number of episode runs.
#[derive(Clone, Copy, Debug)]
struct Sample {
    n_episodes: usize,
    memory_kib: u64,
    descriptors: u64,
    threads: u64,
}

/// Plays a run in this process; returns whether memory, descriptors and threads stay constant.
///
/// # Errors
/// If the run fails.
pub fn run(options: &SoakOptions) -> Result<bool> {
    let dir = tempfile::tempdir().context("no temporary folder")?;
    prepare(&[GENERATE], dir.path())?;
    shorten(&dir.path().join("e"), options.frames)?;
    let journal = dir.path().join("run/results.jsonl");
    let began = Instant::now();
    let (code, mut samples) = play(dir.path(), options.episodes.div_ceil(2), &journal);
    anyhow::ensure!(code == 0, "the run ends with exit code {code}");
    // After the last episode the report is written, with figures.
    let n_episodes = samples.last().map_or(0, |sample| sample.n_episodes);
    samples.retain(|sample| sample.n_episodes < n_episodes);
    anyhow::ensure!(samples.len() >= 20, "too few samples; play more or longer episodes");
    let seconds = began.elapsed().as_secs_f64();
    println!("| episodes | memory, MiB | descriptors | threads |\n|--:|--:|--:|--:|");
    for tenth in 1..=10 {
        let sample = samples[(samples.len() * tenth / 10).max(1) - 1];
        let Sample { n_episodes, memory_kib, descriptors, threads } = sample;
        let mib = memory_kib as f64 / 1024.0;
        println!("| {n_episodes} | {mib:.1} | {descriptors} | {threads} |");
    }
    let (first, second) = samples.split_at(samples.len() / 2);
    let peak = |part: &[Sample], value: fn(&Sample) -> u64| part.iter().map(value).max();
    let memory = |part| peak(part, |sample| sample.memory_kib).unwrap_or_default() as f64;
    let growth = 100.0 * (memory(second) / memory(first) - 1.0);
    let is_constant = |value| peak(second, value) <= peak(first, value);
    let n_episodes = samples.last().map_or(0, |sample| sample.n_episodes);
    println!("{n_episodes} episodes in {seconds:.0} s; memory {growth:+.1} % in the second half");
    Ok(growth <= MAX_GROWTH_PERCENT
        && is_constant(|sample| sample.descriptors)
        && is_constant(|sample| sample.threads))
}

/// Plays each of two episode runs with this number of seeds, in the folder `at`; returns the exit
/// code and samples by number of finished episodes.
fn play(at: &Path, n_seeds: u32, journal: &Path) -> (u8, Vec<Sample>) {
    let path = |name: &str| at.join(name).into_os_string();
    let mut arguments: Vec<OsString> =
        words("chaic --quiet eval --helper none,rhp --size 16 --jobs 1")
            .into_iter()
            .map(Into::into)
            .collect();
    arguments.extend(["--episodes".into(), path("e"), "--out".into(), path("run")]);
    arguments.extend(["--seeds".into(), n_seeds.to_string().into()]);
    let has_ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let sampler = scope.spawn(|| {
            let (mut lines, mut samples) = (LineCounter::default(), Vec::new());
            while !has_ended.load(Ordering::Relaxed) {
                samples.extend(lines.count(journal).map(sample));
                std::thread::sleep(PERIOD);
            }
            samples
        });
        let code = chaic::run(arguments, &Launcher::this_program());
        has_ended.store(true, Ordering::Relaxed);
        (code, sampler.join().expect("the sampler does not panic"))
    })
}

/// Returns the state of this process after this number of episode runs.
fn sample(n_episodes: usize) -> Sample {
    let (memory_kib, descriptors, threads) = (memory_kib(), descriptors(), threads());
    Sample { n_episodes, memory_kib, descriptors, threads }
}

/// Counter of the lines of a growing file, which is read piece by piece.
#[derive(Debug, Default)]
struct LineCounter {
    n_lines: usize,
    n_bytes: u64,
}

impl LineCounter {
    /// Returns the number of complete lines; `None` before the first one.
    fn count(&mut self, path: &Path) -> Option<usize> {
        let mut file = File::open(path).ok()?;
        file.seek(SeekFrom::Start(self.n_bytes)).ok()?;
        let mut buffer = [0; 4096];
        loop {
            let n = file.read(&mut buffer).ok()?;
            if n == 0 {
                return (self.n_lines > 0).then_some(self.n_lines);
            }
            self.n_bytes += n as u64;
            self.n_lines += buffer[..n].iter().filter(|byte| **byte == b'\n').count();
        }
    }
}
