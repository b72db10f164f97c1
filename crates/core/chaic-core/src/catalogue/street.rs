//! Objects in a street: the truck and the hydrant as goal places, the bicycle, the tents of the
//! market, and decoration.

use super::shape::{
    BLACK, BRASS, FURNISHING, GLASS, Paint, ROLLING, STEEL, WHITE, ball, cuboid, cylinder,
    in_meters, ring, rod, rod_x, rod_z, taper, tub,
};
use super::{ClassInfo, Finish, Part, Role};

pub(super) const CLASSES: &[ClassInfo] =
    &[TRUCK, FIRE_HYDRANT, BIKE, TENT, HOUSE_FRONT, TREE, STREET_LAMP, BENCH, MAILBOX, FENCE];

const TIRE: Paint = Paint([34, 34, 36], Finish::Matte);
const LAMP_WHITE: Paint = Paint([255, 250, 222], Finish::Glossy);
const LAMP_RED: Paint = Paint([206, 40, 36], Finish::Glossy);
const IRON: Paint = Paint([52, 56, 58], Finish::Metal);
const BED_STEEL: Paint = Paint([112, 118, 124], Finish::Metal);

/// A wheel of the truck, without collision: the chassis between the wheels collides.
const fn truck_wheel(x: f32, z: f32) -> Part {
    rod_x([x, 0.42, z], 0.3, 0.84, TIRE).non_colliding()
}

/// The cap over the nuts of a wheel, on the outside of the truck.
const fn hub_cap(x: f32, z: f32) -> Part {
    rod_x([x, 0.42, z], 0.02, 0.4, STEEL).non_colliding()
}

// The bed is open at the back; its floor supports the moved furniture.
const TRUCK_M: [f32; 3] = [2.1, 2.2, 6.0];
const TRUCK: ClassInfo = ClassInfo {
    name: "truck",
    label: "truck",
    original_model: Some("b06_dump"),
    detector_index: Some(42),
    size_m: TRUCK_M,
    mass_kg: 3500.0,
    parts: &in_meters(
        TRUCK_M,
        [
            cuboid([0.0, 0.4, -2.22], [2.0, 1.8, 1.46], Paint([240, 190, 48], Finish::Glossy)),
            cuboid([0.0, 0.8, 0.8], [2.1, 0.15, 4.4], BED_STEEL).surface(),
            cuboid([-1.02, 0.95, 0.8], [0.06, 0.3, 4.4], Paint([240, 190, 48], Finish::Glossy)),
            cuboid([1.02, 0.95, 0.8], [0.06, 0.3, 4.4], Paint([240, 190, 48], Finish::Glossy)),
            cuboid([0.0, 0.95, -1.37], [2.1, 0.7, 0.06], BED_STEEL),
            cuboid([0.0, 0.35, 0.0], [1.3, 0.45, 5.8], IRON),
            cuboid([0.0, 1.3, -2.94], [1.76, 0.68, 0.05], GLASS).non_colliding(),
            cuboid([0.0, 1.34, -2.3], [2.03, 0.6, 0.8], GLASS).non_colliding(),
            cuboid([0.0, 0.8, -2.95], [1.2, 0.34, 0.05], BLACK).non_colliding(),
            cuboid([0.0, 0.38, -2.94], [2.06, 0.22, 0.12], IRON).non_colliding(),
            cuboid([-0.8, 0.82, -2.95], [0.28, 0.22, 0.06], LAMP_WHITE).non_colliding(),
            cuboid([0.8, 0.82, -2.95], [0.28, 0.22, 0.06], LAMP_WHITE).non_colliding(),
            truck_wheel(-0.85, -2.1),
            truck_wheel(0.85, -2.1),
            truck_wheel(-0.85, 1.6),
            truck_wheel(0.85, 1.6),
            hub_cap(-1.01, -2.1),
            hub_cap(1.01, -2.1),
            hub_cap(-1.01, 1.6),
            hub_cap(1.01, 1.6),
            cuboid([-0.85, 0.62, 2.95], [0.26, 0.14, 0.06], LAMP_RED).non_colliding(),
            cuboid([0.85, 0.62, 2.95], [0.26, 0.14, 0.06], LAMP_RED).non_colliding(),
        ],
    ),
    ..FURNISHING
};

