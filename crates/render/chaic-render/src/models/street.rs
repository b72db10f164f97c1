//! Models of objects in the street.

use chaic_core::catalogue::Finish;
use chaic_core::geom::math::{cos, sin};

use super::Model;
use super::colors::{BLACK, BRASS, DARK_STEEL, GAP, GLASS, IRON, LAMP, RUBBER, STEEL, WHITE};
use crate::mesh_builder::{MeshBuilder, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "truck" => truck,
        "fire_hydrant" => hydrant,
        "bike" => bike,
        "tent" => tent,
        "house_front" => house_front,
        "tree" => tree,
        "street_lamp" => street_lamp,
        "bench" => bench,
        "mailbox" => mailbox,
        "fence" => fence,
        _ => return None,
    })
}

const RED: [u8; 3] = [206, 40, 36];

fn truck(s: &mut MeshBuilder) {
    let body = s.main_paint_or(&[[240, 190, 48], [240, 190, 48], [70, 120, 180], [196, 70, 50]]);
    let bed = paint([112, 118, 124], Finish::Metal);
    s.set_paint(body);
    // The cab: a lower block, and an upper one that slopes backward.
    s.block([0.0, 0.4, -2.22], [2.0, 0.88, 1.46], 0.06);
    let side = [[-0.72, 0.0], [-0.6, 0.9], [0.73, 0.9], [0.73, 0.0]];
    // Extruded in the plane of height and length: x of the outline is +z.
    s.cut(
        [0.0, 1.28, -2.22],
        &side.map(|[z, y]| [-z, y]).map(|p| [p[0], p[1]]),
        1.98,
        [0.0, 90.0, 0.0],
    );
    s.set_paint(GLASS);
    s.block_turned([0.0, 1.72, -2.893], [1.74, 0.66, 0.03], [7.6, 0.0, 0.0], 0.0);
    for x in [-0.985, 0.985] {
        s.block([x, 1.38, -2.3], [0.03, 0.6, 0.72], 0.01);
    }
    s.set_paint(GAP);
    for x in [-1.0, 1.0] {
        for z in [-2.72, -1.86] {
            s.block([x, 0.5, z], [0.012, 0.86, 0.014], 0.0);
        }
    }
    s.set_paint(BLACK);
    for x in [-1.0, 1.0] {
        s.block([x, 1.16, -1.98], [0.03, 0.04, 0.16], 0.008);
    }
    for k in 0..5 {
        s.block([0.0, 0.8 + 0.07 * k as f32, -2.955], [1.2, 0.045, 0.03], 0.008);
    }
    s.set_paint(IRON);
    s.block([0.0, 0.38, -2.94], [2.06, 0.22, 0.12], 0.03);
    s.block([0.0, 0.35, 0.0], [1.3, 0.45, 5.8], 0.02);
    s.set_paint(LAMP);
    for x in [-0.8, 0.8] {
        s.pillow([x, 0.93, -2.955], [0.3, 0.22, 0.06], [0.0; 3], 0.4);
    }
    s.set_paint(paint([240, 140, 40], Finish::Glossy));
    for x in [-0.8, 0.8] {
        s.block([x, 0.68, -2.955], [0.2, 0.07, 0.03], 0.01);
    }
    s.set_paint(WHITE);
    s.block([0.0, 0.44, -2.999], [0.5, 0.11, 0.004], 0.0);
    // The cargo bed.
    s.add_part(1);
    s.set_paint(bed);
    s.block([0.0, 0.95, -1.37], [2.1, 0.7, 0.06], 0.01);
    for k in 0..9 {
        let x = -0.92 + 0.23 * k as f32;
        s.block([x, 0.95, -1.345], [0.03, 0.68, 0.03], 0.0);
    }
    s.set_paint(body);
    for x in [-1.02, 1.02] {
        s.block([x, 0.95, 0.8], [0.06, 0.3, 4.4], 0.012);
        for k in 0..7 {
            s.block([1.002 * x, 0.8, -1.2 + 0.68 * k as f32], [0.054, 0.44, 0.06], 0.01);
        }
    }
    for x in [-0.85, 0.85] {
        for z in [-2.1, 1.6] {
            let out = if x < 0.0 { -1.0 } else { 1.0 };
            let at = |dx: f32| [x + out * dx, 0.42, z];
            s.set_paint(RUBBER);
            s.lathe_along(
                at(-0.15),
                [out, 0.0, 0.0],
                &[
                    [0.28, 0.0],
                    [0.38, 0.01],
                    [0.42, 0.04],
                    [0.42, 0.26],
                    [0.38, 0.29],
                    [0.26, 0.296],
                    [0.25, 0.28],
                ],
            );
            s.set_paint(STEEL);
            s.lathe_along(
                at(0.09),
                [out, 0.0, 0.0],
                &[
                    [0.26, 0.0],
                    [0.26, 0.05],
                    [0.2, 0.035],
                    [0.12, 0.05],
                    [0.09, 0.075],
                    [0.0, 0.08],
                ],
            );
            s.set_paint(DARK_STEEL);
            for k in 0..6 {
                let a = 1.047 * k as f32;
                let p = at(0.135);
                s.ball(
                    [p[0], p[1] + 0.16 * sin(a) - 0.02, p[2] + 0.16 * cos(a)],
                    [0.03, 0.04, 0.04],
                );
            }
        }
    }
    s.set_paint(paint(RED, Finish::Glossy));
    for x in [-0.85, 0.85] {
        s.block([x, 0.62, 2.95], [0.26, 0.14, 0.06], 0.015);
    }
    s.set_paint(BLACK);
    for x in [-0.96, 0.96] {
        for z in [-2.1, 1.6] {
            s.block([0.93 * x, 0.86, z], [0.28, 0.03, 1.0], 0.008);
        }
    }
}

