//! Drawing of one camera's view: frustum, portal and occlusion culling, draw order, rasterization.

use chaic_core::{EntityId, Vec3};

use crate::clip::clip;
use crate::mesh::Mesh;
use crate::portals::VisibleRegions;
use crate::projection::{CameraTransform, Projection};
use crate::raster::{RenderTarget, VisibilityId};
use crate::scene_frame::{Instance, SceneFrame};
use crate::setup::{SETUP_BATCH_SIZE, ScreenVertices, TriangleSetup, TriangleSetups};
use crate::shade::{DrawnInstances, ShadingBuffers};
use crate::solids::level_for;

/// Buffers that one thread reuses for every view.
#[derive(Default)]
pub(crate) struct Scratch {
    /// Render target of views with color.
    pub target: RenderTarget<u32>,
    /// Render target of views without color.
    pub id_target: RenderTarget<u16>,
    pub buffers: DrawBuffers,
    pub shading: ShadingBuffers,
}

/// Buffers of drawing apart from the render target.
#[derive(Default)]
pub(crate) struct DrawBuffers {
    /// Vector width for which the inner loops are compiled: the widest of this machine.
    pub arch: pulp::Arch,
    vertices: ScreenVertices,
    setups: TriangleSetups,
    /// Indices of triangles that may cover a pixel.
    survivors: Vec<u32>,
    candidates: Vec<Candidate>,
    visible: VisibleRegions,
    /// Level of detail of each instance in this view.
    pub levels: Vec<u8>,
    /// Offset of the first triangle of each drawn instance.
    pub first_triangles: Vec<u32>,
    /// Total number of triangles of all drawn instances.
    pub n_triangles: usize,
}

impl DrawBuffers {
    /// Returns the instances of the last draw call.
    pub fn drawn_instances(&self) -> DrawnInstances<'_> {
        DrawnInstances {
            arch: self.arch,
            levels: &self.levels,
            first_triangles: &self.first_triangles,
            n_triangles: self.n_triangles,
        }
    }
}

/// Parts of a scene that a view leaves out.
#[derive(Clone, Copy)]
pub(crate) struct Exclusions {
    pub body: Option<EntityId>,
    pub ceiling: bool,
}

/// An instance that may be visible.
struct Candidate {
    distance: f32,
    index: u32,
    is_structure: bool,
    screen_bounds: ScreenBounds,
}

/// Screen-space bounds of an instance.
#[derive(Clone, Copy)]
pub(crate) struct ScreenBounds {
    /// Minimum u, minimum v, maximum u, maximum v, pixels.
    rect: [f32; 4],
    nearest: f32,
    crosses_near: bool,
}

impl ScreenBounds {
    /// Half of the longer side, pixels, which selects the level of detail. `f32::MAX` if the bounds
    /// cross the near plane.
    pub fn radius_px(&self) -> f32 {
        let [u0, v0, u1, v1] = self.rect;
        if self.crosses_near { f32::MAX } else { 0.5 * (u1 - u0).max(v1 - v0) }
    }
}

