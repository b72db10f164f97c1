//! Records that shaders read, in the layout of `shaders/common.wgsl`.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use chaic_core::EntityId;
use chaic_render::geometry::{N_LEVELS, RegionSet};
use chaic_render::{Projection, View};

use crate::gpu::PlacedWorld;

/// Visibility data of a view, computed on the host.
pub(crate) struct ViewVisibility {
    pub projection: Projection,
    /// Visible regions.
    pub regions: RegionSet,
}

impl ViewVisibility {
    /// Visibility of a view of a world; `None` for an invalid camera.
    pub fn new(view: &View, world: &PlacedWorld) -> Option<ViewVisibility> {
        let projection = Projection::from_camera(&view.camera)?;
        Some(ViewVisibility { projection, regions: world.regions.visible_regions(&projection) })
    }
}

/// A camera; 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct ViewRecord {
    pub right: [f32; 3],
    /// Focal length, pixels; 0 for an invalid camera.
    pub focal: f32,
    pub down: [f32; 3],
    pub mu: f32,
    pub forward: [f32; 3],
    pub mv: f32,
    pub eye: [f32; 3],
    pub first_instance: u32,
    pub n_instances: u32,
    /// Hidden entities; 0 for none.
    pub hidden_body: u32,
    pub hidden_ceiling: u32,
    /// Offset of the view in the instance lists.
    pub first_visible: u32,
    /// Index of the [`LightRecord`] of the world.
    pub light: u32,
    /// One bit per visible region.
    pub regions: [u32; 2],
    pub padding: u32,
}

impl ViewRecord {
    /// Record of a view of a world; its instance lists begin at `first_visible`.
    pub fn new(
        view: &View,
        visibility: Option<&ViewVisibility>,
        world: &PlacedWorld,
        first_visible: u32,
    ) -> ViewRecord {
        let Some(ViewVisibility { projection, regions }) = visibility else {
            return ViewRecord { first_visible, ..ViewRecord::zeroed() };
        };
        let Range { start, end } = world.instances.clone();
        let (mu, mv) = projection.center();
        let id = |hidden: Option<EntityId>| hidden.map_or(0, |id| u32::from(id.0));
        ViewRecord {
            right: projection.right.to_array(),
            focal: projection.focal,
            down: (-projection.up).to_array(),
            mu,
            forward: projection.forward.to_array(),
            mv,
            eye: projection.eye.to_array(),
            first_instance: start,
            n_instances: end - start,
            hidden_body: id(view.hide.map(EntityId::from_agent)),
            hidden_ceiling: id(view.hide_ceiling.then_some(EntityId::CEILING)),
            first_visible,
            light: world.light.record.start,
            regions: words(*regions),
            padding: 0,
        }
    }
}

/// Splits a region set into two words, the first regions first.
pub(crate) fn words(regions: RegionSet) -> [u32; 2] {
    let bits = regions.bits();
    [bits as u32, (bits >> 32) as u32]
}

/// A mesh with a pose in the world; 144 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct InstanceRecord {
    /// Columns of the rotation from the object frame to the world frame.
    pub x: [f32; 3],
    pub mesh: u32,
    pub y: [f32; 3],
    pub entity: u32,
    pub z: [f32; 3],
    /// [`LIT_BY_SKY`], [`LIT_BY_LAMP`] or [`LIT_BY_POINT`].
    pub light_source: u32,
    pub origin: [f32; 3],
    pub is_tinted: u32,
    pub tint: [f32; 3],
    /// One bit per region that it overlaps, in two words.
    pub regions_low: u32,
    pub lamp: [f32; 3],
    pub regions_high: u32,
    /// Bounding box over all levels of detail, in the object frame.
    pub low: [f32; 3],
    pub padding: u32,
    pub high: [f32; 3],
    pub padding_2: u32,
    /// Factor on linear colors.
    pub factor: [f32; 3],
    pub padding_3: u32,
}

/// Lit by the sky and the sun.
pub(crate) const LIT_BY_SKY: u32 = 0;
/// Lit by the lamp of the instance.
pub(crate) const LIT_BY_LAMP: u32 = 1;
/// Lit per point by the lamp of the room in front of the point.
pub(crate) const LIT_BY_POINT: u32 = 2;

/// Offsets of the levels of a mesh; 16 bytes each.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct MeshRecord {
    /// First vertex, first triangle, number of triangles, first material.
    pub levels: [[u32; 4]; N_LEVELS],
}

/// Material of a group of triangles; 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct MaterialRecord {
    pub color: [f32; 3],
    /// 0 without texture.
    pub texels_per_m: f32,
    pub axes_x: [f32; 3],
    pub gloss: u32,
    pub axes_y: [f32; 3],
    pub is_tinted: u32,
    pub axes_z: [f32; 3],
    /// Offset of the texture tile in the atlas.
    pub first_texel: u32,
}

/// Lighting of a world; 160 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct LightRecord {
    pub to_sun: [f32; 3],
    pub ceiling_m: f32,
    pub sun: [f32; 3],
    pub first_lamp: u32,
    pub lamp: [f32; 3],
    pub n_lamps: u32,
    pub outdoors_high: [f32; 3],
    pub first_cell: u32,
    pub outdoors_low: [f32; 3],
    pub n_x: u32,
    pub indoors_high: [f32; 3],
    pub n_z: u32,
    pub indoors_low: [f32; 3],
    pub cells_per_m: f32,
    pub horizon: [f32; 3],
    pub min_x: f32,
    pub zenith: [f32; 3],
    pub min_z: f32,
    pub below: [f32; 3],
    pub padding: u32,
}

/// Counters of a view; 16 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Tally {
    pub n_visible: u32,
    pub max_triangles: u32,
    pub n_triangles: u32,
    pub padding: u32,
}

/// Parameters shared by the dispatches of one round; 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct RoundParams {
    pub width: u32,
    pub height: u32,
    pub first_view: u32,
    pub id_words: u32,
    pub wants_color: u32,
    pub padding: [u32; 3],
}

// Sizes of these structs in WGSL.
const _: () = {
    assert!(size_of::<ViewRecord>() == 96);
    assert!(size_of::<InstanceRecord>() == 144);
    assert!(size_of::<MeshRecord>() == 16 * N_LEVELS);
    assert!(size_of::<MaterialRecord>() == 64);
    assert!(size_of::<LightRecord>() == 160);
    assert!(size_of::<Tally>() == 16);
    assert!(size_of::<RoundParams>() == 32);
};
