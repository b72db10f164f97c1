//! Private root folder of a sandboxed command, in a separate mount namespace.
//!
//! ```text
//! /            read-only, in memory
//! ├── usr, lib, ...   those of the system, read-only
//! ├── etc             some files of the system, and a user table with one user
//! ├── dev             null, zero, full, random, urandom
//! ├── proc            of the command's pid namespace
//! ├── tmp, dev/shm, start folder   private, writable, in memory, with a common limit
//! └── readable files and folders at their own paths, read-only
//! ```

use std::ffi::CString;
use std::fs::{self, File};
use std::os::unix::fs::{MetadataExt as _, symlink};
use std::path::{Path, PathBuf};

use nix::sched::{CloneFlags, unshare};
use rustix::mount::{
    MountFlags, MountPropagationFlags, UnmountFlags, mount, mount_bind_recursive, mount_change,
    mount_remount, unmount,
};
use rustix::process::pivot_root;

use super::{SetupError, SetupResult};
use crate::policy::{DEVICES, Policy, SYSTEM_FILES, SYSTEM_FOLDERS};

/// Folder in which the root is built; it exists on every system.
const BASE: &str = "/tmp";
/// Root folder of the caller during the construction.
const OLD: &str = "/old";
/// New root folder during the construction.
const NEW: &str = "/new";
/// Private file system whose folders are bound into the new root.
const SCRATCH: &str = "/scratch";
/// Empty file that hides masked files.
const EMPTY: &str = "/empty";
/// Maximum number of files and folders that a command can create.
const MAX_FILES: u32 = 100_000;

/// Builds the root folder and enters it. Returns the folders that the command can write to.
pub(super) fn build(policy: &Policy) -> SetupResult<Vec<PathBuf>> {
    unshare(CloneFlags::CLONE_NEWNS).map_err(SetupError::context("enter a mount namespace"))?;
    mount_change("/", MountPropagationFlags::PRIVATE | MountPropagationFlags::REC)
        .map_err(SetupError::context("keep mounts private"))?;
    mount_tmpfs(BASE, "mode=0755,size=1m")?;
    for folder in [OLD, NEW, SCRATCH] {
        make_folder(Path::new(&format!("{BASE}{folder}")))?;
    }
    enter(BASE, &format!("{BASE}{OLD}"))?;
    fs::write(EMPTY, "").map_err(SetupError::context(format!("write {EMPTY}")))?;
    mount_tmpfs(NEW, "mode=0755,size=4m")?;
    let options = format!("mode=0700,size={}m,nr_inodes={MAX_FILES}", policy.scratch_mib);
    mount_tmpfs(SCRATCH, &options)?;

    let mut root = Root { writable: Vec::new() };
    root.add_system()?;
    root.add_devices()?;
    if !policy.is_readable(Path::new("/tmp")) {
        root.add_private(Path::new("/tmp"))?;
    }
    // The root itself and the folders of the kernel are not replaced.
    let is_replaced =
        !["/", "/dev", "/proc", "/sys", "/etc"].map(Path::new).contains(&&*policy.start_folder);
    if is_replaced && !policy.is_readable(&policy.start_folder) {
        root.add_private(&policy.start_folder)?;
    }
    root.add_readable(policy)?;
    for masked in &policy.masked {
        root.mask(masked)?;
    }
    root.make_read_only()?;
    root.add_processes()?;

    make_folder(Path::new("/new/old"))?;
    enter(NEW, "/new/old")?;
    unmount("/old", UnmountFlags::DETACH)
        .map_err(SetupError::context("leave the caller's root"))?;
    fs::remove_dir("/old").map_err(SetupError::context("remove the caller's root"))?;
    let flags = MountFlags::BIND | MountFlags::RDONLY | MountFlags::NOSUID | MountFlags::NODEV;
    mount_remount("/", flags, "").map_err(SetupError::context("make the root read-only"))?;
    Ok(root.writable)
}

fn enter(new: &str, old: &str) -> SetupResult<()> {
    pivot_root(new, old).map_err(SetupError::context(format!("make {new} the root")))?;
    std::env::set_current_dir("/").map_err(SetupError::context("enter the new root"))
}

