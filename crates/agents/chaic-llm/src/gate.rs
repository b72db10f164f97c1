//! Who may ask now: so many at a time, and as long as the budget lasts.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use crate::exchange::Usage;
use crate::settings::{Budget, Price};

/// How often somebody who waits looks whether the run is to stop.
pub(crate) const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What has been spent, or may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Requests.
    pub requests: u64,
    /// Tokens of prompts and answers.
    pub tokens: u64,
    /// Money.
    pub money: f64,
}

impl Spent {
    /// What a request of this usage costs.
    pub fn of(requests: u64, usage: Usage, price: &Price) -> Spent {
        let money = price.millionths(usage) / 1e6;
        Spent { requests, tokens: usage.prompt + usage.answer, money }
    }

    /// Adds what else was spent.
    pub fn add(&mut self, other: Spent) {
        self.requests += other.requests;
        self.tokens += other.tokens;
        self.money += other.money;
    }

    fn take(&mut self, other: Spent) {
        self.requests -= other.requests;
        self.tokens -= other.tokens;
        self.money -= other.money;
    }
}

/// Lets requests pass.
#[derive(Debug)]
pub struct Gate {
    budget: Budget,
    in_flight: usize,
    began: Instant,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    spent: Spent,
    /// What those in flight may cost at most.
    reserved: Spent,
    in_flight: usize,
}

/// What the gate says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Admission {
    /// Go; give it back by [`Gate::settle`].
    Go,
    /// The budget is spent.
    Spent(&'static str),
    /// The run is to stop.
    Stopped,
}

impl Gate {
    /// A gate for a run that has spent so much before.
    pub fn new(budget: Budget, in_flight: usize, before: Spent) -> Gate {
        let state = State { spent: before, ..State::default() };
        let (state, changed) = (Mutex::new(state), Condvar::new());
        Gate { budget, in_flight: in_flight.max(1), began: Instant::now(), state, changed }
    }

    /// Waits until one more request may be sent that costs at most `worst`. Where what is in flight
    /// might use up the budget, it waits for that; so the budget is overrun by one request at most.
    pub fn enter(&self, worst: Spent, stop: &AtomicBool) -> Admission {
        let mut state = self.lock();
        loop {
            if stop.load(Ordering::Relaxed) {
                return Admission::Stopped;
            }
            if let Some(what) = self.used_up(state.spent) {
                return Admission::Spent(what);
            }
            let mut all = state.spent;
            all.add(state.reserved);
            all.add(worst);
            let fits = state.in_flight == 0 || !self.exceeds(all);
            if fits && state.in_flight < self.in_flight {
                state.in_flight += 1;
                state.reserved.add(worst);
                return Admission::Go;
            }
            let waited = self.changed.wait_timeout(state, LOOK_EVERY);
            state = waited.unwrap_or_else(|e| e.into_inner()).0;
        }
    }

    /// A request has come back and has cost so much.
    pub fn settle(&self, worst: Spent, cost: Spent) {
        let mut state = self.lock();
        state.in_flight -= 1;
        state.reserved.take(worst);
        state.spent.add(cost);
        drop(state);
        self.changed.notify_all();
    }

    /// What has been spent so far.
    pub fn spent(&self) -> Spent {
        self.lock().spent
    }

    fn used_up(&self, spent: Spent) -> Option<&'static str> {
        let Budget { requests, tokens, money, minutes, .. } = self.budget;
        let minutes_passed = self.began.elapsed().as_secs_f64() / 60.0;
        [
            (requests.is_some_and(|n| spent.requests >= n), "requests"),
            (tokens.is_some_and(|n| spent.tokens >= n), "tokens"),
            (money.is_some_and(|n| spent.money >= n), "money"),
            (minutes.is_some_and(|n| minutes_passed >= n), "minutes"),
        ]
        .into_iter()
        .find_map(|(is_used_up, what)| is_used_up.then_some(what))
    }

    fn exceeds(&self, all: Spent) -> bool {
        let Budget { requests, tokens, money, .. } = self.budget;
        requests.is_some_and(|n| all.requests > n)
            || tokens.is_some_and(|n| all.tokens > n)
            || money.is_some_and(|n| all.money > n)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// Sleeps, but not on when the run is to stop; whether it slept through.
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
        std::thread::sleep(left.min(LOOK_EVERY));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static GO_ON: AtomicBool = AtomicBool::new(false);

    fn cost(tokens: u64) -> Spent {
        Spent { requests: 1, tokens, money: tokens as f64 / 1000.0 }
    }

    #[test]
    fn the_budget_is_overrun_by_one_request_at_most_whatever_they_cost() {
        let budgets = [
            Budget { requests: Some(7), ..Budget::default() },
            Budget { tokens: Some(1000), ..Budget::default() },
            Budget { money: Some(1.0), ..Budget::default() },
        ];
        for budget in budgets {
            let gate = Gate::new(budget, 16, Spent::default());
            // Requests that may cost 400 and do cost 150 each, from eight sides at a time.
            std::thread::scope(|scope| {
                for _ in 0..8 {
                    scope.spawn(|| {
                        while gate.enter(cost(400), &GO_ON) == Admission::Go {
                            std::thread::yield_now();
                            gate.settle(cost(400), cost(150));
                        }
                    });
                }
            });
            let spent = gate.spent();
            // 7 of 7; or the first number of requests that reaches 1000 tokens.
            assert_eq!(spent.requests, 7, "{budget:?}");
            assert!(spent.tokens <= 1000 + 150);
        }
    }

    #[test]
    fn never_more_than_so_many_are_in_flight() {
        let gate = Gate::new(Budget::default(), 3, Spent::default());
        let stop = AtomicBool::new(false);
        for _ in 0..3 {
            assert_eq!(gate.enter(cost(1), &stop), Admission::Go);
        }
        std::thread::scope(|scope| {
            let fourth = scope.spawn(|| gate.enter(cost(1), &stop));
            while !fourth.is_finished() {
                stop.store(true, Ordering::Relaxed);
            }
            assert_eq!(fourth.join().unwrap(), Admission::Stopped);
        });
    }

    #[test]
    fn what_was_spent_before_counts_and_time_does() {
        let budget = Budget { requests: Some(3), ..Budget::default() };
        let before = Spent { requests: 3, ..Spent::default() };
        assert_eq!(
            Gate::new(budget, 1, before).enter(cost(1), &GO_ON),
            Admission::Spent("requests")
        );
        let budget = Budget { minutes: Some(0.0), ..Budget::default() };
        let gate = Gate::new(budget, 1, Spent::default());
        assert_eq!(gate.enter(cost(1), &GO_ON), Admission::Spent("minutes"));
    }
}
