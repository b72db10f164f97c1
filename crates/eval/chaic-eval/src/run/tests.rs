//! Promise: a run survives interruptions, and its results do not depend on how it was played.

mod forging;
mod merging;
mod partner_lists;
mod starting;
mod verifying;

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use chaic_agents::PlannerRules;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Action, Agent, AgentError, Briefing, Observation, TaskId};
use chaic_env::helper_registry::{Helper, built_in_partner};
use chaic_env::{Digest, EnvError};
use chaic_episodes::Episode;

use super::*;
use crate::error::EvalError;
use crate::metrics::Summary;
use crate::verify::ReportState;

/// Number of frames of a test episode: enough for a few decisions of each agent.
const HORIZON: u32 = 90;
/// Side of the images, pixels.
const SIZE: u32 = 32;

/// Agent that turns in place and attempts impossible actions.
struct Turner {
    turns: u32,
}

impl Agent for Turner {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::DEPTH_AND_IDS
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> std::result::Result<Action, AgentError> {
        self.turns += 1;
        Ok(match self.turns % 3 {
            0 => Action::PutIn,
            1 => Action::TurnLeft,
            _ => Action::PickUp {
                object: chaic_core::Target::Entity(chaic_core::EntityId(9999)),
                hand: chaic_core::Hand::Left,
            },
        })
    }
}

/// Behavior of an agent from frame 30 on.
#[derive(Clone, Copy)]
enum Failure {
    None,
    Panics,
    ReturnsError,
    Halts,
}

struct FailingAgent(Failure);

impl Agent for FailingAgent {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, observation: &Observation) -> std::result::Result<Action, AgentError> {
        match self.0 {
            _ if observation.frame < 30 => Ok(Action::Wait { frames: 10 }),
            Failure::None => Ok(Action::Wait { frames: 10 }),
            Failure::Panics => panic!("out of ideas"),
            Failure::ReturnsError => Err(AgentError::Broken("out of ideas".to_owned())),
            Failure::Halts => Err(AgentError::Halted("no answer".to_owned())),
        }
    }
}

/// Helpers of these tests, and the partner `stranger`. The stop flag is raised after `stop_after`
/// helpers have been created.
struct TestHelpers {
    n_created: AtomicUsize,
    stop_after: usize,
    stop: AtomicBool,
    failure: Failure,
}

impl TestHelpers {
    fn new() -> TestHelpers {
        let (n_created, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
        TestHelpers { n_created, stop_after: usize::MAX, stop, failure: Failure::Panics }
    }
}

impl HelperRegistry for TestHelpers {
    fn names(&self) -> Vec<String> {
        vec!["turner".to_owned(), "breaker".to_owned()]
    }

    fn make(&self, name: &str, _: PlannerRules) -> Option<Helper> {
        if self.n_created.fetch_add(1, Ordering::SeqCst) + 1 >= self.stop_after {
            self.stop.store(true, Ordering::SeqCst);
        }
        let agent: Box<dyn Agent> = match name {
            "breaker" => Box::new(FailingAgent(self.failure)),
            "turner" => Box::new(Turner { turns: 0 }),
            _ => return None,
        };
        Some(Helper { agent, grants: Grants::NONE })
    }

    fn partner(&self, name: &str, _: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        if name != "stranger" {
            return built_in_partner(name, rules);
        }
        Some(Helper { agent: Box::new(FailingAgent(Failure::None)), grants: Grants::NONE })
    }
}

/// Returns a folder with short episodes of these tasks.
fn episode_files(tasks: &[TaskId], per_task: usize) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for task in tasks {
        for k in 0..per_task {
            let full = chaic_episodes::find_episode(&format!("{task}/test/{k:02}")).unwrap();
            let mut setup = full.into_setup();
            setup.horizon = HORIZON;
            let short = Episode::new(format!("{task}/short/{k}"), "short", None, setup).unwrap();
            fs::write(dir.path().join(format!("{task}-{k}.json")), short.to_json()).unwrap();
        }
    }
    dir
}

fn request(files: &tempfile::TempDir, helpers: &[&str]) -> RunRequest {
    RunRequest {
        helpers: Some(helpers.iter().map(|h| (*h).to_owned()).collect()),
        seeds: Some(2),
        image_size: Some(SIZE),
        episodes: Some(files.path().to_owned()),
        ..RunRequest::default()
    }
}

