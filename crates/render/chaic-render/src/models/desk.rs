//! Models of further items on desks and shelves and in children's rooms, in the houses of the
//! original.

use chaic_core::catalogue::Finish;
use chaic_core::geom::math::{cos, sin};

use super::Model;
use super::colors::{BLACK, BRASS, DARK_STEEL, GAP, GLOSSY_BLACK, PAPER, STEEL, WALNUT, WHITE};
use crate::mesh_builder::{MeshBuilder, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "baking_sheet" => baking_sheet,
        "notepad" => notepad,
        "laptop" => laptop,
        "headphones" => headphones,
        "globe" => globe,
        "sculpture" => sculpture,
        "toy_horse" => toy_horse,
        "puzzle_box" => puzzle_box,
        _ => return None,
    })
}

fn baking_sheet(s: &mut MeshBuilder) {
    s.add_all_parts();
    s.set_paint(DARK_STEEL);
    s.block([0.0, 0.004, 0.0], [0.57, 0.0035, 0.325], 0.0);
    if s.style % 2 == 1 {
        s.set_paint(paint([206, 160, 100], Finish::Crust));
        for k in 0..12 {
            let (i, j) = ((k % 4) as f32, (k / 4) as f32);
            s.ball([-0.2 + 0.133 * i, 0.006, -0.1 + 0.1 * j], [0.07, 0.009, 0.07]);
        }
    }
}

fn notepad(s: &mut MeshBuilder) {
    s.set_paint(PAPER);
    s.block([0.0, 0.0, 0.0], [0.114, 0.046, 0.114], 0.002);
    if !s.is_level_within(20.0) {
        s.set_paint(paint([206, 204, 196], Finish::Matte));
        for k in 0..6 {
            s.block([0.0, 0.006 + 0.007 * k as f32, 0.0], [0.1144, 0.001, 0.1144], 0.0);
        }
    }
    let cover = s.pick(0, &[[246, 224, 120], [246, 224, 120], [160, 210, 230], [240, 170, 180]]);
    s.set_paint(paint(cover, Finish::Matte));
    s.block([0.0, 0.046, 0.0], [0.11, 0.005, 0.11], 0.001);
    s.set_paint(paint([70, 80, 120], Finish::Matte));
    for k in 0..4 {
        s.block(
            [-0.01 * (k % 2) as f32, 0.051, -0.035 + 0.02 * k as f32],
            [0.08, 0.0006, 0.004],
            0.0,
        );
    }
}

fn laptop(s: &mut MeshBuilder) {
    let case = s.main_paint_or(&[STEEL.color, STEEL.color, [70, 72, 78], [214, 190, 170]]);
    s.set_paint(case);
    s.block([0.0, 0.0, -0.02], [0.313, 0.016, 0.215], 0.004);
    s.block([0.0, 0.014, 0.11], [0.313, 0.26, 0.012], 0.004);
    s.set_paint(GLOSSY_BLACK);
    s.block([0.0, 0.025, 0.1025], [0.3, 0.24, 0.006], 0.0);
    s.set_paint(paint(
        s.pick(2, &[[70, 130, 190], [90, 150, 120], [140, 100, 170]]),
        Finish::Glossy,
    ));
    s.block([0.0, 0.035, 0.0993], [0.282, 0.21, 0.002], 0.0);
    s.set_paint(WHITE);
    s.block([-0.05, 0.08, 0.098], [0.15, 0.13, 0.001], 0.0);
    s.set_paint(paint([60, 70, 90], Finish::Matte));
    for k in 0..5 {
        s.block([-0.06, 0.1 + 0.02 * k as f32, 0.0972], [0.1, 0.006, 0.001], 0.0);
    }
    s.set_paint(BLACK);
    for k in 0..48 {
        let (i, j) = ((k % 12) as f32, (k / 12) as f32);
        s.block([-0.126 + 0.0229 * i, 0.0155, -0.03 + 0.024 * j], [0.019, 0.002, 0.019], 0.0);
    }
    s.set_paint(paint(case.color.map(|c| (0.8 * f32::from(c)) as u8), Finish::Glossy));
    s.block([0.0, 0.0156, -0.09], [0.1, 0.001, 0.055], 0.0);
    s.set_paint(BLACK);
    s.rod([-0.12, 0.014, 0.1], [0.12, 0.014, 0.1], 0.005);
}

