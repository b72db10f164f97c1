//! Promise: the result tables of README.md, docs/results.md and docs/people.md agree with the runs that they name. The
//! `scores.json` of these runs are `docs/results/{standard,test,impaired}.json`.

use std::fs;

use serde_json::Value;

use crate::root;

/// Row titles of docs/results.md and docs/people.md, with the helpers' names: those of the paper.
const ROWS: [(&str, &str); 4] =
    [("w/o", "none"), ("Random", "random"), ("RHP", "rhp"), ("Oracle", "oracle")];
/// The same for helpers without a row in the paper.
const MORE_ROWS: [(&str, &str); 1] = [("Infer", "infer")];
/// Starts of the rows of the README's table, with the helpers' names.
const README_ROWS: [(&str, &str); 5] = [
    ("| **No helper** (w/o) |", "none"),
    ("| **Random** valid plans |", "random"),
    ("| **RHP**, rule-based hierarchical planner |", "rhp"),
    ("| **Infer**, which infers goal and constraint |", "infer"),
    ("| **Oracle**, RHP that knows the goal |", "oracle"),
];
/// Columns of the tables, in order.
const TASKS: [&str; 8] = [
    "no_constraint",
    "high_target",
    "high_container",
    "high_goal",
    "low_target",
    "obstacle",
    "shopping",
    "moving_house",
];

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Formats a number with two digits, without a minus before zero.
fn number(value: &Value) -> Option<String> {
    value.as_f64().map(|value| format!("{value:.2}").replace("-0.00", "0.00"))
}

/// Transport rate.
fn rate(score: &Value) -> String {
    number(&score["tr"]).expect("every score has a rate")
}

/// Transport rate, with the efficiency improvement in brackets.
fn rate_and_improvement(score: &Value) -> String {
    number(&score["ei"]).map_or(rate(score), |ei| format!("{} ({ei})", rate(score)))
}

/// Transport rate, with its 95 % interval in brackets.
fn rate_and_interval(score: &Value) -> String {
    let [low, high] = [0, 1].map(|k| number(&score["tr_ci"][k]).expect("it has an interval"));
    format!("{} ({low}–{high})", rate(score))
}

/// Reads the scores in `docs/results/RUN.json`, of a complete run with this number of episode runs.
fn scores(run: &str, n_scored: u64) -> Value {
    let scores = read(&format!("docs/results/{run}.json"));
    let scores: Value = serde_json::from_str(&scores).expect("it is JSON");
    assert_eq!(scores["incomplete"], false, "the run is complete");
    assert_eq!(scores["episode_runs"]["scored"], n_scored);
    scores
}

/// Compares the row of a page that begins with `start` with the scores of a helper.
fn assert_row(
    page: &str,
    start: &str,
    helper: &str,
    scores: &Value,
    tasks: &[&str],
    cell: fn(&Value) -> String,
) {
    let text = read(page);
    let row = text.lines().find(|line| line.starts_with(start));
    let row = row.unwrap_or_else(|| panic!("{page}: no row begins with {start}"));
    let cells = row[start.len()..].trim_end_matches('|').split('|');
    let cells: Vec<&str> = cells.map(str::trim).collect();
    let expected: Vec<String> =
        tasks.iter().map(|task| cell(&scores["tasks"][task][helper])).collect();
    assert_eq!(cells, expected, "{page}: {start}");
}

/// Compares the rows `| **TITLE**, NAME |` of a page.
fn assert_rows(
    page: &str,
    name: &str,
    rows: &[(&str, &str)],
    scores: &Value,
    tasks: &[&str],
    cell: fn(&Value) -> String,
) {
    for (title, helper) in rows {
        assert_row(page, &format!("| **{title}**, {name} |"), helper, scores, tasks, cell);
    }
}

#[test]
fn the_readme_has_the_rates_of_the_standard_split() {
    let scores = scores("standard", 5 * 800);
    for (start, helper) in README_ROWS {
        assert_row("README.md", start, helper, &scores, &TASKS, rate);
    }
}

#[test]
fn the_results_page_has_the_rates_and_intervals_of_the_standard_split() {
    let scores = scores("standard", 5 * 800);
    let rows = [&ROWS[..], &MORE_ROWS[..]].concat();
    assert_rows("docs/results.md", "standard", &rows, &scores, &TASKS, rate_and_interval);
}

#[test]
fn the_results_page_has_the_test_episodes_beside_the_paper() {
    let scores = scores("test", 5 * 96);
    let rows = [&ROWS[..], &MORE_ROWS[..]].concat();
    assert_rows("docs/results.md", "chaic", &rows, &scores, &TASKS, rate_and_improvement);
}

#[test]
fn the_people_page_has_the_rates_with_impaired_partners() {
    let scores = scores("impaired", 4 * 200);
    let tasks = ["no_constraint", "one_handed", "low_vision", "tires", "tremor"];
    assert_rows("docs/people.md", "impaired", &ROWS, &scores, &tasks, rate_and_interval);
}
