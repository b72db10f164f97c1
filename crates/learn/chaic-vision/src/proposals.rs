//! Proposals of objects: segments of several groupings of the same pixels, without duplicates. The
//! second stage of the detector decides which of them are objects.

use crate::instances::{InstanceConfig, Pixels, Segment};

/// Maximum number of proposals of an image.
pub const MAX_PROPOSALS: usize = 64;
/// Proposals with a greater intersection over union (IoU) are duplicates.
const DUPLICATE_IOU: f32 = 0.9;

/// Groupings whose segments are proposals, in order of precedence.
pub const GROUPINGS: [InstanceConfig; 6] = [
    InstanceConfig::DEFAULT,
    // Neighbors of one class that stand close together.
    InstanceConfig {
        center_vote_radius: 0.35,
        join_extents: 0.4,
        relabel_extents: 0.3,
        ..InstanceConfig::DEFAULT
    },
    // Objects that fall apart into several votes or labels.
    InstanceConfig {
        center_vote_radius: 1.6,
        join_extents: 1.8,
        relabel_extents: 1.2,
        ..InstanceConfig::DEFAULT
    },
    // Structures that are larger than their class, such as fences.
    InstanceConfig {
        center_vote_radius: f32::INFINITY,
        join_extents: 0.0,
        relabel_extents: 0.0,
        ..InstanceConfig::DEFAULT
    },
    // Objects with several labels and one center.
    InstanceConfig {
        center_vote_radius: 0.6,
        join_extents: 0.6,
        relabel_extents: 0.6,
        ignores_labels: true,
        ..InstanceConfig::DEFAULT
    },
    // Objects that stand apart from others.
    InstanceConfig {
        gap_extents: 0.2,
        center_vote_radius: f32::INFINITY,
        join_extents: 0.0,
        relabel_extents: 0.0,
        ignores_labels: true,
        ..InstanceConfig::DEFAULT
    },
];

/// Returns the proposals of an image, at most [`MAX_PROPOSALS`]; pixels of a segment are in
/// ascending order.
pub fn proposals(pixels: &Pixels) -> Vec<Segment> {
    let n_pixels = pixels.pixels().len();
    let mut kept: Vec<Segment> = Vec::new();
    // For each grouping, the proposal that owns each pixel.
    let mut owners: Vec<Vec<u16>> = Vec::new();
    let objects = pixels.object_pixels();
    for config in &GROUPINGS {
        if kept.len() == MAX_PROPOSALS {
            break;
        }
        let mut owner = vec![u16::MAX; n_pixels];
        for mut segment in pixels.segments_among(&objects, config) {
            if kept.len() == MAX_PROPOSALS || is_duplicate(&segment, &kept, &owners) {
                continue;
            }
            segment.pixels.sort_unstable();
            segment.pixels.iter().for_each(|k| owner[*k as usize] = kept.len() as u16);
            kept.push(segment);
        }
        owners.push(owner);
    }
    kept
}

fn is_duplicate(segment: &Segment, kept: &[Segment], owners: &[Vec<u16>]) -> bool {
    owners.iter().any(|owner| {
        let mut shared = vec![0u32; kept.len()];
        for k in &segment.pixels {
            if let Some(n) = shared.get_mut(usize::from(owner[*k as usize])) {
                *n += 1;
            }
        }
        shared.iter().zip(kept).any(|(shared, other)| {
            let union = segment.pixels.len() + other.pixels.len() - *shared as usize;
            *shared as f32 > DUPLICATE_IOU * union as f32
        })
    })
}
