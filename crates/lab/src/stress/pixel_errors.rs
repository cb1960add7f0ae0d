//! Draws a scene and holds it against the reference, pixel by pixel.
//!
//! Only numeric error is compared: the reference looks through the middle of each pixel, as a frame of one sample does. A pixel on
//! which both see different triangles says where edges lie, not how light is computed: it is left out of the error, and counted. It must
//! be finite all the same, and so must everything that the G-buffer holds.

use std::fmt;
use std::sync::Arc;

use super::StressError;
use super::comparison::ReferenceComparison;
use super::formula::WorstInput;
use super::grid::{self, ChannelRange};
use afterlight::frame::{self, Pixels, Renderer};
use afterlight::gpu::Device;
use afterlight::plan::{FramePlan, ToneMapping};
use afterlight::scene::{Output, Playing, Pose, Scene, Settings, SettingsPatch, View};
use afterlight_truth::reference::{Mode, TriangleId, TruthOptions, spreading};

/// A pixel darker than this share of the brightest one counts as that bright, unless the subject says another share: nobody sees an error
/// relative to black.
pub const FLOOR: f64 = 1e-4;

/// The most that tone mapping takes (`shaders/tonemap.wgsl`); a target may hold less.
const WHITE: f32 = 65000.0;

/// The scene that is drawn for a value, and its truth.
#[derive(Debug, Clone)]
pub struct Subject {
    pub scene: Scene,
    /// Settings that win over the scene's. The size is [`Subject::SIZE`] unless they set another.
    pub settings: SettingsPatch,
    /// The least light that a pixel's error is relative to, as a share of the picture's peak: [`FLOOR`], 1 for errors relative to the peak, or 0
    /// where each decade of one picture counts.
    pub floor: f64,
    /// The scene that the truth is taken of, where that is another one: one that ought to look the same.
    pub truth: Option<Scene>,
    /// The moment that is drawn of a scene that moves; none: as it is at rest.
    pub playing: Option<Playing>,
    /// All of the sky's light arrives everywhere in the truth, too: it is then an integral, and no estimate.
    pub open_sky: bool,
}

/// The differences of a picture, or a formula, from the truth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// The greatest difference of a channel over the pixel's brightest channel, or over [`Subject::floor`] times the picture's.
    pub worst: f64,
    /// The mean over the pixels of their greatest.
    pub mean: f64,
    /// Pixels, or inputs of a formula, that were compared.
    pub compared: usize,
    /// Pixels on which raster and truth see different triangles; inputs that need only be sane.
    pub elsewhere: usize,
    /// Values that are infinite or no number, in the picture and in the G-buffer.
    pub not_finite: usize,
    /// Values below zero, in the picture.
    pub negative: usize,
    /// The input at which a formula errs most.
    pub worst_input: Option<WorstInput>,
    /// The pixel at which a picture errs most; none where no pixel errs.
    pub worst_pixel: Option<WorstPixel>,
}

/// The pixel at which a picture errs most, in exposed light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstPixel {
    /// Column and row, from the top left.
    pub at: [u32; 2],
    pub drawn: [f64; 3],
    pub expected: [f64; 3],
}

impl fmt::Display for WorstPixel {
    /// `pixel 12 7, drawn 5e-1 4e-1 3e-1, expected 5.1e-1 4e-1 3e-1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let light = |light: [f64; 3]| light.map(|channel| format!("{channel:.7e}")).join(" ");
        let [column, row] = self.at;
        write!(f, "pixel {column} {row}, drawn {}, expected {}", light(self.drawn), light(self.expected))
    }
}

impl Errors {
    /// Share of the pixels on which raster and truth see different triangles; 1 for no pixels.
    pub fn elsewhere_share(&self) -> f64 {
        let all = self.compared + self.elsewhere;
        if all == 0 { 1.0 } else { self.elsewhere as f64 / all as f64 }
    }
}

/// The picture that was drawn and the one that should have been, to be looked at. Exposed light, RGB, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct PicturePair {
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub drawn: Vec<[f32; 3]>,
    pub expected: Vec<[f64; 3]>,
}

impl PicturePair {
    /// Pixels that are black and should be bright.
    pub fn black(&self) -> usize {
        /// The least normal number of half floats: darker light may be lost in the target.
        const DARK: f64 = 6.2e-5;
        let most = |light: &[f64; 3]| light.iter().fold(0.0f64, |most, &channel| most.max(channel));
        let bright = self.expected.iter().map(most).fold(DARK / 0.02, f64::max) * 0.02;
        let is_black = |(drawn, truth): &(&[f32; 3], &[f64; 3])| **drawn == [0.0; 3] && most(truth) > bright;
        self.drawn.iter().zip(&self.expected).filter(is_black).count()
    }
}

