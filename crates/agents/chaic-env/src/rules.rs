//! The rules that a run is played by: the world's and the planners' together, by name, with single
//! rules set otherwise for experiments.

use std::fmt;
use std::str::FromStr;

pub use chaic_agents::PlannerRules;
pub use chaic_world::Rules;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{EnvError, Result};

/// Names a rule set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RuleSetName {
    /// What the paper says and means.
    Paper,
    /// What the original's released code does.
    Compat,
}

/// All rules of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RuleSet {
    /// Which set it is, or began as.
    pub name: RuleSetName,
    /// By which the world goes on.
    pub world: Rules,
    /// By which minds plan.
    pub planner: PlannerRules,
}

impl RuleSet {
    /// The paper's.
    pub const PAPER: RuleSet =
        RuleSet { name: RuleSetName::Paper, world: Rules::paper(), planner: PlannerRules::paper() };

    /// The original code's.
    pub const COMPAT: RuleSet = RuleSet {
        name: RuleSetName::Compat,
        world: Rules::compat(),
        planner: PlannerRules::compat(),
    };

    /// The set of this name.
    pub const fn named(name: RuleSetName) -> RuleSet {
        match name {
            RuleSetName::Paper => RuleSet::PAPER,
            RuleSetName::Compat => RuleSet::COMPAT,
        }
    }

    /// The same with one rule set otherwise by `NAME=VALUE`, for example
    /// `world.dropped_counts=true`; a VALUE of `paper` or `compat` takes that set's.
    ///
    /// # Errors
    /// [`EnvError::Rule`] that lists all names, or says what is wrong with the value.
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
        let old = old.ok_or_else(|| {
            wrong(format!("no rule `{name}`; the rules are {}", rule_names().join(", ")))
        })?;
        let of_set = text.parse().ok().map(|set| RuleSet::named(set).to_value());
        let new = match of_set.as_ref().and_then(|set| set.pointer(&pointer)) {
            Some(value) => value.clone(),
            None if old.is_string() => Value::String(text.to_owned()),
            None => serde_json::from_str(text).map_err(|_| wrong(expected(old)))?,
        };
        let hint = expected(old);
        if let Some(place) = all.pointer_mut(&pointer) {
            *place = new;
        }
        let made: RuleSet =
            serde_json::from_value(all).map_err(|e| wrong(format!("{hint}: {e}")))?;
        made.check_motion().map_err(wrong)?;
        Ok(made)
    }

    /// Planners divide by the length of a turn and of a step.
    fn check_motion(&self) -> std::result::Result<(), String> {
        let Rules { turn_rad, stride_m, .. } = self.world;
        for (name, value, most) in
            [("turn_rad", turn_rad, std::f32::consts::PI), ("stride_m", stride_m, 10.0)]
        {
            if !(0.01..=most).contains(&value) {
                return Err(format!("`world.{name}` is from 0.01 to {most:.2}"));
            }
        }
        Ok(())
    }

    fn to_value(self) -> Value {
        serde_json::to_value(self).expect("rules have string keys and finite numbers")
    }
}

fn expected(old: &Value) -> String {
    format!("expected paper, compat or a value like {old}")
}

/// The names of all single rules, as `--set` takes them.
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

/// The names of the rules in which the two sets differ.
pub fn differing_rules() -> Vec<String> {
    let (paper, compat) = (RuleSet::PAPER.to_value(), RuleSet::COMPAT.to_value());
    let differs = |name: &String| {
        let pointer = format!("/{}", name.replace('.', "/"));
        paper.pointer(&pointer) != compat.pointer(&pointer)
    };
    rule_names().into_iter().filter(differs).collect()
}

/// The value of a single rule in both sets, paper's first, as `--set` would take it.
///
/// # Errors
/// [`EnvError::Rule`] that lists all names.
pub fn rule_values(name: &str) -> Result<(String, String)> {
    let pointer = format!("/{}", name.replace('.', "/"));
    let of = |set: RuleSet| {
        let value = set.to_value().pointer(&pointer).filter(|v| !v.is_object()).cloned();
        value.map(|v| match &v {
            Value::String(text) => text.clone(),
            // Rules are single precision: without the digits that only a double has.
            Value::Number(n) if n.is_f64() => format!("{:?}", n.as_f64().unwrap_or(0.0) as f32),
            other => other.to_string(),
        })
    };
    let values = of(RuleSet::PAPER).zip(of(RuleSet::COMPAT)).filter(|_| name != "name");
    values.ok_or_else(|| {
        let known = rule_names();
        EnvError::UnknownRule { name: name.to_owned(), known }
    })
}

impl RuleSetName {
    /// The name in commands.
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
