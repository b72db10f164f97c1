//! Other immovable objects in the houses of the original, with simple shapes. Sizes are those of
//! the original's models; importers scale each object to its own size.

use super::shape::{
    BLACK, BRASS, DARK_STEEL, FURNISHING, GLASS, GLOSSY_BLACK, Paint, STEEL, WHITE, arc, ball,
    cuboid, cylinder, in_meters, ring, rod_x, rod_z, round_tub, taper,
};
use super::{ClassInfo, Finish, Part, Solid};

pub(super) const CLASSES: &[ClassInfo] = &[
    decor("corner_sofa", "sofa", CORNER_SOFA_M, 120.0, &CORNER_SOFA, SOFA_COLORS),
    decor("bench_sofa", "sofa", BENCH_SOFA_M, 25.0, &BENCH_SOFA, BENCH_COLORS),
    decor("round_table", "table", ROUND_TABLE_M, 15.0, &ROUND_TABLE, TABLE_COLORS),
    decor("stacked_tables", "table", STACKED_TABLES_M, 18.0, &STACKED_TABLES, &[]),
    decor("table_lamp", "table lamp", TABLE_LAMP_M, 2.0, &TABLE_LAMP, &[]),
    decor("painting", "painting", PAINTING_M, 3.0, &PAINTING, PAINTING_COLORS),
    decor("cushion", "cushion", CUSHION_M, 0.6, &CUSHION, CUSHION_COLORS),
    decor("suitcase", "suitcase", SUITCASE_M, 3.5, &SUITCASE, SUITCASE_COLORS),
    decor("trunk", "trunk", TRUNK_M, 20.0, &TRUNK, &[]),
    decor("woven_box", "box", WOVEN_BOX_M, 4.0, &WOVEN_BOX, &[]),
    decor("dog_house", "dog house", DOG_HOUSE_M, 15.0, &DOG_HOUSE, &[]),
    decor("planter", "planter", PLANTER_M, 9.0, &PLANTER, &[]),
    decor("flower_vase", "flower vase", FLOWER_VASE_M, 1.0, &FLOWER_VASE, &[]),
    decor("coffee_maker", "coffee maker", COFFEE_MAKER_M, 3.0, &COFFEE_MAKER, &[]),
    decor("toaster", "toaster", TOASTER_M, 1.5, &TOASTER, &[]),
    decor("jug", "jug", JUG_M, 1.2, &JUG, &[]),
    decor("pan", "pan", PAN_M, 1.8, &PAN, &[]),
    decor("baking_sheet", "baking sheet", BAKING_SHEET_M, 0.8, &BAKING_SHEET, &[]),
    decor("wineglass", "wineglass", WINEGLASS_M, 0.2, &WINEGLASS, &[]),
    decor("pepper_mill", "pepper mill", PEPPER_MILL_M, 0.2, &PEPPER_MILL, &[]),
    decor("cutlery", "cutlery", CUTLERY_M, 0.05, &CUTLERY, &[]),
    decor("kitchen_tool", "kitchen tool", KITCHEN_TOOL_M, 0.2, &KITCHEN_TOOL, &[]),
    decor("notepad", "notepad", NOTEPAD_M, 0.3, &NOTEPAD, &[]),
    decor("laptop", "laptop", LAPTOP_M, 1.3, &LAPTOP, &[]),
    decor("headphones", "headphones", HEADPHONES_M, 0.3, &HEADPHONES, &[]),
    decor("globe", "globe", GLOBE_M, 0.5, &GLOBE, &[]),
    decor("sculpture", "sculpture", SCULPTURE_M, 0.5, &SCULPTURE, &[]),
    decor("toy_horse", "toy", TOY_HORSE_M, 3.0, &TOY_HORSE, TOY_COLORS),
    decor("puzzle_box", "toy", PUZZLE_BOX_M, 1.0, &PUZZLE_BOX, &[]),
];

const fn decor(
    name: &'static str,
    label: &'static str,
    size_m: [f32; 3],
    mass_kg: f32,
    parts: &'static [Part],
    palette: &'static [[u8; 3]],
) -> ClassInfo {
    ClassInfo { name, label, size_m, mass_kg, parts, palette, ..FURNISHING }
}

