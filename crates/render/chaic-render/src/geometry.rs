//! Geometry of one frame as plain data: for other renderers, and for files.
//!
//! Frames and units are those of [`chaic_core::geom`]: meters, right-handed, y up. Triangles are
//! counter-clockwise seen from outside, and every solid is closed. Floors and ceilings are single
//! sheets that face the room. Colors are linear, 0 to 1.

use chaic_core::{EntityId, Vec3};
use chaic_world::{Posture, State};
use glam::Mat3;

use crate::draw::screen_bounds;
use crate::ground::NO_ROOM;
use crate::mesh::{Material, Mesh};
use crate::scene_frame::{Instance, corners};
use crate::texture;
use crate::{Projection, Scene};

pub use crate::mesh::{SpecularPreset, unit};
pub use crate::portals::{PortalGraph, RegionSet};
pub use crate::solids::{N_LEVELS, level_for};
pub use crate::texture::{Texture, display_from_linear};

/// Finest level of detail.
pub const FINEST_LEVEL: usize = N_LEVELS - 1;

/// Geometry of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// Unique meshes; every one is used by an instance.
    pub meshes: Vec<MeshData>,
    /// Instances: structure, then people, then objects.
    pub instances: Vec<InstanceData>,
}

/// A mesh in its object frame.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshData {
    /// Vertex positions, meters.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one per position. They are undefined at vertices that only flat triangles use.
    pub normals: Vec<[f32; 3]>,
    /// Triangles, grouped by material.
    pub triangles: Vec<TriangleData>,
    /// Materials of the triangles.
    pub materials: Vec<MaterialData>,
    /// Minimum corner of the bounding box, meters.
    pub min: [f32; 3],
    /// Maximum corner of the bounding box, meters.
    pub max: [f32; 3],
}

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleData {
    /// Indices of its vertices, counter-clockwise seen from outside.
    pub vertices: [u32; 3],
    /// Index of its material.
    pub material: u8,
    /// True if vertex normals are interpolated; otherwise the triangle has its geometric normal.
    pub smooth: bool,
}

/// Material of a group of triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialData {
    /// Linear red, green and blue, 0 to 1.
    pub color: [f32; 3],
    /// Brightness texture.
    pub texture: Texture,
    /// Reflection of light.
    pub gloss: SpecularPreset,
    /// Texture axes in the object frame: unit vectors, the longest extent first. A texture is
    /// projected along the axis most perpendicular to the face; the first remaining axis is u.
    pub axes: [[f32; 3]; 3],
    /// True if the tint of an instance replaces the color.
    pub tinted: bool,
}

/// A mesh with a pose in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceData {
    /// Entity id. All floors share one id, and so do walls and ceilings.
    pub entity: EntityId,
    /// Index of its mesh.
    pub mesh: u32,
    /// Columns of the rotation from the object frame to the world frame.
    pub rotation: [[f32; 3]; 3],
    /// Origin of the object in the world, meters.
    pub origin: [f32; 3],
    /// Linear color of the tinted materials.
    pub tint: Option<[f32; 3]>,
    /// Factor on all linear colors, including the tint.
    pub factor: [f32; 3],
    /// Light source of the instance.
    pub light_source: LightAssignment,
    /// Regions of [`Scene::portal_graph`] that it overlaps.
    pub regions: RegionSet,
    /// Minimum corner of the bounding box over all levels of detail, in the object frame, meters.
    pub min: [f32; 3],
    /// Maximum corner of the bounding box over all levels of detail, in the object frame, meters.
    pub max: [f32; 3],
}

impl InstanceData {
    /// Half of the longer side of its bounds on the image, pixels, which selects the level of
    /// detail ([`level_for`]). `None` if it is outside the image.
    pub fn radius_px(&self, projection: &Projection) -> Option<f32> {
        let rotation = Mat3::from_cols_array_2d(&self.rotation);
        let transform = projection.camera_from(&rotation, self.origin.into());
        screen_bounds(corners(self.min.into(), self.max.into()), projection, &transform)
            .map(|bounds| bounds.radius_px())
    }
}

/// Light source of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightAssignment {
    /// Sun and sky.
    Sky,
    /// Lamp of its room, at this position in the world, meters.
    Lamp([f32; 3]),
    /// Per point: structure spans rooms, and each point is lit by the room in front of it, see
    /// [`Scene::lamp_at`].
    PerPoint,
}

/// Repeating brightness tile of a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct TileData {
    /// Side of the tile, meters.
    pub side_m: f32,
    /// Texels along the side.
    pub side_texels: usize,
    /// Factors on the linear color of the material, u8, 128 means 1, shape [v, u].
    pub texels: Vec<u8>,
}

impl Geometry {
    /// Removes the instances of an entity, and the meshes that no other instance uses.
    pub fn remove_entity(&mut self, entity: EntityId) {
        self.instances.retain(|i| i.entity != entity);
        let mut new_indices = vec![None; self.meshes.len()];
        let mut meshes = Vec::new();
        for instance in &mut self.instances {
            let old = instance.mesh as usize;
            let new = *new_indices[old].get_or_insert_with(|| {
                meshes.push(self.meshes[old].clone());
                meshes.len() as u32 - 1
            });
            instance.mesh = new;
        }
        self.meshes = meshes;
    }

