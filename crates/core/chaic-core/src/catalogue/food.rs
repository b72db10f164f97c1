//! Food from the kitchen and the market, carried in one hand: fruit, bread, cakes and cans.

use super::shape::{
    DARK_STEEL, Paint, STEEL, TARGET, arc, ball, cuboid, cylinder, in_meters, ring, taper,
};
use super::{ClassInfo, Finish, Part, TargetSet};

pub(super) const CLASSES: &[ClassInfo] = &[
    APPLE,
    BANANA,
    ORANGE,
    SHOP_BANANA,
    GRAPE,
    BREAD,
    BURGER,
    LOAF_BREAD,
    CROISSANT,
    PINK_DONUT,
    PEPSI_CAN,
    COCACOLA_CAN,
    SPRITE_CAN,
    FANTA_CAN,
];

// Fruit.

const PEEL: Paint = Paint([236, 200, 60], Finish::Skin);
const STALK: Paint = Paint([92, 70, 40], Finish::Wood);
const LEAF: Paint = Paint([74, 132, 52], Finish::Matte);

const APPLE_M: [f32; 3] = [0.097, 0.091, 0.097];
const APPLE: ClassInfo = ClassInfo {
    name: "apple",
    label: "apple",
    original_model: Some("apple"),
    detector_index: Some(10),
    sets: &[TargetSet::Fruit, TargetSet::ShopFruit],
    size_m: APPLE_M,
    mass_kg: 0.2,
    parts: &in_meters(
        APPLE_M,
        [
            ball([0.0, 0.0, 0.0], [0.097, 0.083, 0.097], Paint([196, 36, 40], Finish::Skin)),
            cylinder([0.0, 0.078, 0.0], [0.007, 0.013, 0.007], STALK).non_colliding(),
            ball([0.014, 0.082, 0.0], [0.03, 0.005, 0.015], LEAF)
                .turned([0.0, 30.0, 15.0])
                .non_colliding(),
        ],
    ),
    palette: &[[196, 36, 40], [150, 176, 58], [214, 150, 58]],
    ..TARGET
};

const BANANA_M: [f32; 3] = [0.165, 0.035, 0.163];
const BANANA: ClassInfo = ClassInfo {
    name: "banana",
    label: "banana",
    original_model: Some("b04_banana"),
    detector_index: Some(11),
    sets: &[TargetSet::Fruit],
    size_m: BANANA_M,
    mass_kg: 0.15,
    parts: &in_meters(
        BANANA_M,
        [
            ball([-0.034, 0.0, -0.034], [0.12, 0.035, 0.036], PEEL).turned([0.0, 45.0, 0.0]),
            arc([0.0345, 0.0175, 0.0345], 0.234, 0.033, 120.0, PEEL).turned([0.0, 45.0, 0.0]),
            ball([0.0604, 0.002, -0.0621], [0.044, 0.031, 0.031], PEEL)
                .turned([0.0, -15.0, 0.0])
                .non_colliding(),
            ball([-0.0621, 0.002, 0.0602], [0.043, 0.031, 0.031], PEEL)
                .turned([0.0, -75.0, 0.0])
                .non_colliding(),
            ball([0.0735, 0.01, -0.059], [0.018, 0.015, 0.015], STALK).non_colliding(),
            ball([-0.059, 0.01, 0.072], [0.015, 0.015, 0.018], STALK).non_colliding(),
        ],
    ),
    ..TARGET
};

const ORANGE_M: [f32; 3] = [0.096, 0.096, 0.096];
const ORANGE: ClassInfo = ClassInfo {
    name: "orange",
    label: "orange",
    original_model: Some("b04_orange_00"),
    detector_index: Some(12),
    sets: &[TargetSet::Fruit, TargetSet::ShopFruit],
    size_m: ORANGE_M,
    mass_kg: 0.22,
    parts: &in_meters(
        ORANGE_M,
        [
            ball([0.0, 0.0, 0.0], [0.096, 0.095, 0.096], Paint([240, 134, 26], Finish::Skin)),
            cylinder([0.0, 0.092, 0.0], [0.016, 0.004, 0.016], LEAF).non_colliding(),
        ],
    ),
    palette: &[[240, 134, 26], [246, 152, 44], [228, 116, 22]],
    ..TARGET
};

