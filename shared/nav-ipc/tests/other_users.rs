//! Other users can neither disturb a world nor be waited for in vain without a word. Most of this needs two users: where
//! the tests do not run as root, those parts pass and say so.

use nav_core::messages::{Goal, LaserScan};
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode, others};
use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown, symlink};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const ROOT: &str = "NAV_IPC_USER_ROOT";
/// `nobody`.
const USER: u32 = 65534;

fn scratch() -> tempfile::TempDir {
    tempfile::Builder::new().prefix("nav").tempdir_in("/tmp").expect("a scratch folder")
}

fn open(config: &IpcConfig) -> Result<RobotNode, IpcError> {
    RobotNode::open(&RobotName::new("r").expect("a plain name"), config)
}

fn is_root() -> bool {
    let is_root = fs::metadata("/proc/self").expect("this process").uid() == 0;
    if !is_root {
        eprintln!("not checked: another user can only be tried as root");
    }
    is_root
}

fn shared_files(config: &IpcConfig) -> Vec<PathBuf> {
    let files = fs::read_dir("/dev/shm").expect("shared memory is mounted").flatten();
    let ours = |path: &PathBuf| path.to_string_lossy().contains(config.prefix());
    files.map(|file| file.path()).filter(ours).collect()
}

#[test]
fn nothing_is_open_to_others() {
    let folder = scratch();
    let config = IpcConfig::in_folder(&folder.path().join("new")).expect("a short path");
    let node = open(&config).expect("a node");
    let _out = node.writer::<LaserScan>().expect("a writer");
    let _in = node.reader::<LaserScan>().expect("a reader");
    let mode = |path: &Path| fs::metadata(path).expect("there").mode() & 0o7777;
    assert_eq!(mode(&config.root()), 0o700);
    let files = shared_files(&config);
    assert!(files.len() >= 5, "{files:?}");
    for path in &files {
        assert_eq!(mode(path) & 0o077, 0, "{}", path.display());
    }
    let counter = files.iter().filter(|path| path.to_string_lossy().ends_with("global_mgmt")).count();
    assert_eq!(counter, 1, "the one that we made is the one that iceoryx2 uses");
    // As a stock peer that came first leaves it.
    let counter = files.iter().find(|path| path.to_string_lossy().ends_with("global_mgmt")).expect("counted");
    fs::set_permissions(counter, Permissions::from_mode(0o666)).expect("ours");
    let _other = open(&config).expect("another node");
    assert_eq!(mode(counter), 0o600);
    drop((_out, _in, _other, node));
    config.remove_all();
}

#[test]
fn a_folder_that_others_may_write_to_or_lead_astray_is_refused() {
    let folder = scratch();
    let root = folder.path().join("open");
    fs::create_dir(&root).expect("a folder");
    fs::set_permissions(&root, Permissions::from_mode(0o777)).expect("ours");
    let link = folder.path().join("link");
    symlink("/tmp", &link).expect("a link");
    for root in [root, link] {
        let config = IpcConfig::in_folder(&root).expect("a short path");
        let error = open(&config).map(drop).expect_err("not ours alone");
        assert!(matches!(error, IpcError::SharedRoot { .. }), "{error}");
    }
}

#[test]
fn a_folder_or_a_file_of_another_user_is_named_with_both_users() {
    if !is_root() {
        return;
    }
    let folder = scratch();
    let root = folder.path().join("theirs");
    fs::create_dir(&root).expect("a folder");
    chown(&root, Some(USER), Some(USER)).expect("given away");
    let error = open(&IpcConfig::in_folder(&root).expect("a short path")).expect_err("theirs").to_string();
    assert!(error.contains("user 65534") && error.contains("0 (root)"), "{error}");
    assert!(error.contains("as the same user"), "{error}");

    let config = IpcConfig::in_folder(&folder.path().join("ours")).expect("a short path");
    let squatted = Path::new("/dev/shm").join(format!("{}x", config.prefix()));
    fs::write(&squatted, "x").expect("written");
    chown(&squatted, Some(USER), Some(USER)).expect("given away");
    let error = open(&config).expect_err("in the way").to_string();
    fs::remove_file(&squatted).expect("removed");
    assert!(error.contains("user 65534") && error.contains("--ipc-root"), "{error}");
    assert!(open(&config).is_ok(), "without it we start");
    config.remove_all();
}

/// Not a test of its own: what runs as another user. Prints what it finds, and stays.
#[test]
fn child() {
    let Some(root) = std::env::var_os(ROOT) else { return };
    let root = (!root.is_empty()).then(|| PathBuf::from(root));
    let config = IpcConfig::from_option(root.as_deref()).expect("a short path");
    match open(&config).and_then(|node| Ok((node.reader::<Goal>()?, node))) {
        Ok(_stays) => std::thread::sleep(Duration::from_secs(60)),
        Err(error) => println!("{error}"),
    }
}

/// This test as another user; nothing where that is not possible.
fn as_another_user(root: &str, folder: &Path) -> Option<Child> {
    let program = folder.join("test");
    fs::copy(std::env::current_exe().expect("this test"), &program).expect("copied");
    fs::set_permissions(folder, Permissions::from_mode(0o755)).expect("ours");
    let user = USER.to_string();
    Command::new("setpriv")
        .args(["--reuid", &user, "--regid", &user, "--clear-groups"])
        .arg(program)
        .args(["--exact", "child", "--nocapture"])
        .env(ROOT, root)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()
}

#[test]
fn two_users_are_told_of_each_other() {
    if !is_root() {
        return;
    }
    let folder = scratch();
    let ours = folder.path().join("ours");
    let config = IpcConfig::in_folder(&ours).expect("a short path");
    let _node = open(&config).expect("a node");
    let Some(child) = as_another_user(&ours.to_string_lossy(), folder.path()) else { return };
    let said = String::from_utf8_lossy(&child.wait_with_output().expect("it ends").stdout).into_owned();
    assert!(said.contains("belongs to user 0 (root)") && said.contains("as user 65534"), "{said}");

    // Each in the world of its own user.
    let Some(mut child) = as_another_user("", folder.path()) else { return };
    let began = Instant::now();
    let hint = loop {
        match others::programs_of_other_users(&IpcConfig::default()) {
            Some(hint) => break hint,
            None => assert!(began.elapsed() < Duration::from_secs(20), "no word of the other user"),
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    assert!(hint.contains("user 65534") && hint.contains("/tmp/hybridnav-65534"), "{hint}");
    child.kill().expect("killed");
    child.wait().expect("waited for");
    assert_eq!(others::programs_of_other_users(&config), None, "a folder that was given is everybody's");
    config.remove_all();
    // The killed one cannot tidy up.
    let _ = fs::remove_dir_all("/tmp/hybridnav-65534");
    for path in fs::read_dir("/dev/shm").expect("shared memory is mounted").flatten() {
        if path.metadata().is_ok_and(|metadata| metadata.uid() == USER) {
            let _ = fs::remove_file(path.path());
        }
    }
}
