//! Models of beds, cupboards, shelves and other furniture.

use chaic_core::catalogue::Finish;
use chaic_core::geom::math::{cos, sin};

use super::Model;
use super::colors::{
    BLACK, BRASS, DARK_STEEL, GAP, GLOSSY_BLACK, LAMP, LINEN, OAK, PALE_OAK, PAPER, STEEL, WALNUT,
    WHITE,
};
use crate::mesh_builder::{MeshBuilder, Paint, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "bed" => bed,
        "nightstand" => nightstand,
        "wardrobe" => wardrobe,
        "cabinet" => cabinet,
        "desk" => desk,
        "tv_stand" => tv_stand,
        "bookshelf" => bookshelf,
        "potted_plant" => potted_plant,
        "floor_lamp" => floor_lamp,
        "rug" => rug,
        "trashbin" => trashbin,
        "bright_fire_extinguisher" => extinguisher,
        _ => return None,
    })
}

fn bed(s: &mut MeshBuilder) {
    let wood = s.pick(1, &[OAK, WALNUT, paint([226, 222, 214], Finish::Wood)]);
    let cover = s.main_paint();
    s.set_paint(LINEN);
    s.block([0.0, 0.28, -0.03], [2.04, 0.25, 2.44], 0.06);
    s.set_paint(cover);
    s.block([0.0, 0.24, -0.36], [2.14, 0.3, 1.84], 0.06);
    s.set_paint(wood);
    s.block([0.0, 0.08, -0.03], [2.1, 0.2, 2.5], 0.015);
    s.block([0.0, 0.0, 1.24], [2.194, 1.2, 0.09], 0.03);
    if s.style.is_multiple_of(2) {
        s.set_paint(paint(wood.color.map(|c| (0.9 * f32::from(c)) as u8), Finish::Wood));
        for x in [-0.72, 0.0, 0.72] {
            s.block([x, 0.56, 1.192], [0.62, 0.54, 0.02], 0.008);
        }
    } else {
        s.set_paint(cover);
        for k in 0..8 {
            let (i, j) = ((k % 4) as f32, (k / 4) as f32);
            s.pillow([-0.78 + 0.52 * i, 0.7 + 0.3 * j, 1.195], [0.51, 0.29, 0.05], [0.0; 3], 0.4);
        }
    }
    s.set_paint(LINEN);
    s.block([0.0, 0.535, 0.44], [2.12, 0.03, 0.28], 0.014);
    for x in [-0.5, 0.5] {
        s.pillow([x, 0.6, 0.9], [0.86, 0.2, 0.5], [0.0; 3], 0.7);
    }
    s.set_paint(WALNUT);
    for x in [-0.95, 0.95] {
        s.taper([x, 0.0, -1.15], [x, 0.085, -1.15], 0.035, 0.05);
    }
}

/// Adds a handle in front of a door or drawer at (x, y, z): a knob, a bar or a bow, by style.
fn handle(s: &mut MeshBuilder, at: [f32; 3], upright: bool, metal: Paint) {
    let [x, y, z] = at;
    s.set_paint(metal);
    let along = |t: f32| if upright { [x, y + t, z] } else { [x + t, y, z] };
    let out = |p: [f32; 3]| [p[0], p[1], z - 0.02];
    match s.pick(9, &[0, 1, 2]) {
        0 => s.lathe_along(
            at,
            [0.0, 0.0, -1.0],
            &[[0.007, 0.0], [0.006, 0.008], [0.013, 0.013], [0.012, 0.019], [0.0, 0.022]],
        ),
        1 => {
            s.rod(out(along(-0.07)), out(along(0.07)), 0.0065);
            s.rod(along(-0.055), out(along(-0.055)), 0.005);
            s.rod(along(0.055), out(along(0.055)), 0.005);
        }
        _ => s.pipe(&[along(-0.055), out(along(-0.045)), out(along(0.045)), along(0.055)], 0.006),
    }
}

