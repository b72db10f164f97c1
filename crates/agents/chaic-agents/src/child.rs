//! The child who comes along while shopping: follows, now and then runs away, and comes back when
//! the helper is near (facts A2.4).

use chaic_core::agent::{ChildState, Thought};
use chaic_core::briefing::Relation;
use chaic_core::geom::{wrap_angle, xz, yaw_towards};
use chaic_core::observation::Senses;
use chaic_core::rng::Stream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Frame, Observation, Vec2, Vec3};

use crate::execution::follow::{Follow, Follower};
use crate::execution::navigate::{Destination, Nav, Navigator};
use crate::execution::recover::Recovery;
use crate::execution::walking::style;
use crate::mapping::Space;
use crate::memory::Memory;
use crate::perception::{GroundTruthIds, Perception as _};
use crate::rules::{ChildDraws, PlannerRules};
use crate::track::{Intent, named};

/// The draws that are escapes if they are the same in every episode: those of the original's first
/// forty that are at most 20 of 100. In 3000 frames there are 30 draws at most.
const ESCAPES: [u32; 6] = [6, 14, 26, 38, 39, 40];
/// Points drawn and points kept at most.
const DRAWS: (usize, usize) = (2000, 500);

/// What the child is up to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ChildBehavior {
    Follow,
    /// Runs to a point (x, z).
    RunAway(Vec2),
    GotoGuardian,
}

/// The child's mind. It knows where everybody is.
#[derive(Clone, Debug)]
pub struct Child {
    rules: PlannerRules,
    episode: Option<Episode>,
}

#[derive(Clone, Debug)]
struct Episode {
    briefing: Briefing,
    memory: Memory,
    navigator: Navigator,
    recovery: Recovery,
    follower: Follower,
    rng: Stream,
    n_draws: u32,
    behavior: ChildBehavior,
    since: Option<Frame>,
}

impl Child {
    /// A child that has not been briefed.
    pub fn new(rules: PlannerRules) -> Child {
        Child { rules, episode: None }
    }
}

impl Episode {
    fn new(briefing: &Briefing, rules: PlannerRules) -> Episode {
        Episode {
            briefing: briefing.clone(),
            memory: Memory::new(briefing, rules),
            navigator: Navigator::default(),
            recovery: Recovery::default(),
            follower: Follower::default(),
            rng: Stream::new(briefing.seed, "child", 0),
            n_draws: 0,
            behavior: ChildBehavior::Follow,
            since: None,
        }
    }

    fn position_of(&self, agent: Option<AgentId>) -> Option<Vec3> {
        self.memory.people.get(agent?).map(|p| p.position_in_world)
    }

    fn guardian(&self) -> Option<AgentId> {
        let relation = |r| self.briefing.companion(r);
        relation(Relation::Guardian).or_else(|| relation(Relation::Partner))
    }

    fn helper(&self) -> Option<AgentId> {
        let guardian = self.guardian();
        self.briefing.companions.iter().map(|c| c.agent).find(|a| Some(*a) != guardian)
    }

    /// The state machine of the original's child.
    fn change_behavior(&mut self) {
        let here = self.memory.pose.position;
        let away_m = |p: Option<Vec3>| p.map_or(f32::INFINITY, |p| xz(p).distance(xz(here)));
        let (guardian, helper) =
            (self.position_of(self.guardian()), self.position_of(self.helper()));
        let (now, rules) = (self.memory.frame, self.memory.rules.child);
        let is_due = self.since.is_none_or(|since| now > since + rules.plan_frames);
        let next = match self.behavior {
            ChildBehavior::RunAway(_) if away_m(helper) < rules.caught_m => {
                ChildBehavior::GotoGuardian
            }
            ChildBehavior::GotoGuardian if is_due && away_m(guardian) < rules.home_m => {
                ChildBehavior::Follow
            }
            ChildBehavior::Follow if is_due => {
                let runs = self.draws_escape();
                match guardian.filter(|_| runs).and_then(|g| self.far_point(g)) {
                    Some(point) => ChildBehavior::RunAway(point),
                    None => ChildBehavior::Follow,
                }
            }
            same => same,
        };
        if is_due || next != self.behavior {
            self.since = Some(now);
        }
        if next != self.behavior {
            self.navigator.reset();
            self.recovery.reset();
            self.follower = Follower::default();
            self.behavior = next;
        }
    }

