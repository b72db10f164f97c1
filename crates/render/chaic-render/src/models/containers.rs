//! Models of bowls, trays and baskets.

use chaic_core::catalogue::Finish;

use super::Model;
use crate::mesh_builder::{MeshBuilder, Paint, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "bowl" => bowl,
        "plate" => plate,
        "tea_tray" => tea_tray,
        "plastic_basket" => plastic_basket,
        "wicker_basket" => wicker_basket,
        "wood_basket" => wood_basket,
        "bamboo_basket" => bamboo_basket,
        _ => return None,
    })
}

fn bowl(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    let outline = [
        [0.095, 0.0],
        [0.1, 0.012],
        [0.112, 0.014],
        [0.15, 0.045],
        [0.182, 0.085],
        [0.203, 0.128],
        [0.206, 0.138],
        [0.2, 0.138],
        [0.19, 0.128],
        [0.168, 0.085],
        [0.136, 0.048],
        [0.094, 0.028],
    ];
    s.lathe([0.0; 3], &outline);
    s.set_paint(s.pick(
        1,
        &[
            paint([150, 104, 66], Finish::Glossy),
            paint([70, 96, 120], Finish::Glossy),
            paint([230, 226, 214], Finish::Glossy),
        ],
    ));
    s.hoop([0.0, 0.134, 0.0], [0.0, 1.0, 0.0], 0.203, 0.0055);
    if s.style % 2 == 1 {
        s.hoop([0.0, 0.1, 0.0], [0.0, 1.0, 0.0], 0.187, 0.005);
        s.hoop([0.0, 0.085, 0.0], [0.0, 1.0, 0.0], 0.18, 0.004);
    }
}

fn plate(s: &mut MeshBuilder) {
    let china =
        s.main_paint_or(&[[238, 238, 232], [238, 238, 232], [224, 232, 236], [240, 230, 212]]);
    let ring = s.pick(1, &[[76, 112, 168], [170, 62, 58], [92, 132, 96], [200, 164, 74]]);
    s.set_paint(china);
    let outline = [
        [0.11, 0.0],
        [0.128, 0.006],
        [0.155, 0.015],
        [0.212, 0.036],
        [0.2145, 0.0385],
        [0.211, 0.039],
        [0.15, 0.0225],
        [0.142, 0.0185],
    ];
    s.lathe([0.0; 3], &outline);
    s.set_paint(paint(ring, Finish::Glossy));
    s.lathe(
        [0.0; 3],
        &[[0.2, 0.033], [0.207, 0.0366], [0.2065, 0.0378], [0.196, 0.0362], [0.2, 0.033]],
    );
    s.hoop([0.0, 0.0185, 0.0], [0.0, 1.0, 0.0], 0.139, 0.0022);
    if s.style % 2 == 1 {
        for k in 0..8 {
            use chaic_core::geom::math::{cos, sin};
            let a = 0.785 * k as f32;
            s.ball_turned(
                [0.175 * cos(a), 0.0297, 0.175 * sin(a)],
                [0.026, 0.003, 0.014],
                [0.0, -a.to_degrees(), 16.0],
            );
        }
    }
}

fn tea_tray(s: &mut MeshBuilder) {
    const WOODS: [[[u8; 3]; 2]; 4] = [
        [[128, 82, 48], [98, 60, 36]],
        [[166, 120, 74], [120, 80, 46]],
        [[128, 82, 48], [98, 60, 36]],
        [[96, 58, 40], [150, 104, 60]],
    ];
    let [base, rim] = s.pick(0, &WOODS).map(|c| paint(c, Finish::Wood));
    s.set_paint(base);
    s.block([0.0, 0.0, 0.0], [0.44, 0.012, 0.31], 0.003);
    s.set_paint(rim);
    for z in [-0.154, 0.154] {
        s.block([0.0, 0.0, z], [0.45, 0.03, 0.012], 0.004);
    }
    for x in [-0.219, 0.219] {
        s.block([x, 0.0, 0.0], [0.012, 0.03, 0.32], 0.004);
        // A handle raised over a gap for the fingers.
        s.pipe(
            &[
                [x, 0.026, -0.058],
                [x, 0.04, -0.046],
                [x, 0.0435, 0.0],
                [x, 0.04, 0.046],
                [x, 0.026, 0.058],
            ],
            0.006,
        );
    }
    if s.style % 2 == 1 {
        s.set_paint(paint([214, 196, 160], Finish::Wood));
        for z in [-0.08, 0.0, 0.08] {
            s.block([0.0, 0.0115, z], [0.4, 0.0012, 0.006], 0.0);
        }
    }
}