/// Adds a door or drawer front around (x, z) from height `y`, with a raised or sunken panel.
fn front(s: &mut MeshBuilder, at: [f32; 3], width: f32, height: f32, color: Paint) {
    let [x, y, z] = at;
    s.set_paint(color);
    s.block([x, y, z], [width, height, 0.02], 0.005);
    let rim = 0.14 * width.min(height);
    let (w, h) = (width - 2.0 * rim, height - 2.0 * rim);
    match s.pick(8, &[0, 1, 2]) {
        0 => s.block([x, y + rim, z - 0.012], [w, h, 0.008], 0.004),
        1 => {
            s.set_paint(GAP);
            s.block([x, y + rim, z - 0.0095], [w, h, 0.0022], 0.0);
            s.set_paint(color);
            s.block([x, y + rim + 0.006, z - 0.0105], [w - 0.012, h - 0.012, 0.0022], 0.0);
        }
        _ => {}
    }
}

fn nightstand(s: &mut MeshBuilder) {
    let [wood, door] = s.pick(0, &[[OAK, PALE_OAK], [WALNUT, OAK], [WHITE, WHITE], [OAK, WHITE]]);
    s.set_paint(wood);
    s.block([0.0, 0.12, 0.01], [0.43, 0.355, 0.37], 0.006);
    s.block([0.0, 0.475, 0.0], [0.45, 0.025, 0.4], 0.008);
    s.set_paint(GAP);
    s.block([0.0, 0.138, -0.17], [0.39, 0.325, 0.008], 0.0);
    let rows: &[(f32, f32)] = s.pick(
        1,
        &[
            &[(0.145, 0.15), (0.305, 0.15)],
            &[(0.145, 0.1), (0.255, 0.1), (0.365, 0.092)],
            &[(0.145, 0.2), (0.355, 0.1)],
        ],
    );
    for (y, height) in rows {
        front(s, [0.0, *y, -0.175], 0.38, *height, door);
        handle(s, [0.0, y + 0.5 * height, -0.178], false, BRASS);
    }
    s.set_paint(WALNUT);
    for x in [-0.18, 0.18] {
        for z in [-0.16, 0.16] {
            s.taper([x, 0.0, z], [x, 0.125, z], 0.011, 0.018);
        }
    }
}

fn wardrobe(s: &mut MeshBuilder) {
    const WOODS: [[[u8; 3]; 2]; 4] = [
        [[112, 74, 50], [138, 94, 64]],
        [[192, 150, 98], [214, 180, 132]],
        [[222, 218, 208], [238, 236, 228]],
        [[112, 74, 50], [214, 204, 188]],
    ];
    let [wood, panel] = s.pick(0, &WOODS).map(|c| paint(c, Finish::Wood));
    s.set_paint(wood);
    s.block([0.0, 0.06, 0.01], [1.16, 1.83, 0.55], 0.006);
    s.block([0.0, 1.89, 0.0], [1.2, 0.06, 0.6], 0.015);
    s.add_parts(&[2]);
    s.set_paint(GAP);
    s.block([0.0, 0.08, -0.268], [1.12, 1.79, 0.008], 0.0);
    for x in [-0.283, 0.283] {
        front(s, [x, 0.32, -0.277], 0.55, 1.545, panel);
        front(s, [x, 0.085, -0.277], 0.55, 0.225, panel);
        handle(s, [x, 0.2, -0.287], false, BRASS);
        handle(s, [0.17 * x, 1.05, -0.287], true, BRASS);
    }
    if s.style == 1 {
        s.set_paint(paint([150, 170, 180], Finish::Glass));
        s.block([0.283, 0.42, -0.2905], [0.4, 1.35, 0.006], 0.0);
    }
}