fn mount_tmpfs(path: &str, options: &str) -> SetupResult<()> {
    let step = SetupError::context(format!("mount a private file system at {path}"));
    let options = CString::new(options).expect("options have no zero bytes");
    mount("tmpfs", path, "tmpfs", MountFlags::NOSUID | MountFlags::NODEV, &*options).map_err(step)
}

fn make_folder(path: &Path) -> SetupResult<()> {
    fs::create_dir_all(path).map_err(SetupError::context(format!("make {}", path.display())))
}

/// Rebases an absolute path to another root.
fn under(root: &str, path: &Path) -> PathBuf {
    let inside = path.strip_prefix("/").unwrap_or(path);
    Path::new(root).join(inside)
}

/// New root folder under construction.
struct Root {
    writable: Vec<PathBuf>,
}

impl Root {
    fn add_system(&mut self) -> SetupResult<()> {
        for path in SYSTEM_FOLDERS.iter().chain(SYSTEM_FILES).map(Path::new) {
            let (old, new) = (under(OLD, path), under(NEW, path));
            let Ok(kind) = fs::symlink_metadata(&old) else { continue };
            if kind.is_symlink() {
                let step = || SetupError::context(format!("link {}", path.display()));
                let target = fs::read_link(&old).map_err(step())?;
                make_folder(new.parent().unwrap_or(&new))?;
                symlink(target, &new).map_err(step())?;
            } else {
                self.bind(path, path)?;
            }
        }
        let text = |name: &str, text: &str| {
            let path = under(NEW, Path::new(name));
            fs::write(&path, text).map_err(SetupError::context(format!("write {name}")))
        };
        make_folder(&under(NEW, Path::new("/etc")))?;
        text("/etc/passwd", "helper:x:0:0:helper:/tmp:/bin/sh\n")?;
        text("/etc/group", "helper:x:0:\n")?;
        text("/etc/hosts", "127.0.0.1 localhost\n::1 localhost\n")?;
        text("/etc/nsswitch.conf", "passwd: files\ngroup: files\nhosts: files\n")
    }

    fn add_devices(&mut self) -> SetupResult<()> {
        for device in DEVICES.iter().map(Path::new) {
            if under(OLD, device).exists() {
                self.bind(device, device)?;
            }
        }
        let links = [("fd", "fd"), ("stdin", "fd/0"), ("stdout", "fd/1"), ("stderr", "fd/2")];
        for (name, target) in links {
            let link = under(NEW, &Path::new("/dev").join(name));
            symlink(format!("/proc/self/{target}"), &link)
                .map_err(SetupError::context(format!("link /dev/{name}")))?;
        }
        self.add_private(Path::new("/dev/shm"))
    }

    /// Adds an empty writable folder.
    fn add_private(&mut self, path: &Path) -> SetupResult<()> {
        if self.writable.iter().any(|writable| writable == path) {
            return Ok(());
        }
        let name = format!("{SCRATCH}/{}", self.writable.len());
        make_folder(Path::new(&name))?;
        let target = under(NEW, path);
        make_folder(&target)?;
        bind(Path::new(&name), &target)?;
        self.writable.push(path.to_owned());
        Ok(())
    }

    /// Adds readable paths, outer folders first.
    fn add_readable(&mut self, policy: &Policy) -> SetupResult<()> {
        let mut paths = policy.readable.clone();
        paths.sort_by_key(|path| path.components().count());
        let mut added: Vec<PathBuf> = SYSTEM_FOLDERS.iter().map(PathBuf::from).collect();
        for path in paths {
            if added.iter().any(|folder| path.starts_with(folder)) {
                continue;
            }
            // The target of a link is a separate readable path.
            let target = resolve_in(OLD, &path);
            if target != path {
                let link = under(NEW, &path);
                make_folder(link.parent().unwrap_or(&link))?;
                if fs::symlink_metadata(&link).is_err() {
                    symlink(&target, &link)
                        .map_err(SetupError::context(format!("link {}", path.display())))?;
                }
                continue;
            }
            self.bind(&path, &path)?;
            added.push(path);
        }
        Ok(())
    }