/// Rotation of the four sides of a square basket around the vertical axis, degrees.
const SIDES: [f32; 4] = [0.0, 90.0, 180.0, 270.0];

/// Returns a point of the side that faces -z at rotation 0: `x` along it, `out` outward.
fn on_side(turn_deg: f32, x: f32, y: f32, out: f32) -> [f32; 3] {
    match turn_deg as i32 {
        0 => [x, y, -out],
        90 => [-out, y, -x],
        180 => [-x, y, out],
        _ => [out, y, x],
    }
}

/// Adds a band around a square basket whose outer half width is `half` at height `y`.
fn band(s: &mut MeshBuilder, y: f32, half: f32, high: f32, thickness: f32) {
    for turn in SIDES {
        let center = on_side(turn, 0.0, y + 0.5 * high, half - 0.5 * thickness);
        s.block_turned(center, [2.0 * half, high, thickness], [0.0, turn, 0.0], 0.3 * thickness);
    }
}

fn plastic_basket(s: &mut MeshBuilder) {
    if s.is_level_within(20.0) {
        s.add_all_parts();
        return;
    }
    let color =
        s.main_paint_or(&[[238, 238, 234], [238, 238, 234], [206, 226, 236], [236, 226, 206]]);
    s.set_paint(color);
    s.block([0.0, 0.0, 0.0], [0.344, 0.012, 0.344], 0.004);
    // A lattice: slightly sloped uprights, and crossbars.
    for turn in SIDES {
        for k in 0..10 {
            let x = -0.162 + 0.036 * k as f32;
            let (low, high) =
                (on_side(turn, x, 0.006, 0.17), on_side(turn, 1.03 * x, 0.215, 0.179));
            s.sweep(&[(low, 0.0052), (high, 0.0052)]);
        }
    }
    for (k, y) in [0.004, 0.045, 0.088, 0.131, 0.172].into_iter().enumerate() {
        band(s, y, 0.1745 + 0.0022 * k as f32, if k == 0 { 0.024 } else { 0.011 }, 0.008);
    }
    band(s, 0.21, 0.185, 0.03, 0.014);
}

const WILLOW: Paint = paint([166, 118, 70], Finish::Wicker);
const DARK_WILLOW: Paint = paint([124, 82, 46], Finish::Wicker);

fn wicker_basket(s: &mut MeshBuilder) {
    s.set_paint(paint(
        s.pick(0, &[WILLOW.color, [188, 146, 96], WILLOW.color, [140, 98, 60]]),
        Finish::Wicker,
    ));
    s.add_part_shape(&s.class.parts[0]);
    s.set_paint(DARK_WILLOW);
    let rows = if s.is_level_within(20.0) { 0 } else { 5 };
    for k in 0..rows {
        let y = 0.03 + 0.034 * k as f32;
        band(s, y, 0.153 + 0.13 * y, 0.014, 0.008);
    }
    // A plaited rim and foot.
    let strands = if s.is_level_within(60.0) { 0 } else { 14 };
    for turn in SIDES {
        for k in 0..strands {
            let x = -0.165 + 0.33 * (k as f32 + 0.5) / strands as f32;
            let from = on_side(turn, x - 0.017, 0.203, 0.178);
            let to = on_side(turn, x + 0.017, 0.226, 0.178);
            s.sweep(&[(from, 0.0062), (to, 0.0062)]);
        }
    }
    band(s, 0.201, 0.183, 0.024, 0.018);
    band(s, 0.0, 0.158, 0.022, 0.018);
    for turn in [0.0, 180.0] {
        let at = |x: f32, y: f32| on_side(turn, x, y, 0.178);
        s.pipe(
            &[
                at(-0.055, 0.2),
                at(-0.05, 0.222),
                at(-0.025, 0.2325),
                at(0.025, 0.2325),
                at(0.05, 0.222),
                at(0.055, 0.2),
            ],
            0.0075,
        );
    }
}

