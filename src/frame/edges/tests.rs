use std::collections::BTreeSet;

use ash::vk::{AccessFlags as A, PipelineStageFlags as S};

use super::masks::SUPPORTED;
use super::*;
use crate::plan::samples;
use crate::scene::Transparency;
use crate::targets::{Attachment, Target, attachments, gbuffer_inputs, light_target};

const SUBPASSES: [Place; 6] =
    [Place::Geometry, Place::Lighting, Place::Forward, Place::Transparent, Place::Composite, Place::Tonemap];

/// What a subpass does with an attachment, told by the plan alone.
struct Touch {
    place: Place,
    target: Target,
    uses: Vec<(S, A)>,
}

const COLOR_WRITE: (S, A) = (S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
const COLOR_READ: (S, A) = (S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_READ);
const INPUT_READ: (S, A) = (S::FRAGMENT_SHADER, A::INPUT_ATTACHMENT_READ);
/// A clear of depth happens in the early tests, a store in the late ones (specification, 8.1).
const DEPTH_CLEAR: (S, A) = (S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
const DEPTH_STORE: (S, A) = (S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
const DEPTH_READ_EARLY: (S, A) = (S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ);
const DEPTH_READ_LATE: (S, A) = (S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ);

fn is_gbuffer(target: Target) -> bool {
    let others = [Target::Depth, Target::Accumulation, Target::Weights, Target::Hdr, Target::Samples, Target::Output];
    !others.contains(&target)
}

/// In the order of the subpasses.
fn touches(plan: &FramePlan) -> Vec<Touch> {
    let mut all = Vec::new();
    let mut touch = |place, target, uses: &[(S, A)]| all.push(Touch { place, target, uses: uses.to_vec() });
    let written = &[DEPTH_CLEAR, DEPTH_STORE, DEPTH_READ_EARLY];
    if plan.is_forward() {
        touch(Place::Forward, Target::Depth, written);
    } else if plan.has_geometry() {
        touch(Place::Geometry, Target::Depth, written);
        let stored = attachments(plan).into_iter().map(|attachment| attachment.target);
        for target in stored.filter(|target| is_gbuffer(*target)) {
            let counts = target == Target::Count;
            touch(Place::Geometry, target, if counts { &[COLOR_WRITE, COLOR_READ] } else { &[COLOR_WRITE] });
        }
        if plan.emissive {
            touch(Place::Geometry, light_target(plan), &[COLOR_WRITE]);
        }
        touch(Place::Lighting, Target::Depth, &[DEPTH_READ_EARLY, DEPTH_READ_LATE]);
    }
    for (_, target) in gbuffer_inputs(plan) {
        touch(Place::Lighting, target, &[INPUT_READ]);
    }
    // A resolve reads the samples and writes the output, both as colour attachments (specification, 8.4).
    let resolves = plan.resolves_output() && plan.transparency.is_none();
    let light = if plan.blends_light() || resolves { &[COLOR_WRITE, COLOR_READ][..] } else { &[COLOR_WRITE] };
    touch(lit(plan), light_target(plan), light);
    if resolves {
        touch(lit(plan), Target::Output, &[COLOR_WRITE]);
    }
    let depth = &[DEPTH_READ_EARLY, DEPTH_READ_LATE];
    match plan.transparency {
        Some(Transparency::Sorted) => {
            touch(Place::Transparent, Target::Depth, depth);
            touch(Place::Transparent, light_target(plan), &[COLOR_WRITE, COLOR_READ]);
            if plan.resolves_output() {
                touch(Place::Transparent, Target::Output, &[COLOR_WRITE]);
            }
        }
        Some(Transparency::Oit) => {
            touch(Place::Transparent, Target::Depth, depth);
            for target in [Target::Accumulation, Target::Weights] {
                touch(Place::Transparent, target, &[COLOR_WRITE, COLOR_READ]);
                touch(Place::Composite, target, &[INPUT_READ]);
            }
            touch(Place::Composite, light_target(plan), &[COLOR_WRITE, COLOR_READ]);
            if plan.resolves_output() {
                touch(Place::Composite, Target::Output, &[COLOR_WRITE]);
            }
        }
        None => {}
    }
    if plan.has_tonemap_subpass() {
        touch(Place::Tonemap, Target::Hdr, &[INPUT_READ]);
        touch(Place::Tonemap, Target::Output, &[COLOR_WRITE]);
    }
    all
}

/// Where what is opaque is lit.
fn lit(plan: &FramePlan) -> Place {
    if plan.is_forward() { Place::Forward } else { Place::Lighting }
}

fn covers(one: &Use, (stage, access): (S, A)) -> bool {
    one.stage.contains(stage) && one.access.contains(access)
}

/// Whether it is waited for: its stage, and what it wrote.
fn waits_for(one: &Use, (stage, access): (S, A)) -> bool {
    covers(one, (stage, Use::new(stage, access).writes().access))
}

fn main_row(table: &Edges, from: Place, to: Place) -> Option<&Edge> {
    table.iter().find(|edge| edge.carrier == Carrier::MainPass && (edge.from, edge.to) == (from, to))
}

fn each_plan(check: impl Fn(&str, &FramePlan, &Edges)) {
    for (name, plan) in samples::plans().into_iter().chain(samples::forward_plans()) {
        check(&name, &plan, &table(&plan));
    }
}

/// The subpasses that touch an attachment, first and last, with their uses.
fn lifetime(plan: &FramePlan, attachment: &Attachment) -> (Touch, Touch) {
    let own = |touch: &Touch| touch.target == attachment.target;
    let merged = |place: Place| {
        let uses = touches(plan).into_iter().filter(|touch| own(touch) && touch.place == place);
        Touch { place, target: attachment.target, uses: uses.flat_map(|touch| touch.uses).collect() }
    };
    let places: Vec<Place> = touches(plan).iter().filter(|touch| own(touch)).map(|touch| touch.place).collect();
    // `touches` is not sorted within LIGHTING, but by subpass it is.
    (merged(places[0]), merged(places[places.len() - 1]))
}

#[test]
fn names_are_unique_and_every_row_says_why() {
    each_plan(|name, _, table| {
        let names: BTreeSet<_> = table.iter().map(|edge| edge.name).collect();
        assert_eq!(names.len(), table.iter().count(), "{name}");
        assert!(table.iter().all(|edge| !edge.why.is_empty()), "{name}");
    });
}

#[test]
fn one_row_a_pair_of_subpasses() {
    each_plan(|name, _, table| {
        for (index, edge) in table.iter().enumerate().filter(|(_, edge)| edge.carrier.is_render_pass()) {
            let same = |other: &&Edge| {
                (other.from, other.to) == (edge.from, edge.to)
                    && std::mem::discriminant(&other.carrier) == std::mem::discriminant(&edge.carrier)
            };
            assert_eq!(table.iter().position(|other| same(&other)), Some(index), "{name}: {}", edge.name);
        }
    });
}

#[test]
fn the_first_use_of_every_attachment_waits_for_its_last_one_in_the_frame_before() {
    each_plan(|name, plan, table| {
        for attachment in attachments(plan) {
            let target = attachment.target;
            let (first, _) = lifetime(plan, &attachment);
            let row = main_row(table, Place::Outside, first.place)
                .unwrap_or_else(|| panic!("{name}: nothing orders {target:?} before {:?}", first.place));
            // Its load, a clear or nothing, writes it, before all else.
            let load = if target == Target::Depth { DEPTH_CLEAR } else { COLOR_WRITE };
            assert!(covers(&row.after, load), "{name}: {} does not hold back {load:?} of {target:?}", row.name);
            let before = match attachment.store {
                // What is stored is read by COPY, which waits for the write.
                vk::AttachmentStoreOp::STORE if plan.fxaa => vec![(S::FRAGMENT_SHADER, A::SHADER_READ)],
                vk::AttachmentStoreOp::STORE => vec![(S::TRANSFER, A::TRANSFER_READ)],
                _ => vec![drop_of(target)],
            };
            for one in before {
                assert!(waits_for(&row.before, one), "{name}: {} does not wait for {one:?} of {target:?}", row.name);
            }
        }
    });
}

/// The store of the last subpass that uses a target; DONT_CARE writes too.
fn drop_of(target: Target) -> (S, A) {
    if target == Target::Depth { DEPTH_STORE } else { COLOR_WRITE }
}

#[test]
fn what_a_subpass_wrote_is_ordered_before_every_later_subpass_that_touches_it() {
    each_plan(|name, plan, table| {
        let touches = touches(plan);
        for later in &touches {
            let same = |earlier: &&Touch| earlier.target == later.target && earlier.place != later.place;
            let written_before = touches.iter().filter(same).take_while(|earlier| earlier.place != later.place);
            // The writer next before it: rows chain from there.
            let place_index = |place| SUBPASSES.iter().position(|&p| p == place);
            let Some(earlier) =
                written_before.filter(|earlier| place_index(earlier.place) < place_index(later.place)).last()
            else {
                continue;
            };
            let row = main_row(table, earlier.place, later.place)
                .unwrap_or_else(|| panic!("{name}: no row {:?} to {:?}", earlier.place, later.place));
            for &one in earlier.uses.iter().filter(|(_, access)| is_write(*access)) {
                assert!(waits_for(&row.before, one), "{name}: {} does not wait for {one:?}", row.name);
            }
            for &one in &later.uses {
                assert!(covers(&row.after, one), "{name}: {} does not hold back {one:?}", row.name);
            }
        }
    });
}

fn is_write(access: A) -> bool {
    access.intersects(A::COLOR_ATTACHMENT_WRITE | A::DEPTH_STENCIL_ATTACHMENT_WRITE)
}

#[test]
fn the_store_of_the_last_subpass_that_uses_an_attachment_is_ordered_too() {
    each_plan(|name, plan, table| {
        for attachment in attachments(plan) {
            let (first, last) = lifetime(plan, &attachment);
            if first.place == last.place {
                continue;
            }
            let drop = drop_of(attachment.target);
            let into_last: Vec<_> =
                table.iter().filter(|e| e.carrier == Carrier::MainPass && e.to == last.place).collect();
            let covered = into_last.iter().any(|row| row.from != Place::Outside && covers(&row.after, drop));
            assert!(covered, "{name}: no row into {:?} covers the store of {:?}", last.place, attachment.target);
        }
    });
}

#[test]
fn the_picture_is_copied_after_the_last_subpass_and_reaches_the_host() {
    each_plan(|name, plan, table| {
        let last = touches(plan).into_iter().rfind(|touch| touch.target == Target::Output);
        let last = last.expect("something writes the output").place;
        let of = |from, to| table.iter().find(|edge| (edge.from, edge.to) == (from, to));
        let (row, carrier) = match plan.fxaa {
            true => (of(Place::Fxaa, Place::Outside), Carrier::FxaaPass),
            false => (of(last, Place::Outside), Carrier::MainPass),
        };
        let row = row.unwrap_or_else(|| panic!("{name}: no read-back"));
        assert_eq!((row.carrier, of(last, Place::Fxaa).is_some()), (carrier, plan.fxaa), "{name}");
        assert!(waits_for(&row.before, COLOR_WRITE) && covers(&row.after, (S::TRANSFER, A::TRANSFER_READ)), "{name}");
        let host = table.row("picture-to-host");
        assert_eq!((host.carrier, host.from), (Carrier::BufferBarrier, Place::Copy), "{name}");
        assert!(
            waits_for(&host.before, (S::TRANSFER, A::TRANSFER_WRITE)) && covers(&host.after, (S::HOST, A::HOST_READ))
        );
    });
}

#[test]
fn fxaa_samples_the_whole_output_and_draws_no_picture_that_is_being_copied() {
    each_plan(|name, plan, table| {
        let of = |from, to| table.iter().find(|edge| (edge.from, edge.to) == (from, to));
        let last = touches(plan).into_iter().rfind(|touch| touch.target == Target::Output);
        let last = last.expect("something writes the output").place;
        let (into, reuse) = (of(last, Place::Fxaa), of(Place::Outside, Place::Fxaa));
        assert_eq!((into.is_some(), reuse.is_some()), (plan.fxaa, plan.fxaa), "{name}");
        if let (Some(into), Some(reuse)) = (into, reuse) {
            assert_eq!((into.carrier, into.by_region), (Carrier::MainPass, false), "{name}");
            assert!(waits_for(&into.before, COLOR_WRITE) && covers(&into.after, (S::FRAGMENT_SHADER, A::SHADER_READ)));
            assert_eq!(reuse.carrier, Carrier::FxaaPass, "{name}");
            assert!(waits_for(&reuse.before, (S::TRANSFER, A::TRANSFER_READ)) && covers(&reuse.after, COLOR_WRITE));
        }
    });
}

#[test]
fn the_shadow_map_has_its_rows_where_the_plan_has_one() {
    each_plan(|name, plan, table| {
        let of = |from, to| table.iter().find(|edge| (edge.from, edge.to) == (from, to));
        let read = (S::FRAGMENT_SHADER, A::SHADER_READ);
        let (reuse, into) = (of(Place::Outside, Place::Shadow), of(Place::Shadow, lit(plan)));
        assert_eq!((reuse.is_some(), into.is_some()), (plan.shadow.is_some(), plan.shadow.is_some()), "{name}");
        if let (Some(reuse), Some(into)) = (reuse, into) {
            assert!(waits_for(&reuse.before, read) && covers(&into.after, read), "{name}");
            assert!(covers(&reuse.after, DEPTH_CLEAR), "{name}");
            assert!(waits_for(&into.before, DEPTH_STORE), "{name}");
            // Maps of one layer are drawn one after the other: their rows chain.
            assert!(reuse.before.stage.intersects(into.after.stage), "{name}");
            assert_eq!((reuse.carrier, into.carrier), (Carrier::ShadowPass, Carrier::ShadowPass), "{name}");
        }
    });
}

#[test]
fn every_access_is_one_that_a_stage_of_its_mask_supports_and_every_stage_that_must_wait_has_one() {
    each_plan(|name, _, table| {
        for (edge, side) in table.iter().flat_map(|edge| [(edge, Side::Before), (edge, Side::After)]) {
            let one = edge.side(side);
            let named = SUPPORTED.iter().filter(|(access, _)| one.access.contains(*access));
            let (mut accesses, mut stages) = (A::empty(), S::empty());
            for &(access, supporting) in named {
                assert!(one.stage.intersects(supporting), "{name}: {}: {access:?} without its stage", edge.name);
                (accesses, stages) = (accesses | access, stages | supporting);
            }
            assert_eq!(accesses, one.access, "{name}: {}: an access that the table does not know", edge.name);
            // A stage that only read is waited for without an access, and the CPU frees what it does not look at.
            let bare = side == Side::Before || edge.name == "last-use-to-destroy";
            assert!(!one.stage.is_empty(), "{name}: {}: no stage", edge.name);
            assert!(bare || stages.contains(one.stage), "{name}: {}: a stage that does nothing", edge.name);
            assert!(side == Side::After || one == one.writes(), "{name}: {}: a read made available", edge.name);
        }
    });
}

#[test]
fn rows_are_by_region_between_subpasses_and_nowhere_else() {
    each_plan(|name, _, table| {
        for edge in table.iter() {
            let outside = |place| matches!(place, Place::Outside | Place::Fxaa);
            let between = edge.carrier == Carrier::MainPass && !outside(edge.from) && !outside(edge.to);
            assert_eq!(edge.by_region, between, "{name}: {}", edge.name);
        }
    });
}

#[test]
fn rows_wait_for_nothing_that_the_plan_leaves_out() {
    each_plan(|name, plan, table| {
        let any = |one: (S, A)| table.iter().any(|edge| covers(&edge.before, one) || covers(&edge.after, one));
        // What is blended over was written by an earlier subpass.
        let blends = plan.emissive || plan.transparency.is_some();
        assert_eq!(any(COLOR_READ), blends, "{name}");
        let places: BTreeSet<_> =
            table.iter().flat_map(|edge| [edge.from, edge.to]).map(|p| format!("{p:?}")).collect();
        assert_eq!(places.contains("Geometry"), plan.has_geometry() && !plan.is_forward(), "{name}");
        assert_eq!(places.contains("Forward"), plan.is_forward(), "{name}");
        assert_eq!(places.contains("Lighting"), !plan.is_forward(), "{name}");
        assert_eq!(places.contains("Tonemap"), plan.has_tonemap_subpass(), "{name}");
        assert_eq!(places.contains("Transparent"), plan.transparency.is_some(), "{name}");
        assert_eq!(places.contains("Composite"), plan.transparency == Some(Transparency::Oit), "{name}");
        assert_eq!(places.contains("Shadow"), plan.shadow.is_some(), "{name}");
        let reads_light = plan.has_tonemap_subpass() || plan.transparency == Some(Transparency::Oit);
        assert_eq!(any(INPUT_READ), plan.has_geometry() && (!plan.is_forward() || reads_light), "{name}");
    });
}

#[test]
fn a_tiled_frame_orders_what_compute_reads_and_writes() {
    const COMPUTE: S = S::COMPUTE_SHADER;
    for (name, plan) in samples::tiled_plans() {
        let table = table(&plan);
        let of = |from, to| {
            let row = table.iter().find(|edge| (edge.from, edge.to) == (from, to));
            row.unwrap_or_else(|| panic!("{name}: no row {from} to {to}"))
        };
        // The attachments: read by the last frame, written, read by this one.
        let (reuse, stored) = (of(Place::Outside, Place::Geometry), of(Place::Geometry, Place::Tiled));
        assert_eq!((reuse.carrier, stored.carrier), (Carrier::MainPass, Carrier::MainPass), "{name}");
        assert!(waits_for(&reuse.before, (COMPUTE, A::SHADER_READ)), "{name}");
        assert!(covers(&stored.after, (COMPUTE, A::SHADER_READ)), "{name}");
        for (load, store) in [(DEPTH_CLEAR, DEPTH_STORE), (COLOR_WRITE, COLOR_WRITE)] {
            assert!(covers(&reuse.after, load) && waits_for(&stored.before, store), "{name}: {load:?}");
        }
        // The output: copied from the last frame, written, copied.
        let (output, copied) = (of(Place::Outside, Place::Tiled), of(Place::Tiled, Place::Outside));
        let general = vk::ImageLayout::GENERAL;
        assert_eq!(output.carrier, Carrier::ImageBarrier(vk::ImageLayout::UNDEFINED, general), "{name}");
        assert_eq!(copied.carrier, Carrier::ImageBarrier(general, vk::ImageLayout::TRANSFER_SRC_OPTIMAL), "{name}");
        for row in [&output.after, &copied.before] {
            assert!(covers(row, (COMPUTE, A::SHADER_WRITE)), "{name}");
        }
        let copy = (S::TRANSFER, A::TRANSFER_READ);
        assert!(waits_for(&output.before, copy) && covers(&copied.after, copy), "{name}");
        assert_eq!(table.row("picture-to-host").carrier, Carrier::BufferBarrier, "{name}");
        if plan.shadow.is_some() {
            assert!(waits_for(&of(Place::Outside, Place::Shadow).before, (COMPUTE, A::SHADER_READ)), "{name}");
            assert!(covers(&of(Place::Shadow, Place::Tiled).after, (COMPUTE, A::SHADER_READ)), "{name}");
        }
        let names: BTreeSet<_> = table.iter().map(|edge| edge.name).collect();
        assert!(names.len() == table.iter().count() && table.iter().all(|edge| !edge.by_region), "{name}");
    }
}

#[test]
fn what_is_uploaded_has_its_rows_and_what_is_not_has_none() {
    each_plan(|name, plan, table| {
        let has = |row| table.find(row).is_some();
        let uploads = plan.uploads;
        assert_eq!(has("upload-to-vertices"), uploads.vertices || uploads.volumes, "{name}");
        assert_eq!((has("texture-to-copy"), has("upload-to-textures")), (uploads.textures, uploads.textures), "{name}");
        assert_eq!((has("level-to-blit"), has("blit-to-textures")), (uploads.mip_levels, uploads.mip_levels), "{name}");
        let order = table.upload_order();
        assert_eq!(order.buffers, table.find("upload-to-vertices").map(Edge::order), "{name}");
        assert_eq!(table.clear_order().is_some(), plan.shadow.is_some(), "{name}");
    });
}

#[test]
fn a_dropped_dependency_of_a_render_pass_is_gone_and_a_dropped_barrier_orders_nothing() {
    each_plan(|name, _, table| {
        for edge in table.iter() {
            let Ok(without) = table.without(edge.name) else {
                assert!(edge.carrier.stays().is_some(), "{name}: {}", edge.name);
                continue;
            };
            assert!(edge.carrier.stays().is_none(), "{name}: {}", edge.name);
            if edge.carrier.is_render_pass() {
                assert!(without.find(edge.name).is_none(), "{name}: {}", edge.name);
            } else {
                let left = without.row(edge.name);
                assert_eq!((left.before, left.after, left.carrier), (Use::START, Use::END, edge.carrier), "{name}");
            }
            assert!(without.iter().filter(|other| other.name != edge.name).all(|other| other == table.row(other.name)));
        }
    });
}

#[test]
fn a_bit_goes_with_what_only_it_supports() {
    let (_, plan) = samples::plans().into_iter().find(|(_, plan)| plan.has_geometry()).expect("a G-buffer");
    let table = table(&plan);
    let row = table.row("gbuffer-to-lighting");
    let without = |side, stage, access| {
        table.without_bits(row.name, side, Use::new(stage, access)).expect("a row").row(row.name).clone()
    };
    // Late tests still write what early ones did.
    let late = without(Side::Before, S::EARLY_FRAGMENT_TESTS, A::empty());
    assert_eq!(late.before, Use::new(row.before.stage & !S::EARLY_FRAGMENT_TESTS, row.before.access));
    // Nothing else writes colours.
    let no_color = without(Side::Before, S::COLOR_ATTACHMENT_OUTPUT, A::empty());
    assert_eq!(no_color.before.access, row.before.access & !A::COLOR_ATTACHMENT_WRITE);
    let blind = without(Side::After, S::empty(), A::DEPTH_STENCIL_ATTACHMENT_READ);
    assert_eq!(blind.after, Use::new(row.after.stage, row.after.access & !A::DEPTH_STENCIL_ATTACHMENT_READ));
    let nothing = without(Side::Before, row.before.stage, A::empty());
    assert_eq!((nothing.before, nothing.after), (Use::START, row.after));
}

#[test]
fn a_row_that_is_not_there_is_refused_with_a_suggestion_and_one_that_stays_with_its_reason() {
    let (_, plan) = samples::plans().remove(0);
    let table = table(&plan);
    let refused = table.without("picture-to-hosts").expect_err("no such row").to_string();
    assert!(refused.contains("did you mean \"picture-to-host\"?"), "{refused}");
    for name in ["host-to-frame", "frame-to-host", "copy-to-host", "last-use-to-destroy"] {
        let refused = table.without_bits(name, Side::After, Use::END).expect_err("it stays").to_string();
        assert!(refused.contains(name) && refused.contains("cannot be dropped"), "{refused}");
    }
}
