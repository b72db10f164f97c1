//! Furniture of a house.

use super::kitchen::{KITCHEN_COUNTER, REFRIGERATOR, STOVE};
use super::shape::{
    BLACK, BRASS, DARK_STEEL, FURNISHING, LACQUER, Paint, STEEL, ball, cuboid, cylinder, in_meters,
    rod_x, rod_z, round_tub, taper,
};
use super::{ClassInfo, Finish, Part};

pub(super) const CLASSES: &[ClassInfo] = &[
    BED,
    NIGHTSTAND,
    WARDROBE,
    CABINET,
    REFRIGERATOR,
    KITCHEN_COUNTER,
    STOVE,
    SIDE_CHAIR,
    DINING_TABLE,
    COFFEE_TABLE,
    DESK,
    STOOL,
    ARMCHAIR,
    LONG_SOFA,
    TV_STAND,
    BOOKSHELF,
    POTTED_PLANT,
    FLOOR_LAMP,
    RUG,
];

const OAK: Paint = Paint([192, 150, 98], Finish::Wood);
const PALE_OAK: Paint = Paint([214, 180, 132], Finish::Wood);
const WALNUT: Paint = Paint([112, 74, 50], Finish::Wood);
const LINEN: Paint = Paint([240, 238, 232], Finish::Fabric);
const CHARCOAL: Paint = Paint([70, 72, 78], Finish::Fabric);
const LEAF: Paint = Paint([62, 122, 58], Finish::Matte);
const LIGHT_LEAF: Paint = Paint([92, 152, 72], Finish::Matte);

/// Four square legs of width `leg_m` at distances `x` and `z` from the center.
const fn legs(x: f32, z: f32, height_m: f32, leg_m: f32, paint: Paint) -> [Part; 4] {
    let size = [leg_m, height_m, leg_m];
    [
        cuboid([-x, 0.0, -z], size, paint),
        cuboid([x, 0.0, -z], size, paint),
        cuboid([-x, 0.0, z], size, paint),
        cuboid([x, 0.0, z], size, paint),
    ]
}

// Bedroom.

const BED_M: [f32; 3] = [2.194, 1.201, 2.578];
const BED: ClassInfo = ClassInfo {
    name: "bed",
    label: "bed",
    original_model: Some("bed01"),
    detector_index: Some(47),
    size_m: BED_M,
    mass_kg: 95.0,
    parts: &in_meters(
        BED_M,
        [
            cuboid([0.0, 0.24, -0.36], [2.14, 0.3, 1.84], Paint([96, 124, 166], Finish::Fabric))
                .surface(),
            cuboid([0.0, 0.28, -0.03], [2.04, 0.25, 2.44], LINEN).surface(),
            cuboid([0.0, 0.08, -0.03], [2.1, 0.2, 2.5], OAK),
            cuboid([0.0, 0.0, 1.24], [2.194, 1.201, 0.09], OAK),
            cuboid([0.0, 0.541, 0.44], [2.14, 0.02, 0.26], LINEN).non_colliding(),
            ball([-0.5, 0.5, 0.9], [0.86, 0.2, 0.5], LINEN).non_colliding(),
            ball([0.5, 0.5, 0.9], [0.86, 0.2, 0.5], LINEN).non_colliding(),
            cuboid([-0.95, 0.0, -1.15], [0.1, 0.08, 0.1], WALNUT).non_colliding(),
            cuboid([0.95, 0.0, -1.15], [0.1, 0.08, 0.1], WALNUT).non_colliding(),
        ],
    ),
    palette: &[[96, 124, 166], [178, 92, 80], [136, 152, 118], [206, 196, 178]],
    ..FURNISHING
};

const LEGS_NIGHTSTAND: [Part; 4] = legs(0.18, 0.16, 0.12, 0.035, WALNUT);

