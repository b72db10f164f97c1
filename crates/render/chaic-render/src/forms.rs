//! Closed meshes of rounded boxes, cushions, lumps, lathed vessels and extruded outlines.

use chaic_core::Vec3;
use chaic_core::geom::math;

use crate::mesh::{Mesh, OrientedBox, unit_circle};

/// Integer hash with uniform output.
pub(crate) fn hash_u32(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Adds a box with bevels of size `r` and smooth normals.
pub(crate) fn rounded_box(mesh: &mut Mesh, obb: &OrientedBox, r: f32) {
    let base = mesh.positions.len();
    let sign = |k: usize, axis: usize| if k >> axis & 1 == 1 { 1.0f32 } else { -1.0 };
    let half = 0.5 * obb.extent;
    for k in 0..8 {
        let out = Vec3::new(sign(k, 0), sign(k, 1), sign(k, 2));
        for face in 0..3 {
            let axis = Vec3::AXES[face];
            let p = out * (half - Vec3::splat(r) + axis * r);
            mesh.vertex(obb.center + obb.axes * p, obb.axes * (out * axis));
        }
    }
    let at = |k: usize, face: usize| base + 3 * k + face;
    for (q, face) in [
        ([0, 4, 6, 2], 0),
        ([1, 3, 7, 5], 0),
        ([0, 1, 5, 4], 1),
        ([2, 6, 7, 3], 1),
        ([0, 2, 3, 1], 2),
        ([4, 5, 7, 6], 2),
    ] {
        mesh.quad(q.map(|k| at(k, face)), false);
    }
    for edge in 0..3 {
        let (f, g) = ((edge + 1) % 3, (edge + 2) % 3);
        for k in (0..8usize).filter(|k| k >> edge & 1 == 0) {
            let l = k | 1 << edge;
            let mut quad = [at(k, f), at(k, g), at(l, g), at(l, f)];
            if sign(k, f) * sign(k, g) < 0.0 {
                quad.reverse();
            }
            mesh.quad(quad, true);
        }
    }
    for k in 0..8 {
        let mut corners = [at(k, 0), at(k, 1), at(k, 2)];
        if sign(k, 0) * sign(k, 1) * sign(k, 2) < 0.0 {
            corners.reverse();
        }
        mesh.triangle(corners, true);
    }
}

/// Adds a grid of `stacks` by `n` quads around the y axis. `surface` maps latitude and longitude,
/// radians, to a point in [-0.5, 0.5]^3 and a normal.
fn lat_lon_mesh(
    mesh: &mut Mesh,
    obb: &OrientedBox,
    stacks: usize,
    n: usize,
    smooth: bool,
    surface: impl Fn(f32, f32) -> (Vec3, Vec3),
) {
    let pi = std::f32::consts::PI;
    let add = |mesh: &mut Mesh, lat: f32, k: usize| {
        let (p, normal) = surface(lat, 2.0 * pi * k as f32 / n as f32);
        mesh.vertex(obb.point(p), obb.normal(normal))
    };
    let bottom = add(mesh, -0.5 * pi, 0);
    let mut below = None;
    for j in 1..stacks {
        let lat = pi * (j as f32 / stacks as f32 - 0.5);
        let ring = mesh.positions.len();
        for k in 0..n {
            add(mesh, lat, k);
        }
        match below {
            None => {
                for k in 0..n {
                    mesh.triangle([bottom, ring + k, ring + (k + 1) % n], smooth);
                }
            }
            Some(low) => mesh.join_rings(low, ring, n, smooth),
        }
        below = Some(ring);
    }
    let (top, last) = (add(mesh, 0.5 * pi, 0), below.unwrap_or(bottom));
    for k in 0..n {
        mesh.triangle([top, last + (k + 1) % n, last + k], smooth);
    }
}

/// Adds a superellipsoid: a box at `soft` 0, an ellipsoid at `soft` 1.
pub(crate) fn pillow(mesh: &mut Mesh, obb: &OrientedBox, soft: f32, n: usize) {
    let power = |x: f32, e: f32| {
        let size = math::powf(x.abs().max(1e-6), e);
        if x < 0.0 { -size } else { size }
    };
    let stacks = (n / 2).clamp(4, 10) / 2 * 2;
    lat_lon_mesh(mesh, obb, stacks, n, true, |lat, lon| {
        let (sy, cy) = (math::sin(lat), math::cos(lat));
        let (sx, cx) = (math::sin(lon), math::cos(lon));
        let r = power(cy, soft);
        let p = Vec3::new(r * power(cx, soft), power(sy, soft), r * power(sx, soft));
        let q = power(cy, 2.0 - soft);
        let normal =
            Vec3::new(q * power(cx, 2.0 - soft), power(sy, 2.0 - soft), q * power(sx, 2.0 - soft));
        (0.5 * p, normal)
    });
}

/// Adds an ellipsoid of flat facets whose vertices are pushed in by up to `rough` of the radius.
pub(crate) fn lump(mesh: &mut Mesh, obb: &OrientedBox, rough: f32, seed: u32, n: usize) {
    let stacks = (n / 2).max(3);
    lat_lon_mesh(mesh, obb, stacks, n, false, |lat, lon| {
        let (y, r) = (math::sin(lat), math::cos(lat));
        let d = Vec3::new(r * math::cos(lon), y, r * math::sin(lon));
        let key = [lat, lon].map(|a| ((a + 10.0) * 100.0) as u32);
        let h = hash_u32(seed ^ hash_u32(key[0] ^ hash_u32(key[1]))) as f32 / u32::MAX as f32;
        (0.5 * d * (1.0 - rough * h), d)
    });
}

/// Revolves an outline of (radius, height), in units of the extents, around the y axis of the box.
/// An outline that ends where it begins makes a ring; others are closed with caps.
pub(crate) fn lathe(mesh: &mut Mesh, obb: &OrientedBox, outline: &[[f32; 2]], n: usize) {
    let m = outline.len();
    if m < 2 {
        return;
    }
    let slope = |j: usize| {
        let ([r0, y0], [r1, y1]) = (outline[j], outline[j + 1]);
        let (dr, dy) = (r1 - r0, y1 - y0);
        let l = (dr * dr + dy * dy).sqrt().max(1e-9);
        [dy / l, -dr / l]
    };
    let ring = |mesh: &mut Mesh, [r, y]: [f32; 2], [nr, ny]: [f32; 2]| {
        let base = mesh.positions.len();
        for k in 0..n {
            let (c, s) = unit_circle(k, n);
            let p = obb.point(Vec3::new(r * c, y, r * s));
            mesh.vertex(p, obb.normal(Vec3::new(nr * c, ny, nr * s)));
        }
        base
    };
    let mut first = None;
    let mut last = 0;
    let mut smooth_ring = None;
    for j in 0..m - 1 {
        let here = slope(j);
        let low = match smooth_ring {
            Some(ring) => ring,
            None => ring(mesh, outline[j], here),
        };
        first.get_or_insert(low);
        // Shallow bends of the outline get smooth normals.
        let next = (j + 2 < m).then(|| slope(j + 1));
        let next_if_smooth = next.filter(|s| s[0] * here[0] + s[1] * here[1] > 0.6);
        let normal = next_if_smooth.map_or(here, |s| [s[0] + here[0], s[1] + here[1]]);
        let high = ring(mesh, outline[j + 1], normal);
        smooth_ring = next_if_smooth.map(|_| high);
        for k in 0..n {
            let l = (k + 1) % n;
            if outline[j + 1][0] > 1e-5 {
                mesh.triangle([low + k, high + k, high + l], true);
            }
            if outline[j][0] > 1e-5 {
                mesh.triangle([low + k, high + l, low + l], true);
            }
        }
        last = high;
    }
    if outline[0] == outline[m - 1] {
        return;
    }
    if outline[0][0] > 1e-5 {
        mesh.cap(first.unwrap_or(last), n, true);
    }
    if outline[m - 1][0] > 1e-5 {
        mesh.cap(last, n, false);
    }
}

/// Extrudes an outline in the xy plane of the box.
pub(crate) fn extrude(mesh: &mut Mesh, obb: &OrientedBox, outline: &[[f32; 2]], thickness_m: f32) {
    let n = outline.len();
    let middle = outline.iter().fold([0.0; 2], |m, p| [m[0] + p[0], m[1] + p[1]]);
    let [mx, my] = middle.map(|x| x / n as f32);
    let half = 0.5 * thickness_m;
    let mut layer = |z: f32| {
        let base = mesh.positions.len();
        for [x, y] in outline {
            mesh.vertex(obb.point(Vec3::new(*x, *y, z)), Vec3::Y);
        }
        let center = mesh.vertex(obb.point(Vec3::new(mx, my, z)), Vec3::Y);
        (base, center)
    };
    let ((back, back_middle), (front, front_middle)) = (layer(-half), layer(half));
    for k in 0..n {
        let l = (k + 1) % n;
        mesh.triangle([front_middle, front + k, front + l], false);
        mesh.triangle([back_middle, back + l, back + k], false);
        mesh.quad([back + k, back + l, front + l, front + k], false);
    }
}

/// Adds a piece of a cylindrical wall around the vertical axis through `bottom`; see
/// [`crate::mesh_builder::MeshBuilder`].
pub(crate) fn sector(
    mesh: &mut Mesh,
    bottom: Vec3,
    radii: [f32; 2],
    heights: [f32; 2],
    angles_deg: [f32; 2],
    n: usize,
) {
    let base = mesh.positions.len();
    for k in 0..=n {
        let t = k as f32 / n as f32;
        let a = (angles_deg[0] + (angles_deg[1] - angles_deg[0]) * t).to_radians();
        let out = Vec3::new(math::sin(a), 0.0, -math::cos(a));
        for (radius, sign) in [(radii[0], -1.0), (radii[1], 1.0)] {
            for y in heights {
                mesh.vertex(bottom + out * radius + Vec3::Y * y, out * sign);
            }
        }
    }
    // Corners of a slice: 0 inside low, 1 inside high, 2 outside low, 3 outside high.
    let at = |k: usize, corner: usize| base + 4 * k + corner;
    for k in 0..n {
        mesh.quad([at(k, 2), at(k, 3), at(k + 1, 3), at(k + 1, 2)], true);
        mesh.quad([at(k, 0), at(k + 1, 0), at(k + 1, 1), at(k, 1)], true);
        mesh.quad([at(k, 1), at(k + 1, 1), at(k + 1, 3), at(k, 3)], false);
        mesh.quad([at(k, 0), at(k, 2), at(k + 1, 2), at(k + 1, 0)], false);
    }
    mesh.quad([at(0, 0), at(0, 1), at(0, 3), at(0, 2)], false);
    mesh.quad([at(n, 0), at(n, 2), at(n, 3), at(n, 1)], false);
}
