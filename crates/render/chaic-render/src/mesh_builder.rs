//! Builder of detailed models for rendering: rounded boxes, cushions, lathed vessels, bent pipes,
//! extruded outlines, leaves.
//!
//! All lengths are meters at catalogue size. Upright shapes are placed by the center of their
//! bottom, the others by their center or ends. Parts smaller than about a pixel at the current
//! level of detail are left out.

use chaic_core::Vec3;
use chaic_core::catalogue::{ClassInfo, Finish, Part, Solid};
use glam::Mat3;

use crate::forms;
pub(crate) use crate::forms::hash_u32;
use crate::mesh::{Material, Mesh, OrientedBox, Section, length, unit};
use crate::solids::{self, Detail, LEVEL_RADIUS_PX, part_obb};

/// Color and finish of the shapes that follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Paint {
    pub color: [u8; 3],
    pub finish: Finish,
    /// True if the tint of an object replaces the color.
    pub tinted: bool,
}

/// Paint of a fixed color.
pub(crate) const fn paint(color: [u8; 3], finish: Finish) -> Paint {
    Paint { color, finish, tinted: false }
}

/// A point or size, meters.
pub(crate) type Point3 = [f32; 3];

/// Builds the mesh of one class at one level of detail.
pub(crate) struct MeshBuilder {
    pub class: &'static ClassInfo,
    /// Style of the class.
    pub style: u8,
    pub level: usize,
    detail: Detail,
    mesh: Mesh,
    paint: Paint,
    /// Paint and axes of the last material of the mesh.
    last: Option<(Paint, Mat3)>,
}

impl MeshBuilder {
    pub fn new(class: &'static ClassInfo, style: u8, level: usize) -> MeshBuilder {
        let detail = Detail::of_level(level, 0.5 * length(Vec3::from(class.size_m)));
        let paint = paint([200; 3], Finish::Matte);
        MeshBuilder { class, style, level, detail, mesh: Mesh::default(), paint, last: None }
    }

    /// Returns the mesh.
    pub fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// Sets the paint of the shapes that follow.
    pub fn set_paint(&mut self, paint: Paint) {
        self.paint = paint;
    }

    /// Returns the paint of the main part, which the variant of an object recolors.
    pub fn main_paint(&self) -> Paint {
        let part = &self.class.parts[0];
        Paint { color: part.color, finish: part.finish, tinted: !self.class.palette.is_empty() }
    }

    /// Returns the main paint; a class without a palette takes one of these colors, by style.
    pub fn main_paint_or(&self, colors: &[[u8; 3]]) -> Paint {
        let mut main_paint = self.main_paint();
        if !main_paint.tinted {
            main_paint.color = self.pick(0, colors);
        }
        main_paint
    }

    /// Picks an option by style; different slots choose independently.
    pub fn pick<T: Copy>(&self, slot: u32, options: &[T]) -> T {
        options[self.random(slot) as usize % options.len().max(1)]
    }

    /// Returns a random number that depends only on style and slot.
    pub fn random(&self, slot: u32) -> u32 {
        // The first four styles take the first four options of slot 0.
        if slot == 0 {
            return u32::from(self.style);
        }
        hash_u32(slot.wrapping_mul(64) + u32::from(self.style)) >> 8
    }

    /// Returns whether the radius of the object at this level is at most `radius_px`, pixels.
    pub fn is_level_within(&self, radius_px: f32) -> bool {
        LEVEL_RADIUS_PX[self.level] <= radius_px
    }

    /// Returns whether a size, meters, covers about a pixel. Most objects are smaller on the image
    /// than the maximum of their level.
    pub fn covers_pixel(&self, size_m: f32) -> bool {
        size_m * self.detail.px_per_m > if self.is_level_within(60.0) { 1.5 } else { 1.1 }
    }

    /// Tolerance of outlines, meters.
    fn tolerance_m(&self) -> f32 {
        0.5 / self.detail.px_per_m
    }

