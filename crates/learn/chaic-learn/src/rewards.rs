//! What is rewarded: facts of the world that no helper is told.

use chaic_core::{AgentId, Frame};
use chaic_env::Totals;
use chaic_world::World;
use serde::{Deserialize, Serialize};

/// What each term is worth; 0 switches it off. The paper rewards deliveries, the distance to the nearest target and
/// invalid actions (appendix on learning), and doesn't tell its weights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rewards {
    /// For everything that is wanted, by whomever it is delivered.
    pub team: f32,
    /// For everything that is wanted, where the helper itself delivers it: less of the partner's luck is in it.
    pub own: f32,
    /// For everything that is wanted, while the helper holds it: taken back when it is delivered, dropped, or the
    /// episode ends.
    pub held: f32,
    /// Taken off for each metre of the way to the next delivery.
    pub way_per_m: f32,
    /// Taken off for each own action other than moving about that fails.
    pub failed: f32,
    /// Taken off if the child is away from its guardian all the time.
    pub emergency: f32,
}

impl Default for Rewards {
    fn default() -> Rewards {
        Rewards { team: 5.0, own: 5.0, held: 2.0, way_per_m: 0.0, failed: 0.0, emergency: 0.5 }
    }
}

/// What the helper of one episode has earned so far.
#[derive(Clone, Debug)]
pub struct Account {
    rewards: Rewards,
    n_failed: u32,
    last_deed: Option<Frame>,
}

impl Account {
    /// Nothing yet.
    pub fn new(rewards: Rewards) -> Account {
        Account { rewards, n_failed: 0, last_deed: None }
    }

    /// What has been earned as the world stands. It is to be asked whenever somebody decides, or failures are missed.
    pub fn earned(&mut self, world: &World) -> f32 {
        let deed = world.state().people.get(AgentId::HELPER.index()).and_then(|p| p.last_deed);
        if let Some((frame, _, outcome)) = deed
            && self.last_deed != Some(frame)
        {
            self.last_deed = Some(frame);
            self.n_failed += u32::from(!outcome.is_success());
        }
        let Rewards { team, own, held, way_per_m, failed, emergency } = self.rewards;
        let totals = Totals::of(world, AgentId::HELPER);
        // What is on its way is worth nothing when there is no time left for it.
        let (held, way_per_m) = if world.is_over() { (0.0, 0.0) } else { (held, way_per_m) };
        team * totals.delivered as f32 + own * totals.own as f32 + held * totals.held as f32
            - way_per_m * totals.way_m as f32
            - failed * self.n_failed as f32
            - emergency * totals.emergency as f32
    }
}
