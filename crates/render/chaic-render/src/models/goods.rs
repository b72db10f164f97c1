//! Models of portable items for work, school and the home.

use chaic_core::catalogue::Finish;

use super::Model;
use super::colors::{BLACK, BRASS, DARK_STEEL, GLOSSY_BLACK, STEEL, WHITE};
use crate::mesh_builder::{MeshBuilder, Paint, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "iphone" => iphone,
        "ipod" => ipod,
        "purse" => purse,
        "key" => key,
        "mouse" => mouse,
        "pen" => pen,
        "pencil_bucket" => pencil_bucket,
        "calculator" => calculator,
        "lighter" => lighter,
        "vase" => vase,
        _ => return None,
    })
}

/// Outline of a rounded rectangle around the origin, counter-clockwise.
fn round_rectangle<const N: usize>(width: f32, height: f32, radius: f32) -> [[f32; 2]; N] {
    use chaic_core::geom::math::{cos, sin};
    let quarter = N / 4;
    std::array::from_fn(|k| {
        let turn = (k / quarter) as f32 + (k % quarter) as f32 / (quarter - 1) as f32;
        let a = std::f32::consts::FRAC_PI_2 * turn;
        let (sx, sy) = match k / quarter {
            0 => (1.0, 1.0),
            1 => (-1.0, 1.0),
            2 => (-1.0, -1.0),
            _ => (1.0, -1.0),
        };
        [
            sx * (0.5 * width - radius) + radius * cos(a),
            sy * (0.5 * height - radius) + radius * sin(a),
        ]
    })
}

const SCREENS: [[u8; 3]; 4] = [[44, 96, 158], [120, 72, 140], [46, 120, 104], [180, 110, 70]];

fn iphone(s: &mut MeshBuilder) {
    const FLAT: [f32; 3] = [-90.0, 0.0, 0.0];
    s.set_paint(s.pick(0, &[STEEL, STEEL, paint([226, 200, 150], Finish::Metal), DARK_STEEL]));
    s.cut([0.0, 0.006, 0.0], &round_rectangle::<16>(0.095, 0.185, 0.014), 0.012, FLAT);
    s.set_paint(s.pick(0, &[GLOSSY_BLACK, paint([240, 240, 240], Finish::Glossy)]));
    s.cut([0.0, 0.0122, 0.0], &round_rectangle::<16>(0.091, 0.181, 0.012), 0.0018, FLAT);
    s.set_paint(paint(s.pick(2, &SCREENS), Finish::Glossy));
    s.block([0.0, 0.0126, -0.004], [0.082, 0.001, 0.126], 0.0);
    let icons = [
        [92, 196, 104],
        [240, 178, 62],
        [230, 232, 236],
        [214, 74, 70],
        [90, 150, 230],
        [236, 132, 60],
    ];
    for k in 0..20usize {
        let (i, j) = ((k % 4) as f32, (k / 4) as f32);
        if k / 4 == 3 && s.style.is_multiple_of(2) {
            continue;
        }
        s.set_paint(paint(icons[(k * 5 + usize::from(s.style)) % 6], Finish::Glossy));
        let z = -0.055 + 0.0255 * j;
        s.block([-0.0285 + 0.019 * i, 0.0133, z], [0.014, 0.0008, 0.015], 0.0);
    }
    s.set_paint(DARK_STEEL);
    s.lathe([0.0, 0.0128, 0.075], &[[0.009, 0.0], [0.009, 0.001], [0.006, 0.0012]]);
    s.block([0.0, 0.0128, -0.08], [0.022, 0.001, 0.004], 0.0);
    s.block([-0.0478, 0.005, -0.05], [0.0015, 0.004, 0.02], 0.0);
}

