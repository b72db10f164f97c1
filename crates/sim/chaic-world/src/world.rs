//! World: setup, rules and state together, with the public interface of the simulation.

use std::sync::Arc;

use chaic_core::capability::{Capability, Gait};
use chaic_core::catalogue::Role;
use chaic_core::geom::{horizontal_distance, yaw_rotation};
use chaic_core::task::GoalApproach;
use chaic_core::{AgentId, EntityId, Hand, ResolvedAction, Vec3};
use serde::{Deserialize, Serialize};

use crate::collide::{BlockIndex, Body, Disc};
use crate::event::{Event, EventKind};
use crate::rules::{ReachReference, Rules};
use crate::setup::{AgentSpec, ObjectSpec, Setup, SetupError};
use crate::shape::{Block, blocks_at, blocks_of, wall_blocks};
use crate::state::{AgentState, ImpairmentState, ObjectLocation, ObjectState, State};

/// An episode in progress.
#[derive(Clone, Debug)]
pub struct World {
    pub(crate) setup: Arc<Setup>,
    pub(crate) rules: Rules,
    /// Walls and immovable objects, derived from the setup.
    pub(crate) block_index: Arc<BlockIndex>,
    /// Indices of movable objects that block bodies, derived from the setup.
    pub(crate) movable_blockers: Arc<[usize]>,
    /// Capability of each agent, derived from the setup.
    capabilities: Arc<[Capability]>,
    pub(crate) state: State,
    pub(crate) events: Vec<Event>,
}

/// A saved state as bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Snapshot(pub Vec<u8>);

/// A snapshot that cannot be restored.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// The bytes are not a valid state.
    #[error("the snapshot cannot be read: {0}")]
    Unreadable(String),
    /// The state belongs to a different setup.
    #[error("the snapshot has {got} and this world has {expected}")]
    OtherSetup {
        /// Numbers of objects and people in the snapshot.
        got: String,
        /// Numbers of objects and people in this world.
        expected: String,
    },
}

/// An action that cannot be submitted. An action that is only impossible *in the world* is
/// accepted, and fails there with a reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubmitError {
    /// The agent does not exist.
    #[error("there is no agent {0:?} in this episode")]
    NoSuchAgent(AgentId),
    /// The agent's previous action is still in progress.
    #[error("the {0} is still busy")]
    Busy(AgentId),
    /// The episode has ended.
    #[error("the episode is over")]
    Over,
}

impl World {
    /// Creates the world at the start of an episode.
    ///
    /// # Errors
    /// If the setup contains invalid numbers or ids; see [`Setup::check`].
    pub fn new(setup: impl Into<Arc<Setup>>, rules: Rules) -> Result<World, SetupError> {
        let setup = setup.into();
        setup.check()?;
        let mut state = initial_state(&setup);
        attach_vehicles(&setup, &mut state);
        // A vehicle moves with its rider, and blocks nothing.
        let blocks_where_it_stands =
            |i: usize, t: &ObjectSpec| t.fixed && state.objects[i].holder().is_none();
        let fixed = setup.things.iter().enumerate().filter(|(i, t)| blocks_where_it_stands(*i, t));
        let blocks = wall_blocks(&setup)
            .chain(fixed.flat_map(|(i, t)| blocks_at(t, Setup::entity(i), t.position, t.yaw_rad)))
            .collect();
        let block_index = Arc::new(BlockIndex::new(blocks, setup.bounds));
        let blocks_bodies = |t: &ObjectSpec| {
            !t.fixed && matches!(t.class.info().role, Role::Obstacle | Role::HeavyTarget)
        };
        let movable_blockers = setup
            .things
            .iter()
            .enumerate()
            .filter(|(_, t)| blocks_bodies(t))
            .map(|(i, _)| i)
            .collect();
        let capabilities = setup.people.iter().map(AgentSpec::capability).collect();
        let events = Vec::new();
        let mut world =
            World { setup, rules, block_index, movable_blockers, capabilities, state, events };
        world.update_carried_objects();
        Ok(world)
    }

    /// Returns the setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Returns the rules.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// Returns the current state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Returns whether the episode has ended.
    pub fn is_over(&self) -> bool {
        self.state.over
    }