    fn draws_escape(&mut self) -> bool {
        self.n_draws += 1;
        match self.memory.rules.child_draws {
            ChildDraws::Seeded => self.rng.chance(self.memory.rules.child.run_chance),
            ChildDraws::Constant => ESCAPES.contains(&self.n_draws),
        }
    }

    /// A point far off and away from the guardian: of all that were drawn, the one at three
    /// quarters by distance from the guardian.
    fn far_point(&mut self, guardian: Vec3) -> Option<Vec2> {
        let rules = self.memory.rules.child;
        let inside = self.briefing.bounds.grown(-rules.border_m);
        let here = self.memory.here();
        let to_guardian = yaw_towards(self.memory.pose.position, guardian);
        let mut kept: Vec<(f32, Vec2)> = Vec::new();
        for _ in 0..DRAWS.0 {
            let point = Vec2::new(
                self.rng.range(inside.min.x, inside.max.x.max(inside.min.x + 0.01)),
                self.rng.range(inside.min.y, inside.max.y.max(inside.min.y + 0.01)),
            );
            let from_guardian_m = point.distance(xz(guardian));
            let yaw = yaw_towards(self.memory.pose.position, Vec3::new(point.x, 0.0, point.y));
            let off = wrap_angle(yaw - to_guardian).abs();
            let is_far = from_guardian_m > rules.far_m;
            let enough = if is_far { rules.off_far_rad } else { rules.off_rad };
            if point.distance(here) > rules.run_min_m && off > enough && self.is_free(point) {
                kept.push((from_guardian_m, point));
            }
            if kept.len() == DRAWS.1 {
                break;
            }
        }
        kept.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.get(kept.len() * 3 / 4).map(|(_, point)| *point)
    }

    fn is_free(&self, point: Vec2) -> bool {
        let Memory { map, rules, .. } = &self.memory;
        map.grid().disc(point, rules.child.free_m).all(|c| map.space(c) < Space::Occupied)
    }

    fn act(&mut self, observation: &Observation) -> Intent {
        let percepts = GroundTruthIds.perceive(observation);
        self.memory.update(&self.briefing, observation, &percepts);
        self.change_behavior();
        if self.recovery.is_hopeless() {
            self.recovery = Recovery::default();
            if matches!(self.behavior, ChildBehavior::RunAway(_)) {
                // It can't get there: here is as good.
                self.behavior = ChildBehavior::RunAway(self.memory.here());
            }
        }
        let last = observation.own.last;
        if style(self.memory.rules.walking).recovers()
            && let Some(action) = self.recovery.step(&mut self.memory, last, &mut self.rng)
        {
            return action;
        }
        match self.behavior {
            ChildBehavior::RunAway(point) => self.run_to(point),
            ChildBehavior::Follow | ChildBehavior::GotoGuardian => {
                let Some(guardian) = self.guardian() else { return self.fidget() };
                let keep_m = self.memory.rules.child.follow_m;
                match self.follower.step(&mut self.memory, &mut self.navigator, guardian, keep_m) {
                    Follow::Act(action) => action,
                    Follow::Near(action) => {
                        self.recovery.stand();
                        action
                    }
                    Follow::Lost => self.fidget(),
                }
            }
        }
    }

    fn run_to(&mut self, point: Vec2) -> Intent {
        let there_m = self.memory.rules.child.there_m;
        match self.navigator.step(&mut self.memory, &Destination::near(point, there_m)) {
            Nav::Act(action) => action,
            Nav::Arrived => self.fidget(),
            Nav::Unreachable => {
                self.behavior = ChildBehavior::RunAway(self.memory.here());
                self.fidget()
            }
        }
    }

    /// Stands about, looking here and there.
    fn fidget(&mut self) -> Intent {
        self.recovery.stand();
        match self.rng.below(4) {
            0 => Action::TurnLeft,
            1 => Action::TurnRight,
            _ => Action::Wait { frames: 5 },
        }
    }
}

