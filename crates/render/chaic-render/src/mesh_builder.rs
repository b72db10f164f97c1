//! Forms richer than the catalogue's solids, for what is only looked at: rounded boxes, cushions,
//! turned vessels, bent pipes, cut outlines, leaves.
//!
//! Everything is given in metres at the catalogue's size, like the catalogue itself: upright forms
//! by the middle of their bottom, the others by their middle or ends. What is smaller than about a
//! pixel at the level of detail is left out.

use chaic_core::Vec3;
use chaic_core::catalogue::{ClassInfo, Finish, Part, Solid};
use glam::Mat3;

use crate::forms;
pub(crate) use crate::forms::scramble;
use crate::mesh::{Mesh, Place, Section, Skin, length, unit};
use crate::solids::{self, Detail, LEVEL_RADIUS_PX, place_of};

/// What is painted next: color and finish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Paint {
    pub color: [u8; 3],
    pub finish: Finish,
    /// Whether an object's variant recolors it.
    pub tinted: bool,
}

/// A paint of a fixed color.
pub(crate) const fn paint(color: [u8; 3], finish: Finish) -> Paint {
    Paint { color, finish, tinted: false }
}

/// A place in metres.
pub(crate) type P = [f32; 3];

/// Builds the mesh of one class at one level of detail.
pub(crate) struct MeshBuilder {
    pub class: &'static ClassInfo,
    /// Which of the class's styles.
    pub style: u8,
    pub level: usize,
    detail: Detail,
    mesh: Mesh,
    now: Paint,
    /// The paint and axes of the mesh's last skin.
    last: Option<(Paint, Mat3)>,
}

impl MeshBuilder {
    pub fn new(class: &'static ClassInfo, style: u8, level: usize) -> MeshBuilder {
        let detail = Detail::of_level(level, 0.5 * length(Vec3::from(class.size_m)));
        let now = paint([200; 3], Finish::Matte);
        MeshBuilder { class, style, level, detail, mesh: Mesh::default(), now, last: None }
    }

    /// What was built.
    pub fn mesh(self) -> Mesh {
        self.mesh
    }

    /// What follows is painted so.
    pub fn paint(&mut self, paint: Paint) {
        self.now = paint;
    }

    /// The paint of the class's main part, which its variant recolors.
    pub fn main(&self) -> Paint {
        let part = &self.class.parts[0];
        Paint { color: part.color, finish: part.finish, tinted: !self.class.palette.is_empty() }
    }

    /// The main paint, or for a class without alternatives one of these by style.
    pub fn main_or(&self, others: &[[u8; 3]]) -> Paint {
        let mut main = self.main();
        if !main.tinted {
            main.color = self.pick(0, others);
        }
        main
    }

    /// One of the options, by style; different slots choose independently.
    pub fn pick<T: Copy>(&self, slot: u32, options: &[T]) -> T {
        options[self.chance(slot) as usize % options.len().max(1)]
    }

    /// A number that depends on class, style and slot only.
    pub fn chance(&self, slot: u32) -> u32 {
        // The first four styles take the first four options of slot 0.
        if slot == 0 {
            return u32::from(self.style);
        }
        scramble(slot.wrapping_mul(64) + u32::from(self.style)) >> 8
    }

    /// Whether half of the object never covers more than this on the image, pixels.
    pub fn within(&self, radius_px: f32) -> bool {
        LEVEL_RADIUS_PX[self.level] <= radius_px
    }

    /// Whether something of this size, metres, covers about a pixel. Most things are smaller on the
    /// image than the largest that a level is for.
    pub fn shows(&self, size_m: f32) -> bool {
        size_m * self.detail.px_per_m > if self.within(60.0) { 1.5 } else { 1.1 }
    }

    /// How far an outline may be off, metres.
    fn slack_m(&self) -> f32 {
        0.5 / self.detail.px_per_m
    }

    fn shows_extent(&self, e: Vec3) -> bool {
        let largest = e.max_element();
        let middle = e.x.max(e.y).min(e.x.max(e.z)).min(e.y.max(e.z));
        match self.level {
            // The smallest pictures show the main parts only.
            0 => self.shows(0.5 * largest) && self.shows(1.2 * middle),
            _ => self.shows(0.7 * largest) && self.shows(1.6 * middle),
        }
    }

