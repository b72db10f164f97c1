//! Small objects for work, school and the home, carried in one hand. They include the fragile vase.

use super::shape::{
    ARCH, BLACK, BRASS, DARK_STEEL, GLOSSY_BLACK, Paint, STEEL, TARGET, WHITE, arc, ball, cuboid,
    cylinder, in_meters, ring, rod_x, rod_z, round_tub, taper,
};
use super::{ClassInfo, Finish, Part, Role, Solid, TargetSet};

pub(super) const CLASSES: &[ClassInfo] =
    &[IPHONE, IPOD, PURSE, KEY, MOUSE, PEN, PENCIL_BUCKET, CALCULATOR, LIGHTER, VASE];

// Work.

const SCREEN: Paint = Paint([44, 96, 158], Finish::Glass);

/// A colored square on the screen of a telephone.
const fn icon(x: f32, z: f32, color: [u8; 3]) -> Part {
    cuboid([x, 0.0125, z], [0.014, 0.0023, 0.016], Paint(color, Finish::Glossy)).non_colliding()
}

const IPHONE_M: [f32; 3] = [0.095, 0.015, 0.185];
const IPHONE: ClassInfo = ClassInfo {
    name: "iphone",
    label: "iphone",
    original_model: Some("f10_apple_iphone_4"),
    detector_index: Some(13),
    sets: &[TargetSet::Work],
    size_m: IPHONE_M,
    mass_kg: 0.14,
    parts: &in_meters(
        IPHONE_M,
        [
            cuboid([0.0, 0.0, 0.0], [0.095, 0.012, 0.185], STEEL),
            cuboid([0.0, 0.0115, 0.0], [0.091, 0.002, 0.181], GLOSSY_BLACK).non_colliding(),
            cuboid([0.0, 0.012, -0.004], [0.082, 0.002, 0.126], SCREEN).non_colliding(),
            cylinder([0.0, 0.012, 0.075], [0.018, 0.0025, 0.018], DARK_STEEL).non_colliding(),
            cuboid([0.0, 0.012, -0.08], [0.022, 0.002, 0.004], DARK_STEEL).non_colliding(),
            icon(-0.028, -0.05, [92, 196, 104]),
            icon(-0.009, -0.05, [240, 178, 62]),
            icon(0.01, -0.05, [230, 232, 236]),
            icon(0.029, -0.05, [214, 74, 70]),
            icon(-0.028, 0.042, [92, 196, 104]),
            icon(-0.009, 0.042, [230, 232, 236]),
            icon(0.01, 0.042, [240, 178, 62]),
            icon(0.029, 0.042, [236, 132, 60]),
        ],
    ),
    ..TARGET
};

const IPOD_M: [f32; 3] = [0.094, 0.198, 0.01];
const IPOD: ClassInfo = ClassInfo {
    name: "ipod",
    label: "ipod",
    original_model: Some("apple_ipod_touch_yellow_vray"),
    detector_index: Some(16),
    sets: &[TargetSet::Work],
    size_m: IPOD_M,
    mass_kg: 0.1,
    parts: &in_meters(
        IPOD_M,
        [
            cuboid(
                [0.0, 0.0, 0.0005],
                [0.094, 0.198, 0.009],
                Paint([238, 204, 44], Finish::Glossy),
            ),
            cuboid([0.0, 0.108, -0.0035], [0.078, 0.078, 0.002], GLOSSY_BLACK).non_colliding(),
            cuboid([0.0, 0.112, -0.004], [0.07, 0.07, 0.002], SCREEN).non_colliding(),
            rod_z([0.0, 0.054, -0.0036], 0.002, 0.07, WHITE).non_colliding(),
            rod_z([0.0, 0.054, -0.00425], 0.0015, 0.026, Paint([238, 204, 44], Finish::Glossy))
                .non_colliding(),
        ],
    ),
    ..TARGET
};

const LEATHER: Paint = Paint([176, 54, 84], Finish::Fabric);
const DARK_LEATHER: Paint = Paint([112, 34, 58], Finish::Fabric);

