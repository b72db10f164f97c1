//! Information that a helper has at its first decision, and tests of whether it predicts the task
//! or the partner.
//!
//! [`InitialInformation`] holds the briefing and the first observation of a helper. [`distinct`]
//! counts different openings, [`predict`] predicts a label from start poses, and
//! [`varying_fields`] lists the fields that differ between openings of one scene kind.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::capability::PersonKind;
use chaic_core::geom::math;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::task::SceneKind;
use chaic_core::{AgentId, TaskId};
use chaic_env::{AgentSlot, Digest, Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::Episode;
use serde_json::Value;

use crate::error::Result;

/// Number of nearest neighbors in [`predict`].
const NEIGHBORS: usize = 5;
/// Number of random permutations of labels that estimate the accuracy by chance.
const PERMUTATIONS: u32 = 100;

/// Information that a helper has at its first decision.
#[derive(Clone, Debug)]
pub struct InitialInformation {
    /// Hidden from the helper: the task.
    pub task: TaskId,
    /// Hidden from the helper: the partner's kind of person.
    pub partner: PersonKind,
    /// Kind of scene, which the classes in the briefing reveal.
    pub scene: SceneKind,
    /// Fields of the briefing by path, as JSON.
    pub briefing: BTreeMap<String, String>,
    /// Fields of the proprioception by path, as JSON.
    pub proprioception: BTreeMap<String, String>,
    /// Start pose: x and z in meters, sine and cosine of the yaw.
    pub pose: [f64; 4],
    /// Digest of the images of the first observation.
    pub images: Digest,
}

impl InitialInformation {
    /// Returns the opening of an episode for a helper with these grants and sensors.
    ///
    /// # Errors
    /// If the episode can't be played.
    pub fn new(
        episode: &Episode,
        grants: Grants,
        sensors: SensorConfig,
    ) -> Result<InitialInformation> {
        let config = EpisodeConfig {
            // The partner's images are not used, so they are as small as possible.
            image_size: Some(*SensorConfig::IMAGE_SIZES.start()),
            ..EpisodeConfig::new(episode, "opening")
        };
        let helper = Some(AgentSlot::external(grants, sensors));
        let mut env = Env::new(config, EpisodeAgents { helper, partner: None })?;
        env.advance(None)?;
        let briefing = env.briefing(AgentId::HELPER);
        let observation = env.observe(AgentId::HELPER).expect("all agents decide at the beginning");
        let (proprioception, images) = (&observation.proprioception, &observation.images);
        let yaw_rad = proprioception.pose.yaw_rad;
        let (sin, cos) = (f64::from(math::sin(yaw_rad)), f64::from(math::cos(yaw_rad)));
        let position = proprioception.pose.position;
        let depth = images.depth_m.iter().flatten().flat_map(|d| d.to_le_bytes());
        let pixels: Vec<u8> = images.rgb.iter().flatten().copied().chain(depth).collect();
        let setup = episode.setup();
        let info = setup.task.info();
        Ok(InitialInformation {
            task: setup.task,
            partner: setup.people.first().map_or(info.partner, |person| person.kind()),
            scene: info.scene,
            briefing: fields(&serde_json::to_value(&briefing).expect("a briefing is JSON")),
            proprioception: fields(
                &serde_json::to_value(proprioception).expect("proprioception is JSON"),
            ),
            pose: [f64::from(position.x), f64::from(position.z), sin, cos],
            images: Digest::of_bytes(&pixels),
        })
    }
}

/// Returns the leaves of a JSON value by path; list elements have their index as name.
fn fields(value: &Value) -> BTreeMap<String, String> {
    fn add(path: &str, value: &Value, out: &mut BTreeMap<String, String>) {
        let child_path =
            |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
        match value {
            Value::Object(map) => map.iter().for_each(|(k, v)| add(&child_path(k), v, out)),
            Value::Array(list) => {
                out.insert(child_path("len"), list.len().to_string());
                list.iter().enumerate().for_each(|(k, v)| add(&child_path(&k.to_string()), v, out));
            }
            leaf => drop(out.insert(path.to_owned(), leaf.to_string())),
        }
    }
    let mut out = BTreeMap::new();
    add("", value, &mut out);
    out
}

/// Returns the number of different keys of the openings.
pub fn distinct<K: Ord>(
    openings: &[&InitialInformation],
    key: impl Fn(&InitialInformation) -> K,
) -> usize {
    openings.iter().map(|opening| key(opening)).collect::<BTreeSet<K>>().len()
}

/// Returns the fields that differ between openings, with their numbers of values.
pub fn varying_fields(
    openings: &[&InitialInformation],
    fields: impl Fn(&InitialInformation) -> &BTreeMap<String, String>,
) -> Vec<(String, usize)> {
    let names: BTreeSet<&String> =
        openings.iter().flat_map(|opening| fields(opening).keys()).collect();
    let values = |name: &String| distinct(openings, |opening| fields(opening).get(name).cloned());
    names.into_iter().map(|name| (name.clone(), values(name))).filter(|(_, n)| *n > 1).collect()
}

/// Accuracy of a prediction, compared with chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Fraction of correct predictions, 0 to 1.
    pub accuracy: f64,
    /// Mean accuracy with randomly permuted labels, 0 to 1.
    pub chance: f64,
    /// Standard deviation of the accuracy with randomly permuted labels.
    pub deviation: f64,
}

