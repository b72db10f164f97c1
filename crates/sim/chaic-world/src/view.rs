//! Data for agents and renderers: briefings, proprioception, granted information, cameras and
//! postures.

use chaic_core::action::Hand;
use chaic_core::briefing::{Briefing, Companion, CompanionRole, TaskDisclosure};
use chaic_core::capability::{Eyesight, Gait};
use chaic_core::catalogue::{CLASSES, Role};
use chaic_core::geom::{Camera, pitch_rotation, rotate_yaw, yaw_rotation};
use chaic_core::observation::{
    GrantedInfo, Grants, HeldIdentity, HeldObject, JointCarrier, ObservedAction, Proprioception,
};
use chaic_core::rng::RngStream;
use chaic_core::task::SceneKind;
use chaic_core::{Action, AgentId, ClassId, EntityId, Outcome, ResolvedAction, Vec3};

use crate::posture::{Arm, Posture};
use crate::setup::AgentSpec;
use crate::state::{ObjectLocation, Phase};
use crate::world::World;

impl World {
    /// Returns the briefing of an agent before the episode. It contains information about the goal
    /// only if `grants` includes it. The seed of a helper derives from `run_seed`.
    pub fn briefing(&self, me: AgentId, grants: Grants, run_seed: u32) -> Briefing {
        let scene = self.setup.task.info().scene;
        let classes =
            |include: &dyn Fn(ClassId) -> bool| ClassId::all().filter(|c| include(*c)).collect();
        let role = |other: AgentId| match (me, other) {
            (_, AgentId::CHILD) => CompanionRole::Child,
            (AgentId::CHILD, AgentId::PARTNER) => CompanionRole::Guardian,
            _ => CompanionRole::Partner,
        };
        let others = self.setup.agents().filter(|a| *a != me);
        let has_wheelchair = self.setup.people.iter().any(|p| p.capability().gait == Gait::Roll);
        Briefing {
            me,
            capability: self.capability(me),
            motion: self.rules.motion(),
            companions: others.map(|agent| Companion { agent, role: role(agent) }).collect(),
            seed: self.agent_seed(me, run_seed),
            horizon: self.setup.horizon,
            bounds: self.setup.bounds,
            possible_targets: classes(&|c| {
                let fragile = c.info().role == Role::Fragile;
                is_possible_target(c, scene) && (self.rules.fragile_targets || !fragile)
            }),
            containers: classes(&|c| {
                let is_listed = self.rules.containers_with_wheelchair || !has_wheelchair;
                is_listed && c.info().role == Role::Container && scene != SceneKind::Yard
            }),
            obstacles: classes(&|c| c.info().role == Role::Obstacle && scene == SceneKind::House),
            goal_places: match grants.goal_place {
                true => vec![self.object(self.setup.goal_places[0]).0.class],
                false => scene.goal_places(),
            },
            goal_place_min_top_m: if grants.goal { self.goal_min_top_m() } else { 0.0 },
            container_capacity: self.rules.container_capacity,
            grants,
            goal: grants.goal.then(|| self.setup.goal.clone()),
            disclosure: grants.task.then(|| self.task_disclosure()),
            layout: grants.state.then(|| self.layout()),
        }
    }

    /// Returns the seed of an agent's own random streams. Partner and child derive it from the
    /// episode. A helper derives it from the run's seed and its agent id only, so it does not
    /// identify the episode.
    fn agent_seed(&self, agent: AgentId, run_seed: u32) -> u64 {
        match agent {
            AgentId::PARTNER | AgentId::CHILD => episode_stream(self.setup.seed, agent).seed(),
            _ => RngStream::new(u64::from(run_seed), "helper", u64::from(agent.0)).seed(),
        }
    }

    fn task_disclosure(&self) -> TaskDisclosure {
        let task = self.setup.task;
        let partner = self.setup.people.first().map_or(task.info().partner, AgentSpec::kind);
        TaskDisclosure { task, partner }
    }

