//! Tracks that an image does not show: their pixels, and the evidence against them.

use chaic_agents::perception::OBJECT_RANGE_M;
use chaic_agents::track::TrackId;
use chaic_core::Frame;
use chaic_core::geom::Camera;

use super::{Track, Tracker, depths_at, extents_m};

/// Minimum tolerance of the depth of an object, meters: the depths of its points differ.
const MIN_DEPTH_ERROR_M: f32 = 0.05;

impl Tracker {
    /// Returns one pixel of each track that was missed in this image although the depth at its place
    /// is that of the object. An action can target the object by this pixel, as by a detection.
    pub fn missed(&self, now: Frame, depth_m: &[f32], camera: &Camera) -> Vec<(TrackId, [u32; 2])> {
        let is_missed =
            |t: &&Track| t.last_seen < now && t.is_at_rest() && !self.held.contains(&t.id);
        let pixel = |track: &Track| {
            let (pixel, depth, visible_m) = depths_at(track.position, depth_m, camera)?;
            let thickness_m = extents_m(track.label).into_iter().fold(f32::MAX, f32::min);
            let is_there = (visible_m - depth).abs() <= (0.5 * thickness_m).max(MIN_DEPTH_ERROR_M);
            is_there.then_some((track.id, pixel))
        };
        self.tracks.iter().filter(is_missed).filter_map(pixel).collect()
    }

    /// Returns the reported tracks that probably do not exist. They count as unreported until they are
    /// detected again.
    pub fn take_retracted(&mut self) -> Vec<TrackId> {
        let mut retracted = Vec::new();
        for track in &mut self.tracks {
            if track.is_reported && track.log_odds < 0.0 {
                track.is_reported = false;
                retracted.push(track.id);
            }
        }
        retracted
    }

    /// Lowers the log odds of tracks that are not detected although their place is visible. An image
    /// says nothing about objects that may be elsewhere (carried, or just released), that a larger mask
    /// contains, or that are beyond the range of detections or at its border.
    pub(super) fn penalize_missing(&mut self, now: Frame, depth_m: &[f32], camera: &Camera) {
        /// Objects nearer by more than this occlude the place, meters.
        const OCCLUSION_MARGIN_M: f32 = 0.1;
        /// Objects with fewer expected pixels may be missed by the detector.
        const MIN_EXPECTED_PX: f32 = 100.0;
        let focal_px = camera.focal_px();
        let (min_log_odds, decrease) = (self.config.log_odds_range[0], self.config.miss_log_odds);
        for track in &mut self.tracks {
            let shown = track.last_seen.max(track.last_covered);
            let is_repeated = self.repeated.is_some_and(|frame| shown < frame);
            let may_be_elsewhere = !track.is_at_rest() || self.held.contains(&track.id);
            if shown >= now || is_repeated || may_be_elsewhere {
                continue;
            }
            let Some((pixel, depth, visible_m)) = depths_at(track.position, depth_m, camera) else {
                continue;
            };
            let is_detectable = depth < OBJECT_RANGE_M && !is_at_border(pixel, camera);
            let mut extents = extents_m(track.label);
            extents.sort_by(f32::total_cmp);
            let expected_px = extents[0] * extents[1] * (focal_px / depth) * (focal_px / depth);
            let is_visible = visible_m > depth - OCCLUSION_MARGIN_M;
            if is_detectable && is_visible && expected_px > MIN_EXPECTED_PX {
                track.log_odds = (track.log_odds - decrease).max(min_log_odds);
            }
        }
    }
}

/// True if the border of the image may cut an object around a pixel.
fn is_at_border(pixel: [u32; 2], camera: &Camera) -> bool {
    /// Width of the border as a fraction of the image's width, as in the helper's memory.
    const BORDER: f32 = 0.08;
    let margin = BORDER * camera.width as f32;
    let is_near = |at: u32, size: u32| {
        let at = at as f32 + 0.5;
        at < margin || at > size as f32 - margin
    };
    is_near(pixel[0], camera.width) || is_near(pixel[1], camera.height)
}
