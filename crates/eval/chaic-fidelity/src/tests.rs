//! The document's numbers equal those of a handmade example of two episodes.

use std::fs;

use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::BuiltInHelpers;
use chaic_env::rules::{RuleSetName, differing_rules};
use chaic_env::{Digest, RunKey};

use super::*;
use chaic_eval::EvalError;
use chaic_eval::metrics::{
    Environments, Formulas, PlayedEpisodes, RunResult, RunStatus, Scores, Summary,
};
use chaic_eval::run::RunGrants;

const LOW: TaskId = TaskId::LowTarget;

fn run(task: TaskId, helper: &str, episode: u32, seed: u32, done: f64) -> RunResult {
    let episode = format!("{task}/original-train/0{episode}");
    RunResult {
        key: RunKey { task, helper: helper.to_owned(), episode, seed },
        status: RunStatus::Done(Summary {
            frames: 3000,
            done,
            total: 10.0,
            away_frames: None,
            stuck_frames: None,
            escape_frames: None,
            deliveries: Vec::new(),
            digest: Digest(0),
            counts: Default::default(),
            diagnostics: Default::default(),
        }),
    }
}

/// Returns two episodes with two seeds each: episode 0 with both seeds, then episode 1.
fn runs(task: TaskId, helper: &str, done: [f64; 4]) -> Vec<RunResult> {
    let at = [(0, 0), (0, 1), (1, 0), (1, 1)];
    at.iter().zip(done).map(|((e, s), d)| run(task, helper, *e, *s, d)).collect()
}

/// Results in low target: w/o 0.4 (published 0.51), RHP 0.4 (0.66), oracle 0.8 (0.82).
fn low() -> Vec<RunResult> {
    let mut all = runs(LOW, "none", [4.0, 6.0, 2.0, 4.0]);
    all.extend(runs(LOW, "rhp", [5.0, 5.0, 3.0, 3.0]));
    all.extend(runs(LOW, "oracle", [9.0, 9.0, 7.0, 7.0]));
    all
}

fn assert_close(a: f64, b: f64) {
    // The fourth digit of a standard error depends on the random resamples.
    assert!((a - b).abs() < 1e-4, "{a} is not {b}");
}

#[test]
fn rates_and_chance_equal_the_handmade_example() {
    let environments = Environments::default();
    let rate = |results: &[RunResult], task, helper: &str| {
        task_rate(
            PlayedEpisodes { results, planned: &[], environments: &environments },
            task,
            helper,
        )
    };
    let none = rate(&low(), LOW, "none").unwrap();
    assert_close(none.tr, 0.4);
    // Means 0.5 and 0.3; each seed alone 0.4 and 0.2, or 0.6 and 0.4: the standard deviation is
    // always 0.02^0.5.
    assert_close(none.interval.unwrap().se, (0.02f64 / 2.0).sqrt());
    assert_close(none.se_once.unwrap(), (0.02f64 / 2.0).sqrt());
    assert_close(none.difference().unwrap(), -0.11);
    assert_close(none.chance_se().unwrap(), (0.02f64 / 2.0 + 0.02 / 12.0).sqrt());
    assert!(!none.is_beyond_chance());
    // Obstacle: always 1 of 10 (published 0.07), so chance explains nothing.
    let obstacle = runs(TaskId::Obstacle, "none", [1.0; 4]);
    let obstacle = rate(&obstacle, TaskId::Obstacle, "none").unwrap();
    assert!(obstacle.is_beyond_chance());
    let d = published_difference(&[none, obstacle]).unwrap();
    assert_close(d.mad, 0.07);
    assert_close(d.bias, -0.04);
    // Half of 0.108012 * 0.797885, and half of 0.108012 * (1 - 0.636620)^0.5.
    assert_close(d.by_chance, 0.043090);
    assert_close(d.chance_sd, 0.032556);
    assert_eq!((d.tasks, d.significant), (2, 1));
    assert!(rate(&low(), LOW, "random").is_none());
    let unpublished = runs(LOW, "follow", [1.0; 4]);
    assert_eq!(published_difference(&[rate(&unpublished, LOW, "follow").unwrap()]), None);
}

fn order_of(results: &[RunResult], helpers: &[String]) -> PairwiseOrder {
    let environments = Environments::default();
    pairwise_order(
        PlayedEpisodes { results, planned: &[], environments: &environments },
        LOW,
        helpers,
    )
}

