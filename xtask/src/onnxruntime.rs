//! ONNX Runtime's shared library, set up in `.tools/onnxruntime/`.
//!
//! The export check and the tests load it through `ORT_DYLIB_PATH`; the robot never does.

use std::fs;

use anyhow::{Context, Result, bail};

use crate::shell::{partial_folder, remove_folder, say, set_up_lock, tools};
use crate::wheel::{Wheel, unpack};

const ONNXRUNTIME: Wheel = Wheel {
    name: "onnxruntime",
    version: "1.31.1",
    platform: "manylinux_2_28_x86_64",
    sha256: "5752bd508126ae7c49894d3b9d2e83f0c3d487319246d04c444b393308d7ad7f",
    size_mb: 24,
};

/// Sets `.tools/onnxruntime/libonnxruntime.so` up unless it is there or the user has one of their own.
///
/// # Errors
/// One sentence when the download fails or does not have its digest.
pub(crate) fn set_up() -> Result<()> {
    let folder = tools().join("onnxruntime");
    let library = folder.join("libonnxruntime.so");
    // Cargo itself sets the variable to our path (.cargo/config.toml) unless the user has set it.
    if let Some(path) = std::env::var_os("ORT_DYLIB_PATH").filter(|path| *path != library) {
        say(&format!("ONNX Runtime: using yours, ORT_DYLIB_PATH={}; nothing to do", path.display()));
        return Ok(());
    }
    let _lock = set_up_lock()?;
    let mark = folder.join("complete");
    let stamp = format!("onnxruntime {} {}\n", ONNXRUNTIME.version, ONNXRUNTIME.sha256);
    if fs::read_to_string(&mark).is_ok_and(|found| found == stamp) {
        say(&format!("ONNX Runtime {} is ready in .tools/onnxruntime/", ONNXRUNTIME.version));
        return Ok(());
    }
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        bail!(
            "the pinned ONNX Runtime is for Linux on x86_64; install it yourself and set ORT_DYLIB_PATH to the library"
        );
    }
    let downloads = tools().join("download-onnxruntime");
    let partial = partial_folder("onnxruntime")?;
    let wheel = ONNXRUNTIME.fetch(&downloads, None)?;
    let member = format!("onnxruntime/capi/libonnxruntime.so.{}", ONNXRUNTIME.version);
    unpack(&wheel, &[&member, "onnxruntime/LICENSE", "onnxruntime/ThirdPartyNotices.txt"], &partial)?;
    fs::rename(partial.join(&member), partial.join("libonnxruntime.so"))
        .with_context(|| format!("the wheel has no {member}"))?;
    fs::write(partial.join("complete"), stamp)?;
    remove_folder(&folder)?;
    fs::rename(&partial, &folder).context("could not move the finished ONNX Runtime into place")?;
    remove_folder(&downloads)?;
    say(&format!("ONNX Runtime {} is ready in .tools/onnxruntime/", ONNXRUNTIME.version));
    Ok(())
}
