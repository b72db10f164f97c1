//! Content of an agent's memory, for drawings and analyses. Rules and scores never read it.

use crate::{AgentId, ClassId, Frame, Vec2, Vec3};

/// Map, objects and people that an agent remembers, and its planned path.
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryView {
    /// Map of the place.
    pub map: ExploredMap,
    /// Objects at their remembered positions.
    pub objects: Vec<RememberedObject>,
    /// Other people at their last known positions.
    pub people: Vec<RememberedPerson>,
    /// Points (x, z) of the planned path from the agent on, meters; empty without a path.
    pub path: Vec<Vec2>,
}

/// Occupancy map over a part of the ground plane.
#[derive(Clone, Debug, PartialEq)]
pub struct ExploredMap {
    /// Corner (x, z) of the first cell with the smallest coordinates, meters.
    pub min: Vec2,
    /// Side of a cell, meters.
    pub cell_m: f32,
    /// Number of cells along x.
    pub n_columns: usize,
    /// Cells, row by row along x.
    pub cells: Vec<ExploredCell>,
}

/// Content of a map's cell, as far as an agent knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExploredCell {
    /// Never seen.
    Unknown,
    /// Seen without an obstacle.
    Free,
    /// A wall, furniture or another static obstacle.
    Occupied,
}

/// Object in a memory.
#[derive(Clone, Debug, PartialEq)]
pub struct RememberedObject {
    /// Name that the agent uses for it, for example `#31`.
    pub name: String,
    /// Class.
    pub class: ClassId,
    /// Position in the world, meters.
    pub position_in_world: Vec3,
    /// Frame of the last sighting.
    pub last_seen: Frame,
}

/// Person in a memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RememberedPerson {
    /// The person.
    pub agent: AgentId,
    /// Last known position in the world, meters.
    pub position_in_world: Vec3,
    /// Frame of the sighting.
    pub frame: Frame,
}
