//! Models of further decoration and furniture in the houses of the original.

use chaic_core::catalogue::Finish;
use chaic_core::geom::math::{cos, sin};

use super::Model;
use super::colors::{BLACK, BRASS, GAP, LAMP, LEAF, STEEL, WALNUT, WHITE};
use crate::mesh_builder::{MeshBuilder, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "table_lamp" => table_lamp,
        "painting" => painting,
        "cushion" => cushion,
        "suitcase" => suitcase,
        "trunk" => trunk,
        "woven_box" => woven_box,
        "dog_house" => dog_house,
        "planter" => planter,
        "flower_vase" => flower_vase,
        _ => return None,
    })
}

fn table_lamp(s: &mut MeshBuilder) {
    let shade =
        s.main_paint_or(&[[244, 230, 200], [200, 120, 90], [150, 176, 170], [238, 236, 230]]);
    s.set_paint(shade);
    s.lathe(
        [0.0, 0.34, 0.0],
        &[
            [0.196, 0.004],
            [0.2, 0.0],
            [0.14, 0.257],
            [0.138, 0.26],
            [0.135, 0.255],
            [0.19, 0.012],
            [0.196, 0.004],
        ],
    );
    s.set_paint(LAMP);
    s.ball([0.0, 0.42, 0.0], [0.07, 0.09, 0.07]);
    s.set_paint(s.pick(1, &[BRASS, STEEL, paint([70, 96, 120], Finish::Glossy)]));
    s.lathe(
        [0.0; 3],
        &[
            [0.1, 0.0],
            [0.1, 0.012],
            [0.06, 0.022],
            [0.022, 0.04],
            [0.03, 0.1],
            [0.045, 0.16],
            [0.03, 0.23],
            [0.014, 0.28],
            [0.014, 0.43],
        ],
    );
    s.rod([-0.138, 0.585, 0.0], [0.138, 0.585, 0.0], 0.003);
    s.rod([0.0, 0.5, 0.0], [0.0, 0.595, 0.0], 0.004);
}

fn painting(s: &mut MeshBuilder) {
    let frame = s.pick(1, &[WALNUT, BRASS, WHITE, BLACK]);
    s.set_paint(s.main_paint());
    s.block([0.0, 0.06, 0.0], [0.7, 1.04, 0.034], 0.0);
    s.set_paint(frame);
    for (x, y, w, h) in [
        (-0.38, 0.0, 0.06, 1.16),
        (0.38, 0.0, 0.06, 1.16),
        (0.0, 0.0, 0.7, 0.06),
        (0.0, 1.1, 0.7, 0.06),
    ] {
        s.block([x, y, 0.0], [w, h, 0.04], 0.008);
    }
    // A landscape, fruit in a bowl, or abstract shapes.
    let z = -0.0172;
    match s.pick(2, &[0, 1, 2]) {
        0 => {
            s.set_paint(paint([150, 186, 214], Finish::Matte));
            s.block([0.0, 0.55, z], [0.69, 0.54, 0.002], 0.0);
            s.set_paint(paint([88, 120, 84], Finish::Matte));
            s.cut(
                [0.0, 0.5, z],
                &[[-0.345, -0.1], [0.345, -0.1], [0.345, 0.12], [0.05, 0.2], [-0.345, 0.06]],
                0.003,
                [0.0; 3],
            );
            s.set_paint(paint([244, 220, 130], Finish::Matte));
            s.ball_turned([0.18, 0.95, z], [0.12, 0.12, 0.004], [0.0; 3]);
            s.set_paint(paint([110, 84, 60], Finish::Matte));
            s.cut(
                [-0.1, 0.3, z],
                &[[-0.1, -0.2], [0.12, -0.2], [0.02, 0.2], [-0.02, 0.2]],
                0.004,
                [0.0; 3],
            );
        }
        1 => {
            s.set_paint(paint([120, 84, 60], Finish::Matte));
            s.block([0.0, 0.06, z], [0.69, 0.36, 0.002], 0.0);
            for (k, [x, y, d]) in
                [[-0.14, 0.55, 0.22], [0.06, 0.53, 0.24], [0.2, 0.5, 0.18], [-0.02, 0.66, 0.2]]
                    .into_iter()
                    .enumerate()
            {
                s.set_paint(paint(
                    [[200, 60, 50], [230, 160, 50], [110, 140, 70], [220, 200, 90]][k],
                    Finish::Matte,
                ));
                s.ball_turned([x, y, z], [d, d, 0.005], [0.0; 3]);
            }
            s.set_paint(paint([90, 110, 140], Finish::Matte));
            s.cut(
                [0.0, 0.4, z - 0.001],
                &[[-0.12, -0.12], [0.12, -0.12], [0.28, 0.1], [-0.28, 0.1]],
                0.003,
                [0.0; 3],
            );
        }
        _ => {
            for (k, [x, y, w, h]) in [
                [-0.15, 0.7, 0.3, 0.4],
                [0.15, 0.5, 0.28, 0.6],
                [0.0, 0.2, 0.5, 0.16],
                [0.1, 0.92, 0.34, 0.1],
            ]
            .into_iter()
            .enumerate()
            {
                s.set_paint(paint(
                    [[206, 176, 96], [88, 104, 84], [170, 80, 60], [60, 70, 110]][k],
                    Finish::Matte,
                ));
                s.block([x, y - 0.1, z], [w, h.min(1.0 - y + 0.1), 0.002 + 0.0004 * k as f32], 0.0);
            }
        }
    }
}

