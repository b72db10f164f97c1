//! Occupancy from a granted layout.

use chaic_core::briefing::{Layout, LayoutBlock};

use super::{
    CELL_M, HEAD_MARGIN_M, MAX_CONFIDENCE, OccupancyMap, SEEN_FIRM, SEEN_FREE, SEEN_HIGH,
    SEEN_NEAR, SEEN_TALL, TALL_M, WALL_M,
};

impl OccupancyMap {
    /// Adds granted floors and fixed blocks. `height_m` is the height of the agent's body: blocks
    /// above it do not block.
    ///
    /// The cells have the states that views of them from all sides would give, with the maximum
    /// confidence. Only what is taller than all furniture counts as a wall.
    pub fn add_layout(&mut self, layout: &Layout, height_m: f32) {
        for cell in 0..self.grid.n_cells() {
            let center = self.grid.center(cell);
            if layout.floors.iter().any(|floor| floor.contains(center)) {
                self.seen_bits[cell] |= SEEN_FREE | SEEN_NEAR;
            }
        }
        let head_m = (height_m + HEAD_MARGIN_M).min(WALL_M);
        let blocks_body = |block: &&LayoutBlock| {
            let [low_m, high_m] = block.y_range_m;
            high_m > self.step_over_m && low_m <= head_m
        };
        for block in layout.blocks.iter().filter(blocks_body) {
            let margin_m = 0.5 * CELL_M;
            let radius_m = (block.half_xz + margin_m).length();
            for cell in self.grid.disc(block.center_xz, radius_m) {
                if !block.contains(self.grid.center(cell), margin_m) {
                    continue;
                }
                self.confidence[cell] = MAX_CONFIDENCE;
                self.seen_bits[cell] |= SEEN_NEAR | SEEN_FIRM;
                // Furniture up to TALL_M is no wall here, so that it does not hide its own inside.
                if block.y_range_m[1] > TALL_M {
                    self.seen_bits[cell] |= SEEN_HIGH | SEEN_TALL;
                }
            }
        }
        self.version += 1;
    }
}

#[cfg(test)]
mod tests {
    use chaic_core::Vec2;

    use super::*;
    use crate::mapping::CellOccupancy;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{MOTION, Toy, ToyObject};

    fn state(map: &OccupancyMap, x: f32, z: f32) -> CellOccupancy {
        map.state(map.grid().cell_at(Vec2::new(x, z)).expect("inside"))
    }

    #[test]
    fn a_layout_gives_the_states_that_looking_around_gives() {
        let mut toy = Toy::room(6.0, 6.0);
        toy.add(ToyObject::new("cabinet", [1.0, 0.0, -2.0], [0.8, 1.0, 0.4]));
        toy.add(ToyObject::new("cabinet", [-1.5, 0.0, 1.5], [0.8, 2.3, 0.4]));
        toy.add(ToyObject::new("cabinet", [1.5, 2.05, 1.5], [0.8, 0.2, 0.4]));
        toy.add_wall([-3.0, -0.05], [-1.5, 0.05]);
        let mut granted = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        granted.add_layout(&toy.layout(), 1.75);
        let mut seen = OccupancyMap::new(&toy.bounds(), MOTION.step_over_m);
        for at in [[0.0, 0.0], [-2.3, -2.3], [-2.3, 2.3], [2.3, 2.3], [2.3, -2.3]] {
            for k in 0..12 {
                toy.stand(at, std::f32::consts::TAU * k as f32 / 12.0);
                let observation = toy.observe();
                let percepts = GroundTruthIds.perceive(&observation);
                seen.integrate(&observation, &percepts, 1.75, 5.0);
            }
        }
        let inside = |cell: &usize| toy.bounds().contains(seen.grid().center(*cell));
        let (mut n_known, mut n_equal) = (0, 0);
        for cell in (0..seen.grid().n_cells()).filter(inside) {
            let [seen_state, granted_state] = [seen.state(cell), granted.state(cell)];
            assert_ne!(granted_state, CellOccupancy::Unknown, "cell {cell}");
            if seen_state == CellOccupancy::Unknown {
                continue;
            }
            n_known += 1;
            n_equal += u32::from(seen_state == granted_state);
            let is_near_edge = granted.grid().neighbors(cell).any(|(next, _)| {
                granted.state(next) != granted_state || seen.state(next) != seen_state
            });
            assert!(seen_state == granted_state || is_near_edge, "cell {cell}");
        }
        assert!(n_known > 2000 && n_equal * 100 > n_known * 95, "{n_equal} of {n_known}");
        assert_eq!(state(&granted, -1.5, 1.5), CellOccupancy::Wall);
        assert_eq!(state(&granted, 1.0, -2.0), CellOccupancy::Occupied);
        assert_eq!(state(&granted, 1.5, 1.5), CellOccupancy::Free, "below a board");
        assert_eq!(state(&granted, 0.0, -3.3), CellOccupancy::Unknown, "behind the wall");
    }
}