fn cabinet(s: &mut MeshBuilder) {
    const WOODS: [[[u8; 3]; 2]; 4] = [
        [[192, 150, 98], [214, 180, 132]],
        [[192, 150, 98], [214, 180, 132]],
        [[206, 164, 112], [224, 188, 140]],
        [[170, 122, 74], [192, 146, 96]],
    ];
    let [wood, door] = s.pick(0, &WOODS).map(|c| paint(c, Finish::Wood));
    s.set_paint(wood);
    s.block([0.0, 0.08, 0.015], [0.9, 1.98, 0.42], 0.006);
    s.add_parts(&[1]);
    s.set_paint(GAP);
    s.block([0.0, 0.09, -0.193], [0.875, 1.955, 0.008], 0.0);
    for x in [-0.2215, 0.2215] {
        front(s, [x, 1.06, -0.203], 0.433, 0.975, door);
        front(s, [x, 0.1, -0.203], 0.433, 0.95, door);
        handle(s, [0.16 * x, 1.25, -0.2115], true, STEEL);
        handle(s, [0.16 * x, 0.84, -0.2115], true, STEEL);
    }
}

fn desk(s: &mut MeshBuilder) {
    let body = s.pick(1, &[paint([236, 234, 228], Finish::Glossy), s.main_paint(), DARK_STEEL]);
    let legs = s.pick(1, &[body, s.main_paint(), BLACK]);
    s.set_paint(s.main_paint());
    s.block([0.0, 0.715, 0.0], [1.3, 0.035, 0.65], 0.008);
    s.set_paint(body);
    s.block([0.44, 0.0, 0.02], [0.38, 0.716, 0.58], 0.005);
    s.block([-0.17, 0.4, 0.29], [0.86, 0.3, 0.02], 0.004);
    s.set_paint(GAP);
    s.block([0.44, 0.035, -0.268], [0.36, 0.67, 0.006], 0.0);
    for (y, height) in [(0.05, 0.21), (0.27, 0.205), (0.485, 0.215)] {
        front(s, [0.44, y, -0.277], 0.355, height, s.main_paint());
        handle(s, [0.44, y + 0.62 * height, -0.2865], false, DARK_STEEL);
    }
    s.set_paint(legs);
    for z in [-0.28, 0.28] {
        s.block([-0.6, 0.0, z], [0.05, 0.716, 0.05], 0.006);
    }
    s.block([-0.6, 0.08, 0.0], [0.03, 0.03, 0.54], 0.004);
}

fn tv_stand(s: &mut MeshBuilder) {
    let door = s.pick(1, &[PALE_OAK, s.main_paint(), WHITE]);
    s.set_paint(s.main_paint());
    s.block([0.0, 0.46, 0.0], [1.4, 0.04, 0.4], 0.008);
    s.block([0.0, 0.1, 0.015], [1.38, 0.361, 0.37], 0.006);
    s.set_paint(GAP);
    s.block([0.0, 0.115, -0.168], [1.36, 0.335, 0.006], 0.0);
    for x in [-0.455, 0.455] {
        front(s, [x, 0.12, -0.176], 0.43, 0.325, door);
        handle(s, [0.62 * x, 0.29, -0.1855], true, BRASS);
    }
    // An open middle with two shelves, a player and discs.
    s.set_paint(BLACK);
    s.block([0.0, 0.12, -0.169], [0.47, 0.155, 0.008], 0.0);
    s.block([0.0, 0.29, -0.169], [0.47, 0.155, 0.008], 0.0);
    s.set_paint(DARK_STEEL);
    s.block([0.0, 0.13, -0.176], [0.34, 0.055, 0.02], 0.003);
    s.set_paint(paint([86, 190, 220], Finish::Glossy));
    s.block([0.09, 0.148, -0.187], [0.07, 0.016, 0.002], 0.0);
    for k in 0..12 {
        let color = [[190, 60, 54], [60, 100, 160], [220, 210, 190], [70, 130, 90]][k % 4];
        s.set_paint(paint(color, Finish::Glossy));
        s.block([-0.2 + 0.02 * k as f32, 0.292, -0.174], [0.016, 0.13, 0.014], 0.0);
    }
    s.set_paint(BLACK);
    for x in [-0.62, 0.62] {
        for z in [-0.14, 0.14] {
            s.taper([x, 0.0, z], [x, 0.105, z], 0.014, 0.022);
        }
    }
}

