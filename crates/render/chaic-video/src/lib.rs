//! Video encoding of episodes: H.264 in MP4, or animated GIF, without external programs.
//!
//! The same frames give the same file on one machine and build: one encoder thread, a fixed
//! quantizer instead of a target bit rate, no time stamp in the file. The bytes may differ across
//! machines, because the encoder selects instructions by processor. No score reads them.

mod gif;
#[cfg(feature = "mp4")]
mod mp4;
#[cfg(feature = "mp4")]
mod yuv;

use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use chaic_files::TemporaryFile;
use image::RgbImage;

/// File name extensions that this build supports.
pub const EXTENSIONS: &[&str] = if cfg!(feature = "mp4") { &["mp4", "gif"] } else { &["gif"] };

/// Minimum width and height, from the encoder.
pub const MIN_SIDE_PX: u32 = 16;
/// Maximum of the longer side, from the encoder.
pub const MAX_LONG_SIDE_PX: u32 = 3840;
/// Maximum of the shorter side, from the encoder.
pub const MAX_SHORT_SIDE_PX: u32 = 2160;
/// Maximum frame rate of an MP4 file. No known display is faster, so a higher rate is a mistake.
pub const MAX_FPS: u32 = 240;
/// Maximum frame rate of a GIF: browsers replace a frame time below 0.02 s by 0.1 s.
pub const MAX_GIF_FPS: u32 = 50;

