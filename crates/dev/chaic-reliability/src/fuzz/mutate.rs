//! Random changes to inputs, of bytes, of text and of JSON.

use chaic_core::rng::RngStream;
use serde_json::{Value, json};

/// Structure of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// One JSON value.
    Json,
    /// JSON values, one per line.
    JsonLines,
    /// Lines of text, such as TOML.
    Text,
    /// Bytes.
    Binary,
}

/// Maximum size of an input, bytes. Larger inputs only cost time.
const MAX_BYTES: usize = 1 << 20;
/// Maximum number of changes of one input.
const MAX_CHANGES: usize = 4;
/// Nesting depth of arrays: more than JSON parsers accept.
const DEEP: usize = 200;

/// Returns a changed copy of `input`, which may take a part of `other`.
pub fn mutate(rng: &mut RngStream, input: &[u8], other: &[u8], format: Format) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..=rng.below(MAX_CHANGES) {
        let is_structured = rng.chance(0.6);
        match format {
            Format::Json if is_structured => change_json(rng, &mut bytes),
            Format::JsonLines if is_structured => change_line(rng, &mut bytes, change_json),
            Format::JsonLines | Format::Text if rng.chance(0.3) => change_lines(rng, &mut bytes),
            Format::Text if is_structured => change_line(rng, &mut bytes, change_word),
            _ => change_bytes(rng, &mut bytes, other),
        }
        bytes.truncate(MAX_BYTES);
    }
    bytes
}

/// Draws a range within `len`.
fn range(rng: &mut RngStream, len: usize) -> std::ops::Range<usize> {
    let start = rng.below(len + 1);
    let longest = (len - start).min(64);
    start..start + rng.below(longest + 1)
}

fn change_bytes(rng: &mut RngStream, bytes: &mut Vec<u8>, other: &[u8]) {
    const SPECIAL: [u8; 10] = [0, 1, 0x7f, 0x80, 0xff, b'"', b'\\', b'{', b'\n', b'-'];
    let at = rng.below(bytes.len() + 1);
    match rng.below(8) {
        0 if at < bytes.len() => bytes[at] ^= 1 << rng.below(8),
        1 if at < bytes.len() => bytes[at] = SPECIAL[rng.below(SPECIAL.len())],
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(range(rng, bytes.len()))),
        4 => {
            let part = bytes[range(rng, bytes.len())].to_vec();
            bytes.splice(at..at, part);
        }
        5 => {
            let part = other[range(rng, other.len())].to_vec();
            bytes.splice(at..at, part);
        }
        6 => {
            let number = [0, 1, u32::MAX, 1 << 31, rng.below(1 << 32) as u32][rng.below(5)];
            let end = bytes.len().min(at + 4);
            bytes.splice(at..end, number.to_le_bytes());
        }
        _ => bytes.insert(at, rng.below(256) as u8),
    }
}

/// Removes, repeats or swaps lines.
fn change_lines(rng: &mut RngStream, bytes: &mut Vec<u8>) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
    if lines.is_empty() {
        return;
    }
    let (a, b) = (rng.below(lines.len()), rng.below(lines.len()));
    match rng.below(3) {
        0 => drop(lines.remove(a)),
        1 => lines.insert(b, lines[a]),
        _ => lines.swap(a, b),
    }
    *bytes = lines.concat();
}

/// Changes one line by `change`.
fn change_line(rng: &mut RngStream, bytes: &mut Vec<u8>, change: fn(&mut RngStream, &mut Vec<u8>)) {
    let lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
    if lines.is_empty() {
        return;
    }
    let k = rng.below(lines.len());
    let mut line = lines[k].strip_suffix(b"\n").unwrap_or(lines[k]).to_vec();
    change(rng, &mut line);
    line.push(b'\n');
    *bytes = [lines[..k].concat(), line, lines[k + 1..].concat()].concat();
}

/// Replaces the text between two separators.
fn change_word(rng: &mut RngStream, line: &mut Vec<u8>) {
    const WORDS: [&str; 16] = [
        "0",
        "-1",
        "1",
        "1e999",
        "-1e-999",
        "nan",
        "inf",
        "18446744073709551616",
        "0.5",
        "\"\"",
        "\"../..\"",
        "[]",
        "{}",
        "[[[[",
        "true",
        "= =",
    ];
    let is_separator = |byte: &u8| b" =,[]\"{}".contains(byte);
    let mut words = Vec::new();
    let mut start = 0;
    for word in line.split(is_separator) {
        words.push(start..start + word.len());
        start += word.len() + 1;
    }
    let word = words[rng.below(words.len())].clone();
    line.splice(word, WORDS[rng.below(WORDS.len())].bytes());
}

/// Changes one node of a JSON value.
fn change_json(rng: &mut RngStream, bytes: &mut Vec<u8>) {
    let Ok(mut value) = serde_json::from_slice::<Value>(bytes) else { return };
    let mut k = rng.below(count(&value));
    if let Some(node) = node(&mut value, &mut k) {
        change_node(rng, node);
    }
    *bytes = serde_json::to_vec(&value).unwrap_or_default();
}

/// Returns the number of nodes.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(items) => items.iter().map(count).sum(),
        Value::Object(fields) => fields.values().map(count).sum(),
        _ => 0,
    }
}

/// Returns node number `k` in depth-first order.
fn node<'v>(value: &'v mut Value, k: &mut usize) -> Option<&'v mut Value> {
    if *k == 0 {
        return Some(value);
    }
    *k -= 1;
    match value {
        Value::Array(items) => items.iter_mut().find_map(|item| node(item, k)),
        Value::Object(fields) => fields.values_mut().find_map(|field| node(field, k)),
        _ => None,
    }
}

fn change_node(rng: &mut RngStream, node: &mut Value) {
    match node {
        Value::Array(items) if !items.is_empty() && rng.chance(0.7) => {
            let k = rng.below(items.len());
            match rng.below(3) {
                0 => drop(items.remove(k)),
                1 => items.push(items[k].clone()),
                _ => items.swap(0, k),
            }
        }
        Value::Object(fields) if !fields.is_empty() && rng.chance(0.7) => {
            let names: Vec<String> = fields.keys().cloned().collect();
            let name = &names[rng.below(names.len())];
            let field = fields.remove(name).unwrap_or_default();
            if rng.chance(0.5) {
                fields.insert(format!("{name}x"), field);
            }
        }
        Value::Number(number) if rng.chance(0.5) => {
            let x = number.as_f64().unwrap_or_default();
            let changed = [x + 1.0, x - 1.0, -x, x * 1e6, x * 0.5, x + 1e-3][rng.below(6)];
            *node = if changed.fract() == 0.0 && changed.abs() < 1e15 {
                json!(changed as i64)
            } else {
                json!(changed)
            };
        }
        _ => *node = hostile(rng),
    }
}

/// Returns a value that parsers rarely expect.
fn hostile(rng: &mut RngStream) -> Value {
    match rng.below(16) {
        0 => Value::Null,
        1 => json!(true),
        2 => json!(0),
        3 => json!(-1),
        4 => json!(u64::MAX),
        5 => json!(i64::MIN),
        6 => json!(1e308),
        7 => json!(3.5e38),
        8 => json!(-0.0),
        9 => json!(""),
        10 => json!("../../x"),
        11 => json!("a\u{0}\u{1b}[31m\u{202e}"),
        12 => json!("x".repeat(10_000)),
        13 => json!([]),
        14 => json!({}),
        _ => (0..DEEP).fold(Value::Null, |inner, _| json!([inner])),
    }
}