/// Rasterizes all visible instances of a frame into the target.
pub(crate) fn draw<V: VisibilityId>(
    frame: &SceneFrame,
    projection: &Projection,
    exclusions: Exclusions,
    target: &mut RenderTarget<V>,
    buffers: &mut DrawBuffers,
) {
    let DrawBuffers {
        arch,
        vertices,
        setups,
        survivors,
        candidates,
        visible,
        levels,
        first_triangles,
        n_triangles,
    } = buffers;
    first_triangles.clear();
    first_triangles.resize(frame.instances.len(), 0);
    *n_triangles = 0;
    arch.dispatch(ClearTarget { target, projection });
    levels.clear();
    levels.resize(frame.instances.len(), 0);
    candidates.clear();
    frame.portals.find_visible(projection, visible);
    for (index, instance) in frame.instances.iter().enumerate().take(0xffff) {
        if exclusions.body == Some(instance.entity)
            || (exclusions.ceiling && instance.entity == EntityId::CEILING)
            // A map shows doorways, not the walls above them.
            || (projection.is_plan && instance.entity == EntityId::WALL && instance.min.y > 1.0)
        {
            continue;
        }
        // Regions of the structure are known, so this test is cheaper than that of the frustum.
        if instance.regions.is_some_and(|regions| !visible.may_show(regions, None)) {
            continue;
        }
        let transform = projection.camera_from(&instance.rotation, instance.origin);
        if let Some(screen_bounds) = screen_bounds(instance.corners(), projection, &transform) {
            let rect = (!screen_bounds.crosses_near).then_some(screen_bounds.rect);
            if !visible.may_show(instance.regions_in(frame.portals), rect) {
                continue;
            }
            let is_structure = instance.entity < EntityId::FIRST_PERSON;
            let distance = instance.distance(projection.eye);
            candidates.push(Candidate {
                distance,
                index: index as u32,
                is_structure,
                screen_bounds,
            });
        }
    }
    // Structure first because it occludes the most; each group from front to back.
    candidates.sort_by(|a, b| {
        let key = |c: &Candidate| (!c.is_structure, c.distance);
        let ((sa, da), (sb, db)) = (key(a), key(b));
        sa.cmp(&sb).then(da.total_cmp(&db)).then(a.index.cmp(&b.index))
    });
    for candidate in candidates.iter() {
        let ScreenBounds { rect, nearest, crosses_near } = candidate.screen_bounds;
        let q = projection.inverse_depth(nearest);
        if !crosses_near && arch.dispatch(IsOccluded { target: &mut *target, rect, q }) {
            continue;
        }
        let instance = &frame.instances[candidate.index as usize];
        let level = level_for(candidate.screen_bounds.radius_px());
        levels[candidate.index as usize] = level as u8;
        first_triangles[candidate.index as usize] = *n_triangles as u32;
        *n_triangles += instance.shape.mesh(level).triangles.len();
        let drawing = InstanceDraw { instance, index: candidate.index as usize, level, projection };
        arch.dispatch(DrawInstance { drawing, crosses_near, target, vertices, setups, survivors });
        let unbounded = [f32::NEG_INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::INFINITY];
        target.mark_dirty(if crosses_near { unbounded } else { rect });
    }
}

/// Returns the screen-space bounds of a box; `None` if it is outside the frustum.
pub(crate) fn screen_bounds(
    corners: [Vec3; 8],
    projection: &Projection,
    transform: &CameraTransform,
) -> Option<ScreenBounds> {
    let (mu, mv) = projection.center();
    let (near, far) = (projection.near_m(), projection.far_m());
    let mut outside_all = 0b11_1111u32;
    let mut crosses_near = false;
    let mut rect = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
    let mut nearest = f32::INFINITY;
    for corner in corners {
        let p = transform.map(corner);
        if !p.is_finite() {
            return None;
        }
        let scale = if projection.is_plan { 1.0 } else { p.z };
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
    // A box between two rows or columns of pixel centers covers no pixel.
    let misses_pixel_centers = |low: f32, high: f32| {
        low > 0.5
            && (low - 0.5) as i32 == (high - 0.5) as i32
            && (low - 0.5) as i32 as f32 != low - 0.5
    };
    if !crosses_near
        && (misses_pixel_centers(rect[0], rect[2]) || misses_pixel_centers(rect[1], rect[3]))
    {
        return None;
    }
    // The plan camera is above everything.
    (!(crosses_near && projection.is_plan)).then_some(ScreenBounds { rect, nearest, crosses_near })
}

/// One instance to draw.
struct InstanceDraw<'a> {
    instance: &'a Instance<'a>,
    index: usize,
    level: usize,
    projection: &'a Projection,
}

/// Draws one instance. Compiled for each vector width and dispatched to the widest one of the
/// machine.
struct DrawInstance<'a, V: VisibilityId> {
    drawing: InstanceDraw<'a>,
    crosses_near: bool,
    target: &'a mut RenderTarget<V>,
    vertices: &'a mut ScreenVertices,
    setups: &'a mut TriangleSetups,
    survivors: &'a mut Vec<u32>,
}

