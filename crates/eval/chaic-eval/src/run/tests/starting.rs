//! Promise: a run that was stopped at its start can be started again, and files of others are not
//! removed.

use std::collections::BTreeMap;

use chaic_env::partner_suite::PartnerSuite;

use super::*;
use crate::suite::SuiteFolder;

/// Files that a run of one episode file writes before its `run.json`, besides the lock.
const STARTUP_FILES: [&str; 7] = [
    "episodes/low_target-short-0.json",
    "episodes/low_target-short-0.json.tmp",
    "episodes/shopping-old.json",
    "llm/settings.json",
    "llm/settings.json.tmp",
    "llm/templates/task.txt",
    "run.json.tmp",
];

#[test]
fn a_run_that_was_stopped_at_its_start_is_started_again() {
    let source = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let helpers = TestHelpers::new();
    let request = request(&source, &["turner"]);
    let names = |path: &Path| {
        let mut names: Vec<_> = files_below(path).into_iter().collect();
        names.sort();
        names
    };
    let undisturbed = dir.path().join("undisturbed");
    drop(Run::open(&undisturbed, FolderMode::New, &request, &helpers).unwrap());
    // Any subset of the files: all orders of writing leave one of these subsets.
    for left in 0..1_u32 << STARTUP_FILES.len() {
        let path = dir.path().join(left.to_string());
        fs::create_dir(&path).unwrap();
        fs::write(path.join(".lock"), "").unwrap();
        for (_, name) in STARTUP_FILES.iter().enumerate().filter(|(k, _)| left >> k & 1 == 1) {
            fs::create_dir_all(path.join(name).parent().unwrap()).unwrap();
            fs::write(path.join(name), "{ torn").unwrap();
        }
        let error = RunFolder::check_started(&path).unwrap_err();
        assert!(matches!(error, EvalError::NotStarted { .. }), "{left}: {error}");
        let access = if left % 2 == 0 { FolderMode::New } else { FolderMode::Resume };
        drop(Run::open(&path, access, &request, &helpers).unwrap());
        assert_eq!(names(&path), names(&undisturbed), "{left}");
    }
}

#[test]
fn runs_that_were_stopped_in_their_list_of_partners_are_started_again() {
    let dir = tempfile::tempdir().unwrap();
    let start = |path: &Path| SuiteFolder::start(path, PartnerSuite::bundled());
    for (k, left) in [&["partners.json.tmp"][..], &["partners.json.tmp", "partners.json.1.tmp"]]
        .into_iter()
        .enumerate()
    {
        let path = dir.path().join(k.to_string());
        fs::create_dir(&path).unwrap();
        for name in left {
            fs::write(path.join(name), "{ torn").unwrap();
        }
        start(&path).unwrap();
        assert_eq!(SuiteFolder::read(&path).unwrap().suite(), &PartnerSuite::bundled());
        assert!(!path.join("partners.json.tmp").exists());
        // Until all runs are started, the same start continues.
        start(&path).unwrap();
    }
    for other in ["partners.txt", "robustness.json.tmp"] {
        let path = dir.path().join(other);
        fs::create_dir(&path).unwrap();
        fs::write(path.join("partners.json.tmp"), "{ torn").unwrap();
        fs::write(path.join(other), "dear").unwrap();
        let before = files_below(&path);
        let error = start(&path).unwrap_err();
        assert!(matches!(error, EvalError::NotEmpty { .. }), "{other}: {error}");
        assert_eq!(files_below(&path), before);
    }
}

