//! Promise: depth and ids match the geometry, color does not affect them, nothing depends on
//! threads, and no camera breaks the renderer.

use chaic_core::capability::{Eyesight, Persona};
use chaic_core::geom::{Camera, Rect};
use chaic_core::observation::Images;
use chaic_core::{AgentId, ClassId, EntityId, Vec3};
use chaic_render::{
    Channels, Labels, MAX_SIDE_PX, Scene, View, WorldViews, floor_plan, image_out, render_batch,
};
use chaic_test_kit::scenes;
use chaic_test_kit::scenes::{camera, empty, object, posture, wall, world};
use chaic_world::{ObjectSpec, Setup, Wall, World};

const DEPTH_AND_IDS: Channels = Channels::DEPTH_AND_IDS;

fn view(camera: Camera) -> View {
    View::from_camera(camera, DEPTH_AND_IDS)
}

fn render(world: &World, view: View) -> Images {
    let scene = Scene::new(world.setup());
    scene.render(world, &[view]).pop().expect("one image per view")
}

fn depth_and_ids(setup: Setup, camera: Camera) -> (Vec<f32>, Vec<u16>) {
    let images = render(&world(setup), view(camera));
    (
        images.depth_m.expect("the channel was requested"),
        images.ids.expect("the channel was requested"),
    )
}

/// A wall whose face is at z = -3, 4 m wide and 3 m high.
fn wall_ahead() -> Setup {
    let mut setup = empty();
    let ahead = Wall { thickness_m: 0.2, top_m: 3.0, ..wall([-2.0, -3.1], [2.0, -3.1]) };
    setup.walls.push(ahead);
    setup
}

#[test]
fn a_wall_3_m_ahead_has_a_depth_of_3_m() {
    let (depth, ids) = depth_and_ids(wall_ahead(), camera([0.0, 1.6, 0.0], 0.0, 0.0, 512, 512));
    let at = |row: usize, column: usize| (depth[row * 512 + column], ids[row * 512 + column]);
    let (d, id) = at(256, 256);
    assert!((d - 3.0).abs() < 1e-3, "{d}");
    assert_eq!(id, EntityId::WALL.0);
    // Depth is along the camera axis: the same over the whole face.
    assert!((at(256, 120).0 - 3.0).abs() < 1e-3 && (at(180, 300).0 - 3.0).abs() < 1e-3);
    // The floor 1.6 m below: row r sees depth 1.6 * 256 / (r + 0.5 - 256).
    let (d, id) = at(500, 256);
    assert!((d - 1.6 * 256.0 / 244.5).abs() < 1e-3, "{d}");
    assert_eq!(id, EntityId::FLOOR.0);
    assert_eq!(at(2, 2), (Camera::FAR_M, EntityId::NOTHING.0));
}

#[test]
fn a_box_covers_the_projected_pixels() {
    // The wall face is 4.2 m wide (ends overlap by half a thickness). Its top is 1.4 m above the
    // eye and 3 m ahead, at a focal length of 256 px.
    let (_, ids) = depth_and_ids(wall_ahead(), camera([0.0, 1.6, 0.0], 0.0, 0.0, 512, 512));
    let row = &ids[200 * 512..201 * 512];
    let width_px = row.iter().filter(|id| **id == EntityId::WALL.0).count() as f32;
    assert!((width_px - 4.2 / 3.0 * 256.0).abs() <= 1.0, "{width_px}");
    let top = (0..512)
        .find(|r| ids[r * 512 + 256] == EntityId::WALL.0)
        .expect("the wall is in view") as f32;
    assert!((top - (256.0 - 1.4 / 3.0 * 256.0)).abs() <= 1.0, "{top}");
}

#[test]
fn the_nearer_object_occludes_the_farther() {
    let mut setup = wall_ahead();
    setup.things.push(ObjectSpec { fixed: true, ..object("refrigerator", 0.0, -1.8, 0.0) });
    setup.things.push(ObjectSpec { fixed: true, ..object("refrigerator", 0.0, -4.5, 0.0) });
    let (near, far) = (Setup::entity(1).0, Setup::entity(2).0);
    let (depth, ids) = depth_and_ids(setup, camera([0.0, 1.2, 0.0], 0.0, 0.0, 256, 256));
    assert_eq!(ids[128 * 256 + 128], near);
    assert!(depth[128 * 256 + 128] < 1.8);
    assert!(!ids.contains(&far), "the object is behind the wall");
    assert!(ids.contains(&EntityId::WALL.0));
}

