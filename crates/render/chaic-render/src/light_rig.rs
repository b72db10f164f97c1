//! What gives light: the sun, the sky, and the lamps of rooms.

use chaic_core::Vec3;

/// A ceiling is lit as if it were higher by so much, metres: lamps shine downwards, and what reaches it
/// is mostly what comes back from below.
pub(crate) const CEILING_FARTHER_M: f32 = 1.0;
/// By what light on ceilings is multiplied: they see the whole lit room.
pub(crate) const CEILING_TONE: f32 = 1.05;

/// The light of a scene. Colors are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightRig {
    /// Unit vector to the sun.
    pub to_sun: Vec3,
    pub sun: Vec3,
    /// A room's lamp, at no distance.
    pub lamp: Vec3,
    /// Light from above and from below, out of doors.
    pub outdoors: [Vec3; 2],
    /// The same in a room.
    pub indoors: [Vec3; 2],
    /// The sky at the horizon and in the zenith, and the ground below the horizon.
    pub sky: [Vec3; 3],
}

impl LightRig {
    /// The canonical look: a bright day.
    pub const DAY: LightRig = LightRig {
        to_sun: Vec3::new(0.42, 0.80, 0.43),
        sun: Vec3::new(0.92, 0.86, 0.74),
        lamp: Vec3::new(0.66, 0.62, 0.55),
        outdoors: [Vec3::new(0.36, 0.41, 0.48), Vec3::new(0.24, 0.23, 0.20)],
        indoors: [Vec3::new(0.40, 0.40, 0.40), Vec3::new(0.34, 0.32, 0.30)],
        sky: [
            Vec3::new(0.74, 0.82, 0.88),
            Vec3::new(0.19, 0.40, 0.74),
            Vec3::new(0.36, 0.38, 0.34),
        ],
    };

    /// Dusk: the sun low and red, the sky dim, lamps on.
    pub const EVENING: LightRig = LightRig {
        to_sun: Vec3::new(0.81, 0.35, 0.47),
        sun: Vec3::new(0.78, 0.50, 0.30),
        lamp: Vec3::new(0.74, 0.58, 0.40),
        outdoors: [Vec3::new(0.25, 0.25, 0.34), Vec3::new(0.17, 0.15, 0.15)],
        indoors: [Vec3::new(0.26, 0.24, 0.24), Vec3::new(0.24, 0.20, 0.17)],
        sky: [
            Vec3::new(0.86, 0.56, 0.36),
            Vec3::new(0.13, 0.18, 0.40),
            Vec3::new(0.24, 0.22, 0.21),
        ],
    };

    /// By what the color of a lamp is multiplied: half of its light's color, as bright as can be shown.
    pub fn glow(&self) -> Vec3 {
        0.5 + 0.5 * self.lamp / self.lamp.max_element().max(1e-6)
    }

    /// What is seen of a level surface out of doors, of linear color, without shadow.
    pub fn in_the_open(&self, color: Vec3) -> Vec3 {
        color * (self.outdoors[0] + self.sun * self.to_sun.y.max(0.0))
    }

    /// The linear color of the sky along a ray, and of the ground, far away, that has this color
    /// close by.
    #[inline(always)]
    pub fn sky_along(&self, ray: Vec3, ground: Vec3) -> Vec3 {
        let [horizon, zenith, _] = self.sky;
        let y = ray.y / ray.dot(ray).max(1e-12).sqrt();
        let up = (1.0 - y) * (1.0 - y);
        let (to, t) = if y >= 0.0 {
            (zenith, 1.0 - up * (0.4 + 0.6 * up))
        } else {
            (ground, (-6.0 * y).min(1.0))
        };
        horizon + (to - horizon) * t
    }
}
