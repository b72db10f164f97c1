//! What minds are made to see with.

use chaic_core::observation::{Grants, Senses};

use chaic_core::AgentId;

use crate::behavior::BehaviorModel;
use crate::perception::{GroundTruthIds, Perception};

/// What [`TrueSight`], which has no name in traces, is called where one is chosen by name.
pub const GROUND_TRUTH: &str = "gt";

/// A kind of perception: what it is called, what it asks for, and where minds get it from.
pub trait Sight: Send + Sync {
    /// Its name in traces and reports, with which somebody else can see the same; `None` for ids from
    /// ground truth, which are a grant.
    fn name(&self) -> Option<String>;

    /// Which images it looks at.
    fn senses(&self) -> Senses;

    /// What a mind is granted that sees by it instead of by ids from ground truth.
    fn grants(&self, asked: Grants) -> Grants;

    /// A fresh one for one mind.
    fn perception(&self) -> Box<dyn Perception>;

    /// What tells a mind what this person does, if it isn't what the mind has anyway: grants, or what
    /// follows from tracks.
    fn behavior(&self, _watched: AgentId) -> Option<Box<dyn BehaviorModel>> {
        None
    }
}

/// [`GroundTruthIds`].
#[derive(Clone, Copy, Debug, Default)]
pub struct TrueSight;

impl Sight for TrueSight {
    fn name(&self) -> Option<String> {
        None
    }

    fn senses(&self) -> Senses {
        Senses::DEPTH_AND_IDS
    }

    fn grants(&self, asked: Grants) -> Grants {
        asked
    }

    fn perception(&self) -> Box<dyn Perception> {
        Box::new(GroundTruthIds)
    }
}