    fn covers_pixels(&self, e: Vec3) -> bool {
        let largest = e.max_element();
        let median = e.x.max(e.y).min(e.x.max(e.z)).min(e.y.max(e.z));
        match self.level {
            // The coarsest level contains only the main parts.
            0 => self.covers_pixel(0.5 * largest) && self.covers_pixel(1.2 * median),
            _ => self.covers_pixel(0.7 * largest) && self.covers_pixel(1.6 * median),
        }
    }

    /// Begins a material whose grain runs along the box.
    fn begin_material(&mut self, obb: &OrientedBox) {
        let is_plain = matches!(self.paint.finish, Finish::Matte | Finish::Glossy | Finish::Glass);
        let axes = if is_plain { Mat3::IDENTITY } else { obb.grain_axes() };
        if self.last != Some((self.paint, axes)) {
            let mut material = Material::new(self.paint.color, self.paint.finish).with_axes(axes);
            material.tinted = self.paint.tinted;
            self.mesh.set_material(material);
            self.last = Some((self.paint, axes));
        }
    }

    fn begin_plain_material(&mut self) {
        self.begin_material(&OrientedBox::upright(Vec3::ZERO, Vec3::ONE));
    }

    // Parts of the catalogue.

    /// Adds every part of the class, with rounded edges.
    pub fn add_all_parts(&mut self) {
        self.add_parts_except(&[]);
    }

    /// Adds every part except these.
    pub fn add_parts_except(&mut self, excluded: &[usize]) {
        for k in (0..self.class.parts.len()).filter(|k| !excluded.contains(k)) {
            self.add_part(k);
        }
    }

    /// Adds these parts.
    pub fn add_parts(&mut self, parts: &[usize]) {
        for k in parts {
            self.add_part(*k);
        }
    }

    /// Adds one part in its own color.
    pub fn add_part(&mut self, k: usize) {
        let Some(part) = self.class.parts.get(k) else { return };
        let main_paint = self.main_paint();
        let tinted = main_paint.tinted && part.color == main_paint.color;
        self.paint = Paint { color: part.color, finish: part.finish, tinted };
        self.add_part_shape(part);
    }

    /// Adds one part in the current paint.
    pub fn add_part_shape(&mut self, part: &Part) {
        let obb = part_obb(part, Vec3::from(self.class.size_m));
        if !part.collides && !self.covers_pixels(obb.extent) {
            return;
        }
        self.begin_material(&obb);
        let detail = self.detail;
        match part.solid {
            Solid::Cuboid => {
                let min_extent = obb.extent.min_element();
                let radius = match part.finish {
                    Finish::Fabric => (0.3 * min_extent).min(0.05),
                    Finish::Crust | Finish::Skin => 0.3 * min_extent,
                    _ => (0.2 * min_extent).min(0.008),
                };
                self.rounded(&obb, radius);
            }
            Solid::Frustum { top } if top > 0.05 => {
                let n = detail.segments(0.5 * obb.extent.x.max(obb.extent.z));
                let [r0, r1] = if top > 1.0 { [0.5 / top, 0.5] } else { [0.5, 0.5 * top] };
                let bevel = 0.12 * obb.extent.min_element();
                let (by, bx) = (bevel / obb.extent.y, bevel / obb.extent.x.max(obb.extent.z));
                if self.covers_pixel(bevel) {
                    let outline = [[r0 - bx, -0.5], [r0, by - 0.5], [r1, 0.5 - by], [r1 - bx, 0.5]];
                    forms::lathe(&mut self.mesh, &obb, &outline, n);
                } else {
                    solids::frustum(&mut self.mesh, &obb, top, n);
                }
            }
            form => solids::solid(&mut self.mesh, form, &obb, detail),
        }
    }

    fn rounded(&mut self, obb: &OrientedBox, round_m: f32) {
        if self.covers_pixel(round_m) {
            forms::rounded_box(&mut self.mesh, obb, round_m.min(0.49 * obb.extent.min_element()));
        } else {
            solids::cuboid(&mut self.mesh, obb);
        }
    }

