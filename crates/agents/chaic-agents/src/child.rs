//! Child of the shopping task: it follows its guardian, sometimes runs away, and comes back when
//! the helper is near (facts A2.4).

use chaic_core::agent::{ChildState, Thought};
use chaic_core::briefing::CompanionRole;
use chaic_core::geom::{to_xz, wrap_angle, yaw_towards};
use chaic_core::observation::SensorConfig;
use chaic_core::rng::RngStream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Frame, Observation, Vec2, Vec3};

use crate::execution::destination::Destination;
use crate::execution::follow::{FollowStep, Follower};
use crate::execution::navigation::{NavigationStep, Navigator};
use crate::execution::new_navigator;
use crate::execution::recovery::Recovery;
use crate::mapping::CellOccupancy;
use crate::memory::Memory;
use crate::perception::{GroundTruthIds, Perception as _};
use crate::rules::{ChildDraws, PlannerRules};
use crate::track::{Intent, resolve_target};

/// Draws, from 1, that are escapes under [`ChildDraws::Constant`]: of the original's first forty,
/// those of at most 20 of 100. An episode of 3000 frames has at most 30 draws.
const ESCAPE_DRAWS: [u32; 6] = [6, 14, 26, 38, 39, 40];
/// Maximum number of points drawn.
const MAX_DRAWS: usize = 2000;
/// Maximum number of suitable points.
const MAX_POINTS: usize = 500;

/// State of the child's state machine.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ChildBehavior {
    Follow,
    /// Runs to a point (x, z).
    RunAway(Vec2),
    GotoGuardian,
}

/// Agent of the child. It knows the positions of all agents.
#[derive(Clone, Debug)]
pub struct ChildAgent {
    rules: PlannerRules,
    episode: Option<Episode>,
}

#[derive(Clone, Debug)]
struct Episode {
    briefing: Briefing,
    memory: Memory,
    navigator: Box<dyn Navigator>,
    recovery: Recovery,
    follower: Follower,
    rng: RngStream,
    n_draws: u32,
    behavior: ChildBehavior,
    /// Frame of the last decision, or of the last change of state.
    last_decision: Option<Frame>,
}

impl ChildAgent {
    /// Creates a child without an episode.
    pub fn new(rules: PlannerRules) -> ChildAgent {
        ChildAgent { rules, episode: None }
    }
}

impl Episode {
    fn new(briefing: &Briefing, rules: PlannerRules) -> Episode {
        Episode {
            briefing: briefing.clone(),
            memory: Memory::new(briefing, rules),
            navigator: new_navigator(rules.walking),
            recovery: Recovery::default(),
            follower: Follower::default(),
            rng: RngStream::new(briefing.seed, "child", 0),
            n_draws: 0,
            behavior: ChildBehavior::Follow,
            last_decision: None,
        }
    }

    fn position_of(&self, agent: Option<AgentId>) -> Option<Vec3> {
        self.memory.people.get(agent?).map(|p| p.position_in_world)
    }

    fn guardian(&self) -> Option<AgentId> {
        let companion = |role| self.briefing.companion(role);
        companion(CompanionRole::Guardian).or_else(|| companion(CompanionRole::Partner))
    }

    fn helper(&self) -> Option<AgentId> {
        let guardian = self.guardian();
        self.briefing.companions.iter().map(|c| c.agent).find(|a| Some(*a) != guardian)
    }

    /// Advances the state machine of the original's child.
    fn update_behavior(&mut self) {
        let here = self.memory.pose.position;
        let distance_m =
            |p: Option<Vec3>| p.map_or(f32::INFINITY, |p| to_xz(p).distance(to_xz(here)));
        let (guardian, helper) =
            (self.position_of(self.guardian()), self.position_of(self.helper()));
        let (now, rules) = (self.memory.frame, self.memory.rules.child);
        let is_due =
            self.last_decision.is_none_or(|since| now > since + rules.decision_interval_frames);
        let next = match self.behavior {
            ChildBehavior::RunAway(_) if distance_m(helper) < rules.turn_back_distance_m => {
                ChildBehavior::GotoGuardian
            }
            ChildBehavior::GotoGuardian
                if is_due && distance_m(guardian) < rules.returned_distance_m =>
            {
                ChildBehavior::Follow
            }
            ChildBehavior::Follow if is_due => {
                let escapes = self.draw_escape();
                match guardian.filter(|_| escapes).and_then(|g| self.escape_target(g)) {
                    Some(point) => ChildBehavior::RunAway(point),
                    None => ChildBehavior::Follow,
                }
            }
            same => same,
        };
        if is_due || next != self.behavior {
            self.last_decision = Some(now);
        }
        if next != self.behavior {
            self.navigator.reset();
            self.recovery.reset();
            self.follower = Follower::default();
            self.behavior = next;
        }
    }

    fn draw_escape(&mut self) -> bool {
        self.n_draws += 1;
        match self.memory.rules.child_draws {
            ChildDraws::Seeded => self.rng.chance(self.memory.rules.child.escape_probability),
            ChildDraws::Constant => ESCAPE_DRAWS.contains(&self.n_draws),
        }
    }

