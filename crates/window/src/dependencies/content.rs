//! The contents of the panel of dependencies, and the label of a simulated picture.

use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;

use egui::{Align2, Area, Checkbox, Color32, Context, Frame, Id, Order, RichText, TextWrapMode, Ui};

use super::{Dependencies, ListedRow, Request};
use afterlight::frame::HazardPicture;
use afterlight::frame::rows::{Row, Side};
use afterlight::gpu::Validation;

/// Warnings in messages have the same.
const WARNING: Color32 = Color32::from_rgb(255, 190, 40);
/// The widest that the label of a simulated picture gets, in points.
const WIDEST: f32 = 720.0;

const RECORDS: &str = "record frames without them";
const DANGER: &str = "The frames are then recorded without these rows, and the validation layer can report them. A driver may do anything with such \
frames: a GPU may hang, and its device may be lost. Otherwise the rows stay, and only the proof and the picture go without them.";
const HINT: &str = "Switch a row off to see what may go wrong without it.";
const UNWATCHED: &str = "No validation layer watches: view --validate switches it on.";

impl Dependencies {
    /// Builds the contents. Returns the user's request.
    pub(super) fn content(&self, ui: &mut Ui, validation: Validation, chapter: Option<&Path>) -> Option<Request> {
        let mut request = None;
        ui.horizontal_wrapped(|ui| {
            if ui.button("all on").clicked() {
                request = Some(Request::AllOn);
            }
            let mut records = self.records;
            if ui.checkbox(&mut records, RECORDS).on_hover_text(DANGER).changed() {
                request = Some(Request::Records(records));
            }
            if let Some(chapter) = chapter {
                let link = ui.link("the book's chapter").on_hover_text(chapter.display().to_string());
                request = link.clicked().then_some(Request::Chapter).or(request.take());
            }
        });
        request = self.consequences(ui, validation).or(request);
        ui.separator();
        for listed in &self.listed {
            request = self.row(ui, listed).or(request);
        }
        request
    }

    /// Shows the possible consequences of the rows that are off: hazards by the proof, messages of the layer, and pictures.
    fn consequences(&self, ui: &mut Ui, validation: Validation) -> Option<Request> {
        if self.off.is_empty() {
            ui.weak(HINT);
            return None;
        }
        let mut request = None;
        for listed in self.listed.iter().filter(|own| self.off.contains(&own.row.name)) {
            request = self.pictures(ui, listed).or(request);
        }
        match self.hazards[..] {
            [] => _ = ui.label("The proof finds no hazard: other rows order the same."),
            _ => _ = ui.strong("By the proof"),
        }
        for sentence in &self.hazards {
            ui.colored_label(WARNING, sentence);
        }
        match (validation, self.records) {
            (Validation::Off, _) => _ = ui.weak(UNWATCHED),
            (_, false) => _ = ui.weak("The layer has nothing to report: the frames still have these rows."),
            (_, true) => {
                ui.strong(format!(
                    "By the validation layer: {}",
                    afterlight::scene::counted(self.messages.len(), "rule")
                ));
                for message in &self.messages {
                    ui.colored_label(WARNING, &message.id_name).on_hover_text(&message.text);
                }
            }
        }
        request
    }

    fn row(&self, ui: &mut Ui, listed: &ListedRow) -> Option<Request> {
        let row = &listed.row;
        let mut is_on = !self.off.contains(&row.name);
        let stays = row.carrier.stays();
        let switch = ui.add_enabled(stays.is_none(), Checkbox::new(&mut is_on, RichText::new(row.label).strong()));
        let request = switch.changed().then_some(Request::Switch(row.name));
        if let Some(why) = stays {
            switch.on_disabled_hover_text(why);
        }
        for line in described(row) {
            ui.label(RichText::new(line).small());
        }
        request
    }

    /// The choice among the pictures of a row's hazard.
    fn pictures(&self, ui: &mut Ui, listed: &ListedRow) -> Option<Request> {
        let name = listed.row.name;
        let shown = self.pictured.filter(|(row, _)| *row == name).map(|(_, how)| how);
        let mut chosen = shown;
        ui.label(RichText::new(format!("{} is off", listed.row.label)).strong());
        ui.horizontal_wrapped(|ui| {
            // A word that has no room goes to the next line.
            ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
            ui.label("simulated picture:");
            ui.selectable_value(&mut chosen, None, "none");
            for (how, found) in &listed.pictures {
                ui.add_enabled_ui(found.is_ok(), |ui| ui.selectable_value(&mut chosen, Some(*how), how.to_string()));
            }
        });
        for reason in reasons(&listed.pictures) {
            ui.label(RichText::new(reason).small());
        }
        (chosen != shown).then_some(Request::Picture(chosen.map(|how| (name, how))))
    }
}

/// The ends, the carrier, the masks of both sides and the reason of a row, as `inspect` prints them.
pub(super) fn described(row: &Row) -> [String; 4] {
    let side = |word: &str, side: Side| {
        let uses = row.side(side);
        format!("{word}: {} ({})", uses.stages(), uses.accesses())
    };
    [
        format!("{} -> {}, {}{}", row.from, row.to, row.carrier, row.region()),
        side("after", Side::Before),
        side("before", Side::After),
        row.why.clone(),
    ]
}

/// The reasons why a row lacks pictures, each once, with the pictures that it is about.
pub(super) fn reasons(pictures: &[(HazardPicture, Result<(), String>)]) -> Vec<String> {
    let mut all: Vec<(&str, Vec<String>)> = Vec::new();
    for (how, found) in pictures {
        let Err(reason) = found else { continue };
        match all.iter_mut().find(|(own, _)| own == reason) {
            Some((_, hows)) => hows.push(how.to_string()),
            None => all.push((reason, vec![how.to_string()])),
        }
    }
    let is_of_all = |hows: &[String]| hows.len() == pictures.len();
    all.into_iter()
        .map(
            |(reason, hows)| {
                if is_of_all(&hows) { reason.to_owned() } else { format!("{}: {reason}", hows.join(", ")) }
            },
        )
        .collect()
}

/// Says over the picture that it is a simulation, and of what.
pub(super) fn show_label(context: &Context, text: &str) {
    let area = Area::new(Id::new("simulation")).order(Order::Tooltip).anchor(Align2::CENTER_TOP, [0.0, 8.0]);
    area.interactable(false).show(context, |ui| {
        ui.set_max_width((context.content_rect().width() - 40.0).clamp(60.0, WIDEST));
        Frame::popup(ui.style()).show(ui, |ui| ui.colored_label(WARNING, text));
    });
}

/// Opens a file by the program that the system has for it. A system without one shows nothing: the panel names the file.
pub(super) fn open_file(path: &Path) {
    let opener = match () {
        () if cfg!(windows) => "explorer",
        () if cfg!(target_vendor = "apple") => "open",
        () => "xdg-open",
    };
    let started =
        Command::new(opener).arg(path).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    if let Ok(mut started) = started {
        // Somebody must wait for it, or its entry stays in the system's table of processes.
        thread::spawn(move || started.wait());
    }
}
