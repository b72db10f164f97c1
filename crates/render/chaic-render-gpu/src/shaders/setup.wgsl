// Triangles of visible instances as they lie on the image: a few workgroups a view.

@group(0) @binding(0) var<storage, read> views: array<View>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> meshes: array<Mesh>;
@group(0) @binding(3) var<storage, read> visible: array<u32>;
@group(0) @binding(4) var<storage, read> levels: array<u32>;
// `Tally` word by word, for the atomic count.
@group(0) @binding(5) var<storage, read_write> tallies: array<atomic<u32>>;
// Position, and what shading reads; shape [vertex].
@group(0) @binding(6) var<storage, read> vertices: array<vec4u>;
// Three vertices, skin, whether smooth, packed; shape [triangle].
@group(0) @binding(7) var<storage, read> triangles: array<vec2u>;
// Where in the round's triangles each view's begin; shape [view].
@group(0) @binding(8) var<storage, read> firsts: array<u32>;
// First row, one past the last; first column, one past the last: 16 bits each.
@group(0) @binding(9) var<storage, read_write> bounds: array<vec2u>;
// See `fill`; shape [triangle, 4].
@group(0) @binding(10) var<storage, read_write> filled: array<vec4u>;
@group(0) @binding(11) var<uniform> round: Round;

const CROSSES_NEAR: u32 = 0x80000000u;
const N_THREADS: u32 = 32u;

// Where a triangle goes, and what it is called.
struct Slot {
    view: u32,
    name: u32,
}

// Inverse depth over the image: `q + du * (u - u0) + dv * (v - v0)`, kept within [low, high].
struct Slope {
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
        let into = camera_from(view, instance);
        let level = meshes[instance.mesh].levels[levels[view.first_visible + index]];
        for (var t = thread; t < level.z; t += N_THREADS) {
            let packed = triangles[level.y + t];
            let p = array<vec3f, 3>(
                vertex(into, level.x + (packed.x & 0xffffu)),
                vertex(into, level.x + (packed.x >> 16u)),
                vertex(into, level.x + (packed.y & 0xffffu)),
            );
            let slot = Slot(v, (index << 16u) | t);
            if (crosses_near && min(min(p[0].z, p[1].z), p[2].z) < NEAR_M) {
                cut(view, p, slot);
            } else {
                project(view, p, slot);
            }
        }
    }
}

fn vertex(into: IntoCamera, k: u32) -> vec3f {
    return into_camera(into, bitcast<vec3f>(vertices[k].xyz));
}

// A triangle in front of the camera, if it faces it.
fn project(view: View, p: array<vec3f, 3>, slot: Slot) {
    let q = 1.0 / vec3f(p[0].z, p[1].z, p[2].z);
    let middle = vec2f(view.mu, view.mv);
    let a = middle + p[0].xy * q.x;
    let b = middle + p[1].xy * q.y;
    let c = middle + p[2].xy * q.z;
    let ab = b - a;
    let ac = c - a;
    let area = ab.x * ac.y - ab.y * ac.x;
    // Rows run downwards, so counter-clockwise triangles have negative area here.
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
    fill(a, b, c, Slope(a.x, a.y, q.x, du, dv, low, high), slot);
}

// A triangle that reaches behind the near plane: what is left of it is a triangle or two.
fn cut(view: View, vertex: array<vec3f, 3>, slot: Slot) {
    var p = vertex;
    // The plane n . p = d gives inverse depth 1 / w = (n.x * x / w + n.y * y / w + n.z) / d, however far
    // outside of the image the vertices are.
    let n = cross(p[1] - p[0], p[2] - p[0]);
    let d = dot(n, p[0]);
    if (!(d < 0.0)) {
        return;
    }
    var left: array<vec2f, 4>;
    var n_left = 0u;
    let middle = vec2f(view.mu, view.mv);
    for (var k = 0u; k < 3u; k++) {
        let here = p[k];
        let next = p[(k + 1u) % 3u];
        let is_inside = here.z >= NEAR_M;
        let next_is_inside = next.z >= NEAR_M;
        if (is_inside) {
            left[n_left] = middle + here.xy / here.z;
            n_left++;
        }
        if (is_inside != next_is_inside) {
            // Cut from the inner end outwards, so that a neighbor finds the same point.
            let inner = select(next, here, is_inside);
            let outer = select(here, next, is_inside);
            let t = (inner.z - NEAR_M) / (inner.z - outer.z);
            left[n_left] = middle + (inner.xy + (outer.xy - inner.xy) * t) / NEAR_M;
            n_left++;
        }
    }
    let slope = Slope(view.mu, view.mv, n.z / d, n.x / d, n.y / d, 0.0, 1.0 / NEAR_M);
    if (n_left >= 3u) {
        fill(left[0], left[1], left[2], slope, slot);
    }
    if (n_left == 4u) {
        fill(left[0], left[2], left[3], slope, slot);
    }
}

fn is_before(a: vec2f, b: vec2f) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn per_row(top: vec2f, bottom: vec2f) -> f32 {
    let dv = bottom.y - top.y;
    return select(0.0, (bottom.x - top.x) / dv, dv > 0.0);
}

// Appends what tiles need to fill a triangle: vertices a, b, c from top to bottom, how far edges go
// to the right from row to row (ac, ab, bc), inverse depth at a and its slope, rows and columns.
fn fill(p: vec2f, q: vec2f, r: vec2f, slope: Slope, slot: Slot) {
    var a = p;
    var b = q;
    var c = r;
    if (is_before(b, a)) {
        let t = a;
        a = b;
        b = t;
    }
    if (is_before(c, b)) {
        let t = b;
        b = c;
        c = t;
        if (is_before(b, a)) {
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
    let q_at_a = slope.q + slope.dv * (a.y - slope.v0) + slope.du * (a.x - slope.u0);
    let k = firsts[slot.view] + atomicAdd(&tallies[4u * slot.view + 2u], 1u);
    bounds[k] = vec2u(first | (last << 16u), begin | (end << 16u));
    filled[4u * k] = bitcast<vec4u>(vec4f(a, per_row(a, c), per_row(a, b)));
    filled[4u * k + 1u] = bitcast<vec4u>(vec4f(b, per_row(b, c), q_at_a));
    filled[4u * k + 2u] = bitcast<vec4u>(vec4f(slope.du, slope.dv, slope.low, slope.high));
    let turn = select(0u, 0x80000000u, b_is_right);
    filled[4u * k + 3u] = vec4u(first | (last << 16u), middle | turn, slot.name, 0u);
}
