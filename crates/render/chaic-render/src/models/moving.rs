//! Models of the furniture that is carried to the truck in the moving task.

use chaic_core::catalogue::Finish;

use super::Model;
use super::colors::{BLACK, BRASS, DARK_STEEL, GAP, GLASS, GLOSSY_BLACK, STEEL, WALNUT, WHITE};
use super::furniture::sofa_on;
use crate::mesh_builder::{MeshBuilder, Paint, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "backpack" => backpack,
        "kettle" => kettle,
        "navy_chair" => navy_chair,
        "wood_shelving" => wood_shelving,
        "printer" => printer,
        "table" => table,
        "television" => television,
        "microwave" => microwave,
        "dishwasher" => dishwasher,
        "drawer" => drawer,
        "piano" => piano,
        "sofa" => sofa,
        _ => return None,
    })
}

fn backpack(s: &mut MeshBuilder) {
    let strap = paint([38, 40, 46], Finish::Fabric);
    let pocket = paint(s.pick(1, &[[72, 78, 88], [58, 62, 70], [110, 96, 70]]), Finish::Fabric);
    s.set_paint(s.main_paint());
    s.pillow([0.0, 0.295, 0.03], [0.34, 0.58, 0.27], [0.0; 3], 0.55);
    s.set_paint(pocket);
    s.pillow([0.0, 0.1, 0.02], [0.35, 0.2, 0.29], [0.0; 3], 0.5);
    s.pillow([0.0, 0.18, -0.13], [0.26, 0.26, 0.16], [0.0; 3], 0.45);
    s.pillow([0.0, 0.42, -0.115], [0.2, 0.14, 0.08], [0.0; 3], 0.5);
    for x in [-0.15, 0.15] {
        s.pillow([x, 0.15, 0.03], [0.07, 0.2, 0.16], [0.0; 3], 0.5);
    }
    s.set_paint(BRASS);
    s.pipe(
        &[
            [-0.115, 0.21, -0.168],
            [-0.07, 0.252, -0.198],
            [0.0, 0.262, -0.207],
            [0.07, 0.252, -0.198],
            [0.115, 0.21, -0.168],
        ],
        0.005,
    );
    s.block([0.07, 0.215, -0.207], [0.012, 0.035, 0.008], 0.002);
    s.pipe(
        &[
            [-0.15, 0.38, -0.075],
            [-0.11, 0.52, -0.06],
            [0.0, 0.56, -0.045],
            [0.11, 0.52, -0.06],
            [0.15, 0.38, -0.075],
        ],
        0.006,
    );
    s.set_paint(strap);
    s.pipe(
        &[[-0.05, 0.565, 0.07], [-0.04, 0.6, 0.07], [0.04, 0.6, 0.07], [0.05, 0.565, 0.07]],
        0.011,
    );
    for x in [-0.09, 0.09] {
        s.pipe(
            &[
                [x, 0.52, 0.13],
                [x, 0.46, 0.2],
                [1.15 * x, 0.3, 0.212],
                [1.25 * x, 0.14, 0.19],
                [1.2 * x, 0.07, 0.13],
            ],
            0.018,
        );
    }
    for y in [0.3, 0.08] {
        s.block([0.0, y, -0.212], [0.05, 0.016, 0.006], 0.0);
    }
}

fn kettle(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    let outline = [
        [0.15, 0.004],
        [0.168, 0.02],
        [0.166, 0.06],
        [0.15, 0.12],
        [0.128, 0.168],
        [0.11, 0.19],
        [0.1, 0.194],
    ];
    s.lathe([0.0, 0.0, 0.02], &outline);
    s.lathe(
        [0.0, 0.19, 0.02],
        &[[0.1, 0.0], [0.098, 0.008], [0.07, 0.022], [0.03, 0.029], [0.0, 0.03]],
    );
    s.curve(&[
        ([0.0, 0.09, -0.11], 0.032),
        ([0.0, 0.14, -0.14], 0.024),
        ([0.0, 0.19, -0.162], 0.018),
        ([0.0, 0.215, -0.176], 0.014),
    ]);
    s.set_paint(DARK_STEEL);
    s.lathe([0.0, 0.0, 0.02], &[[0.145, 0.0], [0.169, 0.003], [0.17, 0.014], [0.166, 0.017]]);
    s.hoop([0.0, 0.192, 0.02], [0.0, 1.0, 0.0], 0.104, 0.004);
    s.set_paint(BLACK);
    s.lathe(
        [0.0, 0.215, 0.02],
        &[[0.009, 0.0], [0.008, 0.014], [0.019, 0.022], [0.02, 0.032], [0.0, 0.04]],
    );
    s.pipe(
        &[
            [0.0, 0.165, 0.145],
            [0.0, 0.27, 0.152],
            [0.0, 0.345, 0.1],
            [0.0, 0.356, 0.02],
            [0.0, 0.345, -0.06],
            [0.0, 0.27, -0.105],
            [0.0, 0.175, -0.1],
        ],
        0.012,
    );
}

