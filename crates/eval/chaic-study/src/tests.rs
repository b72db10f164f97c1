//! Promises: a definition is strict, assignment is balanced with drop-outs, and data are checked before they
//! are exported and gone after a deletion.

mod collected;

use std::fs;
use std::path::{Path, PathBuf};

use super::*;

/// A small definition with three helpers.
const SMALL: &str = r#"title = "Shelves"
consent = "consent.txt"
instructions = "instructions.txt"
debrief = "debrief.txt"
completion_code = "SHELVES-7"
participants = 48
timeout_minutes = 60
design = "latin_square"
practice = ["no_constraint/train/00"]
episodes = ["high_target/test/00", "high_target/test/01", "high_target/test/02"]

[factors]
helper = ["none", "rhp", "infer"]

[forms]
after_condition = ["trust"]
at_end = ["sus"]
"#;

fn folder_with(definition: &str) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("the disk has space");
    for name in ["consent", "instructions", "debrief"] {
        let text = format!("# The {name}\n\nPlain words.\n");
        fs::write(dir.path().join(format!("{name}.txt")), text).expect("the disk has space");
    }
    let path = dir.path().join("study.toml");
    fs::write(&path, definition).expect("the disk has space");
    (dir, path)
}

fn plan_of(path: &Path) -> Result<StudyPlan> {
    StudyPlan::new(Study::read(path)?, path)
}

fn plan(definition: &str) -> StudyPlan {
    let (_dir, path) = folder_with(definition);
    plan_of(&path).expect("a valid study")
}

#[test]
fn errors_name_the_key_and_the_expectation() {
    for (old, new, words) in [
        ("title = \"Shelves\"", "title = 3", "line 1: invalid type"),
        ("title = \"Shelves\"", "headline = \"Shelves\"", "unknown field `headline`"),
        ("title = \"Shelves\"", "title = \"\"", "`title` must be one line"),
        ("\"SHELVES-7\"", "\"A B\"", "`completion_code` must have"),
        ("participants = 48", "participants = 0", "`participants` must be from 1 to 10000, not 0"),
        ("participants = 48", "participants = 10001", "from 1 to 10000"),
        (
            "participants = 48",
            "participants = 4294967296",
            "line 6: invalid value: integer `4294967296`, expected an integer from 0 to 4294967295",
        ),
        (
            "participants = 48",
            "participants = 99999999999999999999",
            "line 6: 99999999999999999999 exceeds 64 bits",
        ),
        ("timeout_minutes = 60", "timeout_minutes = 99999", "`timeout_minutes` must be from 1"),
        ("timeout_minutes = 60\n", "", "missing field `timeout_minutes`"),
        ("latin_square", "latin", "unknown variant `latin`"),
        ("\"consent.txt\"", "\"absent.txt\"", "absent.txt"),
        ("[factors]", "trials = 11\n[factors]", "`trials` must be from 1 to 10"),
        ("[factors]", "trials = 2\n[factors]", "a participant plays 6 of them"),
        ("high_target/test/02", "high_target/test/01", "must not repeat `high_target/test/01`"),
        ("no_constraint/train/00", "high_target/test/00", "must not repeat `high_target/test/00`"),
        ("high_target/test/02", "high_target/test/1", "the house of `high_target/test/1` twice"),
        (
            "high_target/test/02",
            "high_target/test/01/+tremor",
            "the house of `high_target/test/01/",
        ),
        (
            "high_target/test/02",
            "high_target/test/99",
            "study.toml: no episode `high_target/test/99`",
        ),
        ("\"infer\"]", "\"deep\"]", "`helper` names `deep`; expected one of none, random"),
        (
            "\"infer\"]\n",
            "\"human\"]\n[play]\nsimulator = \"server\"\n",
            "`helper` names `human`; expected one of none",
        ),
        ("\"rhp\", \"infer\"]", "\"none\"]", "`factors.helper` must have from 2 to 16 different"),
        ("\"none\", \"rhp\", \"infer\"]", "\"rhp\"]", "`factors.helper` must have from 2"),
        ("[forms]", "seat = [\"partner\", \"helper\"]\n[forms]", "`factors.helper` needs"),
        ("[forms]", "[play]\nspeed = 3\n[forms]", "`play.speed` must be 1, 2, 4 or 8, not 3"),
        ("[forms]", "[play]\nsimulator = \"cloud\"\n[forms]", "unknown variant `cloud`"),
        ("\"trust\"", "\"trusts\"", "no form `trusts`; expected one of nasa_tlx, sus"),
        ("\"trust\"", "\"trust\", \"trust\"", "must not repeat `trust`"),
    ] {
        let changed = SMALL.replace(old, new);
        assert_ne!(changed, SMALL, "{old}");
        let (_dir, path) = folder_with(&changed);
        let error = plan_of(&path).expect_err(new);
        let message = error.to_string();
        assert!(message.contains(words), "{new}: {message}");
        assert!(!message.contains('\n'), "{message}");
        // A text that is missing is no invalid request.
        assert_eq!(error.is_usage(), !new.contains("absent.txt"), "{message}");
    }
    let (dir, path) = folder_with(SMALL);
    fs::write(dir.path().join("consent.txt"), "x".repeat(70_000)).expect("the disk has space");
    let message = plan_of(&path).expect_err("a long text").to_string();
    assert!(message.contains("is longer than 65536 bytes"), "{message}");
}

