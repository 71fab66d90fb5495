//! libtorch without CUDA, set up unattended in `.libtorch/`.
//!
//! The only place every machine can reach is the Python package index, so libtorch is taken from the
//! torch wheel. That one is built for CUDA: its CPU library is kept and made to load without CUDA.
//!
//! 1. `libtorch_cpu.so`, `libc10.so`, `libgomp.so.1` and the headers are kept; `libtorch_cuda.so` is
//!    left out, and with it torch-sys links no CUDA.
//! 2. `libtorch_cpu.so` asks for `libcudart` and `libcupti`: two stub libraries made from its undefined
//!    symbols answer "no device".
//! 3. The wheel's `libtorch.so` asks for the CUDA library: an empty one that asks for the CPU library
//!    takes its place.
//!
//! All is made in `.tools/` and renamed when complete: a killed set-up leaves nothing
//! that looks finished.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::shell::{have, partial_folder, remove_folder, root, run_quiet, say, set_up_lock, size_mb, tools};
use crate::wheel::{Wheel, unpack};

/// The version that tch 0.26 is made for.
const TORCH: Wheel = Wheel {
    name: "torch",
    version: "2.13.0",
    platform: "manylinux_2_28_x86_64",
    sha256: "60fcdcb2f3876e21146cb4524ef06397d727ca9ad5f020818547e25075fe3cb7",
    size_mb: 527,
};

/// Counts the ways `.libtorch/` was ever made; a folder made another way is made again.
const RECIPE: &str = "1";

/// What of the wheel is kept.
const KEPT: [&str; 7] = [
    "torch/lib/libtorch_cpu.so",
    "torch/lib/libc10.so",
    "torch/lib/libgomp.so.1",
    "torch/include/ATen/",
    "torch/include/c10/",
    "torch/include/torch/",
    "torch/include/caffe2/",
];

/// Where a libtorch comes from.
enum Source {
    /// The user's own variable, `NAME=value`.
    User(String),
    /// `.libtorch/` of this workspace, complete or not.
    Ours { folder: PathBuf, complete: bool },
}

impl Source {
    fn find() -> Self {
        let folder = root().join(".libtorch");
        if let Ok(value) = std::env::var("LIBTORCH_USE_PYTORCH") {
            return Self::User(format!("LIBTORCH_USE_PYTORCH={value}"));
        }
        // Cargo itself sets LIBTORCH to our folder (.cargo/config.toml) unless the user has set it.
        match std::env::var_os("LIBTORCH") {
            Some(value) if Path::new(&value) != folder => {
                Self::User(format!("LIBTORCH={}", Path::new(&value).display()))
            }
            _ => {
                let complete = fs::read_to_string(folder.join("complete")).is_ok_and(|mark| mark == stamp());
                Self::Ours { folder, complete }
            }
        }
    }
}

/// The content of the file that marks a complete `.libtorch/`.
fn stamp() -> String {
    format!("torch {} {} recipe {RECIPE}\n", TORCH.version, TORCH.sha256)
}

/// Sets `.libtorch/` up unless it is there or the user has a libtorch of their own.
///
/// # Errors
/// One sentence when a needed program is missing, the download fails or does not have its digest.
pub(crate) fn set_up(wheel: Option<&Path>) -> Result<()> {
    if let Source::User(variable) = Source::find() {
        say(&format!("libtorch: using yours, {variable}; nothing to do (unset it to use .libtorch/)"));
        return Ok(());
    }
    let _lock = set_up_lock()?;
    let Source::Ours { folder, complete } = Source::find() else { return Ok(()) };
    if complete {
        say(&format!("libtorch {} is ready in .libtorch/", TORCH.version));
        return Ok(());
    }
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        bail!(
            "the pinned libtorch is for Linux on x86_64; install libtorch {} yourself and set LIBTORCH to its folder",
            TORCH.version
        );
    }
    for (program, package) in [("gcc", "gcc"), ("c++", "g++"), ("readelf", "binutils"), ("strip", "binutils")]
    {
        if !have(program, &["--version"]) {
            bail!(
                "{program} is not installed; install it (on Debian: apt-get install {package}) and run this again"
            );
        }
    }
    let downloads = tools().join("download-torch");
    let partial = partial_folder("libtorch")?;
    let wheel = TORCH.fetch(&downloads, wheel)?;
    say("unpacking the CPU part and making it load without CUDA");
    unpack(&wheel, &KEPT, &partial)?;
    make_standalone(&partial.join("torch"))?;
    remove_folder(&folder)?;
    fs::rename(partial.join("torch"), &folder)
        .with_context(|| format!("could not move the finished libtorch to {}", folder.display()))?;
    remove_folder(&partial)?;
    remove_folder(&downloads)?;
    say(&format!("libtorch {} is ready in .libtorch/ ({} MB)", TORCH.version, size_mb(&folder)));
    Ok(())
}