#[test]
fn inversions_are_counted_by_pairs() {
    let helpers = ["none", "rhp", "oracle"].map(str::to_owned);
    let equal = order_of(&low(), &helpers);
    assert_eq!((equal.pairs, equal.inverted.len()), (3, 1));
    let inversion = &equal.inverted[0];
    assert_eq!((inversion.higher.as_str(), inversion.lower.as_str()), ("rhp", "none"));
    assert!(inversion.is_within_interval() && equal.is_within_intervals() && !equal.is_preserved());
    // RHP one object below w/o in every episode: beyond chance.
    let mut results = low();
    results.retain(|r| r.key.helper != "rhp");
    results.extend(runs(LOW, "rhp", [4.0, 4.0, 2.0, 2.0]));
    let worse = order_of(&results, &helpers);
    assert_close(worse.inverted[0].interval.unwrap().mean, -0.1);
    assert!(!worse.is_within_intervals());
    // The paper has w/o at 0.51 and Random at 0.50; Random above is an inversion.
    let mut results = low();
    results.extend(runs(LOW, "random", [9.5; 4]));
    let helpers = ["none", "random", "oracle"].map(str::to_owned);
    assert_eq!(order_of(&results, &helpers).inverted.len(), 2);
    assert!(order_of(&[], &helpers).is_preserved());
}

#[test]
fn a_switch_is_compared_on_common_episode_runs() {
    // One seed only: 4 and 2 become 6 and 4. The second seed of the base is ignored.
    let switched = [run(LOW, "none", 0, 0, 6.0), run(LOW, "none", 1, 0, 4.0)];
    let (low, environments) = (low(), Environments::default());
    let base = PlayedEpisodes { results: &low, planned: &[], environments: &environments };
    let change = switch_effect("world.blocking", base, &switched, "none");
    assert_close(change.tasks[&LOW].mean, 0.2);
    assert_close(change.all.unwrap().low, 0.2);
    let untouched = super::switch_effect("world.blocking", base, &low, "oracle");
    assert_eq!((untouched.tasks[&LOW].low, untouched.tasks[&LOW].high), (0.0, 0.0));
    assert!(super::switch_effect("world.blocking", base, &switched, "rhp").all.is_none());
}

fn plan() -> Experiment {
    Experiment {
        tasks: vec![LOW],
        helpers: ["none", "rhp", "oracle"].map(str::to_owned).to_vec(),
        n_episodes: None,
        seeds: 2,
        image_size: None,
        switches: vec!["world.blocking".to_owned()],
        switch_helpers: vec!["none".to_owned()],
        switch_seeds: 1,
    }
}

/// Returns all parts, complete.
fn states(plan: &Experiment) -> Vec<PartState> {
    let state = |part: ExperimentPart| {
        let results = match part.switch {
            None => low(),
            Some(_) => vec![run(LOW, "none", 0, 0, 6.0), run(LOW, "none", 1, 0, 4.0)],
        };
        let planned = results.iter().map(|r| r.key.clone()).collect();
        let helpers = [("rhp", Grants::IDS), ("oracle", Grants::ORACLE)];
        let helpers = helpers.map(|(name, grants)| (name.to_owned(), grants)).into();
        let granted = Some(RunGrants {
            helpers,
            partner: Grants::PARTNER,
            perception: Default::default(),
            isolation: Default::default(),
            weights: Default::default(),
            limits_s: Default::default(),
        });
        PartState { part, planned, results, environments: Environments::default(), granted }
    };
    plan.parts().into_iter().map(state).collect()
}

