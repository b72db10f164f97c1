//! The public data set is imported completely and as recorded. The tests run if
//! CHAIC_ORIGINAL_DATASET and CHAIC_TDW name the folders of data set and package (`docs/import.md`
//! lists their sources). Otherwise they print a note to standard error and check nothing.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;

use chaic_core::TaskId;
use chaic_core::geom::{horizontal_distance, to_xz};
use chaic_core::task::SceneKind;
use chaic_episodes::{Episode, ReachabilityParams, path_lengths_from};
use chaic_import::{Imported, OnError, SourceSplit, Sources, house, import};
use chaic_world::{ObjectSpec, RoomKind, Rules, World};
use serde_json::Value;

const HALVES: [(SourceSplit, &str); 2] =
    [(SourceSplit::Train, "train"), (SourceSplit::Test, "test")];

fn sources() -> Option<Sources> {
    let folder = |name: &str| {
        let value = std::env::var_os(name).map(PathBuf::from);
        if value.is_none() {
            // Written directly to the stream, because the test harness captures printed text.
            let note = format!("SKIPPED: a test on the original's data, {name} is not set\n");
            drop(std::io::stderr().write_all(note.as_bytes()));
        }
        value
    };
    let (dataset, tdw) = (folder("CHAIC_ORIGINAL_DATASET")?, folder("CHAIC_TDW")?);
    Some(Sources { dataset, tdw, half: None })
}

/// An imported episode with the data set's records.
struct Compared {
    episode: Episode,
    /// Objects of the episode with the recorded height, and the recorded room if it is reliable.
    objects: Vec<(ObjectSpec, f64, Option<String>)>,
    metadata: Value,
}

/// Returns all episodes of the halves that exist.
fn all() -> Vec<Compared> {
    let Some(sources) = sources() else { return Vec::new() };
    let Imported { episodes, skipped } = import(&sources, OnError::Skip).expect("a data set");
    assert!(skipped.is_empty(), "{skipped:#?}");
    episodes.into_iter().map(|e| compare(e, &sources)).collect()
}

fn compare(episode: Episode, sources: &Sources) -> Compared {
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
        for (command, object) in added.into_iter().zip(things) {
            if obstacles.contains(&command["name"]) {
                continue;
            }
            let list = usize::from(containers.contains(&command["name"]));
            let height_m = heights[list].next().expect("one for each");
            let room = rooms.next().expect("one for each")[1].as_str().expect("a name").to_owned();
            // Recorded names of objects on the floor are shifted by one.
            let is_reliable = command["position"]["y"].as_f64().expect("a number") > 0.2;
            objects.push((*object, height_m, is_reliable.then_some(room)));
        }
    }
    Compared { episode, objects, metadata }
}

#[test]
fn all_episodes_are_imported() {
    let Some(sources) = sources() else { return };
    let ids: Vec<String> = all().iter().map(|c| c.episode.id().to_owned()).collect();
    for (half, name) in HALVES {
        let one = import(&Sources { half: Some(half), ..sources.clone() }, OnError::Stop);
        let Ok(one) = one else { continue };
        assert_eq!(one.episodes.len(), 96, "{name}");
        let again = import(&Sources { half: Some(half), ..sources.clone() }, OnError::Stop);
        assert_eq!(again.expect("as before").episodes, one.episodes, "an import is reproducible");
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
        for (object, height_m, room) in &objects {
            n += 1;
            n_same += usize::from((f64::from(object.position.y) - height_m).abs() <= 0.0501);
            let Some(name) = room else { continue };
            let at = setup.room_at(to_xz(object.position)).map(|r| setup.rooms[r].kind);
            let expected = match name.as_str() {
                "Kitchen" => RoomKind::Kitchen,
                "Livingroom" => RoomKind::LivingRoom,
                "Bedroom" => RoomKind::Bedroom,
                "Office" => RoomKind::Office,
                _ => RoomKind::Corridor,
            };
            assert_eq!(at, Some(expected), "{}: {}", episode.id(), object.class);
        }
    }
    assert!(n_same as f32 >= 0.95 * n as f32, "{n_same} of {n}");
}

#[test]
fn people_start_free_and_near_their_recorded_positions() {
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
        let world = World::new(setup.clone(), Rules::paper()).expect("a valid world");
        assert!(world.waiting().len() >= 2, "{}", episode.id());
    }
}

/// Compares with an independent digest of the training half, if it lies beside the episodes.
#[test]
fn indoor_objects_agree_with_an_independent_digest() {
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
        // Twelve episodes per task, identified by the scene and layout in the list.
        let list = sources.dataset.join("train").join(episode.task().original_name().unwrap());
        let list = fs::read(list.join("test_env.json")).expect("a list");
        let list: Value = serde_json::from_slice(&list).expect("JSON");
        let word = |f: &str| list[n % 12][f].as_str().expect("a word").to_owned();
        let record = &folder[&format!("{}_{}", word("scene"), word("layout"))];
        let objects = record["objects"].as_array().expect("a list");
        let things = &setup.things[setup.things.len() - objects.len()..];
        for (digest, object) in objects.iter().zip(things) {
            let number = |v: &Value| v.as_f64().expect("a number") as f32;
            let at = |k: usize| number(&digest["pos"][k]);
            if digest["outcome"] != "top" {
                continue;
            }
            let off = to_xz(object.position) - glam::Vec2::new(at(0), -at(2));
            n_top += 1;
            n_near += usize::from(off.length() <= 0.25);
            assert!(off.length() < 0.7, "{}: {} lies {off} off", episode.id(), object.class);
        }
    }
    assert!(n_top > 1000 && n_near as f32 >= 0.95 * n_top as f32, "{n_near} of {n_top}");
}

#[test]
fn houses_have_furniture_and_a_reachable_bed() {
    let Some(sources) = sources() else { return };
    for (scene, layout) in
        ["1a", "2b", "4c", "5a"].into_iter().flat_map(|s| (0..3).map(move |l| (s, l)))
    {
        let setup = house(&sources, scene, layout).expect("it is in the package");
        assert_eq!(setup.goal_places.len(), 1, "{scene}/{layout}");
        let bed = setup.object_index(setup.goal_places[0]).expect("a thing");
        let params = ReachabilityParams { radius_m: 0.2, reach_m: 0.7, cell_m: 0.1 };
        let lengths_m = path_lengths_from(&setup, bed, params);
        let n_reached = lengths_m.iter().filter(|m| m.is_finite()).count();
        assert!(n_reached > 30 && lengths_m[bed] == 0.0, "{scene}/{layout}: {n_reached}");
    }
    for (scene, layout, word) in [("3a", 0, "scene"), ("1d", 0, "scene"), ("1a", 3, "layout")] {
        let error =
            house(&sources, scene, layout).expect_err("the house does not exist").to_string();
        assert!(error.contains(word), "{error}");
    }
}