fn hydrant(s: &mut MeshBuilder) {
    let red = s.main_paint_or(&[[202, 40, 34], [202, 40, 34], [220, 170, 40], [202, 40, 34]]);
    let cap = s.pick(
        1,
        &[paint([226, 196, 74], Finish::Metal), paint([226, 196, 74], Finish::Metal), STEEL],
    );
    s.set_paint(red);
    s.lathe(
        [0.0; 3],
        &[
            [0.17, 0.0],
            [0.17, 0.045],
            [0.15, 0.06],
            [0.12, 0.075],
            [0.105, 0.1],
            [0.105, 0.2],
            [0.118, 0.21],
            [0.118, 0.235],
            [0.11, 0.245],
            [0.11, 0.52],
            [0.15, 0.53],
            [0.15, 0.565],
            [0.135, 0.575],
            [0.125, 0.63],
            [0.09, 0.69],
            [0.06, 0.71],
        ],
    );
    s.set_paint(cap);
    s.lathe(
        [0.0, 0.7, 0.0],
        &[[0.1, 0.0], [0.1, 0.012], [0.06, 0.024], [0.045, 0.026], [0.04, 0.05]],
    );
    for k in 0..8 {
        let a = 0.785 * k as f32 + 0.39;
        s.ball([0.138 * cos(a), 0.56, 0.138 * sin(a)], [0.022, 0.018, 0.022]);
        s.ball([0.15 * cos(a), 0.04, 0.15 * sin(a)], [0.022, 0.018, 0.022]);
    }
    for (axis, y, r) in [
        ([-1.0f32, 0.0, 0.0], 0.42, 0.055),
        ([1.0, 0.0, 0.0], 0.42, 0.055),
        ([0.0, 0.0, -1.0], 0.36, 0.072),
    ] {
        let at = |t: f32| [axis[0] * t, y, axis[2] * t];
        s.set_paint(red);
        s.lathe_along(at(0.09), axis, &[[r, 0.0], [r, 0.06], [1.1 * r, 0.065], [1.1 * r, 0.075]]);
        s.set_paint(cap);
        s.lathe_along(
            at(0.16),
            axis,
            &[
                [1.15 * r, 0.0],
                [1.2 * r, 0.006],
                [1.15 * r, 0.02],
                [0.4 * r, 0.026],
                [0.38 * r, 0.039],
            ],
        );
    }
    s.set_paint(DARK_STEEL);
    s.pipe(
        &[[0.06, 0.36, -0.16], [0.1, 0.31, -0.15], [0.13, 0.33, -0.1], [0.14, 0.37, -0.04]],
        0.005,
    );
}

