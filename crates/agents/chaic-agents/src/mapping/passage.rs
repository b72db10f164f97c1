//! Narrow passages: doorways, seen as walls on two opposite sides.

use std::ops::RangeInclusive;

use chaic_core::Vec2;
use chaic_core::geom::to_xz;

use super::grid::CELL_M;
use super::occupancy::{CellOccupancy, OccupancyMap};
use super::semantic::MappedObject;

/// Maximum distance between the walls on two opposite sides, meters. Ours: door openings are up to
/// 1.2 m wide, and each wall may appear one or two cells thinner than it is.
const MAX_WIDTH_M: f32 = 1.7;
/// Maximum distance from the point to each of the two walls, meters. The visible points of an
/// obstacle have their mean up to half a passage from its center.
const MAX_SIDE_M: f32 = 1.4;
/// Directions in which opposite walls are searched: walls of houses are parallel to the axes.
/// Diagonals would count every corner as a passage.
const DIRECTIONS: [Vec2; 2] = [Vec2::X, Vec2::Y];

/// Maximum distance of an obstacle's center from the mean of its visible points, cells (0.375 m):
/// half the depth of the largest obstacles. Walls may appear one cell thick, so each cell counts.
const CENTER_ERROR_CELLS: i16 = 3;

/// Distance of a passage's ends from the obstacle's center along the passage, cells (0.5 to 1 m), and
/// to its sides (0.375 m).
const END_CELLS: RangeInclusive<i16> = 4..=8;
const SIDE_CELLS: RangeInclusive<i16> = -3..=3;

/// Returns whether an obstacle stands in a narrow passage, as far as the map shows. Only its front is
/// visible, so its center may lie beyond the mean of its visible points, but not beyond a wall.
pub fn stands_in_passage(map: &OccupancyMap, object: &MappedObject) -> bool {
    let at = to_xz(object.position_in_world);
    let directions = DIRECTIONS.into_iter().flat_map(|d| [d, -d]);
    directions.into_iter().any(|direction| {
        let offsets = (0..=CENTER_ERROR_CELLS).map(|k| at + CELL_M * f32::from(k) * direction);
        offsets
            .take_while(|point| !is_tall_wall(map, *point))
            .any(|point| is_in_passage(map, point))
    })
}

/// Returns whether a point (x, z) lies between two walls of a narrow passage with floor on both of
/// its ends, as far as the map shows. Unknown cells and tall furniture are no walls. The wall behind
/// an obstacle is hidden, so two walls alone do not make a passage.
fn is_in_passage(map: &OccupancyMap, at: Vec2) -> bool {
    let to_wall = |direction: Vec2| {
        let steps = (1..).map(|k| CELL_M * k as f32).take_while(|m| *m <= MAX_SIDE_M);
        steps.into_iter().find(|m| is_tall_wall(map, at + direction * *m))
    };
    DIRECTIONS.into_iter().any(|direction| {
        let sides = to_wall(direction).zip(to_wall(-direction));
        let is_narrow = sides.is_some_and(|(one, other)| one + other <= MAX_WIDTH_M);
        let along = direction.perp();
        is_narrow && has_floor(map, at, along) && has_floor(map, at, -along)
    })
}

/// Returns whether floor was seen at the end of a passage in this direction.
fn has_floor(map: &OccupancyMap, at: Vec2, direction: Vec2) -> bool {
    let is_free = |point: Vec2| {
        map.grid().cell_at(point).is_some_and(|cell| map.state(cell) == CellOccupancy::Free)
    };
    let cells = |range: RangeInclusive<i16>| range.map(|k| CELL_M * f32::from(k));
    cells(END_CELLS).any(|ahead| {
        cells(SIDE_CELLS).any(|aside| is_free(at + ahead * direction + aside * direction.perp()))
    })
}

/// Returns whether a wall up to the ceiling stands at this point (x, z).
fn is_tall_wall(map: &OccupancyMap, at: Vec2) -> bool {
    let cell = map.grid().cell_at(at).map(|cell| map.cell(cell));
    cell.is_some_and(|cell| cell.state() == CellOccupancy::Wall && cell.is_tall())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerRules;
    use crate::memory::Memory;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{Toy, ToyObject};

    #[test]
    fn a_gap_in_a_wall_is_a_passage_and_a_place_beside_the_wall_is_not() {
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        toy.add_wall([-4.0, -2.1], [-0.5, -1.9]);
        toy.add_wall([0.5, -2.1], [4.0, -1.9]);
        toy.stand([0.0, 1.0], 0.0);
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, PlannerRules::paper());
        let unseen = is_in_passage(&memory.map, Vec2::new(0.0, -2.0));
        let observation = toy.observe();
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        let expected =
            [(0.0, -2.0, true), (0.3, -2.0, true), (2.0, -1.4, false), (0.0, 0.0, false)];
        assert!(!unseen, "what was not seen is no wall");
        for (x, z, expected) in expected {
            assert_eq!(is_in_passage(&memory.map, Vec2::new(x, z)), expected, "{x} {z}");
        }
    }

    #[test]
    fn obstacles_at_walls_and_in_corners_stand_in_no_passage() {
        // A wall from side to side hides what is behind it; the obstacle hides the wall.
        for (wall_end_m, at, expected) in [
            (0.6, [0.0, -2.0], true),
            (0.6, [1.6, -1.65], false),
            (0.6, [3.7, -1.65], false),
            (0.6, [3.75, 1.0], false),
            (0.6, [-3.7, 3.7], false),
            (0.0, [0.0, -1.65], false),
            (0.0, [1.8, -1.65], false),
        ] {
            let mut toy = Toy::room(8.0, 8.0);
            toy.size = 256;
            toy.add_wall([-4.0, -2.1], [-wall_end_m, -1.9]);
            toy.add_wall([wall_end_m, -2.1], [4.0, -1.9]);
            // Tall enough to hide the wall.
            let size = [0.4, 1.9, 0.4];
            let bin = toy.add(ToyObject::new("trashbin", [at[0], 0.0, at[1]], size));
            let briefing = toy.briefing();
            let mut memory = Memory::new(&briefing, PlannerRules::paper());
            for turn in 0..12 {
                toy.stand([0.0, 1.0], turn as f32 * std::f32::consts::FRAC_PI_6);
                let observation = toy.observe();
                let percepts = GroundTruthIds.perceive(&observation);
                memory.update(&briefing, &observation, &percepts);
            }
            let object = memory.objects.get(bin).expect("seen");
            assert_eq!(stands_in_passage(&memory.map, object), expected, "{at:?}");
        }
    }
}