#[test]
fn equal_digests_give_equal_trials_and_every_change_another_digest() {
    let (first, again) = (plan(SMALL), plan(SMALL));
    assert_eq!(first.digest(), again.digest());
    for slot in 1..=48 {
        assert_eq!(first.trials(slot), again.trials(slot));
    }
    for (old, new) in [("Shelves", "Boxes"), ("48", "49"), ("test/02", "test/03"), ("sus", "trust")]
    {
        assert_ne!(plan(&SMALL.replace(old, new)).digest(), first.digest(), "{new}");
    }
    let (dir, path) = folder_with(SMALL);
    fs::write(dir.path().join("consent.txt"), "Other words.").expect("the disk has space");
    assert_ne!(plan_of(&path).expect("a valid study").digest(), first.digest());
}

#[test]
fn conditions_meet_every_episode_and_no_participant_meets_one_twice() {
    let plan = plan(SMALL);
    assert_eq!(plan.conditions().len(), 3);
    let mut met = vec![vec![0; plan.episodes().len()]; 3];
    for slot in 1..=18 {
        let trials = plan.trials(slot);
        assert_eq!(trials.len(), 4);
        assert_eq!((trials[0].position, plan.helper(trials[0])), (0, "none"));
        assert_eq!(trials[0].condition, trials[1].condition, "practice is like what follows");
        let mut episodes: Vec<usize> = trials.iter().map(|trial| trial.episode).collect();
        episodes.sort_unstable();
        episodes.dedup();
        assert_eq!(episodes.len(), 4, "slot {slot}");
        for trial in &trials[1..] {
            met[trial.condition][trial.episode] += 1;
        }
    }
    // 18 slots are three blocks of six orders.
    assert!(met.iter().all(|row| row[1..] == [6, 6, 6] && row[0] == 0), "{met:?}");
}

#[test]
fn tasks_and_persons_select_episodes() {
    let definition = SMALL
        .replace("\"high_target/test/02\"", "\"low_target/test/00\", \"low_target/test/01\"")
        .replace(
            "helper = [\"none\", \"rhp\", \"infer\"]",
            "task = [\"high_target\", \"low_target\"]\nperson = [\"wheelchair\", \"child\"]",
        );
    let plan = plan(&definition);
    assert_eq!(plan.conditions().len(), 4);
    for trial in &plan.trials(3)[1..] {
        let condition = &plan.conditions()[trial.condition];
        let episode = plan.episodes()[trial.episode].id();
        let [task, person] = [0, 1].map(|k| condition.levels[k].1.as_str());
        assert!(episode.starts_with(task) && episode.ends_with(person), "{episode}: {condition:?}");
    }
}