#[test]
fn occluded_objects_cover_no_pixel_in_any_draw_order() {
    // Occlusion culling must never remove a visible object: compare with a world without walls.
    let mut open = empty();
    for k in 0..12 {
        open.things
            .push(ObjectSpec { fixed: true, ..object("stool", -3.0 + 0.5 * k as f32, -4.0, 0.3) });
    }
    let mut walled = open.clone();
    walled.walls.push(Wall { top_m: 2.5, ..wall([-0.5, -2.0], [0.7, -2.0]) });
    let eye = camera([0.0, 1.5, 0.0], 0.1, -0.2, 320, 200);
    let ((_, open), (_, walled)) = (depth_and_ids(open, eye), depth_and_ids(walled, eye));
    for (a, b) in open.iter().zip(&walled) {
        assert!(a == b || *b == EntityId::WALL.0, "{a} became {b}");
    }
    assert!(walled.iter().any(|id| *id >= Setup::entity(1).0));
}

#[test]
fn an_eye_does_not_see_its_own_body() {
    let setup = empty();
    let world = world(setup);
    let eye = world.camera(AgentId::PARTNER, 128);
    let body = EntityId::from_agent(AgentId::PARTNER).0;
    let own = render(&world, View::from_eye(AgentId::PARTNER, eye, DEPTH_AND_IDS));
    assert!(!own.ids.expect("the channel was requested").contains(&body));
    let other = camera([-9.0, 1.6, 7.0], std::f32::consts::PI, 0.0, 128, 128);
    let visible_ids = render(&world, view(other)).ids.expect("the channel was requested");
    let n = visible_ids.iter().filter(|id| **id == body).count();
    assert!((300..6000).contains(&n), "an adult 2 m away covers {n} pixels");
}

#[test]
fn color_affects_neither_depth_nor_ids() {
    let world = world(scenes::house());
    let camera = camera([5.0, 1.6, 4.0], -0.5, 0.0, 200, 160);
    let without = render(&world, view(camera));
    let with = render(&world, View { channels: Channels::ALL, ..view(camera) });
    assert_eq!((without.depth_m, without.ids), (with.depth_m, with.ids));
    assert_eq!(without.rgb, None);
    let rgb = with.rgb.expect("the channel was requested");
    let mean = rgb.iter().map(|c| u64::from(*c)).sum::<u64>() / rgb.len() as u64;
    assert!((80..230).contains(&mean), "a lit room has a mean of {mean}");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let views: Vec<View> = (0..9)
        .map(|k| {
            let c = camera([2.0 + k as f32, 1.5, 4.0], 0.7 * k as f32, -0.1, 96, 64 + k);
            View { channels: Channels::ALL, ..view(c) }
        })
        .collect();
    let all = [1, 2, 4].map(|n| {
        let world = world(scenes::house());
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("the thread pool starts");
        pool.install(|| Scene::new(world.setup()).render(&world, &views))
    });
    assert!(all[0] == all[1] && all[1] == all[2]);
    let world = world(scenes::house());
    assert_eq!(all[0][3], render(&world, views[3]), "a single view gives the same image");
}

#[test]
fn a_batch_of_worlds_gives_the_same_images_as_single_renders() {
    let worlds = [wall_ahead(), scenes::house(), scenes::street(), empty()].map(world);
    let scenes: Vec<Scene> = worlds.iter().map(|w| Scene::new(w.setup())).collect();
    let eyes = [[0.0, 1.6, 0.0], [1.0, 1.2, 2.0], [0.6, 1.65, 2.2]];
    let views: Vec<View> = eyes
        .iter()
        .zip([Channels::ALL, Channels::RGB, DEPTH_AND_IDS])
        .map(|(eye, channels)| View { channels, ..view(camera(*eye, 0.4, -0.1, 93, 57)) })
        .collect();
    let batch: Vec<WorldViews> = worlds
        .iter()
        .zip(&scenes)
        .enumerate()
        .map(|(k, (world, scene))| WorldViews { scene, world, views: &views[..k % 4] })
        .collect();
    let alone: Vec<Vec<Images>> =
        batch.iter().map(|b| Scene::new(b.world.setup()).render(b.world, b.views)).collect();
    for n_threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .expect("the thread pool starts");
        let mut images = vec![Vec::new(); 9];
        pool.install(|| render_batch(&batch, &mut images));
        assert!(images == alone, "{n_threads} threads");
    }
}