const SPINES: [[u8; 3]; 12] = [
    [150, 52, 48],
    [52, 82, 128],
    [196, 170, 110],
    [66, 110, 80],
    [214, 206, 188],
    [140, 74, 50],
    [90, 70, 120],
    [206, 150, 54],
    [60, 120, 140],
    [40, 44, 60],
    [180, 90, 100],
    [112, 120, 70],
];

fn bookshelf(s: &mut MeshBuilder) {
    const WOODS: [[[u8; 3]; 2]; 4] = [
        [[192, 150, 98], [112, 74, 50]],
        [[112, 74, 50], [80, 52, 36]],
        [[234, 232, 226], [200, 198, 190]],
        [[192, 150, 98], [150, 110, 70]],
    ];
    let [wood, back] = s.pick(0, &WOODS).map(|c| paint(c, Finish::Wood));
    s.set_paint(back);
    s.block([0.0, 0.0, 0.06], [0.88, 1.39, 0.178], 0.0);
    s.set_paint(wood);
    for x in [-0.435, 0.435] {
        s.block([x, 0.0, 0.0], [0.03, 1.4, 0.3], 0.004);
    }
    for top in [0.08, 0.51, 0.94, 1.4] {
        s.block([0.0, top - 0.03, 0.0], [0.87, 0.03, 0.299], 0.004);
    }
    if s.is_level_within(20.0) {
        for k in 6..s.class.parts.len() {
            s.add_part(k);
        }
        return;
    }
    for (shelf, y) in [0.08, 0.51, 0.94].into_iter().enumerate() {
        let mut x = -0.41;
        let mut k = 0u32;
        while x < 0.36 {
            let h = s.random(100 + 40 * shelf as u32 + k);
            let width = 0.024 + 0.004 * (h % 7) as f32;
            let height = 0.22 + 0.018 * (h / 7 % 8) as f32;
            k += 1;
            if h.is_multiple_of(11) {
                // A gap with an ornament.
                s.set_paint(
                    s.pick(60 + k, &[BRASS, paint([190, 200, 206], Finish::Glossy), BLACK]),
                );
                s.lathe(
                    [x + 0.06, y, -0.07],
                    &[[0.025, 0.0], [0.04, 0.05], [0.03, 0.1], [0.012, 0.13], [0.018, 0.16]],
                );
                x += 0.12;
                continue;
            }
            let color = SPINES[(h / 64 % 12) as usize];
            s.set_paint(paint(color, Finish::Matte));
            let lean = if h % 13 == 1 { -7.0 } else { 0.0 };
            let z = -0.065 + 0.003 * (h % 5) as f32;
            let center =
                [x + 0.5 * width + if lean == 0.0 { 0.0 } else { 0.012 }, y + 0.5 * height, z];
            s.block_turned(center, [width - 0.002, height, 0.14], [0.0, 0.0, lean], 0.003);
            // The title on the spine.
            if !h.is_multiple_of(3) && lean == 0.0 {
                s.set_paint(if h.is_multiple_of(2) { BRASS } else { PAPER });
                s.block(
                    [center[0], y + 0.62 * height, z - 0.0702],
                    [0.6 * width, 0.2 * height, 0.001],
                    0.0,
                );
            }
            x += width + if lean == 0.0 { 0.0 } else { 0.03 };
        }
    }
}

