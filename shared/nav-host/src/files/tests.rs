use super::*;
use std::ffi::CString;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};

pub(super) fn make_pipe(path: &Path) {
    let path = CString::new(path.as_os_str().as_bytes()).expect("no zero in it");
    // SAFETY: a path that ends with a zero.
    assert_eq!(unsafe { libc::mkfifo(path.as_ptr(), 0o600) }, 0, "{}", io::Error::last_os_error());
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let name = |entry: io::Result<fs::DirEntry>| entry.expect("readable").file_name();
    let mut names: Vec<_> = entries.map(|entry| name(entry).to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_failed_write_leaves_the_previous_file_and_no_rubbish() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("policy.onnx");
    replace(&path, b"first").expect("the first write");
    let full = |file: &mut BufWriter<File>| {
        file.write_all(b"half")?;
        Err(io::Error::from(io::ErrorKind::StorageFull))
    };
    let error = write_atomically(&path, full).expect_err("the disk is full");
    assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    assert_eq!(fs::read(&path).expect("the file is there"), b"first");
    assert_eq!(names(folder.path()), ["policy.onnx"]);
    replace(&path, b"second").expect("the second write");
    assert_eq!(fs::read(&path).expect("the file is there"), b"second");
}

#[test]
fn what_cannot_be_written_is_known_before() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("reports").join("a.json");
    check_writable(&path).expect("its folder is made");
    assert_eq!(names(&folder.path().join("reports")).len(), 0);
    let error = check_writable(folder.path()).expect_err("a folder is no file");
    assert_eq!(error.kind(), io::ErrorKind::IsADirectory);
    replace(&path, b"{}").expect("written");
    assert!(check_writable(&path.join("below.json")).is_err(), "a file is no folder");
    check_writable(&path).expect("it may be replaced");
    assert_eq!(fs::read(&path).expect("the file is there"), b"{}", "and is not yet");
    for nothing in ["", ".."] {
        assert!(check_writable(Path::new(nothing)).is_err(), "{nothing:?}");
    }
}

#[test]
fn files_of_the_user_stay() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("out.json");
    let theirs = [".out.json.tmp", "out.json.tmp", "out.partial"].map(|name| folder.path().join(name));
    theirs.iter().for_each(|path| fs::write(path, "precious").expect("written"));
    check_writable(&path).expect("it can be written");
    replace(&path, b"{}").expect("written");
    assert!(theirs.iter().all(|path| fs::read(path).expect("it is there") == b"precious"));
    assert_eq!(names(folder.path()).len(), 4);
}

#[test]
fn who_may_read_a_file_stays_as_it_was() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("out.json");
    fs::write(&path, "old").expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).expect("our own file");
    replace(&path, b"new").expect("written");
    assert_eq!(fs::metadata(&path).expect("it is there").permissions().mode() & 0o777, 0o600);
}

#[test]
fn links_are_kept_and_followed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("other")).expect("a folder");
    symlink("other/r.json", at("link.json")).expect("a link to what is not there yet");
    symlink("link.json", at("second.json")).expect("a link to a link");
    for text in ["first", "second"] {
        check_writable(&at("second.json")).expect("it can be written");
        replace(&at("second.json"), text).expect("written");
        assert_eq!(fs::read_to_string(at("other/r.json")).expect("written there"), text);
    }
    assert!(at("link.json").is_symlink() && at("second.json").is_symlink());
    assert_eq!(names(&at("other")), ["r.json"]);
    symlink(".", at("folder")).expect("a link to a folder");
    let error = check_writable(&at("folder")).expect_err("a folder is no file");
    assert_eq!(error.kind(), io::ErrorKind::IsADirectory);
    symlink("round", at("round")).expect("a link to itself");
    let error = check_writable(&at("round")).expect_err("it leads nowhere");
    assert!(error.to_string().contains("circle"), "{error}");
}

#[test]
fn devices_are_written_through() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    // By links: a test need not be allowed to make devices, and must not put one at risk.
    for (name, device) in [("null", "/dev/null"), ("full", "/dev/full")] {
        symlink(device, at(name)).expect("a link");
        check_writable(&at(name)).expect("everybody may");
    }
    replace(&at("null"), b"{}").expect("it takes everything");
    let error = replace(&at("full"), b"{}").expect_err("it takes nothing");
    assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    for name in ["null", "full"] {
        assert!(fs::metadata(at(name)).expect("there").file_type().is_char_device(), "{name}");
    }
    assert_eq!(names(folder.path()), ["full", "null"]);
}

#[test]
fn a_pipes_reader_gets_everything_and_is_not_disturbed_by_the_check() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("pipe");
    make_pipe(&path);
    let from = path.clone();
    let reader = std::thread::spawn(move || fs::read(from));
    check_writable(&path).expect("it can be written");
    // More than a pipe holds.
    let bytes = vec![b'x'; 1 << 18];
    replace(&path, &bytes).expect("somebody reads");
    assert!(reader.join().expect("no panic").expect("read") == bytes);
    assert_eq!(names(folder.path()), ["pipe"]);
}

#[test]
fn what_a_process_has_open_is_not_replaced_under_it() {
    use std::os::fd::AsRawFd as _;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("log");
    let mut log = File::options().append(true).create(true).open(&path).expect("a file");
    log.write_all(b"before\n").expect("written");
    let link = folder.path().join("stdout");
    symlink(format!("/proc/self/fd/{}", log.as_raw_fd()), &link).expect("as /dev/stdout is one");
    check_writable(&link).expect("it can be written");
    replace(&link, b"report\n").expect("written");
    log.write_all(b"after\n").expect("written");
    assert_eq!(fs::read_to_string(&path).expect("it is there"), "before\nreport\nafter\n");
    assert_eq!(names(folder.path()), ["log", "stdout"]);
}

#[test]
fn sockets_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("socket");
    let _listener = std::os::unix::net::UnixListener::bind(&path).expect("a socket");
    let error = check_writable(&path).expect_err("it is no file");
    assert!(error.to_string().contains("socket"), "{error}");
}