#[test]
fn labels_match_images() {
    let world = world(wall_ahead());
    let scene = Scene::new(world.setup());
    let view = view(camera([0.0, 1.6, 0.0], 0.0, 0.0, 64, 48));
    let images = scene.render(&world, &[view]).pop().expect("one image per view");
    let labels = scene.label(&world, &view);
    assert_eq!(Some(&labels.ids), images.ids.as_ref());
    let mm = images.depth_m.iter().flatten().map(|d| chaic_render::depth_mm(*d));
    assert!(mm.eq(labels.depth_mm.iter().copied()));
    let normals = labels.normals.as_chunks::<3>().0;
    let mut n_wall = 0;
    for (k, (id, normal)) in labels.ids.iter().zip(normals).enumerate() {
        let class = scene.class_of(EntityId(*id)).map_or(Labels::NO_CLASS, |c| c.index() as u8);
        assert_eq!(labels.classes[k], class);
        // The wall faces the eye, the floor faces up; the background has no normal.
        let expected = match EntityId(*id) {
            EntityId::WALL => [0.0, 0.0, 1.0],
            EntityId::FLOOR => [0.0, 1.0, 0.0],
            EntityId::NOTHING => [0.0; 3],
            _ => continue,
        };
        n_wall += usize::from(EntityId(*id) == EntityId::WALL);
        let error = normal.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(error < 1e-5, "{k}: {id} {normal:?}");
    }
    assert!(n_wall > 500, "{n_wall} pixels of wall");
    assert!(labels.depth_mm.contains(&2999) || labels.depth_mm.contains(&3000));
}

#[test]
fn labels_end_at_the_limits_of_sight() {
    let world = world(wall_ahead());
    let scene = Scene::new(world.setup());
    let sight =
        Eyesight { range_m: 2.0, blur_rad: 0.0, field_rad: std::f32::consts::PI, lowered_rad: 0.0 };
    let complete = view(camera([0.0, 1.6, 0.0], 0.0, 0.0, 64, 48));
    assert!(scene.label(&world, &complete).ids.contains(&EntityId::WALL.0));
    let view = View { sight: Some(sight), ..complete };
    let images = scene.render(&world, &[view]).pop().expect("one image per view");
    let labels = scene.label(&world, &view);
    assert_eq!(Some(&labels.ids), images.ids.as_ref());
    let mm = images.depth_m.iter().flatten().map(|d| chaic_render::depth_mm(*d));
    assert!(mm.eq(labels.depth_mm.iter().copied()));
    assert!(labels.ids.contains(&EntityId::FLOOR.0) && !labels.ids.contains(&EntityId::WALL.0));
    let normals = labels.normals.as_chunks::<3>().0;
    for (id, normal) in labels.ids.iter().zip(normals) {
        assert_eq!(*id == EntityId::NOTHING.0, *normal == [0.0; 3], "{id} {normal:?}");
    }
}

#[test]
fn round_objects_have_smooth_normals() {
    let mut setup = empty();
    let apple = object("apple", 0.0, -0.6, 0.0);
    setup.things.push(ObjectSpec { position: Vec3::new(0.0, 1.6, -0.6), ..apple });
    let world = world(setup);
    let scene = Scene::new(world.setup());
    let view = view(camera([0.0, 1.63, 0.0], 0.0, 0.0, 256, 256));
    let labels = scene.label(&world, &view);
    let class = ClassId::named("apple").index() as u8;
    let visible_ids: Vec<usize> = (0..256 * 256).filter(|k| labels.classes[*k] == class).collect();
    assert!(visible_ids.len() > 100, "{} pixels", visible_ids.len());
    let normals = labels.normals.as_chunks::<3>().0;
    let mut left = 0.0;
    for k in &visible_ids {
        let [x, y, z] = normals[*k];
        assert!((x * x + y * y + z * z - 1.0).abs() < 1e-4);
        left += x * (if k % 256 < 128 { -1.0 } else { 1.0 });
    }
    assert!(left / visible_ids.len() as f32 > 0.2, "normals point outward at the sides: {left}");
}

