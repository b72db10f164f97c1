//! Promise: losses are differences of paired rates, and the parts add up to the total.

use chaic_core::TaskId;
use chaic_core::observation::Grants;

use super::*;
use crate::metrics::Environments;
use crate::metrics::tests::{case, result};

/// Counted objects of ten in each of two episodes.
const DONE: [(&str, [f64; 2]); 6] = [
    ("none", [1.0, 3.0]),
    ("rhp", [3.0, 4.0]),
    ("infer", [4.0, 6.0]),
    ("oracle", [6.0, 5.0]),
    ("infer_known_goal", [7.0, 7.0]),
    ("oracle_plan", [8.0, 10.0]),
];

fn results() -> Vec<RunResult> {
    let each = DONE.into_iter().flat_map(|(helper, [a, b])| [(helper, "e0", a), (helper, "e1", b)]);
    each.map(|(helper, episode, done)| result(case(helper, episode, done, 10.0))).collect()
}

fn losses(helpers: &[&str]) -> Result<Losses, String> {
    losses_of(&results(), helpers)
}

fn losses_of(results: &[RunResult], helpers: &[&str]) -> Result<Losses, String> {
    let helpers: Vec<String> = helpers.iter().map(|h| (*h).to_owned()).collect();
    let grants = |helper: &String| match helper.as_str() {
        "oracle" => Grants::ORACLE,
        "infer_known_goal" => Grants { goal: true, ..Grants::PLANNER },
        "ideal_observer" => Grants { state: true, ..Grants::PLANNER },
        "oracle_plan" => Grants::ALL,
        _ => Grants::PLANNER,
    };
    let granted = RunGrants {
        helpers: helpers.iter().map(|h| (h.clone(), grants(h))).collect(),
        partner: Grants::PARTNER,
        perception: Default::default(),
        isolation: Default::default(),
        weights: Default::default(),
        limits_s: Default::default(),
    };
    let environments = Environments::default();
    let played = PlayedEpisodes { results, planned: &[], environments: &environments };
    Losses::new(played, &helpers, &granted)
}

/// Returns the mean losses of a helper over all tasks, by cause.
fn means(losses: &Losses, helper: &str) -> Vec<(&'static str, f64)> {
    let found = losses.helpers.iter().find(|h| h.helper == helper).expect("the helper is listed");
    let mean = |loss: &Loss| (loss.cause, (1e3 * loss.all.unwrap().mean).round() / 1e3);
    found.losses.iter().map(mean).collect()
}

#[test]
fn the_grants_of_a_helper_decide_its_references() {
    let all = DONE.map(|(helper, _)| helper);
    let losses = losses(&all).unwrap();
    let listed: Vec<&str> = losses.helpers.iter().map(|h| h.helper.as_str()).collect();
    assert_eq!(listed, ["rhp", "infer", "oracle", "infer_known_goal"]);
    // Means: rhp 0.35, infer 0.5, oracle 0.55, infer_known_goal 0.7, oracle_plan 0.9.
    let expected = [("total", 0.55), ("search", 0.2), ("inference", 0.2), ("planning", 0.15)];
    assert_eq!(means(&losses, "rhp"), expected);
    assert_eq!(means(&losses, "infer"), [("total", 0.4), ("search", 0.2), ("inference", 0.2)]);
    assert_eq!(means(&losses, "oracle"), [("total", 0.35), ("search", 0.2), ("planning", 0.15)]);
    assert_eq!(means(&losses, "infer_known_goal"), [("total", 0.2), ("search", 0.2)]);
    let interval = losses.helpers[0].losses[0].tasks[&TaskId::LowTarget];
    assert!(interval.low < 0.55 && 0.55 < interval.high, "{interval:?}");
}

#[test]
fn losses_are_over_the_episodes_that_all_references_have() {
    let all = DONE.map(|(helper, _)| helper);
    let mut results = results();
    // A third episode lacks one of the references.
    let played = all.into_iter().filter(|helper| *helper != "infer_known_goal");
    results.extend(played.map(|helper| result(case(helper, "e2", 9.0, 10.0))));
    let (unfinished, finished) = (losses_of(&results, &all).unwrap(), losses(&all).unwrap());
    for helper in ["rhp", "infer", "oracle", "infer_known_goal"] {
        assert_eq!(means(&unfinished, helper), means(&finished, helper), "{helper}");
    }
}

#[test]
fn every_format_has_every_loss() {
    let all = DONE.map(|(helper, _)| helper);
    let losses = losses(&all).unwrap();
    let csv = losses.text(Format::Csv);
    assert!(csv.contains("\nrhp,planning,low_target,0.150000,"), "{csv}");
    assert_eq!(csv.lines().count(), 1 + 2 * 12);
    for format in [Format::Table, Format::Markdown] {
        let text = losses.text(format);
        assert!(text.contains("Low target") && text.contains("planning"), "{text}");
    }
    let json: serde_json::Value = serde_json::from_str(&losses.text(Format::Json)).unwrap();
    assert_eq!(json["helpers"][0]["losses"][3]["cause"], "planning");
}

#[test]
fn missing_references_are_named() {
    let message = losses(&["none", "rhp", "oracle", "oracle_plan"]).unwrap_err();
    assert!(message.contains("infer, infer_known_goal in the same run"), "{message}");
    let message = losses(&["ideal_observer", "rhp", "infer", "infer_known_goal"]).unwrap_err();
    assert!(message.contains("the helpers oracle_plan in"), "{message}");
}
