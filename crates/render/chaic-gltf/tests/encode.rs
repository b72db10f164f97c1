//! Promise: a written glTF file is read back as the same scene.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::{AgentId, EntityId, Vec3};
use chaic_render::geometry::{FINEST_LEVEL, Geometry};
use chaic_render::{Appearance, Scene};
use chaic_test_kit::hostile;
use chaic_test_kit::scenes::{house, street, world};
use chaic_world::World;
use glam::{Mat4, Quat};

fn class_of(entity: EntityId) -> &'static str {
    match entity {
        EntityId::FLOOR => "floor",
        EntityId::WALL => "wall",
        EntityId::CEILING => "ceiling",
        e if e.is_object() => "thing",
        _ => "person",
    }
}

fn geometry_of(world: &World) -> Geometry {
    geometry_in(world, Appearance::Canonical)
}

fn geometry_in(world: &World, appearance: Appearance) -> Geometry {
    let postures: Vec<_> = world.setup().agents().map(|a| world.posture(a)).collect();
    let scene = Scene::with_appearance(world.setup(), appearance);
    scene.geometry(world.state(), &postures, FINEST_LEVEL)
}

/// Number of triangles, and the bounds of their vertices in the world.
type NodeExtent = (usize, Vec3, Vec3);

fn grow((n, low, high): &mut NodeExtent, triangles: usize, points: impl Iterator<Item = Vec3>) {
    *n += triangles;
    for p in points {
        (*low, *high) = (low.min(p), high.max(p));
    }
}

const NOTHING: NodeExtent = (0, Vec3::INFINITY, Vec3::NEG_INFINITY);

/// Reads the extent of each node from a file, by node name.
fn extents_in(file: &[u8]) -> BTreeMap<String, NodeExtent> {
    let gltf = gltf::Gltf::from_slice(file).expect("the file is valid");
    let blob = gltf.blob.as_deref().expect("the file has a binary part");
    let mut extents = BTreeMap::new();
    for node in gltf.default_scene().expect("the file has a scene").nodes() {
        let Some(mesh) = node.mesh() else { continue };
        let (origin, rotation, scale) = node.transform().decomposed();
        assert_eq!(scale, [1.0; 3]);
        let pose = Mat4::from_rotation_translation(Quat::from_array(rotation), origin.into());
        let name = node.name().expect("nodes have names").to_owned();
        let extent = extents.entry(name).or_insert(NOTHING);
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|_| Some(blob));
            let positions: Vec<Vec3> =
                reader.read_positions().expect("positions").map(Vec3::from).collect();
            let normals: Vec<Vec3> =
                reader.read_normals().expect("normals").map(Vec3::from).collect();
            assert_eq!(positions.len(), normals.len());
            assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "{:?}", node.name());
            let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
            let bounds = primitive.bounding_box();
            for p in &positions {
                assert!(p.cmpge(bounds.min.into()).all() && p.cmple(bounds.max.into()).all());
            }
            let corners = indices.iter().map(|k| pose.transform_point3(positions[*k as usize]));
            grow(extent, indices.len() / 3, corners);
        }
    }
    extents
}

fn extents_of(geometry: &Geometry) -> BTreeMap<String, NodeExtent> {
    let mut extents = BTreeMap::new();
    for instance in &geometry.instances {
        let mesh = &geometry.meshes[instance.mesh as usize];
        let m = glam::Mat3::from_cols_array_2d(&instance.rotation);
        let name = format!("{}{}", class_of(instance.entity), instance.entity);
        let extent = extents.entry(name).or_insert(NOTHING);
        let corners = mesh.triangles.iter().flat_map(|t| t.vertices);
        let points = corners
            .map(|k| m * Vec3::from(mesh.positions[k as usize]) + Vec3::from(instance.origin));
        grow(extent, mesh.triangles.len(), points);
    }
    extents
}

#[test]
fn a_file_holds_every_triangle_where_it_is() {
    for setup in [house(), street()] {
        let geometry = geometry_of(&world(setup));
        let read = extents_in(&chaic_gltf::glb(&geometry, &class_of, &[]));
        let expected = extents_of(&geometry);
        assert!(read.keys().eq(expected.keys()), "{:?}", read.keys());
        for (name, (n, low, high)) in expected {
            let (found, found_low, found_high) = read[&name];
            assert_eq!(found, n, "{name}");
            let error = (found_low - low).abs().max((found_high - high).abs()).max_element();
            assert!(error < 1e-4, "{name} is off by {error} m");
        }
    }
}

