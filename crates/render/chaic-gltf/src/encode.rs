//! Encoder of geometry as binary glTF 2.0, for viewers, modeling programs and other renderers.
//!
//! Axes and units of glTF and chaic are the same: right-handed, y up, meters; cameras look along
//! -z. A glTF material holds color and gloss; the texture is stored by name only.

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
    Geometry, InstanceData, MaterialData, MeshData, SpecularPreset, TriangleData,
    display_from_linear, unit,
};

/// Encodes a scene as the bytes of a `.glb` file.
///
/// The file has a node `class#id` for each instance, with both values as extras, and a node for
/// each camera. Each combination of shape, tint and factor is a mesh, with one primitive per
/// material. Equal glTF materials are shared. Their color is the material color or the tint, times
/// the factor, at most 1. `class_of` returns the class name of an entity. Flat triangles do not
/// share vertices, so that each has one normal.
pub fn glb(
    geometry: &Geometry,
    class_of: &dyn Fn(EntityId) -> &'static str,
    cameras: &[(String, Camera)],
) -> Vec<u8> {
    let mut writer = GlbWriter::new();
    let mut nodes = Vec::new();
    let mut meshes = BTreeMap::new();
    let shapes: Vec<Vec<MeshPart>> = geometry.meshes.iter().map(|m| writer.parts(m)).collect();
    for instance in &geometry.instances {
        let class = class_of(instance.entity);
        let parts = &shapes[instance.mesh as usize];
        let key = (
            instance.mesh,
            instance.tint.map(|tint| tint.map(f32::to_bits)),
            instance.factor.map(f32::to_bits),
        );
        let mesh = (!parts.is_empty())
            .then(|| *meshes.entry(key).or_insert_with(|| writer.mesh(class, parts, instance)));
        let m = Mat3::from_cols_array_2d(&instance.rotation);
        let id = instance.entity.0;
        nodes.push(writer.root.push(Node {
            mesh,
            name: Some(format!("{class}{}", instance.entity)),
            rotation: Some(UnitQuaternion(Quat::from_mat3(&m).normalize().to_array())),
            translation: Some(instance.origin),
            extras: extras(&serde_json::json!({ "entity": id, "class": class })),
            ..Default::default()
        }));
    }
    for (name, camera) in cameras {
        nodes.push(writer.camera(name, camera));
    }
    writer.finish(nodes)
}

/// Triangles of one material.
#[derive(Clone, Copy)]
struct MeshPart {
    material: MaterialData,
    positions: Index<Accessor>,
    normals: Index<Accessor>,
    indices: Index<Accessor>,
}

/// A file under construction.
struct GlbWriter {
    root: Root,
    /// Contents of the three buffer views: positions, normals, indices.
    bytes: [Vec<u8>; 3],
    materials: BTreeMap<MaterialKey, Index<Material>>,
}

/// Color as bits, gloss, texture.
type MaterialKey = ([u32; 3], SpecularPreset, chaic_render::geometry::Texture);

const POSITIONS: usize = 0;
const NORMALS: usize = 1;
const INDICES: usize = 2;

impl GlbWriter {
    fn new() -> GlbWriter {
        let generator = concat!("chaic ", env!("CARGO_PKG_VERSION"));
        let asset = Asset { generator: Some(generator.to_owned()), ..Default::default() };
        let root = Root { asset, ..Default::default() };
        GlbWriter { root, bytes: Default::default(), materials: BTreeMap::new() }
    }

    /// Encodes a mesh: one part per material that has triangles.
    fn parts(&mut self, mesh: &MeshData) -> Vec<MeshPart> {
        let with_triangles = mesh.materials.iter().enumerate().filter_map(|(k, material)| {
            let triangles: Vec<&TriangleData> =
                mesh.triangles.iter().filter(|t| usize::from(t.material) == k).collect();
            (!triangles.is_empty()).then_some((material, triangles))
        });
        with_triangles.map(|(material, triangles)| self.part(mesh, *material, &triangles)).collect()
    }

    fn part(
        &mut self,
        mesh: &MeshData,
        material: MaterialData,
        triangles: &[&TriangleData],
    ) -> MeshPart {
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
        let offset = self.append(POSITIONS, positions.iter().flatten().map(|x| x.to_le_bytes()));
        let position_accessor = accessor(POSITIONS, offset, positions.len());
        let positions = self.root.push(Accessor { min, max, ..position_accessor });
        let offset = self.append(NORMALS, normals.iter().flatten().map(|x| x.to_le_bytes()));
        let normals = self.root.push(accessor(NORMALS, offset, normals.len()));
        let offset = self.append(INDICES, indices.iter().map(|k| k.to_le_bytes()));
        let indices = self.root.push(accessor(INDICES, offset, indices.len()));
        MeshPart { material, positions, normals, indices }
    }

