//! Models of seats and tables.

use chaic_core::Vec3;
use chaic_core::catalogue::Finish;

use super::Model;
use super::colors::{BLACK, DARK_STEEL, IRON, STEEL, WALNUT};
use crate::mesh_builder::{MeshBuilder, Paint, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "side_chair" => side_chair,
        "dining_table" => dining_table,
        "coffee_table" => coffee_table,
        "stool" => stool,
        "armchair" => armchair,
        "long_sofa" => long_sofa,
        "corner_sofa" => corner_sofa,
        "bench_sofa" => bench_sofa,
        "round_table" => round_table,
        "stacked_tables" => stacked_tables,
        _ => return None,
    })
}

/// Returns the minimum and maximum corner of a catalogue part, meters.
fn part_box(s: &MeshBuilder, k: usize) -> [Vec3; 2] {
    let part = &s.class.parts[k];
    let size = Vec3::from(s.class.size_m);
    let (center, half) = (Vec3::from(part.center) * size, 0.5 * Vec3::from(part.extent) * size);
    [center - half, center + half]
}

/// Adds a cushion on part `k` of the class between two fractions of its width.
fn seat_cushion(s: &mut MeshBuilder, k: usize, from: f32, to: f32) {
    let [low, high] = part_box(s, k);
    let size = high - low;
    let gap = 0.004;
    let middle =
        [low.x + 0.5 * (from + to) * size.x, 0.5 * (low.y + high.y), 0.5 * (low.z + high.z)];
    s.pillow(middle, [(to - from) * size.x - gap, size.y, size.z], [0.0; 3], 0.26);
}

/// Adds a sofa whose parts are seat, base, back, left arm and right arm, in that order.
pub(super) fn sofa_on(s: &mut MeshBuilder, seat: Paint, frame: Paint, n: usize) {
    if s.is_level_within(20.0) {
        let parts = s.class.parts;
        for (k, part) in parts.iter().enumerate() {
            s.set_paint(if k == 0 || k > 6 && k < 7 + n { seat } else { frame });
            s.add_part_shape(part);
        }
        return;
    }
    s.set_paint(frame);
    for k in 1..3 {
        let [low, high] = part_box(s, k);
        let size = high - low;
        s.block([low.x + 0.5 * size.x, low.y, low.z + 0.5 * size.z], size.into(), 0.035);
    }
    for k in 3..5 {
        let [low, high] = part_box(s, k);
        let size = high - low;
        let middle = [low.x + 0.5 * size.x, 0.5 * (low.y + high.y), low.z + 0.5 * size.z];
        // Arms are square or round.
        if s.pick(3, &[true, false]) {
            s.pillow(middle, size.into(), [0.0; 3], 0.2);
        } else {
            s.block([middle[0], low.y, middle[2]], size.into(), 0.03);
            let r = 0.55 * size.x;
            let inside = middle[0] - middle[0].signum() * (r - 0.5 * size.x);
            let y = high.y - 0.5 * size.x + 0.02;
            s.lathe_along(
                [inside, y, low.z + 0.004],
                [0.0, 0.0, 1.0],
                &[[0.8 * r, 0.0], [r, 0.012], [r, size.z - 0.016], [0.8 * r, size.z - 0.004]],
            );
        }
    }
    s.set_paint(seat);
    for k in 0..n {
        seat_cushion(s, 0, k as f32 / n as f32, (k + 1) as f32 / n as f32);
    }
    // Cushions lean against the back, thin enough to leave space for objects on the seat.
    let [low, high] = part_box(s, 0);
    let [_, back] = part_box(s, 2);
    let height = (back.y - high.y) * 0.98;
    for k in 0..n {
        let x = low.x + (k as f32 + 0.5) / n as f32 * (high.x - low.x);
        let width = (high.x - low.x) / n as f32;
        let middle = [x, high.y + 0.49 * height, high.z - 0.05];
        s.pillow(middle, [width - 0.01, height, 0.11], [4.0, 0.0, 0.0], 0.42);
    }
}

fn armchair(s: &mut MeshBuilder) {
    let frame = paint(s.pick(1, &[[70, 72, 78], [70, 72, 78], [150, 138, 124]]), Finish::Fabric);
    sofa_on(s, s.main_paint(), frame, 1);
    feet(s, 0.36, 0.32, 0.085);
}

fn long_sofa(s: &mut MeshBuilder) {
    let frame = s.pick(1, &[None, Some([122, 126, 132]), Some([96, 84, 76])]);
    let frame = frame.map_or(s.main_paint(), |c| paint(c, Finish::Fabric));
    sofa_on(s, s.main_paint(), frame, 3);
    feet(s, 0.85, 0.34, 0.075);
}

