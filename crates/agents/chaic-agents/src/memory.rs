//! Memory of an agent: occupancy map, objects, people, own hands and past actions.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use chaic_core::briefing::{CompanionRole, MotionParams};
use chaic_core::capability::Gait;
use chaic_core::geom::{Pose, Rect, horizontal_distance, to_xz};
use chaic_core::observation::{Grants, JointCarrier, WorldState};
use chaic_core::{
    Action, AgentId, Briefing, ClassId, FailureReason, Frame, Observation, Outcome, Role, Vec2,
    Vec3,
};

use crate::mapping::{
    MappedObject, OccupancyMap, PersonMap, SemanticMap, TrackedPerson, held_objects,
};
use crate::perception::{Detection, Percepts};
use crate::planning::careful_costs::CarefulCosts;
use crate::planning::compat::lattice_costs::LatticeCosts;
use crate::planning::cost_map::CostMap;
use crate::planning::cost_model::{CostInputs, CostModel, MapChanges};
use crate::planning::path::{CostField, DijkstraSearch, PathCosts, Search};
use crate::rules::{Exploration, PlannerRules, Walking};
use crate::track::{Hands, Intent, TrackId};

pub mod egocentric;
mod view;

/// Tolerance by which the observed top of a place may be too low, meters.
const TOP_TOLERANCE_M: f32 = 0.1;
/// An object counts as reached from this distance when path lengths are estimated, meters.
const REACHED_M: f32 = 1.5;

/// Time since a sighting for which a person may affect the costs of [`CarefulCosts`], frames.
const PEOPLE_FRAMES: Frame = 60;

/// Time after which an object put on the goal place has certainly settled, frames.
pub const SETTLE_FRAMES: Frame = 240;

/// Completed action of the agent itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActionRecord {
    /// Frame in which it ended.
    pub frame: Frame,
    /// The action.
    pub action: Intent,
    /// Its outcome.
    pub outcome: Outcome,
}

/// Memory of one agent in one episode.
#[derive(Clone, Debug)]
pub struct Memory {
    /// Planner rules of the agent.
    pub rules: PlannerRules,
    /// Frame of the last update.
    pub frame: Frame,
    /// Pose of the agent's body.
    pub pose: Pose,
    /// Motion parameters of the body.
    pub motion: MotionParams,
    /// Static structure.
    pub map: OccupancyMap,
    /// Known objects.
    pub objects: SemanticMap,
    /// Last sightings of people.
    pub people: PersonMap,
    /// Objects held by the agent.
    pub hands: Hands,
    /// The agent's action that has just ended; set before each update.
    pub last: Option<(Intent, Outcome)>,
    /// Objects that are delivered, as far as known or assumed.
    pub delivered: BTreeSet<TrackId>,
    /// Objects that were put on a goal place and have not been confirmed as delivered, with the
    /// place and the frame.
    assumed_delivered: BTreeMap<TrackId, (TrackId, Frame)>,
    /// Places of the goal class on which a put-on failed, for example because they are too low.
    failed_places: BTreeSet<TrackId>,
    /// Lowest and highest top on which the agent can put something, meters.
    put_range_m: [f32; 2],
    /// The agent's interactions (neither locomotion nor waiting), oldest first.
    pub history: Vec<ActionRecord>,
    /// Class of each track known so far.
    classes: BTreeMap<TrackId, ClassId>,
    height_m: f32,
    goal_places: Vec<ClassId>,
    /// Goal places of the episode, if the state is granted.
    granted_goal_places: Option<BTreeSet<TrackId>>,
    goal_place_min_top_m: f32,
    costs: CostMap,
    cost_model: Box<dyn CostModel>,
    /// Versions of the occupancy map and of the object layout in the current costs.
    costs_layout: Option<(u32, u32)>,
    /// True if a person was seen recently, or is still in the current costs.
    has_people_changes: bool,
    /// True if a person was seen recently when costs were computed last.
    costs_have_people: bool,
    /// Bounds of the area that bodies cannot leave.
    pub bounds: Rect,
    /// The other carrier of an object that this agent carries as leader.
    pub other_end: Option<JointCarrier>,
    /// The last action, if it was locomotion and was blocked.
    pub blocked: Option<Intent>,
    /// True if there were updates since costs were computed last.
    is_stale: bool,
    is_partner: bool,
    gait: Gait,
    removes_obstacles: bool,
    /// Height of the eyes, meters.
    eye_m: f32,
    /// True if actions point at objects, which must be in the image.
    pub needs_view: bool,
    /// True if `dijkstra` starts, or has started, with the current costs and position.
    has_path_costs: bool,
    dijkstra: RefCell<DijkstraSearch>,
    search: Search,
}

