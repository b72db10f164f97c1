//! Scaling of quantities to network inputs, mostly between 0 and 1.

use chaic_core::catalogue::TargetSet;
use chaic_core::geom::math;

/// Sets of target classes.
pub const TARGET_SETS: [TargetSet; 8] = [
    TargetSet::Fruit,
    TargetSet::Bread,
    TargetSet::Work,
    TargetSet::School,
    TargetSet::ShopFruit,
    TargetSet::ShopBakery,
    TargetSet::ShopDrinks,
    TargetSet::Furniture,
];

/// Scale of path lengths and distances between objects, meters: about a house.
pub const DISTANCE_SCALE_M: f32 = 20.0;
/// Scale of durations, frames: an episode.
pub const TIME_SCALE_FRAMES: f32 = 3000.0;
/// Frames after which [`recency`] falls to 1/e.
const RECENCY_FRAMES: f32 = 120.0;

/// Returns 1 for true and 0 for false.
pub fn flag(condition: bool) -> f32 {
    f32::from(u8::from(condition))
}

/// Returns `x / max`, clamped to 0..1.
pub fn normalize_clamped(x: f32, max: f32) -> f32 {
    (x / max).clamp(0.0, 1.0)
}

/// Mass at which [`log_mass`] saturates: more than the heaviest furniture, kilograms.
const MAX_MASS_KG: f32 = 1000.0;

/// Returns a mass on a logarithmic scale, 0 to 1.
pub fn log_mass(mass_kg: f32) -> f32 {
    normalize_clamped(math::ln(1.0 + mass_kg), math::ln(1.0 + MAX_MASS_KG))
}

/// Returns the recency of an event of this age in frames: 1 for now, falling exponentially to 0.
pub fn recency(age_frames: u32) -> f32 {
    math::exp(-(age_frames as f32) / RECENCY_FRAMES)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Furniture weighs 50 to 900 kg, and its value is its mass.
    #[test]
    fn masses_of_furniture_and_of_food_are_told_apart() {
        let features = [0.0, 0.2, 1.0, 50.0, 100.0, 400.0, 900.0].map(log_mass);
        assert!(features.is_sorted_by(|a, b| a + 0.02 < *b) && features[6] < 1.0, "{features:?}");
    }
}
