//! The promise of this file: odd batches give clear errors or blank pictures, worlds come and go
//! without leaving anything behind, and who asks for a card gets no stand-in.

mod common;

use chaic_core::geom::Camera;
use chaic_core::{EntityId, Quat, Vec3};
use chaic_render::{Channels, View};
use chaic_render_gpu::{Adapters, Gpu, GpuError};
use common::{episode, gpu, views};

const EPISODE: &str = "high_goal/train/00";

#[test]
fn no_views_give_no_images() {
    let Some(mut gpu) = gpu("no views") else { return };
    let batch = gpu.render(&[]).expect("nothing is easy");
    assert_eq!((batch.n_views(), batch.size()), (0, (0, 0)));
    assert_eq!(batch.read().expect("nothing comes back"), []);
}

#[test]
fn images_without_pixels_are_empty_and_odd_sizes_are_drawn() {
    let Some(mut gpu) = gpu("odd sizes") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("it fits");
    let eye = views(&world, 64, Channels::ALL)[1];
    for (width, height) in [(0, 0), (0, 7), (7, 0), (1, 1), (1, 65), (33, 3), (97, 64)] {
        let view = View { camera: Camera { width, height, ..eye.camera }, ..eye };
        let batch = gpu.render(&[(id, view), (id, view)]).expect("it is drawn");
        for images in batch.read().expect("it comes back") {
            let n = (width * height) as usize;
            let ids = images.ids.expect("asked for");
            assert_eq!(images.rgb.map(|b| b.len()), Some(3 * n));
            assert_eq!(images.depth_m.map(|b| b.len()), Some(n));
            let cpu = scene.render(&world, &[view]).remove(0).ids.expect("asked for");
            let same = ids.iter().zip(&cpu).filter(|(a, b)| a == b).count();
            assert!(ids.len() == n && 100 * same >= 98 * n, "{width}x{height}: {same} of {n}");
        }
    }
}

#[test]
fn cameras_without_sense_see_nothing() {
    let Some(mut gpu) = gpu("odd cameras") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("it fits");
    let good = views(&world, 40, Channels::ALL)[0];
    let odd = [
        Camera { eye_in_world: Vec3::NAN, ..good.camera },
        Camera { eye_in_world: Vec3::splat(f32::INFINITY), ..good.camera },
        Camera { vertical_fov_rad: f32::NAN, ..good.camera },
        Camera { vertical_fov_rad: 0.0, ..good.camera },
        Camera { world_from_camera: Quat::from_xyzw(0.0, f32::NAN, 0.0, 1.0), ..good.camera },
        Camera { world_from_camera: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good.camera },
    ];
    let odd = odd.map(|camera| (id, View { camera, ..good }));
    let images = gpu.render(&odd).expect("it is drawn").read().expect("it comes back");
    for ((_, view), gpu) in odd.iter().zip(images) {
        assert_eq!(gpu, scene.render(&world, &[*view]).remove(0));
        assert!(gpu.ids.expect("asked for").iter().all(|id| *id == EntityId::NOTHING.0));
    }
}

#[test]
fn things_without_a_place_are_left_out() {
    let Some(mut gpu) = gpu("odd things") else { return };
    let (world, scene) = episode(EPISODE);
    let mut state = world.state().clone();
    for (k, thing) in state.things.iter_mut().enumerate() {
        match k % 3 {
            0 => thing.position = Vec3::NAN,
            1 => thing.rotation = Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0),
            _ => {}
        }
    }
    let postures: Vec<_> = world.setup().agents().map(|a| world.posture(a)).collect();
    let id = gpu.add_state(&scene, &state, &postures).expect("it fits");
    let view = views(&world, 128, Channels::DEPTH_AND_IDS)[1];
    let gpu = gpu.render(&[(id, view)]).expect("it is drawn").read().expect("it comes back");
    let cpu = scene.render_state(&state, &postures, &[view]).remove(0).ids.expect("asked for");
    let ids = gpu[0].ids.as_ref().expect("asked for");
    let same = ids.iter().zip(&cpu).filter(|(a, b)| a == b).count();
    assert!(1000 * same > 995 * cpu.len(), "{same} of {}", cpu.len());
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let Some(mut gpu) = gpu("errors") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("it fits");
    let view = views(&world, 512, Channels::DEPTH_AND_IDS)[0];
    let sized = |width, height| View { camera: Camera { width, height, ..view.camera }, ..view };
    let mixed = gpu.render(&[(id, view), (id, sized(256, 512))]).expect_err("two sizes");
    assert!(mixed.to_string().contains("view 1 is 256x512 pixels"), "{mixed}");
    let many = vec![(id, sized(1, 1)); chaic_render_gpu::MAX_VIEWS + 1];
    let many = gpu.render(&many).expect_err("too many");
    assert!(many.to_string().contains("render at most 65535 at a time"), "{many}");
    let large = gpu.render(&[(id, sized(chaic_render::MAX_SIDE_PX + 1, 8))]).expect_err("large");
    assert!(matches!(large, GpuError::TooLargeBatch { most: 0, .. }), "{large}");
    gpu.remove(id).expect("it is there");
    assert!(matches!(gpu.render(&[(id, view)]), Err(GpuError::UnknownWorld(_))));
    assert!(matches!(gpu.update(id, &scene, &world), Err(GpuError::UnknownWorld(_))));
    assert!(matches!(gpu.remove(id), Err(GpuError::UnknownWorld(_))));
}

#[test]
fn worlds_share_shapes_and_leave_nothing_behind() {
    let Some(mut gpu) = gpu("worlds") else { return };
    let (world, scene) = episode(EPISODE);
    let (other, other_scene) = episode("shopping/train/01");
    let view = views(&world, 64, Channels::DEPTH_AND_IDS)[1];
    let first = gpu.add(&scene, &world).expect("it fits");
    let alone = gpu.render(&[(first, view)]).expect("drawn").read().expect("it comes back");
    let more: Vec<_> = (0..40).map(|_| gpu.add(&scene, &world).expect("it fits")).collect();
    let bytes = gpu.bytes_of_worlds();
    for id in more {
        gpu.update(id, &other_scene, &other).expect("it fits");
        gpu.update(id, &scene, &world).expect("it fits");
        gpu.remove(id).expect("it is there");
    }
    // Rooms for one world of the other kind at most came to it.
    assert!(gpu.bytes_of_worlds() <= 4 * bytes, "{} became {}", bytes, gpu.bytes_of_worlds());
    let again = gpu.render(&[(first, view)]).expect("drawn").read().expect("it comes back");
    assert_eq!(alone, again);
}

#[test]
fn many_rounds_and_any_company_give_the_same_images() {
    let Some(mut gpu) = gpu("company") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("it fits");
    let looks = views(&world, 96, Channels::ALL);
    let asked: Vec<_> = looks.iter().map(|view| (id, *view)).collect();
    let together = gpu.render(&asked).expect("drawn").read().expect("it comes back");
    for (one, together) in asked.iter().zip(&together) {
        let alone = gpu.render(&[*one]).expect("drawn").read().expect("it comes back");
        assert_eq!(&alone[0], together);
    }
}

#[test]
fn who_asks_for_a_card_gets_no_program() {
    match Gpu::new(Adapters::Cards) {
        Ok(gpu) => assert!(!gpu.name().contains("Cpu"), "{}", gpu.name()),
        Err(error) => {
            let told = error.to_string();
            assert!(told.contains("discrete, virtual, integrated"), "{told}");
            assert!(told.contains("mesa-vulkan-drivers"), "{told}");
        }
    }
}
