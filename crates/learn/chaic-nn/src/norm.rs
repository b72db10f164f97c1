//! Layer normalization of each pixel: channels are normalized to mean 0 and variance 1, then scaled
//! and shifted by parameters (Ba et al., "Layer Normalization", 2016). Pixels are independent, so
//! batches and images may have any size.

use pulp::{Simd, WithSimd};

/// Added to variances.
const EPSILON: f32 = 1e-5;
/// Number of partial sums over channels. They are added in a fixed order, so results do not depend
/// on the vector width. The number of channels must be a multiple of this value.
pub(crate) const LANES: usize = 16;
/// Number of pixels that are normalized together, to hide the latency of square roots.
const PIXELS: usize = 16;

/// One value per pixel.
type PerPixel = [f32; PIXELS];

/// Returns the sum over the channels of a pixel; `value(k)` returns the k-th vector of terms. Lanes
/// are added pairwise by halves.
#[inline(always)]
fn sum<S: Simd>(simd: S, n_vectors: usize, mut value: impl FnMut(usize) -> S::f32s) -> f32 {
    let mut n = LANES / S::F32_LANES;
    // There are enough sums even for vectors of one element.
    let mut sums = [simd.splat_f32s(0.0); LANES];
    for first in (0..n_vectors).step_by(n) {
        for (j, sum) in sums.iter_mut().enumerate().take(n) {
            *sum = simd.add_f32s(*sum, value(first + j));
        }
    }
    while n > 1 {
        n /= 2;
        for j in 0..n {
            sums[j] = simd.add_f32s(sums[j], sums[j + n]);
        }
    }
    // Reduces by halves as well, on all machines (pulp 0.22).
    simd.reduce_sum_f32s(sums[0])
}

/// Returns channel means and inverse standard deviations of a few pixels, shape [pixels, channels].
#[inline(always)]
fn statistics<S: Simd>(simd: S, map: &[f32], channels: usize) -> (PerPixel, PerPixel) {
    let inv_channels = 1.0 / channels as f32;
    let n_vectors = channels / S::F32_LANES;
    let (mut means, mut inv_std_devs) = ([0.0; PIXELS], [0.0; PIXELS]);
    for (x, mean) in map.chunks_exact(channels).zip(&mut means) {
        let (x, _) = S::as_simd_f32s(x);
        *mean = inv_channels
            * sum(
                simd,
                n_vectors,
                #[inline(always)]
                |v| x[v],
            );
    }
    for ((x, inv_std_dev), mean) in map.chunks_exact(channels).zip(&mut inv_std_devs).zip(means) {
        let (x, _) = S::as_simd_f32s(x);
        let mean = simd.splat_f32s(mean);
        *inv_std_dev = sum(
            simd,
            n_vectors,
            #[inline(always)]
            |v| {
                let difference = simd.sub_f32s(x[v], mean);
                simd.mul_f32s(difference, difference)
            },
        );
    }
    for inv_std_dev in &mut inv_std_devs {
        *inv_std_dev = 1.0 / (inv_channels * *inv_std_dev + EPSILON).sqrt();
    }
    (means, inv_std_devs)
}

/// Normalizes maps of shape [pixels, channels] into `out`; values below `floor` are set to `floor`.
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
            // The most frequent numbers of channels.
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
            let (means, inv_std_devs) = statistics(simd, map, channels);
            let pixels = map.chunks_exact(channels).zip(out.chunks_exact_mut(channels));
            for ((x, out), (mean, inv_std_dev)) in pixels.zip(means.into_iter().zip(inv_std_devs)) {
                let (x, out) = (S::as_simd_f32s(x).0, S::as_mut_simd_f32s(out).0);
                let (mean, inv_std_dev) = (simd.splat_f32s(mean), simd.splat_f32s(inv_std_dev));
                for v in 0..n_vectors {
                    let normalized = simd.mul_f32s(simd.sub_f32s(x[v], mean), inv_std_dev);
                    let y = simd.add_f32s(simd.mul_f32s(normalized, scale[v]), shift[v]);
                    out[v] = simd.select_f32s(simd.greater_than_f32s(y, floor), y, floor);
                }
            }
        }
    }
}

/// Adds the gradients of input, scale and shift, given the gradient of the output.
pub(crate) struct Backward<'a> {
    pub map: &'a [f32],
    pub scale: &'a [f32],
    pub grad_output: &'a [f32],
    pub grad_input: &'a mut [f32],
    pub grad_scale: &'a mut [f32],
    pub grad_shift: &'a mut [f32],
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
        let Backward { map, scale, grad_output, grad_input, grad_scale, grad_shift } = self;
        let (n_vectors, inv_channels) = (channels / S::F32_LANES, 1.0 / channels as f32);
        let (scale, _) = S::as_simd_f32s(scale);
        let (grad_scale, _) = S::as_mut_simd_f32s(grad_scale);
        let (grad_shift, _) = S::as_mut_simd_f32s(grad_shift);
        let maps = map.chunks(PIXELS * channels).zip(grad_output.chunks(PIXELS * channels));
        for ((map, grad_output), grad_input) in maps.zip(grad_input.chunks_mut(PIXELS * channels)) {
            let (means, inv_std_devs) = statistics(simd, map, channels);
            let (mut sums, mut products) = ([0.0; PIXELS], [0.0; PIXELS]);
            let pixels = map.chunks_exact(channels).zip(grad_output.chunks_exact(channels));
            for (p, (x, g)) in pixels.enumerate() {
                let (x, g) = (S::as_simd_f32s(x).0, S::as_simd_f32s(g).0);
                let (mean, inv_std_dev) =
                    (simd.splat_f32s(means[p]), simd.splat_f32s(inv_std_devs[p]));
                sums[p] = inv_channels
                    * sum(
                        simd,
                        n_vectors,
                        #[inline(always)]
                        |v| {
                            grad_shift[v] = simd.add_f32s(grad_shift[v], g[v]);
                            simd.mul_f32s(g[v], scale[v])
                        },
                    );
                products[p] = inv_channels
                    * sum(
                        simd,
                        n_vectors,
                        #[inline(always)]
                        |v| {
                            let normalized = simd.mul_f32s(simd.sub_f32s(x[v], mean), inv_std_dev);
                            grad_scale[v] =
                                simd.add_f32s(grad_scale[v], simd.mul_f32s(g[v], normalized));
                            simd.mul_f32s(simd.mul_f32s(g[v], scale[v]), normalized)
                        },
                    );
            }
            let pixels = map.chunks_exact(channels).zip(grad_output.chunks_exact(channels));
            for (p, ((x, g), out)) in pixels.zip(grad_input.chunks_exact_mut(channels)).enumerate()
            {
                let (x, g) = (S::as_simd_f32s(x).0, S::as_simd_f32s(g).0);
                let (out, _) = S::as_mut_simd_f32s(out);
                let (mean, inv_std_dev) =
                    (simd.splat_f32s(means[p]), simd.splat_f32s(inv_std_devs[p]));
                let (sum, product) = (simd.splat_f32s(sums[p]), simd.splat_f32s(products[p]));
                for v in 0..n_vectors {
                    let normalized = simd.mul_f32s(simd.sub_f32s(x[v], mean), inv_std_dev);
                    let centered = simd.sub_f32s(simd.mul_f32s(g[v], scale[v]), sum);
                    let centered = simd.sub_f32s(centered, simd.mul_f32s(normalized, product));
                    out[v] = simd.add_f32s(out[v], simd.mul_f32s(inv_std_dev, centered));
                }
            }
        }
    }
}
