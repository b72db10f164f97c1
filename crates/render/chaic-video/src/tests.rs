//! Promise: a video plays, with the right boxes, the right number of frames, and the right pixels.

use image::Rgb;

use super::*;

const RED: Rgb<u8> = Rgb([220, 30, 40]);
const GRAY: Rgb<u8> = Rgb([90, 100, 110]);

/// A red square of 16 pixels that moves 4 pixels per frame.
fn frame(width: u32, height: u32, index: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let inside = (index * 4..index * 4 + 16).contains(&x) && (16..32).contains(&y);
        if inside { RED } else { GRAY }
    })
}

fn write(path: &Path, width: u32, height: u32, n_frames: u32) -> Vec<u8> {
    let mut video = VideoWriter::create(path, width, height, 10).unwrap();
    for index in 0..n_frames {
        video.push(&frame(width, height, index)).unwrap();
    }
    assert_eq!(video.n_frames(), n_frames);
    video.finish().unwrap();
    std::fs::read(path).unwrap()
}

fn assert_close(got: [u8; 3], expected: Rgb<u8>, tolerance: u8) {
    let near = got.iter().zip(expected.0).all(|(a, b)| a.abs_diff(b) <= tolerance);
    assert!(near, "expected {:?}, got {got:?}", expected.0);
}

#[test]
fn a_gif_contains_the_frames() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = write(&dir.path().join("square.GIF"), 63, 47, 10);

    let mut options = ::gif::DecodeOptions::new();
    options.set_color_output(::gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes.as_slice()).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (63, 47));
    let mut index = 0;
    while let Some(decoded) = decoder.read_next_frame().unwrap() {
        assert_eq!(decoded.delay, 10);
        let at = |x: usize, y: usize| decoded.buffer[(y * 63 + x) * 4..][..3].try_into().unwrap();
        assert_close(at(index * 4 + 8, 24), RED, 12);
        assert_close(at(index * 4 + 8, 8), GRAY, 12);
        index += 1;
    }
    assert_eq!(index, 10);
}

#[test]
fn an_unfinished_video_keeps_the_old_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.gif");
    std::fs::write(&path, "dear").unwrap();
    let names = || std::fs::read_dir(dir.path()).unwrap().count();
    let mut video = VideoWriter::create(&path, 64, 48, 10).unwrap();
    video.push(&frame(64, 48, 0)).unwrap();
    // The old file stays visible until the video is finished, also after a crash.
    assert_eq!(std::fs::read(&path).unwrap(), b"dear");
    assert_eq!(names(), 2);
    drop(video);
    assert_eq!((std::fs::read(&path).unwrap(), names()), (b"dear".to_vec(), 1));
    assert!(write(&path, 64, 48, 2).starts_with(b"GIF89a"));
    assert_eq!(names(), 1);
}

#[test]
fn writers_of_the_same_video_do_not_mix() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("same.gif");
    let [one, two] = [1, 2].map(|n| write(&dir.path().join(format!("{n}.gif")), 64, 48, n));
    let mut first = VideoWriter::create(&path, 64, 48, 10).unwrap();
    let mut second = VideoWriter::create(&path, 64, 48, 10).unwrap();
    first.push(&frame(64, 48, 0)).unwrap();
    for index in 0..2 {
        second.push(&frame(64, 48, index)).unwrap();
    }
    first.finish().unwrap();
    assert!(std::fs::read(&path).unwrap() == one);
    second.finish().unwrap();
    assert!(std::fs::read(&path).unwrap() == two);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 3);
}

