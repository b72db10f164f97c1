//! Only regular files are opened, and only some functions create missing ones.

use std::io::Write as _;

use super::*;

#[test]
fn only_regular_files_are_read_up_to_the_limit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.txt");
    fs::write(&path, "0123456789").unwrap();
    assert_eq!(read_bounded(&path, 4).unwrap(), b"0123");
    assert_eq!(read_user_file(&path, 4).unwrap(), b"0123");
    assert_eq!(read_below(dir.path(), &path, 4).unwrap(), b"0123");
    let error = read_bounded(dir.path(), 4).unwrap_err().to_string();
    assert!(error.contains("it is a folder"), "{error}");
    let missing = read_bounded(&dir.path().join("b.txt"), 4).unwrap_err();
    assert_eq!(missing.error.kind(), ErrorKind::NotFound);
    assert!(missing.to_string().starts_with("can't open "), "{missing}");
    #[cfg(unix)]
    {
        let error = read_bounded(Path::new("/dev/null"), 4).unwrap_err().to_string();
        assert!(error.contains("can't read /dev/null: it is no regular file"), "{error}");
        assert!(read_user_file(Path::new("/dev/zero"), 4).is_err());
    }
}

#[test]
fn a_removed_file_is_not_created_again() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.txt");
    let missing = open_existing_for_append(&path).unwrap_err();
    assert_eq!(missing.error.kind(), ErrorKind::NotFound);
    assert!(missing.to_string().starts_with("can't open "), "{missing}");
    assert!(!path.exists());
    open_for_append(&path).unwrap().write_all(b"first").unwrap();
    open_existing_for_append(&path).unwrap().write_all(b", second").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"first, second");
    assert!(open_existing_for_append(dir.path()).is_err());
}

#[cfg(unix)]
mod links {
    use std::os::unix::fs::symlink;

    use super::*;

    /// Creates a folder `root`, and the file `secret` outside of it. The root contains a file `f/x`,
    /// a linked file `f/y`, a dangling link `f/z`, a pipe `f/p` and a linked folder `g`.
    fn folder_with_links() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("root");
        fs::create_dir_all(root.join("f")).unwrap();
        fs::write(dir.path().join("secret"), "secret").unwrap();
        fs::write(root.join("f/x"), "good").unwrap();
        symlink(dir.path().join("secret"), root.join("f/y")).unwrap();
        symlink(dir.path().join("new"), root.join("f/z")).unwrap();
        symlink(root.join("f"), root.join("g")).unwrap();
        let pipe = std::process::Command::new("mkfifo").arg(root.join("f/p")).status();
        assert!(pipe.unwrap().success());
        dir
    }

    #[test]
    fn links_are_not_followed_below_a_folder() {
        let dir = folder_with_links();
        let root = dir.path().join("root");
        let content_or_error = |name: &str| {
            let read = read_below(&root, &root.join(name), 9);
            read.map_or_else(|e| e.to_string(), |bytes| String::from_utf8(bytes).unwrap())
        };
        assert_eq!(content_or_error("f/x"), "good");
        for (name, words) in [
            ("f/y", "it is a link"),
            ("f/z", "it is a link"),
            ("g/x", "linked folder"),
            ("f/p", "no regular file"),
            ("f", "it is a folder"),
            ("f/x/x", "can't open"),
        ] {
            assert!(content_or_error(name).contains(words), "{name}: {}", content_or_error(name));
        }
        // Links created after the check of the name are refused too.
        let open = |names: &[&str]| {
            let names: Vec<&std::ffi::OsStr> = names.iter().map(std::ffi::OsStr::new).collect();
            open_names(&root, &names)
        };
        assert!(open(&["f", "x"]).is_ok());
        assert!(open(&["f", "y"]).is_err() && open(&["g", "x"]).is_err() && open(&[]).is_err());
    }

    #[test]
    fn a_user_file_may_be_a_link_to_a_regular_file() {
        let dir = folder_with_links();
        let f = dir.path().join("root/f");
        assert_eq!(read_user_file(&f.join("y"), 9).unwrap(), b"secret");
        assert!(read_bounded(&f.join("y"), 9).is_err());
        assert!(read_user_file(&f.join("z"), 9).is_err());
        assert!(read_user_file(&f.join("p"), 9).is_err());
    }

    #[test]
    fn nothing_is_written_through_a_link() {
        let dir = folder_with_links();
        let root = dir.path().join("root");
        for name in ["f/y", "f/z", "f/p", "g"] {
            let path = root.join(name);
            assert!(open_for_append(&path).is_err(), "{name}");
            assert!(open_existing_for_append(&path).is_err(), "{name}");
            assert!(open_or_create(&path).is_err(), "{name}");
        }
        assert!(!dir.path().join("new").exists());
        create_folders_below(&root, &root.join("f/a/b")).unwrap();
        create_folders_below(&root, &root.join("f/a/b")).unwrap();
        for name in ["g/a", "f/x/a", "f/y"] {
            assert!(create_folders_below(&root, &root.join(name)).is_err(), "{name}");
        }
        for name in ["f/y", "f/z", "f/p", "f/x", "f/new"] {
            drop(create_or_replace(&root.join(name)).unwrap());
            assert_eq!(kind(&root.join(name)).unwrap(), EntryKind::File, "{name}");
        }
        assert!(create_or_replace(&root.join("f/a")).is_err());
        assert_eq!(fs::read(dir.path().join("secret")).unwrap(), b"secret");
        assert!(!dir.path().join("new").exists());
    }

    #[test]
    fn a_linked_temporary_file_does_not_redirect_a_write() {
        let dir = folder_with_links();
        let path = dir.path().join("root/report.md");
        symlink(dir.path().join("secret"), crate::with_suffix(&path, crate::TEMPORARY_SUFFIX))
            .unwrap();
        crate::write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read(dir.path().join("secret")).unwrap(), b"secret");
        // A linked file is replaced, and the target of the link stays unchanged.
        crate::write_atomically(&dir.path().join("root/f/y"), b"new").unwrap();
        assert_eq!(fs::read(dir.path().join("secret")).unwrap(), b"secret");
    }
}
