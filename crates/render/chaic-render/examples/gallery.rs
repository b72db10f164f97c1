//! Renders a gallery for visual inspection:
//! `cargo run --release -p chaic-render --example gallery -- FOLDER`.
//!
//! It writes contact sheets of every class in its variants, of every persona in every posture, and
//! of the helper's first view in each task in several appearances. It also writes two hand-made
//! worlds, and prints the number of triangles of a furnished house at each level of detail.
//! `docs/gallery.md` shows the sheets.

use std::path::Path;

use chaic_core::capability::{IMPAIRMENTS, Impairment, Impairments, PersonKind, Persona};
use chaic_core::geom::Camera;
use chaic_core::{AgentId, ClassId, Role, TaskId, Vec3};
use chaic_episodes::{GeneratorSeeds, generate};
use chaic_render::geometry::Geometry;
use chaic_render::text::{self, Align};
use chaic_render::{Appearance, Channels, LEVEL_RADIUS_PX, Scene, View, floor_plan, image_out};
use chaic_test_kit::scenes;
use chaic_test_kit::scenes::{camera, posture};
use chaic_world::{ObjectSpec, Posture, Setup, World};
use image::RgbImage;
use image::codecs::png::{CompressionType, FilterType as PngFilter, PngEncoder};
use image::imageops::{FilterType, resize};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).ok_or("usage: gallery FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    classes(folder)?;
    people(folder)?;
    tasks(folder, Appearance::Canonical, "task_views", 224)?;
    tasks(folder, Appearance::Evening, "task_views_evening", 192)?;
    tasks(folder, VARIED[0], "task_views_varied", 192)?;
    appearances(folder)?;
    let (house, street) = (scenes::world(scenes::house()), scenes::world(scenes::street()));
    let scene = Scene::new(house.setup());
    let levels = scene.geometry_at_all_levels(house.state(), &[]);
    let counts = levels.each_ref().map(Geometry::count_triangles).map(|n| n.to_string());
    let n = house.setup().things.len();
    let up_to = LEVEL_RADIUS_PX[..counts.len() - 1].iter().map(f32::to_string);
    println!(
        "triangles of a house of eight rooms with {n} things: {}; levels for half of the longer side \
         up to {} pixels, and above",
        counts.join(", "),
        up_to.collect::<Vec<_>>().join(", ")
    );
    for (name, world, cameras) in [
        (
            "house",
            &house,
            [
                camera([5.0, 1.65, 4.1], -0.5, 0.0, 768, 768),
                camera([0.7, 1.65, 4.2], -0.7, -0.2, 768, 768),
                camera([9.3, 1.65, 0.6], -2.4, -0.2, 768, 768),
                camera([14.0, 1.2, 4.2], -0.7, -0.1, 768, 768),
            ],
        ),
        (
            "street",
            &street,
            [
                camera([0.5, 1.65, 4.5], 0.1, 0.0, 768, 768),
                camera([9.0, 1.65, 0.0], 1.3, 0.0, 768, 768),
                camera([-3.0, 1.0, -3.0], -0.6, 0.0, 768, 768),
                camera([-12.0, 3.0, 8.0], -0.7, -0.3, 768, 768),
            ],
        ),
    ] {
        views(folder, name, world, &cameras)?;
        floor_plan::draw(world, 1100).save(folder.join(format!("{name}_plan.png")))?;
    }
    Ok(())
}