impl<V: VisibilityId> pulp::NullaryFnOnce for DrawInstance<'_, V> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let DrawInstance { drawing, crosses_near, target, vertices, setups, survivors } = self;
        drawing.draw(crosses_near, target, vertices, setups, survivors);
    }
}

/// Clears a render target, compiled likewise.
struct ClearTarget<'a, V: VisibilityId> {
    target: &'a mut RenderTarget<V>,
    projection: &'a Projection,
}

impl<V: VisibilityId> pulp::NullaryFnOnce for ClearTarget<'_, V> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Projection { width, height, .. } = *self.projection;
        self.target.clear(
            width,
            height,
            self.projection.inverse_depth(self.projection.far_m()).max(0.0),
        );
    }
}

/// Tests a rectangle against the hierarchical z-buffer, compiled likewise.
struct IsOccluded<'a, V: VisibilityId> {
    target: &'a mut RenderTarget<V>,
    rect: [f32; 4],
    q: f32,
}

impl<V: VisibilityId> pulp::NullaryFnOnce for IsOccluded<'_, V> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.target.is_occluded(self.rect, self.q)
    }
}

impl InstanceDraw<'_> {
    #[inline(always)]
    fn visibility_id<V: VisibilityId>(&self, mesh: &Mesh, triangle: usize) -> V {
        V::new(self.instance.entity, self.index, usize::from(mesh.faces[triangle]))
    }

    #[inline(always)]
    fn draw<V: VisibilityId>(
        &self,
        crosses_near: bool,
        target: &mut RenderTarget<V>,
        vertices: &mut ScreenVertices,
        setups: &mut TriangleSetups,
        survivors: &mut Vec<u32>,
    ) {
        let projection = self.projection;
        let mesh = self.instance.shape.mesh(self.level);
        let transform = projection.camera_from(&self.instance.rotation, self.instance.origin);
        vertices.project_vertices(&mesh.positions, &transform, projection);
        // A plan view has no near plane.
        let nearest = if projection.is_plan { f32::INFINITY } else { 1.0 / projection.near_m() };
        let n_vertices = mesh.positions.len();
        vertices.cull_backfaces(n_vertices, &mesh.indices, projection, nearest, survivors);
        let rows = projection.height as f32;
        let lists = mesh.indices.each_ref().map(|list| &list[..]);
        for batch in survivors.chunks(SETUP_BATCH_SIZE) {
            let mut triangles = [0; SETUP_BATCH_SIZE];
            triangles[..batch.len()].copy_from_slice(batch);
            setups.fill(&triangles, &lists, vertices, rows);
            for (k, triangle) in batch.iter().enumerate() {
                target.fill(&setups.get(k), self.visibility_id(mesh, *triangle as usize));
            }
        }
        if crosses_near {
            self.draw_clipped(&transform, nearest, target, vertices);
        }
    }

    /// Draws the triangles that cross the near plane.
    #[inline(always)]
    fn draw_clipped<V: VisibilityId>(
        &self,
        transform: &CameraTransform,
        nearest: f32,
        target: &mut RenderTarget<V>,
        vertices: &ScreenVertices,
    ) {
        let mesh = self.instance.shape.mesh(self.level);
        let (near, rows) = (self.projection.near_m(), self.projection.height as f32);
        for (triangle, (a, b, c)) in mesh.triangle_indices().enumerate() {
            let in_front = [a, b, c].map(|c| vertices.is_beyond_near_plane(c, nearest));
            if in_front == [true; 3] || in_front == [false; 3] {
                continue;
            }
            let p: [Vec3; 3] = [a, b, c].map(|c| transform.map(mesh.positions[usize::from(c)]));
            let Some(clipped) = clip(p, near, self.projection.center()) else { continue };
            for j in 2..clipped.n {
                let fan = [clipped.vertices[0], clipped.vertices[j - 1], clipped.vertices[j]];
                target.fill(
                    &TriangleSetup::from_vertices(fan, clipped.depth_plane, rows),
                    self.visibility_id(mesh, triangle),
                );
            }
        }
    }
}