    /// Begins a skin whose grain runs along the place.
    fn skin(&mut self, place: &Place) {
        let plain = matches!(self.now.finish, Finish::Matte | Finish::Glossy | Finish::Glass);
        let axes = if plain { Mat3::IDENTITY } else { place.grain() };
        if self.last != Some((self.now, axes)) {
            let mut skin = Skin::new(self.now.color, self.now.finish).with_axes(axes);
            skin.tinted = self.now.tinted;
            self.mesh.skin(skin);
            self.last = Some((self.now, axes));
        }
    }

    fn plain_skin(&mut self) {
        self.skin(&Place::upright(Vec3::ZERO, Vec3::ONE));
    }

    // The catalogue's own parts.

    /// Every part of the class, with its edges rounded.
    pub fn all(&mut self) {
        self.without(&[]);
    }

    /// Every part but these.
    pub fn without(&mut self, left_out: &[usize]) {
        for k in (0..self.class.parts.len()).filter(|k| !left_out.contains(k)) {
            self.part(k);
        }
    }

    /// These parts.
    pub fn only(&mut self, parts: &[usize]) {
        for k in parts {
            self.part(*k);
        }
    }

    /// One part, in its own color.
    pub fn part(&mut self, k: usize) {
        let Some(part) = self.class.parts.get(k) else { return };
        let main = self.main();
        let tinted = main.tinted && part.color == main.color;
        self.now = Paint { color: part.color, finish: part.finish, tinted };
        self.shape(part);
    }

    /// One part in the present paint.
    pub fn shape(&mut self, part: &Part) {
        let place = place_of(part, Vec3::from(self.class.size_m));
        if !part.collides && !self.shows_extent(place.extent) {
            return;
        }
        self.skin(&place);
        let detail = self.detail;
        match part.solid {
            Solid::Cuboid => {
                let least = place.extent.min_element();
                let round = match part.finish {
                    Finish::Fabric => (0.3 * least).min(0.05),
                    Finish::Crust | Finish::Skin => 0.3 * least,
                    _ => (0.2 * least).min(0.008),
                };
                self.rounded(&place, round);
            }
            Solid::Frustum { top } if top > 0.05 => {
                let n = detail.segments(0.5 * place.extent.x.max(place.extent.z));
                let [r0, r1] = if top > 1.0 { [0.5 / top, 0.5] } else { [0.5, 0.5 * top] };
                let bevel = 0.12 * place.extent.min_element();
                let (by, bx) = (bevel / place.extent.y, bevel / place.extent.x.max(place.extent.z));
                if self.shows(bevel) {
                    let outline = [[r0 - bx, -0.5], [r0, by - 0.5], [r1, 0.5 - by], [r1 - bx, 0.5]];
                    forms::lathe(&mut self.mesh, &place, &outline, n);
                } else {
                    solids::frustum(&mut self.mesh, &place, top, n);
                }
            }
            form => solids::solid(&mut self.mesh, form, &place, detail),
        }
    }

    fn rounded(&mut self, place: &Place, round_m: f32) {
        if self.shows(round_m) {
            forms::rounded_box(
                &mut self.mesh,
                place,
                round_m.min(0.49 * place.extent.min_element()),
            );
        } else {
            solids::cuboid(&mut self.mesh, place);
        }
    }

    // Forms.

    /// An upright box with rounded edges.
    pub fn block(&mut self, bottom: P, size: P, round_m: f32) {
        let middle = [bottom[0], bottom[1] + 0.5 * size[1], bottom[2]];
        self.block_turned(middle, size, [0.0; 3], round_m);
    }

    /// A box about its middle, turned (degrees about z, then x, then y).
    pub fn block_turned(&mut self, middle: P, size: P, turn_deg: P, round_m: f32) {
        let place = turned(middle, size, turn_deg);
        if self.shows_extent(place.extent) {
            self.skin(&place);
            self.rounded(&place, round_m);
        }
    }

