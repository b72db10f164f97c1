//! Layer normalization of each pixel: its channels are scaled to mean 0 and variance 1, then by a
//! learned scale and shift ("Layer Normalization", 2016). No pixel depends on others, so that batches may have any
//! size and images any number.

use pulp::{Simd, WithSimd};

/// Added to variances.
const EPSILON: f32 = 1e-5;
/// Sums over channels run in so many lanes, which are added in one order: the same bits with vectors of
/// any width. Channels are a multiple of it.
pub(crate) const LANES: usize = 16;
/// Pixels that are normalized together, so that none waits for the root of another.
const PIXELS: usize = 16;

/// A number of each of a few pixels.
type OfPixels = [f32; PIXELS];

/// The sum over the channels of a pixel of what `of` makes of each vector of them, by its index. Its
/// lanes are added half to half.
#[inline(always)]
fn sum<S: Simd>(simd: S, n_vectors: usize, mut of: impl FnMut(usize) -> S::f32s) -> f32 {
    let mut n = LANES / S::F32_LANES;
    // One number in a vector is the least.
    let mut sums = [simd.splat_f32s(0.0); LANES];
    for first in (0..n_vectors).step_by(n) {
        for (j, sum) in sums.iter_mut().enumerate().take(n) {
            *sum = simd.add_f32s(*sum, of(first + j));
        }
    }
    while n > 1 {
        n /= 2;
        for j in 0..n {
            sums[j] = simd.add_f32s(sums[j], sums[j + n]);
        }
    }
    // Half to half, too, on all machines (pulp 0.22).
    simd.reduce_sum_f32s(sums[0])
}

/// Means of the channels of a few pixels, shape [pixels, channels], and one over their deviations.
#[inline(always)]
fn statistics<S: Simd>(simd: S, map: &[f32], channels: usize) -> (OfPixels, OfPixels) {
    let part = 1.0 / channels as f32;
    let n_vectors = channels / S::F32_LANES;
    let (mut means, mut inverses) = ([0.0; PIXELS], [0.0; PIXELS]);
    for (x, mean) in map.chunks_exact(channels).zip(&mut means) {
        let (x, _) = S::as_simd_f32s(x);
        *mean = part
            * sum(
                simd,
                n_vectors,
                #[inline(always)]
                |v| x[v],
            );
    }
    for ((x, inverse), mean) in map.chunks_exact(channels).zip(&mut inverses).zip(means) {
        let (x, _) = S::as_simd_f32s(x);
        let mean = simd.splat_f32s(mean);
        *inverse = sum(
            simd,
            n_vectors,
            #[inline(always)]
            |v| {
                let off = simd.sub_f32s(x[v], mean);
                simd.mul_f32s(off, off)
            },
        );
    }
    for inverse in &mut inverses {
        *inverse = 1.0 / (part * *inverse + EPSILON).sqrt();
    }
    (means, inverses)
}

/// Normalizes maps, shape [pixels, channels], into `out`. What is less than `floor` becomes that.
pub(crate) struct Forward<'a> {
    pub map: &'a [f32],
    pub scale: &'a [f32],
    pub shift: &'a [f32],
    pub floor: f32,
    pub out: &'a mut [f32],
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.scale.len() {
            // Of these widths most pixels are.
            48 => self.run(simd, 48),
            96 => self.run(simd, 96),
            channels => self.run(simd, channels),
        }
    }
}

