//! Keyframes: while the agent turns in place, the detector processes every third image. The others
//! reuse the detections of the last keyframe. If it shows a person, all images are processed.

use chaic_agents::perception::{Detection, Percepts, STRIDE};
use chaic_core::geom::{Pose, horizontal_distance, wrap_angle};
use chaic_core::{Action, Frame, Observation, Outcome, Vec3};

use crate::tracker::depths_at;

/// Maximum turn of the camera since the keyframe, radians: two turns of 15 degrees. The horizontal
/// field of view is 90 degrees, so each object is visible in two keyframes of a rotation in place.
const MAX_TURN_RAD: f32 = 0.55;
/// Maximum displacement of the camera since the keyframe, meters; a step is longer.
const MAX_STEP_M: f32 = 0.1;
/// Maximum time since the keyframe, frames: two turns.
const MAX_AGE: Frame = 4;

/// The last image that the detector processed.
#[derive(Clone, Debug)]
pub(crate) struct Keyframe {
    frame: Frame,
    pose: Pose,
    /// Detections, each with a visible point of its object.
    detections: Vec<(Detection, Vec3)>,
}

impl Keyframe {
    /// Creates a keyframe from an image with its detections.
    pub fn new(observation: &Observation, depth_m: &[f32], detections: &[Detection]) -> Keyframe {
        let camera = &observation.camera;
        let visible_point = |detection: &Detection| {
            let [column, row] = detection.pixel;
            let depth = depth_m[row as usize * camera.width as usize + column as usize];
            (detection.clone(), camera.unproject(column, row, depth))
        };
        Keyframe {
            frame: observation.frame,
            pose: observation.proprioception.pose,
            detections: detections.iter().map(visible_point).collect(),
        }
    }

    /// Returns whether an image is similar enough to reuse the detections: the agent has only turned
    /// since, and by less than the limits, and the keyframe shows no person. People walk, and crops of
    /// their behavior need their positions.
    pub fn is_similar(&self, observation: &Observation) -> bool {
        let own = &observation.proprioception;
        let has_turned =
            matches!(own.last, Some((Action::TurnLeft | Action::TurnRight, Outcome::Success)));
        let turn_rad = wrap_angle(own.pose.yaw_rad - self.pose.yaw_rad).abs();
        let step_m = horizontal_distance(own.pose.position, self.pose.position);
        let has_people = self.detections.iter().any(|(d, _)| d.person.is_some());
        has_turned
            && !has_people
            && turn_rad <= MAX_TURN_RAD
            && step_m <= MAX_STEP_M
            && observation.frame - self.frame <= MAX_AGE
    }