    /// An ellipsoid standing on `bottom`.
    pub fn ball(&mut self, bottom: P, size: P) {
        let middle = [bottom[0], bottom[1] + 0.5 * size[1], bottom[2]];
        self.ball_turned(middle, size, [0.0; 3]);
    }

    /// An ellipsoid about its middle, turned.
    pub fn ball_turned(&mut self, middle: P, size: P, turn_deg: P) {
        let place = turned(middle, size, turn_deg);
        if self.shows_extent(place.extent) {
            self.skin(&place);
            let n = self.detail.segments(0.5 * place.extent.max_element());
            solids::ellipsoid(&mut self.mesh, &place, n);
        }
    }

    /// A cushion about its middle: something between a box (`soft` 0) and an ellipsoid (1).
    pub fn pillow(&mut self, middle: P, size: P, turn_deg: P, soft: f32) {
        let place = turned(middle, size, turn_deg);
        if self.shows_extent(place.extent) {
            self.skin(&place);
            let n = self.detail.segments(0.5 * place.extent.max_element()).max(8) / 4 * 4;
            forms::pillow(&mut self.mesh, &place, soft.clamp(0.15, 1.0), n);
        }
    }

    /// A lump: an ellipsoid about its middle with flat facets pushed in and out by up to `rough`.
    pub fn lump(&mut self, middle: P, size: P, rough: f32, seed: u32) {
        let place = turned(middle, size, [0.0; 3]);
        if self.shows_extent(place.extent) {
            self.skin(&place);
            let n = self.detail.segments(0.7 * place.extent.max_element()).min(18);
            forms::lump(&mut self.mesh, &place, rough, seed, n);
        }
    }

    /// Something turned on a lathe: its outline as (radius, height above `bottom`), from the bottom
    /// up along the outside and, for vessels, down again along the inside; or back to its first
    /// point, for a ring.
    pub fn lathe(&mut self, bottom: P, outline: &[[f32; 2]]) {
        self.lathe_along(bottom, [0.0, 1.0, 0.0], outline);
    }

    /// The same about the axis that points from `start` in a direction.
    pub fn lathe_along(&mut self, start: P, axis: P, outline: &[[f32; 2]]) {
        let wide = outline.iter().fold(0.0f32, |w, p| w.max(p[0]));
        let high = outline.iter().fold(0.0f32, |w, p| w.max(p[1].abs()));
        if !self.shows_extent(Vec3::new(2.0 * wide, high, 2.0 * wide)) {
            return;
        }
        let place =
            Place { center: Vec3::from(start), axes: upright_along(axis), extent: Vec3::ONE };
        self.plain_skin();
        let n = self.detail.segments(wide);
        let points: Vec<[f32; 3]> = outline.iter().map(|[r, y]| [*r, *y, 0.0]).collect();
        let kept = essential(&points, self.slack_m());
        let kept: Vec<[f32; 2]> = kept.into_iter().map(|k| outline[k]).collect();
        forms::lathe(&mut self.mesh, &place, &kept, n);
    }

    /// A straight rod.
    pub fn rod(&mut self, from: P, to: P, radius_m: f32) {
        self.taper(from, to, radius_m, radius_m);
    }

    /// A straight rod that changes its radius.
    pub fn taper(&mut self, from: P, to: P, radius_from: f32, radius_to: f32) {
        self.sweep(&[(from, radius_from), (to, radius_to)]);
    }

    /// A pipe of one radius along a smooth curve through the points.
    pub fn pipe(&mut self, points: &[P], radius_m: f32) {
        let points: Vec<(P, f32)> = points.iter().map(|p| (*p, radius_m)).collect();
        self.curve(&points);
    }

