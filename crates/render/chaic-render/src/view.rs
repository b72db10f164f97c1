//! Views: a camera and the images that it renders.

use std::cell::RefCell;

use chaic_core::capability::Eyesight;
use chaic_core::geom::Camera;
use chaic_core::observation::{Images, SensorConfig};
use chaic_core::{AgentId, EntityId};
use chaic_world::World;

use crate::draw::{Exclusions, Scratch, draw};
use crate::projection::{Projection, clamp_depth_m, reciprocal};
use crate::raster::{Block32, LANES, RenderTarget};
use crate::scene_frame::SceneFrame;
use crate::shade::{OutputImages, shade};
use crate::vision_limits::limit_vision;

/// Longest side of an image, pixels. It limits the memory of one view to 1.5 GB.
pub const MAX_SIDE_PX: u32 = 8192;

/// Image channels that a view renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channels {
    /// RGB color.
    pub rgb: bool,
    /// Depth along the camera axis.
    pub depth: bool,
    /// Instance ids.
    pub ids: bool,
}

impl Channels {
    /// All three channels.
    pub const ALL: Channels = Channels { rgb: true, depth: true, ids: true };
    /// Color only.
    pub const RGB: Channels = Channels { rgb: true, depth: false, ids: false };
    /// Depth and ids without color, which costs the most.
    pub const DEPTH_AND_IDS: Channels = Channels { rgb: false, depth: true, ids: true };
}

impl From<SensorConfig> for Channels {
    fn from(sensors: SensorConfig) -> Channels {
        Channels { rgb: sensors.rgb, depth: sensors.depth, ids: sensors.ids }
    }
}

/// A camera and the channels that it renders.
///
/// An invalid camera (not finite, or without a field of view) renders nothing: black, maximum
/// depth, no ids. A camera with a side over [`MAX_SIDE_PX`] gets no images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Channels to render.
    pub channels: Channels,
    /// Agent whose body is not drawn: an eye does not see the inside of its own head.
    pub hide: Option<AgentId>,
    /// Hides ceilings, to look into a house from above.
    pub hide_ceiling: bool,
    /// Limits of range, sharpness and field of view; `None` for a perfect camera.
    pub sight: Option<Eyesight>,
}

impl View {
    /// View of a camera that hides nothing.
    pub fn from_camera(camera: Camera, channels: Channels) -> View {
        View { camera, channels, hide: None, hide_ceiling: false, sight: None }
    }

    /// View from the eye of an agent, without the limits of its vision.
    pub fn from_eye(agent: AgentId, camera: Camera, channels: Channels) -> View {
        View { hide: Some(agent), ..View::from_camera(camera, channels) }
    }

    /// View from the eye of an agent with the limits of its vision, in a square image of `size_px`
    /// pixels.
    pub fn from_agent(world: &World, agent: AgentId, size_px: u32, channels: Channels) -> View {
        let sight = world.eyesight(agent);
        View { sight, ..View::from_eye(agent, world.camera(agent, size_px), channels) }
    }

    /// Returns the parts of the scene that the view leaves out.
    pub(crate) fn exclusions(&self) -> Exclusions {
        Exclusions { body: self.hide.map(EntityId::from_agent), ceiling: self.hide_ceiling }
    }
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Runs `work` with the buffers of this thread.
pub(crate) fn with_scratch<T>(work: impl FnOnce(&mut Scratch) -> T) -> T {
    SCRATCH.with(|scratch| match scratch.try_borrow_mut() {
        Ok(mut scratch) => work(&mut scratch),
        Err(_) => work(&mut Scratch::default()),
    })
}

/// Calls `check` once for each vector width of this machine, and once for scalar code, with the
/// name of the width. During the call, this thread renders single views with that width. Images do
/// not depend on the width; tests use this function to check that.
pub fn with_each_width(mut check: impl FnMut(&str)) {
    let original = with_scratch(|s| s.buffers.arch);
    for (name, arch) in widths() {
        with_scratch(|s| s.buffers.arch = arch);
        check(name);
    }
    with_scratch(|s| s.buffers.arch = original);
}

/// Vector widths that this machine supports.
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

/// Caller-owned buffers for the images of one view. A missing buffer means that the image is not
/// rendered.
#[derive(Debug, Default)]
pub struct ImagesMut<'a> {
    /// RGB, u8, shape [height, width, 3], as in [`Images::rgb`].
    pub rgb: Option<&'a mut [u8]>,
    /// Depth in meters, f32, shape [height, width], as in [`Images::depth_m`].
    pub depth_m: Option<&'a mut [f32]>,
    /// Instance ids, u16, shape [height, width], as in [`Images::ids`].
    pub ids: Option<&'a mut [u16]>,
}

impl ImagesMut<'_> {
    /// Returns whether each buffer has the length for a camera of `n` pixels.
    fn fits(&self, n: usize) -> bool {
        self.rgb.as_ref().is_none_or(|b| b.len() == 3 * n)
            && self.depth_m.as_ref().is_none_or(|b| b.len() == n)
            && self.ids.as_ref().is_none_or(|b| b.len() == n)
    }
}