fn ipod(s: &mut MeshBuilder) {
    const COLORS: [[u8; 3]; 4] = [[238, 204, 44], [238, 204, 44], [232, 190, 30], [244, 214, 70]];
    s.set_paint(paint(s.pick(0, &COLORS), Finish::Glossy));
    s.cut([0.0, 0.099, 0.0005], &round_rectangle::<16>(0.094, 0.198, 0.012), 0.009, [0.0; 3]);
    s.set_paint(GLOSSY_BLACK);
    s.block([0.0, 0.108, -0.004], [0.078, 0.078, 0.0012], 0.0);
    s.set_paint(paint(s.pick(2, &SCREENS), Finish::Glossy));
    s.block([0.0, 0.112, -0.0045], [0.07, 0.07, 0.0008], 0.0);
    s.set_paint(WHITE);
    for k in 0..4 {
        let width = [0.05, 0.038, 0.055, 0.03][k];
        let x = -0.03 + 0.5 * width;
        s.block([x, 0.166 - 0.014 * k as f32, -0.0048], [width, 0.005, 0.0004], 0.0);
    }
    let toward = [0.0, 0.0, -1.0];
    s.lathe_along([0.0, 0.054, -0.0038], toward, &[[0.035, 0.0], [0.035, 0.0009], [0.033, 0.0012]]);
    s.set_paint(DARK_STEEL);
    for [x, y] in [[0.0, 0.079], [0.0, 0.029], [0.025, 0.054], [-0.025, 0.054]] {
        s.block([x, y - 0.002, -0.0049], [0.008, 0.004, 0.0003], 0.0);
    }
    s.set_paint(paint(s.pick(0, &COLORS), Finish::Glossy));
    s.lathe_along([0.0, 0.054, -0.004], toward, &[[0.013, 0.0], [0.013, 0.0008], [0.0, 0.001]]);
}

fn purse(s: &mut MeshBuilder) {
    const LEATHERS: [[u8; 3]; 4] = [[176, 54, 84], [60, 70, 120], [150, 96, 58], [176, 54, 84]];
    let leather = paint(s.pick(0, &LEATHERS), Finish::Fabric);
    let dark = paint(leather.color.map(|c| (0.62 * f32::from(c)) as u8), Finish::Fabric);
    s.set_paint(leather);
    // Wide at the bottom, narrow at the clasp.
    s.pillow([0.0, 0.036, 0.0], [0.254, 0.072, 0.041], [0.0; 3], 0.6);
    s.cut(
        [0.0, 0.0, 0.0],
        &[
            [-0.118, 0.012],
            [0.118, 0.012],
            [0.122, 0.036],
            [0.1, 0.079],
            [-0.1, 0.079],
            [-0.122, 0.036],
        ],
        0.026,
        [0.0; 3],
    );
    s.set_paint(BRASS);
    s.block([0.0, 0.073, 0.0], [0.2, 0.011, 0.016], 0.004);
    s.ball([-0.006, 0.083, -0.004], [0.014; 3]);
    s.ball([0.006, 0.083, 0.004], [0.014; 3]);
    s.set_paint(dark);
    s.pipe(
        &[
            [-0.066, 0.08, 0.0],
            [-0.055, 0.096, 0.0],
            [0.0, 0.104, 0.0],
            [0.055, 0.096, 0.0],
            [0.066, 0.08, 0.0],
        ],
        0.0036,
    );
    s.block([0.0, 0.024, -0.0188], [0.09, 0.024, 0.003], 0.001);
    s.set_paint(BRASS);
    s.ball([0.0, 0.034, -0.0203], [0.01, 0.01, 0.003]);
}

fn key(s: &mut MeshBuilder) {
    let metal = s.pick(0, &[BRASS, BRASS, paint([214, 178, 96], Finish::Metal), BRASS]);
    s.add_all_parts();
    s.set_paint(metal);
    for (z, x, length) in [(0.0325, 0.006, 0.012), (0.0485, 0.006, 0.01), (0.064, 0.007, 0.012)] {
        s.block([x, 0.0005, z], [length, 0.005, 0.005], 0.0);
    }
    s.hoop([-0.004, 0.003, -0.02], [0.0, 0.0, 1.0], 0.0055, 0.0018);
    s.hoop([-0.004, 0.003, -0.012], [0.0, 0.0, 1.0], 0.0052, 0.0016);
}

fn mouse(s: &mut MeshBuilder) {
    s.set_paint(BLACK);
    s.pillow([0.0, 0.009, 0.0], [0.07, 0.018, 0.126], [0.0; 3], 0.55);
    s.set_paint(s.main_paint());
    s.pillow([0.0, 0.021, 0.002], [0.074, 0.038, 0.126], [3.0, 0.0, 0.0], 0.72);
    s.set_paint(BLACK);
    s.block_turned([0.0, 0.036, -0.036], [0.0022, 0.008, 0.05], [-12.0, 0.0, 0.0], 0.0);
    s.block_turned([0.0, 0.0372, -0.006], [0.06, 0.002, 0.0022], [-2.0, 0.0, 0.0], 0.0);
    s.set_paint(STEEL);
    s.lathe_along(
        [-0.005, 0.031, -0.034],
        [1.0, 0.0, 0.0],
        &[[0.008, 0.0], [0.0105, 0.002], [0.0105, 0.008], [0.008, 0.01]],
    );
    s.ball([0.0, 0.0382, 0.026], [0.014, 0.003, 0.018]);
}