    /// A pipe through the points with a radius at each, along a smooth curve.
    pub fn curve(&mut self, points: &[(P, f32)]) {
        let way: f32 =
            points.windows(2).map(|w| length(Vec3::from(w[1].0) - Vec3::from(w[0].0))).sum();
        let per_span = (self.detail.segments(0.4 * way) / points.len().max(1)).clamp(1, 6);
        let mut fine = Vec::with_capacity(points.len() * per_span);
        let at = |k: isize| points[k.clamp(0, points.len() as isize - 1) as usize];
        for k in 0..points.len().saturating_sub(1) as isize {
            let [a, b, c, d] = [at(k - 1), at(k), at(k + 1), at(k + 2)];
            for j in 0..per_span {
                let t = j as f32 / per_span as f32;
                let p = std::array::from_fn(|i| catmull_rom([a.0[i], b.0[i], c.0[i], d.0[i]], t));
                fine.push((p, b.1 + (c.1 - b.1) * t));
            }
        }
        fine.extend(points.last());
        // What the radius does counts as well.
        let slack = self.slack_m();
        let places: Vec<P> = fine.iter().map(|p| p.0).collect();
        let widths: Vec<P> = fine.iter().enumerate().map(|(k, p)| [k as f32, p.1, 0.0]).collect();
        let mut kept = essential(&places, slack);
        kept.extend(essential(&widths, slack));
        kept.sort_unstable();
        kept.dedup();
        let kept: Vec<(P, f32)> = kept.into_iter().map(|k| fine[k]).collect();
        self.sweep(&kept);
    }

    /// A round pipe with corners where the points are.
    pub fn sweep(&mut self, points: &[(P, f32)]) {
        let wide = points.iter().fold(0.0f32, |w, p| w.max(p.1));
        let way: f32 =
            points.windows(2).map(|w| length(Vec3::from(w[1].0) - Vec3::from(w[0].0))).sum();
        if points.len() < 2 || !self.shows_extent(Vec3::new(2.0 * wide, way, 2.0 * wide)) {
            return;
        }
        let n = self.detail.segments(wide).min(16);
        let n = if self.within(20.0) { n.min(6) } else { n };
        let end = points[points.len() - 1].0;
        let place = Place {
            center: Vec3::ZERO,
            axes: upright_along([
                end[0] - points[0].0[0],
                end[1] - points[0].0[1],
                end[2] - points[0].0[2],
            ]),
            extent: Vec3::new(0.1, 1.0, 0.1),
        };
        self.skin(&place);
        let mut sections = Vec::with_capacity(points.len());
        let mut side = Vec3::ZERO;
        for k in 0..points.len() {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(points.len() - 1));
            let along = unit(Vec3::from(points[after].0) - Vec3::from(points[before].0));
            let hint = if side != Vec3::ZERO {
                side
            } else if along.x.abs() < 0.7 {
                Vec3::X
            } else {
                Vec3::Z
            };
            side = unit(hint - along * along.dot(hint));
            let radius = points[k].1.max(1e-4);
            let (a, b) = (side * radius, side.cross(along) * radius);
            sections.push(Section { center: Vec3::from(points[k].0), a, b });
        }
        self.mesh.tube(&sections, n);
    }

    /// A leaf from `root` to `tip`, `width_m` wide, sagging in its middle by `sag_m`.
    pub fn leaf(&mut self, root: P, tip: P, width_m: f32, sag_m: f32) {
        let (root, tip) = (Vec3::from(root), Vec3::from(tip));
        let long = length(tip - root);
        if !self.shows_extent(Vec3::new(width_m, long, 0.0)) {
            return;
        }
        self.plain_skin();
        let along = unit(tip - root);
        let side = unit(along.cross(Vec3::Y) + Vec3::X * 1e-3);
        let thick = side.cross(along) * (0.04 * width_m).max(0.0006);
        let shape: &[[f32; 2]] = if self.within(20.0) {
            &[[0.0, 0.1], [0.45, 1.0], [1.0, 0.04]]
        } else {
            &[[0.0, 0.1], [0.2, 0.7], [0.45, 1.0], [0.75, 0.65], [1.0, 0.04]]
        };
        let sections: Vec<Section> = shape
            .iter()
            .map(|[t, w]| Section {
                center: root + (tip - root) * *t + Vec3::Y * (sag_m * 4.0 * t * (1.0 - t)),
                a: side * (0.5 * width_m * w),
                b: thick * (0.3 + 0.7 * w),
            })
            .collect();
        self.mesh.tube(&sections, if self.within(20.0) { 4 } else { 6 });
    }

    /// A ring about `middle` in the plane square to `axis`.
    pub fn hoop(&mut self, middle: P, axis: P, radius_m: f32, tube_radius_m: f32) {
        let outer = 2.0 * (radius_m + tube_radius_m);
        let tube = 2.0 * tube_radius_m;
        if self.shows(tube) {
            let extent = Vec3::new(outer, tube, outer);
            let place = Place { center: Vec3::from(middle), axes: upright_along(axis), extent };
            self.skin(&place);
            solids::solid(&mut self.mesh, Solid::Torus { tube: tube / outer }, &place, self.detail);
        }
    }

    /// An outline in the plane of the turned x and y axes, counter-clockwise seen from +z and seen
    /// whole from its middle, `thick_m` thick.
    pub fn cut(&mut self, middle: P, outline: &[[f32; 2]], thick_m: f32, turn_deg: P) {
        let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
        for p in outline {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
            }
        }
        let place = turned(middle, [high[0] - low[0], high[1] - low[1], thick_m], turn_deg);
        if self.shows_extent(place.extent) {
            self.skin(&place);
            let place = Place { extent: Vec3::ONE, ..place };
            forms::cut(&mut self.mesh, &place, outline, thick_m);
        }
    }

    /// A piece of a round wall about the vertical through `bottom`: between two radii, two heights
    /// and two angles (degrees; 0 is the front, -z; 90 is +x).
    pub fn sector(&mut self, bottom: P, radii: [f32; 2], heights: [f32; 2], angles_deg: [f32; 2]) {
        let turn = (angles_deg[1] - angles_deg[0]).to_radians();
        let extent = Vec3::new(radii[1] * turn, heights[1] - heights[0], radii[1] - radii[0]);
        if self.shows_extent(extent) {
            self.plain_skin();
            let n = (self.detail.segments(radii[1]) as f32 * turn / std::f32::consts::TAU) as usize;
            forms::sector(&mut self.mesh, Vec3::from(bottom), radii, heights, angles_deg, n.max(1));
        }
    }
}

