//! Promises: rows of different rules or partners are never in one table. A table with a list of partners ranks by the
//! list. Texts of a submission cannot add markup.

use chaic_core::TaskId;
use chaic_core::capability::PersonChange;
use chaic_env::partner_suite::SuitePartner;
use chaic_eval::metrics::{
    FormulaSet, PartnerResults, PlayedEpisodes, RunStatus, Scores, Summary, robustness,
};
use chaic_eval::report::RecordedGrants;

use super::*;
use crate::partners::PartnersDigest;
use crate::played::{compared, pooled};
use crate::score::{EpisodeOutcome, PartnerScore, PartnersScore, SubmissionRecord, pooled_tasks};

const EVIL: &str = "</td><script>alert(1)</script>\"'&";

fn rules(split: &str, track: &str) -> EvaluationConditions {
    EvaluationConditions {
        chaic: "0.1.0".to_owned(),
        track: track.to_owned(),
        rules: "paper".to_owned(),
        set: Vec::new(),
        tasks: vec![TaskId::Obstacle],
        split: split.to_owned(),
        episodes_sha256: split.repeat(3),
        n_episodes: 6,
        seeds: 1,
        size: None,
        partner: "rules".to_owned(),
        partners: None,
        person: None,
        appearance: "canonical".to_owned(),
        perception: "gt".to_owned(),
        behavior: "gt".to_owned(),
    }
}

fn result(helper: &str, k: usize, done: u32) -> RunResult {
    let (helper, episode) = (helper.to_owned(), format!("obstacle/sealed/{k:03}"));
    let summary = Summary {
        frames: 100,
        done: f64::from(done),
        total: 10.0,
        away_frames: None,
        escape_frames: None,
        stuck_frames: None,
        deliveries: Vec::new(),
        digest: chaic_env::Digest(u64::from(done)),
        counts: BTreeMap::new(),
        diagnostics: BTreeMap::new(),
    };
    let key = RunKey { task: TaskId::Obstacle, helper, episode, seed: 0 };
    RunResult { key, status: RunStatus::Done(summary) }
}

/// Returns the record of a result in a score.
fn record(result: &RunResult) -> EpisodeRunRecord {
    let outcome = result.summary().map(|summary| EpisodeOutcome {
        frames: summary.frames,
        done: summary.done,
        total: summary.total,
        state: summary.digest,
        trace_sha256: String::new(),
    });
    EpisodeRunRecord { key: result.key.clone(), outcome }
}

fn tasks(results: &[RunResult]) -> BTreeMap<TaskId, BTreeMap<String, chaic_eval::metrics::Score>> {
    let environments = Environments::default();
    let played = PlayedEpisodes { results, planned: &[], environments: &environments };
    Scores::new(played, &FormulaSet::Paper.formulas()).tasks
}

/// Returns results with a person, in tenths per episode: `rates` of the helper, 1 of no helper and 4 of RHP.
fn partner_results(person: &str, name: &str, rates: [u32; 6]) -> Vec<RunResult> {
    let own = rates.iter().enumerate().map(|(k, done)| result(name, k, *done));
    let others = [(NONE, 1), ("rhp", 4)];
    let others = others.iter().flat_map(|(name, done)| (0..6).map(move |k| result(name, k, *done)));
    let renamed = own.chain(others).map(|mut result| {
        result.key.episode += &format!("/{person}");
        result
    });
    renamed.collect()
}

/// Adds results with the persons `+tires` and `+tremor` to an evaluation, in tenths per episode. The
/// list has this digest.
fn with_partners(
    entry: ConfirmedEntry,
    digest: &str,
    tires: [u32; 6],
    tremor: [u32; 6],
) -> ConfirmedEntry {
    let name = entry.score.submission.name.clone();
    let results = [("+tires", tires), ("+tremor", tremor)]
        .map(|(person, rates)| partner_results(person, &name, rates));
    with_partner_results(entry, digest, results)
}