impl Subject {
    pub const SIZE: [u32; 2] = [64, 36];

    pub fn new(scene: Scene) -> Self {
        Self { scene, settings: SettingsPatch::default(), floor: FLOOR, truth: None, playing: None, open_sky: false }
    }

    /// A subject with these settings.
    pub fn with(scene: Scene, settings: SettingsPatch) -> Self {
        Self { settings, ..Self::new(scene) }
    }

    /// Returns the pose of its moment.
    fn pose(&self) -> Option<Pose> {
        self.playing.as_ref().map(|playing| self.scene.motion.pose(playing))
    }

    /// Returns the scene that its pictures should show.
    pub(super) fn still(&self) -> Scene {
        self.playing.as_ref().map_or_else(|| self.scene.clone(), |playing| self.scene.at(playing).into_owned())
    }

    pub(super) fn decided(&self) -> Settings {
        let size = SettingsPatch { size: Some(Self::SIZE), ..SettingsPatch::default() };
        let decided = self.settings.or(&self.scene.settings).or(&size).decide();
        Settings { output: Output::Exposed, ..decided }
    }
}

/// The views that show the G-buffer.
const TARGETS: [View; 4] = [View::Normal, View::Albedo, View::Metallic, View::Roughness];

/// Draws the subject, and compares it with the truth of a scene, its own or one that ought to look the same.
///
/// # Errors
/// A lost device, and a subject that a plan refuses.
pub fn compare(device: &Arc<Device>, subject: &Subject, truth: &Scene) -> Result<(Errors, PicturePair), StressError> {
    let ReferenceComparison { mut pictures, drawn: light, reference, eye, exposure } =
        ReferenceComparison::of(device, subject, truth, None)?;
    let largest = pictures.largest;
    let options = TruthOptions::of(Mode::Point);
    let rays = reference.render(&eye, &options, &|_, _| {});
    let spans = grid::spans(grid::half_step(device), &reference, &eye, options.smith, &rays.radiance);
    let mut spans: Vec<ChannelRange> = spans.into_iter().map(|span| span.map(|light| light * exposure)).collect();
    let mut expected: Vec<[f64; 3]> =
        rays.radiance.iter().map(|light| light.map(|channel| channel * exposure)).collect();
    let settings = subject.decided();
    if let Some(spread) = spreading(&settings) {
        // Light brighter than the target's largest value spreads as that value.
        let spread = |light: Vec<[f64; 3]>| {
            let kept: Vec<_> = light.into_iter().map(|light| light.map(|channel| channel.min(largest))).collect();
            spread(&kept, eye.size)
        };
        expected = spread(expected);
        // A pixel of spread light is a mean of the picture's pixels with weights that are not negative, so it grows with each of them. A picture whose
        // pixels lie within their spans becomes one between the spread least and the spread most.
        let ends: [fn(&ChannelRange) -> [f64; 3]; 2] = [|span| span.least, |span| span.most];
        let [least, most] = ends.map(|end| spread(spans.iter().map(end).collect()));
        spans = least.into_iter().zip(most).map(|(least, most)| ChannelRange { least, most }).collect();
    }
    if expected.iter().flatten().any(|channel| !channel.is_finite()) {
        return Err(StressError::Refused("the truth itself is not finite".into()));
    }
    let elsewhere = pictures.elsewhere(rays.triangles.as_deref().unwrap_or_default())?;
    let scale = ErrorScale { floor: subject.floor, largest };
    let width = eye.size[0];
    let mut errors = against(&light, ExpectedLight { light: &expected, spans: &spans, width }, &elsewhere, scale);
    for view in TARGETS {
        match pictures.draw(view) {
            Ok(values) => errors.not_finite += values.iter().filter(|value| !value.is_finite()).count(),
            // A view that the subject has not.
            Err(StressError::Refused(_)) => {}
            Err(error) => return Err(error),
        }
    }
    let drawn = light.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    Ok((errors, PicturePair { size: eye.size, drawn, expected }))
}

pub(super) struct PictureRenderer<'a> {
    device: &'a Arc<Device>,
    subject: &'a Subject,
    settings: Settings,
    /// The light at which the last one drawn saturates.
    largest: f64,
}

/// The scale of relative errors.
#[derive(Debug, Clone, Copy)]
struct ErrorScale {
    floor: f64,
    /// Brighter light counts as this bright: it is white, and only has to be finite.
    largest: f64,
}