const NIGHTSTAND_M: [f32; 3] = [0.45, 0.5, 0.4];
const NIGHTSTAND: ClassInfo = ClassInfo {
    name: "nightstand",
    label: "nightstand",
    size_m: NIGHTSTAND_M,
    mass_kg: 12.0,
    parts: &in_meters(
        NIGHTSTAND_M,
        [
            cuboid([0.0, 0.12, 0.01], [0.43, 0.355, 0.37], OAK),
            cuboid([0.0, 0.475, 0.0], [0.45, 0.025, 0.4], OAK).surface(),
            cuboid([0.0, 0.315, -0.18], [0.38, 0.14, 0.02], PALE_OAK).non_colliding(),
            cuboid([0.0, 0.145, -0.18], [0.38, 0.14, 0.02], PALE_OAK).non_colliding(),
            ball([0.0, 0.372, -0.19], [0.02, 0.02, 0.02], BRASS).non_colliding(),
            ball([0.0, 0.202, -0.19], [0.02, 0.02, 0.02], BRASS).non_colliding(),
            LEGS_NIGHTSTAND[0],
            LEGS_NIGHTSTAND[1],
            LEGS_NIGHTSTAND[2],
            LEGS_NIGHTSTAND[3],
        ],
    ),
    ..FURNISHING
};

const PANEL: Paint = Paint([138, 94, 64], Finish::Wood);

const WARDROBE_M: [f32; 3] = [1.2, 1.95, 0.6];
const WARDROBE: ClassInfo = ClassInfo {
    name: "wardrobe",
    label: "wardrobe",
    size_m: WARDROBE_M,
    mass_kg: 85.0,
    parts: &in_meters(
        WARDROBE_M,
        [
            cuboid([0.0, 0.06, 0.01], [1.16, 1.83, 0.55], WALNUT),
            cuboid([0.0, 1.89, 0.0], [1.2, 0.06, 0.6], WALNUT),
            cuboid([0.0, 0.0, 0.02], [1.1, 0.06, 0.5], BLACK).non_colliding(),
            cuboid([-0.285, 0.32, -0.275], [0.54, 1.54, 0.02], PANEL).non_colliding(),
            cuboid([0.285, 0.32, -0.275], [0.54, 1.54, 0.02], PANEL).non_colliding(),
            cuboid([-0.285, 0.09, -0.275], [0.54, 0.2, 0.02], PANEL).non_colliding(),
            cuboid([0.285, 0.09, -0.275], [0.54, 0.2, 0.02], PANEL).non_colliding(),
            cylinder([-0.05, 0.92, -0.287], [0.022, 0.26, 0.022], BRASS).non_colliding(),
            cylinder([0.05, 0.92, -0.287], [0.022, 0.26, 0.022], BRASS).non_colliding(),
            rod_x([-0.285, 0.2, -0.287], 0.14, 0.022, BRASS).non_colliding(),
            rod_x([0.285, 0.2, -0.287], 0.14, 0.022, BRASS).non_colliding(),
        ],
    ),
    ..FURNISHING
};

// Kitchen.

const CABINET_M: [f32; 3] = [0.9, 2.06, 0.45];
const CABINET: ClassInfo = ClassInfo {
    name: "cabinet",
    label: "cabinet",
    original_model: Some("cabinet_full_height_wood_beech_honey_composite"),
    detector_index: Some(48),
    size_m: CABINET_M,
    mass_kg: 70.0,
    parts: &in_meters(
        CABINET_M,
        [
            cuboid([0.0, 0.08, 0.015], [0.9, 1.98, 0.42], OAK).surface(),
            cuboid([0.0, 0.0, 0.03], [0.86, 0.08, 0.38], BLACK),
            cuboid([-0.222, 1.06, -0.2], [0.43, 0.97, 0.02], PALE_OAK).non_colliding(),
            cuboid([0.222, 1.06, -0.2], [0.43, 0.97, 0.02], PALE_OAK).non_colliding(),
            cuboid([-0.222, 0.1, -0.2], [0.43, 0.93, 0.02], PALE_OAK).non_colliding(),
            cuboid([0.222, 0.1, -0.2], [0.43, 0.93, 0.02], PALE_OAK).non_colliding(),
            cylinder([-0.04, 1.15, -0.216], [0.018, 0.2, 0.018], STEEL).non_colliding(),
            cylinder([0.04, 1.15, -0.216], [0.018, 0.2, 0.018], STEEL).non_colliding(),
            cylinder([-0.04, 0.74, -0.216], [0.018, 0.2, 0.018], STEEL).non_colliding(),
            cylinder([0.04, 0.74, -0.216], [0.018, 0.2, 0.018], STEEL).non_colliding(),
        ],
    ),
    ..FURNISHING
};

