//! Rule-based helpers by name.

use chaic_core::observation::Grants;
use chaic_core::{Agent, AgentId};

use crate::behavior::GroundTruthBehavior;
use crate::perception_factory::PerceptionFactory;
use crate::planning_agent::PlanningAgent;
use crate::policies::{
    FollowPolicy, InferOptions, InferPolicy, RandomPolicy, RulePolicy, RuleProfile,
};
use crate::rules::{Exploration, PlannerRules};

/// Table entry of a built-in helper.
#[derive(Clone, Copy, Debug)]
pub struct HelperInfo {
    /// Name in commands and files.
    pub name: &'static str,
    /// Title in result tables.
    pub title: &'static str,
    /// Description in a few words, for lists.
    pub about: &'static str,
    /// Constructs the helper with these planner rules and this perception.
    pub make: fn(PlannerRules, &dyn PerceptionFactory) -> Box<dyn Agent>,
    /// Returns the grants that the helper requests under these rules.
    pub grants: fn(PlannerRules) -> Grants,
}

/// All helpers of this crate.
pub static HELPERS: [HelperInfo; 11] = [
    HelperInfo {
        name: "random",
        title: "Random",
        about: "random valid plans",
        make: |rules, factory| Box::new(random(rules, factory)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "rhp",
        title: "RHP",
        about: "rule-based planner; goal unknown",
        make: |rules, factory| Box::new(rhp(rules, factory)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "oracle",
        title: "Oracle",
        about: "the same planner; goal known",
        make: |rules, factory| Box::new(oracle(rules, factory)),
        grants: |_| Grants::ORACLE,
    },
    HelperInfo {
        name: "follow",
        title: "Follow",
        about: "stays near the partner",
        make: |rules, factory| Box::new(follow(rules, factory)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "infer",
        title: "Infer",
        about: "infers goal and person, then plans for both",
        make: |rules, factory| Box::new(infer(rules, factory, InferOptions::ALL, false)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "infer_no_watching",
        title: "Infer, no watching",
        about: "infer that does not follow the partner",
        make: |rules, factory| {
            Box::new(infer(rules, factory, InferOptions::WITHOUT_FOLLOWING, false))
        },
        grants: planner_grants,
    },
    HelperInfo {
        name: "infer_no_planner",
        title: "Infer, rules",
        about: "infer that follows the oracle's rules",
        make: |rules, factory| Box::new(infer(rules, factory, InferOptions::NO_PLANNER, false)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "infer_no_constraint",
        title: "Infer, goal only",
        about: "infer that assumes an unimpaired adult",
        make: |rules, factory| Box::new(infer(rules, factory, InferOptions::NO_CONSTRAINT, false)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "infer_known_goal",
        title: "Infer, known goal",
        about: "infer with the goal granted",
        make: |rules, factory| Box::new(infer(rules, factory, InferOptions::ALL, true)),
        grants: |rules| Grants { goal: true, ..planner_grants(rules) },
    },
    HelperInfo {
        name: "ideal_observer",
        title: "Ideal observer",
        about: "infer that sees everything; goal unknown",
        make: |rules, factory| Box::new(infer_with_granted_state(rules, factory)),
        grants: |_| Grants { behavior: true, positions: true, state: true, ..Grants::PLANNER },
    },
    HelperInfo {
        name: "oracle_plan",
        title: "Oracle plan",
        about: "upper bound: the planner of infer knows everything",
        make: |rules, factory| Box::new(infer_with_granted_state(rules, factory)),
        grants: |_| Grants::ALL,
    },
];

fn planner_grants(rules: PlannerRules) -> Grants {
    Grants { behavior: rules.knows_partner_behavior, ..Grants::PLANNER }
}

impl HelperInfo {
    /// Returns the helper with this name.
    pub fn find_helper(name: &str) -> Option<&'static HelperInfo> {
        HELPERS.iter().find(|helper| helper.name == name)
    }
}

/// Constructs the random helper: any valid plan with equal probability (paper section 5.2).
pub fn random(rules: PlannerRules, factory: &dyn PerceptionFactory) -> PlanningAgent<RandomPolicy> {
    PlanningAgent::with_perception(RandomPolicy::default(), rules, factory)
}

/// Constructs the rule-based hierarchical planner (RHP): the partner's rules without knowledge of
/// its goal.
pub fn rhp(rules: PlannerRules, factory: &dyn PerceptionFactory) -> PlanningAgent<RulePolicy> {
    PlanningAgent::with_perception(RulePolicy::new(RuleProfile::RHP), rules, factory)
}

/// Constructs the oracle: RHP's rules with the goal, the progress and the partner's actions
/// granted.
pub fn oracle(rules: PlannerRules, factory: &dyn PerceptionFactory) -> PlanningAgent<RulePolicy> {
    let behavior = Box::new(GroundTruthBehavior::default());
    let policy = RulePolicy::new(RuleProfile::ORACLE);
    PlanningAgent::with(policy, factory.perception(), behavior, rules).replace_perception(factory)
}

/// Constructs the helper that infers goal and constraint from what it sees, and plans for both.
/// `knows_goal` tells whether the goal is granted.
pub fn infer(
    rules: PlannerRules,
    factory: &dyn PerceptionFactory,
    options: InferOptions,
    knows_goal: bool,
) -> PlanningAgent<InferPolicy> {
    let policy = InferPolicy::new(options);
    // A perception may withhold the partner's actions, which the agent then recognizes itself.
    let grants = factory.grants(Grants { goal: knows_goal, ..planner_grants(rules) });
    let rules = explore_unknown_area(rules);
    PlanningAgent::with_watched(policy, rules, factory, AgentId::PARTNER, grants)
}

/// Returns rules that explore where most area is unknown instead of at the nearest frontier. Random
/// exploration is kept.
pub fn explore_unknown_area(rules: PlannerRules) -> PlannerRules {
    match rules.exploration {
        Exploration::Frontier => PlannerRules { exploration: Exploration::UnknownArea, ..rules },
        _ => rules,
    }
}

/// Constructs an upper bound: the inferring helper with granted state and behavior.
pub fn infer_with_granted_state(
    rules: PlannerRules,
    factory: &dyn PerceptionFactory,
) -> PlanningAgent<InferPolicy> {
    let behavior = Box::new(GroundTruthBehavior::default());
    let policy = InferPolicy::new(InferOptions::ALL);
    PlanningAgent::with(policy, factory.perception(), behavior, rules).replace_perception(factory)
}

/// Constructs the helper that always stays near the partner.
pub fn follow(rules: PlannerRules, factory: &dyn PerceptionFactory) -> PlanningAgent<FollowPolicy> {
    PlanningAgent::with_perception(FollowPolicy::default(), rules, factory)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behavior::{BehaviorLog, BehaviorModel};
    use crate::memory::Memory;
    use crate::perception::Perception;
    use crate::perception_factory::GroundTruthPerceptionFactory;
    use chaic_core::Observation;
    use chaic_core::observation::{FrameHistorySpec, SensorConfig};

    const HISTORY: FrameHistorySpec =
        FrameHistorySpec { image_size: 32, every_frames: 3, max_len: 4 };

    /// Perception that withholds the partner's actions, because its model recognizes them.
    struct Recognition;

    #[derive(Default)]
    struct RecognitionModel(BehaviorLog);

    impl PerceptionFactory for Recognition {
        fn name(&self) -> Option<String> {
            None
        }

        fn sensors(&self) -> SensorConfig {
            GroundTruthPerceptionFactory.sensors()
        }

        fn grants(&self, requested: Grants) -> Grants {
            Grants { behavior: requested.behavior && requested.goal, ..requested }
        }

        fn perception(&self) -> Box<dyn Perception> {
            GroundTruthPerceptionFactory.perception()
        }

        fn behavior(&self, _: AgentId) -> Option<Box<dyn BehaviorModel>> {
            Some(Box::new(RecognitionModel::default()))
        }
    }

    impl BehaviorModel for RecognitionModel {
        fn reset(&mut self) {}

        fn frame_history(&self) -> Option<FrameHistorySpec> {
            Some(HISTORY)
        }

        fn observe(&mut self, _: &Observation, _: &Memory) {}

        fn log(&self) -> &BehaviorLog {
            &self.0
        }

        fn fork(&self) -> Box<dyn BehaviorModel> {
            Box::new(RecognitionModel(self.0.clone()))
        }
    }

    #[test]
    fn a_helper_recognizes_the_actions_that_its_perception_withholds() {
        for (name, recognizes) in [("infer", true), ("infer_no_planner", true), ("oracle", false)] {
            let info = HelperInfo::find_helper(name).unwrap();
            for rules in [PlannerRules::paper(), PlannerRules::compat()] {
                let history = (info.make)(rules, &Recognition).sensors().frame_history;
                assert_eq!(history == Some(HISTORY), recognizes, "{name}");
            }
        }
        let info = HelperInfo::find_helper("infer_known_goal").unwrap();
        let history = (info.make)(PlannerRules::compat(), &Recognition).sensors().frame_history;
        assert_eq!(history, None, "with the goal, the actions are granted");
    }

    #[test]
    fn every_name_has_a_helper_with_the_grants_of_its_kind() {
        for info in &HELPERS {
            let name = info.name;
            assert!(
                (info.make)(PlannerRules::paper(), &GroundTruthPerceptionFactory).sensors().depth,
                "{name}"
            );
            for rules in [PlannerRules::paper(), PlannerRules::compat()] {
                let grants = (info.grants)(rules);
                let is_among = |names: &[&str]| names.contains(&name);
                assert_eq!(
                    grants.goal,
                    is_among(&["oracle", "infer_known_goal", "oracle_plan"]),
                    "{name}"
                );
                assert!(grants.ids && grants.goal_place, "{name}");
                let is_bound = is_among(&["ideal_observer", "oracle_plan"]);
                let knows_behavior = is_bound || name == "oracle" || rules.knows_partner_behavior;
                assert_eq!(grants.behavior, knows_behavior, "{name}");
                assert_eq!((grants.state, grants.positions), (is_bound, is_bound), "{name}");
                assert_eq!(grants.task, name == "oracle_plan", "{name}");
            }
            assert_eq!(HelperInfo::find_helper(name).map(|h| h.title), Some(info.title));
            assert!(!info.about.is_empty(), "{name}");
        }
        assert!(HelperInfo::find_helper("unknown").is_none());
    }
}
