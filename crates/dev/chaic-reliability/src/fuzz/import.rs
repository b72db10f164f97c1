//! Handmade data sets in the format of the original, with a package of a few models.

use std::path::Path;
use std::{fs, io};

use chaic_core::TaskId;
use chaic_import::{ImportError, OnError, SourceSplit, Sources, import};
use serde_json::{Value, json};

use super::inputs::Inputs;

/// Returns data sets of one indoor and one outdoor episode. Each line is a file, in the order of [`write()`].
pub fn seeds() -> Vec<Vec<u8>> {
    let text = |files: [Value; 6]| files.map(|file| file.to_string()).join("\n");
    vec![text(house()).into_bytes(), text(street()).into_bytes()]
}

/// Imports a data set whose files are the lines of the input.
pub fn parse(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let folder = inputs.scratch.join("original");
    write(&folder, bytes).expect("the scratch folder is writable");
    let half = folder.join("train");
    let sources =
        Sources { tdw: folder.join("tdw"), dataset: folder, half: Some(SourceSplit::Train) };
    let imported = import(&sources, OnError::Skip).map_err(|error| error.to_string())?;
    // The data set has one task; the folders of the others are missing.
    let is_other_task = |error: &ImportError| match error {
        ImportError::Unreadable { path, .. } => path.parent() == Some(&*half) && !path.exists(),
        _ => false,
    };
    match imported.skipped.iter().find(|&error| !is_other_task(error)) {
        Some(error) => Err(error.to_string()),
        None => Ok(()),
    }
}

/// Writes a data set of one task, and the package.
fn write(folder: &Path, bytes: &[u8]) -> io::Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    let mut lines = bytes.split(|byte| *byte == b'\n');
    let mut line = || lines.next().unwrap_or_default();
    let list = line();
    let task = folder.join("train").join(task_name(list));
    let library = folder.join("tdw/metadata_libraries");
    let files = [
        (task.join("test_env.json"), list),
        (task.join("1a_0_0.json"), line()),
        (task.join("1a_0_0_metadata.json"), line()),
        (folder.join("train/room_types.json"), line()),
        (folder.join("tdw/add_ons/floorplan_layouts.json"), line()),
        (library.join("models_core.json"), line()),
        (library.join("models_full.json"), &b"{\"records\": {}}"[..]),
        (folder.join("tdw/version.py"), &b"__version__ = \"1.12.27.0\"\n"[..]),
    ];
    for (path, text) in files {
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        fs::write(path, text)?;
    }
    Ok(())
}

/// Returns the name of the task of a list of episodes; that of the first task if it has none.
fn task_name(list: &[u8]) -> &'static str {
    let list: Value = serde_json::from_slice(list).unwrap_or_default();
    let kind = list.pointer("/0/task/task_kind").and_then(Value::as_str);
    let names: Vec<&str> = TaskId::paper().filter_map(TaskId::original_name).collect();
    names.iter().copied().find(|name| Some(*name) == kind).unwrap_or(names[0])
}

/// Returns a house with a table, a bed, a plate and two apples, one of which fell.
fn house() -> [Value; 6] {
    let list = json!([{"scene": "1a", "layout": "0_0", "seed": 2824, "task": {
        "goal_position_names": ["bed"], "goal_task": [["apple", 2]],
        "container_names": ["plate06"], "task_kind": "normal",
    }}]);
    let commands = json!([
        object(1, "apple", [-5.3, 0.74, 2.5]),
        {"$type": "scale_object_and_mass", "id": 1, "scale_factor": xyz([2.0; 3])},
        object(2, "plate06", [-4.8, 0.74, 2.0]),
        {"$type": "scale_object", "id": 2, "scale_factor": xyz([1.76; 3])},
        object(3, "apple", [-4.6, 0.74, 2.7]),
        {"$type": "rotate_object_to_euler_angles", "id": 3, "euler_angles": xyz([0.0, 90.0, 0.0])},
    ]);
    let rooms = [["apple", "Livingroom"], ["plate06", "Livingroom"], ["apple", "Livingroom"]];
    let metadata = json!({
        "object_room_list": rooms, "object_height": [0.73, 0.0], "container_height": [0.75],
        "agent": {"0": xyz([-5.0, 0.0, 4.0]), "1": xyz([-7.0, 0.0, 2.5])},
    });
    let names = ["Kitchen", "Livingroom", "Bedroom", "Livingroom", "Livingroom", "Office"];
    let layouts = json!({"1": {"0": [
        piece("dining_room_table", [-5.0, 0.1, 2.3], 90.0),
        piece("bed01", [-12.25, 0.0, 1.66], 0.0),
    ]}});
    let records = json!({"records": {
        "dining_room_table": record("table", [1.09, 0.735, 1.09]),
        "bed01": record("bed", [2.19, 1.2, 2.58]),
        "apple": record("apple", [0.1, 0.095, 0.1]),
        "plate06": record("plate", [0.244, 0.023, 0.244]),
    }});
    [list, commands, metadata, json!({"1": [names]}), layouts, records]
}

/// Returns a street with a sofa and a truck.
fn street() -> [Value; 6] {
    let list = json!([{"scene": "1a", "layout": "0_0", "seed": 77, "task": {
        "goal_position_names": "truck", "goal_task": [["arflex_strips_sofa", 1]],
        "container_names": [], "task_kind": "outdoor_furniture",
    }}]);
    let commands = json!([
        object(1, "arflex_strips_sofa", [3.75, 0.32, 2.5]),
        {"$type": "scale_object", "id": 1, "scale_factor": xyz([0.7; 3])},
        object(2, "b06_dump", [14.0, 0.0, 0.0]),
        {"$type": "rotate_object_to_euler_angles", "id": 2, "euler_angles": xyz([0.0, 90.0, 0.0])},
        {"$type": "scale_object", "id": 2, "scale_factor": xyz([0.9, 0.5, 1.0])},
    ]);
    let metadata = json!({"agent": {"0": [-0.25, 0.1, 2.25], "1": [2.0, 0.1, -1.25]}});
    let records = json!({"records": {
        "b06_dump": record("truck", [3.5, 3.68, 10.6]),
        "arflex_strips_sofa": record("sofa", [1.92, 0.665, 0.975]),
    }});
    [list, commands, metadata, json!({}), json!({}), records]
}

fn xyz([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

/// Returns the command that adds an object.
fn object(id: u64, model: &str, position: [f64; 3]) -> Value {
    json!({"$type": "add_object", "id": id, "name": model, "position": xyz(position)})
}

/// Returns a piece of furniture of a layout.
fn piece(model: &str, position: [f64; 3], yaw_deg: f64) -> Value {
    json!({
        "name": model, "position": xyz(position), "rotation": xyz([0.0, yaw_deg, 0.0]),
        "scale_factor": xyz([1.0; 3]), "gravity": true, "kinematic": false,
    })
}

/// Returns the record of a model.
fn record(category: &str, size: [f64; 3]) -> Value {
    let [x, y, z] = size.map(|side| 0.5 * side);
    json!({"wcategory": category, "bounds": {
        "left": xyz([-x, 0.0, 0.0]), "right": xyz([x, 0.0, 0.0]),
        "bottom": xyz([0.0; 3]), "top": xyz([0.0, 2.0 * y, 0.0]),
        "back": xyz([0.0, 0.0, -z]), "front": xyz([0.0, 0.0, z]),
    }})
}
