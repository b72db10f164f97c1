//! A scripted run: everybody walks about at random and tries whatever can be done nearby.

use std::fmt::Write as _;

use chaic_core::action::Hand;
use chaic_core::catalogue::Role;
use chaic_core::geom::{horizontal_distance, wrap_angle, yaw_towards};
use chaic_core::rng::Stream;
use chaic_core::{Action, AgentId, EntityId, ResolvedAction};
use chaic_world::{EventKind, World};

/// Among so many of the nearest things somebody chooses what to take.
const NEAREST: usize = 3;
/// From how far it tries to take or put something, metres.
const REACH_M: f32 = 1.8;
/// For so long it goes for the same one, frames.
const AIM_FRAMES: u32 = 300;
/// For so long the two are after the same piece of furniture, frames.
const TOGETHER_FRAMES: u32 = 500;

/// Who acts how, and what came of it.
#[derive(Debug)]
pub struct Script {
    people: Vec<Actor>,
    counts: Counts,
}

/// Somebody who acts.
#[derive(Debug)]
struct Actor {
    luck: Stream,
    /// What it is going to take, and until when.
    aim: Option<(EntityId, u32)>,
}

/// How often what happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Things taken.
    pub taken: u32,
    /// Things put into a container or basket.
    pub stowed: u32,
    /// Things let go.
    pub released: u32,
    /// Obstacles put aside.
    pub removed: u32,
    /// Pieces of furniture lifted by two.
    pub lifted: u32,
    /// Things delivered.
    pub delivered: u32,
}

impl Script {
    /// Nobody has done anything yet.
    pub fn new(world: &World) -> Script {
        let seed = world.setup().seed;
        let actor = |a: AgentId| {
            let luck = Stream::new(seed, "goldens", u64::from(a.0));
            Actor { luck, aim: None }
        };
        Script { people: world.setup().agents().map(actor).collect(), counts: Counts::default() }
    }

    /// Plays to a frame, or to the end.
    pub fn play(&mut self, world: &mut World, until: u32) {
        while !world.is_over() && world.state().frame < until {
            for agent in world.waiting() {
                let action = choose(world, agent, &mut self.people[agent.index()]);
                // It waits, so it can't be busy.
                let _ = world.submit(agent, action);
            }
            world.tick();
            for event in world.drain_events() {
                self.counts.note(event.kind);
            }
        }
    }

    /// What happened so far.
    pub fn happened(&self) -> Counts {
        self.counts
    }

    /// The same in words.
    pub fn counts(&self) -> String {
        let Counts { taken, stowed, released, removed, lifted, delivered } = self.counts;
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

impl Counts {
    fn note(&mut self, kind: EventKind) {
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

/// The next action of somebody who waits.
fn choose(world: &World, agent: AgentId, actor: &mut Actor) -> ResolvedAction {
    let luck = &mut actor.luck;
    let hands = world.state().people[agent.index()].hands;
    let hand = if luck.chance(0.5) { Hand::Left } else { Hand::Right };
    let is_full = hands.iter().all(Option::is_some);
    if is_full && luck.chance(0.75) {
        return if luck.chance(0.5) { Action::PutIn } else { put(world, agent, hand, luck) };
    }
    // A hand that can take something, if there is one.
    let hand = if hands[hand.index()].is_some() { hand.other() } else { hand };
    match luck.below(16) {
        0..4 => Action::MoveForward,
        4 => Action::TurnLeft,
        5 => Action::TurnRight,
        6..8 => Action::Wait { frames: 1 + luck.below(20) as u32 },
        8..10 => put(world, agent, hand.other(), luck),
        _ => take(world, agent, hand, actor),
    }
}

/// Taking or removing something nearby, or going there.
fn take(world: &World, agent: AgentId, hand: Hand, actor: &mut Actor) -> ResolvedAction {
    let setup = world.setup();
    let role = |e: EntityId| setup.thing(e).map(|t| t.class.info().role);
    let is_loose = |e: &EntityId| setup.thing(*e).is_some_and(|t| !t.fixed);
    let heavy: Vec<EntityId> =
        setup.entities().filter(|e| role(*e) == Some(Role::HeavyTarget)).filter(is_loose).collect();
    let round = (world.state().frame / TOGETHER_FRAMES) as usize;
    if !heavy.is_empty() {
        let object = heavy[round % heavy.len()];
        return go_or(world, agent, object, Action::PickUp { object, hand });
    }
    let Some(object) = actor.aim_at(world, agent) else { return Action::MoveForward };
    let action = if role(object) == Some(Role::Obstacle) {
        Action::RemoveObstacle { obstacle: object, hand }
    } else {
        Action::PickUp { object, hand }
    };
    go_or(world, agent, object, action)
}

impl Actor {
    /// What it is going to take: one of the nearest things, for a while.
    fn aim_at(&mut self, world: &World, agent: AgentId) -> Option<EntityId> {
        let (setup, now) = (world.setup(), world.state().frame);
        let is_there = |e: &EntityId| {
            let state = setup.thing_index(*e).map(|i| &world.state().things[i]);
            setup.thing(*e).is_some_and(|t| !t.fixed && t.class.info().is_movable())
                && state.is_some_and(|t| t.is_resting() && t.delivered.is_none())
        };
        if let Some((object, until)) = self.aim
            && now < until
            && is_there(&object)
        {
            return Some(object);
        }
        let mut around: Vec<EntityId> = setup.entities().filter(is_there).collect();
        around.sort_by(|a, b| distance(world, agent, *a).total_cmp(&distance(world, agent, *b)));
        let role = |e: &EntityId| setup.thing(*e).map(|t| t.class.info().role);
        let can_clear = setup.people[agent.index()].capability().removes_obstacles;
        around.retain(|e| can_clear || role(e) != Some(Role::Obstacle));
        let obstacle = around.iter().find(|e| role(e) == Some(Role::Obstacle)).copied();
        around.truncate(NEAREST);
        around.extend(obstacle);
        let object = self.luck.choose(&around).copied()?;
        self.aim = Some((object, now + AIM_FRAMES));
        Some(object)
    }
}

/// Putting what is in hand on a goal place, or on something nearby.
fn put(world: &World, agent: AgentId, hand: Hand, luck: &mut Stream) -> ResolvedAction {
    let setup = world.setup();
    let is_fixed = |e: &EntityId| setup.thing(*e).is_some_and(|t| t.fixed);
    let mut places: Vec<EntityId> =
        setup.entities().filter(|e| is_fixed(e) && distance(world, agent, *e) < REACH_M).collect();
    places.extend(&setup.goal_places);
    let Some(place) = luck.choose(&places).copied() else { return Action::TurnLeft };
    go_or(world, agent, place, Action::PutOn { place, hand })
}

/// The action if the thing is within reach; else a turn or a step towards it.
fn go_or(
    world: &World,
    agent: AgentId,
    entity: EntityId,
    action: ResolvedAction,
) -> ResolvedAction {
    if distance(world, agent, entity) < REACH_M {
        return action;
    }
    let pose = world.state().people[agent.index()].pose;
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
        .thing_index(entity)
        .map_or_else(Default::default, |i| world.state().things[i].position)
}

/// Distance in plan from a person to the edge of a thing, metres: as if it were round.
fn distance(world: &World, agent: AgentId, entity: EntityId) -> f32 {
    let here = world.state().people[agent.index()].pose.position;
    let radius = world.setup().thing(entity).map_or(0.0, |t| t.half_longer_side_m());
    horizontal_distance(here, position(world, entity)) - radius
}
