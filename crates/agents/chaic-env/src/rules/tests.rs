//! Tests that rules are set by name, and that both sets consist of the listed rules. `docs/rules.md`
//! lists every rule with its values, and old listings are read.

use super::*;

/// Page that lists every rule with its value and reason.
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../docs/rules.md");

#[test]
fn single_rules_are_set_by_value_and_by_set() -> Result<()> {
    let rules = RuleSet::COMPAT
        .with("world.durations.refused_pick_up=5")?
        .with("world.blocking=paper")?
        .with("planner.failed_goal_place_frames=0")?
        .with("planner.time.replan_interval_frames=80")?;
    assert_eq!(rules.world.durations.refused_pick_up, 5);
    assert_eq!(rules.world.blocking, Rules::paper().blocking);
    assert_eq!(rules.planner.failed_goal_place_frames, 0);
    assert_eq!(rules.planner.time.replan_interval_frames, 80);
    assert_eq!(rules.name, RuleSetName::Compat);
    assert_eq!(rules.planner.walking, PlannerRules::compat().walking);
    Ok(())
}

#[test]
fn a_wrong_setting_is_refused_with_the_expected_values() {
    for (setting, expected) in [
        ("world.gravity=9", "planner.exploration"),
        ("name=paper", "no rule `name`"),
        ("world.stride_m", "NAME=VALUE"),
        ("world.stride_m=far", "0.4"),
        ("world.stride_m=0", "0.01 to 10"),
        ("world.turn_rad=0", "0.01 to 3.14"),
        ("world.turn_rad=-0.3", "0.01 to 3.14"),
        ("planner.exploration=nowhere", "frontier"),
        ("world.failed_put_on_can_deliver=1", "false"),
        ("world.durations.open_hand=0", "1 to 10000"),
        ("world.durations.reach=10001", "0 to 10000"),
        ("world.pick_penalty.beta=0", "1 to 1000000"),
        ("world.break_chance_low=1.5", "0 to 1"),
        ("planner.failures.ignore_frames=4294967295", "0 to 1000000"),
        ("planner.pick_within_m=1e39", "0 to 1000000"),
        ("planner.put_within_m=-1", "0 to 1000000"),
    ] {
        let error = RuleSet::PAPER.with(setting).expect_err(setting).to_string();
        assert!(error.contains(setting) && error.contains(expected), "{error}");
    }
}

#[test]
fn earlier_names_of_rules_are_read_and_refused_with_the_current_ones() {
    let mut earlier = RuleSet::COMPAT.to_value();
    let names = rule_names();
    // Names of groups come last, so that their rules are found.
    let mut renamed = renamed::RENAMED_RULES;
    renamed.sort_by_key(|(old, _)| *old == "planner.limits");
    for (old, new) in renamed {
        let is_rule =
            |name: &str| names.iter().any(|n| n == name || n.starts_with(&format!("{name}.")));
        assert!(is_rule(new) && !is_rule(old), "{old}: {new}");
        let (group, new_key) = new.rsplit_once('.').unwrap();
        let group = earlier.pointer_mut(&format!("/{}", group.replace('.', "/"))).unwrap();
        let group = group.as_object_mut().unwrap();
        let value = group.remove(new_key).unwrap();
        group.insert(old.rsplit_once('.').unwrap().1.to_owned(), value);
    }
    assert_eq!(serde_json::from_value::<RuleSet>(earlier).unwrap(), RuleSet::COMPAT);
    let error = RuleSet::PAPER.with("planner.limits.wait_frames=3").unwrap_err().to_string();
    assert!(error.contains("`planner.plan_timeouts.wait_frames`"), "{error}");
    for setting in ["planner.limits.wait_frames=3", "planner.plan_timeouts.wait_frames=3"] {
        let rules = RuleSet::PAPER.with_recorded(setting).unwrap();
        assert_eq!(rules.planner.plan_timeouts.wait_frames, 3);
    }
}

#[test]
fn the_sets_differ_in_exactly_the_listed_rules() -> Result<()> {
    let differing = differing_rules();
    let rebuilt = differing
        .iter()
        .try_fold(RuleSet::PAPER, |rules, name| rules.with(&format!("{name}=compat")))?;
    assert_eq!(RuleSet { name: RuleSetName::Compat, ..rebuilt }, RuleSet::COMPAT);
    for name in &differing {
        let (paper, compat) = rule_values(name)?;
        assert_ne!(paper, compat, "{name}");
        assert_ne!(RuleSet::COMPAT.with(&format!("{name}={paper}"))?, RuleSet::COMPAT);
    }
    assert!(differing.iter().any(|n| n == "world.durations.refused_pick_up"));
    assert!(!differing.iter().any(|n| n == "world.stride_m"));
    assert!(rule_values("world.durations").is_err() && rule_values("world.gravity").is_err());
    Ok(())
}

#[test]
fn each_set_can_be_built_from_the_other_rule_by_rule() -> Result<()> {
    let rebuilt = rule_names()
        .iter()
        .try_fold(RuleSet::PAPER, |rules, name| rules.with(&format!("{name}=compat")))?;
    assert_eq!(RuleSet { name: RuleSetName::Compat, ..rebuilt }, RuleSet::COMPAT);
    Ok(())
}

/// Returns the rules in the tables of a page with the values of their rows: one for both sets, or the
/// paper's and the original's.
fn listed(page: &str) -> Vec<(&str, Vec<&str>)> {
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| {
        let (name, columns) = row.split_once("` | ")?;
        let values: Vec<&str> = columns.trim_end_matches(" |").split(" | ").collect();
        let is_rule = name.starts_with("world.") || name.starts_with("planner.");
        is_rule.then(|| (name, values[..values.len() - 1].to_vec()))
    })
    .collect()
}

/// Returns whether a table value equals a rule's value, with 2 equal to 2.0.
fn equals(row: &str, value: &str) -> bool {
    let number = |text: &str| text.parse::<f32>().ok();
    row == value || number(row).is_some_and(|n| number(value) == Some(n))
}

#[test]
fn the_rules_page_lists_every_rule_with_its_values() -> Result<()> {
    let page = std::fs::read_to_string(PAGE).expect("docs/rules.md exists");
    let rows = listed(&page);
    for (name, values) in &rows {
        let (paper, compat) = rule_values(name)?;
        let expected = if paper == compat { vec![paper] } else { vec![paper, compat] };
        // A rule that is off in both sets may still list two values.
        let is_right = values.iter().enumerate().all(|(i, v)| {
            equals(v, expected.get(i).or(expected.last()).map_or("", String::as_str))
        });
        assert!(is_right && values.len() >= expected.len(), "{name}: {values:?}, not {expected:?}");
    }
    for name in rule_names() {
        let n_rows = rows.iter().filter(|(listed, _)| *listed == name).count();
        assert_eq!(n_rows, 1, "rows of `{name}` in docs/rules.md");
    }
    Ok(())
}

#[test]
fn old_listings_without_rule_groups_are_read_with_default_values() {
    for rules in [RuleSet::PAPER, RuleSet::COMPAT] {
        let mut listing = rules.to_value();
        let planner = listing["planner"].as_object_mut().expect("a struct");
        for group in ["time", "plan_timeouts", "failures", "lifting", "people", "child"] {
            assert!(planner.remove(group).is_some(), "{group}");
        }
        assert_eq!(serde_json::from_value::<RuleSet>(listing).expect("readable"), rules);
        // A rule of the first version is required.
        let mut listing = rules.to_value();
        listing["planner"].as_object_mut().expect("a struct").remove("walking");
        assert!(serde_json::from_value::<RuleSet>(listing).is_err());
    }
}
