//! Bloom: light that is spread around where it comes from, in 64 bits.
//!
//! The truth is a convolution. A level of BLOOM's has, for a light at any place, a response; its mean over all places of the light is the kernel of the
//! level. For filters of `1 5 10 10 5 1` down and up that is, along an axis, the binomial coefficients of 10 over 1024, spread by 1, 2, 4, ... pixels,
//! one after the other ([`spread`]). Beside the picture lies its mirror image, so that no light is lost: light that a lens would throw out of the
//! picture lands inside of its edge, and even light stays even.
//!
//! [`by_levels`] spreads light as a frame does: by filters of texels, whose response changes with a light's place in its texel. The difference of
//! the two is the error of coarse levels, and that between a frame and [`by_levels`] is the frame's rounding.

use rayon::prelude::*;

use super::Truth;
use afterlight_scene::Settings;

/// Rows from the top, three channels.
type LightPixels = Vec<[f64; 3]>;
/// A filter of a row (axis 0) or a column (axis 1).
type SeparableFilter<'a> = &'a (dyn Fn(&[f64], usize) -> Vec<f64> + Sync);

/// The picture's light with its share of spread light, as the settings have it.
pub fn bloomed(light: &[[f64; 3]], size: [u32; 2], settings: &Settings) -> LightPixels {
    if settings.bloom <= 0.0 {
        return light.to_vec();
    }
    mixed(light, &spread(light, size, settings.bloom_radius), settings.bloom)
}

/// Returns how settings spread the light of a picture of some size; `None` where they spread none.
pub fn spreading(settings: &Settings) -> Option<impl Fn(&[[f64; 3]], [u32; 2]) -> LightPixels> {
    (settings.bloom > 0.0).then_some(|light: &[[f64; 3]], size| bloomed(light, size, settings))
}

impl Truth {
    /// Adds the settings' share of spread light. The standard error keeps its value from before the spreading, which would make it less.
    pub fn with_spread_light(mut self, settings: &Settings) -> Self {
        self.radiance = bloomed(&self.radiance, self.size, settings);
        self
    }
}

/// Spreads light as a frame does: through a pyramid of levels, with as many filter taps as the settings have.
pub fn by_levels(light: &[[f64; 3]], size: [u32; 2], settings: &Settings) -> LightPixels {
    let weights = weights(size, settings.bloom_radius, settings.bloom_taps);
    let edges = size.map(|edge| edge as usize);
    let masses = edges.map(|edge| vec![1.0; edge]);
    let picture = PyramidLevel { light: light.to_vec(), masses };
    let spread = picture.mixed_with_wider(&weights, settings.bloom_taps);
    mixed(light, &spread, settings.bloom)
}

fn mixed(light: &[[f64; 3]], spread: &[[f64; 3]], strength: f32) -> LightPixels {
    let strength = f64::from(strength);
    let one = |(own, spread): (&[f64; 3], &[f64; 3])| {
        std::array::from_fn(|channel| own[channel] + strength * (spread[channel] - own[channel]))
    };
    light.iter().zip(spread).map(one).collect()
}