impl Prediction {
    /// Predicts the label of each opening by a majority vote of its voters. Without voters, it
    /// predicts the most frequent label of the other fold.
    fn new(mut labels: Vec<String>, voters: &[Vec<usize>]) -> Prediction {
        let accuracy = accuracy(&labels, voters);
        let mut random = RngStream::new(0, "permuted labels", 0);
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
    let fold_majority = [0, 1].map(|fold| majority((fold..n).step_by(2).map(|j| &labels[j])));
    let is_correct = |i: &usize| {
        let predicted = if voters[*i].is_empty() {
            fold_majority[1 - *i % 2]
        } else {
            majority(voters[*i].iter().map(|j| &labels[*j]))
        };
        predicted == Some(&labels[*i])
    };
    (0..n).filter(is_correct).count() as f64 / n as f64
}

/// Returns the most frequent label; of equally frequent labels, the first by name.
fn majority<'a>(labels: impl Iterator<Item = &'a String>) -> Option<&'a String> {
    let mut counts: BTreeMap<&String, usize> = BTreeMap::new();
    labels.for_each(|label| *counts.entry(label).or_default() += 1);
    let best = counts.into_iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(a.0)));
    best.map(|(label, _)| label)
}

/// Returns the indices of the openings in the other fold. Folds alternate, so that episodes of one
/// seed in different tasks are in the same fold.
fn other_fold(i: usize, n: usize) -> impl Iterator<Item = usize> {
    (1 - i % 2..n).step_by(2)
}

/// Predicts each opening's label from the labels of the nearest start poses in the other fold.
/// Coordinates are scaled to unit variance.
pub fn predict(
    openings: &[&InitialInformation],
    label: impl Fn(&InitialInformation) -> String,
) -> Prediction {
    let n = openings.len();
    let scales: [f64; 4] = std::array::from_fn(|k| {
        let mean = openings.iter().map(|o| o.pose[k]).sum::<f64>() / n as f64;
        let squares = openings.iter().map(|o| (o.pose[k] - mean) * (o.pose[k] - mean));
        let variance = squares.sum::<f64>() / n as f64;
        1.0 / variance.sqrt().max(1e-9)
    });
    let distance = |a: &InitialInformation, b: &InitialInformation| -> f64 {
        let scaled = (0..4).map(|k| (a.pose[k] - b.pose[k]) * scales[k]);
        scaled.map(|x| x * x).sum()
    };
    let nearest = |i: usize| {
        let mut neighbors: Vec<usize> = other_fold(i, n).collect();
        let to = |j: usize| distance(openings[i], openings[j]);
        neighbors.sort_by(|a, b| to(*a).total_cmp(&to(*b)));
        neighbors.truncate(NEIGHBORS);
        neighbors
    };
    let voters: Vec<Vec<usize>> = (0..n).map(nearest).collect();
    Prediction::new(openings.iter().map(|o| label(o)).collect(), &voters)
}

/// Predicts each opening's label from the openings of the other fold with the same value of a
/// field.
pub fn predict_by_value(
    openings: &[&InitialInformation],
    value: impl Fn(&InitialInformation) -> Option<String>,
    label: impl Fn(&InitialInformation) -> String,
) -> Prediction {
    let values: Vec<Option<String>> = openings.iter().map(|opening| value(opening)).collect();
    let same = |i: usize| other_fold(i, values.len()).filter(|j| values[*j] == values[i]).collect();
    let voters: Vec<Vec<usize>> = (0..values.len()).map(same).collect();
    Prediction::new(openings.iter().map(|o| label(o)).collect(), &voters)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opening(task: TaskId, x: f64) -> InitialInformation {
        InitialInformation {
            task,
            partner: task.info().partner,
            scene: task.info().scene,
            briefing: BTreeMap::new(),
            proprioception: BTreeMap::from([("x".to_owned(), (x > 0.0).to_string())]),
            pose: [x, 0.0, 0.0, 1.0],
            images: Digest::of_bytes(&[]),
        }
    }

    fn label(opening: &InitialInformation) -> String {
        opening.task.to_string()
    }

    #[test]
    fn a_dependence_is_found_if_there_is_one() {
        let openings = |is_dependent: bool| -> Vec<InitialInformation> {
            let mut random = RngStream::new(1, "openings", 0);
            let tasks = [TaskId::HighTarget, TaskId::LowTarget];
            (0..200)
                .map(|k| {
                    let side = if is_dependent { k / 2 } else { random.below(2) };
                    let x = if side.is_multiple_of(2) { 2.0 } else { -2.0 };
                    opening(tasks[k / 2 % 2], x + f64::from(random.unit()))
                })
                .collect()
        };
        for is_dependent in [true, false] {
            let all = openings(is_dependent);
            let all: Vec<&InitialInformation> = all.iter().collect();
            let by_pose = predict(&all, label);
            let by_value = predict_by_value(&all, |o| o.proprioception.get("x").cloned(), label);
            for found in [by_pose, by_value] {
                assert_eq!(found.z() > 8.0, is_dependent, "{found:?}");
                assert_eq!(found.accuracy > 0.99, is_dependent, "{found:?}");
            }
            assert_eq!(varying_fields(&all, |o| &o.proprioception), [("x".to_owned(), 2)]);
            assert_eq!(distinct(&all, label), 2);
        }
    }
}
