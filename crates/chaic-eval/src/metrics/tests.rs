//! Scores against tables worked by hand.

use chaic_protocol::{AgentId, ClassId, EntityId, TaskId};

use super::*;
use crate::digest::Digest;

struct Case<'a> {
    task: TaskId,
    helper: &'a str,
    episode: &'a str,
    seed: u32,
    done: f64,
    total: f64,
    deliveries: Vec<Delivery>,
    away: Option<u32>,
}

fn case<'a>(helper: &'a str, episode: &'a str, done: f64, total: f64) -> Case<'a> {
    let task = TaskId::LowTarget;
    Case { task, helper, episode, seed: 0, done, total, deliveries: Vec::new(), away: None }
}

fn result(c: Case<'_>) -> RunResult {
    let (helper, episode) = (c.helper.to_owned(), c.episode.to_owned());
    RunResult {
        key: RunKey { task: c.task, helper, episode, seed: c.seed },
        ending: Ending::Done(Summary {
            frames: 1000,
            done: c.done,
            total: c.total,
            away_frames: c.away,
            stuck_frames: None,
            escape_frames: c.away,
            deliveries: c.deliveries,
            digest: Digest(0),
            counts: Default::default(),
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

fn close(a: Option<f64>, b: f64) {
    assert!((a.unwrap() - b).abs() < 1e-9, "{a:?} is not {b}");
}

#[test]
fn transport_rate_and_efficiency_improvement() {
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
    let scores = Scores::of(&results, &Formulas::PAPER);
    let (alone, team) = (
        scores.get(TaskId::LowTarget, "none").unwrap(),
        scores.get(TaskId::LowTarget, "rhp").unwrap(),
    );
    close(Some(alone.tr), (0.2 + 0.4 + 0.0 + 0.5) / 4.0);
    close(Some(team.tr), (0.6 + 0.6 + 0.0 + 1.0 / 3.0) / 4.0);
    assert_eq!(
        (alone.episodes, alone.ei, alone.cr, alone.ia, alone.er),
        (4, None, None, None, None)
    );
    // e1: (0.6 - 0.3) / 0.6 = 1/2; e2: both 0, so 0; e3: (1/3 - 1/2) / (1/2) = -1/3.
    close(team.ei, (0.5 + 0.0 - 1.0 / 3.0) / 3.0);
    // Means of episodes 0.6, 0, 1/3: deviation 0.3006..., over the root of 3.
    let m = (0.6 + 1.0 / 3.0) / 3.0;
    let ss: f64 = [0.6, 0.0, 1.0 / 3.0].iter().map(|v: &f64| (v - m) * (v - m)).sum();
    close(team.tr_se, (ss / 2.0).sqrt() / 3f64.sqrt());

    // By the scripts: e1 (6 - 3) / 6; e2 0 / max(0, 0, 1); e3 (2 - 3) / 3. Same here, as rates and
    // counts of one episode are proportional and nothing is below one object.
    close(
        Scores::of(&results, &Formulas::ORIGINAL).get(TaskId::LowTarget, "rhp").unwrap().ei,
        0.5 / 9.0,
    );
    // The floor: half an object on the mean, alone nothing, is 0.5 / 1 there and 1 in the paper.
    results = vec![
        result(case("none", "e1", 0.0, 10.0)),
        result(case("rhp", "e1", 1.0, 10.0)),
        result(Case { seed: 1, ..case("rhp", "e1", 0.0, 10.0) }),
    ];
    let ei = |f| Scores::of(&results, &f).get(TaskId::LowTarget, "rhp").unwrap().ei;
    close(ei(Formulas::ORIGINAL), 0.5);
    close(ei(Formulas::PAPER), 1.0);
    let se = |f| Scores::of(&results, &f).get(TaskId::LowTarget, "rhp").unwrap().tr_se;
    assert_eq!(se(Formulas::PAPER), None, "one episode has no standard error");
    close(se(Formulas::ORIGINAL), 0.05);
}

#[test]
fn accuracy_and_completion_are_pooled_and_containers_are_means() {
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
    let score = |f| *Scores::of(&results, &f).get(TaskId::LowTarget, "rhp").unwrap();
    close(score(Formulas::PAPER).ia, 1.0 / 3.0);
    close(score(Formulas::PAPER).cr, 1.0 / 3.0);
    close(score(Formulas::ORIGINAL).cr, 2.0 / 3.0);
    assert_eq!(score(Formulas::PAPER).ei, None, "there is nothing to compare with");
}

#[test]
fn moving_house_weighs_and_credits_joint_carrying() {
    let heavy: Vec<ClassId> =
        ClassId::all().filter(|c| c.info().role == chaic_protocol::Role::HeavyTarget).collect();
    let mass = |c: ClassId| f64::from(c.info().mass_kg);
    let (a, b) = (heavy[0], heavy[1]);
    let by_partner =
        |class, together| Delivery { class, together, ..delivery(AgentId::PARTNER, "apple", true) };
    let run = Case {
        task: TaskId::MovingHouse,
        deliveries: vec![by_partner(a, true), by_partner(b, false)],
        ..case("rhp", "e1", mass(a) + mass(b), 2.0 * (mass(a) + mass(b)))
    };
    let scores = Scores::of(&[result(run)], &Formulas::PAPER);
    let score = scores.get(TaskId::MovingHouse, "rhp").unwrap();
    close(score.cr, mass(a) / (mass(a) + mass(b)));
    close(Some(score.tr), 0.5);
}

#[test]
fn emergencies_are_pooled_over_frames() {
    let run = |episode, away| {
        result(Case { task: TaskId::Shopping, away: Some(away), ..case("rhp", episode, 1.0, 4.0) })
    };
    let scores = Scores::of(&[run("e1", 100), run("e2", 500)], &Formulas::PAPER);
    close(scores.get(TaskId::Shopping, "rhp").unwrap().er, 0.3);
}

#[test]
fn paired_intervals_match_the_hand_worked_one() {
    // 0.1, 0.2, 0.3: mean 0.2, deviation 0.1, t(2) 4.303: half width 0.2484...
    let i = paired_interval(&[0.1, 0.2, 0.3]).unwrap();
    assert!(
        (i.mean - 0.2).abs() < 1e-12 && (i.high - 0.2 - 4.303 * 0.1 / 3f64.sqrt()).abs() < 1e-12
    );
    assert_eq!(paired_interval(&[0.1]), None);
    let results: Vec<RunResult> = [("none", [1.0, 2.0, 3.0]), ("rhp", [2.0, 4.0, 6.0])]
        .iter()
        .flat_map(|(h, done)| {
            done.iter().zip(["e1", "e2", "e3"]).map(|(d, e)| result(case(h, e, *d, 10.0)))
        })
        .collect();
    let names = ["none".to_owned(), "rhp".to_owned()];
    let found = differences(&results, &names);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].helper.as_str(), found[0].baseline.as_str()), ("rhp", "none"));
    let all = found[0].all.unwrap();
    assert!((all.mean - 0.2).abs() < 1e-12 && (all.low - i.low).abs() < 1e-12, "{all:?}");
    assert!(!found[0].tasks.is_empty());
}

#[test]
fn broken_runs_are_left_out_and_order_does_not_matter() {
    let error = RunResult {
        key: RunKey {
            task: TaskId::LowTarget,
            helper: "rhp".into(),
            episode: "e9".into(),
            seed: 0,
        },
        ending: Ending::Error { message: "boom".into() },
    };
    let mut results = vec![error];
    results.extend(
        (0..7).map(|k| result(Case { seed: k, ..case("rhp", "e1", f64::from(k) * 0.1, 0.7) })),
    );
    let scores = Scores::of(&results, &Formulas::PAPER);
    results.reverse();
    assert_eq!(scores, Scores::of(&results, &Formulas::PAPER));
    assert_eq!(scores.get(TaskId::LowTarget, "rhp").unwrap().episodes, 7);
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
    let scores = Scores::of(&[back], &Formulas::PAPER);
    let json = serde_json::to_value(&scores).unwrap();
    let score = &json["tasks"]["low_target"]["rhp"];
    let keys: Vec<&str> = score.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(keys, ["cr", "ei", "episodes", "er", "ia", "tr", "tr_se"], "{json}");
    assert!(score["ei"].is_null() && score["episodes"] == 1);
}
