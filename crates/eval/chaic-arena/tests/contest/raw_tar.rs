//! Archives with any bytes in any field, which no library writes.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;

/// Size of a block, bytes.
pub const BLOCK: usize = 512;

/// Manifest of a submission with a program.
pub const MANIFEST: &str = r#"version = 1
name = "mine"
release = "1.0"
authors = ["A. Author"]
license = "MIT"
description = "Waits."
chaic = "0.1.0"

[helper]
command = ["sh", "helper.sh"]

[training]
hardware = "none"
core_hours = 0

[public]
split = "standard"
"#;

/// Fields of a header that a case changes.
pub struct Header<'a> {
    pub path: &'a [u8],
    pub prefix: &'a [u8],
    pub kind: u8,
    pub link: &'a [u8],
    /// Content of the field of the size; the size of the content if it is empty.
    pub size: &'a [u8],
    pub magic: &'a [u8],
}

impl Default for Header<'_> {
    fn default() -> Self {
        Header {
            path: b"helper/evil",
            prefix: b"",
            kind: b'0',
            link: b"",
            size: b"",
            magic: b"ustar\x0000",
        }
    }
}

/// Returns an entry: the header and the content, filled to whole blocks.
pub fn entry(header: &Header<'_>, content: &[u8]) -> Vec<u8> {
    let mut block = [0; BLOCK];
    let mut set = |at: usize, bytes: &[u8]| block[at..at + bytes.len()].copy_from_slice(bytes);
    set(0, header.path);
    set(100, b"0000644\0");
    set(108, b"0000000\0");
    set(116, b"0000000\0");
    let size = format!("{:011o}\0", content.len());
    set(124, if header.size.is_empty() { size.as_bytes() } else { header.size });
    set(136, b"00000000000\0");
    set(148, b"        ");
    set(156, &[header.kind]);
    set(157, header.link);
    set(257, header.magic);
    set(345, header.prefix);
    let sum: u32 = block.iter().map(|byte| u32::from(*byte)).sum();
    block[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    let mut bytes = block.to_vec();
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(BLOCK), 0);
    bytes
}

pub fn file(path: &str, content: &str) -> Vec<u8> {
    entry(&Header { path: path.as_bytes(), ..Header::default() }, content.as_bytes())
}

pub fn folder(path: &str) -> Vec<u8> {
    entry(&Header { path: path.as_bytes(), kind: b'5', ..Header::default() }, b"")
}

/// Returns an entry without content of this kind.
pub fn special(kind: u8, link: &str) -> Vec<u8> {
    entry(&Header { kind, link: link.as_bytes(), ..Header::default() }, b"")
}

/// Returns an archive of these entries with an end marker.
pub fn archive(entries: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = entries.concat();
    bytes.resize(bytes.len() + 2 * BLOCK, 0);
    bytes
}

/// Returns the archive of a submission with one more entry at its end.
pub fn with(more: Vec<u8>) -> Vec<u8> {
    archive(&[file("submission.toml", MANIFEST), file("helper/helper.sh", "exit 1\n"), more])
}

/// Returns the archive of a submission with this manifest.
pub fn with_manifest(manifest: &str) -> Vec<u8> {
    archive(&[file("submission.toml", manifest), file("helper/helper.sh", "exit 1\n")])
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).expect("a vector");
    encoder.finish().expect("a vector")
}
