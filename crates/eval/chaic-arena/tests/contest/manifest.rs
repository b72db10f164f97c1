//! Promise: a manifest has defaults, and each problem is named with its place.

use std::path::Path;

use chaic_arena::{
    ArenaError, HelperSource, MANIFEST, MAX_MANIFEST_BYTES, Manifest, PublicPart, Result,
};
use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::Track;
use chaic_episodes::Split;

const GOOD: &str = r#"version = 1
name = "mine"
release = "1.0"
authors = ["A. Author", "B. Author"]
license = "MIT OR Apache-2.0"
description = "Carries the nearest target."
chaic = "0.1.0"

[helper]
command = ["python3", "helper.py"]

[play]
grants = ["ids", "goal_place"]

[training]
hardware = "2 cores of an EPYC"
core_hours = 0

[public]
split = "standard"
tasks = ["obstacle"]
n_episodes = 2
"#;

fn parse(text: &str) -> Result<Manifest> {
    Manifest::parse(text.as_bytes(), Path::new(MANIFEST))
}

#[test]
fn a_manifest_has_values_and_defaults() {
    let manifest = parse(GOOD).expect("it is valid");
    assert_eq!(manifest.play.grants, Grants::PLANNER);
    assert_eq!(
        (manifest.play.track, manifest.play.perception.as_str()),
        (Track::Unrestricted, "gt")
    );
    assert_eq!(manifest.public.tasks, Some(vec![TaskId::Obstacle]));
    let words = ["python3", "helper.py"].map(str::to_owned).to_vec();
    assert_eq!(manifest.helper, HelperSource::Command(words));

    let policy =
        GOOD.replace(r#"command = ["python3", "helper.py"]"#, r#"policy = "w/a.safetensors""#);
    let policy = parse(&policy).expect("it is valid").helper;
    assert_eq!(policy, HelperSource::Policy("w/a.safetensors".to_owned()));
    let whole = GOOD.replace("tasks = [\"obstacle\"]\nn_episodes = 2\n", "");
    let public = parse(&whole).expect("it is valid").public;
    assert_eq!(public, PublicPart { split: Split::Standard, tasks: None, n_episodes: None });
}

#[test]
fn each_problem_is_named_with_its_place() {
    for (from, to, words) in [
        ("version = 1", "version = 2", "`version` is 2, expected 1"),
        ("version = 1", "version = 1\nextra = 1", "unknown field `extra`"),
        ("\"mine\"", "\"../mine\"", "`name`: `../mine` is not a valid name"),
        ("\"mine\"", "\"none\"", "`name`: there is a helper `none` already"),
        ("\"mine\"", "\"a\\nb\"", "`name` has a line break"),
        ("\"1.0\"", "1.0", "`release`: invalid type: floating point `1.0`"),
        ("\"1.0\"", "\"=1+1\"", "`release` has other characters"),
        ("[\"A. Author\", \"B. Author\"]", "[]", "`authors` has 0 entries"),
        ("\"A. Author\"", "\"A\\nB\"", "`authors` has a line break"),
        ("MIT OR Apache-2.0", "MIT OR MINE", "`license` is no SPDX expression"),
        ("MIT OR Apache-2.0", "", "`license` has 0 bytes"),
        ("0.1.0", "0.0.9", "`chaic` is 0.0.9, but this is chaic 0.1.0"),
        ("0.1.0", "0.1\\n2", "`chaic` has a line break"),
        ("[helper]", "[helper]\npolicy = \"w\"", "`helper`: give exactly one of"),
        ("command = ", "run = ", "unknown field `run`"),
        ("[\"python3\", \"helper.py\"]", "\"python3 helper.py\"", "`helper.command`: invalid type"),
        ("[\"python3\", \"helper.py\"]", "[]", "`helper.command` has 0 words"),
        ("\"ids\"", "\"gold\"", "`play.grants`: no grant `gold`"),
        ("\"ids\"", "\"a\\r\\u001b[2J\"", "`play.grants`: no grant `a  [2J`"),
        ("\"ids\"", "\"goal_place\"", "`goal_place` is listed twice"),
        ("[play]", "[play]\ntrack = \"open\"", "`play.track`: unknown variant `open`"),
        ("[play]", "[play]\ntrack = \"hidden\"", "`play`: helper `mine` is granted ids"),
        ("[play]", "[play]\nperception = \"learned:/x\"", "`play.perception` is `learned:/x`"),
        ("core_hours = 0", "core_hours = -1", "`training.core_hours` is -1"),
        ("core_hours = 0", "core_hours = nan", "`training.core_hours` is NaN"),
        ("core_hours = 0", "", "missing field `core_hours`"),
        ("\"standard\"", "\"mine\"", "`public.split`: "),
        ("\"obstacle\"", "\"lunch\"", "`public.tasks[0]`: unknown variant `lunch`"),
        ("\"obstacle\"", "", "`public.tasks` must name at least one task"),
        ("n_episodes = 2", "n_episodes = 0", "`public.n_episodes` is 0"),
        ("n_episodes = 2", "n_episodes = -1", "expected an integer from 0 to 4294967295"),
        ("[public]", "[public", "line 19"),
    ] {
        assert!(GOOD.contains(from), "{from}");
        let error = parse(&GOOD.replacen(from, to, 1)).expect_err(to).to_string();
        assert!(error.starts_with("submission.toml: ") && error.contains(words), "{to}: {error}");
        assert!(!error.contains(char::is_control), "{error}");
    }
    let long = GOOD.replacen("ids", &"x".repeat(5000), 1);
    let error = parse(&long).expect_err("no such grant").to_string();
    assert!(error.contains("`play.grants`: no grant `xxx") && error.len() < 600, "{error}");
    for policy in ["/w", "../w", "a/../../w", "", "a\\\\b"] {
        let to = format!("policy = \"{policy}\"");
        let error = parse(&GOOD.replace(r#"command = ["python3", "helper.py"]"#, &to));
        let error = error.expect_err(policy).to_string();
        assert!(error.contains("`helper.policy`: "), "{policy}: {error}");
    }
    let path = Path::new(MANIFEST);
    let long = vec![b'#'; MAX_MANIFEST_BYTES as usize + 1];
    for bytes in [&long[..], &[0xff, 0xfe][..]] {
        assert!(matches!(Manifest::parse(bytes, path), Err(ArenaError::Manifest { .. })));
    }
}
