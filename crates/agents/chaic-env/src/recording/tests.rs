//! Promise: a partner that repeats a recording delivers what the recorded one delivered, and still ends
//! its episode reasonably if a helper takes objects away. Traces name the recording by digest.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

use chaic_core::{AgentError, EntityId};
use chaic_episodes::{Episode, find_episode};

use super::*;
use crate::helper_registry::{BuiltInHelpers, find_partner};
use crate::{Env, EnvError, EpisodeAgents, EpisodeConfig};

/// Plays an episode with a partner and a helper.
fn play(episode: &Episode, partner: Option<Helper>, helper: Option<&str>) -> Trace {
    let rules = PlannerRules::paper();
    let config = EpisodeConfig {
        image_size: Some(64),
        ..EpisodeConfig::new(episode, helper.unwrap_or("none"))
    };
    let helper = helper.and_then(|name| BuiltInHelpers.make(name, rules));
    let mut env = Env::new(config, EpisodeAgents::new(helper, partner)).expect("a valid episode");
    let mut records = Vec::new();
    let mut keep = |record: &Record| {
        records.push(record.clone());
        Ok::<(), AgentError>(())
    };
    env.run(&AtomicBool::new(false), None, &mut keep).expect("it plays");
    Trace { header: env.header().clone(), records }
}

/// Returns the delivered objects in the order of their deliveries, each once.
fn delivered(trace: &Trace) -> Vec<EntityId> {
    let mut found = Vec::new();
    for record in &trace.records {
        if let Record::Event(event) = record
            && let EventKind::Delivered { object, .. } = event.event.kind
            && !found.contains(&object)
        {
            found.push(object);
        }
    }
    found
}

fn recordings(trace: &Trace, digest: u64) -> Recordings {
    let recording = Recording::from_trace(trace, Digest(digest)).expect("the partner acts");
    Recordings::new(vec![recording]).expect("there is one")
}

#[test]
fn a_recording_of_the_rules_repeats_their_deliveries() {
    for id in ["no_constraint/gen/12", "low_target/gen/13", "shopping/gen/3"] {
        let episode = find_episode(id).expect("a generated episode");
        let original = play(&episode, None, None);
        let expected = delivered(&original);
        assert!(!expected.is_empty(), "{id}");
        let repeated =
            play(&episode, recordings(&original, 7).partner(None, PlannerRules::paper()), None);
        assert_eq!(delivered(&repeated), expected, "{id}");
        let digest = repeated.header.people[0].recording.as_deref();
        assert_eq!(digest, Some("0000000000000007"));
        assert_eq!(original.header.people[0].recording, None);
    }
}

#[test]
fn the_partner_goes_on_if_a_helper_takes_objects_away() {
    let episode = find_episode("no_constraint/gen/12").expect("a generated episode");
    let original = play(&episode, None, None);
    let expected: BTreeSet<EntityId> = delivered(&original).into_iter().collect();
    let recordings = recordings(&original, 7);
    let helped = play(&episode, recordings.partner(None, PlannerRules::paper()), Some("oracle"));
    let found: BTreeSet<EntityId> = delivered(&helped).into_iter().collect();
    let end = |trace: &Trace| trace.end().expect("it ended").clone();
    let (alone, together) = (end(&original), end(&helped));
    assert!(found.len() >= expected.len(), "{found:?} instead of {expected:?}");
    assert!(together.done >= alone.done && together.frame <= alone.frame, "{together:?}");
}

