//! Robustness: gains of helpers with partners that they were not tuned on.
//!
//! A *cell* is an episode with one partner. Its gain is the transport rate with the helper minus that
//! without helper, with the same partner and seeds averaged. `docs/metrics.md` defines the figures.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_core::capability::PersonChange;
use chaic_env::helper_registry::NONE;
use serde::Serialize;

use crate::metrics::cluster::{Clusters, Environments};
use crate::metrics::differences::rates;
use crate::metrics::scores::grouped;
use crate::metrics::{Interval, RunResult};

/// Fraction of the cells in the worst decile.
const WORST_FRACTION: f64 = 0.1;

/// Results of all helpers with one partner.
#[derive(Clone, Copy, Debug)]
pub struct PartnerResults<'a> {
    /// Name of the partner.
    pub partner: &'a str,
    /// Change of the person, which is part of the episode ids.
    pub person: Option<PersonChange>,
    /// Results of the run.
    pub results: &'a [RunResult],
}

/// A mean with its 95 % interval over environments.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// The interval; absent if a scene kind has fewer than two environments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<Interval>,
}

/// Gain of a helper with one partner, in transport rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartnerGain {
    /// Name of the partner.
    pub partner: String,
    /// Mean gain over all episodes.
    pub gain: Estimate,
    /// Ratio of this gain to that with the ordinary partner; absent if the latter is not
    /// distinguishable from zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_kept: Option<Estimate>,
    /// Mean gain by task.
    pub tasks: BTreeMap<TaskId, Estimate>,
}

/// Robustness of one helper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HelperRobustness {
    /// Name of the helper.
    pub helper: String,
    /// Number of episodes that were played with every partner, with and without the helper.
    pub episodes: usize,
    /// Gain with the ordinary partner.
    pub ordinary: PartnerGain,
    /// Gain with each other partner.
    pub partners: Vec<PartnerGain>,
    /// Mean gain over all other partners.
    pub suite: Estimate,
    /// Ratio of this mean to the gain with the ordinary partner; absent as in [`PartnerGain`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_kept: Option<Estimate>,
    /// Mean gain over the worst tenth of the cells with other partners.
    pub worst_decile: Estimate,
    /// The same for the cells with the ordinary partner.
    pub worst_decile_ordinary: Estimate,
}

impl HelperRobustness {
    /// Returns the partner with the lowest mean gain; the first of equal ones.
    pub fn worst_partner(&self) -> Option<&PartnerGain> {
        self.partners.iter().min_by(|a, b| a.gain.mean.total_cmp(&b.gain.mean))
    }
}

/// Task and id of an episode with the ordinary partner.
type EpisodeKey<'a> = (TaskId, &'a str);
/// Gains by episode.
type Gains<'a> = BTreeMap<EpisodeKey<'a>, f64>;

/// Computes the robustness of all helpers, in the order of `helpers`. The first of `partners` is the
/// ordinary one. Helpers without a common episode with it and another partner are left out, and so
/// are partners without results.
///
/// A failed run counts as zero; see [`differences`](crate::metrics::differences()).
pub fn robustness(
    partners: &[PartnerResults<'_>],
    helpers: &[String],
    environments: &Environments,
) -> Vec<HelperRobustness> {
    let suffixes: Vec<String> = partners
        .iter()
        .map(|partner| partner.person.map_or_else(String::new, |change| format!("/{change}")))
        .collect();
    let each = helpers.iter().filter(|helper| *helper != NONE);
    each.filter_map(|helper| {
        let gains: Vec<(&str, Gains<'_>)> = partners
            .iter()
            .zip(&suffixes)
            .map(|(partner, suffix)| (partner.partner, gains(partner, suffix, helper)))
            .collect();
        helper_robustness(helper, gains, environments)
    })
    .collect()
}

/// Returns the gains of a helper with one partner.
fn gains<'a>(partner: &PartnerResults<'a>, suffix: &str, helper: &str) -> Gains<'a> {
    let mut gains = Gains::new();
    for (task, by_helper) in grouped(partner.results) {
        let Some((with, without)) = rates(&by_helper, helper).zip(rates(&by_helper, NONE)) else {
            continue;
        };
        for (id, rate) in with {
            let Some(alone) = without.get(id) else { continue };
            let episode = id.strip_suffix(suffix).unwrap_or(id);
            gains.insert((task, episode), rate - alone);
        }
    }
    gains
}

