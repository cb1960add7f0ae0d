//! The front as people read it in a terminal.

use std::fmt::Write as _;
use std::path::Path;

use afterlight::report::sweep::assemble::default_on_front;
use afterlight::report::sweep::model::{Against, Metric, Report, SceneReport};

use crate::cli::table::{Table, bytes, milliseconds};

/// Each scene's front by this metric against the converged truth, and where the settings as given lie.
pub fn of(report: &Report, metric: Metric, folder: &Path) -> String {
    let machine = &report.machine;
    let mut text = format!("{} ({}), {}\n", machine.device, machine.driver, machine.cpu);
    for scene in &report.scenes {
        let _ = write!(text, "\n{}", scene_text(scene, metric));
    }
    let _ = writeln!(text, "\nAll of it: {}", folder.join("report.html").display());
    text
}

fn scene_text(scene: &SceneReport, metric: Metric) -> String {
    let [width, height] = scene.size;
    let truth = &scene.truth;
    let mut text = format!(
        "{}: {width}x{height}, {} triangles, {} lights; {} points, truth of {} samples\n",
        scene.name,
        scene.triangles,
        scene.lights,
        scene.points.len(),
        truth.samples
    );
    let Some(front) = scene.fronts.iter().find(|front| front.metric == metric && front.truth == Against::Converged)
    else {
        text += "No front by this metric was sought: measure with this --metric, or without --quick.\n";
        return text;
    };
    let mut table = Table::with_figures_from(1);
    table.row(["settings", "a picture", "95%", "FLIP", "relMSE", "RMSE", "on the front", "memory"]);
    let is_on_it = |index: usize| front.points.contains(&index);
    let given = (!is_on_it(scene.default)).then_some(scene.default);
    for index in front.points.iter().copied().chain(given) {
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
    let _ = writeln!(text, "{}", default_on_front(scene, metric, Against::Converged));
    text
}