/// Returns the weights of the picture itself and of each level. Each level weighs twice as much as the one before it, and the last as much as makes
/// the root mean square of the distances by which light is spread the radius, a part of the picture's height.
///
/// A filter of 2, 4 or 6 taps (1 1, 1 3 3 1, 1 5 10 10 5 1) moves light by 1/4, 3/4 or 5/4 of a texel squared along an axis; level k is reached by k
/// of them down, of texels of 1, 2, 4, ... pixels, and as many up, which have four taps at least.
fn weights([width, height]: [u32; 2], radius: f32, taps: u32) -> Vec<f64> {
    let square = (f64::from(radius) * f64::from(height)).powi(2);
    let squares = |taps: u32| f64::from(taps - 1) / 4.0;
    let both = 2.0 * (squares(taps) + squares(taps.max(4)));
    let most = f64::from(width.max(height)).log2().ceil().clamp(3.0, 15.0) as i32;
    let mut weights = vec![1.0];
    for level in 1..=most {
        let distance = |level: i32| both * (4f64.powi(level) - 1.0) / 3.0;
        let excess = |(level, weight): (usize, &f64)| weight * (square - distance(level as i32));
        let lacking: f64 = weights.iter().enumerate().map(excess).sum();
        let whole = 2f64.powi(level);
        let beyond = distance(level) - square;
        let weight = if lacking < whole * beyond { lacking / beyond } else { whole };
        weights.push(weight.max(0.0));
        if weight < whole {
            break;
        }
    }
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// The light that is spread, alone: the picture's, convolved with the kernel of each level, weighted and added up.
pub fn spread(light: &[[f64; 3]], size: [u32; 2], radius: f32) -> LightPixels {
    let weights = weights(size, radius, 6);
    let mut level = light.to_vec();
    let mut sum: LightPixels = light.iter().map(|own| own.map(|channel| channel * weights[0])).collect();
    for (index, weight) in weights.iter().enumerate().skip(1) {
        level = binomial(&level, size, 1 << (index - 1));
        for (sum, own) in sum.iter_mut().zip(&level) {
            (0..3).for_each(|channel| sum[channel] += weight * own[channel]);
        }
    }
    sum
}

/// Convolves along both axes with the binomial coefficients of 10, spaced `apart` pixels.
fn binomial(light: &[[f64; 3]], [width, height]: [u32; 2], apart: i64) -> LightPixels {
    const COEFFICIENTS: [f64; 11] = [1.0, 10.0, 45.0, 120.0, 210.0, 252.0, 210.0, 120.0, 45.0, 10.0, 1.0];
    let (width, height) = (width as usize, height as usize);
    // The places of the coefficients in a row or column, which beside the picture goes on as its mirror image.
    let places = |at: usize, count: usize| -> [usize; 11] {
        std::array::from_fn(|tap| {
            let place = (at as i64 + (tap as i64 - 5) * apart).rem_euclid(2 * count as i64) as usize;
            place.min(2 * count - 1 - place)
        })
    };
    let sum = |value: &dyn Fn(usize) -> [f64; 3]| -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (tap, coefficient) in COEFFICIENTS.iter().enumerate() {
            let own = value(tap);
            (0..3).for_each(|channel| sum[channel] += coefficient / 1024.0 * own[channel]);
        }
        sum
    };
    let mut across = vec![[0.0; 3]; light.len()];
    across.par_chunks_mut(width).zip(light.par_chunks(width)).for_each(|(row, source)| {
        for (x, out) in row.iter_mut().enumerate() {
            let places = places(x, width);
            *out = sum(&|tap| source[places[tap]]);
        }
    });
    let mut both = vec![[0.0; 3]; light.len()];
    both.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let places = places(y, height);
        for (x, out) in row.iter_mut().enumerate() {
            *out = sum(&|tap| across[places[tap] * width + x]);
        }
    });
    both
}

/// A level of the light, and the masses of its texels along both axes: how many pixels of the picture they stand for.
struct PyramidLevel {
    light: LightPixels,
    masses: [Vec<f64>; 2],
}

impl PyramidLevel {
    /// Mixes this level's light with the wider levels; `weights` begin with this level's.
    fn mixed_with_wider(&self, weights: &[f64], taps: u32) -> LightPixels {
        let all: f64 = weights.iter().sum();
        if weights.len() == 1 || all <= 0.0 {
            return self.light.clone();
        }
        let wider = self.wider(taps);
        let back = self.back(&wider.mixed_with_wider(&weights[1..], taps), taps);
        let own = weights[0] / all;
        let mixed = |(light, back): (&[f64; 3], &[f64; 3])| {
            std::array::from_fn(|channel| own * light[channel] + (1.0 - own) * back[channel])
        };
        self.light.iter().zip(&back).map(mixed).collect()
    }

