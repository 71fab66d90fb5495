//! Lets the trainer find libtorch when it starts, without any exported variable.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    println!("cargo::rerun-if-changed=build.rs");
    for variable in ["LIBTORCH", "LIBTORCH_LIB", "LIBTORCH_USE_PYTORCH"] {
        println!("cargo::rerun-if-env-changed={variable}");
    }
    if std::env::var_os("LIBTORCH_USE_PYTORCH").is_some() {
        // The libtorch of a Python environment: its owner sets LD_LIBRARY_PATH.
        return ExitCode::SUCCESS;
    }
    let variable = |name| std::env::var_os(name).map(PathBuf::from);
    let Some(libtorch) = variable("LIBTORCH_LIB").or_else(|| variable("LIBTORCH")) else {
        return ExitCode::SUCCESS;
    };
    let lib = libtorch.join("lib");
    println!("cargo::rerun-if-changed={}", lib.join("libtorch.so").display());
    if !lib.join("libtorch.so").exists() {
        println!(
            "cargo::error=there is no libtorch in {}: run `cargo xtask libtorch` once, then build again",
            libtorch.display()
        );
        return ExitCode::FAILURE;
    }
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    if workspace.is_some_and(|workspace| libtorch == workspace.join(".libtorch")) {
        // From target/release/ and from target/release/{deps,examples}/: the checkout can be moved.
        println!("cargo::rustc-link-arg=-Wl,-rpath,$ORIGIN/../../.libtorch/lib");
        println!("cargo::rustc-link-arg=-Wl,-rpath,$ORIGIN/../../../.libtorch/lib");
    }
    // For a target folder elsewhere, and for a libtorch of the user's own.
    println!("cargo::rustc-link-arg=-Wl,-rpath,{}", lib.display());
    ExitCode::SUCCESS
}
