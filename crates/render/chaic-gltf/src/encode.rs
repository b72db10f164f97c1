//! Geometry as a binary glTF 2.0 file, for viewers, modelling programs and other renderers.
//!
//! glTF's axes and units are ours: right-handed, y up, metres; cameras look along -z. A material
//! holds a skin's color and gloss; what its texture looks like is only named.

use std::borrow::Cow;
use std::collections::BTreeMap;

use chaic_core::geom::Camera;
use chaic_core::{EntityId, Vec3};
use glam::{Mat3, Quat};
use gltf::binary::{Glb, Header};
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Stride, Target, View};
use gltf::json::extras::RawValue;
use gltf::json::material::{
    EmissiveFactor, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor,
};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::scene::UnitQuaternion;
use gltf::json::validation::{Checked::Valid, USize64};
use gltf::json::{Accessor, Asset, Buffer, Index, Material, Mesh, Node, Root, Scene};

use chaic_render::geometry::{
    Geometry, Gloss, InstanceData, MeshData, SkinData, TriangleData, shown_from_linear, unit,
};

/// A scene as the bytes of a `.glb` file.
///
/// There is a node `class#id` for each instance, with both as extras; a mesh for each shape in each
/// tint and factor, with a primitive for each skin; and a node for each camera. A material is shared
/// by all that look the same; its color is the skin's or the tint, times the factor, at most 1. `class_of` names what an
/// entity is. The vertices of flat triangles are their own, so that they have one normal.
pub fn glb(
    geometry: &Geometry,
    class_of: &dyn Fn(EntityId) -> &'static str,
    cameras: &[(String, Camera)],
) -> Vec<u8> {
    let mut file = File::new();
    let mut nodes = Vec::new();
    let mut meshes = BTreeMap::new();
    let shapes: Vec<Vec<Part>> = geometry.meshes.iter().map(|m| file.parts(m)).collect();
    for instance in &geometry.instances {
        let class = class_of(instance.entity);
        let parts = &shapes[instance.mesh as usize];
        let key = (
            instance.mesh,
            instance.tint.map(|tint| tint.map(f32::to_bits)),
            instance.factor.map(f32::to_bits),
        );
        let mesh = (!parts.is_empty())
            .then(|| *meshes.entry(key).or_insert_with(|| file.mesh(class, parts, instance)));
        let m = Mat3::from_cols_array_2d(&instance.rotation);
        let id = instance.entity.0;
        nodes.push(file.root.push(Node {
            mesh,
            name: Some(format!("{class}{}", instance.entity)),
            rotation: Some(UnitQuaternion(Quat::from_mat3(&m).normalize().to_array())),
            translation: Some(instance.origin),
            extras: extras(&serde_json::json!({ "entity": id, "class": class })),
            ..Default::default()
        }));
    }
    for (name, camera) in cameras {
        nodes.push(file.camera(name, camera));
    }
    file.finish(nodes)
}

/// The triangles of one skin.
#[derive(Clone, Copy)]
struct Part {
    skin: SkinData,
    positions: Index<Accessor>,
    normals: Index<Accessor>,
    indices: Index<Accessor>,
}

/// A file that is being written.
struct File {
    root: Root,
    /// What becomes the three views of the buffer, in the order of [`VIEWS`].
    bytes: [Vec<u8>; 3],
    materials: BTreeMap<MaterialKey, Index<Material>>,
}

/// Color as bits, gloss, texture.
type MaterialKey = ([u32; 3], Gloss, chaic_render::geometry::Texture);

const POSITIONS: usize = 0;
const NORMALS: usize = 1;
const INDICES: usize = 2;

impl File {
    fn new() -> File {
        let generator = concat!("chaic ", env!("CARGO_PKG_VERSION"));
        let asset = Asset { generator: Some(generator.to_owned()), ..Default::default() };
        let root = Root { asset, ..Default::default() };
        File { root, bytes: Default::default(), materials: BTreeMap::new() }
    }

