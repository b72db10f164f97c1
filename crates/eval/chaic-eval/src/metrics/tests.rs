//! Scores compared with tables computed by hand.

use chaic_core::{AgentId, ClassId, EntityId, TaskId};
use chaic_env::{Digest, RunKey};

use super::*;

pub(crate) struct Case<'a> {
    task: TaskId,
    helper: &'a str,
    episode: &'a str,
    seed: u32,
    done: f64,
    total: f64,
    deliveries: Vec<Delivery>,
    away: Option<u32>,
}

pub(crate) fn case<'a>(helper: &'a str, episode: &'a str, done: f64, total: f64) -> Case<'a> {
    let task = TaskId::LowTarget;
    Case { task, helper, episode, seed: 0, done, total, deliveries: Vec::new(), away: None }
}

pub(crate) fn result(c: Case<'_>) -> RunResult {
    let (helper, episode) = (c.helper.to_owned(), c.episode.to_owned());
    RunResult {
        key: RunKey { task: c.task, helper, episode, seed: c.seed },
        status: RunStatus::Done(Summary {
            frames: 1000,
            done: c.done,
            total: c.total,
            away_frames: c.away,
            stuck_frames: None,
            escape_frames: c.away,
            deliveries: c.deliveries,
            digest: Digest(0),
            counts: Default::default(),
            diagnostics: Default::default(),
        }),
    }
}

fn delivery(by: AgentId, class: &str, counted: bool) -> Delivery {
    Delivery {
        frame: 1,
        object: EntityId(40),
        class: ClassId::named(class),
        by,
        counted,
        together: false,
        handed: false,
    }
}

fn assert_close(a: Option<f64>, b: f64) {
    assert!((a.unwrap() - b).abs() < 1e-9, "{a:?} is not {b}");
}

/// Resampling changes the third digit of a standard error.
fn assert_close_to_resampled(a: Option<f64>, b: f64) {
    assert!((a.unwrap() - b).abs() < 0.02 * b.abs(), "{a:?} is not {b}");
}

/// Computes scores with the given environments and without a plan.
fn scores_in(results: &[RunResult], environments: &Environments, f: Formulas) -> Scores {
    Scores::new(PlayedEpisodes { results, planned: &[], environments }, &f)
}

fn scores_of(results: &[RunResult], f: Formulas) -> Scores {
    scores_in(results, &Environments::default(), f)
}

fn error(helper: &str, episode: &str, seed: u32) -> RunResult {
    let (task, helper, episode) = (TaskId::LowTarget, helper.to_owned(), episode.to_owned());
    let key = RunKey { task, helper, episode, seed };
    RunResult { key, status: RunStatus::Error { message: "boom".to_owned() } }
}

/// Returns environments for episodes e1, e2, ... in these houses.
fn houses(names: &[&str]) -> Environments {
    let entry = |(k, house): (usize, &&str)| {
        (TaskId::LowTarget, format!("e{}", k + 1), (*house).to_owned())
    };
    Environments::new(names.iter().enumerate().map(entry))
}

