//! Actions as Python has them: rows of numbers for learners, strings and dictionaries for everybody else.

use chaic_core::observation::SelfState;
use chaic_core::{Action, Hand, Outcome, Target};
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};

use crate::error::mistake;

/// The kinds of actions that rows of numbers name by their index. Those of a hand and a thing point at a pixel of
/// the image last seen.
pub const ACTIONS: [&str; 11] = [
    "move_forward",
    "turn_left",
    "turn_right",
    "pick_up_left",
    "pick_up_right",
    "put_in",
    "put_on_left",
    "put_on_right",
    "remove_obstacle_left",
    "remove_obstacle_right",
    "wait",
];

/// How long a wait of a row is, frames: a turn takes about as long.
const WAIT_FRAMES: u32 = 10;

/// The action of a row: kind, column and row of the pixel.
///
/// # Errors
/// `ValueError` if there is no such kind, or a pixel is negative. Pixels beyond the image show nothing.
pub fn of_row([kind, column, row]: [i64; 3]) -> PyResult<Action> {
    let pixel = || {
        let of = |x: i64| {
            u32::try_from(x)
                .map_err(|_| mistake(format!("no pixel is at column {column}, row {row}")))
        };
        Ok::<_, PyErr>(Target::Pixel { column: of(column)?, row: of(row)? })
    };
    Ok(match kind {
        0 => Action::MoveForward,
        1 => Action::TurnLeft,
        2 => Action::TurnRight,
        3 => Action::PickUp { object: pixel()?, hand: Hand::Left },
        4 => Action::PickUp { object: pixel()?, hand: Hand::Right },
        5 => Action::PutIn,
        6 => Action::PutOn { place: pixel()?, hand: Hand::Left },
        7 => Action::PutOn { place: pixel()?, hand: Hand::Right },
        8 => Action::RemoveObstacle { obstacle: pixel()?, hand: Hand::Left },
        9 => Action::RemoveObstacle { obstacle: pixel()?, hand: Hand::Right },
        10 => Action::Wait { frames: WAIT_FRAMES },
        other => {
            let n = ACTIONS.len();
            return Err(mistake(format!("no action is number {other}; there are {n}")));
        }
    })
}

/// The action of a string or a dictionary, written as in docs/subprocess-helpers.md.
///
/// # Errors
/// `ValueError` if it is none.
pub fn of_object(object: &Bound<'_, PyAny>) -> PyResult<Action> {
    let action: Action = depythonize(object).map_err(|error| {
        mistake(format!("{} is no action: {error}", crate::error::shown(object)))
    })?;
    match action {
        Action::Wait { frames: 0 } => Err(mistake("a wait takes at least 1 frame")),
        action => Ok(action),
    }
}

/// The same the other way round.
pub fn to_object<'py>(py: Python<'py>, action: &Action) -> PyResult<Bound<'py, PyAny>> {
    Ok(pythonize(py, action)?)
}

/// Which kinds of actions the own hands don't rule out, in the order of [`ACTIONS`].
pub fn mask(own: &SelfState) -> [bool; ACTIONS.len()] {
    let [left, right] = [0, 1].map(|hand| own.hands[hand].is_some());
    let is_two_handed = own.hands[0].as_ref().is_some_and(|held| held.in_both_hands);
    let in_both = left && right && !is_two_handed;
    [true, true, true, !left, !right, in_both, left, right, !left, !right, true]
}

/// What an agent knows of itself, as numbers; their names in [`OWN`].
pub fn own_numbers(own: &SelfState, part_of_time: f32) -> [f32; OWN.len()] {
    use chaic_core::geom::math;
    let held = |hand: usize| {
        let held = own.hands[hand].as_ref();
        let n_contents = held.map_or(0, |held| held.n_contents);
        [f32::from(u8::from(held.is_some())), n_contents as f32]
    };
    let ([left, left_n], [right, right_n]) = (held(0), held(1));
    let (succeeded, failed) = match own.last {
        Some((_, Outcome::Success)) => (1.0, 0.0),
        Some(_) => (0.0, 1.0),
        None => (0.0, 0.0),
    };
    let is_two_handed = own.hands[0].as_ref().is_some_and(|held| held.in_both_hands);
    let pose = own.pose;
    [
        pose.position.x,
        pose.position.z,
        math::sin(pose.yaw_rad),
        math::cos(pose.yaw_rad),
        part_of_time,
        left,
        left_n,
        right,
        right_n,
        f32::from(u8::from(is_two_handed)),
        succeeded,
        failed,
    ]
}

/// What [`own_numbers`] has: the place in the world in metres, the direction of the eye, the part of the episode
/// that has passed, for each hand whether it holds something and how many things are in that, whether one thing
/// is in both hands, and whether the last action ended well or failed.
pub const OWN: [&str; 12] = [
    "x_m",
    "z_m",
    "sin_yaw",
    "cos_yaw",
    "part_of_time",
    "left_holds",
    "left_contents",
    "right_holds",
    "right_contents",
    "one_in_both",
    "last_succeeded",
    "last_failed",
];
