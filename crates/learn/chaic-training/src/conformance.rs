//! Tests that every trainer passes. Crates with trainers call them from their own tests.
//!
//! A failed test panics with a description of the violated property.

use std::fmt::Debug;
use std::sync::atomic::AtomicBool;

use toml::{Table, Value};

use crate::bounds;
use crate::checkpoint::{Checkpoint, CheckpointError, Section};
use crate::config::{config_text, parse_config};
use crate::run::{checkpoint_bytes, identity, restore};
use crate::trainer::Trainer;

/// Maximum size of a checkpoint in which every bit is flipped, bits.
const EVERY_BIT: usize = 20_000;
/// Number of bits that are flipped in larger checkpoints, in addition to bits of the first bytes.
/// [`SAMPLED_BYTES`] selects a number in this range.
const SAMPLED_BITS: [usize; 2] = [24, 160];
/// Total number of bytes that these flips may read.
const SAMPLED_BYTES: usize = 1 << 30;
/// Number of first bytes of larger checkpoints in which every [`HEAD_STRIDE`]-th bit is flipped:
/// head, identity and first section.
const HEAD_BYTES: usize = 160;
/// Stride in checkpoints with the maximum number of samples. An odd stride visits all bits of a byte.
const HEAD_STRIDE: usize = 5;

/// Asserts that a trainer refuses every damaged checkpoint, and every one with impossible values.
///
/// # Panics
/// If a damaged checkpoint is accepted, or refused for another reason than damage.
pub fn refuses_damaged_checkpoints<T: Trainer>(trainer: &mut T) {
    let bytes = checkpoint_bytes(trainer, &[]).expect("the checkpoint can be written");
    let stop = AtomicBool::new(false);
    let mut expect_damage = |bytes: &[u8], description: &str| match restore(trainer, bytes, &stop) {
        Err(CheckpointError::Damaged(_)) => {}
        Err(error) => panic!("{description}: {error}"),
        Ok(_) => panic!("a checkpoint with {description} is accepted"),
    };
    let mut flipped = bytes.clone();
    for bit in sampled_bits(8 * bytes.len()) {
        flipped[bit / 8] ^= 1 << (bit % 8);
        expect_damage(&flipped, &format!("bit {bit} flipped"));
        flipped[bit / 8] ^= 1 << (bit % 8);
    }
    for n in [0, 1, 15, 16, 35, 36, 40, bytes.len() / 2, bytes.len() - 1] {
        expect_damage(&bytes[..n], &format!("truncation to {n} bytes"));
    }
    expect_damage(&[&bytes[..], &[0]].concat(), "an appended byte");
    let identity = identity(trainer);
    for_each_alteration(&trainer.checkpoint(), |description, altered| {
        let restored = restore(trainer, &altered.encode(&identity), &stop);
        assert!(restored.is_err(), "a checkpoint with {description} is accepted");
    });
}

fn sampled_bits(n_bits: usize) -> Vec<usize> {
    if n_bits <= EVERY_BIT {
        return (0..n_bits).collect();
    }
    let [min, max] = SAMPLED_BITS;
    let n = (8 * SAMPLED_BYTES / n_bits).clamp(min, max);
    let step = n_bits / n;
    let head_stride = HEAD_STRIDE * max / n;
    let head = (0..8 * HEAD_BYTES).step_by(head_stride | 1);
    head.chain((0..n_bits).step_by(step | 1)).collect()
}

/// Calls `check` for checkpoints that differ from a valid one by a value, a length or a section, with
/// a description of each. Only one copy exists at a time, because checkpoints are large.
fn for_each_alteration(valid: &Checkpoint, mut check: impl FnMut(&str, &Checkpoint)) {
    let mut altered = valid.clone();
    let mut add = |description: String, name: &str, section: Option<Section>| {
        match section {
            Some(section) => altered.sections.insert(name.to_owned(), section),
            None => altered.sections.remove(name),
        };
        check(&format!("{description} in `{name}`"), &altered);
        altered.sections.insert(name.to_owned(), valid.sections[name].clone());
    };
    for (name, section) in &valid.sections {
        add("no section".to_owned(), name, None);
        add("another type".to_owned(), name, Some(other_type(section)));
        add("an appended value".to_owned(), name, Some(longer(section)));
        let n = len(section);
        if n > 0 {
            // Each value is tried at one place only, because checkpoints are large.
            for (k, value) in hostile_values(section).into_iter().enumerate() {
                let at = [0, n / 2, n - 1][k % 3];
                add(format!("{value:?} at {at}"), name, Some(with_value(section, at, value)));
            }
        }
    }
}

fn len(section: &Section) -> usize {
    match section {
        Section::Integers(values) => values.len(),
        Section::Floats(values) => values.len(),
        Section::Doubles(values) => values.len(),
        Section::Bytes(values) => values.len(),
    }
}

fn other_type(section: &Section) -> Section {
    match section {
        Section::Integers(_) => Section::Floats(vec![0.0; len(section)]),
        _ => Section::Integers(vec![0; len(section)]),
    }
}

fn longer(section: &Section) -> Section {
    let mut section = section.clone();
    match &mut section {
        Section::Integers(values) => values.push(0),
        Section::Floats(values) => values.push(0.0),
        Section::Doubles(values) => values.push(0.0),
        Section::Bytes(values) => values.push(0),
    }
    section
}

/// Value of a section.
#[derive(Clone, Copy, Debug)]
enum SectionValue {
    Integer(u64),
    Float(f32),
    Double(f64),
}

