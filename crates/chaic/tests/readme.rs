//! Promise: the table of results in the README is what the run that it names gave. The run's
//! `scores.json` is `docs/results/test.json`; whoever changes one of them has to change both.

use std::fs;
use std::path::Path;

use serde_json::Value;

/// What the README calls each helper, and the scores.
const ROWS: [(&str, &str); 4] =
    [("w/o", "none"), ("Random", "random"), ("RHP", "rhp"), ("Oracle", "oracle")];
/// The columns of its table, in order.
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

fn text(path: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the root");
    fs::read_to_string(root.join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// A cell as it must stand: transport rate, with the efficiency improvement in brackets.
fn cell(score: &Value) -> String {
    let tr = score["tr"].as_f64().expect("every score has a rate");
    let ei = score["ei"].as_f64().map_or(String::new(), |ei| format!(" ({ei:.2})"));
    // No minus before what is rounded to nothing.
    format!("{tr:.2}{ei}").replace("-0.00", "0.00")
}

#[test]
fn the_table_of_results_is_that_of_the_run() {
    let (readme, scores) = (text("README.md"), text("docs/results/test.json"));
    let scores: Value = serde_json::from_str(&scores).expect("it is JSON");
    assert_eq!(scores["incomplete"], false, "the run is whole");
    assert_eq!(scores["episode_runs"]["scored"], 4 * 96);
    for (title, helper) in ROWS {
        let start = format!("| **{title}**, chaic |");
        let row = readme.lines().find(|line| line.starts_with(&start));
        let row = row.unwrap_or_else(|| panic!("no row begins with {start}"));
        let cells: Vec<&str> = row[start.len()..].trim_end_matches('|').split('|').collect();
        let cells: Vec<&str> = cells.into_iter().map(str::trim).collect();
        let expected: Vec<String> =
            TASKS.iter().map(|task| cell(&scores["tasks"][task][helper])).collect();
        assert_eq!(cells, expected, "{title}");
    }
}
