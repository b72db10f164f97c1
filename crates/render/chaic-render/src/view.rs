//! Cameras and what they ask for.

use std::cell::RefCell;

use chaic_core::capability::Sight;
use chaic_core::geom::Camera;
use chaic_core::observation::{Images, Senses};
use chaic_core::{AgentId, EntityId};
use chaic_world::World;

use crate::draw::{Omit, Scratch, draw};
use crate::frame::Frame;
use crate::lens::{Lens, reciprocal, seen_depth_m};
use crate::raster::{LANES, Target, Wide};
use crate::shade::{Drawn, Wanted, shade};
use crate::sight::limit_vision;

/// Longest side of an image, pixels: bounds the memory that one view can ask for to 1.5 GB.
pub const MAX_SIDE_PX: u32 = 8192;

/// Which images a view is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channels {
    /// Color.
    pub rgb: bool,
    /// Depth along the camera's axis.
    pub depth: bool,
    /// Instance ids.
    pub ids: bool,
}

impl Channels {
    /// All three.
    pub const ALL: Channels = Channels { rgb: true, depth: true, ids: true };
    /// Color only.
    pub const RGB: Channels = Channels { rgb: true, depth: false, ids: false };
    /// All but color, which costs the most.
    pub const DEPTH_AND_IDS: Channels = Channels { rgb: false, depth: true, ids: true };
}

impl From<Senses> for Channels {
    fn from(senses: Senses) -> Channels {
        Channels { rgb: senses.rgb, depth: senses.depth, ids: senses.ids }
    }
}

/// A camera, and what is wanted of it.
///
/// A camera whose numbers make no picture (not finite, no angle of view) sees nothing at all: sky,
/// far, no ids. One with a side over [`MAX_SIDE_PX`] gets no images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Which images.
    pub channels: Channels,
    /// Whose body is left out: an eye doesn't see its own head from inside.
    pub hide: Option<AgentId>,
    /// Whether ceilings are left out, to look into a house from above.
    pub hide_ceiling: bool,
    /// How far and how sharply it is seen, if not as by a camera.
    pub sight: Option<Sight>,
}

impl View {
    /// What a camera sees, with everybody and everything.
    pub fn of_camera(camera: Camera, channels: Channels) -> View {
        View { camera, channels, hide: None, hide_ceiling: false, sight: None }
    }

    /// What the agent whose eye this is would see if it saw as far and as sharply as a camera.
    pub fn of_eye(agent: AgentId, camera: Camera, channels: Channels) -> View {
        View { hide: Some(agent), ..View::of_camera(camera, channels) }
    }

    /// What an agent sees, in an image of this side in pixels.
    pub fn of_agent(world: &World, agent: AgentId, size_px: u32, channels: Channels) -> View {
        let sight = world.sight(agent);
        View { sight, ..View::of_eye(agent, world.eye(agent, size_px), channels) }
    }

    /// What is left out of it.
    pub(crate) fn omit(&self) -> Omit {
        Omit { body: self.hide.map(EntityId::of_agent), ceiling: self.hide_ceiling }
    }
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Runs `work` with this thread's buffers.
pub(crate) fn with_scratch<T>(work: impl FnOnce(&mut Scratch) -> T) -> T {
    SCRATCH.with(|scratch| match scratch.try_borrow_mut() {
        Ok(mut scratch) => work(&mut scratch),
        Err(_) => work(&mut Scratch::default()),
    })
}

/// Calls `look` once for each width of vectors that this machine has, by name, and for none
/// (`scalar`). Meanwhile this thread draws single views for that width. Pictures don't depend on it:
/// this is for those who check that.
pub fn with_each_width(mut look: impl FnMut(&str)) {
    let usual = with_scratch(|s| s.work.arch);
    for (name, arch) in widths() {
        with_scratch(|s| s.work.arch = arch);
        look(name);
    }
    with_scratch(|s| s.work.arch = usual);
}

/// What inner loops can be compiled for that this machine runs.
fn widths() -> Vec<(&'static str, pulp::Arch)> {
    let mut widths = vec![("scalar", pulp::Arch::Scalar)];
    #[cfg(target_arch = "x86_64")]
    {
        widths.extend(pulp::x86::V3::try_new().map(|v3| ("x86-64-v3", pulp::Arch::V3(v3))));
        widths.extend(pulp::x86::V4::try_new().map(|v4| ("x86-64-v4", pulp::Arch::V4(v4))));
    }
    #[cfg(not(target_arch = "x86_64"))]
    widths.push(("widest", pulp::Arch::new()));
    widths
}

/// Buffers for the images of one view, all of them the caller's. Those that are absent aren't made.
#[derive(Debug, Default)]
pub struct ImagesMut<'a> {
    /// RGB, shape [height, width, 3], as in [`Images::rgb`].
    pub rgb: Option<&'a mut [u8]>,
    /// Depth in metres, shape [height, width], as in [`Images::depth_m`].
    pub depth_m: Option<&'a mut [f32]>,
    /// Instance ids, shape [height, width], as in [`Images::ids`].
    pub ids: Option<&'a mut [u16]>,
}