#[test]
fn invalid_requests_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let gif = dir.path().join("a.gif");
    let create = |path: &Path, width, height, fps| VideoWriter::create(path, width, height, fps);

    let error = create(&dir.path().join("a.webm"), 64, 48, 10).unwrap_err();
    assert!(error.to_string().contains(&EXTENSIONS.join(", ")), "{error}");
    assert!(!dir.path().join("a.webm").exists());
    assert!(matches!(
        create(Path::new("mp4"), 64, 48, 10),
        Err(VideoError::UnsupportedExtension { .. })
    ));
    for (width, height) in [(0, 48), (64, 8), (4000, 64), (3000, 3000)] {
        assert!(matches!(create(&gif, width, height, 10), Err(VideoError::Size { .. })));
    }
    for fps in [0, MAX_GIF_FPS + 1] {
        assert!(matches!(create(&gif, 64, 48, fps), Err(VideoError::FrameRate { .. })));
    }
    let missing = dir.path().join("missing/a.gif");
    assert!(matches!(create(&missing, 64, 48, 10), Err(VideoError::Io { .. })));

    let mut video = create(&gif, 64, 48, 10).unwrap();
    assert!(matches!(
        video.push(&RgbImage::new(48, 64)),
        Err(VideoError::FrameSize { expected: (64, 48), got: (48, 64) })
    ));
    assert!(matches!(video.finish(), Err(VideoError::NoFrames { .. })));
}

#[cfg(feature = "mp4")]
mod mp4 {
    use openh264::decoder::Decoder;
    use openh264::formats::YUVSource;
    use shiguredo_mp4::boxes::SampleEntry;
    use shiguredo_mp4::demux::{Input, Mp4FileDemuxer};

    use super::*;

    /// Decoded content of a file.
    struct DecodedVideo {
        size: (usize, usize),
        durations_secs: Vec<f64>,
        keyframes: Vec<usize>,
        /// RGB, u8, each of shape [height, width, 3].
        frames: Vec<Vec<u8>>,
    }

    impl DecodedVideo {
        fn pixel(&self, index: usize, x: usize, y: usize) -> [u8; 3] {
            self.frames[index][(y * self.size.0 + x) * 3..][..3].try_into().unwrap()
        }
    }

    fn decode(bytes: &[u8]) -> DecodedVideo {
        let mut demuxer = Mp4FileDemuxer::new();
        while let Some(required) = demuxer.required_input() {
            let start = required.position as usize;
            let end = required.size.map_or(bytes.len(), |n| start + n);
            demuxer.handle_input(Input { position: start as u64, data: &bytes[start..end] });
        }
        let mut decoder = Decoder::new().unwrap();
        let mut decoded_video = DecodedVideo {
            size: (0, 0),
            durations_secs: vec![],
            keyframes: vec![],
            frames: vec![],
        };
        while let Some(sample) = demuxer.next_sample().unwrap() {
            let mut annex_b = Vec::new();
            if let Some(SampleEntry::Avc1(avc1)) = sample.sample_entry {
                for set in avc1.avcc_box.sps_list.iter().chain(&avc1.avcc_box.pps_list) {
                    annex_b.extend_from_slice(&[0, 0, 0, 1]);
                    annex_b.extend_from_slice(set);
                }
            }
            if sample.keyframe {
                decoded_video.keyframes.push(decoded_video.frames.len());
            }
            let timescale = f64::from(sample.track.timescale.get());
            decoded_video.durations_secs.push(f64::from(sample.duration) / timescale);
            let data = &bytes[sample.data_offset as usize..][..sample.data_size];
            annex_b.extend(
                shiguredo_mp4::bitstream::h264::length_prefixed_to_annexb(
                    data,
                    shiguredo_mp4::bitstream::h264::LengthSize::FourBytes,
                )
                .unwrap(),
            );
            let yuv = decoder.decode(&annex_b).unwrap().expect("one image per sample");
            decoded_video.size = yuv.dimensions();
            decoded_video.frames.push(to_rgb(&yuv));
        }
        decoded_video
    }

