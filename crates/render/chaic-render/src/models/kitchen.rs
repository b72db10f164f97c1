//! Models of kitchen furniture and of items on counters.

use chaic_core::catalogue::Finish;

use super::Model;
use super::colors::{BLACK, DARK_STEEL, GAP, GLASS, GLOSSY_BLACK, STEEL, WALNUT, WHITE};
use crate::mesh_builder::{MeshBuilder, paint};

pub(super) fn model(name: &str) -> Option<Model> {
    Some(match name {
        "refrigerator" => refrigerator,
        "kitchen_counter" => counter,
        "stove" => stove,
        "coffee_maker" => coffee_maker,
        "toaster" => toaster,
        "jug" => jug,
        "pan" => pan,
        "wineglass" => wineglass,
        "pepper_mill" => pepper_mill,
        "cutlery" => cutlery,
        "kitchen_tool" => kitchen_tool,
        _ => return None,
    })
}

const LACQUER: [u8; 3] = [236, 234, 228];

fn refrigerator(s: &mut MeshBuilder) {
    let steel = paint([200, 204, 208], Finish::Metal);
    let [body, door] = s.pick(
        0,
        &[
            [paint([206, 210, 214], Finish::Glossy), paint(LACQUER, Finish::Glossy)],
            [paint([206, 210, 214], Finish::Glossy), paint(LACQUER, Finish::Glossy)],
            [paint([150, 154, 160], Finish::Metal), steel],
            [paint([196, 206, 200], Finish::Glossy), paint([206, 220, 212], Finish::Glossy)],
        ],
    );
    s.set_paint(body);
    s.block([0.0, 0.05, 0.04], [0.9, 1.73, 0.67], 0.012);
    s.add_part(1);
    s.set_paint(GAP);
    s.block([0.0, 0.07, -0.293], [0.88, 1.69, 0.02], 0.0);
    s.set_paint(door);
    s.block([0.0, 0.06, -0.323], [0.89, 1.105, 0.055], 0.018);
    s.block([0.0, 1.177, -0.323], [0.89, 0.595, 0.055], 0.018);
    s.set_paint(STEEL);
    for (low, high) in [(0.61, 1.11), (1.22, 1.54)] {
        s.rod([-0.38, low, -0.363], [-0.38, high, -0.363], 0.011);
        for y in [low + 0.03, high - 0.03] {
            s.rod([-0.38, y, -0.345], [-0.38, y, -0.364], 0.009);
        }
    }
    s.set_paint(GLASS);
    s.block([0.16, 1.4, -0.351], [0.2, 0.1, 0.006], 0.003);
    s.set_paint(paint([86, 200, 230], Finish::Glossy));
    s.block([0.16, 1.435, -0.3548], [0.09, 0.03, 0.002], 0.0);
    if s.style % 2 == 1 {
        // Notes and magnets.
        for (k, [x, y]) in [[0.05, 0.86], [0.24, 0.93], [0.2, 0.7]].into_iter().enumerate() {
            s.set_paint(paint(
                [[250, 240, 150], [240, 240, 236], [200, 226, 240]][k],
                Finish::Matte,
            ));
            s.block_turned(
                [x, y, -0.3512],
                [0.11, 0.14, 0.0015],
                [0.0, 0.0, 5.0 - 4.0 * k as f32],
                0.0,
            );
            s.set_paint(paint([[210, 60, 50], [60, 120, 200], [70, 160, 80]][k], Finish::Glossy));
            s.ball([x, y + 0.045, -0.3525], [0.022, 0.022, 0.008]);
        }
    }
}