fn navy_chair(s: &mut MeshBuilder) {
    let metal =
        s.main_paint_or(&[[198, 200, 203], [198, 200, 203], [176, 180, 186], [150, 154, 160]]);
    s.set_paint(metal);
    s.pillow([0.0, 0.453, -0.02], [0.41, 0.028, 0.44], [0.0; 3], 0.3);
    for x in [-0.185, 0.185] {
        s.curve(&[
            ([x, 0.0, -0.215], 0.013),
            ([x, 0.2, -0.212], 0.015),
            ([x, 0.45, -0.205], 0.016),
        ]);
        s.curve(&[
            ([x, 0.0, 0.222], 0.013),
            ([x, 0.44, 0.2], 0.016),
            ([x, 0.7, 0.215], 0.016),
            ([x, 0.845, 0.228], 0.014),
        ]);
        s.rod([x, 0.24, -0.21], [x, 0.24, 0.21], 0.01);
    }
    s.rod([-0.185, 0.2, -0.212], [0.185, 0.2, -0.212], 0.01);
    s.rod([-0.185, 0.2, 0.21], [0.185, 0.2, 0.21], 0.01);
    for x in [-0.09, 0.0, 0.09] {
        s.block_turned([x, 0.63, 0.216], [0.034, 0.36, 0.012], [3.0, 0.0, 0.0], 0.004);
    }
    s.pillow([0.0, 0.82, 0.226], [0.42, 0.075, 0.026], [3.0, 0.0, 0.0], 0.35);
}

fn wood_shelving(s: &mut MeshBuilder) {
    const WOODS: [[[u8; 3]; 2]; 4] = [
        [[206, 168, 112], [184, 144, 90]],
        [[206, 168, 112], [184, 144, 90]],
        [[222, 188, 138], [204, 164, 112]],
        [[176, 130, 82], [150, 106, 64]],
    ];
    let [board, post] = s.pick(0, &WOODS).map(|c| paint(c, Finish::Wood));
    for (k, part) in s.class.parts.iter().enumerate() {
        s.set_paint(if k < 3 { board } else { post });
        s.add_part_shape(part);
    }
    s.set_paint(post);
    for x in [-0.14, 0.14] {
        s.block_turned([x, 0.49, 0.0], [0.01, 0.03, 0.98], [42.0, 0.0, 0.0], 0.003);
    }
    s.set_paint(DARK_STEEL);
    for x in [-0.156, 0.156] {
        for z in [-0.36, 0.36] {
            for y in [0.325, 0.645, 0.965] {
                s.ball([x * 0.99, y, z], [0.006, 0.012, 0.012]);
            }
        }
    }
}

fn printer(s: &mut MeshBuilder) {
    let body = s.main_paint_or(&[[188, 190, 194], [214, 214, 210], [188, 190, 194], [70, 72, 78]]);
    let dark = paint([66, 70, 76], Finish::Matte);
    s.set_paint(body);
    s.block([0.0, 0.0, 0.03], [0.5, 0.25, 0.33], 0.014);
    s.set_paint(dark);
    s.block([0.0, 0.25, 0.03], [0.48, 0.06, 0.31], 0.014);
    s.set_paint(GAP);
    s.block([0.0, 0.247, 0.03], [0.494, 0.005, 0.324], 0.0);
    s.block([0.0, 0.085, -0.133], [0.36, 0.09, 0.008], 0.0);
    s.add_parts(&[3, 4, 5, 6]);
    s.set_paint(WHITE);
    s.block([0.01, 0.086, -0.148], [0.21, 0.004, 0.09], 0.0);
    s.set_paint(GLASS);
    s.block([-0.17, 0.2, -0.138], [0.09, 0.036, 0.006], 0.002);
    for (k, color) in
        [[60, 170, 90], [220, 220, 224], [220, 220, 224], [210, 70, 60]].into_iter().enumerate()
    {
        s.set_paint(paint(color, Finish::Glossy));
        s.ball_turned([-0.1 + 0.03 * k as f32, 0.218, -0.137], [0.018, 0.018, 0.008], [0.0; 3]);
    }
    s.set_paint(dark);
    s.block([0.0, 0.02, -0.137], [0.46, 0.045, 0.008], 0.003);
    s.set_paint(body);
    s.block([0.0, 0.038, -0.141], [0.08, 0.01, 0.006], 0.002);
}

