//! What a mind remembers: the plan of the place, what is where, who was where, what was done.

pub mod grid;
pub mod occupancy;
pub mod people;
pub mod semantic;

pub mod costs;
pub mod lattice_costs;

use std::collections::BTreeSet;
use std::sync::Arc;

use chaic_protocol::briefing::Relation;
use chaic_protocol::capability::Gait;
use chaic_protocol::geom::{Pose, horizontal_distance, xz};
use chaic_protocol::{
    Action, AgentId, Briefing, ClassId, EntityId, Frame, Observation, Outcome, Vec2, Vec3,
};

pub use grid::{CELL_M, Grid};
pub use occupancy::{OccupancyMap, Space};
pub use people::{People, Person};
pub use semantic::{SemanticMap, Thing};

use crate::execution::path::{Reach, Search};
use crate::perception::Percepts;
use crate::rules::{Exploration, PlannerRules, Walking};
use costs::CostMap;

/// A top may look this much lower than it is, metres.
const TOP_TOLERANCE_M: f32 = 0.1;
/// From this near to a thing it counts as reached when distances are estimated, metres.
const NEAR_THING_M: f32 = 1.5;

/// One own action that ended, for the record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Done {
    /// When it had ended.
    pub frame: Frame,
    /// What it was.
    pub action: Action,
    /// How it ended.
    pub outcome: Outcome,
}

/// All that one mind remembers of its episode.
#[derive(Clone, Debug)]
pub struct Memory {
    /// By which rules its owner plans.
    pub rules: PlannerRules,
    /// When it was updated last.
    pub frame: Frame,
    /// Where the own body is.
    pub pose: Pose,
    /// What stands firmly.
    pub map: OccupancyMap,
    /// What is where.
    pub things: SemanticMap,
    /// Who was where.
    pub people: People,
    /// What is known to be delivered.
    pub delivered: BTreeSet<EntityId>,
    /// The own actions other than moving about, oldest first.
    pub history: Vec<Done>,
    classes: Option<Arc<Vec<Option<ClassId>>>>,
    height_m: f32,
    goal_place: ClassId,
    goal_place_min_top_m: f32,
    costs: CostMap,
    costs_of: Option<(u32, u32)>,
    people_moved: bool,
    /// Whether anything was taken in since costs were computed last.
    is_stale: bool,
    is_partner: bool,
    gait: Gait,
    removes_obstacles: bool,
    reach: Option<Reach>,
    search: Search,
}

impl Memory {
    /// Nothing remembered yet.
    pub fn new(briefing: &Briefing, rules: PlannerRules) -> Memory {
        let map = OccupancyMap::new(&briefing.bounds);
        let costs = CostMap::new(*map.grid(), briefing.capability.radius_m);
        Memory {
            rules,
            frame: 0,
            pose: Pose::default(),
            things: SemanticMap::default(),
            people: People::default(),
            delivered: BTreeSet::new(),
            history: Vec::new(),
            classes: None,
            height_m: briefing.capability.height_m,
            goal_place: briefing.goal_place,
            goal_place_min_top_m: briefing.goal_place_min_top_m,
            search: Search::new(map.grid().n_cells()),
            map,
            costs,
            costs_of: None,
            people_moved: true,
            is_stale: true,
            is_partner: briefing.me == AgentId::PARTNER,
            gait: briefing.capability.gait,
            removes_obstacles: briefing.capability.removes_obstacles,
            reach: None,
        }
    }

    /// Takes in one observation.
    pub fn update(&mut self, briefing: &Briefing, observation: &Observation, percepts: &Percepts) {
        let before = self.frame;
        if self.classes.is_none() {
            self.classes.clone_from(&observation.granted.classes);
        }
        self.frame = observation.frame;
        self.pose = observation.own.pose;
        let seen = if self.rules.sees_people(briefing) { &percepts.detections[..] } else { &[] };
        self.people.see(briefing, observation, seen);
        self.people_moved = self.people.iter().any(|p| p.frame + 60 > self.frame);
        let in_view: Vec<Vec3> =
            self.people.iter().filter(|p| p.is_in_view).map(|p| p.position_in_world).collect();
        let hands_at = if self.rules.sees_holding { &in_view[..] } else { &[] };
        self.things.see(&percepts.detections, hands_at, self.frame);
        if self.rules.forgets_missing {
            self.things.forget_missing(observation);
        }
        self.things.expire(before, self.frame);
        for held in observation.own.held() {
            self.things.mark_absent(held.entity);
            for (entity, _) in &held.contents {
                self.things.mark_absent(*entity);
            }
        }
        for hands in observation.granted.partner_hands.iter() {
            for held in hands.iter().flatten() {
                self.things.mark_held(held.entity, self.frame + self.rules.held_frames);
                for (entity, _) in &held.contents {
                    self.things.mark_held(*entity, self.frame + self.rules.held_frames);
                }
            }
        }
        for obstacle in &observation.removed {
            self.things.mark_gone(*obstacle);
        }
        if let Some(delivered) = &observation.delivered {
            for entity in delivered {
                if self.delivered.insert(*entity) {
                    self.things.mark_gone(*entity);
                }
            }
        }
        for entity in &self.delivered {
            self.things.mark_gone(*entity);
        }
        if let Some((action, outcome)) = observation.own.last
            && action.subject().is_some()
        {
            self.history.push(Done { frame: self.frame, action, outcome });
        }
        let known_m = self.rules.known_range_m(briefing);
        self.map.integrate(observation, percepts, self.height_m, known_m);
        self.reach = None;
        self.is_stale = true;
    }