fn counter(s: &mut MeshBuilder) {
    let doors = s.pick(
        1,
        &[
            paint(LACQUER, Finish::Glossy),
            paint([150, 172, 164], Finish::Matte),
            paint([200, 160, 110], Finish::Wood),
        ],
    );
    s.set_paint(s.main_paint());
    s.block([0.0, 0.86, 0.0], [1.8, 0.04, 0.6], 0.008);
    s.add_parts(&[1, 2]);
    s.set_paint(GAP);
    s.block([0.0, 0.1, -0.257], [1.78, 0.755, 0.01], 0.0);
    for k in 0..4 {
        let x = -0.6705 + 0.447 * k as f32;
        s.set_paint(doors);
        s.block([x, 0.105, -0.267], [0.438, 0.565, 0.018], 0.005);
        s.block([x, 0.68, -0.267], [0.438, 0.165, 0.018], 0.005);
        if s.style.is_multiple_of(2) {
            s.block([x, 0.165, -0.2765], [0.32, 0.445, 0.006], 0.004);
        }
        s.set_paint(STEEL);
        for y in [0.765, 0.63] {
            s.rod([x - 0.09, y, -0.289], [x + 0.09, y, -0.289], 0.0065);
            for dx in [-0.07, 0.07] {
                s.rod([x + dx, y, -0.275], [x + dx, y, -0.29], 0.005);
            }
        }
    }
    // A sink, drawn as a dark steel bowl flush with the top.
    if s.style.is_multiple_of(2) {
        s.set_paint(STEEL);
        s.block([0.45, 0.8985, 0.02], [0.48, 0.0035, 0.38], 0.0);
        s.set_paint(DARK_STEEL);
        s.block([0.45, 0.8995, 0.02], [0.43, 0.0032, 0.33], 0.0);
        s.set_paint(GLOSSY_BLACK);
        s.lathe([0.45, 0.9, 0.02], &[[0.03, 0.0], [0.03, 0.0032], [0.0, 0.0034]]);
    }
}

fn stove(s: &mut MeshBuilder) {
    let body = s.pick(
        0,
        &[
            paint(LACQUER, Finish::Glossy),
            paint(LACQUER, Finish::Glossy),
            STEEL,
            paint([60, 62, 66], Finish::Glossy),
        ],
    );
    s.set_paint(body);
    s.block([0.0, 0.0, 0.02], [0.6, 0.87, 0.56], 0.006);
    s.set_paint(GLOSSY_BLACK);
    s.block([0.0, 0.87, 0.02], [0.6, 0.02, 0.56], 0.005);
    for (x, z, r) in
        [(-0.14, -0.12, 0.1), (0.14, -0.12, 0.08), (-0.14, 0.16, 0.08), (0.14, 0.16, 0.1)]
    {
        s.set_paint(DARK_STEEL);
        if s.style.is_multiple_of(2) {
            s.lathe([x, 0.885, z], &[[r, 0.0], [r, 0.009], [0.9 * r, 0.012], [0.3 * r, 0.01]]);
            s.set_paint(paint([110, 60, 50], Finish::Metal));
            s.hoop([x, 0.8955, z], [0.0, 1.0, 0.0], 0.62 * r, 0.003);
        } else {
            // Gas stove: a burner under a grate.
            s.lathe([x, 0.885, z], &[[0.4 * r, 0.0], [0.42 * r, 0.008], [0.2 * r, 0.011]]);
            s.set_paint(BLACK);
            for turn in [0.0f32, 90.0] {
                s.block_turned([x, 0.8945, z], [2.0 * r, 0.009, 0.01], [0.0, turn, 0.0], 0.002);
            }
            s.hoop([x, 0.893, z], [0.0, 1.0, 0.0], 0.92 * r, 0.005);
        }
    }
    s.set_paint(BLACK);
    s.block([0.0, 0.75, -0.262], [0.6, 0.12, 0.02], 0.005);
    for k in 0..5 {
        let x = -0.22 + 0.11 * k as f32;
        if k == 2 {
            s.set_paint(paint([70, 200, 150], Finish::Glossy));
            s.block([x, 0.79, -0.2725], [0.07, 0.035, 0.003], 0.0);
            continue;
        }
        s.set_paint(STEEL);
        s.lathe_along(
            [x, 0.81, -0.272],
            [0.0, 0.0, -1.0],
            &[[0.025, 0.0], [0.024, 0.006], [0.018, 0.008], [0.016, 0.024]],
        );
        s.set_paint(BLACK);
        s.block([x, 0.81, -0.297], [0.004, 0.015, 0.002], 0.0);
    }
    s.set_paint(DARK_STEEL);
    s.block([0.0, 0.19, -0.267], [0.56, 0.52, 0.02], 0.006);
    s.set_paint(GLASS);
    s.block([0.0, 0.26, -0.276], [0.42, 0.3, 0.008], 0.004);
    s.set_paint(body);
    s.block([0.0, 0.03, -0.267], [0.56, 0.14, 0.02], 0.006);
    s.set_paint(STEEL);
    s.rod([-0.23, 0.65, -0.288], [0.23, 0.65, -0.288], 0.0105);
    for x in [-0.2, 0.2] {
        s.rod([x, 0.65, -0.27], [x, 0.65, -0.289], 0.009);
    }
}