fn bike(s: &mut MeshBuilder) {
    let color = s.main_paint_or(&[[58, 148, 150], [58, 148, 150], [176, 60, 70], [70, 90, 150]]);
    let leather = paint([112, 70, 44], Finish::Fabric);
    let x = 0.0;
    s.set_paint(color);
    let crank = [x, 0.3, 0.08];
    let rear = [x, 0.34, 0.535];
    let seat = [x, 0.78, 0.235];
    let head = [x, 0.72, -0.43];
    s.pipe(&[head, [x, 0.52, -0.2], crank], 0.019);
    s.pipe(&[[x, 0.82, -0.4], [x, 0.62, -0.15], [x, 0.53, 0.16]], 0.016);
    s.rod(crank, seat, 0.016);
    for dx in [-0.03, 0.03] {
        let beside = |p: [f32; 3], k: f32| [k * dx, p[1], p[2]];
        s.rod(beside(crank, 0.6), beside(rear, 1.6), 0.009);
        s.rod(beside([x, 0.66, 0.19], 0.5), beside(rear, 1.6), 0.008);
        s.pipe(
            &[
                beside([x, 0.7, -0.435], 1.2),
                beside([x, 0.55, -0.47], 1.5),
                beside([x, 0.34, -0.535], 1.5),
            ],
            0.009,
        );
    }
    s.rod([x, 0.68, -0.42], [x, 0.92, -0.35], 0.018);
    for z in [-0.535, 0.535] {
        let at = [x, 0.34, z];
        s.set_paint(RUBBER);
        s.hoop(at, [1.0, 0.0, 0.0], 0.316, 0.024);
        s.set_paint(STEEL);
        s.hoop(at, [1.0, 0.0, 0.0], 0.29, 0.011);
        s.rod([-0.05, 0.34, z], [0.05, 0.34, z], 0.02);
        let n = if s.is_level_within(20.0) { 6 } else { 18 };
        for k in 0..n {
            let a = std::f32::consts::TAU * k as f32 / n as f32;
            let out = if k % 2 == 0 { 0.022 } else { -0.022 };
            s.rod([out, 0.34, z], [0.0, 0.34 + 0.29 * sin(a), z + 0.29 * cos(a)], 0.0022);
        }
        // The mudguard.
        s.set_paint(color);
        let (from, to) = if z < 0.0 { (-20.0f32, 130.0f32) } else { (30.0, 190.0) };
        let arch: Vec<[f32; 3]> = (0..7)
            .map(|k| (from + (to - from) * k as f32 / 6.0).to_radians())
            .map(|a| [x, 0.34 + 0.352 * sin(a), z - 0.352 * cos(a)])
            .filter(|p| p[2].abs() < 0.87)
            .collect();
        s.pipe(&arch, 0.013);
    }
    s.set_paint(STEEL);
    s.rod([x, 0.9, -0.355], [x, 1.0, -0.33], 0.014);
    s.pipe(
        &[
            [-0.28, 1.0, -0.1],
            [-0.26, 1.02, -0.2],
            [-0.14, 1.02, -0.32],
            [x, 1.0, -0.34],
            [0.14, 1.02, -0.32],
            [0.26, 1.02, -0.2],
            [0.28, 1.0, -0.1],
        ],
        0.012,
    );
    s.set_paint(leather);
    for side in [-1.0, 1.0] {
        s.rod([0.27 * side, 1.012, -0.17], [0.28 * side, 0.998, -0.06], 0.018);
    }
    s.pillow([0.0, 0.88, 0.33], [0.2, 0.08, 0.2], [0.0; 3], 0.7);
    s.pillow([0.0, 0.885, 0.22], [0.09, 0.06, 0.22], [0.0; 3], 0.7);
    s.set_paint(STEEL);
    s.rod(seat, [x, 0.86, 0.26], 0.012);
    s.lathe_along(
        [0.02, 0.3, 0.08],
        [1.0, 0.0, 0.0],
        &[[0.09, 0.0], [0.095, 0.004], [0.09, 0.008]],
    );
    s.rod([0.03, 0.3, 0.08], [0.045, 0.19, 0.04], 0.009);
    s.rod([-0.03, 0.3, 0.08], [-0.045, 0.41, 0.12], 0.009);
    s.set_paint(BLACK);
    s.block([0.09, 0.18, 0.04], [0.1, 0.024, 0.07], 0.006);
    s.block([-0.09, 0.4, 0.12], [0.1, 0.024, 0.07], 0.006);
    s.block_turned([0.036, 0.35, 0.31], [0.012, 0.05, 0.46], [-5.0, 0.0, 0.0], 0.006);
    s.add_part(19);
    s.set_paint(LAMP);
    s.lathe_along(
        [x, 0.68, -0.47],
        [0.0, 0.0, -1.0],
        &[[0.018, 0.0], [0.034, 0.03], [0.034, 0.05], [0.0, 0.06]],
    );
    s.set_paint(paint(RED, Finish::Glossy));
    s.ball([x, 0.56, 0.83], [0.05, 0.05, 0.04]);
    s.set_paint(paint([150, 104, 62], Finish::Wicker));
    for z in [-0.768, -0.472] {
        s.rod([-0.195, 0.962, z], [0.195, 0.962, z], 0.008);
    }
    for dx in [-0.195, 0.195] {
        s.rod([dx, 0.962, -0.768], [dx, 0.962, -0.472], 0.008);
    }
}

