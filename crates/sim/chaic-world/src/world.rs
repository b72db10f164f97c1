//! A world: setup, rules and state together, and the doors to them.

use std::sync::Arc;

use chaic_core::capability::{Capability, Gait};
use chaic_core::catalogue::Role;
use chaic_core::geom::{horizontal_distance, yaw_rotation};
use chaic_core::task::GoalApproach;
use chaic_core::{AgentId, EntityId, Hand, ResolvedAction, Vec3};
use serde::{Deserialize, Serialize};

use crate::collide::{BlockIndex, Body, Disc};
use crate::event::{Event, EventKind};
use crate::rules::{ReachTo, Rules};
use crate::setup::{Person, Setup, SetupError, Thing};
use crate::shape::{Block, blocks_at, wall_blocks};
use crate::state::{Condition, PersonState, Place, State, ThingState};

/// An episode under way.
#[derive(Clone, Debug)]
pub struct World {
    pub(crate) setup: Arc<Setup>,
    pub(crate) rules: Rules,
    /// Walls and things that never move: derived from the setup.
    pub(crate) block_index: Arc<BlockIndex>,
    /// Things that can be moved and block bodies: derived from the setup.
    pub(crate) movable_blockers: Arc<[usize]>,
    /// What each person's body can do: derived from the setup.
    capabilities: Arc<[Capability]>,
    pub(crate) state: State,
    pub(crate) events: Vec<Event>,
}

/// A saved state, as bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Snapshot(pub Vec<u8>);

/// Why a snapshot can't be restored.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// The bytes are no state.
    #[error("the snapshot can't be read: {0}")]
    Unreadable(String),
    /// The state belongs to another setup.
    #[error("the snapshot has {got} and this world has {expected}")]
    OtherSetup {
        /// Things and people of the snapshot.
        got: String,
        /// Things and people of this world.
        expected: String,
    },
}

/// Why an action can't be submitted. An action that is merely impossible *in the world* is
/// accepted, and fails there with a reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubmitError {
    /// There is no such agent.
    #[error("there is no agent {0:?} in this episode")]
    NoSuchAgent(AgentId),
    /// The agent's last action is still under way.
    #[error("the {0} is still busy")]
    Busy(AgentId),
    /// The episode has ended.
    #[error("the episode is over")]
    Over,
}

impl World {
    /// The world at the beginning of an episode.
    ///
    /// # Errors
    /// If the setup holds numbers or ids that no world can have; see [`Setup::check`].
    pub fn new(setup: impl Into<Arc<Setup>>, rules: Rules) -> Result<World, SetupError> {
        let setup = setup.into();
        setup.check()?;
        let fixed = setup.things.iter().enumerate().filter(|(_, t)| t.fixed);
        let blocks = wall_blocks(&setup)
            .chain(fixed.flat_map(|(i, t)| blocks_at(t, Setup::entity(i), t.position, t.yaw_rad)))
            .collect();
        let block_index = Arc::new(BlockIndex::new(blocks, setup.bounds));
        let blocks_bodies = |t: &Thing| {
            !t.fixed && matches!(t.class.info().role, Role::Obstacle | Role::HeavyTarget)
        };
        let movable_blockers = setup
            .things
            .iter()
            .enumerate()
            .filter(|(_, t)| blocks_bodies(t))
            .map(|(i, _)| i)
            .collect();
        let state = initial_state(&setup);
        let capabilities = setup.people.iter().map(Person::capability).collect();
        let events = Vec::new();
        let mut world =
            World { setup, rules, block_index, movable_blockers, capabilities, state, events };
        world.attach_vehicles();
        world.carry_along();
        Ok(world)
    }

    /// How the episode began.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The rules.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// How it stands.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Whether the episode has ended.
    pub fn is_over(&self) -> bool {
        self.state.over
    }

    /// The agents that wait to be asked, in order.
    pub fn waiting(&self) -> Vec<AgentId> {
        if self.state.over {
            return Vec::new();
        }
        self.setup.agents().filter(|a| self.person(*a).activity.is_none()).collect()
    }

