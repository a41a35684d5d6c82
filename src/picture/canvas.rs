//! The pixel raster of a picture, and its PNG file.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// A colour as red, green and blue bytes (sRGB).
pub type Colour = [u8; 3];

/// Colour of frames, ticks and letters.
pub const INK: Colour = [38, 38, 42];

/// Colour of auxiliary lines, which must not distract from the data.
pub const PALE_INK: Colour = [176, 176, 182];

/// A finished picture: rows from top to bottom, three bytes per pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Red, green and blue of each pixel; `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

impl Image {
    /// Create a white picture of the given size, in pixels.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            rgb: vec![255; 3 * width as usize * height as usize],
        }
    }

    /// Write the picture as an eight-bit RGB PNG file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_png(&self, path: &Path) -> std::io::Result<()> {
        let mut encoder =
            png::Encoder::new(BufWriter::new(File::create(path)?), self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        Ok(writer.finish()?)
    }

    /// Join pictures side by side. The space below shorter pictures is white.
    pub fn row(images: &[Self]) -> Self {
        let height = images.iter().map(|image| image.height).max().unwrap_or(0);
        let mut joined = Self::new(images.iter().map(|image| image.width).sum(), height);
        let mut left = 0;
        for image in images {
            let bytes = 3 * image.width as usize;
            let rows = joined.rgb.chunks_exact_mut(3 * joined.width as usize);
            for (row, own) in rows.zip(image.rgb.chunks_exact(bytes)) {
                row[left..left + bytes].copy_from_slice(own);
            }
            left += bytes;
        }
        joined
    }

    /// Return the colour of the pixel in `column` and `row`.
    ///
    /// # Panics
    ///
    /// If the pixel lies outside the picture.
    pub fn pixel(&self, column: u32, row: u32) -> Colour {
        assert!(column < self.width && row < self.height);
        let start = 3 * (row as usize * self.width as usize + column as usize);
        [self.rgb[start], self.rgb[start + 1], self.rgb[start + 2]]
    }

    /// Fill the pixels of columns `left..right` and rows `top..bottom` that lie inside the picture.
    pub fn fill_rectangle(&mut self, [left, right]: [i64; 2], rows: [i64; 2], colour: Colour) {
        let left = left.clamp(0, i64::from(self.width)) as usize;
        let right = right.clamp(0, i64::from(self.width)) as usize;
        if left >= right {
            return;
        }
        let top = rows[0].clamp(0, i64::from(self.height)) as usize;
        let bottom = rows[1].clamp(0, i64::from(self.height)) as usize;
        for row in top..bottom {
            let start = row * self.width as usize;
            let span = &mut self.rgb[3 * (start + left)..3 * (start + right)];
            for pixel in span.chunks_exact_mut(3) {
                pixel.copy_from_slice(&colour);
            }
        }
    }

    /// Fill the pixels whose centres lie inside a convex polygon.
    ///
    /// Centres on a left or upper edge belong to the polygon, centres on a right or lower edge do not.
    /// Polygons that share an edge therefore share no pixel.
    pub fn fill_polygon(&mut self, corners: &[[f64; 2]], colour: Colour) {
        for (row, columns) in spans(corners, i64::from(self.height)) {
            self.fill_rectangle(columns, [row, row + 1], colour);
        }
    }

    /// Draw a straight line. A line along a row or a column covers whole pixels. Any other line is
    /// antialiased.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], thickness: f64, colour: Colour) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        if along[0] == 0.0 || along[1] == 0.0 {
            let [columns, rows] = [0, 1].map(|axis| {
                let whole = thickness.round().max(1.0);
                let low = (from[axis].min(to[axis]) - whole / 2.0).round();
                [low as i64, (low + along[axis].abs().round() + whole) as i64]
            });
            self.fill_rectangle(columns, rows, colour);
            return;
        }
        let reach = thickness / 2.0 + 1.0;
        let [columns, rows] = [0, 1].map(|axis| {
            let low = from[axis].min(to[axis]) - reach;
            low.floor() as i64..(low + along[axis].abs() + 2.0 * reach).ceil() as i64
        });
        for row in rows {
            for column in columns.clone() {
                let offset = [column as f64 + 0.5 - from[0], row as f64 + 0.5 - from[1]];
                let part = (offset[0] * along[0] + offset[1] * along[1]) / (length * length);
                let part = part.clamp(0.0, 1.0);
                let distance = (offset[0] - part * along[0]).hypot(offset[1] - part * along[1]);
                self.blend(column, row, thickness / 2.0 + 0.5 - distance, colour);
            }
        }
    }

    /// Blend `colour` into one pixel. `coverage` is the weight of the colour, and is clamped to the range
    /// from 0 to 1.
    pub fn blend(&mut self, column: i64, row: i64, coverage: f64, colour: Colour) {
        let inside = (0..i64::from(self.width)).contains(&column)
            && (0..i64::from(self.height)).contains(&row);
        if !inside || coverage <= 0.0 {
            return;
        }
        let share = coverage.min(1.0);
        let start = 3 * (row as usize * self.width as usize + column as usize);
        for (under, over) in self.rgb[start..start + 3].iter_mut().zip(colour) {
            *under = (f64::from(*under) * (1.0 - share) + f64::from(over) * share).round() as u8;
        }
    }
}

