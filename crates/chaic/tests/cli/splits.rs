//! Splits that are made on the fly are listed, written and checked like the bundled ones.

use std::fs;

use crate::*;

#[test]
fn standard_episodes_are_listed_written_and_checked() {
    let dir = tempfile::tempdir().expect("there is room");
    let at = dir.path();
    let list = ["episodes", "list", "--split", "standard", "--task", "moving_house"];
    let list = well(at, &[&list[..], &["--format", "json"]].concat());
    let list: Vec<serde_json::Value> = serde_json::from_str(&list).expect("it is JSON");
    assert_eq!(list.len(), 100);
    assert_eq!(list[99]["id"], "moving_house/standard/099");
    assert_eq!(list[99]["generator"]["settings"]["varied_layout"], true);

    let split = ["--split", "gen-standard:7..9"];
    let generate = ["episodes", "generate", "--task", "obstacle", "--out", "e"];
    well(at, &[&generate[..], &split].concat());
    let (one, two) = ("e/obstacle-gen-standard-7.json", "e/obstacle-gen-standard-8.json");
    let written = fs::read(at.join(one)).expect("it has been written");
    let written: serde_json::Value = serde_json::from_slice(&written).expect("it is JSON");
    assert_eq!(written["generator"]["settings"]["decoys"], true);
    let checked = well(at, &["episodes", "validate", one, two]);
    assert_eq!(checked.matches("fine").count(), 2, "{checked}");
    let checked = well(at, &["episodes", "validate", "--split", "gen-standard:7..8"]);
    assert_eq!(checked, "gen-standard:7..8: 8 episodes fine\n");
}
