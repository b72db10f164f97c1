//! Promise: reports have the same content in every format.

use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::rules::RuleSetName;
use chaic_env::{CHAIC_VERSION, Digest, RunKey};

use super::*;
use crate::figure::MAX_HELPERS;
use crate::metrics::{FormulaSet, RunResult, RunStatus, Summary};
use crate::run::{EpisodeJob, FolderMode, RunFolder, RunGrants, RunOptions};

fn results() -> Vec<RunResult> {
    let mut results = Vec::new();
    for task in TaskId::paper() {
        for (helper, done) in [("oracle", 3.0), ("none", 1.0), ("rhp", 2.0)] {
            for k in 0..2 {
                let episode = format!("{task}/test/0{k}");
                let away_frames = (task == TaskId::Shopping && helper != "none").then_some(250);
                results.push(RunResult {
                    key: RunKey { task, helper: helper.to_owned(), episode, seed: 0 },
                    status: RunStatus::Done(Summary {
                        frames: 1000,
                        done: done + f64::from(k),
                        total: 10.0,
                        away_frames,
                        stuck_frames: None,
                        escape_frames: away_frames,
                        deliveries: Vec::new(),
                        digest: Digest(0),
                        counts: Default::default(),
                        diagnostics: Default::default(),
                    }),
                });
            }
        }
    }
    results
}

fn options() -> RunOptions {
    RunOptions {
        tasks: TaskId::paper().collect(),
        helpers: vec!["none".into(), "rhp".into(), "oracle".into()],
        split: "test".into(),
        n_episodes: Some(2),
        seeds: 1,
        image_size: None,
        rules: RuleSetName::Paper,
        rule_overrides: vec![],
        traces: true,
        partner: None,
        person: None,
        appearance: None,
        perception: None,
        behavior: None,
        track: chaic_env::Track::Unrestricted,
    }
}

/// Returns the default grants of `rhp` and `oracle`, and the given grants of the partner.
fn granted(partner: Grants) -> RunGrants {
    let helpers = [("rhp", Grants::IDS), ("oracle", Grants::ORACLE)];
    RunGrants {
        helpers: helpers.map(|(name, g)| (name.to_owned(), g)).into(),
        partner,
        perception: Default::default(),
        isolation: Default::default(),
        weights: Default::default(),
        limits_s: Default::default(),
    }
}

fn text(results: &[RunResult], format: Format) -> String {
    text_with(results, Some(&granted(Grants::PARTNER)), format)
}

fn text_with(results: &[RunResult], granted: Option<&RunGrants>, format: Format) -> String {
    let job =
        |r: RunResult| EpisodeJob { environment: r.key.episode.clone(), key: r.key, horizon: 1000 };
    let planned: Vec<EpisodeJob> = self::results().into_iter().map(job).collect();
    let (version, formulas) = (CHAIC_VERSION, FormulaSet::Paper);
    Report { version, options: &options(), results, planned: &planned, granted, formulas }
        .text(format)
}

#[test]
fn the_heading_has_the_version_that_started_the_run() {
    let (results, options) = (results(), options());
    let heading = |version: &str| {
        let (results, formulas) = (&results, FormulaSet::Paper);
        let report =
            Report { version, options: &options, results, planned: &[], granted: None, formulas };
        report.text(Format::Markdown).lines().nth(2).unwrap().to_owned()
    };
    assert!(heading(CHAIC_VERSION).starts_with(&format!("chaic {CHAIC_VERSION}, rules")));
    let older = format!("chaic 0.0.7 (report of chaic {CHAIC_VERSION}), rules");
    assert!(heading("0.0.7").starts_with(&older), "{}", heading("0.0.7"));
}

#[test]
fn one_episode_and_one_episode_run_are_singular() {
    let (results, mut options) = (results(), options());
    let mut text = |n_episodes, n_results: usize| {
        options.n_episodes = n_episodes;
        let (results, formulas) = (&results[..n_results], FormulaSet::Paper);
        let (version, options) = (CHAIC_VERSION, &options);
        Report { version, options, results, planned: &[], granted: None, formulas }
            .text(Format::Markdown)
    };
    let all = text(None, 48);
    assert!(all.contains(", all episodes of each task") && all.contains("48 episode runs.\n"));
    let one = text(Some(1), 1);
    assert!(one.contains(", first episode of each task") && one.contains("\n1 episode run.\n"));
    assert!(text(Some(2), 2).contains(", first 2 episodes of each task"));
}

