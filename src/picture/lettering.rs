//! Smooth text from fonts embedded in the program.

use super::canvas::{Colour, Image};
use ab_glyph::{Font, FontRef, Glyph, GlyphId, PxScale, ScaleFont, point};

/// Height of capital letters and digits as a fraction of the text size.
pub const CAPITAL_HEIGHT: f64 = 0.69;

/// The direction in which text runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Running {
    /// From left to right.
    Across,
    /// From bottom to top, as along a vertical axis.
    Upwards,
}

/// The fonts: a proportional font, and a font for characters that the first font lacks.
pub struct Lettering {
    fonts: [FontRef<'static>; 2],
}

impl Lettering {
    /// Open the embedded fonts.
    pub fn new() -> Self {
        let open = |bytes| FontRef::try_from_slice(bytes).expect("embedded fonts are readable");
        Self {
            fonts: [
                open(epaint_default_fonts::UBUNTU_LIGHT),
                open(epaint_default_fonts::HACK_REGULAR),
            ],
        }
    }

    /// Return the first font that has the character. If no font has the character, return the last font,
    /// which draws the sign for missing characters.
    fn font_of(&self, character: char) -> &FontRef<'static> {
        let [usual, substitute] = &self.fonts;
        if usual.glyph_id(character) == GlyphId(0) {
            substitute
        } else {
            usual
        }
    }

    /// Place the characters of `text` on a baseline that starts at the origin; `size` is in pixels. Return
    /// the characters with their fonts, and the length of the line in pixels.
    fn place(&self, text: &str, size: f64) -> (Vec<(Glyph, &FontRef<'static>)>, f64) {
        let mut glyphs = Vec::new();
        let mut cursor = 0.0;
        let mut previous: Option<(GlyphId, &FontRef<'static>)> = None;
        for character in text.chars() {
            let font = self.font_of(character);
            let em = font.units_per_em().unwrap_or(1000.0);
            let scale = PxScale::from(size as f32 * font.height_unscaled() / em);
            let scaled = font.as_scaled(scale);
            let id = font.glyph_id(character);
            if let Some((before, same)) = previous
                && std::ptr::eq(same, font)
            {
                cursor += scaled.kern(before, id);
            }
            glyphs.push((id.with_scale_and_position(scale, point(cursor, 0.0)), font));
            cursor += scaled.h_advance(id);
            previous = Some((id, font));
        }
        (glyphs, f64::from(cursor))
    }

    /// Return the length of a line of text, pixels. `size` is the text size, pixels.
    pub fn length(&self, text: &str, size: f64) -> f64 {
        self.place(text, size).1
    }

    /// Draw a line of text. The middle of the line, at half the height of capital letters, is at `centre`.
    pub fn draw(
        &self,
        image: &mut Image,
        text: &str,
        size: f64,
        centre: [f64; 2],
        running: Running,
        colour: Colour,
    ) {
        let (glyphs, length) = self.place(text, size);
        let back = length / 2.0;
        let down = CAPITAL_HEIGHT * size / 2.0;
        // Round the origin to a whole pixel, so that the baselines of all labels are equally sharp.
        let [column, row] = match running {
            Running::Across => [centre[0] - back, centre[1] + down],
            Running::Upwards => [centre[0] + down, centre[1] + back],
        }
        .map(|coordinate| coordinate.round() as i64);
        for (glyph, font) in glyphs {
            let Some(outline) = font.outline_glyph(glyph) else {
                continue;
            };
            let corner = outline.px_bounds().min;
            outline.draw(|x, y, coverage| {
                let along = corner.x as i64 + i64::from(x);
                let below = corner.y as i64 + i64::from(y);
                let (column, row) = match running {
                    Running::Across => (column + along, row + below),
                    Running::Upwards => (column + below, row - 1 - along),
                };
                // The fonts are light, so increase the coverage by a gamma curve.
                let weight = f64::from(coverage).powf(0.7);
                image.blend(column, row, weight, colour);
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::canvas::INK;
    use super::*;

    #[test]
    fn every_needed_character_is_in_a_font() {
        let lettering = Lettering::new();
        let needed = "azAZ09.,:;()[]/%=+-−×·°µ²³⁰¹⁴⁵⁶⁷⁸⁹⁻αβγδεθκλνρσςτφωΔΣΩ√≤≥±_";
        for character in needed.chars() {
            let id = lettering.font_of(character).glyph_id(character);
            assert_ne!(id, GlyphId(0), "{character} is missing");
        }
    }

    /// Return the first and last column and the first and last row that contain dark pixels.
    fn inked(image: &Image) -> [u32; 4] {
        let dark: Vec<(u32, u32)> = (0..image.height)
            .flat_map(|row| (0..image.width).map(move |column| (column, row)))
            .filter(|(column, row)| image.pixel(*column, *row)[0] < 128)
            .collect();
        let columns = || dark.iter().map(|place| place.0);
        let rows = || dark.iter().map(|place| place.1);
        [
            columns().min().unwrap(),
            columns().max().unwrap(),
            rows().min().unwrap(),
            rows().max().unwrap(),
        ]
    }

    #[test]
    fn text_is_centred_in_both_directions() {
        let lettering = Lettering::new();
        for running in [Running::Across, Running::Upwards] {
            let mut image = Image::new(301, 301);
            lettering.draw(&mut image, "HEIGH", 40.0, [150.0, 150.0], running, INK);
            let [left, right, top, bottom] = inked(&image);
            assert!((left + right).abs_diff(300) <= 6, "{left} {right}");
            assert!((top + bottom).abs_diff(300) <= 6, "{top} {bottom}");
            assert_eq!(right - left > bottom - top, running == Running::Across);
        }
    }

    #[test]
    fn length_grows_with_the_size() {
        let lettering = Lettering::new();
        let ratio = lettering.length("0.25", 40.0) / lettering.length("0.25", 10.0);
        assert!((ratio - 4.0).abs() < 0.01);
        assert_eq!(lettering.length("", 10.0), 0.0);
    }
}
