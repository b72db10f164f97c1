//! Promises: rows of different rules are never in one table, and texts of a submission cannot add markup.

use chaic_core::TaskId;
use chaic_eval::metrics::{FormulaSet, PlayedEpisodes, RunStatus, Scores, Summary};
use chaic_eval::report::RecordedGrants;

use super::*;
use crate::score::SubmissionRecord;

const EVIL: &str = "</td><script>alert(1)</script>\"'&";

fn rules(split: &str, track: &str) -> EvaluationConditions {
    EvaluationConditions {
        chaic: "0.1.0".to_owned(),
        track: track.to_owned(),
        rules: "paper".to_owned(),
        set: Vec::new(),
        tasks: vec![TaskId::Obstacle],
        split: split.to_owned(),
        episodes_sha256: split.repeat(3),
        n_episodes: 6,
        seeds: 1,
        size: None,
        partner: "rules".to_owned(),
        person: None,
        appearance: "canonical".to_owned(),
        perception: "gt".to_owned(),
        behavior: "gt".to_owned(),
    }
}

fn result(helper: &str, k: usize, done: u32) -> RunResult {
    let (helper, episode) = (helper.to_owned(), format!("obstacle/sealed/{k:03}"));
    let summary = Summary {
        frames: 100,
        done: f64::from(done),
        total: 10.0,
        away_frames: None,
        escape_frames: None,
        stuck_frames: None,
        deliveries: Vec::new(),
        digest: chaic_env::Digest(u64::from(done)),
        counts: BTreeMap::new(),
        diagnostics: BTreeMap::new(),
    };
    let key = RunKey { task: TaskId::Obstacle, helper, episode, seed: 0 };
    RunResult { key, status: RunStatus::Done(summary) }
}

/// Returns an evaluation in which the helper delivers `rates` tenths per episode, and RHP 4 and 5.
fn entry(name: &str, conditions: &EvaluationConditions, rates: [u32; 6]) -> ConfirmedEntry {
    let own = rates.iter().enumerate().map(|(k, done)| result(name, k, *done));
    let others = [(NONE, 1), ("rhp", 4)]
        .into_iter()
        .flat_map(|(helper, done)| (0..6).map(move |k| result(helper, k, done + k as u32 % 2)));
    let results: Vec<RunResult> = own.chain(others).collect();
    let granted = RecordedGrants {
        grants: vec!["goal_place".to_owned(), "ids".to_owned()],
        perception: "ground_truth".to_owned(),
        isolation: None,
        weights: None,
    };
    let planned: Vec<RunKey> = results.iter().map(|result| result.key.clone()).collect();
    let environments = Environments::default();
    let played =
        PlayedEpisodes { results: &results, planned: &planned, environments: &environments };
    let score = SubmissionScore {
        format: "chaic-score",
        version: 1,
        submission: SubmissionRecord {
            name: name.to_owned(),
            release: "1.0".to_owned(),
            authors: vec![EVIL.to_owned()],
            description: EVIL.to_owned(),
            license: "MIT".to_owned(),
            hardware: EVIL.to_owned(),
            core_hours: 1.5,
            sha256: format!("{name:0>64}"),
        },
        conditions: conditions.clone(),
        grants: [name, NONE, "rhp"].map(|name| (name.to_owned(), granted.clone())).into(),
        partner: None,
        tasks: Scores::new(played, &FormulaSet::Paper.formulas()).tasks,
        episode_runs: Vec::new(),
    };
    ConfirmedEntry { folder: format!("of-{name}"), score, results, environments }
}

fn leaderboard(entries: Vec<ConfirmedEntry>) -> Leaderboard {
    let mut builder = LeaderboardBuilder::default();
    entries.into_iter().for_each(|entry| builder.add_entry(Path::new("x"), entry));
    builder.build()
}

#[test]
fn rows_of_different_rules_are_in_different_tables() {
    let (unrestricted, hidden, other) =
        (rules("a", "unrestricted"), rules("a", "hidden"), rules("b", "unrestricted"));
    let size = EvaluationConditions { size: Some(64), ..unrestricted.clone() };
    let version = EvaluationConditions { chaic: "0.2.0".to_owned(), ..unrestricted.clone() };
    let perception =
        EvaluationConditions { perception: "learned".to_owned(), ..unrestricted.clone() };
    let behavior = EvaluationConditions { behavior: "learned".to_owned(), ..unrestricted.clone() };
    let all = [&unrestricted, &hidden, &other, &size, &version, &perception, &behavior];
    let entries = all.iter().enumerate().flat_map(|(k, rules)| {
        [entry(&format!("m{k}"), rules, [5; 6]), entry(&format!("n{k}"), rules, [6; 6])]
    });
    let board = leaderboard(entries.collect());
    assert_eq!((board.tables.len(), board.n_submissions()), (7, 14));
    for table in &board.tables {
        let k = all.iter().position(|rules| **rules == table.conditions).expect("given rules");
        let names: Vec<&str> = table.rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!(names, [&format!("n{k}"), &format!("m{k}"), "rhp", NONE]);
    }
    let page = board.to_html("t");
    assert_eq!(page.matches("<table>").count(), 3 * 7);
    assert_eq!(page.matches("<caption>").count(), 3 * 7);
}

