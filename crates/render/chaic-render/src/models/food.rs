//! Models of fruit, bread, cakes and cans.

use chaic_core::catalogue::Finish;

use super::Model;
use super::colors::{DARK_STEEL, LEAF, STALK, STEEL};
use crate::mesh_builder::{MeshBuilder, Paint, Point3, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "apple" => apple,
        "banana" => banana,
        "orange" => orange,
        "shop_banana" => bananas,
        "grape" => grape,
        "bread" => bread,
        "burger" => burger,
        "loaf_bread" => loaf,
        "croissant" => croissant,
        "pink_donut" => donut,
        "pepsi_can" => pepsi,
        "cocacola_can" => cola,
        "sprite_can" => sprite,
        "fanta_can" => fanta,
        _ => return None,
    })
}

fn apple(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    // Wider or taller by style.
    let w = s.pick(1, &[1.0, 0.97, 0.94, 0.98]);
    let outline = [
        [0.006, 0.008],
        [0.018, 0.001],
        [0.030, 0.004],
        [0.041, 0.022],
        [0.0485, 0.046],
        [0.0475, 0.062],
        [0.040, 0.077],
        [0.026, 0.083],
        [0.012, 0.079],
        [0.0, 0.071],
    ]
    .map(|[r, y]| [w * r, y]);
    s.lathe([0.0; 3], &outline);
    s.set_paint(STALK);
    s.curve(&[
        ([0.0, 0.069, 0.0], 0.0022),
        ([0.002, 0.08, 0.0], 0.0018),
        ([0.006, 0.0905, 0.001], 0.0026),
    ]);
    if s.pick(2, &[true, false, true, true]) {
        s.set_paint(LEAF);
        s.leaf([0.003, 0.081, 0.0], [0.032, 0.088, 0.010], 0.017, 0.002);
    }
}

const PEEL: Paint = paint([236, 200, 60], Finish::Skin);
const PEEL_GREEN: Paint = paint([190, 180, 66], Finish::Skin);
const PEEL_END: Paint = paint([86, 70, 40], Finish::Skin);

/// Adds a banana along an arc of `radius` around (x, y, z), between two angles in degrees (0 is -x,
/// 90 is -z), raised by `lift` in its middle.
fn one_banana(
    s: &mut MeshBuilder,
    center: Point3,
    radius: f32,
    angles: [f32; 2],
    thickness: f32,
    lift: f32,
) {
    use chaic_core::geom::math::{cos, sin};
    let at = |t: f32| {
        let a = (angles[0] + (angles[1] - angles[0]) * t).to_radians();
        let rise = lift * 4.0 * t * (1.0 - t);
        [center[0] - radius * cos(a), center[1] + rise, center[2] - radius * sin(a)]
    };
    let body = [
        (0.0, 0.16),
        (0.04, 0.26),
        (0.13, 0.62),
        (0.28, 0.95),
        (0.5, 1.0),
        (0.72, 0.93),
        (0.88, 0.6),
        (0.96, 0.34),
    ]
    .map(|(t, r)| (at(t), r * 0.5 * thickness));
    let peel = s.pick(1, &[PEEL, PEEL, PEEL_GREEN, paint([226, 184, 50], Finish::Skin)]);
    s.set_paint(peel);
    s.curve(&body);
    s.set_paint(PEEL_END);
    s.sweep(&[(at(0.955), 0.16 * thickness), (at(1.0), 0.11 * thickness)]);
    s.sweep(&[(at(0.0), 0.09 * thickness), (at(0.012), 0.1 * thickness)]);
}

fn banana(s: &mut MeshBuilder) {
    // The ends are at the +x and the +z side of the box, the back is at the corner between them.
    one_banana(s, [0.0345, 0.0175, 0.0345], 0.1, [-23.0, 113.0], 0.0345, 0.0);
}

