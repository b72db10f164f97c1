//! Trained detector: parameters, score calibration, and their file.

use chaic_core::ClassId;
use chaic_core::geom::Camera;
use chaic_nn::simd::widest;
use chaic_nn::weights::WeightsError;
use chaic_nn::{Inference, Network, Shape, weights};

use crate::calibration::{Calibration, N_PREDICTORS, predictors};
use crate::detector::Detector;
use crate::features::{ImageCrop, N_FEATURES, features};
use crate::instances::{
    Instance, InstanceConfig, Pixels, Segment, remove_background, sort_by_score,
};
use crate::proposals::proposals;
use crate::roi::RoiSource;
use crate::roi_network::RoiNetwork;
use crate::second_stage::{SecondStage, SecondStageInference};

/// A trained detector.
#[derive(Clone, Debug)]
pub struct TrainedDetector {
    /// Network of the first stage.
    pub detector: Detector,
    /// Parameters of the first stage.
    pub parameters: Vec<f32>,
    /// The second stage; without it, segments of the first stage are instances.
    pub second_stage: Option<SecondStage>,
    /// Calibration of scores.
    pub calibration: Calibration,
}

/// Prefix of the second stage's parameters in weights files, and of its sections in checkpoints.
pub(crate) const SECOND_STAGE: &str = "roi.";

/// Returns the kind in weights files: format version, number of stages, and digest of the classes.
fn kind(n_stages: usize) -> String {
    let names: Vec<&str> = ClassId::all().map(|class| class.name()).collect();
    format!("chaic detector {n_stages}, classes {}", weights::digest(names.join(" ").as_bytes()))
}

/// Returns the parameters of both stages as those of one network.
pub(crate) fn both_stages(detector: &Detector, second_stage: &RoiNetwork) -> Network {
    let mut network = detector.network.clone();
    network.append_parameters(SECOND_STAGE, &second_stage.network);
    network
}

/// Returns the layout of a file: network parameters and calibration.
fn file_layout(detector: &Detector, second_stage: Option<&RoiNetwork>) -> Network {
    let mut network = match second_stage {
        Some(second_stage) => both_stages(detector, second_stage),
        None => detector.network.clone(),
    };
    network.extra_parameters("calibration", N_PREDICTORS);
    network
}

/// Buffers for inference.
#[derive(Clone, Debug)]
pub struct DetectorInference {
    first_stage: Inference,
    second_stage: Option<SecondStageInference>,
}

impl TrainedDetector {
    /// Creates a detector of one stage without score calibration.
    pub fn uncalibrated(detector: &Detector, parameters: &[f32]) -> TrainedDetector {
        TrainedDetector {
            detector: detector.clone(),
            parameters: parameters.to_vec(),
            second_stage: None,
            calibration: Calibration::default(),
        }
    }

    /// Returns the detector that is part of chaic; weights/README.md documents its training and
    /// accuracy.
    pub fn built_in() -> TrainedDetector {
        let bytes = include_bytes!("../weights/detector.safetensors");
        TrainedDetector::from_bytes(bytes).expect("a test reads the bundled weights")
    }