#[test]
fn the_document_equals_the_handmade_example() {
    let plan = plan();
    let parts = states(&plan);
    let text =
        document(ReportInputs { plan: &plan, parts: &parts }, "fidelity", "Because.\n").unwrap();
    for line in [
        "--seeds 2 --helper none,rhp,oracle --task low_target --switch world.blocking \
         --switch-seeds 1 --switch-helper none\n",
        "Only these of the eight tasks: Low target.",
        "**The published figures are over the original's test split, these over its training split**",
        "**Granted: RHP: ids from ground truth; Oracle: ids from ground truth, granted behavior, goal,",
        "| **RHP (ids from ground truth)**, chaic | 0.40 |",
        "over environments (low target: 2; cluster bootstrap",
        "| **w/o**, chaic | 0.40 |\n| w/o, paper | 0.51 |\n| difference | -0.11 ±1.27 |\n",
        "| Oracle, paper | 0.82 |\n| difference | -0.02 ±1.27 |\n",
        "| w/o | 0.11 | 0.09 | 0.07 | -0.11 | 0 of 1 |\n",
        "| Low target | Oracle > RHP > w/o | Oracle > w/o = RHP | 2 of 3 | RHP - w/o 0.00 (within",
        "kept in 0 of 1 tasks; in 1 more all inverted pairs",
        "Of 3 pairs 2 are kept",
        "| **Oracle - w/o**, chaic | 0.40 | 0.40 |\n| Oracle - w/o, paper | 0.31 | 0.31 |\n",
        "| EI, RHP | 0.00 (0.23) |\n",
        "| SE, w/o | 0.10 (0.03) |\n",
        "](images/fidelity-compat.svg)",
        "| `world.blocking` | creeps to stops | **0.20** | **0.20** |\n",
        "| Low target | `world.blocking` +0.20 |\n",
    ] {
        assert!(text.contains(line), "{line}\nis missing in\n{text}");
    }
    assert!(text.ends_with(&format!("{CAUSES_BEGIN}\nBecause.\n{CAUSES_END}\n")), "{text}");
    assert!(!text.contains("unfinished") && !text.contains("Unequal"), "{text}");
}

#[test]
fn missing_runs_are_listed_first() {
    let plan = plan();
    let mut parts = states(&plan);
    parts[1].results.clear();
    parts[0].results.remove(4);
    parts[0].results[0].status = RunStatus::Error { message: "out of ideas".to_owned() };
    parts[2].results.pop();
    let text = document(ReportInputs { plan: &plan, parts: &parts }, "fidelity", "").unwrap();
    let (top, _) = text.split_once("Made by").unwrap();
    for line in [
        "unfinished: 14 of 26 episode runs are missing",
        "- `paper`: 12 of 12 are missing",
        "- `compat`: 1 of 12 are missing",
        "- `switch/world.blocking`: 1 of 2 are missing",
        "compat: Unequal: in low target the rows rest on different episode runs (w/o on 4, Oracle on \
         4, RHP on 3)",
        "1 episode run failed and counts as zero",
        "`compat`: low_target/original-train/00 with none, seed 0: out of ideas",
    ] {
        assert!(top.contains(line), "{line}\nis missing in\n{top}");
    }
    assert!(!text.contains("## Rules of the paper"), "{text}");
    parts.iter_mut().for_each(|p| p.results.clear());
    let nothing = document(ReportInputs { plan: &plan, parts: &parts }, "fidelity", "");
    assert!(nothing.unwrap_err().to_string().contains("no episode run has finished"));
}

#[test]
fn equal_rates_whose_sums_are_rounded_are_drawn() {
    let plan = plan();
    let mut parts = states(&plan);
    // The mean of 1,600 rates of 0.95 is above the interval of the mean over 20 episodes, in the
    // 14th decimal.
    let equal: Vec<RunResult> = (0..20)
        .flat_map(|episode| (0..80).map(move |seed| run(LOW, "none", episode, seed, 9.5)))
        .collect();
    for part in parts.iter_mut().filter(|part| part.part.switch.is_none()) {
        part.planned = equal.iter().map(|result| result.key.clone()).collect();
        part.results = equal.clone();
        let score = Scores::new(part.played(), &Formulas::PAPER);
        let score = score.get(LOW, "none").unwrap();
        assert!(score.tr_ci.is_some_and(|[_, high]| high < score.tr), "{score:?}");
    }
    let dir = tempfile::tempdir().unwrap();
    let inputs = ReportInputs { plan: &plan, parts: &parts };
    write_document(inputs, &dir.path().join("fidelity.md")).unwrap();
}

#[test]
fn the_handwritten_section_is_kept() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("docs/reference/fidelity.md");
    let plan = plan();
    let parts = states(&plan);
    let write = || write_document(ReportInputs { plan: &plan, parts: &parts }, &path);
    write().unwrap();
    let empty = fs::read_to_string(&path).unwrap();
    let svg =
        fs::read_to_string(dir.path().join("docs/reference/images/fidelity-paper.svg")).unwrap();
    assert!(svg.contains("dots: published") && svg.contains("<circle"), "{svg}");
    let by_hand = empty.replace(CAUSES_BEGIN, &format!("{CAUSES_BEGIN}\n\nIt was the chair.\n"));
    fs::write(&path, &by_hand).unwrap();
    write().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), by_hand);
    // Other files are not overwritten.
    fs::write(&path, "# A letter\n").unwrap();
    assert!(write().unwrap_err().to_string().contains("not a document of this kind"));
    assert_eq!(fs::read_to_string(&path).unwrap(), "# A letter\n");
}

