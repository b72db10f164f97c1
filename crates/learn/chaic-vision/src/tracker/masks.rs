//! Pixels that the static map leaves out: held objects and large movable ones, by their place instead of
//! their detected masks.

use chaic_agents::perception::PixelKind;
use chaic_core::geom::{Camera, Pose, rotate_yaw};
use chaic_core::{ClassId, Hand, Vec2, Vec3};

use super::plan_extent::PlanExtent;
use super::{Track, Tracker, extents_m, pixel_kind};

/// Half extents of an unknown object, meters. The detector once labeled a fire extinguisher, 1.06 m
/// high, as a pen.
const UNKNOWN_M: Vec3 = Vec3::new(0.25, 0.55, 0.25);

impl Tracker {
    /// Sets a mask where the image shows held objects, regardless of their detected class: shape
    /// [height / stride, width / stride], rounded up. An object may be larger than its detected class.
    /// In the static map, a held object would block the path wherever the agent goes.
    pub fn mask_held(
        &self,
        pose: Pose,
        depth_m: &[f32],
        camera: &Camera,
        stride: u32,
        mask: &mut [bool],
    ) {
        let boxes = self.held_boxes(UNKNOWN_M);
        if boxes.is_empty() {
            return;
        }
        let (width, stride) = (camera.width as usize, stride as usize);
        let max_distance_m =
            boxes.iter().map(|(at, half)| (*at + *half).length().max((*at - *half).length()));
        let max_distance_m = max_distance_m.fold(0.0, f32::max);
        let columns = width.div_ceil(stride);
        for (k, is_dynamic) in mask.iter_mut().enumerate() {
            let (x, y) = (stride * (k % columns), stride * (k / columns));
            let depth = depth_m[y * width + x];
            if depth < max_distance_m && !*is_dynamic {
                let point = camera.unproject(x as u32, y as u32, depth);
                *is_dynamic = is_within(&boxes, point, pose);
            }
        }
    }

    /// Sets a mask where the image shows points within large movable objects, also those that the
    /// detector missed: the static map would keep them after the object has moved. The shape is that
    /// of [`Tracker::mask_held`].
    pub fn mask_movables(&self, depth_m: &[f32], camera: &Camera, stride: u32, mask: &mut [bool]) {
        /// Distance around the extent in which points belong to the object, meters: points from above
        /// are 0.125 m apart.
        const MARGIN_M: f32 = 0.15;
        /// Points below are floor, meters.
        const FLOOR_M: f32 = 0.08;
        /// Points higher above the top of the object belong to a wall, meters.
        const TOP_MARGIN_M: f32 = 0.1;
        let is_known = |track: &&Track| {
            let is_movable = pixel_kind(track.label) == PixelKind::Movable;
            is_movable && !track.is_released && track.log_odds > self.config.report_log_odds
        };
        // A mask may miss the upper part.
        let top_m = |track: &Track| track.top_m.max(extents_m(track.label)[1]);
        let extent_and_top = |track: &Track| Some((track.extent?, top_m(track) + TOP_MARGIN_M));
        let extents: Vec<(PlanExtent, f32)> =
            self.tracks.iter().filter(is_known).filter_map(extent_and_top).collect();
        if extents.is_empty() {
            return;
        }
        let (width, stride) = (camera.width as usize, stride as usize);
        let columns = width.div_ceil(stride);
        for (k, is_dynamic) in mask.iter_mut().enumerate().filter(|(_, is_dynamic)| !**is_dynamic) {
            let (x, y) = (stride * (k % columns), stride * (k / columns));
            let point = camera.unproject(x as u32, y as u32, depth_m[y * width + x]);
            if point.y > FLOOR_M {
                let at = Vec2::new(point.x, point.z);
                *is_dynamic = extents
                    .iter()
                    .any(|(extent, top_m)| point.y < *top_m && extent.contains(at, MARGIN_M));
            }
        }
    }

    /// Boxes of held objects in the body's frame: centers and half extents, meters. Half extents without
    /// margin are at least `min_half_m`.
    pub(super) fn held_boxes(&self, min_half_m: Vec3) -> Vec<(Vec3, Vec3)> {
        /// Margin around the extents of the class, meters.
        const MARGIN_M: f32 = 0.1;
        /// Height of the contents above the center of their container, meters.
        const CONTENTS_M: f32 = 0.4;
        let half = |class: Option<ClassId>| {
            let size = class.map_or((2.0 * UNKNOWN_M).to_array(), |class| class.info().size_m);
            let across = 0.5 * size[0].max(size[2]);
            let half = Vec3::new(across, 0.5 * size[1], across);
            half.max(min_half_m) + Vec3::splat(MARGIN_M)
        };
        let height_m = self.height_m;
        if self.hands.is_joint {
            // In front of the body, at any height.
            let half = half(self.hands.held().next().and_then(|held| held.class()));
            let center = Vec3::new(0.0, 0.5 * height_m, -(0.3 + half.z));
            return vec![(center, Vec3::new(half.x, height_m, half.z + 0.3))];
        }
        let in_hand = |hand: Hand| {
            let held = self.hands.hands[hand.index()].as_ref()?;
            let side = if hand == Hand::Left { -1.0 } else { 1.0 };
            // Position of held objects, relative to the body's height.
            let center = Vec3::new(side * 0.2, 0.57 * height_m, -0.31 * height_m);
            // Contents stand out of their container.
            let above_m = if held.n_contents > 0 { 0.5 * CONTENTS_M } else { 0.0 };
            Some((center + above_m * Vec3::Y, half(held.class()) + above_m * Vec3::Y))
        };
        Hand::BOTH.into_iter().filter_map(in_hand).collect()
    }
}

/// Returns whether a point (world frame) lies inside one of the boxes (body frame).
pub(super) fn is_within(boxes: &[(Vec3, Vec3)], point: Vec3, body: Pose) -> bool {
    let p = rotate_yaw(point - body.position, -body.yaw_rad);
    boxes.iter().any(|(at, half)| (p - *at).abs().cmplt(*half).all())
}