    /// Whether its owner, who can't clear obstacles away, waits before them until somebody has
    /// (original facts 1.6).
    pub fn waits_for_obstacles(&self) -> bool {
        !self.removes_obstacles
    }

    /// Whether its owner goes to where the goal place was when the plan began, whatever it sees of
    /// it since (original facts 2.4).
    pub fn keeps_goal_in_mind(&self) -> bool {
        self.is_partner && self.gait == Gait::WalkBike
    }

    /// Brings costs and distances up to date. Cheap if nothing changed.
    pub fn refresh(&mut self) {
        self.refresh_costs();
        let needs_reach = self.rules.walking == Walking::Careful
            || self.rules.exploration == Exploration::Frontier;
        if needs_reach && self.reach.is_none() {
            self.reach = Some(Reach::from(&self.costs, self.here(), &mut self.search));
        }
    }

    fn refresh_costs(&mut self) {
        if self.rules.walking == Walking::Lattice {
            let Memory { map, things, people, .. } = self;
            let (heeds_obstacles, now) = (self.is_partner, self.frame);
            let seen = lattice_costs::Seen { map, things, people, heeds_obstacles, now };
            if std::mem::take(&mut self.is_stale) {
                self.costs.rebuild_lattice(&seen);
            }
            return;
        }
        let of = (self.map.version(), self.things.layout());
        if self.costs_of != Some(of) || self.people_moved {
            let here = self.here();
            self.costs.rebuild(&self.map, &self.things, &self.people, here, self.frame);
            self.costs_of = Some(of);
            self.people_moved = false;
            self.reach = None;
        }
    }

    /// The present costs, and working space for a search on them.
    pub fn costs_and_search(&mut self) -> (&CostMap, &mut Search) {
        self.refresh_costs();
        (&self.costs, &mut self.search)
    }

    /// Costs as of the last [`Memory::refresh`].
    pub fn costs(&self) -> &CostMap {
        &self.costs
    }

    /// The class of an object, if it was seen or granted.
    pub fn class_of(&self, entity: EntityId) -> Option<ClassId> {
        let granted = || self.classes.as_ref()?.get(usize::from(entity.0)).copied()?;
        self.things.get(entity).map(|t| t.class).or_else(granted)
    }

    /// Where one stands (x, z).
    pub fn here(&self) -> Vec2 {
        xz(self.pose.position)
    }

    /// How costly each cell is to get to, as of the last [`Memory::refresh`].
    pub fn reach(&self) -> Option<&Reach> {
        self.reach.as_ref()
    }

    /// Length of the way to a thing, metres, made longer by narrow and unknown places; `None` if
    /// no way is known. Straight distance before the first [`Memory::refresh`].
    pub fn way_to(&self, thing: &Thing) -> Option<f32> {
        let straight_m = thing.distance_from(self.here());
        let reach = self.reach.as_ref().filter(|_| self.rules.walking == Walking::Careful);
        let Some(reach) = reach else { return Some(straight_m) };
        let grid = self.map.grid();
        let near = |p: Vec2| grid.disc(p, NEAR_THING_M).filter_map(|c| reach.cost(c)).min();
        let at = near(thing.nearest_point(self.here()));
        // The nearest point of a long thing may be behind a wall: ask for its middle too.
        let cost = at.into_iter().chain(near(xz(thing.position_in_world))).min()?;
        Some(Reach::metres(cost).max(straight_m))
    }

    /// The known goal places that one can get to, nearest first, with the way to each in metres;
    /// those that were given up lately come last.
    pub fn goal_places(&self) -> Vec<(&Thing, f32)> {
        let mut places: Vec<_> = self
            .things
            .iter()
            .filter(|t| t.class == self.goal_place && t.is_present)
            .filter(|t| self.rules.goal_blackout_frames == 0 || self.frame >= t.ignore_until)
            .filter(|t| t.top_m + TOP_TOLERANCE_M >= self.goal_place_min_top_m)
            .filter_map(|t| Some((t, self.way_to(t)?)))
            .collect();
        let is_given_up = |t: &Thing| self.frame < t.ignore_until;
        places.sort_by(|a, b| is_given_up(a.0).cmp(&is_given_up(b.0)).then(a.1.total_cmp(&b.1)));
        places
    }

    /// Whether child and partner look too far apart: both in view, or both seen a moment ago
    /// (original facts 2.1, 2.4).
    pub fn child_is_away(&self, briefing: &Briefing) -> bool {
        const APART_SEEN_M: f32 = 3.5;
        const APART_REMEMBERED_M: f32 = 5.5;
        const FRESH_FRAMES: Frame = 50;
        let companions =
            [Relation::Partner, Relation::Child].map(|relation| self.companion(briefing, relation));
        let [Some(partner), Some(child)] = companions else { return false };
        let apart_m = horizontal_distance(partner.position_in_world, child.position_in_world);
        let are_in_view = partner.is_in_view && child.is_in_view;
        let are_fresh = partner.frame.min(child.frame) + FRESH_FRAMES > self.frame;
        (are_in_view && apart_m > APART_SEEN_M) || (are_fresh && apart_m > APART_REMEMBERED_M)
    }

    /// The last sighting of the companion of this relation.
    pub fn companion(&self, briefing: &Briefing, relation: Relation) -> Option<&Person> {
        self.people.get(briefing.companion(relation)?)
    }
}