const GRAY_FABRIC: Paint = Paint([134, 131, 127], Finish::Fabric);
const DARK_FABRIC: Paint = Paint([92, 90, 88], Finish::Fabric);
const OAK: Paint = Paint([191, 159, 128], Finish::Wood);
const WALNUT: Paint = Paint([112, 74, 50], Finish::Wood);
const PAPER: Paint = Paint([240, 240, 236], Finish::Matte);
const WICKER: Paint = Paint([206, 178, 142], Finish::Wicker);
const PORCELAIN: Paint = Paint([226, 224, 220], Finish::Glossy);
const BRONZE: Paint = Paint([128, 92, 62], Finish::Metal);

// Seats and tables.

const SOFA_COLORS: &[[u8; 3]] = &[[134, 131, 127], [162, 151, 142], [50, 54, 61], [156, 32, 44]];
const BENCH_COLORS: &[[u8; 3]] = &[[134, 131, 127], [221, 218, 213], [65, 50, 40]];
const TABLE_COLORS: &[[u8; 3]] =
    &[[191, 159, 128], [217, 216, 214], [145, 141, 134], [112, 74, 50]];

/// Two wings at a right angle, the longer along the back (+z), the other along -x; seats at 0.42 m.
/// Fitted to the measured heights of the original's corner sofa.
const CORNER_SOFA_M: [f32; 3] = [4.54, 0.9, 2.85];
const CORNER_SOFA: [Part; 8] = in_meters(
    CORNER_SOFA_M,
    [
        cuboid([-1.56, 0.26, -0.1], [0.58, 0.16, 2.65], GRAY_FABRIC).surface(),
        cuboid([0.5, 0.26, 0.715], [3.54, 0.16, 0.53], GRAY_FABRIC).surface(),
        cuboid([1.61, 0.26, 0.175], [1.32, 0.16, 0.55], GRAY_FABRIC).surface(),
        cuboid([-1.77, 0.0, 0.0], [1.0, 0.26, 2.85], DARK_FABRIC),
        cuboid([0.5, 0.0, 0.94], [3.54, 0.26, 0.97], DARK_FABRIC),
        cuboid([-2.06, 0.26, 0.09], [0.42, 0.54, 2.67], DARK_FABRIC),
        cuboid([0.21, 0.26, 1.2], [4.12, 0.54, 0.45], DARK_FABRIC),
        cuboid([2.01, 0.26, 0.74], [0.52, 0.36, 0.48], DARK_FABRIC),
    ],
);

const BENCH_SOFA_M: [f32; 3] = [1.28, 0.44, 0.48];
const BENCH_SOFA: [Part; 6] = in_meters(
    BENCH_SOFA_M,
    [
        cuboid([0.0, 0.3, 0.0], [1.28, 0.14, 0.48], GRAY_FABRIC).surface(),
        cuboid([0.0, 0.26, 0.0], [1.2, 0.04, 0.42], DARK_STEEL),
        cuboid([-0.58, 0.0, -0.18], [0.05, 0.26, 0.05], STEEL),
        cuboid([0.58, 0.0, -0.18], [0.05, 0.26, 0.05], STEEL),
        cuboid([-0.58, 0.0, 0.18], [0.05, 0.26, 0.05], STEEL),
        cuboid([0.58, 0.0, 0.18], [0.05, 0.26, 0.05], STEEL),
    ],
);

/// A disc on a pillar. Its supporting surface is the inscribed square, so that no object is placed
/// on air.
const ROUND_TABLE_M: [f32; 3] = [0.6, 0.45, 0.6];
const ROUND_TABLE: [Part; 4] = in_meters(
    ROUND_TABLE_M,
    [
        cylinder([0.0, 0.41, 0.0], [0.6, 0.04, 0.6], OAK).non_colliding(),
        cuboid([0.0, 0.41, 0.0], [0.424, 0.04, 0.424], OAK).surface(),
        cylinder([0.0, 0.02, 0.0], [0.1, 0.39, 0.1], DARK_STEEL),
        cylinder([0.0, 0.0, 0.0], [0.36, 0.02, 0.36], DARK_STEEL),
    ],
);

