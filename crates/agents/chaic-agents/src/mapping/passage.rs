//! Narrow passages: doorways, seen as walls on two opposite sides.

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
/// Directions in which opposite walls are searched: walls of houses are parallel to the axes, and
/// those of other scenes have at most this angle of 45 degrees to one of them.
const DIRECTIONS: [Vec2; 4] = [
    Vec2::new(1.0, 0.0),
    Vec2::new(0.0, 1.0),
    Vec2::new(std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2),
    Vec2::new(std::f32::consts::FRAC_1_SQRT_2, -std::f32::consts::FRAC_1_SQRT_2),
];

/// Maximum distance of an obstacle's center from the mean of its visible points, cells (0.375 m):
/// half the depth of the largest obstacles. Walls may appear one cell thick, so each cell counts.
const CENTER_ERROR_CELLS: i16 = 3;

/// Returns whether an obstacle stands in a narrow passage, as far as the map shows. Only its front is
/// visible, so its center may lie beyond the mean of its visible points.
pub fn stands_in_passage(map: &OccupancyMap, object: &MappedObject) -> bool {
    let at = to_xz(object.position_in_world);
    let offsets = (-CENTER_ERROR_CELLS..=CENTER_ERROR_CELLS).map(|k| CELL_M * f32::from(k));
    offsets
        .into_iter()
        .any(|m| is_in_passage(map, at + m * Vec2::X) || is_in_passage(map, at + m * Vec2::Y))
}

/// Returns whether a point (x, z) lies between two walls of a narrow passage, as far as the map
/// shows. Unknown cells and tall furniture are no walls.
fn is_in_passage(map: &OccupancyMap, at: Vec2) -> bool {
    let to_wall = |direction: Vec2| {
        let steps = (1..).map(|k| CELL_M * k as f32).take_while(|m| *m <= MAX_SIDE_M);
        steps.into_iter().find(|m| {
            let cell = map.grid().cell_at(at + direction * *m);
            cell.map(|cell| map.cell(cell))
                .is_some_and(|cell| cell.state() == CellOccupancy::Wall && cell.is_tall())
        })
    };
    DIRECTIONS.into_iter().any(|direction| {
        let sides = to_wall(direction).zip(to_wall(-direction));
        sides.is_some_and(|(one, other)| one + other <= MAX_WIDTH_M)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::Toy;

    #[test]
    fn a_gap_in_a_wall_is_a_passage_and_a_place_beside_the_wall_is_not() {
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        toy.add_wall([-4.0, -2.1], [-0.5, -1.9]);
        toy.add_wall([0.5, -2.1], [4.0, -1.9]);
        toy.stand([0.0, 1.0], 0.0);
        let briefing = toy.briefing();
        let mut memory = crate::memory::Memory::new(&briefing, crate::PlannerRules::paper());
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
}
