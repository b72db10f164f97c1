//! Promises: single rules are set by name, both sets are made of the rules that are listed, every
//! rule stands in `docs/rules.md` with the values that it has, and old listings are read.

use super::*;

/// Where every rule stands with its value and reason.
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../docs/rules.md");

#[test]
fn single_rules_are_set_by_value_and_by_set() -> Result<()> {
    let rules = RuleSet::COMPAT
        .with("world.durations.refused_pick=5")?
        .with("world.blocking=paper")?
        .with("planner.goal_blackout_frames=0")?
        .with("planner.time.reconsider_frames=80")?;
    assert_eq!(rules.world.durations.refused_pick, 5);
    assert_eq!(rules.world.blocking, Rules::paper().blocking);
    assert_eq!(rules.planner.goal_blackout_frames, 0);
    assert_eq!(rules.planner.time.reconsider_frames, 80);
    assert_eq!(rules.name, RuleSetName::Compat);
    assert_eq!(rules.planner.walking, PlannerRules::compat().walking);
    Ok(())
}

#[test]
fn a_wrong_setting_is_refused_with_what_would_be_right() {
    for (setting, expected) in [
        ("world.gravity=9", "planner.exploration"),
        ("name=paper", "no rule `name`"),
        ("world.stride_m", "NAME=VALUE"),
        ("world.stride_m=far", "0.4"),
        ("world.stride_m=0", "0.01 to 10"),
        ("world.turn_rad=0", "0.01 to 3.14"),
        ("world.turn_rad=-0.3", "0.01 to 3.14"),
        ("planner.exploration=nowhere", "frontier"),
        ("world.dropped_counts=1", "false"),
    ] {
        let error = RuleSet::PAPER.with(setting).expect_err(setting).to_string();
        assert!(error.contains(setting) && error.contains(expected), "{error}");
    }
}

#[test]
fn the_sets_differ_in_just_the_listed_rules() -> Result<()> {
    let differing = differing_rules();
    let made = differing
        .iter()
        .try_fold(RuleSet::PAPER, |rules, name| rules.with(&format!("{name}=compat")))?;
    assert_eq!(RuleSet { name: RuleSetName::Compat, ..made }, RuleSet::COMPAT);
    for name in &differing {
        let (paper, compat) = rule_values(name)?;
        assert_ne!(paper, compat, "{name}");
        assert_ne!(RuleSet::COMPAT.with(&format!("{name}={paper}"))?, RuleSet::COMPAT);
    }
    assert!(differing.iter().any(|n| n == "world.durations.refused_pick"));
    assert!(!differing.iter().any(|n| n == "world.stride_m"));
    assert!(rule_values("world.durations").is_err() && rule_values("world.gravity").is_err());
    Ok(())
}

#[test]
fn every_set_can_be_made_of_the_other_rule_by_rule() -> Result<()> {
    let made = rule_names()
        .iter()
        .try_fold(RuleSet::PAPER, |rules, name| rules.with(&format!("{name}=compat")))?;
    assert_eq!(RuleSet { name: RuleSetName::Compat, ..made }, RuleSet::COMPAT);
    Ok(())
}

/// The rules of a page's tables, each with the values that its row gives: one for both sets, or the
/// paper's and the original's.
fn listed(page: &str) -> Vec<(&str, Vec<&str>)> {
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| {
        let (name, rest) = row.split_once("` | ")?;
        let values: Vec<&str> = rest.trim_end_matches(" |").split(" | ").collect();
        let is_rule = name.starts_with("world.") || name.starts_with("planner.");
        is_rule.then(|| (name, values[..values.len() - 1].to_vec()))
    })
    .collect()
}

/// Whether a row says what is so, be it as 2 or as 2.0.
fn says(row: &str, value: &str) -> bool {
    let number = |text: &str| text.parse::<f32>().ok();
    row == value || number(row).is_some_and(|n| number(value) == Some(n))
}

#[test]
fn every_rule_stands_in_the_page_of_rules_with_its_values() -> Result<()> {
    let page = std::fs::read_to_string(PAGE).expect("the page is in the repository");
    let rows = listed(&page);
    for (name, values) in &rows {
        let (paper, compat) = rule_values(name)?;
        let expected = if paper == compat { vec![paper] } else { vec![paper, compat] };
        // What is off in both sets may still be told apart.
        let is_right = values
            .iter()
            .enumerate()
            .all(|(i, v)| says(v, expected.get(i).or(expected.last()).map_or("", String::as_str)));
        assert!(is_right && values.len() >= expected.len(), "{name}: {values:?}, not {expected:?}");
    }
    for name in rule_names() {
        let n_rows = rows.iter().filter(|(listed, _)| *listed == name).count();
        assert_eq!(n_rows, 1, "rows of `{name}` in docs/rules.md");
    }
    Ok(())
}

#[test]
fn listings_from_before_constants_were_rules_are_read_as_they_were_played() {
    for rules in [RuleSet::PAPER, RuleSet::COMPAT] {
        let mut listing = rules.to_value();
        let planner = listing["planner"].as_object_mut().expect("a struct");
        for group in ["time", "limits", "failures", "lifting", "people", "child"] {
            assert!(planner.remove(group).is_some(), "{group}");
        }
        assert_eq!(serde_json::from_value::<RuleSet>(listing).expect("readable"), rules);
        // A rule that was always there may not be missing.
        let mut listing = rules.to_value();
        listing["planner"].as_object_mut().expect("a struct").remove("walking");
        assert!(serde_json::from_value::<RuleSet>(listing).is_err());
    }
}