/// Two tables, the lower one half under the higher one.
const STACKED_TABLES_M: [f32; 3] = [1.3, 0.4715, 0.9974];
const STACKED_TABLES: [Part; 6] = in_meters(
    STACKED_TABLES_M,
    [
        cuboid([-0.4, 0.4315, 0.027], [0.5, 0.04, 0.94], WHITE).surface(),
        cuboid([0.25, 0.29, -0.013], [0.8, 0.04, 0.8], WHITE).surface(),
        cuboid([-0.6, 0.0, 0.027], [0.04, 0.4315, 0.8], WHITE),
        cuboid([-0.2, 0.0, 0.027], [0.04, 0.4315, 0.8], WHITE),
        cuboid([0.62, 0.0, -0.34], [0.04, 0.29, 0.04], STEEL),
        cuboid([0.62, 0.0, 0.32], [0.04, 0.29, 0.04], STEEL),
    ],
);

// Lamps, pictures, cushions.

const TABLE_LAMP_M: [f32; 3] = [0.4, 0.6, 0.4];
const TABLE_LAMP: [Part; 3] = in_meters(
    TABLE_LAMP_M,
    [
        taper(0.7, [0.0, 0.34, 0.0], [0.4, 0.26, 0.4], Paint([244, 230, 200], Finish::Fabric)),
        cylinder([0.0, 0.02, 0.0], [0.05, 0.34, 0.05], BRASS),
        cylinder([0.0, 0.0, 0.0], [0.2, 0.02, 0.2], BRASS),
    ],
);

const PAINTING_COLORS: &[[u8; 3]] =
    &[[172, 158, 139], [182, 181, 184], [96, 120, 150], [150, 84, 62]];
const PAINTING_M: [f32; 3] = [0.82, 1.16, 0.04];
const PAINTING: [Part; 4] = in_meters(
    PAINTING_M,
    [
        cuboid([0.0, 0.06, 0.0], [0.7, 1.04, 0.034], Paint([172, 158, 139], Finish::Matte)),
        cuboid([0.0, 0.0, 0.005], [0.82, 1.16, 0.03], WALNUT),
        ball([-0.12, 0.5, -0.01], [0.3, 0.4, 0.02], Paint([206, 176, 96], Finish::Matte))
            .non_colliding(),
        cuboid([0.1, 0.2, -0.01], [0.36, 0.3, 0.02], Paint([88, 104, 84], Finish::Matte))
            .non_colliding(),
    ],
);

const CUSHION_COLORS: &[[u8; 3]] = &[[123, 122, 119], [122, 120, 103], [153, 151, 145]];
const CUSHION_M: [f32; 3] = [0.13, 0.3, 0.38];
const CUSHION: [Part; 1] = in_meters(
    CUSHION_M,
    [ball([0.0, 0.0, 0.0], [0.13, 0.3, 0.38], Paint([123, 122, 119], Finish::Fabric))],
);

// Luggage and boxes.

const SUITCASE_COLORS: &[[u8; 3]] =
    &[[144, 84, 82], [199, 197, 193], [96, 116, 150], [217, 218, 212]];
const SUITCASE_M: [f32; 3] = [0.46, 0.39, 0.11];
const SUITCASE: [Part; 4] = in_meters(
    SUITCASE_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.46, 0.34, 0.1], Paint([144, 84, 82], Finish::Matte)),
        cuboid([0.0, 0.155, 0.0], [0.46, 0.02, 0.106], BLACK).non_colliding(),
        arc([0.0, 0.34, 0.0], 0.14, 0.02, 180.0, BLACK).turned([90.0, 0.0, 0.0]),
        cuboid([0.0, 0.28, -0.052], [0.06, 0.04, 0.006], BRASS).non_colliding(),
    ],
);

