//! What agents are told and perceive, as Python reads it: fields are made when they are asked for.

use chaic_core::geom::Camera;
use chaic_core::observation::Images;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use pythonize::pythonize;
use serde::Serialize;

/// Anything of plain data, as dictionaries, lists, numbers and strings.
pub fn plain<'py>(py: Python<'py>, data: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    Ok(pythonize(py, data)?)
}

/// What an agent is told before an episode (docs/subprocess-helpers.md has the fields).
#[pyclass(frozen, module = "chaic._chaic", skip_from_py_object)]
#[derive(Clone)]
pub struct Briefing(pub chaic_core::Briefing);

#[pymethods]
impl Briefing {
    /// All of it.
    fn as_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.0)
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let nothing = |_| PyAttributeError::new_err(format!("a briefing has no {name:?}"));
        plain(py, &self.0)?.get_item(name).map_err(nothing)
    }

    fn __repr__(&self) -> String {
        format!("Briefing(me={}, horizon={})", self.0.me.0, self.0.horizon)
    }
}

/// What an agent perceives when its action has ended (docs/subprocess-helpers.md has the fields).
#[pyclass(frozen, module = "chaic._chaic", skip_from_py_object)]
#[derive(Clone)]
pub struct Observation(pub chaic_core::Observation);

/// An array of color, uint8 [height, width, 3].
pub type Rgb<'py> = Bound<'py, PyArray3<u8>>;
/// An array of depth, float32 metres [height, width].
pub type Depth<'py> = Bound<'py, PyArray2<f32>>;
/// An array of instance ids, uint16 [height, width].
pub type Ids<'py> = Bound<'py, PyArray2<u16>>;

/// Images as arrays.
pub fn arrays<'py>(
    py: Python<'py>,
    images: &Images,
    camera: &Camera,
) -> PyResult<(Option<Rgb<'py>>, Option<Depth<'py>>, Option<Ids<'py>>)> {
    let shape = [camera.height as usize, camera.width as usize];
    let of_color = [shape[0], shape[1], 3];
    let rgb = images.rgb.as_ref().map(|rgb| PyArray1::from_slice(py, rgb).reshape(of_color));
    let depth = images.depth_m.as_ref().map(|m| PyArray1::from_slice(py, m).reshape(shape));
    let ids = images.ids.as_ref().map(|ids| PyArray1::from_slice(py, ids).reshape(shape));
    Ok((rgb.transpose()?, depth.transpose()?, ids.transpose()?))
}

#[pymethods]
impl Observation {
    /// Frames since the episode began.
    #[getter]
    fn frame(&self) -> u32 {
        self.0.frame
    }

    /// What the agent knows of itself: `pose`, `hands`, `last`, `other_end`.
    #[getter]
    fn own<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.0.own)
    }

    /// The camera that took the images.
    #[getter]
    fn camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.0.camera)
    }

    /// What was granted beyond own images and state.
    #[getter]
    fn granted<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.0.granted)
    }

    /// Color, uint8 [height, width, 3]; `None` if it wasn't asked for.
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Option<Rgb<'py>>> {
        Ok(arrays(py, &self.0.images, &self.0.camera)?.0)
    }

    /// Depth along the camera's axis, float32 metres [height, width]; `None` if it wasn't asked for.
    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Option<Depth<'py>>> {
        Ok(arrays(py, &self.0.images, &self.0.camera)?.1)
    }

    /// Instance ids, uint16 [height, width]; `None` if they weren't asked for or aren't granted.
    #[getter]
    fn ids<'py>(&self, py: Python<'py>) -> PyResult<Option<Ids<'py>>> {
        Ok(arrays(py, &self.0.images, &self.0.camera)?.2)
    }

    /// What was seen since the last decision, oldest first, where that was asked for: dictionaries with
    /// `frame`, `camera`, `rgb` and `depth`.
    #[getter]
    fn film<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let frames = PyList::empty(py);
        for film in &self.0.film {
            let (rgb, depth, _) = arrays(py, &film.images, &film.camera)?;
            let frame = pyo3::types::PyDict::new(py);
            frame.set_item("frame", film.frame)?;
            frame.set_item("camera", plain(py, &film.camera)?)?;
            frame.set_item("rgb", rgb)?;
            frame.set_item("depth", depth)?;
            frames.append(frame)?;
        }
        Ok(frames)
    }

    fn __repr__(&self) -> String {
        format!("Observation(frame={})", self.0.frame)
    }
}