#[test]
fn shapes_are_shared_and_materials_and_cameras_match() {
    let world = world(house());
    let mut geometry = geometry_of(&world);
    geometry.remove_entity(EntityId::CEILING);
    let eye = world.camera(AgentId::HELPER, 512);
    let bytes = chaic_gltf::glb(&geometry, &class_of, &[("eye".to_owned(), eye)]);
    assert_eq!(bytes, chaic_gltf::glb(&geometry, &class_of, &[("eye".to_owned(), eye)]));
    let gltf = gltf::Gltf::from_slice(&bytes).expect("the file is valid");
    assert!(gltf.nodes().all(|n| n.name() != Some("ceiling#3")), "the ceiling was removed");
    assert!(gltf.meshes().len() < gltf.nodes().len() - 10, "shapes are shared");
    let apples = |node: &gltf::Node| {
        let extras = node.extras().as_ref().map_or(String::new(), |e| e.get().to_owned());
        extras == format!("{{\"class\":\"thing\",\"entity\":{}}}", chaic_world::Setup::entity(20).0)
    };
    assert_eq!(gltf.nodes().filter(apples).count(), 1);
    // Each color occurs once, including tints.
    let colors: Vec<String> = gltf
        .materials()
        .map(|m| format!("{:?}{:?}", m.pbr_metallic_roughness().base_color_factor(), m.name()))
        .collect();
    assert_eq!(colors.iter().collect::<std::collections::BTreeSet<_>>().len(), colors.len());
    let tints = geometry.instances.iter().filter_map(|i| i.tint);
    for [r, g, b] in tints {
        let exists = gltf
            .materials()
            .any(|m| m.pbr_metallic_roughness().base_color_factor() == [r, g, b, 1.0]);
        assert!(exists, "no material is {r} {g} {b}");
    }
    // Only windows emit light: lamps were removed with the ceilings.
    let mut n_glowing = 0;
    for material in gltf.materials() {
        let name = material.name().expect("materials have names");
        let [r, g, b, _] = material.pbr_metallic_roughness().base_color_factor();
        let is_emissive = name.contains(" glow ") || name.contains(" pane ");
        assert_eq!(
            material.emissive_factor(),
            if is_emissive { [r, g, b] } else { [0.0; 3] },
            "{name}"
        );
        n_glowing += usize::from(is_emissive);
    }
    assert_eq!(n_glowing, 1);
    let node = gltf.nodes().find(|n| n.camera().is_some()).expect("a camera was given");
    let (origin, rotation, _) = node.transform().decomposed();
    assert_eq!(Vec3::from(origin), eye.eye_in_world);
    let forward = Quat::from_array(rotation) * Vec3::NEG_Z;
    assert!((forward - eye.world_from_camera * Vec3::NEG_Z).length() < 1e-6);
}

/// Reads the material colors of each node as bits, by node name.
fn colors_in(file: &[u8]) -> BTreeMap<String, Vec<BTreeSet<[u32; 3]>>> {
    let gltf = gltf::Gltf::from_slice(file).expect("the file is valid");
    let mut colors: BTreeMap<String, Vec<BTreeSet<[u32; 3]>>> = BTreeMap::new();
    for node in gltf.nodes() {
        let Some(mesh) = node.mesh() else { continue };
        let of_material = |primitive: gltf::Primitive| {
            let [r, g, b, a] = primitive.material().pbr_metallic_roughness().base_color_factor();
            assert!([r, g, b].iter().all(|c| (0.0..=1.0).contains(c)) && a == 1.0);
            [r, g, b].map(f32::to_bits)
        };
        let name = node.name().expect("nodes have names").to_owned();
        colors.entry(name).or_default().push(mesh.primitives().map(of_material).collect());
    }
    colors
}

#[test]
fn every_instance_has_the_colors_that_its_factor_makes() {
    let world = world(house());
    let geometry = geometry_in(&world, Appearance::Varied { seed: 5 });
    let file = chaic_gltf::glb(&geometry, &class_of, &[]);
    let found = colors_in(&file);
    let mut expected: BTreeMap<String, Vec<BTreeSet<[u32; 3]>>> = BTreeMap::new();
    for instance in &geometry.instances {
        let mesh = &geometry.meshes[instance.mesh as usize];
        let used: BTreeSet<u8> = mesh.triangles.iter().map(|t| t.material).collect();
        let color = |k: u8| {
            let material = mesh.materials[usize::from(k)];
            let own = instance.tint.filter(|_| material.tinted).unwrap_or(material.color);
            let scaled = |c: usize| (own[c] * instance.factor[c]).min(1.0).to_bits();
            [scaled(0), scaled(1), scaled(2)]
        };
        let name = format!("{}{}", class_of(instance.entity), instance.entity);
        expected.entry(name).or_default().push(used.into_iter().map(color).collect());
    }
    assert_eq!(found, expected);
    assert!(found != colors_in(&chaic_gltf::glb(&geometry_of(&world), &class_of, &[])));

    // Two instances of a shape with the same factor share a mesh; another factor gets its own.
    let mut three = geometry.clone();
    let object =
        geometry.instances.iter().find(|i| i.entity.is_object()).expect("the scene has objects");
    let with_factor = |factor: [f32; 3]| chaic_render::geometry::InstanceData { factor, ..*object };
    three.instances = vec![with_factor([0.5; 3]), with_factor([0.5; 3]), with_factor([0.25; 3])];
    let file = chaic_gltf::glb(&three, &class_of, &[]);
    let gltf = gltf::Gltf::from_slice(&file).expect("the file is valid");
    assert_eq!((gltf.nodes().count(), gltf.meshes().count()), (3, 2));
}

/// Random and hostile setups, states and cameras do not break the encoder.
#[test]
fn hostile_scenes_are_encoded() {
    for seed in 0..120 {
        let case = hostile::case(seed, None);
        let level = case.state.objects.len() % (FINEST_LEVEL + 1);
        let scene = Scene::with_appearance(&case.setup, case.appearance);
        let geometry = scene.geometry(&case.state, &case.postures, level);
        let cameras: Vec<_> = case.views.iter().map(|v| ("camera".to_owned(), v.camera)).collect();
        let file = chaic_gltf::glb(&geometry, &|_| "object", &cameras);
        assert!(file.starts_with(b"glTF"), "seed {seed}");
    }
}
