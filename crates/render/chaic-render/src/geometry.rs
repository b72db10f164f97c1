//! Everything that can be seen at one moment as plain data: for other renderers, and for files.
//!
//! Frames and units are those of [`chaic_core::geom`]: metres, right-handed, y up. Triangles are
//! counter-clockwise seen from outside, and every solid is closed; floors and ceilings are single
//! sheets that face the room. Colors are linear light, 0 to 1.

use chaic_core::{EntityId, Vec3};
use chaic_world::{Posture, State};
use glam::Mat3;

use crate::draw::outline;
use crate::frame::{Instance, corners};
use crate::ground::NO_ROOM;
use crate::mesh::{Mesh, Skin};
use crate::texture;
use crate::{Lens, Scene};

pub use crate::mesh::{Gloss, unit};
pub use crate::portals::{PortalGraph, RegionSet};
pub use crate::shapes::{BodyShape, ShapeName, Shapes};
pub use crate::solids::{N_LEVELS, level_for};
pub use crate::texture::{Texture, shown_from_linear};

/// The finest level of detail.
pub const FINEST: usize = N_LEVELS - 1;

/// Everything that can be seen at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The shapes, each once; every one is used by an instance.
    pub meshes: Vec<MeshData>,
    /// What there is: structure, then people, then things.
    pub instances: Vec<InstanceData>,
}

/// A shape in its object's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshData {
    /// Corners, metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, as many as positions; without meaning at vertices of flat triangles only.
    pub normals: Vec<[f32; 3]>,
    /// The triangles, those of one skin one after the other.
    pub triangles: Vec<TriangleData>,
    /// What the triangles' skins are.
    pub skins: Vec<SkinData>,
    /// Least coordinates of all vertices, metres.
    pub min: [f32; 3],
    /// Greatest coordinates of all vertices, metres.
    pub max: [f32; 3],
}

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleData {
    /// Indices of its vertices, counter-clockwise seen from outside.
    pub vertices: [u32; 3],
    /// Index of its skin.
    pub skin: u8,
    /// Whether the vertices' normals are interpolated; else the triangle's own plane has the normal.
    pub smooth: bool,
}

/// How a group of triangles looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinData {
    /// Linear red, green and blue, 0 to 1.
    pub color: [f32; 3],
    /// What it looks like close up.
    pub texture: Texture,
    /// How it answers to light.
    pub gloss: Gloss,
    /// The skin's axes in the object's frame, unit vectors, the longest extent's first. A texture is
    /// laid on a face by leaving out the axis that is most square to it; the first axis left is u.
    pub axes: [[f32; 3]; 3],
    /// Whether an instance's tint takes the color's place.
    pub tinted: bool,
}

/// A mesh somewhere in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceData {
    /// What it is; all floors share an id, and so do walls and ceilings.
    pub entity: EntityId,
    /// Index of its mesh.
    pub mesh: u32,
    /// The columns of the rotation from the object's frame to the world's: where the object's own
    /// x, y and z point.
    pub rotation: [[f32; 3]; 3],
    /// Where the object's origin is in the world, metres.
    pub origin: [f32; 3],
    /// Linear color of the tinted skins.
    pub tint: Option<[f32; 3]>,
    /// By what all its linear colors are multiplied, its tint's too.
    pub factor: [f32; 3],
    /// What lights it.
    pub lit_by: LitBy,
    /// The regions of [`Scene::regions`] that it reaches into.
    pub regions: RegionSet,
    /// Least coordinates of its shape at any level of detail, in the object's frame, metres.
    pub min: [f32; 3],
    /// Greatest coordinates of its shape at any level of detail, in the object's frame, metres.
    pub max: [f32; 3],
}

impl InstanceData {
    /// Half of the longer side of its bounds on the image of a lens, pixels, which decides its level
    /// of detail ([`level_for`]); `None` if it is outside of the image.
    pub fn radius_px(&self, lens: &Lens) -> Option<f32> {
        let rotation = Mat3::from_cols_array_2d(&self.rotation);
        let into = lens.camera_from(&rotation, self.origin.into());
        outline(corners(self.min.into(), self.max.into()), lens, &into).map(|o| o.radius_px())
    }
}

/// What lights an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LitBy {
    /// The sky and the sun.
    Sky,
    /// The lamp of the room it is in, at this point in the world, metres.
    Lamp([f32; 3]),
    /// Structure spans rooms: each of its points has the light of the room in front of it, see
    /// [`Scene::lamp_at`].
    EachPoint,
}

/// The square of brightness that a texture repeats.
#[derive(Clone, Debug, PartialEq)]
pub struct TileData {
    /// Side of the square, metres.
    pub side_m: f32,
    /// Texels along the side.
    pub side_texels: usize,
    /// Factors on the skin's linear color, 128 meaning 1, shape [v, u].
    pub texels: Vec<u8>,
}

