//! Body and clothes around the joints of a skeleton.

use chaic_core::Vec3;
use chaic_core::catalogue::Finish;
use glam::Mat3;

use super::outfit::{Hair, Headwear, Outfit, Pattern};
use super::proportions::BodyProportions;
use super::skeleton::Skeleton;
use crate::mesh::{Material, Mesh, OrientedBox, Section, unit};
use crate::solids::{Detail, ellipsoid};

/// Adds a person.
pub(super) fn add(
    mesh: &mut Mesh,
    s: &Skeleton,
    b: &BodyProportions,
    outfit: &Outfit,
    detail: Detail,
) {
    trunk(mesh, s, b, outfit, detail);
    for k in 0..2 {
        leg(mesh, s, b, outfit, k, detail);
        arm(mesh, s, b, outfit, k, detail);
    }
    head(mesh, s, b, outfit, detail);
    if s.sling {
        sling(mesh, s, b, detail);
    }
    if let Some([handle, tip]) = s.cane {
        cane(mesh, handle, tip, detail);
    }
}

/// Adds the sling of the left arm: a cloth around the forearm, and a strap around the neck.
fn sling(mesh: &mut Mesh, s: &Skeleton, b: &BodyProportions, detail: Detail) {
    let g = b.girth;
    let n = segments(detail, 0.07 * g).max(6);
    let (elbow, hand) = (s.elbows[0], s.hands[0]);
    mesh.set_material(cloth([238, 238, 232]));
    let behind = elbow + (elbow - hand) * 0.12;
    mesh.limb(behind, elbow.lerp(hand, 0.85), 0.082 * g, 0.062 * g, n);
    // The strap passes in front of the chest.
    let neck = s.chest + s.trunk.y_axis * (0.05 * b.top_y);
    let front = -s.trunk.z_axis * (0.10 * g);
    for (end, side) in [(elbow.lerp(hand, 0.1), -1.0), (elbow.lerp(hand, 0.8), 1.0)] {
        let collar = neck + s.trunk.x_axis * (side * 0.07 * g) + front * 0.5;
        let over = end.lerp(collar, 0.5) + front * 0.35;
        mesh.limb(end, over, 0.018 * g, 0.018 * g, 5);
        mesh.limb(over, collar, 0.018 * g, 0.018 * g, 5);
    }
}

/// Adds a white cane with a red end.
fn cane(mesh: &mut Mesh, handle: Vec3, tip: Vec3, detail: Detail) {
    let n = segments(detail, 0.012).max(4);
    let low = handle.lerp(tip, 0.78);
    mesh.set_material(Material::new([244, 244, 242], Finish::Glossy));
    mesh.limb(handle, low, 0.014, 0.012, n);
    mesh.set_material(Material::new([200, 40, 36], Finish::Glossy));
    mesh.limb(low, tip, 0.012, 0.012, n);
}

/// Returns whether a size covers about a pixel.
fn covers_pixel(detail: Detail, size_m: f32) -> bool {
    size_m * detail.px_per_m > 0.8
}

fn cloth(color: [u8; 3]) -> Material {
    Material::new(color, Finish::Fabric)
}

fn skin_material(color: [u8; 3]) -> Material {
    Material { gloss: crate::mesh::SpecularPreset::Satin, ..Material::new(color, Finish::Matte) }
}

fn segments(detail: Detail, radius_m: f32) -> usize {
    detail.segments(radius_m).min(14)
}