fn cushion(s: &mut MeshBuilder) {
    // Seams that curve inward between the corners. The filling is thickest in the center, with a
    // button on each face.
    const CORNER: [f32; 2] = [0.184, 0.144];
    const SIDE: [f32; 2] = [0.174, 0.134];
    let [[x, y], [u, v]] = [CORNER, SIDE];
    s.set_paint(s.main_paint());
    s.cut(
        [0.0, 0.15, 0.0],
        &[[x, -y], [u, 0.0], [x, y], [0.0, v], [-x, y], [-u, 0.0], [-x, -y], [0.0, -v]],
        0.02,
        [0.0, 90.0, 0.0],
    );
    s.pillow([0.0, 0.15, 0.0], [0.13, 2.0 * v, 2.0 * u], [0.0; 3], 0.52);
    if s.is_level_within(12.0) {
        return;
    }
    s.set_paint(s.pick(
        1,
        &[
            paint([222, 214, 198], Finish::Fabric),
            paint([66, 60, 58], Finish::Fabric),
            paint([190, 150, 84], Finish::Fabric),
        ],
    ));
    let at = |z: f32, y: f32| [0.0, 0.15 + y, z];
    for side in [-1.0, 1.0] {
        s.pipe(&[at(side * x, -y), at(side * u, 0.0), at(side * x, y)], 0.0075);
        s.pipe(&[at(-x, side * y), at(0.0, side * v), at(x, side * y)], 0.0075);
        s.ball_turned([0.063 * side, 0.15, 0.0], [0.01, 0.03, 0.03], [0.0; 3]);
    }
}

fn suitcase(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    s.block([0.0, 0.0, 0.0], [0.46, 0.34, 0.1], 0.02);
    s.set_paint(BLACK);
    s.block([0.0, 0.16, 0.0], [0.462, 0.012, 0.104], 0.002);
    s.pipe(
        &[[-0.07, 0.335, 0.0], [-0.06, 0.375, 0.0], [0.06, 0.375, 0.0], [0.07, 0.335, 0.0]],
        0.009,
    );
    for x in [-0.21, 0.21] {
        for y in [0.004, 0.29] {
            s.block([x, y, 0.0], [0.044, 0.046, 0.105], 0.01);
        }
    }
    s.set_paint(paint([122, 84, 54], Finish::Fabric));
    for x in [-0.13, 0.13] {
        s.block([x, 0.0, 0.0], [0.03, 0.342, 0.104], 0.003);
    }
    s.set_paint(BRASS);
    for x in [-0.13, 0.13] {
        s.block([x, 0.25, -0.0525], [0.036, 0.04, 0.004], 0.001);
    }
    s.block([0.0, 0.28, -0.051], [0.06, 0.04, 0.006], 0.002);
}