fn tent(s: &mut MeshBuilder) {
    let canvas = s.main_paint_or(&[[200, 54, 48], [56, 110, 168], [64, 140, 90], [226, 150, 50]]);
    let white = paint([240, 236, 224], Finish::Fabric);
    for k in 0..7 {
        let x = -1.2 + 2.4 * (k as f32 + 0.5) / 7.0;
        s.set_paint(if k % 2 == 0 { canvas } else { white });
        for (z, lean) in [(-0.475, 68.7), (0.475, -68.7)] {
            s.block_turned([x, 2.185, z], [0.344, 1.01, 0.02], [lean, 0.0, 0.0], 0.0);
        }
        // The scalloped valance.
        for z in [-0.938, 0.938] {
            let half: [f32; 2] = [0.1715, 0.085];
            let rim: [[f32; 2]; 9] = std::array::from_fn(|j| match j {
                0 => [half[0], half[1]],
                1 => [-half[0], half[1]],
                _ => {
                    let a = std::f32::consts::PI * (j - 2) as f32 / 6.0;
                    [-half[0] * cos(a), -0.02 - 0.075 * sin(a)]
                }
            });
            s.cut([x, 1.935, z], &rim, 0.012, [0.0; 3]);
        }
    }
    // Gables at the sides.
    s.set_paint(canvas);
    for x in [-1.17, 1.17] {
        s.cut([x, 2.02, 0.0], &[[-0.9, 0.0], [0.9, 0.0], [0.0, 0.33]], 0.012, [0.0, 90.0, 0.0]);
    }
    s.set_paint(STEEL);
    for x in [-1.15, 1.15] {
        for z in [-0.9, 0.9] {
            s.rod([x, 0.0, z], [x, 2.06, z], 0.024);
            s.lathe([x, 0.0, z], &[[0.05, 0.0], [0.05, 0.012], [0.026, 0.02]]);
        }
    }
    for z in [-0.9, 0.9] {
        s.rod([-1.15, 1.99, z], [1.15, 1.99, z], 0.014);
    }
}

