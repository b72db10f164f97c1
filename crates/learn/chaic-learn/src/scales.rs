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

/// Returns the recency of an event of this age in frames: 1 for now, falling exponentially to 0.
pub fn recency(age_frames: u32) -> f32 {
    math::exp(-(age_frames as f32) / RECENCY_FRAMES)
}