/// Those points of a line without which it would be off by more than `slack`; ends are kept, and
/// of a closed line some point between (Douglas and Peucker's way).
fn essential(points: &[P], slack: f32) -> Vec<usize> {
    let n = points.len();
    let mut kept = vec![false; n];
    let mut spans = vec![(0, n.saturating_sub(1))];
    let closed = n > 2 && points[0] == points[n - 1];
    while let Some((from, to)) = spans.pop() {
        kept[from] = true;
        kept[to] = true;
        let (a, b) = (Vec3::from(points[from]), Vec3::from(points[to]));
        let along = b - a;
        let l2 = along.dot(along);
        let off = |k: usize| {
            let d = Vec3::from(points[k]) - a;
            let t = if l2 > 0.0 { (d.dot(along) / l2).clamp(0.0, 1.0) } else { 0.0 };
            length(d - along * t)
        };
        let worst = (from + 1..to).map(|k| (off(k), k)).max_by(|x, y| x.0.total_cmp(&y.0));
        let must = closed && (from, to) == (0, n - 1);
        if let Some((by, k)) = worst
            && (by > slack || must)
        {
            spans.push((from, k));
            spans.push((k, to));
        }
    }
    (0..n).filter(|k| kept[*k]).collect()
}

fn turned(middle: P, size: P, turn_deg: P) -> Place {
    let part = Part::new(Solid::Cuboid, middle, size, [0; 3], Finish::Matte).turned(turn_deg);
    place_of(&part, Vec3::ONE)
}

/// Axes whose y points in a direction.
fn upright_along(axis: P) -> Mat3 {
    let y = unit(Vec3::from(axis));
    let hint = if y.y.abs() > 0.99 { Vec3::X } else { y.cross(Vec3::Y) };
    let x = unit(hint - y * y.dot(hint));
    Mat3::from_cols(x, y, x.cross(y))
}

fn catmull_rom([a, b, c, d]: [f32; 4], t: f32) -> f32 {
    let (t2, t3) = (t * t, t * t * t);
    0.5 * (2.0 * b
        + (c - a) * t
        + (2.0 * a - 5.0 * b + 4.0 * c - d) * t2
        + (3.0 * b - a - 3.0 * c + d) * t3)
}