#[test]
fn transport_rate_and_efficiency_improvement_are_means_over_episodes() {
    // Alone: e1 2/10 and 4/10 (two seeds), e2 0/8, e3 3/6. Team: e1 6/10 and 6/10, e2 0/8, e3 2/6.
    let mut results = vec![
        result(case("none", "e1", 2.0, 10.0)),
        result(Case { seed: 1, ..case("none", "e1", 4.0, 10.0) }),
        result(case("none", "e2", 0.0, 8.0)),
        result(case("none", "e3", 3.0, 6.0)),
        result(case("rhp", "e1", 6.0, 10.0)),
        result(Case { seed: 1, ..case("rhp", "e1", 6.0, 10.0) }),
        result(case("rhp", "e2", 0.0, 8.0)),
        result(case("rhp", "e3", 2.0, 6.0)),
    ];
    let scores = scores_of(&results, Formulas::PAPER);
    let (alone, team) = (
        scores.get(TaskId::LowTarget, "none").unwrap(),
        scores.get(TaskId::LowTarget, "rhp").unwrap(),
    );
    assert_close(Some(alone.tr), (0.2 + 0.4 + 0.0 + 0.5) / 4.0);
    assert_close(Some(team.tr), (0.6 + 0.6 + 0.0 + 1.0 / 3.0) / 4.0);
    assert_eq!(
        (alone.episodes, alone.ei, alone.cr, alone.ia, alone.er),
        (4, None, None, None, None)
    );
    // e1: (0.6 - 0.3) / 0.6 = 1/2; e2: both 0, so 0; e3: (1/3 - 1/2) / (1/2) = -1/3.
    assert_close(team.ei, (0.5 + 0.0 - 1.0 / 3.0) / 3.0);
    // Episode means 0.6, 0, 1/3: standard deviation 0.3006..., divided by sqrt(3).
    let m = (0.6 + 1.0 / 3.0) / 3.0;
    let ss: f64 = [0.6, 0.0, 1.0 / 3.0].iter().map(|v: &f64| (v - m) * (v - m)).sum();
    // Seeds are weighted by their number (4 runs in 3 environments), so the value is only close to
    // the formula.
    assert!((team.tr_se.unwrap() / ((ss / 2.0).sqrt() / 3f64.sqrt()) - 1.0).abs() < 0.2);
    assert_eq!((team.environments, team.failed, team.incomplete), (3, 0, false));

    // The scripts give e1 (6 - 3) / 6; e2 0 / max(0, 0, 1); e3 (2 - 3) / 3. Both formulas agree
    // here: rates and amounts of one episode are proportional, and no amount is below one object.
    assert_close(
        scores_of(&results, Formulas::ORIGINAL).get(TaskId::LowTarget, "rhp").unwrap().ei,
        0.5 / 9.0,
    );
    // The floor: with a mean of half an object, and nothing alone, EI is 0.5 / 1 there and 1 in the
    // paper.
    results = vec![
        result(case("none", "e1", 0.0, 10.0)),
        result(case("rhp", "e1", 1.0, 10.0)),
        result(Case { seed: 1, ..case("rhp", "e1", 0.0, 10.0) }),
    ];
    let ei = |f| scores_of(&results, f).get(TaskId::LowTarget, "rhp").unwrap().ei;
    assert_close(ei(Formulas::ORIGINAL), 0.5);
    assert_close(ei(Formulas::PAPER), 1.0);
    let se = |f| scores_of(&results, f).get(TaskId::LowTarget, "rhp").unwrap().tr_se;
    assert_eq!(se(Formulas::PAPER), None, "one episode has no standard error");
    assert_close(se(Formulas::ORIGINAL), 0.05);
}

#[test]
fn accuracy_and_completion_are_pooled_without_containers() {
    let (p, h) = (AgentId::PARTNER, AgentId::HELPER);
    let one = Case {
        deliveries: vec![
            delivery(h, "apple", true),
            delivery(h, "apple", false),
            delivery(h, "wicker_basket", false),
            delivery(p, "apple", true),
            Delivery { handed: true, ..delivery(p, "apple", true) },
        ],
        ..case("rhp", "e1", 3.0, 3.0)
    };
    let two = Case { deliveries: vec![delivery(h, "bread", false)], ..case("rhp", "e2", 0.0, 3.0) };
    let results = [result(one), result(two)];
    let score = |f| scores_of(&results, f).get(TaskId::LowTarget, "rhp").unwrap().clone();
    assert_close(score(Formulas::PAPER).ia, 1.0 / 3.0);
    assert_close(score(Formulas::PAPER).cr, 1.0 / 3.0);
    assert_close(score(Formulas::ORIGINAL).cr, 2.0 / 3.0);
    assert_eq!(score(Formulas::PAPER).ei, None, "there is no baseline");
}