fn trunk(mesh: &mut Mesh, s: &Skeleton, b: &BodyProportions, outfit: &Outfit, detail: Detail) {
    let (w, d) = (b.shoulder_x, 0.105 * b.girth);
    let long = b.shoulder_y - b.hip_y;
    let n = segments(detail, 1.3 * w).max(6);
    // A bent back bulges between hips and neck.
    let back_bulge = 0.22 * (b.lean_rad - 0.1).max(0.0) * b.top_y;
    let section = |up: f32, width: f32, depth: f32, back: f32| Section {
        center: s.hips
            + s.trunk.y_axis * (up * long)
            + s.trunk.z_axis * (back + back_bulge * (up * (1.1 - up)).max(0.0) * 3.3),
        a: s.trunk.x_axis * width,
        b: s.trunk.z_axis * depth,
    };
    mesh.set_material(cloth(outfit.trousers));
    mesh.tube(
        &[
            section(-0.19, 0.45 * w, 0.6 * d, 0.0),
            section(-0.10, 0.82 * w, 1.0 * d, 0.01),
            section(0.06, 0.88 * w, 1.06 * d, 0.01),
            section(0.16, 0.80 * w, 0.9 * d, 0.0),
        ],
        n,
    );
    let body = |grow: f32| {
        [
            section(-0.03, 1.0 * w * grow, 1.22 * d * grow, 0.008),
            section(0.12, 0.90 * w * grow, 1.10 * d * grow, 0.008),
            section(0.30, 0.76 * w * grow, 0.92 * d * grow, 0.0),
            section(0.62, 0.98 * w * grow, 1.14 * d * grow, 0.0),
            section(0.86, 1.12 * w * grow, 1.02 * d * grow, 0.005),
            section(0.97, 0.98 * w * grow, 0.72 * d * grow, 0.008),
            section(1.07, 0.42 * w * grow, 0.5 * d * grow, 0.008),
        ]
    };
    mesh.set_material(cloth(outfit.shirt));
    mesh.tube(&body(1.0), n);
    if let Some(vest) = outfit.vest {
        mesh.set_material(cloth(vest));
        mesh.tube(&body(1.07)[..6], n);
        // A bright stripe around the chest.
        mesh.set_material(skin_material([236, 240, 190]));
        mesh.tube(
            &[section(0.40, 0.92 * w, 1.12 * d, 0.0), section(0.48, 0.97 * w, 1.18 * d, 0.0)],
            n,
        );
    }
    if covers_pixel(detail, 0.02) {
        clothing_details(mesh, &section, &body(1.0), w, d, outfit, n);
    }
    mesh.set_material(skin_material(outfit.skin));
    let neck = 0.052 * b.girth.max(0.8);
    mesh.limb(
        s.chest,
        s.head - s.head_axes.y_axis * (0.25 * b.head),
        neck,
        neck,
        segments(detail, neck),
    );
}

/// Adds belt, collar, stripes and buttons to a trunk with half width `w` and half depth `d`.
fn clothing_details(
    mesh: &mut Mesh,
    section: &dyn Fn(f32, f32, f32, f32) -> Section,
    body: &[Section],
    w: f32,
    d: f32,
    outfit: &Outfit,
    n: usize,
) {
    let band = |mesh: &mut Mesh, low: f32, high: f32, width: f32, depth: f32| {
        mesh.tube(
            &[
                section(low, width * w, depth * d, 0.006),
                section(high, width * w, depth * d, 0.006),
            ],
            n,
        );
    };
    if outfit.pattern != Pattern::Plain && outfit.vest.is_none() {
        mesh.set_material(Material::new(outfit.belt, Finish::Glossy));
        band(mesh, -0.04, 0.005, 1.015, 1.24);
    }
    match outfit.pattern {
        Pattern::Stripes(color) if outfit.vest.is_none() => {
            mesh.set_material(cloth(color));
            // The outline of the trunk is straight between its sections.
            let heights = [-0.03, 0.12, 0.30, 0.62, 0.86, 0.97];
            for k in 0..6 {
                let up = 0.12 + 0.13 * k as f32;
                let j = (1..heights.len() - 1).take_while(|j| heights[*j] < up).count();
                let at = |up: f32| {
                    let t = (up - heights[j]) / (heights[j + 1] - heights[j]);
                    let (p, q) = (&body[j], &body[j + 1]);
                    Section {
                        center: p.center.lerp(q.center, t),
                        a: p.a.lerp(q.a, t) * 1.015,
                        b: p.b.lerp(q.b, t) * 1.02,
                    }
                };
                mesh.tube(&[at(up), at(up + 0.045)], n);
            }
        }
        Pattern::Buttons(color) => {
            mesh.set_material(cloth(color));
            for k in 0..5 {
                let up = 0.14 + 0.17 * k as f32;
                let waist = 1.16 - 0.55 * (up - 0.35).abs().min(0.3);
                let mut button = section(up, 0.0, 0.0, 0.0);
                button.center -= unit(back_direction(section)) * (d * waist.max(1.02));
                let extent = Vec3::splat(0.02);
                ellipsoid(mesh, &OrientedBox::upright(button.center, extent), 6);
            }
            mesh.tube(
                &[section(1.0, 0.62 * w, 0.7 * d, 0.004), section(1.09, 0.56 * w, 0.66 * d, 0.004)],
                n,
            );
        }
        _ => {}
    }
}

/// Backward direction of the trunk.
fn back_direction(section: &dyn Fn(f32, f32, f32, f32) -> Section) -> Vec3 {
    section(0.0, 0.0, 1.0, 0.0).b
}

