//! Animated GIF with 256 colors per frame, for places that do not play video.

use std::io::{BufWriter, IntoInnerError};

use chaic_files::TemporaryFile;
use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};
use image::RgbImage;

use super::SinkError;

/// Speed of the palette search, 1 (best) to 30; the library recommends 10.
const PALETTE_SPEED: i32 = 10;

/// Animated GIF writer.
pub(super) struct GifSink {
    encoder: Encoder<BufWriter<TemporaryFile>>,
    fps: u32,
    n_frames: u32,
}

impl GifSink {
    pub(super) fn open(
        out: BufWriter<TemporaryFile>,
        width: u32,
        height: u32,
        fps: u32,
    ) -> Result<GifSink, SinkError> {
        let mut encoder = Encoder::new(out, side_px(width), side_px(height), &[])?;
        encoder.set_repeat(Repeat::Infinite)?;
        Ok(GifSink { encoder, fps, n_frames: 0 })
    }

    pub(super) fn push(&mut self, image: &RgbImage) -> Result<(), SinkError> {
        let mut frame = Frame::from_rgb_speed(
            side_px(image.width()),
            side_px(image.height()),
            image.as_raw(),
            PALETTE_SPEED,
        );
        frame.delay = delay_centisecs(self.n_frames, self.fps);
        frame.dispose = DisposalMethod::Keep;
        self.encoder.write_frame(&frame)?;
        self.n_frames += 1;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<(), SinkError> {
        let out = self.encoder.into_inner()?;
        Ok(out.into_inner().map_err(IntoInnerError::into_error)?.commit()?)
    }
}

impl std::fmt::Debug for GifSink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GifSink").field("n_frames", &self.n_frames).finish_non_exhaustive()
    }
}

impl From<EncodingError> for SinkError {
    fn from(error: EncodingError) -> SinkError {
        match error {
            EncodingError::Io(error) => SinkError::Io(error),
            other => SinkError::encode(other),
        }
    }
}

fn side_px(px: u32) -> u16 {
    u16::try_from(px).expect("the writer bounds both sides")
}

/// Duration of frame `index` in GIF units of 0.01 s, rounded so that the sum does not drift.
fn delay_centisecs(index: u32, fps: u32) -> u16 {
    let end = |n: u64| (n * 100 + u64::from(fps) / 2) / u64::from(fps);
    let n = u64::from(index);
    u16::try_from(end(n + 1) - end(n)).expect("a frame lasts one second at most")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_add_up_to_the_frame_rate() {
        for fps in [1, 7, 10, 24, 30, 50] {
            let sum: u32 = (0..fps * 3).map(|i| u32::from(delay_centisecs(i, fps))).sum();
            assert_eq!(sum, 300, "{fps} frames per second");
        }
    }
}
