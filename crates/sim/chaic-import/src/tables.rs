//! Measurements of this project that neither the data set nor the package contains.
//!
//! `data/README.md` documents sources and accuracy. All values are in Unity's frame, in meters.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use chaic_core::ClassId;
use serde::Deserialize;

/// Properties of a model besides its record.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Model {
    /// Class that represents the model.
    pub class: ClassId,
    /// Rotation of the class relative to the model, degrees, counter-clockwise from above. A
    /// multiple of 90, for models that do not face +z.
    #[serde(default)]
    pub turn_deg: f32,
    /// Measured height of the seat, mattress or load bed above the bottom, at scale 1.
    pub seat_m: Option<f32>,
    /// Minimum and maximum corner, where the record's are wrong.
    #[serde(rename = "box")]
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Measured sRGB color.
    pub rgb: Option<[u8; 3]>,
}

/// A house without furniture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Floorplan {
    /// Thickness of walls.
    pub thickness_m: f32,
    /// Height of walls.
    pub height_m: f32,
    /// Extent of all rooms: `[x_min, z_min, x_max, z_max]`, as all rectangles here.
    pub bounds: [f32; 4],
    /// Walls, cut at the openings.
    pub walls: Vec<[f32; 4]>,
    /// Rooms, by the original's index.
    pub regions: Vec<[f32; 4]>,
    /// Doorways and other passages between rooms.
    pub openings: Vec<Opening>,
    /// Colors by variant: a, b, c.
    pub variants: BTreeMap<String, Colors>,
}

/// A gap in a wall from `a` to `b` (x, z).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Opening {
    pub regions: [u32; 2],
    pub a: [f32; 2],
    pub b: [f32; 2],
}

/// sRGB colors of a house.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Colors {
    pub wall: [u8; 3],
    /// By region.
    pub floors: Vec<[u8; 3]>,
}

/// Models by name.
pub(crate) static MODELS: LazyLock<BTreeMap<String, Model>> =
    LazyLock::new(|| parse(include_str!("../data/models.json")));

/// Floor plans by number.
pub(crate) static FLOORPLANS: LazyLock<BTreeMap<String, Floorplan>> =
    LazyLock::new(|| parse(include_str!("../data/floorplans.json")));

fn parse<T: serde::de::DeserializeOwned>(text: &str) -> T {
    serde_json::from_str(text).expect("every table is checked by a test")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_tables_are_valid_and_complete() {
        assert_eq!(MODELS.len(), 158);
        assert!(MODELS.values().all(|m| m.turn_deg % 90.0 == 0.0));
        assert_eq!(FLOORPLANS.keys().collect::<Vec<_>>(), ["1", "2", "4", "5"]);
        for plan in FLOORPLANS.values() {
            for colors in plan.variants.values() {
                assert_eq!(colors.floors.len(), plan.regions.len());
            }
            let n = plan.regions.len() as u32;
            assert!(plan.openings.iter().all(|o| o.regions.iter().all(|r| *r < n)));
        }
    }

    #[test]
    fn every_model_of_the_catalogue_has_its_class() {
        for class in ClassId::all() {
            // The lighter is in the original's lists, but in no episode.
            let Some(name) = class.info().original_model.filter(|n| *n != "b04_lighter") else {
                continue;
            };
            assert_eq!(MODELS[name].class, class, "{name}");
        }
    }
}
