//! The figures of a frame: draw counts and times.

/// The figures of a frame that was drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DrawCounts {
    /// Opaque objects that were drawn, without the objects of `on_device`.
    pub objects: usize,
    /// Opaque objects that the device culls and draws. Triangles of these objects are not counted.
    pub on_device: usize,
    /// Objects among `on_device` that the device drew; known when the frame is done.
    pub found: Option<usize>,
    /// Commands that draw surfaces.
    pub commands: usize,
    /// Objects beside or behind the view.
    pub culled: usize,
    /// Objects in view that others hide.
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
    /// Shadow maps that shaders sample.
    pub shadow_maps: usize,
    /// Shadow maps that were drawn anew.
    pub shadow_maps_drawn: usize,
}

/// The times of a frame.
#[derive(Debug, Clone, Default)]
pub struct FrameTimes {
    /// CPU time to find the visible objects and to record the frame.
    pub record_ms: f64,
    /// CPU time of the call that submits the frame.
    pub submit_ms: f64,
    /// Time from the start of recording until the device was done.
    pub wall_ms: f64,
    /// The whole frame by the device's own clock.
    pub gpu_ms: Option<f64>,
    /// Time of each pass, by the device's own clock. Empty on CPU devices, which may shade at any time, whatever subpass is recorded.
    pub passes: Vec<(String, f64)>,
    /// The frame's figures.
    pub drawn: DrawCounts,
}
