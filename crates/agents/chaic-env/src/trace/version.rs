//! Keys of older versions of the format.

/// Keys of version 2 and their names since version 3. Reading accepts both by `serde(alias)`.
const RENAMED_IN_3: [(&str, &str); 6] = [
    ("senses", "sensors"),
    ("film", "frame_history"),
    ("most", "max_len"),
    ("mood", "mode"),
    ("noticed", "last_observed"),
    ("sees", "perceived"),
];

/// Returns a line that has the keys of the current version with the keys of `version`.
///
/// Each renamed key follows another entry of its object. `,"KEY":` cannot occur inside a JSON string,
/// where quotes are escaped.
pub(super) fn with_keys_of(version: u32, line: String) -> String {
    if version >= 3 {
        return line;
    }
    RENAMED_IN_3.iter().fold(line, |line, (old, new)| {
        line.replace(&format!(",\"{new}\":"), &format!(",\"{old}\":"))
    })
}
