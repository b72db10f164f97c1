//! Promise: unusual batches give clear errors or blank images, removed worlds leave nothing behind,
//! and `Adapters::Hardware` never selects a software device.

use crate::common::{episode, gpu, views};
use chaic_core::capability::Eyesight;
use chaic_core::geom::Camera;
use chaic_core::{EntityId, Quat, Vec3};
use chaic_render::{Channels, View};
use chaic_render_gpu::{Adapters, Gpu, GpuError};

const EPISODE: &str = "high_goal/train/00";

#[test]
fn no_views_give_no_images() {
    let Some(mut gpu) = gpu("empty batches") else { return };
    let batch = gpu.render(&[]).expect("an empty batch is valid");
    assert_eq!((batch.n_views(), batch.size()), (0, (0, 0)));
    assert_eq!(batch.read().expect("an empty batch can be read"), []);
}

#[test]
fn empty_images_are_empty_and_unusual_sizes_are_drawn() {
    let Some(mut gpu) = gpu("odd sizes") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("the world fits on the device");
    let eye = views(&world, 64, Channels::ALL)[1];
    for (width, height) in [(0, 0), (0, 7), (7, 0), (1, 1), (1, 65), (33, 3), (97, 64)] {
        let view = View { camera: Camera { width, height, ..eye.camera }, ..eye };
        let batch = gpu.render(&[(id, view), (id, view)]).expect("the batch is valid");
        for images in batch.read().expect("the images can be read") {
            let n = (width * height) as usize;
            let ids = images.ids.expect("the channel was requested");
            assert_eq!(images.rgb.map(|b| b.len()), Some(3 * n));
            assert_eq!(images.depth_m.map(|b| b.len()), Some(n));
            let cpu =
                scene.render(&world, &[view]).remove(0).ids.expect("the channel was requested");
            let n_equal = ids.iter().zip(&cpu).filter(|(a, b)| a == b).count();
            assert!(
                ids.len() == n && 100 * n_equal >= 98 * n,
                "{width}x{height}: {n_equal} of {n}"
            );
        }
    }
}

#[test]
fn invalid_cameras_render_background() {
    let Some(mut gpu) = gpu("odd cameras") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("the world fits on the device");
    let good = views(&world, 40, Channels::ALL)[0];
    let invalid = [
        Camera { eye_in_world: Vec3::NAN, ..good.camera },
        Camera { eye_in_world: Vec3::splat(f32::INFINITY), ..good.camera },
        Camera { vertical_fov_rad: f32::NAN, ..good.camera },
        Camera { vertical_fov_rad: 0.0, ..good.camera },
        Camera { world_from_camera: Quat::from_xyzw(0.0, f32::NAN, 0.0, 1.0), ..good.camera },
        Camera { world_from_camera: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good.camera },
    ];
    let invalid = invalid.map(|camera| (id, View { camera, ..good }));
    let images =
        gpu.render(&invalid).expect("the batch is valid").read().expect("the images can be read");
    for ((_, view), gpu) in invalid.iter().zip(images) {
        assert_eq!(gpu, scene.render(&world, &[*view]).remove(0));
        assert!(
            gpu.ids.expect("the channel was requested").iter().all(|id| *id == EntityId::NOTHING.0)
        );
    }
}

#[test]
fn objects_with_invalid_poses_are_left_out() {
    let Some(mut gpu) = gpu("odd things") else { return };
    let (world, scene) = episode(EPISODE);
    let mut state = world.state().clone();
    for (k, object) in state.objects.iter_mut().enumerate() {
        match k % 3 {
            0 => object.position = Vec3::NAN,
            1 => object.rotation = Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0),
            _ => {}
        }
    }
    let postures: Vec<_> = world.setup().agents().map(|a| world.posture(a)).collect();
    let id = gpu.add_state(&scene, &state, &postures).expect("the world fits on the device");
    let view = views(&world, 128, Channels::DEPTH_AND_IDS)[1];
    let gpu = gpu
        .render(&[(id, view)])
        .expect("the batch is valid")
        .read()
        .expect("the images can be read");
    let cpu = scene
        .render_state(&state, &postures, &[view])
        .remove(0)
        .ids
        .expect("the channel was requested");
    let ids = gpu[0].ids.as_ref().expect("the channel was requested");
    let n_equal = ids.iter().zip(&cpu).filter(|(a, b)| a == b).count();
    assert!(1000 * n_equal > 995 * cpu.len(), "{n_equal} of {}", cpu.len());
}

