//! What a pixel can be of: a class of the catalogue, people among them, or nothing that is named.

use chaic_core::ClassId;

/// What is no thing: structure, the ground, the sky.
pub const BACKGROUND: u8 = 0;

/// How many labels there are.
pub fn n_labels() -> usize {
    1 + ClassId::all().count()
}

/// The label of a class.
pub fn label_of(class: Option<ClassId>) -> u8 {
    class.map_or(BACKGROUND, |class| 1 + class.index() as u8)
}

/// The class of a label; `None` of the background.
pub fn class_of(label: u8) -> Option<ClassId> {
    ClassId::all().nth(usize::from(label).checked_sub(1)?)
}

/// Half the largest extent of each label's class, metres: what offsets to the middle of a thing are
/// told in.
pub fn half_extents_m() -> Vec<f32> {
    let half = |class: ClassId| 0.5 * class.info().size_m.into_iter().fold(0.05, f32::max);
    std::iter::once(1.0).chain(ClassId::all().map(half)).collect()
}