impl Memory {
    /// Creates a memory that contains only the layout, if it is granted.
    pub fn new(briefing: &Briefing, rules: PlannerRules) -> Memory {
        let mut map = OccupancyMap::new(&briefing.bounds, briefing.motion.step_over_m);
        if let Some(layout) = &briefing.layout {
            map.add_layout(layout, briefing.capability.height_m);
        }
        let costs = CostMap::new(*map.grid(), briefing.capability.radius_m);
        Memory {
            rules,
            frame: 0,
            pose: Pose::default(),
            motion: briefing.motion,
            objects: SemanticMap::default(),
            people: PersonMap::default(),
            hands: Hands::default(),
            last: None,
            delivered: BTreeSet::new(),
            assumed_delivered: BTreeMap::new(),
            failed_places: BTreeSet::new(),
            put_range_m: briefing.capability.put_range_m,
            history: Vec::new(),
            classes: BTreeMap::new(),
            height_m: briefing.capability.height_m,
            goal_places: briefing.goal_places.clone(),
            granted_goal_places: None,
            goal_place_min_top_m: briefing.goal_place_min_top_m,
            search: Search::new(map.grid().n_cells()),
            map,
            costs,
            cost_model: cost_model(rules.walking),
            costs_layout: None,
            has_people_changes: true,
            costs_have_people: false,
            bounds: briefing.bounds,
            other_end: None,
            blocked: None,
            is_stale: true,
            is_partner: briefing.me == AgentId::PARTNER,
            gait: briefing.capability.gait,
            removes_obstacles: briefing.capability.removes_obstacles,
            eye_m: briefing.capability.eye_height_m,
            needs_view: false,
            has_path_costs: false,
            dijkstra: RefCell::default(),
        }
    }

    /// Updates the memory with one observation.
    pub fn update(&mut self, briefing: &Briefing, observation: &Observation, percepts: &Percepts) {
        let before = self.frame;
        self.frame = observation.frame;
        self.pose = observation.proprioception.pose;
        self.other_end = observation.proprioception.other_end;
        self.blocked = self.last.and_then(|(action, outcome)| {
            let is_blocked = outcome == Outcome::Failure(FailureReason::Blocked);
            (is_blocked && action.is_locomotion()).then_some(action)
        });
        let detections = &percepts.detections[..];
        self.classes.extend(detections.iter().map(|d| (d.track, d.class)));
        let visible = if self.rules.sees_people(briefing) { detections } else { &[] };
        self.people.update(briefing, observation, visible);
        self.has_people_changes = self.costs_have_people || self.saw_people_recently();
        let in_view: Vec<Vec3> =
            self.people.iter().filter(|p| p.is_in_view).map(|p| p.position_in_world).collect();
        let people_at = if self.rules.sees_held_objects { &in_view[..] } else { &[] };
        self.objects.update(detections, people_at, self.rules.seen_held_ignore_frames, self.frame);
        self.objects.record_viewpoint(to_xz(self.pose.position), self.frame);
        self.objects.retract(&percepts.retracted, &briefing.possible_targets);
        if self.rules.forgets_missing && !percepts.is_reused {
            self.objects.forget_missing(observation);
        }
        self.objects.count_newly_available(before, self.frame);
        self.update_hands(observation, percepts.hands.as_ref());
        self.apply_grants(observation);
        if let Some(state) = &observation.granted.state {
            self.apply_state(state, briefing.me);
        }
        self.revert_false_deliveries(percepts, briefing.grants);
        if !(briefing.grants.ids || briefing.grants.progress) {
            self.detect_deliveries(percepts);
        }
        if let Some((action, outcome)) = self.last
            && (action.subject().is_some() || action == Action::PutIn)
        {
            self.history.push(ActionRecord { frame: self.frame, action, outcome });
        }
        let known_m = self.rules.known_range_m(briefing);
        self.map.integrate(observation, percepts, self.height_m, known_m);
        self.has_path_costs = false;
        self.is_stale = true;
    }