/// The light that a picture should show.
#[derive(Clone, Copy)]
struct ExpectedLight<'a> {
    light: &'a [[f64; 3]],
    /// The light that each pixel may show besides, as [`grid`] says.
    spans: &'a [ChannelRange],
    /// Pixels of a row.
    width: u32,
}

/// Returns the light at which pictures of the plan saturate.
pub(super) fn saturation(plan: &FramePlan) -> f64 {
    let most = if plan.tone_mapping == ToneMapping::Kept { WHITE } else { f32::MAX };
    f64::from(plan.largest_light().min(most))
}

impl<'a> PictureRenderer<'a> {
    pub fn of(device: &'a Arc<Device>, subject: &'a Subject, settings: &Settings) -> Self {
        Self { device, subject, settings: settings.clone(), largest: f64::INFINITY }
    }

    /// RGBA of a view.
    pub fn draw(&mut self, view: View) -> Result<Vec<f32>, StressError> {
        let settings = if view == self.settings.view { self.settings.clone() } else { self.settings.showing(view) };
        let mut renderer = Renderer::new(self.device, &self.subject.scene, &settings)?;
        self.largest = saturation(renderer.plan());
        let Subject { scene, playing, .. } = self.subject;
        let show = |renderer: &mut Renderer, seconds: f64| {
            if let Some(playing) = playing {
                let time = playing.time + seconds;
                renderer.pose(scene, &scene.motion.pose(&playing.with_time(time)))?;
            }
            Ok::<_, frame::Error>(scene.camera)
        };
        match renderer.picture_while(show, || {})?.pixels {
            Pixels::LinearF32(rgba) => Ok(rgba),
            Pixels::Srgb8(_) => Err(StressError::Refused(format!("{view} has no values that could be compared"))),
        }
    }

    /// Returns the pixels that show another triangle than the truth. If the device gives no triangle numbers, returns the pixels next to which the
    /// truth changes.
    pub fn elsewhere(&self, truth: &[Option<TriangleId>]) -> Result<Vec<bool>, StressError> {
        let (scene, camera) = (&self.subject.scene, &self.subject.scene.camera);
        let pose = self.subject.pose();
        Ok(match frame::triangles(self.device, (scene, pose.as_ref()), camera, &self.settings)? {
            Some(raster) => raster.iter().zip(truth).map(|(raster, truth)| raster != truth).collect(),
            None => self.beside_edges(truth),
        })
    }

    fn beside_edges(&self, truth: &[Option<TriangleId>]) -> Vec<bool> {
        let [width, height] = self.settings.size.map(|edge| edge as usize);
        let at = |x: usize, y: usize| truth[y * width + x];
        let differs = |x: usize, y: usize| {
            let near = |center: usize, end: usize| center.saturating_sub(1)..(center + 2).min(end);
            near(y, height).any(|row| near(x, width).any(|column| at(column, row) != at(x, y)))
        };
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| differs(x, y)).collect()
    }
}