/// Makes the unpacked `torch/` a libtorch that builds and loads on its own.
fn make_standalone(torch: &Path) -> Result<()> {
    let lib = torch.join("lib");
    let cpu = lib.join("libtorch_cpu.so");
    for (library, symbols) in undefined_versioned_symbols(&cpu)? {
        if library.starts_with("libcu") {
            make_stub(&lib, &library, &symbols)?;
        }
    }
    for name in ["libtorch_cpu.so", "libc10.so"] {
        let mut strip = Command::new("strip");
        run_quiet(strip.arg("--strip-unneeded").arg(lib.join(name)), "strip", |_| ())?;
    }
    let source = lib.join("empty.c");
    fs::write(&source, "")?;
    let mut gcc = Command::new("gcc");
    gcc.args(["-shared", "-fPIC", "-Wl,--no-as-needed", "-Wl,-soname,libtorch.so", "-Wl,-rpath,$ORIGIN"])
        .arg("-o")
        .args([lib.join("libtorch.so"), source.clone(), cpu])
        .arg(format!("-Wl,-rpath-link,{}", lib.display()));
    run_quiet(&mut gcc, "gcc, linking libtorch.so,", |_| ())?;
    fs::remove_file(source)?;
    symlink("libgomp.so.1", lib.join("libgomp.so"))?;
    // torch-sys refuses a version it was not made for, and reads it here.
    fs::write(torch.join("build-version"), format!("{}+cpu\n", TORCH.version))?;
    fs::write(torch.join("complete"), stamp())?;
    Ok(())
}

/// The undefined symbols of a library whose version names a library, grouped by that library.
fn undefined_versioned_symbols(library: &Path) -> Result<BTreeMap<String, Vec<String>>> {
    let mut readelf = Command::new("readelf");
    readelf.args(["--wide", "--dyn-syms"]).arg(library);
    let listing = run_quiet(&mut readelf, "readelf", |_| ())?;
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for line in listing.lines() {
        // Num: Value Size Type Bind Vis Ndx Name@Version (index)
        let fields: Vec<&str> = line.split_whitespace().collect();
        let Some((name, version)) = fields.get(7).and_then(|name| name.split_once('@')) else { continue };
        if fields[6] == "UND" && version.contains(".so.") {
            found.entry(version.to_owned()).or_default().push(name.to_owned());
        }
    }
    if found.is_empty() {
        bail!(
            "{} names no CUDA library, so this is not the wheel this set-up was written for",
            library.display()
        );
    }
    Ok(found)
}

/// Makes a library `soname` that holds `symbols` under the version `soname`.
///
/// Each is a function that reports failure (100, "no device"), but for those that return a text.
fn make_stub(lib: &Path, soname: &str, symbols: &[String]) -> Result<()> {
    let source = lib.join("stub.c");
    let script = lib.join("stub.map");
    let mut code = String::new();
    for symbol in symbols {
        code += &if symbol.ends_with("GetErrorString") {
            format!("const char *{symbol}(void) {{ return \"built without CUDA\"; }}\n")
        } else {
            format!("int {symbol}(void) {{ return 100; }}\n")
        };
    }
    fs::write(&source, code)?;
    fs::write(&script, format!("{soname} {{ global: {}; local: *; }};\n", symbols.join("; ")))?;
    let mut gcc = Command::new("gcc");
    gcc.args(["-shared", "-fPIC", "-O1"])
        .arg(format!("-Wl,-soname,{soname}"))
        .arg(format!("-Wl,--version-script={}", script.display()))
        .arg("-o")
        .args([&lib.join(soname), &source]);
    run_quiet(&mut gcc, &format!("gcc, making a stub of {soname},"), |_| ())?;
    fs::remove_file(source)?;
    fs::remove_file(script)?;
    Ok(())
}

/// Says in one sentence when there is no libtorch to build the trainer with.
///
/// # Errors
/// When `.libtorch/` is not set up and the user has no libtorch of their own.
pub(crate) fn require() -> Result<()> {
    if let Source::Ours { complete: false, .. } = Source::find() {
        bail!(
            "the trainer needs libtorch, which is not set up yet; run `cargo xtask libtorch` once (about 15 s)"
        );
    }
    Ok(())
}