    /// Number of triangles of all instances.
    pub fn count_triangles(&self) -> usize {
        let n_triangles = |i: &InstanceData| self.meshes[i.mesh as usize].triangles.len();
        self.instances.iter().map(n_triangles).sum()
    }
}

/// Returns the tile of a texture; `None` for [`Texture::Plain`].
pub fn tile(texture: Texture) -> Option<TileData> {
    let begin = texture.tile()?.begin as usize;
    let finest = &texture::atlas()[begin..][..TILE_TEXELS * TILE_TEXELS];
    // The atlas holds square roots.
    let linear = |texel: &u32| ((texel & 0xff) * (texel & 0xff) / 128).min(255) as u8;
    let texels = finest.iter().map(linear).collect();
    Some(TileData { side_m: texture.period_m(), side_texels: TILE_TEXELS, texels })
}

/// Texels along the side of a tile at the finest mip level; a power of two.
pub const TILE_TEXELS: usize = texture::TILE_SIDE;

/// Returns the texture atlas: all tiles with mip levels from [`TILE_TEXELS`] texels per side down
/// to one. Each texel holds its neighbors: itself in the lowest byte, then those to the right,
/// below, and below to the right. 128 means 1. Texels are factors on display colors (square roots
/// of linear light).
pub fn atlas() -> &'static [u32] {
    texture::atlas()
}

/// Position of a tile in the [`atlas`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtlasTile {
    /// Index of its first texel.
    pub begin: u32,
    /// Texels per meter at the finest mip level.
    pub texels_per_m: f32,
}

/// Returns the position of a texture's tile; `None` for [`Texture::Plain`].
pub fn atlas_tile(texture: Texture) -> Option<AtlasTile> {
    let tile = texture.tile()?;
    Some(AtlasTile { begin: tile.begin, texels_per_m: tile.texels_per_m })
}

impl Scene {
    /// Returns the geometry of a state at a level of detail. Levels past the finest give the
    /// finest. `postures` lists the postures of the agents in order.
    pub fn geometry(&self, state: &State, postures: &[Posture], level: usize) -> Geometry {
        let [geometry] = self.geometry_at(state, postures, [level]);
        geometry
    }

    /// Returns the geometry at all levels of detail, the coarsest first. All levels have the same
    /// instances, and meshes with the same index have the same shape.
    pub fn geometry_at_all_levels(
        &self,
        state: &State,
        postures: &[Posture],
    ) -> [Geometry; N_LEVELS] {
        self.geometry_at(state, postures, std::array::from_fn(|level| level))
    }

    fn geometry_at<const N: usize>(
        &self,
        state: &State,
        postures: &[Posture],
        levels: [usize; N],
    ) -> [Geometry; N] {
        self.with_shapes(state, postures, |shapes| {
            let meshes = |level: usize| (0..shapes.len()).map(move |k| shapes.mesh(k, level));
            levels.map(|level| Geometry {
                meshes: meshes(level).collect(),
                instances: shapes.instances.clone(),
            })
        })
    }

    pub(crate) fn instance_data(&self, instance: &Instance, mesh: u32) -> InstanceData {
        let light_source = match instance.room {
            None => LightAssignment::PerPoint,
            Some(NO_ROOM) => LightAssignment::Sky,
            Some(room) => self
                .ground()
                .lamp(room)
                .map_or(LightAssignment::Sky, |at| LightAssignment::Lamp(at.to_array())),
        };
        InstanceData {
            entity: instance.entity,
            mesh,
            rotation: columns(&instance.rotation),
            origin: instance.origin.to_array(),
            tint: instance.tint,
            factor: instance.factor.to_array(),
            light_source,
            regions: instance.regions_in(self.portal_graph()),
            min: instance.min.to_array(),
            max: instance.max.to_array(),
        }
    }

    /// Returns the position of the lamp of the room at a point, meters; `None` outdoors.
    pub fn lamp_at(&self, point: Vec3) -> Option<Vec3> {
        let room = self.ground().room_at(point);
        if room == NO_ROOM { None } else { self.ground().lamp(room) }
    }
}

impl From<&Mesh> for MeshData {
    fn from(mesh: &Mesh) -> MeshData {
        let triangles = mesh.triangles.iter().map(|t| TriangleData {
            vertices: t.vertices.map(u32::from),
            material: t.material,
            smooth: t.smooth,
        });
        MeshData {
            positions: mesh.positions.iter().map(Vec3::to_array).collect(),
            normals: mesh.normals.iter().map(Vec3::to_array).collect(),
            triangles: triangles.collect(),
            materials: mesh.materials.iter().map(MaterialData::from).collect(),
            min: mesh.min.to_array(),
            max: mesh.max.to_array(),
        }
    }
}

impl From<&Material> for MaterialData {
    fn from(material: &Material) -> MaterialData {
        let Material { color, texture, gloss, axes, tinted } = *material;
        MaterialData { color, texture, gloss, axes: columns(&axes), tinted }
    }
}

fn columns(m: &Mat3) -> [[f32; 3]; 3] {
    m.to_cols_array_2d()
}