fn coffee_maker(s: &mut MeshBuilder) {
    let case = s.main_paint_or(&[WHITE.color, [40, 42, 46], [170, 40, 40], WHITE.color]);
    s.set_paint(case);
    s.block([0.0, 0.0, 0.0], [0.327, 0.05, 0.165], 0.012);
    s.block([0.11, 0.045, 0.0], [0.107, 0.3, 0.165], 0.012);
    s.block([0.0, 0.255, 0.0], [0.327, 0.09, 0.165], 0.014);
    s.set_paint(GLASS);
    s.lathe(
        [-0.06, 0.052, 0.0],
        &[[0.05, 0.0], [0.062, 0.01], [0.065, 0.06], [0.056, 0.12], [0.045, 0.15], [0.047, 0.16]],
    );
    s.set_paint(BLACK);
    s.lathe([-0.06, 0.21, 0.0], &[[0.05, 0.0], [0.05, 0.014], [0.02, 0.022], [0.0, 0.024]]);
    s.pipe(
        &[[-0.115, 0.2, 0.0], [-0.152, 0.19, 0.0], [-0.155, 0.12, 0.0], [-0.122, 0.09, 0.0]],
        0.007,
    );
    s.lathe([-0.06, 0.048, 0.0], &[[0.068, 0.0], [0.068, 0.005]]);
    s.block([0.0, 0.28, -0.0815], [0.1, 0.03, 0.002], 0.0);
    s.set_paint(paint([210, 60, 50], Finish::Glossy));
    s.ball([0.11, 0.28, -0.081], [0.016, 0.016, 0.004]);
}

fn toaster(s: &mut MeshBuilder) {
    s.set_paint(s.main_paint_or(&[STEEL.color, STEEL.color, [150, 40, 40], [206, 222, 214]]));
    s.pillow([0.0, 0.092, 0.0], [0.35, 0.178, 0.17], [0.0; 3], 0.24);
    s.set_paint(BLACK);
    s.block([0.0, 0.0, 0.0], [0.3, 0.012, 0.13], 0.003);
    for z in [-0.035, 0.035] {
        s.block([0.0, 0.172, z], [0.26, 0.01, 0.03], 0.0);
    }
    s.block([0.172, 0.05, 0.0], [0.006, 0.1, 0.01], 0.0);
    s.block([0.178, 0.11, 0.0], [0.016, 0.022, 0.05], 0.005);
    s.lathe_along([0.17, 0.05, 0.045], [1.0, 0.0, 0.0], &[[0.015, 0.0], [0.014, 0.012]]);
    if s.style % 2 == 1 {
        s.set_paint(paint([204, 160, 96], Finish::Crust));
        s.block([0.0, 0.1, 0.035], [0.11, 0.083, 0.014], 0.004);
    }
}

fn jug(s: &mut MeshBuilder) {
    let clay = s.main_paint_or(&[[64, 44, 26], [150, 96, 56], [70, 90, 110], [206, 196, 176]]);
    let clay = paint(clay.color, Finish::Glossy);
    s.set_paint(clay);
    s.lathe(
        [0.025, 0.0, 0.0],
        &[
            [0.045, 0.0],
            [0.05, 0.006],
            [0.07, 0.06],
            [0.075, 0.115],
            [0.066, 0.165],
            [0.045, 0.205],
            [0.034, 0.235],
            [0.036, 0.27],
            [0.043, 0.288],
            [0.042, 0.293],
            [0.037, 0.29],
            [0.03, 0.27],
            [0.028, 0.24],
        ],
    );
    s.pipe(
        &[
            [-0.005, 0.265, 0.0],
            [-0.05, 0.268, 0.0],
            [-0.085, 0.22, 0.0],
            [-0.075, 0.16, 0.0],
            [-0.04, 0.13, 0.0],
        ],
        0.0085,
    );
    s.set_paint(paint([84, 60, 38], Finish::Glossy));
    s.hoop([0.025, 0.225, 0.0], [0.0, 1.0, 0.0], 0.0365, 0.004);
}

fn pan(s: &mut MeshBuilder) {
    let metal = s.main_paint_or(&[DARK_STEEL.color, STEEL.color, [150, 50, 46], [60, 62, 66]]);
    s.set_paint(metal);
    s.lathe([0.0, 0.0, 0.08], &[[0.14, 0.0], [0.15, 0.006], [0.155, 0.058], [0.153, 0.06]]);
    s.set_paint(STEEL);
    s.lathe(
        [0.0, 0.058, 0.08],
        &[[0.153, 0.0], [0.153, 0.004], [0.12, 0.016], [0.06, 0.022], [0.0, 0.023]],
    );
    s.set_paint(BLACK);
    s.lathe(
        [0.0, 0.078, 0.08],
        &[[0.008, 0.0], [0.008, 0.008], [0.02, 0.014], [0.018, 0.023], [0.0, 0.026]],
    );
    s.curve(&[
        ([0.0, 0.045, -0.066], 0.009),
        ([0.0, 0.052, -0.12], 0.01),
        ([0.0, 0.055, -0.19], 0.0125),
        ([0.0, 0.053, -0.234], 0.01),
    ]);
}

