//! State and visibility of objects: whether they lie in play, and whether a person can see them.

use chaic_core::{Frame, Vec2};

use crate::mapping::{CellOccupancy, MappedObject};
use crate::memory::Memory;

/// Tall furniture counts as wall in the map, so walls this near to the object do not hide it,
/// meters.
const OWN_FOOTPRINT_M: f32 = 0.6;

/// Returns whether an object is believed to lie in play, outside of all hands.
pub(super) fn is_at_rest(object: &MappedObject, now: Frame) -> bool {
    object.is_present && !object.is_out_of_play && object.held_until <= now
}

/// Returns whether a wall stands between a person and an object.
pub fn is_hidden(memory: &Memory, from: Vec2, to: Vec2) -> bool {
    let grid = memory.map.grid();
    grid.line(from, to).any(|cell| {
        memory.map.state(cell) == CellOccupancy::Wall
            && grid.center(cell).distance(to) > OWN_FOOTPRINT_M
    })
}