/// Returns the values that no trainer writes.
fn hostile_values(section: &Section) -> Vec<SectionValue> {
    match section {
        Section::Integers(_) => [1 << 63, u64::MAX].map(SectionValue::Integer).to_vec(),
        Section::Floats(_) => {
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(SectionValue::Float).to_vec()
        }
        Section::Doubles(_) => {
            [f64::NAN, f64::INFINITY, -1.0, 2.0].map(SectionValue::Double).to_vec()
        }
        // A trainer may write any byte, so no byte is hostile.
        Section::Bytes(_) => Vec::new(),
    }
}

/// Returns a copy of a section with another value.
fn with_value(section: &Section, at: usize, value: SectionValue) -> Section {
    let mut section = section.clone();
    match (&mut section, value) {
        (Section::Integers(values), SectionValue::Integer(value)) => values[at] = value,
        (Section::Floats(values), SectionValue::Float(value)) => values[at] = value,
        (Section::Doubles(values), SectionValue::Double(value)) => values[at] = value,
        _ => unreachable!("the value is of the type of the section"),
    }
    section
}

/// Asserts that every number in the configuration of a trainer has bounds.
///
/// A written configuration states them. Any other value of a number is accepted within bounds, or
/// refused with key and bounds.
///
/// # Panics
/// If a number has no bounds, or an error message lacks key or bounds.
pub fn bounds_every_number<T: Trainer>() {
    let config = T::Config::default();
    let table = Table::try_from(&config).expect("the default configuration serializes to TOML");
    assert_eq!(bounds::unbounded(&table, T::BOUNDS), [""; 0], "numbers without bounds");
    let text = config_text::<T>(&config);
    parse_config::<T>(&text).unwrap_or_else(|e| panic!("defaults are refused: {e}"));
    let mut leaves = Vec::new();
    numbers(&Value::Table(table.clone()), &mut Vec::new(), &mut leaves);
    assert!(leaves.len() > 5, "{leaves:?}");
    let stated = text.lines().filter(|line| line.contains("  # ")).count();
    let lines = text.lines().filter(|line| is_number_line(line)).count();
    assert_eq!(stated, lines, "bounds are missing in {text}");
    for leaf in leaves {
        let mut n_refused = 0;
        for hostile in hostile_numbers() {
            let mut root = Value::Table(table.clone());
            set(&mut root, &leaf, hostile.clone());
            let text = toml::to_string(&root).expect("numbers serialize to TOML");
            let key = leaf.iter().rev().find(|step| step.parse::<usize>().is_err());
            let key = key.expect("every number has a key");
            if let Err(problem) = parse_config::<T>(&text) {
                n_refused += 1;
                let names = problem.contains(key.as_str()) && problem.contains(" to ");
                assert!(names, "{} = {hostile}: {problem}", leaf.join("."));
                assert!(!problem.contains('\n'), "{problem}");
            }
        }
        // NaN, infinity and 1e308 are out of bounds for every key.
        assert!(n_refused >= 3, "{} takes {} hostile values", leaf.join("."), n_refused);
    }
}

fn hostile_numbers() -> Vec<Value> {
    let reals = [f64::NAN, f64::INFINITY, -1.0, 1e308, -1e308, 1e-308, 2.5].map(Value::Float);
    let integers = [-1, 0, 1 << 32, i64::MAX, i64::MIN].map(Value::Integer);
    reals.into_iter().chain(integers).collect()
}

fn is_number_line(line: &str) -> bool {
    let value = line.split_once(" = ").map_or("", |(_, value)| value.trim_start_matches('['));
    value.starts_with(|c: char| c.is_ascii_digit() || c == '-')
}

/// Collects the paths of all numbers, by keys and list indices.
fn numbers(value: &Value, path: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    let mut inner = |step: String, value: &Value| {
        path.push(step);
        numbers(value, path, found);
        path.pop();
    };
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| inner(key.clone(), value)),
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(k, value)| inner(k.to_string(), value));
        }
        Value::Integer(_) | Value::Float(_) => found.push(path.clone()),
        _ => {}
    }
}

fn set(value: &mut Value, path: &[String], to: Value) {
    let Some((first, rest)) = path.split_first() else {
        *value = to;
        return;
    };
    let inner = match value {
        Value::Array(values) => first.parse().ok().and_then(|k: usize| values.get_mut(k)),
        value => value.get_mut(first.as_str()),
    };
    set(inner.expect("the path is one of the table's"), rest, to);
}

/// Checks one table of a configuration, given its header and its renamed keys: old key, current key
/// and a value other than the default. The old key must be read as the current one; both at once and
/// an unknown key must be refused with one clear line.
///
/// # Panics
/// If a check fails.
pub fn check_renamed_keys<T: Trainer<Config: PartialEq + Debug + Default>>(
    header: &str,
    keys: &[(&str, &str, &str)],
) {
    let problem = |text: &str| {
        let problem = parse_config::<T>(text).unwrap_err();
        assert!(!problem.contains('\n'), "{problem}");
        problem
    };
    for (old, current, value) in keys {
        let old_text = format!("{header}{old} = {value}\n");
        let parsed = parse_config::<T>(&old_text).unwrap_or_else(|e| panic!("{old}: {e}"));
        assert_eq!(parsed, parse_config::<T>(&format!("{header}{current} = {value}\n")).unwrap());
        assert_ne!(parsed, T::Config::default(), "{old} has an effect");
        let both = problem(&format!("{old_text}{current} = {value}\n"));
        let expected =
            format!("duplicate field `{current}`: it is set under its current and under");
        assert!(both.contains(&expected), "{both}");
    }
    let unknown = problem(&format!("{header}no_such_key = 1\n"));
    assert!(unknown.contains("unknown field `no_such_key`"), "{unknown}");
}