/// Renders one view into images whose memory is reused.
pub(crate) fn draw_view(frame: &SceneFrame, view: &View, images: &mut Images) {
    let Camera { width, height, .. } = view.camera;
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        *images = Images::default();
        return;
    }
    let n = width as usize * height as usize;
    let Channels { rgb, depth, ids } = view.channels;
    let images = ImagesMut {
        rgb: resize_image(&mut images.rgb, rgb, 3 * n),
        depth_m: resize_image(&mut images.depth_m, depth, n),
        ids: resize_image(&mut images.ids, ids, n),
    };
    draw_view_into(frame, view, images);
}

/// Renders one view into caller-owned buffers. Which images are rendered depends on which buffers
/// are present.
///
/// # Panics
/// If the length of a buffer differs from the length of the camera's image.
pub(crate) fn draw_view_into(frame: &SceneFrame, view: &View, images: ImagesMut<'_>) {
    let n = view.camera.width as usize * view.camera.height as usize;
    assert!(images.fits(n), "a buffer does not match the {n} pixels of the view");
    if let Some(sight) = &view.sight {
        let mut unlimited = View { sight: None, ..*view };
        unlimited.channels.depth = true;
        let ImagesMut { mut rgb, depth_m, mut ids } = images;
        let mut scratch_depth_m = vec![0.0; if depth_m.is_some() { 0 } else { n }];
        let depth_m = depth_m.unwrap_or(&mut scratch_depth_m);
        let all = ImagesMut {
            rgb: rgb.as_deref_mut(),
            depth_m: Some(&mut *depth_m),
            ids: ids.as_deref_mut(),
        };
        draw_view_into(frame, &unlimited, all);
        limit_vision(sight, &view.camera, rgb, depth_m, ids);
        return;
    }
    let ImagesMut { rgb, depth_m, ids } = images;
    let Some(projection) = Projection::from_camera(&view.camera).filter(|_| n > 0) else {
        rgb.into_iter().for_each(|b| b.fill(0));
        depth_m.into_iter().for_each(|b| b.fill(Camera::FAR_M));
        ids.into_iter().for_each(|b| b.fill(EntityId::NOTHING.0));
        return;
    };
    with_scratch(|scratch| {
        let exclusions = view.exclusions();
        let Scratch { target, id_target, buffers, shading } = scratch;
        if let Some(rgb) = rgb {
            draw(frame, &projection, exclusions, target, buffers);
            let output = OutputImages { rgb, depth_m, ids };
            shade(frame, &projection, &buffers.drawn_instances(), target, shading, output);
            return;
        }
        draw(frame, &projection, exclusions, id_target, buffers);
        buffers.arch.dispatch(ReadBack { target: id_target, depth_m, ids });
    });
}

/// Copies depth and ids out of the render target. Compiled for each vector width and dispatched to
/// the widest one of the machine.
struct ReadBack<'a> {
    target: &'a RenderTarget<u16>,
    depth_m: Option<&'a mut [f32]>,
    ids: Option<&'a mut [u16]>,
}

impl pulp::NullaryFnOnce for ReadBack<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let ReadBack { target, depth_m, ids } = self;
        if let Some(depth_m) = depth_m {
            target.copy_inverse_depth(depth_m, clamped_depths_m);
        }
        if let Some(ids) = ids {
            target.copy_visibility_ids(ids);
        }
    }
}

/// Depths of a block of inverse depths, meters. A named function: a closure would be compiled
/// separately, without the vector instructions of this machine.
#[inline(always)]
fn clamped_depths_m(inverse_depth: &Block32<f32>) -> [f32; LANES] {
    let mut depth_m = [0.0; LANES];
    for k in 0..LANES {
        depth_m[k] = clamp_depth_m(reciprocal(inverse_depth[k]));
    }
    depth_m
}

/// Returns an image of `n` elements if `is_wanted`. The content is not initialized.
fn resize_image<T: Clone + Default>(
    image: &mut Option<Vec<T>>,
    is_wanted: bool,
    n: usize,
) -> Option<&mut [T]> {
    if !is_wanted {
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

    fn render_scenes(color: bool) -> Vec<Images> {
        let mut all = Vec::new();
        for (setup, eye, yaw) in
            [(house(), [0.6, 1.65, 2.2], -1.57), (street(), [9.0, 1.65, 0.0], 1.3)]
        {
            let world = world(setup);
            let scene = Scene::new(world.setup());
            let channels = if color { Channels::ALL } else { Channels::DEPTH_AND_IDS };
            let camera = camera(eye, yaw, -0.1, 203, 149);
            let view = View::from_camera(camera, channels);
            all.extend(scene.render(&world, &[view]));
        }
        all
    }

    #[test]
    fn images_are_the_same_bits_with_vectors_of_any_width() {
        for color in [true, false] {
            let expected = render_scenes(color);
            with_each_width(|width| {
                assert!(render_scenes(color) == expected, "{width}, color {color}");
            });
        }
    }
}
