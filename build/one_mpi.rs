//! Check that HDF5 was built with the linked MPI; a program with two MPI libraries crashes at its start.
//!
//! `mpi-sys` and `hdf5-metno-sys` find their libraries independently. This module repeats both searches, and
//! compares the names of the MPI shared libraries.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The linked MPI.
pub struct Mpi {
    /// True for Open MPI, whose bindings differ from the bindings of MPICH and its derivatives.
    pub is_open_mpi: bool,
}

/// Find MPI and HDF5, and check that HDF5 needs the MPI library that is linked.
///
/// # Errors
/// If no MPI is found, or if HDF5 was built with another MPI; the message then names the fix.
pub fn check() -> Result<Mpi, String> {
    let mpi = build_probe_mpi::probe().map_err(|errors| {
        let reasons: Vec<String> = errors.iter().map(ToString::to_string).collect();
        format!("no MPI was found: {}", reasons.join("; "))
    })?;
    let folders = mpi.include_paths.iter().map(PathBuf::as_path);
    let header = folders
        .chain([Path::new("/usr/include")])
        .find_map(|folder| std::fs::read_to_string(folder.join("mpi.h")).ok());
    let is_open_mpi = header.is_some_and(|text| text.contains("OMPI_MAJOR_VERSION"));
    let linked: Vec<String> = (mpi.libs.iter())
        .filter(|name| name.starts_with("mpi"))
        .filter_map(|name| loader_name(name, &mpi.lib_paths))
        .collect();
    let Some(hdf5) = hdf5_library() else {
        return Ok(Mpi { is_open_mpi });
    };
    let needed: Vec<String> = (needed_libraries(&hdf5).into_iter())
        .filter(|name| name.starts_with("libmpi"))
        .collect();
    // A list of names is empty for a static library, or if the tool that reads the names is missing.
    if linked.is_empty() || needed.is_empty() || needed.iter().any(|name| linked.contains(name)) {
        return Ok(Mpi { is_open_mpi });
    }
    let compiler = mpi.mpicc.as_deref().unwrap_or("pkg-config");
    Err(format!(
        "HDF5 and MPI do not fit: {} was built for {}, but `{compiler}` links {}\n\
         set HDF5_DIR to an HDF5 that was built with this MPI{}, or MPICC to the compiler wrapper of \
         the MPI that HDF5 was built with",
        hdf5.display(),
        needed.join(", "),
        linked.join(", "),
        example(&linked)
    ))
}

/// Return a note with Debian's folder of the HDF5 that was built with the linked MPI; empty if the folder
/// does not exist.
fn example(linked: &[String]) -> String {
    let family = if linked.iter().any(|name| name.starts_with("libmpich")) {
        "mpich"
    } else {
        "openmpi"
    };
    let machine = std::env::consts::ARCH;
    let folder = format!("/usr/lib/{machine}-linux-gnu/hdf5/{family}");
    if Path::new(&folder).exists() {
        format!(" (HDF5_DIR={folder})")
    } else {
        String::new()
    }
}

/// Find the shared library of HDF5 that `hdf5-metno-sys` links; `None` if there is none.
fn hdf5_library() -> Option<PathBuf> {
    let own = std::env::var_os("HDF5_DIR").map(|root| vec![PathBuf::from(root).join("lib")]);
    let folders = own.or_else(|| {
        let mut configuration = pkg_config::Config::new();
        let found = configuration.cargo_metadata(false).probe("hdf5").ok()?;
        Some(found.link_paths)
    });
    let mut folders = folders.unwrap_or_default();
    // The build script of `hdf5-metno-sys` sets this variable.
    if let Some(include) = std::env::var_os("DEP_HDF5_INCLUDE") {
        folders.extend(Path::new(&include).parent().map(|root| root.join("lib")));
    }
    let files = folders
        .iter()
        .flat_map(|folder| ["libhdf5.so", "libhdf5.dylib"].map(|name| folder.join(name)));
    files.into_iter().find(|file| file.exists())
}

/// Return the soname of the library that `-l NAME` links; `None` if the library or its soname is not found.
fn loader_name(name: &str, folders: &[PathBuf]) -> Option<String> {
    let system = ["/usr/lib64", "/usr/lib"].map(PathBuf::from);
    let files = folders.iter().chain(&system);
    let mut files = files.flat_map(|folder| {
        ["so", "dylib"].map(|ending| folder.join(format!("lib{name}.{ending}")))
    });
    let file = files.find(|file| file.exists())?;
    if file.extension().is_some_and(|ending| ending == "dylib") {
        let lines = printed("otool", &["-D"], &file)?;
        return Some(base_name(lines.lines().nth(1)?));
    }
    entries(&file, "SONAME").into_iter().next()
}

/// Return the sonames of the libraries that a shared library needs.
fn needed_libraries(file: &Path) -> Vec<String> {
    if file.extension().is_some_and(|ending| ending == "dylib") {
        let lines = printed("otool", &["-L"], file).unwrap_or_default();
        let names = lines
            .lines()
            .skip(1)
            .filter_map(|line| line.split_whitespace().next());
        return names.map(base_name).collect();
    }
    entries(file, "NEEDED")
}

/// Return all values of the tag `kind` in the dynamic section of an ELF file.
fn entries(file: &Path, kind: &str) -> Vec<String> {
    let lines = printed("readelf", &["-d", "-W"], file).unwrap_or_default();
    let value = |line: &str| {
        let (_, rest) = line.split_once('[')?;
        Some(rest.split_once(']')?.0.to_owned())
    };
    let kind = format!("({kind})");
    let lines = lines.lines().filter(|line| line.contains(&kind));
    lines.filter_map(value).collect()
}

fn base_name(path: &str) -> String {
    path.rsplit('/').next().unwrap_or(path).to_owned()
}

/// Run a program on a file and return its standard output, in English; `None` if the program cannot be
/// started.
fn printed(program: &str, options: &[&str], file: &Path) -> Option<String> {
    let mut command = Command::new(program);
    let output = command
        .args(options)
        .arg(file)
        .env("LC_ALL", "C")
        .output()
        .ok()?;
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}
