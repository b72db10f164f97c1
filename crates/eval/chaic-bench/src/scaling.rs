//! Estimates of the speed of more cores and machines from service times measured on one thread.

use std::time::Instant;

use chaic_core::rng::RngStream;
use chaic_env::{AdvanceOutcome, EnvBatch, ImagesMut};
use chaic_eval::{EvalError, Result};
use serde::Serialize;

use super::Machine;
use super::env::{EnvSetup, random_action};
use super::queueing::{ClosedNetwork, SteadyState, makespan};

/// Numbers of cores of the estimates.
const CORES: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Numbers of machines of the estimates.
const NODES: [usize; 7] = [1, 2, 5, 10, 20, 50, 100];
/// Copies of the environments in the larger batch.
const COPIES: usize = 16;
/// Steps by which a copy is ahead of the previous one. Prime, so that copies do not repeat together.
const COPY_SHIFT: usize = 37;

/// Machines that collect decisions for one learner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cluster {
    /// Cores of a machine, each with environments of its own.
    pub cores_per_node: usize,
    /// Rate of the learner's network connection, Mbit/s.
    pub network_mbit_s: f64,
    /// Decisions that the learner processes per second.
    pub learner_rate: f64,
}

/// Configuration of a scaling benchmark.
#[derive(Clone, Debug)]
pub struct ScalingBench {
    /// Measured environments.
    pub setup: EnvSetup,
    /// Duration of the measurement, seconds.
    pub seconds: f32,
    /// Cluster to estimate.
    pub cluster: Cluster,
}

/// Measured service times, and estimates from them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScalingEstimate {
    /// Number of measured environments.
    pub envs: usize,
    /// Number of environments of [`CoreSpeed::large_batch`].
    pub large_envs: usize,
    /// Number of measured decisions.
    pub steps: usize,
    /// Time of a decision on one thread, milliseconds: simulation, partner and the helper's images.
    pub mean_ms: f64,
    /// 99th percentile of this time, milliseconds.
    pub p99_ms: f64,
    /// Maximum of this time, milliseconds.
    pub max_ms: f64,
    /// Size of a decision's images, bytes.
    pub image_bytes: usize,
    /// Estimates for one machine.
    pub cores: Vec<CoreSpeed>,
    /// Parameters of the cluster.
    pub cluster: Cluster,
    /// Estimates for a cluster that sends all images to its learner.
    pub nodes: Vec<ClusterSpeed>,
    /// Machine and build of the measurement.
    pub machine: Machine,
}

/// Estimated speed of one machine, decisions per second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CoreSpeed {
    /// Number of cores.
    pub cores: usize,
    /// Batch of the measured environments; each step waits for the slowest.
    pub batch: f64,
    /// Batch of [`ScalingEstimate::large_envs`] environments.
    pub large_batch: f64,
    /// Environments that do not wait for each other.
    pub independent: f64,
}

/// Estimated speed of a cluster.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClusterSpeed {
    /// Number of machines.
    pub nodes: usize,
    /// Decisions per second.
    pub steps_per_second: f64,
    /// Busy fraction of the learner's network connection.
    pub network_utilization: f64,
    /// Busy fraction of the learner.
    pub learner_utilization: f64,
}

impl ScalingBench {
    /// Measures the time of each environment's steps on one thread, and estimates other machines.
    /// `progress` receives the fraction of the duration that has passed, 0 to 1.
    ///
    /// # Errors
    /// If episodes cannot be read, an environment fails, or there is none.
    pub fn measure(&self, progress: &mut dyn FnMut(f32)) -> Result<ScalingEstimate> {
        super::with_threads(1, progress, |progress| self.measure_here(progress))
    }

    fn measure_here(&self, progress: &mut dyn FnMut(f32)) -> Result<ScalingEstimate> {
        let (times, image_bytes) = self.step_times(progress)?;
        let envs = times.len();
        let mut each: Vec<f64> = times.iter().flatten().copied().collect();
        each.sort_by(f64::total_cmp);
        let (Some(max), n) = (each.last(), each.len()) else {
            return Err(EvalError::Options("there are no environments".to_owned()));
        };
        let mean_s = each.iter().sum::<f64>() / n as f64;
        let core = |cores: usize| CoreSpeed {
            cores,
            batch: batch_speed(&times, 1, cores),
            large_batch: batch_speed(&times, COPIES, cores),
            independent: cores as f64 / mean_s,
        };
        let node = |nodes: usize| self.cluster.speed(nodes, mean_s, image_bytes);
        Ok(ScalingEstimate {
            envs,
            large_envs: COPIES * envs,
            steps: n,
            mean_ms: 1e3 * mean_s,
            p99_ms: 1e3 * each[n * 99 / 100],
            max_ms: 1e3 * max,
            image_bytes,
            cores: CORES.map(core).to_vec(),
            cluster: self.cluster,
            nodes: NODES.map(node).to_vec(),
            machine: Machine::current(),
        })
    }

