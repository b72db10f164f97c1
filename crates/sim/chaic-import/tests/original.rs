//! Promise: the public data set is imported whole and as it was recorded. Runs where
//! CHAIC_ORIGINAL_DATASET and CHAIC_TDW name the folders of data set and package (`docs/import.md`
//! says where to get them), and says on standard error that it checks nothing where they don't.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;

use chaic_core::TaskId;
use chaic_core::geom::{horizontal_distance, xz};
use chaic_core::task::SceneKind;
use chaic_episodes::{Episode, Walker, ways_from};
use chaic_import::{Half, Imported, OnError, Sources, house, import};
use chaic_world::{RoomKind, Rules, Thing, World};
use serde_json::Value;

const HALVES: [(Half, &str); 2] = [(Half::Train, "train"), (Half::Test, "test")];

fn sources() -> Option<Sources> {
    let folder = |name: &str| {
        let value = std::env::var_os(name).map(PathBuf::from);
        if value.is_none() {
            // Written straight to the stream, since the test harness swallows what is printed.
            let note = format!("SKIPPED: a test on the original's data, {name} is not set\n");
            drop(std::io::stderr().write_all(note.as_bytes()));
        }
        value
    };
    let (dataset, tdw) = (folder("CHAIC_ORIGINAL_DATASET")?, folder("CHAIC_TDW")?);
    Some(Sources { dataset, tdw, half: None })
}

/// What an episode became, beside what the data set says of it.
struct Compared {
    episode: Episode,
    /// Things of the episode beside model, recorded height, and recorded room where it is sure.
    objects: Vec<(Thing, f64, Option<String>)>,
    metadata: Value,
}

/// All episodes of the halves that are there.
fn all() -> Vec<Compared> {
    let Some(sources) = sources() else { return Vec::new() };
    let Imported { episodes, left_out } = import(&sources, OnError::KeepGoing).expect("a data set");
    assert!(left_out.is_empty(), "{left_out:#?}");
    episodes.into_iter().map(|e| compared(e, &sources)).collect()
}

fn compared(episode: Episode, sources: &Sources) -> Compared {
    let half =
        HALVES.iter().find(|(_, n)| episode.split() == format!("original-{n}")).expect("one");
    let candidates = [format!("{}_dataset", half.1), half.1.to_owned()];
    let folder = candidates.iter().map(|n| sources.dataset.join(n)).find(|p| p.is_dir());
    let folder = folder.expect("it was imported").join(episode.task().original_name().unwrap());
    let json = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(folder.join(name)).expect("a file")).expect("JSON")
    };
    let index: usize =
        episode.id().rsplit('/').next().and_then(|n| n.parse().ok()).expect("a number");
    let entry = &json("test_env.json")[index];
    let word = |field: &str| entry[field].as_str().expect("a word").to_owned();
    let stem = format!("{}_{}", word("scene"), word("layout"));
    let (commands, metadata) =
        (json(&format!("{stem}.json")), json(&format!("{stem}_metadata.json")));
    let mut objects = Vec::new();
    if episode.task().info().scene == SceneKind::House {
        let added: Vec<&Value> = commands
            .as_array()
            .expect("a list")
            .iter()
            .filter(|c| c["$type"] == "add_object")
            .collect();
        let things = &episode.setup().things;
        let things = &things[things.len() - added.len()..];
        let names = |field: &str| entry["task"][field].as_array().cloned().unwrap_or_default();
        let (containers, obstacles) = (names("container_names"), names("obstacle_names"));
        let mut heights = ["object_height", "container_height"].map(|f| {
            metadata[f].as_array().expect("a list").iter().map(|h| h.as_f64().expect("a number"))
        });
        let mut rooms = metadata["object_room_list"].as_array().expect("a list").iter();
        for (command, thing) in added.into_iter().zip(things) {
            if obstacles.contains(&command["name"]) {
                continue;
            }
            let list = usize::from(containers.contains(&command["name"]));
            let height_m = heights[list].next().expect("one for each");
            let room = rooms.next().expect("one for each")[1].as_str().expect("a name").to_owned();
            // Names of what was put on the floor are shifted by one.
            let is_sure = command["position"]["y"].as_f64().expect("a number") > 0.2;
            objects.push((*thing, height_m, is_sure.then_some(room)));
        }
    }
    Compared { episode, objects, metadata }
}

#[test]
fn every_episode_is_there() {
    let Some(sources) = sources() else { return };
    let ids: Vec<String> = all().iter().map(|c| c.episode.id().to_owned()).collect();
    for (half, name) in HALVES {
        let one = import(&Sources { half: Some(half), ..sources.clone() }, OnError::Stop);
        let Ok(one) = one else { continue };
        assert_eq!(one.episodes.len(), 96, "{name}");
        let again = import(&Sources { half: Some(half), ..sources.clone() }, OnError::Stop);
        assert_eq!(
            again.expect("as before").episodes,
            one.episodes,
            "the same sources, the same bits"
        );
        for task in TaskId::paper() {
            for k in 0..12 {
                assert!(ids.contains(&format!("{task}/original-{name}/{k:02}")), "{task} {k}");
            }
        }
    }
}