fn table(s: &mut MeshBuilder) {
    let wood = s.main_paint_or(&[[124, 80, 56], [124, 80, 56], [166, 118, 76], [92, 60, 44]]);
    s.set_paint(wood);
    s.block([0.0, 0.475, 0.0], [0.76, 0.035, 0.76], 0.01);
    for x in [-0.335, 0.335] {
        for z in [-0.335, 0.335] {
            match s.pick(1, &[0, 1, 2]) {
                0 => s.taper([x, 0.0, z], [x, 0.476, z], 0.018, 0.03),
                1 => s.lathe(
                    [x, 0.0, z],
                    &[
                        [0.018, 0.0],
                        [0.022, 0.03],
                        [0.016, 0.06],
                        [0.028, 0.2],
                        [0.022, 0.3],
                        [0.03, 0.34],
                        [0.03, 0.476],
                    ],
                ),
                _ => s.block([x, 0.0, z], [0.055, 0.476, 0.055], 0.008),
            }
        }
    }
    for k in [5, 6, 7, 8] {
        s.set_paint(wood);
        let part = s.class.parts[k];
        s.add_part_shape(&part);
    }
}

fn television(s: &mut MeshBuilder) {
    let case = s.main_paint_or(&[[54, 54, 58], [54, 54, 58], [96, 70, 52], [120, 122, 126]]);
    s.set_paint(case);
    s.block([0.0, 0.02, -0.13], [0.83, 0.53, 0.25], 0.02);
    s.set_paint(BLACK);
    s.pillow([0.0, 0.26, 0.085], [0.64, 0.42, 0.22], [0.0; 3], 0.3);
    s.pillow([0.0, 0.24, 0.215], [0.44, 0.3, 0.09], [0.0; 3], 0.3);
    s.block([0.0, 0.0, -0.02], [0.6, 0.05, 0.42], 0.01);
    s.set_paint(GLOSSY_BLACK);
    s.block([0.05, 0.075, -0.251], [0.66, 0.44, 0.014], 0.006);
    s.set_paint(paint([60, 84, 98], Finish::Glass));
    s.pillow([0.05, 0.295, -0.2495], [0.61, 0.4, 0.018], [0.0; 3], 0.22);
    s.set_paint(STEEL);
    for y in [0.478, 0.398] {
        s.lathe_along(
            [-0.345, y, -0.25],
            [0.0, 0.0, -1.0],
            &[[0.03, -0.004], [0.03, 0.003], [0.024, 0.004], [0.02, 0.0098]],
        );
    }
    s.set_paint(BLACK);
    for k in 0..9 {
        s.block([-0.345, 0.1 + 0.021 * k as f32, -0.2545], [0.07, 0.01, 0.006], 0.0);
    }
    s.set_paint(paint([200, 60, 50], Finish::Glossy));
    s.ball([-0.345, 0.325, -0.256], [0.014, 0.014, 0.006]);
    if s.style % 2 == 1 {
        s.set_paint(STEEL);
        for lean in [-0.22, 0.22] {
            s.taper([0.0, 0.5, -0.05], [lean, 0.545, -0.05], 0.004, 0.003);
        }
    }
}

