//! Fuzzing of all parsers: changed copies of valid inputs, without instrumentation.
//!
//! An input with a new error message joins the pool of inputs, so that changes accumulate.
//! Promises: no panic, no hang, bounded memory, and a message of one line.

mod import;
mod inputs;
mod mutate;
mod processes;
mod targets;

use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};
use chaic_core::rng::RngStream;
use clap::Args;

use self::inputs::Inputs;
use self::mutate::{Format, mutate};
use self::targets::{TARGETS, Target};
use crate::process_status::{peak_memory_kib, reset_peak_memory};

/// Maximum parsing time of one input. A longer time counts as a hang; the slowest parser takes a
/// tenth of a second.
const MAX_DURATION: Duration = Duration::from_secs(60);
/// Maximum memory that parsing may add, KiB: a hundred times the largest input, and an exec message
/// with the images of the largest observation.
const MAX_MEMORY_KIB: u64 = 1 << 20;
/// Maximum number of inputs in memory per parser.
const MAX_POOL: usize = 512;
/// Maximum number of different messages that are counted per parser; it bounds the memory.
const MAX_MESSAGES: usize = 10_000;
/// Maximum size of an input that the corpus keeps, bytes, so that the repository stays small.
const MAX_KEPT_BYTES: usize = 2 << 10;
/// Maximum number of inputs that the corpus keeps per parser.
const MAX_KEPT: usize = 24;

/// Header of the printed table.
const HEAD: &str = "| parser | inputs | messages | failures | memory, MiB |\n|---|--:|--:|--:|--:|";

/// Options of `fuzz`.
#[derive(Args)]
pub struct FuzzOptions {
    /// Names of parsers (default: all).
    targets: Vec<String>,
    /// Duration per parser in seconds, 1 to 1000000.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seconds: u64,
    /// Largest number of changed inputs per parser, 0 to 1000000000000.
    #[arg(long, default_value_t = 1_000_000_000_000,
          value_parser = clap::value_parser!(u64).range(0..=1_000_000_000_000))]
    inputs: u64,
    /// Seed of all changes.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder with inputs of earlier runs, in a folder per parser.
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/corpus"))]
    corpus: PathBuf,
    /// Add short inputs with a new message to the corpus.
    #[arg(long)]
    keep: bool,
    /// Number of parsers at the same time, each in a process of its own, 1 to 256.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=256))]
    jobs: u32,
}

/// Result for one parser.
struct FuzzResult {
    n_inputs: u64,
    /// Number of different messages.
    n_messages: usize,
    /// Descriptions of broken promises; the inputs are in the corpus.
    failures: Vec<String>,
}

/// Input that is being parsed, for the watchdog.
#[derive(Default)]
struct CurrentInput {
    /// Corpus of the parser.
    folder: PathBuf,
    input: Vec<u8>,
    began: Option<Instant>,
}

/// Fuzzes the parsers; returns whether all promises hold.
///
/// # Errors
/// If a parser is unknown or the inputs cannot be prepared.
pub fn run_all(options: &FuzzOptions) -> Result<bool> {
    let targets = select(&options.targets)?;
    if options.jobs > 1 {
        println!("{HEAD}");
        return processes::run(&targets, options);
    }
    let dir = tempfile::tempdir().context("no temporary folder")?;
    let inputs = Inputs::new(dir.path())?;
    let current = Arc::new(Mutex::new(CurrentInput::default()));
    watch(Arc::clone(&current));
    report_other_panics(Arc::clone(&current));
    let mut n_failures = 0;
    println!("{HEAD}");
    for target in targets {
        reset_peak_memory();
        let before_kib = peak_memory_kib();
        let mut fuzzed = fuzz(target, &inputs, options, &current)?;
        let added_kib = peak_memory_kib().saturating_sub(before_kib);
        if added_kib > MAX_MEMORY_KIB {
            fuzzed.failures.push(format!("parsing took {} MiB", added_kib >> 10));
        }
        for failure in &fuzzed.failures {
            eprintln!("{}: {failure}", target.name);
        }
        n_failures += fuzzed.failures.len();
        let FuzzResult { n_inputs, n_messages, failures } = fuzzed;
        let (name, n) = (target.name, failures.len());
        println!("| {name} | {n_inputs} | {n_messages} | {n} | {} |", added_kib >> 10);
    }
    Ok(n_failures == 0)
}

fn select(names: &[String]) -> Result<Vec<&'static Target>> {
    if let Some(unknown) = names.iter().find(|name| !TARGETS.iter().any(|t| t.name == **name)) {
        let known: Vec<&str> = TARGETS.iter().map(|t| t.name).collect();
        bail!("no parser `{unknown}`; the parsers are {}", known.join(", "));
    }
    Ok(TARGETS.iter().filter(|t| names.is_empty() || names.iter().any(|n| n == t.name)).collect())
}

/// Prints panics outside of parsers. A panic in a parser is reported with its input.
fn report_other_panics(current: Arc<Mutex<CurrentInput>>) {
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if current.lock().unwrap_or_else(PoisonError::into_inner).began.is_none() {
            print(panic);
        }
    }));
}

