//! `--calibrate` measures the figures that `auto` chooses by; without it `doctor` tells them with the rest of a device.

use std::{io, process, thread};

use afterlight::frame::capabilities;
use afterlight::gpu::{DeviceChoice, PhysicalDevice};
use afterlight::plan::{Basis, COMPARED, CostModel, CullingCost, PathCost};
use afterlight_lab::report::calibrate;
use afterlight_truth::measure::WarmUp;
use serde::Serialize;

use crate::args::DeviceArgs;
use crate::failure::{Exit, Failure};
use crate::table::TextTable;
use crate::typed::Typed;
use crate::{output, progress, session};

/// The figures that `auto` chooses by.
#[derive(Debug, Serialize)]
pub struct CalibrationReport {
    /// `asked`, `unasked`, or `null` for the figures of another device.
    measured: Option<&'static str>,
    /// The other device.
    of: Option<&'static str>,
    paths: Vec<LightPathReport>,
    culling: CullingCost,
    /// Objects from which on the device culls, where it can; `null`: it never does.
    many_objects: Option<usize>,
    /// The warm-up before the frames of `--calibrate`; one that never settled, if there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    warm_up: Option<WarmUp>,
}

/// One path's figures, in picoseconds.
#[derive(Debug, Serialize)]
struct LightPathReport {
    path: String,
    /// `null` where the device cannot take it.
    #[serde(flatten)]
    cost: Option<PathCost>,
}

impl CalibrationReport {
    pub fn of(device: &PhysicalDevice) -> Self {
        let costs: CostModel = capabilities(device).costs;
        let (measured, of) = match costs.basis {
            Basis::Kind(of) => (None, Some(of)),
            Basis::Unasked => (Some("unasked"), None),
            Basis::Asked => (Some("asked"), None),
        };
        let paths = COMPARED.iter().zip(costs.paths);
        let paths = paths.map(|(path, cost)| LightPathReport {
            path: path.to_string(),
            cost: Some(cost).filter(|cost| *cost != afterlight::plan::ABSENT),
        });
        let many = costs.culling.many_objects();
        Self {
            measured,
            of,
            paths: paths.collect(),
            culling: costs.culling,
            many_objects: (many != usize::MAX).then_some(many),
            warm_up: None,
        }
    }

    /// The figures, and the command that measures them: of the device of this number, or of the one that is used by default.
    pub fn text(&self, number: Option<usize>) -> String {
        let whose = match (self.of, self.measured) {
            (Some(of), _) => {
                let measuring = Typed::new("doctor").flag("calibrate", true);
                let measuring = measuring.option_if("device", number.map(|number| number.to_string()));
                format!("figures of {of}; `{measuring}` measures this device")
            }
            (None, Some("unasked")) => "what was measured on this device beside a window".into(),
            (None, _) => "what was measured on this device".into(),
        };
        let mut table = TextTable::new();
        let nanoseconds = |picoseconds: u32| format!("{:.3}", f64::from(picoseconds) / 1e3);
        table.row(["ns", "a pixel", "a light without a range", "lists", "a light of limited reach", "a triangle"]);
        for LightPathReport { path, cost } in &self.paths {
            match cost {
                Some(cost) => {
                    let all = [cost.base, cost.unlimited, cost.lists, cost.limited, cost.triangle].map(nanoseconds);
                    table.row(std::iter::once(path.clone()).chain(all))
                }
                None => table.row([path.as_str(), "not on this device"]),
            };
        }
        let culls = match self.many_objects {
            Some(many) => format!("from {many} objects on the device culls, where it can"),
            None => "the device never culls by itself".into(),
        };
        format!("  `auto` chooses by {whose}\n{}  {culls}\n", table.render())
    }
}

/// Measures the device and keeps the figures for later runs.
pub fn run(device: Option<DeviceChoice>, asked: bool, json: bool) -> Result<(), Failure> {
    if !asked {
        thread::spawn(end_with_parent);
    }
    session::with_device(&DeviceArgs { device, validate: None }, |device| {
        let unkept = |error| {
            let what = format!("the figures of {} cannot be kept: {error}", device.physical.name);
            Failure::new(Exit::BadInput, what).with_hint("AFTERLIGHT_CALIBRATION names a folder for them")
        };
        // The place is checked before seconds are spent on figures that could not be kept.
        device.physical.calibration_place().map_err(unkept)?;
        let mut bar = None;
        let (measured, warm_up) = calibrate::measure(&device, asked, &mut |_, all| {
            bar.get_or_insert_with(|| progress::bar("calibrating".into(), all as u64, !asked)).step();
        })?;
        drop(bar);
        let place = measured.keep(&device.physical).map_err(unkept)?;
        let mut physical = device.physical.clone();
        physical.calibration = serde_json::to_vec(&measured).ok();
        let mut report = CalibrationReport::of(&physical);
        report.warm_up = warm_up;
        let moving = warm_up.and_then(|warm_up| warm_up.words());
        let moving =
            moving.map_or_else(String::new, |words| format!("  {words}: calibrate again while nothing else runs\n"));
        let text = match json {
            true => output::json(&report)?,
            false => format!("{}\n{}{moving}  kept in {}\n", physical.name, report.text(None), place.display()),
        };
        output::print(&text, false)
    })
}

/// Ends the process when nobody holds the other end of standard input any more: the window that it measures beside is gone.
fn end_with_parent() {
    let _ = io::copy(&mut io::stdin(), &mut io::sink());
    process::exit(0);
}