#[test]
fn differences_are_paired_with_rhp_and_adjusted() {
    let unrestricted = rules("a", "unrestricted");
    // RHP has 4, 5, 4, 5, 4, 5 tenths.
    let board = leaderboard(vec![
        entry("same", &unrestricted, [4, 5, 4, 5, 4, 5]),
        entry("better", &unrestricted, [6, 7, 5, 8, 6, 6]),
        entry("unsure", &unrestricted, [9, 1, 5, 5, 4, 6]),
    ]);
    let [table] = &board.tables[..] else { panic!("one table") };
    assert_eq!((table.reference.as_str(), table.environments), ("rhp", 6));
    let difference = |name: &str| {
        let row = table.rows.iter().find(|row| row.name == name).expect(name);
        row.difference
    };
    assert_eq!((difference("rhp"), difference(NONE)), (None, None));
    let same = difference("same").expect("paired");
    assert_eq!((same.mean, same.p, same.p_holm), (0.0, 1.0, 1.0));
    let better = difference("better").expect("paired");
    // Differences 0.2, 0.2, 0.1, 0.3, 0.2, 0.1.
    assert!((better.mean - 1.1 / 6.0).abs() < 1e-12 && better.low > 0.0, "{better:?}");
    assert!(better.p < 0.01 && (better.p_holm - 3.0 * better.p).abs() < 1e-12, "{better:?}");
    let unsure = difference("unsure").expect("paired");
    assert!(unsure.low < 0.0 && unsure.p > 0.3, "{unsure:?}");
    assert_eq!(board.to_csv().lines().count(), 1 + 5);
}

#[test]
fn one_environment_is_counted_although_it_has_no_interval() {
    let mut mine = entry("mine", &rules("a", "unrestricted"), [5; 6]);
    let house =
        |k: u32| (TaskId::Obstacle, format!("obstacle/sealed/{k:03}"), "house/a".to_owned());
    mine.environments = Environments::new((0..6).map(house));
    let board = leaderboard(vec![mine]);
    let [table] = &board.tables[..] else { panic!("one table") };
    assert_eq!((table.environments, table.rows[0].tr_ci), (1, None));
    assert!(board.to_html("t").contains("<dt>Environments</dt><dd>1</dd>"));
}

#[test]
fn repeated_and_contradictory_evaluations_are_refused() {
    let unrestricted = rules("a", "unrestricted");
    let mut cheater = entry("cheater", &unrestricted, [9; 6]);
    let of_none = cheater.results.iter_mut().find(|result| result.key.helper == NONE);
    *of_none.expect("it played") = result(NONE, 0, 0);
    let board = leaderboard(vec![
        entry("first", &unrestricted, [5; 6]),
        entry("first", &unrestricted, [5; 6]),
        cheater,
        entry("last", &unrestricted, [3; 6]),
    ]);
    assert_eq!(board.n_submissions(), 2);
    let reasons: Vec<&str> = board.refused.iter().map(|entry| entry.reason.as_str()).collect();
    let [repeated, contradictory] = reasons[..] else { panic!("{reasons:?}") };
    assert_eq!(repeated, "it is the submission of of-first");
    assert!(contradictory.starts_with("obstacle/sealed/000 with none and seed 0 ends otherwise"));
}

#[test]
fn texts_cannot_add_markup_and_the_page_loads_nothing() {
    let mut builder = LeaderboardBuilder::default();
    builder.add_entry(Path::new("x"), entry("mine", &rules(EVIL, "unrestricted"), [5; 6]));
    builder.refuse(Path::new(EVIL), &format!("{EVIL}/run: {EVIL}"));
    let page = builder.build().to_html(EVIL);
    assert_eq!(page.matches("<script").count(), 0, "{page}");
    for forbidden in ["src=", "<link", "@import", "url(", "http"] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    assert!(page.contains("&lt;&#x2f;td&gt;"), "texts are escaped");
    assert!(leaderboard(Vec::new()).to_html("t").contains("No submission is confirmed."));
}