#[test]
fn objects_lie_in_the_recorded_rooms_at_the_recorded_heights() {
    let (mut n, mut n_same) = (0, 0);
    for Compared { episode, objects, .. } in all() {
        let setup = episode.setup();
        for (thing, height_m, room) in &objects {
            n += 1;
            n_same += usize::from((f64::from(thing.position.y) - height_m).abs() <= 0.0501);
            let Some(name) = room else { continue };
            let at = setup.room_at(xz(thing.position)).map(|r| setup.rooms[r].kind);
            let expected = match name.as_str() {
                "Kitchen" => RoomKind::Kitchen,
                "Livingroom" => RoomKind::LivingRoom,
                "Bedroom" => RoomKind::Bedroom,
                "Office" => RoomKind::Office,
                _ => RoomKind::Corridor,
            };
            assert_eq!(at, Some(expected), "{}: {}", episode.id(), thing.class);
        }
    }
    assert!(n_same as f32 >= 0.95 * n as f32, "{n_same} of {n}");
}

#[test]
fn people_start_free_and_near_their_recorded_places() {
    for Compared { episode, metadata, .. } in all() {
        let setup = episode.setup();
        for (k, person) in setup.people.iter().enumerate() {
            let at = &metadata["agent"][k.to_string()];
            let coordinate =
                |name: &str, i: usize| at[name].as_f64().or(at[i].as_f64()).expect("a number");
            let recorded =
                glam::Vec3::new(coordinate("x", 0) as f32, 0.0, -coordinate("z", 2) as f32);
            let off_m = horizontal_distance(person.pose.position, recorded);
            assert!(off_m < 0.25, "{}: agent {k} is moved by {off_m} m", episode.id());
        }
        let world = World::new(setup.clone(), Rules::paper()).expect("a world begins");
        assert!(world.waiting().len() >= 2, "{}", episode.id());
    }
}

/// A digest of the training half made apart from the importer, where it lies beside the episodes.
#[test]
fn indoor_objects_agree_with_a_digest_made_apart() {
    let Some(sources) = sources() else { return };
    let Ok(bytes) = fs::read(sources.dataset.join("train/resolved_indoor.json")) else { return };
    let digest: Value = serde_json::from_slice(&bytes).expect("JSON");
    let imported = import(&sources, OnError::Stop).expect("a data set");
    let (mut n_top, mut n_near) = (0, 0);
    let is_train = |e: &&Episode| e.split() == "original-train";
    for (n, episode) in imported.episodes.iter().filter(is_train).enumerate() {
        let Some(folder) = digest["tasks"].get(episode.task().original_name().unwrap()) else {
            continue;
        };
        let setup = episode.setup();
        // Twelve of each task, by the seed that the list gives each.
        let list = sources.dataset.join("train").join(episode.task().original_name().unwrap());
        let list = fs::read(list.join("test_env.json")).expect("a list");
        let list: Value = serde_json::from_slice(&list).expect("JSON");
        let word = |f: &str| list[n % 12][f].as_str().expect("a word").to_owned();
        let record = &folder[&format!("{}_{}", word("scene"), word("layout"))];
        let objects = record["objects"].as_array().expect("a list");
        let things = &setup.things[setup.things.len() - objects.len()..];
        for (object, thing) in objects.iter().zip(things) {
            let number = |v: &Value| v.as_f64().expect("a number") as f32;
            let at = |k: usize| number(&object["pos"][k]);
            if object["outcome"] != "top" {
                continue;
            }
            let off = xz(thing.position) - glam::Vec2::new(at(0), -at(2));
            n_top += 1;
            n_near += usize::from(off.length() <= 0.25);
            assert!(off.length() < 0.7, "{}: {} lies {off} off", episode.id(), thing.class);
        }
    }
    assert!(n_top > 1000 && n_near as f32 >= 0.95 * n_top as f32, "{n_near} of {n_top}");
}

#[test]
fn every_house_of_both_halves_has_its_furniture_and_one_bed_that_one_gets_to() {
    let Some(sources) = sources() else { return };
    for (scene, layout) in
        ["1a", "2b", "4c", "5a"].into_iter().flat_map(|s| (0..3).map(move |l| (s, l)))
    {
        let setup = house(&sources, scene, layout).expect("it is in the package");
        assert_eq!(setup.goal_places.len(), 1, "{scene}/{layout}");
        let bed = setup.thing_index(setup.goal_places[0]).expect("a thing");
        let walker = Walker { radius_m: 0.2, reach_m: 0.7, cell_m: 0.1 };
        let ways_m = ways_from(&setup, bed, walker);
        let n_reached = ways_m.iter().filter(|m| m.is_finite()).count();
        assert!(n_reached > 30 && ways_m[bed] == 0.0, "{scene}/{layout}: {n_reached}");
    }
    for (scene, layout, word) in [("3a", 0, "scene"), ("1d", 0, "scene"), ("1a", 3, "layout")] {
        let error = house(&sources, scene, layout).expect_err("there is none").to_string();
        assert!(error.contains(word), "{error}");
    }
}