/// Adds these results with the persons `+tires` and `+tremor` to an evaluation.
fn with_partner_results(
    entry: ConfirmedEntry,
    digest: &str,
    [tires, tremor]: [Vec<RunResult>; 2],
) -> ConfirmedEntry {
    let name = entry.score.submission.name.clone();
    let persons: [(PersonChange, Vec<RunResult>); 2] = [("+tires", tires), ("+tremor", tremor)]
        .map(|(person, results)| (person.parse().expect("a change"), results));
    let ordinary = PartnerResults { partner: RULES, person: None, results: &entry.results };
    let others = persons.iter().map(|(person, results)| PartnerResults {
        partner: if person.to_string() == "+tires" { "tires" } else { "trembles" },
        person: Some(*person),
        results,
    });
    let played: Vec<PartnerResults<'_>> = std::iter::once(ordinary).chain(others).collect();
    let list = played[1..].iter().map(|partner| PartnerScore {
        partner: SuitePartner {
            name: partner.partner.to_owned(),
            partner: None,
            person: partner.person,
        },
        grants: None,
        tr: BTreeMap::new(),
        episode_runs: partner.results.iter().map(record).collect(),
    });
    let runs = || persons.iter().map(|(person, results)| (Some(*person), &results[..]));
    let (results, compared) = (pooled(runs()), compared(runs()));
    let partners = PartnersScore {
        tasks: pooled_tasks(&results, compared.as_deref(), &entry.environments),
        robustness: robustness(&played, &[name], &entry.environments),
        list: list.collect(),
    };
    let digest = PartnersDigest { n: 2, sha256: digest.to_owned() };
    let conditions =
        EvaluationConditions { partners: Some(digest), ..entry.score.conditions.clone() };
    let score = SubmissionScore { conditions, partners: Some(partners), ..entry.score.clone() };
    ConfirmedEntry { score, results, compared, ..entry }
}

/// Returns an evaluation in which the helper delivers `rates` tenths per episode, and RHP 4 and 5.
fn entry(name: &str, conditions: &EvaluationConditions, rates: [u32; 6]) -> ConfirmedEntry {
    let own = rates.iter().enumerate().map(|(k, done)| result(name, k, *done));
    let others = [(NONE, 1), ("rhp", 4)]
        .into_iter()
        .flat_map(|(helper, done)| (0..6).map(move |k| result(helper, k, done + k as u32 % 2)));
    let results: Vec<RunResult> = own.chain(others).collect();
    let granted = RecordedGrants {
        grants: vec!["goal_place".to_owned(), "ids".to_owned()],
        perception: "ground_truth".to_owned(),
        isolation: None,
        weights: None,
    };
    let environments = Environments::default();
    let score = SubmissionScore {
        format: "chaic-score",
        version: 1,
        submission: SubmissionRecord {
            name: name.to_owned(),
            release: "1.0".to_owned(),
            authors: vec![EVIL.to_owned()],
            description: EVIL.to_owned(),
            license: "MIT".to_owned(),
            hardware: EVIL.to_owned(),
            core_hours: 1.5,
            sha256: format!("{name:0>64}"),
        },
        conditions: conditions.clone(),
        grants: [name, NONE, "rhp"].map(|name| (name.to_owned(), granted.clone())).into(),
        partner: None,
        tasks: tasks(&results),
        episode_runs: results.iter().map(record).collect(),
        partners: None,
    };
    ConfirmedEntry { folder: format!("of-{name}"), score, results, compared: None, environments }
}

fn leaderboard(entries: Vec<ConfirmedEntry>) -> Leaderboard {
    let mut builder = LeaderboardBuilder::default();
    entries.into_iter().for_each(|entry| builder.add_entry(Path::new("x"), entry));
    builder.build()
}