const HYDRANT_RED: Paint = Paint([202, 40, 34], Finish::Glossy);
const HYDRANT_CAP: Paint = Paint([226, 196, 74], Finish::Metal);

const FIRE_HYDRANT_M: [f32; 3] = [0.4, 0.75, 0.4];
const FIRE_HYDRANT: ClassInfo = ClassInfo {
    name: "fire_hydrant",
    label: "fire hydrant",
    original_model: Some("b03_fire_hydrant"),
    detector_index: Some(43),
    size_m: FIRE_HYDRANT_M,
    mass_kg: 120.0,
    parts: &in_meters(
        FIRE_HYDRANT_M,
        [
            cylinder([0.0, 0.05, 0.0], [0.22, 0.5, 0.22], HYDRANT_RED),
            cylinder([0.0, 0.0, 0.0], [0.34, 0.06, 0.34], HYDRANT_RED),
            taper(0.68, [0.0, 0.55, 0.0], [0.27, 0.16, 0.27], HYDRANT_RED),
            cylinder([0.0, 0.7, 0.0], [0.2, 0.05, 0.2], HYDRANT_CAP).surface(),
            cylinder([0.0, 0.53, 0.0], [0.3, 0.035, 0.3], HYDRANT_RED).non_colliding(),
            rod_x([0.0, 0.42, 0.0], 0.34, 0.11, HYDRANT_RED).non_colliding(),
            rod_x([-0.18, 0.42, 0.0], 0.04, 0.135, HYDRANT_CAP).non_colliding(),
            rod_x([0.18, 0.42, 0.0], 0.04, 0.135, HYDRANT_CAP).non_colliding(),
            rod_z([0.0, 0.36, -0.09], 0.17, 0.14, HYDRANT_RED).non_colliding(),
            rod_z([0.0, 0.36, -0.18], 0.04, 0.17, HYDRANT_CAP).non_colliding(),
        ],
    ),
    ..FURNISHING
};

const FRAME: Paint = Paint([58, 148, 150], Finish::Glossy);
const BIKE_BASKET: Paint = Paint([186, 140, 86], Finish::Wicker);
const SADDLE: Paint = Paint([112, 70, 44], Finish::Fabric);

/// A tube of the bicycle's frame, leaning in the plane of the wheels.
const fn tube(y: f32, z: f32, length_m: f32, lean_deg: f32) -> Part {
    rod([0.0, y, z], length_m, 0.034, [lean_deg, 0.0, 0.0], FRAME).non_colliding()
}

/// Two opposite spokes of the wheel at `z`.
const fn spoke(z: f32, lean_deg: f32) -> Part {
    rod([0.0, 0.34, z], 0.64, 0.008, [lean_deg, 0.0, 0.0], STEEL).non_colliding()
}

const BIKE_M: [f32; 3] = [0.6, 1.05, 1.75];
const BIKE: ClassInfo = ClassInfo {
    name: "bike",
    label: "bike",
    original_model: Some("huffy_nel_lusso_womens_cruiser_bike_2011vray"),
    detector_index: Some(44),
    role: Role::Vehicle,
    size_m: BIKE_M,
    mass_kg: 16.0,
    parts: &in_meters(
        BIKE_M,
        [
            // Down tube, seat tube, top tube, stays, fork.
            rod([0.0, 0.52, -0.17], 0.666, 0.04, [131.3, 0.0, 0.0], FRAME),
            tube(0.57, 0.165, 0.566, 17.5),
            tube(0.63, -0.135, 0.611, 111.1),
            tube(0.32, 0.307, 0.457, -95.0),
            tube(0.5, 0.363, 0.471, -47.2),
            tube(0.635, -0.448, 0.615, 16.5),
            ring([0.0, 0.34, -0.535], 0.68, 0.05, TIRE).turned(ROLLING),
            ring([0.0, 0.34, 0.535], 0.68, 0.05, TIRE).turned(ROLLING),
            spoke(-0.535, 0.0),
            spoke(-0.535, 60.0),
            spoke(-0.535, 120.0),
            spoke(0.535, 0.0),
            spoke(0.535, 60.0),
            spoke(0.535, 120.0),
            rod([0.0, 0.975, -0.345], 0.12, 0.03, [18.4, 0.0, 0.0], STEEL).non_colliding(),
            rod_x([0.0, 1.02, -0.33], 0.6, 0.026, STEEL).non_colliding(),
            rod_x([-0.24, 1.02, -0.33], 0.12, 0.04, SADDLE).non_colliding(),
            rod_x([0.24, 1.02, -0.33], 0.12, 0.04, SADDLE).non_colliding(),
            ball([0.0, 0.84, 0.27], [0.19, 0.08, 0.28], SADDLE),
            tub([0.0, 0.72, -0.62], [0.4, 0.25, 0.3], 0.014, 0.84, BIKE_BASKET),
            rod_x([0.0, 0.3, 0.08], 0.03, 0.18, STEEL).non_colliding(),
            cuboid([0.09, 0.19, 0.04], [0.1, 0.025, 0.07], BLACK).non_colliding(),
            cuboid([-0.09, 0.39, 0.12], [0.1, 0.025, 0.07], BLACK).non_colliding(),
        ],
    ),
    ..FURNISHING
};

