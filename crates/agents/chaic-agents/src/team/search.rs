//! Search for the helper's best sequence of operations: annealed removal and best reinsertion.

use chaic_core::geom::math;
use chaic_core::rng::RngStream;

use super::problem::{Operation, Place, PlaceKind, TeamProblem};
use super::simulation::simulate;

/// Effort of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchSettings {
    /// Number of sequences that are simulated.
    pub n_evaluations: usize,
    /// Start temperature, deliveries.
    pub start_temperature: f32,
    /// Final temperature, deliveries.
    pub end_temperature: f32,
}

impl SearchSettings {
    /// Ours; twice as many evaluations gain less than 0.05 deliveries.
    pub const DEFAULT: SearchSettings =
        SearchSettings { n_evaluations: 3000, start_temperature: 0.2, end_temperature: 0.002 };
}

/// A sequence of operations with its expected value.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamPlan {
    /// The helper's operations in order.
    pub operations: Vec<Operation>,
    /// Value by [`simulate`].
    pub value: f32,
}

/// Returns the best sequence found. The search starts from the best of `candidates` and a greedy
/// sequence, so the result is never worse than any of them.
pub fn improve(
    problem: &TeamProblem,
    candidates: &[Vec<Operation>],
    settings: SearchSettings,
    rng: &mut RngStream,
) -> TeamPlan {
    let mut search = Search::new(problem);
    let mut best = search.rated(greedy(problem));
    for candidate in candidates {
        let candidate = search.rated(candidate.clone());
        if candidate.value > best.value {
            best = candidate;
        }
    }
    let mut current = best.clone();
    while search.n_evaluations < settings.n_evaluations {
        let progress = search.n_evaluations as f32 / settings.n_evaluations as f32;
        let temperature = settings.end_temperature
            + (settings.start_temperature - settings.end_temperature) * (1.0 - progress);
        let new = search.neighbor(&current, rng);
        let is_accepted = new.value >= current.value
            || rng.unit() < math::exp((new.value - current.value) / temperature);
        if is_accepted {
            current = new;
            if current.value > best.value {
                best = current.clone();
            }
        }
    }
    best.operations = search.without_useless(best.operations);
    best
}

/// Returns the sequence that removes all blocking obstacles, then picks up the nearest target and
/// delivers when the hands are full.
pub fn greedy(problem: &TeamProblem) -> Vec<Operation> {
    let is_blocked = problem.partner.as_ref().is_some_and(|p| p.is_blocked);
    let obstacles = problem.places_of(PlaceKind::Obstacle).filter(|_| is_blocked);
    let mut operations: Vec<Operation> = obstacles.map(Operation::Remove).collect();
    let mut left: Vec<usize> = problem.places_of(PlaceKind::Target).collect();
    let mut row = problem.helper_row();
    let n_hands = problem.helper.n_loose.max(1);
    let mut n_free = n_hands.saturating_sub(problem.helper.loose.len());
    while !left.is_empty() {
        if n_free == 0 {
            operations.push(Operation::Deliver);
            n_free = n_hands;
        }
        let path = |i: &usize| problem.path_m[row][left[*i]];
        let nearest = (0..left.len()).min_by(|a, b| path(a).total_cmp(&path(b)));
        let Some(nearest) = nearest else { break };
        row = left.remove(nearest);
        operations.push(Operation::PickUp(row));
        n_free -= 1;
    }
    operations
}

struct Search<'a> {
    problem: &'a TeamProblem,
    /// Operations that a sequence contains at most once.
    single: Vec<Operation>,
    n_evaluations: usize,
}

impl<'a> Search<'a> {
    fn new(problem: &'a TeamProblem) -> Search<'a> {
        let operation = |(i, place): (usize, &Place)| match place.kind {
            PlaceKind::Target => Some(Operation::PickUp(i)),
            PlaceKind::Container => Some(Operation::TakeContainer(i)),
            PlaceKind::Obstacle => Some(Operation::Remove(i)),
            PlaceKind::Goal => None,
        };
        let single = problem.places.iter().enumerate().filter_map(operation).collect();
        Search { problem, single, n_evaluations: 0 }
    }

    fn rated(&mut self, operations: Vec<Operation>) -> TeamPlan {
        self.n_evaluations += 1;
        let value = simulate(self.problem, &operations);
        TeamPlan { operations, value }
    }

    /// Returns a changed sequence: one or two operations removed, each reinserted, or an unused one
    /// inserted, at the best of all positions.
    fn neighbor(&mut self, plan: &TeamPlan, rng: &mut RngStream) -> TeamPlan {
        let mut operations = plan.operations.clone();
        let mut waiting = Vec::new();
        for _ in 0..rng.below(3) {
            if !operations.is_empty() {
                waiting.push(operations.remove(rng.below(operations.len())));
            }
        }
        if waiting.is_empty() || rng.chance(0.4) {
            // An unused operation, another delivery, or a replacement.
            if rng.chance(0.4) {
                waiting.clear();
            }
            let new = match rng.chance(0.25) {
                true => Some(Operation::Deliver),
                false => rng.choose(&self.single).copied(),
            };
            waiting.extend(new.filter(|new| {
                *new == Operation::Deliver || !(operations.contains(new) || waiting.contains(new))
            }));
        }
        let mut changed = None;
        for operation in waiting {
            let inserted = self.insert_best(&operations, operation);
            operations.clone_from(&inserted.operations);
            changed = Some(inserted);
        }
        match changed {
            Some(changed) => changed,
            None => self.rated(operations),
        }
    }

    fn insert_best(&mut self, operations: &[Operation], new: Operation) -> TeamPlan {
        let mut best: Option<TeamPlan> = None;
        for at in 0..=operations.len() {
            let mut with_new = operations.to_vec();
            with_new.insert(at, new);
            let rated = self.rated(with_new);
            if best.as_ref().is_none_or(|best| rated.value > best.value) {
                best = Some(rated);
            }
        }
        best.unwrap_or_else(|| TeamPlan { operations: operations.to_vec(), value: f32::MIN })
    }

    /// Removes each operation without which the value does not fall.
    fn without_useless(&mut self, mut operations: Vec<Operation>) -> Vec<Operation> {
        let mut value = simulate(self.problem, &operations);
        let mut at = 0;
        while at < operations.len() {
            let removed = operations.remove(at);
            let without = simulate(self.problem, &operations);
            if without >= value {
                value = without;
            } else {
                operations.insert(at, removed);
                at += 1;
            }
        }
        operations
    }
}