fn microwave(s: &mut MeshBuilder) {
    let case = s.main_paint_or(&[STEEL.color, STEEL.color, [226, 226, 222], [64, 66, 70]]);
    s.set_paint(case);
    s.block([0.0, 0.015, 0.02], [0.76, 0.425, 0.4], 0.014);
    s.add_parts(&[1]);
    s.set_paint(DARK_STEEL);
    s.block([0.09, 0.045, -0.187], [0.54, 0.365, 0.022], 0.008);
    s.set_paint(GLASS);
    s.block([0.115, 0.085, -0.193], [0.42, 0.285, 0.016], 0.006);
    s.set_paint(BLACK);
    s.block([-0.28, 0.045, -0.187], [0.17, 0.365, 0.022], 0.006);
    s.set_paint(STEEL);
    s.rod([-0.14, 0.085, -0.207], [-0.14, 0.37, -0.207], 0.011);
    for y in [0.1, 0.355] {
        s.rod([-0.14, y, -0.195], [-0.14, y, -0.208], 0.008);
    }
    s.set_paint(paint([40, 60, 52], Finish::Glossy));
    s.block([-0.28, 0.335, -0.196], [0.13, 0.05, 0.012], 0.003);
    s.set_paint(paint([86, 226, 160], Finish::Glossy));
    for (k, x) in [-0.035, -0.012, 0.018, 0.041].into_iter().enumerate() {
        s.block([-0.28 + x, 0.345, -0.203], [0.006 + 0.003 * (k % 2) as f32, 0.03, 0.002], 0.0);
    }
    s.set_paint(paint([176, 180, 184], Finish::Matte));
    for k in 0..12 {
        let (i, j) = ((k % 3) as f32, (k / 3) as f32);
        s.block([-0.323 + 0.043 * i, 0.28 - 0.036 * j, -0.2], [0.034, 0.024, 0.006], 0.003);
    }
    s.set_paint(STEEL);
    s.lathe_along(
        [-0.28, 0.1, -0.19],
        [0.0, 0.0, -1.0],
        &[[0.034, 0.0], [0.034, 0.008], [0.028, 0.014], [0.026, 0.018]],
    );
    s.set_paint(GAP);
    for k in 0..8 {
        for x in [-0.381, 0.381] {
            s.block([x * 0.998, 0.3, 0.02 + 0.02 * k as f32], [0.002, 0.07, 0.008], 0.0);
        }
    }
}

fn dishwasher(s: &mut MeshBuilder) {
    let front = s.pick(0, &[STEEL, paint([232, 232, 228], Finish::Glossy), STEEL, DARK_STEEL]);
    s.add_parts(&[0, 1]);
    s.set_paint(front);
    s.block([0.0, 0.08, -0.255], [0.51, 0.5, 0.03], 0.008);
    s.set_paint(DARK_STEEL);
    s.block([0.0, 0.59, -0.255], [0.51, 0.11, 0.03], 0.008);
    s.set_paint(GAP);
    s.block([0.0, 0.579, -0.25], [0.505, 0.012, 0.03], 0.0);
    s.set_paint(STEEL);
    s.rod([-0.2, 0.545, -0.283], [0.2, 0.545, -0.283], 0.011);
    for x in [-0.17, 0.17] {
        s.rod([x, 0.545, -0.265], [x, 0.545, -0.284], 0.009);
    }
    s.set_paint(paint([86, 190, 220], Finish::Glossy));
    s.block([-0.16, 0.625, -0.265], [0.11, 0.04, 0.014], 0.003);
    s.add_parts(&[6, 7, 8]);
    s.set_paint(WHITE);
    s.block([0.02, 0.64, -0.272], [0.03, 0.012, 0.004], 0.0);
    s.block([-0.03, 0.64, -0.272], [0.03, 0.012, 0.004], 0.0);
}

fn drawer(s: &mut MeshBuilder) {
    const WOODS: [[[u8; 3]; 2]; 4] = [
        [[200, 146, 88], [216, 166, 106]],
        [[200, 146, 88], [216, 166, 106]],
        [[150, 100, 62], [170, 116, 74]],
        [[200, 146, 88], [238, 234, 224]],
    ];
    let [wood, front] = s.pick(0, &WOODS).map(|c| paint(c, Finish::Wood));
    s.set_paint(wood);
    s.block([0.0, 0.05, 0.02], [0.47, 0.65, 0.45], 0.005);
    s.set_paint(GAP);
    s.block([0.0, 0.075, -0.204], [0.444, 0.615, 0.008], 0.0);
    s.add_parts(&[1, 2]);
    for y in [0.09, 0.295, 0.5] {
        s.set_paint(front);
        s.block([0.0, y, -0.212], [0.43, 0.185, 0.02], 0.005);
        s.block([0.0, y + 0.025, -0.2235], [0.37, 0.135, 0.006], 0.004);
        s.set_paint(s.pick(1, &[BRASS, BRASS, DARK_STEEL]));
        if s.style.is_multiple_of(2) {
            s.lathe_along(
                [0.0, y + 0.09, -0.225],
                [0.0, 0.0, -1.0],
                &[[0.009, 0.0], [0.008, 0.012], [0.018, 0.018], [0.017, 0.026], [0.0, 0.03]],
            );
        } else {
            s.pipe(
                &[
                    [-0.06, y + 0.1, -0.224],
                    [-0.055, y + 0.098, -0.244],
                    [0.055, y + 0.098, -0.244],
                    [0.06, y + 0.1, -0.224],
                ],
                0.007,
            );
        }
    }
}