#[test]
fn an_unfinished_run_is_reported() {
    let whole = results();
    let md = text(&whole, Format::Markdown);
    assert!(!md.contains("Unfinished") && !md.contains("Unequal"), "{md}");
    // RHP lacks one episode of the obstacle task, and all of shopping.
    let some = |r: &&RunResult| {
        let (k, is_rhp) = (&r.key, r.key.helper == "rhp");
        !(is_rhp && (k.task == TaskId::Shopping || k.episode == "obstacle/test/01"))
    };
    let part: Vec<RunResult> = whole.iter().filter(some).cloned().collect();
    for format in [Format::Table, Format::Markdown] {
        let text = text(&part, format);
        let missing =
            "Unfinished: 3 of 48 episode runs are missing (RHP 3); all numbers are of those";
        assert!(text.contains(missing), "{text}");
        assert!(text.contains("in obstacle the rows rest on different"), "{text}");
        assert!(text.contains("(w/o on 2, Oracle on 2, RHP on 1)"), "{text}");
        assert!(text.contains("Missing: obstacle/test/01 with rhp, seed 0; shopping"), "{text}");
        assert!(text.contains("0.20(0.50)?"), "the row with one missing is marked: {text}");
        assert!(text.contains("? Incomplete: episode runs are missing."), "{text}");
        assert!(!text.contains("in shopping the rows"), "a missing row is not unequal: {text}");
    }
    let json: serde_json::Value = serde_json::from_str(&text(&part, Format::Json)).unwrap();
    let runs = serde_json::json!({"planned": 48, "scored": 45, "broken": 0, "missing": 3});
    assert_eq!(json["episode_runs"], runs);
    assert_eq!(json["incomplete"], true);
    assert_eq!(json["missing"].as_array().unwrap().len(), 3);
    let row = &json["tasks"]["obstacle"]["rhp"];
    assert_eq!(row["incomplete"], true);
    assert_eq!(row["missing"], serde_json::json!(["obstacle/test/01 seed 0"]));
    assert_eq!(json["tasks"]["obstacle"]["none"]["incomplete"], false);
}

#[test]
fn the_command_of_a_run_has_all_options() {
    assert_eq!(options().command(), "chaic eval --helper none,rhp,oracle --n-episodes 2");
    let change = RunOptions { person: Some("child".parse().unwrap()), traces: false, ..options() };
    let expected = "chaic eval --helper none,rhp,oracle --n-episodes 2 --person child --no-traces";
    assert_eq!(change.command(), expected);
}

#[test]
fn a_report_of_many_helpers_is_written_without_figures() {
    for (n_helpers, has_figures) in [(MAX_HELPERS, true), (MAX_HELPERS + 1, false)] {
        let of_helper = |k: usize| {
            let mut result = results().remove(0);
            result.key.helper = format!("helper{k:02}");
            result
        };
        let results: Vec<RunResult> = (0..n_helpers).map(of_helper).collect();
        let job = |r: &RunResult| EpisodeJob {
            environment: r.key.episode.clone(),
            key: r.key.clone(),
            horizon: 1000,
        };
        let planned: Vec<EpisodeJob> = results.iter().map(job).collect();
        let helpers = results.iter().map(|r| r.key.helper.clone()).collect();
        let options = RunOptions { helpers, ..options() };
        let formulas = FormulaSet::Paper;
        let report = Report {
            version: CHAIC_VERSION,
            options: &options,
            results: &results,
            planned: &planned,
            granted: None,
            formulas,
        };
        let temporary = tempfile::tempdir().unwrap();
        let (folder, _) = RunFolder::lock(&temporary.path().join("run"), FolderMode::New).unwrap();
        write_files(&folder, &report).unwrap();
        assert!(folder.join("scores.json").is_file() && folder.join("report.md").is_file());
        for figure in ["figure.svg", "figure.png"] {
            assert_eq!(folder.join(figure).is_file(), has_figures, "{n_helpers} {figure}");
        }
        assert_eq!(differing_files(&folder, &report).unwrap(), (vec![], vec![]));
    }
}

#[test]
fn the_table_has_the_papers_layout() {
    let table = text(&results(), Format::Table);
    let lines: Vec<&str> = table.lines().collect();
    let row = |name: &str| *lines.iter().find(|l| l.contains(name)).unwrap();
    assert!(row("High container").contains("No constraint"), "{table}");
    // Alone 1 and 2 of 10, with RHP 2 and 3: EI is the mean of 1/2 and 1/3.
    assert!(row("RHP").contains("0.25(0.42)") && row("w/o").contains("0.15 "), "{table}");
    let shopping = *lines.iter().filter(|l| l.contains("Oracle")).nth(1).unwrap();
    assert!(shopping.contains("0.25"), "the emergency rate is there: {table}");
    assert!(lines.iter().all(|l| l.chars().count() <= 120), "{table}");
}

#[test]
fn every_format_has_every_task_and_helper() {
    let results = results();
    let csv = text(&results, Format::Csv);
    assert_eq!(csv.lines().count(), 1 + 8 * 3);
    let row = csv.lines().find(|l| l.starts_with("shopping,rhp,")).unwrap();
    assert!(row.starts_with("shopping,rhp,ids,ground_truth,0.250000,0.04999"), "{row}");
    assert!(row.ends_with(",,,0.250000,,2,2,0,false"), "{row}");
    assert!(row.contains(",0.416667,"), "{row}");
    let json: serde_json::Value = serde_json::from_str(&text(&results, Format::Json)).unwrap();
    assert_eq!(json["tasks"].as_object().unwrap().len(), 8);
    assert_eq!(json["tasks"]["obstacle"]["none"]["ei"], serde_json::Value::Null);
    let md = text(&results, Format::Markdown);
    assert!(md.contains("| RHP - w/o | 0.10 [0.10, 0.10] |"), "{md}");
    // One environment per episode of the indoor tasks, and two streets and two yards.
    assert!(md.contains("| all tasks | 16 | 0.00 | 0.00 |"), "{md}");
}

