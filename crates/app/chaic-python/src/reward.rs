//! Rewards per action, with weights from Python.

use std::collections::BTreeMap;

use chaic_env::{RewardTerms, RewardWeights};
use pyo3::prelude::*;

use crate::error::value_error;

/// Access to the weight of a term.
type WeightField = fn(&mut RewardWeights) -> &mut f64;

/// Terms of a reward per action by their names in Python.
const FIELDS: [(&str, WeightField); 3] = [
    ("delivered", |weights| &mut weights.delivered),
    ("progress_per_m", |weights| &mut weights.progress_per_m),
    ("invalid", |weights| &mut weights.invalid),
];

/// Returns the default weights by name.
pub fn standard_weights() -> BTreeMap<&'static str, f64> {
    let mut weights = RewardWeights::STANDARD;
    FIELDS.iter().map(|(name, field)| (*name, *field(&mut weights))).collect()
}

/// Parses weights; missing terms have weight 0.
///
/// # Errors
/// `ValueError` for an unknown term.
pub fn parse_weights(by_name: &BTreeMap<String, f64>) -> PyResult<RewardWeights> {
    let mut weights = RewardWeights::NONE;
    for (name, weight) in by_name {
        let Some((_, field)) = FIELDS.iter().find(|(known, _)| known == name) else {
            let known = FIELDS.map(|(name, _)| name).join(", ");
            return Err(value_error(format!(
                "unknown reward term {name:?}; the terms are {known}"
            )));
        };
        *field(&mut weights) = *weight;
    }
    Ok(weights)
}

/// Returns the reward of an action: the weighted sum of its terms, as in `World.step` and `World.reward`.
/// The names of the weights are those of `REWARD`.
#[pyfunction]
pub fn weigh_reward(
    delivered: f64,
    progress_m: f64,
    is_invalid: bool,
    weights: BTreeMap<String, f64>,
) -> PyResult<f64> {
    let terms = RewardTerms { delivered, progress_m, is_invalid };
    Ok(terms.weighted_sum(&parse_weights(&weights)?))
}
