//! Reading of archives, entry by entry.

use std::io::{BufRead as _, BufReader, ErrorKind, Read, Write};
use std::path::Path;

use chaic_files::{FileError, LOCK, open_user_file};
use flate2::bufread::MultiGzDecoder;
use tar::{EntryType, Header};

use super::entry_path::{Paths, check_path};
use super::{BYTECODE, MAX_ENTRIES, MAX_FILE_BYTES, MAX_TOTAL_BYTES, refused};
use crate::error::{ArenaError, Result};

/// Size of a block of the tar format, bytes.
const BLOCK: usize = 512;
/// Maximum number of zero bytes after the end marker: GNU tar fills records of 10 KiB.
const MAX_PADDING: usize = 64 << 10;
/// First bytes of a gzip file.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// Number of bytes that are copied at a time.
const CHUNK: usize = 64 << 10;

/// Receiver of the files and folders of an archive.
pub(super) trait Destination {
    /// Creates a folder.
    fn folder(&mut self, path: &str) -> Result<()>;

    /// Creates a file. `copy` writes its content.
    fn file(
        &mut self,
        path: &str,
        is_executable: bool,
        copy: &mut dyn FnMut(&mut dyn Write) -> Result<()>,
    ) -> Result<()>;
}

/// Reader of one archive.
pub(super) struct Scan<'a> {
    archive: &'a Path,
    input: Box<dyn Read>,
    paths: Paths,
    n_entries: usize,
    total_bytes: u64,
}

