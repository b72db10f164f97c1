//! Where the other people were seen last.

use chaic_core::{AgentId, Briefing, Frame, Observation, Vec3};

use crate::perception::Detection;

/// What is remembered of one person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Person {
    /// Who.
    pub agent: AgentId,
    /// Where, metres: the mean of the visible points, or the feet if positions are granted.
    pub position_in_world: Vec3,
    /// When.
    pub frame: Frame,
    /// Whether the person is in the image now (or its position is granted).
    pub is_in_view: bool,
}

/// The last sighting of each companion.
#[derive(Clone, Debug, Default)]
pub struct People {
    seen: Vec<Person>,
}

impl People {
    /// The last sighting of one person.
    pub fn get(&self, agent: AgentId) -> Option<&Person> {
        self.seen.iter().find(|p| p.agent == agent)
    }

    /// All sightings, in the order of first sight.
    pub fn iter(&self) -> impl Iterator<Item = &Person> {
        self.seen.iter()
    }

    /// All but one.
    pub fn without(&self, agent: AgentId) -> People {
        People { seen: self.seen.iter().copied().filter(|p| p.agent != agent).collect() }
    }

    /// Takes in who is seen now.
    pub fn see(&mut self, briefing: &Briefing, observation: &Observation, seen: &[Detection]) {
        for person in &mut self.seen {
            person.is_in_view = false;
        }
        for detection in seen {
            if let Some(agent) = detection.person {
                self.note(agent, detection.position_in_world, observation.frame);
            }
        }
        for (agent, pose) in &observation.granted.poses {
            if *agent != briefing.me {
                self.note(*agent, pose.position, observation.frame);
            }
        }
    }

    fn note(&mut self, agent: AgentId, position_in_world: Vec3, frame: Frame) {
        let now = Person { agent, position_in_world, frame, is_in_view: true };
        match self.seen.iter_mut().find(|p| p.agent == agent) {
            Some(person) => *person = now,
            None => self.seen.push(now),
        }
    }
}
