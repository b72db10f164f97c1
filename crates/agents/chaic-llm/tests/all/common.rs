//! What the tests of this crate share: short episodes, a stand-in, and a run of both.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use chaic_core::TaskId;
use chaic_episodes::{Episode, find_episode};
use chaic_eval::metrics::{RunResult, Summary};
use chaic_eval::run::{Access, Run, RunRequest};
use chaic_llm::exchange::{Decided, Exchange};
use chaic_llm::record::{self, Entry, Record};
use chaic_llm::settings::Then;
use chaic_llm::{Language, Settings};
use chaic_llm_standin::{Options, StandIn};

/// Side of a test's images, pixels.
pub const SIZE: u32 = 64;

/// Everything that a test writes, and the episodes it plays.
pub struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    /// One episode of so many frames of each task.
    pub fn new(tasks: &[TaskId], horizon: u32) -> Bench {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("episodes")).unwrap();
        for task in tasks {
            let mut setup = find_episode(&format!("{task}/test/00")).unwrap().into_setup();
            setup.horizon = horizon;
            let short = Episode::new(format!("{task}/short/0"), "short", None, setup).unwrap();
            let path = dir.path().join(format!("episodes/{task}.json"));
            fs::write(path, short.to_json()).unwrap();
        }
        Bench { dir }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn given(&self, helpers: &[&str]) -> RunRequest {
        RunRequest {
            helpers: Some(helpers.iter().map(|h| (*h).to_owned()).collect()),
            size: Some(SIZE),
            episodes: Some(self.path("episodes")),
            ..RunRequest::default()
        }
    }

    /// Plays, in a new folder or on in one that is there; whether to the end, and the results.
    pub fn play(
        &self,
        name: &str,
        given: &RunRequest,
        language: &Language,
    ) -> (bool, Vec<RunResult>) {
        let path = self.path(name);
        let (mut run, _) = Run::open(&path, Access::Resume, given, language).unwrap();
        language.attach(&path).unwrap();
        let is_whole = run.play(2, language, stop(language), &mut |_| {}).unwrap();
        let mut results = run.results().to_vec();
        results.sort_by(|a, b| a.key.cmp(&b.key));
        (is_whole, results)
    }

    /// All records of a run.
    pub fn records(&self, name: &str) -> Vec<Record> {
        let run = self.path(name);
        let paths = record::all(&run).unwrap();
        paths.iter().map(|p| Record::read(&run, p).unwrap()).collect()
    }
}

/// A flag of its own for each language.
pub fn flag() -> &'static AtomicBool {
    Box::leak(Box::new(AtomicBool::new(false)))
}

pub fn stop(language: &Language) -> &'static AtomicBool {
    language.stop()
}

/// A stand-in, and settings to ask it that don't wait for long.
pub fn standin(options: Options) -> (StandIn, Settings) {
    let standin = StandIn::start(options).unwrap();
    let settings = settings(&standin.url());
    (standin, settings)
}

pub fn settings(url: &str) -> Settings {
    let mut settings = Settings::default();
    settings.asking.model = "standin".to_owned();
    settings.endpoint.url = url.to_owned();
    settings.endpoint.timeout_secs = 0.25;
    settings.faults.first_wait_secs = 0.001;
    settings.faults.longest_wait_secs = 0.02;
    settings.faults.then = Then::Fallback;
    settings
}

pub fn summary(result: &RunResult) -> &Summary {
    result.summary().unwrap_or_else(|| panic!("{result:?} has no score"))
}

/// All that was decided in a record.
pub fn decided(record: &Record) -> Vec<&Decided> {
    let all = record.entries.iter().filter_map(|entry| match entry {
        Entry::Decided(decided) => Some(decided),
        Entry::Exchange(_) => None,
    });
    all.collect()
}

/// All exchanges in a record.
pub fn exchanges(record: &Record) -> Vec<&Exchange> {
    let all = record.entries.iter().filter_map(|entry| match entry {
        Entry::Exchange(exchange) => Some(&**exchange),
        Entry::Decided(_) => None,
    });
    all.collect()
}

/// Every file in a folder with its bytes, in the order of their paths; locks left out.
pub fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    fn walk(folder: &Path, root: &Path, found: &mut Vec<(PathBuf, Vec<u8>)>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, found);
            } else if path.file_name().is_some_and(|n| n != ".lock") {
                let name = path.strip_prefix(root).unwrap().to_owned();
                found.push((name, fs::read(&path).unwrap()));
            }
        }
    }
    let mut found = Vec::new();
    walk(folder, folder, &mut found);
    found.sort();
    found
}