fn bananas(s: &mut MeshBuilder) {
    s.set_paint(paint([138, 124, 52], Finish::Skin));
    s.lathe([0.084, 0.03, 0.01], &[[0.012, 0.0], [0.013, 0.04], [0.009, 0.075], [0.008, 0.088]]);
    for (y, z, turn) in [
        (0.019, -0.042, -9.0),
        (0.019, -0.008, -2.0),
        (0.019, 0.026, 6.0),
        (0.052, -0.026, -5.0),
        (0.052, 0.010, 3.0),
        (0.084, -0.008, 0.0f32),
    ] {
        use chaic_core::geom::math::sin;
        let end = z + 0.17 * sin(-turn.to_radians());
        let at = |t: f32, y: f32| {
            let bow = 0.055 * 4.0 * t * (1.0 - t) - 0.02;
            [0.082 - 0.172 * t, y, 0.02 + (z - 0.02) * (0.35 + 0.65 * t) + (end - z) * t - bow]
        };
        let rise = |t: f32| 0.05 + (y - 0.05) * (4.0 * t).min(1.0);
        s.set_paint(s.pick(1, &[PEEL, PEEL_GREEN, PEEL, paint([226, 184, 50], Finish::Skin)]));
        let body = [(0.0, 0.4), (0.1, 0.5), (0.28, 0.95), (0.5, 1.0), (0.75, 0.92), (0.93, 0.45)]
            .map(|(t, r)| (at(t, rise(t)), 0.0182 * r));
        s.curve(&body);
        s.set_paint(PEEL_END);
        s.sweep(&[(at(0.92, y), 0.008), (at(1.0, y), 0.004)]);
    }
}

fn orange(s: &mut MeshBuilder) {
    s.add_part(0);
    s.set_paint(paint([84, 122, 48], Finish::Matte));
    s.lathe([0.0, 0.0925, 0.0], &[[0.008, 0.0], [0.006, 0.0025], [0.0, 0.0035]]);
    if s.style % 2 == 1 {
        s.leaf([0.0, 0.094, 0.0], [0.034, 0.0955, -0.02], 0.02, 0.0005);
    }
}

fn grape(s: &mut MeshBuilder) {
    const PURPLES: [[u8; 3]; 3] = [[112, 34, 70], [86, 26, 60], [128, 48, 86]];
    const GREENS: [[u8; 3]; 3] = [[150, 176, 72], [132, 160, 60], [170, 190, 90]];
    let colors = s.pick(0, &[PURPLES, PURPLES, PURPLES, GREENS]);
    s.set_paint(paint(colors[1], Finish::Glossy));
    s.ball([0.0, 0.02, 0.0], [0.1, 0.17, 0.11]);
    let n = if s.is_level_within(20.0) { 16 } else { 34 };
    for k in 0..n {
        use chaic_core::geom::math::{cos, sin};
        let t = (k as f32 + 0.5) / n as f32;
        let a = 2.4 * k as f32;
        // Narrow at the bottom, wide at the top.
        let r = 0.054 * (t * 2.2).min(1.0) * if t > 0.85 { 0.75 } else { 1.0 };
        let y = 0.004 + 0.165 * t;
        let d = 0.031 + 0.003 * (k % 3) as f32;
        s.set_paint(paint(colors[k % 3], Finish::Glossy));
        s.ball([r * cos(a), y, 1.1 * r * sin(a)], [d; 3]);
    }
    s.set_paint(paint([112, 128, 56], Finish::Wood));
    s.curve(&[
        ([0.0, 0.17, 0.0], 0.004),
        ([0.002, 0.21, 0.0], 0.004),
        ([0.016, 0.232, 0.004], 0.006),
    ]);
}

const CRUST: Paint = paint([190, 132, 70], Finish::Crust);
const DARK_CRUST: Paint = paint([156, 98, 46], Finish::Crust);
const CRUMB: Paint = paint([232, 204, 152], Finish::Crust);