fn views(folder: &Path, name: &str, world: &World, cameras: &[Camera]) -> image::ImageResult<()> {
    let scene = Scene::new(world.setup());
    let view = |camera| View::from_camera(camera, Channels::ALL);
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

/// Renders one image with 2x2 supersampling.
fn render_image(scene: &Scene, world: &World, postures: &[Posture], camera: Camera) -> RgbImage {
    render_view(scene, world, postures, camera, None)
}

fn render_view(
    scene: &Scene,
    world: &World,
    postures: &[Posture],
    camera: Camera,
    hide: Option<AgentId>,
) -> RgbImage {
    let (width, height) = (camera.width, camera.height);
    let camera = Camera { width: 2 * width, height: 2 * height, ..camera };
    let view = View { hide, ..View::from_camera(camera, Channels::RGB) };
    let images = scene.render_state(world.state(), postures, &[view]);
    let rgb = images.into_iter().next().and_then(|i| i.rgb).unwrap_or_default();
    let large = image_out::rgb(&rgb, 2 * width, 2 * height);
    let large = large.unwrap_or_else(|| RgbImage::new(2 * width, 2 * height));
    resize(&large, width, height, FilterType::Triangle)
}

/// Writes a PNG file with the strongest compression.
fn save(image: &RgbImage, path: &Path) -> image::ImageResult<()> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, PngFilter::Adaptive);
    image.write_with_encoder(encoder)
}

fn label(image: &mut RgbImage, label_text: &str) {
    text::draw(image, (3.0, 2.0), 11.0, [20; 3], Align::Left, label_text);
}

/// Every class in four variants, twelve images per row.
fn classes(folder: &Path) -> image::ImageResult<()> {
    let all: Vec<ClassId> = ClassId::all().filter(|c| c.info().role != Role::Person).collect();
    for (page, group) in all.chunks(all.len().div_ceil(5)).enumerate() {
        let pictures = group.iter().flat_map(|c| (0..4).map(|v| class_image(*c, v)));
        let pictures: Vec<RgbImage> = pictures.collect();
        save(&image_out::grid(&pictures, 12), &folder.join(format!("classes_{page}.png")))?;
    }
    Ok(())
}

/// An empty setup without ground, so that image files stay small.
fn empty_setup() -> Setup {
    let mut setup = scenes::empty();
    setup.floors.clear();
    setup.bounds = chaic_core::geom::Rect::new([-30.0; 2], [30.0; 2]);
    setup.things[0].position = Vec3::new(25.0, 0.0, 25.0);
    setup.people[0].pose.position = Vec3::new(-25.0, 0.0, 25.0);
    setup
}

fn class_image(class: ClassId, variant: u8) -> RgbImage {
    const SIDE_PX: u32 = 104;
    let mut setup = empty_setup();
    let thing = ObjectSpec::new(class, Vec3::ZERO, std::f32::consts::PI);
    setup.things.push(ObjectSpec { fixed: true, variant, ..thing });
    let size = Vec3::from(class.info().size_m);
    // The near plane is at a few centimeters: tiny objects need a larger distance and a narrower
    // field of view.
    let min_distance = 1.32 * size.length();
    let distance = min_distance.max(0.25);
    let eye = [0.55 * distance, 0.5 * size.y + 0.55 * distance, 0.95 * distance];
    let pitch = -chaic_core::geom::math::atan2(0.55, 1.098);
    let camera = camera(eye, 0.5248, pitch, SIDE_PX, SIDE_PX);
    let camera = Camera { vertical_fov_rad: 0.62 * min_distance / distance, ..camera };
    let world = scenes::world(setup);
    let mut image = render_image(&Scene::new(world.setup()), &world, &[], camera);
    if variant == 0 {
        label(&mut image, class.name());
    }
    image
}

/// One row per persona with one image per posture, and one sheet of people who work together.
fn people(folder: &Path) -> image::ImageResult<()> {
    let world = scenes::world(empty_setup());
    let scene = Scene::new(world.setup());
    let mut pictures = Vec::new();
    for persona in Persona::ALL {
        for (k, (name, p)) in postures(persona).into_iter().enumerate() {
            let mut p = Posture { appearance: k as u8, ..p };
            p.pose.yaw_rad = if name == "walking away" { 0.6 } else { -2.5 };
            let h = p.height_m;
            let camera = camera([0.0, 0.66 * h, 2.3 * h], 0.0, -0.06, 132, 176);
            let camera = Camera { vertical_fov_rad: 0.68, ..camera };
            let mut image = render_image(&scene, &world, &[p], camera);
            label(&mut image, &format!("{persona:?}: {name}"));
            pictures.push(image);
        }
    }
    save(&image_out::grid(&pictures, 9), &folder.join("people.png"))?;
    save(&impaired(&scene, &world), &folder.join("people_impaired.png"))?;
    save(&together(), &folder.join("people_together.png"))
}

