//! Layer normalization of each pixel: its channels are scaled to mean 0 and variance 1, then by a
//! learned scale and shift ("Layer Normalization", 2016). No pixel depends on others, so that batches may have any
//! size and images any number.

/// Added to variances.
const EPSILON: f32 = 1e-5;
/// Sums run in so many lanes, which are added in one order: the same bits with vectors of any width.
pub(crate) const LANES: usize = 16;

/// The sum of lanes, half onto half.
#[inline(always)]
fn total(mut lanes: [f32; LANES]) -> f32 {
    let mut n = LANES / 2;
    while n > 0 {
        for k in 0..n {
            lanes[k] += lanes[k + n];
        }
        n /= 2;
    }
    lanes[0]
}

/// Mean of a pixel's channels, and one over their deviation.
#[inline(always)]
fn statistics(pixel: &[f32]) -> (f32, f32) {
    let part = 1.0 / pixel.len() as f32;
    let mut sums = [0.0; LANES];
    for x in pixel.as_chunks::<LANES>().0 {
        for k in 0..LANES {
            sums[k] += x[k];
        }
    }
    let mean = part * total(sums);
    let mut squares = [0.0; LANES];
    for x in pixel.as_chunks::<LANES>().0 {
        for k in 0..LANES {
            squares[k] += (x[k] - mean) * (x[k] - mean);
        }
    }
    (mean, 1.0 / (part * total(squares) + EPSILON).sqrt())
}

/// Normalizes maps, shape [pixels, channels], into `out`, compiled for the widest vectors. What is less
/// than `floor` becomes that.
pub(crate) struct Forward<'a> {
    pub map: &'a [f32],
    pub scale: &'a [f32],
    pub shift: &'a [f32],
    pub floor: f32,
    pub out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Forward { map, scale, shift, floor, out } = self;
        let channels = scale.len();
        let shift = &shift[..channels];
        for (x, out) in map.chunks_exact(channels).zip(out.chunks_exact_mut(channels)) {
            let (mean, inverse) = statistics(x);
            for c in 0..channels {
                let y = (x[c] - mean) * inverse * scale[c] + shift[c];
                out[c] = if y > floor { y } else { floor };
            }
        }
    }
}

/// Adds the gradients by maps, scale and shift, from that by the result, likewise.
pub(crate) struct Backward<'a> {
    pub map: &'a [f32],
    pub scale: &'a [f32],
    pub gradient: &'a [f32],
    pub by_map: &'a mut [f32],
    pub by_scale: &'a mut [f32],
    pub by_shift: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Backward { map, scale, gradient, by_map, by_scale, by_shift } = self;
        let channels = scale.len();
        let part = 1.0 / channels as f32;
        let (by_scale, by_shift) = (&mut by_scale[..channels], &mut by_shift[..channels]);
        let pixels = map.chunks_exact(channels).zip(gradient.chunks_exact(channels));
        for ((x, g), by_map) in pixels.zip(by_map.chunks_exact_mut(channels)) {
            let (mean, inverse) = statistics(x);
            let (mut sums, mut products) = ([0.0; LANES], [0.0; LANES]);
            for first in (0..channels).step_by(LANES) {
                let lanes = first..first + LANES;
                let (x, g, scale) = (&x[lanes.clone()], &g[lanes.clone()], &scale[lanes.clone()]);
                let (by_scale, by_shift) = (&mut by_scale[lanes.clone()], &mut by_shift[lanes]);
                for k in 0..LANES {
                    let normal = (x[k] - mean) * inverse;
                    by_scale[k] += g[k] * normal;
                    by_shift[k] += g[k];
                    sums[k] += g[k] * scale[k];
                    products[k] += g[k] * scale[k] * normal;
                }
            }
            let (sum, product) = (part * total(sums), part * total(products));
            for c in 0..channels {
                let normal = (x[c] - mean) * inverse;
                by_map[c] += inverse * (g[c] * scale[c] - sum - normal * product);
            }
        }
    }
}