    /// Reads a safetensors file of a detector with one or two stages.
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
        let has_second_stage = weights::kind(bytes)? != kind(1);
        let network = has_second_stage.then(RoiNetwork::new);
        let layout = file_layout(&detector, network.as_ref());
        let n_stages = 1 + usize::from(has_second_stage);
        let mut parameters = weights::from_bytes(&layout, bytes, &kind(n_stages))?;
        let coefficients = parameters.split_off(parameters.len() - N_PREDICTORS);
        let coefficients = coefficients.try_into().expect("the layout ends with the calibration");
        let others = parameters.split_off(detector.network.n_parameters());
        let second_stage = network.map(|network| SecondStage { network, parameters: others });
        let calibration = Calibration { coefficients };
        Ok(TrainedDetector { detector, parameters, second_stage, calibration })
    }

    /// Writes a safetensors file.
    ///
    /// # Errors
    /// If a parameter is not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&self.file_layout(), &self.all_parameters(), &self.kind())
    }

    fn file_layout(&self) -> Network {
        file_layout(&self.detector, self.second_stage.as_ref().map(|stage| &stage.network))
    }

    fn kind(&self) -> String {
        kind(1 + usize::from(self.second_stage.is_some()))
    }

    fn all_parameters(&self) -> Vec<f32> {
        let second_stage = self.second_stage.iter().flat_map(|stage| &stage.parameters);
        let parameters = self.parameters.iter().chain(second_stage);
        parameters.chain(&self.calibration.coefficients).copied().collect()
    }

    /// Returns the digest of the weights file, twelve hexadecimal digits.
    pub fn digest(&self) -> String {
        weights::digest_of(&self.file_layout(), &self.all_parameters(), &self.kind())
    }

    /// Creates buffers for inference.
    pub fn inference(&self) -> DetectorInference {
        let first_stage = Inference::new(&self.detector.network, &self.parameters, widest());
        let second_stage = self.second_stage.as_ref().map(SecondStage::inference);
        DetectorInference { first_stage, second_stage }
    }

    /// Returns the stride of the network: width and height of images must be multiples of it, pixels.
    pub fn image_step(&self) -> u32 {
        self.detector.network.stride() as u32
    }

    /// Returns whether both sides of the camera's image are positive multiples of
    /// [`Self::image_step`].
    pub fn fits(&self, camera: &Camera) -> bool {
        let step = self.image_step();
        [camera.width, camera.height].iter().all(|side| *side > 0 && side.is_multiple_of(step))
    }

    /// Detects instances in an image, in descending order of score: color (u8, shape [height,
    /// width, 3]) and depth (meters, shape [height, width]). Pixels whose depth is not finite
    /// count as the far plane, and no mask but that of a fence contains them.
    ///
    /// # Panics
    /// As [`TrainedDetector::first_stage`].
    pub fn detect(
        &self,
        rgb: &[u8],
        depth_m: &[f32],
        camera: &Camera,
        inference: &mut DetectorInference,
    ) -> Vec<Instance> {
        let pixels = self.first_stage(rgb, depth_m, camera, inference);
        match self.second_stage {
            Some(_) => self.instances_among(&pixels, &proposals(&pixels), depth_m, inference),
            None => {
                let instances = pixels.instances(depth_m, &InstanceConfig::DEFAULT);
                self.with_scores(instances, depth_m, camera)
            }
        }
    }

    /// Returns the predictions of the first stage for an image, as in [`TrainedDetector::detect`].
    ///
    /// # Panics
    /// If the shapes do not fit the camera, or the camera does not fit the network.
    pub fn first_stage(
        &self,
        rgb: &[u8],
        depth_m: &[f32],
        camera: &Camera,
        inference: &mut DetectorInference,
    ) -> Pixels {
        let (width, height, step) = (camera.width, camera.height, self.image_step());
        assert!(self.fits(camera), "{width} x {height} pixels are not multiples of {step}");
        let n_pixels = width as usize * height as usize;
        let is_complete = rgb.len() == 3 * n_pixels && depth_m.len() == n_pixels;
        assert!(is_complete, "color or depth do not have the camera's {width} x {height} pixels");
        first_stage_pixels(rgb, depth_m, camera, &mut inference.first_stage)
    }

    /// Returns the instances among proposals, in descending order of score; none without a second
    /// stage. `inference` and `pixels` must come from the last call of
    /// [`TrainedDetector::first_stage`].
    pub fn instances_among(
        &self,
        pixels: &Pixels,
        proposals: &[Segment],
        depth_m: &[f32],
        inference: &mut DetectorInference,
    ) -> Vec<Instance> {
        let DetectorInference { first_stage, second_stage } = inference;
        let (Some(stage), Some(buffers)) = (&self.second_stage, second_stage) else {
            return Vec::new();
        };
        let source = RoiSource { features: first_stage.last_input(), pixels };
        let instances = stage.instances(&source, proposals, depth_m, buffers);
        self.with_scores(instances, depth_m, pixels.camera())
    }

    /// Removes the background from instances, calibrates their scores and sorts them.
    fn with_scores(
        &self,
        mut instances: Vec<Instance>,
        depth_m: &[f32],
        camera: &Camera,
    ) -> Vec<Instance> {
        for instance in &mut instances {
            remove_background(instance, depth_m, camera);
        }
        instances.retain(|instance| !instance.pixels.is_empty());
        for instance in &mut instances {
            for (_, score) in &mut instance.names {
                let predictors = predictors(*score, instance.pixels.len(), instance.center);
                *score = self.calibration.probability(&predictors);
            }
        }
        sort_by_score(&mut instances);
        instances
    }
}

/// Runs the first stage on an image.
pub(crate) fn first_stage_pixels(
    rgb: &[u8],
    depth_m: &[f32],
    camera: &Camera,
    inference: &mut Inference,
) -> Pixels {
    let crop = ImageCrop::whole(camera);
    let [width, height] = crop.size;
    let shape = Shape { n: 1, height, width, channels: N_FEATURES };
    features(rgb, depth_m, camera, crop, inference.input(shape));
    let mut pixels = Pixels::new(camera);
    inference.run(|_, row: usize, strip: &[f32]| pixels.read(row, strip, depth_m));
    pixels
}

#[cfg(test)]
mod tests;