/// Returns names and contents of all files below a folder.
fn files_below(path: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in chaic_files::entries(path).unwrap() {
        let name = entry.file_name().unwrap().to_str().unwrap().to_owned();
        if entry.is_dir() {
            let below = files_below(&entry).into_iter();
            found.extend(below.map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else {
            found.push((name, fs::read(&entry).unwrap()));
        }
    }
    found
}

#[test]
fn files_of_others_are_never_removed() {
    let source = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let helpers = TestHelpers::new();
    let request = request(&source, &["turner"]);
    for (k, name) in [
        "episodes/letter.txt",
        "episodes/more/a.json",
        "letter.txt",
        "results.jsonl",
        "traces/a.jsonl",
        "llm/low_target/vlm/short-0-s0.jsonl",
    ]
    .iter()
    .enumerate()
    {
        let path = dir.path().join(k.to_string());
        fs::create_dir_all(path.join(name).parent().unwrap()).unwrap();
        for file in [".lock", name] {
            fs::write(path.join(file), "dear").unwrap();
        }
        let before = files_below(&path);
        let open = |access| Run::open(&path, access, &request, &helpers).unwrap_err();
        let (begun, resumed) = (open(FolderMode::New), open(FolderMode::Resume));
        assert!(matches!(begun, EvalError::NotEmpty { .. }), "{name}: {begun}");
        assert!(matches!(resumed, EvalError::NotARun { .. }), "{name}: {resumed}");
        assert_eq!(files_below(&path), before);
    }
    // Episodes in the run's own folder may be a user's files, whatever their names.
    let path = dir.path().join("own");
    fs::create_dir_all(path.join("episodes")).unwrap();
    fs::write(path.join(".lock"), "").unwrap();
    fs::copy(source.path().join("low_target-0.json"), path.join("episodes/a.json")).unwrap();
    let own = RunRequest { episodes: Some(path.join("episodes")), ..request.clone() };
    let before = files_below(&path);
    let error = Run::open(&path, FolderMode::New, &own, &helpers).unwrap_err();
    assert!(matches!(error, EvalError::NotEmpty { .. }), "{error}");
    assert_eq!(files_below(&path), before);
    // A folder of episodes without a lock is a user's.
    let path = dir.path().join("mine");
    fs::create_dir_all(path.join("episodes")).unwrap();
    fs::write(path.join("episodes/a.json"), "{}").unwrap();
    let error = Run::open(&path, FolderMode::New, &request, &helpers).unwrap_err();
    assert!(matches!(error, EvalError::NotEmpty { .. }), "{error}");
    assert_eq!(files_below(&path).len(), 1);
}

/// Helpers without the weights of one task.
struct WithoutObstacle(TestHelpers);

impl HelperRegistry for WithoutObstacle {
    fn names(&self) -> Vec<String> {
        self.0.names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        self.0.make(name, rules)
    }

    fn check_task(&self, name: &str, task: TaskId) -> std::result::Result<(), String> {
        let is_missing = name == "turner" && task == TaskId::Obstacle;
        if is_missing { Err("no weights of obstacle".to_owned()) } else { Ok(()) }
    }
}

#[test]
fn a_task_without_an_episode_or_a_helper_that_plays_it_is_refused() {
    let source = episode_files(&[TaskId::LowTarget, TaskId::Obstacle], 1);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run");
    let helpers = WithoutObstacle(TestHelpers::new());
    let all = request(&source, &["none", "turner"]);
    let empty = RunRequest {
        episodes: Some(dir.path().to_owned()),
        tasks: Some(vec![TaskId::LowTarget]),
        ..all.clone()
    };
    for (request, problem) in [
        (&all, "no weights of obstacle".to_owned()),
        (&empty, format!("{} holds no episode file (*.json) of low_target", dir.path().display())),
    ] {
        let error = Run::open(&path, FolderMode::New, request, &helpers).unwrap_err();
        assert!(error.is_usage() && error.to_string() == problem, "{error}");
        assert!(!path.exists());
    }
    // An earlier version started such a run, or a file was removed since.
    let started = dir.path().join("started");
    drop(Run::open(&started, FolderMode::New, &all, &helpers.0).unwrap());
    let error = Run::open(&started, FolderMode::Resume, &all, &helpers).unwrap_err();
    assert!(error.is_usage() && error.to_string() == "no weights of obstacle", "{error}");
    let low = RunRequest { tasks: Some(vec![TaskId::LowTarget]), ..all };
    Run::open(&path, FolderMode::New, &low, &helpers).unwrap();
}

/// Helper `viewer` of another language, which requests these images.
struct Viewers(SensorConfig);

struct Viewer(SensorConfig);

impl Agent for Viewer {
    fn sensors(&self) -> SensorConfig {
        self.0
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> std::result::Result<Action, AgentError> {
        Ok(Action::Wait { frames: 10 })
    }

    fn isolation(&self) -> Option<String> {
        Some("trusted".to_owned())
    }
}

impl HelperRegistry for Viewers {
    fn names(&self) -> Vec<String> {
        vec!["viewer".to_owned()]
    }

    fn make(&self, name: &str, _: PlannerRules) -> Option<Helper> {
        (name == "viewer").then(|| Helper { agent: Box::new(Viewer(self.0)), grants: Grants::IDS })
    }
}

#[test]
fn a_helper_with_other_images_does_not_resume_a_run() {
    let source = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let request = request(&source, &["viewer"]);
    let open = |name: &str, access, sensors| {
        let path = dir.path().join(name);
        Run::open(&path, access, &request, &Viewers(sensors)).map(drop)
    };
    let depth = SensorConfig { ids: false, ..SensorConfig::DEPTH_AND_IDS };
    let small = SensorConfig { image_size: 64, ..depth };
    let none = SensorConfig::NONE;
    for (name, sensors) in [("depth", depth), ("none", none)] {
        open(name, FolderMode::New, sensors).unwrap();
        open(name, FolderMode::Resume, sensors).unwrap();
    }
    for (name, sensors, words) in [
        ("depth", small, ["viewer requests depth of 64 pixels now", "has depth of 512 pixels;"]),
        ("depth", none, ["viewer requests no images now", "has depth of 512 pixels;"]),
        ("none", small, ["viewer requests depth of 64 pixels now", "has no images;"]),
    ] {
        let error = open(name, FolderMode::Resume, sensors).unwrap_err();
        let text = error.to_string();
        assert!(error.is_usage() && words.iter().all(|word| text.contains(word)), "{text}");
    }
    // A merged run has the images of its parts.
    let run_file = |name: &str| dir.path().join(name).join("run.json");
    drop(merge(&dir.path().join("merged"), &[dir.path().join("depth")]).unwrap());
    let text = fs::read_to_string(run_file("depth")).unwrap();
    assert_eq!(fs::read_to_string(run_file("merged")).unwrap(), text);
    let parts = ["depth", "none"].map(|name| dir.path().join(name));
    let error = merge(&dir.path().join("mixed"), &parts).unwrap_err().to_string();
    assert!(error.contains("different runs"), "{error}");
    // A run of an older version records none.
    let mut older: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(older.as_object_mut().unwrap().remove("images").is_some());
    fs::write(run_file("depth"), older.to_string()).unwrap();
    open("depth", FolderMode::Resume, small).unwrap();
}

#[test]
fn a_run_is_resumed_and_merged_only_with_the_same_files_of_helpers() {
    let source = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let files = |digest: u64| -> HelperFiles {
        let of_helper = BTreeMap::from([("helper.py".to_owned(), Digest(digest))]);
        // The second plays in no run, and the last names no file.
        let names = ["turner", "other", "breaker"];
        let mut files: HelperFiles = names.map(|name| (name.to_owned(), of_helper.clone())).into();
        files.get_mut("breaker").unwrap().clear();
        files
    };
    let open = |name: &str, access, helper_files: HelperFiles| {
        let request = RunRequest { helper_files, ..request(&source, &["turner", "breaker"]) };
        Run::open(&dir.path().join(name), access, &request, &TestHelpers::new()).map(drop)
    };
    open("a", FolderMode::New, files(1)).unwrap();
    open("a", FolderMode::Resume, files(1)).unwrap();
    // A file that did not exist, such as a log of the helper, and a caller that knows no files.
    let mut more = files(1);
    more.get_mut("breaker").unwrap().insert("log".to_owned(), Digest(5));
    open("a", FolderMode::Resume, more).unwrap();
    open("a", FolderMode::Resume, HelperFiles::new()).unwrap();
    let missing = HelperFiles::from([("turner".to_owned(), BTreeMap::new())]);
    for changed in [files(2), missing] {
        let error = open("a", FolderMode::Resume, changed).unwrap_err();
        let text = error.to_string();
        assert!(error.is_usage() && text.contains("another content of helper.py"), "{text}");
        assert!(text.contains("which turner runs") && !text.contains('\n'), "{text}");
    }
    let path = |name: &str| dir.path().join(name);
    let text = |name: &str| fs::read_to_string(path(name).join("run.json")).unwrap();
    drop(merge(&path("merged"), &[path("a")]).unwrap());
    assert_eq!(text("merged"), text("a"));
    assert!(text("a").contains("\"turner\"") && !text("a").contains("\"other\""), "{}", text("a"));
    open("b", FolderMode::New, files(2)).unwrap();
    let error = merge(&path("mixed"), &[path("a"), path("b")]).unwrap_err();
    assert!(error.is_usage() && error.to_string().contains("different files"), "{error}");
    // A run of an older version records no files.
    let mut older: serde_json::Value = serde_json::from_str(&text("a")).unwrap();
    assert!(older.as_object_mut().unwrap().remove("files").is_some());
    fs::write(path("a").join("run.json"), older.to_string()).unwrap();
    open("a", FolderMode::Resume, files(2)).unwrap();
    drop(merge(&path("both"), &[path("a"), path("b")]).unwrap());
    assert!(!text("both").contains("\"files\": {"), "{}", text("both"));
}

#[test]
fn invalid_requests_write_nothing() {
    let source = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let helpers = TestHelpers::new();
    let path = dir.path().join("run");
    let good = request(&source, &["turner"]);
    let file = source.path().join("low_target-0.json");
    let twin = source.path().join("twin.json");
    fs::copy(&file, &twin).unwrap();
    for request in [
        good.clone(),
        RunRequest { tasks: Some(vec![TaskId::Shopping]), ..good.clone() },
        RunRequest { partner: Some("nobody".to_owned()), ..good.clone() },
        RunRequest { episodes: None, split: "gen:0..2000000".parse().ok(), ..good.clone() },
    ] {
        for access in [FolderMode::New, FolderMode::Resume] {
            let error = Run::open(&path, access, &request, &helpers).unwrap_err();
            assert!(error.is_usage(), "{error}");
            assert!(!path.exists(), "{error}");
        }
    }
    fs::remove_file(&twin).unwrap();
    Run::open(&path, FolderMode::New, &good, &helpers).unwrap();
}