/// Adds four lathed feet.
fn feet(s: &mut MeshBuilder, x: f32, z: f32, high: f32) {
    s.set_paint(WALNUT);
    for sx in [-x, x] {
        for sz in [-z, z] {
            s.taper([sx, 0.0, sz], [sx, high, sz], 0.018, 0.028);
        }
    }
}

fn corner_sofa(s: &mut MeshBuilder) {
    if s.is_level_within(20.0) {
        s.add_all_parts();
        return;
    }
    let frame = s.main_paint();
    s.set_paint(frame);
    for k in 3..8 {
        let [low, high] = part_box(s, k);
        let size = high - low;
        let middle = [low.x + 0.5 * size.x, 0.5 * (low.y + high.y), low.z + 0.5 * size.z];
        if k < 5 {
            s.block([middle[0], low.y, middle[2]], size.into(), 0.04);
            continue;
        }
        // The backs consist of cushions side by side.
        let n = (size.x.max(size.z) / 0.85).max(1.0) as usize;
        for j in 0..n {
            let t = (j as f32 + 0.5) / n as f32 - 0.5;
            let (mut middle, mut extent) = (middle, size.to_array());
            let along = if size.x > size.z { 0 } else { 2 };
            middle[along] += t * size[along];
            extent[along] = size[along] / n as f32 - 0.005;
            s.pillow(middle, extent, [0.0; 3], 0.25);
        }
    }
    // Five cushions on the back wing, three on the side wing, one on the chaise.
    for k in 0..5 {
        seat_cushion(s, 1, 0.2 * k as f32, 0.2 * (k + 1) as f32);
    }
    seat_cushion(s, 2, 0.0, 1.0);
    let [low, high] = part_box(s, 0);
    for k in 0..3 {
        let depth = (high.z - low.z) / 3.0;
        let z = low.z + depth * (k as f32 + 0.5);
        s.pillow(
            [0.5 * (low.x + high.x), 0.34, z],
            [high.x - low.x, 0.16, depth - 0.006],
            [0.0; 3],
            0.26,
        );
    }
}

fn bench_sofa(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    if s.is_level_within(20.0) {
        s.add_all_parts();
        return;
    }
    s.pillow([0.0, 0.37, 0.0], [1.28, 0.14, 0.48], [0.0; 3], 0.2);
    s.set_paint(DARK_STEEL);
    s.block([0.0, 0.26, 0.0], [1.2, 0.05, 0.42], 0.008);
    s.set_paint(STEEL);
    for x in [-0.58, 0.58] {
        for z in [-0.18, 0.18] {
            s.taper([x, 0.0, z], [x * 0.97, 0.28, z], 0.012, 0.024);
        }
    }
}

fn side_chair(s: &mut MeshBuilder) {
    const COVERS: [[u8; 3]; 4] = [[232, 188, 62], [232, 188, 62], [222, 170, 48], [240, 204, 96]];
    let cover = paint(s.pick(0, &COVERS), Finish::Fabric);
    let wood = s.pick(1, &[WALNUT, paint([192, 150, 98], Finish::Wood), BLACK]);
    s.set_paint(cover);
    s.pillow([0.0, 0.415, -0.015], [0.43, 0.07, 0.46], [0.0; 3], 0.3);
    match s.pick(2, &[0, 1]) {
        0 => s.pillow([0.0, 0.61, 0.215], [0.42, 0.38, 0.055], [0.0; 3], 0.3),
        _ => {
            s.pillow([0.0, 0.69, 0.215], [0.42, 0.22, 0.055], [0.0; 3], 0.34);
            s.set_paint(wood);
            for x in [-0.16, 0.16] {
                s.block([x, 0.4, 0.22], [0.03, 0.24, 0.025], 0.006);
            }
        }
    }
    s.set_paint(wood);
    for x in [-0.185, 0.185] {
        for z in [-0.2, 0.2] {
            s.taper([x, 0.0, z], [x, 0.4, z], 0.012, 0.019);
        }
        s.rod([x, 0.16, -0.2], [x, 0.16, 0.2], 0.009);
    }
    s.block([0.0, 0.355, -0.2], [0.36, 0.035, 0.02], 0.004);
    s.block([0.0, 0.355, 0.2], [0.36, 0.035, 0.02], 0.004);
}

