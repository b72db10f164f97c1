//! Briefings and observations in Python. Their fields are converted on access.

use chaic_core::geom::Camera;
use chaic_core::observation::Images;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyList;
use pythonize::pythonize;
use serde::Serialize;

use crate::error::no_attribute;

/// Converts plain data to dictionaries, lists, numbers and strings.
pub fn to_python<'py>(py: Python<'py>, data: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    Ok(pythonize(py, data)?)
}

/// Information for an agent before an episode; docs/subprocess-helpers.md lists the fields.
#[pyclass(frozen, module = "chaic._chaic", skip_from_py_object)]
#[derive(Clone)]
pub struct Briefing(pub chaic_core::Briefing);

#[pymethods]
impl Briefing {
    /// Returns all fields.
    fn as_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0)
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        if name == "layout" {
            // The field is absent without the grant of the state.
            return to_python(py, &self.0.layout);
        }
        let missing = |_| no_attribute("Briefing", name, &[("told", "disclosure")]);
        to_python(py, &self.0)?.get_item(name).map_err(missing)
    }

    fn __repr__(&self) -> String {
        format!("Briefing(me={}, horizon={})", self.0.me.0, self.0.horizon)
    }
}

/// Observation of an agent when its action has ended; docs/subprocess-helpers.md lists the fields.
#[pyclass(frozen, module = "chaic._chaic", skip_from_py_object)]
#[derive(Clone)]
pub struct Observation(pub chaic_core::Observation);

/// Color, uint8 [height, width, 3].
pub type Rgb<'py> = Bound<'py, PyArray3<u8>>;
/// Depth, float32 meters [height, width].
pub type Depth<'py> = Bound<'py, PyArray2<f32>>;
/// Instance ids, uint16 [height, width].
pub type Ids<'py> = Bound<'py, PyArray2<u16>>;

/// Returns the shape of a camera's images.
fn shape(camera: &Camera) -> [usize; 2] {
    [camera.height as usize, camera.width as usize]
}

/// Converts a color image to an array.
fn rgb_array<'py>(py: Python<'py>, images: &Images, camera: &Camera) -> PyResult<Option<Rgb<'py>>> {
    let [height, width] = shape(camera);
    let array = |rgb| PyArray1::from_slice(py, rgb).reshape([height, width, 3]);
    images.rgb.as_deref().map(array).transpose()
}

/// Converts a depth image to an array.
fn depth_array<'py>(
    py: Python<'py>,
    images: &Images,
    camera: &Camera,
) -> PyResult<Option<Depth<'py>>> {
    let array = |depth_m| PyArray1::from_slice(py, depth_m).reshape(shape(camera));
    images.depth_m.as_deref().map(array).transpose()
}

/// Converts an image of instance ids to an array.
fn ids_array<'py>(py: Python<'py>, images: &Images, camera: &Camera) -> PyResult<Option<Ids<'py>>> {
    let array = |ids| PyArray1::from_slice(py, ids).reshape(shape(camera));
    images.ids.as_deref().map(array).transpose()
}

/// Converts images to arrays.
pub fn arrays<'py>(
    py: Python<'py>,
    images: &Images,
    camera: &Camera,
) -> PyResult<(Option<Rgb<'py>>, Option<Depth<'py>>, Option<Ids<'py>>)> {
    let (rgb, depth) = (rgb_array(py, images, camera)?, depth_array(py, images, camera)?);
    Ok((rgb, depth, ids_array(py, images, camera)?))
}

#[pymethods]
impl Observation {
    /// Frames since the start of the episode.
    #[getter]
    fn frame(&self) -> u32 {
        self.0.frame
    }

    /// State of the own body: `pose`, `hands`, `last`, `other_end`.
    #[getter]
    fn proprioception<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0.proprioception)
    }

    /// Camera of the images.
    #[getter]
    fn camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0.camera)
    }

    /// Granted information.
    #[getter]
    fn granted<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0.granted)
    }

    /// Color, uint8 [height, width, 3]; `None` if not requested.
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Option<Rgb<'py>>> {
        rgb_array(py, &self.0.images, &self.0.camera)
    }

    /// Depth along the camera's axis, float32 meters [height, width]; `None` if not requested.
    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Option<Depth<'py>>> {
        depth_array(py, &self.0.images, &self.0.camera)
    }

    /// Instance ids, uint16 [height, width]; `None` if not requested or not granted.
    #[getter]
    fn ids<'py>(&self, py: Python<'py>) -> PyResult<Option<Ids<'py>>> {
        ids_array(py, &self.0.images, &self.0.camera)
    }

    /// Images since the last decision, oldest first, if requested: dictionaries with `frame`, `camera`, `rgb`
    /// and `depth`.
    #[getter]
    fn frame_history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let frames = PyList::empty(py);
        for history in &self.0.frame_history {
            let rgb = rgb_array(py, &history.images, &history.camera)?;
            let depth = depth_array(py, &history.images, &history.camera)?;
            let frame = pyo3::types::PyDict::new(py);
            frame.set_item("frame", history.frame)?;
            frame.set_item("camera", to_python(py, &history.camera)?)?;
            frame.set_item("rgb", rgb)?;
            frame.set_item("depth", depth)?;
            frames.append(frame)?;
        }
        Ok(frames)
    }

    /// Raises `AttributeError`; the message names the new name of a renamed attribute.
    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        let renamed = [("own", "proprioception"), ("film", "frame_history")];
        Err(no_attribute("Observation", name, &renamed))
    }

    fn __repr__(&self) -> String {
        format!("Observation(frame={})", self.0.frame)
    }
}
