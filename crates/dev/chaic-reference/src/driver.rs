//! Random joint actions that make interactions common.

use std::ops::ControlFlow;

use chaic_core::action::Hand;
use chaic_core::catalogue::Role;
use chaic_core::geom::{Pose, forward, horizontal_distance, yaw_towards};
use chaic_core::rng::RngStream;
use chaic_core::{Action, AgentId, EntityId, Frame, ResolvedAction, Vec3};
use chaic_world::{Setup, Snapshot, World};

/// Distance in plan up to which an object counts as near, meters.
const NEAR_M: f32 = 2.4;
/// Distance at which a person is put beside an object, from its edge, meters.
const BESIDE_M: [f32; 2] = [0.25, 1.3];
/// The same distance for furniture. It is larger, so that one person may wait long for the other.
const BESIDE_FURNITURE_M: [f32; 2] = [0.2, 2.9];

/// Source of random actions in one episode.
pub(crate) struct Driver {
    rng: RngStream,
    /// Object to which people were moved last.
    meeting: Option<EntityId>,
    /// Furniture that partner and helper try to lift together, the frame at which they give up,
    /// and the number of remaining attempts.
    joint_lift: Option<(EntityId, Frame, u32)>,
}

fn position(world: &World, entity: EntityId) -> Vec3 {
    let k = world.setup().object_index(entity).expect("the object exists");
    world.state().objects[k].position
}

fn role(setup: &Setup, entity: EntityId) -> Role {
    setup.object(entity).expect("the object exists").class.info().role
}

/// Returns the furniture that another person picks up now, if the hands of this one are free.
fn picked_furniture(world: &World, agent: AgentId) -> Option<EntityId> {
    let people = &world.state().agents;
    let is_free = people[agent.index()].hands == [None; 2];
    let actions = people.iter().filter_map(|p| p.activity.as_ref().map(|a| a.action));
    let picked = actions.filter_map(|action| match action {
        Action::PickUp { object, .. } => Some(object),
        _ => None,
    });
    let mut furniture = picked.filter(|e| {
        world.setup().object(*e).is_some_and(|t| t.class.info().role == Role::HeavyTarget)
    });
    furniture.next().filter(|_| is_free)
}

impl Driver {
    /// Creates the driver of an episode.
    pub(crate) fn new(seed: u64) -> Driver {
        Driver { rng: RngStream::new(seed, "reference driver", 0), meeting: None, joint_lift: None }
    }

    /// Moves people who wait for a decision to random objects. Returns whether a person was moved.
    pub(crate) fn move_people(&mut self, world: &mut World) -> bool {
        let waiting = world.waiting();
        let chosen: Vec<AgentId> = waiting.into_iter().filter(|_| self.rng.chance(0.12)).collect();
        let mut state = world.state().clone();
        let mut has_moved = false;
        for agent in chosen {
            let Some(place) = self.choose_meeting(world, agent) else { continue };
            let spec = world.setup().object(place).expect("the object exists");
            let angle = self.rng.range(0.0, std::f32::consts::TAU);
            let is_furniture = spec.class.info().role == Role::HeavyTarget;
            let [low, high] = if is_furniture { BESIDE_FURNITURE_M } else { BESIDE_M };
            let from_edge = self.rng.range(low, high);
            let at = position(world, place);
            let target = at + forward(angle) * (spec.half_longer_side_m() + from_edge);
            let bounds = world.setup().bounds;
            let x = target.x.clamp(bounds.min.x + 0.05, bounds.max.x - 0.05);
            let z = target.z.clamp(bounds.min.y + 0.05, bounds.max.y - 0.05);
            let here = Vec3::new(x, 0.0, z);
            let yaw_rad = yaw_towards(here, at);
            state.agents[agent.index()].pose = Pose { position: here, yaw_rad };
            has_moved = true;
        }
        if has_moved {
            let mut bytes = postcard::to_stdvec(&state).expect("a state is plain data");
            if !state.impairment_states.is_empty() {
                bytes = postcard::to_extend(&state.impairment_states, bytes)
                    .expect("conditions are plain data");
            }
            world.restore(&Snapshot(bytes)).expect("the snapshot is of this world");
        }
        has_moved
    }