fn piano(s: &mut MeshBuilder) {
    let lacquer = s.main_paint_or(&[
        GLOSSY_BLACK.color,
        GLOSSY_BLACK.color,
        [70, 34, 24],
        GLOSSY_BLACK.color,
    ]);
    let ivory = paint([244, 240, 226], Finish::Glossy);
    s.set_paint(lacquer);
    s.block([0.0, 0.4, -0.13], [1.11, 0.2, 0.36], 0.012);
    s.add_part_shape(&s.class.parts[1]);
    s.block([0.0, 0.42, -0.37], [1.11, 0.08, 0.165], 0.012);
    for x in [-0.52, 0.52] {
        s.block([x, 0.48, -0.37], [0.07, 0.09, 0.165], 0.014);
    }
    for (x, z) in [(-0.46, -0.2), (0.46, -0.2), (0.16, 0.33)] {
        s.set_paint(lacquer);
        s.lathe(
            [x, 0.03, z],
            &[[0.018, 0.0], [0.024, 0.01], [0.022, 0.15], [0.034, 0.3], [0.035, 0.375]],
        );
        s.set_paint(BRASS);
        s.ball([x, 0.0, z], [0.036, 0.036, 0.036]);
    }
    s.set_paint(ivory);
    s.block([0.0, 0.497, -0.385], [0.97, 0.025, 0.13], 0.004);
    s.set_paint(GAP);
    if !s.is_level_within(20.0) {
        for k in 1..36 {
            let x = -0.485 + 0.97 * k as f32 / 36.0;
            s.block([x, 0.5215, -0.385], [0.002, 0.0011, 0.13], 0.0);
        }
    }
    s.set_paint(GLOSSY_BLACK);
    for k in (1..36).filter(|k| ![0, 3].contains(&(k % 7))) {
        let x = -0.485 + 0.97 * k as f32 / 36.0;
        s.block([x, 0.522, -0.357], [0.014, 0.011, 0.074], 0.003);
    }
    s.add_parts(&[12, 13, 15]);
    s.set_paint(lacquer);
    s.add_part_shape(&s.class.parts[14]);
    // The sheet music on its stand, and the pedals.
    s.set_paint(WHITE);
    s.block_turned([0.0, 0.668, -0.114], [0.22, 0.11, 0.004], [12.0, 0.0, 0.0], 0.0);
    s.set_paint(BLACK);
    for k in 0..4 {
        let y = 0.635 + 0.022 * k as f32;
        s.block_turned(
            [0.0, y, -0.1165 + 0.21 * (y - 0.668)],
            [0.19, 0.004, 0.002],
            [12.0, 0.0, 0.0],
            0.0,
        );
    }
    s.set_paint(lacquer);
    s.block([0.0, 0.05, -0.13], [0.16, 0.05, 0.04], 0.008);
    s.rod([-0.05, 0.08, -0.13], [-0.05, 0.41, -0.12], 0.008);
    s.rod([0.05, 0.08, -0.13], [0.05, 0.41, -0.12], 0.008);
    s.set_paint(BRASS);
    for x in [-0.045, 0.0, 0.045] {
        s.block([x, 0.055, -0.175], [0.022, 0.01, 0.07], 0.004);
    }
}

fn sofa(s: &mut MeshBuilder) {
    const FABRICS: [[[u8; 3]; 2]; 4] = [
        [[172, 160, 150], [142, 130, 120]],
        [[172, 160, 150], [142, 130, 120]],
        [[126, 138, 150], [100, 112, 126]],
        [[166, 120, 96], [136, 94, 74]],
    ];
    let [seat, frame]: [Paint; 2] = s.pick(0, &FABRICS).map(|c| paint(c, Finish::Fabric));
    sofa_on(s, seat, frame, 2);
    s.set_paint(WALNUT);
    for x in [-0.56, 0.56] {
        for z in [-0.26, 0.26] {
            s.taper([x, 0.0, z], [x, 0.035, z], 0.018, 0.024);
        }
    }
}