const CANVAS_RED: Paint = Paint([200, 54, 48], Finish::Fabric);
const CANVAS_WHITE: Paint = Paint([240, 236, 224], Finish::Fabric);

/// The pole of a tent.
const fn tent_pole(x: f32, z: f32) -> Part {
    cylinder([x, 0.0, z], [0.05, 2.05, 0.05], STEEL)
}

/// A strip of canvas on the front (z < 0) or back slope of the tent's roof.
const fn canvas(x: f32, z: f32, width_m: f32, thickness_m: f32, paint: Paint) -> Part {
    let lean_deg = if z < 0.0 { 68.7 } else { -68.7 };
    cuboid([x, 1.68, z], [width_m, 1.01, thickness_m], paint)
        .turned([lean_deg, 0.0, 0.0])
        .non_colliding()
}

const TENT_M: [f32; 3] = [2.4, 2.4, 1.9];
const TENT: ClassInfo = ClassInfo {
    name: "tent",
    label: "tent",
    original_model: Some("b01_tent"),
    detector_index: Some(45),
    size_m: TENT_M,
    mass_kg: 40.0,
    parts: &in_meters(
        TENT_M,
        [
            canvas(0.0, -0.475, 2.4, 0.02, CANVAS_RED),
            canvas(0.0, 0.475, 2.4, 0.02, CANVAS_RED),
            canvas(-0.6, -0.475, 0.4, 0.03, CANVAS_WHITE),
            canvas(0.0, -0.475, 0.4, 0.03, CANVAS_WHITE),
            canvas(0.6, -0.475, 0.4, 0.03, CANVAS_WHITE),
            canvas(-0.6, 0.475, 0.4, 0.03, CANVAS_WHITE),
            canvas(0.0, 0.475, 0.4, 0.03, CANVAS_WHITE),
            canvas(0.6, 0.475, 0.4, 0.03, CANVAS_WHITE),
            cuboid([0.0, 1.84, -0.935], [2.4, 0.17, 0.02], CANVAS_WHITE).non_colliding(),
            cuboid([0.0, 1.84, 0.935], [2.4, 0.17, 0.02], CANVAS_WHITE).non_colliding(),
            tent_pole(-1.15, -0.9),
            tent_pole(1.15, -0.9),
            tent_pole(-1.15, 0.9),
            tent_pole(1.15, 0.9),
        ],
    ),
    ..FURNISHING
};

const TRIM: Paint = Paint([240, 238, 230], Finish::Matte);
const ROOF: Paint = Paint([126, 62, 50], Finish::Matte);
const CHIMNEY: Paint = Paint([168, 104, 84], Finish::Matte);
const STONE: Paint = Paint([142, 138, 132], Finish::Matte);
const DOOR: Paint = Paint([60, 92, 82], Finish::Wood);

/// The frame of a window, with its sill at 1.1 m.
const fn window_frame(x: f32) -> Part {
    cuboid([x, 1.1, -0.19], [1.3, 1.5, 0.1], TRIM).non_colliding()
}

/// One of the two panes in a frame.
const fn pane(x: f32) -> Part {
    cuboid([x, 1.2, -0.2], [0.52, 1.3, 0.12], GLASS).non_colliding()
}

