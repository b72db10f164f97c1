//! Furniture of a kitchen, listed among the furniture of a house.

use super::shape::{
    BLACK, DARK_STEEL, FURNISHING, GLASS, GLOSSY_BLACK, LACQUER, Paint, STEEL, cuboid, cylinder,
    in_meters, rod_x, rod_z,
};
use super::{ClassInfo, Finish, Part};

const REFRIGERATOR_M: [f32; 3] = [0.9, 1.78, 0.75];
pub(super) const REFRIGERATOR: ClassInfo = ClassInfo {
    name: "refrigerator",
    label: "refrigerator",
    original_model: Some("fridge_large_composite"),
    detector_index: Some(49),
    size_m: REFRIGERATOR_M,
    mass_kg: 110.0,
    parts: &in_meters(
        REFRIGERATOR_M,
        [
            cuboid([0.0, 0.05, 0.04], [0.9, 1.73, 0.67], Paint([206, 210, 214], Finish::Glossy))
                .surface(),
            cuboid([0.0, 0.0, 0.06], [0.84, 0.05, 0.58], BLACK).non_colliding(),
            cuboid([0.0, 0.06, -0.32], [0.89, 1.1, 0.06], LACQUER).non_colliding(),
            cuboid([0.0, 1.18, -0.32], [0.89, 0.59, 0.06], LACQUER).non_colliding(),
            cylinder([-0.38, 0.61, -0.36], [0.026, 0.5, 0.026], STEEL).non_colliding(),
            cylinder([-0.38, 1.22, -0.36], [0.026, 0.32, 0.026], STEEL).non_colliding(),
            cuboid([0.16, 1.4, -0.3525], [0.2, 0.1, 0.01], GLASS).non_colliding(),
        ],
    ),
    ..FURNISHING
};

const STONE_TOP: Paint = Paint([74, 76, 80], Finish::Glossy);

/// A door of the kitchen counter.
const fn counter_door(x: f32) -> Part {
    cuboid([x, 0.11, -0.265], [0.43, 0.56, 0.02], LACQUER).non_colliding()
}

/// A drawer of the kitchen counter.
const fn counter_drawer(x: f32) -> Part {
    cuboid([x, 0.69, -0.265], [0.43, 0.15, 0.02], LACQUER).non_colliding()
}

/// The handle of a door or drawer.
const fn counter_handle(x: f32, y: f32) -> Part {
    rod_x([x, y, -0.28], 0.18, 0.016, STEEL).non_colliding()
}

const KITCHEN_COUNTER_M: [f32; 3] = [1.8, 0.9, 0.6];
pub(super) const KITCHEN_COUNTER: ClassInfo = ClassInfo {
    name: "kitchen_counter",
    label: "kitchen counter",
    size_m: KITCHEN_COUNTER_M,
    mass_kg: 120.0,
    parts: &in_meters(
        KITCHEN_COUNTER_M,
        [
            cuboid([0.0, 0.86, 0.0], [1.8, 0.04, 0.6], STONE_TOP).surface(),
            cuboid([0.0, 0.1, 0.02], [1.8, 0.76, 0.55], Paint([206, 204, 198], Finish::Matte)),
            cuboid([0.0, 0.0, 0.05], [1.76, 0.1, 0.48], BLACK),
            counter_door(-0.67),
            counter_door(-0.223),
            counter_door(0.223),
            counter_door(0.67),
            counter_drawer(-0.67),
            counter_drawer(-0.223),
            counter_drawer(0.223),
            counter_drawer(0.67),
            counter_handle(-0.67, 0.765),
            counter_handle(-0.223, 0.765),
            counter_handle(0.223, 0.765),
            counter_handle(0.67, 0.765),
            counter_handle(-0.67, 0.63),
            counter_handle(-0.223, 0.63),
            counter_handle(0.223, 0.63),
            counter_handle(0.67, 0.63),
        ],
    ),
    palette: &[[74, 76, 80], [196, 186, 170], [166, 124, 80]],
    ..FURNISHING
};

/// A hotplate of the stove.
const fn hotplate(x: f32, z: f32, width_m: f32) -> Part {
    cylinder([x, 0.885, z], [width_m, 0.014, width_m], DARK_STEEL).non_colliding()
}

/// A knob of the stove.
const fn stove_knob(x: f32) -> Part {
    rod_z([x, 0.81, -0.285], 0.03, 0.045, STEEL).non_colliding()
}

const STOVE_M: [f32; 3] = [0.6, 0.9, 0.6];
pub(super) const STOVE: ClassInfo = ClassInfo {
    name: "stove",
    label: "stove",
    size_m: STOVE_M,
    mass_kg: 55.0,
    parts: &in_meters(
        STOVE_M,
        [
            cuboid([0.0, 0.0, 0.02], [0.6, 0.87, 0.56], LACQUER),
            cuboid([0.0, 0.87, 0.02], [0.6, 0.02, 0.56], GLOSSY_BLACK),
            hotplate(-0.14, -0.12, 0.2),
            hotplate(0.14, -0.12, 0.16),
            hotplate(-0.14, 0.16, 0.16),
            hotplate(0.14, 0.16, 0.2),
            cuboid([0.0, 0.75, -0.26], [0.6, 0.12, 0.02], BLACK).non_colliding(),
            stove_knob(-0.21),
            stove_knob(-0.07),
            stove_knob(0.07),
            stove_knob(0.21),
            cuboid([0.0, 0.2, -0.265], [0.54, 0.5, 0.02], DARK_STEEL).non_colliding(),
            cuboid([0.0, 0.26, -0.27], [0.42, 0.3, 0.02], GLASS).non_colliding(),
            rod_x([0.0, 0.64, -0.285], 0.46, 0.024, STEEL).non_colliding(),
        ],
    ),
    ..FURNISHING
};