    /// Returns the proprioception of an agent. `last` is its last action in terms of its own names.
    /// `grants.ids` adds the identities of held objects.
    pub fn proprioception(
        &self,
        agent: AgentId,
        grants: Grants,
        last: Option<(Action, Outcome)>,
    ) -> Proprioception {
        let in_both_hands = self.holds_furniture(agent).is_some();
        let hands = self.person(agent).hands.map(|held| {
            held.map(|entity| HeldObject {
                n_contents: self.contents(entity).len() as u32,
                in_both_hands,
                identity: grants.ids.then(|| self.identity(entity)),
            })
        });
        let joint = self.state.joint.filter(|j| j.leader == agent && j.under_way);
        let other_end = joint
            .map(|j| JointCarrier { agent: j.follower, position_in_body: j.follower_in_leader });
        Proprioception { pose: self.person(agent).pose, hands, last, other_end }
    }

    /// Returns the last completed action of an agent with its outcome.
    pub fn last_action(&self, agent: AgentId) -> Option<(ResolvedAction, Outcome)> {
        self.person(agent).last
    }

    /// Returns the granted information of an agent for this frame, in addition to images and
    /// proprioception. `in_view` holds the entities in the agent's image in the order of ids,
    /// without walls and floor.
    pub fn granted(&self, agent: AgentId, grants: Grants, in_view: &[EntityId]) -> GrantedInfo {
        let mut granted = GrantedInfo::default();
        let is_in_view = |entity: EntityId| in_view.binary_search(&entity).is_ok();
        if grants.ids {
            let class = |e: &EntityId| Some((*e, self.class_of(*e)?));
            granted.classes = in_view.iter().filter_map(class).collect();
            granted.removed = self.announced_obstacles();
        }
        if grants.ids || grants.progress {
            let all = self.delivered().into_iter();
            let listed = all.filter(|e| grants.progress || is_in_view(*e));
            granted.delivered = listed.map(|e| (e, self.object(e).0.class)).collect();
        }
        if grants.goal {
            granted.goal = Some(self.setup.goal.clone());
        }
        let teammate = if agent == AgentId::PARTNER { AgentId::HELPER } else { AgentId::PARTNER };
        if grants.behavior {
            let is_observed =
                |a: &AgentId| *a != agent && (grants.state || is_in_view(EntityId::from_agent(*a)));
            for other in self.setup.agents().filter(is_observed) {
                granted.behavior.extend(self.observed_action(other));
                if other == teammate {
                    let hands = self.person(other).hands;
                    granted.partner_hands = Some(hands.map(|h| h.map(|e| self.identity(e))));
                }
            }
        }
        if grants.positions {
            granted.poses = self.setup.agents().map(|a| (a, self.person(a).pose)).collect();
        }
        granted.state = grants.state.then(|| self.world_state());
        granted
    }

    /// Returns the class of an object or agent.
    fn class_of(&self, entity: EntityId) -> Option<ClassId> {
        let is_person = || entity.agent().is_some_and(|a| a.index() < self.setup.people.len());
        let person = || is_person().then(|| ClassId::named("person"));
        self.setup.object(entity).map(|t| t.class).or_else(person)
    }

    /// Returns the class of every entity, indexed by id; constant during an episode. For rendering
    /// and labels, never for an agent.
    pub fn classes(&self) -> Vec<Option<ClassId>> {
        let n = usize::from(EntityId::FIRST_OBJECT.0) + self.setup.things.len();
        (0..n).map(|i| self.class_of(EntityId(i as u16))).collect()
    }

    fn identity(&self, entity: EntityId) -> HeldIdentity {
        let class = |e: EntityId| self.object(e).0.class;
        let contents = self.contents(entity).into_iter().map(|e| (e, class(e))).collect();
        HeldIdentity { entity, class: class(entity), contents }
    }

    fn observed_action(&self, agent: AgentId) -> Option<ObservedAction> {
        let person = self.person(agent);
        if let Some(activity) = person.activity.as_ref().filter(|a| a.action.is_interaction()) {
            let (frame, action) = (activity.since, activity.action);
            return Some(ObservedAction { agent, frame, action, outcome: None });
        }
        person.last_interaction.map(|(frame, action, outcome)| ObservedAction {
            agent,
            frame,
            action,
            outcome: Some(outcome),
        })
    }

