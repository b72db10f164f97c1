//! Containers, which hold up to three targets and are carried in one hand.

use super::shape::{
    ARCH, ARCH_ALONG, Paint, TARGET, WHITE, arc, cuboid, cylinder, in_meters, ring, round_tub, tub,
};
use super::{ClassInfo, Finish, Part, Role};

pub(super) const CLASSES: &[ClassInfo] =
    &[BOWL, PLATE, TEA_TRAY, PLASTIC_BASKET, WICKER_BASKET, WOOD_BASKET, BAMBOO_BASKET];

const CONTAINER: ClassInfo = ClassInfo { role: Role::Container, ..TARGET };

const CLAY: Paint = Paint([208, 170, 122], Finish::Glossy);
const GLAZED_RIM: Paint = Paint([150, 104, 66], Finish::Glossy);

const BOWL_M: [f32; 3] = [0.42, 0.14, 0.42];
const BOWL: ClassInfo = ClassInfo {
    name: "bowl",
    label: "bowl",
    original_model: Some("b04_bowl_smooth"),
    detector_index: Some(0),
    size_m: BOWL_M,
    mass_kg: 0.9,
    parts: &in_meters(
        BOWL_M,
        [
            round_tub([0.0, 0.01, 0.0], [0.41, 0.13, 0.41], 0.014, 0.52, CLAY),
            cylinder([0.0, 0.0, 0.0], [0.19, 0.014, 0.19], CLAY).non_colliding(),
            ring([0.0, 0.131, 0.0], 0.42, 0.018, GLAZED_RIM).non_colliding(),
        ],
    ),
    palette: &[[208, 170, 122], [196, 202, 206], [96, 136, 150]],
    ..CONTAINER
};

const CHINA: Paint = Paint([238, 238, 232], Finish::Glossy);
const CHINA_BLUE: Paint = Paint([76, 112, 168], Finish::Glossy);

const PLATE_M: [f32; 3] = [0.43, 0.04, 0.43];
const PLATE: ClassInfo = ClassInfo {
    name: "plate",
    label: "plate",
    original_model: Some("plate06"),
    detector_index: Some(1),
    size_m: PLATE_M,
    mass_kg: 0.7,
    parts: &in_meters(
        PLATE_M,
        [
            cylinder([0.0, 0.0, 0.0], [0.34, 0.016, 0.34], CHINA),
            round_tub([0.0, 0.006, 0.0], [0.43, 0.034, 0.43], 0.012, 0.74, CHINA).non_colliding(),
            cylinder([0.0, 0.0, 0.0], [0.3, 0.0195, 0.3], CHINA_BLUE).non_colliding(),
            cylinder([0.0, 0.0, 0.0], [0.28, 0.02, 0.28], CHINA).non_colliding(),
        ],
    ),
    ..CONTAINER
};

const TRAY_WOOD: Paint = Paint([128, 82, 48], Finish::Wood);
const TRAY_RIM: Paint = Paint([98, 60, 36], Finish::Wood);

const TEA_TRAY_M: [f32; 3] = [0.45, 0.05, 0.32];
const TEA_TRAY: ClassInfo = ClassInfo {
    name: "tea_tray",
    label: "tea tray",
    original_model: Some("teatray"),
    detector_index: Some(2),
    size_m: TEA_TRAY_M,
    mass_kg: 0.7,
    parts: &in_meters(
        TEA_TRAY_M,
        [
            cuboid([0.0, 0.0, 0.0], [0.44, 0.012, 0.31], TRAY_WOOD),
            cuboid([0.0, 0.0, -0.154], [0.45, 0.03, 0.012], TRAY_RIM).non_colliding(),
            cuboid([0.0, 0.0, 0.154], [0.45, 0.03, 0.012], TRAY_RIM).non_colliding(),
            cuboid([-0.219, 0.0, 0.0], [0.012, 0.03, 0.32], TRAY_RIM).non_colliding(),
            cuboid([0.219, 0.0, 0.0], [0.012, 0.03, 0.32], TRAY_RIM).non_colliding(),
            arc([-0.219, 0.0, 0.0], 0.1, 0.012, 120.0, TRAY_RIM).turned(ARCH_ALONG),
            arc([0.219, 0.0, 0.0], 0.1, 0.012, 120.0, TRAY_RIM).turned(ARCH_ALONG),
        ],
    ),
    ..CONTAINER
};