fn house_front(s: &mut MeshBuilder) {
    let trim = paint([240, 238, 230], Finish::Matte);
    let door = s.pick(1, &[[60, 92, 82], [130, 52, 44], [50, 66, 110], [96, 66, 44]]);
    let roof = paint(s.pick(2, &[[126, 62, 50], [84, 84, 92], [110, 80, 60]]), Finish::Matte);
    s.add_part(0);
    s.set_paint(roof);
    s.block_turned([0.0, 4.17, 0.0], [8.0, 1.76, 0.08], [30.7, 0.0, 0.0], 0.0);
    if !s.is_level_within(60.0) {
        // Rows of roof tiles.
        for k in 0..11 {
            let t = (k as f32 + 0.5) / 11.0 - 0.5;
            let (y, z) = (4.17 + 1.5 * t, 0.88 * t - 0.045);
            s.block_turned([0.0, y, z], [7.98, 0.15, 0.03], [35.0, 0.0, 0.0], 0.0);
        }
    }
    s.add_parts(&[3]);
    s.set_paint(paint([110, 70, 58], Finish::Matte));
    s.block([2.6, 4.85, 0.2], [0.8, 0.14, 0.6], 0.0);
    s.set_paint(trim);
    s.block([0.0, 3.3, -0.46], [8.0, 0.14, 0.07], 0.02);
    for x in [-3.75, 3.75] {
        s.block([x, 0.0, -0.17], [0.12, 3.5, 0.05], 0.01);
    }
    s.add_parts(&[4, 5]);
    s.set_paint(trim);
    s.block([0.0, 0.16, -0.19], [1.24, 2.3, 0.1], 0.02);
    let door = paint(door, Finish::Wood);
    s.set_paint(door);
    s.block([0.0, 0.16, -0.22], [1.0, 2.16, 0.08], 0.01);
    s.set_paint(paint(door.color.map(|c| (0.82 * f32::from(c)) as u8), Finish::Wood));
    for x in [-0.23, 0.23] {
        s.block([x, 0.35, -0.262], [0.36, 0.72, 0.016], 0.008);
    }
    s.set_paint(GLASS);
    for x in [-0.23, 0.23] {
        s.block([x, 1.3, -0.264], [0.36, 0.82, 0.01], 0.0);
    }
    s.set_paint(BRASS);
    s.ball([-0.4, 1.12, -0.3], [0.07, 0.07, 0.07]);
    s.block([0.0, 1.16, -0.266], [0.24, 0.04, 0.01], 0.0);
    for x in [-2.4, 2.4] {
        s.set_paint(trim);
        s.block([x, 1.1, -0.19], [1.3, 1.5, 0.1], 0.02);
        s.set_paint(GLASS);
        s.block([x, 1.2, -0.2], [1.14, 1.3, 0.12], 0.0);
        s.set_paint(trim);
        s.block([x, 1.2, -0.225], [0.06, 1.3, 0.1], 0.0);
        for y in [1.6, 2.05] {
            s.block([x, y, -0.222], [1.14, 0.035, 0.1], 0.0);
        }
        s.block([x, 1.04, -0.24], [1.46, 0.08, 0.2], 0.02);
        // Shutters, or a flower box.
        if s.style.is_multiple_of(2) {
            s.set_paint(door);
            for side in [-0.88, 0.88] {
                s.block([x + side, 1.1, -0.185], [0.4, 1.5, 0.05], 0.01);
                s.set_paint(door);
                for k in 0..9 {
                    s.block_turned(
                        [x + side, 1.2 + 0.16 * k as f32, -0.215],
                        [0.32, 0.1, 0.02],
                        [25.0, 0.0, 0.0],
                        0.0,
                    );
                }
            }
        } else {
            s.set_paint(paint([150, 84, 60], Finish::Matte));
            s.block([x, 0.9, -0.3], [1.2, 0.2, 0.2], 0.02);
            for k in 0..9 {
                let dx = -0.5 + 0.125 * k as f32;
                s.set_paint(paint([78, 130, 60], Finish::Crust));
                s.lump([x + dx, 1.12, -0.3], [0.2, 0.16, 0.18], 0.25, k as u32);
                let flower = [[220, 60, 70], [240, 200, 70], [230, 120, 170]][k % 3];
                s.set_paint(paint(flower, Finish::Matte));
                s.ball([x + dx, 1.17, -0.36], [0.07, 0.06, 0.07]);
            }
        }
    }
}