const HOUSE_FRONT_M: [f32; 3] = [8.0, 5.0, 1.0];
const HOUSE_FRONT: ClassInfo = ClassInfo {
    name: "house_front",
    label: "house",
    size_m: HOUSE_FRONT_M,
    mass_kg: 20_000.0,
    parts: &in_meters(
        HOUSE_FRONT_M,
        [
            cuboid([0.0, 0.0, 0.17], [7.6, 3.5, 0.66], Paint([224, 208, 172], Finish::Matte)),
            cuboid([0.0, 3.29, 0.0], [8.0, 1.76, 0.11], ROOF)
                .turned([30.7, 0.0, 0.0])
                .non_colliding(),
            cuboid([0.0, 3.3, -0.47], [8.0, 0.12, 0.06], TRIM).non_colliding(),
            cuboid([2.6, 3.6, 0.2], [0.7, 1.4, 0.5], CHIMNEY).non_colliding(),
            cuboid([0.0, 0.0, -0.17], [7.62, 0.4, 0.06], STONE).non_colliding(),
            cuboid([0.0, 0.0, -0.33], [1.6, 0.16, 0.34], STONE),
            cuboid([0.0, 0.16, -0.19], [1.24, 2.3, 0.1], TRIM).non_colliding(),
            cuboid([0.0, 0.16, -0.2], [1.0, 2.18, 0.12], DOOR).non_colliding(),
            ball([-0.38, 1.15, -0.28], [0.09, 0.09, 0.09], BRASS).non_colliding(),
            window_frame(-2.4),
            pane(-2.69),
            pane(-2.11),
            window_frame(2.4),
            pane(2.11),
            pane(2.69),
        ],
    ),
    palette: &[[224, 208, 172], [186, 200, 206], [206, 160, 140], [196, 206, 178]],
    ..FURNISHING
};

const BARK: Paint = Paint([104, 78, 54], Finish::Wood);
const FOLIAGE: Paint = Paint([72, 126, 56], Finish::Crust);
const LIGHT_FOLIAGE: Paint = Paint([92, 146, 66], Finish::Crust);

const TREE_M: [f32; 3] = [2.6, 4.6, 2.6];
const TREE: ClassInfo = ClassInfo {
    name: "tree",
    label: "tree",
    size_m: TREE_M,
    mass_kg: 600.0,
    parts: &in_meters(
        TREE_M,
        [
            ball([0.0, 1.7, 0.0], [2.2, 2.2, 2.2], FOLIAGE).non_colliding(),
            taper(0.6, [0.0, 0.0, 0.0], [0.34, 2.2, 0.34], BARK),
            ball([0.5, 1.6, 0.3], [1.5, 1.4, 1.5], LIGHT_FOLIAGE).non_colliding(),
            ball([-0.55, 1.8, -0.25], [1.5, 1.5, 1.5], LIGHT_FOLIAGE).non_colliding(),
            ball([0.1, 2.9, -0.1], [1.6, 1.7, 1.6], LIGHT_FOLIAGE).non_colliding(),
            ball([-0.1, 1.9, 0.6], [1.4, 1.4, 1.3], FOLIAGE).non_colliding(),
            ball([0.2, 1.9, -0.6], [1.4, 1.4, 1.3], FOLIAGE).non_colliding(),
        ],
    ),
    palette: &[[72, 126, 56], [92, 120, 44], [58, 112, 70]],
    ..FURNISHING
};

const STREET_LAMP_M: [f32; 3] = [0.36, 4.6, 1.5];
const STREET_LAMP: ClassInfo = ClassInfo {
    name: "street_lamp",
    label: "street lamp",
    size_m: STREET_LAMP_M,
    mass_kg: 90.0,
    parts: &in_meters(
        STREET_LAMP_M,
        [
            taper(0.6, [0.0, 0.0, 0.57], [0.16, 4.5, 0.16], IRON),
            taper(0.6, [0.0, 0.0, 0.57], [0.36, 0.5, 0.36], IRON),
            rod_z([0.0, 4.5, 0.1], 1.0, 0.07, IRON).non_colliding(),
            ball([0.0, 4.42, -0.44], [0.3, 0.18, 0.62], IRON).non_colliding(),
            ball([0.0, 4.38, -0.44], [0.24, 0.16, 0.52], LAMP_WHITE).non_colliding(),
        ],
    ),
    ..FURNISHING
};

const PLANK: Paint = Paint([158, 108, 64], Finish::Wood);

