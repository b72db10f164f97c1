// Culling and level of detail of instances: one workgroup per view.

@group(0) @binding(0) var<storage, read> views: array<View>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> meshes: array<Mesh>;
// Instance index; the top bit is set if it crosses the near plane. Shape [view, visible].
@group(0) @binding(3) var<storage, read_write> visible: array<u32>;
// Level of detail; shape [view, instance].
@group(0) @binding(4) var<storage, read_write> levels: array<u32>;
@group(0) @binding(5) var<storage, read_write> tallies: array<Tally>;

const CROSSES_NEAR: u32 = 0x80000000u;

var<workgroup> n_visible: atomic<u32>;
var<workgroup> max_triangles: atomic<u32>;

@compute @workgroup_size(64)
fn cull(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let view = views[group.x];
    for (var k = thread; k < view.n_instances; k += 64u) {
        cull_instance(view, k);
    }
    workgroupBarrier();
    if (thread == 0u) {
        tallies[group.x].n_visible = atomicLoad(&n_visible);
        tallies[group.x].max_triangles = atomicLoad(&max_triangles);
        tallies[group.x].n_triangles = 0u;
    }
}

fn cull_instance(view: View, k: u32) {
    let instance = instances[view.first_instance + k];
    if (instance.entity == view.hidden_body || instance.entity == view.hidden_ceiling) {
        return;
    }
    // Portal culling: skip instances in rooms without a line of sight.
    let visible_low = view.regions_low & instance.regions_low;
    if ((visible_low | (view.regions_high & instance.regions_high)) == 0u) {
        return;
    }
    let transform = camera_from(view, instance);
    var outside_all = 63u;
    var crosses_near = false;
    var low = vec2f(1e30);
    var high = vec2f(-1e30);
    for (var c = 0u; c < 8u; c++) {
        let is_high = ((vec3u(c) >> vec3u(0u, 1u, 2u)) & vec3u(1u)) == vec3u(1u);
        let p = to_camera(transform, select(instance.low, instance.high, is_high));
        var outside = select(0u, 1u, p.x < -view.mu * p.z);
        outside |= select(0u, 2u, p.x > view.mu * p.z);
        outside |= select(0u, 4u, p.y < -view.mv * p.z);
        outside |= select(0u, 8u, p.y > view.mv * p.z);
        outside |= select(0u, 16u, p.z < NEAR_M);
        outside |= select(0u, 32u, p.z > FAR_M);
        outside_all &= outside;
        if (p.z < NEAR_M) {
            crosses_near = true;
        } else {
            let at = vec2f(view.mu, view.mv) + p.xy / p.z;
            low = min(low, at);
            high = max(high, at);
        }
    }
    if (outside_all != 0u) {
        return;
    }
    if (!crosses_near && (misses_pixel_centers(low.x, high.x) || misses_pixel_centers(low.y, high.y))) {
        return;
    }
    var level = N_LEVELS - 1u;
    if (!crosses_near) {
        let radius_px = 0.5 * max(high.x - low.x, high.y - low.y);
        level = level_for(radius_px);
    }
    let max_of_instance = meshes[instance.mesh].levels[level].z * select(1u, 2u, crosses_near);
    levels[view.first_visible + k] = level;
    let slot = atomicAdd(&n_visible, 1u);
    visible[view.first_visible + slot] = k | select(0u, CROSSES_NEAR, crosses_near);
    atomicAdd(&max_triangles, max_of_instance);
}

// Returns whether no pixel center lies between the two coordinates.
fn misses_pixel_centers(low: f32, high: f32) -> bool {
    let t = low - 0.5;
    return t > 0.0 && u32(t) == u32(high - 0.5) && floor(t) != t;
}

fn level_for(radius_px: f32) -> u32 {
    var level = 0u;
    for (var k = 0u; k < N_LEVELS - 1u; k++) {
        level += select(0u, 1u, radius_px > LEVEL_RADIUS_PX[k]);
    }
    return level;
}