    fn wider(&self, taps: u32) -> Self {
        let masses = self.masses.each_ref().map(|masses| pairs(masses));
        let light = along_axes(&self.light, self.masses[0].len(), &|row, axis| {
            let (mut row, masses) = (row.to_vec(), &self.masses[axis]);
            if taps > 4 {
                exchange(&mut row, masses, &|_| true);
            }
            if taps > 2 {
                exchange(&mut row, masses, &|before| before % 2 == 1);
            }
            let energy: Vec<f64> = row.iter().zip(masses).map(|(own, mass)| own * mass).collect();
            pairs(&energy).iter().zip(pairs(masses)).map(|(energy, mass)| energy / mass).collect()
        });
        Self { light, masses }
    }

    /// Light of the next wider level at the texels of this one.
    fn back(&self, wider: &[[f64; 3]], taps: u32) -> LightPixels {
        along_axes(wider, self.masses[0].len().div_ceil(2), &|row, axis| {
            let masses = &self.masses[axis];
            let mut row: Vec<f64> = (0..masses.len()).map(|index| row[index / 2]).collect();
            exchange(&mut row, masses, &|before| before % 2 == 1);
            if taps > 4 {
                exchange(&mut row, masses, &|_| true);
            }
            row
        })
    }
}

/// The sums of each two that follow each other; the last may be alone.
fn pairs(values: &[f64]) -> Vec<f64> {
    values.chunks(2).map(|pair| pair.iter().sum()).collect()
}

/// Two neighbours, of which `which` is asked the first one's number, exchange a quarter of the smaller one's mass.
fn exchange(row: &mut [f64], masses: &[f64], which: &dyn Fn(usize) -> bool) {
    let before = row.to_vec();
    for first in (0..before.len().saturating_sub(1)).filter(|&first| which(first)) {
        let energy = masses[first].min(masses[first + 1]) / 4.0 * (before[first + 1] - before[first]);
        row[first] += energy / masses[first];
        row[first + 1] -= energy / masses[first + 1];
    }
}

