//! Limits on requests: number in flight and budget.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use crate::exchange::Usage;
use crate::settings::{Budget, Price};

/// Interval at which waiting requests poll the stop flag.
pub(crate) const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Spent amounts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spending {
    /// Requests.
    pub requests: u64,
    /// Tokens of prompts and answers.
    pub tokens: u64,
    /// Money.
    pub cost: f64,
}

impl Spending {
    /// Returns the cost of requests with this usage.
    pub fn new(requests: u64, usage: Usage, price: &Price) -> Spending {
        let cost = price.millionths(usage) / 1e6;
        Spending { requests, tokens: usage.prompt + usage.answer, cost }
    }

    /// Adds another amount.
    pub fn add(&mut self, other: Spending) {
        self.requests += other.requests;
        self.tokens += other.tokens;
        self.cost += other.cost;
    }

    fn subtract(&mut self, other: Spending) {
        self.requests -= other.requests;
        self.tokens -= other.tokens;
        self.cost -= other.cost;
    }
}

/// Limiter of concurrent requests and of the budget.
#[derive(Debug)]
pub struct RateLimiter {
    budget: Budget,
    in_flight: usize,
    start: Instant,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    spent: Spending,
    /// Maximum cost of the requests in flight.
    reserved: Spending,
    in_flight: usize,
}

/// Result of a request for admission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Admission {
    /// Admitted; the caller must call [`RateLimiter::settle_cost`].
    Admitted,
    /// A limit of the budget is spent.
    BudgetSpent(&'static str),
    /// The run must stop.
    Stopped,
}

impl RateLimiter {
    /// Creates a limiter for a run with earlier spending.
    pub fn new(budget: Budget, in_flight: usize, before: Spending) -> RateLimiter {
        let state = State { spent: before, ..State::default() };
        let (state, changed) = (Mutex::new(state), Condvar::new());
        RateLimiter { budget, in_flight: in_flight.max(1), start: Instant::now(), state, changed }
    }

    /// Waits until one more request that costs at most `max_cost` is admitted. If the requests in
    /// flight could exhaust the budget, it waits for them; the budget is exceeded by one request at
    /// most.
    pub fn wait_for_admission(&self, max_cost: Spending, stop: &AtomicBool) -> Admission {
        let mut state = self.lock();
        loop {
            if stop.load(Ordering::Relaxed) {
                return Admission::Stopped;
            }
            if let Some(limit) = self.spent_limit(state.spent) {
                return Admission::BudgetSpent(limit);
            }
            let mut total = state.spent;
            total.add(state.reserved);
            total.add(max_cost);
            let fits = state.in_flight == 0 || !self.exceeds(total);
            if fits && state.in_flight < self.in_flight {
                state.in_flight += 1;
                state.reserved.add(max_cost);
                return Admission::Admitted;
            }
            let waited = self.changed.wait_timeout(state, POLL_INTERVAL);
            state = waited.unwrap_or_else(|e| e.into_inner()).0;
        }
    }

    /// Replaces a reserved cost by the actual cost of a finished request.
    pub fn settle_cost(&self, max_cost: Spending, cost: Spending) {
        let mut state = self.lock();
        state.in_flight -= 1;
        state.reserved.subtract(max_cost);
        state.spent.add(cost);
        drop(state);
        self.changed.notify_all();
    }

    /// Returns the amount spent so far.
    pub fn spent(&self) -> Spending {
        self.lock().spent
    }

    fn spent_limit(&self, spent: Spending) -> Option<&'static str> {
        let Budget { max_requests, max_tokens, max_cost, max_minutes, .. } = self.budget;
        let minutes_passed = self.start.elapsed().as_secs_f64() / 60.0;
        [
            (max_requests.is_some_and(|n| spent.requests >= n), "requests"),
            (max_tokens.is_some_and(|n| spent.tokens >= n), "tokens"),
            (max_cost.is_some_and(|n| spent.cost >= n), "money"),
            (max_minutes.is_some_and(|n| minutes_passed >= n), "minutes"),
        ]
        .into_iter()
        .find_map(|(is_spent, limit)| is_spent.then_some(limit))
    }

    fn exceeds(&self, total: Spending) -> bool {
        let Budget { max_requests, max_tokens, max_cost, .. } = self.budget;
        max_requests.is_some_and(|n| total.requests > n)
            || max_tokens.is_some_and(|n| total.tokens > n)
            || max_cost.is_some_and(|n| total.cost > n)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// Sleeps unless the run stops; returns whether the sleep was complete.
pub fn sleep(time: Duration, stop: &AtomicBool) -> bool {
    let until = Instant::now() + time;
    loop {
        if stop.load(Ordering::Relaxed) {
            return false;
        }
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return true;
        }
        std::thread::sleep(left.min(POLL_INTERVAL));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static NOT_STOPPED: AtomicBool = AtomicBool::new(false);

    fn cost(tokens: u64) -> Spending {
        Spending { requests: 1, tokens, cost: tokens as f64 / 1000.0 }
    }

    #[test]
    fn the_budget_is_exceeded_by_one_request_at_most() {
        let budgets = [
            Budget { max_requests: Some(7), ..Budget::default() },
            Budget { max_tokens: Some(1000), ..Budget::default() },
            Budget { max_cost: Some(1.0), ..Budget::default() },
        ];
        for budget in budgets {
            let limiter = RateLimiter::new(budget, 16, Spending::default());
            // Requests that reserve 400 and cost 150 tokens each, eight at a time.
            std::thread::scope(|scope| {
                for _ in 0..8 {
                    scope.spawn(|| {
                        while limiter.wait_for_admission(cost(400), &NOT_STOPPED)
                            == Admission::Admitted
                        {
                            std::thread::yield_now();
                            limiter.settle_cost(cost(400), cost(150));
                        }
                    });
                }
            });
            let spent = limiter.spent();
            // All 7, or the first number of requests that reaches 1000 tokens.
            assert_eq!(spent.requests, 7, "{budget:?}");
            assert!(spent.tokens <= 1000 + 150);
        }
    }

    #[test]
    fn requests_in_flight_are_limited() {
        let limiter = RateLimiter::new(Budget::default(), 3, Spending::default());
        let stop = AtomicBool::new(false);
        for _ in 0..3 {
            assert_eq!(limiter.wait_for_admission(cost(1), &stop), Admission::Admitted);
        }
        std::thread::scope(|scope| {
            let fourth = scope.spawn(|| limiter.wait_for_admission(cost(1), &stop));
            while !fourth.is_finished() {
                stop.store(true, Ordering::Relaxed);
            }
            assert_eq!(fourth.join().unwrap(), Admission::Stopped);
        });
    }

    #[test]
    fn earlier_spending_and_elapsed_time_count() {
        let budget = Budget { max_requests: Some(3), ..Budget::default() };
        let before = Spending { requests: 3, ..Spending::default() };
        assert_eq!(
            RateLimiter::new(budget, 1, before).wait_for_admission(cost(1), &NOT_STOPPED),
            Admission::BudgetSpent("requests")
        );
        let budget = Budget { max_minutes: Some(0.0), ..Budget::default() };
        let limiter = RateLimiter::new(budget, 1, Spending::default());
        assert_eq!(
            limiter.wait_for_admission(cost(1), &NOT_STOPPED),
            Admission::BudgetSpent("minutes")
        );
    }
}
