//! Episodes in Python.

use std::io::Cursor;
use std::sync::Arc;

use chaic_core::{ClassId, TaskId};
use chaic_env::rules::RuleSet;
use chaic_episodes::{Split, find_episode};
use chaic_render::floor_plan;
use chaic_world::{SetupError, World};
use image::{ImageFormat, RgbImage};
use numpy::{PyArray1, PyArray3, PyArrayMethods as _, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::error::{no_attribute, readable, runtime_error, value_error};

/// An episode: a scene, its objects and people, and the partner's goal.
#[pyclass(frozen, module = "chaic._chaic", skip_from_py_object)]
#[derive(Clone)]
pub struct Episode(pub Arc<chaic_episodes::Episode>);

#[pymethods]
impl Episode {
    /// Loads an episode by id, such as `high_target/train/03` or `low_target/standard/007`; an id such as
    /// `obstacle/gen/123` generates it.
    #[new]
    fn new(py: Python<'_>, id: &str) -> PyResult<Episode> {
        let episode = py.detach(|| find_episode(id));
        let episode =
            episode.map_err(|e| if e.is_usage() { value_error(e) } else { runtime_error(e) })?;
        Ok(Episode(Arc::new(episode)))
    }

    /// Parses and checks the text of an episode file (docs/episodes.md).
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Episode> {
        let episode = py.detach(|| chaic_episodes::Episode::parse(text.as_bytes(), "the text"));
        Ok(Episode(Arc::new(episode.map_err(value_error)?)))
    }

    /// Returns the text of an episode file.
    fn to_json(&self, py: Python<'_>) -> String {
        py.detach(|| self.0.to_json())
    }

    /// Episode id.
    #[getter]
    fn id(&self) -> &str {
        self.0.id()
    }

    /// Task name.
    #[getter]
    fn task(&self) -> &'static str {
        self.0.task().name()
    }

    /// Draws the top view, uint8 [height, width, 3].
    #[pyo3(signature = (width=640))]
    fn floor_plan<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::error::plan_width)] width: u32,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let picture = py.detach(|| {
            let world = World::new(self.0.setup().clone(), RuleSet::PAPER.world)?;
            Ok::<_, SetupError>(floor_plan::draw(&world, width))
        });
        let picture = picture.map_err(value_error)?;
        let shape = [picture.height() as usize, picture.width() as usize, 3];
        PyArray1::from_vec(py, picture.into_raw()).reshape(shape)
    }

    /// Returns the content of an episode file (docs/episodes.md); `from_dict` reads it.
    fn as_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.0.to_json_line(),))
    }

    /// Parses and checks the content of an episode file. Remove `generator` from a changed episode: the field
    /// states which generator made it.
    #[staticmethod]
    fn from_dict(py: Python<'_>, fields: &Bound<'_, PyDict>) -> PyResult<Episode> {
        let text: String = py.import("json")?.call_method1("dumps", (fields,))?.extract()?;
        Episode::from_json(py, &text)
    }

    /// Raises `AttributeError`; the message names the new name of a renamed method.
    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        Err(no_attribute("Episode", name, &[("plan", "floor_plan")]))
    }

    /// Shows the top view in the notebook or the browser.
    fn show(slf: Bound<'_, Self>) -> PyResult<()> {
        slf.py().import("chaic.pictures")?.call_method1("show", (slf,))?;
        Ok(())
    }

    /// Returns the picture for notebooks, as PNG.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        encode_png(py, &self.floor_plan(py, 640)?)
    }

    fn __repr__(&self) -> String {
        format!("Episode({:?})", self.0.id())
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String,))> {
        let from_json = py.get_type::<Episode>().getattr("from_json")?;
        Ok((from_json.unbind(), (self.0.to_json_line(),)))
    }
}

/// Encodes a color image, uint8 [height, width, 3], as PNG.
#[pyfunction]
pub fn encode_png<'py>(
    py: Python<'py>,
    rgb: &Bound<'py, PyArray3<u8>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let rgb = readable("rgb", rgb)?;
    let &[height, width, 3] = rgb.shape() else {
        return Err(value_error("expected a picture of shape (height, width, 3)"));
    };
    if height == 0 || width == 0 {
        return Err(value_error("the picture has no pixels"));
    }
    let pixels: Vec<u8> = rgb.as_array().iter().copied().collect();
    let mut bytes = Cursor::new(Vec::new());
    let picture = RgbImage::from_raw(width as u32, height as u32, pixels)
        .ok_or_else(|| value_error("the picture is too large"))?;
    picture.write_to(&mut bytes, ImageFormat::Png).map_err(runtime_error)?;
    Ok(PyBytes::new(py, bytes.get_ref()))
}

/// Maximum number of listed episode ids, which take about 1 GB of memory.
const MAX_IDS: usize = 10_000_000;

/// Returns the episode ids of a task in a split: `train`, `test`, `standard`, `gen:A..B` or
/// `gen-standard:A..B`. A split of more than 10 million episodes raises `ValueError`.
#[pyfunction]
pub fn episode_ids(split: &str, task: &str) -> PyResult<Vec<String>> {
    let split: Split = split.parse().map_err(value_error)?;
    let task: TaskId = task.parse().map_err(value_error)?;
    let n = split.len_of(task);
    if n > MAX_IDS {
        return Err(value_error(format!("{split} has {n} episodes, expected at most {MAX_IDS}")));
    }
    Ok((0..n).map(|k| split.episode_id(task, k)).collect())
}

/// Returns the names of all tasks, the paper's eight first.
#[pyfunction]
pub fn tasks() -> Vec<&'static str> {
    TaskId::all().map(TaskId::name).collect()
}

/// Returns the names of all classes of the catalogue, by class index.
#[pyfunction]
pub fn classes() -> Vec<&'static str> {
    ClassId::all().map(|class| class.info().name).collect()
}