#[test]
fn invalid_plans_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let files = dir.path().join("episodes");
    fs::create_dir(&files).unwrap();
    let episode = chaic_episodes::find_episode("low_target/test/00").unwrap();
    fs::write(files.join("a.json"), episode.to_json()).unwrap();
    let out = dir.path().join("out");
    let default_request =
        ExperimentRequest { episodes: Some(files), ..ExperimentRequest::default() };
    let list = |names: &[&str]| Some(names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
    for (request, message) in [
        (
            ExperimentRequest { helpers: list(&["rhp"]), ..default_request.clone() },
            "--helper needs `none`",
        ),
        (
            ExperimentRequest { helpers: list(&["none", "nobody"]), ..default_request.clone() },
            "unknown helper `nobody`",
        ),
        (
            ExperimentRequest { switch_helpers: list(&["follow"]), ..default_request.clone() },
            "--switch-helper follow",
        ),
        (ExperimentRequest { switch_seeds: Some(6), ..default_request.clone() }, "1 to 5"),
        (ExperimentRequest { seeds: Some(0), ..default_request.clone() }, "at least 1"),
        (
            ExperimentRequest { switches: list(&["world.gravity"]), ..default_request.clone() },
            "no rule `world.gravity`",
        ),
        (
            ExperimentRequest { switches: list(&["world.stride_m"]), ..default_request.clone() },
            "is 0.4 in both",
        ),
        (
            ExperimentRequest { tasks: Some(vec![TaskId::Obstacle]), ..default_request.clone() },
            "has no episode of obstacle; it has those of low_target",
        ),
        (ExperimentRequest::default(), "--episodes"),
    ] {
        let error =
            ExperimentFolder::create(&out, &request, &BuiltInHelpers).unwrap_err().to_string();
        assert!(error.contains(message), "{message}: {error}");
        assert!(!out.exists(), "{message}: nothing is written");
    }
    assert!(
        ExperimentFolder::resume(&out, &default_request)
            .unwrap_err()
            .to_string()
            .contains("fidelity.json")
    );

    let two = list(&["planner.walking", "world.blocking"]);
    let experiment = ExperimentFolder::create(
        &out,
        &ExperimentRequest { switches: two, ..default_request.clone() },
        &BuiltInHelpers,
    )
    .unwrap();
    let names: Vec<String> = experiment.plan.parts().into_iter().map(|p| p.name).collect();
    let mut in_order: Vec<String> = differing_rules();
    in_order.retain(|r| r == "planner.walking" || r == "world.blocking");
    assert_eq!(names[..2], ["compat", "paper"]);
    let folders: Vec<String> = in_order.iter().map(|rule| format!("switch/{rule}")).collect();
    assert_eq!(names[2..], folders);
    let given = experiment.run_request(&experiment.plan.parts()[2]).unwrap();
    assert!(given.no_traces && given.rules == Some(RuleSetName::Compat), "{given:?}");
    assert_eq!(given.rule_overrides, [format!("{}=paper", in_order[0])]);
    assert!(matches!(
        ExperimentFolder::create(&out, &default_request, &BuiltInHelpers),
        Err(EvalError::NotEmpty { .. })
    ));
    // No run has started; switches may be added, other options must not change.
    assert!(parts(&experiment).unwrap_err().to_string().contains("has no run yet"));
    let more =
        ExperimentRequest { switches: list(&["world.reach_to"]), ..ExperimentRequest::default() };
    assert_eq!(ExperimentFolder::resume(&out, &more).unwrap().plan.switches.len(), 3);
    assert_eq!(
        ExperimentFolder::resume(&out, &ExperimentRequest::default()).unwrap().plan.switches.len(),
        3
    );
    let other = ExperimentRequest { seeds: Some(2), ..ExperimentRequest::default() };
    let error = ExperimentFolder::resume(&out, &other).unwrap_err().to_string();
    assert!(error.contains("--seeds 5, not 2"), "{error}");
}
