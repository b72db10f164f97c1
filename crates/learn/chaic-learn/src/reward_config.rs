//! Reward tables in configuration files. Each training accepts the terms that it can compute.

use chaic_env::RewardWeights;
use serde::{Deserialize, Serialize};

/// `[rollout.rewards]`: weights of a cumulative reward, for policies that choose plans.
#[derive(Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct CumulativeTable {
    #[serde(alias = "team")]
    delivered: f32,
    #[serde(alias = "own")]
    own_delivered: f32,
    held: f32,
    #[serde(alias = "way_per_m")]
    remaining_per_m: f32,
    failed: f32,
    emergency: f32,
}

impl Default for CumulativeTable {
    fn default() -> CumulativeTable {
        RewardWeights::CUMULATIVE.into()
    }
}

impl From<RewardWeights> for CumulativeTable {
    fn from(weights: RewardWeights) -> CumulativeTable {
        CumulativeTable {
            delivered: weights.delivered as f32,
            own_delivered: weights.own_delivered as f32,
            held: weights.held as f32,
            remaining_per_m: weights.remaining_per_m as f32,
            failed: weights.failed as f32,
            emergency: weights.emergency as f32,
        }
    }
}

impl From<CumulativeTable> for RewardWeights {
    fn from(table: CumulativeTable) -> RewardWeights {
        RewardWeights {
            delivered: f64::from(table.delivered),
            own_delivered: f64::from(table.own_delivered),
            held: f64::from(table.held),
            remaining_per_m: f64::from(table.remaining_per_m),
            failed: f64::from(table.failed),
            emergency: f64::from(table.emergency),
            ..RewardWeights::NONE
        }
    }
}

/// `[rewards]`: weights of a reward per action, for visual policies.
#[derive(Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ActionTable {
    delivered: f64,
    #[serde(alias = "approached_per_m")]
    progress_per_m: f64,
    invalid: f64,
}

impl Default for ActionTable {
    fn default() -> ActionTable {
        RewardWeights::STANDARD.into()
    }
}

impl From<RewardWeights> for ActionTable {
    fn from(weights: RewardWeights) -> ActionTable {
        let RewardWeights { delivered, progress_per_m, invalid, .. } = weights;
        ActionTable { delivered, progress_per_m, invalid }
    }
}

impl From<ActionTable> for RewardWeights {
    fn from(table: ActionTable) -> RewardWeights {
        let ActionTable { delivered, progress_per_m, invalid } = table;
        RewardWeights { delivered, progress_per_m, invalid, ..RewardWeights::NONE }
    }
}

/// Weights of a cumulative reward as a table, for `#[serde(with)]`.
pub(crate) mod cumulative {
    use chaic_env::RewardWeights;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    use super::CumulativeTable;

    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub(crate) fn serialize<S: Serializer>(
        weights: &RewardWeights,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        CumulativeTable::from(*weights).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<RewardWeights, D::Error> {
        CumulativeTable::deserialize(deserializer).map(RewardWeights::from)
    }
}

/// Weights of a reward per action as a table, for `#[serde(with)]`.
pub(crate) mod per_action {
    use chaic_env::RewardWeights;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    use super::ActionTable;

    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub(crate) fn serialize<S: Serializer>(
        weights: &RewardWeights,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        ActionTable::from(*weights).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<RewardWeights, D::Error> {
        ActionTable::deserialize(deserializer).map(RewardWeights::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_keys_of_cumulative_tables_get_their_defaults() {
        let table: CumulativeTable =
            serde_json::from_str(r#"{"delivered": 1, "remaining_per_m": 0.5}"#).unwrap();
        let expected =
            RewardWeights { delivered: 1.0, remaining_per_m: 0.5, ..RewardWeights::CUMULATIVE };
        assert_eq!(RewardWeights::from(table), expected);
        let text = serde_json::to_string(&CumulativeTable::default()).unwrap();
        let expected = r#"{"delivered":5.0,"own_delivered":5.0,"held":2.0,"remaining_per_m":0.0,"failed":0.0,"emergency":0.5}"#;
        assert_eq!(text, expected);
    }

    #[test]
    fn tables_of_earlier_versions_are_read() {
        let old: CumulativeTable =
            serde_json::from_str(r#"{"team": 1, "own": 2, "way_per_m": 0.5}"#).unwrap();
        let expected = RewardWeights {
            delivered: 1.0,
            own_delivered: 2.0,
            remaining_per_m: 0.5,
            ..RewardWeights::CUMULATIVE
        };
        assert_eq!(RewardWeights::from(old), expected);
        let old = r#"{"delivered": 10.0, "approached_per_m": 0.05, "invalid": 0.1}"#;
        let table: ActionTable = serde_json::from_str(old).unwrap();
        assert_eq!(RewardWeights::from(table), RewardWeights::STANDARD);
        assert!(serde_json::from_str::<ActionTable>(r#"{"team": 1.0}"#).is_err());
    }
}