    /// The parts of a mesh, one for each skin that has triangles.
    fn parts(&mut self, mesh: &MeshData) -> Vec<Part> {
        let with_triangles = mesh.skins.iter().enumerate().filter_map(|(k, skin)| {
            let own: Vec<&TriangleData> =
                mesh.triangles.iter().filter(|t| usize::from(t.skin) == k).collect();
            (!own.is_empty()).then_some((skin, own))
        });
        with_triangles.map(|(skin, triangles)| self.part(mesh, *skin, &triangles)).collect()
    }

    fn part(&mut self, mesh: &MeshData, skin: SkinData, triangles: &[&TriangleData]) -> Part {
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        let mut indices = Vec::with_capacity(3 * triangles.len());
        let mut shared: BTreeMap<u32, u32> = BTreeMap::new();
        for triangle in triangles {
            let [a, b, c] = triangle.vertices.map(|k| Vec3::from(mesh.positions[k as usize]));
            let plane = unit((b - a).cross(c - a)).to_array();
            for vertex in triangle.vertices {
                let next = positions.len() as u32;
                let index =
                    if triangle.smooth { *shared.entry(vertex).or_insert(next) } else { next };
                if index == next {
                    let normal = mesh.normals[vertex as usize];
                    positions.push(mesh.positions[vertex as usize]);
                    normals.push(if triangle.smooth { normal } else { plane });
                }
                indices.push(index);
            }
        }
        let bounds = |pick: fn(f32, f32) -> f32| {
            let all =
                positions.iter().copied().reduce(|a, b| std::array::from_fn(|k| pick(a[k], b[k])));
            all.map(|v| serde_json::json!(v))
        };
        let (min, max) = (bounds(f32::min), bounds(f32::max));
        let at = self.append(POSITIONS, positions.iter().flatten().map(|x| x.to_le_bytes()));
        let whole = accessor(POSITIONS, at, positions.len());
        let positions = self.root.push(Accessor { min, max, ..whole });
        let at = self.append(NORMALS, normals.iter().flatten().map(|x| x.to_le_bytes()));
        let normals = self.root.push(accessor(NORMALS, at, normals.len()));
        let at = self.append(INDICES, indices.iter().map(|k| k.to_le_bytes()));
        let indices = self.root.push(accessor(INDICES, at, indices.len()));
        Part { skin, positions, normals, indices }
    }

    /// Appends numbers of four bytes to a view; returns where they begin.
    fn append(&mut self, view: usize, numbers: impl Iterator<Item = [u8; 4]>) -> usize {
        let bytes = &mut self.bytes[view];
        let at = bytes.len();
        bytes.extend(numbers.flatten());
        at
    }

    fn mesh(&mut self, class: &str, parts: &[Part], instance: &InstanceData) -> Index<Mesh> {
        let mut primitives = Vec::with_capacity(parts.len());
        for part in parts {
            let color = instance.tint.filter(|_| part.skin.tinted).unwrap_or(part.skin.color);
            let color = Vec3::from(color) * Vec3::from(instance.factor);
            // A material can't reflect more light than there is.
            let color = color.clamp(Vec3::ZERO, Vec3::ONE).to_array();
            let attributes = [
                (Valid(Semantic::Positions), part.positions),
                (Valid(Semantic::Normals), part.normals),
            ];
            primitives.push(Primitive {
                attributes: attributes.into(),
                extensions: None,
                extras: None,
                indices: Some(part.indices),
                material: Some(self.material(color, &part.skin)),
                mode: Valid(Mode::Triangles),
                targets: None,
            });
        }
        self.root.push(Mesh {
            extensions: None,
            extras: None,
            name: Some(class.to_owned()),
            primitives,
            weights: None,
        })
    }