#[test]
fn rows_of_different_rules_are_in_different_tables() {
    let (unrestricted, hidden, other) =
        (rules("a", "unrestricted"), rules("a", "hidden"), rules("b", "unrestricted"));
    let size = EvaluationConditions { size: Some(64), ..unrestricted.clone() };
    let version = EvaluationConditions { chaic: "0.2.0".to_owned(), ..unrestricted.clone() };
    let perception =
        EvaluationConditions { perception: "learned".to_owned(), ..unrestricted.clone() };
    let behavior = EvaluationConditions { behavior: "learned".to_owned(), ..unrestricted.clone() };
    let all = [&unrestricted, &hidden, &other, &size, &version, &perception, &behavior];
    let entries = all.iter().enumerate().flat_map(|(k, rules)| {
        [entry(&format!("m{k}"), rules, [5; 6]), entry(&format!("n{k}"), rules, [6; 6])]
    });
    let board = leaderboard(entries.collect());
    assert_eq!((board.tables.len(), board.n_submissions()), (7, 14));
    for table in &board.tables {
        let k = all.iter().position(|rules| **rules == table.conditions).expect("given rules");
        let names: Vec<&str> = table.rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!(names, [&format!("n{k}"), &format!("m{k}"), "rhp", NONE]);
    }
    let page = board.to_html("t");
    assert_eq!(page.matches("<table>").count(), 3 * 7);
    assert_eq!(page.matches("<caption>").count(), 3 * 7);
}

#[test]
fn a_table_with_partners_ranks_by_the_list_and_shows_robustness() {
    let unrestricted = rules("a", "unrestricted");
    let entry = |name: &str, rates| entry(name, &unrestricted, rates);
    let board = leaderboard(vec![
        // Better with the ordinary partner, worse with the list.
        with_partners(entry("tuned", [9; 6]), "x", [2, 2, 2, 2, 2, 2], [1, 3, 2, 1, 3, 2]),
        with_partners(entry("robust", [5; 6]), "x", [4, 4, 6, 6, 5, 5], [5, 5, 5, 5, 5, 5]),
        with_partners(entry("other", [8; 6]), "y", [8; 6], [8; 6]),
        entry("plain", [7; 6]),
    ]);
    assert!(board.refused.is_empty(), "{:?}", board.refused);
    let names = |table: &LeaderboardTable| -> Vec<String> {
        let submissions = table.rows.iter().filter(|row| row.sha256.is_some());
        submissions.map(|row| row.name.clone()).collect()
    };
    let [plain, x, y] = &board.tables[..] else { panic!("three tables") };
    assert_eq!([names(plain), names(y)], [["plain"], ["other"]]);
    assert_eq!(names(x), ["robust", "tuned"]);
    let row = |name: &str| x.rows.iter().find(|row| row.name == name).expect(name);
    let (robust, tuned) = (row("robust"), row("tuned"));
    assert!((robust.tr - 0.5).abs() < 1e-12 && (tuned.tr - 0.2).abs() < 1e-12, "{x:?}");
    let obstacle = &robust.tasks[&TaskId::Obstacle];
    assert!((obstacle.tr - 0.5).abs() < 1e-12, "{obstacle:?}");
    // Differences to RHP: 0.05, 0.05, 0.15, 0.15, 0.1, 0.1.
    let difference = robust.difference.expect("paired with RHP");
    assert!((difference.mean - 0.1).abs() < 1e-12 && difference.low > 0.0, "{difference:?}");
    // Gains: 0.35 on average with the ordinary partner, 0.4 with the list.
    let gains = robust.robustness.as_ref().expect("it played the list");
    assert!((gains.ordinary.gain.mean - 0.35).abs() < 1e-12, "{gains:?}");
    assert!((gains.suite.mean - 0.4).abs() < 1e-12, "{gains:?}");
    assert!(plain.rows.iter().all(|row| row.robustness.is_none()));

    let page = board.to_html("t");
    for words in ["Share kept", "list of 2", "a, unrestricted track, 2 partners", "Worst tenth:"] {
        assert!(page.contains(words), "{words}: {page}");
    }
    assert_eq!(page.matches(": robustness, gain of TR").count(), 2);
    let csv = board.to_csv();
    let header: Vec<&str> = csv.lines().next().expect("a header").split(',').collect();
    let line = csv.lines().find(|line| line.contains(",robust,")).expect("its row");
    let cells: Vec<&str> = line.split(',').collect();
    assert_eq!(cells.len(), header.len());
    let cell = |name: &str| cells[header.iter().position(|n| *n == name).expect(name)];
    assert_eq!((cell("partners"), cell("gain")), ("2", "0.400000"));
    assert_eq!(cell("partner"), "list of 2");

    // A table without a list has the words and fields of earlier versions only.
    let plain = leaderboard(vec![entry("plain", [7; 6])]);
    for text in [plain.to_html("t"), plain.to_json()] {
        assert!(!text.contains("robustness") && !text.contains("Share kept"), "{text}");
    }
}

