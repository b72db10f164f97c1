//! How quantities become numbers that a network reads, most of them between 0 and 1.

use chaic_core::catalogue::TargetSet;
use chaic_core::geom::math;

/// Sets that targets come from.
pub const SETS: [TargetSet; 8] = [
    TargetSet::Fruit,
    TargetSet::Bread,
    TargetSet::Work,
    TargetSet::School,
    TargetSet::ShopFruit,
    TargetSet::ShopBakery,
    TargetSet::ShopDrinks,
    TargetSet::Furniture,
];

/// What happened so many frames ago is fresh by 1/e.
const FRESH_FRAMES: f32 = 120.0;

/// 1 for yes.
pub fn flag(is_so: bool) -> f32 {
    f32::from(u8::from(is_so))
}

/// A share that rises from 0 to 1 as `x` grows to `most`.
pub fn share(x: f32, most: f32) -> f32 {
    (x / most).clamp(0.0, 1.0)
}

/// How fresh what happened so many frames ago is, 1 to 0.
pub fn fresh(age: u32) -> f32 {
    math::exp(-(age as f32) / FRESH_FRAMES)
}
