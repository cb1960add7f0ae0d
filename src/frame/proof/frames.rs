//! What a plan's frames do, told by the plan, its render passes and its rows: uploads, frames in flight, copies, and what a window adds.

use ash::vk::{AccessFlags as A, ImageLayout as L, PipelineStageFlags as S};

use super::order::PRESENTATION;
use super::program::{Memory, Program, Scope, Span, Sync, Time, Who};
use super::render_pass::Besides;
use crate::frame::IN_FLIGHT;
use crate::frame::edges::{Carrier, Edge, Edges, FORMULA_WRITE, Place, RowName};
use crate::frame::render_pass::{PassDescription, Resource};
use crate::gpu::sync::{DEVICE_ACCESS, HOST_WRITE, Use};
use crate::gpu::upload::{BLIT_READ, COPY_WRITE};
use crate::gpu_scene::{ATLAS_LAYOUT, INDEX_READ, TEXTURE_READ, VERTEX_READ, shadow_clear};
use crate::passes::{copy, encode, fxaa, overlay, present, shadow, split, tiled};
use crate::plan::{Canvas, FramePlan};
use crate::targets::{Target, Touch, stored_inputs};

const BUFFER: L = L::UNDEFINED;
const MAPS: [Memory; 2] = [Memory::ShadowMap(0), Memory::ShadowMap(1)];
const LEVELS: [Memory; 3] = [Memory::Level(0), Memory::Level(1), Memory::Level(2)];

/// Shaders read what the CPU wrote for their frame.
const UNIFORM_READ: Use = Use::new(
    S::from_raw(S::VERTEX_SHADER.as_raw() | S::FRAGMENT_SHADER.as_raw() | S::COMPUTE_SHADER.as_raw()),
    A::SHADER_READ,
);
const PRESENTED: Use = Use::new(PRESENTATION, A::MEMORY_READ);

/// What is different from frame to frame.
#[derive(Clone, Copy, Default)]
struct Turn {
    /// How often each shadow map is drawn.
    maps: [usize; 2],
    split: bool,
    copied: bool,
    covered: bool,
    /// With a texture that is new.
    has_new_panel: bool,
}

/// The frames of a plan with these rows.
pub(super) fn program(plan: &FramePlan, edges: &Edges) -> Program {
    let mut frames = Frames { plan, edges, program: Program::default(), ends: Vec::new(), copied: None };
    let uploaded = frames.upload();
    frames.clear_maps();
    let turns = turns(plan);
    for (index, turn) in turns.iter().enumerate() {
        frames.frame(index, *turn);
    }
    frames.look();
    frames.wait(RowName::LastUseToDestroy, uploaded);
    frames.program.command(Place::Host, &[(Memory::Staging, BUFFER, HOST_WRITE)]);
    frames.program
}

/// Each frame after one with and without a copy, and of a window's each with and without each thing that may lie over the picture.
fn turns(plan: &FramePlan) -> Vec<Turn> {
    // Looked up before they are drawn, drawn twice one after the other, kept, and drawn anew.
    let maps = |index: usize| [[0, 0], [2, 0], [0, 0], [1, 1]][index % 4];
    match plan.presented {
        None => (0..4).map(|index| Turn { maps: maps(index), copied: index == 1, ..Turn::default() }).collect(),
        Some(_) => (0..9)
            .map(|index| Turn {
                maps: maps(index),
                copied: index & 1 != 0,
                split: index & 2 != 0,
                covered: index & 4 != 0,
                has_new_panel: index == 4,
            })
            .collect(),
    }
}

/// The dispatch that evaluates formulas, with these rows.
pub(super) fn formulas(edges: &Edges) -> Program {
    let mut program = Program::default();
    let order = |row| edges.find(row).map(Edge::order);
    let (inputs, results) = (Memory::Written(0), Memory::ReadBack);
    program.command(Place::Host, &[(inputs, BUFFER, HOST_WRITE)]);
    if let Some(submitted) = order(RowName::HostToFrame) {
        program.barrier(submitted, None);
    }
    program.command(Place::Device, &[(inputs, BUFFER, UNIFORM_READ), (results, BUFFER, FORMULA_WRITE)]);
    if let Some(order) = order(RowName::ResultsToHost) {
        program.barrier(order, Some(results));
    }
    if let Some(order) = order(RowName::CopyToHost) {
        let end = program.step();
        program.fence(order, end);
    }
    program.command(Place::Host, &[(results, BUFFER, copy::HOST_READ)]);
    program
}

