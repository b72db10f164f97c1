//! What the others do: a log of their actions and holdings, as far as it is known.

use chaic_protocol::observation::SeenAction;
use chaic_protocol::{Action, AgentId, ClassId, EntityId, Frame, Observation};

use crate::memory::Memory;

/// What is known of the others' doings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BehaviorLog {
    /// Their actions other than moving about, oldest first; an action under way is replaced by
    /// its end.
    pub actions: Vec<SeenAction>,
    /// What the partner held when that was known last, contents included.
    pub partner_holds: Vec<(EntityId, ClassId)>,
    /// When that was.
    pub partner_holds_frame: Option<Frame>,
    /// Every object that the partner was ever known to take, in the order of taking.
    pub partner_took: Vec<(EntityId, ClassId)>,
}

impl BehaviorLog {
    /// The last known attempt of this person to pick something up that has ended.
    pub fn last_pick_of(&self, agent: AgentId) -> Option<(&SeenAction, EntityId)> {
        let has_ended = |seen: &&SeenAction| seen.agent == agent && seen.outcome.is_some();
        self.actions.iter().rev().filter(has_ended).find_map(|seen| match seen.action {
            Action::PickUp { object, .. } => Some((seen, object)),
            _ => None,
        })
    }
}

/// Recognizes what the others do.
pub trait BehaviorModel: Send {
    /// Begins an episode.
    fn reset(&mut self);

    /// Looks at one observation, after the memory has taken it in.
    fn watch(&mut self, observation: &Observation, memory: &Memory);

    /// What is known so far.
    fn log(&self) -> &BehaviorLog;
}

/// Reads what was granted, and nothing else; silent without a grant.
#[derive(Clone, Debug, Default)]
pub struct GroundTruthBehavior {
    log: BehaviorLog,
}

impl BehaviorModel for GroundTruthBehavior {
    fn reset(&mut self) {
        self.log = BehaviorLog::default();
    }

    fn watch(&mut self, observation: &Observation, _: &Memory) {
        let log = &mut self.log;
        for seen in &observation.granted.behavior {
            let same = |old: &&mut SeenAction| {
                old.agent == seen.agent
                    && old.action == seen.action
                    && (old.frame == seen.frame || old.outcome.is_none())
            };
            match log.actions.iter_mut().rev().take(4).find(same) {
                Some(old) => *old = *seen,
                None => log.actions.push(*seen),
            }
        }
        if let Some(hands) = &observation.granted.partner_hands {
            log.partner_holds = hands
                .iter()
                .flatten()
                .flat_map(|h| {
                    std::iter::once((h.entity, h.class)).chain(h.contents.iter().copied())
                })
                .collect();
            // Furniture is held by both hands and appears twice.
            log.partner_holds.sort_unstable();
            log.partner_holds.dedup();
            log.partner_holds_frame = Some(observation.frame);
            for held in &log.partner_holds {
                if !log.partner_took.contains(held) {
                    log.partner_took.push(*held);
                }
            }
        }
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Toy;
    use chaic_protocol::observation::Held;
    use chaic_protocol::{Hand, Outcome};

    #[test]
    fn an_action_under_way_is_replaced_by_its_end_and_holdings_are_collected() {
        let toy = Toy::room(4.0, 4.0);
        let memory = Memory::new(&toy.briefing(), crate::PlannerRules::paper());
        let mut model = GroundTruthBehavior::default();
        let apple = (EntityId(20), ClassId::named("apple"));
        let mut seen = SeenAction {
            agent: AgentId::PARTNER,
            frame: 10,
            action: Action::PickUp { object: apple.0, hand: Hand::Left },
            outcome: None,
        };
        let mut observation = toy.observe();
        observation.granted.behavior = vec![seen];
        model.watch(&observation, &memory);
        assert_eq!(model.log().last_pick_of(AgentId::PARTNER), None, "it is under way");
        (seen.frame, seen.outcome) = (40, Some(Outcome::Success));
        observation.granted.behavior = vec![seen];
        let held = Held { entity: apple.0, class: apple.1, contents: vec![] };
        observation.granted.partner_hands = Some([Some(held.clone()), Some(held)]);
        model.watch(&observation, &memory);
        model.watch(&observation, &memory);
        assert_eq!(model.log().actions, vec![seen]);
        assert_eq!(model.log().partner_took, vec![apple]);
        let last = model.log().last_pick_of(AgentId::PARTNER);
        assert_eq!(last.map(|(_, object)| object), Some(apple.0));
        assert_eq!(model.log().last_pick_of(AgentId::CHILD), None);
    }
}
