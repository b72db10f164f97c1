//! By what the cost of each cell is reckoned, and when anew: with care, or as the original does.

use chaic_core::{Frame, Vec2};

use super::costs::CostMap;
use crate::mapping::{OccupancyMap, People, SemanticMap};

/// What costs come from.
pub struct Seen<'a> {
    /// What stands firmly.
    pub map: &'a OccupancyMap,
    /// What is where.
    pub things: &'a SemanticMap,
    /// Who was where.
    pub people: &'a People,
    /// How much room is left around obstacles, by whoever heeds them.
    pub berth: Option<Berth>,
    /// Where one stands (x, z).
    pub here: Vec2,
    /// The present frame.
    pub now: Frame,
}

/// The room that is left around an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Berth {
    /// The original's: a square of cells around its middle.
    Wide,
    /// As much as a body of this radius, metres, needs to get past it (ours).
    Narrow(f32),
}

/// What has come since costs were computed last.
#[derive(Clone, Copy, Debug, Default)]
pub struct News {
    /// Anything was taken in.
    pub any: bool,
    /// What stands where has changed.
    pub layout: bool,
    /// Somebody was seen a moment ago.
    pub people: bool,
}

/// A way of reckoning costs.
pub trait CostModel: Sync {
    /// Whether such news asks for new costs.
    fn is_outdated_by(&self, news: News) -> bool;

    /// Computes all costs anew.
    fn rebuild(&self, costs: &mut CostMap, seen: &Seen<'_>);

    /// Whether a thing is as far as the way to it is long; else, as the crow flies.
    fn measures_ways(&self) -> bool;
}

/// Costs for a body of its true width.
#[derive(Clone, Copy, Debug)]
pub struct CarefulCosts;

impl CostModel for CarefulCosts {
    fn is_outdated_by(&self, news: News) -> bool {
        news.layout || news.people
    }

    fn rebuild(&self, costs: &mut CostMap, seen: &Seen<'_>) {
        costs.rebuild(seen);
    }

    fn measures_ways(&self) -> bool {
        true
    }
}

/// The original's (facts A1.5), see [`super::lattice_costs`].
#[derive(Clone, Copy, Debug)]
pub struct LatticeCosts;

impl CostModel for LatticeCosts {
    fn is_outdated_by(&self, news: News) -> bool {
        news.any
    }

    fn rebuild(&self, costs: &mut CostMap, seen: &Seen<'_>) {
        costs.rebuild_lattice(seen);
    }

    fn measures_ways(&self) -> bool {
        false
    }
}
