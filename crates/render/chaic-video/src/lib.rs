//! Videos of episodes: H.264 in MP4, or an animated GIF, without any external program.
//!
//! The same frames give the same file on one machine and build: one encoder thread, a fixed
//! quantizer instead of a bit rate to chase, no time stamp in the file. The bytes are not
//! promised across machines (the encoder picks its instructions by processor) and no score
//! reads them.

mod gif;
#[cfg(feature = "mp4")]
mod mp4;
#[cfg(feature = "mp4")]
mod yuv;

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use image::RgbImage;

/// File name extensions that this build can write.
pub const EXTENSIONS: &[&str] = if cfg!(feature = "mp4") { &["mp4", "gif"] } else { &["gif"] };

/// Smallest width and height, of the encoder.
pub const MIN_SIDE_PX: u32 = 16;
/// Largest longer side, of the encoder.
pub const MAX_LONG_SIDE_PX: u32 = 3840;
/// Largest shorter side, of the encoder.
pub const MAX_SHORT_SIDE_PX: u32 = 2160;
/// Highest frame rate of an MP4 file; faster than any display we know of is a mistake.
pub const MAX_FPS: u32 = 240;
/// Highest frame rate of a GIF: below 0.02 s a frame, browsers fall back to 0.1 s.
pub const MAX_GIF_FPS: u32 = 50;

/// Why a video could not be written.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// The extension names no format of this build.
    #[error("cannot write a video of this kind, use one of {}: {path:?}", EXTENSIONS.join(", "))]
    UnsupportedExtension {
        /// The file asked for.
        path: PathBuf,
    },
    /// The size is outside what the encoder takes.
    #[error(
        "cannot encode frames of {width}x{height} pixels, \
         sides must be {MIN_SIDE_PX} to {MAX_LONG_SIDE_PX}x{MAX_SHORT_SIDE_PX}"
    )]
    Size {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// The frame rate is zero or too high for the format.
    #[error("cannot write {fps} frames a second, choose 1 to {max}")]
    FrameRate {
        /// The rate asked for.
        fps: u32,
        /// The highest rate of this format.
        max: u32,
    },
    /// A frame has another size than the video.
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
        /// The file asked for.
        path: PathBuf,
    },
    /// The file could not be written.
    #[error("cannot write the video: {source}: {path:?}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The encoder or the container refused a frame.
    #[error("cannot encode frame {frame}: {source}: {path:?}")]
    Encode {
        /// The file.
        path: PathBuf,
        /// Which frame, from 0.
        frame: u32,
        /// What the library said.
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
    provisional: Provisional,
}

/// The name under which a video is written: it gets its own once it is whole, and what never
/// becomes whole is removed.
#[derive(Debug)]
struct Provisional {
    path: PathBuf,
    is_kept: bool,
}

impl Provisional {
    fn beside(path: &Path) -> Provisional {
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".partial");
        Provisional { path: path.with_file_name(name), is_kept: false }
    }

    fn becomes(mut self, path: &Path) -> io::Result<()> {
        fs::rename(&self.path, path)?;
        self.is_kept = true;
        Ok(())
    }
}

/// Creates an empty file, in place of an older file or link of this name. Links are not followed.
fn create_fresh(path: &Path) -> io::Result<File> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(e),
        _ => File::options().write(true).create_new(true).open(path),
    }
}

impl Drop for Provisional {
    fn drop(&mut self) {
        if !self.is_kept {
            // Where it can't be removed, its name says what it is.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[derive(Debug)]
enum Sink {
    Gif(gif::GifSink),
    #[cfg(feature = "mp4")]
    Mp4(Box<mp4::Mp4Sink>),
}

/// What can go wrong inside a sink; the writer adds file and frame.
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
    /// Starts a video of `width` x `height` pixels at `path`, whose extension picks the format.
    ///
    /// H.264 halves the resolution of color, so an odd side of an MP4 grows by one pixel that
    /// repeats its neighbor. An existing file is replaced as soon as the video is finished; until
    /// then it is written to `PATH.partial`.
    pub fn create(
        path: &Path,
        width: u32,
        height: u32,
        fps: u32,
    ) -> Result<VideoWriter, VideoError> {
        let format = Format::of(path)?;
        let (long, short) = (width.max(height), width.min(height));
        if short < MIN_SIDE_PX || long > MAX_LONG_SIDE_PX || short > MAX_SHORT_SIDE_PX {
            return Err(VideoError::Size { width, height });
        }
        let max = format.max_fps();
        if !(1..=max).contains(&fps) {
            return Err(VideoError::FrameRate { fps, max });
        }
        let provisional = Provisional::beside(path);
        let sink = create_fresh(&provisional.path)
            .map_err(SinkError::Io)
            .and_then(|file| Sink::open(format, BufWriter::new(file), width, height, fps))
            .map_err(|error| error.at(path, 0))?;
        Ok(VideoWriter { path: path.to_owned(), width, height, n_frames: 0, sink, provisional })
    }

    /// Adds the next frame, which has the size of the video.
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
        .map_err(|error| error.at(&self.path, self.n_frames))?;
        self.n_frames += 1;
        Ok(())
    }

    /// Frames added so far.
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
        .and_then(|()| self.provisional.becomes(&self.path).map_err(SinkError::Io))
        .map_err(|error| error.at(&self.path, self.n_frames))
    }
}

impl Sink {
    fn open(
        format: Format,
        out: BufWriter<File>,
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

    fn at(self, path: &Path, frame: u32) -> VideoError {
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
    fn of(path: &Path) -> Result<Format, VideoError> {
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
