//! Obstacles, which block a doorway until an agent removes them.

use super::shape::{
    BLACK, BRASS, DARK_STEEL, FURNISHING, Paint, WHITE, arc, ball, cuboid, cylinder, in_meters,
    ring, rod_z, round_tub, taper,
};
use super::{ClassInfo, Finish, Role};

pub(super) const CLASSES: &[ClassInfo] = &[TRASHBIN, BRIGHT_FIRE_EXTINGUISHER];

const OBSTACLE: ClassInfo = ClassInfo { role: Role::Obstacle, ..FURNISHING };
const PAPER: Paint = Paint([238, 236, 228], Finish::Matte);

const BIN_GRAY: Paint = Paint([142, 148, 152], Finish::Metal);

const TRASHBIN_M: [f32; 3] = [0.48, 0.57, 0.48];
const TRASHBIN: ClassInfo = ClassInfo {
    name: "trashbin",
    label: "trashbin",
    original_model: Some("trashbin"),
    detector_index: Some(51),
    size_m: TRASHBIN_M,
    mass_kg: 33.0,
    parts: &in_meters(
        TRASHBIN_M,
        [
            round_tub([0.0, 0.0, 0.0], [0.46, 0.55, 0.46], 0.014, 0.76, BIN_GRAY),
            ring([0.0, 0.545, 0.0], 0.48, 0.03, DARK_STEEL).non_colliding(),
            ring([0.0, 0.03, 0.0], 0.376, 0.03, DARK_STEEL).non_colliding(),
            cylinder([0.0, 0.02, 0.0], [0.36, 0.36, 0.36], BLACK).non_colliding(),
            ball([-0.09, 0.34, -0.05], [0.17, 0.16, 0.16], PAPER).non_colliding(),
            ball([0.08, 0.35, 0.06], [0.18, 0.16, 0.17], PAPER).non_colliding(),
            ball([0.06, 0.34, -0.1], [0.12, 0.12, 0.12], Paint([206, 176, 120], Finish::Matte))
                .non_colliding(),
        ],
    ),
    ..OBSTACLE
};

const EXTINGUISHER_RED: Paint = Paint([214, 28, 30], Finish::Glossy);

const BRIGHT_FIRE_EXTINGUISHER_M: [f32; 3] = [0.28, 1.06, 0.43];
const BRIGHT_FIRE_EXTINGUISHER: ClassInfo = ClassInfo {
    name: "bright_fire_extinguisher",
    label: "fire extinguisher",
    original_model: Some("b05_fire_extinguisher"),
    detector_index: Some(52),
    size_m: BRIGHT_FIRE_EXTINGUISHER_M,
    mass_kg: 68.0,
    parts: &in_meters(
        BRIGHT_FIRE_EXTINGUISHER_M,
        [
            cylinder([0.0, 0.03, 0.06], [0.27, 0.7, 0.27], EXTINGUISHER_RED),
            ball([0.0, 0.6, 0.06], [0.27, 0.26, 0.27], EXTINGUISHER_RED),
            cylinder([0.0, 0.0, 0.06], [0.28, 0.05, 0.28], BLACK),
            cylinder([0.0, 0.83, 0.06], [0.075, 0.19, 0.075], BRASS).non_colliding(),
            cuboid([0.0, 0.94, -0.02], [0.04, 0.03, 0.24], BLACK).non_colliding(),
            cuboid([0.0, 1.005, -0.01], [0.04, 0.026, 0.26], BLACK)
                .turned([9.0, 0.0, 0.0])
                .non_colliding(),
            rod_z([0.0, 0.89, 0.01], 0.03, 0.07, WHITE).non_colliding(),
            arc([0.0, 0.79, -0.07], 0.26, 0.032, 190.0, BLACK).turned([40.0, 0.0, 90.0]),
            taper(0.5, [0.0, 0.4, -0.165], [0.075, 0.34, 0.075], BLACK).non_colliding(),
            cuboid([0.0, 0.32, -0.072], [0.17, 0.24, 0.012], WHITE).non_colliding(),
            cuboid([0.0, 0.47, -0.074], [0.17, 0.05, 0.012], EXTINGUISHER_RED).non_colliding(),
        ],
    ),
    ..OBSTACLE
};