const PURSE_M: [f32; 3] = [0.254, 0.108, 0.041];
const PURSE: ClassInfo = ClassInfo {
    name: "purse",
    label: "purse",
    original_model: Some("small_purse"),
    detector_index: Some(18),
    sets: &[TargetSet::Work],
    size_m: PURSE_M,
    mass_kg: 0.4,
    parts: &in_meters(
        PURSE_M,
        [
            taper(0.76, [0.0, 0.0, 0.0], [0.254, 0.078, 0.041], LEATHER),
            rod_x([0.0, 0.079, 0.0], 0.196, 0.013, BRASS).non_colliding(),
            ball([-0.007, 0.083, -0.004], [0.014, 0.014, 0.014], BRASS).non_colliding(),
            ball([0.007, 0.083, 0.004], [0.014, 0.014, 0.014], BRASS).non_colliding(),
            cylinder([0.0, 0.0, 0.0], [0.254, 0.008, 0.041], DARK_LEATHER).non_colliding(),
            arc([0.0, 0.043, 0.0], 0.13, 0.008, 130.0, DARK_LEATHER).turned(ARCH),
            ball([0.0, 0.028, -0.0185], [0.06, 0.022, 0.004], DARK_LEATHER).non_colliding(),
        ],
    ),
    ..TARGET
};

const KEY_M: [f32; 3] = [0.051, 0.006, 0.158];
const KEY: ClassInfo = ClassInfo {
    name: "key",
    label: "key",
    original_model: Some("key_brass"),
    detector_index: Some(15),
    sets: &[TargetSet::Work],
    size_m: KEY_M,
    mass_kg: 0.05,
    parts: &in_meters(
        KEY_M,
        [
            cuboid([-0.004, 0.0, 0.026], [0.012, 0.006, 0.104], BRASS),
            Part::new(
                Solid::Torus { tube: 0.24 },
                [0.0, 0.003, -0.0535],
                [0.051, 0.006, 0.051],
                BRASS.0,
                BRASS.1,
            )
            .non_colliding(),
            cuboid([0.0, 0.0, -0.028], [0.022, 0.006, 0.008], BRASS).non_colliding(),
            cuboid([0.009, 0.0, 0.072], [0.018, 0.006, 0.01], BRASS).non_colliding(),
            cuboid([0.007, 0.0, 0.056], [0.014, 0.006, 0.008], BRASS).non_colliding(),
            cuboid([0.009, 0.0, 0.041], [0.018, 0.006, 0.008], BRASS).non_colliding(),
        ],
    ),
    ..TARGET
};

// School.

const MOUSE_M: [f32; 3] = [0.075, 0.042, 0.132];
const MOUSE: ClassInfo = ClassInfo {
    name: "mouse",
    label: "mouse",
    original_model: Some("mouse_02_vray"),
    detector_index: Some(21),
    sets: &[TargetSet::School],
    size_m: MOUSE_M,
    mass_kg: 0.1,
    parts: &in_meters(
        MOUSE_M,
        [
            ball([0.0, 0.0, 0.0], [0.075, 0.04, 0.132], Paint([52, 54, 60], Finish::Glossy)),
            cylinder([0.0, 0.0, 0.0], [0.064, 0.016, 0.116], BLACK).non_colliding(),
            ball([0.0, 0.0005, -0.03], [0.004, 0.041, 0.07], STEEL).non_colliding(),
            rod_x([0.0, 0.032, -0.032], 0.01, 0.02, STEEL).non_colliding(),
            ball([0.0, 0.0365, 0.026], [0.014, 0.004, 0.018], STEEL).non_colliding(),
        ],
    ),
    palette: &[[52, 54, 60], [214, 214, 210], [150, 34, 40]],
    ..TARGET
};

