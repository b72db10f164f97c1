//! Mesh of a wheelchair in the body frame.

use chaic_core::Vec3;
use chaic_core::catalogue::{Finish, Solid};
use chaic_core::geom::math;
use glam::Mat3;

use super::skeleton::{AXLE_Z_M, WHEEL_RADIUS_M, WHEEL_X_M};
use crate::mesh::{Material, Mesh, OrientedBox};
use crate::solids::{Detail, cuboid, frustum, solid};

const FRAME: [u8; 3] = [150, 156, 164];
const CLOTH: [u8; 3] = [34, 38, 48];
const TYRE: [u8; 3] = [26, 26, 28];

/// Bounding box of the wheelchair, meters.
pub(super) const MIN: Vec3 = Vec3::new(-0.34, -0.01, -0.62);
pub(super) const MAX: Vec3 = Vec3::new(0.34, 1.02, 0.46);

/// Adds a wheelchair that has rolled `walked_m`.
pub(super) fn add(mesh: &mut Mesh, walked_m: f32, detail: Detail) {
    seat(mesh);
    frame(mesh, detail);
    for side in [-1.0, 1.0] {
        wheel(mesh, side, walked_m, detail);
        caster(mesh, side, walked_m, detail);
    }
}

fn bar(mesh: &mut Mesh, center: [f32; 3], extent: [f32; 3]) {
    cuboid(mesh, &OrientedBox::upright(Vec3::from(center), Vec3::from(extent)));
}

fn seat(mesh: &mut Mesh) {
    mesh.set_material(Material::new(CLOTH, Finish::Fabric));
    bar(mesh, [0.0, 0.455, -0.06], [0.44, 0.06, 0.44]);
    bar(mesh, [0.0, 0.74, 0.21], [0.42, 0.48, 0.045]);
    for side in [-1.0, 1.0] {
        bar(mesh, [side * 0.235, 0.685, -0.02], [0.055, 0.035, 0.32]);
        bar(mesh, [side * 0.215, 0.975, 0.30], [0.035, 0.035, 0.12]);
    }
}

fn frame(mesh: &mut Mesh, detail: Detail) {
    mesh.set_material(Material::new(FRAME, Finish::Metal));
    let n = detail.segments(0.015).min(8);
    for side in [-1.0, 1.0] {
        let mut rod = |a: [f32; 3], b: [f32; 3]| {
            let at = |p: [f32; 3]| Vec3::new(side * p[0], p[1], p[2]);
            mesh.limb(at(a), at(b), 0.014, 0.014, n);
        };
        rod([0.215, 0.42, 0.22], [0.215, 0.98, 0.25]);
        rod([0.215, 0.42, 0.22], [0.215, 0.42, -0.27]);
        rod([0.215, 0.42, -0.27], [0.15, 0.13, -0.44]);
        rod([0.235, 0.44, -0.14], [0.235, 0.67, -0.14]);
        rod([0.215, 0.42, -0.24], [0.215, 0.16, -0.26]);
        rod([0.24, WHEEL_RADIUS_M, AXLE_Z_M], [0.215, 0.43, AXLE_Z_M]);
    }
    // Foot plates.
    mesh.set_material(Material::new(CLOTH, Finish::Matte));
    for side in [-1.0, 1.0] {
        bar(mesh, [side * 0.11, 0.105, -0.50], [0.16, 0.02, 0.18]);
    }
}

/// Axes of a wheel whose axle is y.
fn wheel_axes(turn_rad: f32) -> Mat3 {
    let (s, c) = (math::sin(turn_rad), math::cos(turn_rad));
    Mat3::from_cols(Vec3::new(0.0, c, s), Vec3::X, Vec3::new(0.0, -s, c) * -1.0)
}

fn wheel(mesh: &mut Mesh, side: f32, walked_m: f32, detail: Detail) {
    let center = Vec3::new(side * WHEEL_X_M, WHEEL_RADIUS_M, AXLE_Z_M);
    let axes = wheel_axes(-(walked_m / WHEEL_RADIUS_M) % std::f32::consts::TAU);
    let d = 2.0 * WHEEL_RADIUS_M;
    mesh.set_material(Material::new(TYRE, Finish::Matte));
    let tyre = OrientedBox { center, axes, extent: Vec3::new(d, 0.035, d) };
    solid(mesh, Solid::Torus { tube: 0.06 }, &tyre, detail);
    mesh.set_material(Material::new(FRAME, Finish::Metal));
    let rim = OrientedBox {
        center: center + Vec3::X * (side * 0.03),
        axes,
        extent: Vec3::new(0.9 * d, 0.018, 0.9 * d),
    };
    solid(mesh, Solid::Torus { tube: 0.035 }, &rim, detail);
    let hub = OrientedBox { center, axes, extent: Vec3::new(0.06, 0.06, 0.06) };
    frustum(mesh, &hub, 1.0, detail.segments(0.03));
    for k in 0..5 {
        let axes = wheel_axes(
            -(walked_m / WHEEL_RADIUS_M) % std::f32::consts::TAU + 0.628_318_5 * k as f32,
        );
        cuboid(mesh, &OrientedBox { center, axes, extent: Vec3::new(0.95 * d, 0.006, 0.008) });
    }
}

fn caster(mesh: &mut Mesh, side: f32, walked_m: f32, detail: Detail) {
    mesh.set_material(Material::new(TYRE, Finish::Matte));
    let center = Vec3::new(side * 0.215, 0.08, -0.27);
    let axes = wheel_axes(-(walked_m / 0.08) % std::f32::consts::TAU);
    frustum(
        mesh,
        &OrientedBox { center, axes, extent: Vec3::new(0.16, 0.03, 0.16) },
        1.0,
        detail.segments(0.08),
    );
}