const TRUNK_M: [f32; 3] = [0.885, 0.99, 0.68];
const TRUNK: [Part; 6] = in_meters(
    TRUNK_M,
    [
        cuboid([0.0, 0.0, 0.01], [0.885, 0.7, 0.66], Paint([150, 116, 88], Finish::Wood)),
        cuboid([0.0, 0.7, 0.0], [0.885, 0.29, 0.68], Paint([128, 96, 72], Finish::Wood)).surface(),
        cuboid([-0.3, 0.0, -0.325], [0.06, 0.99, 0.03], BRASS).non_colliding(),
        cuboid([0.3, 0.0, -0.325], [0.06, 0.99, 0.03], BRASS).non_colliding(),
        cuboid([0.0, 0.62, -0.328], [0.12, 0.14, 0.02], BRASS).non_colliding(),
        cuboid([0.0, 0.69, 0.0], [0.886, 0.02, 0.68], BLACK).non_colliding(),
    ],
);

const WOVEN_BOX_M: [f32; 3] = [0.72, 0.5, 0.72];
const WOVEN_BOX: [Part; 2] = in_meters(
    WOVEN_BOX_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.7, 0.42, 0.7], WICKER),
        cuboid([0.0, 0.42, 0.0], [0.72, 0.08, 0.72], WICKER).surface(),
    ],
);

const DOG_HOUSE_M: [f32; 3] = [1.14, 0.83, 1.18];
const DOG_HOUSE: [Part; 4] = in_meters(
    DOG_HOUSE_M,
    [
        cuboid([0.0, 0.0, 0.0], [1.04, 0.72, 1.08], Paint([132, 130, 132], Finish::Wood)),
        cuboid([0.0, 0.72, 0.0], [1.14, 0.11, 1.18], Paint([96, 94, 96], Finish::Matte)).surface(),
        cuboid([-0.25, 0.05, -0.545], [0.34, 0.5, 0.02], BLACK).non_colliding(),
        cuboid([0.25, 0.05, -0.545], [0.34, 0.5, 0.02], BLACK).non_colliding(),
    ],
);

const PLANTER_M: [f32; 3] = [0.513, 0.504, 0.512];
const PLANTER: [Part; 2] = in_meters(
    PLANTER_M,
    [
        round_tub([0.0, 0.0, 0.0], [0.513, 0.504, 0.512], 0.03, 0.6, PORCELAIN),
        cylinder([0.0, 0.38, 0.0], [0.4, 0.04, 0.4], Paint([88, 74, 60], Finish::Crust))
            .non_colliding(),
    ],
);

const FLOWER_VASE_M: [f32; 3] = [0.097, 0.293, 0.097];
const FLOWER_VASE: [Part; 3] = in_meters(
    FLOWER_VASE_M,
    [
        ball([0.0, 0.0, 0.0], [0.097, 0.2, 0.097], Paint([201, 181, 172], Finish::Glossy)),
        cylinder([0.0, 0.17, 0.0], [0.036, 0.11, 0.036], Paint([201, 181, 172], Finish::Glossy)),
        ring([0.0, 0.283, 0.0], 0.05, 0.018, Paint([186, 166, 156], Finish::Glossy))
            .non_colliding(),
    ],
);

// Kitchen.

const COFFEE_MAKER_M: [f32; 3] = [0.327, 0.345, 0.165];
const COFFEE_MAKER: [Part; 5] = in_meters(
    COFFEE_MAKER_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.327, 0.05, 0.165], WHITE),
        cuboid([0.11, 0.05, 0.0], [0.107, 0.295, 0.165], WHITE),
        cuboid([0.0, 0.255, 0.0], [0.327, 0.09, 0.165], WHITE),
        cylinder([-0.06, 0.05, 0.0], [0.13, 0.16, 0.13], GLASS).non_colliding(),
        cuboid([0.0, 0.28, -0.08], [0.1, 0.03, 0.005], BLACK).non_colliding(),
    ],
);

const TOASTER_M: [f32; 3] = [0.373, 0.184, 0.17];
const TOASTER: [Part; 4] = in_meters(
    TOASTER_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.35, 0.18, 0.17], STEEL),
        cuboid([0.0, 0.174, -0.035], [0.26, 0.01, 0.03], BLACK).non_colliding(),
        cuboid([0.0, 0.174, 0.035], [0.26, 0.01, 0.03], BLACK).non_colliding(),
        cuboid([0.176, 0.1, 0.0], [0.02, 0.025, 0.05], BLACK).non_colliding(),
    ],
);

