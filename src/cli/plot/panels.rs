//! Pictures of several outputs or results side by side.

use std::path::PathBuf;

use fissure::error::{Error, Result};
use fissure::output::ResultReader;
use fissure::picture::Image;

use super::choice::choose_times;
use super::limits::Frame;
use super::painter::Painter;
use super::picture::{LEAST_WIDTH, PictureArguments, beside, check_png, nothing_to_draw};
use super::{PlotArguments, Verbosity};
use crate::cli::format::si;
use crate::cli::{outln, result_file};

/// Draw the requested outputs of each result side by side, with the same axes and range of colours.
///
/// # Errors
/// If a file is not a result, an argument is wrong, or a result lacks the field. If the results differ in
/// their dimension or drawn quantity, or if no point is drawn. If the picture is too narrow or cannot be
/// written.
pub fn plot(arguments: &PlotArguments, results: &[PathBuf], verbosity: Verbosity) -> Result<()> {
    if arguments.time == "all" {
        let message = "--time all: writes a picture of each output of one result; of several results, \
                       name the times, such as --time 1e-5,last";
        return Err(Error::input(message));
    }
    let files: Vec<PathBuf> = results.iter().map(|result| result_file(result)).collect();
    let readers: Vec<ResultReader> = (files.iter())
        .map(|file| ResultReader::open(file))
        .collect::<Result<_>>()?;
    let times: Vec<Vec<f64>> = readers
        .iter()
        .map(ResultReader::times)
        .collect::<Result<_>>()?;
    let chosen: Vec<Vec<usize>> = (times.iter().zip(&files))
        .map(|(times, file)| choose_times(&arguments.time, file, times))
        .collect::<Result<_>>()?;
    let count = chosen.iter().map(Vec::len).sum::<usize>() as u32;
    let width = arguments.picture.width / count;
    if width < LEAST_WIDTH {
        let least = LEAST_WIDTH * count;
        let message =
            format!("--width: must be at least {least} for {count} pictures side by side");
        return Err(Error::input(message));
    }
    let panel = PictureArguments {
        width,
        ..arguments.picture.clone()
    };
    let mut painters = Vec::new();
    let inputs = results.iter().zip(&files).zip(&readers).zip(&chosen);
    for (((name, file), reader), chosen) in inputs {
        let reference = chosen.iter().copied().max().unwrap_or(0);
        let mut painter = Painter::new(&panel, file, reader, reference)?;
        if files.len() > 1 {
            painter.title = name.display().to_string();
        }
        painter.check(chosen)?;
        painters.push(painter);
    }
    check_alike(&painters)?;
    share_factor(&mut painters);
    let path = match &arguments.output {
        Some(path) => path.clone(),
        None => beside(&files[0], &format!("{}_panels.png", painters[0].name())),
    };
    check_png(&path)?;
    let panels = || {
        let outputs = painters.iter().zip(&chosen).zip(&times);
        outputs.flat_map(|((painter, chosen), times)| {
            chosen
                .iter()
                .map(move |index| (painter, *index, times[*index]))
        })
    };
    let frames = panels().map(|(painter, index, _)| painter.frame(index));
    let frame = Frame::of_all(frames)?.ok_or_else(|| nothing_to_draw(&files[0]))?;
    let images =
        panels().map(|(painter, index, time)| painter.image(index, &si(time, "s"), Some(&frame)));
    let images: Vec<Image> = images.collect::<Result<_>>()?;
    Image::row(&images)
        .write_png(&path)
        .map_err(|error| Error::file(&path, "write", &error))?;
    if verbosity > Verbosity::Quiet {
        let label = &painters[0].quantity.label;
        outln!("wrote {}: {count} pictures of {label}", path.display());
    }
    Ok(())
}

/// Check that all results have the same dimension and drawn quantity.
fn check_alike(painters: &[Painter]) -> Result<()> {
    let (label, dimension) = (painters[0].quantity.label.clone(), painters[0].dimension);
    if let Some(other) = (painters.iter()).find(|painter| painter.quantity.label != label) {
        let message = format!(
            "the first result would show {label}, another one {}; name a field that all have with --field",
            other.quantity.label
        );
        return Err(Error::input(message));
    }
    if painters
        .iter()
        .any(|painter| painter.dimension != dimension)
    {
        let message = "pictures side by side need results of the same dimension";
        return Err(Error::input(message));
    }
    Ok(())
}

/// Set the factor on the drawn displacements to the same value for all results. This value is the smallest
/// factor of the results that have displacements.
fn share_factor(painters: &mut [Painter]) {
    let displaced = painters.iter().filter(|painter| painter.is_displaced);
    let factors = displaced.map(|painter| painter.factor);
    if let Some(smallest) = factors.min_by(f64::total_cmp) {
        painters
            .iter_mut()
            .for_each(|painter| painter.factor = smallest);
    }
}
