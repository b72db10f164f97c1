//! What a mind remembers: the plan of the place, what is where, who was where, what was done.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::briefing::{Motion, Relation};
use chaic_core::capability::Gait;
use chaic_core::geom::{Pose, Rect, horizontal_distance, xz};
use chaic_core::observation::{Grants, OtherEnd};
use chaic_core::{
    AgentId, Briefing, ClassId, FailureReason, Frame, Observation, Outcome, Role, Vec2, Vec3,
};

use crate::mapping::{OccupancyMap, People, Person, SemanticMap, Thing, hands};
use crate::perception::{Detection, Percepts};
use crate::planning::cost_model::{Berth, CarefulCosts, CostModel, LatticeCosts, News, Seen};
use crate::planning::costs::CostMap;
use crate::planning::path::{CostField, Search};
use crate::rules::{Exploration, FailureRules, PlannerRules, Walking};
use crate::track::{Hands, Intent, TrackId};

pub mod egocentric;

/// A top may look this much lower than it is, metres.
const TOP_TOLERANCE_M: f32 = 0.1;
/// From this near to a thing it counts as reached when distances are estimated, metres.
const NEAR_THING_M: f32 = 1.5;

/// What was put on the goal place lies still after so long at the latest, frames.
pub const SETTLE_FRAMES: Frame = 240;

/// One own action that ended, for the record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Done {
    /// When it had ended.
    pub frame: Frame,
    /// What it was.
    pub action: Intent,
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
    /// How bodies move and reach.
    pub motion: Motion,
    /// What stands firmly.
    pub map: OccupancyMap,
    /// What is where.
    pub things: SemanticMap,
    /// Who was where.
    pub people: People,
    /// What the own hands hold.
    pub hands: Hands,
    /// The own action that has just ended; set by the mind before each update.
    pub last: Option<(Intent, Outcome)>,
    /// What is known or believed to be delivered.
    pub delivered: BTreeSet<TrackId>,
    /// What was put on a goal place and has not been seen delivered since, with the place and when
    /// it was put there.
    believed: BTreeMap<TrackId, (TrackId, Frame)>,
    /// Places of the goal place's class on which something could not be put: too low, for example.
    failed_places: BTreeSet<TrackId>,
    /// Lowest and highest top that the own hands put something on, metres.
    put_range_m: [f32; 2],
    /// The own actions other than moving about, oldest first.
    pub history: Vec<Done>,
    /// The class of each track that ever came up.
    classes: BTreeMap<TrackId, ClassId>,
    height_m: f32,
    goal_places: Vec<ClassId>,
    goal_place_min_top_m: f32,
    costs: CostMap,
    costs_of: Option<(u32, u32)>,
    people_moved: bool,
    /// Nobody gets out of this.
    pub bounds: Rect,
    /// Who carries along what one leads with.
    pub other_end: Option<OtherEnd>,
    /// The last action, if it was one of moving about and something was in the way.
    pub blocked: Option<Intent>,
    /// Whether anything was taken in since costs were computed last.
    is_stale: bool,
    is_partner: bool,
    gait: Gait,
    removes_obstacles: bool,
    patience: Patience,
    cost_field: Option<CostField>,
    search: Search,
}

/// How long one has waited for somebody to clear an obstacle away.
#[derive(Clone, Copy, Debug, Default)]
struct Patience {
    /// The first wait since one got on.
    since: Option<Frame>,
    /// One waits for none until then, having waited in vain.
    over_until: Frame,
}

impl Memory {
    /// Nothing remembered yet.
    pub fn new(briefing: &Briefing, rules: PlannerRules) -> Memory {
        let map = OccupancyMap::new(&briefing.bounds, briefing.motion.step_over_m);
        let costs = CostMap::new(*map.grid(), briefing.capability.radius_m);
        Memory {
            rules,
            frame: 0,
            pose: Pose::default(),
            motion: briefing.motion,
            things: SemanticMap::default(),
            people: People::default(),
            hands: Hands::default(),
            last: None,
            delivered: BTreeSet::new(),
            believed: BTreeMap::new(),
            failed_places: BTreeSet::new(),
            put_range_m: briefing.capability.put_range_m,
            history: Vec::new(),
            classes: BTreeMap::new(),
            height_m: briefing.capability.height_m,
            goal_places: briefing.goal_places.clone(),
            goal_place_min_top_m: briefing.goal_place_min_top_m,
            search: Search::new(map.grid().n_cells()),
            map,
            costs,
            costs_of: None,
            people_moved: true,
            bounds: briefing.bounds,
            other_end: None,
            blocked: None,
            is_stale: true,
            is_partner: briefing.me == AgentId::PARTNER,
            gait: briefing.capability.gait,
            removes_obstacles: briefing.capability.removes_obstacles,
            patience: Patience::default(),
            cost_field: None,
        }
    }

