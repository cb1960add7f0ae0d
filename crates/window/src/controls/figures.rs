//! Figures on the panels: times, counts, memory and the parts of the plan.

use egui::{Grid, RichText, Sense, Stroke, Ui, Vec2, pos2};

use crate::clock::Interval;
use afterlight::frame::FrameTimes;
use afterlight::gpu::MemoryReport;
use afterlight::plan::Part;

/// Milliseconds that the graph of times shows at least.
const LEAST_MS: f32 = 4.0;

/// A part of an interval in milliseconds.
type Share = fn(&Interval) -> Option<f64>;

/// Times of the last frames: from one to the next, and the part of it in which the CPU and the device were busy.
pub(super) fn graph(ui: &mut Ui, intervals: &[Interval], times: &FrameTimes) {
    let colors = [ui.visuals().strong_text_color(), egui::Color32::LIGHT_BLUE, egui::Color32::GOLD];
    let lines: [(&str, Share); 3] =
        [("frame", |own| Some(own.interval_ms)), ("CPU", |own| Some(own.record_ms)), ("GPU", |own| own.gpu_ms)];
    ui.horizontal(|ui| {
        // An interval has the times that were known when it ended, and at first none.
        let last = [intervals.last().map(|own| own.interval_ms), Some(times.record_ms), times.gpu_ms];
        for (((name, _), last), color) in lines.iter().zip(last).zip(colors) {
            let last = last.map_or("-".into(), |ms| format!("{ms:.2} ms"));
            ui.label(RichText::new(format!("{name} {last}")).color(color));
        }
    });
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 60.0), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let most = intervals.iter().map(|own| own.interval_ms as f32).fold(LEAST_MS, f32::max);
    let step = rect.width() / (intervals.len().max(2) - 1) as f32;
    for ((_, of), color) in lines.iter().zip(colors) {
        let point = |(index, own): (usize, &Interval)| {
            let height = of(own)? as f32 / most * rect.height();
            Some(pos2(rect.left() + index as f32 * step, rect.bottom() - height))
        };
        painter.line(intervals.iter().enumerate().filter_map(point).collect(), Stroke::new(1.0_f32, color));
    }
}

/// Counts and times of the last frame.
pub(super) fn frame(ui: &mut Ui, times: &FrameTimes) {
    let drawn = &times.drawn;
    let all = drawn.objects + drawn.culled + drawn.occluded;
    Grid::new("frame").num_columns(2).show(ui, |ui| {
        let mut row = |what: &str, value: String| {
            ui.label(what);
            ui.label(value);
            ui.end_row();
        };
        row(
            "objects",
            match drawn.found {
                None => format!("{} of {all}, {} out of view, {} hidden", drawn.objects, drawn.culled, drawn.occluded),
                Some(found) => format!("{} of {}", drawn.objects + found, all + drawn.on_device),
            },
        );
        row("commands", drawn.commands.to_string());
        row("triangles", drawn.triangles.to_string());
        row("lights", format!("{} of {}", drawn.lights, drawn.lights + drawn.idle_lights));
        row("shadow maps", format!("{} of {} drawn anew", drawn.shadow_maps_drawn, drawn.shadow_maps));
        row("CPU", format!("{:.2} ms", times.record_ms));
        for (pass, ms) in &times.passes {
            row(pass, format!("{ms:.3} ms"));
        }
        if let Some(ms) = times.gpu_ms {
            row("GPU", format!("{ms:.2} ms"));
        }
    });
}

/// Memory on the device, by its kind.
pub(super) fn memory(ui: &mut Ui, memory: &MemoryReport) {
    Grid::new("memory").num_columns(2).show(ui, |ui| {
        let mut row = |what: &str, bytes: u64| {
            ui.label(what);
            ui.label(format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)));
            ui.end_row();
        };
        for (kind, report) in &memory.kinds {
            row(kind.text(), report.bytes);
        }
        row("all", memory.bytes);
        row("peak", memory.peak_bytes);
    });
}

/// Parts of the plan with their reasons.
pub(super) fn plan_parts(ui: &mut Ui, parts: &[Part]) {
    for included in [true, false] {
        ui.strong(if included { "in" } else { "left out" });
        for part in parts.iter().filter(|part| part.included == included) {
            ui.label(&part.name).on_hover_text(&part.reason);
            ui.label(RichText::new(&part.reason).small().weak());
        }
    }
}
