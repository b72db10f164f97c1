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

/// Returns the best sequence found. The search starts from the best of the empty sequence, four greedy
/// sequences and `candidates`, so the result is never worse than any of them.
pub fn search_operations(
    problem: &TeamProblem,
    candidates: &[Vec<Operation>],
    settings: SearchSettings,
    rng: &mut RngStream,
) -> TeamPlan {
    let mut search = Search::new(problem);
    let mut best = search.rated(Vec::new());
    let greedy = [false, true].into_iter().flat_map(|uses_containers| {
        [false, true].map(|removes| greedy(problem, uses_containers, removes))
    });
    for candidate in greedy.chain(candidates.iter().cloned()) {
        let candidate = search.rated(candidate);
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
    let operations = search.without_useless(best.operations);
    search.rated(operations)
}

/// Returns a sequence in the order of the published rules: all obstacles if `removes`, then trips
/// that pick up the nearest targets until the hands are full. If `uses_containers`, trips for three
/// targets or more begin with the nearest container.
pub fn greedy(problem: &TeamProblem, uses_containers: bool, removes: bool) -> Vec<Operation> {
    let obstacles = problem.places_of(PlaceKind::Obstacle).filter(|_| removes);
    let mut operations: Vec<Operation> = obstacles.map(Operation::Remove).collect();
    let mut targets: Vec<usize> = problem.places_of(PlaceKind::Target).collect();
    let mut containers: Vec<usize> = problem.places_of(PlaceKind::Container).collect();
    let helper = &problem.helper;
    let mut row = problem.helper_row();
    let mut has_container = helper.contained.is_some();
    let mut n_carried = helper.loose.len() + helper.contained.as_ref().map_or(0, Vec::len);
    let path = |row: usize, place: usize| problem.path_m[row][place];
    let take_nearest = |row: usize, places: &mut Vec<usize>| {
        let order = |a: &usize, b: &usize| path(row, places[*a]).total_cmp(&path(row, places[*b]));
        let nearest = (0..places.len()).min_by(order)?;
        Some(places.remove(nearest))
    };
    while !targets.is_empty() {
        let capacity = if has_container { problem.container_capacity + 1 } else { helper.n_loose };
        if n_carried >= capacity.max(1) {
            operations.push(Operation::Deliver);
            (n_carried, has_container) = (0, false);
            continue;
        }
        let wants_container = uses_containers
            && helper.carries_containers
            && !has_container
            && n_carried == 0
            && targets.len() >= 3;
        if wants_container && let Some(container) = take_nearest(row, &mut containers) {
            operations.push(Operation::TakeContainer(container));
            (row, has_container) = (container, true);
            continue;
        }
        let Some(target) = take_nearest(row, &mut targets) else { break };
        operations.push(Operation::PickUp(target));
        row = target;
        n_carried += 1;
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
        let value = self.evaluate(&operations);
        TeamPlan { operations, value }
    }

    fn evaluate(&mut self, operations: &[Operation]) -> f32 {
        self.n_evaluations += 1;
        simulate(self.problem, operations)
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
        if rng.chance(0.15) {
            // A container replaces a delivery.
            operations
                .iter()
                .position(|o| *o == Operation::Deliver)
                .map(|at| operations.remove(at));
            let is_container = |o: &Operation| matches!(o, Operation::TakeContainer(_));
            let unused = self.single.iter().filter(|o| is_container(o) && !operations.contains(o));
            let unused: Vec<Operation> = unused.copied().collect();
            waiting.extend(rng.choose(&unused));
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
        let end = operations.len();
        let mut with_new = Vec::with_capacity(end + 1);
        with_new.push(new);
        with_new.extend_from_slice(operations);
        let (mut best_at, mut value) = (0, self.evaluate(&with_new));
        for at in 1..=end {
            // Moves the new operation to position `at`.
            with_new.swap(at - 1, at);
            let value_here = self.evaluate(&with_new);
            if value_here > value {
                (best_at, value) = (at, value_here);
            }
        }
        with_new[best_at..].rotate_right(1);
        TeamPlan { operations: with_new, value }
    }

    /// Removes each operation that does not raise the value.
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

#[cfg(test)]
mod tests;