impl ImagesMut<'_> {
    /// Whether each buffer is as long as a camera of `n` pixels needs.
    fn fits(&self, n: usize) -> bool {
        self.rgb.as_ref().is_none_or(|b| b.len() == 3 * n)
            && self.depth_m.as_ref().is_none_or(|b| b.len() == n)
            && self.ids.as_ref().is_none_or(|b| b.len() == n)
    }
}

/// Draws one view, into images whose memory is used again.
pub(crate) fn draw_view(frame: &Frame, view: &View, images: &mut Images) {
    let Camera { width, height, .. } = view.camera;
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        *images = Images::default();
        return;
    }
    let n = width as usize * height as usize;
    let Channels { rgb, depth, ids } = view.channels;
    let images = ImagesMut {
        rgb: sized(&mut images.rgb, rgb, 3 * n),
        depth_m: sized(&mut images.depth_m, depth, n),
        ids: sized(&mut images.ids, ids, n),
    };
    draw_view_into(frame, view, images);
}

/// Draws one view into buffers of the caller's; which images are made depends on which are there.
///
/// # Panics
/// If a buffer has another length than the camera's images.
pub(crate) fn draw_view_into(frame: &Frame, view: &View, images: ImagesMut<'_>) {
    let n = view.camera.width as usize * view.camera.height as usize;
    assert!(images.fits(n), "buffers of another length than the {n} pixels of the view");
    if let Some(sight) = &view.sight {
        let mut whole = View { sight: None, ..*view };
        whole.channels.depth = true;
        let ImagesMut { mut rgb, depth_m, mut ids } = images;
        let mut own_depth_m = vec![0.0; if depth_m.is_some() { 0 } else { n }];
        let depth_m = depth_m.unwrap_or(&mut own_depth_m);
        let all = ImagesMut {
            rgb: rgb.as_deref_mut(),
            depth_m: Some(&mut *depth_m),
            ids: ids.as_deref_mut(),
        };
        draw_view_into(frame, &whole, all);
        limit_vision(sight, &view.camera, rgb, depth_m, ids);
        return;
    }
    let ImagesMut { rgb, depth_m, ids } = images;
    let Some(lens) = Lens::of(&view.camera).filter(|_| n > 0) else {
        rgb.into_iter().for_each(|b| b.fill(0));
        depth_m.into_iter().for_each(|b| b.fill(Camera::FAR_M));
        ids.into_iter().for_each(|b| b.fill(EntityId::NOTHING.0));
        return;
    };
    with_scratch(|scratch| {
        let omit = view.omit();
        let Scratch { target, plain, work, canvas } = scratch;
        if let Some(rgb) = rgb {
            draw(frame, &lens, omit, target, work);
            let wanted = Wanted { rgb, depth_m, ids };
            shade(frame, &lens, &Drawn::of(work), target, canvas, wanted);
            return;
        }
        draw(frame, &lens, omit, plain, work);
        work.arch.dispatch(ReadBack { target: plain, depth_m, ids });
    });
}

/// Copies depths and ids out, compiled for each kind of vectors and called for the widest that the
/// machine has.
struct ReadBack<'a> {
    target: &'a Target<u16>,
    depth_m: Option<&'a mut [f32]>,
    ids: Option<&'a mut [u16]>,
}

impl pulp::NullaryFnOnce for ReadBack<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let ReadBack { target, depth_m, ids } = self;
        if let Some(depth_m) = depth_m {
            target.copy_inverse_depth(depth_m, seen_depths_m);
        }
        if let Some(ids) = ids {
            target.copy_visibility_ids(ids);
        }
    }
}

/// What an eye sees of a block's inverse depths, metres. A function by name: a closure would be
/// compiled apart, without this machine's vectors.
#[inline(always)]
fn seen_depths_m(inverse_depth: &Wide<f32>) -> [f32; LANES] {
    let mut depth_m = [0.0; LANES];
    for k in 0..LANES {
        depth_m[k] = seen_depth_m(reciprocal(inverse_depth[k]));
    }
    depth_m
}

/// An image of `n` numbers, if it is wanted; what is in it is whatever was there.
fn sized<T: Clone + Default>(
    image: &mut Option<Vec<T>>,
    wanted: bool,
    n: usize,
) -> Option<&mut [T]> {
    if !wanted {
        *image = None;
        return None;
    }
    let image = image.get_or_insert_default();
    image.resize(n, T::default());
    Some(image)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;
    use chaic_test_kit::scenes::{camera, house, street, world};

    fn looked_at(color: bool) -> Vec<Images> {
        let mut all = Vec::new();
        for (setup, eye, yaw) in
            [(house(), [0.6, 1.65, 2.2], -1.57), (street(), [9.0, 1.65, 0.0], 1.3)]
        {
            let world = world(setup);
            let scene = Scene::new(world.setup());
            let channels = if color { Channels::ALL } else { Channels::DEPTH_AND_IDS };
            let camera = camera(eye, yaw, -0.1, 203, 149);
            let view = View::of_camera(camera, channels);
            all.extend(scene.render(&world, &[view]));
        }
        all
    }

    #[test]
    fn images_are_the_same_bits_with_vectors_of_any_width() {
        for color in [true, false] {
            let usual = looked_at(color);
            with_each_width(|width| {
                assert!(looked_at(color) == usual, "{width}, color {color}");
            });
        }
    }
}