    /// Returns the times of each environment's steps in seconds, and the size of a decision's images.
    /// All environments have the same number of steps.
    fn step_times(&self, progress: &mut dyn FnMut(f32)) -> Result<(Vec<Vec<f64>>, usize)> {
        let bundled = self.setup.episodes()?;
        let batch = |k: usize| Ok(EnvBatch::new(vec![self.setup.env(&bundled, k)?])?);
        let mut batches = (0..self.setup.envs).map(batch).collect::<Result<Vec<EnvBatch>>>()?;
        let lengths = batches.first().map_or([0; 3], |batch| batch.layout().lengths());
        let [n_rgb, n_depth, n_ids] = lengths;
        let (mut rgb, mut depth_m, mut ids) = (vec![0; n_rgb], vec![0.0; n_depth], vec![0; n_ids]);
        let mut rng = RngStream::new(0, "bench env", 0);
        let mut times: Vec<Vec<f64>> = vec![Vec::new(); batches.len()];
        let (mut n_ended, mut fraction) = (0, 0.0);
        let start = Instant::now();
        while fraction < 1.0 {
            for (batch, times) in batches.iter_mut().zip(&mut times) {
                let begun = Instant::now();
                loop {
                    let images = ImagesMut {
                        rgb: (n_rgb > 0).then_some(&mut rgb),
                        depth_m: (n_depth > 0).then_some(&mut depth_m),
                        ids: (n_ids > 0).then_some(&mut ids),
                    };
                    let outcomes = batch.advance_and_observe(None, images)?;
                    let outcome =
                        outcomes.into_iter().next().expect("the batch has one environment");
                    match outcome.map_err(|error| EvalError::Options(error.to_string()))? {
                        AdvanceOutcome::NeedsAction => break,
                        AdvanceOutcome::Ended | AdvanceOutcome::Stopped => {
                            let number = self.setup.envs + n_ended;
                            batch.reset(0, self.setup.config(&bundled, number))?;
                            n_ended += 1;
                        }
                    }
                }
                for slot in batch.waiting() {
                    batch.submit(slot, random_action(self.setup.size, &mut rng));
                }
                times.push(begun.elapsed().as_secs_f64());
            }
            fraction = start.elapsed().as_secs_f32() / self.seconds;
            progress(fraction.min(1.0));
        }
        let bytes = size_of_val(&rgb[..]) + size_of_val(&depth_m[..]) + size_of_val(&ids[..]);
        Ok((times, bytes))
    }
}

/// Returns the decisions per second of a batch on many cores; `times` are `[env][step]` in seconds.
fn batch_speed(times: &[Vec<f64>], copies: usize, cores: usize) -> f64 {
    let n_steps = times.first().map_or(0, Vec::len);
    let mut seconds = 0.0;
    for step in 0..n_steps {
        let tasks = (0..copies).flat_map(|copy| {
            times.iter().map(move |env| env[(step + copy * COPY_SHIFT) % n_steps])
        });
        seconds += makespan(tasks, cores);
    }
    (times.len() * copies * n_steps) as f64 / seconds
}

impl Cluster {
    /// Estimates the speed: every core produces a decision in `mean_s` seconds, sends it to the
    /// learner, and waits until the learner has processed it.
    fn speed(&self, nodes: usize, mean_s: f64, image_bytes: usize) -> ClusterSpeed {
        let network_s = 8.0 * image_bytes as f64 / (1e6 * self.network_mbit_s);
        let network =
            ClosedNetwork { think_s: mean_s, service_s: [network_s, 1.0 / self.learner_rate] };
        let SteadyState { throughput, utilization: [network_utilization, learner_utilization] } =
            network.steady_state(nodes * self.cores_per_node);
        ClusterSpeed {
            nodes,
            steps_per_second: throughput,
            network_utilization,
            learner_utilization,
        }
    }
}

#[cfg(test)]
mod tests {
    use chaic_core::TaskId;
    use chaic_render::Channels;

    use super::*;

    #[test]
    fn estimates_follow_from_measured_times() {
        let setup = EnvSetup {
            tasks: TaskId::paper().collect(),
            envs: 8,
            size: 32,
            partner_size: 32,
            channels: Channels { ids: false, ..Channels::ALL },
        };
        let cluster = Cluster { cores_per_node: 16, network_mbit_s: 1e4, learner_rate: 2000.0 };
        let bench = ScalingBench { setup, seconds: 0.3, cluster };
        let estimate = bench.measure(&mut |_| {}).expect("bundled episodes");
        assert_eq!(estimate.image_bytes, 32 * 32 * (3 + 4));
        assert!(estimate.mean_ms <= estimate.max_ms && estimate.p99_ms <= estimate.max_ms);
        let one = estimate.cores[0];
        assert!((one.batch / one.independent - 1.0).abs() < 1e-9, "{one:?}");
        for speed in &estimate.cores {
            assert!(speed.batch <= speed.independent * (1.0 + 1e-9), "{speed:?}");
        }
        for speed in &estimate.nodes {
            assert!(speed.steps_per_second <= cluster.learner_rate * (1.0 + 1e-9), "{speed:?}");
        }
    }

    #[test]
    fn a_batch_waits_for_its_slowest_environment() {
        let times = [vec![1.0; 4], vec![1.0; 4], vec![8.0; 4]];
        assert!((batch_speed(&times, 1, 1) - 0.3).abs() < 1e-12);
        assert!((batch_speed(&times, 1, 64) - 3.0 / 8.0).abs() < 1e-12);
    }
}
