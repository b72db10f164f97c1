//! Meshes of the catalogue's solids.

use chaic_core::Vec3;
use chaic_core::catalogue::{Part, Solid};
use chaic_core::geom::math;
use glam::Mat3;

use crate::mesh::{Mesh, OrientedBox, unit_circle};

/// Number of levels of detail.
pub const N_LEVELS: usize = 7;

/// Maximum radius of each level of detail, pixels; the last level has no maximum. At that radius,
/// round outlines are within about one pixel of the exact ones.
pub const LEVEL_RADIUS_PX: [f32; N_LEVELS] = [7.0, 12.0, 20.0, 35.0, 60.0, 110.0, 200.0];

/// Level of detail for an object with this radius on the image.
pub fn level_for(radius_px: f32) -> usize {
    LEVEL_RADIUS_PX[..N_LEVELS - 1].iter().take_while(|r| radius_px > **r).count()
}

/// Resolution of tessellation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Detail {
    /// Pixels per meter.
    pub px_per_m: f32,
}

impl Detail {
    /// Resolution of `level` for an object with this half diagonal.
    pub fn of_level(level: usize, radius_m: f32) -> Detail {
        Detail { px_per_m: LEVEL_RADIUS_PX[level] / radius_m.max(1e-3) }
    }

    /// Number of segments of a circle. The error of n chords is r pi^2 / (2 n^2), which is kept
    /// near one pixel.
    pub fn segments(&self, radius_m: f32) -> usize {
        let n = 2.3 * (radius_m.max(0.0) * self.px_per_m).sqrt();
        (n as usize).clamp(5, 32)
    }
}

/// Oriented box of a part, for an object of this size.
pub(crate) fn part_obb(part: &Part, size: Vec3) -> OrientedBox {
    let [x, y, z] = part.turn_deg.map(f32::to_radians);
    let (about_x, about_y, about_z) = (
        rotation(Vec3::X, Vec3::Y, Vec3::Z, x),
        rotation(Vec3::Y, Vec3::Z, Vec3::X, y),
        rotation(Vec3::Z, Vec3::X, Vec3::Y, z),
    );
    OrientedBox {
        center: Vec3::from(part.center) * size,
        axes: about_y * about_x * about_z,
        extent: (Vec3::from(part.extent) * size).max(Vec3::splat(1e-4)),
    }
}

/// Rotation that turns `b` toward `c` around `axis`.
fn rotation(axis: Vec3, b: Vec3, c: Vec3, rad: f32) -> Mat3 {
    let (s, co) = (math::sin(rad), math::cos(rad));
    let (nb, nc) = (b * co + c * s, c * co - b * s);
    let image = |e: Vec3| axis * axis.dot(e) + nb * b.dot(e) + nc * c.dot(e);
    Mat3::from_cols(image(Vec3::X), image(Vec3::Y), image(Vec3::Z))
}

/// Adds one solid.
pub(crate) fn solid(mesh: &mut Mesh, solid: Solid, obb: &OrientedBox, detail: Detail) {
    let width = 0.5 * obb.extent.x.max(obb.extent.z);
    let n = detail.segments(width);
    match solid {
        Solid::Cuboid => cuboid(mesh, obb),
        Solid::Ellipsoid => {
            let n = detail.segments(0.5 * obb.extent.max_element());
            ellipsoid(mesh, obb, n);
        }
        Solid::Frustum { top } => frustum(mesh, obb, top, n),
        Solid::Torus { tube } => {
            let m = detail.segments(width * tube).min(16);
            // A thin wire needs only three sides.
            let (m, min_segments) =
                if detail.px_per_m * width * tube < 1.0 { (3, 6) } else { (m, 8) };
            torus(mesh, obb, tube, 360.0, n.max(min_segments), m);
        }
        Solid::Arc { tube, degrees } => {
            let m = detail.segments(width * tube).min(16);
            let m = if detail.px_per_m * width * tube < 1.0 { 3 } else { m };
            let n = ((n as f32 * degrees / 360.0) as usize + 2).max(4);
            torus(mesh, obb, tube, degrees.clamp(1.0, 359.0), n, m);
        }
        Solid::Tub { wall, bottom } => tub(mesh, obb, wall, bottom),
        Solid::RoundTub { wall, bottom } => round_tub(mesh, obb, wall, bottom, n),
    }
}

pub(crate) fn cuboid(mesh: &mut Mesh, obb: &OrientedBox) {
    let base = mesh.positions.len();
    for k in 0..8 {
        let sign = |bit: usize| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
        mesh.vertex(obb.point(Vec3::new(sign(0), sign(1), sign(2))), Vec3::Y);
    }
    for q in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        mesh.quad(q.map(|c| base + c), false);
    }
}

