//! The panel of dependencies: the rows of the frame in their order, each with a switch. A row that is off is left out of the frames, the proof says what
//! may go wrong without it, and a picture of that hazard is drawn on purpose, since most drivers show none.

mod content;

use std::collections::BTreeSet;
use std::path::Path;

use egui::{Align2, Context, ScrollArea, pos2};

use self::content::{open_file, show_label};
use afterlight::frame::rows::{Row, RowName, Rows, table};
use afterlight::frame::{Error, HazardPicture, MissingRow, Presenter};
use afterlight::gpu::{Instance, Message, Validation};
use afterlight::passes::{Endpoint, ONCE};
use afterlight::plan::FramePlan;
use afterlight_proof::simulation::simulation;
use afterlight_proof::{FrameModel, in_words};

/// Points above the panel, for the label of a simulated picture: up to three lines.
const TOP: f32 = 72.0;
/// The width of the panel, in points: the longest masks have a line.
const WIDTH: f32 = 460.0;

/// A row of the frames, as the panel shows it.
struct ListedRow {
    row: Row,
    /// For a row that is off: each picture of its hazard, or why there is none.
    pictures: Vec<(HazardPicture, Result<(), String>)>,
}

/// The rows that are switched off, and the consequences.
pub struct Dependencies {
    /// The rows that the frames have, or would have if all were on.
    listed: Vec<ListedRow>,
    off: BTreeSet<RowName>,
    /// Frames are recorded without the rows that are off. Otherwise only the proof and the picture go without them.
    records: bool,
    pictured: Option<(RowName, HazardPicture)>,
    /// The hazards of the rows that are off, in words.
    hazards: Vec<String>,
    /// The label of the picture, while it is a simulation.
    label: Option<String>,
    /// Messages of the layer about frames as they are now, each rule once.
    messages: Vec<Message>,
    /// The number of messages that were read from the log.
    heard: usize,
    /// The rows, by their names, that the window begins without, and the picture of the first: until frames are made.
    asked: Option<(Vec<String>, Option<HazardPicture>)>,
    /// Names among them that the frames have no row for, until they are reported.
    lacking: Vec<String>,
    /// The rows that the frames are recorded without.
    left_out: BTreeSet<RowName>,
    /// The frames do not have the last change yet.
    has_change: bool,
}

/// What a click on the panel asks for.
enum Request {
    Switch(RowName),
    Picture(Option<(RowName, HazardPicture)>),
    AllOn,
    Records(bool),
    Chapter,
}

impl Dependencies {
    /// Starts with all rows on, except the rows `without`. A missing row may make a device hang, so frames are recorded without it only on CPUs,
    /// where no more than the program hangs, unless the user asks for it.
    pub fn new(is_cpu: bool, without: &[String], hazard: Option<HazardPicture>) -> Self {
        Self {
            listed: Vec::new(),
            off: BTreeSet::new(),
            records: is_cpu,
            pictured: None,
            hazards: Vec::new(),
            label: None,
            messages: Vec::new(),
            heard: 0,
            asked: (!without.is_empty()).then(|| (without.to_vec(), hazard)),
            lacking: Vec::new(),
            left_out: BTreeSet::new(),
            has_change: false,
        }
    }

    /// Returns true if the picture is a simulation.
    pub fn is_simulated(&self) -> bool {
        self.label.is_some()
    }

    /// Returns true if a change waits for the next frame.
    pub fn has_change(&self) -> bool {
        self.has_change
    }

    /// The rows that the window was to begin without and that its frames do not have, once.
    pub fn take_lacking(&mut self) -> Vec<String> {
        std::mem::take(&mut self.lacking)
    }

    /// Lists the rows of frames that were made.
    pub fn follow(&mut self, plan: &FramePlan) {
        let rows = table(plan);
        if let Some((names, hazard)) = self.asked.take() {
            // Windows differ in the rows of their frames, as with `--hdr`.
            let mut named = Vec::new();
            for name in names {
                match rows.named(&name, |_| true) {
                    Ok(row) => named.push(row.name),
                    Err(_) => self.lacking.push(name),
                }
            }
            self.pictured = named.first().copied().zip(hazard);
            self.off.extend(named);
            self.has_change = true;
        }
        if let Some((row, how)) = self.pictured
            && picture(plan, row, how).is_err()
        {
            // The first one that this row has.
            let mut others = HazardPicture::NAMES.iter().map(|&(_, how)| how);
            self.pictured = others.find(|&how| picture(plan, row, how).is_ok()).map(|how| (row, how));
            self.has_change = true;
        }
        let pictures = |row: &Row| match self.off.contains(&row.name) {
            true => HazardPicture::NAMES.iter().map(|&(_, how)| (how, picture(plan, row.name, how))).collect(),
            false => Vec::new(),
        };
        self.listed = rows.iter().map(|row| ListedRow { pictures: pictures(row), row: row.clone() }).collect();
        self.hazards = match self.off.is_empty() {
            true => Vec::new(),
            false => {
                let hazards = FrameModel::of(plan, &without(&rows, &self.off)).hazards();
                in_words(hazards.iter().map(|hazard| &hazard.consequence))
            }
        };
        let simulated = self.pictured.map(|(row, how)| simulation(plan, row, how));
        self.label = simulated.and_then(Result::ok).map(|own| own.to_string());
    }

