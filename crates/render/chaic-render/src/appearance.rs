//! Lighting and colors of a scene. They never change depth or ids.

use std::fmt;
use std::str::FromStr;

use chaic_core::geom::math;
use chaic_core::rng::RngStream;
use chaic_core::{EntityId, Vec3};

use crate::light_rig::LightRig;
use crate::mesh::unit;

/// Lighting and colors of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Appearance {
    /// Benchmark appearance: a bright day, colors as in the catalogue.
    #[default]
    Canonical,
    /// Benchmark colors at dusk: a low, red sun and warm lamps.
    Evening,
    /// Random appearance from a seed, to train perception that does not depend on light and color
    /// (domain randomization). It varies time of day, sun direction, strength and warmth of all
    /// lights, and the color of each object, floor, wall and person.
    Varied {
        /// Seed of the random appearance.
        seed: u64,
    },
}

impl FromStr for Appearance {
    type Err = String;

    /// Parses `canonical`, `evening`, or `varied:SEED`.
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

/// Colored part of a scene. Each kind has its own random stream, so that more parts of one kind do
/// not change the others.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ColoredPart {
    Floor(usize),
    /// All walls, or all ceilings.
    Shell(EntityId),
    Object(usize),
    Person(usize),
}

impl Appearance {
    /// Returns the light sources.
    pub(crate) fn light_rig(self) -> LightRig {
        match self {
            Appearance::Canonical => LightRig::DAY,
            Appearance::Evening => LightRig::EVENING,
            Appearance::Varied { seed } => random_light_rig(seed),
        }
    }

    /// Returns the factor on the linear color of a part.
    pub(crate) fn factor(self, part: ColoredPart) -> Vec3 {
        let Appearance::Varied { seed } = self else { return Vec3::ONE };
        let (name, k, hue, min_brightness) = match part {
            ColoredPart::Floor(k) => ("appearance of floors", k, 0.22, 0.75),
            ColoredPart::Shell(e) => ("appearance of structure", usize::from(e.0), 0.22, 0.75),
            ColoredPart::Object(k) => ("appearance of things", k, 0.25, 0.7),
            ColoredPart::Person(k) => ("appearance of people", k, 0.08, 0.8),
        };
        let mut rng = RngStream::new(seed, name, k as u64);
        let brightness = rng.range(min_brightness, 1.2);
        let mut channel = || brightness * rng.range(1.0 - hue, 1.0 + hue);
        Vec3::new(channel(), channel(), channel())
    }
}

fn random_light_rig(seed: u64) -> LightRig {
    let mut rng = RngStream::new(seed, "appearance of light", 0);
    let base = if rng.range(0.0, 1.0) < 0.7 { LightRig::DAY } else { LightRig::EVENING };
    let azimuth = rng.range(0.0, std::f32::consts::TAU);
    let elevation = rng.range(0.25, 1.25);
    let flat = math::cos(elevation);
    let to_sun =
        unit(Vec3::new(flat * math::cos(azimuth), math::sin(elevation), flat * math::sin(azimuth)));
    // Red and blue vary in opposite directions: warmer or colder.
    let mut color = |light: Vec3, strength: [f32; 2], warmth: f32| {
        let (s, w) = (rng.range(strength[0], strength[1]), rng.range(-warmth, warmth));
        light * s * Vec3::new(1.0 + w, 1.0, 1.0 - w)
    };
    let sun = color(base.sun, [0.6, 1.1], 0.12);
    let lamp = color(base.lamp, [0.6, 1.2], 0.2);
    let ambient = color(Vec3::ONE, [0.75, 1.15], 0.1);
    let sky = color(Vec3::ONE, [0.85, 1.1], 0.08);
    LightRig {
        to_sun,
        sun,
        lamp,
        outdoors: base.outdoors.map(|c| c * ambient),
        indoors: base.indoors.map(|c| c * ambient),
        sky: base.sky.map(|c| c * sky),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_appearance_round_trips_through_text() {
        for text in ["canonical", "evening", "varied:17"] {
            assert_eq!(text.parse::<Appearance>().map(|a| a.to_string()), Ok(text.to_owned()));
        }
        for wrong in ["", "day", "varied", "varied:", "varied:-1", "varied:x"] {
            assert!(wrong.parse::<Appearance>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_random_appearance_is_neither_dark_nor_glaring() {
        for seed in 0..2000 {
            let appearance = Appearance::Varied { seed };
            let light_rig = appearance.light_rig();
            assert!((light_rig.to_sun.length() - 1.0).abs() < 1e-4 && light_rig.to_sun.y > 0.2);
            for [high, low] in [light_rig.indoors, light_rig.outdoors] {
                assert!(high.min_element() > 0.1 && low.min_element() > 0.08, "{seed}: dark");
                assert!(high.max_element() < 0.75, "{seed}: glaring");
            }
            let factor = appearance.factor(ColoredPart::Object(seed as usize % 50));
            assert!(factor.min_element() > 0.5 && factor.max_element() < 1.51, "{factor}");
        }
    }
}
