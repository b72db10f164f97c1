//! Any valid plan, all equally likely.

use chaic_protocol::Briefing;
use chaic_protocol::rng::Stream;

use crate::decision::{Context, Plan, Policy};

/// Chooses uniformly among the valid plans (the paper's random helper).
#[derive(Clone, Debug)]
pub struct Random {
    rng: Stream,
}

impl Default for Random {
    fn default() -> Random {
        Random { rng: Stream::new(0, "random policy", 0) }
    }
}

impl Policy for Random {
    fn reset(&mut self, briefing: &Briefing) {
        self.rng = Stream::new(briefing.seed, "random policy", 0);
    }

    fn choose(&mut self, _: &Context<'_>, valid: &[Plan]) -> Plan {
        self.rng.choose(valid).copied().unwrap_or(Plan::Explore)
    }
}