    /// Returns the camera of an agent: at eye height, facing forward, and level unless an
    /// impairment lowers the gaze. `size` is the side length of the image, pixels.
    pub fn camera(&self, agent: AgentId, size: u32) -> Camera {
        let (pose, level) =
            (self.person(agent).pose, yaw_rotation(self.person(agent).pose.yaw_rad));
        let lowered = |eyesight: Eyesight| level * pitch_rotation(-eyesight.lowered_rad);
        Camera {
            eye_in_world: pose.position + Vec3::Y * self.capability(agent).eye_height_m,
            world_from_camera: self.eyesight(agent).map_or(level, lowered),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: size,
            height: size,
        }
    }

    /// Returns the limits of an agent's eyesight, if it has any.
    pub fn eyesight(&self, agent: AgentId) -> Option<Eyesight> {
        self.capability(agent).eyesight
    }

    /// Returns the point in front of an agent at which it holds objects, in the world, meters.
    pub(crate) fn front_in_world(&self, agent: AgentId) -> Vec3 {
        let h = self.capability(agent).height_m;
        self.person(agent).pose.to_world(Vec3::new(0.0, 0.6 * h, -0.3 * h))
    }

    /// Returns the rest position of a hand in the world, meters.
    pub(crate) fn hand_rest_in_world(&self, agent: AgentId, hand: Hand) -> Vec3 {
        let holding = self.person(agent).hands[hand.index()].is_some();
        self.person(agent).pose.to_world(self.hand_rest_in_body(agent, hand, holding))
    }

    /// Returns the rest position of a hand in the body frame: hanging, or in front of the body with
    /// an object. It is scaled with the height of the body (facts S16.1).
    fn hand_rest_in_body(&self, agent: AgentId, hand: Hand, holding: bool) -> Vec3 {
        let c = self.capability(agent);
        let side = if hand == Hand::Left { -1.0 } else { 1.0 };
        match (c.gait, holding) {
            // The unusable arm is in a sling at the chest.
            _ if !c.hands.include(hand) => Vec3::new(0.0, 0.66 * c.height_m, -0.12 * c.height_m),
            (Gait::Roll, true) => Vec3::new(side * 0.18, 0.82, -0.5),
            (Gait::Roll, false) => Vec3::new(side * 0.33, 0.62, 0.0),
            (Gait::WalkBike, _) if hand == Hand::Left => Vec3::new(-0.4, 0.98, -0.35),
            (_, true) => Vec3::new(side * 0.2, 0.57 * c.height_m, -0.31 * c.height_m),
            (_, false) => Vec3::new(side * 0.24, 0.43 * c.height_m, 0.0),
        }
    }

    /// Returns the current position of a hand in the world, meters.
    pub(crate) fn hand_in_world(&self, agent: AgentId, hand: Hand) -> Vec3 {
        let pose = self.person(agent).pose;
        let rest = self.hand_rest_in_world(agent, hand);
        let Some(step) = self.person(agent).phase() else { return rest };
        let applies = |h: Option<Hand>| h.is_none_or(|h| h == hand);
        let spread = |p: Vec3, h: Option<Hand>| match h {
            Some(_) => p,
            // Both hands hold the two sides.
            None => {
                p + rotate_yaw(
                    Vec3::X * if hand == Hand::Left { -0.22 } else { 0.22 },
                    pose.yaw_rad,
                )
            }
        };
        let t = step.progress();
        match step.phase {
            Phase::Reach { hand: h, to, fails } if applies(h) => {
                // A failed reach arrives after two thirds of its time and stays there.
                let t = if fails { (1.5 * t).min(1.0) } else { t };
                rest.lerp(spread(to, h), t * t * (3.0 - 2.0 * t))
            }
            Phase::Grasp { hand: h, object } if applies(h) => {
                let (spec, state) = self.object(object);
                spread(state.position + state.rotation * (Vec3::Y * 0.5 * spec.size_m().y), h)
            }
            Phase::Release { hand: h, object, at, .. } if applies(h) => {
                spread(at + Vec3::Y * 0.5 * self.object(object).0.size_m().y, h)
            }
            Phase::ResetArms { from: Some(from), hand: h } if applies(h) => {
                spread(from, h).lerp(rest, t)
            }
            _ => rest,
        }
    }