fn bread(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    let bun = [
        [0.046, 0.0],
        [0.060, 0.010],
        [0.065, 0.024],
        [0.060, 0.042],
        [0.044, 0.060],
        [0.022, 0.069],
        [0.0, 0.071],
    ];
    s.lathe([0.0; 3], &bun);
    s.set_paint(CRUMB);
    if s.style.is_multiple_of(2) {
        for x in [-0.026, 0.0, 0.026] {
            let y = 0.067 - 7.0 * x * x;
            s.ball_turned([x, y, 0.0], [0.009, 0.01, 0.072], [0.0, 12.0, 0.0]);
        }
    } else {
        s.ball_turned([0.0, 0.0665, 0.0], [0.009, 0.011, 0.08], [0.0, 45.0, 0.0]);
        s.ball_turned([0.0, 0.0665, 0.0], [0.009, 0.011, 0.08], [0.0, -45.0, 0.0]);
    }
}

fn burger(s: &mut MeshBuilder) {
    s.set_paint(CRUST);
    s.lathe([0.0; 3], &[[0.044, 0.0], [0.049, 0.005], [0.050, 0.014], [0.047, 0.02]]);
    s.set_paint(paint([84, 48, 30], Finish::Crust));
    s.lathe([0.0, 0.017, 0.0], &[[0.048, 0.0], [0.0525, 0.006], [0.0525, 0.012], [0.048, 0.018]]);
    s.set_paint(paint([240, 190, 60], Finish::Glossy));
    s.block_turned([0.0, 0.0365, 0.0], [0.074, 0.003, 0.074], [0.0, 40.0, 0.0], 0.001);
    s.set_paint(paint([190, 50, 38], Finish::Glossy));
    s.lathe([0.0, 0.037, 0.0], &[[0.046, 0.0], [0.050, 0.002], [0.048, 0.005]]);
    s.set_paint(paint([112, 172, 60], Finish::Matte));
    for k in 0..9 {
        use chaic_core::geom::math::{cos, sin};
        let a = 0.698 * k as f32;
        let y = 0.043 + 0.002 * (k % 2) as f32;
        s.ball_turned(
            [0.034 * cos(a), y, 0.034 * sin(a)],
            [0.04, 0.005, 0.034],
            [0.0, -a.to_degrees(), if k % 2 == 0 { 10.0 } else { -14.0 }],
        );
    }
    s.set_paint(s.pick(1, &[paint([202, 128, 56], Finish::Crust), DARK_CRUST, CRUST]));
    let dome = [
        [0.046, 0.0],
        [0.051, 0.006],
        [0.048, 0.017],
        [0.038, 0.026],
        [0.022, 0.031],
        [0.0, 0.033],
    ];
    s.lathe([0.0, 0.0445, 0.0], &dome);
    s.set_paint(CRUMB);
    for k in 0..18 {
        use chaic_core::geom::math::{cos, sin};
        let (a, r) = (2.4 * k as f32, 0.0088 * (k as f32 + 0.4).sqrt());
        let y = 0.0772 - 6.6 * r * r * if r > 0.03 { 1.25 } else { 1.0 };
        s.ball_turned([r * cos(a), y, r * sin(a)], [0.007, 0.0025, 0.0045], [0.0, 40.0 * a, 0.0]);
    }
}

fn loaf(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    s.pillow([0.0, 0.0255, 0.0], [0.085, 0.051, 0.194], [0.0; 3], 0.72);
    s.set_paint(CRUMB);
    let n = s.pick(1, &[4, 3, 5]);
    for k in 0..n {
        let z = 0.15 * ((k as f32 + 0.5) / n as f32 - 0.5);
        let y = 0.0478 - 0.6 * z * z;
        s.ball_turned([0.0, y, z], [0.052, 0.009, 0.011], [0.0, 32.0, 0.0]);
    }
}

