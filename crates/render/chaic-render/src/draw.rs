//! Drawing of one camera's view: frustum, portal and occlusion culling, draw order, rasterization.

use chaic_core::{EntityId, Vec3};

use crate::clip::clip;
use crate::frame::{Frame, Instance};
use crate::lens::{IntoCamera, Lens};
use crate::mesh::Mesh;
use crate::portals::VisibleRegions;
use crate::raster::{Target, VisibilityId};
use crate::setup::{N_SETUPS, ScreenVertices, Setup, Setups};
use crate::solids::level_for;

/// Buffers that one thread uses again and again.
#[derive(Default)]
pub(crate) struct Scratch {
    /// For views in color.
    pub target: Target<u32>,
    /// For all others.
    pub plain: Target<u16>,
    pub work: Work,
    pub canvas: crate::shade::Canvas,
}

/// What drawing needs beside its target.
#[derive(Default)]
pub(crate) struct Work {
    /// For which vectors the inner loops are compiled: the widest of this machine.
    pub arch: pulp::Arch,
    vertices: ScreenVertices,
    setups: Setups,
    /// Triangles that may cover a pixel.
    alive: Vec<u32>,
    order: Vec<Candidate>,
    seen: VisibleRegions,
    /// Level of detail of each instance in this view.
    pub levels: Vec<u8>,
    /// The number of the first triangle of each instance that is drawn.
    pub firsts: Vec<u32>,
    /// How many triangles the instances that are drawn have.
    pub n_triangles: usize,
}

/// What is left out of a view.
#[derive(Clone, Copy)]
pub(crate) struct Omit {
    pub body: Option<EntityId>,
    pub ceiling: bool,
}

/// An instance that may be in view.
struct Candidate {
    distance: f32,
    index: u32,
    is_structure: bool,
    outline: Outline,
}

/// Where the bounds of an instance are on the image.
#[derive(Clone, Copy)]
pub(crate) struct Outline {
    /// Least u, least v, most u, most v, pixels.
    rect: [f32; 4],
    nearest: f32,
    crosses_near: bool,
}

impl Outline {
    /// Half of the longer side, pixels: what decides the level of detail. Large if it reaches behind
    /// the near plane.
    pub fn radius_px(&self) -> f32 {
        let [u0, v0, u1, v1] = self.rect;
        if self.crosses_near { f32::MAX } else { 0.5 * (u1 - u0).max(v1 - v0) }
    }
}

/// Draws all that a lens sees of a frame into the target.
pub(crate) fn draw<O: VisibilityId>(
    frame: &Frame,
    lens: &Lens,
    omit: Omit,
    target: &mut Target<O>,
    work: &mut Work,
) {
    let Work { arch, vertices, setups, alive, order, seen, levels, firsts, n_triangles } = work;
    firsts.clear();
    firsts.resize(frame.instances.len(), 0);
    *n_triangles = 0;
    arch.dispatch(Clear { target, lens });
    levels.clear();
    levels.resize(frame.instances.len(), 0);
    order.clear();
    frame.regions.find_visible(lens, seen);
    for (index, instance) in frame.instances.iter().enumerate().take(0xffff) {
        if omit.body == Some(instance.entity)
            || (omit.ceiling && instance.entity == EntityId::CEILING)
            // A map shows doors, not what is above them.
            || (lens.is_plan && instance.entity == EntityId::WALL && instance.min.y > 1.0)
        {
            continue;
        }
        let into = lens.camera_from(&instance.rotation, instance.origin);
        if let Some(outline) = outline(instance.corners(), lens, &into) {
            let rect = (!outline.crosses_near).then_some(outline.rect);
            if !seen.shows(instance.regions_among(frame.regions), rect) {
                continue;
            }
            let is_structure = instance.entity < EntityId::FIRST_PERSON;
            let distance = instance.distance(lens.eye);
            order.push(Candidate { distance, index: index as u32, is_structure, outline });
        }
    }
    // Walls and floors first since they hide the most; each group from near to far.
    order.sort_by(|a, b| {
        let key = |c: &Candidate| (!c.is_structure, c.distance);
        let ((sa, da), (sb, db)) = (key(a), key(b));
        sa.cmp(&sb).then(da.total_cmp(&db)).then(a.index.cmp(&b.index))
    });
    for candidate in order.iter() {
        let Outline { rect, nearest, crosses_near } = candidate.outline;
        let q = lens.inverse_depth(nearest);
        if !crosses_near && arch.dispatch(IsOccluded { target: &mut *target, rect, q }) {
            continue;
        }
        let instance = &frame.instances[candidate.index as usize];
        let level = level_for(candidate.outline.radius_px());
        levels[candidate.index as usize] = level as u8;
        firsts[candidate.index as usize] = *n_triangles as u32;
        *n_triangles += instance.shape.mesh(level).triangles.len();
        let drawing = Drawing { instance, index: candidate.index as usize, level, lens };
        arch.dispatch(DrawOne { drawing, crosses_near, target, vertices, setups, alive });
        let everywhere = [f32::NEG_INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::INFINITY];
        target.touch(if crosses_near { everywhere } else { rect });
    }
}

