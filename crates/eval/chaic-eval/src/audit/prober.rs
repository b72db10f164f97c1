//! An agent that tries everything, to learn what it should not.

use chaic_core::observation::Senses;
use chaic_core::rng::Stream;
use chaic_core::{Action, Agent, AgentError, Briefing, EntityId, Hand, Observation, Target};

/// Names of entities beyond any that an episode has, to be tried too.
const BEYOND: usize = 20;

/// Tries every action on every target: each entity by name, whether or not it may name any, each
/// pixel inside and outside of its image, with either hand; and walks about in between.
#[derive(Debug)]
pub struct Prober {
    sees: bool,
    n_entities: usize,
    stream: Stream,
    next: usize,
}

impl Prober {
    /// One who looks at color, depth and ids (as far as they are granted), or who is blind, in an
    /// episode of so many things.
    pub fn new(sees: bool, n_things: usize) -> Prober {
        let n_entities = usize::from(EntityId::FIRST_OBJECT.0) + n_things + BEYOND;
        Prober { sees, n_entities, stream: Stream::new(0, "prober", 0), next: 0 }
    }

    fn target(&mut self, size: u32) -> Target {
        self.next += 1;
        if self.stream.chance(0.5) {
            Target::Entity(EntityId((self.next % self.n_entities) as u16))
        } else {
            // A few beyond the border.
            let n = size as usize + 2;
            let mut pixel = || self.stream.below(n) as u32;
            Target::Pixel { column: pixel(), row: pixel() }
        }
    }
}

impl Agent for Prober {
    fn senses(&self) -> Senses {
        match self.sees {
            true => Senses { rgb: true, ..Senses::DEPTH_AND_IDS },
            false => Senses::NONE,
        }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.stream = Stream::new(briefing.seed, "prober", 0);
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
