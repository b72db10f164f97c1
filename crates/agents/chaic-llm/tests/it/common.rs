//! Shared fixtures: short episodes, a stand-in endpoint, and runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use chaic_core::TaskId;
use chaic_episodes::{Episode, find_episode};
use chaic_eval::metrics::{RunResult, Summary};
use chaic_eval::run::{FolderMode, Run, RunRequest};
use chaic_llm::exchange::{DecisionRecord, Exchange};
use chaic_llm::record::{self, DecisionLog, RecordEntry};
use chaic_llm::settings::FailureAction;
use chaic_llm::{LanguageHelpers, Settings};
use chaic_llm_standin::{Options, StandIn};

/// Image size of the tests, pixels.
pub const SIZE: u32 = 64;

/// Files of a test, and the episodes it plays.
pub struct Fixture {
    dir: tempfile::TempDir,
}

impl Fixture {
    /// Creates one episode of this length for each task.
    pub fn new(tasks: &[TaskId], horizon: u32) -> Fixture {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("episodes")).unwrap();
        for task in tasks {
            let mut setup = find_episode(&format!("{task}/test/00")).unwrap().into_setup();
            setup.horizon = horizon;
            let short = Episode::new(format!("{task}/short/0"), "short", None, setup).unwrap();
            let path = dir.path().join(format!("episodes/{task}.json"));
            fs::write(path, short.to_json()).unwrap();
        }
        Fixture { dir }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn request(&self, helpers: &[&str]) -> RunRequest {
        RunRequest {
            helpers: Some(helpers.iter().map(|h| (*h).to_owned()).collect()),
            image_size: Some(SIZE),
            episodes: Some(self.path("episodes")),
            ..RunRequest::default()
        }
    }

    /// Plays in a new folder, or resumes; returns whether the run finished, and the results.
    pub fn play(
        &self,
        name: &str,
        request: &RunRequest,
        language: &LanguageHelpers,
    ) -> (bool, Vec<RunResult>) {
        let path = self.path(name);
        let (mut run, _) = Run::open(&path, FolderMode::Resume, request, language).unwrap();
        language.attach(&path).unwrap();
        let is_complete = run.play(2, language, stop(language), &mut |_| {}).unwrap();
        let mut results = run.results().to_vec();
        results.sort_by(|a, b| a.key.cmp(&b.key));
        (is_complete, results)
    }

    /// Reads all records of a run.
    pub fn records(&self, name: &str) -> Vec<DecisionLog> {
        let run = self.path(name);
        let paths = record::all(&run).unwrap();
        paths.iter().map(|p| DecisionLog::read(&run, p).unwrap()).collect()
    }
}

/// Creates a stop flag.
pub fn flag() -> &'static AtomicBool {
    Box::leak(Box::new(AtomicBool::new(false)))
}

pub fn stop(language: &LanguageHelpers) -> &'static AtomicBool {
    language.stop()
}

/// Starts a stand-in; returns settings with short waits for it.
pub fn standin(options: Options) -> (StandIn, Settings) {
    let standin = StandIn::start(options).unwrap();
    let settings = settings(&standin.url());
    (standin, settings)
}

pub fn settings(url: &str) -> Settings {
    let mut settings = Settings::default();
    settings.request.model = "standin".to_owned();
    settings.endpoint.url = url.to_owned();
    settings.endpoint.timeout_secs = 0.25;
    settings.retry.initial_backoff_secs = 0.001;
    settings.retry.max_backoff_secs = 0.02;
    settings.retry.on_failure = FailureAction::Fallback;
    settings
}

pub fn summary(result: &RunResult) -> &Summary {
    result.summary().unwrap_or_else(|| panic!("{result:?} has no score"))
}

/// Returns all decisions of a record.
pub fn decided(record: &DecisionLog) -> Vec<&DecisionRecord> {
    let all = record.entries.iter().filter_map(|entry| match entry {
        RecordEntry::Decision(decided) => Some(decided),
        RecordEntry::Exchange(_) => None,
    });
    all.collect()
}

/// Returns all exchanges of a record.
pub fn exchanges(record: &DecisionLog) -> Vec<&Exchange> {
    let all = record.entries.iter().filter_map(|entry| match entry {
        RecordEntry::Exchange(exchange) => Some(&**exchange),
        RecordEntry::Decision(_) => None,
    });
    all.collect()
}

/// Reads all files of a folder, sorted by path, without locks.
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