    /// Draws points far from here and off the guardian's direction, and returns the one at the 75th
    /// percentile of distance from the guardian.
    fn escape_target(&mut self, guardian: Vec3) -> Option<Vec2> {
        let rules = self.memory.rules.child;
        let inside = self.briefing.bounds.expanded(-rules.bounds_margin_m);
        let here = self.memory.position();
        let to_guardian = yaw_towards(self.memory.pose.position, guardian);
        let mut kept: Vec<(f32, Vec2)> = Vec::new();
        for _ in 0..MAX_DRAWS {
            let point = Vec2::new(
                self.rng.range(inside.min.x, inside.max.x.max(inside.min.x + 0.01)),
                self.rng.range(inside.min.y, inside.max.y.max(inside.min.y + 0.01)),
            );
            let from_guardian_m = point.distance(to_xz(guardian));
            let yaw = yaw_towards(self.memory.pose.position, Vec3::new(point.x, 0.0, point.y));
            let off = wrap_angle(yaw - to_guardian).abs();
            let is_far = from_guardian_m > rules.far_from_guardian_m;
            let min_off_rad =
                if is_far { rules.escape_min_angle_far_rad } else { rules.escape_min_angle_rad };
            if point.distance(here) > rules.escape_min_m && off > min_off_rad && self.is_free(point)
            {
                kept.push((from_guardian_m, point));
            }
            if kept.len() == MAX_POINTS {
                break;
            }
        }
        kept.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.get(kept.len() * 3 / 4).map(|(_, point)| *point)
    }

    fn is_free(&self, point: Vec2) -> bool {
        let Memory { map, rules, .. } = &self.memory;
        map.grid()
            .disc(point, rules.child.target_clearance_m)
            .all(|c| map.state(c) < CellOccupancy::Occupied)
    }

    fn act(&mut self, observation: &Observation) -> Intent {
        let percepts = GroundTruthIds.perceive(observation);
        self.memory.update(&self.briefing, observation, &percepts);
        self.update_behavior();
        if self.recovery.should_give_up() {
            self.recovery = Recovery::default();
            if matches!(self.behavior, ChildBehavior::RunAway(_)) {
                // The point is unreachable: stay here instead.
                self.behavior = ChildBehavior::RunAway(self.memory.position());
            }
        }
        let last = observation.proprioception.last;
        if self.navigator.needs_recovery()
            && let Some(action) = self.recovery.step(&mut self.memory, last, &mut self.rng)
        {
            return action;
        }
        match self.behavior {
            ChildBehavior::RunAway(point) => self.run_towards(point),
            ChildBehavior::Follow | ChildBehavior::GotoGuardian => {
                let Some(guardian) = self.guardian() else { return self.idle() };
                let keep_m = self.memory.rules.child.follow_distance_m;
                match self.follower.step(
                    &mut self.memory,
                    self.navigator.as_mut(),
                    guardian,
                    keep_m,
                ) {
                    FollowStep::Act(action) => action,
                    FollowStep::Near(action) => {
                        self.recovery.record_stop();
                        action
                    }
                    FollowStep::Lost => self.idle(),
                }
            }
        }
    }

    fn run_towards(&mut self, point: Vec2) -> Intent {
        let arrival_m = self.memory.rules.child.arrival_distance_m;
        match self.navigator.step(&mut self.memory, &Destination::near(point, arrival_m)) {
            NavigationStep::Act(action) => action,
            NavigationStep::Arrived => self.idle(),
            NavigationStep::Unreachable => {
                self.behavior = ChildBehavior::RunAway(self.memory.position());
                self.idle()
            }
        }
    }

    /// Stands still, or turns at random.
    fn idle(&mut self) -> Intent {
        self.recovery.record_stop();
        match self.rng.below(4) {
            0 => Action::TurnLeft,
            1 => Action::TurnRight,
            _ => Action::Wait { frames: 5 },
        }
    }
}