    /// Takes in one observation.
    pub fn update(&mut self, briefing: &Briefing, observation: &Observation, percepts: &Percepts) {
        let before = self.frame;
        self.frame = observation.frame;
        self.pose = observation.own.pose;
        self.other_end = observation.own.other_end;
        self.blocked = self.last.and_then(|(action, outcome)| {
            let is_blocked = outcome == Outcome::Failure(FailureReason::Blocked);
            (is_blocked && action.is_locomotion()).then_some(action)
        });
        let detections = &percepts.detections[..];
        self.classes.extend(detections.iter().map(|d| (d.track, d.class)));
        let seen = if self.rules.sees_people(briefing) { detections } else { &[] };
        self.people.see(briefing, observation, seen);
        self.people_moved = self.people.iter().any(|p| p.frame + 60 > self.frame);
        let in_view: Vec<Vec3> =
            self.people.iter().filter(|p| p.is_in_view).map(|p| p.position_in_world).collect();
        let hands_at = if self.rules.sees_holding { &in_view[..] } else { &[] };
        self.things.see(detections, hands_at, self.rules.held_frames, self.frame);
        if self.rules.forgets_missing {
            self.things.forget_missing(observation);
        }
        self.things.expire(before, self.frame);
        self.feel(observation, percepts.hands.as_ref());
        self.take_in_grants(observation);
        self.settle(percepts, briefing.grants);
        if !(briefing.grants.ids || briefing.grants.progress) {
            self.see_delivered(percepts);
        }
        if let Some((action, outcome)) = self.last
            && action.subject().is_some()
        {
            self.history.push(Done { frame: self.frame, action, outcome });
        }
        let known_m = self.rules.known_range_m(briefing);
        self.map.integrate(observation, percepts, self.height_m, known_m);
        self.cost_field = None;
        self.is_stale = true;
    }

    /// What the own hands hold now, by keeping account of what they did last.
    pub fn account(&self, observation: &Observation) -> Hands {
        let class_of = |track| self.class_of(track);
        hands::account(&self.hands, &observation.own, self.last, self.gait, class_of)
    }

    /// What the own hands hold: as told, or by keeping account.
    fn feel(&mut self, observation: &Observation, told: Option<&Hands>) {
        self.hands = told.cloned().unwrap_or_else(|| self.account(observation));
        for (track, class) in self.hands.all() {
            self.classes.insert(track, class);
            self.things.mark_absent(track);
        }
    }

    /// What was granted beyond the own image and state.
    fn take_in_grants(&mut self, observation: &Observation) {
        let granted = &observation.granted;
        for it in granted.partner_hands.iter().flatten().flatten() {
            let until = self.frame + self.rules.held_frames;
            for (entity, class) in std::iter::once(&(it.entity, it.class)).chain(&it.contents) {
                self.classes.insert((*entity).into(), *class);
                self.things.mark_held((*entity).into(), until);
            }
        }
        for obstacle in &granted.removed {
            self.things.mark_gone((*obstacle).into());
        }
        for (entity, class) in &granted.delivered {
            let track = TrackId::from(*entity);
            self.classes.insert(track, *class);
            self.delivered.insert(track);
            self.believed.remove(&track);
        }
        for track in &self.delivered {
            self.things.mark_gone(*track);
        }
    }

    /// Takes back what was believed to be delivered and isn't: seen lying still elsewhere, or
    /// (for whom everything is told) not among what is delivered.
    fn settle(&mut self, percepts: &Percepts, grants: Grants) {
        if !(grants.ids || grants.progress) {
            return;
        }
        let now = self.frame;
        let is_seen = |track| percepts.detections.iter().any(|d| d.track == track);
        let is_refuted = |(track, (_, since)): &(&TrackId, &(TrackId, Frame))| {
            now >= since + SETTLE_FRAMES && (grants.progress || is_seen(**track))
        };
        let pending = self.believed.iter().filter(is_refuted);
        let refuted: Vec<(TrackId, TrackId)> =
            pending.map(|(t, (place, _))| (*t, *place)).collect();
        for (track, place) in refuted {
            self.failed_places.insert(place);
            self.believed.remove(&track);
            self.delivered.remove(&track);
            self.things.return_to_play(track);
        }
    }

