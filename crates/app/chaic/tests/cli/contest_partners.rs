//! Promises on contests with several partners: a submission plays the ordinary partner and those of a list. Its score
//! has their results, verification covers all of them, and tables never mix lists of partners.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::*;

/// Partners of all kinds: another body, drawn habits, and a network.
const LIST: &str = r#"{
  "format": "chaic-partners",
  "version": 1,
  "partners": [
    { "name": "hasty", "person": "+speed150" },
    { "name": "drawn", "partner": "drawn:7", "person": "+tires" },
    { "name": "learned", "partner": "cloned" }
  ]
}"#;

/// Returns a folder with a submission of `random` in `mine/`, one short episode in `short/` and the list in
/// `list.json`.
fn contest() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let generate = ["episodes", "generate", "--task", "no_constraint", "--seeds", "0..1"];
    run_ok(at, &[&generate[..], &["--out", "short"]].concat());
    shorten(&at.join("short"));
    fs::create_dir(at.join("mine")).expect("the disk has space");
    let manifest = format!(
        "version = 1\nname = \"random\"\nrelease = \"1.0\"\nauthors = [\"A. Author\"]\nlicense = \"MIT\"\n\
         description = \"Random valid plans.\"\nchaic = \"{}\"\n[helper]\nbuilt_in = \"random\"\n\
         [play]\ngrants = [\"ids\", \"goal_place\"]\n[training]\nhardware = \"none\"\ncore_hours = 0\n\
         [public]\nsplit = \"standard\"\n",
        env!("CARGO_PKG_VERSION")
    );
    fs::write(at.join("mine/submission.toml"), manifest).expect("the disk has space");
    fs::write(at.join("list.json"), LIST).expect("the disk has space");
    dir
}

const PLAY: [&str; 5] = ["submit", "run", "mine", "--episodes", "short"];