impl Agent for ChildAgent {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::DEPTH_AND_IDS
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.episode = Some(Episode::new(briefing, self.rules));
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let intent = self.episode.as_mut().map(|episode| episode.act(observation));
        let action =
            intent.and_then(|intent| resolve_target(intent, |track| GroundTruthIds.target(track)));
        Ok(action.unwrap_or(Action::Wait { frames: 5 }))
    }

    fn thought(&self) -> Thought {
        let plan = match self.episode.as_ref().map(|e| e.behavior) {
            Some(ChildBehavior::RunAway(_)) => "run away",
            Some(ChildBehavior::GotoGuardian) => "go back",
            Some(ChildBehavior::Follow) | None => "come along",
        };
        Thought { plan: plan.to_owned(), ..Thought::default() }
    }

    fn child_state(&self) -> Option<ChildState> {
        self.episode.as_ref().map(|e| match e.behavior {
            ChildBehavior::Follow => ChildState::Follow,
            ChildBehavior::RunAway(_) => ChildState::RunAway,
            ChildBehavior::GotoGuardian => ChildState::GotoGuardian,
        })
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        Some(Box::new(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rules::ChildRules;
    use crate::test_support::Toy;
    use chaic_core::briefing::Companion;
    use chaic_core::geom::Pose;

    fn pose_at(x: f32, z: f32) -> Pose {
        Pose { position: Vec3::new(x, 0.0, z), yaw_rad: 0.0 }
    }

    /// A child without camera on an empty plane; the other agents are placed by the test.
    struct Scenario {
        child: ChildAgent,
        observation: Observation,
    }

    impl Scenario {
        fn new(seed: u64) -> Scenario {
            let toy = Toy::room(28.0, 13.0);
            let mut briefing = toy.briefing();
            briefing.seed = seed;
            briefing.me = AgentId::CHILD;
            briefing.companions = vec![
                Companion { agent: AgentId::PARTNER, role: CompanionRole::Guardian },
                Companion { agent: AgentId::HELPER, role: CompanionRole::Partner },
            ];
            let mut child = ChildAgent::new(PlannerRules::paper());
            child.reset(&briefing);
            let mut observation = toy.observe();
            observation.images = Default::default();
            Scenario { child, observation }
        }

        fn state_at(&mut self, frame: Frame, guardian_x: f32, helper_x: f32) -> ChildState {
            self.observation.frame = frame;
            self.observation.granted.poses = vec![
                (AgentId::PARTNER, pose_at(guardian_x, 0.0)),
                (AgentId::HELPER, pose_at(helper_x, 0.0)),
            ];
            self.child.act(&self.observation).expect("rule-based agents do not fail");
            self.child.child_state().expect("it has a briefing")
        }
    }

    #[test]
    fn one_draw_in_five_is_an_escape_and_draws_are_a_hundred_frames_apart() {
        let (mut escapes, n) = (0, 600);
        for seed in 0..n {
            let mut scenario = Scenario::new(seed);
            escapes += u32::from(scenario.state_at(0, 1.0, 9.0) == ChildState::RunAway);
        }
        // 120 expected, standard deviation 9.8.
        assert!((85..155).contains(&escapes), "{escapes} of {n}");
        let mut scenario = (0..50)
            .map(Scenario::new)
            .find_map(|mut s| (s.state_at(0, 1.0, 9.0) == ChildState::Follow).then_some(s))
            .expect("most follow at first");
        for frame in 1..=ChildRules::STANDARD.decision_interval_frames {
            assert_eq!(
                scenario.state_at(frame, 1.0, 9.0),
                ChildState::Follow,
                "no draw before frame 101"
            );
        }
    }

    #[test]
    fn with_constant_draws_it_escapes_at_the_sixth_draw_of_every_episode() {
        for seed in 0..5 {
            let mut scenario = Scenario::new(seed);
            scenario.child.rules.child_draws = ChildDraws::Constant;
            scenario.child.episode.as_mut().expect("it has a briefing").memory.rules =
                scenario.child.rules;
            // The first draw comes at once, the next ones every 101 frames.
            let first =
                (0..2000).find(|frame| scenario.state_at(*frame, 1.0, 9.0) == ChildState::RunAway);
            assert_eq!(
                first,
                Some(5 * (ChildRules::STANDARD.decision_interval_frames + 1)),
                "seed {seed}"
            );
        }
    }

    #[test]
    fn it_comes_back_only_when_the_helper_is_near_and_follows_once_it_has_returned() {
        let mut scenario = (0..50)
            .map(Scenario::new)
            .find_map(|mut s| (s.state_at(0, 1.0, 9.0) == ChildState::RunAway).then_some(s))
            .expect("some run at once");
        for frame in (10..2000).step_by(10) {
            assert_eq!(scenario.state_at(frame, 1.0, 2.6), ChildState::RunAway);
        }
        assert_eq!(scenario.state_at(2000, 6.0, 2.4), ChildState::GotoGuardian);
        assert_eq!(
            scenario.state_at(2101, 6.0, 2.4),
            ChildState::GotoGuardian,
            "still 6 m from home"
        );
        assert_eq!(scenario.state_at(2202, 2.9, 9.0), ChildState::Follow);
    }

    #[test]
    fn escape_targets_are_far_within_bounds_and_away_from_the_guardian() {
        for seed in 0..40 {
            let mut scenario = Scenario::new(seed);
            scenario.state_at(0, 2.0, 9.0);
            let episode = scenario.child.episode.as_mut().expect("it has a briefing");
            let guardian = Vec3::new(2.0, 0.0, 0.0);
            let point = episode.escape_target(guardian).expect("there is room");
            assert!(episode.briefing.bounds.contains(point));
            assert!(point.length() > ChildRules::STANDARD.escape_min_m);
            let off = wrap_angle(
                yaw_towards(Vec3::ZERO, Vec3::new(point.x, 0.0, point.y))
                    - yaw_towards(Vec3::ZERO, guardian),
            );
            assert!(off.abs() > ChildRules::STANDARD.escape_min_angle_far_rad);
        }
    }
}