fn croissant(s: &mut MeshBuilder) {
    use chaic_core::geom::math::{cos, sin};
    let baked = s.pick(1, &[[206u8, 146, 72], [186, 120, 54]]);
    let shade = |by: f32| paint(baked.map(|c| (by * f32::from(c)) as u8), Finish::Crust);
    // Rolled dough: a crescent whose layers narrow toward both tips. The edge of each layer lies on
    // the next one, and the dough is darkest in the middle.
    let at = |deg: f32| {
        let a = deg.to_radians();
        [0.051 * sin(a), 0.026, 0.014 - 0.054 * cos(a)]
    };
    let steps = [0.0f32, 17.0, 40.0, 62.0, 82.0, 100.0];
    for side in [-1.0, 1.0] {
        for k in 0..5 {
            let (a, b) = (side * steps[k], side * (steps[k + 1] + 6.0));
            let r = 0.028 - 0.0043 * k as f32;
            s.set_paint(shade(1.0 - 0.035 * k as f32));
            let mut ends = [(at(a), 0.96 * r), (at(0.4 * a + 0.6 * b), r), (at(b), 0.72 * r)];
            ends.iter_mut().for_each(|(p, r)| p[1] = *r + 0.001);
            s.curve(&ends);
            // Edge of the layer.
            if !s.is_level_within(60.0) {
                s.set_paint(shade(0.66));
                let edge = 0.4 * a + 0.6 * b;
                let (p, along) = (at(edge), edge.to_radians());
                let axis = [0.051 * cos(along), 0.0, 0.054 * sin(along)];
                s.hoop([p[0], r + 0.001, p[2]], axis, r - 0.0008, 0.0011);
            }
        }
        let mut tip =
            [(at(side * 100.0), 0.0085), (at(side * 114.0), 0.0055), (at(side * 124.0), 0.002)];
        tip.iter_mut().for_each(|(p, r)| p[1] = *r + 0.003);
        s.set_paint(shade(0.74));
        s.sweep(&tip);
    }
}

fn donut(s: &mut MeshBuilder) {
    use chaic_core::geom::math::{cos, sin};
    s.add_part(1);
    let icing =
        s.main_paint_or(&[[238, 132, 174], [244, 150, 190], [228, 112, 160], [246, 166, 196]]);
    s.set_paint(icing);
    s.add_part_shape(&s.class.parts[0]);
    let n = if s.is_level_within(20.0) { 8 } else { 26 };
    let colors = [[250, 250, 246], [90, 170, 226], [248, 212, 70], [110, 190, 96], [150, 90, 60]];
    for k in 0..n {
        let (a, r) = (2.4 * k as f32, 0.036 + 0.0022 * (k * 5 % 7) as f32);
        let out = (r - 0.043) / 0.02;
        let y = 0.026 + 0.0195 * (1.0 - out * out).sqrt();
        s.set_paint(paint(colors[k % 5], Finish::Glossy));
        let turn = [0.0, 77.0 * k as f32, 0.0];
        s.block_turned([r * cos(a), y, r * sin(a)], [0.011, 0.003, 0.003], turn, 0.001);
    }
}

/// Adds a can: its wall, its rims and its tab.
fn can(s: &mut MeshBuilder, main: Paint) {
    let [w, h, _] = s.class.size_m;
    let outline =
        [[0.40, 0.0], [0.435, 0.012], [0.475, 0.055], [0.475, 0.90], [0.43, 0.945], [0.405, 0.965]]
            .map(|[r, y]| [r * w, y * h]);
    s.set_paint(STEEL);
    s.lathe([0.0; 3], &[[0.40 * w, 0.0], [0.435 * w, 0.012 * h], [0.472 * w, 0.05 * h]]);
    s.set_paint(main);
    s.lathe([0.0; 3], &outline[1..]);
    s.set_paint(STEEL);
    let top = [[0.402, 0.955], [0.42, 0.965], [0.425, 0.988], [0.405, 0.99], [0.39, 0.972]];
    s.lathe([0.0; 3], &top.map(|[r, y]| [r * w, y * h]));
    s.block([0.0, 0.973 * h, -0.05 * w], [0.16 * w, 0.008 * h, 0.32 * w], 0.001);
    s.set_paint(DARK_STEEL);
    s.ball([0.0, 0.9735 * h, -0.22 * w], [0.26 * w, 0.004 * h, 0.2 * w]);
}

/// Adds a piece of a label around the can, between heights (fractions) and angles, degrees.
fn label(s: &mut MeshBuilder, paint: Paint, heights: [f32; 2], angles: [f32; 2]) {
    let [w, h, _] = s.class.size_m;
    s.set_paint(paint);
    s.sector([0.0; 3], [0.46 * w, 0.482 * w], heights.map(|y| y * h), angles);
}