    /// Chooses an object beside which a person continues: of a random role, a goal place, or the
    /// place of the last move.
    fn choose_meeting(&mut self, world: &World, agent: AgentId) -> Option<EntityId> {
        let setup = world.setup();
        let hands = world.state().agents[agent.index()].hands;
        let is_full = hands.iter().all(Option::is_some);
        if self.rng.chance(if is_full { 0.5 } else { 0.12 }) {
            return self.rng.choose(&setup.goal_places).copied();
        }
        let is_piece = self.meeting.is_some_and(|e| role(setup, e) == Role::HeavyTarget);
        if self.rng.chance(if is_piece { 0.8 } else { 0.35 }) && self.meeting.is_some() {
            return self.meeting;
        }
        const ROLES: [Role; 8] = [
            Role::Target,
            Role::Target,
            Role::Container,
            Role::Container,
            Role::Fragile,
            Role::Fragile,
            Role::Obstacle,
            Role::HeavyTarget,
        ];
        let wanted = *self.rng.choose(&ROLES)?;
        let holds_container = hands.iter().flatten().any(|e| role(setup, *e) == Role::Container);
        let wanted = if holds_container { Role::Target } else { wanted };
        let is_possible = |e: &EntityId| {
            let k = setup.object_index(*e).expect("the object exists");
            let object = &world.state().objects[k];
            role(setup, *e) == wanted
                && !setup.things[k].fixed
                && object.is_resting()
                && object.delivered.is_none()
        };
        let possible: Vec<EntityId> = setup.entities().filter(is_possible).collect();
        self.meeting = self.rng.choose(&possible).copied().or(self.meeting);
        self.meeting
    }

    /// Chooses the next action of a person; `None` lets it wait for another frame.
    pub(crate) fn choose(&mut self, world: &World, agent: AgentId) -> Option<ResolvedAction> {
        if self.rng.chance(0.02) {
            return None;
        }
        let setup = world.setup();
        let hands = world.state().agents[agent.index()].hands;
        let roles = hands.map(|h| h.map(|e| role(setup, e)));
        let is_loaded = roles.contains(&Some(Role::Container))
            && roles.iter().any(|r| matches!(r, Some(Role::Target | Role::Fragile)));
        if is_loaded && self.rng.chance(0.6) {
            return Some(Action::PutIn);
        }
        if let ControlFlow::Break(choice) = self.choose_with_furniture(world, agent) {
            return choice;
        }
        let here = world.state().agents[agent.index()].pose.position;
        let is_near = |e: &EntityId| {
            let reach = NEAR_M + setup.object(*e).expect("it exists").half_longer_side_m();
            horizontal_distance(position(world, *e), here) < reach
        };
        let near: Vec<EntityId> = setup.entities().filter(is_near).collect();
        let hand = self.hand(hands.map(|h| h.is_some()), 0.8);
        let full_hand = self.hand(hands.map(|h| h.is_none()), 0.85);
        Some(match self.rng.below(100) {
            0..9 => Action::MoveForward,
            9..12 => Action::TurnLeft,
            12..15 => Action::TurnRight,
            15..18 => Action::Wait { frames: self.rng.below(16) as u32 },
            18 => Action::Wait { frames: [u32::MAX, 250][self.rng.below(2)] },
            19..21 => Action::PutIn,
            21..30 => Action::RemoveObstacle { obstacle: self.obstacle(world, &near), hand },
            30..55 => Action::PutOn { place: self.place(world, &near), hand: full_hand },
            _ => Action::PickUp { object: self.object(world, &near, agent), hand },
        })
    }

    /// Chooses actions with furniture: both lift it, a third person is faster, or the leader moves.
    fn choose_with_furniture(
        &mut self,
        world: &World,
        agent: AgentId,
    ) -> ControlFlow<Option<ResolvedAction>> {
        let hands = world.state().agents[agent.index()].hands;
        let pick_up = |object| Action::PickUp { object, hand: Hand::Right };
        // Furniture is walked around more often than put down at once.
        let is_leading = world.state().joint.is_some_and(|j| j.leader == agent);
        if is_leading && self.rng.chance(0.7) {
            let motions = [Action::MoveForward, Action::TurnLeft, Action::TurnRight];
            return ControlFlow::Break(self.rng.choose(&motions).copied());
        }
        let is_in_pair = agent.index() < 2 && hands == [None; 2];
        if let Some((object, until, tries)) = self.joint_lift.filter(|_| is_in_pair) {
            // Both choose in the same frame.
            let others = world.state().agents.iter().take(2).enumerate();
            let is_ready = others.filter(|(k, _)| *k != agent.index()).all(|(_, other)| {
                let action = other.activity.as_ref().map(|a| a.action);
                action.is_none_or(|a| a.subject() == Some(object))
            });
            if world.state().frame > until || tries == 0 {
                self.joint_lift = None;
            } else if is_ready {
                self.joint_lift = Some((object, until, tries - 1));
                return ControlFlow::Break(Some(pick_up(object)));
            } else {
                return ControlFlow::Break(None);
            }
        }
        // A third person may be faster.
        if let Some((object, ..)) = self.joint_lift
            && agent.index() >= 2
            && hands == [None; 2]
            && self.rng.chance(0.5)
        {
            return ControlFlow::Break(Some(pick_up(object)));
        }
        // Two people lift furniture if both choose it.
        if let Some(object) = picked_furniture(world, agent)
            && self.rng.chance(0.6)
        {
            return ControlFlow::Break(Some(pick_up(object)));
        }
        ControlFlow::Continue(())
    }