#[test]
fn depth_leads_back_to_the_surface() {
    let mut setup = wall_ahead();
    setup.walls.clear();
    let size = Vec3::from(ClassId::named("refrigerator").info().size_m);
    let fridge = ObjectSpec { fixed: true, ..object("refrigerator", 0.3, -2.5, 0.6) };
    setup.things.push(fridge);
    let camera = camera([0.5, 1.7, 0.2], 0.1, -0.25, 256, 192);
    let (depth, ids) = depth_and_ids(setup, camera);
    let mut n = 0;
    for row in 0..192u32 {
        for column in 0..256u32 {
            let k = (row * 256 + column) as usize;
            let p = camera.unproject(column, row, depth[k]);
            if ids[k] == EntityId::FLOOR.0 {
                assert!(p.y.abs() < 2e-3, "{p}");
            } else if ids[k] == Setup::entity(1).0 {
                let own = chaic_core::geom::rotate_yaw(p - fridge.position, -fridge.yaw_rad);
                let out = (own.abs() - Vec3::new(0.5 * size.x, size.y, 0.5 * size.z)).max_element();
                assert!(out < 5e-3, "{own} is outside of {size}");
                n += 1;
            }
        }
    }
    assert!(n > 1000, "{n}");
}

#[test]
fn triangles_behind_the_camera_are_clipped() {
    // A long wall 0.3 m to the left, from far behind to far ahead.
    let mut setup = empty();
    setup.walls.push(Wall { thickness_m: 0.2, top_m: 3.0, ..wall([-0.4, 9.0], [-0.4, -9.0]) });
    let (depth, ids) = depth_and_ids(setup, camera([0.0, 1.5, 0.0], 0.0, 0.0, 128, 128));
    for column in 0..56 {
        assert_eq!(ids[64 * 128 + column], EntityId::WALL.0, "column {column}");
        let expected = 0.3 * 64.0 / (63.5 - column as f32);
        let d = depth[64 * 128 + column];
        assert!((d - expected).abs() < 1e-3 * expected, "column {column}: {d}, not {expected}");
    }
}

#[test]
fn invalid_cameras_give_blank_images() {
    let world = world(scenes::house());
    let good = camera([5.0, 1.6, 4.0], 0.0, 0.0, 40, 30);
    let mut invalid = vec![
        Camera { eye_in_world: Vec3::NAN, ..good },
        Camera { eye_in_world: Vec3::splat(f32::INFINITY), ..good },
        Camera { vertical_fov_rad: 0.0, ..good },
        Camera { vertical_fov_rad: f32::NAN, ..good },
        Camera { world_from_camera: chaic_core::Quat::from_xyzw(0.0, f32::NAN, 0.0, 1.0), ..good },
        Camera { world_from_camera: chaic_core::Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good },
    ];
    for camera in &invalid {
        let images = render(&world, View { channels: Channels::ALL, ..view(*camera) });
        assert_eq!(images.rgb.map(|b| b.len()), Some(40 * 30 * 3));
        assert!(
            images.depth_m.expect("the channel was requested").iter().all(|d| *d == Camera::FAR_M)
        );
        assert!(images.ids.expect("the channel was requested").iter().all(|id| *id == 0));
    }
    invalid.clear();
    for (width, height) in [(0, 0), (0, 7), (7, 0), (1, 1), (1, 300), (333, 3)] {
        let images = render(
            &world,
            View { channels: Channels::ALL, ..view(Camera { width, height, ..good }) },
        );
        assert_eq!(images.ids.map(|b| b.len()), Some((width * height) as usize));
    }
    let huge = Camera { width: MAX_SIDE_PX + 1, ..good };
    assert_eq!(render(&world, view(huge)), Images::default());
    // Eyes inside a wall, below the ground, and inside furniture; straight up and down.
    for (eye, pitch) in [
        ([4.5, 1.0, 1.0], 0.3),
        ([5.0, -1.0, 4.0], 0.0),
        ([1.5, 0.3, 3.0], 0.0),
        ([5.0, 1.0, 3.0], std::f32::consts::FRAC_PI_2),
        ([5.0, 1.0, 3.0], -std::f32::consts::FRAC_PI_2),
    ] {
        render(&world, View { channels: Channels::ALL, ..view(camera(eye, 0.4, pitch, 64, 64)) });
    }
}