/// Adds a wave around the can, approximated by steps.
fn wave(s: &mut MeshBuilder, paint: Paint, low: f32, high: f32, swing: f32) {
    let n = if s.is_level_within(20.0) { 8 } else { 20 };
    for k in 0..n {
        use chaic_core::geom::math::sin;
        let span = 360.0 / n as f32;
        let y = swing * sin(std::f32::consts::TAU * k as f32 / n as f32);
        label(s, paint, [low + y, high + y], [span * k as f32 - 0.6, span * (k + 1) as f32]);
    }
}

/// Adds a round emblem with horizontal stripes at three places around the can.
fn disc(s: &mut MeshBuilder, center: f32, radius: f32, stripes: [Paint; 3]) {
    let n = if s.is_level_within(20.0) { 5 } else { 11 };
    let [w, h, _] = s.class.size_m;
    for back in [0.0, 120.0, 240.0] {
        for k in 0..n {
            let t = (k as f32 + 0.5) / n as f32 * 2.0 - 1.0;
            let width = radius * (1.0 - t * t).sqrt();
            let half_deg = (width * h / (0.48 * w)).to_degrees();
            let y = center + radius * t;
            let half = radius / n as f32;
            let stripe = stripes[(3 * k / n).min(2)];
            label(s, stripe, [y - half, y + half], [back - half_deg, back + half_deg]);
        }
    }
}

const CAN_WHITE: Paint = paint([240, 240, 240], Finish::Glossy);
const CAN_RED: Paint = paint([204, 26, 34], Finish::Glossy);
const CAN_BLUE: Paint = paint([26, 66, 166], Finish::Glossy);
const CAN_GREEN: Paint = paint([28, 142, 66], Finish::Glossy);
const CAN_YELLOW: Paint = paint([244, 222, 60], Finish::Glossy);

fn pepsi(s: &mut MeshBuilder) {
    can(s, s.pick(0, &[CAN_BLUE, paint([18, 48, 140], Finish::Glossy), CAN_BLUE]));
    disc(s, 0.52, 0.17, [CAN_BLUE, CAN_WHITE, CAN_RED]);
    label(s, CAN_WHITE, [0.22, 0.25], [0.0, 359.0]);
}

fn cola(s: &mut MeshBuilder) {
    can(s, s.pick(0, &[CAN_RED, paint([184, 16, 28], Finish::Glossy), CAN_RED]));
    wave(s, CAN_WHITE, 0.36, 0.44, 0.06);
    // The lettering as seen from a distance.
    for back in [0.0, 120.0, 240.0] {
        for (k, a) in [-46.0f32, -30.0, -16.0, 0.0, 14.0, 30.0].into_iter().enumerate() {
            let high = if k % 3 == 0 { 0.72 } else { 0.65 };
            label(s, CAN_WHITE, [0.55, high], [back + a, back + a + 9.0]);
        }
    }
}

fn sprite(s: &mut MeshBuilder) {
    can(s, s.pick(0, &[CAN_GREEN, paint([20, 124, 54], Finish::Glossy), CAN_GREEN]));
    wave(s, CAN_BLUE, 0.14, 0.3, 0.03);
    disc(s, 0.57, 0.12, [CAN_YELLOW, CAN_YELLOW, CAN_WHITE]);
}

fn fanta(s: &mut MeshBuilder) {
    let orange = paint([240, 124, 22], Finish::Glossy);
    can(s, s.pick(0, &[orange, paint([232, 108, 18], Finish::Glossy), orange]));
    disc(s, 0.5, 0.16, [CAN_BLUE, CAN_WHITE, CAN_BLUE]);
    for back in [0.0, 120.0, 240.0] {
        label(s, CAN_GREEN, [0.7, 0.78], [back + 8.0, back + 34.0]);
    }
    wave(s, CAN_YELLOW, 0.12, 0.18, 0.02);
}
