//! `fissure plot` of a field: options, and the names of the picture files.

use std::path::{Path, PathBuf};

use clap::Args;
use fissure::error::{Error, Result};
use fissure::output::ResultReader;

use super::choice::choose_times;
use super::painter::Painter;
use super::{PlotArguments, check_ending};
use crate::cli::format::si;
use crate::cli::{Verbosity, outln, result_file};

/// Smallest width of a picture, pixels.
pub const LEAST_WIDTH: u32 = 200;

/// Options of pictures.
#[derive(Args, Clone)]
pub struct PictureArguments {
    /// Field to draw [default: damage, or another field if the result has no damage].
    #[arg(short, long, value_name = "NAME")]
    pub(super) field: Option<String>,

    /// Component or invariant of a vector or tensor: x, xx, magnitude, von_mises, principal_1, trace, …
    #[arg(short, long, value_name = "NAME")]
    pub(super) component: Option<String>,

    /// Factor by which the drawn displacement is multiplied, or `auto`.
    #[arg(
        long,
        value_name = "FACTOR",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    pub(super) deform: String,

    /// Draw only one layer of points of a solid: the layer at this plane, such as z=0.005 (m).
    #[arg(long, value_name = "AXIS=POSITION")]
    pub(super) slice: Option<String>,

    /// Direction from a solid to the camera: its angle from +x towards +y, and its angle above the x-y plane,
    /// in degrees [default: -45,35.26].
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION",
        allow_hyphen_values = true,
        conflicts_with = "slice"
    )]
    pub(super) camera: Option<String>,

    /// Draw only the points in a half space, such as 'x<0.01' or 'z>0' (m). May be repeated.
    #[arg(long, value_name = "AXIS<POSITION")]
    pub(super) clip: Vec<String>,

    /// Draw only the points whose value is in this range. LOW or HIGH may be left out: `0.3:` means 0.3 and
    /// above.
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true)]
    pub(super) threshold: Option<String>,

    /// Field whose values are compared with the range of `--threshold`. A component or invariant may follow
    /// after a colon, such as stress:xx [default: the drawn field and component].
    #[arg(long, value_name = "NAME[:COMPONENT]", requires = "threshold")]
    pub(super) threshold_field: Option<String>,

    /// Draw the lines of a CSV file, such as crack_NAME.csv, over the picture of a plane body. The file
    /// must have the columns x and y (m). If the file also has the column branch, consecutive rows with the
    /// same entry in this column form one line. May be repeated.
    #[arg(long, value_name = "FILE.csv")]
    pub(super) path: Vec<PathBuf>,

    /// Range of the colours: two values such as `0,1`, two percentiles such as `5%,95%`, or `all` [default:
    /// all, or 0.5%,99.5% if there are outliers].
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true)]
    pub(super) range: Option<String>,

    /// Subtract another result. The other result must have the same points, and outputs at the same times.
    #[arg(long, value_name = "RESULT", conflicts_with = "log")]
    pub(super) minus: Option<PathBuf>,

    /// Draw lines of equal value in plane pictures and slices: N lines, or lines at given values such as
    /// 1e6,2e6.
    #[arg(long, value_name = "N|VALUE,…", allow_hyphen_values = true)]
    pub(super) contours: Option<String>,

    /// Draw the arrows of a vector field, such as velocity.
    #[arg(long, value_name = "FIELD")]
    pub(super) vectors: Option<String>,

    /// Colour map: viridis, turbo, coolwarm, grey or damage [default: coolwarm with --minus, damage for the
    /// field damage, otherwise viridis].
    #[arg(long, value_name = "NAME")]
    pub(super) colors: Option<String>,

    /// Logarithmic scale of the colours. Points with values of 0 or less are grey, or pale blue with the
    /// colour map `grey`.
    #[arg(long)]
    pub(super) log: bool,

    /// Width of the picture in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 1200, value_parser = clap::value_parser!(u32).range(i64::from(LEAST_WIDTH)..=10_000))]
    pub(super) width: u32,
}

/// Draw outputs of a result, each as a separate picture: the last output, the outputs nearest to given times,
/// or all outputs.
///
/// # Errors
/// - If the file is not a result.
/// - If an argument is wrong.
/// - If the field or component is missing.
/// - If a picture cannot be written.
pub fn plot(arguments: &PlotArguments, result: &Path, verbosity: Verbosity) -> Result<()> {
    let file = result_file(result);
    let result = ResultReader::open(&file)?;
    let times = result.times()?;
    let chosen = choose_times(&arguments.time, &file, &times)?;
    let last = chosen.last().copied().unwrap_or(0);
    let painter = Painter::new(&arguments.picture, &file, &result, last)?;
    let path = match &arguments.output {
        Some(path) => path.clone(),
        None => beside(&file, &format!("{}.png", painter.name())),
    };
    painter.check(&chosen)?;
    check_png(&path)?;
    for index in &chosen {
        let path = match chosen.len() {
            1 => path.clone(),
            _ => numbered(&path, *index),
        };
        let image = painter.image(*index, &si(times[*index], "s"), None)?;
        image
            .write_png(&path)
            .map_err(|error| Error::file(&path, "write", &error))?;
        if verbosity > Verbosity::Quiet {
            let (time, what) = (si(times[*index], "s"), &painter.quantity.label);
            outln!("wrote {}: {what} at t = {time}", path.display());
        }
    }
    Ok(())
}

/// Check that the name of a picture ends in .png.
///
/// # Errors
/// If the name has another ending.
pub fn check_png(path: &Path) -> Result<()> {
    let hint = "; `--y` draws curves, and `fissure movie` films";
    check_ending(path, &["png"], hint)
}

/// Return the error for a result in which no output has points.
pub fn nothing_to_draw(file: &Path) -> Error {
    let message = format!("{}: no output has points to draw", file.display());
    Error::input(message)
}

/// Return the path of the file `name` in the folder of a result. For a further result, such as
/// `result_edge.vtkhdf`, `result_edge_` is put before the name. No field name starts with `result_`, so the
/// names are unique.
pub fn beside(result: &Path, name: &str) -> PathBuf {
    let stem = result.file_stem().unwrap_or_default().to_string_lossy();
    let further = if stem.starts_with("result_") {
        format!("{stem}_")
    } else {
        String::new()
    };
    result.with_file_name(format!("{further}{name}"))
}

/// Insert the index of an output into a file name: `name.png` becomes `name_0012.png`.
fn numbered(path: &Path, index: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}_{index:04}.png"))
}
