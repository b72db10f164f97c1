//! Bounds of the numbers in a configuration.
//!
//! Each training has one [`BoundTable`]. It validates configurations, and its bounds are written as
//! comments into `config.toml`.

use std::fmt;

use toml::{Table, Value};

/// Bounds of a number, a list or a table in a configuration. Both ends are allowed.
#[derive(Clone, Copy, Debug)]
pub enum Bound {
    /// Bounds of an integer.
    Integer {
        /// Smallest value.
        lower: i64,
        /// Largest value.
        upper: i64,
    },
    /// Bounds of a real number; NaN is out of bounds.
    Real {
        /// Smallest value.
        lower: f64,
        /// Largest value.
        upper: f64,
    },
    /// Bounds of each element of a list of fixed length.
    List(&'static [Bound]),
    /// Bounds of a table, or of each table in a list.
    Table(BoundTable),
}

/// Keys of a table with their bounds. Keys without numbers are absent.
pub type BoundTable = &'static [(&'static str, Bound)];

/// Returns the bounds of an integer.
pub const fn integer(lower: i64, upper: i64) -> Bound {
    Bound::Integer { lower, upper }
}

/// Returns the bounds of a real number.
pub const fn real(lower: f64, upper: f64) -> Bound {
    Bound::Real { lower, upper }
}

/// Bounds of a fraction.
pub const FRACTION: Bound = real(0.0, 1.0);
/// Bounds of a seed: all non-negative integers of TOML.
pub const SEED: Bound = integer(0, i64::MAX);
/// Maximum number of training steps; at a thousand steps a second they take twelve days.
pub const MAX_STEPS: u64 = 1_000_000_000;
/// Bounds of the number of training steps.
pub const STEPS: Bound = integer(1, MAX_STEPS as i64);
/// Bounds of a learning rate. AdamW changes each parameter by about the learning rate per step, and
/// the magnitude of parameters is about 1.
pub const LEARNING_RATE: Bound = real(0.0, 1.0);
/// Bounds of the number of shards. Each shard is a thread with a gradient buffer.
pub const SHARDS: Bound = integer(1, 256);
/// Bounds of [`AdamWConfig`](chaic_nn::AdamWConfig). The betas must be below 1: at 1, bias
/// correction divides by 0.
pub const ADAM: Bound = Bound::Table(&[
    ("beta1", real(0.0, 0.9999)),
    ("beta2", real(0.0, 0.99999)),
    ("epsilon", real(1e-12, 1.0)),
    ("weight_decay", real(0.0, 1.0)),
    ("max_grad_norm", real(1e-6, 1e6)),
]);

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bound::Integer { lower, upper } => write!(f, "{lower} to {upper}"),
            Bound::Real { lower, upper } => {
                write!(f, "{} to {}", format_number(*lower), format_number(*upper))
            }
            Bound::List(bounds) => {
                let bounds: Vec<String> = bounds.iter().map(Bound::to_string).collect();
                f.write_str(&bounds.join(", "))
            }
            Bound::Table(_) => Ok(()),
        }
    }
}

/// Formats a number as TOML does, in scientific notation if it is very small or large.
fn format_number(x: f64) -> String {
    let is_plain = x == 0.0 || (1e-3..1e7).contains(&x.abs());
    if is_plain { x.to_string() } else { format!("{x:e}").to_lowercase() }
}

impl Bound {
    /// Returns whether a number is within bounds; `None` if the value has another type.
    fn allows(self, value: &Value) -> Option<bool> {
        Some(match (self, value) {
            (Bound::Integer { lower, upper }, Value::Integer(n)) => (lower..=upper).contains(n),
            (Bound::Integer { .. }, Value::Float(_)) => false,
            // Configurations hold single-precision numbers, so bounds are compared in single
            // precision.
            (Bound::Real { lower, upper }, Value::Float(x)) => {
                (lower as f32..=upper as f32).contains(&(*x as f32))
            }
            (Bound::Real { lower, upper }, Value::Integer(n)) => {
                (lower..=upper).contains(&(*n as f64))
            }
            _ => return None,
        })
    }
}

/// Checks the numbers of a configuration.
///
/// # Errors
/// One line that names the first key that is out of bounds, its value and its bounds.
pub fn check(table: &Table, bounds: BoundTable) -> Result<(), String> {
    check_table(table, bounds, "")
}

fn check_table(table: &Table, bounds: BoundTable, prefix: &str) -> Result<(), String> {
    for (key, bound) in bounds {
        if let Some(value) = table.get(*key) {
            check_value(value, *bound, &format!("{prefix}{key}"))?;
        }
    }
    Ok(())
}

fn check_value(value: &Value, bound: Bound, path: &str) -> Result<(), String> {
    match (bound, value) {
        (Bound::Table(bounds), Value::Table(table)) => {
            check_table(table, bounds, &format!("{path}."))
        }
        (Bound::List(bounds), Value::Array(values)) => {
            let pairs = values.iter().zip(bounds).enumerate();
            for (k, (value, bound)) in pairs {
                check_value(value, *bound, &format!("{path}[{k}]"))?;
            }
            Ok(())
        }
        (_, Value::Array(values)) => {
            for (k, value) in values.iter().enumerate() {
                check_value(value, bound, &format!("{path}[{k}]"))?;
            }
            Ok(())
        }
        _ if bound.allows(value) == Some(false) => {
            let value = value.as_float().map_or_else(|| value.to_string(), format_number);
            let kind = if matches!(bound, Bound::Integer { .. }) { "an integer " } else { "" };
            Err(format!("`{path}` is {value}; it must be {kind}from {bound}"))
        }
        // The parser refuses values of another type.
        _ => Ok(()),
    }
}

