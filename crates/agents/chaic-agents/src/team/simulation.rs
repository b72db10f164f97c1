//! Forward model: both people in a [`TeamProblem`], event by event.
//!
//! The helper follows a given sequence of operations. The partner follows the published rules
//! (paper section 5.1.1) on the places that it has probably seen.

use super::problem::{
    MAX_CLASSES, NO_PATH_M, Operation, OperationFrames, PlaceKind, TeamMember, TeamProblem,
};
use crate::rules::RuleProfile;

/// Factor of the way to a place that the partner has not seen yet: it must search. Measured in
/// episodes of `gen-standard:7000..7010`.
const SEARCH_FACTOR: f32 = 1.8;
/// The partner abandons an object if an attempt succeeds with less than this probability. Ours.
const MIN_CHANCE: f32 = 0.6;
/// Value of an early delivery relative to a late one, per delivery: 0.5 for a delivery now, 0 for
/// one at the end. Ours: early deliveries are safer.
const EARLY_BONUS: f32 = 0.5;
/// Cost of one operation, deliveries. Ours: without it, useless detours are free.
const OPERATION_COST: f32 = 0.002;
/// The rider empties its basket in less time than two hands put objects down. Measured.
const BASKET_PUT_ON_FACTOR: f32 = 0.5;
/// Maximum number of decisions in one simulation.
const MAX_DECISIONS: usize = 256;
/// Time after which a partner without anything to do looks again, frames.
const IDLE_FRAMES: f32 = 20.0;

/// A simulated delivery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delivery {
    /// Frames from now.
    pub frames: f32,
    /// True if the helper delivers.
    pub by_helper: bool,
    /// Index of the class.
    pub class_index: usize,
    /// Number of objects that count.
    pub count: f32,
}

/// An event of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SimulatedEvent {
    /// A person picks up what lies at a place, or has removed the obstacle there.
    Arrival {
        /// Frames from now.
        frames: f32,
        /// True for the helper.
        by_helper: bool,
        /// Index of the place.
        place: usize,
    },
    /// A delivered object.
    Delivery(Delivery),
}

/// Returns the expected value of a sequence of the helper's operations over all hypotheses. It
/// counts deliveries, early ones more than late ones, minus a small cost for each operation.
pub fn simulate(problem: &TeamProblem, operations: &[Operation]) -> f32 {
    let per_goal = problem.hypotheses.iter().map(|goal| {
        goal.probability * Simulation::new(problem, &goal.missing).run(operations, &mut |_| {})
    });
    per_goal.sum::<f32>() - OPERATION_COST * operations.len() as f32
}

/// Returns the events under one hypothesis, in the order of the simulation.
pub fn timeline(
    problem: &TeamProblem,
    operations: &[Operation],
    hypothesis: usize,
) -> Vec<SimulatedEvent> {
    let mut all = Vec::new();
    if let Some(goal) = problem.hypotheses.get(hypothesis) {
        Simulation::new(problem, &goal.missing).run(operations, &mut |event| all.push(event));
    }
    all
}

/// Objects carried by one person, as class indices, without allocation.
#[derive(Clone, Copy)]
struct Load {
    classes: [u8; 8],
    n: usize,
}

impl Load {
    fn new(classes: &[usize]) -> Load {
        let mut load = Load { classes: [0; 8], n: 0 };
        classes.iter().for_each(|class| load.push(*class));
        load
    }

    fn push(&mut self, class: usize) {
        if self.n < self.classes.len() {
            self.classes[self.n] = class as u8;
            self.n += 1;
        }
    }

    fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.classes[..self.n].iter().map(|c| usize::from(*c))
    }
}

/// State of one person in the simulation.
#[derive(Clone, Copy)]
struct Person {
    /// Time of the next event, frames from now: a decision, or the arrival at `pending`.
    time: f32,
    /// Place that the person walks to, to pick something up or to remove an obstacle.
    pending: Option<usize>,
    /// Row in the matrices.
    row: usize,
    loose: Load,
    contained: Load,
    has_container: bool,
    is_done: bool,
}

