//! Text on images.

use std::sync::LazyLock;

use ab_glyph::{Font as _, FontRef, Glyph, PxScale, ScaleFont as _, point};
use image::RgbImage;

use crate::paint::blend;
pub use crate::text_label::Align;
use crate::text_label::TextLabel;

static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    FontRef::try_from_slice(epaint_default_fonts::HACK_REGULAR).expect("the bundled font is valid")
});

/// Glyphs of one line from x = 0 with the baseline at y = 0, and the width of the line.
fn layout_line(text: &str, size_px: f32) -> (Vec<Glyph>, f32) {
    let font = FONT.as_scaled(PxScale::from(size_px.clamp(4.0, 400.0)));
    let (mut x, mut last, mut glyphs) = (0.0, None, Vec::new());
    for c in text.chars().take(10_000) {
        let id = font.glyph_id(c);
        if let Some(last) = last {
            x += font.kern(last, id);
        }
        glyphs.push(id.with_scale_and_position(font.scale(), point(x, 0.0)));
        x += font.h_advance(id);
        last = Some(id);
    }
    (glyphs, x)
}

/// Width of a line of text, pixels.
pub fn width(text: &str, size_px: f32) -> f32 {
    layout_line(text, size_px).1
}

/// Draws one line of text with its top at `position`, pixels. Parts outside the image are clipped.
pub fn draw(
    image: &mut RgbImage,
    position: (f32, f32),
    size_px: f32,
    color: [u8; 3],
    align: Align,
    text: &str,
) {
    let (x, y) = position;
    let (glyphs, width_px) = layout_line(text, size_px);
    let x = match align {
        Align::Left => x,
        Align::Center => x - 0.5 * width_px,
        Align::Right => x - width_px,
    };
    let ascent = FONT.as_scaled(PxScale::from(size_px.clamp(4.0, 400.0))).ascent();
    // Integer pixel positions keep stems sharp.
    let (x, y) = ((x + 0.5).floor(), (y + ascent + 0.5).floor());
    for mut glyph in glyphs {
        glyph.position.x += x;
        glyph.position.y += y;
        let Some(outline) = FONT.outline_glyph(glyph) else { continue };
        let bounds = outline.px_bounds();
        outline.draw(|dx, dy, coverage| {
            let (px, py) =
                (bounds.min.x as i64 + i64::from(dx), bounds.min.y as i64 + i64::from(dy));
            let inside = px >= 0
                && py >= 0
                && px < i64::from(image.width())
                && py < i64::from(image.height());
            if inside {
                let pixel = image.get_pixel_mut(px as u32, py as u32);
                blend(&mut pixel.0, color, coverage);
            }
        });
    }
}

/// Draws a label with its border.
pub(crate) fn draw_label(image: &mut RgbImage, label: &TextLabel) {
    let TextLabel { text, top, size_px, align, color, border } = label;
    let mut draw_at = |dx, dy, color| {
        draw(image, (top.x + dx, top.y + dy), *size_px, color, *align, text);
    };
    if let Some(border) = border {
        for (dx, dy) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            draw_at(dx, dy, *border);
        }
    }
    draw_at(0.0, 0.0, *color);
}

#[cfg(test)]
mod tests {
    use chaic_core::Vec2;

    use super::*;

    #[test]
    fn text_leaves_ink_and_may_leave_the_image() {
        let mut image = RgbImage::from_pixel(80, 30, image::Rgb([255; 3]));
        draw(&mut image, (40.0, 4.0), 20.0, [0; 3], Align::Center, "chaic");
        let ink = image.pixels().filter(|p| p.0[0] < 100).count();
        assert!((60..800).contains(&ink), "{ink}");
        draw(&mut image, (-30.0, -8.0), 50.0, [0; 3], Align::Left, "far outside");
        assert!(width("ww", 20.0) > width("w", 20.0));
        let (text, size_px) = ("wanted: 2 apple", 17.0);
        assert!((width(text, size_px) - TextLabel::width_px(text, size_px)).abs() < 0.01);
        let label = TextLabel {
            text: text.to_owned(),
            top: Vec2::new(1.0, 2.0),
            size_px,
            align: Align::Left,
            color: [0; 3],
            border: None,
        };
        let font = FONT.as_scaled(PxScale::from(size_px));
        assert!(label.baseline().distance(Vec2::new(1.0, 2.0 + font.ascent())) < 0.01);
        let em_px = FONT.units_per_em().unwrap() / FONT.height_unscaled() * size_px;
        assert!((label.em_px() - em_px).abs() < 0.01);
    }
}
