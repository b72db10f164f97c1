//! How a scene is lit and colored: a choice that changes colors only, never depth or ids.

use std::fmt;
use std::str::FromStr;

use chaic_core::geom::math;
use chaic_core::rng::Stream;
use chaic_core::{EntityId, Vec3};

use crate::light_rig::LightRig;
use crate::mesh::unit;

/// How a scene is lit and colored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Appearance {
    /// The benchmark's: a bright day, colors as in the catalogue.
    #[default]
    Canonical,
    /// The same at dusk: a low, red sun, warm lamps.
    Evening,
    /// Drawn from a seed, to train perception that must not depend on light and color (domain
    /// randomization): time of day, where the sun stands, how strong and warm sun, sky and lamps
    /// are, and the color of each thing, floor, wall and person.
    Varied {
        /// Picks the draw.
        seed: u64,
    },
}

impl FromStr for Appearance {
    type Err = String;

    /// `canonical`, `evening`, or `varied:SEED`.
    fn from_str(text: &str) -> Result<Appearance, String> {
        match (text, text.strip_prefix("varied:").map(str::parse)) {
            ("canonical", _) => Ok(Appearance::Canonical),
            ("evening", _) => Ok(Appearance::Evening),
            (_, Some(Ok(seed))) => Ok(Appearance::Varied { seed }),
            _ => Err(format!("no appearance {text:?}, expected canonical, evening or varied:SEED")),
        }
    }
}

impl fmt::Display for Appearance {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Appearance::Canonical => f.write_str("canonical"),
            Appearance::Evening => f.write_str("evening"),
            Appearance::Varied { seed } => write!(f, "varied:{seed}"),
        }
    }
}

/// What an appearance has to draw for: each has draws of its own, so that more of one kind leave
/// the others as they are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Painted {
    Floor(usize),
    /// All walls, or all ceilings.
    Shell(EntityId),
    Thing(usize),
    Person(usize),
}

impl Appearance {
    /// The lights.
    pub(crate) fn light_rig(self) -> LightRig {
        match self {
            Appearance::Canonical => LightRig::DAY,
            Appearance::Evening => LightRig::EVENING,
            Appearance::Varied { seed } => varied(seed),
        }
    }

    /// By what the linear color of something is multiplied.
    pub(crate) fn factor(self, painted: Painted) -> Vec3 {
        let Appearance::Varied { seed } = self else { return Vec3::ONE };
        let (name, k, hue, dimmest) = match painted {
            Painted::Floor(k) => ("appearance of floors", k, 0.22, 0.75),
            Painted::Shell(e) => ("appearance of structure", usize::from(e.0), 0.22, 0.75),
            Painted::Thing(k) => ("appearance of things", k, 0.25, 0.7),
            Painted::Person(k) => ("appearance of people", k, 0.08, 0.8),
        };
        let mut rng = Stream::new(seed, name, k as u64);
        let bright = rng.range(dimmest, 1.2);
        let mut channel = || bright * rng.range(1.0 - hue, 1.0 + hue);
        Vec3::new(channel(), channel(), channel())
    }
}

fn varied(seed: u64) -> LightRig {
    let mut rng = Stream::new(seed, "appearance of light", 0);
    let from = if rng.range(0.0, 1.0) < 0.7 { LightRig::DAY } else { LightRig::EVENING };
    let azimuth = rng.range(0.0, std::f32::consts::TAU);
    let elevation = rng.range(0.25, 1.25);
    let flat = math::cos(elevation);
    let to_sun =
        unit(Vec3::new(flat * math::cos(azimuth), math::sin(elevation), flat * math::sin(azimuth)));
    // Red and blue change against each other: warmer or colder.
    let mut color = |light: Vec3, strength: [f32; 2], warmth: f32| {
        let (s, w) = (rng.range(strength[0], strength[1]), rng.range(-warmth, warmth));
        light * s * Vec3::new(1.0 + w, 1.0, 1.0 - w)
    };
    let sun = color(from.sun, [0.6, 1.1], 0.12);
    let lamp = color(from.lamp, [0.6, 1.2], 0.2);
    let around = color(Vec3::ONE, [0.75, 1.15], 0.1);
    let sky = color(Vec3::ONE, [0.85, 1.1], 0.08);
    LightRig {
        to_sun,
        sun,
        lamp,
        outdoors: from.outdoors.map(|c| c * around),
        indoors: from.indoors.map(|c| c * around),
        sky: from.sky.map(|c| c * sky),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_appearance_is_read_as_it_is_written() {
        for text in ["canonical", "evening", "varied:17"] {
            assert_eq!(text.parse::<Appearance>().map(|a| a.to_string()), Ok(text.to_owned()));
        }
        for wrong in ["", "day", "varied", "varied:", "varied:-1", "varied:x"] {
            assert!(wrong.parse::<Appearance>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_draw_can_be_seen_by() {
        for seed in 0..2000 {
            let appearance = Appearance::Varied { seed };
            let rig = appearance.light_rig();
            assert!((rig.to_sun.length() - 1.0).abs() < 1e-4 && rig.to_sun.y > 0.2);
            for [high, low] in [rig.indoors, rig.outdoors] {
                assert!(high.min_element() > 0.1 && low.min_element() > 0.08, "{seed}: dark");
                assert!(high.max_element() < 0.75, "{seed}: glaring");
            }
            let factor = appearance.factor(Painted::Thing(seed as usize % 50));
            assert!(factor.min_element() > 0.5 && factor.max_element() < 1.51, "{factor}");
        }
    }
}
