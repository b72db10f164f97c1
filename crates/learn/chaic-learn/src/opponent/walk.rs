//! Current walk of the partner, and how well each place explains it.
//!
//! A person who walks to a place follows a short path. The detour over the present position
//! distinguishes likely from unlikely destinations (inverse planning). The constants are chosen by
//! hand and not tuned, because a learned model weights the features.

use std::collections::{BTreeMap, BTreeSet};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::belief::is_hidden;
use chaic_agents::mapping::{MappedObject, PersonMap};
use chaic_agents::memory::Memory;
use chaic_agents::planning::careful_costs::CarefulCosts;
use chaic_agents::planning::cost_map::CostMap;
use chaic_agents::planning::cost_model::{CostInputs, CostModel as _};
use chaic_agents::planning::path::{CostField, Search};
use chaic_agents::track::TrackId;
use chaic_core::geom::to_xz;
use chaic_core::{AgentId, Briefing, Frame, Vec2};

/// The partner stands still while it moves by less than this, meters.
const STILL_M: f32 = 0.15;
/// A walk ends after this time at one position, frames.
const MAX_STILL_FRAMES: Frame = 45;
/// A walk ends if the partner is not seen for longer than this, frames.
const MAX_UNSEEN_FRAMES: Frame = 120;
/// Range in which the partner notices objects in any direction, meters (as in the belief of `infer`).
const NOTICE_M: f32 = 5.0;
/// Range in which the partner notices objects ahead, and in all directions during its first full
/// turn, meters. Beyond it, small objects are hardly visible.
const NOTICE_AHEAD_M: f32 = 10.0;
/// Cosine of half the camera's view angle.
const AHEAD_COS: f32 = 0.7;
/// End of the full turn with which the partner begins an episode, frames.
const FIRST_TURN_END: Frame = 60;
/// Maximum distances between a person and the middle of the object that the person uses, meters:
/// first for small objects and tables, then for a truck.
const BESIDE_M: [f32; 2] = [1.5, 4.0];
/// Minimum length by which progress is divided, meters.
const MIN_WALK_M: f32 = 0.3;

/// Walk of the partner since its last stop or interaction.
#[derive(Clone, Debug, Default)]
pub struct PartnerWalk {
    /// First and last observed position (x, z) of the walk.
    ends: Option<[Vec2; 2]>,
    last_seen: Frame,
    /// Position at which the partner stands, and the frame of its arrival.
    stop: (Vec2, Frame),
    /// Numbers of ended interactions and held objects.
    n_events: (usize, usize),
    /// Objects that the partner has been near, or walked towards, without a wall between.
    noticed: BTreeSet<TrackId>,
    map: Option<WalkMap>,
    /// Path costs from the start of the walk, and the version of the map costs from which they were
    /// computed.
    from_start: Option<(CostField, u32)>,
}

impl PartnerWalk {
    /// Adds an observation; `partner` is its position (x, z), if visible.
    pub fn observe(&mut self, memory: &Memory, behavior: &BehaviorLog, partner: Option<Vec2>) {
        let Some(at) = partner else { return };
        let now = memory.frame;
        let ended =
            behavior.actions.iter().filter(|a| a.agent == AgentId::PARTNER && a.outcome.is_some());
        let n_events = (ended.count(), behavior.partner_holds.len());
        let stands = self.ends.is_some() && at.distance(self.stop.0) < STILL_M;
        if !stands {
            self.stop = (at, now);
        }
        let is_over = n_events != self.n_events
            || now > self.last_seen + MAX_UNSEEN_FRAMES
            || now > self.stop.1 + MAX_STILL_FRAMES;
        let start = self.ends.filter(|_| !is_over).map_or(at, |[start, _]| start);
        if self.ends.is_none() || is_over {
            self.from_start = None;
        }
        let direction =
            self.ends.map_or(Vec2::ZERO, |[_, before]| (at - before).normalize_or_zero());
        self.ends = Some([start, at]);
        (self.last_seen, self.n_events) = (now, n_events);
        for object in resting_objects(memory) {
            let object_at = to_xz(object.position_in_world);
            let is_ahead = now < FIRST_TURN_END
                || (object_at - at).normalize_or_zero().dot(direction) > AHEAD_COS;
            let range_m = if is_ahead { NOTICE_AHEAD_M } else { NOTICE_M };
            if at.distance(object_at) < range_m && !is_hidden(memory, at, object_at) {
                self.noticed.insert(object.track);
            }
        }
    }

