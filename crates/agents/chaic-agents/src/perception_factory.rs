//! Factories that configure an agent's perception.

use chaic_core::observation::{Grants, SensorConfig};

use chaic_core::AgentId;

use crate::behavior::BehaviorModel;
use crate::perception::{GroundTruthIds, Perception, PixelTargets};

/// Name that selects [`GroundTruthPerceptionFactory`], which has no name in traces.
pub const GROUND_TRUTH: &str = "gt";

/// Name that selects [`GroundTruthTracksFactory`].
pub const GT_TRACKS: &str = "gt_tracks";

/// Kind of perception: its name, its required sensors and grants, and constructors of its parts.
pub trait PerceptionFactory: Send + Sync {
    /// Name in traces and reports; `None` for granted ground-truth ids.
    fn name(&self) -> Option<String>;

    /// Sensors that the perception requires.
    fn sensors(&self) -> SensorConfig;

    /// Returns the grants of an agent that uses this perception instead of ground-truth ids.
    fn grants(&self, requested: Grants) -> Grants;

    /// Width and height of images must be multiples of this, pixels.
    fn image_step(&self) -> u32 {
        1
    }

    /// Checks the side of square images, pixels.
    ///
    /// # Errors
    /// If the perception cannot read images of this size.
    fn check_image_size(&self, size: u32) -> Result<(), String> {
        let step = self.image_step();
        if size.is_multiple_of(step) {
            return Ok(());
        }
        Err(format!(
            "this perception needs an image size that is a multiple of {step}, not {size} pixels"
        ))
    }

    /// Creates the perception of one agent.
    fn perception(&self) -> Box<dyn Perception>;

    /// Creates a behavior model of this person; `None` selects the default, grants or inference
    /// from tracks.
    fn behavior(&self, _watched: AgentId) -> Option<Box<dyn BehaviorModel>> {
        None
    }
}

/// Factory of [`GroundTruthIds`].
#[derive(Clone, Copy, Debug, Default)]
pub struct GroundTruthPerceptionFactory;

impl PerceptionFactory for GroundTruthPerceptionFactory {
    fn name(&self) -> Option<String> {
        None
    }

    fn sensors(&self) -> SensorConfig {
        SensorConfig::DEPTH_AND_IDS
    }

    fn grants(&self, requested: Grants) -> Grants {
        requested
    }

    fn perception(&self) -> Box<dyn Perception> {
        Box::new(GroundTruthIds)
    }
}

/// Factory of [`GroundTruthIds`] for agents that act on pixels: it measures what pointing costs.
#[derive(Clone, Copy, Debug, Default)]
pub struct GroundTruthTracksFactory;

impl PerceptionFactory for GroundTruthTracksFactory {
    fn name(&self) -> Option<String> {
        Some(GT_TRACKS.to_owned())
    }

    fn sensors(&self) -> SensorConfig {
        SensorConfig::DEPTH_AND_IDS
    }

    fn grants(&self, requested: Grants) -> Grants {
        requested
    }

    fn perception(&self) -> Box<dyn Perception> {
        Box::new(PixelTargets::<GroundTruthIds>::default())
    }
}
