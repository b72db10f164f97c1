//! Content of a memory for drawings.

use chaic_core::memory_view::{
    ExploredCell, ExploredMap, MemoryView, RememberedObject, RememberedPerson,
};

use super::Memory;
use crate::mapping::{CELL_M, CellOccupancy};

impl Memory {
    /// Returns the content of the memory, with a path as cells of the map. Held and delivered objects
    /// have no position, so they are not contained.
    pub fn view(&self, path: &[usize]) -> MemoryView {
        let grid = self.map.grid();
        let objects =
            self.objects.iter().filter(|object| object.is_present && !object.is_out_of_play);
        MemoryView {
            map: ExploredMap {
                min: grid.center(0) - 0.5 * CELL_M,
                cell_m: CELL_M,
                n_columns: grid.nx(),
                cells: self.map.cells().map(|cell| explored(cell.state())).collect(),
            },
            objects: objects
                .map(|object| RememberedObject {
                    name: object.track.to_string(),
                    class: object.class,
                    position_in_world: object.position_in_world,
                    last_seen: object.last_seen,
                })
                .collect(),
            people: self
                .people
                .iter()
                .map(|person| RememberedPerson {
                    agent: person.agent,
                    position_in_world: person.position_in_world,
                    frame: person.frame,
                })
                .collect(),
            path: path.iter().map(|cell| grid.center(*cell)).collect(),
        }
    }
}

fn explored(occupancy: CellOccupancy) -> ExploredCell {
    match occupancy {
        CellOccupancy::Unknown => ExploredCell::Unknown,
        CellOccupancy::Free => ExploredCell::Free,
        CellOccupancy::Occupied | CellOccupancy::Wall => ExploredCell::Occupied,
    }
}