fn potted_plant(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint());
    let pot = [
        [0.118, 0.0],
        [0.122, 0.01],
        [0.152, 0.27],
        [0.17, 0.28],
        [0.17, 0.335],
        [0.165, 0.34],
        [0.15, 0.335],
        [0.145, 0.28],
        [0.14, 0.26],
    ];
    s.lathe([0.0; 3], &pot);
    s.set_paint(paint([70, 50, 38], Finish::Crust));
    s.lathe([0.0, 0.24, 0.0], &[[0.14, 0.0], [0.14, 0.04], [0.1, 0.05], [0.0, 0.052]]);
    let greens = [[62, 122, 58], [92, 152, 72], [76, 136, 64]];
    match s.pick(1, &[0, 1, 2]) {
        // Long blades that grow from the center.
        0 => {
            let n = if s.is_level_within(20.0) { 9 } else { 16 };
            for k in 0..n {
                let (a, t) = (2.4 * k as f32, (k as f32 + 1.0) / n as f32);
                let out = 0.205 - 0.12 * (t - 0.35).max(0.0);
                let top = 0.62 + 0.47 * t;
                s.set_paint(paint(greens[k % 3], Finish::Matte));
                s.leaf(
                    [0.02 * cos(a), 0.27, 0.02 * sin(a)],
                    [out * t.max(0.45) * cos(a), top, out * t.max(0.45) * sin(a)],
                    0.06,
                    0.06 * (1.0 - t),
                );
            }
        }
        // A stem with broad leaves on stalks.
        1 => {
            s.set_paint(paint([96, 84, 56], Finish::Wood));
            s.curve(&[
                ([0.0, 0.27, 0.0], 0.014),
                ([0.01, 0.6, 0.0], 0.011),
                ([0.0, 0.98, 0.01], 0.006),
            ]);
            let n = if s.is_level_within(20.0) { 8 } else { 15 };
            for k in 0..n {
                let (a, t) = (2.4 * k as f32, (k as f32 + 0.5) / n as f32);
                let y = 0.45 + 0.5 * t;
                let (near, far) = (0.05, 0.2 - 0.1 * t);
                s.set_paint(paint([96, 84, 56], Finish::Wood));
                s.taper([0.0, y - 0.04, 0.0], [near * cos(a), y, near * sin(a)], 0.004, 0.003);
                s.set_paint(paint(greens[k % 3], Finish::Matte));
                s.leaf(
                    [near * cos(a), y, near * sin(a)],
                    [far * cos(a), y + 0.03 + 0.08 * t, far * sin(a)],
                    0.12 - 0.04 * t,
                    0.025,
                );
            }
        }
        // A bush.
        _ => {
            s.set_paint(paint([96, 84, 56], Finish::Wood));
            s.taper([0.0, 0.27, 0.0], [0.0, 0.6, 0.0], 0.016, 0.012);
            for (k, [x, y, z, d]) in [
                [0.0, 0.78, 0.0, 0.36],
                [0.09, 0.68, 0.05, 0.24],
                [-0.09, 0.7, -0.05, 0.26],
                [0.03, 0.66, -0.1, 0.22],
                [-0.04, 0.93, 0.03, 0.26],
                [-0.03, 0.64, 0.1, 0.22],
            ]
            .into_iter()
            .enumerate()
            {
                s.set_paint(paint(greens[k % 3], Finish::Crust));
                s.lump([x, y, z], [d, d, d], 0.22, k as u32 + 7);
            }
        }
    }
}

