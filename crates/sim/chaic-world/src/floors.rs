//! Parts of overlapping floors that are visible from above.

use chaic_core::geom::Rect;

use crate::setup::{Floor, Setup};

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
}

/// Calls `keep` with the parts of `rect` outside of `hole`, at most four.
pub fn subtract_rect(rect: &Rect, hole: &Rect, mut keep: impl FnMut(Rect)) {
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