const CROWN: Paint = Paint([138, 124, 52], Finish::Skin);

/// A banana of a bunch, along x with a small rotation away from its neighbors.
const fn finger(y: f32, z: f32, turn_deg: f32) -> Part {
    // The ring's center is 0.12 m behind the banana, so a rotation about it shifts the banana
    // sideways.
    let x = 0.12 * turn_deg.to_radians() - 0.006;
    arc([x, y, z + 0.106], 0.276, 0.036, 82.0, PEEL).turned([0.0, turn_deg, 0.0])
}

/// The dark tip of a banana.
const fn fingertip(y: f32, z: f32, turn_deg: f32) -> Part {
    let z = z + 0.017 + 0.08 * turn_deg.to_radians();
    ball([-0.085, y - 0.01, z], [0.022, 0.02, 0.02], STALK).non_colliding()
}

const SHOP_BANANA_M: [f32; 3] = [0.195, 0.119, 0.155];
const SHOP_BANANA: ClassInfo = ClassInfo {
    name: "shop_banana",
    label: "banana",
    original_model: Some("b03_banan_001"),
    detector_index: Some(29),
    sets: &[TargetSet::ShopFruit],
    size_m: SHOP_BANANA_M,
    mass_kg: 0.5,
    parts: &in_meters(
        SHOP_BANANA_M,
        [
            ball([0.0, 0.0, -0.006], [0.14, 0.06, 0.06], PEEL),
            taper(0.4, [0.08, 0.0, 0.012], [0.034, 0.119, 0.1], CROWN),
            finger(0.02, -0.036, -5.0),
            finger(0.018, 0.0, 1.5),
            finger(0.02, 0.036, 5.0),
            finger(0.051, -0.02, -3.0),
            finger(0.051, 0.02, 3.0),
            finger(0.083, 0.0, -1.5),
            fingertip(0.02, -0.036, -5.0),
            fingertip(0.018, 0.0, 1.5),
            fingertip(0.02, 0.036, 5.0),
            fingertip(0.051, -0.02, -3.0),
            fingertip(0.051, 0.02, 3.0),
            fingertip(0.083, 0.0, -1.5),
        ],
    ),
    ..TARGET
};

const RED_GRAPE: Paint = Paint([112, 34, 70], Finish::Glossy);
const DARK_GRAPE: Paint = Paint([86, 26, 60], Finish::Glossy);

const fn berry(x: f32, y: f32, z: f32, paint: Paint) -> Part {
    ball([x, y, z], [0.062, 0.062, 0.062], paint).non_colliding()
}

const GRAPE_M: [f32; 3] = [0.164, 0.234, 0.183];
const GRAPE: ClassInfo = ClassInfo {
    name: "grape",
    label: "grape",
    original_model: Some("b04_red_grapes"),
    detector_index: Some(30),
    sets: &[TargetSet::ShopFruit],
    size_m: GRAPE_M,
    mass_kg: 0.5,
    parts: &in_meters(
        GRAPE_M,
        [
            ball([0.0, 0.0, 0.0], [0.11, 0.2, 0.12], DARK_GRAPE),
            berry(0.051, 0.14, 0.0, RED_GRAPE),
            berry(0.016, 0.14, -0.058, DARK_GRAPE),
            berry(-0.043, 0.145, -0.036, RED_GRAPE),
            berry(-0.043, 0.14, 0.036, DARK_GRAPE),
            berry(0.016, 0.145, 0.058, RED_GRAPE),
            berry(0.04, 0.085, -0.036, RED_GRAPE),
            berry(0.04, 0.085, 0.036, DARK_GRAPE),
            berry(-0.035, 0.085, 0.04, RED_GRAPE),
            berry(-0.035, 0.085, -0.04, DARK_GRAPE),
            berry(0.01, 0.038, -0.036, RED_GRAPE),
            berry(-0.03, 0.034, 0.01, RED_GRAPE),
            berry(0.024, 0.034, 0.02, DARK_GRAPE),
            taper(0.7, [0.0, 0.19, 0.0], [0.014, 0.044, 0.014], LEAF).non_colliding(),
        ],
    ),
    ..TARGET
};

