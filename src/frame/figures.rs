//! The figures of a frame: what it drew, and how long it took.

/// The figures of a frame that was drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DrawCounts {
    /// Opaque objects that were drawn, but for those of `on_device`.
    pub objects: usize,
    /// Opaque objects among which the device finds the visible ones, and draws them. Their triangles are not counted.
    pub on_device: usize,
    /// The number of those that it drew; known when the frame is done.
    pub found: Option<usize>,
    /// Commands that draw surfaces.
    pub commands: usize,
    /// Beside or behind the view.
    pub culled: usize,
    /// In view, behind others.
    pub occluded: usize,
    /// Triangles of all draws.
    pub triangles: usize,
    /// Lights of the plan that reach a surface in view and are drawn.
    pub lights: usize,
    /// The plan's other lights: they reach no surface in view, or come after the last light of a halted frame.
    pub idle_lights: usize,
    /// Draws into shadow maps.
    pub casters: usize,
    /// Draws into shadow maps that were left out, because no surface in view lies in their shadow.
    pub idle_casters: usize,
    /// Shadow maps that are looked up.
    pub shadow_maps: usize,
    /// Shadow maps that were drawn anew.
    pub shadow_maps_drawn: usize,
}

/// The times of a frame.
#[derive(Debug, Clone, Default)]
pub struct FrameTimes {
    /// CPU: deciding what is visible and recording it.
    pub record_ms: f64,
    /// CPU: the call that submits it.
    pub submit_ms: f64,
    /// From the start of recording until the device was done.
    pub wall_ms: f64,
    /// The whole frame by the device's own clock.
    pub gpu_ms: Option<f64>,
    /// By pass, by the device's own clock. Empty on CPU devices: they shade when they like, whatever subpass is recorded.
    pub passes: Vec<(String, f64)>,
    /// The frame's figures.
    pub drawn: DrawCounts,
}