/// Return the part of a straight line that lies inside a rectangle. Return `None` if no part lies inside, or
/// if an end of the line is not finite.
pub fn clipped(
    from: [f64; 2],
    to: [f64; 2],
    columns: [f64; 2],
    rows: [f64; 2],
) -> Option<[[f64; 2]; 2]> {
    if !from.iter().chain(&to).all(|end| end.is_finite()) {
        return None;
    }
    // The part of the line that is inside, as fractions of the line.
    let mut inside = [0.0_f64, 1.0];
    for (axis, [low, high]) in [columns, rows].into_iter().enumerate() {
        let along = to[axis] - from[axis];
        if along == 0.0 {
            if !(low..=high).contains(&from[axis]) {
                return None;
            }
            continue;
        }
        let crossings = [low, high].map(|edge| (edge - from[axis]) / along);
        inside[0] = inside[0].max(crossings[0].min(crossings[1]));
        inside[1] = inside[1].min(crossings[0].max(crossings[1]));
    }
    let end = |fraction: f64| [0, 1].map(|axis| from[axis] + fraction * (to[axis] - from[axis]));
    (inside[0] <= inside[1]).then(|| inside.map(end))
}

/// Return the pixel rows that a convex polygon covers in a picture of the given height (pixels). For each
/// row, also return the first column of the polygon and the first column after the polygon.
/// [`Image::fill_polygon`] defines which pixels belong to a polygon.
pub fn spans(corners: &[[f64; 2]], height: i64) -> impl Iterator<Item = (i64, [i64; 2])> + '_ {
    let (top, bottom) = extremes(corners.iter().map(|corner| corner[1]));
    let rows = first_centre(top).max(0)..first_centre(bottom).min(height);
    rows.filter_map(|row| {
        let centre = row as f64 + 0.5;
        let crossings = corners
            .iter()
            .zip(corners.iter().cycle().skip(1))
            .filter(|(from, to)| (from[1] <= centre) != (to[1] <= centre))
            .map(|(from, to)| from[0] + (centre - from[1]) / (to[1] - from[1]) * (to[0] - from[0]));
        let (left, right) = extremes(crossings);
        (left <= right).then(|| (row, [first_centre(left), first_centre(right)]))
    })
}

/// Return the first row or column whose pixel centres are at `edge` or after it.
fn first_centre(edge: f64) -> i64 {
    (edge - 0.5).ceil() as i64
}

/// Return the smallest and largest of some numbers; (∞, −∞) if there are none.
fn extremes(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), number| {
        (low.min(number), high.max(number))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Colour = [255, 0, 0];

    fn red_pixels(image: &Image) -> usize {
        image.rgb.chunks(3).filter(|pixel| **pixel == RED).count()
    }

    #[test]
    fn lines_are_clipped_to_a_rectangle() {
        let clip = |from, to| clipped(from, to, [10.0, 30.0], [0.0, 20.0]);
        assert_eq!(
            clip([12.0, 5.0], [28.0, 7.0]),
            Some([[12.0, 5.0], [28.0, 7.0]])
        );
        assert_eq!(
            clip([20.0, 5.0], [1020.0, 5.0]),
            Some([[20.0, 5.0], [30.0, 5.0]])
        );
        assert_eq!(
            clip([0.0, -10.0], [40.0, 30.0]),
            Some([[10.0, 0.0], [30.0, 20.0]])
        );
        assert_eq!(clip([0.0, 5.0], [9.0, 5.0]), None);
        assert_eq!(clip([20.0, 21.0], [25.0, 21.0]), None);
        assert_eq!(clip([5.0, 15.0], [20.0, 45.0]), None);
        assert_eq!(clip([20.0, 5.0], [f64::NAN, 5.0]), None);
    }

    #[test]
    fn rectangles_are_clipped_to_the_picture() {
        let mut image = Image::new(10, 5);
        image.fill_rectangle([-3, 2], [4, 99], RED);
        assert_eq!(red_pixels(&image), 2);
        assert_eq!(image.pixel(0, 4), RED);
        image.fill_rectangle([12, 20], [0, 5], RED);
        assert_eq!(red_pixels(&image), 2);
    }

    #[test]
    fn polygons_that_share_an_edge_share_no_pixel_and_leave_no_gap() {
        let mut image = Image::new(20, 20);
        image.fill_polygon(&[[2.5, 2.5], [14.5, 2.5], [2.5, 14.5]], RED);
        let first = red_pixels(&image);
        let mut other = Image::new(20, 20);
        other.fill_polygon(&[[14.5, 2.5], [14.5, 14.5], [2.5, 14.5]], RED);
        let second = red_pixels(&other);
        image.fill_polygon(&[[14.5, 2.5], [14.5, 14.5], [2.5, 14.5]], RED);
        assert_eq!(red_pixels(&image), first + second);
        assert_eq!(first + second, 144);
    }

    #[test]
    fn lines_have_the_asked_thickness() {
        let mut image = Image::new(20, 20);
        image.line([5.0, 10.0], [15.0, 10.0], 2.0, RED);
        assert_eq!(red_pixels(&image), 24);
        let mut image = Image::new(20, 20);
        image.line([2.0, 2.0], [18.0, 18.0], 3.0, RED);
        assert_eq!(image.pixel(10, 10), RED);
        assert_eq!(image.pixel(10, 15), [255; 3]);
    }

    #[test]
    fn png_file_holds_the_pixels() {
        let mut image = Image::new(7, 3);
        image.fill_rectangle([1, 3], [1, 2], RED);
        let name = format!("picture_canvas_{}.png", std::process::id());
        let path = std::env::temp_dir().join(name);
        image.write_png(&path).unwrap();
        let file = std::io::BufReader::new(File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let information = reader.next_frame(&mut bytes).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!((information.width, information.height), (7, 3));
        assert_eq!(bytes, image.rgb);
    }
}