impl Forward<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S, channels: usize) {
        let Forward { map, scale, shift, floor, out } = self;
        let n_vectors = channels / S::F32_LANES;
        let (scale, shift) = (S::as_simd_f32s(scale).0, S::as_simd_f32s(shift).0);
        let (scale, shift) = (&scale[..n_vectors], &shift[..n_vectors]);
        let floor = simd.splat_f32s(floor);
        let strips = map.chunks(PIXELS * channels).zip(out.chunks_mut(PIXELS * channels));
        for (map, out) in strips {
            let (means, inverses) = statistics(simd, map, channels);
            let pixels = map.chunks_exact(channels).zip(out.chunks_exact_mut(channels));
            for ((x, out), (mean, inverse)) in pixels.zip(means.into_iter().zip(inverses)) {
                let (x, out) = (S::as_simd_f32s(x).0, S::as_mut_simd_f32s(out).0);
                let (mean, inverse) = (simd.splat_f32s(mean), simd.splat_f32s(inverse));
                for v in 0..n_vectors {
                    let normal = simd.mul_f32s(simd.sub_f32s(x[v], mean), inverse);
                    let y = simd.add_f32s(simd.mul_f32s(normal, scale[v]), shift[v]);
                    out[v] = simd.select_f32s(simd.greater_than_f32s(y, floor), y, floor);
                }
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

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.scale.len() {
            48 => self.run(simd, 48),
            96 => self.run(simd, 96),
            channels => self.run(simd, channels),
        }
    }
}

impl Backward<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S, channels: usize) {
        let Backward { map, scale, gradient, by_map, by_scale, by_shift } = self;
        let (n_vectors, part) = (channels / S::F32_LANES, 1.0 / channels as f32);
        let (scale, _) = S::as_simd_f32s(scale);
        let (by_scale, _) = S::as_mut_simd_f32s(by_scale);
        let (by_shift, _) = S::as_mut_simd_f32s(by_shift);
        let maps = map.chunks(PIXELS * channels).zip(gradient.chunks(PIXELS * channels));
        for ((map, gradient), by_map) in maps.zip(by_map.chunks_mut(PIXELS * channels)) {
            let (means, inverses) = statistics(simd, map, channels);
            let (mut sums, mut products) = ([0.0; PIXELS], [0.0; PIXELS]);
            let pixels = map.chunks_exact(channels).zip(gradient.chunks_exact(channels));
            for (p, (x, g)) in pixels.enumerate() {
                let (x, g) = (S::as_simd_f32s(x).0, S::as_simd_f32s(g).0);
                let (mean, inverse) = (simd.splat_f32s(means[p]), simd.splat_f32s(inverses[p]));
                sums[p] = part
                    * sum(
                        simd,
                        n_vectors,
                        #[inline(always)]
                        |v| {
                            by_shift[v] = simd.add_f32s(by_shift[v], g[v]);
                            simd.mul_f32s(g[v], scale[v])
                        },
                    );
                products[p] = part
                    * sum(
                        simd,
                        n_vectors,
                        #[inline(always)]
                        |v| {
                            let normal = simd.mul_f32s(simd.sub_f32s(x[v], mean), inverse);
                            by_scale[v] = simd.add_f32s(by_scale[v], simd.mul_f32s(g[v], normal));
                            simd.mul_f32s(simd.mul_f32s(g[v], scale[v]), normal)
                        },
                    );
            }
            let pixels = map.chunks_exact(channels).zip(gradient.chunks_exact(channels));
            for (p, ((x, g), by)) in pixels.zip(by_map.chunks_exact_mut(channels)).enumerate() {
                let (x, g) = (S::as_simd_f32s(x).0, S::as_simd_f32s(g).0);
                let (by, _) = S::as_mut_simd_f32s(by);
                let (mean, inverse) = (simd.splat_f32s(means[p]), simd.splat_f32s(inverses[p]));
                let (sum, product) = (simd.splat_f32s(sums[p]), simd.splat_f32s(products[p]));
                for v in 0..n_vectors {
                    let normal = simd.mul_f32s(simd.sub_f32s(x[v], mean), inverse);
                    let own = simd.sub_f32s(simd.mul_f32s(g[v], scale[v]), sum);
                    let own = simd.sub_f32s(own, simd.mul_f32s(normal, product));
                    by[v] = simd.add_f32s(by[v], simd.mul_f32s(inverse, own));
                }
            }
        }
    }
}