    /// Takes the next action of an agent that waits.
    ///
    /// # Errors
    /// If the agent doesn't exist, is busy, or the episode is over.
    pub fn submit(&mut self, agent: AgentId, action: ResolvedAction) -> Result<(), SubmitError> {
        if agent.index() >= self.state.people.len() {
            return Err(SubmitError::NoSuchAgent(agent));
        }
        if self.state.over {
            return Err(SubmitError::Over);
        }
        if self.person(agent).activity.is_some() {
            return Err(SubmitError::Busy(agent));
        }
        self.begin(agent, action);
        Ok(())
    }

    /// Runs frames until some agent waits to be asked, or the episode ends.
    pub fn advance(&mut self) {
        self.advance_watched(&mut |_| ());
    }

    /// The same, with somebody who looks on after each frame.
    pub fn advance_watched(&mut self, look_on: &mut dyn FnMut(&World)) {
        while !self.state.over && self.state.people.iter().all(|p| p.activity.is_some()) {
            self.tick();
            look_on(self);
        }
    }

    /// What has happened since this was last called.
    pub fn drain_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// The state as bytes.
    pub fn snapshot(&self) -> Snapshot {
        let mut bytes = postcard::to_stdvec(&self.state).expect("a state is plain data");
        if !self.state.conditions.is_empty() {
            bytes = postcard::to_extend(&self.state.conditions, bytes).expect("so are conditions");
        }
        Snapshot(bytes)
    }