pub(crate) fn ellipsoid(mesh: &mut Mesh, obb: &OrientedBox, n: usize) {
    let stacks = (n / 2 + 1).clamp(3, 14);
    let pole = |mesh: &mut Mesh, y: f32| {
        mesh.vertex(obb.point(Vec3::new(0.0, 0.5 * y, 0.0)), obb.normal(Vec3::Y * y))
    };
    let bottom = pole(mesh, -1.0);
    let mut below = None;
    for j in 1..stacks {
        let a = std::f32::consts::PI * j as f32 / stacks as f32;
        let (y, r) = (-math::cos(a), math::sin(a));
        let ring = mesh.positions.len();
        for k in 0..n {
            let (c, s) = unit_circle(k, n);
            let d = Vec3::new(r * c, y, r * s);
            mesh.vertex(obb.point(0.5 * d), obb.normal(d));
        }
        match below {
            None => {
                for k in 0..n {
                    mesh.triangle([bottom, ring + k, ring + (k + 1) % n], true);
                }
            }
            Some(low) => mesh.join_rings(low, ring, n, true),
        }
        below = Some(ring);
    }
    let (top, last) = (pole(mesh, 1.0), below.unwrap_or(bottom));
    for k in 0..n {
        mesh.triangle([top, last + (k + 1) % n, last + k], true);
    }
}

/// Adds a ring of vertices of a surface of revolution. Radius 0.5 fills the box. The normal is
/// given as its radial and its vertical component.
fn ring(
    mesh: &mut Mesh,
    obb: &OrientedBox,
    radii: (f32, f32),
    y: f32,
    normal: (f32, f32),
    n: usize,
) -> usize {
    let ((rx, rz), (nr, ny)) = (radii, normal);
    let base = mesh.positions.len();
    for k in 0..n {
        let (c, s) = unit_circle(k, n);
        let p = obb.point(Vec3::new(rx * c, y, rz * s));
        mesh.vertex(p, obb.normal(Vec3::new(nr * c, ny, nr * s)));
    }
    base
}

pub(crate) fn frustum(mesh: &mut Mesh, obb: &OrientedBox, top: f32, n: usize) {
    let (r0, r1) = (0.5, 0.5 * top.max(0.0));
    let (scale, r0) = if r1 > r0 { (0.5 / r1, r0) } else { (1.0, r0) };
    let (r0, r1) = (r0 * scale, r1 * scale);
    let slope = (1.0, r0 - r1);
    let low = ring(mesh, obb, (r0, r0), -0.5, slope, n);
    mesh.cap(low, n, true);
    if r1 < 1e-3 {
        // The tip of a cone has no unique normal: each side gets its own tip vertex.
        for k in 0..n {
            let (c, s) = unit_circle(2 * k + 1, 2 * n);
            let tip = Vec3::new(0.0, 0.5, 0.0);
            let tip = mesh.vertex(obb.point(tip), obb.normal(Vec3::new(c, slope.1, s)));
            mesh.triangle([tip, low + (k + 1) % n, low + k], true);
        }
        return;
    }
    let high = ring(mesh, obb, (r1, r1), 0.5, slope, n);
    mesh.join_rings(low, high, n, true);
    mesh.cap(high, n, false);
}

fn torus(mesh: &mut Mesh, obb: &OrientedBox, tube: f32, degrees: f32, n: usize, m: usize) {
    let tube = tube.clamp(0.005, 0.5);
    let (major, minor) = (0.5 - 0.5 * tube, 0.5 * tube);
    let full = degrees >= 360.0;
    let spans = if full { n } else { n - 1 };
    let base = mesh.positions.len();
    for j in 0..n {
        // The center of the sector is at -z.
        let a = (degrees * (j as f32 / spans as f32 - 0.5)).to_radians();
        let (dx, dz) = (math::sin(a), -math::cos(a));
        for k in 0..m {
            let (c, s) = unit_circle(k, m);
            let r = major + minor * c;
            let p = obb.point(Vec3::new(r * dx, 0.5 * s, r * dz));
            let normal = Vec3::new(c * dx / minor, s / 0.5, c * dz / minor);
            mesh.vertex(p, obb.normal(normal));
        }
    }
    for j in 0..spans {
        mesh.join_rings(base + (j + 1) % n * m, base + j * m, m, true);
    }
    if !full {
        mesh.cap(base, m, false);
        mesh.cap(base + (n - 1) * m, m, true);
    }
}

/// Wall thickness of a tub along x, y and z, relative to the extents.
fn thickness(obb: &OrientedBox, wall: f32) -> Vec3 {
    let t = wall.clamp(0.005, 0.45) * obb.extent.x.min(obb.extent.z);
    let y = (t / obb.extent.y).min(0.3);
    Vec3::new(t / obb.extent.x, y, t / obb.extent.z)
}

