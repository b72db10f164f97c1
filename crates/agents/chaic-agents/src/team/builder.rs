//! Builds a [`TeamProblem`] from the helper's memory and its beliefs.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::capability::{Capability, Gait, LimitPenalty, excess};
use chaic_core::geom::to_xz;
use chaic_core::{Briefing, ClassId, Role, Vec2};

use super::problem::{
    GoalHypothesis, MAX_CLASSES, MAX_PLACES, NO_PATH_M, Place, PlaceKind, TeamMember, TeamProblem,
};
use super::travel::{TravelCache, trace};
use crate::mapping::MappedObject;
use crate::mapping::passage::stands_in_passage;
use crate::memory::Memory;
use crate::planning::path::PathCosts;
use crate::rules::RuleProfile;
use crate::track::TrackId;

/// Ratio of the length of a walked path to the traced one. Measured in `gen-standard:7000..7010`.
const DETOUR: f32 = 1.15;
/// Mean speed on a path relative to full speed: turns and starts. Measured as above.
const MEAN_SPEED: f32 = 0.9;
/// Range in which the partner notices objects, meters. Ours: 70 % of the original's 10 m visibility
/// limit, since the partner rarely looks straight at an object.
const NOTICE_M: f32 = 7.0;
/// Path cells nearer than this to an obstacle are blocked by it for a wheelchair, meters.
const OBSTACLE_M: f32 = 0.75;
/// Path length to a place without a known path: factor of the straight line, and meters added.
const UNKNOWN_PATH: (f32, f32) = (1.5, 1.0);
/// Time reserve at the end of the episode, frames.
const MARGIN_FRAMES: f32 = 40.0;
/// Maximum number of containers in a problem: the nearest ones.
const MAX_CONTAINERS: usize = 3;

/// Belief of the planner about the partner.
#[derive(Clone, Debug, PartialEq)]
pub struct PartnerModel {
    /// Its body.
    pub capability: Capability,
    /// Position (x, z) now, meters, as far as known.
    pub position: Option<Vec2>,
    /// Objects that it holds: track and class, contents included.
    pub holds: Vec<(TrackId, ClassId)>,
    /// Possible goals: probability, and wanted number of each class, delivered ones included.
    pub goals: Vec<(f32, BTreeMap<ClassId, f32>)>,
}

/// Builds problems; keeps path lengths and what the partner has seen between decisions.
#[derive(Clone, Debug, Default)]
pub struct ProblemBuilder {
    travel: TravelCache,
    seen_by_partner: BTreeSet<TrackId>,
    /// Versions of the occupancy map and of the object layout, and the known obstacles.
    layout: Option<(u32, u32, Vec<TrackId>)>,
    epoch: u64,
}

impl ProblemBuilder {
    /// Records the objects that the partner can see from where it stands (x, z). Its direction is
    /// unknown, so it may look anywhere.
    pub fn observe_partner(&mut self, memory: &Memory, position: Vec2) {
        let grid = memory.map.grid();
        for object in memory.objects.iter().filter(|o| o.is_present) {
            let at = to_xz(object.position_in_world);
            let is_near = at.distance(position) <= NOTICE_M;
            if is_near && !grid.line(position, at).any(|c| memory.costs().is_wall(c)) {
                self.seen_by_partner.insert(object.track);
            }
        }
    }

    /// Builds the problem of the rest of the episode; `None` without a goal place or paths.
    pub fn build(
        &mut self,
        briefing: &Briefing,
        memory: &Memory,
        partner: &PartnerModel,
    ) -> Option<TeamProblem> {
        let path_costs = memory.path_costs()?;
        let classes = goal_classes(partner);
        let mut places = self.places(briefing, memory, partner, &classes, path_costs);
        if !places.iter().any(|p| p.kind == PlaceKind::Goal) {
            return None;
        }
        if places.len() > MAX_PLACES {
            places.sort_by_key(|place| place.kind != PlaceKind::Goal);
            places.truncate(MAX_PLACES);
        }
        let helper = helper_worker(briefing, memory, &classes);
        let capacity = briefing.container_capacity as usize;
        let partner_worker = partner.position.map(|_| partner_worker(partner, &classes, capacity));
        let obstacles: Vec<usize> =
            (0..places.len()).filter(|i| places[*i].kind == PlaceKind::Obstacle).collect();
        let (path_m, obstacles_on_path) = self.paths(memory, partner, &places, &obstacles);
        let delivered = |class: ClassId| {
            let of_class = |t: &&TrackId| memory.class_of(**t) == Some(class);
            memory.delivered.iter().filter(of_class).count() as f32
        };
        let hypotheses = partner.goals.iter().map(|(probability, wanted)| GoalHypothesis {
            probability: *probability,
            missing: classes
                .iter()
                .map(|c| (wanted.get(c).copied().unwrap_or(0.0) - delivered(*c)).max(0.0))
                .collect(),
        });
        let frames_left = briefing.horizon.saturating_sub(memory.frame) as f32 - MARGIN_FRAMES;
        Some(TeamProblem {
            hypotheses: hypotheses.collect(),
            places,
            path_m,
            obstacles_on_path,
            classes,
            frames_left: frames_left.max(0.0),
            horizon: briefing.horizon as f32,
            helper,
            partner: partner_worker,
            container_capacity: capacity,
            rules: memory.rules,
        })
    }

