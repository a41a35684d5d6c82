//! `fissure movie`: an animated picture of a result.

use std::path::{Path, PathBuf};

use clap::Args;
use fissure::error::{Error, Result};
use fissure::output::ResultReader;
use fissure::picture::Image;
use fissure::picture::film::Film;

use super::plot::check_ending;
use super::plot::limits::Frame;
use super::plot::painter::Painter;
use super::plot::picture::{PictureArguments, beside, nothing_to_draw};
use super::progress::Progress;
use super::{Verbosity, outln, result_file, without_output};

/// Draw a field over time as an animated PNG, for browsers and presentations.
///
/// All frames have the same axes, size and range of colours.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure movie out/plate                                   the damage over all outputs
  fissure movie out/plate --field velocity --component y --range -5,5
  fissure movie out/block --slice z=0.005 --every 2 --rate 20 -o block.png
  fissure movie out/plate --frames frames                   for ffmpeg:
  ffmpeg -framerate 10 -i frames/frame_%04d.png -pix_fmt yuv420p plate.mp4")]
pub struct MovieArguments {
    /// Result: a .vtkhdf file or its folder.
    result: PathBuf,

    #[command(flatten)]
    picture: PictureArguments,

    /// Draw only every N-th output.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,

    /// Frames per second.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=100))]
    rate: u16,

    /// Path of the film, .png or .apng [default: in the folder of the result, named after the field and
    /// component, such as stress_xx_movie.png].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Write the frames as PNG files frame_0000.png, … to a new or empty folder, instead of a film.
    #[arg(long, value_name = "DIR", conflicts_with = "output")]
    frames: Option<PathBuf>,
}

/// Draw the film of a result, or its frames as separate files.
///
/// # Errors
/// - If the file is not a result or has no output.
/// - If an argument is wrong.
/// - If the field or component is missing.
/// - If no point is drawn.
/// - If a file cannot be written.
pub fn movie(arguments: &MovieArguments, verbosity: Verbosity) -> Result<()> {
    let file = result_file(&arguments.result);
    let result = ResultReader::open(&file)?;
    let times = result.times()?;
    let Some(last) = times.len().checked_sub(1) else {
        return Err(without_output(&file));
    };
    let chosen: Vec<usize> = (0..=last).step_by(arguments.every as usize).collect();
    let painter = Painter::new(&arguments.picture, &file, &result, last)?;
    let path = match &arguments.output {
        Some(path) => path.clone(),
        None => beside(&file, &format!("{}_movie.png", painter.name())),
    };
    let hint = " (an animated PNG); for other formats, write --frames and encode them with ffmpeg";
    check_ending(&path, &["png", "apng"], hint)?;
    painter.check(&chosen)?;
    if let Some(folder) = &arguments.frames {
        create_folder(folder)?;
    }
    // Each output is read twice: first to find the common settings of all frames, then to draw a frame.
    let count = chosen.len() as u64;
    let mut progress = Progress::new(verbosity > Verbosity::Quiet, "frame", 0, 2 * count);
    let frames = (1..).zip(&chosen).map(|(number, index)| {
        let frame = painter.frame(*index);
        progress.update(number, 2 * count, times[*index]);
        frame
    });
    let frame = Frame::of_all(frames)?.ok_or_else(|| nothing_to_draw(&file))?;
    let clock = Clock::new(times[last]);
    let draw = |index: usize| -> Result<Image> {
        let image = painter.image(index, &clock.time(times[index]), Some(&frame))?;
        Ok(image.even())
    };
    let mut film = match &arguments.frames {
        Some(_) => None,
        None => {
            let film = Film::create(&path, &draw(chosen[0])?, count as u32, arguments.rate);
            Some(film.map_err(|error| Error::file(&path, "write", &error))?)
        }
    };
    for (number, index) in chosen.iter().enumerate() {
        let image = draw(*index)?;
        if let Some(film) = &mut film {
            let written = film.append(&image);
            written.map_err(|error| Error::file(&path, "write", &error))?;
        }
        if let Some(folder) = &arguments.frames {
            let path = folder.join(format!("frame_{number:04}.png"));
            let written = image.write_png(&path);
            written.map_err(|error| Error::file(&path, "write", &error))?;
        }
        progress.update(count + number as u64 + 1, 2 * count, times[*index]);
    }
    if let Some(film) = film {
        let written = film.finish();
        written.map_err(|error| Error::file(&path, "write", &error))?;
    }
    progress.finish(true);
    if verbosity > Verbosity::Quiet {
        let label = &painter.quantity.label;
        match &arguments.frames {
            Some(folder) => outln!("wrote {count} frames of {label} to {}", folder.display()),
            None => {
                let (path, rate) = (path.display(), arguments.rate);
                outln!("wrote {path}: {count} frames of {label}, {rate} a second");
            }
        }
    }
    Ok(())
}

/// Create the folder of the frames; an existing folder must be empty.
fn create_folder(folder: &Path) -> Result<()> {
    let created = std::fs::create_dir_all(folder).and_then(|()| std::fs::read_dir(folder));
    let mut entries = created.map_err(|error| Error::file(folder, "create", &error))?;
    if entries.next().is_some() {
        return Err(Error::input(format!(
            "--frames {}: the folder is not empty; name a new one",
            folder.display()
        )));
    }
    Ok(())
}

/// Format of times: one unit and one number of decimals for all frames.
struct Clock {
    factor: f64,
    unit: &'static str,
}

impl Clock {
    fn new(last: f64) -> Self {
        const UNITS: [(f64, &str); 5] = [
            (1.0, "s"),
            (1e3, "ms"),
            (1e6, "µs"),
            (1e9, "ns"),
            (1e12, "ps"),
        ];
        let suits = |(factor, _): &(f64, &str)| last.abs() * factor >= 1.0;
        let (factor, unit) = UNITS.into_iter().find(suits).unwrap_or(UNITS[0]);
        Self { factor, unit }
    }

    fn time(&self, time: f64) -> String {
        format!("{:.2} {}", time * self.factor, self.unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_film_have_one_unit() {
        let clock = Clock::new(4e-5);
        assert_eq!(clock.time(0.0), "0.00 µs");
        assert_eq!(clock.time(4e-7), "0.40 µs");
        assert_eq!(clock.time(4e-5), "40.00 µs");
        assert_eq!(Clock::new(0.0).time(0.0), "0.00 s");
    }
}