/// One row per impairment of an adult, and one of a child with two impairments.
fn impaired(scene: &Scene, world: &chaic_world::World) -> RgbImage {
    let mut kinds: Vec<PersonKind> = IMPAIRMENTS
        .iter()
        .map(|i| PersonKind { persona: Persona::Adult, impairments: Impairments::new(i.id) })
        .collect();
    kinds.push("child+one_handed+tires".parse().expect("the person kind is valid"));
    let mut pictures = Vec::new();
    for kind in kinds {
        for (k, (name, p)) in postures(kind.persona).into_iter().enumerate() {
            let is_tired = kind.impairments.has(Impairment::Tires);
            let mut p = Posture { appearance: k as u8, impairments: kind.impairments, ..p };
            p.fatigue = if is_tired { 1.0 } else { 0.0 };
            if kind.impairments.has(Impairment::OneHanded) {
                p.arms[0].grips = false;
            }
            p.pose.yaw_rad = if name == "walking away" { 0.6 } else { -2.5 };
            let h = p.height_m;
            let camera = camera([0.0, 0.66 * h, 2.3 * h], 0.0, -0.06, 132, 176);
            let camera = Camera { vertical_fov_rad: 0.68, ..camera };
            let mut image = render_image(scene, world, &[p], camera);
            label(&mut image, &if k == 0 { kind.to_string() } else { name.to_owned() });
            pictures.push(image);
        }
    }
    image_out::grid(&pictures, 9)
}

fn arms(mut p: Posture, y: f32, z: f32, grips: [bool; 2]) -> Posture {
    for (k, arm) in p.arms.iter_mut().enumerate() {
        let side = if k == 0 { -1.0 } else { 1.0 };
        arm.hand_in_body = Vec3::new(0.16 * side, y, z);
        arm.grips = grips[k];
    }
    p
}

