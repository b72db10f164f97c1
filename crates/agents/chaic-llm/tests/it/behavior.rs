//! Promise: prompts contain what the behavior model of the run's perception recognized, put-ons and
//! failed attempts included.

use std::sync::Arc;

use chaic_agents::TrackId;
use chaic_agents::behavior::{BehaviorLog, BehaviorModel, ObservedInteraction};
use chaic_agents::memory::Memory;
use chaic_agents::perception::{GroundTruthIds, Perception};
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Action, AgentId, FailureReason, Hand, Observation, Outcome, TaskId};
use chaic_llm::LanguageHelpers;
use chaic_llm_standin::Options;

use crate::common::{Fixture, exchanges, flag, standin};

/// Perception with a behavior model in place of granted behavior, as `--behavior learned`.
struct ScriptedFactory;

impl PerceptionFactory for ScriptedFactory {
    fn name(&self) -> Option<String> {
        None
    }

    fn sensors(&self) -> SensorConfig {
        SensorConfig::DEPTH_AND_IDS
    }

    fn grants(&self, requested: Grants) -> Grants {
        Grants { behavior: false, ..requested }
    }

    fn perception(&self) -> Box<dyn Perception> {
        Box::new(GroundTruthIds)
    }

    fn behavior(&self, person: AgentId) -> Option<Box<dyn BehaviorModel>> {
        Some(Box::new(ScriptedBehavior { person, log: BehaviorLog::default() }))
    }
}

/// Behavior model that recognizes the same interactions in each episode.
#[derive(Clone)]
struct ScriptedBehavior {
    person: AgentId,
    log: BehaviorLog,
}

impl BehaviorModel for ScriptedBehavior {
    fn reset(&mut self) {
        self.log = BehaviorLog::default();
    }

    fn observe(&mut self, _: &Observation, _: &Memory) {
        let hand = Hand::Left;
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        let [first, second, place] = [60_001, 60_002, 60_003].map(TrackId);
        let interactions = [
            (1, Action::PickUp { object: first, hand }, failed),
            (2, Action::PickUp { object: second, hand }, Outcome::Success),
            (3, Action::PutIn, Outcome::Success),
            (4, Action::PutOn { place, hand }, failed),
            (5, Action::PutOn { place, hand }, Outcome::Success),
        ];
        let observed = |(frame, action, outcome)| ObservedInteraction {
            agent: self.person,
            frame,
            action,
            outcome: Some(outcome),
        };
        self.log.actions = interactions.map(observed).to_vec();
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }

    fn fork(&self) -> Box<dyn BehaviorModel> {
        Box::new(self.clone())
    }
}

#[test]
fn prompts_contain_recognized_interactions() {
    const EXPECTED: &str = "
- frame 1: pick up something #60001, failed (beyond this person's limits)
- frame 2: pick up something #60002, done
- frame 3: put something into a container, done
- frame 4: put something on something #60003, failed (beyond this person's limits)
- frame 5: put something on something #60003, done
";
    let fixture = Fixture::new(&[TaskId::NoConstraint], 60);
    let (_standin, settings) = standin(Options::default());
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let language = language.with_perception(Arc::new(ScriptedFactory));
    // The model replaces the granted actions of the last one.
    let request = fixture.request(&["llm", "vlm", "llm_known_task"]);
    assert!(fixture.play("run", &request, &language).0, "{:?}", language.problem());
    let records = fixture.records("run");
    assert_eq!(records.len(), 3);
    for record in &records {
        let exchanges = exchanges(record);
        assert!(!exchanges.is_empty());
        for exchange in exchanges {
            let prompt = &exchange.request.messages[0].text;
            assert!(prompt.contains(EXPECTED), "{}: {prompt}", record.header.key.helper);
        }
    }
}