#[test]
fn failed_runs_of_none_with_one_partner_do_not_bias_comparisons_with_none() {
    let evaluation = |n_failed: usize| {
        let [tires, mut tremor] = [("+tires", [2; 6]), ("+tremor", [0; 6])]
            .map(|(person, rates)| partner_results(person, "mine", rates));
        let of_none = tremor.iter_mut().filter(|result| result.key.helper == NONE);
        for result in of_none.take(n_failed) {
            result.status = RunStatus::Error { message: "the partner ended".to_owned() };
        }
        let entry = entry("mine", &rules("a", "unrestricted"), [5; 6]);
        with_partner_results(entry, "x", [tires, tremor])
    };
    let row = |entry: ConfirmedEntry| {
        let mut board = leaderboard(vec![entry]);
        let rows = &mut board.tables[0].rows;
        rows.remove(rows.iter().position(|row| row.name == "mine").expect("it played"))
    };
    let is_close = |a: f64, b: f64| (a - b).abs() < 1e-12;
    // The helper has 0.2 instead of 0.1 with one partner, and 0 instead of 0.1 with the other one.
    for (n_failed, ei, difference) in [(0, 0.0, 0.0), (3, 0.25, 0.05), (6, 0.5, 0.1)] {
        // All runs of the helper count in its rate and in differences to another helper, 0.4.
        let with_rhp = row(evaluation(n_failed));
        assert!(is_close(with_rhp.tr, 0.1), "{with_rhp:?}");
        assert!(is_close(with_rhp.difference.expect("paired with RHP").mean, -0.3));
        let mut alone = evaluation(n_failed);
        alone.score.grants.remove("rhp");
        let alone = row(alone);
        assert!(is_close(alone.tr, 0.1) && is_close(alone.ei.expect("compared"), ei), "{alone:?}");
        let found = alone.difference.expect("paired with none").mean;
        assert!(is_close(found, difference), "{found} instead of {difference}");
    }
}

#[test]
fn a_built_in_helper_that_plays_otherwise_with_one_partner_is_found() {
    let unrestricted = rules("a", "unrestricted");
    let first = with_partners(entry("first", &unrestricted, [5; 6]), "x", [5; 6], [5; 6]);
    let mut cheater = with_partners(entry("cheater", &unrestricted, [5; 6]), "x", [9; 6], [9; 6]);
    let partners = cheater.score.partners.as_mut().expect("a list");
    let runs = &mut partners.list[1].episode_runs;
    let of_none = runs.iter_mut().find(|run| run.key.helper == NONE).expect("it played");
    of_none.outcome.as_mut().expect("it ended").state = chaic_env::Digest(99);
    let board = leaderboard(vec![first, cheater]);
    let [refused] = &board.refused[..] else { panic!("{:?}", board.refused) };
    let expected =
        "obstacle/sealed/000/+tremor with none, partner trembles and seed 0 ends otherwise";
    assert!(refused.reason.starts_with(expected), "{}", refused.reason);
}

#[test]
fn differences_are_paired_with_rhp_and_adjusted() {
    let unrestricted = rules("a", "unrestricted");
    // RHP has 4, 5, 4, 5, 4, 5 tenths.
    let board = leaderboard(vec![
        entry("same", &unrestricted, [4, 5, 4, 5, 4, 5]),
        entry("better", &unrestricted, [6, 7, 5, 8, 6, 6]),
        entry("unsure", &unrestricted, [9, 1, 5, 5, 4, 6]),
    ]);
    let [table] = &board.tables[..] else { panic!("one table") };
    assert_eq!((table.reference.as_str(), table.environments), ("rhp", 6));
    let difference = |name: &str| {
        let row = table.rows.iter().find(|row| row.name == name).expect(name);
        row.difference
    };
    assert_eq!((difference("rhp"), difference(NONE)), (None, None));
    let same = difference("same").expect("paired");
    assert_eq!((same.mean, same.p, same.p_holm), (0.0, 1.0, 1.0));
    let better = difference("better").expect("paired");
    // Differences 0.2, 0.2, 0.1, 0.3, 0.2, 0.1.
    assert!((better.mean - 1.1 / 6.0).abs() < 1e-12 && better.low > 0.0, "{better:?}");
    assert!(better.p < 0.01 && (better.p_holm - 3.0 * better.p).abs() < 1e-12, "{better:?}");
    let unsure = difference("unsure").expect("paired");
    assert!(unsure.low < 0.0 && unsure.p > 0.3, "{unsure:?}");
    assert_eq!(board.to_csv().lines().count(), 1 + 5);
}

