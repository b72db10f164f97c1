//! What a helper knows at its first decision, and whether that predicts the task or the partner.
//!
//! [`Opening`] holds the briefing and the first observation of a helper. [`distinct`] counts openings
//! that differ, [`predict`] tries to predict a label from start poses, and [`varying_fields`] lists the
//! fields that are not the same in all openings of one kind of scene.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::capability::PersonKind;
use chaic_core::geom::math;
use chaic_core::observation::{Grants, Senses};
use chaic_core::rng::Stream;
use chaic_core::task::SceneKind;
use chaic_core::{AgentId, TaskId};
use chaic_env::rules::RuleSet;
use chaic_env::{Digest, Env, EpisodeConfig, Minds, Seat};
use chaic_episodes::Episode;
use serde_json::Value;

use crate::error::Result;

/// Neighbors that vote in [`predict`].
const NEIGHBORS: usize = 5;
/// Random permutations of labels that tell the accuracy by chance.
const PERMUTATIONS: u32 = 100;

/// What a helper knows at its first decision.
#[derive(Clone, Debug)]
pub struct Opening {
    /// Hidden: the task.
    pub task: TaskId,
    /// Hidden: what kind of person the partner is.
    pub partner: PersonKind,
    /// The kind of scene, which the briefing names by its classes.
    pub scene: SceneKind,
    /// Fields of the briefing by their path, as JSON.
    pub briefing: BTreeMap<String, String>,
    /// Fields of the own state by their path, as JSON.
    pub own: BTreeMap<String, String>,
    /// Start pose: x and z in metres, sine and cosine of the yaw.
    pub pose: [f64; 4],
    /// Digest of the images of the first observation.
    pub images: Digest,
}

impl Opening {
    /// Returns the opening of an episode for a helper with these grants and senses.
    ///
    /// # Errors
    /// If the episode can't be played.
    pub fn of(episode: &Episode, grants: Grants, senses: Senses) -> Result<Opening> {
        let config = EpisodeConfig {
            episode,
            seed: 0,
            rules: RuleSet::PAPER,
            helper: "opening",
            partner: None,
            // The partner's first image is of no interest here.
            image_size: Some(*Senses::IMAGE_SIZES.start()),
            appearance: chaic_render::Appearance::Canonical,
        };
        let helper = Some(Seat::of_caller(grants, senses));
        let mut env = Env::new(config, Minds { helper, partner: None })?;
        env.advance(None)?;
        let briefing = env.briefing(AgentId::HELPER);
        let seen = env.observe(AgentId::HELPER).expect("all agents decide at the beginning");
        let (own, images) = (&seen.own, &seen.images);
        let yaw_rad = own.pose.yaw_rad;
        let (sin, cos) = (f64::from(math::sin(yaw_rad)), f64::from(math::cos(yaw_rad)));
        let at = own.pose.position;
        let depth = images.depth_m.iter().flatten().flat_map(|d| d.to_le_bytes());
        let pixels: Vec<u8> = images.rgb.iter().flatten().copied().chain(depth).collect();
        let setup = episode.setup();
        let info = setup.task.info();
        Ok(Opening {
            task: setup.task,
            partner: setup.people.first().map_or(info.partner, |person| person.kind()),
            scene: info.scene,
            briefing: fields(&serde_json::to_value(&briefing).expect("a briefing is JSON")),
            own: fields(&serde_json::to_value(own).expect("an own state is JSON")),
            pose: [f64::from(at.x), f64::from(at.z), sin, cos],
            images: Digest::of_bytes(&pixels),
        })
    }
}

/// Leaves of a JSON value by their path; elements of lists by their index.
fn fields(value: &Value) -> BTreeMap<String, String> {
    fn add(path: &str, value: &Value, out: &mut BTreeMap<String, String>) {
        let below =
            |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
        match value {
            Value::Object(map) => map.iter().for_each(|(k, v)| add(&below(k), v, out)),
            Value::Array(list) => {
                out.insert(below("len"), list.len().to_string());
                list.iter().enumerate().for_each(|(k, v)| add(&below(&k.to_string()), v, out));
            }
            leaf => drop(out.insert(path.to_owned(), leaf.to_string())),
        }
    }
    let mut out = BTreeMap::new();
    add("", value, &mut out);
    out
}

/// Returns how many different keys the openings have.
pub fn distinct<K: Ord>(openings: &[&Opening], key: impl Fn(&Opening) -> K) -> usize {
    openings.iter().map(|opening| key(opening)).collect::<BTreeSet<K>>().len()
}

/// Returns the fields that are not the same in all openings, with the number of their values.
pub fn varying_fields(
    openings: &[&Opening],
    of: impl Fn(&Opening) -> &BTreeMap<String, String>,
) -> Vec<(String, usize)> {
    let names: BTreeSet<&String> = openings.iter().flat_map(|opening| of(opening).keys()).collect();
    let values = |name: &String| distinct(openings, |opening| of(opening).get(name).cloned());
    names.into_iter().map(|name| (name.clone(), values(name))).filter(|(_, n)| *n > 1).collect()
}

/// How often a prediction was right, and how often it is by chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Share of right predictions, 0 to 1.
    pub accuracy: f64,
    /// Mean accuracy where labels are permuted at random, 0 to 1.
    pub chance: f64,
    /// Standard deviation of the accuracy where labels are permuted at random.
    pub deviation: f64,
}