/// Four bars around a square basket `width_m` wide, from height `y` up.
const fn hoop(y: f32, width_m: f32, height_m: f32, bar_m: f32, paint: Paint) -> [Part; 4] {
    let middle = 0.5 * (width_m - bar_m);
    [
        cuboid([0.0, y, -middle], [width_m, height_m, bar_m], paint).non_colliding(),
        cuboid([0.0, y, middle], [width_m, height_m, bar_m], paint).non_colliding(),
        cuboid([-middle, y, 0.0], [bar_m, height_m, width_m], paint).non_colliding(),
        cuboid([middle, y, 0.0], [bar_m, height_m, width_m], paint).non_colliding(),
    ]
}

const HOLE: Paint = Paint([120, 126, 130], Finish::Matte);

/// A hole in the front or back of the plastic lattice.
const fn hole_across(x: f32, z: f32) -> Part {
    cuboid([x, 0.05, z], [0.074, 0.13, 0.02], HOLE).non_colliding()
}

/// A hole in a side of the plastic lattice.
const fn hole_along(x: f32, z: f32) -> Part {
    cuboid([x, 0.05, z], [0.02, 0.13, 0.074], HOLE).non_colliding()
}

const PLASTIC_RIM: [Part; 4] = hoop(0.21, 0.37, 0.03, 0.016, WHITE);

const PLASTIC_BASKET_M: [f32; 3] = [0.37, 0.24, 0.37];
const PLASTIC_BASKET: ClassInfo = ClassInfo {
    name: "plastic_basket",
    label: "plastic basket",
    original_model: Some("basket_18inx18inx12iin_plastic_lattice"),
    detector_index: Some(3),
    size_m: PLASTIC_BASKET_M,
    mass_kg: 0.6,
    parts: &in_meters(
        PLASTIC_BASKET_M,
        [
            tub([0.0, 0.0, 0.0], [0.366, 0.24, 0.366], 0.008, 0.94, WHITE),
            PLASTIC_RIM[0],
            PLASTIC_RIM[1],
            PLASTIC_RIM[2],
            PLASTIC_RIM[3],
            hole_across(-0.1, -0.174),
            hole_across(0.0, -0.174),
            hole_across(0.1, -0.174),
            hole_across(-0.1, 0.174),
            hole_across(0.0, 0.174),
            hole_across(0.1, 0.174),
            hole_along(-0.174, -0.1),
            hole_along(-0.174, 0.0),
            hole_along(-0.174, 0.1),
            hole_along(0.174, -0.1),
            hole_along(0.174, 0.0),
            hole_along(0.174, 0.1),
        ],
    ),
    ..CONTAINER
};

const WILLOW: Paint = Paint([166, 118, 70], Finish::Wicker);
const DARK_WILLOW: Paint = Paint([124, 82, 46], Finish::Wicker);

const WICKER_RIM: [Part; 4] = hoop(0.2, 0.37, 0.025, 0.02, DARK_WILLOW);
const WICKER_FOOT: [Part; 4] = hoop(0.0, 0.316, 0.022, 0.02, DARK_WILLOW);