    fn material(&mut self, color: [f32; 3], skin: &SkinData) -> Index<Material> {
        let key = (color.map(f32::to_bits), skin.gloss, skin.texture);
        if let Some(known) = self.materials.get(&key) {
            return *known;
        }
        let (metallic, roughness) = metallic_roughness(skin.gloss);
        let [r, g, b] = color;
        let gives_light = matches!(skin.gloss, Gloss::Glow | Gloss::Pane);
        let [red, green, blue] = color.map(shown_from_linear);
        let texture = format!("{:?}", skin.texture).to_lowercase();
        let gloss = format!("{:?}", skin.gloss).to_lowercase();
        let index = self.root.push(Material {
            name: Some(format!("{texture} {gloss} #{red:02x}{green:02x}{blue:02x}")),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor([r, g, b, 1.0]),
                metallic_factor: StrengthFactor(metallic),
                roughness_factor: StrengthFactor(roughness),
                ..Default::default()
            },
            emissive_factor: EmissiveFactor(if gives_light { color } else { [0.0; 3] }),
            extras: extras(&serde_json::json!({ "texture": texture, "gloss": gloss })),
            ..Default::default()
        });
        self.materials.insert(key, index);
        index
    }

    fn camera(&mut self, name: &str, camera: &Camera) -> Index<Node> {
        use gltf::json::camera::{Camera as Lens, Perspective, Type};
        let perspective = Perspective {
            aspect_ratio: Some(camera.width as f32 / camera.height as f32),
            yfov: camera.vertical_fov_rad,
            znear: Camera::NEAR_M,
            zfar: Some(Camera::FAR_M),
            extensions: None,
            extras: None,
        };
        let lens = self.root.push(Lens {
            name: Some(name.to_owned()),
            orthographic: None,
            perspective: Some(perspective),
            type_: Valid(Type::Perspective),
            extensions: None,
            extras: None,
        });
        self.root.push(Node {
            camera: Some(lens),
            name: Some(name.to_owned()),
            rotation: Some(UnitQuaternion(camera.world_from_camera.to_array())),
            translation: Some(camera.eye_in_world.to_array()),
            ..Default::default()
        })
    }

    fn finish(self, nodes: Vec<Index<Node>>) -> Vec<u8> {
        let File { mut root, bytes, .. } = self;
        let scene = Scene { extensions: None, extras: None, name: None, nodes };
        root.scene = Some(root.push(scene));
        let length = bytes.iter().map(Vec::len).sum::<usize>();
        let buffer = root.push(Buffer {
            byte_length: USize64::from(length),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut begin = 0;
        for (view, bytes) in bytes.iter().enumerate() {
            let is_indices = view == INDICES;
            let target = if is_indices { Target::ElementArrayBuffer } else { Target::ArrayBuffer };
            root.push(View {
                buffer,
                byte_length: USize64::from(bytes.len()),
                byte_offset: Some(USize64::from(begin)),
                byte_stride: (!is_indices).then_some(Stride(12)),
                name: None,
                target: Some(Valid(target)),
                extensions: None,
                extras: None,
            });
            begin += bytes.len();
        }
        let json = root.to_vec().expect("names and finite numbers only");
        let glb = Glb {
            // The writer works the length out.
            header: Header { magic: *b"glTF", version: 2, length: 0 },
            json: Cow::Owned(json),
            bin: Some(Cow::Owned(bytes.concat())),
        };
        glb.to_vec().expect("a scene is far below 4 GB")
    }
}

/// So many elements of a view, from this byte on.
fn accessor(view: usize, at: usize, count: usize) -> Accessor {
    let (type_, number) = match view {
        INDICES => (Type::Scalar, ComponentType::U32),
        _ => (Type::Vec3, ComponentType::F32),
    };
    Accessor {
        buffer_view: Some(Index::new(view as u32)),
        byte_offset: Some(USize64::from(at)),
        count: USize64::from(count),
        component_type: Valid(GenericComponentType(number)),
        type_: Valid(type_),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
        extensions: None,
        extras: None,
    }
}

/// The metallic-roughness material nearest to our highlights.
fn metallic_roughness(gloss: Gloss) -> (f32, f32) {
    match gloss {
        Gloss::Dull | Gloss::Glow => (0.0, 0.95),
        Gloss::Satin => (0.0, 0.6),
        Gloss::Shiny => (0.0, 0.3),
        Gloss::Metal => (1.0, 0.4),
        Gloss::Glass | Gloss::Pane => (0.0, 0.1),
    }
}

fn extras(value: &serde_json::Value) -> Option<Box<RawValue>> {
    RawValue::from_string(value.to_string()).ok()
}
