//! A model folder that is replaced as a whole: whoever reads it, and whenever the export is killed, finds the old model or
//! the new one.

use anyhow::{Context, Result};
use std::ffi::CString;
use std::fs;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// Fills a new folder beside `folder` and puts it in its place. What is in the old one and not `ours` is kept.
///
/// # Errors
/// Whatever `fill` says, or the file system; the old folder is then as it was.
pub(super) fn replace_folder(
    folder: &Path,
    ours: &[&str],
    fill: impl FnOnce(&Path) -> Result<()>,
) -> Result<()> {
    let cannot = || format!("cannot write the folder {}", folder.display());
    fs::create_dir_all(folder).with_context(cannot)?;
    // A link to a folder stays one.
    let folder = folder.canonicalize().with_context(cannot)?;
    let (Some(parent), Some(name)) = (folder.parent(), folder.file_name()) else {
        anyhow::bail!("{} is no folder that can be replaced: give one of its own", folder.display());
    };
    let prefix = format!(".{}.new-", name.to_string_lossy());
    remove_left(parent, &prefix, &folder);
    let new = parent.join(format!("{prefix}{}", std::process::id()));
    let filled = fs::create_dir(&new)
        .with_context(|| format!("cannot make a folder in {}", parent.display()))
        .and_then(|()| fill(&new))
        .and_then(|()| keep_others(&folder, &new, ours).with_context(cannot))
        .and_then(|()| exchange(&new, &folder).with_context(cannot));
    let old = new;
    if filled.is_ok() {
        move_folders(&old, &folder).with_context(cannot)?;
    }
    // Now the old folder, or the half-filled new one.
    let removed = fs::remove_dir_all(&old);
    filled?;
    removed.with_context(|| format!("cannot remove the old model in {}", old.display()))?;
    fs::File::open(parent).and_then(|parent| parent.sync_all()).with_context(cannot)
}

/// Removes what exports that were killed left behind; one that lives keeps its own. Folders of an old model that were not yet
/// brought into the new one, `folder`, are brought there now.
fn remove_left(parent: &Path, prefix: &str, folder: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let process = name.to_str().and_then(|name| name.strip_prefix(prefix)?.parse::<u32>().ok());
        let is_left = process.is_some_and(|process| !Path::new(&format!("/proc/{process}")).exists());
        // What cannot be moved stays where it is, and what cannot be removed is in nobody's way.
        if is_left
            && entry.file_type().is_ok_and(|kind| kind.is_dir())
            && move_folders(&entry.path(), folder).is_ok()
        {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// Files of the old folder that are not ours are the same files in the new one.
fn keep_others(old: &Path, new: &Path, ours: &[&str]) -> io::Result<()> {
    for entry in fs::read_dir(old)? {
        let entry = entry?;
        let is_ours = ours.iter().any(|name| entry.file_name().as_os_str() == *name);
        if !is_ours && !entry.file_type()?.is_dir() {
            fs::hard_link(entry.path(), new.join(entry.file_name()))?;
        }
    }
    Ok(())
}

/// Folders cannot be in two places; they follow after the exchange.
fn move_folders(old: &Path, new: &Path) -> io::Result<()> {
    for entry in fs::read_dir(old)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            fs::rename(entry.path(), new.join(entry.file_name()))?;
        }
    }
    Ok(())
}

/// Exchanges two folders in one step.
fn exchange(new: &PathBuf, folder: &PathBuf) -> io::Result<()> {
    let path = |path: &PathBuf| CString::new(path.as_os_str().as_bytes()).map_err(io::Error::other);
    let (new, folder) = (path(new)?, path(folder)?);
    // SAFETY: two paths that end in a zero byte.
    let status = unsafe {
        libc::renameat2(libc::AT_FDCWD, new.as_ptr(), libc::AT_FDCWD, folder.as_ptr(), libc::RENAME_EXCHANGE)
    };
    if status == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").flatten();
        let mut names: Vec<_> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn the_old_folder_stays_until_the_new_one_is_whole() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let models = root.path().join("models");
        let write = |text: &'static str| move |folder: &Path| Ok(fs::write(folder.join("td3.onnx"), text)?);
        replace_folder(&models, &["td3.onnx"], write("first")).expect("the first");
        fs::write(models.join("notes.txt"), "mine").expect("written");
        fs::create_dir(models.join("pictures")).expect("made");
        let failed = replace_folder(&models, &["td3.onnx"], |new| {
            fs::write(new.join("td3.onnx"), "half")?;
            assert_eq!(fs::read_to_string(models.join("td3.onnx"))?, "first", "not before it is whole");
            anyhow::bail!("the disk is full")
        });
        assert!(failed.is_err_and(|error| error.to_string().contains("full")));
        assert_eq!(fs::read_to_string(models.join("td3.onnx")).expect("there"), "first");
        // What a dead export left, and a file that the next model does not have.
        fs::create_dir(root.path().join(".models.new-4294967294")).expect("made");
        fs::write(models.join("dqn.onnx"), "old").expect("written");
        replace_folder(&models, &["td3.onnx", "dqn.onnx"], write("second")).expect("the second");
        assert_eq!(fs::read_to_string(models.join("td3.onnx")).expect("there"), "second");
        assert_eq!(names(&models), ["notes.txt", "pictures", "td3.onnx"]);
        assert_eq!(names(root.path()), ["models"]);
    }

    /// Killed after the exchange: the old model lies aside, with a folder of the user in it.
    #[test]
    fn a_user_s_folder_is_not_lost_with_an_export_that_was_killed() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let (models, left) = (root.path().join("models"), root.path().join(".models.new-4294967294"));
        fs::create_dir_all(left.join("pictures")).expect("made");
        fs::write(left.join("pictures/one.png"), "mine").expect("written");
        fs::write(left.join("td3.onnx"), "old").expect("written");
        replace_folder(&models, &["td3.onnx"], |new| Ok(fs::write(new.join("td3.onnx"), "new")?))
            .expect("exported");
        assert_eq!(names(&models), ["pictures", "td3.onnx"]);
        assert_eq!(fs::read_to_string(models.join("pictures/one.png")).expect("there"), "mine");
        assert_eq!(names(root.path()), ["models"]);
        // A folder of that name is there already: nothing is removed that cannot be brought back.
        fs::create_dir_all(left.join("pictures")).expect("made");
        fs::write(left.join("pictures/one.png"), "another").expect("written");
        replace_folder(&models, &["td3.onnx"], |_| Ok(())).expect("exported");
        assert_eq!(fs::read_to_string(models.join("pictures/one.png")).expect("there"), "mine");
        assert_eq!(fs::read_to_string(left.join("pictures/one.png")).expect("there"), "another");
    }

    #[test]
    fn a_link_to_a_folder_stays_a_link() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let (models, link) = (root.path().join("models"), root.path().join("link"));
        fs::create_dir(&models).expect("made");
        std::os::unix::fs::symlink(&models, &link).expect("linked");
        replace_folder(&link, &[], |new| Ok(fs::write(new.join("a"), "b")?)).expect("replaced");
        assert!(link.is_symlink());
        assert_eq!(names(&models), ["a"]);
    }
}
