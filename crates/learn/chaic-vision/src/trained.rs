//! Trained detector: parameters, score calibration, and their file.

use chaic_core::ClassId;
use chaic_core::geom::Camera;
pub use chaic_nn::Inference;
use chaic_nn::simd::widest;
use chaic_nn::weights::WeightsError;
use chaic_nn::{Network, Shape, weights};

use crate::calibration::{Calibration, N_PREDICTORS, predictors};
use crate::detector::Detector;
use crate::features::{ImageCrop, N_FEATURES, features};
use crate::instances::{Instance, InstanceConfig, Pixels};

/// A trained detector.
#[derive(Clone, Debug)]
pub struct TrainedDetector {
    /// The network.
    pub detector: Detector,
    /// Parameters of the network.
    pub parameters: Vec<f32>,
    /// Calibration of scores.
    pub calibration: Calibration,
}

/// Returns the kind in weights files: format version and digest of the classes.
fn kind() -> String {
    let names: Vec<&str> = ClassId::all().map(|class| class.name()).collect();
    format!("chaic detector 1, classes {}", weights::digest(names.join(" ").as_bytes()))
}

/// Returns the network together with the calibration parameters of the file.
fn file_layout(detector: &Detector) -> Network {
    let mut network = detector.network.clone();
    network.extra_parameters("calibration", N_PREDICTORS);
    network
}

impl TrainedDetector {
    /// Creates a detector without score calibration.
    pub fn uncalibrated(detector: &Detector, parameters: &[f32]) -> TrainedDetector {
        let (detector, parameters) = (detector.clone(), parameters.to_vec());
        TrainedDetector { detector, parameters, calibration: Calibration::default() }
    }

    /// Returns the detector that chaic ships; weights/README.md documents its training and
    /// accuracy.
    pub fn built_in() -> TrainedDetector {
        let bytes = include_bytes!("../weights/detector.safetensors");
        TrainedDetector::from_bytes(bytes).expect("a test reads the shipped weights")
    }

    /// Reads a safetensors file.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is damaged or holds weights of another network.
    pub fn from_bytes(bytes: &[u8]) -> Result<TrainedDetector, WeightsError> {
        TrainedDetector::from_bytes_with_detector(Detector::new(), bytes)
    }

    /// Reads a safetensors file of a network with other blocks.
    ///
    /// # Errors
    /// As [`TrainedDetector::from_bytes`].
    pub fn from_bytes_with_detector(
        detector: Detector,
        bytes: &[u8],
    ) -> Result<TrainedDetector, WeightsError> {
        let mut parameters = weights::from_bytes(&file_layout(&detector), bytes, &kind())?;
        let coefficients = parameters.split_off(detector.network.n_parameters());
        let coefficients = coefficients.try_into().expect("the layout ends with the calibration");
        Ok(TrainedDetector { detector, parameters, calibration: Calibration { coefficients } })
    }

    /// Writes a safetensors file.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&file_layout(&self.detector), &self.all_parameters(), &kind())
    }

    fn all_parameters(&self) -> Vec<f32> {
        self.parameters.iter().chain(&self.calibration.coefficients).copied().collect()
    }

    /// Returns the digest of the weights file, twelve hexadecimal digits.
    pub fn digest(&self) -> String {
        weights::digest_of(&file_layout(&self.detector), &self.all_parameters(), &kind())
    }

    /// Creates buffers for inference.
    pub fn inference(&self) -> Inference {
        Inference::new(&self.detector.network, &self.parameters, widest())
    }

    /// Returns whether both sides of the camera's image are multiples of the network's stride.
    pub fn fits(&self, camera: &Camera) -> bool {
        let stride = self.detector.network.stride() as u32;
        camera.width.is_multiple_of(stride) && camera.height.is_multiple_of(stride)
    }

    /// Detects instances in an image, in descending order of score: color (u8, shape [height,
    /// width, 3]) and depth (meters, shape [height, width]).
    ///
    /// # Panics
    /// If the shapes do not fit the camera, or the camera does not fit the network.
    pub fn detect(
        &self,
        rgb: &[u8],
        depth_m: &[f32],
        camera: &Camera,
        inference: &mut Inference,
    ) -> Vec<Instance> {
        let crop = ImageCrop::whole(camera);
        let [width, height] = crop.size;
        let shape = Shape { n: 1, height, width, channels: N_FEATURES };
        features(rgb, depth_m, camera, crop, inference.input(shape));
        let mut pixels = Pixels::new(camera);
        let read_rows = |_, row: usize, strip: &[f32]| pixels.read(row, strip, depth_m);
        inference.run(read_rows);
        let mut instances = pixels.instances(depth_m, &InstanceConfig::default());
        for instance in &mut instances {
            instance.score = self.calibration.probability(&predictors(instance));
        }
        instances.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.pixels[0].cmp(&b.pixels[0])));
        instances
    }
}
