//! The records that shaders read, laid out as `shaders/common.wgsl` declares them.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use chaic_core::EntityId;
use chaic_render::geometry::{N_LEVELS, RegionSet};
use chaic_render::{Lens, View};

use crate::gpu::Placed;

/// What a view works out on the host.
pub(crate) struct Sight {
    pub lens: Lens,
    /// Those that may be seen.
    pub regions: RegionSet,
}

impl Sight {
    /// Of a view of a world; `None` if it makes no picture.
    pub fn of(view: &View, world: &Placed) -> Option<Sight> {
        let lens = Lens::of(&view.camera)?;
        Some(Sight { lens, regions: world.regions.seen_by(&lens) })
    }
}

/// A camera; 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct ViewRecord {
    pub right: [f32; 3],
    /// Pixels per unit of slope; 0 for a camera that makes no picture.
    pub focal: f32,
    pub down: [f32; 3],
    pub mu: f32,
    pub ahead: [f32; 3],
    pub mv: f32,
    pub eye: [f32; 3],
    pub first_instance: u32,
    pub n_instances: u32,
    /// Entities that are left out; 0 leaves out none.
    pub hidden_body: u32,
    pub hidden_ceiling: u32,
    /// Where the view's part of the lists of instances begins.
    pub first_visible: u32,
    /// Index of the world's [`LightRecord`].
    pub light: u32,
    /// A bit for each region that may be seen.
    pub regions: [u32; 2],
    pub padding: u32,
}

impl ViewRecord {
    /// The record of a view of a world; its lists of instances begin at `first_visible`.
    pub fn of(
        view: &View,
        sight: Option<&Sight>,
        world: &Placed,
        first_visible: u32,
    ) -> ViewRecord {
        let Some(Sight { lens, regions }) = sight else {
            return ViewRecord { first_visible, ..ViewRecord::zeroed() };
        };
        let Range { start, end } = world.instances.clone();
        let (mu, mv) = lens.middle();
        let id = |hidden: Option<EntityId>| hidden.map_or(0, |id| u32::from(id.0));
        ViewRecord {
            right: lens.right.to_array(),
            focal: lens.focal,
            down: (-lens.up).to_array(),
            mu,
            ahead: lens.ahead.to_array(),
            mv,
            eye: lens.eye.to_array(),
            first_instance: start,
            n_instances: end - start,
            hidden_body: id(view.hide.map(EntityId::of_agent)),
            hidden_ceiling: id(view.hide_ceiling.then_some(EntityId::CEILING)),
            first_visible,
            light: world.light.record.start,
            regions: words(*regions),
            padding: 0,
        }
    }
}

/// The bits of a set of regions, those of the first regions first.
pub(crate) fn words(regions: RegionSet) -> [u32; 2] {
    let bits = regions.bits();
    [bits as u32, (bits >> 32) as u32]
}

/// A mesh somewhere in a world; 144 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct InstanceRecord {
    /// Columns of the rotation from the object's frame to the world.
    pub x: [f32; 3],
    pub mesh: u32,
    pub y: [f32; 3],
    pub entity: u32,
    pub z: [f32; 3],
    /// [`LIT_BY_SKY`] and so on.
    pub lit_by: u32,
    pub origin: [f32; 3],
    pub is_tinted: u32,
    pub tint: [f32; 3],
    /// A bit for each region that it reaches into, in two words.
    pub regions_low: u32,
    pub lamp: [f32; 3],
    pub regions_high: u32,
    /// Bounds of all levels, in the object's frame.
    pub low: [f32; 3],
    pub padding: u32,
    pub high: [f32; 3],
    pub padding_2: u32,
    /// By what linear colors are multiplied.
    pub factor: [f32; 3],
    pub padding_3: u32,
}

/// Lit by the sky and the sun.
pub(crate) const LIT_BY_SKY: u32 = 0;
/// Lit by the lamp of the instance.
pub(crate) const LIT_BY_LAMP: u32 = 1;
/// Lit at each point by the lamp of the room in front of it.
pub(crate) const LIT_BY_POINT: u32 = 2;

/// Where the levels of a mesh lie; 16 bytes each.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct MeshRecord {
    /// First vertex, first triangle, number of triangles, first skin.
    pub levels: [[u32; 4]; N_LEVELS],
}

/// How a group of triangles looks; 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SkinRecord {
    pub color: [f32; 3],
    /// 0 without texture.
    pub texels_per_m: f32,
    pub axes_x: [f32; 3],
    pub gloss: u32,
    pub axes_y: [f32; 3],
    pub is_tinted: u32,
    pub axes_z: [f32; 3],
    /// Where the texture's tile begins in the atlas.
    pub first_texel: u32,
}

/// The light of a world; 160 bytes.
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

/// What culling found out about a view; 16 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Tally {
    pub n_visible: u32,
    pub most_triangles: u32,
    pub n_triangles: u32,
    pub padding: u32,
}

/// What the dispatches of one round share; 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Round {
    pub width: u32,
    pub height: u32,
    pub first_view: u32,
    pub id_words: u32,
    pub wants_color: u32,
    pub padding: [u32; 3],
}

// The sizes that WGSL gives these structs.
const _: () = {
    assert!(size_of::<ViewRecord>() == 96);
    assert!(size_of::<InstanceRecord>() == 144);
    assert!(size_of::<MeshRecord>() == 16 * N_LEVELS);
    assert!(size_of::<SkinRecord>() == 64);
    assert!(size_of::<LightRecord>() == 160);
    assert!(size_of::<Tally>() == 16);
    assert!(size_of::<Round>() == 32);
};
