//! Floors and ceilings in rectangles: parts of overlapping floors that are visible from above, and
//! ceilings in and between rooms.

use chaic_core::geom::Rect;

use crate::setup::{Floor, RoomKind, Setup};

impl Setup {
    /// Maximum number of [`Setup::floor_pieces`]; each is a mesh of its own. Our choice: far more
    /// than any generated or imported place has.
    pub const MAX_FLOOR_PIECES: usize = 4096;

    /// Splits the floors into disjoint pieces: where two overlap, the later one covers the earlier.
    /// Returns `None` if there are more than [`Setup::MAX_FLOOR_PIECES`].
    pub fn floor_pieces(&self) -> Option<Vec<Floor>> {
        let mut pieces: Vec<Floor> = Vec::new();
        for floor in &self.floors {
            let mut remaining = Vec::new();
            for piece in pieces {
                subtract_rect(&piece.rect, &floor.rect, |rect| {
                    remaining.push(Floor { rect, ..piece });
                });
            }
            remaining.push(*floor);
            if remaining.len() > Setup::MAX_FLOOR_PIECES {
                return None;
            }
            pieces = remaining;
        }
        Some(pieces)
    }

    /// Maximum number of rectangles of ceiling between rooms, as [`Setup::MAX_FLOOR_PIECES`].
    pub const MAX_CEILING_PIECES: usize = 4096;

    /// Returns the ceilings of rooms, and of the area between them and the outermost walls:
    /// doorways and alcoves belong to no room. Returns `None` if there are more than
    /// [`Setup::MAX_CEILING_PIECES`] between rooms.
    pub fn ceiling_pieces(&self) -> Option<Vec<Rect>> {
        /// Overlap of ceilings with walls, meters: rooms end at the faces of walls.
        const WALL_OVERLAP_M: f32 = 0.15;
        let rooms = self.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors);
        let mut pieces: Vec<Rect> = rooms.map(|r| r.rect.expanded(WALL_OVERLAP_M)).collect();
        let ends = self.walls.iter().flat_map(|w| [w.a, w.b]);
        let house = ends.fold(self.bounds, |r, p| Rect { min: r.min.min(p), max: r.max.max(p) });
        let mut between = vec![house];
        for room in &pieces {
            let mut remaining = Vec::new();
            for rect in between {
                subtract_rect(&rect, room, |piece| remaining.push(piece));
            }
            if remaining.len() > Setup::MAX_CEILING_PIECES {
                return None;
            }
            between = remaining;
        }
        // They overlap the ceilings of rooms by a millimeter, so that no pixel falls between them.
        pieces.extend(between.iter().map(|r| r.expanded(0.001)));
        Some(pieces)
    }
}

/// Calls `keep` with the parts of `rect` outside of `hole`, at most four.
fn subtract_rect(rect: &Rect, hole: &Rect, mut keep: impl FnMut(Rect)) {
    let (low, high) = (rect.min.max(hole.min), rect.max.min(hole.max));
    if low.x >= high.x || low.y >= high.y {
        keep(*rect);
        return;
    }
    let mut keep_some = |x0: f32, z0: f32, x1: f32, z1: f32| {
        if x1 > x0 && z1 > z0 {
            keep(Rect::new([x0, z0], [x1, z1]));
        }
    };
    keep_some(rect.min.x, rect.min.y, low.x, rect.max.y);
    keep_some(high.x, rect.min.y, rect.max.x, rect.max.y);
    keep_some(low.x, rect.min.y, high.x, low.y);
    keep_some(low.x, high.y, high.x, rect.max.y);
}