    /// Returns the time for which the partner has stood at one position when last seen, frames.
    pub fn standing_frames(&self) -> Frame {
        self.last_seen.saturating_sub(self.stop.1)
    }

    /// Returns whether the partner has probably noticed the object.
    pub fn has_noticed(&self, track: TrackId) -> bool {
        self.noticed.contains(&track)
    }

    /// Computes the path lengths from both ends of the walk to these objects on the observer's map;
    /// `None` before the first sighting.
    pub fn paths<'a>(
        &mut self,
        memory: &Memory,
        objects: impl Iterator<Item = &'a MappedObject>,
    ) -> Option<WalkPaths> {
        let [start, here] = self.ends?;
        let WalkMap { costs, search, .. } = WalkMap::updated(&mut self.map, memory, here);
        let grid = costs.grid();
        let here_cell = grid.cell_at(here).unwrap_or(usize::MAX);
        let cells: Vec<(TrackId, usize)> = objects
            .filter_map(|object| Some((object.track, cell_beside(costs, object)?)))
            .collect();
        let mut wanted: Vec<usize> = cells.iter().map(|(_, cell)| *cell).collect();
        let from_here = CostField::until_final(costs, here, search, &wanted);
        wanted.push(here_cell);
        let version = costs.version();
        let is_current = |(field, of_version): &(CostField, u32)| {
            *of_version == version && wanted.iter().all(|cell| field.is_final(*cell))
        };
        let from_start = match self.from_start.take().filter(is_current) {
            Some((field, _)) => field,
            None if start == here => from_here.clone(),
            None => CostField::until_final(costs, start, search, &wanted),
        };
        let walked = from_start.cost(here_cell);
        let walked_m = walked.map_or_else(|| start.distance(here), CostField::meters);
        let relation = |cell: usize| {
            let meters = |field: &CostField| field.cost(cell).map(CostField::meters);
            let (initial_m, remaining_m) = (meters(&from_start)?, meters(&from_here)?);
            let progress = (initial_m - remaining_m) / walked_m.max(MIN_WALK_M);
            Some(Destination {
                initial_m,
                remaining_m,
                detour_m: (walked_m + remaining_m - initial_m).max(0.0),
                progress: progress.clamp(-1.0, 1.0),
            })
        };
        let destinations =
            cells.iter().filter_map(|(track, cell)| Some((*track, relation(*cell)?))).collect();
        self.from_start = Some((from_start, version));
        Some(WalkPaths { walked_m, destinations })
    }
}

/// Costs of the observer's map without people, since the partner does not avoid itself.
#[derive(Clone, Debug)]
struct WalkMap {
    costs: CostMap,
    /// Versions of the occupancy map and of the object layout in the costs.
    layout: Option<(u32, u32)>,
    search: Search,
}

impl WalkMap {
    /// Returns the current costs for a body at this position (x, z).
    fn updated<'a>(map: &'a mut Option<WalkMap>, memory: &Memory, at: Vec2) -> &'a mut WalkMap {
        let grid = *memory.costs().grid();
        let map = map.get_or_insert_with(|| WalkMap {
            costs: CostMap::new(grid, memory.costs().radius_m()),
            layout: None,
            search: Search::new(grid.n_cells()),
        });
        let layout = Some((memory.map.version(), memory.objects.layout_version()));
        if map.layout != layout {
            map.layout = layout;
            let inputs = CostInputs {
                people: &PersonMap::default(),
                map: &memory.map,
                objects: &memory.objects,
                avoids_obstacles: true,
                position: at,
                now: memory.frame,
            };
            CarefulCosts.recompute(&mut map.costs, &inputs);
        }
        map
    }
}