fn play(run: &mut Run, jobs: usize, helpers: &TestHelpers) -> bool {
    run.play(jobs, helpers, &helpers.stop, &mut |_| ()).unwrap()
}

fn sorted(results: &[RunResult]) -> Vec<RunResult> {
    let mut results = results.to_vec();
    results.sort_by(|a, b| a.key.cmp(&b.key));
    results
}

#[test]
fn merged_shards_equal_the_run_of_one_machine() {
    let (dir, files) = (tempfile::tempdir().unwrap(), episode_files(&[TaskId::Obstacle], 2));
    let (request, helpers) = (request(&files, &["none", "turner"]), TestHelpers::new());
    let open = |name: &str, request: &RunRequest| {
        Run::open(&dir.path().join(name), FolderMode::New, request, &helpers).unwrap().0
    };
    let mut whole = open("whole", &request);
    assert!(play(&mut whole, 1, &helpers));
    let parts: Vec<PathBuf> = (1..=3)
        .map(|number| {
            let name = format!("part{number}");
            let mut part = open(&name, &request);
            let shard = Shard::new(number, 3).unwrap();
            assert!(part.play_shard(shard, 1, &helpers, &helpers.stop, &mut |_| ()).unwrap());
            assert!(part.progress().finished < whole.progress().total);
            dir.path().join(name)
        })
        .collect();
    let merged = merge(&dir.path().join("merged"), &parts).unwrap();
    assert_eq!(sorted(merged.results()), sorted(whole.results()));
    let read = |run: &Run, name: &str| fs::read(run.folder().join(name)).unwrap();
    assert_eq!(read(&merged, "run.json"), read(&whole, "run.json"));
    let lines = |run: &Run| {
        let text = String::from_utf8(read(run, "results.jsonl")).unwrap();
        text.lines().map(str::to_owned).collect::<BTreeSet<_>>()
    };
    assert_eq!(lines(&merged), lines(&whole));
    let traces = |run: &Run| {
        let files = run.folder().traces().unwrap();
        files.iter().map(|path| fs::read(path).unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(traces(&merged), traces(&whole));
    assert!(merge(&dir.path().join("merged"), &parts).is_err(), "the folder is not empty");

    let mut other = open("other", &RunRequest { seeds: Some(1), ..request.clone() });
    play(&mut other, 1, &helpers);
    let mixed = [parts[0].clone(), dir.path().join("other")];
    let refused = merge(&dir.path().join("mixed"), &mixed).unwrap_err().to_string();
    assert!(refused.contains("different runs"), "{refused}");
    assert!(!dir.path().join("mixed").exists());
}

#[test]
fn shards_are_parsed_and_disjoint() {
    assert_eq!("2/4".parse::<Shard>().unwrap().to_string(), "2/4");
    for wrong in ["0/4", "5/4", "2", "2/0", "-1/3", "a/b"] {
        assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
    }
    let shards: Vec<Shard> = (1..=4).map(|k| Shard::new(k, 4).unwrap()).collect();
    for n_helpers in 1..=4 {
        let shards_with =
            |k: usize| shards.iter().filter(move |shard| shard.contains(k, n_helpers));
        assert!((0..40).all(|k| shards_with(k).count() == 1));
        // A shard has all helpers of an episode.
        let first = |k: usize| shards_with(k).next().unwrap();
        assert!((0..40).all(|k| first(k) == first(k - k % n_helpers)));
    }
}

#[test]
fn results_do_not_depend_on_workers_or_interruptions() {
    let files = episode_files(&[TaskId::NoConstraint, TaskId::Shopping], 1);
    let request = request(&files, &["none", "turner"]);
    let dir = tempfile::tempdir().unwrap();
    let mut all = Vec::new();
    for jobs in [1, 2, 4] {
        let helpers = TestHelpers::new();
        let path = dir.path().join(jobs.to_string());
        let (mut run, _) = Run::open(&path, FolderMode::New, &request, &helpers).unwrap();
        assert_eq!(run.progress(), RunProgress { total: 8, finished: 0, errors: 0 });
        assert!(play(&mut run, jobs, &helpers));
        all.push(sorted(run.results()));
    }
    assert_eq!(all[0], all[1]);
    assert_eq!(all[0], all[2]);
    assert!(all[0].iter().all(|r| r.summary().is_some_and(|s| s.frames == HORIZON)));
    let digests: BTreeSet<Digest> =
        all[0].iter().filter_map(|r| r.summary().map(|s| s.digest)).collect();
    assert!(digests.len() >= 4, "tasks and helpers lead to different episodes");

    // The same run, stopped in the third episode and resumed by another process.
    let path = dir.path().join("interrupted");
    // One helper is created for the check of the options.
    let stopping = TestHelpers { stop_after: 3, ..TestHelpers::new() };
    let (mut run, _) = Run::open(&path, FolderMode::New, &request, &stopping).unwrap();
    assert!(!play(&mut run, 1, &stopping));
    let n_finished = run.results().len();
    assert!((1..8).contains(&n_finished), "{n_finished}");
    drop(run);
    drop(files);
    let helpers = TestHelpers::new();
    let (mut run, _) =
        Run::open(&path, FolderMode::Resume, &RunRequest::default(), &helpers).unwrap();
    assert_eq!(run.progress().finished, n_finished);
    assert!(play(&mut run, 2, &helpers));
    assert_eq!(sorted(run.results()), all[0]);
    // The journal equals the results in memory, and the traces give the results of the journal.
    assert_eq!(
        read_results(&run.folder().results(), &run.planned).unwrap(),
        (all[0].clone(), vec![])
    );
    let traces = run.folder().traces().unwrap();
    assert_eq!(traces.len(), 8);
    let from_traces = traces
        .iter()
        .map(|p| crate::metrics::result_of_trace(&crate::trace_file::read(p).unwrap().0));
    assert_eq!(sorted(&from_traces.map(Option::unwrap).collect::<Vec<_>>()), all[0]);
    let report =
        crate::verify::verify_run(run.folder(), run.options(), &helpers, 2, &|_| ()).unwrap();
    assert_eq!((report.agreeing, report.mismatches), (8, vec![]));
}

#[test]
fn a_failed_helper_loses_its_episode_only() {
    for failure in [Failure::Panics, Failure::ReturnsError] {
        let files = episode_files(&[TaskId::MovingHouse], 1);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("run");
        let helpers = TestHelpers { failure, ..TestHelpers::new() };
        let request = request(&files, &["breaker", "none"]);
        let (mut run, _) = Run::open(&path, FolderMode::New, &request, &helpers).unwrap();
        assert!(play(&mut run, 1, &helpers));
        assert_eq!(run.progress(), RunProgress { total: 4, finished: 4, errors: 2 });
        let is_broken = |r: &&RunResult| matches!(r.status, RunStatus::Error { .. });
        for broken in run.results().iter().filter(is_broken) {
            assert_eq!(broken.key.helper, "breaker");
            let RunStatus::Error { message } = &broken.status else { unreachable!() };
            assert_eq!(message, "the episode broke down: out of ideas");
            assert!(!run.folder().trace(&broken.key).exists());
        }
        drop(run);
        // After a fix, the helper's failed episode runs are played again.
        let fixed = TestHelpers { failure: Failure::None, ..TestHelpers::new() };
        let (mut run, _) =
            Run::open(&path, FolderMode::Resume, &RunRequest::default(), &fixed).unwrap();
        assert!(play(&mut run, 1, &fixed));
        assert_eq!(run.progress(), RunProgress { total: 4, finished: 4, errors: 0 });
    }
}

#[test]
fn a_helper_that_halts_stops_the_run_which_can_be_resumed() {
    let files = episode_files(&[TaskId::MovingHouse], 1);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run");
    let helpers = TestHelpers { failure: Failure::Halts, ..TestHelpers::new() };
    let request = request(&files, &["breaker", "none"]);
    let (mut run, _) = Run::open(&path, FolderMode::New, &request, &helpers).unwrap();
    let halted = run.play(1, &helpers, &helpers.stop, &mut |_| ());
    assert_eq!(halted.unwrap_err().to_string(), "no answer");
    assert_eq!(run.progress().errors, 0, "nothing counts as zero");
    drop(run);
    let answered = TestHelpers { failure: Failure::None, ..TestHelpers::new() };
    let (mut run, _) =
        Run::open(&path, FolderMode::Resume, &RunRequest::default(), &answered).unwrap();
    assert!(play(&mut run, 1, &answered));
    assert_eq!(run.progress(), RunProgress { total: 4, finished: 4, errors: 0 });
}

#[test]
fn another_build_of_the_same_version_is_detected() {
    let files = episode_files(&[TaskId::LowTarget, TaskId::Shopping], 1);
    let dir = tempfile::tempdir().unwrap();
    let helpers = TestHelpers::new();
    let request = request(&files, &["none", "turner"]);
    let (mut run, _) = Run::open(dir.path(), FolderMode::New, &request, &helpers).unwrap();
    let check = |run: &Run| run.check_build(&helpers, &helpers.stop);
    check(&run).unwrap();
    assert!(play(&mut run, 1, &helpers));
    let traces = run.folder().traces().unwrap();
    check(&run).unwrap();
    assert_eq!(run.folder().traces().unwrap(), traces);
    // The checked episode runs of the helpers are of different tasks.
    let mut found = Vec::new();
    for k in 0..run.results.len() {
        let RunStatus::Done(summary) = &mut run.results[k].status else { unreachable!() };
        let digest = std::mem::replace(&mut summary.digest, Digest(1));
        if let Err(EvalError::OtherBuild { key, .. }) = check(&run) {
            assert_eq!(key, run.results[k].key);
            found.push((key.task, key.helper));
        }
        let RunStatus::Done(summary) = &mut run.results[k].status else { unreachable!() };
        summary.digest = digest;
    }
    found.sort();
    let expected = [(TaskId::LowTarget, "none"), (TaskId::Shopping, "turner")];
    assert_eq!(found, expected.map(|(task, helper)| (task, helper.to_owned())));
}

#[test]
fn folders_are_locked_and_checked() {
    let files = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run");
    let helpers = TestHelpers::new();
    let first = request(&files, &["turner"]);
    let open =
        |access, request: &RunRequest| Run::open(&path, access, request, &helpers).map(|_| ());
    let (held, _) = Run::open(&path, FolderMode::New, &first, &helpers).unwrap();
    for access in [FolderMode::New, FolderMode::Resume] {
        assert!(matches!(open(access, &first), Err(EvalError::Locked { .. })));
    }
    drop(held);
    assert!(matches!(open(FolderMode::New, &first), Err(EvalError::NotEmpty { .. })));
    assert!(open(FolderMode::Resume, &first).is_ok());
    let other = RunRequest { seeds: Some(3), ..first.clone() };
    let error = open(FolderMode::Resume, &other).unwrap_err().to_string();
    assert!(error.contains("--seeds 2, not 3"), "{error}");
    let other = RunRequest { helpers: Some(vec!["none".into(), "turner".into()]), ..first.clone() };
    let error = open(FolderMode::Resume, &other).unwrap_err().to_string();
    assert!(error.contains("--helper turner, not none,turner"), "{error}");
    // The order of helpers does not matter.
    let both = RunRequest { helpers: Some(vec!["none".into(), "turner".into()]), ..first.clone() };
    let second = dir.path().join("second");
    drop(Run::open(&second, FolderMode::New, &both, &helpers).unwrap());
    let reordered = ["turner", "none", "turner"].map(str::to_owned).to_vec();
    let reordered = RunRequest { helpers: Some(reordered), ..first.clone() };
    let (run, _) = Run::open(&second, FolderMode::Resume, &reordered, &helpers).unwrap();
    assert_eq!(run.options().helpers, ["none", "turner"]);
    let other = RunRequest { no_traces: true, ..first.clone() };
    let error = open(FolderMode::Resume, &other).unwrap_err().to_string();
    assert!(error.contains("--no-traces off, not on"), "{error}");
    let split =
        RunRequest { episodes: None, split: Some("test".parse().unwrap()), ..first.clone() };
    let error = open(FolderMode::Resume, &split).unwrap_err();
    assert!(
        error.is_usage() && error.to_string().contains("--split not given, not test"),
        "{error}"
    );
    // The same episodes may be in another folder; other episodes are refused.
    let same = episode_files(&[TaskId::LowTarget], 1);
    let other = episode_files(&[TaskId::LowTarget], 2);
    let named = |path: &Path| RunRequest { episodes: Some(path.to_owned()), ..first.clone() };
    assert!(open(FolderMode::Resume, &named(same.path())).is_ok());
    let error = open(FolderMode::Resume, &named(other.path())).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("low_target/short/1"), "{error}");
    assert!(open(FolderMode::Resume, &named(&dir.path().join("nowhere"))).is_err());
    let unknown = RunRequest { helpers: Some(vec!["nobody".into()]), ..first.clone() };
    let elsewhere = dir.path().join("elsewhere");
    let error = Run::open(&elsewhere, FolderMode::New, &unknown, &helpers).unwrap_err().to_string();
    assert!(error.contains("`nobody`") && error.contains("none, turner, breaker"), "{error}");

    // A folder of another version, and one with other content.
    let run_file = path.join("run.json");
    let text = fs::read_to_string(&run_file).unwrap();
    fs::write(&run_file, text.replace("\"version\": 2", "\"version\": 9")).unwrap();
    let error = open(FolderMode::Resume, &first).unwrap_err().to_string();
    assert!(error.contains("version 9") && error.contains("version 2"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    fs::write(&run_file, text.replace(chaic_env::CHAIC_VERSION, "7.7.7")).unwrap();
    let error = open(FolderMode::Resume, &first).unwrap_err().to_string();
    assert!(error.contains("7.7.7") && error.contains(chaic_env::CHAIC_VERSION), "{error}");
    // Options that were changed by hand.
    let changed = format!("{} was changed after the run started", run_file.display());
    for (from, to) in [
        ("\"rules\": \"paper\"", "\"rules\": \"compat\""),
        ("\"size\": 32", "\"size\": 64"),
        ("\"seeds\": 2", "\"seeds\": 1"),
        ("\"seeds\": 2", "\"seeds\": 2, \"traces\": false"),
    ] {
        let other = text.replace(from, to);
        assert_ne!(other, text, "{from} is there");
        fs::write(&run_file, other).unwrap();
        for error in [
            Run::open(&path, FolderMode::Resume, &RunRequest::default(), &helpers).unwrap_err(),
            RunFolder::read(&path).unwrap_err(),
        ] {
            assert!(error.to_string().contains(&changed), "{error}");
        }
    }
    let foreign = dir.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("letter.txt"), "dear").unwrap();
    let error = Run::open(&foreign, FolderMode::Resume, &first, &helpers).unwrap_err();
    assert!(matches!(error, EvalError::NotARun { .. }), "{error}");
    assert!(!foreign.join(".lock").exists());
}

#[test]
fn a_run_of_a_split_is_not_resumed_with_episode_files() {
    let recorded =
        RunRequest { n_episodes: Some(1), ..RunRequest::default() }.new_options().unwrap();
    let request = RunRequest { episodes: Some("mine".into()), ..RunRequest::default() };
    let error = request.resumed_options(&recorded, Path::new("run")).unwrap_err().to_string();
    assert!(error.contains("--episodes not given, not mine"), "{error}");
}

#[test]
fn a_journal_with_invalid_values_is_refused_with_file_and_line() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("results.jsonl");
    let good = r#"{"task":"obstacle","helper":"rhp","episode":"e","seed":0,"status":"done",
        "frames":90,"done":1.0,"total":2.0,"away_frames":3,"deliveries":[{"frame":80,"object":17,
        "class":"apple","by":1,"counted":true}],"digest":"0000000000000003"}"#;
    let good = good.replace("\n        ", "");
    let key = RunKey { task: TaskId::Obstacle, helper: "rhp".into(), episode: "e".into(), seed: 0 };
    let jobs = [EpisodeJob { key, horizon: 100, environment: "house/1".to_owned() }];
    let read = |line: &str| {
        fs::write(&path, format!("{good}\n{line}\n")).unwrap();
        read_results(&path, &jobs).map(|(_, warnings)| warnings)
    };
    assert_eq!(read(&good).unwrap(), []);
    for (from, to, message) in [
        ("\"done\":1.0", "\"done\":3.0", "`done` is 3, expected at most `total`, 2"),
        ("\"done\":1.0", "\"done\":-1.0", "`done` is -1"),
        ("\"total\":2.0", "\"total\":-2.0", "`total` is -2"),
        ("\"away_frames\":3", "\"away_frames\":91", "`away_frames` is 91"),
        ("\"frame\":80", "\"frame\":91", "`frame of a delivery` is 91"),
        ("\"frames\":90", "\"frames\":101", "`frames` is 101, expected at most 100"),
        ("\"done\":1.0", "\"done\":NaN", "expected value, at column"),
        ("\"obstacle\"", "\"lunch\"", "unknown variant `lunch`, expected one of"),
        ("\"rhp\"", "\"nobody\"", "e (obstacle) with helper nobody and seed 0, which this run"),
        ("\"seed\":0", "\"seed\":7", "seed 7, which this run doesn't play"),
        ("\"away_frames\"", "\"~way_frames\"", "unknown field `~way_frames`"),
        ("\"counted\"", "\"handled\":true,\"counted\"", "unknown field `handled`"),
        ("\"seed\":0", "\"seed\":0,\"message\":\"\"", "unknown field `message`"),
        ("\"helper\":\"rhp\",", "", "missing field `helper`"),
    ] {
        let line = good.replacen(from, to, 1);
        assert_ne!(line, good, "{from} is there");
        let error = read(&line).unwrap_err().to_string();
        assert!(error.contains("results.jsonl: line 2: ") && error.contains(message), "{error}");
        assert!(!error.contains("line 1"), "{error}");
    }
    // A crash can leave blocks of zeros in the last line only.
    assert_eq!(read(&good.replacen("\"done\"", "\0\0\0\0\0\0", 1)).unwrap().len(), 1);
}

