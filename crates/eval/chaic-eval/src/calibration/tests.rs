//! Promise: the belief scores follow from the beliefs in traces as docs/metrics.md defines them.

use chaic_core::agent::{PartnerBelief, Thought};
use chaic_core::task::Goal;
use chaic_core::{Action, AgentId, ClassId, Frame};
use chaic_env::trace::{Decision, End, Record, Trace};
use chaic_env::{Digest, EpisodeConfig, trace_header};
use chaic_episodes::find_episode;

use super::*;
use crate::report::Format;

/// Returns a trace of `frames` frames with these probabilities of fruit and of a child, per mille.
fn trace(frames: Frame, beliefs: &[(Frame, u16, u16)]) -> Trace {
    let episode = find_episode("high_goal/test/00").unwrap();
    let header = trace_header(EpisodeConfig::new(&episode, "infer"), None).unwrap();
    let pair =
        |names: [&str; 2], p: u16| vec![(names[0].to_owned(), p), (names[1].to_owned(), 1000 - p)];
    let decision = |(frame, fruit, child): &(Frame, u16, u16)| {
        let belief = PartnerBelief {
            goals: pair(["fruit", "bread"], *fruit),
            people: pair(["child", "adult"], *child),
            ..PartnerBelief::default()
        };
        Record::Decision(Decision {
            frame: *frame,
            agent: AgentId::HELPER,
            action: Action::MoveForward,
            digest: Digest(0),
            thought: Some(Thought { belief: Some(Box::new(belief)), ..Thought::default() }),
        })
    };
    let end = End {
        frame: frames,
        done: 1.0,
        total: 3.0,
        complete: false,
        away_frames: 0,
        stuck_frames: 0,
        digest: Digest(0),
    };
    let records = beliefs.iter().map(decision).chain([Record::End(end)]).collect();
    Trace { header, records }
}

fn goal(targets: &[(&str, u32)]) -> Goal {
    Goal { targets: targets.iter().map(|(name, n)| (ClassId::named(name), *n)).collect() }
}

fn fruit() -> Goal {
    goal(&[("apple", 3), ("bread", 1)])
}

#[test]
fn beliefs_are_sampled_at_fixed_frames() {
    let run = trace(450, &[(0, 500, 500), (150, 800, 400), (300, 900, 300)]);
    let belief = EpisodeBelief::new(&run, &fruit()).unwrap();
    // After the end, the last belief counts.
    assert_eq!(belief.true_set_probability, [0.8, 0.9, 0.9, 0.9, 0.9, 0.9]);
    assert_eq!(belief.identified, Some(150));
    let confidences: Vec<f64> = belief.goal_samples.iter().map(|s| s.confidence).collect();
    assert_eq!(confidences, [0.5, 0.8, 0.9, 0.9], "frames 100, 200, 300 and 400");
    assert!(belief.last_goal.is_correct && belief.goal_samples[0].is_correct);
    assert_eq!(belief.person_samples.len(), 4);
}

#[test]
fn cut_traces_and_yards_have_no_scores() {
    let mut run = trace(450, &[(0, 500, 500)]);
    assert_eq!(EpisodeBelief::new(&run, &goal(&[])), None, "the true set is unknown");
    run.records.pop();
    assert_eq!(EpisodeBelief::new(&run, &fruit()), None);
    assert_eq!(EpisodeBelief::new(&trace(450, &[]), &fruit()), None);
    let mut yard = trace(450, &[(0, 500, 500)]);
    if let Record::Decision(decision) = &mut yard.records[0] {
        let belief = decision.thought.as_mut().and_then(|t| t.belief.as_mut()).unwrap();
        belief.goals = vec![("furniture".to_owned(), 1000)];
    }
    assert_eq!(EpisodeBelief::new(&yard, &goal(&[("sofa", 1)])), None);
}

#[test]
fn scores_are_means_over_runs() {
    let runs = [
        trace(200, &[(0, 500, 500), (90, 800, 1000)]),
        trace(200, &[(0, 400, 500), (190, 600, 1000)]),
    ];
    let beliefs: Vec<EpisodeBelief> =
        runs.iter().map(|run| EpisodeBelief::new(run, &fruit()).unwrap()).collect();
    let scores = BeliefScores::new(&beliefs);
    let HelperScores { all, tasks } = &scores.helpers["infer"];
    assert_eq!(tasks.len(), 1);
    assert_eq!(all.runs, 2);
    assert!((all.true_set_probability[0] - 0.7).abs() < 1e-9);
    assert_eq!((all.identified, all.identified_frame), (0.5, None));
    assert_eq!(all.goal.accuracy, Some(1.0));
    // Samples: 0.8 and 0.8 are correct, 0.6 is wrong, 0.6 is correct.
    // (2 x |1 - 0.8| + 2 x |0.5 - 0.6|) / 4 = 0.15.
    assert!((all.goal.ece.unwrap() - 0.15).abs() < 1e-9, "{:?}", all.goal);
    // (2 ln 0.8 + ln 0.4 + ln 0.6) / 4 = -0.468350.
    assert!((all.goal.log_score.unwrap() + 0.468_350).abs() < 1e-5, "{:?}", all.goal);

    let table = scores.text(Format::Table);
    assert!(table.contains("after the end") && table.contains("Mean probability"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 120), "{table}");
    let csv = scores.text(Format::Csv);
    assert_eq!(csv.lines().count(), 3, "{csv}");
    assert!(csv.contains("\ninfer,all,2,0.700000,"), "{csv}");
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert_eq!(columns, [17; 3], "{csv}");
    let json: serde_json::Value = serde_json::from_str(&scores.text(Format::Json)).unwrap();
    assert_eq!(json["frames"][5], 2000);
    assert_eq!(json["helpers"]["infer"]["all"]["identified_frame"], serde_json::Value::Null);
    assert_eq!(json["helpers"]["infer"]["tasks"]["high_goal"]["runs"], 2);
    let md = scores.text(Format::Markdown);
    assert!(md.contains("| Helper | Task | runs | 200 |"), "{md}");
}
