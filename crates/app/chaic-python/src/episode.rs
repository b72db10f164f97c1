//! Episodes: where they come from, and what they are.

use std::io::Cursor;
use std::sync::Arc;

use chaic_core::{ClassId, TaskId};
use chaic_env::rules::RuleSet;
use chaic_episodes::{Split, find_episode};
use chaic_render::floor_plan;
use chaic_world::{SetupError, World};
use image::{ImageFormat, RgbImage};
use numpy::{
    PyArray1, PyArray3, PyArrayMethods as _, PyReadonlyArray3, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::error::{failure, mistake};

/// An episode: a place, what lies there, who takes part, and what the partner wants.
#[pyclass(frozen, module = "chaic._chaic", skip_from_py_object)]
#[derive(Clone)]
pub struct Episode(pub Arc<chaic_episodes::Episode>);

#[pymethods]
impl Episode {
    /// The episode of this name, like `high_target/train/03` or `low_target/standard/007`; the name
    /// `obstacle/gen/123` generates it.
    #[new]
    fn new(py: Python<'_>, id: &str) -> PyResult<Episode> {
        let episode = py.detach(|| find_episode(id)).map_err(mistake)?;
        Ok(Episode(Arc::new(episode)))
    }

    /// The episode of a file's text (docs/episodes.md), checked as the file is.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Episode> {
        let episode = py.detach(|| chaic_episodes::Episode::parse(text.as_bytes(), "the text"));
        Ok(Episode(Arc::new(episode.map_err(mistake)?)))
    }

    /// As the text of a file.
    fn to_json(&self, py: Python<'_>) -> String {
        py.detach(|| self.0.to_json())
    }

    /// Its name.
    #[getter]
    fn id(&self) -> &str {
        self.0.id()
    }

    /// The name of its task.
    #[getter]
    fn task(&self) -> &'static str {
        self.0.task().name()
    }

    /// Seen from above, uint8 [height, width, 3].
    #[pyo3(signature = (width=640))]
    fn plan<'py>(&self, py: Python<'py>, width: u32) -> PyResult<Bound<'py, PyArray3<u8>>> {
        if !(16..=8192).contains(&width) {
            return Err(mistake(format!("width is {width}, expected 16 to 8192")));
        }
        let picture = py.detach(|| {
            let world = World::new(self.0.setup().clone(), RuleSet::PAPER.world)?;
            Ok::<_, SetupError>(floor_plan::draw(&world, width))
        });
        let picture = picture.map_err(mistake)?;
        let shape = [picture.height() as usize, picture.width() as usize, 3];
        PyArray1::from_vec(py, picture.into_raw()).reshape(shape)
    }

    /// As the dictionary that its file is written from (docs/episodes.md), to be changed and read again by
    /// `from_dict`.
    fn as_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.0.to_json_line(),))
    }

    /// The episode of such a dictionary, checked as a file is. One that was changed has no `generator`: that
    /// would promise what its generator keeps.
    #[staticmethod]
    fn from_dict(py: Python<'_>, fields: &Bound<'_, PyDict>) -> PyResult<Episode> {
        let text: String = py.import("json")?.call_method1("dumps", (fields,))?.extract()?;
        Episode::from_json(py, &text)
    }

    /// Shows the place from above: in a notebook in its cell, elsewhere in the browser.
    fn show(slf: Bound<'_, Self>) -> PyResult<()> {
        slf.py().import("chaic.pictures")?.call_method1("show", (slf,))?;
        Ok(())
    }

    /// The picture that notebooks show.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        encode_png(py, self.plan(py, 640)?.readonly())
    }

    fn __repr__(&self) -> String {
        format!("Episode({:?})", self.0.id())
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String,))> {
        let from_json = py.get_type::<Episode>().getattr("from_json")?;
        Ok((from_json.unbind(), (self.0.to_json_line(),)))
    }
}

/// A picture as the bytes of a PNG file; color, uint8 [height, width, 3].
#[pyfunction]
pub fn encode_png<'py>(
    py: Python<'py>,
    rgb: PyReadonlyArray3<'py, u8>,
) -> PyResult<Bound<'py, PyBytes>> {
    let &[height, width, 3] = rgb.shape() else {
        return Err(mistake("expected a picture of shape (height, width, 3)"));
    };
    let pixels: Vec<u8> = rgb.as_array().iter().copied().collect();
    let mut bytes = Cursor::new(Vec::new());
    let picture = RgbImage::from_raw(width as u32, height as u32, pixels)
        .ok_or_else(|| mistake("the picture is too large"))?;
    picture.write_to(&mut bytes, ImageFormat::Png).map_err(failure)?;
    Ok(PyBytes::new(py, bytes.get_ref()))
}

/// The names of the episodes of a task in a split: `train`, `test`, `standard`, `gen:A..B` or
/// `gen-standard:A..B`.
#[pyfunction]
pub fn episode_ids(split: &str, task: &str) -> PyResult<Vec<String>> {
    let split: Split = split.parse().map_err(mistake)?;
    let task: TaskId = task.parse().map_err(mistake)?;
    Ok((0..split.len_of(task)).map(|k| split.episode_id(task, k)).collect())
}

/// The names of all tasks, the paper's eight first.
#[pyfunction]
pub fn tasks() -> Vec<&'static str> {
    TaskId::all().map(TaskId::name).collect()
}

/// The names of all classes of the catalogue, in the order of their numbers.
#[pyfunction]
pub fn classes() -> Vec<&'static str> {
    ClassId::all().map(|class| class.info().name).collect()
}