#[test]
fn a_journal_cut_at_any_byte_loses_one_record_at_most() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("results.jsonl");
    let result = |seed| RunResult {
        key: RunKey { task: TaskId::Obstacle, helper: "rhp".into(), episode: "e".into(), seed },
        status: RunStatus::Done(Summary {
            frames: 3000,
            done: 1.0,
            total: 10.0,
            away_frames: None,
            stuck_frames: None,
            escape_frames: None,
            deliveries: Vec::new(),
            digest: Digest(3),
            counts: Default::default(),
            diagnostics: Default::default(),
        }),
    };
    let (mut journal, _, _) = Journal::open(&path, &[]).unwrap();
    journal.append(&result(0)).unwrap();
    let first = fs::read(&path).unwrap().len();
    journal.append(&result(1)).unwrap();
    let bytes = fs::read(&path).unwrap();
    for cut in first..bytes.len() {
        fs::write(&path, &bytes[..cut]).unwrap();
        let (read, warnings) = read_results(&path, &[]).unwrap();
        assert_eq!(read, [result(0)]);
        assert_eq!(warnings.len(), usize::from(cut > first), "{cut}");
        // The next appended record does not join the torn one.
        let (mut journal, results, _) = Journal::open(&path, &[]).unwrap();
        assert_eq!(results, [result(0)]);
        journal.append(&result(1)).unwrap();
        assert_eq!(fs::read(&path).unwrap(), bytes, "{cut}");
    }
    // A damaged record before others is not caused by a crash, so nothing is removed.
    let mut damaged = bytes.clone();
    damaged[0] = b'!';
    fs::write(&path, &damaged).unwrap();
    assert!(matches!(
        Journal::open(&path, &[]),
        Err(EvalError::Env(EnvError::Unreadable { line: 1, .. }))
    ));
    assert_eq!(fs::read(&path).unwrap(), damaged);
}

