//! Promise: the exported geometry matches the rendered images.

use std::collections::BTreeSet;

use chaic_core::{AgentId, EntityId, Vec3};
use chaic_render::geometry::{FINEST_LEVEL, Geometry, LightAssignment, N_LEVELS, Texture, tile};
use chaic_render::{Channels, Scene, View};
use chaic_test_kit::scenes::{camera, house, street, world};
use chaic_world::{ObjectLocation, Posture, World};
use glam::Mat3;

fn postures(world: &World) -> Vec<Posture> {
    world.setup().agents().map(|agent| world.posture(agent)).collect()
}

fn geometry_of(world: &World, level: usize) -> Geometry {
    Scene::new(world.setup()).geometry(world.state(), &postures(world), level)
}

/// Returns the nearest triangle that a ray hits: its entity, and the distance in multiples of
/// `ray`.
fn nearest_hit(geometry: &Geometry, eye: Vec3, ray: Vec3) -> Option<(EntityId, f32)> {
    let mut nearest: Option<(EntityId, f32)> = None;
    for instance in &geometry.instances {
        let mesh = &geometry.meshes[instance.mesh as usize];
        let world_from_object = Mat3::from_cols_array_2d(&instance.rotation);
        let inverse = world_from_object.transpose();
        let (o, d) = (inverse * (eye - Vec3::from(instance.origin)), inverse * ray);
        // Test the slabs of the bounding box first.
        let (a, b) = ((Vec3::from(mesh.min) - o) / d, (Vec3::from(mesh.max) - o) / d);
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        if enter > leave || leave < 0.0 {
            continue;
        }
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.vertices.map(|k| Vec3::from(mesh.positions[k as usize]));
            let (e1, e2) = (b - a, c - a);
            let det = e1.dot(d.cross(e2));
            // Counter-clockwise seen from outside: others face away.
            if det <= 1e-12 {
                continue;
            }
            let u = (o - a).dot(d.cross(e2)) / det;
            let v = d.dot((o - a).cross(e1)) / det;
            let t = e2.dot((o - a).cross(e1)) / det;
            let hits = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.05;
            if hits && nearest.is_none_or(|(_, n)| t < n) {
                nearest = Some((instance.entity, t));
            }
        }
    }
    nearest
}

#[test]
fn rays_hit_the_rendered_surfaces() {
    const SIDE: u32 = 256;
    for (setup, eye, yaw) in [
        (house(), [0.7, 1.65, 4.2], -0.7),
        (house(), [5.0, 1.65, 4.1], -0.5),
        (street(), [9.0, 1.65, 0.0], 1.3),
    ] {
        let world = world(setup);
        let camera = camera(eye, yaw, -0.1, SIDE, SIDE);
        let view = View::from_camera(camera, Channels::DEPTH_AND_IDS);
        let images =
            Scene::new(world.setup()).render(&world, &[view]).pop().expect("one image per view");
        let (depth, ids) = (
            images.depth_m.expect("the channel was requested"),
            images.ids.expect("the channel was requested"),
        );
        let geometry = geometry_of(&world, FINEST_LEVEL);
        let (half, focal) = (0.5 * SIDE as f32, camera.focal_px());
        let (mut n, mut n_equal) = (0, 0);
        for row in (5..SIDE).step_by(11) {
            for column in (5..SIDE).step_by(11) {
                let at = (row * SIDE + column) as usize;
                let in_camera =
                    Vec3::new(column as f32 + 0.5 - half, half - row as f32 - 0.5, -focal) / focal;
                let ray = camera.world_from_camera * in_camera;
                let hit = nearest_hit(&geometry, camera.eye_in_world, ray);
                let (entity, hit_m) = hit.unwrap_or((EntityId::NOTHING, depth[at]));
                n += 1;
                n_equal += usize::from(entity.0 == ids[at] && (hit_m - depth[at]).abs() < 0.02);
            }
        }
        // Outlines differ: the renderer uses coarser levels where they suffice.
        assert!(n_equal * 100 >= n * 97, "{n_equal} of {n} from {eye:?}");
    }
}

#[test]
fn shapes_are_shared_and_valid() {
    let world = world(house());
    let levels = Scene::new(world.setup()).geometry_at_all_levels(world.state(), &postures(&world));
    assert_eq!(levels[FINEST_LEVEL], geometry_of(&world, FINEST_LEVEL));
    assert_eq!(levels[FINEST_LEVEL], geometry_of(&world, N_LEVELS + 7), "past the finest");
    let count = |g: &Geometry| g.meshes.iter().map(|m| m.triangles.len()).sum::<usize>();
    assert!(count(&levels[0]) * 3 < count(&levels[FINEST_LEVEL]));
    for level in &levels {
        assert_eq!(level.instances, levels[0].instances);
        assert_eq!(level.meshes.len(), levels[0].meshes.len());
        for mesh in &level.meshes {
            assert_eq!(mesh.positions.len(), mesh.normals.len());
            let n = mesh.positions.len() as u32;
            assert!(mesh.triangles.iter().all(|t| t.vertices.iter().all(|c| *c < n)));
            assert!(mesh.triangles.iter().all(|t| usize::from(t.material) < mesh.materials.len()));
            assert!(mesh.triangles.is_sorted_by_key(|t| t.material));
        }
    }
    // One mesh per class and style, with at most four styles; no unused mesh.
    let used: BTreeSet<u32> = levels[0].instances.iter().map(|i| i.mesh).collect();
    assert!(used.iter().copied().eq(0..levels[0].meshes.len() as u32));
    let things = world.setup().things.iter().map(|t| (t.class, t.scale.map(f32::to_bits)));
    let shapes: BTreeSet<_> = things.collect();
    let objects: Vec<_> = levels[0].instances.iter().filter(|i| i.entity.is_object()).collect();
    let n_meshes = objects.iter().map(|i| i.mesh).collect::<BTreeSet<_>>().len();
    assert!((shapes.len()..=4 * shapes.len()).contains(&n_meshes) && n_meshes < objects.len());
    let lamps =
        levels[0].instances.iter().filter(|i| matches!(i.light_source, LightAssignment::Lamp(_)));
    assert!(lamps.count() > 100, "rooms have lamps");
}

#[test]
fn broken_objects_are_gone_and_people_are_present() {
    let world = world(house());
    let mut state = world.state().clone();
    let entity = chaic_world::Setup::entity(3);
    let scene = Scene::new(world.setup());
    let has = |g: &Geometry, e| g.instances.iter().any(|i| i.entity == e);
    let before = scene.geometry(&state, &postures(&world), 0);
    state.objects[3].location = ObjectLocation::Broken;
    let after = scene.geometry(&state, &postures(&world), 0);
    assert!(has(&before, entity) && !has(&after, entity));
    assert!(has(&after, EntityId::from_agent(AgentId::HELPER)));
    assert_eq!(before.instances.len(), after.instances.len() + 1);
}

#[test]
fn tiles_are_square_and_their_mean_brightness_is_about_1() {
    assert_eq!(tile(Texture::Plain), None);
    let planks = tile(Texture::Planks).expect("has a texture");
    assert_eq!(planks.texels.len(), planks.side_texels * planks.side_texels);
    let mean =
        planks.texels.iter().map(|t| u64::from(*t)).sum::<u64>() / planks.texels.len() as u64;
    assert!((100..150).contains(&mean), "{mean}");
}