fn dining_table(s: &mut MeshBuilder) {
    let legs = s.pick(1, &[s.main_paint(), WALNUT, s.main_paint(), DARK_STEEL]);
    s.set_paint(s.main_paint());
    s.block([0.0, 0.71, 0.0], [1.5, 0.04, 0.9], 0.012);
    s.set_paint(legs);
    for x in [-0.68, 0.68] {
        for z in [-0.38, 0.38] {
            match s.style {
                1 => s.lathe(
                    [x, 0.0, z],
                    &[
                        [0.022, 0.0],
                        [0.028, 0.03],
                        [0.018, 0.06],
                        [0.034, 0.3],
                        [0.026, 0.5],
                        [0.036, 0.54],
                        [0.035, 0.712],
                    ],
                ),
                2 => s.taper([x, 0.0, z], [x, 0.712, z], 0.02, 0.038),
                _ => s.block([x, 0.0, z], [0.07, 0.712, 0.07], 0.008),
            }
        }
    }
    for z in [-0.38, 0.38] {
        s.block([0.0, 0.63, z], [1.3, 0.08, 0.025], 0.004);
    }
    for x in [-0.68, 0.68] {
        s.block([x, 0.63, 0.0], [0.025, 0.08, 0.7], 0.004);
    }
}

fn coffee_table(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    s.block([0.0, 0.385, 0.0], [1.1, 0.035, 0.6], 0.01);
    let shelf = s.pick(1, &[true, false, true]);
    if shelf {
        s.block([0.0, 0.12, 0.0], [0.98, 0.02, 0.48], 0.005);
    }
    s.set_paint(s.pick(2, &[DARK_STEEL, WALNUT, BLACK]));
    for x in [-0.5, 0.5] {
        for z in [-0.25, 0.25] {
            if s.style.is_multiple_of(2) {
                s.block([x, 0.0, z], [0.045, 0.386, 0.045], 0.005);
            } else {
                s.taper([x, 0.0, z], [x, 0.386, z], 0.013, 0.026);
            }
        }
    }
    // A few magazines on the lower shelf.
    if shelf && s.style != 3 {
        for (k, color) in [[196, 70, 60], [60, 110, 150], [230, 220, 200]].into_iter().enumerate() {
            s.set_paint(paint(color, Finish::Glossy));
            let y = 0.14 + 0.008 * k as f32;
            s.block_turned(
                [0.25, y + 0.004, 0.0],
                [0.21, 0.008, 0.28],
                [0.0, 14.0 * k as f32, 0.0],
                0.0,
            );
        }
    }
}

fn stool(s: &mut MeshBuilder) {
    let wood = s.pick(1, &[paint([214, 180, 132], Finish::Wood), WALNUT, IRON]);
    s.set_paint(s.main_paint());
    s.lathe([0.0, 0.44, 0.0], &[[0.17, 0.0], [0.187, 0.008], [0.19, 0.03], [0.182, 0.04]]);
    s.set_paint(wood);
    for x in [-0.11, 0.11] {
        for z in [-0.11, 0.11] {
            s.taper([1.15 * x, 0.0, 1.15 * z], [x, 0.445, z], 0.012, 0.017);
        }
    }
    for z in [-0.12, 0.12] {
        s.rod([-0.12, 0.17, z], [0.12, 0.17, z], 0.01);
    }
    for x in [-0.117, 0.117] {
        s.rod([x, 0.24, -0.117], [x, 0.24, 0.117], 0.01);
    }
}

fn round_table(s: &mut MeshBuilder) {
    let metal = s.pick(1, &[DARK_STEEL, STEEL, WALNUT]);
    s.set_paint(s.main_paint());
    s.lathe([0.0, 0.41, 0.0], &[[0.28, 0.0], [0.3, 0.012], [0.3, 0.034], [0.294, 0.04]]);
    s.set_paint(metal);
    s.lathe(
        [0.0; 3],
        &[
            [0.18, 0.0],
            [0.18, 0.008],
            [0.16, 0.02],
            [0.06, 0.03],
            [0.034, 0.06],
            [0.03, 0.36],
            [0.06, 0.411],
        ],
    );
}

fn stacked_tables(s: &mut MeshBuilder) {
    let tops = s.main_paint_or(&[[238, 238, 234], [214, 180, 132], [112, 74, 50], [60, 62, 66]]);
    s.set_paint(tops);
    s.block([-0.4, 0.4315, 0.027], [0.5, 0.04, 0.94], 0.008);
    s.block([0.25, 0.29, -0.013], [0.8, 0.04, 0.8], 0.008);
    s.set_paint(s.pick(1, &[STEEL, WALNUT, BLACK]));
    for k in 2..6 {
        let part = s.class.parts[k];
        s.add_part_shape(&part);
    }
}