    /// Appends 4-byte values to a buffer view; returns the offset of the first.
    fn append(&mut self, view: usize, numbers: impl Iterator<Item = [u8; 4]>) -> usize {
        let bytes = &mut self.bytes[view];
        let offset = bytes.len();
        bytes.extend(numbers.flatten());
        offset
    }

    fn mesh(&mut self, class: &str, parts: &[MeshPart], instance: &InstanceData) -> Index<Mesh> {
        let mut primitives = Vec::with_capacity(parts.len());
        for part in parts {
            let color =
                instance.tint.filter(|_| part.material.tinted).unwrap_or(part.material.color);
            let color = Vec3::from(color) * Vec3::from(instance.factor);
            // A material cannot reflect more light than it receives.
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
                material: Some(self.material(color, &part.material)),
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

    fn material(&mut self, color: [f32; 3], material: &MaterialData) -> Index<Material> {
        let key = (color.map(f32::to_bits), material.gloss, material.texture);
        if let Some(existing) = self.materials.get(&key) {
            return *existing;
        }
        let (metallic, roughness) = metallic_roughness(material.gloss);
        let [r, g, b] = color;
        let is_emissive = matches!(material.gloss, SpecularPreset::Glow | SpecularPreset::Pane);
        let [red, green, blue] = color.map(display_from_linear);
        let texture = format!("{:?}", material.texture).to_lowercase();
        let gloss = format!("{:?}", material.gloss).to_lowercase();
        let index = self.root.push(Material {
            name: Some(format!("{texture} {gloss} #{red:02x}{green:02x}{blue:02x}")),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor([r, g, b, 1.0]),
                metallic_factor: StrengthFactor(metallic),
                roughness_factor: StrengthFactor(roughness),
                ..Default::default()
            },
            emissive_factor: EmissiveFactor(if is_emissive { color } else { [0.0; 3] }),
            extras: extras(&serde_json::json!({ "texture": texture, "gloss": gloss })),
            ..Default::default()
        });
        self.materials.insert(key, index);
        index
    }

    fn camera(&mut self, name: &str, camera: &Camera) -> Index<Node> {
        use gltf::json::camera::{Camera as GltfCamera, Perspective, Type};
        let perspective = Perspective {
            aspect_ratio: Some(camera.width as f32 / camera.height as f32),
            yfov: camera.vertical_fov_rad,
            znear: Camera::NEAR_M,
            zfar: Some(Camera::FAR_M),
            extensions: None,
            extras: None,
        };
        let projection = self.root.push(GltfCamera {
            name: Some(name.to_owned()),
            orthographic: None,
            perspective: Some(perspective),
            type_: Valid(Type::Perspective),
            extensions: None,
            extras: None,
        });
        self.root.push(Node {
            camera: Some(projection),
            name: Some(name.to_owned()),
            rotation: Some(UnitQuaternion(camera.world_from_camera.to_array())),
            translation: Some(camera.eye_in_world.to_array()),
            ..Default::default()
        })
    }

    fn finish(self, nodes: Vec<Index<Node>>) -> Vec<u8> {
        let GlbWriter { mut root, bytes, .. } = self;
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
        let json = root.to_vec().expect("the JSON has only names and finite values");
        let glb = Glb {
            // The writer computes the length.
            header: Header { magic: *b"glTF", version: 2, length: 0 },
            json: Cow::Owned(json),
            bin: Some(Cow::Owned(bytes.concat())),
        };
        glb.to_vec().expect("a scene is smaller than 4 GB")
    }
}

/// Accessor of `count` elements of a buffer view from byte `offset`.
fn accessor(view: usize, offset: usize, count: usize) -> Accessor {
    let (type_, number) = match view {
        INDICES => (Type::Scalar, ComponentType::U32),
        _ => (Type::Vec3, ComponentType::F32),
    };
    Accessor {
        buffer_view: Some(Index::new(view as u32)),
        byte_offset: Some(USize64::from(offset)),
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

/// Closest metallic-roughness material of a specular preset.
fn metallic_roughness(gloss: SpecularPreset) -> (f32, f32) {
    match gloss {
        SpecularPreset::Dull | SpecularPreset::Glow => (0.0, 0.95),
        SpecularPreset::Satin => (0.0, 0.6),
        SpecularPreset::Shiny => (0.0, 0.3),
        SpecularPreset::Metal => (1.0, 0.4),
        SpecularPreset::Glass | SpecularPreset::Pane => (0.0, 0.1),
    }
}

fn extras(value: &serde_json::Value) -> Option<Box<RawValue>> {
    RawValue::from_string(value.to_string()).ok()
}