    /// Infers the objects in the agent's hands from its own actions.
    pub fn infer_held_objects(&self, observation: &Observation) -> Hands {
        let class_of = |track| self.class_of(track);
        held_objects::infer_held_objects(
            &self.hands,
            &observation.proprioception,
            self.last,
            self.gait,
            class_of,
        )
    }

    /// Updates the hands from perception or, without it, by inference.
    fn update_hands(&mut self, observation: &Observation, perceived: Option<&Hands>) {
        self.hands = perceived.cloned().unwrap_or_else(|| self.infer_held_objects(observation));
        for (track, class) in self.hands.all() {
            self.classes.insert(track, class);
            self.objects.mark_absent(track);
        }
    }

    /// Applies information granted beyond the agent's own image and state.
    fn apply_grants(&mut self, observation: &Observation) {
        let granted = &observation.granted;
        for held in granted.partner_hands.iter().flatten().flatten() {
            let until = self.frame + self.rules.seen_held_ignore_frames;
            for (entity, class) in std::iter::once(&(held.entity, held.class)).chain(&held.contents)
            {
                self.classes.insert((*entity).into(), *class);
                self.objects.mark_held((*entity).into(), until);
            }
        }
        for obstacle in &granted.removed {
            self.objects.mark_out_of_play((*obstacle).into());
        }
        for (entity, class) in &granted.delivered {
            let track = TrackId::from(*entity);
            self.classes.insert(track, *class);
            self.delivered.insert(track);
            self.assumed_delivered.remove(&track);
        }
        for track in &self.delivered {
            self.objects.mark_out_of_play(*track);
        }
    }

    /// Applies the granted state of the world. Objects in the agent's own hands stay as they are.
    fn apply_state(&mut self, state: &WorldState, me: AgentId) {
        let own: BTreeSet<TrackId> = self.hands.all().map(|(track, _)| track).collect();
        for object in &state.objects {
            let track = TrackId::from(object.entity);
            self.classes.insert(track, object.class);
            if object.holder != Some(me) && !own.contains(&track) {
                self.objects.apply_granted_state(object, self.frame);
            }
        }
        self.granted_goal_places = Some(state.goal_places.iter().map(|e| (*e).into()).collect());
    }

    /// Returns whether an object may be a goal place; with the granted state, whether it is one.
    fn is_goal_place(&self, object: &MappedObject) -> bool {
        match &self.granted_goal_places {
            Some(places) => places.contains(&object.track),
            None => self.goal_places.contains(&object.class),
        }
    }

    /// Reverts assumed deliveries that turn out wrong: the object is seen after it has settled, or
    /// (with progress granted) it is not among the delivered ones.
    fn revert_false_deliveries(&mut self, percepts: &Percepts, grants: Grants) {
        if !(grants.ids || grants.progress) {
            return;
        }
        let now = self.frame;
        let is_visible = |track| percepts.detections.iter().any(|d| d.track == track);
        let is_refuted = |(track, (_, since)): &(&TrackId, &(TrackId, Frame))| {
            now >= since + SETTLE_FRAMES && (grants.progress || is_visible(**track))
        };
        let pending = self.assumed_delivered.iter().filter(is_refuted);
        let refuted: Vec<(TrackId, TrackId)> =
            pending.map(|(t, (place, _))| (*t, *place)).collect();
        for (track, place) in refuted {
            self.failed_places.insert(place);
            self.assumed_delivered.remove(&track);
            self.delivered.remove(&track);
            self.objects.return_to_play(track);
        }
    }

