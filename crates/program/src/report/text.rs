//! The front as people read it in a terminal.

use std::fmt::Write as _;
use std::path::Path;

use afterlight::scene::counted;
use afterlight_lab::report::advice::{self, Advice, Reason};
use afterlight_lab::report::sweep::assemble::default_on_front;
use afterlight_lab::report::sweep::families::Sweep;
use afterlight_lab::report::sweep::model::{Against, Front, Metric, Report, SceneReport};
use afterlight_truth::measure::what_moves;

use crate::table::{TextTable, bytes, milliseconds};

/// Each scene's front by this metric against the converged truth, and where the settings as given lie.
/// `all`: the table has every point, and not only the front.
pub fn of(report: &Report, metric: Metric, all: bool, folder: &Path) -> String {
    let machine = &report.machine;
    let mut text = format!("{} ({}), {}\n", machine.device, machine.driver, machine.cpu);
    for scene in &report.scenes {
        let _ = write!(text, "\n{}", scene_text(scene, metric, all));
    }
    let _ = writeln!(text, "\nAll of it: {}", folder.join("report.html").display());
    text
}

fn scene_text(scene: &SceneReport, metric: Metric, all: bool) -> String {
    let [width, height] = scene.size;
    let truth = &scene.truth;
    let mut text = format!(
        "{}: {width}x{height}, {}, {}; {}, truth of {}\ntimes: {}\n",
        scene.name,
        counted(scene.triangles, "triangle"),
        counted(scene.lights, "light"),
        counted(scene.points.len(), "point"),
        counted(truth.samples, "sample"),
        what_moves(scene.moving)
    );
    text.extend(scene.clocks().map(|words| words + "\n"));
    let Some(front) = scene.fronts.iter().find(|front| front.metric == metric && front.truth == Against::Converged)
    else {
        text += "No front by this metric was sought: measure with this --metric, or without --quick.\n";
        return text;
    };
    text += &advice_text(scene, front);
    let mut table = TextTable::with_figures_from(1);
    table.row(["settings", "a picture", "95%", "FLIP", "relMSE", "RMSE", "on the front", "memory"]);
    let is_on_it = |index: usize| front.points.contains(&index);
    let mut listed: Vec<usize> =
        (0..scene.points.len()).filter(|&index| all || is_on_it(index) || index == scene.default).collect();
    let time = |index: usize| scene.points[index].time.decisive().median;
    listed.sort_by(|&a, &b| time(a).total_cmp(&time(b)));
    for &index in &listed {
        let (point, errors) = (&scene.points[index], &scene.points[index].errors.converged);
        let time = point.time.decisive();
        let mark = if index == scene.default { " (as given)" } else { "" };
        let unsure = if time.is_wide() { " unsure" } else { "" };
        let probability = if is_on_it(index) { format!("{:.2}", front.probability[index]) } else { "no".into() };
        table.row([
            format!("{}{mark}", point.name),
            milliseconds(time.median),
            format!("+-{:.1}%{unsure}", 100.0 * time.relative_half_width()),
            format!("{:.5}", errors.flip),
            format!("{:.3e}", errors.rel_mse),
            format!("{:.3e}", errors.rmse),
            probability,
            bytes(point.memory),
        ]);
    }
    text += &table.render();
    if let Some(more) = scene.points.len().checked_sub(listed.len()).filter(|&more| more > 0) {
        let _ = writeln!(text, "{} off the front, too: --all lists them.", counted(more, "point"));
    }
    text.extend(Sweep::quick_words(&scene.left_out).map(|words| words + "\n"));
    let _ = writeln!(text, "{}", default_on_front(scene, metric, Against::Converged));
    text
}

/// The first paragraph: the changes to make, a line each.
fn advice_text(scene: &SceneReport, front: &Front) -> String {
    let advice = advice::of(scene, front);
    let is_free = advice.iter().any(|one| one.reason == Reason::Free);
    let mut text = if is_free { String::new() } else { format!("{}\n", advice::KEEP) };
    for Advice { reason, point } in advice {
        let gain = advice::gain(scene, front.metric, front.truth, point);
        let _ = writeln!(text, "{}: `{}`: {gain}.", reason.text(), scene.points[point].name);
    }
    text
}