/// Error of video encoding.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// This build supports no format with this extension.
    #[error("cannot write a video of this kind, use one of {}: {path:?}", EXTENSIONS.join(", "))]
    UnsupportedExtension {
        /// Requested file.
        path: PathBuf,
    },
    /// The encoder does not support this size.
    #[error(
        "cannot encode frames of {width}x{height} pixels, \
         sides must be {MIN_SIDE_PX} to {MAX_LONG_SIDE_PX}x{MAX_SHORT_SIDE_PX}"
    )]
    Size {
        /// Requested width.
        width: u32,
        /// Requested height.
        height: u32,
    },
    /// The frame rate is zero or too high for the format.
    #[error("cannot write {fps} frames per second, choose 1 to {max}")]
    FrameRate {
        /// Requested rate.
        fps: u32,
        /// Maximum rate of the format.
        max: u32,
    },
    /// The size of a frame differs from the size of the video.
    #[error("expected a frame of {}x{} pixels, got {}x{}", expected.0, expected.1, got.0, got.1)]
    FrameSize {
        /// Width and height of the video.
        expected: (u32, u32),
        /// Width and height of the frame.
        got: (u32, u32),
    },
    /// The video was finished before its first frame.
    #[error("a video needs at least one frame: {path:?}")]
    NoFrames {
        /// Requested file.
        path: PathBuf,
    },
    /// The file could not be written.
    #[error("cannot write the video: {source}: {path:?}")]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The encoder or the container rejected a frame.
    #[error("cannot encode frame {frame}: {source}: {path:?}")]
    Encode {
        /// Path of the file.
        path: PathBuf,
        /// Index of the frame, from 0.
        frame: u32,
        /// Error of the library.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

/// Writes a video frame by frame.
///
/// ```no_run
/// use chaic_video::VideoWriter;
///
/// let mut video = VideoWriter::create("episode.mp4".as_ref(), 640, 480, 30)?;
/// for _ in 0..90 {
///     video.push(&image::RgbImage::new(640, 480))?;
/// }
/// video.finish()?;
/// # Ok::<(), chaic_video::VideoError>(())
/// ```
#[must_use = "a video that is not finished cannot be played"]
#[derive(Debug)]
pub struct VideoWriter {
    path: PathBuf,
    width: u32,
    height: u32,
    n_frames: u32,
    sink: Sink,
}

/// Suffix of the temporary file of an unfinished video.
const PARTIAL_SUFFIX: &str = ".partial";

#[derive(Debug)]
enum Sink {
    Gif(gif::GifSink),
    #[cfg(feature = "mp4")]
    Mp4(Box<mp4::Mp4Sink>),
}

/// Error inside a sink; the writer adds file and frame.
#[derive(Debug)]
enum SinkError {
    Io(io::Error),
    Encode(Box<dyn std::error::Error + Send + Sync>),
}

impl From<io::Error> for SinkError {
    fn from(error: io::Error) -> SinkError {
        SinkError::Io(error)
    }
}

impl VideoWriter {
    /// Starts a video of `width` x `height` pixels at `path`, whose extension selects the format.
    ///
    /// H.264 halves the resolution of color, so an odd side of an MP4 is padded by one repeated
    /// pixel. The video is written to `PATH.partial`, or to `PATH.K.partial` while others write the
    /// same video. This file replaces an existing one when the video is finished. It is removed if
    /// the writer is dropped before.
    pub fn create(
        path: &Path,
        width: u32,
        height: u32,
        fps: u32,
    ) -> Result<VideoWriter, VideoError> {
        let format = Format::from_path(path)?;
        let (long, short) = (width.max(height), width.min(height));
        if short < MIN_SIDE_PX || long > MAX_LONG_SIDE_PX || short > MAX_SHORT_SIDE_PX {
            return Err(VideoError::Size { width, height });
        }
        let max = format.max_fps();
        if !(1..=max).contains(&fps) {
            return Err(VideoError::FrameRate { fps, max });
        }
        let sink = TemporaryFile::with_suffix(path, PARTIAL_SUFFIX)
            .map_err(SinkError::Io)
            .and_then(|file| Sink::open(format, BufWriter::new(file), width, height, fps))
            .map_err(|error| error.into_video_error(path, 0))?;
        Ok(VideoWriter { path: path.to_owned(), width, height, n_frames: 0, sink })
    }

    /// Adds the next frame, which must have the size of the video.
    pub fn push(&mut self, frame: &RgbImage) -> Result<(), VideoError> {
        if frame.dimensions() != (self.width, self.height) {
            return Err(VideoError::FrameSize {
                expected: (self.width, self.height),
                got: frame.dimensions(),
            });
        }
        match &mut self.sink {
            Sink::Gif(sink) => sink.push(frame),
            #[cfg(feature = "mp4")]
            Sink::Mp4(sink) => sink.push(frame),
        }
        .map_err(|error| error.into_video_error(&self.path, self.n_frames))?;
        self.n_frames += 1;
        Ok(())
    }

    /// Number of frames added so far.
    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Completes the file; without this call it cannot be played.
    pub fn finish(self) -> Result<(), VideoError> {
        if self.n_frames == 0 {
            return Err(VideoError::NoFrames { path: self.path });
        }
        match self.sink {
            Sink::Gif(sink) => sink.finish(),
            #[cfg(feature = "mp4")]
            Sink::Mp4(sink) => sink.finish(),
        }
        .map_err(|error| error.into_video_error(&self.path, self.n_frames))
    }
}

impl Sink {
    fn open(
        format: Format,
        out: BufWriter<TemporaryFile>,
        width: u32,
        height: u32,
        fps: u32,
    ) -> Result<Sink, SinkError> {
        match format {
            Format::Gif => gif::GifSink::open(out, width, height, fps).map(Sink::Gif),
            #[cfg(feature = "mp4")]
            Format::Mp4 => {
                mp4::Mp4Sink::open(out, width, height, fps).map(|sink| Sink::Mp4(Box::new(sink)))
            }
        }
    }
}

impl SinkError {
    fn encode(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> SinkError {
        SinkError::Encode(error.into())
    }

    fn into_video_error(self, path: &Path, frame: u32) -> VideoError {
        let path = path.to_owned();
        match self {
            SinkError::Io(source) => VideoError::Io { path, source },
            SinkError::Encode(source) => VideoError::Encode { path, frame, source },
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Gif,
    #[cfg(feature = "mp4")]
    Mp4,
}

impl Format {
    fn from_path(path: &Path) -> Result<Format, VideoError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("gif") => Ok(Format::Gif),
            #[cfg(feature = "mp4")]
            Some("mp4") => Ok(Format::Mp4),
            _ => Err(VideoError::UnsupportedExtension { path: path.to_owned() }),
        }
    }

    fn max_fps(self) -> u32 {
        match self {
            Format::Gif => MAX_GIF_FPS,
            #[cfg(feature = "mp4")]
            Format::Mp4 => MAX_FPS,
        }
    }
}

#[cfg(test)]
mod tests;
