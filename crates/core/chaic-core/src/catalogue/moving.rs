//! Furniture of the moving-house task.
//!
//! Sizes are those of the original after its scaling. Masses are those of its shipped episodes, in
//! the original's units, with which strengths are compared.

use super::shape::{
    ARCH, ARCH_ALONG, BACKWARD, BLACK, BRASS, DARK_STEEL, FURNISHING, GLASS, GLOSSY_BLACK, Paint,
    STEEL, WHITE, arc, ball, cuboid, cylinder, in_meters, rod_x, rod_z, taper,
};
use super::{ClassInfo, Finish, Part, Role, TargetSet};

pub(super) const CLASSES: &[ClassInfo] = &[
    BACKPACK,
    KETTLE,
    NAVY_CHAIR,
    WOOD_SHELVING,
    PRINTER,
    TABLE,
    TELEVISION,
    MICROWAVE,
    DISHWASHER,
    DRAWER,
    PIANO,
    SOFA,
];

const FURNITURE: ClassInfo =
    ClassInfo { role: Role::HeavyTarget, sets: &[TargetSet::Furniture], ..FURNISHING };

const STRAP: Paint = Paint([38, 40, 46], Finish::Fabric);
const POCKET: Paint = Paint([72, 78, 88], Finish::Fabric);

const BACKPACK_M: [f32; 3] = [0.37, 0.61, 0.45];
const BACKPACK: ClassInfo = ClassInfo {
    name: "backpack",
    label: "backpack",
    original_model: Some("b04_backpack"),
    detector_index: Some(22),
    size_m: BACKPACK_M,
    mass_kg: 50.0,
    parts: &in_meters(
        BACKPACK_M,
        [
            ball([0.0, 0.0, 0.02], [0.35, 0.59, 0.3], Paint([46, 84, 150], Finish::Fabric)),
            cylinder([0.0, 0.0, 0.02], [0.3, 0.2, 0.25], POCKET),
            ball([0.0, 0.05, -0.125], [0.27, 0.26, 0.18], POCKET),
            arc([0.0, 0.2, -0.092], 0.25, 0.014, 120.0, BRASS),
            cuboid([0.045, 0.165, -0.195], [0.014, 0.04, 0.02], BRASS).non_colliding(),
            ball([-0.145, 0.05, 0.03], [0.08, 0.2, 0.17], POCKET).non_colliding(),
            ball([0.145, 0.05, 0.03], [0.08, 0.2, 0.17], POCKET).non_colliding(),
            arc([0.0, 0.555, 0.03], 0.11, 0.024, 190.0, STRAP).turned(ARCH),
            arc([-0.09, 0.29, 0.03], 0.388, 0.036, 150.0, STRAP).turned(BACKWARD),
            arc([0.09, 0.29, 0.03], 0.388, 0.036, 150.0, STRAP).turned(BACKWARD),
            arc([0.0, 0.12, -0.02], 0.3, 0.016, 150.0, STRAP).turned([60.0, 0.0, 0.0]),
        ],
    ),
    palette: &[[46, 84, 150], [150, 46, 46], [64, 110, 68]],
    ..FURNITURE
};

const KETTLE_M: [f32; 3] = [0.35, 0.37, 0.38];
const KETTLE: ClassInfo = ClassInfo {
    name: "kettle",
    label: "kettle",
    original_model: Some("kettle_2"),
    detector_index: Some(40),
    size_m: KETTLE_M,
    mass_kg: 50.0,
    parts: &in_meters(
        KETTLE_M,
        [
            taper(0.72, [0.0, 0.0, 0.02], [0.34, 0.17, 0.34], STEEL),
            ball([0.0, 0.115, 0.02], [0.245, 0.11, 0.245], STEEL),
            cylinder([0.0, 0.0, 0.02], [0.34, 0.014, 0.34], DARK_STEEL).non_colliding(),
            ball([0.0, 0.212, 0.02], [0.042, 0.042, 0.042], BLACK).non_colliding(),
            taper(0.5, [0.0, 0.075, -0.128], [0.066, 0.16, 0.066], STEEL)
                .turned([-36.0, 0.0, 0.0])
                .non_colliding(),
            arc([0.0, 0.227, 0.02], 0.28, 0.026, 250.0, BLACK).turned(ARCH_ALONG),
        ],
    ),
    palette: &[[186, 189, 194], [176, 44, 42], [206, 132, 84]],
    ..FURNITURE
};

const ALUMINUM: Paint = Paint([198, 200, 203], Finish::Metal);

