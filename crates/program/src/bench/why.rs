//! `afterlight bench --why`: the costs in a frame. One setting at a time is switched to a cheaper value and drawn in turn with the
//! settings as given, so that costs are found on CPU devices, too, where passes cannot be timed.

use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::{Picture, Pixels, capabilities};
use afterlight::gpu::Device;
use afterlight::plan::{Capabilities, FramePlan};
use afterlight::scene::{SETTINGS, Scene, Setting, Settings, SettingsPatch, ValueKind};
use afterlight_truth::measure::{
    Distribution, LEAST_FOR_95, MedianInterval, Srgb8Image, median_interval, shown_errors,
};
use image::RgbImage;
use image::imageops::{FilterType, resize};
use serde::Serialize;

use super::contender::{self, Contender, decisive};
use super::{Args, report::BenchScene};
use crate::failure::Failure;
use crate::progress;
use crate::table::{TextTable, milliseconds};
use crate::workload::Workload;

/// Renderers that take turns with the settings as given. Each has the scene on the device.
const HELD: usize = 4;
/// Settings that change less than this share of the time explain nothing.
const LEAST_SHARE: f64 = 0.01;

/// One setting with a value that may be cheaper than the one as given.
#[derive(Debug, Clone, PartialEq)]
struct Switch {
    setting: &'static str,
    title: &'static str,
    as_given: String,
    value: String,
}

impl Switch {
    /// As a command line has it.
    fn option(&self) -> String {
        format!("--{} {}", self.setting, self.value)
    }

    /// Returns all switches, also for parts that a frame lacks: the cheaper values of the table's rows, the defaults of settings that differ from
    /// them, and half the size.
    fn all(given: &Settings) -> Vec<Self> {
        let rows = SETTINGS.iter().filter(|row| row.changes_plan && row.only.is_empty());
        rows.flat_map(|row| Self::of(row, given)).collect()
    }

    fn of(row: &'static Setting, given: &Settings) -> Vec<Self> {
        let now = row.text(&given.patch());
        let mut values: Vec<String> = row.cheaper.iter().map(|&value| value.to_owned()).collect();
        if row.values == ValueKind::Size {
            let [width, height] = given.size.map(|edge| edge.div_ceil(2));
            values = vec![format!("{width}x{height}")];
        } else {
            let default = row.text(&Settings::default().patch());
            // A setting that is on by default costs something: its default is not the cheaper value.
            values.extend(default.filter(|value| value != "on" && !row.cheaper.contains(&value.as_str())));
        }
        let number = |text: &str| text.parse::<f64>().ok();
        let is_other = |value: &String| match now.as_deref().and_then(number).zip(number(value)) {
            Some((now, value)) => value < now,
            None => now.as_ref() != Some(value),
        };
        let as_given = now.clone().unwrap_or_else(|| row.unset.to_owned());
        let switch = |value| Self { setting: row.key, title: row.title, as_given: as_given.clone(), value };
        values.into_iter().filter(is_other).map(switch).collect()
    }
}

/// Switches that change the frames of a scene, with their settings, and switches that are refused.
#[derive(Default)]
struct SwitchSelection {
    felt: Vec<(Switch, Settings)>,
    refused: Vec<RefusedOption>,
}

#[derive(Debug, Serialize)]
struct RefusedOption {
    option: String,
    reason: String,
}

impl SwitchSelection {
    fn of(scene: &Scene, given: &Settings, device: &Capabilities) -> Result<Self, Failure> {
        let plan = FramePlan::of(scene, given, device)?;
        let mut choice = Self::default();
        for switch in Switch::all(given) {
            let mut patch = given.patch();
            patch.set(switch.setting, &switch.value)?;
            let settings = Settings { output: given.output, ..patch.decide() };
            match FramePlan::of(scene, &settings, device) {
                Ok(other) if other.has_structure_of(&plan) => {}
                Ok(_) => choice.felt.push((switch, settings)),
                Err(error) => {
                    choice
                        .refused
                        .push(RefusedOption { option: switch.option(), reason: Failure::from(error).message().into() });
                }
            }
        }
        Ok(choice)
    }
}