// Tables and seats.

const YELLOW: Paint = Paint([232, 188, 62], Finish::Fabric);
const LEGS_SIDE_CHAIR: [Part; 4] = legs(0.185, 0.2, 0.38, 0.035, WALNUT);

const SIDE_CHAIR_M: [f32; 3] = [0.43, 0.8, 0.49];
const SIDE_CHAIR: ClassInfo = ClassInfo {
    name: "side_chair",
    label: "chair",
    original_model: Some("yellow_side_chair"),
    detector_index: Some(50),
    size_m: SIDE_CHAIR_M,
    mass_kg: 6.0,
    parts: &in_meters(
        SIDE_CHAIR_M,
        [
            cuboid([0.0, 0.38, -0.015], [0.43, 0.07, 0.46], YELLOW).surface(),
            cuboid([0.0, 0.42, 0.215], [0.42, 0.38, 0.055], YELLOW),
            LEGS_SIDE_CHAIR[0],
            LEGS_SIDE_CHAIR[1],
            LEGS_SIDE_CHAIR[2],
            LEGS_SIDE_CHAIR[3],
        ],
    ),
    ..FURNISHING
};

const LEGS_DINING_TABLE: [Part; 4] = legs(0.68, 0.38, 0.71, 0.07, WALNUT);

const DINING_TABLE_M: [f32; 3] = [1.5, 0.75, 0.9];
const DINING_TABLE: ClassInfo = ClassInfo {
    name: "dining_table",
    label: "table",
    size_m: DINING_TABLE_M,
    mass_kg: 35.0,
    parts: &in_meters(
        DINING_TABLE_M,
        [
            cuboid([0.0, 0.71, 0.0], [1.5, 0.04, 0.9], Paint([168, 116, 72], Finish::Wood))
                .surface(),
            LEGS_DINING_TABLE[0],
            LEGS_DINING_TABLE[1],
            LEGS_DINING_TABLE[2],
            LEGS_DINING_TABLE[3],
            cuboid([0.0, 0.63, -0.38], [1.3, 0.08, 0.025], WALNUT).non_colliding(),
            cuboid([0.0, 0.63, 0.38], [1.3, 0.08, 0.025], WALNUT).non_colliding(),
            cuboid([-0.68, 0.63, 0.0], [0.025, 0.08, 0.7], WALNUT).non_colliding(),
            cuboid([0.68, 0.63, 0.0], [0.025, 0.08, 0.7], WALNUT).non_colliding(),
        ],
    ),
    palette: &[[168, 116, 72], [204, 166, 116], [122, 82, 56]],
    ..FURNISHING
};

const LEGS_COFFEE_TABLE: [Part; 4] = legs(0.5, 0.25, 0.39, 0.045, DARK_STEEL);

const COFFEE_TABLE_M: [f32; 3] = [1.1, 0.42, 0.6];
const COFFEE_TABLE: ClassInfo = ClassInfo {
    name: "coffee_table",
    label: "coffee table",
    size_m: COFFEE_TABLE_M,
    mass_kg: 18.0,
    parts: &in_meters(
        COFFEE_TABLE_M,
        [
            cuboid([0.0, 0.385, 0.0], [1.1, 0.035, 0.6], OAK).surface(),
            LEGS_COFFEE_TABLE[0],
            LEGS_COFFEE_TABLE[1],
            LEGS_COFFEE_TABLE[2],
            LEGS_COFFEE_TABLE[3],
            cuboid([0.0, 0.12, 0.0], [0.98, 0.02, 0.48], OAK).non_colliding(),
        ],
    ),
    palette: &[[192, 150, 98], [120, 80, 54], [222, 216, 206]],
    ..FURNISHING
};

