//! Colours of vertices, which are no part of the format: `v x y z r g b`, as scans have them, and ZBrush's comments `#MRGB`.

/// Floats a little above 1 are rounding, and no sign of another scale.
const ABOUT_ONE: f32 = 1.01;
/// Fractions up to this are light beyond white; larger ones are codes that somebody has averaged.
const MOST_LIGHT: f32 = 16.0;

/// The colours of a file's vertices as they are written.
#[derive(Debug, Default)]
pub(super) struct Colors {
    /// Red, green and blue behind a weight of 1, or four numbers; none for a vertex without.
    written: Vec<Option<[f32; 4]>>,
    /// Vertices that polypaint has coloured so far.
    painted: usize,
    /// Colours with a number that is none.
    pub odd: usize,
}

impl Colors {
    pub fn is_empty(&self) -> bool {
        self.written.is_empty()
    }

    /// Sets the colour of a vertex, counted from 0. Words behind a vertex's place are three for its colour, or four with a weight before or
    /// an opacity behind.
    pub fn set(&mut self, vertex: usize, words: &[&str]) {
        let mut numbers = [1.0; 4];
        let own = match words.len() {
            3 => &mut numbers[1..],
            _ => &mut numbers[..],
        };
        for (number, word) in own.iter_mut().zip(words) {
            *number = word.parse().unwrap_or(f32::NAN);
        }
        let is_whole = numbers.iter().all(|number| number.is_finite());
        self.odd += usize::from(!is_whole);
        self.put(vertex, is_whole.then_some(numbers));
    }

    fn put(&mut self, vertex: usize, color: Option<[f32; 4]>) {
        self.written.resize(self.written.len().max(vertex + 1), None);
        self.written[vertex] = color;
    }

    /// Takes a line of polypaint: eight hexadecimal digits a vertex (mask, red, green, blue), going on with the vertices where the last stopped.
    pub fn paint(&mut self, digits: &str) {
        for code in digits.trim().as_bytes().chunks_exact(8) {
            let code = std::str::from_utf8(code).ok().and_then(|code| u32::from_str_radix(code, 16).ok());
            let Some([_, rgb @ ..]) = code.map(u32::to_be_bytes) else { return };
            let [red, green, blue] = rgb.map(|channel| f32::from(channel) / 255.0);
            self.put(self.painted, Some([1.0, red, green, blue]));
            self.painted += 1;
        }
    }

    /// The colours of `count` vertices, sRGB from 0 to 1, and warnings. White where a vertex has none.
    pub fn decided(mut self, count: usize) -> (Vec<[f32; 3]>, Vec<String>) {
        let colored = self.written.iter().take(count).flatten().count();
        let without = count.saturating_sub(colored + self.odd);
        self.written.resize(count, None);
        let four = || self.written.iter().flatten();
        // A weight is 1 everywhere. Where it is not, and the last number is, that is the opacity.
        let (has_weights, is_opaque) =
            (four().all(|own| own[0] == 1.0), four().all(|own| own[3] == 1.0 || own[3] == 255.0));
        let first = usize::from(has_weights || !is_opaque);
        let channels = || four().flat_map(|own| own[first..first + 3].iter().copied());
        let most = channels().fold(0.0, f32::max);
        let are_codes = most > ABOUT_ONE && (most > MOST_LIGHT || channels().all(|channel| channel == channel.round()));
        let white = match (are_codes, most) {
            (false, _) => 1.0,
            (true, ..=255.0) => 255.0,
            (true, _) => 65535.0,
        };
        let beyond = four()
            .filter(|own| own[first..first + 3].iter().any(|channel| !(0.0..=white * ABOUT_ONE).contains(channel)));
        let mut warnings = Vec::new();
        let mut warn = |count: usize, what: &str| {
            if count > 0 {
                warnings.push(format!("vertex colours ({count}) {what}"));
            }
        };
        warn(beyond.count(), &format!("are not from 0 to {white}, taken for the nearest"));
        warn(self.odd, "have a number that is none, taken for white");
        warn(without, "are missing beside others, taken for white");
        let color = |own: &Option<[f32; 4]>| {
            let own = own.map_or([white; 3], |own| [own[first], own[first + 1], own[first + 2]]);
            own.map(|channel| (channel / white).clamp(0.0, 1.0))
        };
        (self.written.iter().map(color).collect(), warnings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decided(lines: &[&str]) -> (Vec<[f32; 3]>, Vec<String>) {
        let mut colors = Colors::default();
        for (vertex, line) in lines.iter().enumerate().filter(|(_, line)| !line.is_empty()) {
            colors.set(vertex, &line.split_whitespace().collect::<Vec<_>>());
        }
        colors.decided(lines.len())
    }

    #[test]
    fn every_scale_and_order_of_colours_is_told_apart() {
        let half = 128.0 / 255.0;
        for (lines, expected) in [
            (["1 0 0", "0 0.5 0"], [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]),
            (["255 0 0", "0 128 1"], [[1.0, 0.0, 0.0], [0.0, half, 1.0 / 255.0]]),
            (["200.5 0 0", "0 0 51"], [[200.5 / 255.0, 0.0, 0.0], [0.0, 0.0, 0.2]]),
            (["65535 0 0", "0 0 0"], [[1.0, 0.0, 0.0], [0.0; 3]]),
            (["1.000001 0 0", "0 0.5 0"], [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]),
            // A weight before, an opacity behind.
            (["1 1 0 0", "1 0 0.5 0"], [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]),
            (["1 0 0 1", "0 0.5 0 1"], [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]),
            (["255 0 0 255", "0 51 0 255"], [[1.0, 0.0, 0.0], [0.0, 0.2, 0.0]]),
        ] {
            assert_eq!(decided(&lines), (expected.to_vec(), Vec::new()), "{lines:?}");
        }
    }

    #[test]
    fn odd_and_missing_colours_are_white_and_told() {
        let (colors, warnings) = decided(&["1 0 0", "nan 0 0", "", "-1 0.5 3.5"]);
        assert_eq!(colors, [[1.0, 0.0, 0.0], [1.0; 3], [1.0; 3], [0.0, 0.5, 1.0]]);
        assert_eq!(warnings.len(), 3, "{warnings:?}");
        assert!(warnings.iter().all(|warning| warning.starts_with("vertex colours (1) ")), "{warnings:?}");
    }

    #[test]
    fn polypaint_goes_on_where_its_last_line_stopped() {
        let mut colors = Colors::default();
        colors.paint("ffff0000ff00ff00");
        colors.paint("ff0000ff odd");
        assert_eq!(colors.decided(3).0, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }
}
