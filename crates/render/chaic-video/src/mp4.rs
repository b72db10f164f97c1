//! H.264 in MP4: OpenH264 encodes, `shiguredo_mp4` writes the container.

use std::io::{BufWriter, IntoInnerError, Seek as _, SeekFrom, Write as _};
use std::num::NonZeroU32;

use chaic_files::TemporaryFile;
use image::RgbImage;
use openh264::OpenH264API;
use openh264::encoder::{
    Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange, RateControlMode,
    SpsPpsStrategy, TransferCharacteristics, VuiConfig,
};
use shiguredo_mp4::TrackKind;
use shiguredo_mp4::bitstream::h264::{
    H264NalUnitType, H264SampleEntryConfig, LengthSize, build_avc1_box_from_annexb,
    parse_annexb_nal_units,
};
use shiguredo_mp4::boxes::SampleEntry;
use shiguredo_mp4::mux::{Mp4FileMuxer, Mp4FileMuxerOptions, Sample};

use super::SinkError;
use super::yuv::Planes;

/// Quantizer of every frame, 0 (lossless) to 51: text in a panel stays sharp at this value.
const QP: u8 = 20;

/// Seconds between keyframes, to which a player can seek.
const KEYFRAME_PERIOD_SECS: u32 = 2;

/// Space reserved before the frames for the index, which browsers expect first. At 4 bytes per
/// frame, it fits the longest episode at one frame per step. A longer video gets its index at the
/// end.
const INDEX_BYTES: usize = 16 * 1024;

/// MP4 writer.
pub(super) struct Mp4Sink {
    out: BufWriter<TemporaryFile>,
    position: u64,
    encoder: Encoder,
    muxer: Mp4FileMuxer,
    fps: NonZeroU32,
    planes: Planes,
    is_described: bool,
}

impl Mp4Sink {
    pub(super) fn open(
        mut out: BufWriter<TemporaryFile>,
        width: u32,
        height: u32,
        fps: u32,
    ) -> Result<Mp4Sink, SinkError> {
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config(fps))
            .map_err(SinkError::encode)?;
        let options =
            Mp4FileMuxerOptions { reserved_moov_box_size: INDEX_BYTES, ..Default::default() };
        let muxer = Mp4FileMuxer::with_options(options).map_err(SinkError::encode)?;
        let head = muxer.initial_boxes_bytes();
        out.write_all(head)?;
        Ok(Mp4Sink {
            position: head.len() as u64,
            out,
            encoder,
            muxer,
            fps: NonZeroU32::new(fps).expect("the writer bounds the frame rate"),
            planes: Planes::new(width, height),
            is_described: false,
        })
    }

    pub(super) fn push(&mut self, image: &RgbImage) -> Result<(), SinkError> {
        self.planes.read(image);
        let stream = self.encoder.encode(&self.planes).map_err(SinkError::encode)?;
        let keyframe = stream.frame_type() == FrameType::IDR;
        let annex_b = stream.to_vec();
        let data = sample_data(&annex_b)?;
        // The frame type is not sufficient: a frame without slices would shift all later ones.
        if data.is_empty() {
            return Err(SinkError::encode("the encoder dropped the frame"));
        }
        let sample_entry =
            if self.is_described { None } else { Some(track_description(&annex_b)?) };
        self.is_described = true;

        self.out.write_all(&data)?;
        let sample = Sample {
            track_kind: TrackKind::Video,
            sample_entry,
            keyframe,
            timescale: self.fps,
            duration: 1,
            composition_time_offset: None,
            data_offset: self.position,
            data_size: data.len(),
        };
        self.muxer.append_sample(&sample).map_err(SinkError::encode)?;
        self.position += data.len() as u64;
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<(), SinkError> {
        let boxes = self.muxer.finalize().map_err(SinkError::encode)?;
        for (offset, bytes) in boxes.offset_and_bytes_pairs() {
            self.out.seek(SeekFrom::Start(offset))?;
            self.out.write_all(bytes)?;
        }
        Ok(self.out.into_inner().map_err(IntoInnerError::into_error)?.commit()?)
    }
}

impl std::fmt::Debug for Mp4Sink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Mp4Sink").field("position", &self.position).finish_non_exhaustive()
    }
}

fn config(fps: u32) -> EncoderConfig {
    // Stated explicitly, because players otherwise guess the color space from the size.
    let color = VuiConfig::bt709().transfer_characteristics(TransferCharacteristics::Srgb);
    EncoderConfig::new()
        .num_threads(1)
        .skip_frames(false)
        .max_frame_rate(FrameRate::from_hz(fps as f32))
        // This mode with an empty range gives a fixed quantizer without a target bit rate. `Off`
        // fixes it to 26 regardless of the range, and `Quality` prints a warning for each video.
        .rate_control_mode(RateControlMode::Bufferbased)
        .qp(QpRange::new(QP, QP))
        .adaptive_quantization(false)
        .background_detection(false)
        .scene_change_detect(false)
        .sps_pps_strategy(SpsPpsStrategy::ConstantId)
        .intra_frame_period(IntraFramePeriod::from_num_frames(fps * KEYFRAME_PERIOD_SECS))
        .vui(color)
}

/// Track description, from the parameter sets of the first frame.
fn track_description(annex_b: &[u8]) -> Result<SampleEntry, SinkError> {
    let config = H264SampleEntryConfig { length_size: LengthSize::FourBytes };
    build_avc1_box_from_annexb(annex_b, &config).map(SampleEntry::Avc1).map_err(SinkError::encode)
}

/// Converts a frame to MP4 format: each unit prefixed by its length, without the parameter sets,
/// which are in the track description.
fn sample_data(annex_b: &[u8]) -> Result<Vec<u8>, SinkError> {
    let mut data = Vec::with_capacity(annex_b.len());
    for unit in parse_annexb_nal_units(annex_b).map_err(SinkError::encode)? {
        if matches!(unit.nal_unit_type, H264NalUnitType::Sps | H264NalUnitType::Pps) {
            continue;
        }
        let len = u32::try_from(unit.data.len()).map_err(SinkError::encode)?;
        data.extend_from_slice(&len.to_be_bytes());
        data.extend_from_slice(unit.data);
    }
    Ok(data)
}
