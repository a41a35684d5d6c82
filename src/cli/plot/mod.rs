//! `fissure plot`: a picture of a field, or curves of the history.

mod absence;
mod choice;
mod chunks;
pub mod curves;
mod difference;
mod filter;
pub mod limits;
mod overlays;
pub mod painter;
mod panels;
mod paths;
pub mod picture;
mod quantity;

use std::path::{Path, PathBuf};

use clap::Args;
use fissure::error::{Error, Result};

use super::Verbosity;
use picture::PictureArguments;

/// Draw a field of a result, or curves of a history.
///
/// Draws a plane body in its plane. Draws a solid in the view of a camera, or as a slice. With `--y`, draws
/// columns of histories or of CSV files as curves.
#[derive(Args)]
#[command(after_help = "\
Examples, fields:
  fissure plot out/plate                                        the damage at the end
  fissure plot out/plate --field stress --component xx --time 25e-6
  fissure plot out/plate --field stress --component principal_1 --range 0,50e6
  fissure plot out/plate --time all -o frames.png               frames_0000.png, …
  fissure plot out/plate --time 1e-5,2e-5,last                  three times side by side
  fissure plot out/a out/b --field velocity                     two results side by side
  fissure plot out/a --minus out/b --field velocity             difference of two results
  fissure plot out/block --slice z=0.005 --deform 0
  fissure plot out/block --clip 'y>0.002' --camera -70,20
  fissure plot out/plate --field velocity --log --colors turbo --vectors velocity
  fissure plot out/plate --path out/plate/crack_main.csv

Examples, curves:
  fissure plot out/plate/history.csv --y kinetic_energy,strain_energy -o energies.svg
  fissure plot out/a out/b out/c --x probe_u_y --y reaction_top_y")]
pub struct PlotArguments {
    /// Result: a .vtkhdf file or its folder; for curves also a CSV file. Fields of several results are drawn
    /// side by side.
    #[arg(required = true, value_name = "RESULT")]
    results: Vec<PathBuf>,

    #[command(flatten)]
    picture: PictureArguments,

    /// Draw the output that is nearest to the time T (s), or the `last` output. `all` draws each output as a
    /// separate picture. If several times are given, separated by commas, their outputs are drawn side by
    /// side in one picture.
    #[arg(
        short,
        long,
        value_name = "T,…",
        default_value = "last",
        allow_hyphen_values = true
    )]
    time: String,

    /// Columns of the history to draw as curves.
    #[arg(long, value_name = "COLUMN,…", value_delimiter = ',')]
    #[arg(conflicts_with_all = ["field", "component", "deform", "slice", "path", "range", "time", "colors", "log", "threshold", "threshold_field", "clip", "camera", "contours", "vectors", "minus"])]
    y: Vec<String>,

    /// Column of the horizontal axis of curves [default: time].
    #[arg(long, value_name = "COLUMN")]
    x: Option<String>,

    /// Path of the picture: .png, for curves also .svg [default: in the folder of the result, named after the
    /// field and component; for curves, named after the columns].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Draw one picture of a field, several pictures side by side, or curves.
///
/// # Errors
/// - If a file is not a result.
/// - If an argument is wrong.
/// - If the field, component or column is missing.
/// - If a picture cannot be written.
pub fn plot(arguments: &PlotArguments, verbosity: Verbosity) -> Result<()> {
    let is_table = |path: &PathBuf| curves::is_csv(path);
    let curves = !arguments.y.is_empty() || arguments.results.iter().any(is_table);
    if curves {
        return curves::plot(arguments, verbosity);
    }
    if arguments.x.is_some() {
        let message = "--x is for curves; name the other columns with --y COLUMN,COLUMN";
        return Err(Error::input(message));
    }
    match &arguments.results[..] {
        [result] if !arguments.time.contains(',') => picture::plot(arguments, result, verbosity),
        results => panels::plot(arguments, results, verbosity),
    }
}

/// Check that the name of an output file ends in one of the endings `known`. `hint` is appended to the error
/// message.
///
/// # Errors
/// If the ending is not in `known`.
pub fn check_ending(path: &Path, known: &[&str], hint: &str) -> Result<()> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    if known.iter().any(|known| ending.eq_ignore_ascii_case(known)) {
        return Ok(());
    }
    let known: Vec<String> = known.iter().map(|known| format!(".{known}")).collect();
    Err(Error::input(format!(
        "-o {}: the file must end in {}{hint}",
        path.display(),
        known.join(" or "),
    )))
}