/// The costs of a frame, each measured by switching it to a cheaper value.
#[derive(Debug, Serialize)]
pub struct CostBreakdown {
    /// The median time with the settings as given, in milliseconds.
    given_ms: Option<f64>,
    /// Costs whose cheaper value is faster come first, the fastest at the head.
    costs: Vec<SettingCost>,
    /// Values that the device or the scene cannot have.
    refused: Vec<RefusedOption>,
}

#[derive(Debug, Serialize)]
struct SettingCost {
    setting: &'static str,
    as_given: String,
    value: String,
    #[serde(skip)]
    label: String,
    option: String,
    verdict: SpeedChange,
    /// The median as given, times the ratio.
    ms: f64,
    saved_ms: f64,
    /// Ratio of its time to the time of the given settings in the same rounds.
    ratio: MedianInterval,
    picture: Compared,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
enum SpeedChange {
    Faster,
    /// The interval of the ratio reaches to 1, or near it.
    WithinNoise,
    Slower,
}

impl SpeedChange {
    fn of(ratio: &MedianInterval) -> Self {
        match ratio {
            ratio if ratio.count < LEAST_FOR_95 => Self::WithinNoise,
            ratio if ratio.high < 1.0 - LEAST_SHARE => Self::Faster,
            ratio if ratio.low > 1.0 + LEAST_SHARE => Self::Slower,
            _ => Self::WithinNoise,
        }
    }
}

/// The comparison of a picture with the given settings' picture.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
struct Compared {
    /// True if the pictures are equal bit by bit.
    same: bool,
    /// True if it has another size and was scaled to the given one.
    scaled: bool,
    /// Mean FLIP; `null` in builds without FLIP.
    flip: Option<f64>,
    /// Error of sRGB from 0 to 1.
    rmse: Option<f64>,
}

impl Compared {
    fn of(actual: &Srgb8Image, given: &Srgb8Image) -> Self {
        if actual == given {
            return Self { same: true, flip: flip(actual, given), rmse: Some(0.0), ..Self::default() };
        }
        let scaled = (actual.size != given.size).then(|| scaled(actual, given.size));
        let shown = scaled.as_ref().unwrap_or(actual);
        let rmse = shown_errors(shown, given).ok().map(|difference| difference.rmse);
        Self { same: false, scaled: scaled.is_some(), flip: flip(shown, given), rmse }
    }