// Bread and cakes.

const CRUST: Paint = Paint([190, 132, 70], Finish::Crust);
const DARK_CRUST: Paint = Paint([158, 98, 46], Finish::Crust);
const CRUMB: Paint = Paint([232, 204, 152], Finish::Crust);

const BREAD_M: [f32; 3] = [0.13, 0.072, 0.136];
const BREAD: ClassInfo = ClassInfo {
    name: "bread",
    label: "bread",
    original_model: Some("bread"),
    detector_index: Some(7),
    sets: &[TargetSet::Bread],
    size_m: BREAD_M,
    mass_kg: 0.3,
    parts: &in_meters(
        BREAD_M,
        [
            ball([0.0, 0.0, 0.0], [0.13, 0.07, 0.136], CRUST),
            cylinder([0.0, 0.0, 0.0], [0.086, 0.02, 0.09], CRUST).non_colliding(),
            ball([0.0, 0.06, 0.0], [0.013, 0.012, 0.086], CRUMB).non_colliding(),
            ball([0.032, 0.055, 0.0], [0.013, 0.012, 0.072], CRUMB).non_colliding(),
            ball([-0.032, 0.055, 0.0], [0.013, 0.012, 0.072], CRUMB).non_colliding(),
        ],
    ),
    palette: &[[190, 132, 70], [168, 108, 54], [206, 156, 92]],
    ..TARGET
};

const fn sesame(x: f32, y: f32, z: f32) -> Part {
    ball([x, y, z], [0.009, 0.004, 0.006], CRUMB).non_colliding()
}

const BURGER_M: [f32; 3] = [0.107, 0.078, 0.111];
const BURGER: ClassInfo = ClassInfo {
    name: "burger",
    label: "burger",
    original_model: Some("b03_burger"),
    detector_index: Some(8),
    sets: &[TargetSet::Bread, TargetSet::ShopBakery],
    size_m: BURGER_M,
    mass_kg: 0.25,
    parts: &in_meters(
        BURGER_M,
        [
            ball([0.0, 0.022, 0.0], [0.1, 0.055, 0.104], Paint([202, 128, 56], Finish::Crust)),
            cylinder([0.0, 0.0, 0.0], [0.098, 0.02, 0.102], CRUST),
            cylinder([0.0, 0.018, 0.0], [0.103, 0.018, 0.107], Paint([84, 48, 30], Finish::Crust)),
            cuboid([0.0, 0.035, 0.0], [0.075, 0.004, 0.075], PEEL)
                .turned([0.0, 40.0, 0.0])
                .non_colliding(),
            cylinder(
                [0.0, 0.039, 0.0],
                [0.104, 0.005, 0.108],
                Paint([190, 50, 38], Finish::Glossy),
            )
            .non_colliding(),
            ball([0.0, 0.041, 0.0], [0.107, 0.012, 0.111], Paint([112, 172, 60], Finish::Matte))
                .non_colliding(),
            sesame(0.0, 0.074, -0.004),
            sesame(0.022, 0.071, 0.014),
            sesame(-0.024, 0.071, 0.01),
            sesame(-0.013, 0.0705, -0.026),
            sesame(0.02, 0.0705, -0.022),
        ],
    ),
    ..TARGET
};

