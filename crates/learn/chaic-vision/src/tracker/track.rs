//! Evidence and position of one track.

use chaic_agents::perception::SegmentMeasurement;
use chaic_core::{Frame, Vec2};

use super::plan_extent::PlanExtent;
use super::{DetectedObject, Measurement, Track, TrackerConfig};
use crate::labels::n_labels;
use crate::loss::{exp, ln, sigmoid};

/// Probability of each label that a detection does not name.
const UNNAMED: f32 = 0.001;
/// Maximum displacement at which an object near a person counts as unmoved, so that the person does
/// not hold it, meters.
const UNMOVED_M: f32 = 0.15;

impl Track {
    /// Probability of a label, given that the object exists.
    fn probability(&self, label: u8) -> f32 {
        let evidence = self.evidence.get(&label).copied().unwrap_or(0.0);
        let max = self.evidence.values().copied().fold(0.0, f32::max);
        let n_other = (n_labels() - 1).saturating_sub(self.evidence.len()) as f32;
        let sum: f32 = self.evidence.values().map(|evidence| exp(evidence - max)).sum();
        exp(evidence - max) / (sum + n_other * exp(-max))
    }

    /// Probability that track and detection have the same label.
    pub(super) fn agreement(&self, measurement: &Measurement) -> f32 {
        let shared =
            |(label, _): &(u8, f32)| self.probability(*label) * measurement.probability(*label);
        measurement.names.iter().map(shared).sum()
    }

    /// Probability that the object exists and has its label.
    pub(super) fn confidence(&self) -> f32 {
        sigmoid(self.log_odds) * self.probability(self.label)
    }

    /// Returns whether the object probably is where it was last seen: no person carries it, and the
    /// agent has not released it since.
    pub(super) fn is_at_rest(&self) -> bool {
        !self.is_carried && !self.is_released
    }

    /// Adds the evidence of a detection for existence and label.
    pub(super) fn add_evidence(&mut self, measurement: &Measurement, config: &TrackerConfig) {
        let [low, high] = config.log_odds_range;
        let score = measurement.score();
        self.log_odds = match self.evidence.is_empty() {
            true => config.birth_log_odds * (score - config.birth_score),
            false => self.log_odds + config.hit_log_odds * score,
        };
        self.log_odds = self.log_odds.clamp(low, high);
        self.evidence.values_mut().for_each(|evidence| *evidence *= config.evidence_decay);
        for (label, _) in &measurement.names {
            let ratio = measurement.probability(*label).max(UNNAMED) / UNNAMED;
            *self.evidence.entry(*label).or_default() += score * ln(ratio);
        }
        let strongest = self.evidence.iter().fold((0.0, self.label), |best, (label, evidence)| {
            if *evidence > best.0 { (*evidence, *label) } else { best }
        });
        self.label = strongest.1;
    }

    /// Returns whether a detection that matches shows more than the object: the mask is too large for
    /// one object, and the extent of the object is known.
    pub(super) fn is_part_of(&self, object: &DetectedObject<'_>, config: &TrackerConfig) -> bool {
        let is_oversized = |extent: PlanExtent| config.is_oversized(self.label, &extent);
        self.is_at_rest()
            && !object.in_hand
            && self.extent.is_some_and(|extent| !is_oversized(extent))
            && object.large_extent(self.label).is_some_and(is_oversized)
    }

    /// Returns the part of a larger mask that shows the object, which stays at its place.
    pub(super) fn part_of(&self, mask: &SegmentMeasurement) -> SegmentMeasurement {
        let is_own = |point: &&Vec2| self.extent.is_none_or(|extent| extent.contains(**point, 0.0));
        SegmentMeasurement {
            position_in_world: self.position,
            top_m: mask.top_m.min(self.top_m),
            footprint: mask.footprint.iter().filter(is_own).copied().collect(),
            ..mask.clone()
        }
    }

    /// Updates place and extent by a detection.
    pub(super) fn locate(
        &mut self,
        object: &DetectedObject<'_>,
        now: Frame,
        config: &TrackerConfig,
    ) {
        let SegmentMeasurement { position_in_world, top_m, .. } = object.measurement.extent;
        let is_elsewhere =
            !self.is_at_rest() || self.position.distance(position_in_world) > UNMOVED_M;
        let is_carried = object.in_hand && is_elsewhere;
        let has_moved = !self.is_at_rest() || is_carried;
        self.position = position_in_world;
        let seen = object.large_extent(self.label);
        self.top_m = if has_moved { top_m } else { self.top_m.max(top_m) };
        self.extent = match (&self.extent, seen) {
            (Some(extent), Some(seen)) if !has_moved => {
                // A mask that overlaps a neighbor does not enlarge the object.
                let fits = config.fits_object(self.label, extent, &seen);
                Some(if fits { extent.union(&seen) } else { *extent })
            }
            (_, seen) => seen,
        };
        (self.last_seen, self.is_carried, self.is_released) = (now, is_carried, false);
    }
}
