//! Beliefs of one episode run, compared with the truth.

use chaic_core::Frame;
use chaic_core::agent::PartnerBelief;
use chaic_core::capability::Persona;
use chaic_core::catalogue::TargetSet;
use chaic_core::task::Goal;
use chaic_env::RunKey;
use chaic_env::trace::Trace;

use super::measures::Sample;
use crate::recorded_belief::{
    Distribution, beliefs, identified, most_likely, per_mille_of, true_person, true_set,
};

/// Frames at which the probability of the true target set is reported.
pub const PROBABILITY_FRAMES: [Frame; 6] = [200, 400, 600, 1000, 1500, 2000];
/// Frames between two samples of the calibration; the first sample is at this frame.
pub const SAMPLE_EVERY_FRAMES: Frame = 100;

/// Beliefs of one episode run at fixed frames, compared with the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeBelief {
    /// The episode run.
    pub key: RunKey,
    /// Probability of the true target set at [`PROBABILITY_FRAMES`], 0 to 1. After the end of the
    /// episode it is that of the last belief.
    pub true_set_probability: [f64; PROBABILITY_FRAMES.len()],
    /// Frame from which the true target set stays identified.
    pub identified: Option<Frame>,
    /// Samples of the target set every [`SAMPLE_EVERY_FRAMES`].
    pub goal_samples: Vec<Sample>,
    /// Samples of the kind of person at the same frames.
    pub person_samples: Vec<Sample>,
    /// Last belief about the target set.
    pub last_goal: Sample,
    /// Last belief about the kind of person.
    pub last_person: Sample,
}

impl EpisodeBelief {
    /// Compares the beliefs in a trace with the truth. Returns `None` if the trace is cut off or has
    /// no belief, or if furniture is the only target set.
    pub fn new(trace: &Trace, goal: &Goal) -> Option<EpisodeBelief> {
        let end = trace.end()?.frame;
        let history: Vec<(Frame, &PartnerBelief)> = beliefs(trace).collect();
        let last = history.last()?.1;
        let set = true_set(goal, last).filter(|set| *set != TargetSet::Furniture)?.name();
        let person = true_person(&trace.header).map_or("", Persona::name);
        let at = |frame: Frame| {
            let n_before = history.partition_point(|(start, _)| *start <= frame);
            Some(history.get(n_before.checked_sub(1)?)?.1)
        };
        let n_samples = end / SAMPLE_EVERY_FRAMES;
        let sampled: Vec<&PartnerBelief> =
            (1..=n_samples).filter_map(|k| at(k * SAMPLE_EVERY_FRAMES)).collect();
        Some(EpisodeBelief {
            key: trace.header.key(),
            true_set_probability: PROBABILITY_FRAMES.map(|frame| {
                at(frame).map_or(0.0, |belief| fraction(per_mille_of(&belief.goals, set)))
            }),
            identified: identified(trace, set),
            goal_samples: sampled.iter().map(|b| sample(&b.goals, set)).collect(),
            person_samples: sampled.iter().map(|b| sample(&b.people, person)).collect(),
            last_goal: sample(&last.goals, set),
            last_person: sample(&last.people, person),
        })
    }
}

fn sample(distribution: &Distribution, truth: &str) -> Sample {
    let (name, confidence) = most_likely(distribution).unwrap_or_default();
    Sample {
        confidence: fraction(confidence),
        is_correct: name == truth,
        true_probability: fraction(per_mille_of(distribution, truth)),
    }
}

/// Converts a probability per mille.
fn fraction(per_mille: u16) -> f64 {
    0.001 * f64::from(per_mille)
}