const LOAF_BREAD_M: [f32; 3] = [0.085, 0.053, 0.194];
const LOAF_BREAD: ClassInfo = ClassInfo {
    name: "loaf_bread",
    label: "loaf bread",
    original_model: Some("b03_loafbread"),
    detector_index: Some(9),
    sets: &[TargetSet::Bread, TargetSet::ShopBakery],
    size_m: LOAF_BREAD_M,
    mass_kg: 0.4,
    parts: &in_meters(
        LOAF_BREAD_M,
        [
            ball([0.0, 0.0, 0.0], [0.085, 0.051, 0.194], CRUST),
            cylinder([0.0, 0.0, 0.0], [0.064, 0.018, 0.15], CRUST).non_colliding(),
            ball([0.0, 0.042, -0.056], [0.046, 0.009, 0.012], CRUMB)
                .turned([0.0, 30.0, 0.0])
                .non_colliding(),
            ball([0.0, 0.044, -0.019], [0.052, 0.009, 0.012], CRUMB)
                .turned([0.0, 30.0, 0.0])
                .non_colliding(),
            ball([0.0, 0.044, 0.019], [0.052, 0.009, 0.012], CRUMB)
                .turned([0.0, 30.0, 0.0])
                .non_colliding(),
            ball([0.0, 0.042, 0.056], [0.046, 0.009, 0.012], CRUMB)
                .turned([0.0, 30.0, 0.0])
                .non_colliding(),
        ],
    ),
    palette: &[[190, 132, 70], [162, 100, 50], [208, 160, 96]],
    ..TARGET
};

const CROISSANT_M: [f32; 3] = [0.141, 0.058, 0.146];
const CROISSANT: ClassInfo = ClassInfo {
    name: "croissant",
    label: "croissant",
    original_model: Some("b01_croissant"),
    detector_index: Some(27),
    sets: &[TargetSet::ShopBakery],
    size_m: CROISSANT_M,
    mass_kg: 0.08,
    parts: &in_meters(
        CROISSANT_M,
        [
            ball([0.0, 0.0, -0.044], [0.06, 0.058, 0.056], CRUST),
            arc([0.0, 0.02, -0.002], 0.139, 0.04, 230.0, DARK_CRUST),
            ball([0.035, 0.0, -0.032], [0.05, 0.052, 0.054], CRUST).turned([0.0, -45.0, 0.0]),
            ball([-0.035, 0.0, -0.032], [0.05, 0.052, 0.054], CRUST).turned([0.0, 45.0, 0.0]),
            ball([0.049, 0.0, -0.002], [0.042, 0.044, 0.046], CRUST).non_colliding(),
            ball([-0.049, 0.0, -0.002], [0.042, 0.044, 0.046], CRUST).non_colliding(),
            ball([0.044, 0.004, 0.024], [0.03, 0.032, 0.036], DARK_CRUST).non_colliding(),
            ball([-0.044, 0.004, 0.024], [0.03, 0.032, 0.036], DARK_CRUST).non_colliding(),
        ],
    ),
    ..TARGET
};

const fn sprinkle(x: f32, z: f32, turn_deg: f32, color: [u8; 3]) -> Part {
    cuboid([x, 0.043, z], [0.012, 0.004, 0.004], Paint(color, Finish::Glossy))
        .turned([0.0, turn_deg, 0.0])
        .non_colliding()
}

const PINK_DONUT_M: [f32; 3] = [0.134, 0.047, 0.131];
const PINK_DONUT: ClassInfo = ClassInfo {
    name: "pink_donut",
    label: "pink donut",
    original_model: Some("b03_pink_donuts_mesh"),
    detector_index: Some(28),
    sets: &[TargetSet::ShopBakery],
    size_m: PINK_DONUT_M,
    mass_kg: 0.06,
    parts: &in_meters(
        PINK_DONUT_M,
        [
            ring([0.0, 0.026, 0.0], 0.126, 0.04, Paint([238, 132, 174], Finish::Glossy))
                .non_colliding(),
            ring([0.0, 0.021, 0.0], 0.131, 0.042, CRUST),
            sprinkle(0.044, 0.0, 20.0, [250, 250, 246]),
            sprinkle(0.03, 0.032, 100.0, [90, 170, 226]),
            sprinkle(-0.006, 0.042, 60.0, [248, 212, 70]),
            sprinkle(-0.038, 0.02, 140.0, [250, 250, 246]),
            sprinkle(-0.036, -0.024, 10.0, [110, 190, 96]),
            sprinkle(-0.004, -0.043, 80.0, [90, 170, 226]),
            sprinkle(0.032, -0.03, 40.0, [248, 212, 70]),
        ],
    ),
    ..TARGET
};

// Cans.