    // Shapes.

    /// Adds an upright box with rounded edges.
    pub fn block(&mut self, bottom: Point3, size: Point3, round_m: f32) {
        let center = [bottom[0], bottom[1] + 0.5 * size[1], bottom[2]];
        self.block_turned(center, size, [0.0; 3], round_m);
    }

    /// Adds a box by its center, rotated by `turn_deg` (degrees about z, then x, then y).
    pub fn block_turned(&mut self, center: Point3, size: Point3, turn_deg: Point3, round_m: f32) {
        let obb = rotated_box(center, size, turn_deg);
        if self.covers_pixels(obb.extent) {
            self.begin_material(&obb);
            self.rounded(&obb, round_m);
        }
    }

    /// Adds an ellipsoid that stands on `bottom`.
    pub fn ball(&mut self, bottom: Point3, size: Point3) {
        let center = [bottom[0], bottom[1] + 0.5 * size[1], bottom[2]];
        self.ball_turned(center, size, [0.0; 3]);
    }

    /// Adds a rotated ellipsoid by its center.
    pub fn ball_turned(&mut self, center: Point3, size: Point3, turn_deg: Point3) {
        let obb = rotated_box(center, size, turn_deg);
        if self.covers_pixels(obb.extent) {
            self.begin_material(&obb);
            let n = self.detail.segments(0.5 * obb.extent.max_element());
            solids::ellipsoid(&mut self.mesh, &obb, n);
        }
    }

    /// Adds a cushion by its center: a box at `soft` 0, an ellipsoid at `soft` 1.
    pub fn pillow(&mut self, center: Point3, size: Point3, turn_deg: Point3, soft: f32) {
        let obb = rotated_box(center, size, turn_deg);
        if self.covers_pixels(obb.extent) {
            self.begin_material(&obb);
            let n = self.detail.segments(0.5 * obb.extent.max_element()).max(8) / 4 * 4;
            forms::pillow(&mut self.mesh, &obb, soft.clamp(0.15, 1.0), n);
        }
    }

    /// Adds a lump by its center: an ellipsoid with flat facets, displaced by up to `rough`.
    pub fn lump(&mut self, center: Point3, size: Point3, rough: f32, seed: u32) {
        let obb = rotated_box(center, size, [0.0; 3]);
        if self.covers_pixels(obb.extent) {
            self.begin_material(&obb);
            let n = self.detail.segments(0.7 * obb.extent.max_element()).min(18);
            forms::lump(&mut self.mesh, &obb, rough, seed, n);
        }
    }

    /// Adds a surface of revolution. The outline is (radius, height above `bottom`), from the
    /// bottom up along the outside. For vessels it continues down along the inside, and for rings
    /// it returns to its first point.
    pub fn lathe(&mut self, bottom: Point3, outline: &[[f32; 2]]) {
        self.lathe_along(bottom, [0.0, 1.0, 0.0], outline);
    }

    /// Adds a surface of revolution around `axis` from `start`.
    pub fn lathe_along(&mut self, start: Point3, axis: Point3, outline: &[[f32; 2]]) {
        let width = outline.iter().fold(0.0f32, |w, p| w.max(p[0]));
        let height = outline.iter().fold(0.0f32, |w, p| w.max(p[1].abs()));
        if !self.covers_pixels(Vec3::new(2.0 * width, height, 2.0 * width)) {
            return;
        }
        let obb =
            OrientedBox { center: Vec3::from(start), axes: upright_along(axis), extent: Vec3::ONE };
        self.begin_plain_material();
        let n = self.detail.segments(width);
        let points: Vec<[f32; 3]> = outline.iter().map(|[r, y]| [*r, *y, 0.0]).collect();
        let kept = simplify_polyline(&points, self.tolerance_m());
        let kept: Vec<[f32; 2]> = kept.into_iter().map(|k| outline[k]).collect();
        forms::lathe(&mut self.mesh, &obb, &kept, n);
    }