/// Returns the cell nearest to the middle of an object at which a body has room.
fn cell_beside(costs: &CostMap, object: &MappedObject) -> Option<usize> {
    let at = to_xz(object.position_in_world);
    let grid = costs.grid();
    BESIDE_M.into_iter().find_map(|radius_m| {
        let roomy = grid.disc(at, radius_m).filter(|cell| !costs.touches_obstacle(*cell));
        roomy.min_by(|a, b| grid.center(*a).distance(at).total_cmp(&grid.center(*b).distance(at)))
    })
}

/// Relations of a walk to places.
#[derive(Clone, Debug)]
pub struct WalkPaths {
    /// Shortest path between the ends of the walk, meters.
    pub walked_m: f32,
    destinations: BTreeMap<TrackId, Destination>,
}

/// Relation of a walk to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Destination {
    /// Shortest path from the start of the walk to the place, meters.
    pub initial_m: f32,
    /// Shortest path to the place, meters.
    pub remaining_m: f32,
    /// Detour, meters: the length of the path over the present position minus the shortest path
    /// from the start of the walk.
    pub detour_m: f32,
    /// Decrease of the remaining path per length of the walk, -1 to 1.
    pub progress: f32,
}

impl WalkPaths {
    /// Returns the relation to the place of an object; `None` if no path is known.
    pub fn destination(&self, object: &MappedObject) -> Option<Destination> {
        self.destinations.get(&object.track).copied()
    }
}

/// Returns the objects that probably still rest where they were last seen.
pub(super) fn resting_objects(memory: &Memory) -> impl Iterator<Item = &MappedObject> {
    memory
        .objects
        .iter()
        .filter(|t| t.is_present && !t.is_out_of_play && t.held_until <= memory.frame)
}

/// Returns known goal places.
pub(super) fn goal_places<'a>(
    memory: &'a Memory,
    briefing: &'a Briefing,
) -> impl Iterator<Item = &'a MappedObject> {
    memory.objects.iter().filter(|t| briefing.goal_places.contains(&t.class))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_agents::PlannerRules;
    use chaic_agents::perception::Detection;
    use chaic_core::{ClassId, TaskId, Vec3};

    use crate::test_support::start;

    /// Otherwise the features would depend on the frames at which the model was queried.
    #[test]
    fn both_ends_of_a_walk_are_on_the_present_map() {
        let (briefing, _) = start(TaskId::LowTarget);
        let mut memory = Memory::new(&briefing, PlannerRules::paper());
        let grid = *memory.map.grid();
        let walk_start = grid.center(grid.cell_at(briefing.bounds.center()).unwrap());
        let [here, apple_at] = [0.5, 1.5].map(|m| walk_start + Vec2::new(m, 0.0));
        let apple = Detection {
            track: TrackId(1),
            class: ClassId::named("apple"),
            confidence: 1.0,
            person: None,
            pixel: [0, 0],
            position_in_world: Vec3::new(apple_at.x, 0.5, apple_at.y),
            bottom_m: 0.45,
            top_m: 0.55,
            n_pixels: 50,
            footprint: vec![apple_at],
        };
        memory.objects.update(&[apple], &[], 0, 0);
        let behavior = BehaviorLog::default();
        let destination = |walk: &mut PartnerWalk, memory: &Memory| {
            let paths = walk.paths(memory, resting_objects(memory)).unwrap();
            paths.destination(memory.objects.get(TrackId(1)).unwrap()).unwrap()
        };
        let mut asked_early = PartnerWalk::default();
        asked_early.observe(&memory, &behavior, Some(walk_start));
        let mut asked_late = asked_early.clone();
        let first = destination(&mut asked_early, &memory);
        // The helper bumps into something at the start of the walk.
        memory.frame = 10;
        memory.map.record_bump(walk_start, memory.frame, 1000);
        let [early, late] = [&mut asked_early, &mut asked_late].map(|walk| {
            walk.observe(&memory, &behavior, Some(here));
            destination(walk, &memory)
        });
        assert_eq!(early, late);
        assert!(late.initial_m > first.initial_m, "{first:?} {late:?}");
    }
}