fn pen(s: &mut MeshBuilder) {
    let axis = [1.0, 0.0, 0.0];
    s.set_paint(s.main_paint());
    s.lathe_along(
        [-0.076, 0.014, 0.0],
        axis,
        &[[0.008, 0.0], [0.0115, 0.02], [0.0125, 0.06], [0.012, 0.106]],
    );
    s.set_paint(s.pick(1, &[paint([22, 24, 34], Finish::Glossy), s.main_paint()]));
    s.lathe_along(
        [0.03, 0.014, 0.0],
        axis,
        &[[0.0125, 0.0], [0.0138, 0.003], [0.0138, 0.06], [0.012, 0.072], [0.006, 0.0755]],
    );
    s.set_paint(s.pick(2, &[BRASS, STEEL]));
    s.lathe_along(
        [0.026, 0.014, 0.0],
        axis,
        &[[0.0125, 0.0], [0.014, 0.001], [0.014, 0.006], [0.0125, 0.007]],
    );
    s.lathe_along([-0.0985, 0.014, 0.0], axis, &[[0.0012, -0.006], [0.003, 0.004], [0.008, 0.023]]);
    s.block([0.075, 0.0285, 0.0], [0.062, 0.0025, 0.006], 0.001);
    s.block([0.1, 0.02, 0.0], [0.008, 0.011, 0.006], 0.0);
    s.ball([0.047, 0.0262, 0.0], [0.008, 0.005, 0.006]);
}

fn pencil_bucket(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    let wall = [
        [0.0405, 0.0],
        [0.0415, 0.003],
        [0.044, 0.098],
        [0.045, 0.1],
        [0.043, 0.102],
        [0.041, 0.098],
        [0.038, 0.006],
    ];
    s.lathe([0.0; 3], &wall);
    s.set_paint(STEEL);
    for y in [0.014, 0.08] {
        s.hoop([0.0, y, 0.0], [0.0, 1.0, 0.0], 0.0418, 0.0016);
    }
    let colors = [
        [240, 190, 40],
        [204, 44, 44],
        [42, 92, 180],
        [46, 140, 76],
        [240, 190, 40],
        [120, 70, 160],
        [230, 120, 40],
    ];
    let n = s.pick(1, &[6, 7, 5, 6]);
    for k in 0..n {
        use chaic_core::geom::math::{cos, sin};
        let a = 2.4 * k as f32 + f32::from(s.style);
        let (c, sn) = (cos(a), sin(a));
        let height = 0.17 - 0.008 * (k % 4) as f32;
        let at = |t: f32| {
            [(0.016 + 0.018 * t) * c, 0.006 + (height - 0.006) * t, (0.016 + 0.018 * t) * sn]
        };
        s.set_paint(paint(colors[(k + usize::from(s.style)) % 7], Finish::Glossy));
        s.taper(at(0.0), at(0.88), 0.0052, 0.0052);
        s.set_paint(paint([226, 188, 136], Finish::Wood));
        s.taper(at(0.88), at(0.97), 0.0052, 0.0018);
        s.set_paint(paint(colors[(k + usize::from(s.style)) % 7], Finish::Matte));
        s.taper(at(0.97), at(1.0), 0.0018, 0.0004);
    }
    s.set_paint(paint([222, 196, 120], Finish::Glossy));
    s.block_turned([0.0, 0.087, 0.0], [0.024, 0.162, 0.003], [0.0, 25.0, 6.0], 0.0);
}

