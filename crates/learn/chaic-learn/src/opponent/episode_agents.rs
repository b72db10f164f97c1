//! Agents of the episodes that windows are collected from.

use chaic_core::rng::RngStream;

/// Fraction of the episodes whose partner pauses before each plan. Partners that follow the rules never
/// wait.
const WAITING_FRACTION: f32 = 0.25;
/// Fraction of the episodes with a random helper, as in the paper. The other helper, RHP, stays
/// closer to its partner.
const RANDOM_FRACTION: f32 = 0.5;

/// Agents of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EpisodeAgentKinds {
    /// True if the partner pauses before each plan.
    pub partner_waits: bool,
    /// True if the helper is random, false if it is RHP.
    pub helper_is_random: bool,
}

impl EpisodeAgentKinds {
    /// Draws the agents of the episode with this seed, independently of each other and of its task.
    pub fn draw(seed: u64) -> EpisodeAgentKinds {
        let chance = |purpose: &str, p: f32| RngStream::new(seed, purpose, 0).chance(p);
        EpisodeAgentKinds {
            partner_waits: chance("opponent/partner", WAITING_FRACTION),
            helper_is_random: chance("opponent/helper", RANDOM_FRACTION),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_episodes::{DatasetSplit, SeedRange};

    #[test]
    fn every_task_has_all_pairs_of_agents() {
        let first = SeedRange::opponent_model(DatasetSplit::Train).first;
        // Tasks take turns, as in a collection of 2,000 episodes of eight tasks.
        for task in 0..8 {
            let drawn: Vec<EpisodeAgentKinds> =
                (0..250).map(|k| EpisodeAgentKinds::draw(first + 8 * k + task)).collect();
            let count = |is_match: fn(&EpisodeAgentKinds) -> bool| {
                drawn.iter().filter(|agents| is_match(agents)).count()
            };
            // The standard deviations are 7, 8 and 5.
            let n_waiting = count(|agents| agents.partner_waits);
            assert!((42..=83).contains(&n_waiting), "task {task}: {n_waiting}");
            let n_random = count(|agents| agents.helper_is_random);
            assert!((101..=149).contains(&n_random), "task {task}: {n_random}");
            let n_both = count(|agents| agents.partner_waits && agents.helper_is_random);
            assert!((16..=46).contains(&n_both), "task {task}: {n_both}");
        }
    }
}