    /// Returns the agents that wait for a decision, in order.
    pub fn waiting(&self) -> Vec<AgentId> {
        if self.state.over {
            return Vec::new();
        }
        self.setup.agents().filter(|a| self.person(*a).activity.is_none()).collect()
    }

    /// Starts the next action of a waiting agent.
    ///
    /// # Errors
    /// If the agent does not exist or is busy, or if the episode is over.
    pub fn submit(&mut self, agent: AgentId, action: ResolvedAction) -> Result<(), SubmitError> {
        if agent.index() >= self.state.agents.len() {
            return Err(SubmitError::NoSuchAgent(agent));
        }
        if self.state.over {
            return Err(SubmitError::Over);
        }
        if self.person(agent).activity.is_some() {
            return Err(SubmitError::Busy(agent));
        }
        self.start_action(agent, action);
        Ok(())
    }

    /// Runs frames until an agent waits for a decision, or the episode ends.
    pub fn advance(&mut self) {
        self.advance_with_callback(&mut |_| ());
    }

    /// Runs frames as [`World::advance`] does, and calls `on_frame` after each frame.
    pub fn advance_with_callback(&mut self, on_frame: &mut dyn FnMut(&World)) {
        while !self.state.over && self.state.agents.iter().all(|p| p.activity.is_some()) {
            self.tick();
            on_frame(self);
        }
    }

    /// Returns the events since the last call, and clears them.
    pub fn drain_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Returns the state as bytes.
    pub fn snapshot(&self) -> Snapshot {
        let mut bytes = postcard::to_stdvec(&self.state).expect("a state is plain data");
        if !self.state.impairment_states.is_empty() {
            bytes = postcard::to_extend(&self.state.impairment_states, bytes)
                .expect("conditions are plain data");
        }
        Snapshot(bytes)
    }