impl Geometry {
    /// Takes the instances of an entity out, and the meshes that nobody else uses.
    pub fn leave_out(&mut self, entity: EntityId) {
        self.instances.retain(|i| i.entity != entity);
        let mut kept = vec![None; self.meshes.len()];
        let mut meshes = Vec::new();
        for instance in &mut self.instances {
            let old = instance.mesh as usize;
            let new = *kept[old].get_or_insert_with(|| {
                meshes.push(self.meshes[old].clone());
                meshes.len() as u32 - 1
            });
            instance.mesh = new;
        }
        self.meshes = meshes;
    }

    /// Triangles of all instances together.
    pub fn count_triangles(&self) -> usize {
        let of = |i: &InstanceData| self.meshes[i.mesh as usize].triangles.len();
        self.instances.iter().map(of).sum()
    }
}

/// The tile of a texture; [`Texture::Plain`] has none.
pub fn tile(texture: Texture) -> Option<TileData> {
    let begin = texture.tile()?.begin as usize;
    let finest = &texture::atlas()[begin..][..TILE_TEXELS * TILE_TEXELS];
    // The atlas holds roots.
    let linear = |texel: &u32| ((texel & 0xff) * (texel & 0xff) / 128).min(255) as u8;
    let texels = finest.iter().map(linear).collect();
    Some(TileData { side_m: texture.period_m(), side_texels: TILE_TEXELS, texels })
}

/// Texels along the side of a tile at its finest; a power of two.
pub const TILE_TEXELS: usize = texture::SIDE;

/// All tiles, each at sizes from [`TILE_TEXELS`] down to one texel, every size half of the one
/// before. A texel comes with its neighbors: itself in the lowest byte, then those to the right,
/// below, and below to the right; 128 means 1. They are factors on what is shown, the root of
/// linear light.
pub fn atlas() -> &'static [u32] {
    texture::atlas()
}

/// Where a tile is in the [`atlas`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtlasPlace {
    /// Index of its first texel.
    pub begin: u32,
    /// Texels per metre of its finest size.
    pub texels_per_m: f32,
}

/// Where the tile of a texture is; [`Texture::Plain`] has none.
pub fn place_in_atlas(texture: Texture) -> Option<AtlasPlace> {
    let tile = texture.tile()?;
    Some(AtlasPlace { begin: tile.begin, texels_per_m: tile.texels_per_m })
}

impl Scene {
    /// What can be seen at a moment, at a level of detail; levels past the finest are the finest.
    /// `postures` are those of the agents in order.
    pub fn geometry(&self, state: &State, postures: &[Posture], level: usize) -> Geometry {
        let [geometry] = self.geometry_at(state, postures, [level]);
        geometry
    }

    /// The same at all levels of detail, the coarsest first. The instances are the same in each,
    /// and a mesh of the same index is the same shape.
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
        let lit_by = match instance.room {
            None => LitBy::EachPoint,
            Some(NO_ROOM) => LitBy::Sky,
            Some(room) => {
                self.ground().lamp(room).map_or(LitBy::Sky, |at| LitBy::Lamp(at.to_array()))
            }
        };
        InstanceData {
            entity: instance.entity,
            mesh,
            rotation: columns(&instance.rotation),
            origin: instance.origin.to_array(),
            tint: instance.tint,
            factor: instance.factor.to_array(),
            lit_by,
            regions: instance.regions_among(self.regions()),
            min: instance.min.to_array(),
            max: instance.max.to_array(),
        }
    }

    /// Where the lamp of the room at a point hangs, metres; none outdoors.
    pub fn lamp_at(&self, point: Vec3) -> Option<Vec3> {
        let room = self.ground().room_at(point);
        if room == NO_ROOM { None } else { self.ground().lamp(room) }
    }
}

impl From<&Mesh> for MeshData {
    fn from(mesh: &Mesh) -> MeshData {
        let triangles = mesh.triangles.iter().map(|t| TriangleData {
            vertices: t.vertices.map(u32::from),
            skin: t.skin,
            smooth: t.smooth,
        });
        MeshData {
            positions: mesh.positions.iter().map(Vec3::to_array).collect(),
            normals: mesh.normals.iter().map(Vec3::to_array).collect(),
            triangles: triangles.collect(),
            skins: mesh.skins.iter().map(SkinData::from).collect(),
            min: mesh.min.to_array(),
            max: mesh.max.to_array(),
        }
    }
}

impl From<&Skin> for SkinData {
    fn from(skin: &Skin) -> SkinData {
        let Skin { color, texture, gloss, axes, tinted } = *skin;
        SkinData { color, texture, gloss, axes: columns(&axes), tinted }
    }
}

fn columns(m: &Mat3) -> [[f32; 3]; 3] {
    m.to_cols_array_2d()
}