fn tree(s: &mut MeshBuilder) {
    let bark = paint([104, 78, 54], Finish::Wood);
    s.set_paint(bark);
    s.curve(&[
        ([0.0, 0.0, 0.0], 0.17),
        ([0.01, 0.25, 0.0], 0.135),
        ([-0.01, 1.2, 0.01], 0.11),
        ([0.0, 2.3, 0.0], 0.09),
        ([0.05, 3.4, -0.05], 0.05),
    ]);
    for (a, y) in [(0.3f32, 1.7), (2.5, 1.85), (4.4, 2.1), (5.6, 2.5), (1.4, 2.4)] {
        s.curve(&[
            ([0.0, y, 0.0], 0.06),
            ([0.35 * cos(a), y + 0.35, 0.35 * sin(a)], 0.045),
            ([0.75 * cos(a), y + 0.6, 0.75 * sin(a)], 0.02),
        ]);
    }
    let blobs = [
        [0.0, 2.8, 0.0, 2.2, 2.1],
        [0.5, 2.3, 0.3, 1.5, 1.3],
        [-0.55, 2.5, -0.25, 1.5, 1.4],
        [0.1, 3.7, -0.1, 1.6, 1.7],
        [-0.1, 2.6, 0.6, 1.35, 1.3],
        [0.2, 2.6, -0.6, 1.35, 1.3],
        [-0.6, 3.0, 0.35, 1.1, 1.1],
        [0.6, 3.1, -0.3, 1.2, 1.2],
        [0.55, 3.2, 0.45, 0.95, 0.95],
        [-0.4, 3.5, -0.45, 1.0, 1.0],
    ];
    for (k, [x, y, z, w, h]) in blobs.into_iter().enumerate() {
        s.set_paint(s.main_paint());
        s.lump([x, y, z], [w, h, w], 0.16, k as u32 * 31 + u32::from(s.style));
    }
    if s.style == 2 {
        s.set_paint(paint([206, 50, 44], Finish::Glossy));
        for k in 0..22 {
            let (a, t) = (2.4 * k as f32, (k as f32 + 0.5) / 22.0);
            let r = 1.0 - 0.5 * (2.0 * t - 0.7).abs();
            s.ball([r * cos(a), 2.0 + 2.0 * t, r * sin(a)], [0.09; 3]);
        }
    }
}

fn street_lamp(s: &mut MeshBuilder) {
    s.set_paint(s.pick(0, &[IRON, IRON, paint([60, 90, 76], Finish::Metal), DARK_STEEL]));
    s.lathe(
        [0.0, 0.0, 0.57],
        &[
            [0.18, 0.0],
            [0.18, 0.06],
            [0.14, 0.1],
            [0.12, 0.4],
            [0.1, 0.46],
            [0.08, 0.5],
            [0.07, 1.5],
            [0.055, 4.4],
            [0.05, 4.5],
        ],
    );
    s.pipe(&[[0.0, 4.3, 0.57], [0.0, 4.5, 0.45], [0.0, 4.55, 0.15], [0.0, 4.54, -0.2]], 0.035);
    s.rod([0.0, 4.15, 0.56], [0.0, 4.52, 0.2], 0.015);
    s.pillow([0.0, 4.52, -0.44], [0.3, 0.15, 0.62], [0.0; 3], 0.7);
    s.set_paint(DARK_STEEL);
    s.block([0.0, 0.6, 0.49], [0.09, 0.25, 0.02], 0.004);
    s.set_paint(LAMP);
    s.pillow([0.0, 4.455, -0.44], [0.24, 0.12, 0.5], [0.0; 3], 0.8);
}

