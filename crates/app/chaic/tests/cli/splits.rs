//! Promise: generated splits are listed, written and checked like the bundled ones.

use std::fs;

use crate::*;

#[test]
fn standard_episodes_are_listed_written_and_checked() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let list = ["episodes", "list", "--split", "standard", "--task", "moving_house"];
    let list = run_ok(at, &[&list[..], &["--format", "json"]].concat());
    let list: Vec<serde_json::Value> = serde_json::from_str(&list).expect("it is JSON");
    assert_eq!(list.len(), 100);
    assert_eq!(list[99]["id"], "moving_house/standard/099");
    assert_eq!(list[99]["generator"]["settings"]["varied_layout"], true);
    let out = output_of(at, &["episodes", "list", "--split", "train", "--task", "tremor"]);
    assert!(out.status.success() && out.stdout.is_empty(), "{}", text(&out.stdout));
    assert!(text(&out.stderr).contains("train has no episodes of tremor"), "{}", text(&out.stderr));

    let split = ["--split", "gen-standard:7..9"];
    let generate = ["episodes", "generate", "--task", "obstacle", "--out", "e"];
    run_ok(at, &[&generate[..], &split].concat());
    let (one, two) = ("e/obstacle-gen-standard-7.json", "e/obstacle-gen-standard-8.json");
    let written = fs::read(at.join(one)).expect("it has been written");
    let written: serde_json::Value = serde_json::from_slice(&written).expect("it is JSON");
    assert_eq!(written["generator"]["settings"]["decoys"], true);
    let checked = run_ok(at, &["episodes", "validate", one, two]);
    assert_eq!(checked.matches("fine").count(), 2, "{checked}");
    let checked = run_ok(at, &["episodes", "validate", "--split", "gen-standard:7..8"]);
    assert_eq!(checked, "gen-standard:7..8: 12 episodes fine\n");
}

#[test]
fn another_partner_plays_the_same_episodes() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let play =
        ["eval", "--task", "high_target", "--helper", "none", "--n-episodes", "1", "--size", "32"];
    let kind = ["--person", "child+one_handed+tires"];
    run_ok(at, &[&play[..], &kind, &["--out", "run"]].concat());
    assert!(run_ok(at, &["verify", "run"]).contains("all digests agree"));
    let id = "high_target/test/00/child+one_handed+tires";
    let results = fs::read_to_string(at.join("run/results.jsonl")).expect("a text file");
    assert!(results.contains(&format!("\"episode\":\"{id}\"")), "{results}");
    run_ok(at, &["render", id, "--out", "pictures"]);

    // The same holds for episode files. A resumed run needs the same partner.
    let generate = ["episodes", "generate", "--task", "tremor", "--seeds", "0..1", "--out", "e"];
    run_ok(at, &generate);
    let files = ["eval", "--episodes", "e", "--helper", "none", "--size", "32", "--out", "files"];
    run_ok(at, &[&files[..], &["--person", "wheelchair"]].concat());
    let again = ["eval", "--resume", "--out", "files", "--person"];
    run_ok(at, &[&again[..], &["wheelchair", "--episodes", "e"]].concat());
    let refused = run_err(at, &[&again[..], &["frail"]].concat());
    assert!(refused.contains("--person"), "{refused}");

    for (kind, words) in [("ogre", "unknown kind of person"), ("rider", "0 bicycles")] {
        let refused = run_err(at, &[&play[..], &["--person", kind, "--out", "none"]].concat());
        assert!(refused.contains(words) && !at.join("none").exists(), "{refused}");
    }
    let refused = run_err(at, &["eval", "--task", "tires", "--out", "none"]);
    assert!(refused.contains("give --split gen:"), "{refused}");
}

#[test]
fn a_sealed_split_is_played_and_opened_by_its_secret_alone() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let seal = ["episodes", "seal", "--secret", "secret", "--task", "obstacle,shopping"];
    let size = ["--n-episodes", "1", "--n-partners", "2"];
    run_ok(at, &[&seal[..], &size, &["--out", "sealed"]].concat());
    let play = ["eval", "--helper", "none", "--size", "32", "--out", "run"];
    run_ok(at, &[&play[..], &["--episodes", "sealed/episodes"]].concat());
    assert!(run_ok(at, &["verify", "run"]).contains("all digests agree"));

    // The commitment has neither the secret nor a seed.
    let commitment = fs::read_to_string(at.join("sealed/commitment.json")).expect("a text file");
    let secret = fs::read_to_string(at.join("secret")).expect("a text file");
    let episode = fs::read(at.join("sealed/episodes/obstacle-000.json")).expect("an episode");
    let json: serde_json::Value = serde_json::from_slice(&episode).expect("it is JSON");
    assert!(!commitment.contains(secret.trim()));
    assert!(!commitment.contains(&json["generator"]["seed"].to_string()));
    assert!(!commitment.contains("habits"), "{commitment}");

    let open = ["episodes", "open", "--commitment", "sealed/commitment.json", "--out", "opened"];
    run_ok(at, &[&open[..], &["--secret", "secret", "--partners", "partners.json"]].concat());
    assert!(fs::read(at.join("opened/obstacle-000.json")).expect("an episode") == episode);
    let partners = ["sealed/partners.json", "partners.json"].map(|file| fs::read(at.join(file)));
    let [sealed, opened] = partners.map(|bytes| bytes.expect("a list of partners"));
    assert!(sealed == opened && sealed.starts_with(b"{"));

    // The opened split has a card and metadata.
    run_ok(at, &["export", "episodes", "--episodes", "opened", "--out", "set"]);
    let name = json["split"].as_str().expect("a name");
    let exported = format!("set/episodes/obstacle-{name}-000.json");
    assert!(fs::read(at.join(exported)).expect("an episode") == episode);
    let card = fs::read_to_string(at.join("set/README.md")).expect("a card");
    assert!(card.contains(&format!("# chaic episodes: {name}\n\nInitial states of 2")), "{card}");
    assert!(card.contains("--episodes DIR") && at.join("set/croissant.json").is_file(), "{card}");

    // The folder's partners.json is not in this commitment, but would be played with the split.
    let refused = run_err(at, &[&seal[..], &["--n-episodes", "1", "--out", "sealed"]].concat());
    assert!(refused.contains("partners.json belongs to another split"), "{refused}");

    fs::write(at.join("other"), "0".repeat(64)).expect("the disk has space");
    let refused = run_err(at, &[&open[..], &["--secret", "other"]].concat());
    assert!(refused.contains("the secret is not that of the commitment"), "{refused}");
    fs::write(at.join("short"), "0".repeat(63)).expect("the disk has space");
    let refused = run_err(at, &[&open[..], &["--secret", "short"]].concat());
    assert!(refused.contains("64 hexadecimal digits"), "{refused}");
    let forged = commitment.replace("\"episodes_sha256\": \"", "\"episodes_sha256\": \"0");
    fs::write(at.join("sealed/commitment.json"), forged).expect("the disk has space");
    fs::remove_dir_all(at.join("opened")).expect("it was written above");
    let refused = run_err(at, &[&open[..], &["--secret", "secret"]].concat());
    assert!(refused.contains("the episodes differ from those of the commitment"), "{refused}");
    assert!(!at.join("opened").exists(), "episodes were written before the check");
}