    /// Converts a BT.709 image with limited range to RGB.
    fn to_rgb(yuv: &impl YUVSource) -> Vec<u8> {
        let (width, height) = yuv.dimensions();
        let (y_stride, uv_stride, _) = yuv.strides();
        let mut rgb = Vec::with_capacity(width * height * 3);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let luma = (f64::from(yuv.y()[y * y_stride + x]) - 16.0) / 219.0;
            let at = y / 2 * uv_stride + x / 2;
            let [blue, red] = [yuv.u()[at], yuv.v()[at]].map(|c| (f64::from(c) - 128.0) / 224.0);
            let pixel =
                [luma + 1.5748 * red, luma - 0.1873 * blue - 0.4681 * red, luma + 1.8556 * blue];
            rgb.extend(pixel.map(|channel| (channel * 255.0).round() as u8));
        }
        rgb
    }

    /// Types of the top-level boxes, parsed without the library.
    fn top_level_boxes(bytes: &[u8]) -> Vec<String> {
        let mut types = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let field = |from: usize| u32::from_be_bytes(bytes[from..from + 4].try_into().unwrap());
            types.push(String::from_utf8(bytes[at + 4..at + 8].to_vec()).unwrap());
            at += match field(at) as usize {
                1 => ((field(at + 8) as usize) << 32) | field(at + 12) as usize,
                size => size,
            };
        }
        assert_eq!(at, bytes.len(), "the last box ends with the file");
        types
    }

    #[test]
    fn an_mp4_contains_the_frames() {
        let dir = tempfile::tempdir().unwrap();
        let bytes = write(&dir.path().join("square.mp4"), 64, 48, 10);

        assert_eq!(top_level_boxes(&bytes), ["ftyp", "moov", "free", "mdat"]);
        assert!(bytes.windows(4).any(|w| w == b"avcC"));
        let decoded_video = decode(&bytes);
        assert_eq!((decoded_video.size, decoded_video.frames.len()), ((64, 48), 10));
        assert_eq!(decoded_video.durations_secs, [0.1; 10]);
        assert_eq!(decoded_video.keyframes, [0]);
        for index in 0..10 {
            assert_close(decoded_video.pixel(index, index * 4 + 8, 24), RED, 6);
            assert_close(decoded_video.pixel(index, index * 4 + 8, 8), GRAY, 3);
        }
    }

    #[test]
    fn there_is_a_keyframe_every_two_seconds() {
        let dir = tempfile::tempdir().unwrap();
        let decoded_video = decode(&write(&dir.path().join("long.mp4"), 64, 48, 41));
        assert_eq!(decoded_video.keyframes, [0, 20, 40]);
    }

    #[test]
    fn odd_sides_are_padded_by_a_copy() {
        let dir = tempfile::tempdir().unwrap();
        let decoded_video = decode(&write(&dir.path().join("odd.mp4"), 33, 47, 5));
        assert_eq!((decoded_video.size, decoded_video.frames.len()), ((34, 48), 5));
        assert_close(decoded_video.pixel(4, 33, 24), GRAY, 5);
        assert_close(decoded_video.pixel(4, 33, 47), GRAY, 5);
    }

    #[test]
    fn the_smallest_size_is_supported() {
        let dir = tempfile::tempdir().unwrap();
        for side in [(16, 16), (16, 64), (17, 16)] {
            assert_eq!(
                decode(&write(&dir.path().join("a.mp4"), side.0, side.1, 3)).frames.len(),
                3
            );
        }
    }

    #[test]
    fn a_video_longer_than_the_reserved_index_still_plays() {
        let dir = tempfile::tempdir().unwrap();
        let bytes = write(&dir.path().join("long.mp4"), 16, 16, 5000);
        assert_eq!(top_level_boxes(&bytes), ["ftyp", "free", "mdat", "moov"]);
        assert_eq!(decode(&bytes).frames.len(), 5000);
    }

    #[test]
    fn the_same_frames_give_the_same_bytes() {
        let dir = tempfile::tempdir().unwrap();
        let first = write(&dir.path().join("a.mp4"), 64, 48, 30);
        assert_eq!(write(&dir.path().join("b.mp4"), 64, 48, 30), first);
    }
}
