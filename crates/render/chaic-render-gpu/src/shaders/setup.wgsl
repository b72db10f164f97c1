// Triangle setup of visible instances: several workgroups per view.

@group(0) @binding(0) var<storage, read> views: array<View>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> meshes: array<Mesh>;
@group(0) @binding(3) var<storage, read> visible: array<u32>;
@group(0) @binding(4) var<storage, read> levels: array<u32>;
// `Tally` as words, for the atomic count.
@group(0) @binding(5) var<storage, read_write> tallies: array<atomic<u32>>;
// Position and packed normal; shape [vertex].
@group(0) @binding(6) var<storage, read> vertices: array<vec4u>;
// Three vertices, material and smooth flag, packed; shape [triangle].
@group(0) @binding(7) var<storage, read> triangles: array<vec2u>;
// Offset of each view's triangles in the arena; shape [view].
@group(0) @binding(8) var<storage, read> first_triangles: array<u32>;
// First row, end row; first column, end column: 16 bits each.
@group(0) @binding(9) var<storage, read_write> bounds: array<vec2u>;
// See `fill`; shape [triangle, 4].
@group(0) @binding(10) var<storage, read_write> setups: array<vec4u>;
@group(0) @binding(11) var<uniform> round: RoundParams;

const CROSSES_NEAR: u32 = 0x80000000u;
const N_THREADS: u32 = 32u;

// View and visibility id of a triangle.
struct Slot {
    view: u32,
    visibility_id: u32,
}

// Plane of inverse depth over the image: `q + du * (u - u0) + dv * (v - v0)`, clamped to [low,
// high].
struct DepthPlane {
    u0: f32,
    v0: f32,
    q: f32,
    du: f32,
    dv: f32,
    low: f32,
    high: f32,
}

@compute @workgroup_size(32)
fn setup(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) n_groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let v = round.first_view + group.y;
    let view = views[v];
    let n_visible = atomicLoad(&tallies[4u * v]);
    for (var k = group.x; k < n_visible; k += n_groups.x) {
        let entry = visible[view.first_visible + k];
        let index = entry & ~CROSSES_NEAR;
        let crosses_near = entry >= CROSSES_NEAR;
        let instance = instances[view.first_instance + index];
        let transform = camera_from(view, instance);
        let level = meshes[instance.mesh].levels[levels[view.first_visible + index]];
        for (var t = thread; t < level.z; t += N_THREADS) {
            let packed = triangles[level.y + t];
            let p = array<vec3f, 3>(
                vertex(transform, level.x + (packed.x & 0xffffu)),
                vertex(transform, level.x + (packed.x >> 16u)),
                vertex(transform, level.x + (packed.y & 0xffffu)),
            );
            let slot = Slot(v, (index << 16u) | t);
            if (crosses_near && min(min(p[0].z, p[1].z), p[2].z) < NEAR_M) {
                clip(view, p, slot);
            } else {
                project(view, p, slot);
            }
        }
    }
}

fn vertex(transform: CameraTransform, k: u32) -> vec3f {
    return to_camera(transform, bitcast<vec3f>(vertices[k].xyz));
}

// Projects a triangle in front of the near plane, if it faces the camera.
fn project(view: View, p: array<vec3f, 3>, slot: Slot) {
    let q = 1.0 / vec3f(p[0].z, p[1].z, p[2].z);
    let middle = vec2f(view.mu, view.mv);
    let a = middle + p[0].xy * q.x;
    let b = middle + p[1].xy * q.y;
    let c = middle + p[2].xy * q.z;
    let ab = b - a;
    let ac = c - a;
    let area = ab.x * ac.y - ab.y * ac.x;
    // Rows run downward, so counter-clockwise triangles have negative area here.
    if (!(area < 0.0)) {
        return;
    }
    let bq = q.y - q.x;
    let cq = q.z - q.x;
    let inverse = 1.0 / area;
    let du = (bq * ac.y - cq * ab.y) * inverse;
    let dv = (cq * ab.x - bq * ac.x) * inverse;
    let low = min(min(q.x, q.y), q.z);
    let high = max(max(q.x, q.y), q.z);
    fill(a, b, c, DepthPlane(a.x, a.y, q.x, du, dv, low, high), slot);
}