#[test]
fn grants_are_in_every_format() {
    let results = results();
    for format in [Format::Table, Format::Markdown] {
        let text = text(&results, format);
        let tables = text.matches("ids from ground truth").count();
        assert!(tables >= 2 * 4, "both helpers in each of four tables: {text}");
        assert!(!text.contains("additional grants of the partner"), "{text}");
    }
    let all = "**Granted: RHP: ids from ground truth; Oracle: ids from ground truth, granted behavior, \
               goal, goal place, progress.**";
    assert!(text(&results, Format::Markdown).contains(all));
    let json: serde_json::Value = serde_json::from_str(&text(&results, Format::Json)).unwrap();
    let oracle = ["behavior", "goal", "goal_place", "ids", "progress"];
    assert_eq!(
        json["helpers"],
        serde_json::json!({
            "none": {"grants": [], "perception": "none"},
            "rhp": {"grants": ["ids"], "perception": "ground_truth"},
            "oracle": {"grants": oracle, "perception": "ground_truth"},
        })
    );
    assert_eq!(json["partner"]["grants"], serde_json::json!(["goal", "goal_place", "ids"]));
    let own =
        RunGrants { helpers: [("rhp".to_owned(), Grants::NONE)].into(), ..granted(Grants::ORACLE) };
    let md = text_with(&results, Some(&own), Format::Markdown);
    let expected = "RHP: no grants; Oracle: grants not recorded; additional grants of the partner: \
                behavior, progress.";
    assert!(md.contains(expected), "{md}");
    let json = text_with(&results, Some(&own), Format::Json);
    assert!(json.contains("\"perception\": \"own\""), "{json}");
    let unknown = text_with(&results, None, Format::Table);
    assert!(unknown.contains("grants not recorded"), "{unknown}");
}

#[test]
fn language_helpers_with_a_behavior_network_are_named_as_in_the_paper() {
    let behavior = |perception: &str| {
        let helpers = ["llm", "vlm", "rhp"].map(|name| (name.to_owned(), perception.to_owned()));
        RunGrants { perception: helpers.into(), ..granted(Grants::NONE) }
    };
    for (perception, expected) in [
        ("ground_truth, behavior learned 0123", ["LLM+BM", "VLM+BM", "RHP"]),
        ("learned 4567, behavior learned 0123", ["LLM+BM", "VLM+BM", "RHP"]),
        ("learned 4567", ["LLM", "VLM", "RHP"]),
    ] {
        let granted = behavior(perception);
        let labels = Labels { granted: Some(&granted) };
        assert_eq!(["llm", "vlm", "rhp"].map(|helper| labels.name(helper)), expected);
    }
    assert_eq!(Labels { granted: None }.name("llm"), "LLM");
}

#[test]
fn the_csv_has_as_many_cells_as_columns_with_a_behavior_network() {
    let name = "learned 4567, behavior learned 0123";
    let perception = [("rhp".to_owned(), name.to_owned())].into();
    let granted = RunGrants { perception, ..granted(Grants::NONE) };
    let csv = text_with(&results(), Some(&granted), Format::Csv);
    assert!(csv.contains(&format!(",rhp,ids,\"{name}\",")), "{csv}");
    let n_columns = csv.lines().next().unwrap().split(',').count();
    for line in csv.lines() {
        let unquoted = line.replace(&format!("\"{name}\""), name.split(',').next().unwrap());
        assert_eq!(unquoted.split(',').count(), n_columns, "{line}");
    }
}

#[test]
fn a_figure_shows_equal_rates_whose_sums_are_rounded() {
    let results = results();
    let run_options = options();
    let report = Report {
        version: CHAIC_VERSION,
        options: &run_options,
        results: &results,
        planned: &[],
        granted: None,
        formulas: FormulaSet::Paper,
    };
    let mut scores = report.scores();
    for score in scores.tasks.values_mut().flat_map(|row| row.values_mut()) {
        // The mean of rates and that of environments differ in the last bit.
        (score.tr, score.environments) = (0.3, 3);
        score.tr_ci = Some([0.3_f64.next_up(); 2]);
    }
    let dir = tempfile::tempdir().unwrap();
    write_figure(&scores, report.labels(), &dir.path().join("figure.svg")).unwrap();
}

#[test]
fn failed_runs_are_listed() {
    let mut results = results();
    let message = "the episode broke down: boom".to_owned();
    results[0].status = RunStatus::Error { message };
    for format in [Format::Table, Format::Markdown] {
        let text = text(&results, format);
        let expected =
            "Broke down, counts as zero: no_constraint/test/00 with oracle (seed 0): the";
        assert!(text.contains(expected), "{text}");
        // 0 and 4 of 10 instead of 3 and 4.
        assert!(text.contains("0.20(") && text.contains(")*"), "{text}");
        assert!(text.contains("* Episode runs broke down; they count as zero."), "{text}");
    }
}
