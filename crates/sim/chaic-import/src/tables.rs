//! What neither the data set nor the package says: the project's own measurements.
//!
//! `data/README.md` tells sources and accuracy. All figures are in Unity's frame, metres.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use chaic_core::ClassId;
use serde::Deserialize;

/// What is known of a model besides its record.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Model {
    /// The class whose shape it gets.
    pub class: ClassId,
    /// How the class is turned against the model, degrees, counter-clockwise from above: a
    /// multiple of 90, for models that don't look along +z.
    #[serde(default)]
    pub turn_deg: f32,
    /// Measured height of the seat, mattress or bed above its bottom at the model's own size.
    pub seat_m: Option<f32>,
    /// Lowest and highest corner where the record's are wrong.
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
    /// Where one walks from room to room.
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
    LazyLock::new(|| parsed(include_str!("../data/models.json")));

/// Floor plans by number.
pub(crate) static FLOORPLANS: LazyLock<BTreeMap<String, Floorplan>> =
    LazyLock::new(|| parsed(include_str!("../data/floorplans.json")));

fn parsed<T: serde::de::DeserializeOwned>(text: &str) -> T {
    serde_json::from_str(text).expect("a test reads every table")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_can_be_read_and_is_whole() {
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
