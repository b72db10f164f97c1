//! Scripted run: all agents walk at random and try nearby interactions.

use std::fmt::Write as _;

use chaic_core::action::Hand;
use chaic_core::catalogue::Role;
use chaic_core::geom::{horizontal_distance, wrap_angle, yaw_towards};
use chaic_core::rng::RngStream;
use chaic_core::{Action, AgentId, EntityId, ResolvedAction};
use chaic_world::{EventKind, World};

/// Number of nearest objects among which an agent chooses its target.
const NEAREST: usize = 3;
/// Maximum distance at which an agent tries to take or put an object, meters.
const REACH_M: f32 = 1.8;
/// Duration for which an agent keeps its target, frames.
const TARGET_FRAMES: u32 = 300;
/// Duration for which both agents have the same piece of furniture as target, frames.
const TOGETHER_FRAMES: u32 = 500;

/// Script with the state of all actors and event counts.
#[derive(Debug)]
pub struct Script {
    people: Vec<Actor>,
    counts: EventCounts,
}

/// State of one agent.
#[derive(Debug)]
struct Actor {
    rng: RngStream,
    /// Target of the agent, with the last frame of the attempt.
    target: Option<(EntityId, u32)>,
}

/// Number of events by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EventCounts {
    /// Objects taken.
    pub taken: u32,
    /// Objects put into a container or basket.
    pub stowed: u32,
    /// Objects released.
    pub released: u32,
    /// Obstacles removed.
    pub removed: u32,
    /// Pieces of furniture lifted by two agents.
    pub lifted: u32,
    /// Objects delivered.
    pub delivered: u32,
}

impl Script {
    /// Creates a script at the start of a world.
    pub fn new(world: &World) -> Script {
        let seed = world.setup().seed;
        let actor = |a: AgentId| {
            let rng = RngStream::new(seed, "goldens", u64::from(a.0));
            Actor { rng, target: None }
        };
        Script {
            people: world.setup().agents().map(actor).collect(),
            counts: EventCounts::default(),
        }
    }

    /// Plays to a frame, or to the end of the episode.
    pub fn play(&mut self, world: &mut World, until: u32) {
        while !world.is_over() && world.state().frame < until {
            for agent in world.waiting() {
                let action = choose(world, agent, &mut self.people[agent.index()]);
                // The agent waits for an action, so the world accepts it.
                let _ = world.submit(agent, action);
            }
            world.tick();
            for event in world.drain_events() {
                self.counts.count(event.kind);
            }
        }
    }

    /// Returns the event counts so far.
    pub fn event_counts(&self) -> EventCounts {
        self.counts
    }

    /// Returns the event counts as text.
    pub fn counts_text(&self) -> String {
        let EventCounts { taken, stowed, released, removed, lifted, delivered } = self.counts;
        let mut text = String::new();
        for (what, n) in [
            ("taken", taken),
            ("stowed", stowed),
            ("released", released),
            ("removed", removed),
            ("lifted by two", lifted),
            ("delivered", delivered),
        ] {
            let separator = if text.is_empty() { "" } else { ", " };
            let _ = write!(text, "{separator}{n} {what}");
        }
        text
    }
}

impl EventCounts {
    fn count(&mut self, kind: EventKind) {
        match kind {
            EventKind::Taken { .. } => self.taken += 1,
            EventKind::Stowed { .. } => self.stowed += 1,
            EventKind::Released { .. } => self.released += 1,
            EventKind::ObstacleRemoved { .. } => self.removed += 1,
            EventKind::LiftedTogether { .. } => self.lifted += 1,
            EventKind::Delivered { .. } => self.delivered += 1,
            _ => {}
        }
    }
}

/// Chooses the next action of a waiting agent.
fn choose(world: &World, agent: AgentId, actor: &mut Actor) -> ResolvedAction {
    let rng = &mut actor.rng;
    let hands = world.state().agents[agent.index()].hands;
    let hand = if rng.chance(0.5) { Hand::Left } else { Hand::Right };
    let is_full = hands.iter().all(Option::is_some);
    if is_full && rng.chance(0.75) {
        return if rng.chance(0.5) { Action::PutIn } else { put(world, agent, hand, rng) };
    }
    // Prefer a hand that is free.
    let hand = if hands[hand.index()].is_some() { hand.other() } else { hand };
    match rng.below(16) {
        0..4 => Action::MoveForward,
        4 => Action::TurnLeft,
        5 => Action::TurnRight,
        6..8 => Action::Wait { frames: 1 + rng.below(20) as u32 },
        8..10 => put(world, agent, hand.other(), rng),
        _ => take(world, agent, hand, actor),
    }
}