    /// Takes what lies on a goal place for delivered: episodes begin with nothing there, and who is
    /// told of no deliveries sees nothing more of them.
    fn see_delivered(&mut self, percepts: &Percepts) {
        /// What lies on a place is no farther from what is seen of it, in plan, metres.
        const BESIDE_M: f32 = 0.15;
        /// What lies on a place is not seen lower than its top by more than this, metres.
        const BELOW_M: f32 = 0.25;
        let now = self.frame;
        let lies_on = |place: &Thing, track: TrackId, at: Vec3, bottom_m: f32| {
            place.track != track
                && bottom_m > place.top_m.min(self.put_range_m[1]) - BELOW_M
                && place.distance_from(xz(at)) < BESIDE_M
        };
        let goal_places: Vec<&Thing> = self
            .things
            .iter()
            .filter(|t| self.goal_places.contains(&t.class) && t.is_present)
            .filter(|t| t.top_m + TOP_TOLERANCE_M >= self.goal_place_min_top_m)
            .collect();
        let is_there = |seen: &&Detection| {
            let role = seen.class.info().role;
            let is_held = self.things.get(seen.track).is_some_and(|t| now < t.held_until);
            matches!(role, Role::Target | Role::Fragile | Role::HeavyTarget)
                && !is_held
                && goal_places
                    .iter()
                    .any(|p| lies_on(p, seen.track, seen.position_in_world, seen.bottom_m))
        };
        let there: Vec<TrackId> =
            percepts.detections.iter().filter(is_there).map(|d| d.track).collect();
        for track in there {
            self.things.mark_gone(track);
        }
    }

    /// Something was put on a goal place: it is believed to be delivered until seen otherwise.
    pub fn believe_delivered(&mut self, track: TrackId, place: TrackId) {
        if self.delivered.insert(track) {
            self.believed.insert(track, (place, self.frame));
            self.things.mark_gone(track);
        }
    }

    /// Whether its owner, who can't clear obstacles away, waits before them until somebody has
    /// (facts A1.6).
    pub fn waits_for_obstacles(&self) -> bool {
        !self.removes_obstacles
    }

    /// Waits before an obstacle, and tells whether its owner goes on waiting. Who has waited in
    /// vain tries for a while whether there is just enough room to get past.
    pub fn wait_for_obstacle(&mut self) -> bool {
        let FailureRules { obstacle_patience_frames, ignore_frames, .. } = self.rules.failures;
        if self.frame < self.patience.over_until {
            return false;
        }
        let since = *self.patience.since.get_or_insert(self.frame);
        if self.frame >= since + obstacle_patience_frames {
            self.patience = Patience { since: None, over_until: self.frame + ignore_frames };
            self.is_stale = true;
        }
        true
    }

    /// Notes a step ahead: from here on its owner has waited for nothing.
    pub fn note_step(&mut self) {
        self.patience.since = None;
    }

    /// Whether its owner goes to where the goal place was when the plan began, whatever it sees of
    /// it since (facts A2.4).
    pub fn keeps_goal_in_mind(&self) -> bool {
        self.is_partner && self.gait == Gait::WalkBike
    }

    /// Brings costs and distances up to date. Cheap if nothing changed.
    pub fn refresh(&mut self) {
        self.refresh_costs();
        let needs_cost_field =
            self.cost_model().measures_ways() || self.rules.exploration == Exploration::Frontier;
        if needs_cost_field && self.cost_field.is_none() {
            self.cost_field = Some(CostField::from(&self.costs, self.here(), &mut self.search));
        }
    }