    /// Marks objects on a goal place as delivered. Goal places are empty at the start, and without
    /// the grant of progress there is no other evidence.
    fn detect_deliveries(&mut self, percepts: &Percepts) {
        /// Maximum horizontal distance of an object from the visible points of the place it lies
        /// on, meters.
        const MAX_DISTANCE_M: f32 = 0.15;
        /// Maximum height by which an object's lowest visible point is below the place's top,
        /// meters.
        const MAX_BELOW_TOP_M: f32 = 0.25;
        let now = self.frame;
        let lies_on = |place: &MappedObject, track: TrackId, at: Vec3, bottom_m: f32| {
            place.track != track
                && bottom_m > place.top_m.min(self.put_range_m[1]) - MAX_BELOW_TOP_M
                && place.distance_from(to_xz(at)) < MAX_DISTANCE_M
        };
        let goal_places: Vec<&MappedObject> = self
            .objects
            .iter()
            .filter(|t| self.is_goal_place(t) && t.is_present)
            .filter(|t| t.top_m + TOP_TOLERANCE_M >= self.goal_place_min_top_m)
            .collect();
        let is_delivered = |d: &&Detection| {
            let role = d.class.info().role;
            let is_held = self.objects.get(d.track).is_some_and(|t| now < t.held_until);
            matches!(role, Role::Target | Role::Fragile | Role::HeavyTarget)
                && !is_held
                && goal_places.iter().any(|p| lies_on(p, d.track, d.position_in_world, d.bottom_m))
        };
        let delivered: Vec<TrackId> =
            percepts.detections.iter().filter(is_delivered).map(|d| d.track).collect();
        for track in delivered {
            self.objects.mark_out_of_play(track);
        }
    }

    /// Assumes that an object put on a goal place is delivered until the opposite is observed.
    pub fn assume_delivered(&mut self, track: TrackId, place: TrackId) {
        if self.delivered.insert(track) {
            self.assumed_delivered.insert(track, (place, self.frame));
            self.objects.mark_out_of_play(track);
        }
    }

    /// Returns whether the agent cannot remove obstacles and therefore waits in front of them
    /// (facts A1.6).
    pub fn waits_for_obstacles(&self) -> bool {
        !self.removes_obstacles
    }

    /// Returns the height of the eyes above a small object that must be in the image for an action,
    /// meters; `None` if it need not be.
    pub fn eyes_above_m(&self, object: &MappedObject) -> Option<f32> {
        let needs_view = self.needs_view && object.class.info().is_carriable();
        needs_view.then_some(self.eye_m - object.position_in_world.y)
    }

    /// Returns whether the agent navigates to the goal place's position at the start of the plan,
    /// and ignores later observations of it (facts A2.4).
    pub fn keeps_goal_position(&self) -> bool {
        self.is_partner && self.gait == Gait::WalkBike
    }

    /// Updates costs and path costs. Cheap if nothing changed.
    pub fn refresh(&mut self) {
        self.refresh_costs();
        let needs_path_costs =
            self.cost_model.uses_path_length() || self.rules.exploration != Exploration::Sampled;
        if needs_path_costs && !self.has_path_costs {
            let here = self.position();
            self.dijkstra.get_mut().start_on_query(here);
            self.has_path_costs = true;
        }
    }

    fn refresh_costs(&mut self) {
        let layout = (self.map.version(), self.objects.layout_version());
        let changes = MapChanges {
            any: self.is_stale,
            layout: self.costs_layout != Some(layout),
            people: self.has_people_changes,
        };
        if !self.cost_model.is_outdated_by(changes) {
            return;
        }
        (self.is_stale, self.costs_layout, self.has_people_changes) = (false, Some(layout), false);
        self.costs_have_people = self.saw_people_recently();
        self.has_path_costs = false;
        let inputs = CostInputs {
            people: &self.blocking_people(),
            map: &self.map,
            objects: &self.objects,
            avoids_obstacles: self.is_partner,
            position: self.position(),
            now: self.frame,
        };
        self.cost_model.recompute(&mut self.costs, &inputs);
    }

    /// Returns whether a person was seen so recently that it may affect the costs.
    fn saw_people_recently(&self) -> bool {
        self.people.iter().any(|p| p.frame + PEOPLE_FRAMES > self.frame)
    }

    /// Returns the people that the path must avoid. The other carrier is excluded (facts A2.5: a
    /// leader leaves the other carrier's body out of its map).
    fn blocking_people(&self) -> PersonMap {
        match self.other_end {
            Some(end) => self.people.without(end.agent),
            None => self.people.clone(),
        }
    }

    /// Returns the current costs, and working memory for a search on them.
    pub fn costs_and_search(&mut self) -> (&CostMap, &mut Search) {
        self.refresh_costs();
        (&self.costs, &mut self.search)
    }

    /// Costs as of the last [`Memory::refresh`].
    pub fn costs(&self) -> &CostMap {
        &self.costs
    }

    /// Returns the class of an object, if it was ever seen or granted.
    pub fn class_of(&self, track: TrackId) -> Option<ClassId> {
        self.classes.get(&track).copied()
    }