const WICKER_BASKET_M: [f32; 3] = [0.37, 0.24, 0.37];
const WICKER_BASKET: ClassInfo = ClassInfo {
    name: "wicker_basket",
    label: "wicker basket",
    original_model: Some("basket_18inx18inx12iin_wicker"),
    detector_index: Some(4),
    size_m: WICKER_BASKET_M,
    mass_kg: 0.8,
    parts: &in_meters(
        WICKER_BASKET_M,
        [
            tub([0.0, 0.0, 0.0], [0.36, 0.225, 0.36], 0.012, 0.84, WILLOW),
            WICKER_RIM[0],
            WICKER_RIM[1],
            WICKER_RIM[2],
            WICKER_RIM[3],
            WICKER_FOOT[0],
            WICKER_FOOT[1],
            WICKER_FOOT[2],
            WICKER_FOOT[3],
            arc([0.0, 0.178, -0.174], 0.124, 0.02, 170.0, DARK_WILLOW).turned(ARCH),
            arc([0.0, 0.178, 0.174], 0.124, 0.02, 170.0, DARK_WILLOW).turned(ARCH),
        ],
    ),
    ..CONTAINER
};

const SLAT: Paint = Paint([204, 160, 104], Finish::Wood);
const SLAT_FRAME: Paint = Paint([140, 94, 54], Finish::Wood);

const LOW_SLATS: [Part; 4] = hoop(0.05, 0.362, 0.05, 0.012, SLAT_FRAME);
const HIGH_SLATS: [Part; 4] = hoop(0.15, 0.362, 0.05, 0.012, SLAT_FRAME);

const WOOD_BASKET_M: [f32; 3] = [0.37, 0.24, 0.37];
const WOOD_BASKET: ClassInfo = ClassInfo {
    name: "wood_basket",
    label: "wood basket",
    original_model: Some("basket_18inx18inx12iin_wood_mesh"),
    detector_index: Some(5),
    size_m: WOOD_BASKET_M,
    mass_kg: 1.2,
    parts: &in_meters(
        WOOD_BASKET_M,
        [
            tub([0.0, 0.0, 0.0], [0.35, 0.23, 0.35], 0.01, 1.0, SLAT),
            LOW_SLATS[0],
            LOW_SLATS[1],
            LOW_SLATS[2],
            LOW_SLATS[3],
            HIGH_SLATS[0],
            HIGH_SLATS[1],
            HIGH_SLATS[2],
            HIGH_SLATS[3],
            cuboid([-0.172, 0.0, -0.172], [0.026, 0.24, 0.026], SLAT).non_colliding(),
            cuboid([0.172, 0.0, -0.172], [0.026, 0.24, 0.026], SLAT).non_colliding(),
            cuboid([-0.172, 0.0, 0.172], [0.026, 0.24, 0.026], SLAT).non_colliding(),
            cuboid([0.172, 0.0, 0.172], [0.026, 0.24, 0.026], SLAT).non_colliding(),
        ],
    ),
    ..CONTAINER
};

const BAMBOO: Paint = Paint([216, 190, 122], Finish::Wicker);
const BAMBOO_RIM: Paint = Paint([182, 148, 82], Finish::Wood);

const BAMBOO_BASKET_M: [f32; 3] = [0.46, 0.31, 0.46];
const BAMBOO_BASKET: ClassInfo = ClassInfo {
    name: "bamboo_basket",
    label: "bamboo basket",
    original_model: Some("basket_18inx18inx12iin_bamboo"),
    detector_index: Some(6),
    size_m: BAMBOO_BASKET_M,
    mass_kg: 0.9,
    parts: &in_meters(
        BAMBOO_BASKET_M,
        [
            round_tub([0.0, 0.0, 0.0], [0.44, 0.29, 0.44], 0.012, 0.76, BAMBOO),
            ring([0.0, 0.283, 0.0], 0.46, 0.026, BAMBOO_RIM).non_colliding(),
            ring([0.0, 0.15, 0.0], 0.402, 0.02, BAMBOO_RIM).non_colliding(),
            ring([0.0, 0.013, 0.0], 0.354, 0.024, BAMBOO_RIM).non_colliding(),
            arc([0.0, 0.25, -0.215], 0.12, 0.02, 180.0, BAMBOO_RIM).turned(ARCH),
            arc([0.0, 0.25, 0.215], 0.12, 0.02, 180.0, BAMBOO_RIM).turned(ARCH),
        ],
    ),
    ..CONTAINER
};