const DESK_M: [f32; 3] = [1.3, 0.75, 0.65];
const DESK: ClassInfo = ClassInfo {
    name: "desk",
    label: "desk",
    size_m: DESK_M,
    mass_kg: 32.0,
    parts: &in_meters(
        DESK_M,
        [
            cuboid([0.0, 0.715, 0.0], [1.3, 0.035, 0.65], PALE_OAK).surface(),
            cuboid([0.44, 0.0, 0.02], [0.38, 0.715, 0.58], LACQUER),
            cuboid([-0.6, 0.0, -0.28], [0.05, 0.715, 0.05], LACQUER),
            cuboid([-0.6, 0.0, 0.28], [0.05, 0.715, 0.05], LACQUER),
            cuboid([-0.17, 0.4, 0.29], [0.86, 0.3, 0.02], LACQUER).non_colliding(),
            cuboid([0.44, 0.5, -0.275], [0.35, 0.19, 0.02], PALE_OAK).non_colliding(),
            cuboid([0.44, 0.28, -0.275], [0.35, 0.19, 0.02], PALE_OAK).non_colliding(),
            cuboid([0.44, 0.05, -0.275], [0.35, 0.2, 0.02], PALE_OAK).non_colliding(),
            rod_x([0.44, 0.6, -0.295], 0.12, 0.018, DARK_STEEL).non_colliding(),
            rod_x([0.44, 0.38, -0.295], 0.12, 0.018, DARK_STEEL).non_colliding(),
            rod_x([0.44, 0.16, -0.295], 0.12, 0.018, DARK_STEEL).non_colliding(),
        ],
    ),
    palette: &[[214, 180, 132], [150, 104, 66], [92, 66, 50]],
    ..FURNISHING
};

const LEGS_STOOL: [Part; 4] = legs(0.11, 0.11, 0.44, 0.032, PALE_OAK);

const STOOL_M: [f32; 3] = [0.38, 0.48, 0.38];
const STOOL: ClassInfo = ClassInfo {
    name: "stool",
    label: "stool",
    size_m: STOOL_M,
    mass_kg: 3.5,
    parts: &in_meters(
        STOOL_M,
        [
            cylinder([0.0, 0.44, 0.0], [0.38, 0.04, 0.38], PALE_OAK).surface(),
            LEGS_STOOL[0],
            LEGS_STOOL[1],
            LEGS_STOOL[2],
            LEGS_STOOL[3],
            rod_x([0.0, 0.18, -0.11], 0.22, 0.022, PALE_OAK).non_colliding(),
            rod_x([0.0, 0.18, 0.11], 0.22, 0.022, PALE_OAK).non_colliding(),
            rod_z([-0.11, 0.24, 0.0], 0.22, 0.022, PALE_OAK).non_colliding(),
            rod_z([0.11, 0.24, 0.0], 0.22, 0.022, PALE_OAK).non_colliding(),
        ],
    ),
    palette: &[[214, 180, 132], [176, 64, 56], [70, 112, 130]],
    ..FURNISHING
};

// Living room.