const NAVY_CHAIR_M: [f32; 3] = [0.42, 0.86, 0.51];
const NAVY_CHAIR: ClassInfo = ClassInfo {
    name: "navy_chair",
    label: "chair",
    original_model: Some("emeco_navy_chair"),
    detector_index: Some(38),
    size_m: NAVY_CHAIR_M,
    mass_kg: 120.0,
    parts: &in_meters(
        NAVY_CHAIR_M,
        [
            cuboid([0.0, 0.44, -0.02], [0.41, 0.026, 0.44], ALUMINUM).surface(),
            cuboid([-0.185, 0.0, -0.215], [0.03, 0.44, 0.03], ALUMINUM),
            cuboid([0.185, 0.0, -0.215], [0.03, 0.44, 0.03], ALUMINUM),
            cuboid([-0.185, 0.0, 0.215], [0.03, 0.84, 0.03], ALUMINUM),
            cuboid([0.185, 0.0, 0.215], [0.03, 0.84, 0.03], ALUMINUM),
            cuboid([0.0, 0.78, 0.225], [0.42, 0.08, 0.03], ALUMINUM),
            cuboid([-0.09, 0.46, 0.225], [0.035, 0.33, 0.016], ALUMINUM).non_colliding(),
            cuboid([0.0, 0.46, 0.225], [0.035, 0.33, 0.016], ALUMINUM).non_colliding(),
            cuboid([0.09, 0.46, 0.225], [0.035, 0.33, 0.016], ALUMINUM).non_colliding(),
            rod_x([0.0, 0.2, -0.215], 0.36, 0.02, ALUMINUM).non_colliding(),
            rod_z([-0.185, 0.24, 0.0], 0.42, 0.02, ALUMINUM).non_colliding(),
            rod_z([0.185, 0.24, 0.0], 0.42, 0.02, ALUMINUM).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const PINE: Paint = Paint([206, 168, 112], Finish::Wood);
const PINE_POST: Paint = Paint([184, 144, 90], Finish::Wood);

/// A board of the shelving with its top at `y`.
const fn board(y: f32) -> Part {
    cuboid([0.0, y - 0.02, 0.0], [0.29, 0.02, 0.74], PINE).surface()
}

/// A post of the shelving.
const fn post(x: f32, z: f32) -> Part {
    cuboid([x, 0.0, z], [0.03, 0.975, 0.04], PINE_POST)
}

const WOOD_SHELVING_M: [f32; 3] = [0.31, 0.98, 0.76];
const WOOD_SHELVING: ClassInfo = ClassInfo {
    name: "wood_shelving",
    label: "wood shelving",
    original_model: Some("4ft_wood_shelving"),
    detector_index: Some(31),
    size_m: WOOD_SHELVING_M,
    mass_kg: 200.0,
    parts: &in_meters(
        WOOD_SHELVING_M,
        [
            board(0.335),
            board(0.655),
            board(0.98),
            post(-0.14, -0.36),
            post(0.14, -0.36),
            post(-0.14, 0.36),
            post(0.14, 0.36),
            cuboid([0.0, 0.05, -0.36], [0.26, 0.035, 0.02], PINE_POST).non_colliding(),
            cuboid([0.0, 0.05, 0.36], [0.26, 0.035, 0.02], PINE_POST).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const PRINTER_GRAY: Paint = Paint([188, 190, 194], Finish::Matte);
const PRINTER_DARK: Paint = Paint([66, 70, 76], Finish::Matte);

const PRINTER_M: [f32; 3] = [0.5, 0.4, 0.39];
const PRINTER: ClassInfo = ClassInfo {
    name: "printer",
    label: "printer",
    original_model: Some("hp_printer"),
    detector_index: Some(39),
    size_m: PRINTER_M,
    mass_kg: 200.0,
    parts: &in_meters(
        PRINTER_M,
        [
            cuboid([0.0, 0.0, 0.03], [0.5, 0.25, 0.33], PRINTER_GRAY),
            cuboid([0.0, 0.25, 0.03], [0.48, 0.06, 0.31], PRINTER_DARK),
            cuboid([0.0, 0.09, -0.135], [0.34, 0.08, 0.01], BLACK).non_colliding(),
            cuboid([0.0, 0.06, -0.145], [0.34, 0.02, 0.1], PRINTER_DARK).non_colliding(),
            cuboid([0.0, 0.08, -0.15], [0.22, 0.006, 0.09], WHITE).non_colliding(),
            cuboid([0.0, 0.28, 0.165], [0.26, 0.115, 0.012], PRINTER_DARK)
                .turned([14.0, 0.0, 0.0])
                .non_colliding(),
            cuboid([0.0, 0.265, 0.152], [0.22, 0.125, 0.004], WHITE)
                .turned([14.0, 0.0, 0.0])
                .non_colliding(),
            cuboid([-0.17, 0.2, -0.138], [0.09, 0.04, 0.006], GLASS).non_colliding(),
            ball(
                [-0.1, 0.207, -0.142],
                [0.024, 0.024, 0.016],
                Paint([60, 170, 90], Finish::Glossy),
            )
            .non_colliding(),
        ],
    ),
    ..FURNITURE
};

const WALNUT: Paint = Paint([124, 80, 56], Finish::Wood);

const TABLE_M: [f32; 3] = [0.76, 0.51, 0.76];
const TABLE: ClassInfo = ClassInfo {
    name: "table",
    label: "table",
    original_model: Some("dining_room_table"),
    detector_index: Some(36),
    size_m: TABLE_M,
    mass_kg: 300.0,
    parts: &in_meters(
        TABLE_M,
        [
            cuboid([0.0, 0.475, 0.0], [0.76, 0.035, 0.76], WALNUT).surface(),
            cuboid([-0.335, 0.0, -0.335], [0.055, 0.475, 0.055], WALNUT),
            cuboid([0.335, 0.0, -0.335], [0.055, 0.475, 0.055], WALNUT),
            cuboid([-0.335, 0.0, 0.335], [0.055, 0.475, 0.055], WALNUT),
            cuboid([0.335, 0.0, 0.335], [0.055, 0.475, 0.055], WALNUT),
            cuboid([0.0, 0.41, -0.335], [0.64, 0.065, 0.025], WALNUT).non_colliding(),
            cuboid([0.0, 0.41, 0.335], [0.64, 0.065, 0.025], WALNUT).non_colliding(),
            cuboid([-0.335, 0.41, 0.0], [0.025, 0.065, 0.64], WALNUT).non_colliding(),
            cuboid([0.335, 0.41, 0.0], [0.025, 0.065, 0.64], WALNUT).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const TELEVISION_M: [f32; 3] = [0.83, 0.55, 0.52];
const TELEVISION: ClassInfo = ClassInfo {
    name: "television",
    label: "television",
    original_model: Some("sm_tv"),
    detector_index: Some(41),
    size_m: TELEVISION_M,
    mass_kg: 300.0,
    parts: &in_meters(
        TELEVISION_M,
        [
            cuboid([0.0, 0.02, -0.13], [0.83, 0.53, 0.25], Paint([54, 54, 58], Finish::Matte)),
            cuboid([0.0, 0.05, 0.085], [0.64, 0.42, 0.2], BLACK),
            cuboid([0.0, 0.09, 0.215], [0.44, 0.3, 0.09], BLACK),
            cuboid([0.0, 0.0, -0.02], [0.6, 0.05, 0.42], BLACK),
            cuboid([0.05, 0.075, -0.25], [0.66, 0.44, 0.015], GLOSSY_BLACK).non_colliding(),
            ball([0.05, 0.095, -0.252], [0.6, 0.4, 0.016], Paint([60, 84, 98], Finish::Glass))
                .non_colliding(),
            cuboid([0.05, 0.105, -0.2525], [0.56, 0.38, 0.014], Paint([60, 84, 98], Finish::Glass))
                .non_colliding(),
            rod_z([-0.345, 0.45, -0.25], 0.018, 0.055, STEEL).non_colliding(),
            rod_z([-0.345, 0.37, -0.25], 0.018, 0.055, STEEL).non_colliding(),
            cuboid([-0.345, 0.1, -0.252], [0.07, 0.18, 0.01], DARK_STEEL).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const MICROWAVE_M: [f32; 3] = [0.76, 0.44, 0.44];
const MICROWAVE: ClassInfo = ClassInfo {
    name: "microwave",
    label: "microwave",
    original_model: Some("appliance-ge-profile-microwave3"),
    detector_index: Some(32),
    size_m: MICROWAVE_M,
    mass_kg: 400.0,
    parts: &in_meters(
        MICROWAVE_M,
        [
            cuboid([0.0, 0.015, 0.02], [0.76, 0.425, 0.4], STEEL),
            cuboid([0.0, 0.0, 0.02], [0.68, 0.02, 0.34], BLACK).non_colliding(),
            cuboid([0.09, 0.045, -0.185], [0.54, 0.365, 0.02], DARK_STEEL).non_colliding(),
            cuboid([0.115, 0.085, -0.19], [0.42, 0.285, 0.02], GLASS).non_colliding(),
            cylinder([-0.14, 0.0775, -0.205], [0.028, 0.3, 0.028], STEEL).non_colliding(),
            cuboid([-0.28, 0.045, -0.185], [0.17, 0.365, 0.02], BLACK).non_colliding(),
            cuboid(
                [-0.28, 0.335, -0.19],
                [0.13, 0.05, 0.02],
                Paint([72, 214, 150], Finish::Glossy),
            )
            .non_colliding(),
            cuboid([-0.28, 0.265, -0.19], [0.13, 0.035, 0.02], STEEL).non_colliding(),
            cuboid([-0.28, 0.215, -0.19], [0.13, 0.035, 0.02], STEEL).non_colliding(),
            cuboid([-0.28, 0.165, -0.19], [0.13, 0.035, 0.02], STEEL).non_colliding(),
            rod_z([-0.28, 0.1, -0.19], 0.03, 0.06, STEEL).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const DISHWASHER_M: [f32; 3] = [0.53, 0.72, 0.59];
const DISHWASHER: ClassInfo = ClassInfo {
    name: "dishwasher",
    label: "dishwasher",
    original_model: Some("dishwasher_4"),
    detector_index: Some(37),
    size_m: DISHWASHER_M,
    mass_kg: 400.0,
    parts: &in_meters(
        DISHWASHER_M,
        [
            cuboid([0.0, 0.0, 0.025], [0.53, 0.72, 0.54], Paint([216, 218, 220], Finish::Glossy)),
            cuboid([0.0, 0.0, -0.25], [0.5, 0.07, 0.02], BLACK).non_colliding(),
            cuboid([0.0, 0.08, -0.255], [0.51, 0.5, 0.03], STEEL).non_colliding(),
            cuboid([0.0, 0.59, -0.255], [0.51, 0.11, 0.03], DARK_STEEL).non_colliding(),
            rod_x([0.0, 0.545, -0.28], 0.4, 0.028, STEEL).non_colliding(),
            cuboid(
                [-0.16, 0.625, -0.262],
                [0.11, 0.04, 0.02],
                Paint([86, 190, 220], Finish::Glossy),
            )
            .non_colliding(),
            rod_z([0.19, 0.645, -0.265], 0.03, 0.045, STEEL).non_colliding(),
            rod_z([0.12, 0.645, -0.265], 0.02, 0.022, WHITE).non_colliding(),
            rod_z([0.07, 0.645, -0.265], 0.02, 0.022, WHITE).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const HONEY: Paint = Paint([200, 146, 88], Finish::Wood);
const HONEY_FRONT: Paint = Paint([216, 166, 106], Finish::Wood);
const HONEY_DARK: Paint = Paint([150, 102, 58], Finish::Wood);

const DRAWER_M: [f32; 3] = [0.49, 0.73, 0.52];
const DRAWER: ClassInfo = ClassInfo {
    name: "drawer",
    label: "drawer",
    original_model: Some("cabinet_24_door_drawer_wood_beach_honey"),
    detector_index: Some(35),
    size_m: DRAWER_M,
    mass_kg: 500.0,
    parts: &in_meters(
        DRAWER_M,
        [
            cuboid([0.0, 0.05, 0.02], [0.47, 0.65, 0.45], HONEY),
            cuboid([0.0, 0.7, 0.0], [0.49, 0.03, 0.52], HONEY_DARK).surface(),
            cuboid([0.0, 0.0, 0.03], [0.43, 0.05, 0.4], HONEY_DARK).non_colliding(),
            cuboid([0.0, 0.5, -0.21], [0.43, 0.18, 0.02], HONEY_FRONT).non_colliding(),
            cuboid([0.0, 0.295, -0.21], [0.43, 0.18, 0.02], HONEY_FRONT).non_colliding(),
            cuboid([0.0, 0.09, -0.21], [0.43, 0.18, 0.02], HONEY_FRONT).non_colliding(),
            ball([0.0, 0.57, -0.235], [0.04, 0.04, 0.04], BRASS).non_colliding(),
            ball([0.0, 0.365, -0.235], [0.04, 0.04, 0.04], BRASS).non_colliding(),
            ball([0.0, 0.16, -0.235], [0.04, 0.04, 0.04], BRASS).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const IVORY: Paint = Paint([244, 240, 226], Finish::Glossy);

/// A group of two or three black keys.
const fn black_keys(x: f32, width_m: f32) -> Part {
    cuboid([x, 0.525, -0.36], [width_m, 0.014, 0.07], GLOSSY_BLACK).non_colliding()
}

const PIANO_M: [f32; 3] = [1.114, 1.058, 0.909];
const PIANO: ClassInfo = ClassInfo {
    name: "piano",
    label: "piano",
    original_model: Some("b03_grandpiano2014"),
    detector_index: Some(34),
    size_m: PIANO_M,
    mass_kg: 700.0,
    parts: &in_meters(
        PIANO_M,
        [
            cuboid([0.0, 0.4, -0.13], [1.11, 0.2, 0.36], GLOSSY_BLACK),
            cylinder([0.12, 0.4, 0.13], [0.86, 0.2, 0.64], GLOSSY_BLACK),
            cuboid([0.0, 0.42, -0.37], [1.11, 0.08, 0.165], GLOSSY_BLACK),
            taper(0.6, [-0.46, 0.0, -0.2], [0.07, 0.4, 0.07], GLOSSY_BLACK),
            taper(0.6, [0.46, 0.0, -0.2], [0.07, 0.4, 0.07], GLOSSY_BLACK),
            taper(0.6, [0.16, 0.0, 0.33], [0.07, 0.4, 0.07], GLOSSY_BLACK),
            cuboid([0.0, 0.5, -0.38], [0.98, 0.025, 0.13], IVORY).non_colliding(),
            black_keys(-0.36, 0.12),
            black_keys(-0.18, 0.18),
            black_keys(0.0, 0.12),
            black_keys(0.18, 0.18),
            black_keys(0.36, 0.12),
            cuboid([0.0, 0.6, -0.1], [0.5, 0.13, 0.015], GLOSSY_BLACK)
                .turned([12.0, 0.0, 0.0])
                .non_colliding(),
            cylinder([0.12, 0.5, 0.14], [0.78, 0.105, 0.56], Paint([206, 160, 84], Finish::Wood))
                .non_colliding(),
            cuboid([0.17, 0.815, 0.15], [0.8, 0.02, 0.6], GLOSSY_BLACK)
                .turned([0.0, 0.0, -34.0])
                .non_colliding(),
            cylinder([-0.12, 0.6, 0.2], [0.016, 0.4, 0.016], GLOSSY_BLACK).non_colliding(),
        ],
    ),
    ..FURNITURE
};

const OATMEAL: Paint = Paint([172, 160, 150], Finish::Fabric);
const OATMEAL_DARK: Paint = Paint([142, 130, 120], Finish::Fabric);

const SOFA_M: [f32; 3] = [1.34, 0.47, 0.68];
const SOFA: ClassInfo = ClassInfo {
    name: "sofa",
    label: "sofa",
    original_model: Some("arflex_strips_sofa"),
    detector_index: Some(33),
    size_m: SOFA_M,
    mass_kg: 900.0,
    parts: &in_meters(
        SOFA_M,
        [
            cuboid([0.0, 0.17, -0.07], [0.98, 0.13, 0.54], OATMEAL).surface(),
            cuboid([0.0, 0.03, 0.0], [1.3, 0.14, 0.66], OATMEAL_DARK),
            cuboid([0.0, 0.03, 0.27], [1.34, 0.43, 0.14], OATMEAL_DARK),
            cuboid([-0.58, 0.03, -0.07], [0.18, 0.4, 0.54], OATMEAL_DARK),
            cuboid([0.58, 0.03, -0.07], [0.18, 0.4, 0.54], OATMEAL_DARK),
            rod_z([-0.58, 0.41, -0.07], 0.54, 0.1, OATMEAL_DARK).non_colliding(),
            rod_z([0.58, 0.41, -0.07], 0.54, 0.1, OATMEAL_DARK).non_colliding(),
            ball([-0.245, 0.27, 0.15], [0.47, 0.2, 0.14], OATMEAL).non_colliding(),
            ball([0.245, 0.27, 0.15], [0.47, 0.2, 0.14], OATMEAL).non_colliding(),
            cuboid([0.0, 0.18, -0.07], [0.012, 0.121, 0.536], OATMEAL_DARK).non_colliding(),
            cuboid([0.0, 0.0, 0.0], [1.2, 0.03, 0.56], BLACK).non_colliding(),
        ],
    ),
    ..FURNITURE
};
