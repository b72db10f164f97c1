//! Conversion from RGB to YUV planes for the encoder: BT.709, limited range, 4:2:0.
//!
//! OpenH264's own conversion truncates instead of rounding, which tints light gray walls green, and
//! uses floating point. This one uses integers.

use image::RgbImage;
use openh264::formats::YUVSource;

/// Weights of red and blue in luma (BT.709); green has the remainder.
const LUMA_RED: f64 = 0.2126;
const LUMA_BLUE: f64 = 0.0722;
const LUMA_GREEN: f64 = 1.0 - LUMA_RED - LUMA_BLUE;

/// Weights are integer multiples of 2^-16.
const FRACTION_BITS: u32 = 16;
const HALF: i32 = 1 << (FRACTION_BITS - 1);

/// Luma spans 16 to 235, the two chroma planes 16 to 240.
const LUMA_SPAN: f64 = 219.0 / 255.0;
const CHROMA_SPAN: f64 = 112.0 / 255.0;

const Y_WEIGHTS: [i32; 3] =
    [fixed(LUMA_RED * LUMA_SPAN), fixed(LUMA_GREEN * LUMA_SPAN), fixed(LUMA_BLUE * LUMA_SPAN)];
const U_WEIGHTS: [i32; 3] = {
    let red = -fixed(LUMA_RED / (1.0 - LUMA_BLUE) * CHROMA_SPAN);
    let blue = fixed(CHROMA_SPAN);
    // The weights sum to zero, so that gray stays gray.
    [red, -red - blue, blue]
};
const V_WEIGHTS: [i32; 3] = {
    let red = fixed(CHROMA_SPAN);
    let blue = -fixed(LUMA_BLUE / (1.0 - LUMA_RED) * CHROMA_SPAN);
    [red, -red - blue, blue]
};

/// An image as YUV planes of even size.
pub(super) struct Planes {
    width: usize,
    height: usize,
    /// u8, shape [height, width].
    y: Vec<u8>,
    /// u8, shape [height / 2, width / 2].
    u: Vec<u8>,
    /// u8, shape [height / 2, width / 2].
    v: Vec<u8>,
}

impl Planes {
    /// Allocates planes for an image of this size; an odd side is padded by one.
    pub(super) fn new(width: u32, height: u32) -> Planes {
        let (half_width, half_height) = (width.div_ceil(2) as usize, height.div_ceil(2) as usize);
        let quarter = half_width * half_height;
        Planes {
            width: half_width * 2,
            height: half_height * 2,
            y: vec![0; quarter * 4],
            u: vec![0; quarter],
            v: vec![0; quarter],
        }
    }

    /// Converts an image of the size given to `new`.
    pub(super) fn read(&mut self, image: &RgbImage) {
        let row_bytes = image.width() as usize * 3;
        let last_row = image.height() as usize - 1;
        let rows = image.as_raw();
        let row = |index: usize| &rows[index.min(last_row) * row_bytes..][..row_bytes];

        let y_rows = self.y.chunks_exact_mut(self.width * 2);
        let u_rows = self.u.chunks_exact_mut(self.width / 2);
        let v_rows = self.v.chunks_exact_mut(self.width / 2);
        for (index, ((y, u), v)) in y_rows.zip(u_rows).zip(v_rows).enumerate() {
            let (y_top, y_bottom) = y.split_at_mut(self.width);
            convert_rows([row(index * 2), row(index * 2 + 1)], [y_top, y_bottom], u, v);
        }
    }
}

impl YUVSource for Planes {
    fn dimensions(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn strides(&self) -> (usize, usize, usize) {
        (self.width, self.width / 2, self.width / 2)
    }

    fn y(&self) -> &[u8] {
        &self.y
    }

    fn u(&self) -> &[u8] {
        &self.u
    }

    fn v(&self) -> &[u8] {
        &self.v
    }
}

/// Converts two rows of pixels; the last column is repeated if the width is odd.
fn convert_rows(rgb: [&[u8]; 2], y: [&mut [u8]; 2], u: &mut [u8], v: &mut [u8]) {
    let last = rgb[0].len() / 3 - 1;
    let [y_top, y_bottom] = y;
    for (column, (u, v)) in u.iter_mut().zip(v).enumerate() {
        let mut sum = [0; 3];
        for x in [column * 2, column * 2 + 1] {
            let at = x.min(last) * 3;
            for (row, y) in [(rgb[0], &mut *y_top), (rgb[1], &mut *y_bottom)] {
                let pixel = [row[at], row[at + 1], row[at + 2]].map(i32::from);
                y[x] = (16 + ((dot(Y_WEIGHTS, pixel) + HALF) >> FRACTION_BITS)) as u8;
                for (sum, channel) in sum.iter_mut().zip(pixel) {
                    *sum += channel;
                }
            }
        }
        // Two more bits: the sum of four pixels instead of their mean.
        let chroma =
            |weights| (128 + ((dot(weights, sum) + 4 * HALF) >> (FRACTION_BITS + 2))) as u8;
        *u = chroma(U_WEIGHTS);
        *v = chroma(V_WEIGHTS);
    }
}

fn dot(weights: [i32; 3], rgb: [i32; 3]) -> i32 {
    weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
}

/// Rounds to an integer multiple of 2^-16; `value` must not be negative.
const fn fixed(value: f64) -> i32 {
    (value * (1 << FRACTION_BITS) as f64 + 0.5) as i32
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    /// Converts an image of one color; returns the value of each plane.
    fn convert(rgb: [u8; 3]) -> [u8; 3] {
        let mut planes = Planes::new(3, 3);
        planes.read(&RgbImage::from_pixel(3, 3, Rgb(rgb)));
        assert_eq!(planes.dimensions(), (4, 4));
        for plane in [&planes.y, &planes.u, &planes.v] {
            assert!(plane.iter().all(|v| *v == plane[0]), "one color gives one value");
        }
        [planes.y[0], planes.u[0], planes.v[0]]
    }

    #[test]
    fn reference_colors_are_converted_exactly() {
        // ITU-R BT.709 at 8 bits, limited range.
        assert_eq!(convert([0, 0, 0]), [16, 128, 128]);
        assert_eq!(convert([255, 255, 255]), [235, 128, 128]);
        assert_eq!(convert([128, 128, 128]), [126, 128, 128]);
        assert_eq!(convert([255, 0, 0]), [63, 102, 240]);
        assert_eq!(convert([0, 255, 0]), [173, 42, 26]);
        assert_eq!(convert([0, 0, 255]), [32, 240, 118]);
    }

    #[test]
    fn color_is_the_mean_of_four_pixels() {
        let mut planes = Planes::new(2, 2);
        let image = RgbImage::from_fn(2, 2, |x, _| Rgb([[255, 0, 0], [0, 0, 255]][x as usize]));
        planes.read(&image);
        assert_eq!(planes.y, [63, 32, 63, 32]);
        assert_eq!((planes.u[0], planes.v[0]), (171, 179));
    }
}
