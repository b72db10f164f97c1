//! Queueing models of many cores and many machines.

/// Returns the time that `cores` workers need for these tasks, in the unit of their durations. The worker
/// that is free first takes the next task (list scheduling).
pub(crate) fn makespan(durations: impl IntoIterator<Item = f64>, cores: usize) -> f64 {
    let mut free_at = vec![0.0f64; cores.max(1)];
    for duration in durations {
        let next = (0..free_at.len()).min_by(|a, b| free_at[*a].total_cmp(&free_at[*b]));
        free_at[next.unwrap_or(0)] += duration;
    }
    free_at.into_iter().fold(0.0, f64::max)
}

/// Closed network: customers think, then pass the stations one after the other, and start again. Every
/// station serves one customer at a time, in order of arrival.
pub(crate) struct ClosedNetwork<const N: usize> {
    /// Mean time that a customer spends outside the stations, seconds.
    pub think_s: f64,
    /// Mean service time of a customer at each station, seconds.
    pub service_s: [f64; N],
}

/// Steady state of a [`ClosedNetwork`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SteadyState<const N: usize> {
    /// Customers that pass a station, per second.
    pub throughput: f64,
    /// Fraction of the time that each station is busy.
    pub utilization: [f64; N],
}

impl<const N: usize> ClosedNetwork<N> {
    /// Mean value analysis (Reiser and Lavenberg 1980), exact for exponential service times.
    pub fn steady_state(&self, n_customers: usize) -> SteadyState<N> {
        let mut queue = [0.0; N];
        let mut throughput = 0.0;
        for n in 1..=n_customers {
            let response: [f64; N] = std::array::from_fn(|k| self.service_s[k] * (1.0 + queue[k]));
            throughput = n as f64 / (self.think_s + response.iter().sum::<f64>());
            queue = response.map(|time| throughput * time);
        }
        SteadyState { throughput, utilization: self.service_s.map(|s| throughput * s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_task_at_the_end_determines_the_time() {
        assert_eq!(makespan([1.0, 1.0, 1.0, 1.0, 6.0], 2), 8.0);
        assert_eq!(makespan([6.0, 1.0, 1.0, 1.0, 1.0], 2), 6.0);
        assert_eq!(makespan([6.0, 1.0, 1.0], 64), 6.0);
        assert_eq!(makespan([6.0, 1.0, 1.0], 1), 8.0);
    }

    /// The machine repair problem: `n` machines with failure rate 1 and one repairer with rate `1 / s`.
    /// The probability of an idle repairer is known in closed form.
    #[test]
    fn one_station_agrees_with_the_machine_repair_problem() {
        let (n, s) = (7, 0.4);
        let network = ClosedNetwork { think_s: 1.0, service_s: [s] };
        let weight = |k: i32| (0..k).map(|j| f64::from(n - j) * s).product::<f64>();
        let idle = 1.0 / (0..=n).map(weight).sum::<f64>();
        let state = network.steady_state(n as usize);
        assert!((state.utilization[0] - (1.0 - idle)).abs() < 1e-12, "{state:?}");
    }

    #[test]
    fn the_slowest_station_bounds_the_throughput() {
        let network = ClosedNetwork { think_s: 1.0, service_s: [0.001, 0.01] };
        assert!((network.steady_state(1).throughput - 1.0 / 1.011).abs() < 1e-12);
        let state = network.steady_state(1000);
        assert!((state.throughput - 100.0).abs() < 1e-3, "{state:?}");
        assert!((state.utilization[0] - 0.1).abs() < 1e-5, "{state:?}");
    }
}
