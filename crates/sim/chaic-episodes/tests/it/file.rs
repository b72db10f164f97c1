//! The episode file: only valid episodes pass, and errors name the place, the problem and the
//! expected value.

use chaic_episodes::{Episode, EpisodeError, MAX_EPISODE_BYTES, find_episode, json_schema};
use serde_json::{Value, json};

fn bundled(id: &str) -> Value {
    let text = find_episode(id).expect("it is bundled").to_json();
    serde_json::from_str(&text).expect("it is JSON")
}

fn good() -> Value {
    bundled("obstacle/test/03")
}

fn error_of(bytes: &[u8]) -> EpisodeError {
    Episode::parse(bytes, "some/file.json").expect_err("it is broken")
}

/// Modifies a valid file and expects all of `expected` in the error message.
fn check(change: impl Fn(&mut Value), expected: &[&str]) {
    let mut file = good();
    change(&mut file);
    check_file(&file, expected);
}

fn check_file(file: &Value, expected: &[&str]) {
    let message = error_of(file.to_string().as_bytes()).to_string();
    for part in ["some/file.json"].iter().chain(expected) {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn thing_index(file: &Value, class: &str) -> usize {
    let things = file["setup"]["things"].as_array().expect("things are a list");
    things.iter().position(|t| t["class"] == class).expect("there is one")
}

#[test]
fn a_good_file_passes_with_or_without_spaces() {
    let spread = serde_json::to_string_pretty(&good()).expect("it is JSON");
    assert!(Episode::parse(spread.as_bytes(), "x").is_ok());
    assert!(Episode::parse(good().to_string().as_bytes(), "x").is_ok());
    let marked = format!("\u{feff}{}", good());
    assert!(Episode::parse(marked.as_bytes(), "x").is_ok(), "editors write byte order marks");
}

#[test]
fn a_truncated_file_is_reported_as_truncated() {
    let text = find_episode("shopping/test/00").expect("it is bundled").to_json();
    for end in [0, 1, 10, text.len() / 2, text.len() - 3] {
        let error = error_of(&text.as_bytes()[..end]);
        assert!(matches!(error, EpisodeError::Truncated { .. }), "{end}: {error}");
    }
}

#[test]
fn files_of_other_formats_are_refused() {
    assert!(matches!(error_of(b"\x89PNG"), EpisodeError::NotJson { .. }));
    assert!(matches!(error_of(b"[1, 2]"), EpisodeError::WrongFormat { .. }));
    for (bytes, problem) in [
        ("17", "invalid type: integer `17`, expected an object with the fields of an episode"),
        (r#"{"format": "chaic-episode", "format": "gltf"}"#, "duplicate field `format`"),
    ] {
        let message = error_of(bytes.as_bytes()).to_string();
        assert!(message.starts_with(&format!("some/file.json: top level: {problem}")), "{message}");
    }
    assert!(matches!(error_of(b"{}"), EpisodeError::WrongFormat { .. }));
    let other = br#"{"format": "gltf", "version": 2}"#;
    assert!(matches!(error_of(other), EpisodeError::WrongFormat { .. }));
    let newer = br#"{"format": "chaic-episode", "version": 2, "whatever": []}"#;
    let EpisodeError::WrongVersion { found, expected, .. } = error_of(newer) else {
        panic!("the version is wrong");
    };
    assert_eq!((found.as_str(), expected), ("2", 1));
    let long = vec![b' '; MAX_EPISODE_BYTES + 1];
    assert!(matches!(error_of(&long), EpisodeError::TooLong { .. }));
    let not_a_number = br#"{"format": "chaic-episode", "version": 1, "id": NaN}"#;
    assert!(error_of(not_a_number).to_string().contains(": id: is not JSON"));
    let two = br#"{"format": "chaic-episode", "version": 1} {}"#;
    assert!(matches!(error_of(two), EpisodeError::NotJson { .. }));
    let deep = "[".repeat(100_000);
    assert!(matches!(error_of(deep.as_bytes()), EpisodeError::NotJson { .. }));
}

#[test]
fn errors_name_the_field() {
    check(
        |f| f["setup"]["things"][3]["position"][1] = Value::Null,
        &["setup.things[3].position", "null"],
    );
    check(
        |f| f["setup"]["things"][2]["class"] = json!("dragon"),
        &["setup.things[2].class", "dragon"],
    );
    check(|f| f["setup"]["task"] = json!("normal"), &["setup.task", "normal"]);
    check(|f| f["setup"]["horizon"] = json!(-1), &["setup.horizon"]);
    check(|f| f["setup"]["speling"] = json!(1), &["setup", "speling"]);
    let without = |f: &mut Value| {
        f["setup"].as_object_mut().expect("an object").remove("walls");
    };
    check(without, &["setup", "walls"]);
    check(|f| f["id"] = json!("a b\n"), &["id"]);
    for name in ["street", "a\nb"] {
        check(
            |f| f["generator"]["name"] = json!(name),
            &[&format!("generator.name: is {name:?}, expected \"house\"")],
        );
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    let text = find_episode("obstacle/test/03").expect("it is bundled").to_json();
    let huge = text.replacen("\"horizon\": 3000", "\"horizon\": 1e999", 1);
    assert_ne!(huge, text);
    assert!(Episode::parse(huge.as_bytes(), "x").is_err());
    check(
        |f| f["setup"]["things"][3]["position"][0] = json!(1e30),
        &["setup.things[3].position[0]"],
    );
}

#[test]
fn ids_must_refer_to_existing_entries() {
    check(
        |f| f["setup"]["goal_places"] = json!([9999]),
        &["setup.goal_places[0]", "9999", "16 (things[0])"],
    );
    check(|f| f["setup"]["openings"][0]["rooms"][1] = json!(77), &["openings[0].rooms[1]", "77"]);
}

#[test]
fn errors_name_objects_by_their_index() {
    let k = thing_index(&good(), "trashbin");
    check(
        |f| f["setup"]["goal_places"] = json!([16 + k]),
        &["goal_places[0]", &format!("things[{k}] (trashbin), which is not fixed")],
    );
    let place = good()["setup"]["goal_places"][0].as_u64().expect("an id");
    check(
        |f| f["setup"]["goal_places"] = json!([place, place]),
        &["goal_places[1]", &format!("repeats things[{}] (", place - 16)],
    );
}

#[test]
fn people_are_partner_helper_and_child_in_this_order() {
    let swap = |id: &str, a: usize, b: usize| {
        let mut file = bundled(id);
        file["setup"]["people"].as_array_mut().expect("people are a list").swap(a, b);
        file
    };
    let swapped = swap("obstacle/test/03", 0, 1);
    check_file(&swapped, &["people[0].persona: is helper", "people[1].persona: is wheelchair"]);
    let swapped = swap("shopping/test/00", 1, 2);
    check_file(&swapped, &["people[1].persona: is child", "people[2].persona: is helper"]);
    check_file(&swap("shopping/test/00", 0, 2), &["people[2].persona: is rider"]);
}

#[test]
fn the_number_of_people_is_limited_by_agent_ids() {
    let mut setup = find_episode("shopping/test/00").expect("bundled").into_setup();
    let max = chaic_core::AgentId::MAX_AGENTS;
    setup.people = vec![setup.people[0]; max];
    assert_eq!(setup.check(), Ok(()));
    setup.people.push(setup.people[0]);
    let problem = setup.check().expect_err("one too many").to_string();
    assert_eq!(problem, format!("people: has {} entries, expected 1 to {max}", max + 1));
}

#[test]
fn every_rider_needs_a_bicycle() {
    let mut setup = find_episode("shopping/test/00").expect("bundled").into_setup();
    setup.people.push(setup.people[0]);
    let problems: Vec<String> =
        chaic_episodes::validate(&setup).iter().map(ToString::to_string).collect();
    let expected = "hold 1 bicycle for 2 people who need one";
    assert!(problems.iter().any(|problem| problem.contains(expected)), "{problems:?}");
}

#[test]
fn intersecting_and_unsupported_objects_are_refused() {
    let at_wall = |f: &mut Value| {
        let wall = f["setup"]["walls"][0].clone();
        let k = thing_index(f, "bed");
        let (a, b) = (wall["a"].clone(), wall["b"].clone());
        let mid = |i: usize| 0.5 * (a[i].as_f64().unwrap() + b[i].as_f64().unwrap());
        f["setup"]["things"][k]["position"] = json!([mid(0), 0.0, mid(1)]);
    };
    check(at_wall, &["(bed).position", "inside walls[0]"]);
    let in_bed = |f: &mut Value| {
        let k = thing_index(f, "bed");
        f["setup"]["people"][0]["pose"]["position"] = f["setup"]["things"][k]["position"].clone();
    };
    check(in_bed, &["people[0].pose.position", "(bed)"]);
    let in_mid_air = |f: &mut Value| {
        let k = thing_index(f, "plate");
        f["setup"]["things"][k]["position"][1] = json!(2.5);
    };
    check(in_mid_air, &["(plate).position[1]", "nothing supports it"]);
}

#[test]
fn nobody_starts_in_a_wall_outdoors() {
    let mut file = bundled("moving_house/test/00");
    file["generator"] = Value::Null;
    let at = file["setup"]["people"][0]["pose"]["position"].clone();
    let x_m = at[0].as_f64().expect("a number");
    // A thin post: it reaches no furniture, which is at least 0.45 m away.
    let wall = |x_m: f64| {
        json!([{"a": [x_m, at[2]], "b": [x_m, at[2]], "thickness_m": 0.05, "bottom_m": 0.0,
                "top_m": 2.0, "color": [200, 200, 200]}])
    };
    file["setup"]["walls"] = wall(x_m + 0.3);
    assert!(Episode::parse(file.to_string().as_bytes(), "x").is_ok(), "it is beside the post");
    file["setup"]["walls"] = wall(x_m);
    check_file(&file, &["people[0].pose.position: is 0.00 m from a wall, expected at least 0.2 m"]);
}

#[test]
fn thousands_of_large_objects_and_walls_are_checked_in_time() {
    let mut file = bundled("no_constraint/test/00");
    file["generator"] = Value::Null;
    let setup = &mut file["setup"];
    setup["bounds"] = json!({"min": [-30.0, -30.0], "max": [30.0, 30.0]});
    // Flat obstacles over each other, out of reach, and walls far from them.
    let wall = |k: usize| {
        let (x_m, z_m) = (20.0 + (k % 64) as f64 * 0.1, 20.0 + (k / 64) as f64 * 0.2);
        json!({"a": [x_m, z_m], "b": [x_m + 0.05, z_m], "thickness_m": 0.02, "bottom_m": 0.0,
               "top_m": 2.0, "color": [200, 200, 200]})
    };
    let obstacle = json!({"class": "trashbin", "position": [-22.0, 0.0, -22.0], "yaw_rad": 0.0,
                          "scale": [30.0, 0.01, 30.0], "variant": 0, "fixed": false});
    setup["walls"].as_array_mut().expect("walls are a list").extend((0..1500).map(wall));
    let things = setup["things"].as_array_mut().expect("things are a list");
    things.extend(std::iter::repeat_n(obstacle, 1000));
    let start = std::time::Instant::now();
    Episode::parse(file.to_string().as_bytes(), "x").expect("it can be played");
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}

#[test]
fn targets_and_goal_places_must_be_reachable() {
    let mut closed = bundled("no_constraint/test/03");
    let walls = closed["setup"]["walls"].as_array_mut().expect("walls are a list");
    // Lintels down to the floor close every doorway.
    walls.iter_mut().for_each(|w| w["bottom_m"] = json!(0.0));
    check_file(&closed, &["out of reach", "partner", "0.7 m"]);
    check(
        |f| f["setup"]["goal"]["targets"] = json!([["lighter", 1]]),
        &["goal.targets[0]", "lighter"],
    );
    check(
        |f| {
            let things = f["setup"]["things"].as_array().expect("things are a list").clone();
            let kept: Vec<Value> = things
                .into_iter()
                .filter(|t| t["class"] != "trashbin" && t["class"] != "bright_fire_extinguisher")
                .collect();
            f["setup"]["things"] = json!(kept);
        },
        &["obstacle"],
    );
}

#[test]
fn episodes_of_other_sources_must_only_be_playable() {
    let passes = |file: &Value| Episode::parse(file.to_string().as_bytes(), "x").is_ok();
    let mut file = good();
    file["setup"]["goal"]["targets"][0][1] = json!(99);
    check_file(&file, &["goal.targets[0]", "99"]);
    file["generator"] = Value::Null;
    assert!(passes(&file), "as in the original's episodes");
    file["setup"]["goal"]["targets"] = json!([["lighter", 1]]);
    check_file(&file, &["no target of the goal"]);

    // The bottom of a leaning object is above its support; an object in mid-air cannot be
    // played.
    let mut file = good();
    file["generator"] = Value::Null;
    let k = thing_index(&file, "plate");
    let height_m = file["setup"]["things"][k]["position"][1].as_f64().expect("a number");
    file["setup"]["things"][k]["position"][1] = json!(height_m + 0.1);
    assert!(passes(&file), "it may lean");
    file["setup"]["things"][k]["position"][1] = json!(2.5);
    check_file(&file, &["nothing supports it"]);
}

#[test]
fn the_schema_describes_the_file() {
    let schema = json_schema();
    let properties = schema["properties"].as_object().expect("an object has properties");
    let fields: Vec<&String> = properties.keys().collect();
    for field in ["format", "version", "id", "split", "generator", "setup"] {
        assert!(fields.iter().any(|f| *f == field), "{field}");
    }
    assert!(schema.to_string().contains("bright_fire_extinguisher"), "classes are listed");
    // A schema cannot express all checks of the validator, so it names the command that runs
    // them.
    let description = schema["description"].as_str().expect("it has one");
    assert!(description.contains("`chaic episodes validate`"), "{description}");
}

proptest::proptest! {
    #[test]
    fn the_parser_never_panics(bytes: Vec<u8>) {
        let _ = Episode::parse(&bytes, "random bytes");
    }

    #[test]
    fn the_parser_never_panics_on_a_changed_byte(at in 0usize..6000, byte: u8) {
        let mut bytes = find_episode("moving_house/test/01").expect("bundled").to_json_line().into_bytes();
        let at = at % bytes.len();
        bytes[at] = byte;
        if let Ok(episode) = Episode::parse(&bytes, "random bytes") {
            proptest::prop_assert!(chaic_episodes::validate(episode.setup()).is_empty());
        }
    }
}