fn headphones(s: &mut MeshBuilder) {
    let shell =
        s.main_paint_or(&[GLOSSY_BLACK.color, GLOSSY_BLACK.color, [226, 226, 222], [170, 40, 44]]);
    s.set_paint(shell);
    for side in [-1.0, 1.0] {
        s.lathe_along(
            [0.1 * side, 0.06, 0.0],
            [side, 0.0, 0.0],
            &[[0.04, 0.0], [0.048, 0.006], [0.046, 0.02], [0.03, 0.028], [0.0, 0.03]],
        );
        s.set_paint(DARK_STEEL);
        s.rod([0.11 * side, 0.09, 0.0], [0.114 * side, 0.14, 0.0], 0.006);
        s.set_paint(BLACK);
        s.hoop([0.088 * side, 0.06, 0.0], [1.0, 0.0, 0.0], 0.034, 0.014);
        s.set_paint(shell);
    }
    let arch: [[f32; 3]; 9] = std::array::from_fn(|k| {
        let a = std::f32::consts::PI * k as f32 / 8.0;
        [0.114 * cos(a), 0.125 + 0.107 * sin(a), 0.0]
    });
    s.pipe(&arch, 0.011);
    s.set_paint(BLACK);
    s.pipe(&arch[2..7].iter().map(|p| [0.93 * p[0], p[1] - 0.008, 0.0]).collect::<Vec<_>>(), 0.012);
}

fn globe(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint_or(&[
        [120, 156, 190],
        [120, 156, 190],
        [90, 140, 180],
        [204, 186, 150],
    ]));
    s.ball([0.0, 0.05, 0.0], [0.142; 3]);
    // Continents at approximate positions.
    s.set_paint(paint([110, 150, 84], Finish::Matte));
    for [lon, lat, width, height] in [
        [0.3, 0.7, 0.09, 0.06],
        [0.9, 0.5, 0.1, 0.07],
        [0.2, 0.0, 0.06, 0.07],
        [2.3, -0.4, 0.05, 0.03],
        [-1.6, 0.7, 0.08, 0.06],
        [-1.0, -0.3, 0.045, 0.08],
        [1.7, 0.8, 0.09, 0.05],
        [3.6, 0.75, 0.08, 0.05],
    ] {
        let (r, y) = (0.067 * cos(lat), 0.121 + 0.067 * sin(lat));
        let turn = [-lat.to_degrees(), lon.to_degrees(), 0.0];
        s.ball_turned([r * sin(lon), y, r * cos(lon)], [width * 0.7, height * 0.8, 0.0125], turn);
    }
    s.set_paint(BRASS);
    let arch: [[f32; 3]; 9] = std::array::from_fn(|k| {
        let a = (-80.0 + 170.0 * k as f32 / 8.0).to_radians();
        [0.0735 * cos(a), 0.121 + 0.0725 * sin(a), 0.0]
    });
    s.pipe(&arch, 0.0035);
    s.rod([0.0, 0.01, 0.0], [0.0, 0.055, 0.0], 0.008);
    s.set_paint(WALNUT);
    s.lathe(
        [0.0; 3],
        &[[0.048, 0.0], [0.05, 0.006], [0.035, 0.012], [0.014, 0.022], [0.01, 0.035]],
    );
}

fn sculpture(s: &mut MeshBuilder) {
    s.set_paint(BLACK);
    s.block([0.0, 0.0, 0.0], [0.024, 0.006, 0.024], 0.001);
    s.set_paint(paint(s.pick(1, &[[128, 92, 62], [196, 196, 190], [90, 110, 96]]), Finish::Metal));
    s.pillow([0.0, 0.014, 0.0], [0.016, 0.016, 0.012], [0.0, 0.0, 20.0], 0.8);
    s.ball([0.003, 0.0195, 0.0], [0.01, 0.0105, 0.01]);
    s.hoop([0.0, 0.018, 0.0], [0.4, 1.0, 0.2], 0.0125, 0.0022);
}