#[test]
fn a_run_has_one_recording_per_episode_and_seed() {
    let episode = find_episode("no_constraint/gen/12").expect("a generated episode");
    let trace = play(&episode, None, None);
    let recording = |digest| Recording::from_trace(&trace, Digest(digest)).expect("it acts");
    let set = Recordings::new(vec![recording(9), recording(3), recording(9)]).expect("two");
    assert_eq!(set.iter().count(), 2);
    let digest = |seed| set.recording("no_constraint/gen/12", seed).map(|r| r.digest.0);
    assert_eq!([digest(0), digest(1), digest(2)], [Some(3), Some(9), Some(3)]);
    assert!(set.recording("no_constraint/gen/13", 0).is_none());
    let same = Recordings::new(vec![recording(3), recording(9)]).expect("two");
    assert_eq!(set.to_string(), same.to_string());

    let all = [set];
    let registry = RecordedPartners::new(&BuiltInHelpers, &all);
    let name = same.to_string();
    let rules = PlannerRules::paper();
    assert!(find_partner(&registry, Some(&name), None, rules).expect("it is known").is_some());
    let episodes = registry.partner_episodes(&name).expect("not all episodes");
    assert_eq!(episodes.into_keys().collect::<Vec<_>>(), ["no_constraint/gen/12"]);
    assert!(registry.partner_episodes("slow").is_none());
    let missing = find_partner(&BuiltInHelpers, Some(&name), None, rules).err().expect("no file");
    assert!(matches!(missing, EnvError::PartnerFile { .. }) && missing.is_usage(), "{missing}");
}

#[test]
fn attempts_at_one_interaction_are_one_step() {
    let episode = find_episode("no_constraint/gen/12").expect("a generated episode");
    let mut trace = play(&episode, None, None);
    let steps = Recording::from_trace(&trace, Digest(0)).expect("it acts").steps().to_vec();
    let is_put_on = |step: &RecordedStep| step.interaction == RecordedInteraction::PutOn;
    assert!(!steps.windows(2).any(|pair| is_put_on(&pair[0]) && is_put_on(&pair[1])));
    assert!(steps.iter().all(|step| step.n_attempts >= 1));

    trace.header.people[0].input = Some("plans".to_owned());
    assert!(Recording::from_trace(&trace, Digest(0)).is_ok());
    let mut helper = trace.header.people[0].clone();
    helper.agent = AgentId::HELPER;
    trace.header.people.push(helper);
    let refused = Recording::from_trace(&trace, Digest(0)).expect_err("a person is the helper");
    assert_eq!(refused, RecordingError::OtherSeat);
    trace.header.people.truncate(1);
    trace.records.clear();
    let refused = Recording::from_trace(&trace, Digest(0)).expect_err("nothing to repeat");
    assert_eq!(refused, RecordingError::Empty);
}

#[test]
fn files_without_recordings_are_ignored_in_folders_and_refused_alone() {
    let episode = find_episode("no_constraint/gen/12").expect("a generated episode");
    let trace = play(&episode, None, None);
    let text: String = trace.lines().map(|line| line + "\n").collect();
    let header = text.lines().next().expect("a header").to_owned() + "\n";
    let other = "{\"task\":\"shopping\"}\n".to_owned();
    let read = |source: &str, files: &[(&str, &String)]| {
        let content = |(name, text): &(&str, &String)| {
            Ok::<_, EnvError>((PathBuf::from(name), text.as_bytes().to_vec()))
        };
        Recordings::collect(Path::new(source), files.iter().map(content))
    };
    let name = read("a", &[("a", &text)]).expect("a trace").to_string();
    assert_eq!(name, format!("recorded:{}", Digest::of_bytes(text.as_bytes())));
    let folder = [("d/a", &text), ("d/b", &other), ("d/c", &header), ("d/e", &text)];
    assert_eq!(read("d", &folder).expect("one recording").to_string(), name);
    let cut = text[..text.len() - 10].to_owned();
    for (source, files, words) in [
        ("d", vec![("d/b", &other), ("d/c", &header)], "d: has no trace in which a partner"),
        ("c", vec![("c", &header)], "c: the partner picks nothing up"),
        ("b", vec![("b", &other)], "b: line 1: is not the header of a trace"),
        ("d", vec![("d/a", &text), ("d/cut", &cut)], "d/cut: line "),
    ] {
        let error = read(source, &files).expect_err("no recording").to_string();
        assert!(error.contains(words) && !error.contains('\n'), "{error}");
    }
}
