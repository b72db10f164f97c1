//! Draws all that can be seen, to be looked at by a person:
//! `cargo run --release -p chaic-render --example gallery -- FOLDER`.

#[path = "../tests/scenes/mod.rs"]
mod scenes;

use std::path::Path;

use chaic_protocol::capability::Persona;
use chaic_protocol::{ClassId, Role, Vec3};
use chaic_render::text::{self, Align};
use chaic_render::{Channels, Scene, View, image_out, plan};
use chaic_world::{FloorMaterial, Posture, Setup, Thing, World};
use image::RgbImage;
use scenes::{camera, posture};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: gallery FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    classes(folder)?;
    people(folder)?;
    let (house, street) = (scenes::world(scenes::house()), scenes::world(scenes::street()));
    for (name, world, cameras) in [
        (
            "house",
            &house,
            vec![
                camera([5.0, 1.65, 4.1], -0.5, 0.0, 768, 768),
                camera([0.7, 1.65, 4.2], -0.7, -0.2, 768, 768),
                camera([9.3, 1.65, 0.6], -2.4, -0.2, 768, 768),
                camera([14.0, 1.2, 4.2], -0.7, -0.1, 768, 768),
            ],
        ),
        (
            "street",
            &street,
            vec![
                camera([0.5, 1.65, 4.5], 0.1, 0.0, 768, 768),
                camera([9.0, 1.65, 0.0], 1.3, 0.0, 768, 768),
                camera([-3.0, 1.0, -3.0], -0.6, 0.0, 768, 768),
                camera([-12.0, 3.0, 8.0], -0.7, -0.3, 768, 768),
            ],
        ),
    ] {
        views(folder, name, world, &cameras)?;
        plan::draw(world, 1100).save(folder.join(format!("{name}_plan.png")))?;
    }
    Ok(())
}

fn views(
    folder: &Path,
    name: &str,
    world: &World,
    cameras: &[chaic_protocol::geom::Camera],
) -> image::ImageResult<()> {
    let scene = Scene::new(world.setup());
    let view = |camera| View { camera, channels: Channels::ALL, hide: None, hide_ceiling: false };
    let views: Vec<View> = cameras.iter().map(|c| view(*c)).collect();
    let mut pictures = Vec::new();
    for (k, images) in scene.render(world, &views).into_iter().enumerate() {
        let (w, h) = (cameras[k].width, cameras[k].height);
        pictures.extend(images.rgb.and_then(|b| image_out::rgb(&b, w, h)));
        if k == 0 {
            let ids = images.ids.and_then(|b| image_out::ids_view(&b, w, h));
            let depth = images.depth_m.and_then(|b| image_out::depth_view(&b, w, h));
            let depth = depth.map(|d| image::DynamicImage::ImageLuma8(d).to_rgb8());
            let both: Vec<RgbImage> = ids.into_iter().chain(depth).collect();
            image_out::grid(&both, 2).save(folder.join(format!("{name}_ids_depth.png")))?;
        }
    }
    image_out::grid(&pictures, 2).save(folder.join(format!("{name}.png")))
}

/// Twelve classes to a picture.
fn classes(folder: &Path) -> image::ImageResult<()> {
    let all: Vec<ClassId> = ClassId::all().filter(|c| c.info().role != Role::Person).collect();
    for (page, group) in all.chunks(12).enumerate() {
        let pictures: Vec<RgbImage> = group.iter().map(|c| portrait(*c)).collect();
        image_out::grid(&pictures, 4).save(folder.join(format!("classes_{page}.png")))?;
    }
    Ok(())
}

fn portrait(class: ClassId) -> RgbImage {
    let mut setup = scenes::empty();
    setup.floors =
        vec![scenes::floor([-30.0; 2], [30.0; 2], FloorMaterial::Carpet, [214, 212, 208])];
    setup.bounds = chaic_protocol::geom::Rect::new([-30.0; 2], [30.0; 2]);
    setup.things.truncate(1);
    setup.things[0].position = Vec3::new(25.0, 0.0, 25.0);
    setup.people[0].pose.position = Vec3::new(-25.0, 0.0, 25.0);
    setup.things.push(Thing { fixed: true, ..Thing::new(class, Vec3::ZERO, std::f32::consts::PI) });
    let size = Vec3::from(class.info().size_m);
    let world = scenes::world(setup);
    let away = (0.80 * size.length()).max(0.22);
    let eye = [0.55 * away, 0.5 * size.y + 0.55 * away, 0.95 * away];
    let down = -chaic_protocol::geom::math::atan2(0.55, 1.098);
    let camera = camera(eye, 0.5248, down, 360, 360);
    let view = View { camera, channels: Channels::RGB, hide: None, hide_ceiling: false };
    let images = Scene::new(world.setup()).render(&world, &[view]);
    let rgb = images.into_iter().next().and_then(|i| i.rgb).unwrap_or_default();
    let mut picture = image_out::rgb(&rgb, 360, 360).unwrap_or_else(|| RgbImage::new(360, 360));
    text::draw(&mut picture, (6.0, 4.0), 18.0, [20; 3], Align::Left, class.name());
    picture
}

/// One picture per kind of person: postures side by side, from the front and from behind.
fn people(folder: &Path) -> image::ImageResult<()> {
    let setup = Setup { people: Vec::new(), ..scenes::empty() };
    let scene = Scene::new(&setup);
    let state = scenes::world(scenes::empty()).state().clone();
    for persona in Persona::ALL {
        let mut pictures = Vec::new();
        for (k, (name, p)) in postures(persona).into_iter().enumerate() {
            for (yaw, side) in [(-2.5, "front"), (0.6, "back")] {
                let mut p = p;
                p.pose.yaw_rad = yaw;
                p.look = k as u8;
                let h = p.height_m;
                let camera = camera([0.0, 0.62 * h, 0.80 * h], 0.0, -0.12, 360, 440);
                let view =
                    View { camera, channels: Channels::RGB, hide: None, hide_ceiling: false };
                let images = scene.render_state(&state, &[p], &[view]);
                let rgb = images.into_iter().next().and_then(|i| i.rgb).unwrap_or_default();
                let mut picture =
                    image_out::rgb(&rgb, 360, 440).unwrap_or_else(|| RgbImage::new(360, 440));
                let label = format!("{persona:?} {name} {side}");
                text::draw(&mut picture, (6.0, 4.0), 16.0, [20; 3], Align::Left, &label);
                pictures.push(picture);
            }
        }
        let name = format!("people_{persona:?}.png").to_lowercase();
        image_out::grid(&pictures, 6).save(folder.join(name))?;
    }
    Ok(())
}

fn postures(persona: Persona) -> Vec<(&'static str, Posture)> {
    let rest = posture(persona, 0.0, 0.0, 0.0);
    let h = rest.height_m;
    let arms = |mut p: Posture, y: f32, z: f32, grips: bool| {
        for (k, arm) in p.arms.iter_mut().enumerate() {
            let side = if k == 0 { -1.0 } else { 1.0 };
            arm.hand_in_body = Vec3::new(0.16 * side, y, z);
            arm.grips = grips;
        }
        p
    };
    vec![
        ("rest", rest),
        ("moving", Posture { moving: true, walked_m: 0.35, ..rest }),
        ("carrying", arms(rest, 0.57 * h, -0.31 * h, true)),
        ("bending", Posture { bend: 1.0, ..arms(rest, 0.1, -0.4, false) }),
        ("stretching", Posture { stretch: 1.0, ..arms(rest, 1.25 * h, -0.2, false) }),
        ("failing", Posture { failing: true, ..arms(rest, 0.7 * h, -0.35, false) }),
    ]
}