impl Scan<'_> {
    /// Opens an archive.
    pub fn open(archive: &Path) -> Result<Scan<'_>> {
        let mut file = BufReader::new(open_user_file(archive)?);
        let start = file.fill_buf().map_err(FileError::context("read", archive))?;
        let is_gzip = start.starts_with(&GZIP);
        let input: Box<dyn Read> =
            if is_gzip { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
        Ok(Scan { archive, input, paths: Paths::default(), n_entries: 0, total_bytes: 0 })
    }

    /// Passes all files and folders to a destination.
    pub fn run(mut self, destination: &mut dyn Destination) -> Result<()> {
        while let Some(header) = self.next_header()? {
            self.n_entries += 1;
            if self.n_entries > MAX_ENTRIES {
                return Err(refused(
                    self.archive,
                    format!("it has more than {MAX_ENTRIES} entries"),
                ));
            }
            self.entry(&header, destination)?;
        }
        if self.n_entries == 0 {
            return Err(refused(self.archive, "it is empty"));
        }
        self.check_padding()
    }

    /// Reads the next header; returns `None` at the end marker.
    fn next_header(&mut self) -> Result<Option<Header>> {
        let mut header = Header::new_old();
        let n_read = self.fill(header.as_mut_bytes())?;
        if n_read < BLOCK {
            let problem =
                "it is no tar archive, or it is cut off: a header or the end marker is missing";
            return Err(refused(self.archive, problem));
        }
        if header.as_bytes().iter().all(|byte| *byte == 0) {
            return Ok(None);
        }
        let is_tar = header.as_ustar().is_some() || header.as_gnu().is_some();
        if !is_tar || header.cksum().ok() != Some(checksum(&header)) {
            let number = self.n_entries + 1;
            let problem = format!(
                "the header of entry {number} is damaged or of no tar format; make the archive with \
                 `chaic submit pack`"
            );
            return Err(refused(self.archive, problem));
        }
        Ok(Some(header))
    }

    fn entry(&mut self, header: &Header, destination: &mut dyn Destination) -> Result<()> {
        let bytes = header.path_bytes().into_owned();
        let number = self.n_entries;
        let refuse = |problem: String| ArenaError::Entry {
            archive: self.archive.to_owned(),
            number,
            path: bytes.iter().take(200).copied().collect::<Vec<u8>>().escape_ascii().to_string(),
            problem,
        };
        let is_folder = match header.entry_type() {
            EntryType::Regular => false,
            EntryType::Directory => true,
            other => return Err(refuse(refusal_of(other))),
        };
        let size = header.entry_size().map_err(|_| refuse("has a damaged size".to_owned()))?;
        let mode = header.mode().map_err(|_| refuse("has damaged permissions".to_owned()))?;
        // `tar -C FOLDER .` writes the folder itself as `./`, and `./` before each path.
        let mut name = bytes.strip_prefix(b"./").unwrap_or(&bytes);
        if is_folder {
            name = name.strip_suffix(b"/").unwrap_or(name);
            if size != 0 {
                return Err(refuse("is a folder with content".to_owned()));
            }
            if name.is_empty() && bytes == b"./" {
                return Ok(());
            }
        }
        let path = check_path(name).map_err(refuse)?.to_owned();
        // Archives are packed and hashed without lock files and bytecode.
        if path.rsplit('/').next() == Some(LOCK) {
            return Err(refuse(format!("is named `{LOCK}`")));
        }
        if path.split('/').any(|name| name == BYTECODE) {
            return Err(refuse(format!(
                "belongs to `{BYTECODE}`; make the archive with `chaic submit pack`, which leaves it \
                 out"
            )));
        }
        self.paths.add(&path, is_folder).map_err(refuse)?;
        if size > MAX_FILE_BYTES {
            return Err(refuse(format!("has {size} bytes, more than {MAX_FILE_BYTES}")));
        }
        self.total_bytes += size;
        if self.total_bytes > MAX_TOTAL_BYTES {
            return Err(refuse(format!("makes the files larger than {MAX_TOTAL_BYTES} bytes")));
        }
        if is_folder {
            return destination.folder(&path);
        }
        let is_executable_by_owner = mode & 0o100 != 0;
        destination
            .file(&path, is_executable_by_owner, &mut |output| self.copy(size, &path, output))
    }

    /// Copies the content of an entry, and skips the rest of its last block.
    fn copy(&mut self, size: u64, path: &str, output: &mut dyn Write) -> Result<()> {
        let write_error = FileError::context("write", Path::new(path));
        let mut chunk = vec![0; CHUNK];
        let mut left = size;
        let mut written = Ok(());
        while left > 0 && written.is_ok() {
            let n = left.min(CHUNK as u64) as usize;
            self.fill_exactly(&mut chunk[..n])?;
            written = output.write_all(&chunk[..n]);
            left -= n as u64;
        }
        written.map_err(write_error)?;
        let padding = (BLOCK as u64 - size % BLOCK as u64) % BLOCK as u64;
        self.fill_exactly(&mut chunk[..padding as usize])
    }

    /// Checks that only a bounded number of zero bytes follows the first block of the end marker.
    fn check_padding(&mut self) -> Result<()> {
        let mut rest = vec![0; MAX_PADDING + 1];
        let n_read = self.fill(&mut rest)?;
        let problem = if n_read > MAX_PADDING {
            "more data follows its end marker"
        } else if rest[..n_read].iter().any(|byte| *byte != 0) {
            "data follows its end marker"
        } else if n_read < BLOCK {
            "it is cut off within its end marker"
        } else {
            return Ok(());
        };
        Err(refused(self.archive, problem))
    }

    fn fill_exactly(&mut self, buffer: &mut [u8]) -> Result<()> {
        if self.fill(buffer)? == buffer.len() {
            return Ok(());
        }
        let problem = format!("it is cut off within entry {}", self.n_entries);
        Err(refused(self.archive, problem))
    }

    /// Fills a buffer up to the end of the input; returns the number of bytes.
    fn fill(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let mut n = 0;
        while n < buffer.len() {
            match self.input.read(&mut buffer[n..]) {
                Ok(0) => break,
                Ok(read) => n += read,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    let problem = format!("it cannot be read to its end: {error}");
                    return Err(refused(self.archive, problem));
                }
            }
        }
        Ok(n)
    }
}

/// Returns the sum of a header's bytes, in which the field of the checksum counts as spaces.
fn checksum(header: &Header) -> u32 {
    let bytes = header.as_bytes();
    let sum = |bytes: &[u8]| bytes.iter().map(|byte| u32::from(*byte)).sum::<u32>();
    sum(&bytes[..148]) + 8 * u32::from(b' ') + sum(&bytes[156..])
}

/// Returns the reason why entries of this kind are refused.
fn refusal_of(kind: EntryType) -> String {
    let name = match kind {
        EntryType::Link => "a hard link",
        EntryType::Symlink => "a symbolic link",
        EntryType::Char => "a character device",
        EntryType::Block => "a block device",
        EntryType::Fifo => "a named pipe",
        EntryType::GNUSparse => "a sparse file",
        EntryType::GNULongName | EntryType::GNULongLink => "a long name of GNU tar",
        EntryType::XHeader | EntryType::XGlobalHeader => "a pax header",
        _ => "an entry of another kind",
    };
    format!(
        "is {name}; an archive holds plain files and folders, as `chaic submit pack` writes them"
    )
}