    fn text(&self) -> String {
        let scaled = if self.scaled { ", scaled up" } else { "" };
        match (self.same, self.flip, self.rmse) {
            (true, ..) => "the same, bit by bit".into(),
            (_, Some(flip), _) => format!("FLIP {flip:.1e}{scaled}"),
            (_, _, Some(rmse)) => format!("RMSE {rmse:.1e}{scaled}"),
            _ => "-".into(),
        }
    }
}

#[cfg(feature = "report")]
fn flip(actual: &Srgb8Image, given: &Srgb8Image) -> Option<f64> {
    afterlight_truth::measure::flip(actual, given).ok().map(|map| map.mean())
}

#[cfg(not(feature = "report"))]
fn flip(_: &Srgb8Image, _: &Srgb8Image) -> Option<f64> {
    None
}

/// As a screen scales it: bilinearly.
fn scaled(image: &Srgb8Image, size @ [width, height]: [u32; 2]) -> Srgb8Image {
    let codes = image.pixels.as_flattened().to_vec();
    let image = RgbImage::from_raw(image.size[0], image.size[1], codes).unwrap_or_default();
    let codes = resize(&image, width, height, FilterType::Triangle).into_raw();
    Srgb8Image { size, pixels: codes.as_chunks::<3>().0.to_vec() }
}

/// Returns the picture of a contender's last frame. The settings do not ask for linear pixels.
fn picture(contender: &mut Contender) -> Result<Srgb8Image, Failure> {
    let Picture { size, pixels } = contender.renderer.read_back()?;
    let Pixels::Srgb8(rgba) = pixels else { return Ok(Srgb8Image { size, pixels: Vec::new() }) };
    Ok(Srgb8Image::from_rgba(size, &rgba))
}

/// The settings as given and the held switches.
fn turn<'a>(base: &'a mut Contender, held: &'a mut [(&Switch, Contender)]) -> Vec<&'a mut Contender> {
    std::iter::once(base).chain(held.iter_mut().map(|(_, contender)| contender)).collect()
}

/// Measures one scene.
pub fn measure(args: &Args, workload: &Workload, device: &Arc<Device>) -> Result<BenchScene, Failure> {
    // Frames are measured, however many of them a picture is made of.
    let given = Settings { samples: 1, ..workload.settings(&SettingsPatch::default(), &device.physical)? };
    let SwitchSelection { felt, mut refused } =
        SwitchSelection::of(&workload.scene, &given, &capabilities(&device.physical))?;
    let mut base = Contender::new("as given", device, workload, given)?;
    let steps = felt.chunks(HELD).count() as u64 * u64::from(args.frames);
    let bar = progress::bar(workload.scene.name.clone(), steps, args.quiet);
    let (mut measured, mut expected, mut warm_up) = (Vec::new(), None, None);
    for batch in felt.chunks(HELD) {
        let mut held = Vec::new();
        for (switch, settings) in batch {
            match Contender::new(&switch.option(), device, workload, settings.clone()) {
                Ok(contender) => held.push((switch, contender)),
                Err(why) => refused.push(RefusedOption { option: switch.option(), reason: why.message().to_owned() }),
            }
        }
        let begun = base.times.len();
        contender::warm_up(&mut turn(&mut base, &mut held), &workload.scene.camera, args.warmup, &mut warm_up)?;
        for round in 0..args.frames {
            let mut turn = turn(&mut base, &mut held);
            // The first one changes from round to round.
            let count = turn.len();
            turn.rotate_left(round as usize % count);
            for contender in turn {
                contender.draw(&workload.scene.camera, true)?;
            }
            bar.step();
        }
        let expected: &Srgb8Image = match &mut expected {
            Some(picture) => picture,
            none => none.insert(picture(&mut base)?),
        };
        for (switch, mut contender) in held {
            let compared = Compared::of(&picture(&mut contender)?, expected);
            let pairs = contender.times.iter().zip(&base.times[begun..]);
            let software = contender.renderer.plan().software;
            let ratios: Vec<f64> =
                pairs.map(|(own, given)| decisive(own, software) / decisive(given, software)).collect();
            measured.extend(median_interval(&ratios).map(|ratio| (switch.clone(), ratio, compared)));
        }
    }
    drop(bar);
    let software = base.renderer.plan().software;
    let given = Distribution::of(base.times.iter().map(|times| decisive(times, software)));
    let mut report = BenchScene::of(workload, &[base], None).after(warm_up);
    report.why = Some(CostBreakdown::of(given.map(|times| times.median), measured, refused));
    Ok(report)
}

impl CostBreakdown {
    fn of(
        given_ms: Option<f64>,
        measured: Vec<(Switch, MedianInterval, Compared)>,
        refused: Vec<RefusedOption>,
    ) -> Self {
        let cost = |(switch, ratio, picture): (Switch, MedianInterval, Compared)| {
            let given = given_ms.unwrap_or(f64::NAN);
            SettingCost {
                option: switch.option(),
                label: format!("{}: {}", switch.title, switch.as_given),
                setting: switch.setting,
                as_given: switch.as_given,
                value: switch.value,
                verdict: SpeedChange::of(&ratio),
                ms: given * ratio.median,
                saved_ms: given * (1.0 - ratio.median),
                ratio,
                picture,
            }
        };
        let mut costs: Vec<SettingCost> = measured.into_iter().map(cost).collect();
        // Switches that gain nothing keep the order of the table.
        let rank = |cost: &SettingCost| if cost.verdict == SpeedChange::Faster { cost.ratio.median } else { 1.0 };
        costs.sort_by(|a, b| a.verdict.cmp(&b.verdict).then(rank(a).total_cmp(&rank(b))));
        Self { given_ms, costs, refused }
    }