fn leg(
    mesh: &mut Mesh,
    s: &Skeleton,
    b: &BodyProportions,
    outfit: &Outfit,
    k: usize,
    detail: Detail,
) {
    let g = b.girth;
    let n = segments(detail, 0.08 * g);
    let (hip, knee, ankle) = (s.hip_joints[k], s.knees[k], s.ankles[k]);
    mesh.set_material(cloth(outfit.trousers));
    if outfit.short_trousers {
        mesh.limb(hip.lerp(knee, 0.18), hip.lerp(knee, 0.72), 0.078 * g, 0.074 * g, n);
        mesh.set_material(skin_material(outfit.skin));
        mesh.limb(hip.lerp(knee, 0.6), knee, 0.058 * g, 0.05 * g, n);
        mesh.limb(knee, ankle, 0.050 * g, 0.036 * g, n);
    } else {
        mesh.limb(hip.lerp(knee, 0.1), knee, 0.080 * g, 0.060 * g, n);
        mesh.limb(knee, ankle, 0.060 * g, 0.046 * g, n);
    }
    let (sp, cp) = {
        use chaic_core::geom::math;
        (math::sin(s.foot_pitch[k]), math::cos(s.foot_pitch[k]))
    };
    // The foot rotates around its ball when the heel rises.
    let (up, back) = (Vec3::new(0.0, cp, -sp), Vec3::new(0.0, sp, cp));
    let axes = Mat3::from_cols(Vec3::X, up, back);
    let long = 0.148 * b.top_y;
    let center = ankle - back * (0.27 * long) - up * (0.45 * b.ankle_y);
    let n = segments(detail, 0.5 * long);
    mesh.set_material(Material::new(outfit.shoes, Finish::Glossy));
    let extent = Vec3::new(0.092 * g, 1.05 * b.ankle_y, long);
    ellipsoid(mesh, &OrientedBox { center, axes, extent }, n);
    if covers_pixel(detail, 0.03) {
        // The shaft around the heel, and the sole.
        let center = ankle - up * (0.25 * b.ankle_y) + back * (0.02 * long);
        let extent = Vec3::new(0.08 * g, 1.1 * b.ankle_y, 0.42 * long);
        ellipsoid(mesh, &OrientedBox { center, axes, extent }, n);
        mesh.set_material(Material::new(outfit.soles, Finish::Matte));
        let low = ankle - up * (0.9 * b.ankle_y) - back * (0.27 * long);
        let section = |t: f32, width: f32| Section {
            center: low + back * (t * long),
            a: axes.x_axis * (0.047 * g * width),
            b: up * (0.16 * b.ankle_y),
        };
        mesh.tube(
            &[
                section(0.5, 0.6),
                section(0.4, 0.82),
                section(-0.1, 0.8),
                section(-0.3, 1.0),
                section(-0.49, 0.55),
            ],
            n.min(8),
        );
    }
}

fn arm(
    mesh: &mut Mesh,
    s: &Skeleton,
    b: &BodyProportions,
    outfit: &Outfit,
    k: usize,
    detail: Detail,
) {
    let g = b.girth;
    let n = segments(detail, 0.055 * g);
    let (shoulder, elbow, hand) = (s.shoulders[k], s.elbows[k], s.hands[k]);
    let along = unit(hand - elbow);
    let wrist = hand - along * (0.045 * g);
    mesh.set_material(cloth(outfit.shirt));
    let round = OrientedBox::upright(shoulder.lerp(s.chest, 0.12), Vec3::splat(0.122 * g));
    ellipsoid(mesh, &round, n);
    if outfit.long_sleeves {
        mesh.limb(shoulder, elbow, 0.056 * g, 0.044 * g, n);
        mesh.limb(elbow, wrist, 0.044 * g, 0.036 * g, n);
        mesh.set_material(skin_material(outfit.skin));
    } else {
        mesh.limb(shoulder, shoulder.lerp(elbow, 0.62), 0.058 * g, 0.054 * g, n);
        mesh.set_material(skin_material(outfit.skin));
        mesh.limb(shoulder.lerp(elbow, 0.5), elbow, 0.043 * g, 0.038 * g, n);
        mesh.limb(elbow, wrist, 0.039 * g, 0.029 * g, n);
    }
    let side = unit(along.cross(Vec3::Y) + Vec3::Z * 1e-3);
    let axes = Mat3::from_cols(side, along, side.cross(along));
    if !covers_pixel(detail, 0.02) {
        let size = if s.grips[k] { [0.085, 0.095, 0.07] } else { [0.078, 0.15, 0.038] };
        let extent = Vec3::from(size) * g;
        ellipsoid(mesh, &OrientedBox { center: hand, axes, extent }, n);
        return;
    }
    // A palm, extended or closed fingers, and a thumb toward the body.
    let at = |x: f32, y: f32, z: f32| hand + axes * (Vec3::new(x, y, z) * g);
    let palm = Vec3::new(0.078, 0.095, 0.036) * g;
    ellipsoid(mesh, &OrientedBox { center: at(0.0, -0.015, 0.0), axes, extent: palm }, n);
    let inner = if s.shoulders[k].x > 0.0 { -1.0 } else { 1.0 };
    let inner = if side.x < 0.0 { -inner } else { inner };
    for f in 0..4 {
        let x = -0.027 + 0.018 * f as f32;
        let long = [0.062, 0.072, 0.068, 0.055][f];
        let knuckle = at(x, 0.022, 0.0);
        if s.grips[k] {
            let bent = at(x, 0.045, 0.024);
            mesh.limb(knuckle, bent, 0.0095 * g, 0.009 * g, 5);
            mesh.limb(bent, at(x, 0.012, 0.038), 0.009 * g, 0.008 * g, 5);
        } else {
            mesh.limb(knuckle, at(1.15 * x, 0.022 + long, 0.01), 0.0095 * g, 0.0075 * g, 5);
        }
    }
    let thumb =
        if s.grips[k] { at(inner * 0.026, 0.026, 0.036) } else { at(inner * 0.056, 0.03, 0.012) };
    mesh.limb(at(inner * 0.03, -0.025, 0.006), thumb, 0.012 * g, 0.009 * g, 5);
}