/// Where a box of these corners is on the image; `None` if outside of it.
pub(crate) fn outline(corners: [Vec3; 8], lens: &Lens, into: &IntoCamera) -> Option<Outline> {
    let (mu, mv) = lens.middle();
    let (near, far) = (lens.near_m(), lens.far_m());
    let mut outside_all = 0b11_1111u32;
    let mut crosses_near = false;
    let mut rect = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
    let mut nearest = f32::INFINITY;
    for corner in corners {
        let p = into.map(corner);
        if !p.is_finite() {
            return None;
        }
        let scale = if lens.is_plan { 1.0 } else { p.z };
        let outside = [
            p.x < -mu * scale,
            p.x > mu * scale,
            p.y < -mv * scale,
            p.y > mv * scale,
            p.z < near,
            p.z > far,
        ];
        let bits = outside.iter().enumerate().fold(0, |bits, (k, out)| bits | u32::from(*out) << k);
        outside_all &= bits;
        nearest = nearest.min(p.z);
        if p.z < near {
            crosses_near = true;
        } else {
            let (u, v) = (mu + p.x / scale, mv + p.y / scale);
            rect = [rect[0].min(u), rect[1].min(v), rect[2].max(u), rect[3].max(v)];
        }
    }
    if outside_all != 0 {
        return None;
    }
    // A box between two rows or columns of pixel centers covers none.
    let between = |low: f32, high: f32| {
        low > 0.5
            && (low - 0.5) as i32 == (high - 0.5) as i32
            && (low - 0.5) as i32 as f32 != low - 0.5
    };
    if !crosses_near && (between(rect[0], rect[2]) || between(rect[1], rect[3])) {
        return None;
    }
    // The plan camera stands above everything.
    (!(crosses_near && lens.is_plan)).then_some(Outline { rect, nearest, crosses_near })
}

/// One instance being drawn.
struct Drawing<'a> {
    instance: &'a Instance<'a>,
    index: usize,
    level: usize,
    lens: &'a Lens,
}

/// Draws one instance, compiled for each kind of vectors and called for the widest that the
/// machine has.
struct DrawOne<'a, O: VisibilityId> {
    drawing: Drawing<'a>,
    crosses_near: bool,
    target: &'a mut Target<O>,
    vertices: &'a mut ScreenVertices,
    setups: &'a mut Setups,
    alive: &'a mut Vec<u32>,
}

impl<O: VisibilityId> pulp::NullaryFnOnce for DrawOne<'_, O> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let DrawOne { drawing, crosses_near, target, vertices, setups, alive } = self;
        drawing.draw(crosses_near, target, vertices, setups, alive);
    }
}

/// Begins an image, likewise.
struct Clear<'a, O: VisibilityId> {
    target: &'a mut Target<O>,
    lens: &'a Lens,
}

impl<O: VisibilityId> pulp::NullaryFnOnce for Clear<'_, O> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Lens { width, height, .. } = *self.lens;
        self.target.clear(width, height, self.lens.inverse_depth(self.lens.far_m()).max(0.0));
    }
}

/// Asks the hierarchical Z buffer, likewise.
struct IsOccluded<'a, O: VisibilityId> {
    target: &'a mut Target<O>,
    rect: [f32; 4],
    q: f32,
}

impl<O: VisibilityId> pulp::NullaryFnOnce for IsOccluded<'_, O> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.target.is_occluded(self.rect, self.q)
    }
}

impl Drawing<'_> {
    #[inline(always)]
    fn visibility_id<O: VisibilityId>(&self, mesh: &Mesh, triangle: usize) -> O {
        O::of(self.instance.entity, self.index, usize::from(mesh.faces[triangle]))
    }

    #[inline(always)]
    fn draw<O: VisibilityId>(
        &self,
        crosses_near: bool,
        target: &mut Target<O>,
        vertices: &mut ScreenVertices,
        setups: &mut Setups,
        alive: &mut Vec<u32>,
    ) {
        let lens = self.lens;
        let mesh = self.instance.shape.mesh(self.level);
        let into = lens.camera_from(&self.instance.rotation, self.instance.origin);
        vertices.place(&mesh.positions, &into, lens);
        // Of a plan view nothing is too near.
        let nearest = if lens.is_plan { f32::INFINITY } else { 1.0 / lens.near_m() };
        vertices.find_alive(&mesh.indices, lens, nearest, alive);
        let rows = lens.height as f32;
        let lists = mesh.indices.each_ref().map(|list| &list[..]);
        for few in alive.chunks(N_SETUPS) {
            let mut triangles = [0; N_SETUPS];
            triangles[..few.len()].copy_from_slice(few);
            setups.fill(&triangles, &lists, vertices, rows);
            for (k, triangle) in few.iter().enumerate() {
                target.fill(&setups.get(k), self.visibility_id(mesh, *triangle as usize));
            }
        }
        if crosses_near {
            self.draw_clipped(&into, nearest, target, vertices);
        }
    }

    /// Draws those that reach behind the camera.
    #[inline(always)]
    fn draw_clipped<O: VisibilityId>(
        &self,
        into: &IntoCamera,
        nearest: f32,
        target: &mut Target<O>,
        vertices: &ScreenVertices,
    ) {
        let mesh = self.instance.shape.mesh(self.level);
        let (near, rows) = (self.lens.near_m(), self.lens.height as f32);
        for (triangle, (a, b, c)) in mesh.triangle_indices().enumerate() {
            let in_front = [a, b, c].map(|c| vertices.is_in_front(c, nearest));
            if in_front == [true; 3] || in_front == [false; 3] {
                continue;
            }
            let p: [Vec3; 3] = [a, b, c].map(|c| into.map(mesh.positions[usize::from(c)]));
            let Some(clipped) = clip(p, near, self.lens.middle()) else { continue };
            for j in 2..clipped.n {
                let fan = [clipped.vertices[0], clipped.vertices[j - 1], clipped.vertices[j]];
                target
                    .fill(&Setup::of(fan, clipped.slope, rows), self.visibility_id(mesh, triangle));
            }
        }
    }
}