/// Plays the submission with more options, and writes its score.
fn play(at: &Path, out: &str, more: &[&str]) -> String {
    let played = run_ok(at, &[&PLAY[..], more, &["--out", out]].concat());
    run_ok(at, &["submit", "score", out]);
    played
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn read_json(path: &Path) -> Value {
    serde_json::from_str(&read(path)).expect("JSON")
}

#[test]
fn a_submission_plays_the_committed_partners() {
    let dir = contest();
    let at = dir.path();
    fs::write(at.join("secret"), "7".repeat(64)).expect("the disk has space");
    let seal = ["episodes", "seal", "--secret", "secret", "--task", "no_constraint"];
    let size = ["--n-episodes", "1", "--n-partners", "2", "--out", "sealed"];
    run_ok(at, &[&seal[..], &size].concat());
    let partners = ["--partners", "sealed/partners.json"];
    let played = play(at, "results/mine", &partners);
    let extent = "6 episode runs with the ordinary partner and the list of 2 partners";
    for words in ["Robustness: gain of TR", extent] {
        assert!(played.contains(words), "{words}: {played}");
    }
    let run = at.join("results/mine/run");
    assert_eq!(read(&run.join("partners.json")), read(&at.join("sealed/partners.json")));

    // The same command continues, also without the list; another list is refused.
    let journal = read(&run.join("sealed-001/results.jsonl"));
    play(at, "results/mine", &[]);
    play(at, "results/mine", &partners);
    assert_eq!(read(&run.join("sealed-001/results.jsonl")), journal);
    let other = [&PLAY[..], &["--partners", "list.json", "--out", "results/mine"]].concat();
    assert!(run_err(at, &other).contains("was started with other partners"));

    let scored = run_ok(at, &["submit", "score", "results/mine", "--out", "again.json"]);
    assert!(scored.contains("With the list of 2 partners: "), "{scored}");
    let score_path = at.join("results/mine/score.json");
    assert_eq!(read(&score_path), read(&at.join("again.json")));
    let score = read_json(&score_path);
    let mut commitment = read_json(&at.join("sealed/commitment.json"));
    assert_eq!(score["conditions"]["partners"], commitment["partners"]);
    assert_eq!(score["conditions"]["partners"]["n"], 2);
    let robustness = read_json(&run.join("robustness.json"));
    assert_eq!(score["partners"]["robustness"], robustness["helpers"]);
    assert_eq!(score["partners"]["robustness"][0]["helper"], "random");
    let list = score["partners"]["list"].as_array().expect("a list");
    let listed = read_json(&run.join("partners.json"));
    for (k, partner) in list.iter().enumerate() {
        for field in ["name", "partner", "person"] {
            assert_eq!(partner[field], listed["partners"][k][field], "{field}");
        }
        assert!(partner["tr"]["random"]["mean"].is_number(), "{partner}");
        assert_eq!(partner["episode_runs"].as_array().map(Vec::len), Some(2), "{partner}");
    }
    assert_eq!(score["partners"]["tasks"]["no_constraint"]["random"]["episodes"], 2);
    let confirmed = run_ok(at, &["submit", "verify", "results/mine"]);
    assert!(confirmed.contains("confirmed by 6 traces"), "{confirmed}");

    // A commitment to the short episode and other partners, or none.
    commitment["episodes_sha256"] = score["conditions"]["episodes_sha256"].clone();
    let verify = |commitment: &Value, has_passed: bool| {
        fs::write(at.join("c.json"), commitment.to_string()).expect("the disk has space");
        let verify = ["submit", "verify", "results/mine", "--commitment", "c.json"];
        if has_passed { run_ok(at, &verify) } else { run_err(at, &verify) }
    };
    assert!(verify(&commitment, true).contains("confirmed by 6 traces"));
    let mut other = commitment.clone();
    other["partners"]["sha256"] = "0".repeat(64).into();
    let differs = verify(&other, false);
    assert!(differs.contains("but the commitment has 2 partners (SHA-256 0000"), "{differs}");
    commitment.as_object_mut().expect("an object").remove("partners");
    let differs = verify(&commitment, false);
    assert!(differs.contains("but the commitment has none"), "{differs}");
    for text in [&differs, &verify(&other, false)] {
        assert_eq!(text.matches("DIFFERS").count(), 1, "{text}");
    }
}

#[test]
fn tables_never_mix_lists_of_partners() {
    let dir = contest();
    let at = dir.path();
    play(at, "results/list", &["--partners", "list.json"]);
    play(at, "results/plain", &[]);
    let plain = read(&at.join("results/plain/score.json"));
    assert!(!plain.contains("partners") && !plain.contains("robustness"), "{plain}");
    // Drawn, learned and changed partners are re-simulated.
    let confirmed = run_ok(at, &["submit", "verify", "results/list"]);
    assert!(confirmed.contains("confirmed by 8 traces"), "{confirmed}");
    let build = ["leaderboard", "build", "results", "--out", "page.html"];
    let built = run_ok(at, &build);
    assert!(built.contains("page.html: 2 submissions in 2 tables"), "{built}");
    let page = read(&at.join("page.html"));
    for words in ["list of 3", "Worst tenth", "Share kept:"] {
        assert!(page.contains(words), "{words}");
    }
    let tables = read_json(&at.join("page.json"))["tables"].clone();
    let sizes: Vec<&Value> = tables
        .as_array()
        .expect("tables")
        .iter()
        .map(|t| &t["conditions"]["partners"]["n"])
        .collect();
    assert_eq!(sizes, [&Value::Null, &Value::from(3)]);

    // A split without committed partners has no place for the list.
    let score = read_json(&at.join("results/plain/score.json"));
    let seal = ["episodes", "seal", "--secret", "secret", "--task", "no_constraint"];
    run_ok(at, &[&seal[..], &["--n-episodes", "1", "--out", "sealed"]].concat());
    let mut commitment = read_json(&at.join("sealed/commitment.json"));
    commitment["episodes_sha256"] = score["conditions"]["episodes_sha256"].clone();
    fs::write(at.join("c.json"), commitment.to_string()).expect("the disk has space");
    let built = run_err(at, &[&build[..], &["--commitment", "c.json"]].concat());
    assert!(built.contains("REFUSED list: the run was played with 3 partners"), "{built}");
    assert!(built.contains("page.html: 1 submission in 1 table"), "{built}");

    // An altered trace with one partner, an altered report and other episodes are found.
    let run = at.join("results/list/run");
    let trace = run.join("hasty/traces/no_constraint/random/gen-0--speed150-s0.jsonl");
    for (path, from, to, words) in [
        (&trace, "\"turn_left\"", "\"turn_right\"", "results/list/run/hasty/traces/"),
        (&run.join("robustness.json"), "\"mean\": ", "\"mean\": 1", "differs from the results"),
    ] {
        let whole = read(path);
        assert!(whole.contains(from), "{whole}");
        fs::write(path, whole.replacen(from, to, 1)).expect("the disk has space");
        let found = run_err(at, &["submit", "verify", "results/list"]);
        assert!(found.contains("DIFFERS ") && found.contains(words), "{found}");
        fs::write(path, whole).expect("the disk has space");
    }
    run_ok(at, &["submit", "verify", "results/list"]);
    let episode = run.join("learned/episodes/no_constraint-gen-0.json");
    let whole = read(&episode);
    fs::write(&episode, whole.replacen("\"horizon\": 80", "\"horizon\": 81", 1)).expect("space");
    let found = run_err(at, &["submit", "verify", "results/list"]);
    assert!(found.contains("is not that of the run with the ordinary partner"), "{found}");
}

#[test]
fn a_partner_from_a_file_needs_the_list_again() {
    let dir = contest();
    let at = dir.path();
    let weights = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../learn/chaic-learn/weights/partner.safetensors");
    fs::copy(weights, at.join("p.safetensors")).expect("the disk has space");
    let list = LIST.replace("cloned", "policy:p.safetensors");
    fs::write(at.join("list.json"), list).expect("the disk has space");
    let with_list = ["--partners", "list.json"];
    play(at, "results/mine", &with_list);
    let results = at.join("results/mine/run/learned/results.jsonl");
    let journal = read(&results);
    let refused = run_err(at, &[&PLAY[..], &["--out", "results/mine"]].concat());
    let words = "the partner `learned` of results/mine/run comes from a file; give the list again";
    assert!(refused.contains(words) && refused.lines().count() == 1, "{refused}");
    play(at, "results/mine", &with_list);
    assert_eq!(read(&results), journal);
    // Readers need no weights.
    fs::remove_file(at.join("p.safetensors")).expect("it exists");
    let confirmed = run_ok(at, &["submit", "verify", "results/mine"]);
    assert!(confirmed.contains("confirmed by 8 traces"), "{confirmed}");
}

#[test]
fn wrong_lists_of_a_contest_are_refused_as_by_eval() {
    let dir = contest();
    let at = dir.path();
    let play = |list: &str| {
        let refused = run_err(at, &[&PLAY[..], &["--partners", list, "--out", "r"]].concat());
        assert!(!at.join("r/run").exists(), "{refused}");
        let is_error = |line: &&str| line.starts_with("error");
        assert_eq!(refused.lines().filter(is_error).count(), 1, "{refused}");
        refused
    };
    assert!(play("missing.json").contains("no such file; give `suite` or a list of partners"));
    for (from, to, words) in [
        ("\"hasty\"", "\"drawn\"", "two partners have the name `drawn`"),
        ("\"drawn:7\"", "\"habits:pause=999\"", "from 0 to 600"),
        ("\"drawn:7\"", "\"recorded:missing\"", "missing"),
        ("\"cloned\"", "\"ogre\"", "unknown partner `ogre`"),
        ("\"cloned\"", "\"llm\"", "the partner `learned` asks a language model"),
        ("+tires", "rider", "0 bicycles"),
    ] {
        assert!(LIST.contains(from), "{from}");
        fs::write(at.join("wrong.json"), LIST.replace(from, to)).expect("the disk has space");
        let refused = play("wrong.json");
        assert!(refused.contains(words), "{words}: {refused}");
    }
    // A run with the ordinary partner does not continue with a list.
    run_ok(at, &[&PLAY[..], &["--out", "r"]].concat());
    let with_list = [&PLAY[..], &["--partners", "list.json", "--out", "r"]].concat();
    let refused = run_err(at, &with_list);
    assert!(refused.contains("r/run is a run with one partner; omit --partners"), "{refused}");
}