impl Agent for Child {
    fn senses(&self) -> Senses {
        Senses::DEPTH_AND_IDS
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.episode = Some(Episode::new(briefing, self.rules));
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let intent = self.episode.as_mut().map(|episode| episode.act(observation));
        let action = intent.and_then(|intent| named(intent, |track| GroundTruthIds.target(track)));
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

    fn seen_at(x: f32, z: f32) -> Pose {
        Pose { position: Vec3::new(x, 0.0, z), yaw_rad: 0.0 }
    }

    /// A child without eyes on a bare plane, with everybody where they are put.
    struct Stage {
        child: Child,
        observation: Observation,
    }

    impl Stage {
        fn new(seed: u64) -> Stage {
            let toy = Toy::room(28.0, 13.0);
            let mut briefing = toy.briefing();
            briefing.seed = seed;
            briefing.me = AgentId::CHILD;
            briefing.companions = vec![
                Companion { agent: AgentId::PARTNER, relation: Relation::Guardian },
                Companion { agent: AgentId::HELPER, relation: Relation::Partner },
            ];
            let mut child = Child::new(PlannerRules::paper());
            child.reset(&briefing);
            let mut observation = toy.observe();
            observation.images = Default::default();
            Stage { child, observation }
        }

        fn state_at(&mut self, frame: Frame, guardian_x: f32, helper_x: f32) -> ChildState {
            self.observation.frame = frame;
            self.observation.granted.poses = vec![
                (AgentId::PARTNER, seen_at(guardian_x, 0.0)),
                (AgentId::HELPER, seen_at(helper_x, 0.0)),
            ];
            self.child.act(&self.observation).expect("rules decide");
            self.child.child_state().expect("it was briefed")
        }
    }

    #[test]
    fn one_draw_in_five_is_an_escape_and_draws_are_a_hundred_frames_apart() {
        let (mut escapes, n) = (0, 600);
        for seed in 0..n {
            let mut stage = Stage::new(seed);
            escapes += u32::from(stage.state_at(0, 1.0, 9.0) == ChildState::RunAway);
        }
        // 120 expected, standard deviation 9.8.
        assert!((85..155).contains(&escapes), "{escapes} of {n}");
        let mut stage = (0..50)
            .map(Stage::new)
            .find_map(|mut s| (s.state_at(0, 1.0, 9.0) == ChildState::Follow).then_some(s))
            .expect("most follow at first");
        for frame in 1..=ChildRules::STANDARD.plan_frames {
            assert_eq!(
                stage.state_at(frame, 1.0, 9.0),
                ChildState::Follow,
                "no draw before frame 101"
            );
        }
    }

    #[test]
    fn the_constant_draws_let_it_run_at_the_sixth_in_every_episode() {
        for seed in 0..5 {
            let mut stage = Stage::new(seed);
            stage.child.rules.child_draws = ChildDraws::Constant;
            stage.child.episode.as_mut().expect("briefed").memory.rules = stage.child.rules;
            // A draw at once, and then one every 101 frames.
            let first =
                (0..2000).find(|frame| stage.state_at(*frame, 1.0, 9.0) == ChildState::RunAway);
            assert_eq!(first, Some(5 * (ChildRules::STANDARD.plan_frames + 1)), "seed {seed}");
        }
    }

    #[test]
    fn it_comes_back_only_when_the_helper_is_near_and_follows_when_home() {
        let mut stage = (0..50)
            .map(Stage::new)
            .find_map(|mut s| (s.state_at(0, 1.0, 9.0) == ChildState::RunAway).then_some(s))
            .expect("some run at once");
        for frame in (10..2000).step_by(10) {
            assert_eq!(stage.state_at(frame, 1.0, 2.6), ChildState::RunAway);
        }
        assert_eq!(stage.state_at(2000, 6.0, 2.4), ChildState::GotoGuardian);
        assert_eq!(stage.state_at(2101, 6.0, 2.4), ChildState::GotoGuardian, "still 6 m from home");
        assert_eq!(stage.state_at(2202, 2.9, 9.0), ChildState::Follow);
    }

    #[test]
    fn points_to_run_to_are_far_inside_and_away_from_the_guardian() {
        for seed in 0..40 {
            let mut stage = Stage::new(seed);
            stage.state_at(0, 2.0, 9.0);
            let episode = stage.child.episode.as_mut().expect("briefed");
            let guardian = Vec3::new(2.0, 0.0, 0.0);
            let point = episode.far_point(guardian).expect("there is room");
            assert!(episode.briefing.bounds.contains(point));
            assert!(point.length() > ChildRules::STANDARD.run_min_m);
            let off = wrap_angle(
                yaw_towards(Vec3::ZERO, Vec3::new(point.x, 0.0, point.y))
                    - yaw_towards(Vec3::ZERO, guardian),
            );
            assert!(off.abs() > ChildRules::STANDARD.off_far_rad);
        }
    }
}