const BENCH_M: [f32; 3] = [1.6, 0.85, 0.62];
const BENCH: ClassInfo = ClassInfo {
    name: "bench",
    label: "bench",
    size_m: BENCH_M,
    mass_kg: 45.0,
    parts: &in_meters(
        BENCH_M,
        [
            cuboid([0.0, 0.42, -0.06], [1.6, 0.04, 0.46], PLANK).surface(),
            cuboid([0.0, 0.53, 0.255], [1.6, 0.12, 0.035], PLANK),
            cuboid([0.0, 0.71, 0.285], [1.6, 0.12, 0.035], PLANK),
            cuboid([-0.66, 0.0, 0.0], [0.06, 0.42, 0.5], IRON),
            cuboid([0.66, 0.0, 0.0], [0.06, 0.42, 0.5], IRON),
            cuboid([-0.66, 0.42, 0.258], [0.05, 0.42, 0.04], IRON)
                .turned([8.0, 0.0, 0.0])
                .non_colliding(),
            cuboid([0.66, 0.42, 0.258], [0.05, 0.42, 0.04], IRON)
                .turned([8.0, 0.0, 0.0])
                .non_colliding(),
            cuboid([0.0, 0.461, -0.135], [1.6, 0.001, 0.012], IRON).non_colliding(),
            cuboid([0.0, 0.461, 0.015], [1.6, 0.001, 0.012], IRON).non_colliding(),
            cuboid([-0.74, 0.6, -0.03], [0.05, 0.04, 0.46], IRON).non_colliding(),
            cuboid([0.74, 0.6, -0.03], [0.05, 0.04, 0.46], IRON).non_colliding(),
            cuboid([-0.74, 0.42, -0.24], [0.05, 0.19, 0.04], IRON).non_colliding(),
            cuboid([0.74, 0.42, -0.24], [0.05, 0.19, 0.04], IRON).non_colliding(),
        ],
    ),
    ..FURNISHING
};

const POST_BLUE: Paint = Paint([36, 74, 146], Finish::Glossy);

const MAILBOX_M: [f32; 3] = [0.52, 1.2, 0.5];
const MAILBOX: ClassInfo = ClassInfo {
    name: "mailbox",
    label: "mailbox",
    size_m: MAILBOX_M,
    mass_kg: 55.0,
    parts: &in_meters(
        MAILBOX_M,
        [
            cuboid([0.0, 0.16, 0.0], [0.5, 0.8, 0.48], POST_BLUE),
            rod_x([0.0, 0.96, 0.0], 0.5, 0.48, POST_BLUE),
            cuboid([-0.2, 0.0, 0.0], [0.06, 0.16, 0.44], IRON),
            cuboid([0.2, 0.0, 0.0], [0.06, 0.16, 0.44], IRON),
            cuboid([0.0, 0.93, -0.225], [0.36, 0.05, 0.04], BLACK).non_colliding(),
            cuboid([0.0, 0.985, -0.22], [0.38, 0.02, 0.06], STEEL).non_colliding(),
            cuboid([0.0, 0.55, -0.235], [0.3, 0.22, 0.02], WHITE).non_colliding(),
            cuboid([0.0, 0.64, -0.237], [0.3, 0.04, 0.02], LAMP_RED).non_colliding(),
        ],
    ),
    ..FURNISHING
};

const PICKET: Paint = Paint([240, 240, 234], Finish::Wood);

/// A pointed board of the fence.
const fn picket(x: f32) -> Part {
    cuboid([x, 0.06, -0.025], [0.1, 0.9, 0.025], PICKET).non_colliding()
}

const FENCE_M: [f32; 3] = [2.0, 1.0, 0.1];
const FENCE: ClassInfo = ClassInfo {
    name: "fence",
    label: "fence",
    size_m: FENCE_M,
    mass_kg: 25.0,
    parts: &in_meters(
        FENCE_M,
        [
            cuboid([0.0, 0.24, 0.005], [2.0, 0.09, 0.035], PICKET),
            cuboid([0.0, 0.68, 0.005], [2.0, 0.09, 0.035], PICKET),
            cuboid([-0.96, 0.0, 0.01], [0.08, 1.0, 0.08], PICKET),
            cuboid([0.96, 0.0, 0.01], [0.08, 1.0, 0.08], PICKET),
            picket(-0.8),
            picket(-0.6),
            picket(-0.4),
            picket(-0.2),
            picket(0.0),
            picket(0.2),
            picket(0.4),
            picket(0.6),
            picket(0.8),
        ],
    ),
    ..FURNISHING
};