    /// Restores a saved state of the same setup, earlier or later. Clears pending events.
    ///
    /// # Errors
    /// If the bytes are not a state of this setup; the world is then unchanged.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let unreadable = |e: postcard::Error| SnapshotError::Unreadable(e.to_string());
        let (mut state, rest): (State, _) =
            postcard::take_from_bytes(&snapshot.0).map_err(unreadable)?;
        if !rest.is_empty() {
            state.impairment_states = postcard::from_bytes(rest).map_err(unreadable)?;
        }
        let count = |state: &State| {
            let (objects, people) = (state.objects.len(), state.agents.len());
            let conditions = match state.impairment_states.len() {
                0 => String::new(),
                n => format!(" with {n} conditions"),
            };
            format!("{objects} objects and {people} people{conditions}")
        };
        let (got, expected) = (count(&state), count(&self.state));
        if got != expected {
            return Err(SnapshotError::OtherSetup { got, expected });
        }
        self.state = state;
        self.events.clear();
        Ok(())
    }

    /// Returns a hash of the state. Equal states have equal digests.
    pub fn digest(&self) -> u64 {
        xxhash_rust::xxh3::xxh3_64(&self.snapshot().0)
    }

    pub(crate) fn person(&self, agent: AgentId) -> &AgentState {
        &self.state.agents[agent.index()]
    }

    pub(crate) fn person_mut(&mut self, agent: AgentId) -> &mut AgentState {
        &mut self.state.agents[agent.index()]
    }

    pub(crate) fn capability(&self, agent: AgentId) -> Capability {
        self.capabilities[agent.index()]
    }

    /// Returns the fraction of speed and strength that remains at the current fatigue of the agent.
    pub(crate) fn remaining_strength(&self, agent: AgentId) -> f32 {
        let endurance = self.capability(agent).endurance;
        endurance.map_or(1.0, |e| e.remaining_fraction(self.fatigue(agent)))
    }

    /// Returns the fatigue of an agent: 0 rested, 1 exhausted.
    pub fn fatigue(&self, agent: AgentId) -> f32 {
        self.state.impairment_states.get(agent.index()).map_or(0.0, |c| c.fatigue)
    }

    /// Returns the specification and the state of an existing object.
    pub(crate) fn object(&self, entity: EntityId) -> (&ObjectSpec, &ObjectState) {
        let i = self.index(entity);
        (&self.setup.things[i], &self.state.objects[i])
    }

    pub(crate) fn object_mut(&mut self, entity: EntityId) -> &mut ObjectState {
        let i = self.index(entity);
        &mut self.state.objects[i]
    }

    fn index(&self, entity: EntityId) -> usize {
        self.setup.object_index(entity).expect("ids inside the world are those of its setup")
    }

    pub(crate) fn record_event(&mut self, kind: EventKind) {
        self.events.push(Event { frame: self.state.frame, kind });
    }

    /// Returns the collision boxes of an object at its current pose.
    pub(crate) fn blocks_now(&self, index: usize) -> impl Iterator<Item = Block> + use<> {
        let (spec, state) = (&self.setup.things[index], &self.state.objects[index]);
        let f = state.rotation * Vec3::NEG_Z;
        let yaw = chaic_core::geom::yaw_towards(Vec3::ZERO, f);
        blocks_at(spec, Setup::entity(index), state.position, yaw)
    }

    /// Returns the boxes of movable objects that currently block bodies.
    pub(crate) fn movable_blocks(&self) -> Vec<Block> {
        let is_resting = |i: &&usize| self.state.objects[**i].is_resting();
        self.movable_blockers.iter().filter(is_resting).flat_map(|i| self.blocks_now(*i)).collect()
    }

    /// Returns the discs of all agents other than `agent` and `except`.
    pub(crate) fn other_discs(&self, agent: AgentId, except: Option<AgentId>) -> Vec<Disc> {
        let others = self.setup.agents().filter(|a| *a != agent && Some(*a) != except);
        others.map(|a| self.disc(a)).collect()
    }

    /// Returns the discs of all agents.
    pub(crate) fn discs(&self) -> Vec<Disc> {
        self.setup.agents().map(|a| self.disc(a)).collect()
    }

    fn disc(&self, agent: AgentId) -> Disc {
        Disc {
            center: chaic_core::geom::to_xz(self.person(agent).pose.position),
            radius_m: self.capability(agent).radius_m,
        }
    }

    pub(crate) fn body(&self, agent: AgentId) -> Body {
        let c = self.capability(agent);
        Body { radius_m: c.radius_m, low_m: self.rules.step_over_m, high_m: c.height_m }
    }

    /// Returns the bicycle or other vehicle in the left hand of an agent.
    pub(crate) fn vehicle(&self, agent: AgentId) -> Option<EntityId> {
        self.person(agent).hands[Hand::Left.index()]
            .filter(|e| self.object(*e).0.class.info().role == Role::Vehicle)
    }

    /// Returns the direct contents of a container or basket, in slot order.
    pub(crate) fn contents(&self, container: EntityId) -> Vec<EntityId> {
        let mut inside: Vec<(u8, EntityId)> = self
            .setup
            .entities()
            .filter_map(|e| match self.object(e).1.location {
                ObjectLocation::Inside { container: c, slot } if c == container => Some((slot, e)),
                _ => None,
            })
            .collect();
        inside.sort_unstable();
        inside.into_iter().map(|(_, e)| e).collect()
    }

    /// Returns the distance in plan from an agent to the nearest point of an object, meters.
    pub(crate) fn distance_to(&self, agent: AgentId, entity: EntityId) -> f32 {
        let p = self.person(agent).pose.position;
        horizontal_distance(p, self.point_to_reach(p, entity))
    }

    /// Returns the point of an object to which an agent at `p` walks. Depends on the rules and, for
    /// goal places, on the task.
    pub(crate) fn point_to_reach(&self, p: Vec3, entity: EntityId) -> Vec3 {
        let is_reached_at_edge = || {
            self.setup.goal_places.contains(&entity)
                && self.setup.task.info().goal_approach == GoalApproach::NearestPoint
        };
        match self.rules.reach_to {
            ReachReference::Middle if !is_reached_at_edge() => self.object(entity).1.position,
            ReachReference::Middle | ReachReference::NearestPoint => self.nearest_point(p, entity),
        }
    }

    /// Returns the distance of an agent to an object, meters. In a joint carry, the nearer one of
    /// leader and follower counts.
    pub(crate) fn reach_distance(&self, agent: AgentId, entity: EntityId) -> f32 {
        let distance_m = self.distance_to(agent, entity);
        match self.state.joint.filter(|j| j.leader == agent && j.under_way) {
            Some(joint) => distance_m.min(self.distance_to(joint.follower, entity)),
            None => distance_m,
        }
    }

    /// Returns the point of an object's outline that is nearest to `p` in plan, at the height of
    /// `p`.
    pub(crate) fn nearest_point(&self, p: Vec3, entity: EntityId) -> Vec3 {
        let (spec, state) = self.object(entity);
        let half = 0.5 * spec.size_m();
        let facing = state.rotation * Vec3::NEG_Z;
        let block = Block {
            center: state.position + Vec3::Y * half.y,
            half,
            yaw_rad: chaic_core::geom::yaw_towards(Vec3::ZERO, facing),
            entity,
        };
        block.nearest_in_plan(p).0
    }

    /// Returns the height of an object's highest point, meters.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn top_height_m(&self, entity: EntityId) -> f32 {
        let (spec, state) = self.object(entity);
        let half = 0.5 * spec.size_m();
        let m = glam::Mat3::from_quat(state.rotation);
        let middle = state.position.y + (state.rotation * (Vec3::Y * half.y)).y;
        middle + m.x_axis.y.abs() * half.x + m.y_axis.y.abs() * half.y + m.z_axis.y.abs() * half.z
    }
}