fn floor_lamp(s: &mut MeshBuilder) {
    let metal = s.pick(1, &[DARK_STEEL, BRASS, STEEL, BLACK]);
    s.set_paint(s.main_paint());
    // An open lampshade with a bulb.
    s.lathe(
        [0.0, 1.26, 0.0],
        &[
            [0.197, 0.003],
            [0.2, 0.0],
            [0.132, 0.317],
            [0.13, 0.32],
            [0.127, 0.315],
            [0.19, 0.01],
            [0.197, 0.003],
        ],
    );
    s.set_paint(LAMP);
    s.lathe(
        [0.0, 1.36, 0.0],
        &[[0.014, 0.0], [0.02, 0.03], [0.034, 0.06], [0.03, 0.085], [0.0, 0.1]],
    );
    s.set_paint(metal);
    s.rod([0.0, 0.02, 0.0], [0.0, 1.38, 0.0], 0.013);
    s.lathe([0.0; 3], &[[0.15, 0.0], [0.15, 0.014], [0.13, 0.024], [0.03, 0.032], [0.016, 0.05]]);
    for a in [0.0, 2.094, 4.189f32] {
        s.rod([0.0, 1.545, 0.0], [0.13 * cos(a), 1.545, 0.13 * sin(a)], 0.003);
    }
    s.rod([0.0, 1.36, 0.0], [0.0, 1.59, 0.0], 0.004);
    s.ball([0.0, 1.57, 0.0], [0.028; 3]);
    s.set_paint(BRASS);
    s.rod([0.03, 1.22, 0.0], [0.03, 1.3, 0.0], 0.002);
    s.ball([0.03, 1.205, 0.0], [0.012, 0.02, 0.012]);
}

fn rug(s: &mut MeshBuilder) {
    s.add_part(0);
    match s.pick(1, &[0, 1, 2]) {
        0 => s.add_parts_except(&[0]),
        1 => {
            for k in 0..7 {
                let color = [[224, 206, 168], [60, 76, 108], [206, 150, 90]][k % 3];
                s.set_paint(paint(color, Finish::Fabric));
                s.block([-0.81 + 0.27 * k as f32, 0.0, 0.0], [0.12, 0.009, 1.36], 0.0);
            }
        }
        _ => {
            s.add_part(1);
            for k in 0..15 {
                let (i, j) = ((k % 5) as f32, (k / 5) as f32);
                s.set_paint(paint([[60, 76, 108], [170, 92, 70]][k % 2], Finish::Fabric));
                s.block_turned(
                    [-0.68 + 0.34 * i, 0.0048, -0.36 + 0.36 * j],
                    [0.2, 0.0092, 0.2],
                    [0.0, 45.0, 0.0],
                    0.0,
                );
            }
        }
    }
    if !s.is_level_within(60.0) {
        s.set_paint(paint([232, 224, 204], Finish::Fabric));
        for k in 0..56 {
            let z = -0.69 + 1.38 * (k as f32 + 0.5) / 56.0;
            for x in [-0.985, 0.985] {
                s.block([x, 0.0, z], [0.03, 0.0085, 0.008], 0.0);
            }
        }
    }
}

fn trashbin(s: &mut MeshBuilder) {
    let bin = s.main_paint_or(&[[142, 148, 152], [142, 148, 152], [120, 126, 132], [96, 104, 110]]);
    s.set_paint(bin);
    let wall = [
        [0.172, 0.0],
        [0.176, 0.01],
        [0.2, 0.27],
        [0.226, 0.54],
        [0.228, 0.55],
        [0.222, 0.55],
        [0.215, 0.53],
        [0.19, 0.27],
        [0.168, 0.3],
    ];
    s.lathe([0.0; 3], &wall);
    s.set_paint(DARK_STEEL);
    s.hoop([0.0, 0.548, 0.0], [0.0, 1.0, 0.0], 0.226, 0.012);
    s.hoop([0.0, 0.03, 0.0], [0.0, 1.0, 0.0], 0.178, 0.012);
    // Ribs on the outside.
    if !s.is_level_within(20.0) {
        for k in 0..18 {
            let a = 0.349 * k as f32;
            let at = |r: f32, y: f32| [r * cos(a), y, r * sin(a)];
            s.sweep(&[(at(0.178, 0.04), 0.005), (at(0.224, 0.53), 0.005)]);
        }
    }
    s.set_paint(BLACK);
    s.lathe([0.0, 0.3, 0.0], &[[0.19, 0.0], [0.192, 0.06], [0.0, 0.07]]);
    for (k, [x, z, d]) in
        [[-0.08, -0.05, 0.16], [0.08, 0.06, 0.17], [0.06, -0.09, 0.13], [-0.06, 0.09, 0.12]]
            .into_iter()
            .enumerate()
    {
        let color = [[238, 236, 228], [238, 236, 228], [206, 176, 120], [180, 200, 210]];
        s.set_paint(paint(color[(k + usize::from(s.style)) % 4], Finish::Matte));
        s.lump([x, 0.42, z], [d; 3], 0.28, k as u32 + u32::from(s.style) * 9);
    }
    s.set_paint(paint([206, 60, 50], Finish::Glossy));
    s.block_turned([0.0, 0.43, 0.02], [0.06, 0.11, 0.06], [14.0, 30.0, 24.0], 0.006);
}