fn postures(persona: Persona) -> [(&'static str, Posture); 9] {
    let rest = posture(persona, 0.0, 0.0, 0.0);
    let h = rest.height_m;
    let one_hand = arms(rest, 0.6 * h, -0.28 * h, [false, true]);
    let one_hand = Posture { arms: [rest.arms[0], one_hand.arms[1]], ..one_hand };
    [
        ("rest", rest),
        ("walking", Posture { moving: true, walked_m: 0.35, ..rest }),
        ("walking on", Posture { moving: true, walked_m: 0.8, ..rest }),
        ("walking away", Posture { moving: true, walked_m: 0.1, ..rest }),
        ("one hand", one_hand),
        ("two hands", arms(rest, 0.57 * h, -0.31 * h, [true; 2])),
        ("bending", Posture { bend: 1.0, ..arms(rest, 0.1, -0.4, [false; 2]) }),
        ("stretching", Posture { stretch: 1.0, ..arms(rest, 1.17 * h, -0.2, [false; 2]) }),
        ("failing", Posture { failing: true, ..arms(rest, 0.7 * h, -0.35, [false; 2]) }),
    ]
}

/// Two people who lift a sofa, and a rider with a bicycle and a child.
fn together() -> RgbImage {
    let at_pose = |p: Posture, x: f32, z: f32, yaw: f32| {
        let mut p = p;
        p.pose.position = Vec3::new(x, 0.0, z);
        p.pose.yaw_rad = yaw;
        p
    };
    let mut setup = empty_setup();
    let mut sofa =
        ObjectSpec { fixed: true, ..scenes::object("sofa", 0.0, 0.0, std::f32::consts::PI) };
    sofa.position.y = 0.55;
    setup.things.push(sofa);
    let lifting = |persona, appearance, yaw: f32, x: f32| {
        let p = Posture { appearance, bend: 0.12, ..posture(persona, 0.0, 0.0, 0.0) };
        at_pose(arms(p, 0.68, -0.32, [true; 2]), x, 0.0, yaw)
    };
    let half = std::f32::consts::FRAC_PI_2;
    let lifters = [lifting(Persona::Adult, 1, -half, -1.0), lifting(Persona::Helper, 2, half, 1.0)];
    let eye = |height: f32| {
        let camera = camera([0.6, height, 4.6], 0.12, -0.06, 440, 300);
        Camera { vertical_fov_rad: 0.6, ..camera }
    };
    let world = scenes::world(setup);
    let first = render_image(&Scene::new(world.setup()), &world, &lifters, eye(1.15));

    let mut setup = empty_setup();
    setup.things.push(ObjectSpec { fixed: true, ..scenes::object("bike", -0.35, 0.2, half) });
    let mut rider = at_pose(posture(Persona::Rider, 0.0, 0.0, 0.0), -0.2, -0.35, half);
    rider.arms[0].hand_in_body = Vec3::new(-0.35, 1.0, -0.25);
    rider.arms[0].grips = true;
    let child = Posture { moving: true, walked_m: 0.3, ..posture(Persona::Child, 0.0, 0.0, 0.0) };
    let world = scenes::world(setup);
    let scene = Scene::new(world.setup());
    let second = render_image(&scene, &world, &[rider, at_pose(child, 1.1, 0.3, -2.2)], eye(1.15));
    image_out::grid(&[first, second], 2)
}

/// First view of the helper in an episode of each task.
fn tasks(folder: &Path, appearance: Appearance, name: &str, side_px: u32) -> Result<()> {
    let mut pictures = Vec::new();
    for task in TaskId::all() {
        let world = scenes::world(generate(task, GeneratorSeeds { place: 7, episode: 7 })?);
        let postures: Vec<Posture> = world.setup().agents().map(|a| world.posture(a)).collect();
        let eye = world.camera(AgentId::HELPER, side_px);
        let scene = Scene::with_appearance(world.setup(), appearance);
        let mut image = render_view(&scene, &world, &postures, eye, Some(AgentId::HELPER));
        label(&mut image, task.name());
        pictures.push(image);
    }
    save(&image_out::grid(&pictures, 4), &folder.join(format!("{name}.png")))?;
    Ok(())
}

/// Two random appearances.
const VARIED: [Appearance; 2] = [Appearance::Varied { seed: 3 }, Appearance::Varied { seed: 8 }];

/// Two rooms and a street, one row per appearance.
fn appearances(folder: &Path) -> image::ImageResult<()> {
    const SIDE_PX: u32 = 168;
    let (house, street) = (scenes::world(scenes::house()), scenes::world(scenes::street()));
    let places = [
        (&house, [0.7, 1.65, 4.2], -0.7, -0.2),
        (&house, [14.0, 1.2, 4.2], -0.7, -0.1),
        (&street, [0.5, 1.65, 4.5], 0.1, 0.0),
    ];
    let mut pictures = Vec::new();
    for appearance in [Appearance::Canonical, Appearance::Evening, VARIED[0], VARIED[1]] {
        for (k, (world, eye, yaw, pitch)) in places.into_iter().enumerate() {
            let scene = Scene::with_appearance(world.setup(), appearance);
            let postures: Vec<Posture> = world.setup().agents().map(|a| world.posture(a)).collect();
            let camera = camera(eye, yaw, pitch, SIDE_PX, SIDE_PX);
            let mut image = render_image(&scene, world, &postures, camera);
            if k == 0 {
                label(&mut image, &appearance.to_string());
            }
            pictures.push(image);
        }
    }
    save(&image_out::grid(&pictures, 3), &folder.join("appearances.png"))
}