impl Person {
    fn new(worker: &TeamMember, row: usize) -> Person {
        Person {
            time: 0.0,
            pending: None,
            row,
            loose: Load::new(&worker.loose),
            contained: Load::new(worker.contained.as_deref().unwrap_or_default()),
            has_container: worker.contained.is_some(),
            is_done: false,
        }
    }

    fn n_carried(&self) -> usize {
        self.loose.n + self.contained.n
    }

    /// Number of further objects that fit.
    fn n_free(&self, worker: &TeamMember, capacity: usize) -> usize {
        if self.has_container {
            capacity.saturating_sub(self.contained.n) + 1_usize.saturating_sub(self.loose.n)
        } else {
            worker.n_loose.saturating_sub(self.loose.n)
        }
    }
}

/// One simulation.
struct Simulation<'a> {
    problem: &'a TeamProblem,
    frames: OperationFrames,
    missing: [f32; MAX_CLASSES],
    taken: u64,
    removed: u64,
    /// Places that the partner has given up.
    given_up: u64,
    value: f32,
}

impl<'a> Simulation<'a> {
    fn new(problem: &'a TeamProblem, missing_of: &[f32]) -> Simulation<'a> {
        let mut missing = [0.0; MAX_CLASSES];
        missing.iter_mut().zip(missing_of).for_each(|(to, from)| *to = *from);
        let frames = OperationFrames::MEASURED;
        Simulation { problem, frames, missing, taken: 0, removed: 0, given_up: 0, value: 0.0 }
    }

    fn run(mut self, operations: &[Operation], on_event: &mut dyn FnMut(SimulatedEvent)) -> f32 {
        let problem = self.problem;
        let mut helper = Person::new(&problem.helper, problem.helper_row());
        // Without a partner, its worker does nothing.
        let partner_worker = problem.partner.as_ref().unwrap_or(&problem.helper);
        let mut partner = Person::new(partner_worker, problem.partner_row());
        partner.is_done = problem.partner.is_none();
        let mut next = 0;
        for _ in 0..MAX_DECISIONS {
            if helper.is_done && partner.is_done {
                break;
            }
            let is_helpers_turn =
                !helper.is_done && (partner.is_done || helper.time < partner.time);
            if is_helpers_turn {
                match helper.pending.take() {
                    Some(place) => self.arrive(&problem.helper, &mut helper, place, true, on_event),
                    None => self.helper_step(&mut helper, operations, &mut next, on_event),
                }
            } else {
                match partner.pending.take() {
                    Some(place) => {
                        self.arrive(partner_worker, &mut partner, place, false, on_event)
                    }
                    None => self.partner_step(partner_worker, &mut partner, &helper, on_event),
                }
            }
        }
        self.value
    }

    fn walk_frames(path_m: f32, worker: &TeamMember) -> f32 {
        path_m / worker.speed_m_per_frame.max(1e-3)
    }

    fn helper_step(
        &mut self,
        helper: &mut Person,
        operations: &[Operation],
        next: &mut usize,
        on_event: &mut dyn FnMut(SimulatedEvent),
    ) {
        let problem = self.problem;
        let worker = &problem.helper;
        let Some(planned) = operations.get(*next).copied() else {
            match helper.n_carried() {
                0 => helper.is_done = true,
                _ => self.deliver(worker, helper, true, on_event),
            }
            return;
        };
        let n_free = helper.n_free(worker, problem.container_capacity);
        let has_hand = helper.loose.n + usize::from(helper.has_container) < worker.n_loose;
        // A step that needs an empty hand is preceded by a delivery.
        let is_possible = match planned {
            Operation::PickUp(_) => n_free > 0,
            Operation::TakeContainer(_) | Operation::Remove(_) => has_hand,
            Operation::Deliver => true,
        };
        if !is_possible {
            return self.deliver(worker, helper, true, on_event);
        }
        *next += 1;
        let is_taken = |place: usize| self.taken >> place & 1 == 1;
        match planned {
            Operation::Deliver => {
                if helper.n_carried() > 0 {
                    self.deliver(worker, helper, true, on_event);
                }
            }
            Operation::PickUp(place) | Operation::TakeContainer(place) if is_taken(place) => {}
            Operation::TakeContainer(_) if helper.has_container => {}
            Operation::PickUp(place) | Operation::TakeContainer(place) => {
                let path_m = problem.path_m[helper.row][place];
                let walk = Self::walk_frames(path_m, worker);
                let is_late = helper.time + walk + self.frames.pick_up > problem.frames_left;
                if path_m < NO_PATH_M && !is_late {
                    helper.time += walk;
                    helper.row = place;
                    helper.pending = Some(place);
                }
            }
            Operation::Remove(place) => {
                let path_m = problem.path_m[helper.row][place];
                if path_m < NO_PATH_M && self.removed >> place & 1 == 0 {
                    helper.time += Self::walk_frames(path_m, worker) + self.frames.remove;
                    helper.row = place;
                    helper.pending = Some(place);
                }
            }
        }
    }

    /// Picks up what lies at a place, unless the other person has taken it. An obstacle is already
    /// removed by then.
    fn arrive(
        &mut self,
        worker: &TeamMember,
        person: &mut Person,
        place: usize,
        is_helper: bool,
        on_event: &mut dyn FnMut(SimulatedEvent),
    ) {
        if self.taken >> place & 1 == 1 {
            return;
        }
        let info = &self.problem.places[place];
        if info.kind == PlaceKind::Obstacle {
            self.removed |= 1 << place;
            let (frames, by_helper) = (person.time, is_helper);
            on_event(SimulatedEvent::Arrival { frames, by_helper, place });
            return;
        }
        person.time += self.frames.pick_up + worker.docking_frames;
        if !is_helper && info.partner_chance < MIN_CHANCE {
            self.given_up |= 1 << place;
            return;
        }
        self.taken |= 1 << place;
        let (frames, by_helper) = (person.time, is_helper);
        on_event(SimulatedEvent::Arrival { frames, by_helper, place });
        if info.kind == PlaceKind::Container {
            person.has_container = true;
            return;
        }
        let capacity = self.problem.container_capacity;
        // The partner fills its container at once, the helper when it needs the hand.
        let fills = person.has_container && person.contained.n < capacity;
        let class = info.class_index.unwrap_or(MAX_CLASSES - 1);
        if fills && is_helper && person.loose.n > 0 {
            person.time += self.frames.put_in;
            person.loose.iter().for_each(|class| person.contained.push(class));
            person.loose.n = 0;
        }
        person.loose.push(class);
        if fills && !is_helper {
            person.time += self.frames.put_in;
            person.loose.iter().for_each(|class| person.contained.push(class));
            person.loose.n = 0;
        }
    }

    /// Walks to the nearest goal place and puts everything down: the container first, if it holds
    /// more than one object.
    fn deliver(
        &mut self,
        worker: &TeamMember,
        person: &mut Person,
        by_helper: bool,
        on_event: &mut dyn FnMut(SimulatedEvent),
    ) {
        let problem = self.problem;
        let path = |place: &usize| problem.path_m[person.row][*place];
        let goal = problem
            .places_of(PlaceKind::Goal)
            .filter(|g| !self.is_blocked(worker, person.row, *g))
            .min_by(|a, b| path(a).total_cmp(&path(b)));
        let Some(goal) = goal.filter(|g| path(g) < NO_PATH_M) else {
            person.is_done = true;
            return;
        };
        person.time += Self::walk_frames(path(&goal), worker) + worker.docking_frames;
        person.row = goal;
        let chance = if by_helper { 1.0 } else { problem.places[goal].partner_chance };
        let is_basket = worker.docking_frames > 0.0;
        let factor = if is_basket { BASKET_PUT_ON_FACTOR } else { 1.0 };
        let put_on = self.frames.put_on * factor;
        let container_first = person.contained.n > 1;
        for is_container in [container_first, !container_first] {
            let load = if is_container { person.contained } else { person.loose };
            for (k, class) in load.iter().enumerate() {
                // The contents of a container are put down together.
                person.time += if is_container && k > 0 { 0.0 } else { put_on };
                if person.time > problem.frames_left {
                    break;
                }
                let count = self.missing[class].clamp(0.0, 1.0) * chance;
                self.missing[class] -= count;
                let left = (problem.frames_left - person.time) / problem.frames_left.max(1.0);
                self.value += count * (1.0 + EARLY_BONUS * left);
                let frames = person.time;
                let delivery = Delivery { frames, by_helper, class_index: class, count };
                on_event(SimulatedEvent::Delivery(delivery));
            }
        }
        person.loose.n = 0;
        if person.contained.n > 0 {
            person.contained.n = 0;
            person.has_container = false;
        }
        person.is_done |= person.time >= problem.frames_left;
    }

    fn is_blocked(&self, worker: &TeamMember, row: usize, place: usize) -> bool {
        worker.is_blocked && self.problem.obstacles_on_path[row][place] & !self.removed != 0
    }

    /// One decision of the partner by the published rules.
    fn partner_step(
        &mut self,
        worker: &TeamMember,
        partner: &mut Person,
        helper: &Person,
        on_event: &mut dyn FnMut(SimulatedEvent),
    ) {
        let problem = self.problem;
        if partner.time >= problem.frames_left {
            partner.is_done = true;
            return;
        }
        let frames_left = problem.frames_left - partner.time;
        let fraction_left = frames_left / problem.horizon.max(1.0);
        let path = |place: usize| problem.path_m[partner.row][place];
        let effort = |place: &usize| {
            let factor =
                if problem.places[*place].is_known_to_partner { 1.0 } else { SEARCH_FACTOR };
            path(*place) * factor
        };
        let is_open = |place: &usize| {
            (self.taken | self.given_up) >> place & 1 == 0
                && path(*place) < NO_PATH_M
                && !self.is_blocked(worker, partner.row, *place)
        };
        let goals = problem.places_of(PlaceKind::Goal);
        let goal_m = goals.map(path).fold(NO_PATH_M, f32::min);
        let mut carried = [0.0; MAX_CLASSES];
        for class in partner.loose.iter().chain(partner.contained.iter()) {
            carried[class] += 1.0;
        }
        let missing = |class: usize| self.missing[class] - carried[class];
        let n_missing: f32 = (0..problem.classes.len()).map(|c| missing(c).max(0.0)).sum();
        let capacity = problem.container_capacity;
        let is_full = partner.n_free(worker, capacity) == 0;
        let time = problem.rules.time;
        let is_far = frames_left
            < time.path_time_factor * Self::walk_frames(goal_m, worker)
                + time.delivery_reserve_frames as f32;
        let carries = partner.n_carried() > 0;
        let must_deliver = carries && (is_full || fraction_left < worker.deliver_below || is_far);
        let container = || {
            let takes_one = worker.carries_containers
                && !partner.has_container
                && partner.loose.n < worker.n_loose
                && fraction_left > RuleProfile::PARTNER.container_above
                && n_missing >= problem.rules.min_for_container as f32;
            let known = problem.places_of(PlaceKind::Container).filter(|_| takes_one);
            known
                .filter(|p| problem.places[*p].is_known_to_partner && is_open(p))
                .min_by(|a, b| effort(a).total_cmp(&effort(b)))
        };
        let target = || {
            let wanted = problem.places_of(PlaceKind::Target).filter(|p| {
                problem.places[*p].class_index.is_some_and(|class| missing(class) >= 1.0)
            });
            wanted.filter(is_open).min_by(|a, b| effort(a).total_cmp(&effort(b)))
        };
        let chosen = if must_deliver { None } else { container().or_else(target) };
        if let Some(place) = chosen {
            partner.time += Self::walk_frames(effort(&place), worker);
            partner.row = place;
            partner.pending = Some(place);
        } else if carries {
            self.deliver(worker, partner, false, on_event);
            if partner.is_done && partner.time < problem.frames_left && !helper.is_done {
                // Blocked: it waits for the helper.
                partner.is_done = false;
                partner.time = helper.time.max(partner.time) + IDLE_FRAMES;
            }
        } else if helper.is_done {
            partner.is_done = true;
        } else {
            partner.time = helper.time.max(partner.time) + IDLE_FRAMES;
        }
    }
}

#[cfg(test)]
mod tests;