    /// Returns the current posture of an agent.
    pub fn posture(&self, agent: AgentId) -> Posture {
        let c = self.capability(agent);
        let person = self.person(agent);
        let arm = |hand: Hand| {
            let offset = self.hand_in_world(agent, hand) - person.pose.position;
            Arm {
                hand_in_body: rotate_yaw(offset, -person.pose.yaw_rad),
                grips: person.hands[hand.index()].is_some(),
            }
        };
        let arms = [arm(Hand::Left), arm(Hand::Right)];
        let phase = person.phase().map(|s| s.phase);
        let is_handling = matches!(
            phase,
            Some(
                Phase::Reach { .. }
                    | Phase::Grasp { .. }
                    | Phase::Release { .. }
                    | Phase::ResetArms { .. }
            )
        );
        let lowest = arms[0].hand_in_body.y.min(arms[1].hand_in_body.y);
        let highest = arms[0].hand_in_body.y.max(arms[1].hand_in_body.y);
        let below = (0.4 * c.height_m - lowest) / (0.4 * c.height_m);
        let above = (highest - 1.1 * c.height_m) / (0.25 * c.height_m);
        Posture {
            persona: self.setup.people[agent.index()].persona,
            impairments: self.setup.people[agent.index()].impairments,
            fatigue: self.fatigue(agent),
            gait: c.gait,
            height_m: c.height_m,
            appearance: self.setup.people[agent.index()].appearance,
            pose: person.pose,
            moving: self.is_moving(agent),
            walked_m: person.walked_m,
            arms,
            bend: if is_handling { below.clamp(0.0, 1.0) } else { 0.0 },
            stretch: if is_handling { above.clamp(0.0, 1.0) } else { 0.0 },
            failing: is_handling && person.activity.as_ref().is_some_and(|a| a.failing.is_some()),
        }
    }

    /// Returns whether the legs or wheels move.
    pub(crate) fn is_moving(&self, agent: AgentId) -> bool {
        let person = self.person(agent);
        let phase = person.phase().map(|s| s.phase);
        matches!(phase, Some(Phase::Walk { .. } | Phase::Approach { .. }))
            || (person.in_stride && matches!(phase, Some(Phase::Stand)))
            || self.is_carried_along(agent)
    }

    fn is_carried_along(&self, agent: AgentId) -> bool {
        self.state.joint.is_some_and(|j| {
            let leader_phase = || self.person(j.leader).phase().map(|s| s.phase);
            j.under_way
                && j.follower == agent
                && matches!(leader_phase(), Some(Phase::Walk { .. } | Phase::Approach { .. }))
        })
    }

    /// Returns whether an object is still in the scene.
    pub fn is_visible(&self, entity: EntityId) -> bool {
        self.setup.object_index(entity).is_some()
            && self.object(entity).1.location != ObjectLocation::Broken
    }
}

/// Returns whether a class may be a target in this kind of scene.
fn is_possible_target(class: ClassId, scene: SceneKind) -> bool {
    let info = &CLASSES[class.index()];
    let tasks = chaic_core::task::TASKS.iter().filter(|t| t.scene == scene);
    let in_sets = tasks.flat_map(|t| t.sets).any(|s| info.sets.contains(s));
    in_sets || (scene == SceneKind::House && info.role == Role::Fragile)
}

/// Returns the random stream of an agent in the world of this seed. It identifies the episode.
pub fn episode_stream(world_seed: u64, agent: AgentId) -> RngStream {
    RngStream::new(world_seed, "agent", u64::from(agent.0))
}