fn tub(mesh: &mut Mesh, obb: &OrientedBox, wall: f32, bottom: f32) {
    let t = thickness(obb, wall);
    let b = 0.5 * bottom.clamp(0.05, 1.0);
    // Radius of the inner floor: that of the sloped outer side at this height.
    let f = b + (0.5 - b) * t.y;
    let base = mesh.positions.len();
    let levels = [
        (b, b, -0.5),
        (0.5, 0.5, 0.5),
        (0.5 - t.x, 0.5 - t.z, 0.5),
        ((f - t.x).max(0.02), (f - t.z).max(0.02), -0.5 + t.y),
    ];
    for (x, z, y) in levels {
        for (sx, sz) in [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            mesh.vertex(obb.point(Vec3::new(sx * x, y, sz * z)), Vec3::Y);
        }
    }
    for level in 0..3 {
        mesh.join_rings(base + 4 * level, base + 4 * level + 4, 4, false);
    }
    mesh.cap(base, 4, true);
    mesh.cap(base + 12, 4, false);
}

fn round_tub(mesh: &mut Mesh, obb: &OrientedBox, wall: f32, bottom: f32, n: usize) {
    let t = thickness(obb, wall);
    let b = 0.5 * bottom.clamp(0.05, 1.0);
    let f = b + (0.5 - b) * t.y;
    let slope = b - 0.5;
    let a = ring(mesh, obb, (b, b), -0.5, (1.0, slope), n);
    let rim = ring(mesh, obb, (0.5, 0.5), 0.5, (1.0, slope), n);
    let inner = ring(mesh, obb, (0.5 - t.x, 0.5 - t.z), 0.5, (-1.0, -slope), n);
    let floor = ((f - t.x).max(0.02), (f - t.z).max(0.02));
    let floor = ring(mesh, obb, floor, -0.5 + t.y, (-1.0, -slope), n);
    mesh.join_rings(a, rim, n, true);
    mesh.join_rings(rim, inner, n, false);
    mesh.join_rings(inner, floor, n, true);
    mesh.cap(a, n, true);
    mesh.cap(floor, n, false);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Material;
    use chaic_core::catalogue::Finish;

    /// Every solid is closed and faces outward: the signed volume is close to the exact one, and
    /// each edge occurs once in each direction.
    #[test]
    fn solids_are_closed_and_face_outward() {
        let obb = OrientedBox::upright(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.4, 0.6, 0.8));
        let pi = std::f32::consts::PI;
        let box_volume = 0.4 * 0.6 * 0.8;
        for (shape, expected) in [
            (Solid::Cuboid, 1.0),
            (Solid::Ellipsoid, pi / 6.0),
            (Solid::Frustum { top: 1.0 }, pi / 4.0),
            (Solid::Frustum { top: 0.0 }, pi / 12.0),
            (Solid::Torus { tube: 0.25 }, 2.0 * pi * 0.375 * pi * 0.125 * 0.5),
            (Solid::Arc { tube: 0.25, degrees: 180.0 }, pi * 0.375 * pi * 0.125 * 0.5),
            (Solid::Tub { wall: 0.1, bottom: 1.0 }, 1.0 - 0.8 * 0.9 * (1.0 - 0.04 / 0.6)),
            (
                Solid::RoundTub { wall: 0.1, bottom: 1.0 },
                pi / 4.0 * (1.0 - 0.8 * 0.9 * (1.0 - 0.04 / 0.6)),
            ),
        ] {
            let mut mesh = Mesh::default();
            mesh.set_material(Material::new([200; 3], Finish::Matte));
            solid(&mut mesh, shape, &obb, Detail { px_per_m: 500.0 });
            let (mut volume, mut edges) = (0.0, std::collections::BTreeMap::new());
            for t in &mesh.triangles {
                let [a, b, c] = t.vertices.map(|c| mesh.positions[usize::from(c)] - obb.center);
                volume += a.dot(b.cross(c)) / 6.0;
                let key = |v: Vec3| v.to_array().map(|x| (x * 1e5) as i32);
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((key(p), key(q))).or_insert(0) += 1;
                    *edges.entry((key(q), key(p))).or_insert(0) -= 1;
                }
                if t.smooth {
                    let flat = (b - a).cross(c - a);
                    for k in t.vertices {
                        assert!(mesh.normals[usize::from(k)].dot(flat) > 0.0, "{shape:?}: normal");
                    }
                }
            }
            assert!(edges.values().all(|n| *n == 0), "{shape:?} is not closed");
            let fraction = volume / box_volume;
            assert!(
                (fraction - expected).abs() < 0.06 * expected + 0.005,
                "{shape:?}: {fraction}, not {expected}"
            );
        }
    }
}
