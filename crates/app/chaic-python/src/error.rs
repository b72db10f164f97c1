//! Conversion of errors to Python exceptions.

use std::fmt::Display;
use std::ops::RangeInclusive;

use chaic_env::EnvError;
use numpy::ndarray::Dimension;
use numpy::{
    BorrowError, Element, PyArray, PyArrayMethods as _, PyReadonlyArray, PyReadwriteArray,
};
use pyo3::exceptions::{
    PyAttributeError, PyIndexError, PyOverflowError, PyRuntimeError, PyTypeError, PyValueError,
};
use pyo3::prelude::*;

/// Returns a `ValueError` for invalid arguments.
pub fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Returns an `IndexError` for an index `k` of `n` items.
pub fn index_error(what: &str, k: usize, n: usize) -> PyErr {
    PyIndexError::new_err(format!("there is no {what} {k} of {n}"))
}

/// Range of numbers that only their type limits.
pub const ANY_NUMBER: RangeInclusive<u32> = 0..=u32::MAX;

/// Extracts an integer; `name` names it in the error.
///
/// # Errors
/// `ValueError` if it is outside the range, `TypeError` if it is no integer.
pub fn integer(name: &str, value: &Bound<'_, PyAny>, range: &RangeInclusive<u32>) -> PyResult<u32> {
    match value.extract::<u32>() {
        Ok(number) if !range.contains(&number) => Err(out_of_range(name, value, range)),
        Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => {
            Err(out_of_range(name, value, range))
        }
        extracted => extracted,
    }
}

/// Extracts integers; see [`integer`].
fn integers(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    value.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyOverflowError>(value.py()) {
            out_of_range(name, value, &ANY_NUMBER)
        } else {
            error
        }
    })
}

fn out_of_range(name: &str, value: &Bound<'_, PyAny>, range: &RangeInclusive<u32>) -> PyErr {
    let (start, end) = (range.start(), range.end());
    value_error(format!("{name} is {}, expected {start} to {end}", short_repr(value)))
}

/// Extracts a seed; raises `ValueError` if it is out of range.
pub fn seed(value: &Bound<'_, PyAny>) -> PyResult<u32> {
    integer("seed", value, &ANY_NUMBER)
}

/// Extracts seeds; raises `ValueError` if one is out of range.
pub fn seeds(value: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    integers("seeds", value)
}

/// Extracts the number of an agent; raises `ValueError` if it is out of range.
pub fn agent_number(value: &Bound<'_, PyAny>) -> PyResult<u8> {
    Ok(integer("agent", value, &(0..=u32::from(u8::MAX)))? as u8)
}

/// Extracts a number of jobs; raises `ValueError` if it is out of range.
pub fn n_jobs(value: &Bound<'_, PyAny>) -> PyResult<u32> {
    integer("jobs", value, &ANY_NUMBER)
}

/// Extracts the width of a top view, pixels; raises `ValueError` if it is out of range.
pub fn plan_width(value: &Bound<'_, PyAny>) -> PyResult<u32> {
    integer("width", value, &(64..=8192))
}

/// Extracts the side of a semantic map, cells; raises `ValueError` if it is out of range.
pub fn map_side(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(integer("side", value, &(1..=1024))? as usize)
}

/// Extracts the index of a plan; raises `ValueError` if it is negative.
pub fn plan_index(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(integer("index", value, &ANY_NUMBER)? as usize)
}

/// Extracts the index of a world; raises `ValueError` if it is negative.
pub fn world_index(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(integer("world", value, &ANY_NUMBER)? as usize)
}

/// Extracts indices of worlds; raises `ValueError` if one is negative.
pub fn world_indices(value: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    Ok(integers("worlds", value)?.into_iter().map(|world| world as usize).collect())
}

/// Returns an `AttributeError` for an unknown attribute of a class. `renamed` lists old names with their new ones.
pub fn no_attribute(class: &str, name: &str, renamed: &[(&str, &str)]) -> PyErr {
    let new_name = renamed.iter().find(|(old, _)| *old == name).map(|(_, new)| *new);
    PyAttributeError::new_err(match new_name {
        Some(new_name) => format!("{class}.{name} was renamed; use {class}.{new_name}"),
        None => format!("{class} has no attribute {name:?}"),
    })
}

/// Returns a `TypeError` for an object that cannot be pickled. `instead` describes the alternative.
pub fn not_picklable(class: &str, instead: &str) -> PyErr {
    PyTypeError::new_err(format!("a {class} can be neither pickled nor copied: {instead}"))
}

/// Returns a `RuntimeError` for a failure or an invalid state.
pub fn runtime_error(error: impl Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// Converts an error of an environment.
pub fn from_env(error: &EnvError) -> PyErr {
    if error.is_usage() { value_error(error) } else { runtime_error(error) }
}

/// Returns a `RuntimeError` for an object in which a call panicked.
pub fn poisoned<T>(_: T) -> PyErr {
    runtime_error("an earlier call panicked; create a new object")
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
        BorrowError::NotWriteable => value_error(format!("the array {name} is read-only")),
        _ => runtime_error(format!(
            "another argument or thread uses the memory of the array {name} now"
        )),
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