fn helper_robustness(
    helper: &str,
    mut gains: Vec<(&str, Gains<'_>)>,
    environments: &Environments,
) -> Option<HelperRobustness> {
    if gains.first()?.1.is_empty() {
        return None;
    }
    gains.retain(|(_, gains)| !gains.is_empty());
    let mut common: BTreeSet<EpisodeKey<'_>> = gains[0].1.keys().copied().collect();
    common.retain(|episode| gains.iter().all(|(_, gains)| gains.contains_key(episode)));
    for (_, gains) in &mut gains {
        gains.retain(|episode, _| common.contains(episode));
    }
    let ((ordinary_name, ordinary), others) = gains.split_first()?;
    if others.is_empty() || common.is_empty() {
        return None;
    }
    let estimate = |cells: &[(EpisodeKey<'_>, f64)]| Estimate::new(cells, environments);
    let ordinary_cells = cells([ordinary]);
    let ordinary_gain = estimate(&ordinary_cells)?;
    let is_positive = ordinary_gain.interval.is_some_and(|interval| interval.low > 0.0);
    let share = |gains: &Gains<'_>| {
        let linear = linearized_ratio(gains, ordinary);
        if is_positive { estimate(&linear) } else { None }
    };
    let row = |name: &str, gains: &Gains<'_>| {
        let tasks: BTreeSet<TaskId> = gains.keys().map(|(task, _)| *task).collect();
        let in_task = |task: TaskId| {
            let of_task = cells([gains]).into_iter().filter(|((t, _), _)| *t == task);
            Some((task, estimate(&of_task.collect::<Vec<_>>())?))
        };
        Some(PartnerGain {
            partner: name.to_owned(),
            gain: estimate(&cells([gains]))?,
            share_kept: share(gains),
            tasks: tasks.into_iter().filter_map(in_task).collect(),
        })
    };
    let mean_gain = |episode: &EpisodeKey<'_>| {
        others.iter().map(|(_, gains)| gains[episode]).sum::<f64>() / others.len() as f64
    };
    let suite: Gains<'_> = common.iter().map(|episode| (*episode, mean_gain(episode))).collect();
    let other_cells = cells(others.iter().map(|(_, gains)| gains));
    Some(HelperRobustness {
        helper: helper.to_owned(),
        episodes: common.len(),
        ordinary: row(ordinary_name, ordinary)?,
        partners: others.iter().filter_map(|(name, gains)| row(name, gains)).collect(),
        suite: estimate(&cells([&suite]))?,
        share_kept: share(&suite),
        worst_decile: estimate(&linearized_tail(other_cells))?,
        worst_decile_ordinary: estimate(&linearized_tail(ordinary_cells))?,
    })
}

/// Returns all cells of some partners.
fn cells<'g, 'a: 'g>(gains: impl IntoIterator<Item = &'g Gains<'a>>) -> Vec<(EpisodeKey<'a>, f64)> {
    gains.into_iter().flatten().map(|(episode, gain)| (*episode, *gain)).collect()
}

/// Returns values whose mean is the ratio R of the mean gains, and whose spread is that of the ratio
/// to first order: R + (g − R h) / mean(h) for the gains g and h of an episode (Cochran, "Sampling
/// Techniques", 1977, section 6.3).
fn linearized_ratio<'a>(gains: &Gains<'a>, ordinary: &Gains<'a>) -> Vec<(EpisodeKey<'a>, f64)> {
    let n = ordinary.len() as f64;
    let base = ordinary.values().sum::<f64>() / n;
    let ratio = gains.values().sum::<f64>() / n / base;
    let value = |(episode, gain): (&EpisodeKey<'a>, &f64)| {
        (*episode, ratio + (gain - ratio * ordinary[episode]) / base)
    };
    gains.iter().map(value).collect()
}