const JUG_M: [f32; 3] = [0.2, 0.295, 0.15];
const JUG: [Part; 4] = in_meters(
    JUG_M,
    [
        ball([0.025, 0.0, 0.0], [0.15, 0.24, 0.15], Paint([64, 44, 26], Finish::Glossy)),
        cylinder([0.025, 0.19, 0.0], [0.07, 0.09, 0.07], Paint([64, 44, 26], Finish::Glossy)),
        ring([0.025, 0.285, 0.0], 0.08, 0.02, Paint([84, 60, 38], Finish::Glossy)).non_colliding(),
        arc([-0.045, 0.18, 0.0], 0.11, 0.02, 180.0, Paint([64, 44, 26], Finish::Glossy))
            .turned([0.0, 90.0, 90.0]),
    ],
);

const PAN_M: [f32; 3] = [0.365, 0.104, 0.475];
const PAN: [Part; 4] = in_meters(
    PAN_M,
    [
        cylinder([0.0, 0.0, 0.08], [0.31, 0.06, 0.31], DARK_STEEL),
        cylinder([0.0, 0.06, 0.08], [0.3, 0.02, 0.3], STEEL),
        ball([0.0, 0.078, 0.08], [0.04, 0.026, 0.04], BLACK).non_colliding(),
        rod_z([0.0, 0.05, -0.15], 0.17, 0.025, BLACK).non_colliding(),
    ],
);

const BAKING_SHEET_M: [f32; 3] = [0.6, 0.015, 0.353];
const BAKING_SHEET: [Part; 2] = in_meters(
    BAKING_SHEET_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.6, 0.006, 0.353], STEEL),
        Part {
            collides: false,
            ..Part::new(
                Solid::Tub { wall: 0.02, bottom: 0.97 },
                [0.0, 0.0075, 0.0],
                [0.6, 0.015, 0.353],
                [186, 189, 194],
                Finish::Metal,
            )
        },
    ],
);

const WINEGLASS_M: [f32; 3] = [0.056, 0.108, 0.056];
const WINEGLASS: [Part; 3] = in_meters(
    WINEGLASS_M,
    [
        taper(1.3, [0.0, 0.055, 0.0], [0.056, 0.053, 0.056], PORCELAIN),
        cylinder([0.0, 0.004, 0.0], [0.008, 0.052, 0.008], PORCELAIN),
        cylinder([0.0, 0.0, 0.0], [0.05, 0.004, 0.05], PORCELAIN),
    ],
);

const PEPPER_MILL_M: [f32; 3] = [0.06, 0.12, 0.06];
const PEPPER_MILL: [Part; 2] = in_meters(
    PEPPER_MILL_M,
    [
        taper(0.6, [0.0, 0.0, 0.0], [0.06, 0.09, 0.06], WALNUT),
        ball([0.0, 0.08, 0.0], [0.045, 0.04, 0.045], WALNUT),
    ],
);

/// A fork, knife or spoon with its handle along z.
const CUTLERY_M: [f32; 3] = [0.025, 0.015, 0.17];
const CUTLERY: [Part; 2] = in_meters(
    CUTLERY_M,
    [
        cuboid([0.0, 0.0, 0.03], [0.01, 0.006, 0.11], STEEL),
        ball([0.0, 0.0, -0.055], [0.025, 0.015, 0.06], STEEL),
    ],
);

/// A ladle or spatula with its handle along z.
const KITCHEN_TOOL_M: [f32; 3] = [0.1, 0.05, 0.45];
const KITCHEN_TOOL: [Part; 2] = in_meters(
    KITCHEN_TOOL_M,
    [
        rod_z([0.0, 0.03, 0.06], 0.32, 0.018, BLACK),
        ball([0.0, 0.0, -0.17], [0.1, 0.05, 0.11], DARK_STEEL),
    ],
);

// Desk and shelf.

const NOTEPAD_M: [f32; 3] = [0.115, 0.052, 0.115];
const NOTEPAD: [Part; 2] = in_meters(
    NOTEPAD_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.115, 0.046, 0.115], PAPER),
        cuboid([0.0, 0.046, 0.0], [0.11, 0.006, 0.11], Paint([246, 224, 120], Finish::Matte)),
    ],
);

