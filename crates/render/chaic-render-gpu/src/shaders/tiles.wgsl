// Rasterization: inverse depth, visibility id, depth and entity id of each pixel. One workgroup per
// tile of 32 by 32 pixels, four pixels per thread. A workgroup loops over the triangles of its view
// in chunks, keeps those that touch its tile, and each thread tests them against its pixels. The
// nearest triangle wins, and of two equally near ones the lower visibility id, so that the order of
// triangles does not matter.

@group(0) @binding(0) var<storage, read> views: array<View>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> tallies: array<Tally>;
@group(0) @binding(3) var<storage, read> first_triangles: array<u32>;
@group(0) @binding(4) var<storage, read> bounds: array<vec2u>;
@group(0) @binding(5) var<storage, read> setups: array<vec4u>;
// Meters, shape [view, row, column].
@group(0) @binding(6) var<storage, read_write> depth: array<f32>;
// Two ids per word, shape [view, row, word].
@group(0) @binding(7) var<storage, read_write> ids: array<u32>;
// Visibility ids, which shading replaces by colors; shape [view, row, column].
@group(0) @binding(8) var<storage, read_write> color: array<u32>;
@group(0) @binding(9) var<uniform> round: RoundParams;

const TILE: u32 = 32u;
const CHUNK: u32 = 256u;

var<workgroup> list: array<u32, CHUNK>;
var<workgroup> n_listed: atomic<u32>;

// Four pixels: (0, 0), (1, 0), (0, 1), (1, 1) from the first one.
struct Pixels {
    q: vec4f,
    visibility_id: vec4u,
}

@compute @workgroup_size(256)
fn tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let v = round.first_view + group.z;
    let tile = group.xy * TILE;
    let at = tile + 2u * vec2u(thread % 16u, thread / 16u);
    let first = first_triangles[v];
    let n = tallies[v].n_triangles;
    var pixels = Pixels(vec4f(1.0 / FAR_M), vec4u(BACKGROUND));
    for (var base = 0u; base < n; base += CHUNK) {
        let k = base + thread;
        if (k < n) {
            let b = bounds[first + k];
            let low = vec2u(b.y & 0xffffu, b.x & 0xffffu);
            let end = vec2u(b.y >> 16u, b.x >> 16u);
            if (all(low < tile + TILE) && all(end > tile)) {
                list[atomicAdd(&n_listed, 1u)] = first + k;
            }
        }
        workgroupBarrier();
        let m = atomicLoad(&n_listed);
        for (var i = 0u; i < m; i++) {
            pixels = fill(pixels, 4u * list[i], at);
        }
        workgroupBarrier();
        if (thread == 0u) {
            atomicStore(&n_listed, 0u);
        }
        workgroupBarrier();
    }
    write(pixels, v, at);
}

fn fill(before: Pixels, k: u32, at: vec2u) -> Pixels {
    let r3 = setups[k + 3u];
    let rows = vec2u(at.y, at.y + 1u);
    let is_in_rows = (rows >= vec2u(r3.x & 0xffffu)) & (rows < vec2u(r3.x >> 16u));
    if (!any(is_in_rows)) {
        return before;
    }
    let r0 = bitcast<vec4f>(setups[k]);
    let r1 = bitcast<vec4f>(setups[k + 1u]);
    let r2 = bitcast<vec4f>(setups[k + 2u]);
    // Crossings of the two edges with the two rows.
    let v = vec2f(rows) + 0.5;
    let below_a = v - r0.y;
    let long_edge = r0.x + below_a * r0.z;
    let upper = r0.x + below_a * r0.w;
    let lower = r1.x + (v - r1.y) * r1.z;
    let is_upper = rows < vec2u(r3.y & 0xffffu);
    let short_edge = select(lower, upper, is_upper);
    let b_is_right = r3.y >= 0x80000000u;
    let left = select(short_edge, long_edge, b_is_right) - 0.5;
    let right = select(long_edge, short_edge, b_is_right) - 0.5;
    let u = f32(at.x);
    let columns = vec4f(u, u + 1.0, u, u + 1.0);
    let is_in = (left.xxyy <= columns) & (columns < right.xxyy) & is_in_rows.xxyy;
    let q_of_rows = r1.w + r2.y * below_a + r2.x * (0.5 - r0.x);
    let q = clamp(q_of_rows.xxyy + r2.x * columns, vec4f(r2.z), vec4f(r2.w));
    let visibility_id = vec4u(r3.z);
    let is_tie = (q == before.q) & (visibility_id < before.visibility_id) & (before.visibility_id != vec4u(BACKGROUND));
    let wins = is_in & ((q > before.q) | is_tie);
    return Pixels(select(before.q, q, wins), select(before.visibility_id, visibility_id, wins));
}

fn write(pixels: Pixels, v: u32, at: vec2u) {
    let first_instance = views[v].first_instance;
    for (var j = 0u; j < 2u; j++) {
        let row = at.y + j;
        if (row >= round.height || at.x >= round.width) {
            continue;
        }
        let q = select(pixels.q.xy, pixels.q.zw, j == 1u);
        let visibility_id = select(pixels.visibility_id.xy, pixels.visibility_id.zw, j == 1u);
        let line = v * round.height + row;
        var word = 0u;
        for (var i = 0u; i < 2u; i++) {
            if (at.x + i < round.width) {
                let pixel = line * round.width + at.x + i;
                if (visibility_id[i] == BACKGROUND) {
                    depth[pixel] = FAR_M;
                } else {
                    depth[pixel] = 1.0 / q[i];
                    word |= instances[first_instance + (visibility_id[i] >> 16u)].entity << (16u * i);
                }
                if (round.wants_color != 0u) {
                    color[pixel] = visibility_id[i];
                }
            }
        }
        ids[line * round.id_words + at.x / 2u] = word;
    }
}