    /// Hides the content of a folder or file inside a readable folder. A path that the new root lacks
    /// needs no mask.
    fn mask(&mut self, path: &Path) -> SetupResult<()> {
        // A mount through a link would follow it in the root of the construction.
        let path = resolve_in(NEW, path);
        let target = under(NEW, &path);
        let is_private = self.writable.contains(&path);
        match fs::symlink_metadata(&target) {
            Ok(kind) if kind.is_dir() && !is_private => {
                mount_tmpfs(&target.to_string_lossy(), "mode=0555,size=4k")
            }
            Ok(kind) if !kind.is_dir() && !kind.is_symlink() => bind(Path::new(EMPTY), &target),
            _ => Ok(()),
        }
    }

    fn bind(&mut self, from: &Path, to: &Path) -> SetupResult<()> {
        let (from, to) = (under(OLD, from), under(NEW, to));
        if from.is_dir() {
            make_folder(&to)?;
        } else {
            make_folder(to.parent().unwrap_or(&to))?;
            let step = SetupError::context(format!("make {}", to.display()));
            File::options().create(true).append(true).open(&to).map_err(step)?;
        }
        bind(&from, &to)
    }

    /// Makes every mount except private folders read-only. Devices stay usable.
    fn make_read_only(&self) -> SetupResult<()> {
        let step = || SetupError::context("read the list of mounts");
        let text = fs::read_to_string(format!("{OLD}/proc/self/mountinfo")).map_err(step())?;
        let scratch = fs::metadata(SCRATCH).map_err(step())?.dev();
        let scratch = format!("{}:{}", rustix::fs::major(scratch), rustix::fs::minor(scratch));
        let mounts: Vec<Mount> = text.lines().filter_map(Mount::parse).collect();
        for (k, mount) in mounts.iter().enumerate() {
            let Ok(inside) = mount.path.strip_prefix(NEW) else { continue };
            // A later mount at the same place or above hides it.
            let is_hidden = mounts[k + 1..].iter().any(|later| mount.path.starts_with(&later.path));
            if mount.device == scratch || inside == Path::new("") || is_hidden {
                continue;
            }
            let inside = Path::new("/").join(inside);
            let mut flags =
                mount.flags | MountFlags::BIND | MountFlags::RDONLY | MountFlags::NOSUID;
            if !DEVICES.iter().any(|device| inside == Path::new(device)) {
                flags |= MountFlags::NODEV;
            }
            mount_remount(&mount.path, flags, "")
                .map_err(SetupError::context(format!("make {} read-only", inside.display())))?;
        }
        Ok(())
    }

    /// Adds `/proc` of the pid namespace. Files for privileged users are read-only.
    fn add_processes(&self) -> SetupResult<()> {
        const SETTINGS: &[&str] = &["sys", "sysrq-trigger", "irq", "bus", "fs"];
        let proc = under(NEW, Path::new("/proc"));
        make_folder(&proc)?;
        let flags = MountFlags::NOSUID | MountFlags::NODEV | MountFlags::NOEXEC;
        mount("proc", &proc, "proc", flags, c"").map_err(SetupError::context("mount /proc"))?;
        for name in SETTINGS {
            let path = proc.join(name);
            if path.exists() {
                bind(&path, &path)?;
                let flags = flags | MountFlags::BIND | MountFlags::RDONLY;
                mount_remount(&path, flags, "")
                    .map_err(SetupError::context(format!("make /proc/{name} read-only")))?;
            }
        }
        Ok(())
    }
}

fn bind(from: &Path, to: &Path) -> SetupResult<()> {
    mount_bind_recursive(from, to)
        .map_err(SetupError::context(format!("bind {} into the new root", from.display())))
}