// Clips a triangle that crosses the near plane: one or two triangles remain.
fn clip(view: View, vertex: array<vec3f, 3>, slot: Slot) {
    var p = vertex;
    // The plane n . p = d gives inverse depth 1 / w = (n.x * x / w + n.y * y / w + n.z) / d, even
    // for vertices far outside the image.
    let n = cross(p[1] - p[0], p[2] - p[0]);
    let d = dot(n, p[0]);
    if (!(d < 0.0)) {
        return;
    }
    var clipped: array<vec2f, 4>;
    var n_clipped = 0u;
    let middle = vec2f(view.mu, view.mv);
    for (var k = 0u; k < 3u; k++) {
        let here = p[k];
        let next = p[(k + 1u) % 3u];
        let is_inside = here.z >= NEAR_M;
        let next_is_inside = next.z >= NEAR_M;
        if (is_inside) {
            clipped[n_clipped] = middle + here.xy / here.z;
            n_clipped++;
        }
        if (is_inside != next_is_inside) {
            // Cut from the inner end outward, so that a neighboring triangle gets the same point.
            let inner = select(next, here, is_inside);
            let outer = select(here, next, is_inside);
            let t = (inner.z - NEAR_M) / (inner.z - outer.z);
            clipped[n_clipped] = middle + (inner.xy + (outer.xy - inner.xy) * t) / NEAR_M;
            n_clipped++;
        }
    }
    let depth_plane = DepthPlane(view.mu, view.mv, n.z / d, n.x / d, n.y / d, 0.0, 1.0 / NEAR_M);
    if (n_clipped >= 3u) {
        fill(clipped[0], clipped[1], clipped[2], depth_plane, slot);
    }
    if (n_clipped == 4u) {
        fill(clipped[0], clipped[2], clipped[3], depth_plane, slot);
    }
}

fn is_above(a: vec2f, b: vec2f) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn columns_per_row(top: vec2f, bottom: vec2f) -> f32 {
    let dv = bottom.y - top.y;
    return select(0.0, (bottom.x - top.x) / dv, dv > 0.0);
}

// Appends a triangle for rasterization: vertices a, b, c from top to bottom, columns per row along
// the edges (ac, ab, bc), inverse depth at a and its gradient, and the row range.
fn fill(p: vec2f, q: vec2f, r: vec2f, depth_plane: DepthPlane, slot: Slot) {
    var a = p;
    var b = q;
    var c = r;
    if (is_above(b, a)) {
        let t = a;
        a = b;
        b = t;
    }
    if (is_above(c, b)) {
        let t = b;
        b = c;
        c = t;
        if (is_above(b, a)) {
            let s = a;
            a = b;
            b = s;
        }
    }
    let first = first_center(a.y, round.height);
    let middle = first_center(b.y, round.height);
    let last = first_center(c.y, round.height);
    let begin = first_center(min(min(a.x, b.x), c.x), round.width);
    let end = first_center(max(max(a.x, b.x), c.x), round.width);
    if (first >= last || begin >= end) {
        return;
    }
    let b_is_right = (b.x - a.x) * (c.y - a.y) > (c.x - a.x) * (b.y - a.y);
    let q_at_a = depth_plane.q + depth_plane.dv * (a.y - depth_plane.v0) + depth_plane.du * (a.x - depth_plane.u0);
    let k = first_triangles[slot.view] + atomicAdd(&tallies[4u * slot.view + 2u], 1u);
    bounds[k] = vec2u(first | (last << 16u), begin | (end << 16u));
    setups[4u * k] = bitcast<vec4u>(vec4f(a, columns_per_row(a, c), columns_per_row(a, b)));
    setups[4u * k + 1u] = bitcast<vec4u>(vec4f(b, columns_per_row(b, c), q_at_a));
    setups[4u * k + 2u] = bitcast<vec4u>(vec4f(depth_plane.du, depth_plane.dv, depth_plane.low, depth_plane.high));
    let turn = select(0u, 0x80000000u, b_is_right);
    setups[4u * k + 3u] = vec4u(first | (last << 16u), middle | turn, slot.visibility_id, 0u);
}
