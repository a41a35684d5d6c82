//! Animated PNG files, for browsers and presentations.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use super::canvas::Image;

/// An animated PNG file that is written frame by frame and repeats without end.
pub struct Film {
    writer: png::Writer<BufWriter<File>>,
}

impl Film {
    /// Create the file of a film with `frames` frames. All frames have the size of `first`, and each frame is
    /// shown for 1/`rate` s. No frame is written yet.
    ///
    /// # Errors
    /// If the file cannot be written, or `frames` is 0.
    pub fn create(path: &Path, first: &Image, frames: u32, rate: u16) -> std::io::Result<Self> {
        let file = BufWriter::new(File::create(path)?);
        let mut encoder = png::Encoder::new(file, first.width, first.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_animated(frames, 0)?;
        encoder.set_frame_delay(1, rate)?;
        encoder.validate_sequence(true);
        let writer = encoder.write_header()?;
        Ok(Self { writer })
    }

    /// Append a frame.
    ///
    /// # Errors
    /// If the file cannot be written, if the frame has another number of pixels than the first frame, or if
    /// all frames of the film have already been appended.
    pub fn append(&mut self, frame: &Image) -> std::io::Result<()> {
        Ok(self.writer.write_image_data(&frame.rgb)?)
    }

    /// End the film after its last frame.
    ///
    /// # Errors
    /// If the file cannot be written, or frames are missing.
    pub fn finish(self) -> std::io::Result<()> {
        Ok(self.writer.finish()?)
    }
}

impl Image {
    /// Add a white row or column if the height or width is odd, because video encoders need even sizes.
    pub fn even(self) -> Self {
        let mut even = Self::new(
            self.width.next_multiple_of(2),
            self.height.next_multiple_of(2),
        );
        let rows = self.rgb.chunks_exact(3 * self.width as usize);
        for (row, whole) in rows.zip(even.rgb.chunks_exact_mut(3 * even.width as usize)) {
            whole[..row.len()].copy_from_slice(row);
        }
        even
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_read_back_in_their_order() {
        let frame = |colour| {
            let mut image = Image::new(3, 5);
            image.fill_rectangle([0, 3], [0, 5], [colour; 3]);
            image.even()
        };
        let path = std::env::temp_dir().join(format!("picture_film_{}.png", std::process::id()));
        let mut film = Film::create(&path, &frame(0), 3, 20).unwrap();
        for colour in [10, 20, 30] {
            film.append(&frame(colour)).unwrap();
        }
        film.finish().unwrap();
        let file = std::io::BufReader::new(File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let control = *reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        for colour in [10, 20, 30] {
            let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
            let frame = reader.next_frame(&mut bytes).unwrap();
            assert_eq!((frame.width, frame.height), (4, 6));
            assert_eq!(
                bytes[..12],
                [
                    colour, colour, colour, colour, colour, colour, colour, colour, colour, 255,
                    255, 255
                ]
            );
            let control = reader.info().frame_control().unwrap();
            assert_eq!((control.delay_num, control.delay_den), (1, 20));
        }
        std::fs::remove_file(&path).unwrap();
    }
}