    /// Returns a table of the switches that save time, and a line for each switch that does not, costs more, or is refused.
    pub fn text(&self) -> String {
        let given = self.given_ms.unwrap_or(f64::NAN);
        let mut text = format!(
            "Why {} a frame? Each cost at its cheapest, in turn with the settings as given:\n",
            milliseconds(given)
        );
        let mut table = TextTable::with_figures_from(2);
        table.row(["type", "as given", "a frame", "saved", "95%", "picture, to that as given"]);
        for cost in self.costs.iter().filter(|cost| cost.verdict == SpeedChange::Faster) {
            let saved = |ratio: f64| milliseconds(given * (1.0 - ratio));
            table.row([
                cost.option.clone(),
                cost.label.clone(),
                format!("{} -> {}", milliseconds(given), milliseconds(cost.ms)),
                milliseconds(cost.saved_ms),
                format!("{} to {}", saved(cost.ratio.high), saved(cost.ratio.low)),
                cost.picture.text(),
            ]);
        }
        if self.costs.iter().any(|cost| cost.verdict == SpeedChange::Faster) {
            text += &table.render();
        }
        let line = |text: &mut String, what: &str, said: Vec<String>| {
            if !said.is_empty() {
                let _ = writeln!(text, "  {what}: {}", said.join(", "));
            }
        };
        let of = |verdict| self.costs.iter().filter(move |cost| cost.verdict == verdict);
        // A picture that is as good is worth a word where time does not tell.
        let unsure = |cost: &SettingCost| match cost.picture.same {
            true => format!("{} ({})", cost.option, cost.picture.text()),
            false => cost.option.clone(),
        };
        let few = self.costs.iter().any(|cost| cost.ratio.count < LEAST_FOR_95);
        let noise = if few {
            format!("within noise, as --frames are fewer than {LEAST_FOR_95}")
        } else {
            "less than 1% or within noise".into()
        };
        line(&mut text, &noise, of(SpeedChange::WithinNoise).map(unsure).collect());
        let slower = |cost: &SettingCost| format!("{} ({:.2} times as long)", cost.option, cost.ratio.median);
        line(&mut text, "slower", of(SpeedChange::Slower).map(slower).collect());
        for RefusedOption { option, reason } in &self.refused {
            let _ = writeln!(text, "  {option} cannot be: {reason}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use afterlight::plan::CostModel;
    use afterlight::scene::{OpenOptions, open};

    use super::*;

    const LAVAPIPE: Capabilities =
        Capabilities { msaa: 4, software: true, costs: CostModel::CPU, ..Capabilities::ample() };

    fn options(scene: &str, settings: &str) -> Vec<String> {
        let scene = open(scene, &OpenOptions::default()).expect("a built-in scene");
        let given = settings.parse::<SettingsPatch>().expect("settings").or(&scene.settings).decide();
        let choice = SwitchSelection::of(&scene, &given, &LAVAPIPE).expect("a plan");
        choice.felt.iter().map(|(switch, _)| switch.option()).collect()
    }

    #[test]
    fn only_what_is_in_the_frame_is_switched() {
        let hall = options("builtin:hall", "size=321x180");
        for option in ["--size 161x90", "--shadows off", "--shadow-size 512", "--shadow-filter none", "--cascades 1"] {
            assert!(hall.contains(&option.to_owned()), "{option} of {hall:?}");
        }
        for setting in ["--fxaa", "--msaa", "--vignette", "--grain", "--plan"] {
            assert!(!hall.iter().any(|option| option.starts_with(setting)), "{setting} of {hall:?}");
        }
        let without = options("builtin:hall", "shadows=off");
        assert!(!without.iter().any(|option| option.contains("shadow") || option.contains("cascades")), "{without:?}");
    }

    #[test]
    fn whatever_is_not_at_its_default_is_switched_back_and_nothing_becomes_more() {
        let spheres = options("builtin:spheres", "fxaa=on vignette=0.5 grain=0.1 gbuffer=fat anisotropy=1");
        for option in ["--fxaa off", "--vignette 0", "--grain 0", "--gbuffer lean"] {
            assert!(spheres.contains(&option.to_owned()), "{option} of {spheres:?}");
        }
        assert!(!spheres.iter().any(|option| option.starts_with("--anisotropy")), "{spheres:?}");
        let small = options("builtin:hall", "shadow-size=256 cascades=1");
        assert!(!small.iter().any(|option| option.contains("shadow-size") || option.contains("cascades")), "{small:?}");
    }

    fn ratio(median: f64, half: f64, count: usize) -> MedianInterval {
        MedianInterval { median, low: median - half, high: median + half, count }
    }

    #[test]
    fn costs_are_sorted_and_noise_is_no_cost() {
        let switch =
            |setting, value: &str| Switch { setting, title: setting, as_given: "on".into(), value: value.into() };
        let apart = Compared { flip: Some(2.7e-4), rmse: Some(0.01), ..Compared::default() };
        let same = Compared { same: true, flip: Some(0.0), rmse: Some(0.0), ..Compared::default() };
        let measured = vec![
            (switch("fxaa", "off"), ratio(0.98, 0.03, 30), apart.clone()),
            (switch("light-path", "loop"), ratio(1.2, 0.01, 30), same.clone()),
            (switch("anisotropy", "2"), ratio(0.999, 0.001, 30), same),
            (switch("msaa", "1"), ratio(0.9, 0.01, 30), apart.clone()),
            (switch("cascades", "1"), ratio(0.5, 0.02, 30), apart),
        ];
        let why = CostBreakdown::of(Some(100.0), measured, Vec::new());
        let order: Vec<_> = why.costs.iter().map(|cost| (cost.setting, cost.verdict)).collect();
        let expected = [
            ("cascades", SpeedChange::Faster),
            ("msaa", SpeedChange::Faster),
            ("fxaa", SpeedChange::WithinNoise),
            ("anisotropy", SpeedChange::WithinNoise),
            ("light-path", SpeedChange::Slower),
        ];
        assert_eq!(order, expected);
        let text = why.text();
        let row = "--cascades 1  cascades: on  100 ms -> 50.0 ms  50.0 ms  48.0 ms to 52.0 ms";
        let squeezed = text.lines().map(|line| line.split("  ").filter(|cell| !cell.is_empty()).map(str::trim));
        let squeezed: Vec<String> = squeezed.map(|cells| cells.collect::<Vec<_>>().join("  ")).collect();
        assert!(squeezed.iter().any(|line| line.starts_with(row) && line.ends_with("FLIP 2.7e-4")), "{text}");
        assert!(
            text.contains("  less than 1% or within noise: --fxaa off, --anisotropy 2 (the same, bit by bit)\n"),
            "{text}"
        );
        assert!(text.contains("slower: --light-path loop (1.20 times as long)\n"), "{text}");
        assert_eq!(SpeedChange::of(&ratio(0.5, 0.0, LEAST_FOR_95 - 1)), SpeedChange::WithinNoise);
    }

    #[test]
    fn a_smaller_picture_is_compared_at_the_size_as_given() {
        let flat = |size: [u32; 2], code| Srgb8Image { size, pixels: vec![[code; 3]; (size[0] * size[1]) as usize] };
        let compared = Compared::of(&flat([8, 4], 100), &flat([16, 8], 100));
        assert!(compared.scaled && !compared.same && compared.rmse == Some(0.0), "{compared:?}");
        assert!(Compared::of(&flat([8, 4], 90), &flat([16, 8], 100)).rmse > Some(0.03));
        assert_eq!(Compared::of(&flat([16, 8], 9), &flat([16, 8], 9)).text(), "the same, bit by bit");
    }
}
