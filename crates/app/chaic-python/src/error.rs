//! Conversion of errors to Python exceptions.

use std::fmt::Display;

use chaic_env::EnvError;
use numpy::ndarray::Dimension;
use numpy::{
    BorrowError, Element, PyArray, PyArrayMethods as _, PyReadonlyArray, PyReadwriteArray,
};
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

/// Borrows an array of the caller for reading; `name` names it in the error.
///
/// # Errors
/// `RuntimeError` if another call writes to its memory.
pub fn readable<'py, T: Element, D: Dimension>(
    name: &str,
    array: &Bound<'py, PyArray<T, D>>,
) -> PyResult<PyReadonlyArray<'py, T, D>> {
    array.try_readonly().map_err(|problem| not_borrowed(name, &problem))
}

/// Borrows an array of the caller for writing; `name` names it in the error.
///
/// # Errors
/// `ValueError` if it is read-only, `RuntimeError` if another argument or call uses its memory.
pub fn writable<'py, T: Element, D: Dimension>(
    name: &str,
    array: &Bound<'py, PyArray<T, D>>,
) -> PyResult<PyReadwriteArray<'py, T, D>> {
    array.try_readwrite().map_err(|problem| not_borrowed(name, &problem))
}

fn not_borrowed(name: &str, problem: &BorrowError) -> PyErr {
    match problem {
        BorrowError::NotWriteable => mistake(format!("the array {name} is read-only")),
        _ => failure(format!("another argument or thread uses the memory of the array {name} now")),
    }
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