    /// Goes back (or on) to a saved state of the same setup. Undrained events are dropped.
    ///
    /// # Errors
    /// If the bytes are no state of this setup; the world is then unchanged.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let unreadable = |e: postcard::Error| SnapshotError::Unreadable(e.to_string());
        let (mut state, rest): (State, _) =
            postcard::take_from_bytes(&snapshot.0).map_err(unreadable)?;
        if !rest.is_empty() {
            state.conditions = postcard::from_bytes(rest).map_err(unreadable)?;
        }
        let count = |state: &State| {
            let (things, people) = (state.things.len(), state.people.len());
            let conditions = match state.conditions.len() {
                0 => String::new(),
                n => format!(" with {n} conditions"),
            };
            format!("{things} things and {people} people{conditions}")
        };
        let (got, expected) = (count(&state), count(&self.state));
        if got != expected {
            return Err(SnapshotError::OtherSetup { got, expected });
        }
        self.state = state;
        self.events.clear();
        Ok(())
    }

    /// A number that differs between different states, and is the same for equal ones.
    pub fn digest(&self) -> u64 {
        xxhash_rust::xxh3::xxh3_64(&self.snapshot().0)
    }

    pub(crate) fn person(&self, agent: AgentId) -> &PersonState {
        &self.state.people[agent.index()]
    }

    pub(crate) fn person_mut(&mut self, agent: AgentId) -> &mut PersonState {
        &mut self.state.people[agent.index()]
    }

    pub(crate) fn capability(&self, agent: AgentId) -> Capability {
        self.capabilities[agent.index()]
    }

    /// Part of speed and strength that this person's fatigue leaves.
    pub(crate) fn part_left(&self, agent: AgentId) -> f32 {
        let endurance = self.capability(agent).endurance;
        endurance.map_or(1.0, |e| e.part_left(self.fatigue(agent)))
    }

    /// How tired a person is: 0 rested, 1 exhausted.
    pub fn fatigue(&self, agent: AgentId) -> f32 {
        self.state.conditions.get(agent.index()).map_or(0.0, |c| c.fatigue)
    }

    /// Setup and state of a thing that exists.
    pub(crate) fn thing(&self, entity: EntityId) -> (&Thing, &ThingState) {
        let i = self.index(entity);
        (&self.setup.things[i], &self.state.things[i])
    }

    pub(crate) fn thing_mut(&mut self, entity: EntityId) -> &mut ThingState {
        let i = self.index(entity);
        &mut self.state.things[i]
    }

    fn index(&self, entity: EntityId) -> usize {
        self.setup.thing_index(entity).expect("entities inside the world name things of its setup")
    }

    pub(crate) fn happened(&mut self, kind: EventKind) {
        self.events.push(Event { frame: self.state.frame, kind });
    }

    /// The colliding parts of a thing as it stands now.
    pub(crate) fn blocks_now(&self, index: usize) -> impl Iterator<Item = Block> + use<> {
        let (thing, state) = (&self.setup.things[index], &self.state.things[index]);
        let f = state.rotation * Vec3::NEG_Z;
        let yaw = chaic_core::geom::yaw_towards(Vec3::ZERO, f);
        blocks_at(thing, Setup::entity(index), state.position, yaw)
    }

    /// Blocks of movable things that stand in people's way right now.
    pub(crate) fn movable_blocks(&self) -> Vec<Block> {
        let standing = |i: &&usize| self.state.things[**i].is_resting();
        self.movable_blockers.iter().filter(standing).flat_map(|i| self.blocks_now(*i)).collect()
    }

    /// The cylinders of the people other than `agent` and `except`.
    pub(crate) fn others(&self, agent: AgentId, except: Option<AgentId>) -> Vec<Disc> {
        let others = self.setup.agents().filter(|a| *a != agent && Some(*a) != except);
        others.map(|a| self.disc(a)).collect()
    }

    /// The cylinders of everybody.
    pub(crate) fn discs(&self) -> Vec<Disc> {
        self.setup.agents().map(|a| self.disc(a)).collect()
    }

    fn disc(&self, agent: AgentId) -> Disc {
        Disc {
            center: chaic_core::geom::xz(self.person(agent).pose.position),
            radius_m: self.capability(agent).radius_m,
        }
    }

    pub(crate) fn body(&self, agent: AgentId) -> Body {
        let c = self.capability(agent);
        Body { radius_m: c.radius_m, low_m: self.rules.step_over_m, high_m: c.height_m }
    }

    /// The bicycle or other vehicle in an agent's left hand.
    pub(crate) fn vehicle(&self, agent: AgentId) -> Option<EntityId> {
        self.person(agent).hands[Hand::Left.index()]
            .filter(|e| self.thing(*e).0.class.info().role == Role::Vehicle)
    }

    /// What is directly in a container or basket, in the order of its slots.
    pub(crate) fn contents(&self, container: EntityId) -> Vec<EntityId> {
        let mut inside: Vec<(u8, EntityId)> = self
            .setup
            .entities()
            .filter_map(|e| match self.thing(e).1.place {
                Place::Inside { container: c, slot } if c == container => Some((slot, e)),
                _ => None,
            })
            .collect();
        inside.sort_unstable();
        inside.into_iter().map(|(_, e)| e).collect()
    }

    /// Distance in plan from a person to the nearest point of a thing, metres.
    pub(crate) fn distance_to(&self, agent: AgentId, entity: EntityId) -> f32 {
        let p = self.person(agent).pose.position;
        horizontal_distance(p, self.point_to_reach(p, entity))
    }

    /// The point of a thing that one goes to from `p`; of a goal place as the task has it.
    pub(crate) fn point_to_reach(&self, p: Vec3, entity: EntityId) -> Vec3 {
        let is_beside = || {
            self.setup.goal_places.contains(&entity)
                && self.setup.task.info().goal_approach == GoalApproach::NearestPoint
        };
        match self.rules.reach_to {
            ReachTo::Middle if !is_beside() => self.thing(entity).1.position,
            ReachTo::Middle | ReachTo::NearestPoint => self.nearest_point(p, entity),
        }
    }

    /// The same for a person with all that moves as one with it: of two who carry furniture, the
    /// one who is nearer counts.
    pub(crate) fn reach_distance(&self, agent: AgentId, entity: EntityId) -> f32 {
        let own = self.distance_to(agent, entity);
        match self.state.joint.filter(|j| j.leader == agent && j.under_way) {
            Some(joint) => own.min(self.distance_to(joint.follower, entity)),
            None => own,
        }
    }

    /// The point of a thing's outline that is nearest in plan to `p`, at `p`'s height.
    pub(crate) fn nearest_point(&self, p: Vec3, entity: EntityId) -> Vec3 {
        let (thing, state) = self.thing(entity);
        let half = 0.5 * thing.size_m();
        let facing = state.rotation * Vec3::NEG_Z;
        let block = Block {
            center: state.position + Vec3::Y * half.y,
            half,
            yaw_rad: chaic_core::geom::yaw_towards(Vec3::ZERO, facing),
            entity,
        };
        block.nearest_in_plan(p).0
    }

    /// Height of a thing's highest point, metres.
    pub(crate) fn top_of(&self, entity: EntityId) -> f32 {
        let (thing, state) = self.thing(entity);
        let half = 0.5 * thing.size_m();
        let m = glam::Mat3::from_quat(state.rotation);
        let middle = state.position.y + (state.rotation * (Vec3::Y * half.y)).y;
        middle + m.x_axis.y.abs() * half.x + m.y_axis.y.abs() * half.y + m.z_axis.y.abs() * half.z
    }

    /// At the start every rider holds the nearest vehicle.
    fn attach_vehicles(&mut self) {
        for agent in self.setup.agents() {
            if self.capability(agent).gait != Gait::WalkBike {
                continue;
            }
            let at = self.person(agent).pose.position;
            let free = |e: &EntityId| {
                self.thing(*e).0.class.info().role == Role::Vehicle
                    && self.thing(*e).1.holder().is_none()
            };
            let nearest = self.setup.entities().filter(free).min_by(|a, b| {
                let d = |e: &EntityId| horizontal_distance(self.thing(*e).1.position, at);
                d(a).total_cmp(&d(b))
            });
            if let Some(vehicle) = nearest {
                self.thing_mut(vehicle).place = Place::Held { by: agent, hand: Hand::Left };
                self.person_mut(agent).hands[Hand::Left.index()] = Some(vehicle);
            }
        }
    }
}