const PEN_M: [f32; 3] = [0.213, 0.032, 0.028];
const PEN: ClassInfo = ClassInfo {
    name: "pen",
    label: "pen",
    original_model: Some("b05_executive_pen"),
    detector_index: Some(14),
    sets: &[TargetSet::School],
    size_m: PEN_M,
    mass_kg: 0.03,
    parts: &in_meters(
        PEN_M,
        [
            rod_x([-0.02, 0.014, 0.0], 0.1, 0.024, Paint([28, 40, 104], Finish::Glossy)),
            rod_x([0.067, 0.014, 0.0], 0.074, 0.027, Paint([22, 24, 34], Finish::Glossy)),
            rod_x([0.031, 0.014, 0.0], 0.006, 0.028, BRASS).non_colliding(),
            rod_x([0.104, 0.014, 0.0], 0.005, 0.02, BRASS).non_colliding(),
            taper(0.1, [-0.0875, -0.004, 0.0], [0.022, 0.036, 0.022], BRASS)
                .turned([0.0, 0.0, 90.0])
                .non_colliding(),
            cuboid([0.07, 0.028, 0.0], [0.06, 0.004, 0.006], BRASS).non_colliding(),
        ],
    ),
    palette: &[[28, 40, 104], [120, 24, 34], [24, 84, 60]],
    ..TARGET
};

/// A pencil with its sharpened end up.
const fn pencil(x: f32, z: f32, length_m: f32, color: [u8; 3]) -> [Part; 2] {
    let lacquer = Paint(color, Finish::Glossy);
    [
        cylinder([x, 0.004, z], [0.011, length_m - 0.022, 0.011], lacquer).non_colliding(),
        taper(0.12, [x, length_m - 0.018, z], [0.011, 0.018, 0.011], PENCIL_WOOD).non_colliding(),
    ]
}

const PENCIL_WOOD: Paint = Paint([226, 188, 136], Finish::Wood);
const YELLOW_PENCIL: [Part; 2] = pencil(-0.02, -0.014, 0.16, [240, 190, 40]);
const RED_PENCIL: [Part; 2] = pencil(0.004, -0.024, 0.146, [204, 44, 44]);
const BLUE_PENCIL: [Part; 2] = pencil(0.024, -0.004, 0.165, [42, 92, 180]);
const GREEN_PENCIL: [Part; 2] = pencil(-0.008, 0.012, 0.152, [46, 140, 76]);

const PENCIL_BUCKET_M: [f32; 3] = [0.1, 0.171, 0.086];
const PENCIL_BUCKET: ClassInfo = ClassInfo {
    name: "pencil_bucket",
    label: "pencil bucket",
    original_model: Some("pencil_all"),
    detector_index: Some(20),
    sets: &[TargetSet::School],
    size_m: PENCIL_BUCKET_M,
    mass_kg: 0.25,
    parts: &in_meters(
        PENCIL_BUCKET_M,
        [
            round_tub(
                [0.0, 0.0, 0.0],
                [0.09, 0.1, 0.084],
                0.004,
                0.92,
                Paint([70, 84, 98], Finish::Metal),
            ),
            ring([0.0, 0.1, 0.0], 0.086, 0.006, STEEL).non_colliding(),
            YELLOW_PENCIL[0],
            YELLOW_PENCIL[1],
            RED_PENCIL[0],
            RED_PENCIL[1],
            BLUE_PENCIL[0],
            BLUE_PENCIL[1],
            GREEN_PENCIL[0],
            GREEN_PENCIL[1],
            cuboid(
                [0.016, 0.004, 0.02],
                [0.026, 0.167, 0.003],
                Paint([222, 196, 120], Finish::Glossy),
            )
            .non_colliding(),
        ],
    ),
    palette: &[[70, 84, 98], [150, 60, 56], [60, 110, 84]],
    ..TARGET
};

/// A key of a calculator.
const fn button(x: f32, z: f32, paint: Paint) -> Part {
    cuboid([x, 0.02, z], [0.018, 0.008, 0.014], paint).non_colliding()
}

const ORANGE_KEY: Paint = Paint([232, 128, 44], Finish::Matte);

