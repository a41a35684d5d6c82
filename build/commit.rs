//! The commit that the program is built from.

use std::path::Path;
use std::process::Command;

/// Tells the crate its commit, in the variable `FISSURE_COMMIT`; not in a debug build, which would be
/// compiled anew after each commit, and not where the source is no checkout.
pub fn tell() {
    if std::env::var("PROFILE").as_deref() != Ok("release") {
        return;
    }
    // A package that `cargo package` has made knows where it comes from.
    let packaged = std::fs::read_to_string(".cargo_vcs_info.json").ok();
    if let Some(commit) = packaged.as_deref().and_then(sha1) {
        println!("cargo::rustc-env=FISSURE_COMMIT={}", &commit[..12]);
        return;
    }
    // A folder that lies in the checkout of something else is none of ours.
    if !Path::new(".git").exists() {
        return;
    }
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        return;
    };
    let source = ["src", "build", "Cargo.toml", "Cargo.lock"];
    let changes = git(&[&["status", "--porcelain", "--"], &source[..]].concat());
    let changed = if changes.is_some_and(|changes| !changes.is_empty()) {
        " with changes"
    } else {
        ""
    };
    println!("cargo::rustc-env=FISSURE_COMMIT={commit}{changed}");
    for path in source {
        println!("cargo::rerun-if-changed={path}");
    }
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name])
            && Path::new(&path).exists()
        {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}

/// The commit in the file that `cargo package` writes.
fn sha1(information: &str) -> Option<&str> {
    let (_, rest) = information.split_once("\"sha1\"")?;
    let commit = rest.split('"').nth(1)?;
    let is_commit = commit.len() >= 12 && commit.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_commit.then_some(commit)
}

/// What git prints; `None` where it fails or is not there.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
