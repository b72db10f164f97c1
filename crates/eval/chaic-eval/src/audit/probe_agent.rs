//! An agent that tries all actions that could reveal hidden state.

use chaic_core::observation::SensorConfig;
use chaic_core::rng::RngStream;
use chaic_core::{Action, Agent, AgentError, Briefing, EntityId, Hand, Observation, Target};

/// Number of entity ids beyond the episode's own that are tried.
const N_UNKNOWN_IDS: usize = 20;

/// Agent that tries every action on every target with either hand. Targets are entity ids, granted
/// or not, and pixels inside and outside the image. In between it walks at random.
#[derive(Debug)]
pub struct ProbeAgent {
    has_camera: bool,
    n_entities: usize,
    stream: RngStream,
    next: usize,
}

impl ProbeAgent {
    /// Creates an agent for an episode with `n_objects` objects. With `has_camera` it requests
    /// color, depth and ids; otherwise no images.
    pub fn new(has_camera: bool, n_objects: usize) -> ProbeAgent {
        let n_entities = usize::from(EntityId::FIRST_OBJECT.0) + n_objects + N_UNKNOWN_IDS;
        ProbeAgent { has_camera, n_entities, stream: RngStream::new(0, "prober", 0), next: 0 }
    }

    fn target(&mut self, size: u32) -> Target {
        self.next += 1;
        if self.stream.chance(0.5) {
            Target::Entity(EntityId((self.next % self.n_entities) as u16))
        } else {
            // Includes pixels beyond the border.
            let n = size as usize + 2;
            let mut pixel = || self.stream.below(n) as u32;
            Target::Pixel { column: pixel(), row: pixel() }
        }
    }
}

impl Agent for ProbeAgent {
    fn sensors(&self) -> SensorConfig {
        match self.has_camera {
            true => SensorConfig { rgb: true, ..SensorConfig::DEPTH_AND_IDS },
            false => SensorConfig::NONE,
        }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.stream = RngStream::new(briefing.seed, "prober", 0);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let target = self.target(observation.camera.width);
        let hand = Hand::BOTH[self.stream.below(2)];
        Ok(match self.stream.below(12) {
            0..=3 => Action::MoveForward,
            4 => Action::TurnLeft,
            5 => Action::TurnRight,
            6..=8 => Action::PickUp { object: target, hand },
            9 => Action::PutOn { place: target, hand },
            10 => Action::RemoveObstacle { obstacle: target, hand },
            _ if self.stream.chance(0.5) => Action::PutIn,
            _ => Action::Wait { frames: 1 + self.stream.below(20) as u32 },
        })
    }
}