#[test]
fn one_environment_is_counted_although_it_has_no_interval() {
    let mut mine = entry("mine", &rules("a", "unrestricted"), [5; 6]);
    let house =
        |k: u32| (TaskId::Obstacle, format!("obstacle/sealed/{k:03}"), "house/a".to_owned());
    mine.environments = Environments::new((0..6).map(house));
    let board = leaderboard(vec![mine]);
    let [table] = &board.tables[..] else { panic!("one table") };
    assert_eq!((table.environments, table.rows[0].tr_ci), (1, None));
    assert!(board.to_html("t").contains("<dt>Environments</dt><dd>1</dd>"));
}

#[test]
fn repeated_and_contradictory_evaluations_are_refused() {
    let unrestricted = rules("a", "unrestricted");
    let mut cheater = entry("cheater", &unrestricted, [9; 6]);
    let of_none = cheater.score.episode_runs.iter_mut().find(|run| run.key.helper == NONE);
    *of_none.expect("it played") = record(&result(NONE, 0, 0));
    let board = leaderboard(vec![
        entry("first", &unrestricted, [5; 6]),
        entry("first", &unrestricted, [5; 6]),
        cheater,
        entry("last", &unrestricted, [3; 6]),
    ]);
    assert_eq!(board.n_submissions(), 2);
    let reasons: Vec<&str> = board.refused.iter().map(|entry| entry.reason.as_str()).collect();
    let [repeated, contradictory] = reasons[..] else { panic!("{reasons:?}") };
    assert_eq!(repeated, "it is the submission of of-first");
    assert!(contradictory.starts_with("obstacle/sealed/000 with none and seed 0 ends otherwise"));
}

/// A built-in helper may be submitted too; its results are those of the same reference helper.
#[test]
fn a_submitted_built_in_helper_plays_as_the_reference() {
    let unrestricted = rules("a", "unrestricted");
    let first = entry("first", &unrestricted, [5; 6]);
    // RHP has 4, 5, 4, 5, 4, 5 tenths.
    assert_eq!(conflict(&first, &entry("rhp", &unrestricted, [4, 5, 4, 5, 4, 5])), None);
    let reason = conflict(&first, &entry("rhp", &unrestricted, [4, 5, 9, 5, 4, 5]));
    let expected = "obstacle/sealed/002 with rhp and seed 0 ends otherwise than in of-first";
    assert!(reason.as_ref().is_some_and(|text| text.starts_with(expected)), "{reason:?}");
    // Versions of one helper play differently.
    let mut second = entry("first", &unrestricted, [6; 6]);
    second.score.submission.sha256 = "0".repeat(64);
    assert_eq!(conflict(&first, &second), None);
}

#[test]
fn texts_cannot_add_markup_and_the_page_loads_nothing() {
    let mut builder = LeaderboardBuilder::default();
    builder.add_entry(Path::new("x"), entry("mine", &rules(EVIL, "unrestricted"), [5; 6]));
    builder.refuse(Path::new(EVIL), &format!("{EVIL}/run: {EVIL}"));
    let page = builder.build().to_html(EVIL);
    assert_eq!(page.matches("<script").count(), 0, "{page}");
    for forbidden in ["src=", "<link", "@import", "url(", "http"] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    assert!(page.contains("&lt;&#x2f;td&gt;"), "texts are escaped");
    assert!(leaderboard(Vec::new()).to_html("t").contains("No submission is confirmed."));
}