    /// Chooses a hand at random. With this probability, prefers a hand whose entry is false.
    fn hand(&mut self, is_avoided: [bool; 2], probability: f32) -> Hand {
        let hand = if self.rng.chance(0.5) { Hand::Left } else { Hand::Right };
        let other = is_avoided[hand.index()] && !is_avoided[hand.other().index()];
        if other && self.rng.chance(probability) { hand.other() } else { hand }
    }

    /// Chooses any id: of an object, a wall, a person, or nothing.
    fn any(&mut self, setup: &Setup) -> EntityId {
        EntityId(self.rng.below(setup.things.len() + 24) as u16)
    }

    fn of_role(&mut self, world: &World, near: &[EntityId], wanted: &[Role]) -> Option<EntityId> {
        let setup = world.setup();
        let of_role = |e: &&EntityId| wanted.contains(&role(setup, **e));
        let possible: Vec<EntityId> = near.iter().filter(of_role).copied().collect();
        self.rng.choose(&possible).copied()
    }

    fn obstacle(&mut self, world: &World, near: &[EntityId]) -> EntityId {
        let found = match self.rng.below(10) {
            0 => None,
            1..3 => self.rng.choose(near).copied(),
            _ => self.of_role(world, near, &[Role::Obstacle]),
        };
        found.unwrap_or_else(|| self.any(world.setup()))
    }

    fn place(&mut self, world: &World, near: &[EntityId]) -> EntityId {
        let goals = &world.setup().goal_places;
        let near_goal = goals.iter().find(|e| near.contains(e)).copied();
        let found = match self.rng.below(10) {
            0 => None,
            1..4 => self.rng.choose(near).copied(),
            4 => self.rng.choose(goals).copied(),
            _ => near_goal.or(self.of_role(world, near, &[Role::Furnishing])),
        };
        found.unwrap_or_else(|| self.any(world.setup()))
    }

    fn object(&mut self, world: &World, near: &[EntityId], agent: AgentId) -> EntityId {
        const CARRIABLE: [Role; 3] = [Role::Target, Role::Container, Role::Fragile];
        let hands = world.state().agents[agent.index()].hands;
        let setup = world.setup();
        let holds_container = hands.iter().flatten().any(|e| role(setup, *e) == Role::Container);
        let piece =
            self.meeting.filter(|e| near.contains(e) && role(setup, *e) == Role::HeavyTarget);
        if let Some(piece) = piece
            && hands == [None; 2]
            && self.rng.chance(0.6)
        {
            if self.rng.chance(0.4) {
                self.joint_lift = Some((piece, world.state().frame + 150, 4));
            }
            return piece;
        }
        let found = match self.rng.below(20) {
            0 => None,
            1..3 => self.rng.choose(near).copied(),
            3..5 => {
                let others = world.state().agents.iter().flat_map(|a| a.hands);
                let held: Vec<EntityId> = others.flatten().collect();
                self.rng.choose(&held).copied()
            }
            5 => self.meeting.filter(|e| near.contains(e)),
            6..9 => self.of_role(world, near, &[Role::HeavyTarget]),
            9..11 => self.of_role(world, near, &[Role::Fragile]),
            11..14 => self.of_role(world, near, &[Role::Container]),
            _ if holds_container => self.of_role(world, near, &[Role::Target]),
            _ => None,
        };
        found
            .or_else(|| self.of_role(world, near, &CARRIABLE))
            .or_else(|| self.of_role(world, near, &[Role::HeavyTarget]))
            .unwrap_or_else(|| self.any(setup))
    }
}