    /// By what the cost of each cell is reckoned.
    fn cost_model(&self) -> &'static dyn CostModel {
        match self.rules.walking {
            Walking::Careful => &CarefulCosts,
            Walking::Lattice => &LatticeCosts,
        }
    }

    fn refresh_costs(&mut self) {
        let layout = (self.map.version(), self.things.layout());
        let news = News {
            any: self.is_stale,
            layout: self.costs_of != Some(layout),
            people: self.people_moved,
        };
        let model = self.cost_model();
        if !model.is_outdated_by(news) {
            return;
        }
        (self.is_stale, self.costs_of, self.people_moved) = (false, Some(layout), false);
        self.cost_field = None;
        let berth = match self.frame < self.patience.over_until {
            true => Berth::Narrow(self.costs.radius_m()),
            false => Berth::Wide,
        };
        let seen = Seen {
            people: &self.in_the_way(),
            map: &self.map,
            things: &self.things,
            berth: self.is_partner.then_some(berth),
            here: self.here(),
            now: self.frame,
        };
        model.rebuild(&mut self.costs, &seen);
    }

    /// The people whom one would have to go around: not who carries along (facts A2.5: while
    /// two carry, the leader leaves the other one's body out of its map).
    fn in_the_way(&self) -> People {
        match self.other_end {
            Some(end) => self.people.without(end.agent),
            None => self.people.clone(),
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

    /// The class of an object, if it was ever seen or told.
    pub fn class_of(&self, track: TrackId) -> Option<ClassId> {
        self.classes.get(&track).copied()
    }

    /// Where one stands (x, z).
    pub fn here(&self) -> Vec2 {
        xz(self.pose.position)
    }

    /// How costly each cell is to get to, as of the last [`Memory::refresh`].
    pub fn cost_field(&self) -> Option<&CostField> {
        self.cost_field.as_ref()
    }

    /// Length of the way to a thing, metres, made longer by narrow and unknown places; `None` if
    /// no way is known. Straight distance before the first [`Memory::refresh`].
    pub fn way_to(&self, thing: &Thing) -> Option<f32> {
        let straight_m = thing.distance_from(self.here());
        let field = self.cost_field.as_ref().filter(|_| self.cost_model().measures_ways());
        let Some(field) = field else { return Some(straight_m) };
        let grid = self.map.grid();
        let near = |p: Vec2| grid.disc(p, NEAR_THING_M).filter_map(|c| field.cost(c)).min();
        let at = near(thing.nearest_point(self.here()));
        // The nearest point of a long thing may be behind a wall: ask for its middle too.
        let cost = at.into_iter().chain(near(xz(thing.position_in_world))).min()?;
        Some(CostField::metres(cost).max(straight_m))
    }

    /// The known goal places that one can get to, nearest first, with the way to each in metres.
    /// Those on which something could not be put come last, before them those that were given up
    /// lately, and before these the ones out of the own reach.
    pub fn goal_places(&self) -> Vec<(&Thing, f32)> {
        let mut places: Vec<_> = self
            .things
            .iter()
            .filter(|t| self.goal_places.contains(&t.class) && t.is_present)
            .filter(|t| self.rules.goal_blackout_frames == 0 || self.frame >= t.ignore_until)
            .filter(|t| t.top_m + TOP_TOLERANCE_M >= self.goal_place_min_top_m)
            .filter_map(|t| Some((t, self.way_to(t)?)))
            .collect();
        let [low_m, high_m] = self.put_range_m;
        let drawback = |t: &Thing| {
            let is_out_of_reach = t.top_m > high_m || t.top_m < low_m;
            let is_given_up = self.frame < t.ignore_until;
            (self.failed_places.contains(&t.track), is_given_up, is_out_of_reach)
        };
        places.sort_by(|a, b| drawback(a.0).cmp(&drawback(b.0)).then(a.1.total_cmp(&b.1)));
        places
    }

    /// Whether child and partner look too far apart: both in view, or both seen a moment ago
    /// (facts A2.1, A2.4).
    pub fn child_is_away(&self, briefing: &Briefing) -> bool {
        let rules = self.rules.people;
        let companions =
            [Relation::Partner, Relation::Child].map(|relation| self.companion(briefing, relation));
        let [Some(partner), Some(child)] = companions else { return false };
        let apart_m = horizontal_distance(partner.position_in_world, child.position_in_world);
        let are_in_view = partner.is_in_view && child.is_in_view;
        let are_fresh = partner.frame.min(child.frame) + rules.fresh_frames > self.frame;
        (are_in_view && apart_m > rules.child_apart_in_view_m)
            || (are_fresh && apart_m > rules.child_apart_remembered_m)
    }

    /// The last sighting of the companion of this relation.
    pub fn companion(&self, briefing: &Briefing, relation: Relation) -> Option<&Person> {
        self.people.get(briefing.companion(relation)?)
    }
}
