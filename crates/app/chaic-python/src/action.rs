//! Actions in Python: rows of integers for learners, and strings or dictionaries.

use chaic_core::observation::Proprioception;
use chaic_core::{Action, Hand, Outcome, Target};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};

use crate::error::{short_repr, value_error};

/// Kinds of actions; rows refer to them by index. Actions of a hand on an object take a pixel of the last image.
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

/// Duration of a wait in a row, frames: about the duration of a step.
const WAIT_FRAMES: u32 = 10;

/// Parses a row of integers: kind of action, column and row of the pixel.
///
/// # Errors
/// `ValueError` for an unknown kind or a negative pixel. Pixels outside the image resolve to nothing.
pub fn from_row([kind, column, row]: [i64; 3]) -> PyResult<Action> {
    let pixel = || {
        let coordinate = |x: i64| {
            u32::try_from(x).map_err(|_| {
                value_error(format!("there is no pixel at column {column}, row {row}"))
            })
        };
        Ok::<_, PyErr>(Target::Pixel { column: coordinate(column)?, row: coordinate(row)? })
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
            return Err(value_error(format!("there is no action {other} of {n}")));
        }
    })
}

/// Parses a string or dictionary as in docs/subprocess-helpers.md.
///
/// # Errors
/// `ValueError` if it is not an action.
pub fn from_object(object: &Bound<'_, PyAny>) -> PyResult<Action> {
    let action: Action = depythonize(object).map_err(|error| {
        let error = PyErr::from(error);
        let problem = if error.is_instance_of::<PyOverflowError>(object.py()) {
            "a number in it is negative or too large".to_owned()
        } else {
            error.value(object.py()).to_string()
        };
        value_error(format!("{} is no action: {problem}", short_repr(object)))
    })?;
    match action {
        Action::Wait { frames: 0 } => Err(value_error("a wait takes at least 1 frame")),
        action => Ok(action),
    }
}

/// Converts an action to a string or dictionary.
pub fn to_object<'py>(py: Python<'py>, action: &Action) -> PyResult<Bound<'py, PyAny>> {
    Ok(pythonize(py, action)?)
}

/// Returns a mask of the kinds of actions that the hands allow, in the order of [`ACTIONS`].
pub fn mask(proprioception: &Proprioception) -> [bool; ACTIONS.len()] {
    let [left, right] = [0, 1].map(|hand| proprioception.hands[hand].is_some());
    let is_two_handed = proprioception.hands[0].as_ref().is_some_and(|held| held.in_both_hands);
    let can_put_in = left && right && !is_two_handed;
    [true, true, true, !left, !right, can_put_in, left, right, !left, !right, true]
}

/// Returns proprioception as a vector; [`PROPRIOCEPTION`] names its elements.
pub fn proprioception_values(
    proprioception: &Proprioception,
    elapsed_fraction: f32,
) -> [f32; PROPRIOCEPTION.len()] {
    use chaic_core::geom::math;
    let held = |hand: usize| {
        let held = proprioception.hands[hand].as_ref();
        let n_contents = held.map_or(0, |held| held.n_contents);
        [f32::from(u8::from(held.is_some())), n_contents as f32]
    };
    let ([left, left_n], [right, right_n]) = (held(0), held(1));
    let (has_succeeded, has_failed) = match proprioception.last {
        Some((_, Outcome::Success)) => (1.0, 0.0),
        Some(_) => (0.0, 1.0),
        None => (0.0, 0.0),
    };
    let is_two_handed = proprioception.hands[0].as_ref().is_some_and(|held| held.in_both_hands);
    let pose = proprioception.pose;
    [
        pose.position.x,
        pose.position.z,
        math::sin(pose.yaw_rad),
        math::cos(pose.yaw_rad),
        elapsed_fraction,
        left,
        left_n,
        right,
        right_n,
        f32::from(u8::from(is_two_handed)),
        has_succeeded,
        has_failed,
    ]
}

/// Elements of [`proprioception_values`]: position in the world (meters), direction of view, elapsed fraction of the
/// episode. For each hand: whether it holds an object, and how many objects that object contains. The last elements
/// are whether both hands hold one object, and whether the last action succeeded or failed.
pub const PROPRIOCEPTION: [&str; 12] = [
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