/// Returns the bounds of a key, given its path of tables.
fn find(bounds: BoundTable, path: &[&str]) -> Option<Bound> {
    let (first, rest) = path.split_first()?;
    let (_, bound) = bounds.iter().find(|(key, _)| key == first)?;
    match (bound, rest) {
        (Bound::Table(inner), [_, ..]) => find(inner, rest),
        (bound, []) => Some(*bound),
        _ => None,
    }
}

/// Appends the bounds of each number as a comment to its line of a configuration in `toml`'s
/// format.
pub fn annotate(text: &str, bounds: BoundTable) -> String {
    let mut section: Vec<&str> = Vec::new();
    let mut annotated = String::new();
    for line in text.lines() {
        annotated += line;
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']).split('.').collect();
        } else if let Some((key, _)) = line.split_once(" = ") {
            let path: Vec<&str> = section.iter().copied().chain([key]).collect();
            if let Some(bound) = find(bounds, &path) {
                annotated += &format!("  # {bound}");
            }
        }
        annotated.push('\n');
    }
    annotated
}

/// Returns the paths of all numbers in a configuration that have no bounds.
pub fn unbounded(table: &Table, bounds: BoundTable) -> Vec<String> {
    let mut found = Vec::new();
    for (key, value) in table {
        let bound = bounds.iter().find(|(name, _)| name == key).map(|(_, bound)| *bound);
        collect_unbounded(value, bound, key, &mut found);
    }
    found
}

fn collect_unbounded(value: &Value, bound: Option<Bound>, path: &str, found: &mut Vec<String>) {
    match (value, bound) {
        (Value::Table(table), bound) => {
            let inner: BoundTable = if let Some(Bound::Table(inner)) = bound { inner } else { &[] };
            found.extend(unbounded(table, inner).into_iter().map(|key| format!("{path}.{key}")));
        }
        (Value::Array(values), Some(Bound::List(bounds))) => {
            for (k, value) in values.iter().enumerate() {
                collect_unbounded(value, bounds.get(k).copied(), path, found);
            }
        }
        (Value::Array(values), bound) => {
            values.iter().for_each(|value| collect_unbounded(value, bound, path, found));
        }
        (Value::Integer(_) | Value::Float(_), bound)
            if bound.and_then(|bound| bound.allows(value)).is_none() =>
        {
            found.push(path.to_owned());
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: BoundTable = &[
        ("steps", integer(1, 100)),
        ("rate", real(0.0, 1e-4)),
        ("pair", Bound::List(&[real(0.0, 1.0), real(1.0, 10.0)])),
        ("all", real(0.0, 1.0)),
        ("inner", Bound::Table(&[("n", integer(0, 3))])),
        ("each", Bound::Table(&[("n", integer(0, 3))])),
    ];
    const TEXT: &str = "steps = 5\nrate = 0.0001\npair = [0.5, 2.0]\nall = [0.0, 1.0]\n\
                        name = \"x\"\n\n[inner]\nn = 1\n\n[[each]]\nn = 2\n\n[[each]]\nn = 3\n";

    fn problem(text: &str) -> Option<String> {
        check(&text.parse().unwrap(), BOUNDS).err()
    }

    #[test]
    fn numbers_out_of_bounds_are_refused_with_key_and_bounds() {
        assert_eq!(problem(TEXT), None);
        for (text, expected) in [
            ("steps = 0", "`steps` is 0; it must be an integer from 1 to 100"),
            ("steps = 2.5", "`steps` is 2.5; it must be an integer from 1 to 100"),
            ("rate = nan", "`rate` is nan; it must be from 0 to 1e-4"),
            ("rate = -1", "`rate` is -1; it must be from 0 to 1e-4"),
            ("rate = 1e308", "`rate` is 1e308; it must be from 0 to 1e-4"),
            ("pair = [0.5, 0.5]", "`pair[1]` is 0.5; it must be from 1 to 10"),
            ("all = [0.5, 2]", "`all[1]` is 2; it must be from 0 to 1"),
            ("[inner]\nn = -1", "`inner.n` is -1; it must be an integer from 0 to 3"),
            ("[[each]]\n[[each]]\nn = 4", "`each[1].n` is 4; it must be an integer from 0 to 3"),
        ] {
            assert_eq!(problem(text).as_deref(), Some(expected));
        }
        assert_eq!(problem("rate = \"fast\""), None, "the parser checks types");
    }

    #[test]
    fn an_annotated_configuration_states_its_bounds_and_parses_to_the_same_values() {
        let annotated = annotate(TEXT, BOUNDS);
        for line in
            ["steps = 5  # 1 to 100", "pair = [0.5, 2.0]  # 0 to 1, 1 to 10", "n = 3  # 0 to 3"]
        {
            assert!(annotated.contains(line), "{annotated}");
        }
        assert_eq!(annotated.parse::<Table>().unwrap(), TEXT.parse::<Table>().unwrap());
    }

    #[test]
    fn numbers_without_bounds_are_found() {
        assert_eq!(unbounded(&TEXT.parse().unwrap(), BOUNDS), [""; 0]);
        let more = format!("more = 1\n{TEXT}\n[other]\nx = [1.0]\n");
        assert_eq!(unbounded(&more.parse().unwrap(), BOUNDS), ["more", "other.x"]);
    }
}
