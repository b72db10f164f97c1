//! Promises of the bundled benchmark: complete, valid, reproducible, train and test apart.

use std::collections::BTreeSet;

use chaic_episodes::{Bundled, Episode, Split, SplitError, episodes, find_episode, validate};
use chaic_protocol::TaskId;

fn all(split: &Split) -> Vec<Episode> {
    let of = |task| episodes(split, task).collect::<Result<Vec<_>, _>>();
    TaskId::all().flat_map(|task| of(task).expect("bundled episodes are readable")).collect()
}

#[test]
fn there_are_192_valid_episodes() {
    for split in [Split::Train, Split::Test] {
        let episodes = all(&split);
        assert_eq!(episodes.len(), 96);
        for episode in &episodes {
            assert_eq!(validate(episode.setup()), [], "{}", episode.id());
            assert_eq!(episode.split(), split.to_string());
        }
        let seeds: BTreeSet<u64> = episodes.iter().map(Episode::seed).collect();
        assert_eq!(seeds.len(), 96, "no two episodes share their luck");
    }
}

#[test]
fn generators_still_make_the_bundle() {
    let now = chaic_episodes::regenerate_bundled().expect("every seed works");
    let built_in = Bundled::built_in();
    for (name, now, built_in) in
        [("train", now.train, built_in.train), ("test", now.test, built_in.test)]
    {
        let differs = now.lines().zip(built_in.lines()).position(|(a, b)| a != b);
        // The bundle stays what it is when a generator changes; then raise the generator's version
        // and replace this by a test of that version.
        assert!(now == built_in, "{name}: line {differs:?} has changed");
    }
}

/// Everything that stays where it is: walls and fixed things.
fn surroundings(episode: &Episode) -> String {
    let setup = episode.setup();
    let fixed: Vec<_> =
        setup.things.iter().filter(|t| t.fixed).map(|t| (t.class, t.position)).collect();
    format!("{:?}{fixed:?}", setup.walls)
}

#[test]
fn no_surroundings_are_in_both_splits() {
    let of = |split| all(&split).iter().map(surroundings).collect::<BTreeSet<_>>();
    let (train, test) = (of(Split::Train), of(Split::Test));
    assert!(train.is_disjoint(&test));
    let generated = of(Split::Generated(0..3));
    assert!(generated.is_disjoint(&train) && generated.is_disjoint(&test));
}

#[test]
fn splits_name_the_surroundings_of_their_episodes() {
    for split in [Split::Train, Split::Test, Split::Generated(3..5)] {
        for task in TaskId::all() {
            for (k, episode) in (0..).zip(episodes(&split, task)) {
                let episode = episode.expect("every seed works");
                let generator = episode.generator().expect("a generator made it");
                assert_eq!(split.environment(task, k), generator.environment(), "{}", episode.id());
            }
        }
    }
}

#[test]
fn each_indoor_task_has_six_houses_a_split() {
    for task in TaskId::all().take(6) {
        for split in [Split::Train, Split::Test] {
            let walls: BTreeSet<String> = episodes(&split, task)
                .map(|e| format!("{:?}", e.expect("bundled").setup().walls))
                .collect();
            assert_eq!(walls.len(), 6, "{task} {split}");
        }
    }
}

#[test]
fn episodes_are_found_by_name() {
    for id in ["obstacle/test/07", "shopping/train/00", "moving_house/gen/123"] {
        assert_eq!(find_episode(id).expect("it exists").id(), id);
    }
    for id in ["obstacle/test/12", "obstacle/test", "normal/test/1", "obstacle/gen/-1", ""] {
        assert!(matches!(find_episode(id), Err(SplitError::NoSuchEpisode { .. })), "{id}");
    }
}

#[test]
fn splits_are_written_as_they_are_read() {
    for text in ["train", "test", "gen:0..5", "gen:100..1000"] {
        let split: Split = text.parse().expect("it is a split");
        assert_eq!(split.to_string(), text);
    }
    for text in ["", "Test", "gen:", "gen:5..5", "gen:1..", "gen:0..99999999999999"] {
        assert!(text.parse::<Split>().is_err(), "{text}");
    }
}