const ARMCHAIR_M: [f32; 3] = [0.85, 0.8, 0.8];
const ARMCHAIR: ClassInfo = ClassInfo {
    name: "armchair",
    label: "armchair",
    size_m: ARMCHAIR_M,
    mass_kg: 25.0,
    parts: &in_meters(
        ARMCHAIR_M,
        [
            cuboid([0.0, 0.26, -0.09], [0.53, 0.16, 0.62], Paint([178, 96, 62], Finish::Fabric))
                .surface(),
            cuboid([0.0, 0.08, 0.0], [0.85, 0.18, 0.76], CHARCOAL),
            cuboid([0.0, 0.26, 0.31], [0.85, 0.54, 0.18], CHARCOAL),
            cuboid([-0.345, 0.26, -0.08], [0.16, 0.3, 0.62], CHARCOAL),
            cuboid([0.345, 0.26, -0.08], [0.16, 0.3, 0.62], CHARCOAL),
            rod_z([-0.345, 0.55, -0.08], 0.62, 0.15, CHARCOAL).non_colliding(),
            rod_z([0.345, 0.55, -0.08], 0.62, 0.15, CHARCOAL).non_colliding(),
            ball([0.0, 0.4, 0.17], [0.5, 0.36, 0.14], Paint([202, 168, 128], Finish::Fabric))
                .non_colliding(),
            cuboid([0.0, 0.0, 0.0], [0.7, 0.08, 0.6], WALNUT).non_colliding(),
        ],
    ),
    palette: &[[178, 96, 62], [84, 118, 138], [134, 142, 96]],
    ..FURNISHING
};

const SOFA_FRAME: Paint = Paint([122, 126, 132], Finish::Fabric);
const SOFA_CUSHION: Paint = Paint([150, 154, 160], Finish::Fabric);

const LONG_SOFA_M: [f32; 3] = [1.9, 0.75, 0.85];
const LONG_SOFA: ClassInfo = ClassInfo {
    name: "long_sofa",
    label: "sofa",
    size_m: LONG_SOFA_M,
    mass_kg: 55.0,
    parts: &in_meters(
        LONG_SOFA_M,
        [
            cuboid([0.0, 0.26, -0.1], [1.52, 0.16, 0.65], Paint([86, 110, 136], Finish::Fabric))
                .surface(),
            cuboid([0.0, 0.07, 0.0], [1.86, 0.19, 0.82], SOFA_FRAME),
            cuboid([0.0, 0.07, 0.325], [1.9, 0.68, 0.2], SOFA_FRAME),
            cuboid([-0.855, 0.07, -0.1], [0.19, 0.47, 0.65], SOFA_FRAME),
            cuboid([0.855, 0.07, -0.1], [0.19, 0.47, 0.65], SOFA_FRAME),
            rod_z([-0.855, 0.53, -0.1], 0.65, 0.18, SOFA_FRAME).non_colliding(),
            rod_z([0.855, 0.53, -0.1], 0.65, 0.18, SOFA_FRAME).non_colliding(),
            ball([-0.5, 0.38, 0.17], [0.5, 0.34, 0.2], SOFA_CUSHION).non_colliding(),
            ball([0.0, 0.38, 0.17], [0.5, 0.34, 0.2], SOFA_CUSHION).non_colliding(),
            ball([0.5, 0.38, 0.17], [0.5, 0.34, 0.2], SOFA_CUSHION).non_colliding(),
            cuboid([-0.254, 0.27, -0.1], [0.012, 0.151, 0.646], SOFA_FRAME).non_colliding(),
            cuboid([0.254, 0.27, -0.1], [0.012, 0.151, 0.646], SOFA_FRAME).non_colliding(),
            cuboid([0.0, 0.0, 0.0], [1.7, 0.07, 0.66], WALNUT).non_colliding(),
        ],
    ),
    palette: &[[86, 110, 136], [160, 84, 66], [124, 138, 100], [206, 194, 172]],
    ..FURNISHING
};

const LEGS_TV_STAND: [Part; 4] = legs(0.62, 0.14, 0.1, 0.045, BLACK);