    /// Returns the detections whose objects are still visible in an image, at their new pixels. No pixel
    /// counts as static structure, since the masks of the objects are unknown.
    pub fn reuse(&self, observation: &Observation, depth_m: &[f32]) -> Percepts {
        /// Maximum difference between the depth of a point and that of the image, meters.
        const MAX_DEPTH_ERROR_M: f32 = 0.1;
        let camera = &observation.camera;
        let visible = |(detection, point): &(Detection, Vec3)| {
            let (pixel, depth, visible_m) = depths_at(*point, depth_m, camera)?;
            let is_visible = (visible_m - depth).abs() <= MAX_DEPTH_ERROR_M;
            is_visible.then(|| Detection { pixel, ..detection.clone() })
        };
        let n_samples = camera.width.div_ceil(STRIDE) * camera.height.div_ceil(STRIDE);
        Percepts {
            detections: self.detections.iter().filter_map(visible).collect(),
            dynamic_mask: vec![true; n_samples as usize],
            stride: STRIDE,
            is_reused: true,
            ..Percepts::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use chaic_agents::perception::SegmentMeasurement;
    use chaic_agents::track::TrackId;
    use chaic_core::geom::{Camera, forward, yaw_rotation};
    use chaic_core::observation::{GrantedInfo, Images, Proprioception};
    use chaic_core::{AgentId, ClassId, FailureReason};

    use super::*;

    const SIDE_PX: u32 = 64;
    const N_PX: usize = (SIDE_PX * SIDE_PX) as usize;
    const EYE_M: f32 = 1.5;

    /// Observation of an agent that has just turned.
    fn observation(yaw_rad: f32, position: Vec3, frame: Frame) -> Observation {
        Observation {
            frame,
            proprioception: Proprioception {
                pose: Pose { position, yaw_rad },
                hands: [None, None],
                last: Some((Action::TurnLeft, Outcome::Success)),
                other_end: None,
            },
            camera: Camera {
                eye_in_world: position + Vec3::Y * EYE_M,
                world_from_camera: yaw_rotation(yaw_rad),
                vertical_fov_rad: Camera::EYE_FOV_RAD,
                width: SIDE_PX,
                height: SIDE_PX,
            },
            images: Images::default(),
            frame_history: Vec::new(),
            granted: GrantedInfo::default(),
        }
    }

    fn detection(class: &str, person: Option<AgentId>, pixel: [u32; 2]) -> Detection {
        let measurement = SegmentMeasurement {
            pixel,
            position_in_world: Vec3::ZERO,
            bottom_m: 0.0,
            top_m: 1.0,
            n_pixels: 100,
            footprint: Vec::new(),
        };
        Detection::new(TrackId(7), ClassId::named(class), person, measurement)
    }

    /// Keyframe of a detection in the middle of a wall at 3 m.
    fn keyframe(class: &str, person: Option<AgentId>) -> Keyframe {
        let middle = [SIDE_PX / 2; 2];
        let start = observation(0.0, Vec3::ZERO, 0);
        Keyframe::new(&start, &[3.0; N_PX], &[detection(class, person, middle)])
    }

    #[test]
    fn images_are_similar_within_the_limits_after_turns_only() {
        let seen = keyframe("apple", None);
        let here = observation(0.0, Vec3::ZERO, 2);
        assert!(seen.is_similar(&here));
        let turned = |rad: f32| seen.is_similar(&observation(rad, Vec3::ZERO, 2));
        let step_rad = PI / 12.0;
        assert_eq!(
            [2.0, -2.0, 3.0, -3.0].map(|n| turned(n * step_rad)),
            [true, true, false, false]
        );
        assert!(turned(2.0 * PI), "a whole turn shows the same");
        let moved = |x: f32| seen.is_similar(&observation(0.0, forward(0.0) * x * MAX_STEP_M, 2));
        assert_eq!([0.99, 1.01].map(moved), [true, false]);
        let later = |frame: Frame| seen.is_similar(&observation(0.0, Vec3::ZERO, frame));
        assert_eq!([MAX_AGE, MAX_AGE + 1].map(later), [true, false]);
        for last in [
            None,
            Some((Action::TurnLeft, Outcome::Failure(FailureReason::Blocked))),
            Some((Action::MoveForward, Outcome::Success)),
            Some((Action::Wait { frames: 1 }, Outcome::Success)),
            Some((Action::PutIn, Outcome::Success)),
        ] {
            let mut other = here.clone();
            other.proprioception.last = last;
            assert!(!seen.is_similar(&other), "{last:?}");
        }
        assert!(!keyframe("person", Some(AgentId::PARTNER)).is_similar(&here));
    }

    #[test]
    fn detections_are_reused_at_their_new_pixels_while_they_are_visible() {
        let seen = keyframe("apple", None);
        let pixels = |yaw_rad: f32, depth_m: f32| -> Vec<[u32; 2]> {
            let percepts = seen.reuse(&observation(yaw_rad, Vec3::ZERO, 2), &[depth_m; N_PX]);
            assert_eq!(percepts.dynamic_mask.len(), (SIDE_PX.div_ceil(STRIDE) as usize).pow(2));
            assert!(percepts.dynamic_mask.iter().all(|is_dynamic| *is_dynamic));
            percepts.detections.iter().map(|d| d.pixel).collect()
        };
        assert_eq!(pixels(0.0, 3.0), [[SIDE_PX / 2; 2]]);
        // Depth along the new axis is smaller by the cosine of the turn.
        let [column, row] = pixels(0.2, 2.94)[0];
        assert!((37..=40).contains(&column) && row == SIDE_PX / 2, "{column}, {row}");
        let [column, _] = pixels(-0.2, 2.94)[0];
        assert!((24..=27).contains(&column), "{column}");
        assert!(pixels(0.9, 3.0).is_empty(), "outside of the image");
        assert!(pixels(0.0, 2.0).is_empty(), "occluded");
        assert!(pixels(0.0, 4.0).is_empty(), "gone");
        assert!(pixels(0.0, f32::NAN).is_empty(), "without depth");
    }
}