struct Frames<'a> {
    plan: &'a FramePlan,
    edges: &'a Edges,
    program: Program,
    /// When the submission of each frame ended.
    ends: Vec<Time>,
    /// The end of a submission whose copy the CPU has not looked at.
    copied: Option<Time>,
}

impl Frames<'_> {
    /// A barrier of the table, on all memory or some of it.
    fn barrier(&mut self, row: RowName, memory: Option<Memory>) {
        if let Some(edge) = self.edges.find(row) {
            self.program.barrier(edge.order(), memory);
        }
    }

    fn image_barrier(&mut self, row: RowName, memory: Memory) {
        let Some(edge) = self.edges.find(row) else { return };
        if let Carrier::ImageBarrier(old, new) = edge.carrier {
            let sync = self.program.barrier(edge.order(), Some(memory));
            self.program.transition((Who::Row(row), memory), [old, new], vec![sync], None);
        }
    }

    /// What the CPU wrote before a submission is there.
    fn submit(&mut self) {
        self.barrier(RowName::HostToFrame, None);
    }

    /// The CPU waits for all that was submitted until then.
    fn wait(&mut self, row: RowName, until: Time) {
        let Some(order) = self.edges.find(row).map(Edge::order) else { return };
        self.program.fence(order, until);
    }

    /// The CPU looks at the picture that was copied last. It does so only before the next copy, so that its wait hides nothing.
    fn look(&mut self) {
        if let Some(copied) = self.copied.take() {
            self.wait(RowName::CopyToHost, copied);
            self.program.command(Place::Host, &[(Memory::ReadBack, BUFFER, copy::HOST_READ)]);
        }
    }

    /// Gives the end of the submission.
    fn upload(&mut self) -> Time {
        let uploads = self.plan.uploads;
        self.program.command(Place::Host, &[(Memory::Staging, BUFFER, HOST_WRITE)]);
        self.submit();
        let from = (Memory::Staging, BUFFER, copy::READ);
        if uploads.textures {
            for texture in [&LEVELS[..], &[Memory::Texture]] {
                if texture.len() > 1 && !uploads.mip_levels {
                    continue;
                }
                for &level in texture {
                    self.image_barrier(RowName::TextureToCopy, level);
                }
                self.program.command(Place::Upload, &[from, (texture[0], L::TRANSFER_DST_OPTIMAL, COPY_WRITE)]);
                for pair in texture.windows(2) {
                    self.image_barrier(RowName::LevelToBlit, pair[0]);
                    let read = (pair[0], L::TRANSFER_SRC_OPTIMAL, BLIT_READ);
                    self.program.command(Place::Upload, &[read, (pair[1], L::TRANSFER_DST_OPTIMAL, COPY_WRITE)]);
                }
                self.image_barrier(RowName::UploadToTextures, texture[texture.len() - 1]);
                for &level in &texture[..texture.len() - 1] {
                    self.image_barrier(RowName::BlitToTextures, level);
                }
            }
        }
        if uploads.vertices || uploads.volumes {
            self.program.command(Place::Upload, &[from, (Memory::Vertices, BUFFER, COPY_WRITE)]);
            if uploads.vertices {
                self.program.command(Place::Upload, &[from, (Memory::Indices, BUFFER, COPY_WRITE)]);
            }
            self.barrier(RowName::UploadToVertices, None);
        }
        self.program.step()
    }

    /// A texture of OVERLAY.
    fn upload_panel(&mut self) {
        self.image_barrier(RowName::PanelToCopy, Memory::Panel);
        self.program.command(Place::Upload, &[(Memory::Panel, L::TRANSFER_DST_OPTIMAL, COPY_WRITE)]);
        self.image_barrier(RowName::UploadToPanels, Memory::Panel);
    }

    fn clear_maps(&mut self) {
        if self.plan.shadow.is_none() {
            return;
        }
        for map in MAPS {
            self.image_barrier(RowName::ShadowAtlasToClear, map);
            self.program.command(Place::Clear, &[(map, L::TRANSFER_DST_OPTIMAL, shadow_clear::WRITE)]);
            self.image_barrier(RowName::ClearToShadowMaps, map);
        }
    }

    fn frame(&mut self, index: usize, turn: Turn) {
        self.program.frame = index + 1;
        let place = Memory::Written(index % IN_FLIGHT);
        if turn.copied {
            self.look();
        }
        if let Some(last) = index.checked_sub(IN_FLIGHT) {
            self.wait(RowName::FrameToHost, self.ends[last]);
        }
        if turn.has_new_panel {
            self.upload_panel();
        }
        self.program.command(Place::Host, &[(place, BUFFER, HOST_WRITE)]);
        self.submit();
        if self.plan.presented.is_some() {
            self.acquire();
        }
        let (plan, edges) = (self.plan, self.edges);
        if plan.shadow.is_some() {
            let pass = PassDescription::shadow(plan, edges);
            for (map, times) in MAPS.into_iter().zip(turn.maps) {
                for _ in 0..times {
                    self.render_pass(&pass, &[map], place);
                }
            }
        }
        let main = PassDescription::main(plan, edges);
        let names: Vec<_> = main.attachments.iter().map(|(resource, _)| memory_of(plan, *resource)).collect();
        self.render_pass(&main, &names, place);
        if plan.fxaa {
            let pass = PassDescription::fxaa(plan, edges);
            self.render_pass(&pass, &[memory_of(plan, Resource::SmoothedPicture)], place);
        }
        if plan.is_tiled() {
            self.tiled(place);
        }
        match plan.presented {
            None => {}
            Some(canvas) => self.present(canvas, turn),
        }
        let end = self.program.step();
        self.ends.push(end);
        if plan.presented.is_none() && turn.copied {
            // A submission of its own.
            self.submit();
            self.copy(Memory::Picture);
        }
        if turn.copied {
            self.copied = Some(self.program.step());
        }
    }

    fn render_pass(&mut self, pass: &PassDescription, memory: &[Memory], place: Memory) {
        let plan = self.plan;
        self.program.render_pass(pass, memory, |subpass| besides(plan, subpass, place));
    }

    fn tiled(&mut self, place: Memory) {
        let plan = self.plan;
        self.image_barrier(RowName::OutputReuse, Memory::Picture);
        let emitted = plan.emissive.then_some(Target::Hdr);
        let stored: Vec<_> = stored_inputs(plan).into_iter().map(|(_, target)| target).chain(emitted).collect();
        let read = |&target: &Target| {
            (memory_of(plan, Resource::Target(target)), Touch::Input(target).layout(), tiled::GBUFFER_READ)
        };
        let mut touches: Vec<_> = stored.iter().map(read).collect();
        touches.push((Memory::Picture, L::GENERAL, tiled::OUTPUT_WRITE));
        touches.push((place, BUFFER, UNIFORM_READ));
        if plan.shadow.is_some() {
            touches.extend(MAPS.map(|map| (map, ATLAS_LAYOUT, tiled::MAP_READ)));
        }
        self.program.command(Place::Tiled, &touches);
        self.image_barrier(RowName::ReadBack, Memory::Picture);
    }

    fn copy(&mut self, picture: Memory) {
        let buffer = (Memory::ReadBack, BUFFER, copy::WRITE);
        self.program.command(Place::Copy, &[(picture, L::TRANSFER_SRC_OPTIMAL, copy::READ), buffer]);
        self.barrier(RowName::PictureToHost, Some(Memory::ReadBack));
    }

    /// The frame goes on when presentation has let go of the image.
    fn acquire(&mut self) {
        let Some(mask) = self.edges.find(RowName::Acquire).map(|row| row.after) else { return };
        let now = self.program.step();
        self.program.synchronize(Sync {
            first: Scope { span: Span::before(now), mask: PRESENTED },
            second: Scope { span: Span::since(now), mask: Use::new(mask.stage, DEVICE_ACCESS.access) },
            region: None,
            // Presentation of other images goes on meanwhile.
            memory: Some([Memory::SwapchainImage].into_iter().collect()),
            is_whole: false,
            is_fence: false,
        });
    }

    fn present(&mut self, canvas: Canvas, turn: Turn) {
        let is_straight = matches!(canvas, Canvas::Straight(_));
        let picture = if is_straight { Memory::SwapchainImage } else { Memory::Picture };
        if self.plan.is_tiled() && is_straight {
            self.image_barrier(RowName::SwapchainToPresent, Memory::SwapchainImage);
            let read = (Memory::Picture, L::TRANSFER_SRC_OPTIMAL, copy::READ);
            self.program
                .command(Place::Present, &[read, (Memory::SwapchainImage, L::TRANSFER_DST_OPTIMAL, present::WRITE)]);
            self.image_barrier(RowName::PresentToSwapchain, Memory::SwapchainImage);
        }
        if turn.split {
            self.image_barrier(RowName::PictureToSplit, picture);
            self.program.command(Place::Split, &[(picture, L::TRANSFER_DST_OPTIMAL, split::WRITE)]);
            self.image_barrier(RowName::SplitToPicture, picture);
        }
        if turn.copied && is_straight {
            self.image_barrier(RowName::PictureToCopy, picture);
            self.copy(picture);
            self.image_barrier(RowName::CopyToPicture, picture);
        } else if turn.copied {
            self.copy(picture);
        }
        if turn.covered {
            self.image_barrier(RowName::PictureToOverlay, picture);
            let panel = (Memory::Panel, L::SHADER_READ_ONLY_OPTIMAL, overlay::TEXTURE_READ);
            self.program.command(Place::Overlay, &[(picture, L::COLOR_ATTACHMENT_OPTIMAL, overlay::BLEND), panel]);
            self.image_barrier(RowName::OverlayToPicture, picture);
        }
        if !is_straight {
            self.image_barrier(RowName::PictureToEncode, Memory::Picture);
            self.image_barrier(RowName::SwapchainToEncode, Memory::SwapchainImage);
            let read = (Memory::Picture, L::SHADER_READ_ONLY_OPTIMAL, encode::READ);
            self.program
                .command(Place::Encode, &[read, (Memory::SwapchainImage, L::COLOR_ATTACHMENT_OPTIMAL, encode::WRITE)]);
            self.image_barrier(RowName::EncodeToPicture, Memory::Picture);
            self.image_barrier(RowName::EncodeToSwapchain, Memory::SwapchainImage);
        }
        let Some(mask) = self.edges.find(RowName::Present).map(|row| row.before) else { return };
        let now = self.program.step();
        self.program.synchronize(Sync {
            first: Scope { span: Span::before(now), mask },
            second: Scope { span: Span::since(now), mask: PRESENTED },
            region: None,
            memory: None,
            is_whole: true,
            is_fence: false,
        });
        self.program.command(Place::Presentation, &[(Memory::SwapchainImage, L::PRESENT_SRC_KHR, PRESENTED)]);
    }
}