fn extinguisher(s: &mut MeshBuilder) {
    let red = s.main_paint_or(&[[214, 28, 30], [214, 28, 30], [196, 22, 26], [224, 44, 36]]);
    s.set_paint(red);
    let body = [
        [0.13, 0.03],
        [0.135, 0.05],
        [0.135, 0.7],
        [0.128, 0.75],
        [0.105, 0.8],
        [0.07, 0.84],
        [0.045, 0.86],
    ];
    s.lathe([0.0, 0.0, 0.06], &body);
    s.set_paint(BLACK);
    s.lathe([0.0, 0.0, 0.06], &[[0.136, 0.0], [0.14, 0.005], [0.14, 0.045], [0.135, 0.052]]);
    s.set_paint(BRASS);
    s.lathe(
        [0.0, 0.85, 0.06],
        &[[0.036, 0.0], [0.036, 0.05], [0.03, 0.055], [0.03, 0.15], [0.022, 0.165]],
    );
    s.set_paint(BLACK);
    s.block_turned([0.0, 0.965, -0.02], [0.036, 0.022, 0.26], [-4.0, 0.0, 0.0], 0.008);
    s.block_turned([0.0, 1.022, -0.015], [0.036, 0.02, 0.26], [9.0, 0.0, 0.0], 0.008);
    s.set_paint(WHITE);
    s.lathe_along(
        [0.0, 0.9, 0.035],
        [0.0, 0.0, -1.0],
        &[[0.032, 0.0], [0.034, 0.004], [0.034, 0.016], [0.03, 0.02]],
    );
    s.set_paint(paint([60, 160, 80], Finish::Glossy));
    s.block([0.008, 0.905, 0.0135], [0.018, 0.018, 0.002], 0.0);
    s.set_paint(GLOSSY_BLACK);
    s.pipe(
        &[
            [0.0, 0.9, 0.02],
            [0.0, 0.9, -0.08],
            [0.0, 0.86, -0.155],
            [0.0, 0.76, -0.172],
            [0.0, 0.66, -0.165],
        ],
        0.016,
    );
    s.lathe_along(
        [0.0, 0.67, -0.166],
        [0.0, -1.0, 0.0],
        &[[0.018, 0.0], [0.02, 0.02], [0.032, 0.16], [0.037, 0.26], [0.03, 0.262]],
    );
    s.set_paint(paint([240, 236, 224], Finish::Glossy));
    s.sector([0.0, 0.0, 0.06], [0.128, 0.137], [0.3, 0.56], [-40.0, 40.0]);
    s.set_paint(red);
    s.sector([0.0, 0.0, 0.06], [0.128, 0.138], [0.5, 0.54], [-40.0, 40.0]);
    s.set_paint(paint([40, 60, 120], Finish::Glossy));
    for k in 0..4 {
        let y = 0.33 + 0.04 * k as f32;
        s.sector([0.0, 0.0, 0.06], [0.128, 0.138], [y, y + 0.016], [-32.0, 24.0 - 9.0 * k as f32]);
    }
}