const TV_STAND_M: [f32; 3] = [1.4, 0.5, 0.4];
const TV_STAND: ClassInfo = ClassInfo {
    name: "tv_stand",
    label: "tv stand",
    size_m: TV_STAND_M,
    mass_kg: 28.0,
    parts: &in_meters(
        TV_STAND_M,
        [
            cuboid([0.0, 0.46, 0.0], [1.4, 0.04, 0.4], WALNUT).surface(),
            cuboid([0.0, 0.1, 0.015], [1.38, 0.36, 0.37], WALNUT),
            cuboid([-0.46, 0.12, -0.175], [0.42, 0.32, 0.02], PALE_OAK).non_colliding(),
            cuboid([0.46, 0.12, -0.175], [0.42, 0.32, 0.02], PALE_OAK).non_colliding(),
            cuboid([0.0, 0.12, -0.165], [0.46, 0.15, 0.02], BLACK).non_colliding(),
            cuboid([0.0, 0.29, -0.165], [0.46, 0.15, 0.02], BLACK).non_colliding(),
            cuboid([0.03, 0.13, -0.17], [0.3, 0.05, 0.02], DARK_STEEL).non_colliding(),
            ball([-0.28, 0.27, -0.19], [0.025, 0.025, 0.02], BRASS).non_colliding(),
            ball([0.28, 0.27, -0.19], [0.025, 0.025, 0.02], BRASS).non_colliding(),
            LEGS_TV_STAND[0],
            LEGS_TV_STAND[1],
            LEGS_TV_STAND[2],
            LEGS_TV_STAND[3],
        ],
    ),
    palette: &[[112, 74, 50], [210, 206, 198], [60, 60, 64]],
    ..FURNISHING
};

/// A row of books on the shelf whose board has its top at `y`.
const fn books(x: f32, y: f32, width_m: f32, height_m: f32, color: [u8; 3]) -> Part {
    cuboid([x, y, -0.06], [width_m, height_m, 0.14], Paint(color, Finish::Matte)).non_colliding()
}

/// A board of the bookshelf with its top at `y`.
const fn book_board(y: f32) -> Part {
    cuboid([0.0, y - 0.03, 0.0], [0.9, 0.03, 0.3], OAK).non_colliding()
}

const BOOKSHELF_M: [f32; 3] = [0.9, 1.4, 0.3];
const BOOKSHELF: ClassInfo = ClassInfo {
    name: "bookshelf",
    label: "bookshelf",
    size_m: BOOKSHELF_M,
    mass_kg: 60.0,
    parts: &in_meters(
        BOOKSHELF_M,
        [
            cuboid([0.0, 0.0, 0.06], [0.88, 1.39, 0.178], WALNUT),
            cuboid([-0.435, 0.0, 0.0], [0.03, 1.4, 0.3], OAK),
            cuboid([0.435, 0.0, 0.0], [0.03, 1.4, 0.3], OAK),
            book_board(0.08),
            book_board(0.51),
            book_board(0.94),
            book_board(1.4),
            books(-0.33, 0.08, 0.16, 0.32, [150, 52, 48]),
            books(-0.16, 0.08, 0.15, 0.27, [52, 82, 128]),
            books(0.12, 0.08, 0.3, 0.3, [196, 170, 110]),
            books(-0.29, 0.51, 0.24, 0.29, [66, 110, 80]),
            books(-0.09, 0.51, 0.1, 0.34, [214, 206, 188]),
            books(0.26, 0.51, 0.28, 0.27, [140, 74, 50]),
            books(-0.3, 0.94, 0.22, 0.3, [90, 70, 120]),
            books(-0.08, 0.94, 0.18, 0.26, [206, 150, 54]),
            books(0.2, 0.94, 0.14, 0.33, [60, 120, 140]),
        ],
    ),
    ..FURNISHING
};

/// A leaf of the plant, leaning outward.
const fn leaf(x: f32, y: f32, z: f32, turn_deg: [f32; 3], paint: Paint) -> Part {
    ball([x, y, z], [0.13, 0.5, 0.035], paint).turned(turn_deg).non_colliding()
}

const TERRACOTTA: Paint = Paint([182, 100, 66], Finish::Matte);

