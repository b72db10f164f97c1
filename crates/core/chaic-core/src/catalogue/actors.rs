//! People, as a class for perception. The renderer draws their articulated bodies from their
//! posture, so they have no fixed shape here.

use super::{ClassInfo, Role};

pub(super) const CLASSES: &[ClassInfo] = &[ClassInfo {
    name: "person",
    label: "person",
    original_model: None,
    detector_index: None,
    role: Role::Person,
    sets: &[],
    size_m: [0.5, 1.75, 0.35],
    mass_kg: 70.0,
    parts: &[],
    palette: &[],
}];