    /// Position of the body (x, z).
    pub fn position(&self) -> Vec2 {
        to_xz(self.pose.position)
    }

    /// Path costs to all cells; `None` if there was an update since the last [`Memory::refresh`].
    pub fn path_costs(&self) -> Option<PathCosts<'_>> {
        self.has_path_costs.then_some(PathCosts { costs: &self.costs, dijkstra: &self.dijkstra })
    }

    /// Returns the path length to an object in meters, increased by narrow and unknown cells;
    /// `None` if no path is known. Straight-line distance before the first [`Memory::refresh`], and
    /// on the lattice.
    pub fn path_length_to(&self, object: &MappedObject) -> Option<f32> {
        let nearest = object.nearest_point(self.position());
        let straight_m = nearest.distance(self.position());
        let path_costs = self.path_costs().filter(|_| self.cost_model.uses_path_length());
        let Some(path_costs) = path_costs else { return Some(straight_m) };
        let grid = self.map.grid();
        // The nearest point of a long object may be behind a wall, so its center is tried as well.
        let center = to_xz(object.position_in_world);
        let points = [Some(nearest), (center != nearest).then_some(center)];
        let cells = points.into_iter().flatten().flat_map(|p| grid.disc(p, REACHED_M));
        let cost = path_costs.min_cost(cells)?;
        Some(CostField::meters(cost).max(straight_m))
    }

    /// Returns the known goal places with a known path and their path lengths in meters, nearest
    /// first. Places beyond the reach of the hands come later, then those given up recently, and
    /// last those on which a put-on failed.
    pub fn goal_places(&self) -> Vec<(&MappedObject, f32)> {
        let mut places: Vec<_> = self
            .objects
            .iter()
            .filter(|t| self.is_goal_place(t) && t.is_present)
            .filter(|t| !self.is_blacked_out(t))
            .filter(|t| t.top_m + TOP_TOLERANCE_M >= self.goal_place_min_top_m)
            .filter_map(|t| Some((t, self.path_length_to(t)?)))
            .collect();
        let [low_m, high_m] = self.put_range_m;
        let rank = |t: &MappedObject| {
            let is_out_of_reach = t.top_m > high_m || t.top_m < low_m;
            let is_given_up = self.frame < t.ignore_until;
            (self.failed_places.contains(&t.track), is_given_up, is_out_of_reach)
        };
        places.sort_by(|a, b| rank(a.0).cmp(&rank(b.0)).then(a.1.total_cmp(&b.1)));
        places
    }

    /// Sets the minimum top height of goal places, meters.
    pub fn set_goal_place_min_top(&mut self, min_top_m: f32) {
        self.goal_place_min_top_m = min_top_m;
    }

    /// Returns whether a goal place is ignored now. The paper's rules ignore none.
    pub fn is_blacked_out(&self, place: &MappedObject) -> bool {
        self.rules.failed_goal_place_frames > 0 && self.frame < place.ignore_until
    }

    /// Returns whether child and partner are too far apart: both in view, or both seen recently
    /// (facts A2.1, A2.4).
    pub fn child_is_away(&self, briefing: &Briefing) -> bool {
        let rules = self.rules.people;
        let companions = [CompanionRole::Partner, CompanionRole::Child]
            .map(|role| self.companion(briefing, role));
        let [Some(partner), Some(child)] = companions else { return false };
        let apart_m = horizontal_distance(partner.position_in_world, child.position_in_world);
        let are_in_view = partner.is_in_view && child.is_in_view;
        let are_fresh = partner.frame.min(child.frame) + rules.fresh_frames > self.frame;
        (are_in_view && apart_m > rules.child_apart_in_view_m)
            || (are_fresh && apart_m > rules.child_apart_remembered_m)
    }

    /// Returns the last sighting of the companion with this role.
    pub fn companion(&self, briefing: &Briefing, role: CompanionRole) -> Option<&TrackedPerson> {
        self.people.get(briefing.companion(role)?)
    }
}

/// Creates the cost model of a navigation rule.
fn cost_model(walking: Walking) -> Box<dyn CostModel> {
    match walking {
        Walking::Careful => Box::new(CarefulCosts),
        Walking::Lattice => Box::<LatticeCosts>::default(),
    }
}

#[cfg(test)]
mod tests;