fn trunk(s: &mut MeshBuilder) {
    const WOODS: [[[u8; 3]; 2]; 4] = [
        [[150, 116, 88], [128, 96, 72]],
        [[96, 68, 52], [80, 56, 42]],
        [[150, 116, 88], [128, 96, 72]],
        [[92, 108, 92], [78, 92, 80]],
    ];
    let [body, lid] = s.pick(0, &WOODS).map(|c| paint(c, Finish::Wood));
    for (k, color) in [body, lid].into_iter().enumerate() {
        s.set_paint(color);
        s.add_part_shape(&s.class.parts[k]);
    }
    s.add_parts_except(&[0, 1]);
    s.set_paint(paint([96, 70, 50], Finish::Wood));
    for x in [-0.42, 0.0, 0.42] {
        s.block([x, 0.0, -0.327], [0.04, 0.97, 0.02], 0.004);
    }
    s.set_paint(BRASS);
    for x in [-0.425, 0.425] {
        for y in [0.01, 0.62, 0.72, 0.92] {
            s.block([x, y, -0.3], [0.034, 0.06, 0.078], 0.006);
        }
    }
    for x in [-0.3, 0.3] {
        for k in 0..7 {
            s.ball([x, 0.06 + 0.14 * k as f32, -0.34], [0.024, 0.024, 0.01]);
        }
    }
    s.set_paint(GAP);
    s.block([0.0, 0.655, -0.3385], [0.016, 0.03, 0.003], 0.0);
}

fn woven_box(s: &mut MeshBuilder) {
    let willow =
        s.main_paint_or(&[[206, 178, 142], [206, 178, 142], [168, 130, 92], [222, 206, 180]]);
    let darker = |by: f32| willow.color.map(|c| (by * f32::from(c)) as u8);
    s.set_paint(if s.is_level_within(20.0) { willow } else { paint(darker(0.6), Finish::Wicker) });
    s.add_part_shape(&s.class.parts[0]);
    s.set_paint(willow);
    s.add_part_shape(&s.class.parts[1]);
    if !s.is_level_within(20.0) {
        // Strands that go alternately over and under each other.
        const COLUMNS: usize = 7;
        const ROWS: usize = 5;
        let (width, height) = (0.69 / COLUMNS as f32, 0.41 / ROWS as f32);
        for (k, tone) in [1.0, 0.84].into_iter().enumerate() {
            s.set_paint(paint(darker(tone), Finish::Wicker));
            for cell in
                (0..COLUMNS * ROWS).filter(|cell| (cell % COLUMNS + cell / COLUMNS) % 2 == k)
            {
                let along = (cell % COLUMNS) as f32 * width - 0.5 * (0.69 - width);
                let y = (cell / COLUMNS) as f32 * height + 0.004;
                // Strands alternate between horizontal and vertical.
                let [w, h] = if k == 0 { [width, 0.72 * height] } else { [0.62 * width, height] };
                let y = y + 0.5 * (height - h);
                for out in [-0.35, 0.35] {
                    s.block([along, y, out], [w, h, 0.012], 0.0);
                    s.block([out, y, along], [0.012, h, w], 0.0);
                }
            }
        }
    }
    s.set_paint(WALNUT);
    for z in [-0.355, 0.355] {
        s.pipe(
            &[[-0.08, 0.31, 0.98 * z], [-0.06, 0.27, z], [0.06, 0.27, z], [0.08, 0.31, 0.98 * z]],
            0.008,
        );
    }
}

fn dog_house(s: &mut MeshBuilder) {
    let boards =
        s.main_paint_or(&[[132, 130, 132], [168, 120, 80], [132, 130, 132], [150, 80, 70]]);
    s.set_paint(boards);
    s.add_part_shape(&s.class.parts[0]);
    if !s.is_level_within(20.0) {
        s.set_paint(paint(boards.color.map(|c| (0.7 * f32::from(c)) as u8), Finish::Wood));
        for k in 1..6 {
            s.block([0.0, 0.12 * k as f32, 0.0], [1.046, 0.008, 1.086], 0.0);
        }
    }
    s.set_paint(boards);
    s.add_parts(&[1]);
    s.set_paint(BLACK);
    // An arched entrance.
    let arch: [[f32; 2]; 10] = std::array::from_fn(|k| match k {
        0 => [0.26, -0.3],
        9 => [-0.26, -0.3],
        _ => {
            let a = std::f32::consts::PI * (k - 1) as f32 / 7.0;
            [0.26 * cos(a), 0.04 + 0.22 * sin(a)]
        }
    });
    s.cut([0.0, 0.36, -0.543], &arch, 0.012, [0.0; 3]);
    s.set_paint(WHITE);
    for k in 0..9 {
        let a = std::f32::consts::PI * (k as f32 + 0.5) / 9.0;
        s.block_turned(
            [0.29 * cos(a), 0.4 + 0.25 * sin(a), -0.545],
            [0.1, 0.05, 0.02],
            [0.0, 0.0, a.to_degrees() + 90.0],
            0.004,
        );
    }
    for x in [-0.29, 0.29] {
        s.block([x, 0.06, -0.545], [0.05, 0.35, 0.02], 0.004);
    }
}