fn head(mesh: &mut Mesh, s: &Skeleton, b: &BodyProportions, outfit: &Outfit, detail: Detail) {
    let (height, width) = (b.head, b.head_width);
    let depth = 0.5 * (height + width);
    // A point of the head: 1 is its surface along right, up and back.
    let at = |x: f32, y: f32, z: f32| {
        s.head + s.head_axes * (0.5 * Vec3::new(x * width, y * height, z * depth))
    };
    let n = segments(detail, 0.5 * depth).max(6);
    let blob = |mesh: &mut Mesh, c: Vec3, e: Vec3, n: usize| {
        ellipsoid(mesh, &OrientedBox { center: c, axes: s.head_axes, extent: e }, n);
    };
    let size = Vec3::new(width, height, depth);
    mesh.set_material(skin_material(outfit.skin));
    // From chin to crown: height, width, depth and backward shift, relative to the head's size.
    let slices: [[f32; 4]; 8] = [
        [-1.00, 0.26, 0.26, -0.36],
        [-0.90, 0.50, 0.50, -0.26],
        [-0.62, 0.72, 0.78, -0.10],
        [-0.25, 0.88, 0.94, -0.02],
        [0.15, 0.97, 1.00, 0.0],
        [0.50, 0.93, 0.96, 0.03],
        [0.82, 0.66, 0.70, 0.05],
        [0.97, 0.28, 0.30, 0.06],
    ];
    let slices = slices.map(|[y, w, d, back]| Section {
        center: at(0.0, y, back),
        a: s.head_axes.x_axis * (0.5 * w * width),
        b: s.head_axes.z_axis * (0.5 * d * depth),
    });
    mesh.tube(&slices, n);
    let small = detail.segments(0.12 * width);
    for x in [-1.0, 1.0] {
        blob(mesh, at(x, -0.08, 0.1), size * Vec3::new(0.10, 0.24, 0.16), small);
    }
    blob(mesh, at(0.0, -0.16, -1.0), size * Vec3::new(0.14, 0.20, 0.18), small);
    if detail.px_per_m * width > 5.0 {
        face(mesh, &at, &blob, size, outfit, s.effort, small);
    }
    mesh.set_material(Material::new(outfit.hair, Finish::Fabric));
    let is_thin = outfit.hair_cut == Hair::Thin;
    if outfit.headwear == Headwear::None && !is_thin {
        blob(mesh, at(0.0, 0.54, 0.12), size * Vec3::new(1.09, 0.62, 1.07), n);
        // A fringe, parted at the side.
        blob(mesh, at(0.22, 0.62, -0.62), size * Vec3::new(0.66, 0.3, 0.36), n.min(8));
    }
    let crown = if is_thin { -0.12 } else { 0.02 };
    blob(mesh, at(0.0, crown, 0.36), size * Vec3::new(1.05, 0.86, 0.76), n);
    match outfit.hair_cut {
        Hair::Long => {
            blob(mesh, at(0.0, -0.55, 0.60), size * Vec3::new(0.98, 0.98, 0.46), n);
            for x in [-0.82, 0.82] {
                blob(mesh, at(x, -0.45, 0.28), size * Vec3::new(0.28, 0.95, 0.44), n.min(8));
            }
        }
        Hair::Bun => blob(mesh, at(0.0, 0.5, 1.12), size * Vec3::new(0.5, 0.42, 0.46), n),
        Hair::Tail => {
            let (from, to) = (at(0.0, 0.3, 1.05), at(0.0, -1.05, 1.5));
            mesh.limb(from, to, 0.17 * width, 0.07 * width, n.min(8));
        }
        Hair::Short | Hair::Thin => {}
    }
    if outfit.beard && covers_pixel(detail, 0.04) {
        blob(mesh, at(0.0, -0.78, -0.42), size * Vec3::new(0.66, 0.42, 0.62), n);
        blob(mesh, at(0.0, -0.36, -0.86), size * Vec3::new(0.42, 0.1, 0.16), n.min(8));
    }
    match outfit.headwear {
        Headwear::None => {}
        Headwear::Cap => {
            mesh.set_material(cloth(outfit.headwear_color));
            blob(mesh, at(0.0, 0.50, 0.08), size * Vec3::new(1.12, 0.64, 1.10), n);
            blob(mesh, at(0.0, 0.46, -1.05), size * Vec3::new(0.86, 0.09, 0.72), n);
        }
        Headwear::Helmet => {
            mesh.set_material(Material::new(outfit.headwear_color, Finish::Glossy));
            blob(mesh, at(0.0, 0.70, 0.14), size * Vec3::new(1.24, 0.84, 1.24), n);
            mesh.set_material(Material::new([245, 245, 240], Finish::Glossy));
            blob(mesh, at(0.0, 0.74, 0.14), size * Vec3::new(0.30, 0.84, 1.26), n);
        }
    }
}

