//! Packing of folders: the same content gives the same bytes.

use std::io::{self, BufWriter, Read as _, Write};
use std::path::Path;

use chaic_files::{DirectoryEntry, EntryKind, FileError, LOCK, TemporaryFile, open_file, walk};
use sha2::{Digest as _, Sha256};
use tar::{EntryType, Header};

use super::entry_path::{Paths, check_path};
use super::{
    BYTECODE, MAX_DEPTH, MAX_ENTRIES, MAX_FILE_BYTES, MAX_TOTAL_BYTES, PACKAGE_DESCRIPTION,
    PACKAGE_ORIGIN, refused,
};
use crate::error::Result;
use crate::secret::to_hex;

/// Size of a block of the tar format, bytes.
const BLOCK: u64 = 512;

/// Description of a written archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackedArchive {
    /// Number of files.
    pub n_files: usize,
    /// Size of the archive, bytes.
    pub bytes: u64,
    /// SHA-256 of the archive, hexadecimal.
    pub sha256: String,
}

/// Packs the files of a folder into an uncompressed tar archive, sorted by path, without times and owners.
///
/// Lock files are left out, because they hold no content. So are empty folders, the bytecode of Python, and the
/// files in which pip records where a package came from: they name paths of the author.
///
/// # Errors
/// [`ArenaError`](crate::ArenaError) if an entry is no regular file or folder, or its name or size is
/// not allowed. Also if the archive would lie in the folder, or a file cannot be read or written.
pub fn pack(folder: &Path, archive: &Path) -> Result<PackedArchive> {
    if lies_inside(archive, folder) {
        let archive = archive.display();
        let problem = format!("its archive {archive} would lie inside; choose another place");
        return Err(refused(folder, problem));
    }
    let file = TemporaryFile::beside(archive).map_err(FileError::context("create", archive))?;
    let mut output = Hashed::new(BufWriter::new(file));
    let n_files = write_archive(folder, false, &mut output)?;
    let Hashed { inner, digest, bytes } = output;
    let file = inner.into_inner().map_err(io::IntoInnerError::into_error);
    file.and_then(TemporaryFile::commit).map_err(FileError::context("write", archive))?;
    Ok(PackedArchive { n_files, bytes, sha256: to_hex(&digest.finalize()) })
}

/// Returns the SHA-256 of the archive with all files of a folder that archives may hold. That of an extracted
/// archive is the one that [`pack`] returned. Archives of other programs may hold records of pip, which count.
///
/// # Errors
/// Those of [`pack`].
pub fn content_sha256(folder: &Path) -> Result<String> {
    let mut output = Hashed::new(io::sink());
    write_archive(folder, true, &mut output)?;
    Ok(to_hex(&output.digest.finalize()))
}

/// Returns whether a file that may not exist yet lies inside a folder, also through links.
fn lies_inside(file: &Path, folder: &Path) -> bool {
    let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty());
    let parent = parent.unwrap_or(Path::new(".")).canonicalize();
    let folder = folder.canonicalize();
    parent.is_ok_and(|parent| folder.is_ok_and(|folder| parent.starts_with(folder)))
}

/// Writer that computes a digest.
struct Hashed<W> {
    inner: W,
    digest: Sha256,
    bytes: u64,
}

impl<W: Write> Hashed<W> {
    fn new(inner: W) -> Hashed<W> {
        Hashed { inner, digest: Sha256::new(), bytes: 0 }
    }
}

impl<W: Write> Write for Hashed<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let n = self.inner.write(buffer)?;
        self.digest.update(&buffer[..n]);
        self.bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// Writes the archive of a folder, with or without the origins of Python packages; returns the number of files.
fn write_archive(folder: &Path, with_origins: bool, output: &mut dyn Write) -> Result<usize> {
    let mut paths = Paths::default();
    let (mut n_files, mut total) = (0, 0);
    for DirectoryEntry { path, kind } in walk(folder, MAX_DEPTH as u32 - 1)? {
        if path.file_name().is_some_and(|name| name == LOCK) {
            continue;
        }
        let refuse = |problem: String| refused(folder, format!("`{}` {problem}", path.display()));
        let below = path.strip_prefix(folder).map_err(|_| refuse("lies outside".to_owned()))?;
        // Archives separate names by slashes on every system.
        let names: Vec<_> = below.iter().map(|name| name.to_string_lossy()).collect();
        if names.iter().any(|name| *name == BYTECODE) {
            continue;
        }
        let is_origin = match &names[..] {
            [.., package, file] => {
                package.ends_with(PACKAGE_DESCRIPTION) && *file == PACKAGE_ORIGIN
            }
            _ => false,
        };
        if is_origin && !with_origins {
            continue;
        }
        let name = names.join("/");
        let name = check_path(name.as_bytes()).map_err(refuse)?;
        paths.add(name, false).map_err(refuse)?;
        match kind {
            EntryKind::File => {}
            EntryKind::Folder => return Err(refuse(format!("has more than {MAX_DEPTH} names"))),
            _ => return Err(refuse("is a link or no regular file".to_owned())),
        }
        let (size, is_executable) = attributes(&path)?;
        n_files += 1;
        total += size;
        if n_files > MAX_ENTRIES || size > MAX_FILE_BYTES || total > MAX_TOTAL_BYTES {
            return Err(refuse(format!(
                "exceeds a limit: {MAX_ENTRIES} files, {MAX_FILE_BYTES} bytes in one, \
                 {MAX_TOTAL_BYTES} bytes in all"
            )));
        }
        let header = header(name, size, is_executable).ok_or_else(|| {
            refuse("does not fit into a ustar header; shorten the path".to_owned())
        })?;
        write_file(&path, &header, size, output)?;
    }
    if n_files == 0 {
        return Err(refused(folder, "it holds no files"));
    }
    let marker = [0; 2 * BLOCK as usize];
    output.write_all(&marker).map_err(FileError::context("pack", folder))?;
    Ok(n_files)
}

/// Returns the size of a file, and whether its owner may execute it.
fn attributes(path: &Path) -> Result<(u64, bool)> {
    let metadata = std::fs::symlink_metadata(path).map_err(FileError::context("open", path))?;
    #[cfg(unix)]
    let is_executable =
        std::os::unix::fs::PermissionsExt::mode(&metadata.permissions()) & 0o100 != 0;
    #[cfg(not(unix))]
    let is_executable = false;
    Ok((metadata.len(), is_executable))
}

fn header(name: &str, size: u64, is_executable: bool) -> Option<Header> {
    let mut header = Header::new_ustar();
    header.set_path(name).ok()?;
    header.set_size(size);
    header.set_entry_type(EntryType::Regular);
    header.set_mode(if is_executable { 0o755 } else { 0o644 });
    header.set_uid(0);
    header.set_gid(0);
    header.set_mtime(0);
    header.set_cksum();
    Some(header)
}

fn write_file(path: &Path, header: &Header, size: u64, output: &mut dyn Write) -> Result<()> {
    let mut content = open_file(path)?.take(size);
    let padding = vec![0; ((BLOCK - size % BLOCK) % BLOCK) as usize];
    let copied = output.write_all(header.as_bytes()).and_then(|()| {
        let n = io::copy(&mut content, output)?;
        if n != size {
            return Err(io::Error::other("it became shorter while it was read"));
        }
        output.write_all(&padding)
    });
    Ok(copied.map_err(FileError::context("pack", path))?)
}
