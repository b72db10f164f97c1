//! Promise: the tables of results in the README, in docs/results.md and in docs/people.md are what the runs that they name
//! gave. The runs' `scores.json` are `docs/results/{standard,test,impaired}.json`; whoever changes one
//! has to change the other.

use std::fs;
use std::path::Path;

use serde_json::Value;

/// What the README calls each helper, and the scores.
const ROWS: [(&str, &str); 4] =
    [("w/o", "none"), ("Random", "random"), ("RHP", "rhp"), ("Oracle", "oracle")];
/// The columns of its tables, in order.
const PAPERS: [&str; 8] = [
    "no_constraint",
    "high_target",
    "high_container",
    "high_goal",
    "low_target",
    "obstacle",
    "shopping",
    "moving_house",
];

fn text(path: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the root");
    fs::read_to_string(root.join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// A number as it must stand: no minus before what is rounded to nothing.
fn number(value: &Value) -> Option<String> {
    value.as_f64().map(|value| format!("{value:.2}").replace("-0.00", "0.00"))
}

/// Transport rate, with the efficiency improvement in brackets.
fn rate_and_improvement(score: &Value) -> String {
    let tr = number(&score["tr"]).expect("every score has a rate");
    number(&score["ei"]).map_or(tr.clone(), |ei| format!("{tr} ({ei})"))
}

/// Transport rate, with its 95 % interval in brackets.
fn rate_and_interval(score: &Value) -> String {
    let tr = number(&score["tr"]).expect("every score has a rate");
    let [low, high] = [0, 1].map(|k| number(&score["tr_ci"][k]).expect("it has an interval"));
    format!("{tr} ({low}–{high})")
}

/// Compares the rows `| **HELPER**, NAME |` of a page with the scores in `docs/results/RUN.json`, of a
/// run of so many episode runs.
fn assert_table(
    (page, name): (&str, &str),
    run: &str,
    tasks: &[&str],
    n_scored: u64,
    cell: fn(&Value) -> String,
) {
    let (readme, scores) = (text(page), text(&format!("docs/results/{run}.json")));
    let scores: Value = serde_json::from_str(&scores).expect("it is JSON");
    assert_eq!(scores["incomplete"], false, "the run is whole");
    assert_eq!(scores["episode_runs"]["scored"], n_scored);
    for (title, helper) in ROWS {
        let start = format!("| **{title}**, {name} |");
        let row = readme.lines().find(|line| line.starts_with(&start));
        let row = row.unwrap_or_else(|| panic!("no row begins with {start}"));
        let cells = row[start.len()..].trim_end_matches('|').split('|');
        let cells: Vec<&str> = cells.map(str::trim).collect();
        let expected: Vec<String> =
            tasks.iter().map(|task| cell(&scores["tasks"][task][helper])).collect();
        assert_eq!(cells, expected, "{start}");
    }
}

#[test]
fn the_table_of_the_standard_split_is_that_of_its_run() {
    assert_table(("README.md", "standard"), "standard", &PAPERS, 4 * 800, rate_and_interval);
}

#[test]
fn the_table_beside_the_papers_is_that_of_its_run() {
    assert_table(("docs/results.md", "chaic"), "test", &PAPERS, 4 * 96, rate_and_improvement);
}

#[test]
fn the_table_of_impaired_partners_is_that_of_its_run() {
    let tasks = ["no_constraint", "one_handed", "low_vision", "tires", "tremor"];
    assert_table(("docs/people.md", "impaired"), "impaired", &tasks, 4 * 200, rate_and_interval);
}
