//! The bundled benchmark is complete, valid and reproducible, and train and test are disjoint.

use std::collections::BTreeSet;

use chaic_core::TaskId;
use chaic_core::task::SceneKind;
use chaic_episodes::{Bundled, Episode, Split, SplitError, episodes, find_episode, validate};
use chaic_world::Setup;

fn all(split: &Split) -> Vec<Episode> {
    let of = |task| episodes(split, task).collect::<Result<Vec<_>, _>>();
    TaskId::paper().flat_map(|task| of(task).expect("bundled episodes are readable")).collect()
}

#[test]
fn the_bundle_has_192_valid_episodes() {
    for split in [Split::Train, Split::Test] {
        let episodes = all(&split);
        assert_eq!(episodes.len(), 96);
        for episode in &episodes {
            assert_eq!(validate(episode.setup()), [], "{}", episode.id());
            assert_eq!(episode.split(), split.to_string());
        }
        let seeds: BTreeSet<u64> = episodes.iter().map(Episode::seed).collect();
        assert_eq!(seeds.len(), 96, "all episodes have different seeds");
    }
}

#[test]
fn generators_reproduce_the_bundle() {
    let now = chaic_episodes::regenerate_bundled().expect("every seed has an episode");
    let built_in = Bundled::built_in();
    for (name, now, built_in) in
        [("train", now.train, built_in.train), ("test", now.test, built_in.test)]
    {
        let differs = now.lines().zip(built_in.lines()).position(|(a, b)| a != b);
        // The bundle stays the same when a generator changes. Then raise the generator's version
        // and replace this by a test of that version.
        assert!(now == built_in, "{name}: line {differs:?} has changed");
    }
}

/// Classes that affect only the looks of a street or a room, and the bicycle, whose position
/// follows from its rider.
const SCENERY: [&str; 8] =
    ["tree", "fence", "street_lamp", "bench", "mailbox", "house_front", "rug", "bike"];

/// Returns the layout of an environment: walls, furniture, shops, shelves and goal places. Trees
/// and other scenery do not count.
fn surroundings(setup: &Setup) -> String {
    let fixed = setup.things.iter().filter(|t| t.fixed && !SCENERY.contains(&t.class.name()));
    let fixed: Vec<_> = fixed.map(|t| (t.class, t.position)).collect();
    format!("{:?}{fixed:?}", setup.walls)
}

/// Returns the number of episodes of the first list whose surroundings occur in the second.
fn n_shared<'a>(
    one: impl IntoIterator<Item = &'a Episode>,
    other: impl IntoIterator<Item = &'a Episode>,
) -> usize {
    let other: BTreeSet<String> = other.into_iter().map(|e| surroundings(e.setup())).collect();
    one.into_iter().filter(|e| other.contains(&surroundings(e.setup()))).count()
}

fn first(split: &Split, n: usize) -> Vec<Episode> {
    let of = |task| episodes(split, task).take(n).collect::<Result<Vec<_>, _>>();
    TaskId::paper().flat_map(|task| of(task).expect("every seed has an episode")).collect()
}

fn is_indoors(episode: &&Episode) -> bool {
    episode.task().info().scene == SceneKind::House
}

#[test]
fn splits_share_no_surroundings() {
    let (train, test) = (all(&Split::Train), all(&Split::Test));
    let generated = first(&Split::Generated(0..3), 3);
    for (one, other) in [(&train, &test), (&train, &generated), (&test, &generated)] {
        let indoors = |of: &'_ [Episode]| of.iter().filter(is_indoors).cloned().collect::<Vec<_>>();
        assert_eq!(n_shared(&indoors(one), &indoors(other)), 0);
    }
    let standard = first(&Split::Standard, 4);
    let alike = first(&Split::GeneratedStandard(0..4), 4);
    for other in [&train, &test, &generated] {
        assert_eq!((n_shared(&standard, other), n_shared(&alike, other)), (0, 0));
    }
    assert_eq!(n_shared(&standard, &alike), 0);
    let places: BTreeSet<String> = standard.iter().map(|e| surroundings(e.setup())).collect();
    assert_eq!(places.len(), standard.len(), "each has its own environment");
}

/// The paper's settings have one street and one yard.
#[test]
fn shared_surroundings_are_detected() {
    let (train, test) = (all(&Split::Train), all(&Split::Test));
    let outdoors =
        |of: &[Episode]| of.iter().filter(|e| !is_indoors(e)).cloned().collect::<Vec<_>>();
    assert_eq!(n_shared(&outdoors(&train), &outdoors(&test)), 24);
    for task in [TaskId::Shopping, TaskId::MovingHouse] {
        let mut planted = find_episode(&format!("{task}/standard/001")).expect("it exists");
        let mut setup = planted.clone().into_setup();
        setup.things.retain(|t| t.class.name() != "bench");
        setup.things.iter_mut().filter(|t| t.class.name() == "tree").for_each(|t| t.variant += 1);
        planted = Episode::new("planted", "other", None, setup).expect("it is valid");
        let others = episodes(&Split::Standard, task).take(3);
        let others: Vec<Episode> =
            others.collect::<Result<_, _>>().expect("every seed has an episode");
        assert_eq!(n_shared([&planted], &others), 1, "{task}: only trees and benches differ");
    }
}

#[test]
fn the_environment_of_a_split_equals_that_of_its_episodes() {
    for split in [Split::Train, Split::Test, Split::Generated(3..5)] {
        for task in TaskId::paper() {
            for (k, episode) in (0..).zip(episodes(&split, task)) {
                let episode = episode.expect("every seed has an episode");
                let generator = episode.generator().expect("a generator made it");
                assert_eq!(split.environment(task, k), generator.environment(), "{}", episode.id());
            }
        }
    }
}

#[test]
fn each_indoor_task_has_six_houses_per_split() {
    for task in TaskId::paper().take(6) {
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
    for id in
        ["obstacle/test/07", "shopping/train/00", "moving_house/gen/123", "shopping/gen-standard/9"]
    {
        assert_eq!(find_episode(id).expect("it exists").id(), id);
    }
    for id in ["obstacle/test/12", "obstacle/standard/100", "normal/test/1", "obstacle/gen/-1", ""]
    {
        assert!(matches!(find_episode(id), Err(SplitError::NoSuchEpisode { .. })), "{id}");
    }
    let without_bicycle = find_episode("obstacle/test/07/rider").expect_err("it has no bicycle");
    assert!(matches!(without_bicycle, SplitError::Unplayable(_)), "{without_bicycle}");
    assert_eq!(
        find_episode("obstacle/test/07/child").expect("it exists").id(),
        "obstacle/test/07/child"
    );
    let problem =
        find_episode("obstacle/test/07/giant").expect_err("there is no such person").to_string();
    assert!(
        problem.starts_with("episode `obstacle/test/07/giant`: unknown kind of person"),
        "{problem}"
    );
}

#[test]
fn split_names_round_trip() {
    for text in ["train", "test", "standard", "gen:0..5", "gen-standard:100..1000"] {
        let split: Split = text.parse().expect("it is a split");
        assert_eq!(split.to_string(), text);
    }
    for text in
        ["", "Test", "gen:", "gen:5..5", "gen:1..", "gen:0..99999999999999", "standard:0..5"]
    {
        assert!(text.parse::<Split>().is_err(), "{text}");
    }
}