/// Ends the process if one input takes too long, and adds the input to the corpus of its parser.
fn watch(current: Arc<Mutex<CurrentInput>>) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let current = current.lock().unwrap_or_else(PoisonError::into_inner);
            if current.began.is_some_and(|began| began.elapsed() > MAX_DURATION) {
                match keep(&current.folder, &current.input) {
                    Ok(path) => eprintln!("an input hangs; it is in {path}"),
                    Err(error) => eprintln!("an input hangs and can't be kept: {error:#}"),
                }
                process::exit(1);
            }
        }
    });
}

fn fuzz(
    target: &Target,
    inputs: &Inputs,
    options: &FuzzOptions,
    current: &Mutex<CurrentInput>,
) -> Result<FuzzResult> {
    let folder = options.corpus.join(target.name);
    current.lock().unwrap_or_else(PoisonError::into_inner).folder = folder.clone();
    let seeds = (target.seeds)(inputs).with_context(|| format!("parser {}", target.name))?;
    let mut kept = corpus(&folder)?;
    let mut pool = seeds.clone();
    pool.append(&mut kept.clone());
    let mut rng = RngStream::new(options.seed, target.name, 0);
    let mut fuzzed = FuzzResult { n_inputs: 0, n_messages: 0, failures: Vec::new() };
    let mut messages = BTreeSet::new();
    let mut queue = pool.clone();
    let began = Instant::now();
    loop {
        let is_changed = queue.is_empty();
        let input = match queue.pop() {
            Some(input) => input,
            None if fuzzed.n_inputs >= options.inputs => break,
            None if began.elapsed().as_secs() >= options.seconds => break,
            None => {
                let (from, other) = (rng.below(pool.len()), rng.below(pool.len()));
                let mut input = mutate(&mut rng, &pool[from], &pool[other], target.format);
                if rng.chance(0.8) {
                    (target.repair)(&mut input);
                }
                input
            }
        };
        fuzzed.n_inputs += u64::from(is_changed);
        let message = match parse(target, inputs, &input, current) {
            Ok(message) => message,
            Err(problem) => {
                fuzzed.failures.push(format!("{problem}; {}", keep(&folder, &input)?));
                continue;
            }
        };
        let is_new = messages.len() < MAX_MESSAGES && messages.insert(pattern(&message));
        if is_new && is_changed && pool.len() < MAX_POOL {
            if options.keep && input.len() <= MAX_KEPT_BYTES && kept.len() < MAX_KEPT {
                keep(&folder, &input)?;
                kept.push(input.clone());
            }
            pool.push(input);
        }
    }
    if let Some(seed) = seeds.iter().find(|seed| (target.parse)(inputs, seed).is_err()) {
        let message = (target.parse)(inputs, seed).err().unwrap_or_default();
        fuzzed.failures.push(format!("a valid input is refused: {message}"));
    }
    fuzzed.n_messages = messages.len();
    Ok(fuzzed)
}

/// Parses an input; returns the message, or the broken promise.
fn parse(
    target: &Target,
    inputs: &Inputs,
    input: &[u8],
    current: &Mutex<CurrentInput>,
) -> Result<String, String> {
    let set = |began: Option<Instant>| {
        let mut current = current.lock().unwrap_or_else(PoisonError::into_inner);
        if began.is_some() {
            current.input = input.to_vec();
        }
        current.began = began;
    };
    set(Some(Instant::now()));
    let parsed = catch_unwind(AssertUnwindSafe(|| (target.parse)(inputs, input)));
    set(None);
    match parsed {
        Ok(Ok(())) => Ok(String::new()),
        Ok(Err(message)) if message.trim().is_empty() => Err("an empty message".to_owned()),
        // Strings in JSON and in binary files may hold line breaks, which the command escapes.
        Ok(Err(message)) if target.format == Format::Text && message.trim_end().contains('\n') => {
            Err(format!("a message of several lines: {message:?}"))
        }
        Ok(Err(message)) => Ok(message),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
            Err(format!("panic: {}", text.unwrap_or("without a message")))
        }
    }
}

/// Returns a message without numbers and quoted parts.
fn pattern(message: &str) -> String {
    let mut is_quoted = false;
    let keep = |c: &char| {
        is_quoted ^= matches!(c, '`' | '"');
        !is_quoted && !c.is_ascii_digit()
    };
    message.chars().filter(keep).take(200).collect()
}

/// Reads the inputs in a folder, sorted by name.
fn corpus(folder: &Path) -> Result<Vec<Vec<u8>>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let paths = chaic_files::entries(folder)?;
    paths.iter().map(|path| Ok(fs::read(path)?)).collect()
}

/// Writes an input to the corpus; returns its path.
fn keep(folder: &Path, input: &[u8]) -> Result<String> {
    fs::create_dir_all(folder)?;
    let path = folder.join(format!("{:016x}", xxhash_rust::xxh3::xxh3_64(input)));
    fs::write(&path, input)?;
    Ok(path.display().to_string())
}
