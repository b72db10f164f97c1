//! Keys of older versions of the format. Reading accepts them by `serde(alias)`.

use crate::rules::renamed::RENAMED_RULES;

/// Keys of version 2 and their names since version 3.
const RENAMED_IN_3: [(&str, &str); 6] = [
    ("senses", "sensors"),
    ("film", "frame_history"),
    ("most", "max_len"),
    ("mood", "mode"),
    ("noticed", "last_observed"),
    ("sees", "perceived"),
];

/// Returns a line that has the keys of the current version with the keys of `version`.
pub(super) fn with_keys_of(version: u32, line: String) -> String {
    let mut line = line;
    if version < 4 && line.contains(",\"rules\":") {
        for (old, new) in RENAMED_RULES {
            line = with_key(line, last_part(new), last_part(old));
        }
    }
    if version < 3 {
        for (old, new) in RENAMED_IN_3 {
            line = with_key(line, new, old);
        }
    }
    line
}

/// Replaces a key of all objects of a line. `,"KEY":` and `{"KEY":` cannot occur inside a JSON string,
/// where quotes are escaped.
fn with_key(line: String, from: &str, to: &str) -> String {
    ["{", ","].iter().fold(line, |line, before| {
        line.replace(&format!("{before}\"{from}\":"), &format!("{before}\"{to}\":"))
    })
}

fn last_part(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}