fn toy_horse(s: &mut MeshBuilder) {
    let rocker = s.pick(
        1,
        &[WALNUT, paint([176, 60, 54], Finish::Wood), paint([70, 110, 150], Finish::Wood)],
    );
    s.set_paint(s.main_paint());
    s.pillow([0.02, 0.31, 0.0], [0.5, 0.19, 0.17], [0.0; 3], 0.8);
    s.curve(&[
        ([-0.16, 0.34, 0.0], 0.075),
        ([-0.25, 0.43, 0.0], 0.055),
        ([-0.29, 0.485, 0.0], 0.048),
    ]);
    s.pillow([-0.335, 0.475, 0.0], [0.2, 0.1, 0.085], [0.0, 0.0, 28.0], 0.75);
    for z in [-0.03, 0.03] {
        s.taper([-0.275, 0.51, z], [-0.265, 0.55, 1.2 * z], 0.014, 0.003);
        for (x, lean) in [(-0.14, -0.07), (0.18, 0.07)] {
            s.taper([x, 0.28, 2.0 * z], [x + lean, 0.045, 3.5 * z], 0.035, 0.02);
        }
    }
    s.set_paint(rocker);
    for z in [-0.11, 0.11] {
        s.pipe(
            &[
                [-0.46, 0.075, z],
                [-0.3, 0.035, z],
                [0.0, 0.02, z],
                [0.3, 0.035, z],
                [0.46, 0.075, z],
            ],
            0.0185,
        );
    }
    for x in [-0.24, 0.24] {
        s.rod([x, 0.035, -0.11], [x, 0.035, 0.11], 0.014);
    }
    s.pillow([0.02, 0.395, 0.0], [0.2, 0.04, 0.16], [0.0; 3], 0.5);
    s.set_paint(paint([70, 50, 36], Finish::Fabric));
    for k in 0..5 {
        let t = k as f32 / 4.0;
        s.ball_turned([-0.16 - 0.1 * t, 0.41 + 0.1 * t, 0.0], [0.05, 0.06, 0.03], [0.0; 3]);
    }
    s.curve(&[([0.25, 0.34, 0.0], 0.02), ([0.32, 0.28, 0.0], 0.024), ([0.33, 0.19, 0.0], 0.008)]);
    s.rod([-0.27, 0.43, -0.1], [-0.27, 0.43, 0.1], 0.01);
    s.set_paint(GLOSSY_BLACK);
    for z in [-0.037, 0.037] {
        s.ball([-0.325, 0.485, z], [0.018; 3]);
    }
}

fn puzzle_box(s: &mut MeshBuilder) {
    s.add_all_parts();
    let colors = [[200, 60, 50], [60, 110, 170], [230, 190, 70], [80, 150, 90]];
    for k in 0..8 {
        s.set_paint(paint(colors[(k + usize::from(s.style)) % 4], Finish::Matte));
        let x = -0.1 + 0.066 * (k % 4) as f32;
        let z = if k < 4 { -0.1695 } else { 0.1695 };
        s.block([x, 0.03, z], [0.045, 0.045, 0.005], 0.002);
    }
    for z in [-0.1, 0.0, 0.1] {
        s.set_paint(paint(colors[((z * 10.0) as i32 + 4) as usize % 4], Finish::Matte));
        for x in [-0.139, 0.139] {
            s.lathe_along(
                [x * 0.99, 0.07, z],
                [if x < 0.0 { -1.0 } else { 1.0 }, 0.0, 0.0],
                &[[0.03, 0.0], [0.03, 0.002]],
            );
        }
    }
    s.set_paint(GAP);
    s.block([0.0, 0.114, 0.0], [0.2804, 0.003, 0.3404], 0.0);
}