/// Applies `filter` to each row and then to each column, channel by channel.
fn along_axes(light: &[[f64; 3]], width: usize, filter: SeparableFilter) -> LightPixels {
    let filtered = |line: &[[f64; 3]], axis: usize| -> LightPixels {
        let channels: [Vec<f64>; 3] =
            std::array::from_fn(|channel| filter(&line.iter().map(|own| own[channel]).collect::<Vec<_>>(), axis));
        (0..channels[0].len()).map(|at| std::array::from_fn(|channel| channels[channel][at])).collect()
    };
    let rows: Vec<LightPixels> = light.par_chunks(width).map(|row| filtered(row, 0)).collect();
    let columns: Vec<LightPixels> = (0..rows[0].len())
        .into_par_iter()
        .map(|x| filtered(&rows.iter().map(|row| row[x]).collect::<Vec<_>>(), 1))
        .collect();
    (0..columns[0].len()).flat_map(|y| columns.iter().map(move |column| column[y])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(radius: f32, taps: u32) -> Settings {
        Settings { bloom: 1.0, bloom_radius: radius, bloom_taps: taps, ..Settings::default() }
    }

    /// One pixel of light 1.
    fn dot([width, height]: [u32; 2], [x, y]: [usize; 2]) -> LightPixels {
        let mut light = vec![[0.0; 3]; (width * height) as usize];
        light[y * width as usize + x] = [1.0, 0.5, 0.0];
        light
    }

    fn energy(light: &[[f64; 3]]) -> f64 {
        light.iter().map(|own| own[0]).sum()
    }

    /// Uneven light that no symmetry hides anything of.
    fn uneven([width, height]: [u32; 2]) -> LightPixels {
        let value = |index: u32| f64::from(index.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        (0..width * height).map(|index| [0.1 + value(index).powi(8), value(index + 9), 1.0]).collect()
    }

    #[test]
    fn no_light_is_lost_or_gained_at_any_size_and_even_light_stays_even() {
        for size in [[1, 1], [2, 1], [3, 5], [8, 8], [31, 17], [64, 36], [101, 7]] {
            for radius in [0.001, 0.02, 0.1, 1.0] {
                let light = uneven(size);
                let all = |taps| by_levels(&light, size, &settings(radius, taps));
                let ways = [spread(&light, size, radius), all(2), all(4), all(6)];
                for (way, spread) in ways.iter().enumerate() {
                    let kept = energy(spread) / energy(&light);
                    assert!((kept - 1.0).abs() < 1e-12, "{size:?} {radius} {way}: {kept}");
                    assert!(spread.iter().all(|own| (own[2] - 1.0).abs() < 1e-12), "{size:?} {radius} {way}");
                    assert!(spread.iter().all(|own| own[0] >= 0.0), "{size:?} {radius} {way}");
                }
            }
        }
    }

    #[test]
    fn light_lands_as_far_away_as_the_radius_says() {
        let size = [256, 256];
        for (radius, taps) in [(0.005, 2), (0.01, 4), (0.02, 6), (0.04, 4), (0.04, 2)] {
            let square = |spread: &LightPixels| -> f64 {
                let distance =
                    |index: usize| (index as f64 % 256.0 - 127.0).powi(2) + ((index / 256) as f64 - 127.0).powi(2);
                spread.iter().enumerate().map(|(index, own)| own[0] * distance(index)).sum()
            };
            let light = dot(size, [127, 127]);
            // Means of two texels do not keep the middle where it was, which adds to the square.
            let most = if taps == 2 { 0.2 } else { 1e-9 };
            let found = square(&by_levels(&light, size, &settings(radius, taps))).sqrt() / 256.0;
            assert!((found / f64::from(radius) - 1.0).abs() < most, "{taps}: {found} for {radius}");
            let found = square(&spread(&light, size, radius)).sqrt() / 256.0;
            assert!((found / f64::from(radius) - 1.0).abs() < 1e-9, "{found} for {radius}");
        }
    }

    /// A light has 64 places relative to the texels of a level three steps down.
    #[test]
    #[ignore = "test-all: many levels at many places"]
    fn the_kernel_of_the_truth_is_the_mean_response_of_the_levels_wherever_a_light_is() {
        let (size, radius) = ([160, 160], 0.03);
        assert_eq!(weights(size, radius, 6).len(), 4);
        let kernel = spread(&dot(size, [80, 80]), size, radius);
        let mut mean = vec![0.0; kernel.len()];
        for place in 0..64 {
            let (x, y) = (place % 8, place / 8);
            let response = by_levels(&dot(size, [76 + x, 76 + y]), size, &settings(radius, 6));
            for (index, mean) in mean.iter_mut().enumerate() {
                let (column, row) = ((index % 160 + 156 + x) % 160, (index / 160 + 156 + y) % 160);
                *mean += response[row * 160 + column][0] / 64.0;
            }
        }
        let worst = mean.iter().zip(&kernel).map(|(mean, kernel)| (mean - kernel[0]).abs()).fold(0.0, f64::max);
        let peak = kernel[80 * 160 + 80][0];
        assert!(peak > 1e-4 && worst < 1e-12 * peak, "{worst} of {peak}");
        assert!((energy(&kernel) - 1.0).abs() < 1e-12);
    }

    /// Returns the RMS difference between a dot's spread light and its convolution with the kernel, relative to the RMS of the convolution.
    fn flicker(taps: u32, lights: impl ExactSizeIterator<Item = LightPixels>) -> f64 {
        let (size, radius) = ([160, 160], 0.03);
        let (mut apart, mut all) = (0.0, 0.0);
        for light in lights {
            let found = by_levels(&light, size, &settings(radius, taps));
            let squares = |of: &dyn Fn(usize) -> f64| (0..found.len()).map(|index| of(index).powi(2)).sum::<f64>();
            // Of other taps the mean response is another: of a light that is spread over all places of a level.
            let wanted = spread(&light, size, radius);
            apart += squares(&|index| found[index][0] - wanted[index][0]);
            all += squares(&|index| wanted[index][0]);
        }
        (apart / all).sqrt()
    }

    /// A downsampling filter with the frequency response `cos^n(pi f)` and an upsampling filter with `cos^m` leave `cos^(n + m)` of a dot on average,
    /// and besides, by Parseval, the alias mirrored at half of the sampling rate: `sin^n cos^m`. The bound is their ratio along an axis, the square
    /// root of the integral of `sin^2n cos^2m` over the integral of `cos^(2n + 2m)`, times the square root of 2 for two axes. Later levels and
    /// mixtures of several levels flicker less, because most of the light that they would mirror is gone.
    #[test]
    #[ignore = "test-all: many levels at many places"]
    fn a_bright_pixel_that_moves_does_not_flicker_by_more_than_a_level_mirrors() {
        // Integrals of powers over a period, by the midpoint rule, which is exact for them.
        let mean = |of: &dyn Fn(f64) -> f64| {
            (0..64).map(|k| of((f64::from(k) + 0.5) / 64.0 * std::f64::consts::PI)).sum::<f64>() / 64.0
        };
        let bound = |n: i32, m: i32| {
            let mirrored = mean(&|at| at.sin().powi(2 * n) * at.cos().powi(2 * m));
            (2.0 * mirrored / mean(&|at| at.cos().powi(2 * (n + m)))).sqrt()
        };
        let bounds = [(2, bound(1, 3)), (4, bound(3, 3)), (6, bound(5, 5))];
        assert!((bounds[2].1 - 0.0522).abs() < 1e-3 && bounds[1].1 < 0.21 && bounds[0].1 < 0.54, "{bounds:?}");
        let mut before = f64::INFINITY;
        for (taps, bound) in bounds {
            // Both axes have the same filters, so half of the places are mirror images of the other half. `make test-all` tries each place once,
            // `make test` only places along an edge and the diagonal.
            let all = std::env::var("AFTERLIGHT_TESTS").is_ok_and(|value| value == "all");
            let is_tried = |[x, y]: [usize; 2]| if all { x >= y } else { x == y && x % 2 == 1 || y == 0 && x % 4 == 1 };
            let places: Vec<usize> = (0..64).filter(|at| is_tried([at % 8, at / 8])).collect();
            let places = || places.iter().copied();
            // Whole pixels: all places that a light can have on the third level.
            let whole = flicker(taps, places().map(|at| dot([160, 160], [76 + at % 8, 76 + at / 8])));
            // 64 shifts by eighths of a pixel, of which four pixels have their shares.
            let shifted = |at: usize| {
                let (right, down) = ((at % 8) as f64 / 8.0, (at / 8) as f64 / 8.0);
                let mut light = vec![[0.0; 3]; 160 * 160];
                for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let share = |far: usize, part: f64| if far == 1 { part } else { 1.0 - part };
                    light[(80 + y) * 160 + 80 + x] = [share(x, right) * share(y, down); 3];
                }
                light
            };
            let part = flicker(taps, places().map(shifted));
            println!("{taps} taps: {whole:.4} of whole pixels, {part:.4} of parts; bound {bound:.4}");
            // Other taps have another kernel of the same radius besides.
            let allowed = if taps == 6 { bound } else { 1.25 * bound };
            assert!(whole < allowed && part < allowed && whole < before, "{taps}: {whole} {part} {bound}");
            before = whole;
        }
    }

    #[test]
    fn a_strength_of_0_is_the_light_itself_and_of_one_half_the_mean_of_both() {
        let (size, light) = ([31, 17], uneven([31, 17]));
        assert_eq!(bloomed(&light, size, &Settings::default()), light);
        let all = bloomed(&light, size, &settings(0.1, 6));
        let half = bloomed(&light, size, &Settings { bloom: 0.5, ..settings(0.1, 6) });
        for ((light, all), half) in light.iter().zip(&all).zip(&half) {
            assert!((0..3).all(|channel| (half[channel] - (light[channel] + all[channel]) / 2.0).abs() < 1e-12));
        }
    }
}
