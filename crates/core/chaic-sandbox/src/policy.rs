//! Access rights of a sandboxed command.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// Access rights and limits of a sandboxed command. All paths are absolute.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Policy {
    /// Working folder of the command. A private empty folder replaces it, unless it is readable.
    pub start_folder: PathBuf,
    /// Readable files and folders outside the system folders, at the same paths.
    pub readable: Vec<PathBuf>,
    /// Folders and files that appear empty to the command even inside readable folders. Without
    /// namespaces, Landlock refuses access to them, and to lists of the readable folders that contain
    /// them.
    pub masked: Vec<PathBuf>,
    /// Memory of all processes, MiB: anonymous and shared pages.
    pub memory_mib: u64,
    /// Total size of all files that the command can write, in memory, MiB.
    pub scratch_mib: u64,
    /// Maximum number of processes and threads at one time.
    pub max_tasks: u32,
}

/// A path that cannot be made readable.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolicyError {
    /// The path does not exist or is not accessible.
    #[error("--exec-read {path}: {reason}", path = path.display())]
    Unreadable {
        /// The path as given.
        path: PathBuf,
        /// Error of the system.
        reason: String,
    },
    /// The whole file system would be readable.
    #[error("--exec-read / opens every file to the command; name folders, or use --exec-trust")]
    Root,
}

impl Policy {
    /// Adds a file or folder from the user, and the target if it is a link.
    ///
    /// # Errors
    /// If it does not exist or is the root folder.
    pub fn add_readable(&mut self, path: &Path) -> Result<(), PolicyError> {
        let refuse = |e: std::io::Error| PolicyError::Unreadable {
            path: path.to_owned(),
            reason: e.to_string(),
        };
        let absolute = std::path::absolute(path).map_err(refuse)?;
        let target = absolute.canonicalize().map_err(refuse)?;
        if target == Path::new("/") {
            return Err(PolicyError::Root);
        }
        self.add(absolute);
        self.add(target);
        Ok(())
    }

    /// Adds the files in a command line with their folders, and the installation folders of its
    /// programs. Never adds a folder that contains the start folder, a masked folder or the home
    /// folder. For a program in such a folder, it adds only the program file.
    pub fn add_from_command_line(&mut self, line: &str) {
        self.add_words(line, &env::var_os("PATH").unwrap_or_default());
    }

    /// Adds the files and programs of a command line, with the folders of a search path.
    fn add_words(&mut self, line: &str, search_path: &OsStr) {
        for word in split_words(line) {
            let file = self.start_folder.join(&word);
            if file.is_file() {
                self.add_file(&file);
            } else if !word.contains('/') {
                let mut folders = env::split_paths(search_path);
                let found = folders.find_map(|folder| {
                    // An entry of the search path may be relative.
                    let program = self.start_folder.join(folder).join(&word);
                    program.is_file().then_some(program)
                });
                if let Some(program) = found {
                    self.add_program(&program);
                }
            }
        }
    }

    /// Adds the installation folders of a program and of the target of its link.
    fn add_program(&mut self, program: &Path) {
        let target = program.canonicalize().unwrap_or_else(|_| program.to_owned());
        for path in [program.to_owned(), target] {
            if let Some(folder) = installation_folder(&path) {
                self.add_unless_too_wide(folder.to_owned());
            }
            self.add_unless_readable(path);
        }
    }

    fn add_file(&mut self, file: &Path) {
        let Ok(target) = file.canonicalize() else { return };
        let machine_folders = ["/etc", "/proc", "/sys", "/dev", "/run", "/var", "/boot"];
        if machine_folders.iter().any(|folder| target.starts_with(folder)) {
            return;
        }
        for path in [file.to_owned(), target] {
            if let Some(folder) = path.parent() {
                self.add_unless_too_wide(folder.to_owned());
            }
            self.add_unless_readable(path);
        }
    }

    fn add_unless_readable(&mut self, path: PathBuf) {
        if !self.is_readable(&path) && !is_system(&path) {
            self.add(path);
        }
    }

    fn add_unless_too_wide(&mut self, folder: PathBuf) {
        if !self.is_too_wide(&folder) && !is_system(&folder) {
            self.add(folder);
        }
    }

    /// Returns whether a folder contains the start folder, a masked folder or the home folder.
    fn is_too_wide(&self, folder: &Path) -> bool {
        let home = env::home_dir();
        let protected = self.masked.iter().chain(home.as_ref()).chain([&self.start_folder]);
        folder == Path::new("/") || protected.into_iter().any(|path| path.starts_with(folder))
    }

    fn add(&mut self, path: PathBuf) {
        if !self.readable.contains(&path) {
            self.readable.push(path);
        }
    }

    /// Returns whether a path is readable or lies inside a readable folder.
    pub fn is_readable(&self, path: &Path) -> bool {
        self.readable.iter().any(|readable| path.starts_with(readable))
    }
}

/// Splits a command line at white space and shell operators, without handling quotes. It is
/// sufficient to find the paths.
fn split_words(line: &str) -> Vec<String> {
    let is_separator = |c: char| c.is_whitespace() || ";|&()<>=`".contains(c);
    let unquoted = |word: &str| word.trim_matches(['"', '\'']).to_owned();
    line.split(is_separator).map(unquoted).filter(|word| !word.is_empty()).collect()
}

/// Returns the words of a command line that name files, relative to the current folder: programs by their
/// path, scripts and other arguments. Leaves out files into which output is redirected.
pub fn named_files(line: &str) -> Vec<String> {
    // The first word behind a `>` is the file of the output.
    let parts = line.split('>').enumerate();
    let words = parts.flat_map(|(k, part)| split_words(part).into_iter().skip(usize::from(k > 0)));
    words.filter(|word| Path::new(word).is_file()).collect()
}