const LAPTOP_M: [f32; 3] = [0.313, 0.277, 0.256];
const LAPTOP: [Part; 4] = in_meters(
    LAPTOP_M,
    [
        cuboid([0.0, 0.0, -0.02], [0.313, 0.016, 0.215], STEEL),
        cuboid([0.0, 0.014, 0.11], [0.313, 0.26, 0.012], STEEL),
        cuboid([0.0, 0.03, 0.102], [0.29, 0.23, 0.008], GLOSSY_BLACK).non_colliding(),
        cuboid([0.0, 0.012, 0.0], [0.27, 0.006, 0.1], BLACK).non_colliding(),
    ],
);

const HEADPHONES_M: [f32; 3] = [0.26, 0.25, 0.1];
const HEADPHONES: [Part; 3] = in_meters(
    HEADPHONES_M,
    [
        rod_x([-0.1, 0.06, 0.0], 0.06, 0.1, GLOSSY_BLACK),
        rod_x([0.1, 0.06, 0.0], 0.06, 0.1, GLOSSY_BLACK),
        arc([0.0, 0.12, 0.0], 0.24, 0.025, 200.0, GLOSSY_BLACK).turned([90.0, 0.0, 0.0]),
    ],
);

const GLOBE_M: [f32; 3] = [0.158, 0.196, 0.145];
const GLOBE: [Part; 3] = in_meters(
    GLOBE_M,
    [
        ball([0.0, 0.05, 0.0], [0.145, 0.145, 0.145], Paint([120, 156, 190], Finish::Glossy)),
        cylinder([0.0, 0.012, 0.0], [0.02, 0.045, 0.02], BRASS),
        cylinder([0.0, 0.0, 0.0], [0.1, 0.012, 0.1], WALNUT),
    ],
);

const SCULPTURE_M: [f32; 3] = [0.031, 0.03, 0.031];
const SCULPTURE: [Part; 2] = in_meters(
    SCULPTURE_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.024, 0.006, 0.024], BLACK),
        ball([0.0, 0.006, 0.0], [0.031, 0.024, 0.031], BRONZE),
    ],
);

const TOY_COLORS: &[[u8; 3]] = &[[210, 195, 177], [192, 98, 90], [147, 165, 180]];
const TOY_HORSE_PAINT: Paint = Paint([210, 195, 177], Finish::Wood);
/// A rocking horse facing -x.
const TOY_HORSE_M: [f32; 3] = [0.935, 0.551, 0.269];
const TOY_HORSE: [Part; 6] = in_meters(
    TOY_HORSE_M,
    [
        ball([0.02, 0.2, 0.0], [0.5, 0.2, 0.18], TOY_HORSE_PAINT),
        cuboid([-0.22, 0.3, 0.0], [0.1, 0.18, 0.08], TOY_HORSE_PAINT),
        ball([-0.3, 0.42, 0.0], [0.24, 0.12, 0.09], TOY_HORSE_PAINT),
        rod_x([0.0, 0.025, -0.11], 0.93, 0.05, WALNUT),
        rod_x([0.0, 0.025, 0.11], 0.93, 0.05, WALNUT),
        cuboid([0.0, 0.05, 0.0], [0.34, 0.2, 0.2], WALNUT).non_colliding(),
    ],
);

const PUZZLE_BOX_M: [f32; 3] = [0.28, 0.141, 0.34];
const PUZZLE_BOX: [Part; 4] = in_meters(
    PUZZLE_BOX_M,
    [
        cuboid([0.0, 0.0, 0.0], [0.28, 0.13, 0.34], OAK),
        cylinder([-0.07, 0.125, 0.0], [0.06, 0.016, 0.06], Paint([200, 60, 50], Finish::Matte)),
        cuboid([0.06, 0.125, 0.08], [0.06, 0.016, 0.06], Paint([60, 110, 170], Finish::Matte)),
        cuboid([0.06, 0.125, -0.08], [0.07, 0.016, 0.05], Paint([230, 190, 70], Finish::Matte)),
    ],
);
