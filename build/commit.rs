//! The commit that a build is made from.

use std::path::Path;
use std::process::Command;

/// In release builds, set the environment variable `FISSURE_COMMIT` of the crate. The commit comes from git,
/// or from the file that `cargo package` writes. Debug builds do not set this variable, because they would be
/// rebuilt after each commit.
pub fn set_environment() {
    if std::env::var("PROFILE").as_deref() != Ok("release") {
        return;
    }
    // `cargo package` records the commit in this JSON file.
    let packaged = std::fs::read_to_string(".cargo_vcs_info.json").ok();
    if let Some(commit) = packaged.as_deref().and_then(sha1) {
        println!("cargo::rustc-env=FISSURE_COMMIT={}", &commit[..12]);
        return;
    }
    // Without this check, git would report the commit of an enclosing checkout of another project.
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

/// Return the commit in the text of the file that `cargo package` writes; `None` if the text has no commit.
fn sha1(information: &str) -> Option<&str> {
    let (_, rest) = information.split_once("\"sha1\"")?;
    let commit = rest.split('"').nth(1)?;
    let is_commit = commit.len() >= 12 && commit.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_commit.then_some(commit)
}

/// Return the output of git; `None` if git fails or is missing.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