#[test]
fn a_replay_of_an_altered_trace_stops_at_the_first_wrong_digest() {
    let source = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let helpers = TestHelpers::new();
    let request = RunRequest { seeds: None, ..request(&source, &["turner"]) };
    let (mut run, _) = Run::open(dir.path(), FolderMode::New, &request, &helpers).unwrap();
    assert!(play(&mut run, 1, &helpers));
    let path = run.folder().traces().unwrap().remove(0);
    let whole = crate::trace_file::read(&path).unwrap().0;
    let episode = run.folder().episode(run.options(), &whole.header.key()).unwrap();
    let replayed = |trace: &chaic_env::trace::Trace| {
        let mut replay = crate::replay::Replay::new(trace, &episode)?;
        while replay.step()? {}
        Ok::<_, EvalError>(())
    };
    replayed(&whole).unwrap();
    let decisions: Vec<usize> = (0..whole.records.len())
        .filter(|k| matches!(whole.records[*k], chaic_env::trace::Record::Decision(_)))
        .collect();
    // The effect of the last decisions shows in the end record only.
    for k in &decisions[..decisions.len() / 2] {
        let mut altered = whole.clone();
        if let chaic_env::trace::Record::Decision(decision) = &mut altered.records[*k] {
            decision.action = match decision.action {
                Action::TurnLeft => Action::TurnRight,
                _ => Action::TurnLeft,
            };
        }
        let error = replayed(&altered).unwrap_err().to_string();
        assert!(error.contains("the trace was altered"), "{k}: {error}");
        let report =
            crate::verify::verify_trace(run.folder(), run.options(), &helpers, &altered, &path);
        assert!(report.unwrap().is_some(), "{k}");
        altered = whole.clone();
        altered.records.remove(*k);
        assert!(replayed(&altered).is_err(), "{k} removed");
    }
}