const CAN_BLUE: Paint = Paint([26, 66, 166], Finish::Glossy);
const CAN_RED: Paint = Paint([204, 26, 34], Finish::Glossy);
const CAN_WHITE: Paint = Paint([240, 240, 240], Finish::Glossy);
const CAN_GREEN: Paint = Paint([28, 142, 66], Finish::Glossy);
const CAN_YELLOW: Paint = Paint([244, 222, 60], Finish::Glossy);
const CAN_ORANGE: Paint = Paint([240, 124, 22], Finish::Glossy);

/// A can painted `main`, with a band around it and a round mark on its front.
const fn can(size_m: [f32; 3], main: Paint, band: Paint, mark: Paint) -> [Part; 7] {
    let [w, h, _] = size_m;
    in_meters(
        size_m,
        [
            cylinder([0.0, 0.06 * h, 0.0], [0.95 * w, 0.86 * h, 0.95 * w], main),
            cylinder([0.0, 0.0, 0.0], [0.86 * w, 0.06 * h, 0.86 * w], STEEL).non_colliding(),
            taper(0.84, [0.0, 0.92 * h, 0.0], [0.94 * w, 0.06 * h, 0.94 * w], STEEL)
                .non_colliding(),
            ring([0.0, 0.975 * h, 0.0], 0.82 * w, 0.045 * w, STEEL).non_colliding(),
            cuboid([0.0, 0.98 * h, -0.12 * w], [0.18 * w, 0.015 * h, 0.34 * w], DARK_STEEL)
                .non_colliding(),
            cylinder([0.0, 0.22 * h, 0.0], [0.965 * w, 0.14 * h, 0.965 * w], band).non_colliding(),
            ball([0.0, 0.4 * h, -0.34 * w], [0.56 * w, 0.44 * h, 0.32 * w], mark).non_colliding(),
        ],
    )
}

const PEPSI_CAN_M: [f32; 3] = [0.106, 0.202, 0.106];
const PEPSI_CAN: ClassInfo = ClassInfo {
    name: "pepsi_can",
    label: "pepsi can",
    original_model: Some("102_pepsi_can_12_fl_oz_vray"),
    detector_index: Some(23),
    sets: &[TargetSet::ShopDrinks],
    size_m: PEPSI_CAN_M,
    mass_kg: 0.37,
    parts: &can(PEPSI_CAN_M, CAN_BLUE, CAN_RED, CAN_WHITE),
    ..TARGET
};

const COCACOLA_CAN_M: [f32; 3] = [0.097, 0.183, 0.097];
const COCACOLA_CAN: ClassInfo = ClassInfo {
    name: "cocacola_can",
    label: "cocacola can",
    original_model: Some("b03_cocacola_can_cage"),
    detector_index: Some(24),
    sets: &[TargetSet::ShopDrinks],
    size_m: COCACOLA_CAN_M,
    mass_kg: 0.37,
    parts: &can(COCACOLA_CAN_M, CAN_RED, CAN_WHITE, CAN_WHITE),
    ..TARGET
};

const SPRITE_CAN_M: [f32; 3] = [0.106, 0.202, 0.106];
const SPRITE_CAN: ClassInfo = ClassInfo {
    name: "sprite_can",
    label: "sprite can",
    original_model: Some("104_sprite_can_12_fl_oz_vray"),
    detector_index: Some(25),
    sets: &[TargetSet::ShopDrinks],
    size_m: SPRITE_CAN_M,
    mass_kg: 0.37,
    parts: &can(SPRITE_CAN_M, CAN_GREEN, CAN_BLUE, CAN_YELLOW),
    ..TARGET
};

const FANTA_CAN_M: [f32; 3] = [0.106, 0.202, 0.106];
const FANTA_CAN: ClassInfo = ClassInfo {
    name: "fanta_can",
    label: "fanta can",
    original_model: Some("fanta_orange_can_12_fl_oz_vray"),
    detector_index: Some(26),
    sets: &[TargetSet::ShopDrinks],
    size_m: FANTA_CAN_M,
    mass_kg: 0.37,
    parts: &can(FANTA_CAN_M, CAN_ORANGE, CAN_GREEN, CAN_BLUE),
    ..TARGET
};
