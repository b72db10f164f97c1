//! Conversion of errors to Python exceptions.

use std::fmt::Display;

use chaic_env::EnvError;
use pyo3::exceptions::{
    PyAttributeError, PyIndexError, PyOverflowError, PyRuntimeError, PyValueError,
};
use pyo3::prelude::*;

/// Returns a `ValueError` for invalid arguments.
pub fn mistake(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Returns an `IndexError` for an index `k` of `n` items.
pub fn no_such(what: &str, k: usize, n: usize) -> PyErr {
    PyIndexError::new_err(format!("there is no {what} {k} of {n}"))
}

/// Extracts a seed; raises `ValueError` if it is out of range.
pub fn seed(value: &Bound<'_, PyAny>) -> PyResult<u32> {
    value.extract().map_err(|error: PyErr| out_of_range(error, "seed", value, u32::MAX.into()))
}

/// Extracts seeds; raises `ValueError` if one is out of range.
pub fn seeds(value: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    value.extract().map_err(|error: PyErr| out_of_range(error, "seeds", value, u32::MAX.into()))
}

/// Extracts the number of an agent; raises `ValueError` if it is out of range.
pub fn agent_number(value: &Bound<'_, PyAny>) -> PyResult<u8> {
    value.extract().map_err(|error: PyErr| out_of_range(error, "agent", value, u8::MAX.into()))
}

/// Extracts a number of jobs; raises `ValueError` if it is out of range.
pub fn n_jobs(value: &Bound<'_, PyAny>) -> PyResult<u32> {
    value.extract().map_err(|error: PyErr| out_of_range(error, "jobs", value, u32::MAX.into()))
}

/// Replaces an `OverflowError` by a `ValueError` that names the range.
fn out_of_range(error: PyErr, name: &str, value: &Bound<'_, PyAny>, max: u64) -> PyErr {
    if error.is_instance_of::<PyOverflowError>(value.py()) {
        mistake(format!("{name} is {}, expected 0 to {max}", short_repr(value)))
    } else {
        error
    }
}

/// Returns an `AttributeError` for an unknown attribute of a class. `renamed` lists old names with their new ones.
pub fn no_attribute(class: &str, name: &str, renamed: &[(&str, &str)]) -> PyErr {
    let new_name = renamed.iter().find(|(old, _)| *old == name).map(|(_, new)| *new);
    PyAttributeError::new_err(match new_name {
        Some(new_name) => format!("{class}.{name} was renamed; use {class}.{new_name}"),
        None => format!("{class} has no attribute {name:?}"),
    })
}

/// Returns a `RuntimeError` for a failure or an invalid state.
pub fn failure(error: impl Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// Converts an error of an environment.
pub fn from_env(error: &EnvError) -> PyErr {
    if error.is_usage() { mistake(error) } else { failure(error) }
}

/// Returns a `RuntimeError` for an object in which a call panicked.
pub fn poisoned<T>(_: T) -> PyErr {
    failure("an earlier call panicked; create a new object")
}

/// Returns the start of the `repr` of an object.
pub fn short_repr(object: &Bound<'_, PyAny>) -> String {
    const MAX_CHARS: usize = 120;
    let text = object.repr().map_or_else(|_| "the object".to_owned(), |text| text.to_string());
    if text.chars().count() <= MAX_CHARS {
        text
    } else {
        text.chars().take(MAX_CHARS).collect::<String>() + "..."
    }
}