fn wineglass(s: &mut MeshBuilder) {
    s.set_paint(paint([206, 216, 222], Finish::Glossy));
    s.lathe(
        [0.0; 3],
        &[
            [0.0245, 0.0],
            [0.025, 0.002],
            [0.006, 0.007],
            [0.0035, 0.016],
            [0.0035, 0.05],
            [0.014, 0.06],
            [0.025, 0.075],
            [0.027, 0.09],
            [0.0245, 0.1075],
            [0.0232, 0.1075],
            [0.0255, 0.09],
            [0.0235, 0.077],
            [0.012, 0.064],
        ],
    );
    if s.style % 2 == 1 {
        s.set_paint(paint([120, 24, 44], Finish::Glossy));
        s.lathe(
            [0.0, 0.063, 0.0],
            &[[0.012, 0.0], [0.0225, 0.014], [0.0245, 0.022], [0.0, 0.0222]],
        );
    }
}

fn pepper_mill(s: &mut MeshBuilder) {
    let wood = s.pick(0, &[WALNUT, paint([192, 150, 98], Finish::Wood), BLACK, WALNUT]);
    s.set_paint(wood);
    s.lathe(
        [0.0; 3],
        &[
            [0.028, 0.0],
            [0.03, 0.006],
            [0.024, 0.02],
            [0.017, 0.04],
            [0.019, 0.06],
            [0.026, 0.074],
            [0.022, 0.081],
        ],
    );
    s.lathe(
        [0.0, 0.082, 0.0],
        &[[0.02, 0.0], [0.0235, 0.01], [0.02, 0.024], [0.01, 0.031], [0.0, 0.032]],
    );
    s.set_paint(STEEL);
    s.lathe([0.0, 0.079, 0.0], &[[0.021, 0.0], [0.022, 0.002], [0.021, 0.004]]);
    s.ball([0.0, 0.112, 0.0], [0.01, 0.008, 0.01]);
}

fn cutlery(s: &mut MeshBuilder) {
    s.set_paint(STEEL);
    let handle = [
        ([0.0, 0.005, 0.084], 0.0035),
        ([0.0, 0.0045, 0.04], 0.0048),
        ([0.0, 0.004, -0.02], 0.003),
    ];
    s.curve(&handle);
    match s.style {
        0 | 3 => s.pillow([0.0, 0.006, -0.053], [0.025, 0.009, 0.062], [0.0; 3], 0.85),
        1 => {
            s.block([0.0, 0.004, -0.035], [0.024, 0.003, 0.03], 0.001);
            for x in [-0.0095, -0.0032, 0.0032, 0.0095] {
                s.taper([x, 0.0055, -0.048], [x, 0.007, -0.083], 0.0016, 0.001);
            }
        }
        _ => s.block([0.002, 0.003, -0.05], [0.017, 0.002, 0.07], 0.0008),
    }
}

fn kitchen_tool(s: &mut MeshBuilder) {
    s.set_paint(s.pick(1, &[BLACK, WALNUT]));
    s.curve(&[([0.0, 0.03, 0.22], 0.009), ([0.0, 0.031, 0.1], 0.008), ([0.0, 0.03, 0.0], 0.006)]);
    s.set_paint(DARK_STEEL);
    s.curve(&[
        ([0.0, 0.03, 0.01], 0.005),
        ([0.0, 0.03, -0.08], 0.005),
        ([0.0, 0.024, -0.13], 0.004),
    ]);
    if s.style.is_multiple_of(2) {
        s.lathe(
            [0.0, 0.0, -0.17],
            &[
                [0.02, 0.0],
                [0.038, 0.012],
                [0.049, 0.034],
                [0.05, 0.048],
                [0.046, 0.048],
                [0.036, 0.018],
                [0.018, 0.006],
            ],
        );
    } else {
        s.block_turned([0.0, 0.016, -0.17], [0.085, 0.004, 0.1], [6.0, 0.0, 0.0], 0.001);
        s.set_paint(GAP);
        for x in [-0.022, 0.0, 0.022] {
            s.block_turned([x, 0.016, -0.17], [0.006, 0.0046, 0.06], [6.0, 0.0, 0.0], 0.0);
        }
    }
}