/// The counts of complete blocks are equal, so only blocks with open slots differ. The maximum is one
/// for an even number of conditions, and two for an odd number.
#[test]
fn a_thousand_participants_with_drop_outs_stay_balanced() {
    let four = SMALL
        .replace("\"infer\"]", "\"infer\", \"oracle\"]")
        .replace("\"high_target/test/02\"]", "\"high_target/test/02\", \"low_target/test/00\"]");
    let between = SMALL.replace("latin_square", "block_random");
    for (definition, share, n_cells) in [(four.as_str(), 1, 16), (SMALL, 2, 9), (&between, 1, 3)] {
        let plan = plan(definition);
        let balance = simulate(&plan, 1000, 0.2);
        assert_eq!(balance.arrived, 1000);
        assert!((750..850).contains(&balance.completed), "{balance:?}");
        let cells: Vec<u32> = balance.counts.iter().flatten().copied().collect();
        assert_eq!(cells.len(), n_cells);
        assert!(balance.spread() <= share * balance.open_blocks, "{balance:?}");
        assert!(balance.spread() <= 6, "{balance:?}");
        assert_eq!(balance, simulate(&plan, 1000, 0.2), "a simulation repeats");
    }
}

#[test]
fn without_drop_outs_complete_blocks_are_equal() {
    let balance = simulate(&plan(SMALL), 600, 0.0);
    assert_eq!((balance.completed, balance.late, balance.spread()), (600, 0, 0));
}

#[test]
fn the_page_has_all_trials_and_no_more_than_it_needs() {
    let plan = plan(SMALL);
    let content = page_content(&plan);
    assert_eq!(content["slots"].as_array().map(Vec::len), Some(48));
    assert_eq!(content["slots"][0].as_array().map(Vec::len), Some(4));
    assert_eq!(content["slots"][0][0][3], "none", "practice has no helper");
    assert_eq!(content["episodes"].as_array().map(Vec::len), Some(4));
    assert_eq!(content["digest"], plan.digest());
    let forms = content["forms"].as_object().expect("an object");
    assert_eq!(forms.keys().collect::<Vec<_>>(), ["sus", "trust"]);
}

/// With the simulator on the server, the page does not depend on the episodes, factor levels or digest. The page
/// with the simulator is the positive control.
#[test]
fn the_page_of_a_server_with_the_simulator_has_nothing_from_which_a_goal_follows() {
    let server = SMALL.replace("[factors]", "[play]\nsimulator = \"server\"\n[factors]");
    let other = |definition: &str| definition.replace("high_target", "low_target");
    assert_eq!(page_content(&plan(&server)), page_content(&plan(&other(&server))));
    assert_ne!(page_content(&plan(SMALL)), page_content(&plan(&other(SMALL))));
    let text = page_content(&plan(&server)).to_string();
    for hidden in ["target", "goal", "setup", "rhp", plan(&server).digest()] {
        assert!(!text.contains(hidden), "{hidden}");
    }
    for hidden in ["high_target/test/00", "goal", "setup", "rhp", plan(SMALL).digest()] {
        assert!(page_content(&plan(SMALL)).to_string().contains(hidden), "{hidden}");
    }
}

#[test]
fn the_default_simulator_does_not_change_the_digest() {
    let page = SMALL.replace("[factors]", "[play]\nsimulator = \"page\"\n[factors]");
    assert_eq!(plan(&page).digest(), plan(SMALL).digest());
    let server = SMALL.replace("[factors]", "[play]\nsimulator = \"server\"\n[factors]");
    assert_ne!(plan(&server).digest(), plan(SMALL).digest());
}