/// Takes or removes a nearby object, or approaches it.
fn take(world: &World, agent: AgentId, hand: Hand, actor: &mut Actor) -> ResolvedAction {
    let setup = world.setup();
    let role = |e: EntityId| setup.object(e).map(|t| t.class.info().role);
    let is_movable = |e: &EntityId| setup.object(*e).is_some_and(|t| !t.fixed);
    let heavy: Vec<EntityId> = setup
        .entities()
        .filter(|e| role(*e) == Some(Role::HeavyTarget))
        .filter(is_movable)
        .collect();
    let round = (world.state().frame / TOGETHER_FRAMES) as usize;
    if !heavy.is_empty() {
        let object = heavy[round % heavy.len()];
        return approach_or(world, agent, object, Action::PickUp { object, hand });
    }
    let Some(object) = actor.choose_target(world, agent) else { return Action::MoveForward };
    let action = if role(object) == Some(Role::Obstacle) {
        Action::RemoveObstacle { obstacle: object, hand }
    } else {
        Action::PickUp { object, hand }
    };
    approach_or(world, agent, object, action)
}

impl Actor {
    /// Returns the agent's target: one of the nearest objects, kept for a while.
    fn choose_target(&mut self, world: &World, agent: AgentId) -> Option<EntityId> {
        let (setup, now) = (world.setup(), world.state().frame);
        let is_there = |e: &EntityId| {
            let state = setup.object_index(*e).map(|i| &world.state().objects[i]);
            setup.object(*e).is_some_and(|t| !t.fixed && t.class.info().is_movable())
                && state.is_some_and(|t| t.is_resting() && t.delivered.is_none())
        };
        if let Some((object, until)) = self.target
            && now < until
            && is_there(&object)
        {
            return Some(object);
        }
        let mut candidates: Vec<EntityId> = setup.entities().filter(is_there).collect();
        candidates
            .sort_by(|a, b| distance(world, agent, *a).total_cmp(&distance(world, agent, *b)));
        let role = |e: &EntityId| setup.object(*e).map(|t| t.class.info().role);
        let can_clear = setup.people[agent.index()].capability().removes_obstacles;
        candidates.retain(|e| can_clear || role(e) != Some(Role::Obstacle));
        let obstacle = candidates.iter().find(|e| role(e) == Some(Role::Obstacle)).copied();
        candidates.truncate(NEAREST);
        candidates.extend(obstacle);
        let object = self.rng.choose(&candidates).copied()?;
        self.target = Some((object, now + TARGET_FRAMES));
        Some(object)
    }
}

/// Puts the held object on a goal place or on nearby furniture, or approaches it.
fn put(world: &World, agent: AgentId, hand: Hand, rng: &mut RngStream) -> ResolvedAction {
    let setup = world.setup();
    let is_fixed = |e: &EntityId| setup.object(*e).is_some_and(|t| t.fixed);
    let mut places: Vec<EntityId> =
        setup.entities().filter(|e| is_fixed(e) && distance(world, agent, *e) < REACH_M).collect();
    places.extend(&setup.goal_places);
    let Some(place) = rng.choose(&places).copied() else { return Action::TurnLeft };
    approach_or(world, agent, place, Action::PutOn { place, hand })
}

/// Returns the action if the object is within reach; else a turn or a step towards it.
fn approach_or(
    world: &World,
    agent: AgentId,
    entity: EntityId,
    action: ResolvedAction,
) -> ResolvedAction {
    if distance(world, agent, entity) < REACH_M {
        return action;
    }
    let pose = world.state().agents[agent.index()].pose;
    let to = position(world, entity);
    let off = wrap_angle(yaw_towards(pose.position, to) - pose.yaw_rad);
    match () {
        () if off > world.rules().turn_rad => Action::TurnLeft,
        () if off < -world.rules().turn_rad => Action::TurnRight,
        () => Action::MoveForward,
    }
}

fn position(world: &World, entity: EntityId) -> chaic_core::Vec3 {
    world
        .setup()
        .object_index(entity)
        .map_or_else(Default::default, |i| world.state().objects[i].position)
}

/// Returns the distance in plan from a person to the bounding circle of an object, meters.
fn distance(world: &World, agent: AgentId, entity: EntityId) -> f32 {
    let here = world.state().agents[agent.index()].pose.position;
    let radius = world.setup().object(entity).map_or(0.0, |t| t.half_longer_side_m());
    horizontal_distance(here, position(world, entity)) - radius
}
