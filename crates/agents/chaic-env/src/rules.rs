//! Rules of a run: those of the world and of the planners, as named sets with overrides of single rules.

use std::fmt;
use std::str::FromStr;

pub(crate) mod renamed;

pub use chaic_agents::PlannerRules;
pub use chaic_world::Rules;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{EnvError, Result};

/// Largest duration of a part of an action, frames: over three times an episode of the paper.
const MAX_DURATION: f32 = 10_000.0;
/// Largest value of the other rules: the longest horizon of an episode, frames.
const MAX_VALUE: f32 = 1e6;
/// Bounds of rules by the end of their names. The first entry that matches applies.
const RULE_BOUNDS: [(&str, f32, f32); 9] = [
    // Planners divide by both.
    ("world.turn_rad", 0.01, std::f32::consts::PI),
    ("world.stride_m", 0.01, 10.0),
    // Opening a hand releases the object in its last frame.
    ("world.durations.open_hand", 1.0, MAX_DURATION),
    ("world.fall_step_s", 0.001, 0.1),
    ("world.break_chance_low", 0.0, 1.0),
    ("world.break_chance_high", 0.0, 1.0),
    ("planner.child.escape_probability", 0.0, 1.0),
    // Success probabilities are exp(-delta / alpha) / beta.
    ("_penalty.alpha", 0.001, MAX_VALUE),
    ("_penalty.beta", 1.0, MAX_VALUE),
];

/// Name of a rule set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RuleSetName {
    /// Rules of the paper.
    Paper,
    /// Rules of the original's released code.
    Compat,
}

/// All rules of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RuleSet {
    /// Set, before overrides.
    pub name: RuleSetName,
    /// Rules of the world.
    pub world: Rules,
    /// Rules of the planners.
    pub planner: PlannerRules,
}

impl RuleSet {
    /// Rules of the paper.
    pub const PAPER: RuleSet =
        RuleSet { name: RuleSetName::Paper, world: Rules::paper(), planner: PlannerRules::paper() };

    /// Rules of the original code.
    pub const COMPAT: RuleSet = RuleSet {
        name: RuleSetName::Compat,
        world: Rules::compat(),
        planner: PlannerRules::compat(),
    };

    /// Returns the set of this name.
    pub const fn named(name: RuleSetName) -> RuleSet {
        match name {
            RuleSetName::Paper => RuleSet::PAPER,
            RuleSetName::Compat => RuleSet::COMPAT,
        }
    }

    /// Returns the set with one rule changed by `NAME=VALUE`, such as `world.failed_put_on_can_deliver=true`. The
    /// values `paper` and `compat` copy the rule of that set.
    ///
    /// # Errors
    /// [`EnvError::Rule`] with all names, or with the problem of the value.
    ///
    /// ```
    /// use chaic_env::rules::RuleSet;
    /// let rules = RuleSet::PAPER.with("planner.exploration=sampled")?;
    /// assert_eq!(RuleSet::COMPAT.planner.exploration, rules.planner.exploration);
    /// assert!(RuleSet::PAPER.with("world.gravity=0").is_err());
    /// # Ok::<(), chaic_env::EnvError>(())
    /// ```
    pub fn with(self, setting: &str) -> Result<RuleSet> {
        let wrong = |problem| EnvError::Rule { setting: setting.to_owned(), problem };
        let (name, text) =
            setting.split_once('=').ok_or_else(|| wrong("expected NAME=VALUE".to_owned()))?;
        let pointer = format!("/{}", name.replace('.', "/"));
        let mut all = self.to_value();
        let old = all.pointer(&pointer).filter(|_| name != "name");
        let old = old.ok_or_else(|| match renamed::current_name(name) {
            Some(current) => wrong(format!("the rule is now called `{current}`")),
            None => wrong(format!("no rule `{name}`; the rules are {}", rule_names().join(", "))),
        })?;
        let named_set = text.parse().ok().map(|set| RuleSet::named(set).to_value());
        let new = match named_set.as_ref().and_then(|set| set.pointer(&pointer)) {
            Some(value) => value.clone(),
            None if old.is_string() => Value::String(text.to_owned()),
            None => serde_json::from_str(text).map_err(|_| wrong(expected(old)))?,
        };
        let hint = expected(old);
        if let Some(value) = all.pointer_mut(&pointer) {
            *value = new;
        }
        let changed: RuleSet =
            serde_json::from_value(all).map_err(|e| wrong(format!("{hint}: {e}")))?;
        changed.check().map_err(wrong)?;
        Ok(changed)
    }

