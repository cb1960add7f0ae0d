//! Errors in files that were changed while the window is open, told over the last good picture.

use egui::{Align2, Context, RichText, ScrollArea};

/// Errors, in lines.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct ReloadErrors {
    pub scene: Option<String>,
    pub shaders: Option<String>,
}

impl ReloadErrors {
    pub fn is_any(&self) -> bool {
        self.scene.is_some() || self.shaders.is_some()
    }

    /// Removes all faults. Returns true if there were any.
    pub fn clear(&mut self) -> bool {
        let was = self.is_any();
        *self = Self::default();
        was
    }

    /// Shows each, until it is closed.
    pub fn show(&mut self, context: &Context) {
        // At these places neither lies over the other, nor over other panels as they open.
        let all = [
            ("Scene", "scene", &mut self.scene, (Align2::CENTER_TOP, [0.0, 12.0])),
            ("Shaders", "shaders", &mut self.shaders, (Align2::LEFT_BOTTOM, [12.0, -12.0])),
        ];
        for (title, what, fault, (align, offset)) in all {
            let Some(text) = fault else { continue };
            let mut shown = true;
            let window = egui::Window::new(title).open(&mut shown).anchor(align, offset);
            window.resizable(false).show(context, |ui| {
                ui.label(format!("The picture is of the last {what} without a fault."));
                ui.set_max_width(context.content_rect().width() - 60.0);
                ScrollArea::both().max_height(context.content_rect().height() * 0.4).show(ui, |ui| {
                    // Carets must stand under the characters that they point at.
                    let lines = RichText::new(text.as_str()).monospace().color(ui.visuals().error_fg_color);
                    ui.add(egui::Label::new(lines).extend());
                });
            });
            if !shown {
                *fault = None;
            }
        }
    }
}