/// Returns the installation folder of a program: its folder, or the parent of a folder `bin` or
/// `shims`.
fn installation_folder(program: &Path) -> Option<&Path> {
    let folder = program.parent()?;
    let is_bin = folder.ends_with("bin") || folder.ends_with("shims");
    if is_bin { folder.parent() } else { Some(folder) }
}

/// Folders of the operating system that every sandboxed command can read.
pub(crate) const SYSTEM_FOLDERS: &[&str] =
    &["/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32", "/nix/store", "/gnu/store"];

/// Files below `/etc` that programs need and that contain no secrets.
#[cfg(target_os = "linux")]
pub(crate) const SYSTEM_FILES: &[&str] = &[
    "/etc/ld.so.cache",
    "/etc/ld.so.conf",
    "/etc/ld.so.conf.d",
    "/etc/alternatives",
    "/etc/localtime",
    "/etc/timezone",
    "/etc/mime.types",
];

/// Devices that every sandboxed command can use.
#[cfg(target_os = "linux")]
pub(crate) const DEVICES: &[&str] =
    &["/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"];

/// Returns whether a path is inside a system folder, or is the root folder.
fn is_system(path: &Path) -> bool {
    path == Path::new("/") || SYSTEM_FOLDERS.iter().any(|system| path.starts_with(system))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn policy(start_folder: &Path) -> Policy {
        Policy {
            start_folder: start_folder.to_owned(),
            readable: Vec::new(),
            masked: Vec::new(),
            memory_mib: 1,
            scratch_mib: 1,
            max_tasks: 1,
        }
    }

    #[test]
    fn a_named_script_is_readable_with_its_folder_but_not_the_start_folder() {
        let top = tempfile::tempdir().unwrap();
        let top = top.path().canonicalize().unwrap();
        std::fs::create_dir(top.join("mine")).unwrap();
        std::fs::write(top.join("mine/helper.py"), "").unwrap();
        std::fs::write(top.join("beside.py"), "").unwrap();
        let mut policy = policy(&top);
        policy.add_from_command_line("sh mine/helper.py --flag; ./beside.py");
        assert!(policy.is_readable(&top.join("mine/other.py")));
        assert!(
            policy.is_readable(&top.join("beside.py"))
                || policy.is_readable(&top.join("./beside.py"))
        );
        assert!(!policy.is_readable(&top.join("runs")), "{policy:?}");
    }

    #[test]
    fn a_program_is_readable_with_its_installation_or_alone_if_that_is_too_wide() {
        let top = tempfile::tempdir().unwrap();
        let top = top.path().canonicalize().unwrap();
        for folder in ["bin", "tool", "tool/bin", "work"] {
            std::fs::create_dir(top.join(folder)).unwrap();
        }
        for program in ["bin/helper", "tool/bin/trainer"] {
            std::fs::write(top.join(program), "").unwrap();
        }
        let search_path = env::join_paths([top.join("tool/bin"), "bin".into()]).unwrap();
        let mut of_top = policy(&top);
        of_top.add_words("helper --flag; trainer", &search_path);
        for readable in ["bin/helper", "tool/lib"] {
            assert!(of_top.is_readable(&top.join(readable)), "{readable}: {of_top:?}");
        }
        for hidden in ["bin/other", "work", "secret"] {
            assert!(!of_top.is_readable(&top.join(hidden)), "{hidden}: {of_top:?}");
        }
        let mut of_work = policy(&top.join("work"));
        of_work.masked.push(top.join("bin/runs"));
        let search_path = env::join_paths([top.join("bin")]).unwrap();
        of_work.add_words("helper", &search_path);
        assert_eq!(of_work.readable, [top.join("bin/helper")]);
    }

    #[test]
    fn a_folder_that_contains_a_masked_one_is_not_added() {
        let top = tempfile::tempdir().unwrap();
        let top = top.path().canonicalize().unwrap();
        for folder in ["work", "runs", "runs/one"] {
            std::fs::create_dir(top.join(folder)).unwrap();
        }
        let mut policy = policy(&top.join("work"));
        policy.masked.push(top.join("runs/one"));
        policy.add_from_command_line(&format!("cat {}", top.join("runs").display()));
        assert!(!policy.is_readable(&top.join("runs/two")));
    }

    #[test]
    fn files_of_a_command_line_are_named_without_those_of_its_output() {
        let top = tempfile::tempdir().unwrap();
        let file = |name: &str| {
            let path = top.path().join(name);
            std::fs::write(&path, "").unwrap();
            path.display().to_string()
        };
        let [program, script, log] = ["program", "helper.py", "log"].map(file);
        let folder = top.path().display();
        let line =
            format!("'{program}' {script} --in={script} {folder} {folder}/none 2>&1 >>{log}");
        assert_eq!(named_files(&line), [program, script.clone(), script]);
        assert_eq!(named_files(&format!("sh -c ':' 2> {log} < {log}")), [log]);
        assert!(named_files("no-program-of-this-folder --flag").is_empty());
    }

    #[test]
    fn the_root_folder_and_missing_paths_are_refused() {
        let mut policy = policy(Path::new("/tmp"));
        assert_eq!(policy.add_readable(Path::new("/")), Err(PolicyError::Root));
        let error = policy.add_readable(Path::new("/nowhere/at/all")).unwrap_err().to_string();
        assert!(error.contains("--exec-read /nowhere/at/all"), "{error}");
    }
}