impl Prediction {
    /// Lets the voters of each opening predict its label, which the other fold's most frequent label
    /// replaces where there are no voters.
    fn of(mut labels: Vec<String>, voters: &[Vec<usize>]) -> Prediction {
        let accuracy = accuracy(&labels, voters);
        let mut random = Stream::new(0, "permuted labels", 0);
        let permuted: Vec<f64> = (0..PERMUTATIONS)
            .map(|_| {
                random.shuffle(&mut labels);
                self::accuracy(&labels, voters)
            })
            .collect();
        let chance = permuted.iter().sum::<f64>() / f64::from(PERMUTATIONS);
        let squares: f64 = permuted.iter().map(|a| (a - chance) * (a - chance)).sum();
        let deviation = (squares / f64::from(PERMUTATIONS - 1)).sqrt();
        Prediction { accuracy, chance, deviation }
    }

    /// Returns by how many standard deviations the accuracy is above chance.
    pub fn z(&self) -> f64 {
        (self.accuracy - self.chance) / self.deviation.max(1e-9)
    }
}

fn accuracy(labels: &[String], voters: &[Vec<usize>]) -> f64 {
    let n = labels.len();
    let of_fold = [0, 1].map(|fold| majority((fold..n).step_by(2).map(|j| &labels[j])));
    let is_right = |i: &usize| {
        let found = if voters[*i].is_empty() {
            of_fold[1 - *i % 2]
        } else {
            majority(voters[*i].iter().map(|j| &labels[*j]))
        };
        found == Some(&labels[*i])
    };
    (0..n).filter(is_right).count() as f64 / n as f64
}

/// The most frequent label; the first by name among equals.
fn majority<'a>(labels: impl Iterator<Item = &'a String>) -> Option<&'a String> {
    let mut counts: BTreeMap<&String, usize> = BTreeMap::new();
    labels.for_each(|label| *counts.entry(label).or_default() += 1);
    let best = counts.into_iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(a.0)));
    best.map(|(label, _)| label)
}

/// Indices of the openings that predict the one of this index: those of the other fold. Folds
/// alternate, so that episodes of one seed in different tasks are in one fold.
fn other_fold(i: usize, n: usize) -> impl Iterator<Item = usize> {
    (1 - i % 2..n).step_by(2)
}

/// Predicts each opening's label from the labels of the nearest start poses in the other fold.
/// Coordinates are scaled to unit variance.
pub fn predict(openings: &[&Opening], label: impl Fn(&Opening) -> String) -> Prediction {
    let n = openings.len();
    let scales: [f64; 4] = std::array::from_fn(|k| {
        let mean = openings.iter().map(|o| o.pose[k]).sum::<f64>() / n as f64;
        let squares = openings.iter().map(|o| (o.pose[k] - mean) * (o.pose[k] - mean));
        let variance = squares.sum::<f64>() / n as f64;
        1.0 / variance.sqrt().max(1e-9)
    });
    let distance = |a: &Opening, b: &Opening| -> f64 {
        let scaled = (0..4).map(|k| (a.pose[k] - b.pose[k]) * scales[k]);
        scaled.map(|x| x * x).sum()
    };
    let nearest = |i: usize| {
        let mut others: Vec<usize> = other_fold(i, n).collect();
        let to = |j: usize| distance(openings[i], openings[j]);
        others.sort_by(|a, b| to(*a).total_cmp(&to(*b)));
        others.truncate(NEIGHBORS);
        others
    };
    let voters: Vec<Vec<usize>> = (0..n).map(nearest).collect();
    Prediction::of(openings.iter().map(|o| label(o)).collect(), &voters)
}

/// Predicts each opening's label from the openings of the other fold with the same value of a field.
pub fn predict_by_value(
    openings: &[&Opening],
    value: impl Fn(&Opening) -> Option<String>,
    label: impl Fn(&Opening) -> String,
) -> Prediction {
    let values: Vec<Option<String>> = openings.iter().map(|opening| value(opening)).collect();
    let same = |i: usize| other_fold(i, values.len()).filter(|j| values[*j] == values[i]).collect();
    let voters: Vec<Vec<usize>> = (0..values.len()).map(same).collect();
    Prediction::of(openings.iter().map(|o| label(o)).collect(), &voters)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opening(task: TaskId, x: f64) -> Opening {
        Opening {
            task,
            partner: task.info().partner,
            scene: task.info().scene,
            briefing: BTreeMap::new(),
            own: BTreeMap::from([("x".to_owned(), (x > 0.0).to_string())]),
            pose: [x, 0.0, 0.0, 1.0],
            images: Digest::of_bytes(&[]),
        }
    }

    fn label(opening: &Opening) -> String {
        opening.task.to_string()
    }

    #[test]
    fn a_dependence_is_found_if_there_is_one() {
        let openings = |tells: bool| -> Vec<Opening> {
            let mut random = Stream::new(1, "openings", 0);
            let tasks = [TaskId::HighTarget, TaskId::LowTarget];
            (0..200)
                .map(|k| {
                    let side = if tells { k / 2 } else { random.below(2) };
                    let x = if side.is_multiple_of(2) { 2.0 } else { -2.0 };
                    opening(tasks[k / 2 % 2], x + f64::from(random.unit()))
                })
                .collect()
        };
        for tells in [true, false] {
            let all = openings(tells);
            let all: Vec<&Opening> = all.iter().collect();
            let by_pose = predict(&all, label);
            let by_value = predict_by_value(&all, |o| o.own.get("x").cloned(), label);
            for found in [by_pose, by_value] {
                assert_eq!(found.z() > 8.0, tells, "{found:?}");
                assert_eq!(found.accuracy > 0.99, tells, "{found:?}");
            }
            assert_eq!(varying_fields(&all, |o| &o.own), [("x".to_owned(), 2)]);
            assert_eq!(distinct(&all, label), 2);
        }
    }
}
