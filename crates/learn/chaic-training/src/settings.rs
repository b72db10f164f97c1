//! Settings on which a checkpoint depends ([`Trainer::fixed_keys`](crate::Trainer::fixed_keys)).

use std::collections::BTreeMap;

use serde::Serialize;
use toml::{Table, Value};

use crate::checkpoint::{Checkpoint, CheckpointError};

/// Section of a checkpoint that holds the settings as JSON.
const SETTINGS: &str = "run.settings";

/// Values of settings as text, by key.
pub type Settings = BTreeMap<String, String>;

/// Returns a message about the first setting whose value differs from the recorded one; `event`
/// describes when it was recorded. A key on one side only comes from another build and is ignored.
pub fn changed_setting(recorded: &Settings, current: &Settings, event: &str) -> Option<String> {
    recorded.iter().find_map(|(key, before)| {
        let now = current.get(key).filter(|now| *now != before)?;
        Some(format!(
            "`{key}` is {now}, but was {before} when {event}; set it back, or start another training with \
             --out (--weights takes the weights of this one if they fit)"
        ))
    })
}

/// Returns the values of a configuration, as its file has them.
///
/// # Panics
/// If the configuration is no table with TOML values.
pub fn to_table(config: &impl Serialize) -> Table {
    let text = toml::to_string(config).expect("a checked configuration serializes to TOML");
    text.parse().expect("serialized TOML can be parsed")
}

/// Returns the values of these keys of a configuration, as its file has them. The key of a table stands for
/// all keys of the table.
///
/// # Panics
/// If a key has no value.
pub(crate) fn values(config: &impl Serialize, keys: &[&str]) -> Settings {
    let root = Value::Table(to_table(config));
    let mut settings = Settings::new();
    for key in keys {
        let value = key.split('.').try_fold(&root, |table, name| table.get(name));
        insert(&mut settings, key, value.unwrap_or_else(|| panic!("`{key}` has no value")));
    }
    settings
}

fn insert(settings: &mut Settings, key: &str, value: &Value) {
    match value {
        Value::Table(table) => {
            for (name, value) in table {
                insert(settings, &format!("{key}.{name}"), value);
            }
        }
        value => {
            settings.insert(key.to_owned(), value.to_string());
        }
    }
}

/// Adds the settings to a checkpoint, if there are any.
pub(crate) fn record(settings: &Settings, checkpoint: &mut Checkpoint) {
    if !settings.is_empty() {
        let json = serde_json::to_vec(settings).expect("texts serialize to JSON");
        checkpoint.insert_bytes(SETTINGS, json);
    }
}

/// Returns the settings in a checkpoint. Checkpoints of earlier builds have none.
pub(crate) fn recorded(checkpoint: &Checkpoint) -> Result<Settings, CheckpointError> {
    if !checkpoint.sections.contains_key(SETTINGS) {
        return Ok(Settings::new());
    }
    let json = checkpoint.bytes(SETTINGS)?;
    serde_json::from_slice(json)
        .map_err(|e| CheckpointError::section(SETTINGS, format!("cannot be read: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(pairs: &[(&str, &str)]) -> Settings {
        pairs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
    }

    #[test]
    fn values_are_those_of_the_file_and_are_read_back() {
        let text = "n = 1\nnames = [\"a\", \"b\"]\n[t]\nx = 2.0\n[t.u]\nis = true\n[v]\ny = 3\n";
        let table: Table = text.parse().unwrap();
        let expected = settings(&[
            ("names", "[\"a\", \"b\"]"),
            ("t.u.is", "true"),
            ("t.x", "2.0"),
            ("v.y", "3"),
        ]);
        let found = values(&table, &["names", "t", "v.y"]);
        assert_eq!(found, expected);
        // As a double, the value would have 16 digits.
        let single = BTreeMap::from([("gamma", 0.9998_f32)]);
        assert_eq!(values(&single, &["gamma"]), settings(&[("gamma", "0.9998")]));
        let mut checkpoint = Checkpoint::default();
        assert_eq!(recorded(&checkpoint), Ok(Settings::new()));
        record(&found, &mut checkpoint);
        assert_eq!(recorded(&checkpoint), Ok(expected));
        checkpoint.insert_bytes(SETTINGS, b"[]".to_vec());
        let problem = recorded(&checkpoint).unwrap_err().to_string();
        assert!(problem.contains("`run.settings` cannot be read"), "{problem}");
    }

    #[test]
    fn keys_of_other_builds_are_not_compared() {
        let recorded = settings(&[("old", "1"), ("x", "2"), ("y", "3")]);
        let changed = |pairs: &[(&str, &str)]| {
            changed_setting(&recorded, &settings(pairs), "the training began")
        };
        assert_eq!(changed(&[("new", "5"), ("x", "2"), ("y", "3")]), None);
        let problem = changed(&[("x", "2"), ("y", "4")]).unwrap();
        assert!(problem.starts_with("`y` is 4, but was 3 when the training began;"), "{problem}");
    }
}