const CALCULATOR_M: [f32; 3] = [0.1, 0.031, 0.132];
const CALCULATOR: ClassInfo = ClassInfo {
    name: "calculator",
    label: "calculator",
    original_model: Some("b05_calculator"),
    detector_index: Some(19),
    sets: &[TargetSet::School],
    size_m: CALCULATOR_M,
    mass_kg: 0.12,
    parts: &in_meters(
        CALCULATOR_M,
        [
            cuboid([0.0, 0.0, 0.0], [0.1, 0.023, 0.132], Paint([62, 64, 70], Finish::Matte)),
            cuboid([0.0, 0.02, -0.043], [0.1, 0.009, 0.046], BLACK).non_colliding(),
            cuboid(
                [0.0, 0.028, -0.044],
                [0.084, 0.003, 0.028],
                Paint([162, 186, 150], Finish::Glossy),
            )
            .non_colliding(),
            button(-0.033, -0.006, WHITE),
            button(-0.011, -0.006, WHITE),
            button(0.011, -0.006, WHITE),
            button(0.033, -0.006, ORANGE_KEY),
            button(-0.033, 0.019, WHITE),
            button(-0.011, 0.019, WHITE),
            button(0.011, 0.019, WHITE),
            button(0.033, 0.019, ORANGE_KEY),
            button(-0.033, 0.044, WHITE),
            button(-0.011, 0.044, WHITE),
            button(0.011, 0.044, WHITE),
            button(0.033, 0.044, ORANGE_KEY),
        ],
    ),
    ..TARGET
};

// The home.

const LIGHTER_M: [f32; 3] = [0.02, 0.161, 0.045];
const LIGHTER: ClassInfo = ClassInfo {
    name: "lighter",
    label: "lighter",
    original_model: Some("b04_lighter"),
    detector_index: Some(17),
    size_m: LIGHTER_M,
    mass_kg: 0.02,
    parts: &in_meters(
        LIGHTER_M,
        [
            cylinder([0.0, 0.0, 0.0], [0.02, 0.114, 0.045], Paint([206, 38, 48], Finish::Glossy)),
            cylinder([0.0, 0.112, 0.0], [0.0185, 0.028, 0.042], STEEL).non_colliding(),
            cuboid([0.0, 0.138, 0.011], [0.0165, 0.023, 0.016], STEEL).non_colliding(),
            rod_x([0.0, 0.147, -0.007], 0.01, 0.018, DARK_STEEL).non_colliding(),
            cuboid([0.0, 0.138, -0.017], [0.013, 0.006, 0.009], BLACK).non_colliding(),
        ],
    ),
    palette: &[[206, 38, 48], [40, 92, 196], [38, 150, 84], [236, 190, 40]],
    ..TARGET
};

const GLAZE: Paint = Paint([56, 92, 160], Finish::Glossy);

const VASE_M: [f32; 3] = [0.145, 0.212, 0.145];
const VASE: ClassInfo = ClassInfo {
    name: "vase",
    label: "vase",
    original_model: Some("vase_05"),
    detector_index: Some(46),
    role: Role::Fragile,
    size_m: VASE_M,
    mass_kg: 0.8,
    parts: &in_meters(
        VASE_M,
        [
            ball([0.0, 0.004, 0.0], [0.145, 0.146, 0.145], Paint([226, 230, 236], Finish::Glossy)),
            taper(0.7, [0.0, 0.0, 0.0], [0.084, 0.024, 0.084], GLAZE),
            taper(
                0.74,
                [0.0, 0.136, 0.0],
                [0.08, 0.046, 0.08],
                Paint([226, 230, 236], Finish::Glossy),
            ),
            round_tub([0.0, 0.174, 0.0], [0.092, 0.038, 0.092], 0.005, 0.62, GLAZE).non_colliding(),
            ring([0.0, 0.082, 0.0], 0.145, 0.008, GLAZE).non_colliding(),
            ring([0.0, 0.108, 0.0], 0.138, 0.008, GLAZE).non_colliding(),
            ring([0.0, 0.138, 0.0], 0.084, 0.01, GLAZE).non_colliding(),
        ],
    ),
    palette: &[[226, 230, 236], [214, 196, 170], [190, 214, 210]],
    ..TARGET
};
