//! A detector that has learned: its numbers, how its scores are made, and the file of both.

use chaic_core::ClassId;
use chaic_core::geom::Camera;
pub use chaic_nn::Inference;
use chaic_nn::simd::widest;
use chaic_nn::weights::WeightsError;
use chaic_nn::{Network, Shape, weights};

use crate::calibration::{Calibration, N_PREDICTORS, predictors};
use crate::detector::Detector;
use crate::features::{Crop, N_FEATURES, features};
use crate::instances::{Instance, InstanceRules, Pixels};

/// A trained detector.
#[derive(Clone, Debug)]
pub struct TrainedDetector {
    /// The network.
    pub detector: Detector,
    /// Its numbers.
    pub numbers: Vec<f32>,
    /// What scores are made by.
    pub calibration: Calibration,
}

/// What files of it say that they are: the version, and the digest of the classes that it knows.
fn kind() -> String {
    let names: Vec<&str> = ClassId::all().map(|class| class.name()).collect();
    format!("chaic detector 1, classes {}", weights::digest(names.join(" ").as_bytes()))
}

/// All that is in its file.
fn of_file(detector: &Detector) -> Network {
    let mut network = detector.network.clone();
    network.aside("calibration", N_PREDICTORS);
    network
}

impl TrainedDetector {
    /// With scores as they come.
    pub fn uncalibrated(detector: &Detector, numbers: &[f32]) -> TrainedDetector {
        let (detector, numbers) = (detector.clone(), numbers.to_vec());
        TrainedDetector { detector, numbers, calibration: Calibration::default() }
    }

    /// The one that comes with chaic: weights/README.md says how it was made and how good it is.
    pub fn built_in() -> TrainedDetector {
        let bytes = include_bytes!("../weights/detector.safetensors");
        TrainedDetector::from_bytes(bytes).expect("a test reads it")
    }

    /// From a safetensors file.
    ///
    /// # Errors
    /// [`WeightsError`] if it isn't a whole file of this network's weights.
    pub fn from_bytes(bytes: &[u8]) -> Result<TrainedDetector, WeightsError> {
        TrainedDetector::of_bytes(Detector::new(), bytes)
    }

    /// The same of another network.
    ///
    /// # Errors
    /// As [`TrainedDetector::from_bytes`].
    pub fn of_bytes(detector: Detector, bytes: &[u8]) -> Result<TrainedDetector, WeightsError> {
        let mut numbers = weights::from_bytes(&of_file(&detector), bytes, &kind())?;
        let factors = numbers.split_off(detector.network.n_numbers());
        let factors = factors.try_into().expect("the network ends with so many");
        Ok(TrainedDetector { detector, numbers, calibration: Calibration { factors } })
    }

    /// Returns it as a safetensors file.
    ///
    /// # Errors
    /// If a number is not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&of_file(&self.detector), &self.all_numbers(), &kind())
    }

    fn all_numbers(&self) -> Vec<f32> {
        self.numbers.iter().chain(&self.calibration.factors).copied().collect()
    }

    /// The first digits of the digest of its file, which name it.
    pub fn digest(&self) -> String {
        weights::digest_of(&of_file(&self.detector), &self.all_numbers(), &kind())
    }

    /// Working space for looking at images.
    pub fn inference(&self) -> Inference {
        Inference::new(&self.detector.network, &self.numbers, widest())
    }

    /// Whether it can look at images of this camera: sides are multiples of the network's stride.
    pub fn fits(&self, camera: &Camera) -> bool {
        let stride = self.detector.network.stride() as u32;
        camera.width.is_multiple_of(stride) && camera.height.is_multiple_of(stride)
    }

    /// What it sees in an image, surest first: color (u8, shape [height, width, 3]), depth (metres,
    /// shape [height, width]) and the camera.
    ///
    /// # Panics
    /// If shapes don't fit, or the camera doesn't.
    pub fn detect(
        &self,
        (rgb, depth_m, camera): (&[u8], &[f32], &Camera),
        inference: &mut Inference,
    ) -> Vec<Instance> {
        let crop = Crop::whole(camera);
        let [width, height] = crop.size;
        let shape = Shape { n: 1, height, width, channels: N_FEATURES };
        features(rgb, depth_m, camera, crop, inference.input(shape));
        let mut pixels = Pixels::new(camera);
        let take = |_, row: usize, strip: &[f32]| pixels.read(row, strip, depth_m);
        inference.run(take);
        let mut found = pixels.instances(depth_m, &InstanceRules::default());
        for instance in &mut found {
            instance.score = self.calibration.probability(&predictors(instance));
        }
        found.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.pixels[0].cmp(&b.pixels[0])));
        found
    }
}
