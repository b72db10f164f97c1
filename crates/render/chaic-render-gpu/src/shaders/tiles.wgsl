// Inverse depth, visibility id, depth and ids of each pixel: one workgroup a tile of 32 by 32 pixels, one thread
// four pixels. A workgroup goes through the triangles of its view in chunks, keeps those that touch
// its tile, and lets each thread compare them with its own pixels. Whoever is nearest wins, the
// lower name where two are equally near: the order of triangles doesn't matter.

@group(0) @binding(0) var<storage, read> views: array<View>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> tallies: array<Tally>;
@group(0) @binding(3) var<storage, read> firsts: array<u32>;
@group(0) @binding(4) var<storage, read> bounds: array<vec2u>;
@group(0) @binding(5) var<storage, read> filled: array<vec4u>;
// Metres, shape [view, row, column].
@group(0) @binding(6) var<storage, read_write> depth: array<f32>;
// Two ids a word, shape [view, row, word].
@group(0) @binding(7) var<storage, read_write> ids: array<u32>;
// Names for shading to put colors in place of; shape [view, row, column].
@group(0) @binding(8) var<storage, read_write> color: array<u32>;
@group(0) @binding(9) var<uniform> round: Round;

const TILE: u32 = 32u;
const CHUNK: u32 = 256u;

var<workgroup> list: array<u32, CHUNK>;
var<workgroup> n_listed: atomic<u32>;

// Four pixels: (0, 0), (1, 0), (0, 1), (1, 1) from the first one.
struct Pixels {
    q: vec4f,
    name: vec4u,
}

@compute @workgroup_size(256)
fn tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let v = round.first_view + group.z;
    let tile = group.xy * TILE;
    let at = tile + 2u * vec2u(thread % 16u, thread / 16u);
    let first = firsts[v];
    let n = tallies[v].n_triangles;
    var pixels = Pixels(vec4f(1.0 / FAR_M), vec4u(NOBODY));
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
    let r3 = filled[k + 3u];
    let rows = vec2u(at.y, at.y + 1u);
    let is_in_rows = (rows >= vec2u(r3.x & 0xffffu)) & (rows < vec2u(r3.x >> 16u));
    if (!any(is_in_rows)) {
        return before;
    }
    let r0 = bitcast<vec4f>(filled[k]);
    let r1 = bitcast<vec4f>(filled[k + 1u]);
    let r2 = bitcast<vec4f>(filled[k + 2u]);
    // Where the two edges cross the two rows.
    let v = vec2f(rows) + 0.5;
    let below_a = v - r0.y;
    let long = r0.x + below_a * r0.z;
    let upper = r0.x + below_a * r0.w;
    let lower = r1.x + (v - r1.y) * r1.z;
    let is_upper = rows < vec2u(r3.y & 0xffffu);
    let short = select(lower, upper, is_upper);
    let b_is_right = r3.y >= 0x80000000u;
    let left = select(short, long, b_is_right) - 0.5;
    let right = select(long, short, b_is_right) - 0.5;
    let u = f32(at.x);
    let columns = vec4f(u, u + 1.0, u, u + 1.0);
    let is_in = (left.xxyy <= columns) & (columns < right.xxyy) & is_in_rows.xxyy;
    let q_of_rows = r1.w + r2.y * below_a + r2.x * (0.5 - r0.x);
    let q = clamp(q_of_rows.xxyy + r2.x * columns, vec4f(r2.z), vec4f(r2.w));
    let name = vec4u(r3.z);
    let is_level = (q == before.q) & (name < before.name) & (before.name != vec4u(NOBODY));
    let wins = is_in & ((q > before.q) | is_level);
    return Pixels(select(before.q, q, wins), select(before.name, name, wins));
}

fn write(pixels: Pixels, v: u32, at: vec2u) {
    let first_instance = views[v].first_instance;
    for (var j = 0u; j < 2u; j++) {
        let row = at.y + j;
        if (row >= round.height || at.x >= round.width) {
            continue;
        }
        let q = select(pixels.q.xy, pixels.q.zw, j == 1u);
        let name = select(pixels.name.xy, pixels.name.zw, j == 1u);
        let line = v * round.height + row;
        var word = 0u;
        for (var i = 0u; i < 2u; i++) {
            if (at.x + i < round.width) {
                let pixel = line * round.width + at.x + i;
                if (name[i] == NOBODY) {
                    depth[pixel] = FAR_M;
                } else {
                    depth[pixel] = 1.0 / q[i];
                    word |= instances[first_instance + (name[i] >> 16u)].entity << (16u * i);
                }
                if (round.wants_color != 0u) {
                    color[pixel] = name[i];
                }
            }
        }
        ids[line * round.id_words + at.x / 2u] = word;
    }
}
