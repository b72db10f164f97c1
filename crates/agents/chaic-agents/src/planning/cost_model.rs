//! Cost models: how grid cells are priced, and when to recompute.

use std::fmt::Debug;

use chaic_core::{Frame, Vec2};

use super::cost_map::CostMap;
use crate::mapping::{OccupancyMap, PersonMap, SemanticMap};

/// Inputs of a cost computation.
pub struct CostInputs<'a> {
    /// Static structure.
    pub map: &'a OccupancyMap,
    /// Known objects.
    pub objects: &'a SemanticMap,
    /// Last sightings of people.
    pub people: &'a PersonMap,
    /// True if the agent avoids removable obstacles by a wide margin (facts A1.3).
    pub avoids_obstacles: bool,
    /// Position of the body (x, z).
    pub position: Vec2,
    /// Current frame.
    pub now: Frame,
}

/// Changes since costs were computed last.
#[derive(Clone, Copy, Debug, Default)]
pub struct MapChanges {
    /// True if there was any update.
    pub any: bool,
    /// True if the static layout has changed.
    pub layout: bool,
    /// True if a person was seen recently, or was when costs were computed last.
    pub people: bool,
}

/// Computes the costs of grid cells.
pub trait CostModel: Debug + Send + Sync {
    /// Returns whether these changes require a recomputation.
    fn is_outdated_by(&self, changes: MapChanges) -> bool;

    /// Recomputes all costs.
    fn recompute(&mut self, costs: &mut CostMap, inputs: &CostInputs<'_>);

    /// Returns whether object distance is path length (true) or straight-line distance (false).
    fn uses_path_length(&self) -> bool;

    /// Returns a copy that continues identically.
    fn fork(&self) -> Box<dyn CostModel>;
}

impl Clone for Box<dyn CostModel> {
    fn clone(&self) -> Box<dyn CostModel> {
        (**self).fork()
    }
}