    /// Returns the set with one rule changed as [`RuleSet::with`] does. The rule may have the name of an
    /// earlier version, as in recorded options.
    ///
    /// # Errors
    /// Those of [`RuleSet::with`].
    pub fn with_recorded(self, setting: &str) -> Result<RuleSet> {
        let renamed = setting.split_once('=').and_then(|(name, value)| {
            renamed::current_name(name).map(|name| format!("{name}={value}"))
        });
        self.with(renamed.as_deref().unwrap_or(setting))
    }

    /// Checks the bounds of all numbers.
    ///
    /// # Errors
    /// One sentence that names the rule and its bounds.
    pub fn check(&self) -> std::result::Result<(), String> {
        let all = self.to_value();
        for name in rule_names() {
            let Some(rule) = all.pointer(&format!("/{}", name.replace('.', "/"))) else { continue };
            let (min, max) = bounds(&name);
            // Numbers that are not finite are null in JSON.
            let is_allowed = match rule {
                Value::Number(value) => {
                    value.as_f64().is_some_and(|v| (min..=max).contains(&(v as f32)))
                }
                other => !other.is_null(),
            };
            if !is_allowed {
                return Err(format!("`{name}` is from {min} to {max}"));
            }
        }
        Ok(())
    }

    fn to_value(self) -> Value {
        serde_json::to_value(self).expect("rules have string keys and finite numbers")
    }
}

/// Returns minimum and maximum of a rule that is a number.
fn bounds(name: &str) -> (f32, f32) {
    let stated = RULE_BOUNDS.iter().find(|(end, ..)| name.ends_with(end));
    match stated {
        Some((_, min, max)) => (*min, *max),
        None if name.starts_with("world.durations.") => (0.0, MAX_DURATION),
        None => (0.0, MAX_VALUE),
    }
}

fn expected(old: &Value) -> String {
    format!("expected paper, compat or a value like {old}")
}

/// Returns the names of all rules, as `--set` takes them.
pub fn rule_names() -> Vec<String> {
    fn collect(prefix: &str, value: &Value, names: &mut Vec<String>) {
        match value {
            Value::Object(fields) => {
                for (field, value) in fields {
                    collect(&format!("{prefix}.{field}"), value, names);
                }
            }
            _ => names.push(prefix.to_owned()),
        }
    }
    let all = RuleSet::PAPER.to_value();
    let mut names = Vec::new();
    for part in ["world", "planner"] {
        collect(part, &all[part], &mut names);
    }
    names
}

/// Returns the names of the rules that differ between the two sets.
pub fn differing_rules() -> Vec<String> {
    let (paper, compat) = (RuleSet::PAPER.to_value(), RuleSet::COMPAT.to_value());
    let differs = |name: &String| {
        let pointer = format!("/{}", name.replace('.', "/"));
        paper.pointer(&pointer) != compat.pointer(&pointer)
    };
    rule_names().into_iter().filter(differs).collect()
}

/// Returns the value of a rule in both sets, the paper's first, as `--set` takes it.
///
/// # Errors
/// [`EnvError::UnknownRule`] with all names.
pub fn rule_values(name: &str) -> Result<(String, String)> {
    let pointer = format!("/{}", name.replace('.', "/"));
    let value_in = |set: RuleSet| {
        let value = set.to_value().pointer(&pointer).filter(|v| !v.is_object()).cloned();
        value.map(|v| match &v {
            Value::String(text) => text.clone(),
            // Rules have single precision: print no digits of a double.
            Value::Number(n) if n.is_f64() => format!("{:?}", n.as_f64().unwrap_or(0.0) as f32),
            other => other.to_string(),
        })
    };
    let values = value_in(RuleSet::PAPER).zip(value_in(RuleSet::COMPAT)).filter(|_| name != "name");
    values.ok_or_else(|| {
        let known = rule_names();
        EnvError::UnknownRule { name: name.to_owned(), known }
    })
}

impl RuleSetName {
    /// Returns the name on the command line.
    pub fn as_str(self) -> &'static str {
        match self {
            RuleSetName::Paper => "paper",
            RuleSetName::Compat => "compat",
        }
    }
}

impl fmt::Display for RuleSetName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl FromStr for RuleSetName {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<RuleSetName, String> {
        match text {
            "paper" => Ok(RuleSetName::Paper),
            "compat" => Ok(RuleSetName::Compat),
            _ => Err(format!("unknown rules `{text}`; they are paper and compat")),
        }
    }
}

#[cfg(test)]
mod tests;