fn calculator(s: &mut MeshBuilder) {
    const BODIES: [[u8; 3]; 4] = [[62, 64, 70], [200, 202, 206], [62, 64, 70], [70, 84, 110]];
    s.set_paint(paint(s.pick(0, &BODIES), Finish::Matte));
    s.block([0.0, 0.0, 0.0], [0.1, 0.022, 0.132], 0.006);
    s.set_paint(BLACK);
    s.block([0.0, 0.018, -0.043], [0.094, 0.011, 0.042], 0.003);
    s.set_paint(paint([162, 186, 150], Finish::Glossy));
    s.block([0.0, 0.0285, -0.044], [0.084, 0.002, 0.026], 0.0);
    s.set_paint(BLACK);
    for k in 0..6 {
        let x = 0.034 - 0.0115 * k as f32;
        for (dx, dz, w, d) in
            [(-0.003, 0.0, 0.0014, 0.014), (0.003, 0.0, 0.0014, 0.014), (0.0, 0.006, 0.006, 0.0016)]
        {
            if (k + usize::from(s.style)) % 3 != 1 || dx > 0.0 {
                s.block([x + dx, 0.0304, -0.044 + dz], [w, 0.0005, d], 0.0);
            }
        }
    }
    let keys: [Paint; 3] =
        [WHITE, paint([232, 128, 44], Finish::Matte), paint([150, 154, 162], Finish::Matte)];
    for k in 0..20usize {
        let (i, j) = (k % 4, k / 4);
        s.set_paint(
            keys[if i == 3 {
                1
            } else if j == 0 {
                2
            } else {
                0
            }],
        );
        let z = -0.012 + 0.0166 * j as f32;
        s.block([-0.033 + 0.022 * i as f32, 0.02, z], [0.017, 0.0065, 0.0115], 0.0022);
    }
}

fn lighter(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    s.pillow([0.0, 0.057, 0.0], [0.02, 0.114, 0.045], [0.0; 3], 0.3);
    s.set_paint(STEEL);
    s.block([0.0, 0.112, 0.0], [0.018, 0.027, 0.041], 0.004);
    s.block([0.0, 0.137, 0.011], [0.016, 0.0235, 0.016], 0.003);
    s.set_paint(DARK_STEEL);
    s.lathe_along(
        [-0.006, 0.146, -0.006],
        [1.0, 0.0, 0.0],
        &[[0.0085, 0.0], [0.0095, 0.002], [0.0095, 0.01], [0.0085, 0.012]],
    );
    s.set_paint(BLACK);
    s.block_turned([0.0, 0.141, -0.017], [0.014, 0.006, 0.01], [20.0, 0.0, 0.0], 0.002);
    for k in 0..3 {
        s.block([0.0, 0.119 + 0.005 * k as f32, -0.0206], [0.008, 0.002, 0.001], 0.0);
    }
}

fn vase(s: &mut MeshBuilder) {
    let glaze = paint(s.pick(1, &[[56, 92, 160], [150, 60, 50], [50, 110, 90]]), Finish::Glossy);
    s.set_paint(s.main_paint());
    let outline = [
        [0.038, 0.003],
        [0.04, 0.022],
        [0.056, 0.044],
        [0.0715, 0.075],
        [0.066, 0.108],
        [0.05, 0.132],
        [0.037, 0.15],
        [0.032, 0.17],
        [0.034, 0.188],
        [0.044, 0.207],
        [0.0435, 0.211],
        [0.04, 0.207],
        [0.029, 0.188],
        [0.027, 0.168],
        [0.02, 0.15],
    ];
    s.lathe([0.0; 3], &outline);
    s.set_paint(glaze);
    s.lathe([0.0; 3], &[[0.042, 0.0], [0.042, 0.01], [0.0385, 0.024]]);
    s.hoop([0.0, 0.209, 0.0], [0.0, 1.0, 0.0], 0.0418, 0.0024);
    for (y, r) in [(0.062, 0.0665), (0.108, 0.0655), (0.149, 0.037)] {
        s.hoop([0.0, y, 0.0], [0.0, 1.0, 0.0], r, 0.0022);
    }
    // A garland around the widest part.
    let n = if s.is_level_within(20.0) { 6 } else { 12 };
    for k in 0..n {
        use chaic_core::geom::math::{cos, sin};
        let a = std::f32::consts::TAU * k as f32 / n as f32;
        let y = 0.084 + if k % 2 == 0 { 0.005 } else { -0.004 };
        let size =
            if s.style.is_multiple_of(2) { [0.018, 0.012, 0.005] } else { [0.01, 0.02, 0.005] };
        s.ball_turned([0.0695 * sin(a), y, 0.0695 * cos(a)], size, [0.0, a.to_degrees(), 30.0]);
    }
}
