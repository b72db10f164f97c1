//! Which Python exception tells of which error.

use std::fmt::Display;

use chaic_env::EnvError;
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// A mistake in what was asked for.
pub fn mistake(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A number that names nothing.
pub fn no_such(what: &str, k: usize, n: usize) -> PyErr {
    PyIndexError::new_err(format!("there is no {what} {k} of {n}"))
}

/// Something that can't be done now, or failed by itself.
pub fn failure(error: impl Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// An error of an environment.
pub fn of_env(error: &EnvError) -> PyErr {
    if error.is_usage() { mistake(error) } else { failure(error) }
}

/// An object of which a thread broke down.
pub fn poisoned<T>(_: T) -> PyErr {
    failure("an earlier call broke down; make a new object")
}

/// The beginning of how Python shows an object.
pub fn shown(object: &Bound<'_, PyAny>) -> String {
    const MOST: usize = 120;
    let text = object.repr().map_or_else(|_| "it".to_owned(), |text| text.to_string());
    if text.chars().count() <= MOST {
        text
    } else {
        text.chars().take(MOST).collect::<String>() + "..."
    }
}
