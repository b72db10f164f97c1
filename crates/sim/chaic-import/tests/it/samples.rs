//! The formats of data set and package are parsed, on handwritten samples, and errors name file and
//! field. Needs no public data.

use std::fs;
use std::path::Path;

use chaic_core::geom::forward;
use chaic_core::{ClassId, Vec3};
use chaic_episodes::Episode;
use chaic_import::{Imported, OnError, SourceSplit, Sources, import};
use chaic_world::{ObjectSpec, RoomKind, Setup};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A data set of one episode and a package of a few pieces of furniture.
struct Sample {
    folder: TempDir,
}

const LIST: &str = "train_dataset/normal/test_env.json";
const COMMANDS: &str = "train_dataset/normal/1a_0_0.json";
const METADATA: &str = "train_dataset/normal/1a_0_0_metadata.json";
const LAYOUTS: &str = "tdw/add_ons/floorplan_layouts.json";
const RECORDS: &str = "tdw/metadata_libraries/models_core.json";

fn xyz([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

fn piece(name: &str, position: [f64; 3], yaw_deg: f64) -> Value {
    json!({
        "name": name, "library": "models_core.json", "position": xyz(position),
        "rotation": xyz([360.0, yaw_deg, 0.0]), "scale_factor": xyz([1.0; 3]),
        "gravity": true, "kinematic": false,
    })
}

/// Returns a record with left and right swapped, as in some records of the package.
fn record(category: &str, size: [f64; 3]) -> Value {
    let [x, y, z] = size;
    json!({"wcategory": category, "bounds": {
        "left": xyz([0.5 * x, 0.0, 0.0]), "right": xyz([-0.5 * x, 0.0, 0.0]),
        "bottom": xyz([0.0; 3]), "top": xyz([0.0, y, 0.0]),
        "back": xyz([0.0, 0.0, -0.5 * z]), "front": xyz([0.0, 0.0, 0.5 * z]),
        "center": xyz([0.0, 0.5 * y, 0.0]),
    }})
}

impl Sample {
    fn new() -> Sample {
        let sample = Sample { folder: tempfile::tempdir().expect("a temporary folder") };
        sample.write("tdw/version.py", "__version__ = \"1.12.27.0\"\n");
        sample.json(
            LAYOUTS,
            &json!({"1": {"0": [
                piece("dining_room_table", [-5.0, 0.1, 2.3], 90.0),
                piece("bed01", [-12.25, 0.0, 1.66], 0.0),
                piece("trunck", [-30.0, 0.0, 0.0], 0.0),
            ]}}),
        );
        sample.json(
            RECORDS,
            &json!({"description": "", "records": {
                "dining_room_table": record("table", [1.09, 0.735, 1.09]),
                "bed01": record("bed", [2.19, 1.2, 2.58]),
                "trunck": record("trunk", [0.9, 1.0, 0.7]),
                "apple": record("apple", [0.1, 0.095, 0.1]),
                "plate06": record("plate", [0.244, 0.023, 0.244]),
            }}),
        );
        sample.json("tdw/metadata_libraries/models_full.json", &json!({"records": {}}));
        let names = ["Kitchen", "Livingroom", "Bedroom", "Livingroom", "Livingroom", "Office"];
        sample.json("train_dataset/normal/room_types.json", &json!({"1": [names]}));
        sample.json(
            LIST,
            &json!([{"scene": "1a", "layout": "0_0", "seed": 2824, "task": {
                "goal_position_names": ["bed"], "goal_task": [["apple", 2]],
                "container_names": ["plate06"], "task_kind": "normal", "constraint_type": null,
            }}]),
        );
        let add = |id: u64, name: &str, position: [f64; 3]| {
            json!({"$type": "add_object", "id": id, "name": name, "position": xyz(position),
                   "scale_factor": 0.09, "url": "", "category": "", "affordance_points": []})
        };
        let scale = |id: u64, f: f64| json!({"$type": "scale_object_and_mass", "id": id, "scale_factor": xyz([f; 3])});
        sample.json(
            COMMANDS,
            &json!([
                {"$type": "create_avatar", "type": "A_Img_Caps_Kinematic", "id": "a"},
                add(1, "apple", [-5.3, 0.74, 2.5]), scale(1, 2.0),
                add(2, "plate06", [-4.8, 0.74, 2.0]), scale(2, 1.76),
                add(3, "apple", [-4.6, 0.74, 2.7]),
                {"$type": "set_mass", "id": 3, "mass": 2.3},
            ]),
        );
        sample.json(METADATA, &json!({
            "object_room_list": [["apple", "Livingroom"], ["plate06", "Livingroom"], ["apple", "Livingroom"]],
            "object_height": [0.73, 0.0], "container_height": [0.75],
            "agent": {"0": xyz([-5.0, 0.0, 4.0]), "1": xyz([-7.0, 0.0, 2.5])},
        }));
        sample
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn write(&self, file: &str, text: &str) {
        let path = self.path().join(file);
        fs::create_dir_all(path.parent().expect("a file has a parent folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }

    fn json(&self, file: &str, value: &Value) {
        self.write(file, &value.to_string());
    }

    fn edit(&self, file: &str, change: impl FnOnce(&mut Value)) {
        let text = fs::read_to_string(self.path().join(file)).expect("the sample has it");
        let mut value = serde_json::from_str(&text).expect("the sample is JSON");
        change(&mut value);
        self.json(file, &value);
    }

    fn sources(&self) -> Sources {
        let folder = self.path().to_owned();
        Sources { dataset: folder.clone(), tdw: folder, half: None }
    }

    fn import_all(&self) -> Imported {
        import(&self.sources(), OnError::Skip).expect("the data set is readable")
    }

    /// Returns the only episode; the other seven tasks are missing.
    fn episode(&self) -> Episode {
        let imported = self.import_all();
        assert_eq!(imported.skipped.len(), 7, "{:?}", imported.skipped);
        imported.episodes.into_iter().next().expect("the episode was imported")
    }
}

fn objects_of_class<'a>(setup: &'a Setup, class: &str) -> Vec<&'a ObjectSpec> {
    setup.things.iter().filter(|t| t.class == ClassId::named(class)).collect()
}

#[test]
fn an_indoor_episode_equals_a_handmade_example() {
    let episode = Sample::new().episode();
    assert_eq!(episode.id(), "no_constraint/original-train/00");
    let setup = episode.setup();
    let [table] = objects_of_class(setup, "table")[..] else { panic!("one table") };
    assert_eq!(table.position, Vec3::new(-5.0, 0.0, -2.3), "mirrored, and dropped to the floor");
    assert!((forward(table.yaw_rad) - Vec3::X).length() < 1e-3, "Unity's 90 degrees is east");
    assert!(objects_of_class(setup, "trunk").is_empty(), "it is far outside the house");
    assert_eq!(setup.goal_places.len(), 1);
    assert_eq!(setup.object(setup.goal_places[0]).expect("it exists").class.name(), "bed");
    // The second region is a living room from x -2.58 to 4.052, z -5.583 to 0.082.
    assert_eq!(setup.rooms[1].kind, RoomKind::LivingRoom);
    assert!((setup.rooms[1].rect.max.y - 5.583).abs() < 1e-4);
    assert_eq!(setup.people[0].pose.position, Vec3::new(-5.0, 0.0, -4.0));
    assert_eq!(setup.people[0].pose.yaw_rad, 0.0);
}

#[test]
fn objects_lie_at_their_recorded_heights() {
    let episode = Sample::new().episode();
    let [large, fallen] = objects_of_class(episode.setup(), "apple")[..] else {
        panic!("two apples")
    };
    assert!((large.size_m() - Vec3::new(0.2, 0.19, 0.2)).length() < 1e-3, "twice the record");
    assert!((large.position - Vec3::new(-5.3, 0.735, -2.5)).length() < 2e-3, "{}", large.position);
    // The other one was found on the floor: beside the table, not under it.
    assert_eq!(fallen.position.y, 0.0);
    let off = (fallen.position - Vec3::new(-5.0, 0.0, -2.3)).abs();
    assert!(off.max_element() > 0.545 && off.max_element() < 1.2, "{off}");
}

#[test]
fn the_other_folder_layout_is_accepted() {
    let sample = Sample::new();
    fs::rename(sample.path().join("train_dataset"), sample.path().join("train")).expect("renamed");
    fs::rename(
        sample.path().join("train/normal/room_types.json"),
        sample.path().join("room_types.json"),
    )
    .expect("the global copy");
    let sources = Sources {
        tdw: sample.path().join("tdw"),
        half: Some(SourceSplit::Train),
        ..sample.sources()
    };
    let imported = import(&sources, OnError::Skip).expect("it is read");
    assert_eq!(imported.episodes.len(), 1);
}

#[test]
fn an_outdoor_episode_equals_a_handmade_example() {
    let sample = Sample::new();
    sample.edit(RECORDS, |v| {
        v["records"]["b06_dump"] = record("truck", [3.5, 3.68, 10.6]);
        v["records"]["arflex_strips_sofa"] = record("sofa", [1.92, 0.665, 0.975]);
    });
    sample.json(
        "train_dataset/outdoor_furniture/test_env.json",
        &json!([{
        "scene": "2a", "layout": "0_0", "seed": 77, "task": {
            "goal_position_names": "truck", "goal_task": [["arflex_strips_sofa", 1]],
            "container_names": [], "task_kind": "outdoor_furniture", "constraint_type": "weight",
        }}]),
    );
    let add = |id: u64, name: &str, position: [f64; 3], yaw_deg: f64| {
        json!({"$type": "add_object", "id": id, "name": name, "position": xyz(position),
               "rotation": xyz([0.0, yaw_deg, 0.0]), "scale_factor": 1.0})
    };
    let scale =
        |id: u64, f: [f64; 3]| json!({"$type": "scale_object", "id": id, "scale_factor": xyz(f)});
    sample.json(
        "train_dataset/outdoor_furniture/2a_0_0.json",
        &json!([
            add(1, "arflex_strips_sofa", [3.75, 0.32, 2.5], 180.0),
            scale(1, [0.7; 3]),
            add(2, "b06_dump", [14.0, 0.0, 0.0], 90.0),
            scale(2, [0.9, 0.5, 1.0]),
        ]),
    );
    sample.json(
        "train_dataset/outdoor_furniture/2a_0_0_metadata.json",
        &json!({
            "agent": {"0": [-0.25, 0.1, 2.25], "1": [2.0, 0.1, -1.25]}, "mass_map": {"1": 900},
        }),
    );
    let imported = sample.import_all();
    let episode = imported.episodes.last().expect("the second task");
    assert_eq!((episode.id(), episode.seed()), ("moving_house/original-train/00", 77));
    let setup = episode.setup();
    let [truck] = objects_of_class(setup, "truck")[..] else { panic!("one truck") };
    assert!((forward(truck.yaw_rad) - Vec3::X).length() < 1e-3, "it faces +x");
    assert!((truck.size_m() - Vec3::new(3.15, 1.84, 10.6)).abs().max_element() < 2e-3);
    let bed = chaic_world::top_surfaces(truck)[0].center.y;
    assert!((bed - 0.95).abs() < 1e-3, "the load bed has the measured height: {bed}");
    let [sofa] = objects_of_class(setup, "sofa")[..] else { panic!("one sofa") };
    assert_eq!(sofa.position, Vec3::new(3.75, 0.0, -2.5));
    assert!((forward(sofa.yaw_rad) - Vec3::Z).length() < 1e-3 && !sofa.fixed);
    assert_eq!(setup.people[0].pose.position, Vec3::new(-0.25, 0.0, -2.25));
}

/// Modifies a sample and expects an error that contains all these words.
fn expect_error(spoil: impl FnOnce(&Sample), words: &[&str]) {
    let sample = Sample::new();
    spoil(&sample);
    let error =
        import(&sample.sources(), OnError::Stop).expect_err("the sample is invalid").to_string();
    for word in words {
        assert!(error.contains(word), "`{word}` is not in: {error}");
    }
    assert!(!error.contains('\n'), "{error}");
}

#[test]
fn a_missing_or_partial_source_is_named() {
    expect_error(
        |s| fs::remove_dir_all(s.path().join("train_dataset")).unwrap(),
        &["train", "_dataset"],
    );
    expect_error(|s| fs::remove_dir_all(s.path().join("tdw")).unwrap(), &["no tdw package", "pip"]);
    expect_error(|s| fs::remove_file(s.path().join(LAYOUTS)).unwrap(), &["floorplan_layouts.json"]);
    expect_error(|s| fs::remove_file(s.path().join(METADATA)).unwrap(), &["1a_0_0_metadata.json"]);
    expect_error(|_| {}, &["highthing", "is missing"]);
}

#[test]
fn another_version_of_the_package_is_refused() {
    expect_error(
        |s| s.write("tdw/version.py", "__version__ = \"1.13.0.0\""),
        &["1.13.0.0", "1.12.27"],
    );
}

#[test]
fn malformed_files_are_refused_with_the_field() {
    expect_error(|s| s.write(LIST, "[{\"scene\": \"1a\""), &["test_env.json", "EOF"]);
    let seed = |v: &mut Value| v[0]["seed"] = json!("x");
    expect_error(|s| s.edit(LIST, seed), &["test_env.json", "[0].seed", "invalid type"]);
    let scene = |v: &mut Value| v[0]["scene"] = json!("3a");
    expect_error(
        |s| {
            s.edit(LIST, scene);
            for end in [".json", "_metadata.json"] {
                let file = |n: u32| s.path().join(format!("train_dataset/normal/{n}a_0_0{end}"));
                fs::rename(file(1), file(3)).unwrap();
            }
        },
        &["[0].scene", "3a"],
    );
    let short = |v: &mut Value| v["object_height"] = json!([0.7]);
    expect_error(|s| s.edit(METADATA, short), &["metadata.json", "object_height", "fewer"]);
    let agent = |v: &mut Value| v["agent"] = json!({"0": xyz([-5.0, 0.0, 4.0])});
    expect_error(|s| s.edit(METADATA, agent), &["metadata.json", "agent", "1"]);
    let id = |v: &mut Value| v[2]["id"] = json!(77);
    expect_error(|s| s.edit(COMMANDS, id), &["1a_0_0.json", "[2].id", "77"]);
}

#[test]
fn nan_and_too_large_numbers_are_refused_with_the_field() {
    let far = |v: &mut Value| v[1]["position"]["x"] = json!(1e30);
    expect_error(|s| s.edit(COMMANDS, far), &["1a_0_0.json", "[1]", "too large"]);
    let high = |v: &mut Value| v["object_height"][0] = json!(1e39);
    expect_error(|s| s.edit(METADATA, high), &["metadata.json", "object_height[0]", "too large"]);
    let start = |v: &mut Value| v["agent"]["0"]["z"] = json!(1e39);
    expect_error(|s| s.edit(METADATA, start), &["metadata.json", "agent.0", "expected a position"]);
    let sum =
        |v: &mut Value| v[0]["task"]["goal_task"] = json!([["apple", u32::MAX], ["apple", 1]]);
    expect_error(|s| s.edit(LIST, sum), &["1a_0_0.json", "goal.targets[0]", "4294967295 of apple"]);
    let many = |v: &mut Value| v[0]["task"]["goal_task"][0][1] = json!(-1);
    expect_error(|s| s.edit(LIST, many), &["test_env.json", "[0].task.goal_task[0][1]", "invalid"]);
    // Python writes NaN, which is not JSON.
    expect_error(
        |s| {
            let text = fs::read_to_string(s.path().join(LAYOUTS)).unwrap();
            s.write(LAYOUTS, &text.replacen("\"x\":-5.0", "\"x\": NaN", 1));
        },
        &["floorplan_layouts.json", "1.0[0].position.x", "NaN"],
    );
    for number in ["NaN", "-Infinity"] {
        expect_error(
            |s| replace(s, METADATA, "\"object_height\":[0.73", number),
            &["metadata.json", "object_height[0]", "NaN or infinity"],
        );
    }
}

/// Replaces the number at the end of a part of a file.
fn replace(sample: &Sample, file: &str, part: &str, number: &str) {
    let text = fs::read_to_string(sample.path().join(file)).expect("the sample has it");
    let begin = part.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
    let changed = text.replacen(part, &format!("{begin}{number}"), 1);
    assert_ne!(changed, text, "{part}");
    sample.write(file, &changed);
}

#[test]
fn nan_where_nothing_is_read_is_no_error() {
    let sample = Sample::new();
    sample.edit(METADATA, |v| v["mass_map"] = json!({"a: NaN": [1.25]}));
    replace(&sample, METADATA, "[1.25", "NaN, -Infinity");
    assert_eq!(sample.episode(), Sample::new().episode());
}

#[test]
fn the_number_of_episodes_is_bounded() {
    let many = |v: &mut Value| *v = json!(vec![v[0].clone(); 1001]);
    expect_error(
        |s| s.edit(LIST, many),
        &["test_env.json", "has 1001 episodes, expected at most 1000"],
    );
}

#[test]
fn duplicate_object_ids_are_refused() {
    let twice = |v: &mut Value| v[3]["id"] = json!(1);
    expect_error(|s| s.edit(COMMANDS, twice), &["1a_0_0.json", "[3].id", "another object"]);
}

#[test]
fn swapped_files_and_folders_are_refused() {
    let swap = |s: &Sample, path: &str| {
        let path = s.path().join(path);
        let is_dir = path.is_dir();
        if is_dir {
            fs::remove_dir_all(&path).unwrap()
        } else {
            fs::remove_file(&path).unwrap()
        }
        if is_dir { fs::write(&path, "").unwrap() } else { fs::create_dir(&path).unwrap() }
    };
    expect_error(|s| swap(s, "train_dataset"), &["contains no half"]);
    expect_error(|s| swap(s, "train_dataset/normal"), &["normal", "expected a folder"]);
    expect_error(|s| swap(s, "tdw"), &["no tdw package"]);
    expect_error(|s| swap(s, COMMANDS), &["1a_0_0.json", "cannot be read"]);
    expect_error(|s| swap(s, RECORDS), &["models_core.json", "cannot be read"]);
}

#[test]
fn episodes_that_share_a_seed_of_the_data_set_have_different_seeds() {
    let (first, second) = (Sample::new(), Sample::new());
    let goal = |v: &mut Value| v[0]["task"]["goal_task"] = json!([["apple", 1]]);
    second.edit(LIST, goal);
    assert_eq!(first.episode().seed(), second.episode().seed(), "the same episode");
    // A second episode of the task: the same files under another layout.
    let copy = |file: &str| {
        let text = fs::read_to_string(first.path().join(file)).expect("the sample has it");
        first.write(&file.replace("1a_0_0", "1a_0_1"), &text);
    };
    copy(COMMANDS);
    copy(METADATA);
    first.edit(LIST, |v| {
        let mut other = v[0].clone();
        other["layout"] = json!("0_1");
        v.as_array_mut().expect("a list").push(other);
    });
    let seeds: Vec<u64> = first.import_all().episodes.iter().map(|e| e.seed()).collect();
    assert_eq!(seeds.len(), 2);
    assert_ne!(seeds[0], seeds[1]);
}

#[test]
fn a_byte_order_mark_is_ignored() {
    let sample = Sample::new();
    let text = fs::read_to_string(sample.path().join(LIST)).expect("the sample has it");
    sample.write(LIST, &format!("\u{feff}{text}"));
    assert_eq!(sample.episode().seed(), Sample::new().episode().seed());
}

#[test]
fn paths_that_point_outside_are_refused() {
    for word in ["../../etc/passwd", "/etc/passwd", "", "a\u{0}b"] {
        let change = |v: &mut Value| v[0]["scene"] = json!(word);
        expect_error(|s| s.edit(LIST, change), &["test_env.json", "[0].scene", "file name"]);
    }
}

#[test]
fn models_must_be_known() {
    let unknown = |v: &mut Value| v[1]["name"] = json!("b99_unicorn");
    expect_error(
        |s| {
            s.edit(COMMANDS, unknown);
            s.edit(METADATA, |v| v["object_room_list"][0][0] = json!("b99_unicorn"));
        },
        &["1a_0_0.json", "object 0", "b99_unicorn"],
    );
    let bare = |v: &mut Value| drop(v["records"].as_object_mut().unwrap().remove("bed01"));
    expect_error(
        |s| s.edit(RECORDS, bare),
        &["floorplan_layouts.json", "1.0[1].name", "bed01", "record"],
    );
    let goal = |v: &mut Value| v[0]["task"]["goal_task"] = json!([["b99_unicorn", 1]]);
    expect_error(|s| s.edit(LIST, goal), &["[0].task.goal_task[0]", "b99_unicorn"]);
}

#[test]
fn unplayable_episodes_are_refused() {
    // The bed is the only goal place.
    let no_bed = |v: &mut Value| drop(v["1"]["0"].as_array_mut().unwrap().remove(1));
    expect_error(|s| s.edit(LAYOUTS, no_bed), &["1a_0_0.json", "goal_places"]);
}

#[test]
fn skipped_episodes_are_reported_and_the_others_imported() {
    let sample = Sample::new();
    sample.edit(LIST, |v| {
        let mut other = v[0].clone();
        other["layout"] = json!("0_7");
        v.as_array_mut().expect("a list").insert(0, other);
    });
    let imported = sample.import_all();
    let ids: Vec<&str> = imported.episodes.iter().map(Episode::id).collect();
    assert_eq!(ids, ["no_constraint/original-train/01"], "ids contain indices in the list");
    assert!(imported.skipped[0].to_string().contains("1a_0_7.json"));
}