#[test]
fn invalid_batches_give_errors() {
    let Some(mut gpu) = gpu("errors") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("the world fits on the device");
    let view = views(&world, 512, Channels::DEPTH_AND_IDS)[0];
    let sized = |width, height| View { camera: Camera { width, height, ..view.camera }, ..view };
    let mixed = gpu.render(&[(id, view), (id, sized(256, 512))]).expect_err("the sizes differ");
    assert!(mixed.to_string().contains("view 1 is 256x512 pixels"), "{mixed}");
    let many = vec![(id, sized(1, 1)); chaic_render_gpu::MAX_VIEWS + 1];
    let many = gpu.render(&many).expect_err("there are too many views");
    assert!(many.to_string().contains("render at most 65535 at a time"), "{many}");
    let large = gpu
        .render(&[(id, sized(chaic_render::MAX_SIDE_PX + 1, 8))])
        .expect_err("the views are too large");
    assert!(matches!(large, GpuError::TooLargeBatch { max: 0, .. }), "{large}");
    let sight = Eyesight { range_m: 2.0, blur_rad: 0.0, field_rad: 3.0, lowered_rad: 0.0 };
    let limited = View { sight: Some(sight), ..view };
    let limited = gpu.render(&[(id, view), (id, limited)]).expect_err("sight cannot be limited");
    assert!(matches!(limited, GpuError::LimitedEyesight { index: 1 }), "{limited}");
    gpu.remove(id).expect("the world is on the device");
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
    let first = gpu.add(&scene, &world).expect("the world fits on the device");
    let alone = gpu
        .render(&[(first, view)])
        .expect("the batch is valid")
        .read()
        .expect("the images can be read");
    let more: Vec<_> =
        (0..40).map(|_| gpu.add(&scene, &world).expect("the world fits on the device")).collect();
    let bytes = gpu.world_bytes();
    for id in more {
        gpu.update(id, &other_scene, &other).expect("the world fits on the device");
        gpu.update(id, &scene, &world).expect("the world fits on the device");
        gpu.remove(id).expect("the world is on the device");
    }
    // Pools may have grown for one world of the other episode at most.
    assert!(gpu.world_bytes() <= 4 * bytes, "{} became {}", bytes, gpu.world_bytes());
    let again = gpu
        .render(&[(first, view)])
        .expect("the batch is valid")
        .read()
        .expect("the images can be read");
    assert_eq!(alone, again);
}

#[test]
fn images_do_not_depend_on_the_batch() {
    let Some(mut gpu) = gpu("company") else { return };
    let (world, scene) = episode(EPISODE);
    let id = gpu.add(&scene, &world).expect("the world fits on the device");
    let agent_views = views(&world, 96, Channels::ALL);
    let requests: Vec<_> = agent_views.iter().map(|view| (id, *view)).collect();
    let together =
        gpu.render(&requests).expect("the batch is valid").read().expect("the images can be read");
    for (one, together) in requests.iter().zip(&together) {
        let alone = gpu
            .render(&[*one])
            .expect("the batch is valid")
            .read()
            .expect("the images can be read");
        assert_eq!(&alone[0], together);
    }
}

#[test]
fn hardware_adapters_exclude_software_devices() {
    match Gpu::new(Adapters::Hardware) {
        Ok(gpu) => assert!(!gpu.name().contains("Cpu"), "{}", gpu.name()),
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains("discrete, virtual, integrated"), "{text}");
            assert!(text.contains("mesa-vulkan-drivers"), "{text}");
        }
    }
}
