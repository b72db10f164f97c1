//! Labels of pixels: a class of the catalogue, which includes people, or the background.

use chaic_core::ClassId;

/// Label of structure, ground and sky.
pub const BACKGROUND: u8 = 0;

/// Number of labels.
pub fn n_labels() -> usize {
    1 + ClassId::all().count()
}

/// Returns the label of a class.
pub fn label_of(class: Option<ClassId>) -> u8 {
    class.map_or(BACKGROUND, |class| 1 + class.index() as u8)
}

/// Returns the class of a label; `None` for the background.
pub fn class_of(label: u8) -> Option<ClassId> {
    ClassId::all().nth(usize::from(label).checked_sub(1)?)
}

/// Returns half the largest extent of each label's class, in meters. This is the unit of the
/// predicted offsets to object centers.
pub fn half_extents_m() -> Vec<f32> {
    let half = |class: ClassId| 0.5 * class.info().size_m.into_iter().fold(0.05, f32::max);
    std::iter::once(1.0).chain(ClassId::all().map(half)).collect()
}