    /// Adds a straight rod.
    pub fn rod(&mut self, from: Point3, to: Point3, radius_m: f32) {
        self.taper(from, to, radius_m, radius_m);
    }

    /// Adds a straight rod with a different radius at each end.
    pub fn taper(&mut self, from: Point3, to: Point3, radius_from: f32, radius_to: f32) {
        self.sweep(&[(from, radius_from), (to, radius_to)]);
    }

    /// Adds a pipe of constant radius along a smooth curve through the points.
    pub fn pipe(&mut self, points: &[Point3], radius_m: f32) {
        let points: Vec<(Point3, f32)> = points.iter().map(|p| (*p, radius_m)).collect();
        self.curve(&points);
    }

    /// Adds a pipe with a radius at each point, along a smooth curve through the points.
    pub fn curve(&mut self, points: &[(Point3, f32)]) {
        let length_m: f32 =
            points.windows(2).map(|w| length(Vec3::from(w[1].0) - Vec3::from(w[0].0))).sum();
        let per_span = (self.detail.segments(0.4 * length_m) / points.len().max(1)).clamp(1, 6);
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
        // The profile of the radius needs its own points.
        let tolerance = self.tolerance_m();
        let centers: Vec<Point3> = fine.iter().map(|p| p.0).collect();
        let widths: Vec<Point3> =
            fine.iter().enumerate().map(|(k, p)| [k as f32, p.1, 0.0]).collect();
        let mut kept = simplify_polyline(&centers, tolerance);
        kept.extend(simplify_polyline(&widths, tolerance));
        kept.sort_unstable();
        kept.dedup();
        let kept: Vec<(Point3, f32)> = kept.into_iter().map(|k| fine[k]).collect();
        self.sweep(&kept);
    }

