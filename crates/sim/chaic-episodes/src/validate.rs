//! Checks whether an episode can be played.

mod content;
mod placement;
mod reachability;

use std::fmt;

use chaic_world::Setup;

pub use reachability::{ReachabilityParams, path_lengths_from, unreachable_objects};

/// Maximum penetration depth that counts as contact, meters: files are rounded to the millimeter,
/// and shapes are boxes around rounded objects.
const TOLERANCE_M: f32 = 0.02;

/// A problem that makes a setup invalid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path of the field within the setup, for example `things[3].position`.
    pub field: String,
    /// Problem and expected value.
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

/// Strictness of the checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Strictness {
    /// The episode can be played.
    Playable,
    /// The episode can also be solved completely and is well-formed, like all generated episodes.
    Generated,
}

/// Returns all problems of a setup by the standard of our generators; empty if there are none.
///
/// Checks more than [`Setup::check`]. The task has the objects it needs. Objects are supported and
/// do not intersect others. People stand free. All required objects are reachable by the helper
/// and, after removal of the obstacles, by the partner. Later checks depend on earlier ones, so a
/// setup with a problem of one kind may have more of another.
pub fn validate(setup: &Setup) -> Vec<Problem> {
    problems(setup, Strictness::Generated)
}

/// Returns all problems that keep a setup from being played at all; empty if there are none.
///
/// The checks are weaker than those of [`validate`], for episodes from other sources. Furniture may
/// intersect walls and other furniture, people may start nearer to walls, and some targets may be
/// missing or unreachable. Only the best possible score is then lower.
pub fn playable(setup: &Setup) -> Vec<Problem> {
    problems(setup, Strictness::Playable)
}

fn problems(setup: &Setup, strictness: Strictness) -> Vec<Problem> {
    if let Err(e) = setup.check() {
        return vec![Problem::new(e.field, e.problem)];
    }
    let problems = content::problems(setup, strictness);
    if !problems.is_empty() {
        return problems;
    }
    let problems = placement::problems(setup, strictness);
    if !problems.is_empty() {
        return problems;
    }
    reachability::problems(setup, strictness)
}

fn object_field(setup: &Setup, index: usize, field: &str) -> String {
    format!("things[{index}] ({}).{field}", setup.things[index].class)
}