#[test]
fn moving_house_counts_mass_and_credits_joint_carrying() {
    let heavy: Vec<ClassId> =
        ClassId::all().filter(|c| c.info().role == chaic_core::Role::HeavyTarget).collect();
    let mass = |c: ClassId| f64::from(c.info().mass_kg);
    let (a, b) = (heavy[0], heavy[1]);
    let by_partner =
        |class, together| Delivery { class, together, ..delivery(AgentId::PARTNER, "apple", true) };
    let run = Case {
        task: TaskId::MovingHouse,
        deliveries: vec![by_partner(a, true), by_partner(b, false)],
        ..case("rhp", "e1", mass(a) + mass(b), 2.0 * (mass(a) + mass(b)))
    };
    let scores = scores_of(&[result(run)], Formulas::PAPER);
    let score = scores.get(TaskId::MovingHouse, "rhp").unwrap();
    assert_close(score.cr, mass(a) / (mass(a) + mass(b)));
    assert_close(Some(score.tr), 0.5);
}

#[test]
fn emergencies_are_pooled_over_frames() {
    let run = |episode, away| {
        result(Case { task: TaskId::Shopping, away: Some(away), ..case("rhp", episode, 1.0, 4.0) })
    };
    let scores = scores_of(&[run("e1", 100), run("e2", 500)], Formulas::PAPER);
    assert_close(scores.get(TaskId::Shopping, "rhp").unwrap().er, 0.3);
}

/// Returns results of four episodes by two helpers: 0.1, 0.2, 0.3 and 0.4, and twice that.
fn pairs() -> Vec<RunResult> {
    let done = |helper, factor: f64| {
        (1..5).map(move |k| {
            let episode = ["e1", "e2", "e3", "e4"][k - 1];
            result(case(helper, episode, k as f64 * factor, 10.0))
        })
    };
    done("none", 1.0).chain(done("rhp", 2.0)).collect()
}

#[test]
fn differences_are_paired_with_intervals_over_houses() {
    let (results, names) = (pairs(), ["none".to_owned(), "rhp".to_owned()]);
    let difference = |environments: &Environments| {
        let played = PlayedEpisodes { results: &results, planned: &[], environments };
        let mut found = differences(played, &names);
        assert_eq!(found.len(), 1);
        found.pop().unwrap()
    };
    // 0.1, 0.2, 0.3, 0.4: mean 0.25, standard deviation 0.129099, divided by sqrt(4); t(3) is
    // 3.182.
    let apart = difference(&Environments::default());
    assert_eq!((apart.helper.as_str(), apart.baseline.as_str()), ("rhp", "none"));
    let all = apart.all.unwrap();
    assert_close(Some(all.mean), 0.25);
    assert_close_to_resampled(Some(all.half_width()), 3.182 * 0.129099 / 2.0);
    assert_eq!(apart.tasks[&TaskId::LowTarget], all, "there is one task only");
    // Two houses with means 0.15 and 0.35: standard deviation 0.141421, divided by sqrt(2); t(1) is
    // 12.706.
    let shared = difference(&houses(&["a", "a", "b", "b"])).all.unwrap();
    assert_close(Some(shared.mean), 0.25);
    assert_close_to_resampled(Some(shared.half_width()), 12.706 * 0.1);
    assert_eq!((shared.environments, shared.df), (2, 1));
    assert_eq!(difference(&houses(&["a", "a", "a", "a"])).all, None);
    let r = resolution(&[difference(&houses(&["a", "a", "b", "b"]))], None).unwrap();
    assert_eq!(
        (r.environments, r.median, r.largest),
        (2, shared.half_width(), shared.half_width())
    );
    // Of two half widths the median is the mean.
    let two = [difference(&houses(&["a", "a", "b", "b"])), apart];
    let r = resolution(&two, None).unwrap();
    assert_close(Some(r.median), (all.half_width() + shared.half_width()) / 2.0);
    assert_eq!(r.largest, shared.half_width());
    assert!(r.median < r.largest);
    assert_eq!(resolution(&[], None), None);
}

#[test]
fn a_summary_has_at_most_the_goal_within_rounding() {
    let check = |done: f64| result(case("rhp", "e", done, 10.0)).check();
    assert_eq!(check(10.0 + 1e-6), Ok(()), "masses are sums of rounded values");
    let message = check(10.0 + 1e-3).unwrap_err();
    assert!(message.contains("expected at most `total`"), "{message}");
}

