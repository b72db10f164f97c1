//! Light sources: the sun, the sky, and the lamps of rooms.

use chaic_core::Vec3;

/// Extra lamp distance of ceilings, meters: lamps shine downward, and ceilings receive mostly
/// reflected light.
pub(crate) const CEILING_EXTRA_M: f32 = 1.0;
/// Factor on the light on ceilings, which face the whole lit room.
pub(crate) const CEILING_FACTOR: f32 = 1.05;

/// Light sources of a scene. Colors are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightRig {
    /// Unit vector to the sun.
    pub to_sun: Vec3,
    pub sun: Vec3,
    /// Lamp of a room at distance 0.
    pub lamp: Vec3,
    /// Ambient light from above and from below, outdoors.
    pub outdoors: [Vec3; 2],
    /// Ambient light from above and from below, indoors.
    pub indoors: [Vec3; 2],
    /// Sky at the horizon, sky at the zenith, ground below the horizon.
    pub sky: [Vec3; 3],
}

impl LightRig {
    /// Canonical light: a bright day.
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

    /// Dusk: a low, red sun, a dim sky, lamps on.
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

    /// Factor on the color of a glowing lamp: half of its light's color, at maximum brightness.
    pub fn glow(&self) -> Vec3 {
        0.5 + 0.5 * self.lamp / self.lamp.max_element().max(1e-6)
    }

    /// Color of an unshaded horizontal surface outdoors, from its linear color.
    pub fn outdoor_color(&self, color: Vec3) -> Vec3 {
        color * (self.outdoors[0] + self.sun * self.to_sun.y.max(0.0))
    }

    /// Linear color of the sky along a ray. Below the horizon, it fades into `ground`, the color of
    /// the nearby ground.
    #[inline(always)]
    pub fn sky_color(&self, ray: Vec3, ground: Vec3) -> Vec3 {
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