fn initial_state(setup: &Setup) -> State {
    let thing = |t: &Thing| ThingState {
        position: t.position,
        rotation: yaw_rotation(t.yaw_rad),
        place: Place::Resting { on: None },
        delivered: None,
        delivered_by: None,
        last_holder: None,
        released_at: None,
    };
    let mut things: Vec<ThingState> = setup.things.iter().map(thing).collect();
    for (i, thing) in things.iter_mut().enumerate() {
        thing.place = Place::Resting { on: initial_support(setup, i) };
    }
    State {
        frame: 0,
        things,
        people: setup.people.iter().map(|person| PersonState::at(person.pose)).collect(),
        joint: None,
        child_away_frames: 0,
        child_is_away: false,
        stuck_frames: 0,
        over: false,
        conditions: initial_conditions(setup),
    }
}

fn initial_conditions(setup: &Setup) -> Vec<Condition> {
    let changes =
        |p: &Person| p.capability().endurance.is_some() || p.capability().tremor.is_some();
    let n = if setup.people.iter().any(changes) { setup.people.len() } else { 0 };
    vec![Condition::default(); n]
}

/// What a thing stands on at the start: the thing whose top surface is right below its bottom.
fn initial_support(setup: &Setup, index: usize) -> Option<EntityId> {
    /// Gap that still counts as lying on, metres.
    const TOUCHING_M: f32 = 0.03;
    let p = setup.things[index].position;
    if p.y < TOUCHING_M || !setup.things[index].class.info().is_movable() {
        return None;
    }
    let below = |t: &Thing| {
        let block = crate::shape::blocks_of(t);
        block.iter().any(|b| (b.y_range()[1] - p.y).abs() < TOUCHING_M && b.nearest_in_plan(p).1)
    };
    let others = setup.things.iter().enumerate().filter(|(i, _)| *i != index);
    others.filter(|(_, t)| below(t)).map(|(i, _)| Setup::entity(i)).next()
}