#[test]
fn scores_have_the_mean_of_each_diagnostic_metric() {
    let key = Metric::diagnostics().next().unwrap().key;
    let results: Vec<RunResult> = [0.25, 0.75]
        .into_iter()
        .zip(["a", "b"])
        .map(|(value, episode)| {
            let mut result = result(case("rhp", episode, 1.0, 10.0));
            let RunStatus::Done(summary) = &mut result.status else { unreachable!() };
            summary.diagnostics.insert(key.to_owned(), value);
            result
        })
        .collect();
    let environments = Environments::default();
    let played = PlayedEpisodes { results: &results, planned: &[], environments: &environments };
    let scores = Scores::new(played, &FormulaSet::Paper.formulas());
    let score = &scores.tasks[&TaskId::LowTarget]["rhp"];
    assert_close(score.diagnostics.get(key).copied(), 0.5);
}

#[test]
fn runs_are_compared_by_helper_on_common_episodes() {
    let (results, environments) = (pairs(), Environments::default());
    let played = PlayedEpisodes { results: &results, planned: &[], environments: &environments };
    let as_none = |result: &RunResult| {
        let mut result = result.clone();
        result.key.helper = "rhp".to_owned();
        result
    };
    let alone = results.iter().filter(|result| result.key.helper == "none");
    let baseline: Vec<RunResult> = alone.map(as_none).collect();
    let found = run_differences(played, &baseline);
    assert_eq!(found.len(), 1, "the other run has no helper `none`");
    let [rhp, none] = ["rhp", "none"].map(str::to_owned);
    let expected = &differences(played, &[none, rhp])[0];
    assert_eq!((&*found[0].helper, found[0].all), ("rhp", expected.all));
    assert!(run_differences(played, &baseline[..0]).is_empty());
}

#[test]
fn intervals_of_rates_are_clamped() {
    let scores = scores_in(&pairs(), &houses(&["a", "a", "b", "b"]), Formulas::PAPER);
    let score = scores.get(TaskId::LowTarget, "rhp").unwrap();
    assert_eq!(score.tr_ci, Some([0.0, 1.0]), "0.5 with 12.706 * 0.2 to both sides");
    assert_close_to_resampled(score.tr_se, 0.2);
    // EI is 1/2 in every episode.
    assert_close(score.ei_ci.map(|[low, _]| low), 0.5);
    assert_close(score.ei_ci.map(|[_, high]| high), 0.5);
    assert_eq!(score.environments, 2);
}

#[test]
fn failed_runs_count_as_zero_and_order_does_not_matter() {
    let useful = Case {
        deliveries: vec![
            delivery(AgentId::HELPER, "apple", true),
            delivery(AgentId::PARTNER, "apple", true),
        ],
        ..case("rhp", "e1", 8.0, 10.0)
    };
    let mut results = vec![
        result(case("none", "e1", 4.0, 10.0)),
        result(case("none", "e2", 4.0, 10.0)),
        result(useful),
        error("rhp", "e2", 0),
    ];
    let scores = scores_of(&results, Formulas::PAPER);
    let score = scores.get(TaskId::LowTarget, "rhp").unwrap();
    assert_eq!((score.episodes, score.failed), (2, 1));
    // 0.8 and 0; (0.8 - 0.4) / 0.8 and (0 - 0.4) / 0.4.
    assert_close(Some(score.tr), 0.4);
    assert_close(score.ei, (0.5 - 1.0) / 2.0);
    // IA is 1 in one run and 0 in the other; CR is 1/2 and 0.
    assert_close(score.ia, 0.5);
    assert_close(score.cr, 0.25);
    results.reverse();
    assert_eq!(scores, scores_of(&results, Formulas::PAPER));
    let names = ["none".to_owned(), "rhp".to_owned()];
    let environments = Environments::default();
    let played = PlayedEpisodes { results: &results, planned: &[], environments: &environments };
    assert_close(differences(played, &names)[0].all.map(|i| i.mean), (0.4 - 0.4) / 2.0);
    // A failed run without helper is not a baseline: that episode is not compared.
    results.retain(|r| r.key.helper != "none" || r.key.episode != "e2");
    results.push(error("none", "e2", 0));
    let scores = scores_of(&results, Formulas::PAPER);
    assert_close(scores.get(TaskId::LowTarget, "rhp").unwrap().ei, 0.5);
    assert_close(scores.get(TaskId::LowTarget, "none").map(|s| s.tr), 0.2);
    let all_failed = scores_of(&[error("rhp", "e1", 0)], Formulas::PAPER);
    let score = all_failed.get(TaskId::LowTarget, "rhp").unwrap();
    assert_eq!((score.tr, score.ia, score.cr, score.stuck), (0.0, Some(0.0), Some(0.0), None));
}