fn against(rgba: &[f32], expected: ExpectedLight, elsewhere: &[bool], scale: ErrorScale) -> Errors {
    let saturated = |light: f64| light.min(scale.largest);
    let light: Vec<_> = expected.light.iter().map(|light| light.map(saturated)).collect();
    let brightest = light.iter().flatten().fold(0.0f64, |most, &channel| most.max(channel));
    let mut errors = Errors::default();
    let mut sum = 0.0;
    let pixels = rgba.as_chunks::<4>().0.iter().zip(light.iter().zip(expected.spans)).zip(elsewhere);
    for (index, ((drawn, (truth, span)), &elsewhere)) in (0u32..).zip(pixels) {
        let drawn = [drawn[0], drawn[1], drawn[2]].map(f64::from);
        errors.not_finite += drawn.iter().filter(|channel| !channel.is_finite()).count();
        errors.negative += drawn.iter().filter(|channel| **channel < 0.0).count();
        if elsewhere {
            errors.elsewhere += 1;
            continue;
        }
        errors.compared += 1;
        let own = truth.iter().fold(scale.floor * brightest, |most, &channel| most.max(channel));
        let difference = span.map(saturated).distance(drawn.map(saturated));
        // `min` and `max` pass over a NaN, and where nothing is to be seen, no difference is no error: 0 / 0 would be one.
        let error = match difference {
            _ if drawn.iter().any(|channel| channel.is_nan()) => f64::INFINITY,
            0.0 => 0.0,
            difference => difference / own,
        };
        sum += error;
        if error > errors.worst {
            let at = [index % expected.width, index / expected.width];
            errors.worst = error;
            errors.worst_pixel = Some(WorstPixel { at, drawn, expected: *truth });
        }
    }
    errors.mean = sum / errors.compared.max(1) as f64;
    errors
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: ErrorScale = ErrorScale { floor: FLOOR, largest: 1e30 };

    /// Allows no other light than this.
    fn exactly(light: &[[f64; 3]]) -> (&[[f64; 3]], Vec<ChannelRange>) {
        (light, light.iter().copied().map(ChannelRange::of).collect())
    }

    fn held(
        rgba: &[f32],
        (light, spans): (&[[f64; 3]], Vec<ChannelRange>),
        elsewhere: &[bool],
        scale: ErrorScale,
    ) -> Errors {
        against(rgba, ExpectedLight { light, spans: &spans, width: 2 }, elsewhere, scale)
    }

    #[test]
    fn what_lies_between_the_lights_beside_a_pixel_is_no_error() {
        let span = |least, most| ChannelRange { least: [least; 3], most: [most; 3] };
        let spans = vec![span(0.5, 1.25), span(1.0, 1.75)];
        let errors = held(&[1.5, 1.0, 1.0, 1.0, 1.5, 1.0, 1.0, 1.0], (&[[1.0; 3]; 2], spans), &[false; 2], SCALE);
        assert_eq!((errors.worst, errors.mean), (0.25, 0.125));
    }

    #[test]
    fn error_is_relative_to_each_pixel_but_the_dark_ones() {
        let expected = [[100.0, 50.0, 0.0], [1e-6, 0.0, 0.0], [1.0, 1.0, 1.0]];
        let rgba = [101.0, 50.0, 0.0, 1.0, 2e-4, 0.0, 0.0, 1.0, 9.0, 1.0, 1.0, 1.0];
        let errors = held(&rgba, exactly(&expected), &[false, false, true], SCALE);
        assert!((errors.worst - 0.0199).abs() < 1e-6, "{errors:?}");
        assert!((errors.mean - (0.01 + 0.0199) / 2.0).abs() < 1e-6, "{errors:?}");
        assert_eq!((errors.compared, errors.elsewhere, errors.not_finite, errors.negative), (2, 1, 0, 0));
    }

    #[test]
    fn what_no_light_can_be_is_counted_everywhere() {
        let rgba = [f32::NAN, -1.0, 0.0, 1.0, f32::INFINITY, 0.0, -0.0, 1.0];
        let errors = held(&rgba, exactly(&[[1.0; 3]; 2]), &[true, true], SCALE);
        assert_eq!((errors.not_finite, errors.negative, errors.compared), (2, 1, 0));
        let errors = held(&rgba, exactly(&[[1.0; 3]; 2]), &[false, true], SCALE);
        assert!(errors.compared == 1 && [errors.worst, errors.mean] == [f64::INFINITY; 2], "{errors:?}");
    }

    #[test]
    fn what_is_brighter_than_the_target_holds_is_white_and_no_more() {
        let scale = ErrorScale { largest: 100.0, ..SCALE };
        let rgba = [100.0, 100.0, 50.0, 1.0, 60.0, 0.0, 0.0, 1.0];
        let errors = held(&rgba, exactly(&[[1e9, 200.0, 50.0], [1e9, 0.0, 0.0]]), &[false; 2], scale);
        assert!((errors.worst - 0.4).abs() < 1e-9 && (errors.mean - 0.2).abs() < 1e-9, "{errors:?}");
        let of_the_peak = ErrorScale { floor: 1.0, ..SCALE };
        assert!(
            (held(&[10.0, 1.0, 0.0, 1.0], exactly(&[[10.0, 2.0, 0.0]]), &[false], of_the_peak).worst - 0.1).abs()
                < 1e-9
        );
    }

    #[test]
    fn black_is_what_is_bright_and_was_not_drawn() {
        let lit = |light: f64| [0.0, light, 0.0];
        let of = |drawn: Vec<[f32; 3]>, light: [f64; 3]| {
            PicturePair { size: [3, 1], drawn, expected: light.map(lit).to_vec() }.black()
        };
        assert_eq!(of(vec![[0.0; 3]; 3], [1.0, 0.1, 1e-3]), 2);
        assert_eq!(of(vec![[0.0, 1e-9, 0.0], [0.0; 3], [1.0; 3]], [1.0, 0.1, 1.0]), 1);
        // Darker than half floats hold.
        assert_eq!(of(vec![[0.0; 3]; 3], [1e-5, 1e-6, 0.0]), 0);
    }

    #[test]
    fn a_black_picture_of_a_black_scene_is_right() {
        assert_eq!(held(&[0.0; 4], exactly(&[[0.0; 3]]), &[false], SCALE).worst, 0.0);
        assert_eq!(held(&[1.0; 4], exactly(&[[0.0; 3]]), &[false], SCALE).worst, f64::INFINITY);
    }
}