fn bench(s: &mut MeshBuilder) {
    let wood = s.main_paint_or(&[[158, 108, 64], [158, 108, 64], [90, 120, 84], [120, 76, 48]]);
    if s.is_level_within(20.0) {
        s.add_all_parts();
        return;
    }
    s.set_paint(wood);
    for k in 0..4 {
        s.block([0.0, 0.425, -0.235 + 0.116 * k as f32], [1.6, 0.035, 0.1], 0.008);
    }
    for (y, z) in [(0.53, 0.255), (0.71, 0.285)] {
        s.block([0.0, y, z], [1.6, 0.12, 0.035], 0.01);
    }
    s.set_paint(IRON);
    for x in [-0.66, 0.66] {
        s.block([x, 0.39, -0.05], [0.05, 0.035, 0.48], 0.006);
        s.pipe(&[[x, 0.012, -0.255], [x, 0.2, -0.2], [x, 0.4, -0.2]], 0.025);
        s.pipe(
            &[[x, 0.012, 0.25], [x, 0.2, 0.19], [x, 0.4, 0.21], [x, 0.62, 0.262], [x, 0.825, 0.28]],
            0.024,
        );
        let arm = 1.1 * x;
        s.pipe(
            &[
                [arm, 0.41, -0.25],
                [arm, 0.55, -0.27],
                [arm, 0.63, -0.22],
                [arm, 0.64, 0.05],
                [arm, 0.6, 0.25],
            ],
            0.02,
        );
    }
}

fn mailbox(s: &mut MeshBuilder) {
    let blue = s.main_paint_or(&[[36, 74, 146], [36, 74, 146], [196, 40, 36], [30, 100, 70]]);
    s.set_paint(blue);
    s.block([0.0, 0.16, 0.0], [0.5, 0.8, 0.48], 0.015);
    s.lathe_along(
        [-0.25, 0.96, 0.0],
        [1.0, 0.0, 0.0],
        &[[0.22, 0.0], [0.238, 0.015], [0.238, 0.485], [0.22, 0.5]],
    );
    s.set_paint(BLACK);
    s.block([0.0, 0.955, -0.238], [0.36, 0.045, 0.012], 0.0);
    s.set_paint(STEEL);
    s.block_turned([0.0, 1.01, -0.236], [0.38, 0.02, 0.024], [20.0, 0.0, 0.0], 0.006);
    s.set_paint(blue);
    s.block([0.0, 0.26, -0.242], [0.38, 0.24, 0.012], 0.005);
    s.set_paint(WHITE);
    s.block([0.0, 0.55, -0.242], [0.3, 0.26, 0.01], 0.004);
    s.set_paint(paint(RED, Finish::Glossy));
    s.block([0.0, 0.735, -0.2475], [0.26, 0.035, 0.003], 0.0);
    s.set_paint(paint([60, 70, 90], Finish::Matte));
    for k in 0..4 {
        s.block([-0.02, 0.58 + 0.034 * k as f32, -0.2475], [0.2, 0.012, 0.003], 0.0);
    }
    s.set_paint(BRASS);
    s.ball([0.15, 0.38, -0.2485], [0.026, 0.03, 0.012]);
    s.set_paint(IRON);
    for x in [-0.2, 0.2] {
        for z in [-0.17, 0.17] {
            s.block([x, 0.0, z], [0.06, 0.17, 0.06], 0.01);
        }
    }
}

fn fence(s: &mut MeshBuilder) {
    let color =
        s.main_paint_or(&[[240, 240, 234], [240, 240, 234], [150, 110, 74], [120, 140, 130]]);
    s.set_paint(color);
    for y in [0.24, 0.68] {
        s.block([0.0, y, 0.005], [2.0, 0.09, 0.035], 0.006);
    }
    for x in [-0.96, 0.96] {
        s.block([x, 0.0, 0.01], [0.08, 0.96, 0.08], 0.008);
        s.lathe([x, 0.95, 0.01], &[[0.03, 0.0], [0.038, 0.02], [0.028, 0.04], [0.0, 0.05]]);
    }
    let tip: &[[f32; 2]] = s.pick(
        1,
        &[
            &[[0.05, 0.0], [0.05, 0.83], [0.0, 0.9], [-0.05, 0.83], [-0.05, 0.0]],
            &[
                [0.05, 0.0],
                [0.05, 0.84],
                [0.035, 0.88],
                [0.0, 0.9],
                [-0.035, 0.88],
                [-0.05, 0.84],
                [-0.05, 0.0],
            ],
            &[[0.05, 0.0], [0.05, 0.9], [-0.05, 0.9], [-0.05, 0.0]],
        ],
    );
    for k in 0..9 {
        s.cut([-0.8 + 0.2 * k as f32, 0.06, -0.025], tip, 0.025, [0.0; 3]);
    }
}