    fn places(
        &mut self,
        briefing: &Briefing,
        memory: &Memory,
        partner: &PartnerModel,
        classes: &[ClassId],
        path_costs: PathCosts<'_>,
    ) -> Vec<Place> {
        let goals: BTreeSet<TrackId> =
            memory.goal_places().iter().map(|(object, _)| object.track).collect();
        let now = memory.frame;
        let is_held = |track: TrackId| partner.holds.iter().any(|(held, _)| *held == track);
        let kind = |object: &MappedObject| {
            if goals.contains(&object.track) {
                return Some(PlaceKind::Goal);
            }
            if !object.is_available(now) || is_held(object.track) {
                return None;
            }
            match object.class.info().role {
                Role::Container if briefing.containers.contains(&object.class) => {
                    Some(PlaceKind::Container)
                }
                Role::Obstacle => {
                    stands_in_passage(&memory.map, object).then_some(PlaceKind::Obstacle)
                }
                _ => classes.contains(&object.class).then_some(PlaceKind::Target),
            }
        };
        let found: Vec<(PlaceKind, &MappedObject)> = memory
            .objects
            .iter()
            .filter(|o| o.is_present && !o.is_out_of_play)
            .filter_map(|o| Some((kind(o)?, o)))
            .collect();
        self.start_epoch(memory, &found);
        let mut places = Vec::new();
        for (kind, object) in found {
            let within_m = match kind {
                PlaceKind::Goal => memory.rules.put_within_m,
                _ => memory.rules.pick_within_m,
            };
            let arm_m = memory.motion.arm_reach_m;
            let stand = self.travel.stand(path_costs, object, within_m, arm_m);
            let Some(stand) = stand else { continue };
            let body = &partner.capability;
            let partner_chance = match kind {
                PlaceKind::Goal => LimitPenalty::PUT.chance(excess(object.top_m, body.put_range_m)),
                _ => LimitPenalty::PICK.chance(excess(object.top_m, body.pick_range_m)),
            };
            let is_known = kind == PlaceKind::Goal || self.seen_by_partner.contains(&object.track);
            places.push(Place {
                track: object.track,
                class: object.class,
                kind,
                class_index: classes.iter().position(|c| *c == object.class),
                position: to_xz(object.position_in_world),
                stand,
                is_known_to_partner: is_known,
                partner_chance,
            });
        }
        keep_nearest_containers(&mut places, memory.position());
        places
    }

    /// Starts a new epoch of path lengths when the layout of large objects has changed, or obstacles
    /// came or went.
    fn start_epoch(&mut self, memory: &Memory, found: &[(PlaceKind, &MappedObject)]) {
        let obstacles = found.iter().filter(|(kind, _)| *kind == PlaceKind::Obstacle);
        let obstacles: Vec<TrackId> = obstacles.map(|(_, object)| object.track).collect();
        let layout = (memory.map.version(), memory.objects.layout_version(), obstacles);
        if self.layout.as_ref() != Some(&layout) {
            self.layout = Some(layout);
            self.epoch += 1;
        }
        self.travel.start(self.epoch);
    }