fn wood_basket(s: &mut MeshBuilder) {
    let slat = paint(
        s.pick(0, &[[204, 160, 104], [188, 138, 84], [204, 160, 104], [220, 184, 134]]),
        Finish::Wood,
    );
    if s.is_level_within(20.0) {
        s.add_all_parts();
        return;
    }
    let frame = paint([140, 94, 54], Finish::Wood);
    s.set_paint(slat);
    s.block([0.0, 0.0, 0.0], [0.34, 0.012, 0.34], 0.003);
    // Slats with gaps between them.
    for turn in SIDES {
        for y in [0.012, 0.07, 0.128, 0.186] {
            let center = on_side(turn, 0.0, y + 0.022, 0.17);
            s.block_turned(center, [0.344, 0.044, 0.01], [0.0, turn, 0.0], 0.003);
        }
    }
    for x in [-0.168, 0.168] {
        for z in [-0.168, 0.168] {
            s.block([x, 0.0, z], [0.026, 0.24, 0.026], 0.005);
        }
    }
    s.set_paint(frame);
    band(s, 0.02, 0.181, 0.03, 0.009);
    band(s, 0.194, 0.181, 0.03, 0.009);
    s.set_paint(paint([90, 92, 96], Finish::Metal));
    for turn in SIDES {
        for x in [-0.16, 0.16] {
            for y in [0.035, 0.209] {
                let center = on_side(turn, x, y, 0.181);
                s.ball_turned(center, [0.008; 3], [0.0; 3]);
            }
        }
    }
}

fn bamboo_basket(s: &mut MeshBuilder) {
    let body = paint(
        s.pick(0, &[[216, 190, 122], [200, 168, 104], [216, 190, 122], [180, 150, 96]]),
        Finish::Wicker,
    );
    let rim = paint([176, 142, 78], Finish::Wood);
    s.set_paint(body);
    let outline = [
        [0.168, 0.0],
        [0.172, 0.004],
        [0.186, 0.09],
        [0.2, 0.18],
        [0.218, 0.288],
        [0.206, 0.29],
        [0.188, 0.18],
        [0.16, 0.012],
    ];
    s.lathe([0.0; 3], &outline);
    s.set_paint(rim);
    let staves = if s.is_level_within(20.0) { 0 } else { 20 };
    for k in 0..staves {
        use chaic_core::geom::math::{cos, sin};
        let a = std::f32::consts::TAU * k as f32 / staves as f32;
        let at = |r: f32, y: f32| [r * cos(a), y, r * sin(a)];
        s.sweep(&[(at(0.171, 0.006), 0.005), (at(0.2, 0.17), 0.005), (at(0.22, 0.285), 0.005)]);
    }
    for (y, r, tube) in
        [(0.286, 0.217, 0.012), (0.19, 0.203, 0.007), (0.1, 0.189, 0.007), (0.014, 0.173, 0.01)]
    {
        s.hoop([0.0, y, 0.0], [0.0, 1.0, 0.0], r, tube);
    }
    for z in [-0.216, 0.216] {
        s.pipe(
            &[
                [-0.055, 0.25, z],
                [-0.048, 0.288, z],
                [-0.02, 0.3, z],
                [0.02, 0.3, z],
                [0.048, 0.288, z],
                [0.055, 0.25, z],
            ],
            0.009,
        );
    }
}