const POTTED_PLANT_M: [f32; 3] = [0.45, 1.1, 0.45];
const POTTED_PLANT: ClassInfo = ClassInfo {
    name: "potted_plant",
    label: "potted plant",
    size_m: POTTED_PLANT_M,
    mass_kg: 14.0,
    parts: &in_meters(
        POTTED_PLANT_M,
        [
            round_tub([0.0, 0.0, 0.0], [0.34, 0.34, 0.34], 0.02, 0.7, TERRACOTTA),
            cylinder([0.0, 0.25, 0.0], [0.3, 0.05, 0.3], Paint([70, 50, 38], Finish::Crust))
                .non_colliding(),
            cylinder([0.0, 0.25, 0.0], [0.024, 0.5, 0.024], LEAF).non_colliding(),
            ball([0.0, 0.6, 0.0], [0.16, 0.5, 0.06], LIGHT_LEAF).non_colliding(),
            leaf(0.1, 0.46, 0.0, [0.0, 0.0, -24.0], LEAF),
            leaf(-0.1, 0.46, 0.0, [0.0, 0.0, 24.0], LEAF),
            leaf(0.0, 0.44, -0.1, [-22.0, 0.0, 0.0], LIGHT_LEAF),
            leaf(0.0, 0.44, 0.1, [22.0, 0.0, 0.0], LIGHT_LEAF),
            leaf(0.09, 0.34, -0.09, [-30.0, -45.0, 0.0], LEAF),
            leaf(-0.09, 0.34, -0.09, [-30.0, 45.0, 0.0], LIGHT_LEAF),
            leaf(0.09, 0.34, 0.09, [30.0, 45.0, 0.0], LIGHT_LEAF),
            leaf(-0.09, 0.34, 0.09, [30.0, -45.0, 0.0], LEAF),
        ],
    ),
    palette: &[[182, 100, 66], [226, 222, 212], [70, 76, 82]],
    ..FURNISHING
};

const FLOOR_LAMP_M: [f32; 3] = [0.4, 1.6, 0.4];
const FLOOR_LAMP: ClassInfo = ClassInfo {
    name: "floor_lamp",
    label: "floor lamp",
    size_m: FLOOR_LAMP_M,
    mass_kg: 6.0,
    parts: &in_meters(
        FLOOR_LAMP_M,
        [
            taper(0.66, [0.0, 1.26, 0.0], [0.4, 0.32, 0.4], Paint([244, 226, 186], Finish::Fabric)),
            cylinder([0.0, 0.03, 0.0], [0.03, 1.57, 0.03], DARK_STEEL),
            taper(0.9, [0.0, 0.0, 0.0], [0.3, 0.03, 0.3], DARK_STEEL),
            ball([0.0, 1.56, 0.0], [0.04, 0.04, 0.04], BRASS).non_colliding(),
        ],
    ),
    palette: &[[244, 226, 186], [216, 130, 84], [150, 176, 170]],
    ..FURNISHING
};

const RUG_M: [f32; 3] = [2.0, 0.01, 1.4];
const RUG: ClassInfo = ClassInfo {
    name: "rug",
    label: "rug",
    size_m: RUG_M,
    mass_kg: 8.0,
    parts: &in_meters(
        RUG_M,
        [
            cuboid([0.0, 0.0, 0.0], [2.0, 0.007, 1.4], Paint([150, 58, 52], Finish::Fabric)),
            cuboid([0.0, 0.0, 0.0], [1.8, 0.008, 1.2], Paint([224, 206, 168], Finish::Fabric))
                .non_colliding(),
            cuboid([0.0, 0.0, 0.0], [1.68, 0.009, 1.08], Paint([60, 76, 108], Finish::Fabric))
                .non_colliding(),
            cylinder([0.0, 0.0, 0.0], [0.8, 0.01, 0.6], Paint([224, 206, 168], Finish::Fabric))
                .non_colliding(),
        ],
    ),
    palette: &[[150, 58, 52], [70, 104, 84], [176, 136, 72]],
    ..FURNISHING
};