/// The memory of an attachment.
fn memory_of(plan: &FramePlan, resource: Resource) -> Memory {
    match resource {
        Resource::ShadowMaps => MAPS[0],
        Resource::Target(target) if target != Target::Output || plan.fxaa => Memory::Target(target),
        _ if plan.draws_into_swapchain() => Memory::SwapchainImage,
        _ => Memory::Picture,
    }
}

/// What a subpass reads besides attachments.
fn besides(plan: &FramePlan, subpass: Place, place: Memory) -> Vec<Besides> {
    let mut all = vec![(place, BUFFER, UNIFORM_READ)];
    let draws = matches!(subpass, Place::Shadow | Place::Geometry | Place::Forward | Place::Transparent);
    if draws && plan.uploads.vertices {
        all.extend([(Memory::Vertices, BUFFER, VERTEX_READ), (Memory::Indices, BUFFER, INDEX_READ)]);
    }
    if subpass == Place::Lighting && plan.uploads.volumes {
        all.push((Memory::Vertices, BUFFER, VERTEX_READ));
    }
    if draws && plan.uploads.textures {
        let levels = LEVELS.into_iter().filter(|_| plan.uploads.mip_levels);
        let textures = levels.chain([Memory::Texture]);
        all.extend(textures.map(|texture| (texture, L::SHADER_READ_ONLY_OPTIMAL, TEXTURE_READ)));
    }
    let looks_up = matches!(subpass, Place::Lighting | Place::Forward | Place::Transparent);
    if looks_up && plan.shadow.is_some() {
        all.extend(MAPS.map(|map| (map, ATLAS_LAYOUT, shadow::MAP_READ)));
    }
    if subpass == Place::Fxaa {
        all.extend(fxaa::touches(plan).map(|own| (Memory::Target(own.target()), own.layout(), fxaa::OUTPUT_READ)));
    }
    all
}
