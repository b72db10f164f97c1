//! Whether an episode makes sense to play.

mod fit;
mod reach;
mod sense;

use std::fmt;

use chaic_world::Setup;

pub use reach::{Walker, out_of_reach, ways_from};

/// Deepest overlap that counts as touching, metres: files are written to the millimetre, and
/// shapes are boxes around round things.
const TOLERANCE_M: f32 = 0.02;

/// Something that keeps a setup from being played.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path of the field within the setup, for example `things[3].position`.
    pub field: String,
    /// What is wrong, and what was expected.
    pub problem: String,
}

impl Problem {
    fn new(field: impl Into<String>, problem: impl Into<String>) -> Problem {
        Problem { field: field.into(), problem: problem.into() }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.field, self.problem)
    }
}

/// How much is asked of a setup.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Demand {
    /// It can be played.
    Playable,
    /// Beyond that it is tidy and fair, as all episodes of our generators are.
    Fair,
}

/// Everything that keeps a setup from being as good as those of our generators; empty for a good
/// one.
///
/// Beyond [`Setup::check`]: the task has what it needs, things lie on something and in nothing,
/// people stand free, and all that must be reached can be reached, by the helper and, once it has
/// cleared the obstacles, by the partner. Later checks rest on earlier ones, so a setup with a
/// problem of one kind may have more of another.
pub fn validate(setup: &Setup) -> Vec<Problem> {
    problems(setup, Demand::Fair)
}

/// Everything that keeps a setup from being played at all; empty for a playable one.
///
/// Less is asked than by [`validate`]: where episodes come from elsewhere, furniture may cut into
/// walls and other furniture, people may start nearer to walls, some of what is wanted may be
/// missing or out of reach. That is as their makers had it; it spoils nothing but the best score.
pub fn playable(setup: &Setup) -> Vec<Problem> {
    problems(setup, Demand::Playable)
}

fn problems(setup: &Setup, demand: Demand) -> Vec<Problem> {
    if let Err(e) = setup.check() {
        return vec![Problem::new(e.field, e.problem)];
    }
    let problems = sense::problems(setup, demand);
    if !problems.is_empty() {
        return problems;
    }
    let problems = fit::problems(setup, demand);
    if !problems.is_empty() {
        return problems;
    }
    reach::problems(setup, demand)
}

fn thing_field(setup: &Setup, index: usize, field: &str) -> String {
    format!("things[{index}] ({}).{field}", setup.things[index].class)
}