    fn paths(
        &mut self,
        memory: &Memory,
        partner: &PartnerModel,
        places: &[Place],
        obstacles: &[usize],
    ) -> (Vec<Vec<f32>>, Vec<Vec<u64>>) {
        let costs = memory.costs();
        let n = places.len();
        let at_obstacles: Vec<Vec2> = obstacles.iter().map(|i| places[*i].position).collect();
        let all_obstacles = obstacles.iter().fold(0_u64, |bits, i| bits | 1 << i);
        let to_places = |bits: u64| {
            let set = obstacles.iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1);
            set.fold(0_u64, |all, (_, place)| all | 1 << place)
        };
        let mut path_m = vec![vec![NO_PATH_M; n]; n + 2];
        let mut on_path = vec![vec![0; n]; n + 2];
        for from in 0..n + 2 {
            let (key, origin) = match from {
                i if i < n => (places[i].track.0, places[i].stand),
                i if i == n => (u32::MAX, memory.position()),
                _ => match partner.position {
                    Some(at) => (u32::MAX - 1, at),
                    None => continue,
                },
            };
            let stands = places.iter().map(|place| place.stand);
            let field = self.travel.field(costs, key, origin, stands);
            for to in (0..n).filter(|to| *to != from) {
                let stand = places[to].stand;
                match trace(costs, field, stand, &at_obstacles, OBSTACLE_M) {
                    Some(travel) => {
                        path_m[from][to] = DETOUR * travel.length_m.max(0.2);
                        on_path[from][to] = to_places(travel.obstacles);
                    }
                    None => {
                        let (factor, extra_m) = UNKNOWN_PATH;
                        path_m[from][to] = factor * origin.distance(stand) + extra_m;
                        on_path[from][to] = all_obstacles;
                    }
                }
            }
            if from < n {
                path_m[from][from] = 0.0;
            }
        }
        (path_m, on_path)
    }
}

/// Returns all classes that some possible goal wants, in the order of the catalogue.
fn goal_classes(partner: &PartnerModel) -> Vec<ClassId> {
    let wanted = partner.goals.iter().flat_map(|(_, wanted)| wanted.keys().copied());
    let classes: BTreeSet<ClassId> = wanted.collect();
    classes.into_iter().take(MAX_CLASSES - 1).collect()
}

fn keep_nearest_containers(places: &mut Vec<Place>, from: Vec2) {
    let mut distances: Vec<f32> = places
        .iter()
        .filter(|p| p.kind == PlaceKind::Container)
        .map(|p| p.stand.distance(from))
        .collect();
    distances.sort_by(f32::total_cmp);
    if let Some(limit) = distances.get(MAX_CONTAINERS) {
        places.retain(|p| p.kind != PlaceKind::Container || p.stand.distance(from) < *limit);
    }
}

fn helper_worker(briefing: &Briefing, memory: &Memory, classes: &[ClassId]) -> TeamMember {
    let body = &briefing.capability;
    let index = |class: &ClassId| classes.iter().position(|c| c == class);
    let (mut loose, mut contained) = (Vec::new(), None);
    for held in memory.hands.held() {
        let Some((_, class)) = held.object else { continue };
        match class.info().role {
            Role::Container => {
                contained = Some(held.contents.iter().filter_map(|(_, c)| index(c)).collect());
            }
            // An object that no goal wants still fills the hand.
            _ => loose.push(index(&class).unwrap_or(MAX_CLASSES - 1)),
        }
    }
    TeamMember {
        speed_m_per_frame: MEAN_SPEED * body.speed_m_per_frame,
        docking_frames: 0.0,
        loose,
        contained,
        n_loose: body.hands.all().len(),
        carries_containers: body.carries_containers,
        is_blocked: false,
        deliver_below: RuleProfile::PARTNER.deliver_below,
    }
}

fn partner_worker(partner: &PartnerModel, classes: &[ClassId], capacity: usize) -> TeamMember {
    let body = &partner.capability;
    let is_rider = body.gait == Gait::WalkBike;
    let profile = if is_rider { RuleProfile::RIDER } else { RuleProfile::PARTNER };
    let index = |class: &ClassId| classes.iter().position(|c| c == class);
    let has_container = partner.holds.iter().any(|(_, c)| c.info().role == Role::Container);
    let carried: Vec<usize> = partner.holds.iter().filter_map(|(_, c)| index(c)).collect();
    TeamMember {
        speed_m_per_frame: MEAN_SPEED * body.speed_m_per_frame,
        docking_frames: body.docking_frames as f32,
        contained: has_container.then(|| carried.clone()),
        loose: if has_container { Vec::new() } else { carried },
        n_loose: if is_rider { capacity } else { body.hands.all().len() },
        carries_containers: body.carries_containers && !is_rider,
        is_blocked: !body.removes_obstacles,
        deliver_below: profile.deliver_below,
    }
}

#[cfg(test)]
mod tests;