fn planter(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint_or(&[[226, 224, 220], [182, 100, 66], [90, 110, 120], [60, 62, 66]]));
    s.lathe(
        [0.0; 3],
        &[
            [0.15, 0.0],
            [0.158, 0.01],
            [0.2, 0.2],
            [0.232, 0.42],
            [0.25, 0.44],
            [0.256, 0.49],
            [0.25, 0.503],
            [0.236, 0.503],
            [0.226, 0.44],
            [0.21, 0.4],
        ],
    );
    s.set_paint(paint([88, 74, 60], Finish::Crust));
    s.lathe([0.0, 0.38, 0.0], &[[0.2, 0.0], [0.216, 0.03], [0.1, 0.045], [0.0, 0.05]]);
    s.set_paint(LEAF);
    for k in 0..7 {
        let a = 2.4 * k as f32;
        let r = 0.06 + 0.02 * (k % 3) as f32;
        s.leaf(
            [0.04 * cos(a), 0.42, 0.04 * sin(a)],
            [2.0 * r * cos(a), 0.485, 2.0 * r * sin(a)],
            0.04,
            0.01,
        );
    }
}

fn flower_vase(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint_or(&[
        [201, 181, 172],
        [120, 150, 170],
        [160, 90, 80],
        [214, 206, 180],
    ]));
    s.lathe(
        [0.0; 3],
        &[
            [0.028, 0.0],
            [0.031, 0.006],
            [0.044, 0.06],
            [0.0485, 0.1],
            [0.042, 0.145],
            [0.026, 0.18],
            [0.017, 0.21],
            [0.017, 0.25],
            [0.0245, 0.288],
            [0.024, 0.2925],
            [0.02, 0.288],
            [0.013, 0.25],
            [0.012, 0.22],
        ],
    );
    if s.is_level_within(12.0) {
        return;
    }
    // Glazed rings at foot, shoulder and rim, a dark inside, and painted blossoms.
    s.set_paint(
        s.pick(2, &[paint([64, 84, 128], Finish::Glossy), paint([112, 66, 50], Finish::Glossy)]),
    );
    for (y, r, thickness) in
        [(0.008, 0.0315, 0.003), (0.178, 0.0265, 0.0022), (0.289, 0.0235, 0.0026)]
    {
        s.hoop([0.0, y, 0.0], [0.0, 1.0, 0.0], r - 0.5 * thickness, thickness);
    }
    s.set_paint(paint([40, 34, 32], Finish::Matte));
    s.lathe([0.0, 0.282, 0.0], &[[0.017, 0.0], [0.0195, 0.0065]]);
    for k in 0..5 {
        let (turn, y) = (72.0 * k as f32, 0.098);
        let (sn, cs) = (sin(turn.to_radians()), cos(turn.to_radians()));
        let at =
            |along: f32, up: f32, out: f32| [sn * out + cs * along, y + up, cs * out - sn * along];
        s.set_paint(LEAF);
        for side in [-1.0, 1.0] {
            s.ball_turned(
                at(0.013 * side, -0.018, 0.0455),
                [0.017, 0.007, 0.004],
                [0.0, turn, 0.0],
            );
        }
        s.set_paint(s.pick(
            3,
            &[WHITE, paint([214, 96, 110], Finish::Matte), paint([236, 196, 90], Finish::Matte)],
        ));
        for petal in 0..5 {
            let a = (72.0 * petal as f32).to_radians();
            let (dx, dy) = (0.0075 * sin(a), 0.0075 * cos(a));
            s.ball_turned(at(dx, dy, 0.0475), [0.01, 0.01, 0.004], [0.0, turn, 0.0]);
        }
        s.set_paint(BRASS);
        s.ball_turned(at(0.0, 0.0, 0.0488), [0.0065, 0.0065, 0.004], [0.0, turn, 0.0]);
    }
}