/// Resolves links in an absolute path, as seen from another root.
fn resolve_in(root: &str, path: &Path) -> PathBuf {
    /// Limit of the kernel.
    const MAX_LINKS: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        let linked = path.ancestors().collect::<Vec<_>>().into_iter().rev().find_map(|ancestor| {
            let target = fs::read_link(under(root, ancestor)).ok()?;
            let rest = path.strip_prefix(ancestor).unwrap_or(Path::new(""));
            let base = ancestor.parent().unwrap_or(Path::new("/"));
            Some(normalize(&base.join(target).join(rest)))
        });
        match linked {
            Some(next) => path = next,
            None => break,
        }
    }
    path
}

/// Removes `.` and `..` from an absolute path without links.
fn normalize(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for component in path.components() {
        match component {
            std::path::Component::ParentDir => {
                normal.pop();
            }
            std::path::Component::CurDir => {}
            other => normal.push(other),
        }
    }
    normal
}

/// A line of `/proc/self/mountinfo`.
#[derive(Debug, PartialEq)]
struct Mount {
    path: PathBuf,
    /// Major and minor number of its file system, such as `98:0`.
    device: String,
    /// Flags that a remount must keep.
    flags: MountFlags,
}

impl Mount {
    fn parse(line: &str) -> Option<Mount> {
        let mut fields = line.split(' ');
        let (device, path, options) = (fields.nth(2)?, fields.nth(1)?, fields.next()?);
        let mut flags = MountFlags::empty();
        for option in options.split(',') {
            flags |= match option {
                "nosuid" => MountFlags::NOSUID,
                "nodev" => MountFlags::NODEV,
                "noexec" => MountFlags::NOEXEC,
                "noatime" => MountFlags::NOATIME,
                "nodiratime" => MountFlags::NODIRATIME,
                "relatime" => MountFlags::RELATIME,
                _ => MountFlags::empty(),
            };
        }
        Some(Mount { path: PathBuf::from(unescape(path)), device: device.to_owned(), flags })
    }
}

/// Replaces the octal escapes that the kernel writes for spaces in paths.
fn unescape(text: &str) -> std::ffi::OsString {
    use std::os::unix::ffi::OsStringExt as _;
    let bytes = text.as_bytes();
    let (mut unescaped, mut k) = (Vec::with_capacity(bytes.len()), 0);
    while k < bytes.len() {
        let octal = bytes.get(k + 1..k + 4).and_then(|digits| std::str::from_utf8(digits).ok());
        let code = octal.and_then(|digits| u8::from_str_radix(digits, 8).ok());
        match code.filter(|_| bytes[k] == b'\\') {
            Some(code) => {
                unescaped.push(code);
                k += 4;
            }
            None => {
                unescaped.push(bytes[k]);
                k += 1;
            }
        }
    }
    std::ffi::OsString::from_vec(unescaped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_mountinfo_is_parsed() {
        let line =
            "36 35 98:0 /mnt1 /new/my\\040data rw,noatime,nosuid master:1 - ext3 /dev/root rw";
        let mount = Mount::parse(line).unwrap();
        assert_eq!(mount.path, Path::new("/new/my data"));
        assert_eq!(mount.device, "98:0");
        assert_eq!(mount.flags, MountFlags::NOATIME | MountFlags::NOSUID);
        assert_eq!(Mount::parse("cut 35 98:0"), None);
    }

    #[test]
    fn links_are_resolved_within_another_root() {
        let top = tempfile::tempdir().unwrap();
        let top = top.path().canonicalize().unwrap();
        fs::create_dir_all(top.join("real/bin")).unwrap();
        symlink("/real", top.join("alias")).unwrap();
        symlink("../bin/tool", top.join("real/bin/link")).unwrap();
        let root = top.to_str().unwrap();
        assert_eq!(resolve_in(root, Path::new("/alias/bin/link")), Path::new("/real/bin/tool"));
    }

    #[test]
    fn the_resolution_of_circular_links_ends() {
        let top = tempfile::tempdir().unwrap();
        symlink("/b", top.path().join("a")).unwrap();
        symlink("/a", top.path().join("b")).unwrap();
        resolve_in(top.path().to_str().unwrap(), Path::new("/a"));
    }
}
