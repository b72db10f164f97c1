//! Last known positions of other people.

use chaic_core::{AgentId, Briefing, Frame, Observation, Vec3};

use crate::perception::Detection;

/// Last sighting of one person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedPerson {
    /// The person.
    pub agent: AgentId,
    /// Position, meters: the mean of the visible points, or the feet if positions are granted.
    pub position_in_world: Vec3,
    /// Height of the highest visible point, meters; 0 if the position is granted and the body is
    /// not in the image.
    pub top_m: f32,
    /// Frame of the sighting.
    pub frame: Frame,
    /// True if the person is in the current image, or its position is granted.
    pub is_in_view: bool,
}

/// Last sighting of each companion.
#[derive(Clone, Debug, Default)]
pub struct PersonMap {
    people: Vec<TrackedPerson>,
}

impl PersonMap {
    /// Returns the last sighting of one person.
    pub fn get(&self, agent: AgentId) -> Option<&TrackedPerson> {
        self.people.iter().find(|p| p.agent == agent)
    }

    /// Returns all sightings, in the order of the first sighting.
    pub fn iter(&self) -> impl Iterator<Item = &TrackedPerson> {
        self.people.iter()
    }

    /// Returns a copy without one person.
    pub fn without(&self, agent: AgentId) -> PersonMap {
        PersonMap { people: self.people.iter().copied().filter(|p| p.agent != agent).collect() }
    }

    /// Updates the map with the current detections and granted poses.
    pub fn update(
        &mut self,
        briefing: &Briefing,
        observation: &Observation,
        detections: &[Detection],
    ) {
        for person in &mut self.people {
            person.is_in_view = false;
        }
        for detection in detections {
            if let Some(agent) = detection.person {
                let at = detection.position_in_world;
                self.record(agent, at, Some(detection.top_m), observation.frame);
            }
        }
        for (agent, pose) in &observation.granted.poses {
            if *agent != briefing.me {
                self.record(*agent, pose.position, None, observation.frame);
            }
        }
    }

    /// Records a sighting. Without `top_m`, a detection of the same frame keeps its top height.
    fn record(&mut self, agent: AgentId, at: Vec3, top_m: Option<f32>, frame: Frame) {
        let known = self.people.iter().position(|p| p.agent == agent);
        let visible_m = known.map(|i| self.people[i]).filter(|p| p.frame == frame && p.is_in_view);
        let top_m = top_m.or(visible_m.map(|p| p.top_m)).unwrap_or(0.0);
        let now = TrackedPerson { agent, position_in_world: at, top_m, frame, is_in_view: true };
        match known {
            Some(i) => self.people[i] = now,
            None => self.people.push(now),
        }
    }
}