fn face(
    mesh: &mut Mesh,
    at: &dyn Fn(f32, f32, f32) -> Vec3,
    blob: &dyn Fn(&mut Mesh, Vec3, Vec3, usize),
    size: Vec3,
    outfit: &Outfit,
    effort: bool,
    n: usize,
) {
    mesh.set_material(Material::new([246, 246, 242], Finish::Glossy));
    for x in [-0.36, 0.36] {
        blob(mesh, at(x, 0.06, -0.86), size * Vec3::new(0.25, 0.13, 0.14), n);
    }
    mesh.set_material(Material::new([36, 28, 24], Finish::Glossy));
    for x in [-0.36, 0.36] {
        blob(mesh, at(x, 0.06, -0.945), size * Vec3::new(0.12, 0.115, 0.09), n);
    }
    mesh.set_material(Material::new(outfit.hair, Finish::Fabric));
    for x in [-0.37, 0.37] {
        blob(
            mesh,
            at(x, if effort { 0.34 } else { 0.25 }, -0.86),
            size * Vec3::new(0.30, 0.045, 0.12),
            n,
        );
    }
    mesh.set_material(Material::new([164, 76, 70], Finish::Matte));
    // The mouth opens with effort.
    let (y, width, open) = if effort { (-0.54, 0.24, 0.15) } else { (-0.52, 0.34, 0.06) };
    blob(mesh, at(0.0, y, -0.80), size * Vec3::new(width, open, 0.16), n);
    if outfit.dark_glasses {
        mesh.set_material(Material::new([18, 18, 22], Finish::Glossy));
        for x in [-0.40, 0.40] {
            blob(mesh, at(x, 0.06, -0.97), size * Vec3::new(0.36, 0.24, 0.08), n);
        }
        blob(mesh, at(0.0, 0.12, -1.0), size * Vec3::new(0.2, 0.04, 0.05), n);
    } else if outfit.glasses {
        mesh.set_material(Material::new([60, 56, 60], Finish::Metal));
        for x in [-0.40, 0.40] {
            for (dx, dy, w, h) in [
                (0.0, 0.12, 0.38, 0.025),
                (0.0, -0.12, 0.38, 0.025),
                (-0.18, 0.0, 0.03, 0.24),
                (0.18, 0.0, 0.03, 0.24),
            ] {
                blob(
                    mesh,
                    at(x + dx * 2.0, 0.06 + dy * 2.0, -0.99),
                    size * Vec3::new(w, h, 0.04),
                    n,
                );
            }
        }
    }
}