    /// Makes the changes that were asked for. Returns true if the presenter must be fitted again.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn obey(&mut self, presenter: &mut Presenter) -> Result<bool, Error> {
        if !std::mem::take(&mut self.has_change) {
            return Ok(false);
        }
        let wanted = if self.records { self.off.clone() } else { BTreeSet::new() };
        let unfit = wanted != self.left_out;
        if unfit {
            // Rows of uploads count when the scene is uploaded anew.
            let of_scene = wanted.symmetric_difference(&self.left_out).any(|&name| self.is_once(name));
            let off = wanted.clone();
            // SAFETY: the user has asked for frames without these rows, and the panel says what the driver may do then.
            unsafe { presenter.set_rows(move |plan| without(&table(plan), &off), of_scene) };
            self.left_out = wanted;
            self.messages.clear();
        }
        if let Some(plan) = presenter.plan() {
            self.follow(plan);
        }
        let decide = |plan: &FramePlan, name, how| simulation(plan, name, how).ok();
        presenter.simulate(self.pictured.map(|(name, how)| MissingRow { name, how, decide }))?;
        Ok(unfit)
    }

    /// Reads the layer's new messages. Returns a line for each rule that is new.
    pub fn listen(&mut self, instance: &Instance) -> Vec<String> {
        let new = instance.message_log().since(self.heard);
        self.heard += new.len();
        let mut lines = Vec::new();
        for message in new.into_iter().filter(Message::is_about_this_program) {
            if !self.messages.iter().any(|own| own.id_name == message.id_name) {
                lines.push(format!("warning: the validation layer says {}", message.id_name));
                self.messages.push(message);
            }
        }
        lines
    }

    /// Labels a simulated picture, and builds the panel if it is `open`.
    pub fn show(&mut self, context: &Context, open: &mut bool, (instance, chapter): (&Instance, Option<&Path>)) {
        if let Some(label) = &self.label {
            show_label(context, label);
        }
        if *open {
            self.show_panel(context, open, (instance.validation(), chapter));
        }
    }

    fn show_panel(&mut self, context: &Context, open: &mut bool, (validation, chapter): (Validation, Option<&Path>)) {
        let screen = context.content_rect();
        // Below the label.
        let right_top = pos2(screen.right() - 12.0, TOP);
        let size = [(screen.width() - 48.0).clamp(60.0, WIDTH), (screen.height() - TOP - 80.0).max(60.0)];
        let window = egui::Window::new("Dependencies").pivot(Align2::RIGHT_TOP).default_pos(right_top);
        let mut request = None;
        window.default_size(size).open(open).show(context, |ui| {
            let whole = ScrollArea::vertical().max_height(size[1]);
            whole.auto_shrink([false, true]).show(ui, |ui| request = self.content(ui, validation, chapter));
        });
        match (request, chapter) {
            (Some(Request::Chapter), Some(chapter)) => open_file(chapter),
            (Some(request), _) => self.ask(request),
            (None, _) => {}
        }
    }

    fn ask(&mut self, request: Request) {
        match request {
            Request::Switch(name) => self.switch(name),
            Request::Picture(pictured) => self.pictured = pictured,
            Request::AllOn => (self.off, self.pictured) = (BTreeSet::new(), None),
            Request::Records(records) => self.records = records,
            Request::Chapter => return,
        }
        self.has_change = true;
    }

    /// Switches a row off, with the first picture that its hazard has, or on again.
    fn switch(&mut self, name: RowName) {
        if !self.off.remove(&name) {
            self.off.insert(name);
            self.pictured = Some((name, HazardPicture::Stale));
        } else if self.pictured.is_some_and(|(row, _)| row == name) {
            self.pictured = None;
        }
    }

    /// Returns true if a row orders work that is done once, as the scene is uploaded.
    fn is_once(&self, name: RowName) -> bool {
        let has = |place: Endpoint| ONCE.iter().any(|(once, _)| *once == place);
        self.listed.iter().any(|own| own.row.name == name && (has(own.row.from) || has(own.row.to)))
    }
}

/// Checks that a row's hazard has this picture. The reason why it has none is for the panel.
fn picture(plan: &FramePlan, row: RowName, how: HazardPicture) -> Result<(), String> {
    simulation(plan, row, how).map(|_| ()).map_err(|error| error.to_string())
}

/// The table without the rows that are off. A row that these frames do not have is missing already.
fn without(table: &Rows, off: &BTreeSet<RowName>) -> Rows {
    off.iter().fold(table.clone(), |rows, &name| rows.without(name).unwrap_or(rows))
}

#[cfg(test)]
mod tests;