    /// Adds a round pipe with corners at the points.
    pub fn sweep(&mut self, points: &[(Point3, f32)]) {
        let width = points.iter().fold(0.0f32, |w, p| w.max(p.1));
        let length_m: f32 =
            points.windows(2).map(|w| length(Vec3::from(w[1].0) - Vec3::from(w[0].0))).sum();
        if points.len() < 2 || !self.covers_pixels(Vec3::new(2.0 * width, length_m, 2.0 * width)) {
            return;
        }
        let n = self.detail.segments(width).min(16);
        let n = if self.is_level_within(20.0) { n.min(6) } else { n };
        let end = points[points.len() - 1].0;
        let obb = OrientedBox {
            center: Vec3::ZERO,
            axes: upright_along([
                end[0] - points[0].0[0],
                end[1] - points[0].0[1],
                end[2] - points[0].0[2],
            ]),
            extent: Vec3::new(0.1, 1.0, 0.1),
        };
        self.begin_material(&obb);
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

    /// Adds a leaf from `root` to `tip`, `width_m` wide, whose middle is raised by `sag_m`.
    pub fn leaf(&mut self, root: Point3, tip: Point3, width_m: f32, sag_m: f32) {
        let (root, tip) = (Vec3::from(root), Vec3::from(tip));
        let leaf_length = length(tip - root);
        if !self.covers_pixels(Vec3::new(width_m, leaf_length, 0.0)) {
            return;
        }
        self.begin_plain_material();
        let along = unit(tip - root);
        let side = unit(along.cross(Vec3::Y) + Vec3::X * 1e-3);
        let thickness = side.cross(along) * (0.04 * width_m).max(0.0006);
        let shape: &[[f32; 2]] = if self.is_level_within(20.0) {
            &[[0.0, 0.1], [0.45, 1.0], [1.0, 0.04]]
        } else {
            &[[0.0, 0.1], [0.2, 0.7], [0.45, 1.0], [0.75, 0.65], [1.0, 0.04]]
        };
        let sections: Vec<Section> = shape
            .iter()
            .map(|[t, w]| Section {
                center: root + (tip - root) * *t + Vec3::Y * (sag_m * 4.0 * t * (1.0 - t)),
                a: side * (0.5 * width_m * w),
                b: thickness * (0.3 + 0.7 * w),
            })
            .collect();
        self.mesh.tube(&sections, if self.is_level_within(20.0) { 4 } else { 6 });
    }

    /// Adds a ring around `center` in the plane perpendicular to `axis`.
    pub fn hoop(&mut self, center: Point3, axis: Point3, radius_m: f32, tube_radius_m: f32) {
        let outer_diameter = 2.0 * (radius_m + tube_radius_m);
        let tube = 2.0 * tube_radius_m;
        if self.covers_pixel(tube) {
            let extent = Vec3::new(outer_diameter, tube, outer_diameter);
            let obb = OrientedBox { center: Vec3::from(center), axes: upright_along(axis), extent };
            self.begin_material(&obb);
            solids::solid(
                &mut self.mesh,
                Solid::Torus { tube: tube / outer_diameter },
                &obb,
                self.detail,
            );
        }
    }

    /// Adds a plate with an outline in the plane of the rotated x and y axes, `thickness_m` thick. The
    /// outline is counter-clockwise seen from +z and star-shaped around its center.
    pub fn cut(
        &mut self,
        center: Point3,
        outline: &[[f32; 2]],
        thickness_m: f32,
        turn_deg: Point3,
    ) {
        let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
        for p in outline {
            for k in 0..2 {
                (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
            }
        }
        let obb = rotated_box(center, [high[0] - low[0], high[1] - low[1], thickness_m], turn_deg);
        if self.covers_pixels(obb.extent) {
            self.begin_material(&obb);
            let obb = OrientedBox { extent: Vec3::ONE, ..obb };
            forms::extrude(&mut self.mesh, &obb, outline, thickness_m);
        }
    }

    /// Adds a piece of a cylindrical wall around the vertical axis through `bottom`, between two
    /// radii, two heights and two angles (degrees; 0 is the front, -z; 90 is +x).
    pub fn sector(
        &mut self,
        bottom: Point3,
        radii: [f32; 2],
        heights: [f32; 2],
        angles_deg: [f32; 2],
    ) {
        let turn = (angles_deg[1] - angles_deg[0]).to_radians();
        let extent = Vec3::new(radii[1] * turn, heights[1] - heights[0], radii[1] - radii[0]);
        if self.covers_pixels(extent) {
            self.begin_plain_material();
            let n = (self.detail.segments(radii[1]) as f32 * turn / std::f32::consts::TAU) as usize;
            forms::sector(&mut self.mesh, Vec3::from(bottom), radii, heights, angles_deg, n.max(1));
        }
    }
}

/// Simplifies a polyline to the points that keep it within `tolerance` (Douglas-Peucker). It keeps
/// both ends, and at least one point between them for a closed line.
fn simplify_polyline(points: &[Point3], tolerance: f32) -> Vec<usize> {
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
        let distance_to = |k: usize| {
            let d = Vec3::from(points[k]) - a;
            let t = if l2 > 0.0 { (d.dot(along) / l2).clamp(0.0, 1.0) } else { 0.0 };
            length(d - along * t)
        };
        let worst = (from + 1..to).map(|k| (distance_to(k), k)).max_by(|x, y| x.0.total_cmp(&y.0));
        let is_required = closed && (from, to) == (0, n - 1);
        if let Some((distance, k)) = worst
            && (distance > tolerance || is_required)
        {
            spans.push((from, k));
            spans.push((k, to));
        }
    }
    (0..n).filter(|k| kept[*k]).collect()
}

fn rotated_box(center: Point3, size: Point3, turn_deg: Point3) -> OrientedBox {
    let part = Part::new(Solid::Cuboid, center, size, [0; 3], Finish::Matte).turned(turn_deg);
    part_obb(&part, Vec3::ONE)
}

/// Returns axes whose y axis points along `axis`.
fn upright_along(axis: Point3) -> Mat3 {
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
