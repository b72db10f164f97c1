//! Clipping of triangles at the near plane.

use chaic_core::Vec3;

use crate::setup::DepthPlane;

/// A clipped triangle: up to four vertices in screen space, and its plane of inverse depth.
pub(crate) struct Clipped {
    pub vertices: [(f32, f32); 4],
    pub n: usize,
    pub depth_plane: DepthPlane,
}

/// Clips a triangle in camera coordinates (see [`crate::projection::CameraTransform`]) at depth
/// `near_m`. Returns `None` if nothing is left or it faces away.
pub(crate) fn clip(p: [Vec3; 3], near_m: f32, center: (f32, f32)) -> Option<Clipped> {
    let (mu, mv) = center;
    // The plane n . p = d gives inverse depth 1 / w = (n.x * x / w + n.y * y / w + n.z) / d
    // exactly, even for vertices far outside the image.
    let [a, b, c] = p.map(|p| [f64::from(p.x), f64::from(p.y), f64::from(p.z)]);
    let minus = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let (e, f) = (minus(b, a), minus(c, a));
    let n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
    let d = n[0] * a[0] + n[1] * a[1] + n[2] * a[2];
    if d >= 0.0 || d.is_nan() {
        return None;
    }
    let mut out = Clipped {
        vertices: [(0.0, 0.0); 4],
        n: 0,
        depth_plane: DepthPlane {
            q: (n[2] / d) as f32,
            u0: mu,
            v0: mv,
            du: (n[0] / d) as f32,
            dv: (n[1] / d) as f32,
            low: 0.0,
            high: 1.0 / near_m,
        },
    };
    for k in 0..3 {
        let (from, to) = (p[k], p[(k + 1) % 3]);
        let (inside, next_inside) = (from.z >= near_m, to.z >= near_m);
        if inside {
            out.push(from, mu, mv);
        }
        if inside != next_inside {
            // Cut from the inner end outward, so that a neighboring triangle gets the same point.
            let (i, o) = if inside { (from, to) } else { (to, from) };
            let t = (i.z - near_m) / (i.z - o.z);
            let cut = Vec3::new(i.x + (o.x - i.x) * t, i.y + (o.y - i.y) * t, near_m);
            out.push(cut, mu, mv);
        }
    }
    (out.n >= 3).then_some(out)
}

impl Clipped {
    fn push(&mut self, p: Vec3, mu: f32, mv: f32) {
        if self.n < 4 {
            self.vertices[self.n] = (mu + p.x / p.z, mv + p.y / p.z);
            self.n += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_floor_below_the_eye_is_cut_at_the_near_plane() {
        // A floor 1 m below the eye, from 10 m behind to 10 m ahead; focal length 100 px.
        let at = |x: f32, w: f32| Vec3::new(100.0 * x, 100.0, w);
        let clipped = clip([at(-5.0, -10.0), at(0.0, 10.0), at(5.0, -10.0)], 0.1, (50.0, 50.0))
            .or_else(|| clip([at(5.0, -10.0), at(0.0, 10.0), at(-5.0, -10.0)], 0.1, (50.0, 50.0)))
            .expect("part of the floor is ahead");
        assert_eq!(clipped.n, 3);
        // A pixel 20 px below the center sees a depth of 5 m.
        let s = clipped.depth_plane;
        let q = s.q + s.dv * 20.0;
        assert!((1.0 / q - 5.0).abs() < 1e-4, "{}", 1.0 / q);
        assert!(clipped.vertices[..3].iter().any(|c| (c.1 - 60.0).abs() < 1e-3), "tip at 10 m");
    }
}