/// Puts the nearest free vehicle into the left hand of every rider.
fn attach_vehicles(setup: &Setup, state: &mut State) {
    for (agent, spec) in setup.agents().zip(&setup.people) {
        if spec.capability().gait != Gait::WalkBike {
            continue;
        }
        let at = state.agents[agent.index()].pose.position;
        let is_free = |(i, t): &(usize, &ObjectSpec)| {
            t.class.info().role == Role::Vehicle && state.objects[*i].holder().is_none()
        };
        let distance = |i: usize| horizontal_distance(state.objects[i].position, at);
        let vehicles = setup.things.iter().enumerate().filter(is_free).map(|(i, _)| i);
        if let Some(nearest) = vehicles.min_by(|a, b| distance(*a).total_cmp(&distance(*b))) {
            let hand = Hand::Left;
            state.objects[nearest].location = ObjectLocation::Held { by: agent, hand };
            state.agents[agent.index()].hands[hand.index()] = Some(Setup::entity(nearest));
        }
    }
}

fn initial_state(setup: &Setup) -> State {
    let object_state = |t: &ObjectSpec| ObjectState {
        position: t.position,
        rotation: yaw_rotation(t.yaw_rad),
        location: ObjectLocation::Resting { on: None },
        delivered: None,
        delivered_by: None,
        last_holder: None,
        released_at: None,
    };
    let mut objects: Vec<ObjectState> = setup.things.iter().map(object_state).collect();
    let blocks: Vec<Vec<Block>> = setup.things.iter().map(blocks_of).collect();
    for (i, object) in objects.iter_mut().enumerate() {
        object.location = ObjectLocation::Resting { on: initial_support(setup, &blocks, i) };
    }
    State {
        frame: 0,
        objects,
        agents: setup.people.iter().map(|person| AgentState::new(person.pose)).collect(),
        joint: None,
        child_away_frames: 0,
        child_is_away: false,
        stuck_frames: 0,
        over: false,
        impairment_states: initial_impairment_states(setup),
    }
}

fn initial_impairment_states(setup: &Setup) -> Vec<ImpairmentState> {
    let has_condition =
        |p: &AgentSpec| p.capability().endurance.is_some() || p.capability().tremor.is_some();
    let n = if setup.people.iter().any(has_condition) { setup.people.len() } else { 0 };
    vec![ImpairmentState::default(); n]
}

/// Returns the support of an object at the start: the object whose top is at the height of its
/// bottom. `blocks` holds the collision boxes of each object.
fn initial_support(setup: &Setup, blocks: &[Vec<Block>], index: usize) -> Option<EntityId> {
    /// Maximum vertical gap for support, meters.
    const TOUCHING_M: f32 = 0.03;
    let p = setup.things[index].position;
    if p.y < TOUCHING_M || !setup.things[index].class.info().is_movable() {
        return None;
    }
    let touches = |b: &Block| (b.y_range()[1] - p.y).abs() < TOUCHING_M && b.nearest_in_plan(p).1;
    let mut others = blocks.iter().enumerate().filter(|(i, _)| *i != index);
    others.find(|(_, boxes)| boxes.iter().any(touches)).map(|(i, _)| Setup::entity(i))
}