/// Returns values whose mean is that of the worst tenth of the cells (conditional value at risk), and
/// whose spread is that of this mean to first order. They are q − max(q − x, 0) / 0.1 for the gain x
/// and the tenth percentile q (Rockafellar and Uryasev, "Optimization of Conditional Value-at-Risk",
/// 2000, equation 4). If a tenth of the cells is no whole number, the last one counts as a fraction.
fn linearized_tail(cells: Vec<(EpisodeKey<'_>, f64)>) -> Vec<(EpisodeKey<'_>, f64)> {
    let mut sorted: Vec<f64> = cells.iter().map(|(_, gain)| *gain).collect();
    sorted.sort_by(f64::total_cmp);
    let n_worst = (WORST_FRACTION * sorted.len() as f64).ceil() as usize;
    let Some(quantile) = sorted.get(n_worst.max(1) - 1).copied() else { return cells };
    let value = |gain: f64| quantile - (quantile - gain).max(0.0) / WORST_FRACTION;
    cells.into_iter().map(|(episode, gain)| (episode, value(gain))).collect()
}

impl Estimate {
    /// Computes the mean and its interval over environments; `None` without cells.
    fn new(cells: &[(EpisodeKey<'_>, f64)], environments: &Environments) -> Option<Estimate> {
        let mut clusters = Clusters::default();
        for ((task, episode), value) in cells {
            clusters.add(*task, environments.get(*task, episode), *value);
        }
        Some(Estimate { mean: clusters.mean()?, interval: clusters.interval() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::tests::{case, result};

    const EPISODES: [&str; 4] = ["e0", "e1", "e2", "e3"];

    /// Returns the results of a helper and of no helper with a partner, of ten objects each.
    fn results(suffix: &str, with: [f64; 4], without: [f64; 4]) -> Vec<RunResult> {
        let mut results = Vec::new();
        for (k, episode) in EPISODES.into_iter().enumerate() {
            let id = format!("{episode}{suffix}");
            results.push(result(case("rhp", &id, with[k], 10.0)));
            results.push(result(case("none", &id, without[k], 10.0)));
        }
        results
    }

    fn compute(partners: &[(&str, Option<PersonChange>, Vec<RunResult>)]) -> Vec<HelperRobustness> {
        let partners: Vec<PartnerResults<'_>> = partners
            .iter()
            .map(|(partner, person, results)| PartnerResults { partner, person: *person, results })
            .collect();
        robustness(&partners, &["none".to_owned(), "rhp".to_owned()], &Environments::default())
    }

    fn assert_close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-9, "{a} is not {b}");
    }

    #[test]
    fn gains_are_paired_by_episode_and_by_partner() {
        let tires: PersonChange = "+tires".parse().expect("a change");
        let found = compute(&[
            ("rules", None, results("", [6.0, 7.0, 6.0, 7.0], [2.0, 4.0, 2.0, 4.0])),
            ("slow", None, results("", [5.0, 5.0, 5.0, 5.0], [2.0, 4.0, 2.0, 4.0])),
            ("tires", Some(tires), results("/+tires", [2.0, 2.0, 4.0, 4.0], [1.0, 1.0, 1.0, 1.0])),
        ]);
        let [helper] = &found[..] else { panic!("{found:?}") };
        assert_eq!((helper.helper.as_str(), helper.episodes), ("rhp", 4));
        // Gains: 0.4 0.3 0.4 0.3; 0.3 0.1 0.3 0.1; 0.1 0.1 0.3 0.3.
        assert_close(helper.ordinary.gain.mean, 0.35);
        assert_close(helper.partners[0].gain.mean, 0.2);
        assert_close(helper.partners[1].gain.mean, 0.2);
        assert_close(helper.suite.mean, 0.2);
        assert_close(helper.share_kept.expect("a positive gain").mean, 0.2 / 0.35);
        assert_eq!(helper.worst_partner().expect("two partners").partner, "slow");
        // A tenth of eight cells is 0.8 of a cell, and a tenth of four is 0.4.
        assert_close(helper.worst_decile.mean, 0.1);
        assert_close(helper.worst_decile_ordinary.mean, 0.3);
        let share = helper.partners[1].share_kept.and_then(|share| share.interval);
        let share = share.expect("four environments");
        assert!(share.low < 0.4 && share.high > 0.7 && share.df == 3, "{share:?}");
    }

    #[test]
    fn a_ratio_has_no_spread_if_the_gains_are_proportional() {
        let found = compute(&[
            ("rules", None, results("", [2.0, 4.0, 6.0, 8.0], [0.0; 4])),
            ("half", None, results("", [1.0, 2.0, 3.0, 4.0], [0.0; 4])),
        ]);
        let share = found[0].share_kept.expect("a positive gain");
        assert_close(share.mean, 0.5);
        assert!(share.interval.expect("four environments").se < 1e-9, "{share:?}");
    }

    #[test]
    fn the_worst_tenth_counts_the_last_cell_as_a_fraction() {
        let tail = |values: &[f64]| {
            let cells = values.iter().map(|value| ((TaskId::LowTarget, "e"), *value)).collect();
            let tail = linearized_tail(cells);
            tail.iter().map(|(_, value)| value).sum::<f64>() / tail.len() as f64
        };
        let mut values: Vec<f64> = (0..15).rev().map(f64::from).collect();
        assert_close(tail(&values), (0.0 + 0.5 * 1.0) / 1.5);
        values.truncate(10);
        assert_close(tail(&values), 5.0);
        assert_close(tail(&[3.0]), 3.0);
    }

    #[test]
    fn a_share_needs_a_gain_above_zero() {
        let found = compute(&[
            ("rules", None, results("", [2.0, 0.0, 2.0, 0.0], [0.0, 2.0, 0.0, 1.9])),
            ("slow", None, results("", [1.0; 4], [0.0; 4])),
        ]);
        assert!(found[0].ordinary.gain.mean > 0.0 && found[0].share_kept.is_none());
        // Without results of another partner there is nothing to compare.
        assert!(compute(&[("rules", None, results("", [1.0; 4], [0.0; 4]))]).is_empty());
        let partly = results("", [1.0; 4], [0.0; 4])[..2].to_vec();
        let found = compute(&[
            ("rules", None, results("", [2.0; 4], [0.0; 4])),
            ("slow", None, partly),
            ("noisy", None, Vec::new()),
        ]);
        assert_eq!((found[0].episodes, found[0].partners.len()), (1, 1));
    }
}
