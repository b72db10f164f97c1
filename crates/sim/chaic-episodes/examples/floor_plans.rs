//! Draws episodes from above: `cargo run -p chaic-episodes --example floor_plans -- EPISODE..
//! OUT.png`, for example with the episodes `obstacle/test/03` and `obstacle/gen-standard/7`.
//!
//! Walls are dark. Furniture is colored by class, with a notch at its front. Targets are red, other
//! objects orange, containers blue, obstacles magenta, people green. The goal place is outlined.

use std::collections::BTreeMap;

use chaic_core::geom::{forward, rotate_yaw, to_xz};
use chaic_core::{Role, Vec2, Vec3};
use chaic_episodes::{Episode, find_episode};
use chaic_world::{ObjectSpec, Wall};
use image::{Rgb, RgbImage};

const PX_PER_M: f32 = 34.0;

struct Canvas {
    image: RgbImage,
    min: Vec2,
}

impl Canvas {
    fn fill(&mut self, color: [u8; 3], inside: impl Fn(Vec2) -> bool, center: Vec2, reach: f32) {
        let low = ((center - reach - self.min) * PX_PER_M).max(Vec2::ZERO);
        let high = (center + reach - self.min) * PX_PER_M;
        for y in low.y as u32..(high.y.max(0.0) as u32 + 1).min(self.image.height()) {
            for x in low.x as u32..(high.x.max(0.0) as u32 + 1).min(self.image.width()) {
                let p = self.min + Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / PX_PER_M;
                if inside(p) {
                    self.image.put_pixel(x, y, Rgb(color));
                }
            }
        }
    }

    fn draw_object(&mut self, object: &ObjectSpec, color: [u8; 3], grow: f32) {
        let half = 0.5 * object.size_m() + grow;
        let (at, yaw) = (object.position, object.yaw_rad);
        let local = move |p: Vec2| rotate_yaw(Vec3::new(p.x - at.x, 0.0, p.y - at.z), -yaw);
        let inside = |p: Vec2| {
            let l = local(p);
            let notch = l.z < -half.z + 0.08 && l.x.abs() < 0.06;
            l.x.abs() <= half.x && l.z.abs() <= half.z && !notch
        };
        self.fill(color, inside, to_xz(at), half.length());
        let edge = |p: Vec2| {
            let l = local(p);
            let d = Vec2::new(half.x - l.x.abs(), half.z - l.z.abs());
            d.min_element() >= 0.0 && d.min_element() < 0.03
        };
        self.fill(color.map(|c| c / 2), edge, to_xz(at), half.length());
    }

    fn wall(&mut self, wall: &Wall) {
        let along = (wall.b - wall.a).normalize_or(Vec2::X);
        let (a, b) =
            (wall.a - along * 0.5 * wall.thickness_m, wall.b + along * 0.5 * wall.thickness_m);
        let inside = |p: Vec2| {
            let t = (p - a).dot(along);
            t >= 0.0 && t <= a.distance(b) && (p - a - along * t).length() <= 0.5 * wall.thickness_m
        };
        let color = if wall.bottom_m > 1.0 { [200, 190, 150] } else { [40, 40, 44] };
        self.fill(color, inside, 0.5 * (a + b), a.distance(b));
    }
}

fn color(object: &ObjectSpec) -> [u8; 3] {
    match object.class.name() {
        "bed" => [120, 150, 210],
        "cabinet" => [150, 90, 40],
        "refrigerator" => [210, 230, 240],
        "long_sofa" | "armchair" => [90, 140, 120],
        "side_chair" | "stool" => [230, 190, 70],
        "dining_table" | "coffee_table" | "desk" => [190, 140, 90],
        "kitchen_counter" | "stove" => [140, 140, 150],
        "bookshelf" | "wardrobe" => [110, 70, 60],
        "potted_plant" | "tree" => [70, 160, 70],
        "rug" => [220, 190, 180],
        _ => [170, 150, 170],
    }
}

fn draw(episode: &Episode) -> RgbImage {
    let setup = episode.setup();
    let bounds = setup.bounds.expanded(if setup.ceiling_m.is_some() { 0.3 } else { 4.0 });
    let size = bounds.size() * PX_PER_M;
    let image = RgbImage::from_pixel(size.x as u32, size.y as u32, Rgb([250, 250, 250]));
    let mut canvas = Canvas { image, min: bounds.min };
    for floor in &setup.floors {
        let inside = |p: Vec2| floor.rect.contains(p);
        canvas.fill(floor.color.map(|c| 128 + c / 2), inside, floor.rect.center(), 200.0);
    }
    setup.walls.iter().for_each(|w| canvas.wall(w));
    let mut order: Vec<usize> = (0..setup.things.len()).collect();
    order.sort_by(|a, b| {
        let y = |i: usize| (setup.things[i].class.name() != "rug", setup.things[i].position.y);
        y(*a).partial_cmp(&y(*b)).expect("positions are numbers")
    });
    for i in order {
        let object = &setup.things[i];
        if setup.goal_places.contains(&chaic_world::Setup::entity(i)) {
            canvas.draw_object(object, [255, 0, 200], 0.06);
        }
        let role = object.class.info().role;
        let (color, grow) = match role {
            Role::Container => ([40, 80, 230], 0.0),
            Role::Obstacle => ([230, 40, 230], 0.0),
            _ if object.fixed => (color(object), 0.0),
            _ if setup.goal.count(object.class) > 0 => ([220, 20, 20], 0.03),
            _ => ([250, 150, 30], 0.03),
        };
        canvas.draw_object(object, color, grow);
    }
    for person in &setup.people {
        let (p, r) = (to_xz(person.pose.position), person.capability().radius_m);
        canvas.fill([20, 140, 40], |q| q.distance(p) <= r, p, r);
        let nose = p + r * to_xz(forward(person.pose.yaw_rad));
        canvas.fill([0, 0, 0], |q| q.distance(nose) <= 0.07, nose, 0.1);
    }
    canvas.image
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [ids @ .., out] = &args[..] else {
        return Err("usage: floor_plans EPISODE.. OUT.png".into());
    };
    let mut images = Vec::new();
    for id in ids {
        let episode = find_episode(id)?;
        let mut counts: BTreeMap<&str, u32> = BTreeMap::new();
        for object in &episode.setup().things {
            *counts.entry(object.class.name()).or_default() += 1;
        }
        println!("{} {:?}\n{counts:?}", episode.id(), episode.setup().goal.targets);
        images.push(draw(&episode));
    }
    let width = images.iter().map(|i| i.width()).max().unwrap_or(1);
    let height = images.iter().map(|i| i.height() + 12).sum();
    let mut sheet = RgbImage::from_pixel(width, height, Rgb([255, 255, 255]));
    let mut y = 0;
    for image in images {
        image::imageops::replace(&mut sheet, &image, 0, y);
        y += i64::from(image.height()) + 12;
    }
    sheet.save(out)?;
    Ok(())
}