#[test]
fn invalid_postures_are_drawn() {
    let world = world(empty());
    let scene = Scene::new(world.setup());
    for persona in Persona::ALL {
        let mut p = posture(persona, 0.0, 0.0, 0.0);
        (p.bend, p.stretch, p.walked_m, p.height_m) = (f32::NAN, 7.0, f32::INFINITY, -1.0);
        p.arms[0].hand_in_body = Vec3::NAN;
        p.arms[1].hand_in_body = Vec3::splat(1e30);
        let view_of_body =
            View { channels: Channels::ALL, ..view(camera([0.0, 0.3, 1.0], 0.0, 0.0, 64, 64)) };
        let images = scene.render_state(world.state(), &[p], &[view_of_body]);
        let body = EntityId::from_agent(AgentId::PARTNER).0;
        assert!(
            images[0].ids.as_ref().expect("the channel was requested").contains(&body),
            "{persona:?}"
        );
    }
}

#[test]
fn a_plan_shows_walls_people_and_a_legend() {
    let world = world(scenes::house());
    let map = floor_plan::draw(&world, 400);
    assert_eq!(map.width(), 400);
    assert!(map.height() > 200, "the house is twice as wide as deep");
    let dark = map.pixels().filter(|p| p.0.iter().all(|c| *c < 70)).count();
    assert!(dark > 1000, "walls are dark: {dark}");
    let teal = map.pixels().filter(|p| p.0 == [16, 136, 140]).count();
    assert!(teal > 20, "the helper's marker: {teal}");
    assert!(image_out::ids_view(&[0; 4], 2, 2).is_some());
}

#[test]
fn a_plan_of_a_deep_place_shows_both_ends() {
    // 1.6 m by 100.6 m with the margin: 200 pixels wide, the map would be 12,575 pixels high.
    let mut setup = empty();
    setup.bounds = Rect::new([-0.5, -50.0], [0.5, 50.0]);
    setup.people = [-49.0, 49.0].map(|z| scenes::person(Persona::Adult, 0.0, z, 0.0)).to_vec();
    let world = world(setup);
    let map = floor_plan::draw(&world, 200);
    assert_eq!(map.width(), 130);
    let map_height_px = (130.0 * floor_plan::relative_height(&world)) as u32;
    assert!((8000..=MAX_SIDE_PX).contains(&map_height_px), "{map_height_px} pixels");
    let has_color = |color: [u8; 3], rows: std::ops::Range<u32>| {
        let mut pixels = map.enumerate_pixels().filter(|(_, y, _)| rows.contains(y));
        pixels.any(|(_, _, pixel)| pixel.0 == color)
    };
    assert!(has_color([208, 64, 40], 0..200), "the partner at one end");
    assert!(
        has_color([16, 136, 140], map_height_px - 200..map_height_px),
        "the helper at the other"
    );
}

#[test]
fn images_do_not_depend_on_earlier_frames() {
    let world = world(scenes::street());
    let channels = Channels::ALL;
    let views = [
        View { channels, ..view(camera([9.0, 1.65, 0.0], 1.3, -0.2, 96, 64)) },
        View { channels: DEPTH_AND_IDS, ..view(camera([4.0, 1.65, 0.0], 0.3, -0.2, 64, 96)) },
    ];
    // Shadows of objects are cached between frames, but not when an object has moved.
    let mut moved = world.state().clone();
    let index = moved.objects.iter().position(|t| t.position.y < 0.01).expect("one on the ground");
    moved.objects[index].position += Vec3::new(0.0, 0.0, 1.5);
    let scene = Scene::new(world.setup());
    let before = scene.render(&world, &views);
    let after = scene.render_state(&moved, &[], &views);
    assert!(after == Scene::new(world.setup()).render_state(&moved, &[], &views));
    assert!(before[0] != after[0]);
    // Images of other sizes and channels, with other content, are overwritten.
    let mut images = after.into_iter().rev().collect();
    scene.render_into(&world, &views, &mut images);
    assert!(images == before);
}