#[test]
fn a_failed_shopping_run_is_an_emergency_throughout() {
    let shopping =
        |r: RunResult| RunResult { key: RunKey { task: TaskId::Shopping, ..r.key }, ..r };
    let played = result(Case { away: Some(100), ..case("rhp", "e1", 1.0, 4.0) });
    let results = [played, error("rhp", "e2", 0)].map(shopping);
    let scores = scores_of(&results, Formulas::PAPER);
    assert_close(scores.get(TaskId::Shopping, "rhp").unwrap().er, (0.1 + 1.0) / 2.0);
}

#[test]
fn stuck_frames_are_pooled_over_runs_that_counted_them() {
    let stuck = |episode, frames| {
        let mut result = result(case("rhp", episode, 1.0, 4.0));
        if let RunStatus::Done(summary) = &mut result.status {
            summary.stuck_frames = frames;
        }
        result
    };
    let results = [stuck("e1", Some(30)), stuck("e2", Some(0)), stuck("e3", None)];
    let scores = scores_of(&results, Formulas::PAPER);
    assert_close(scores.get(TaskId::LowTarget, "rhp").unwrap().stuck, 30.0 / 2000.0);
}

#[test]
fn missing_runs_are_listed_and_mark_their_rows() {
    let (results, environments) = (pairs(), Environments::default());
    let mut planned: Vec<RunKey> = results.iter().map(|r| r.key.clone()).collect();
    let more = (0..30).map(|seed| error("rhp", "e5", seed).key);
    planned.extend(more.chain([error("oracle", "e1", 0).key]));
    let played =
        PlayedEpisodes { results: &results, planned: &planned, environments: &environments };
    let scores = Scores::new(played, &Formulas::PAPER);
    let row = scores.get(TaskId::LowTarget, "rhp").unwrap();
    assert_eq!((row.incomplete, row.missing.len()), (true, MAX_LISTED_RUNS));
    assert_eq!(row.missing[0], "e5 seed 0");
    assert!(!scores.get(TaskId::LowTarget, "none").unwrap().incomplete);
    assert!(scores.is_unplayed(TaskId::LowTarget, "oracle"));
    assert_eq!(scores.helpers(), ["none", "rhp", "oracle"]);
}

#[test]
fn results_and_scores_read_back() {
    let text = serde_json::to_string(&result(Case {
        deliveries: vec![delivery(AgentId::HELPER, "apple", true)],
        ..case("rhp", "low_target/test/01", 0.1 + 0.2, 3.0)
    }))
    .unwrap();
    let back: RunResult = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&back).unwrap(), text);
    let scores = scores_of(&[back], Formulas::PAPER);
    let json = serde_json::to_value(&scores).unwrap();
    let score = &json["tasks"]["low_target"]["rhp"];
    let keys: Vec<&str> = score.as_object().unwrap().keys().map(String::as_str).collect();
    let expected = [
        "broken",
        "cr",
        "ei",
        "ei_ci",
        "environments",
        "episodes",
        "er",
        "ia",
        "incomplete",
        "stuck",
        "tr",
        "tr_ci",
        "tr_se",
    ];
    assert_eq!(keys, expected, "{json}");
    assert!(score["ei"].is_null() && score["episodes"] == 1);
}
