//! The rules, each on a few commands; `tests/sync/proof.rs` has the plans.

mod render_passes;
mod table;

use ash::vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};

use super::program::{MemorySet, QueueSet, Scope, Span, Sync, Who};
use super::*;
use afterlight::frame::rows::{self, Endpoint, RowName, Side, table};
use afterlight::gpu::sync::{DEVICE_ACCESS, Dependency, SyncVersion, Use};
use afterlight::passes::{Resource, copy, fxaa, geometry, lighting};
use afterlight::plan::{Target, samples};
use afterlight::scene::Passes;

const COPY_WRITE: Use = Use::new(S::TRANSFER, A::TRANSFER_WRITE);
const COPY_READ: Use = Use::new(S::TRANSFER, A::TRANSFER_READ);
const SAMPLE: Use = Use::new(S::FRAGMENT_SHADER, A::SHADER_READ);
const COLOR_WRITE: Use = Use::new(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
const FETCH: Use = Use::new(S::VERTEX_INPUT, A::VERTEX_ATTRIBUTE_READ);
const EARLY_WRITE: Use = Use::new(S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
const LATE_WRITE: Use = Use::new(S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
const HOST_READ: Use = Use::new(S::HOST, A::HOST_READ);
const HOST_WRITE: Use = Use::new(S::HOST, A::HOST_WRITE);
const BUFFER: L = L::UNDEFINED;

/// Only the stages.
fn bare(uses: Use) -> Use {
    Use::new(uses.stage, A::empty())
}

/// Returns the hazards of two touches of one buffer with these barriers between them, one after the other.
fn between(first: Use, barriers: &[(Use, Use)], second: Use) -> Vec<HazardKind> {
    let mut program = Program::default();
    program.command(Endpoint::UPLOAD, &[(Memory::of(Resource::Vertices), BUFFER, first)]);
    for &(before, after) in barriers {
        program.barrier(Dependency::between(before, after), None);
    }
    program.command(Endpoint::DRAWS, &[(Memory::of(Resource::Vertices), BUFFER, second)]);
    kinds(&program)
}

fn kinds(program: &Program) -> Vec<HazardKind> {
    hazards_of(program).map(|hazard| hazard.kind).collect()
}

const NONE: Vec<HazardKind> = Vec::new();

#[test]
fn a_write_must_be_available_and_visible_to_what_comes_after_it() {
    let hazard = vec![HazardKind::ReadAfterWrite];
    assert_eq!(between(COPY_WRITE, &[], SAMPLE), hazard);
    assert_eq!(between(COPY_WRITE, &[(COPY_WRITE, SAMPLE)], SAMPLE), NONE);
    assert_eq!(between(COPY_WRITE, &[(bare(COPY_WRITE), SAMPLE)], SAMPLE), hazard, "not available");
    assert_eq!(between(COPY_WRITE, &[(COPY_WRITE, bare(SAMPLE))], SAMPLE), hazard, "not visible");
    assert_eq!(between(COPY_WRITE, &[(COPY_WRITE, FETCH)], SAMPLE), hazard, "visible to another stage");
    assert_eq!(between(COPY_WRITE, &[], COPY_WRITE), [HazardKind::WriteAfterWrite]);
    assert_eq!(between(COPY_WRITE, &[(COPY_WRITE, COPY_WRITE)], COPY_WRITE), NONE);
}

#[test]
fn a_read_must_be_over_and_no_more_before_a_write() {
    let hazard = vec![HazardKind::WriteAfterRead];
    assert_eq!(between(SAMPLE, &[], COPY_WRITE), hazard);
    assert_eq!(between(SAMPLE, &[(bare(SAMPLE), bare(COPY_WRITE))], COPY_WRITE), NONE);
    assert_eq!(between(SAMPLE, &[], SAMPLE), NONE, "two readers need no order");
}

#[test]
fn a_first_scope_has_logically_earlier_stages_and_a_second_one_later_stages_for_execution_alone() {
    let (fetch, color) = (bare(FETCH), bare(COLOR_WRITE));
    assert_eq!(between(SAMPLE, &[(color, COPY_WRITE)], COPY_WRITE), NONE);
    assert_eq!(between(SAMPLE, &[(fetch, COPY_WRITE)], COPY_WRITE), [HazardKind::WriteAfterRead]);
    assert_eq!(between(COPY_READ, &[(COPY_READ, fetch)], COLOR_WRITE), NONE);
    assert_eq!(between(COPY_READ, &[(COPY_READ, Use::END)], COLOR_WRITE), [HazardKind::WriteAfterRead]);
    assert_eq!(between(SAMPLE, &[(Use::START, COPY_WRITE)], COPY_WRITE), [HazardKind::WriteAfterRead]);
    // Naming the late tests does not make early writes available.
    assert_eq!(between(EARLY_WRITE, &[(LATE_WRITE, SAMPLE)], SAMPLE), [HazardKind::ReadAfterWrite]);
    assert_eq!(between(EARLY_WRITE, &[(LATE_WRITE.or(EARLY_WRITE), SAMPLE)], SAMPLE), NONE);
}

#[test]
fn barriers_make_a_chain_where_their_scopes_meet() {
    let compute = Use::new(S::COMPUTE_SHADER, A::empty());
    assert_eq!(between(COPY_WRITE, &[(COPY_WRITE, compute), (compute, SAMPLE)], SAMPLE), NONE);
    let apart = [(COPY_WRITE, compute), (bare(FETCH), SAMPLE)];
    assert_eq!(between(COPY_WRITE, &apart, SAMPLE), [HazardKind::ReadAfterWrite]);
    let turned = [(compute, SAMPLE), (COPY_WRITE, compute)];
    assert_eq!(between(COPY_WRITE, &turned, SAMPLE), [HazardKind::ReadAfterWrite], "in another order");
    // The scopes meet at the fragment shader: it is later than the first barrier's second scope, and earlier than the second barrier's first scope.
    assert_eq!(between(COPY_WRITE, &[(COPY_WRITE, bare(FETCH)), (bare(COLOR_WRITE), SAMPLE)], SAMPLE), NONE);
}

#[test]
fn a_barrier_on_other_memory_orders_nothing_here() {
    let mut program = Program::default();
    program.command(Endpoint::UPLOAD, &[(Memory::of(Resource::Vertices), BUFFER, COPY_WRITE)]);
    program.barrier(Dependency::between(COPY_WRITE, FETCH), Some(Memory::of(Resource::Indices)));
    program.command(Endpoint::DRAWS, &[(Memory::of(Resource::Vertices), BUFFER, FETCH)]);
    assert_eq!(kinds(&program), [HazardKind::ReadAfterWrite]);
}

#[test]
fn a_dependency_by_region_orders_what_touches_its_own_pixel_alone() {
    for (local, expected) in
        [(Some(1), NONE), (None, vec![HazardKind::ReadAfterWrite]), (Some(2), vec![HazardKind::ReadAfterWrite])]
    {
        let mut program = Program::default();
        let touch = |program: &mut Program, uses: Use, local| {
            let (time, group) = (program.step(), program.group());
            let plain = program.plain(Memory::of(Resource::Vertices), Who::At(geometry::PASS.name), BUFFER);
            program.touch(&MemoryAccess { time, group, local, ..plain }, uses);
        };
        touch(&mut program, COLOR_WRITE, Some(1));
        let time = program.step();
        program.synchronize(Sync {
            first: Scope { span: Span::before(time), mask: COLOR_WRITE },
            second: Scope { span: Span::since(time), mask: SAMPLE },
            region: Some(1),
            by_sample: false,
            memory: None,
            is_whole: false,
            is_fence: false,
        });
        touch(&mut program, SAMPLE, local);
        assert_eq!(kinds(&program), expected, "{local:?}");
    }
}

/// Returns the hazards of a write of one sample and a read in a later subpass, with a row by region from each subpass to the next: by sample, or by pixel.
fn between_samples(reads_all: bool, rows_by_sample: &[bool]) -> Vec<HazardKind> {
    let mut program = Program::default();
    let touch = |program: &mut Program, time, uses, all_samples| {
        let group = program.group();
        let plain = program.plain(Memory::of(Resource::Vertices), Who::At(geometry::PASS.name), BUFFER);
        program.touch(&MemoryAccess { time, group, local: Some(1), all_samples, ..plain }, uses);
    };
    let last = rows_by_sample.len() as u32;
    touch(&mut program, 0, COLOR_WRITE, false);
    touch(&mut program, last, SAMPLE, reads_all);
    for (subpass, &by_sample) in (0..last).zip(rows_by_sample) {
        let of = |subpass| Span::between(subpass, subpass + 1);
        let waits = if subpass + 1 == last { SAMPLE } else { COLOR_WRITE };
        program.synchronize(Sync {
            first: Scope { span: of(subpass), mask: COLOR_WRITE },
            second: Scope { span: of(subpass + 1), mask: waits },
            region: Some(1),
            by_sample,
            memory: None,
            is_whole: false,
            is_fence: false,
        });
    }
    kinds(&program)
}

#[test]
fn a_dependency_by_sample_orders_no_reader_of_a_whole_pixel_but_one_by_pixel_in_its_chain_does() {
    let hazard = vec![HazardKind::ReadAfterWrite];
    assert_eq!(between_samples(false, &[true]), NONE, "its own sample");
    assert_eq!(between_samples(true, &[true]), hazard);
    assert_eq!(between_samples(true, &[false]), NONE);
    assert_eq!(between_samples(true, &[true, true]), hazard);
    assert_eq!(between_samples(true, &[false, true]), NONE, "all samples are over before the next subpass");
    assert_eq!(between_samples(true, &[true, false]), NONE);
}

/// A copy, a barrier or none, a fence or none, and the CPU.
fn to_host(barrier: Option<(Use, Use)>, waits: bool, host: Use) -> Vec<HazardKind> {
    let mut program = Program::default();
    let copy = if host == HOST_WRITE { COPY_READ } else { COPY_WRITE };
    program.command(copy::PASS.name, &[(Memory::of(Resource::ReadBack), BUFFER, copy)]);
    if let Some((before, after)) = barrier {
        program.barrier(Dependency::between(before, after), Some(Memory::of(Resource::ReadBack)));
    }
    if waits {
        let now = program.step();
        program.synchronize(Sync {
            first: Scope { span: Span::before(now), mask: DEVICE_ACCESS },
            second: Scope { span: Span::since(now).on(QueueSet::EVERY), mask: Use::new(S::HOST, A::empty()) },
            region: None,
            by_sample: false,
            memory: Some(MemorySet::from_iter([Memory::of(Resource::ReadBack)])),
            is_whole: true,
            is_fence: true,
        });
    }
    program.command(Endpoint::HOST, &[(Memory::of(Resource::ReadBack), BUFFER, host)]);
    kinds(&program)
}

#[test]
fn the_cpu_waits_by_a_fence_and_sees_by_a_barrier() {
    let barrier = Some((COPY_WRITE, HOST_READ));
    assert_eq!(to_host(barrier, true, HOST_READ), NONE);
    assert_eq!(to_host(None, true, HOST_READ), [HazardKind::ReadAfterWrite], "a fence makes nothing visible");
    assert_eq!(to_host(barrier, false, HOST_READ), [HazardKind::ReadAfterWrite], "a barrier does not make it wait");
    assert_eq!(to_host(None, true, HOST_WRITE), NONE, "what was read may be written");
    assert_eq!(to_host(None, false, HOST_WRITE), [HazardKind::WriteAfterRead]);
}

#[test]
fn a_layout_change_waits_and_is_waited_for_and_leaves_an_image_as_it_must_be() {
    let run = |order: Dependency, layouts: [L; 2]| {
        let mut program = Program::default();
        let [first, second] = [L::GENERAL, L::SHADER_READ_ONLY_OPTIMAL];
        program.barrier(Dependency::between(Use::START, COPY_WRITE), None);
        program.transition(
            (Who::Row(RowName::ImageReuse(Target::Output)), Memory::of(Resource::Target(Target::Output))),
            [L::UNDEFINED, first],
            vec![0],
            None,
        );
        program.command(copy::PASS.name, &[(Memory::of(Resource::Target(Target::Output)), first, COPY_WRITE)]);
        let sync = program.barrier(order, Some(Memory::of(Resource::Target(Target::Output))));
        program.transition(
            (Who::Row(RowName::READ_BACK), Memory::of(Resource::Target(Target::Output))),
            layouts,
            vec![sync],
            None,
        );
        program.command(fxaa::PASS.name, &[(Memory::of(Resource::Target(Target::Output)), second, SAMPLE)]);
        kinds(&program)
    };
    let layouts = [L::GENERAL, L::SHADER_READ_ONLY_OPTIMAL];
    let order = Dependency::between;
    assert_eq!(run(order(COPY_WRITE, SAMPLE), layouts), NONE);
    assert_eq!(run(order(bare(COPY_WRITE), SAMPLE), layouts), [HazardKind::ChangeAfterUse]);
    assert_eq!(run(order(COPY_WRITE, bare(SAMPLE)), layouts), [HazardKind::UseAfterChange]);
    assert_eq!(run(order(COPY_WRITE, SAMPLE), [L::UNDEFINED, layouts[1]]), NONE, "what it held is dropped");
    assert_eq!(run(order(COPY_WRITE, SAMPLE), [L::TRANSFER_DST_OPTIMAL, layouts[1]]), [HazardKind::Layout]);
    assert_eq!(run(order(COPY_WRITE, SAMPLE), [layouts[0], L::TRANSFER_SRC_OPTIMAL]), [HazardKind::Layout]);
}

#[test]
fn a_hazard_is_told_with_both_touches_and_the_memory() {
    let (_, plan) = samples::plans().into_iter().find(|(_, plan)| plan.has_geometry()).expect("a G-buffer");
    let input_read = Use::new(S::empty(), A::INPUT_ATTACHMENT_READ);
    let blind = table(&plan)
        .without_bits(RowName::Pair(geometry::PASS.name, lighting::PASS.name), Side::After, input_read)
        .expect("a row");
    let hazards = FrameModel::of(&plan, &blind).hazards();
    let told: Vec<String> = hazards.iter().map(ToString::to_string).collect();
    let begin = "use after layout change of the target Albedo: nothing orders the change from";
    let end = "before LIGHTING in frame 1 (FRAGMENT_SHADER, INPUT_ATTACHMENT_READ)";
    assert!(told.iter().any(|line| line.starts_with(begin) && line.ends_with(end)), "{told:#?}");
}

#[test]
fn the_dispatch_of_formulas_has_what_it_needs_and_no_more() {
    let rows = rows::formulas();
    assert!(FrameModel::of_formulas(&rows).are_safe());
    for part in rows.find(RowName::RESULTS_TO_HOST).expect("a row").parts() {
        let without = rows.without_part(RowName::RESULTS_TO_HOST, part).expect("it can be dropped");
        let kinds: Vec<_> = FrameModel::of_formulas(&without).hazards().iter().map(|hazard| hazard.kind).collect();
        assert_eq!(kinds, [HazardKind::ReadAfterWrite], "{part:?}");
    }
}

#[test]
fn rows_of_another_plan_leave_hazards_and_name_them() {
    let plans = samples::plans();
    let of = |wanted: bool| plans.iter().find(|(_, plan)| plan.shadow.is_some() == wanted).expect("a plan");
    let (with, without) = (&of(true).1, table(&of(false).1));
    let hazards = FrameModel::of(with, &without).hazards();
    let told: Vec<String> = hazards.iter().map(ToString::to_string).collect();
    assert!(told.iter().any(|line| line.starts_with("wrong layout of shadow map 0: CLEAR")), "{told:#?}");
}

/// Returns the hazards of a write by a copy, and a dispatch on another queue that reads it. `steps` come between the two.
fn across(steps: impl Fn(&mut Program)) -> Vec<HazardKind> {
    let mut program = Program::default();
    program.command(Endpoint::UPLOAD, &[(Memory::of(Resource::Vertices), BUFFER, COPY_WRITE)]);
    steps(&mut program);
    program.queue = Queue::Compute;
    program.command(Endpoint::DRAWS, &[(Memory::of(Resource::Vertices), BUFFER, DISPATCH_READ)]);
    kinds(&program)
}

const DISPATCH_READ: Use = Use::new(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ);
const THERE: [Queue; 2] = [Queue::Graphics, Queue::Compute];

/// A half of a transfer to the compute queue.
fn hand(program: &mut Program, half: Half, before: Use, after: Use) {
    let row = (RowName::ownership(THERE), Dependency::between(before, after));
    program.hand_over(row, (half, THERE), &[(Memory::of(Resource::Vertices), BUFFER)]);
}

fn signal(program: &mut Program, waits: Use) {
    program.queue = Queue::Compute;
    let until = program.step();
    program.semaphore(Dependency::between(DEVICE_ACCESS, waits), until, THERE);
}

#[test]
fn what_crosses_queues_needs_a_release_a_semaphore_and_an_acquire() {
    let all = |released: Use, waits: Use, acquired: Use| {
        across(|program| {
            hand(program, Half::Release, released, acquired);
            signal(program, waits);
            hand(program, Half::Acquire, released, acquired);
        })
    };
    assert_eq!(all(COPY_WRITE, bare(DISPATCH_READ), DISPATCH_READ), NONE);
    assert_eq!(
        all(bare(COPY_WRITE), bare(DISPATCH_READ), DISPATCH_READ),
        [HazardKind::ChangeAfterUse],
        "not available"
    );
    assert_eq!(all(SAMPLE, bare(DISPATCH_READ), DISPATCH_READ), [HazardKind::ChangeAfterUse], "another stage's write");
    assert_eq!(
        all(COPY_WRITE, bare(DISPATCH_READ), bare(DISPATCH_READ)),
        [HazardKind::UseAfterChange],
        "not visible to the read"
    );
    let acquire_is_too_soon = all(COPY_WRITE, bare(COPY_READ), DISPATCH_READ);
    assert_eq!(acquire_is_too_soon, [HazardKind::ChangeAfterUse], "the wait holds back another stage");
}

#[test]
fn half_a_transfer_leaves_contents_with_another_queue() {
    let without_a_semaphore = across(|program| {
        hand(program, Half::Release, COPY_WRITE, DISPATCH_READ);
        program.queue = Queue::Compute;
        hand(program, Half::Acquire, COPY_WRITE, DISPATCH_READ);
    });
    assert_eq!(without_a_semaphore, [HazardKind::ChangeAfterUse]);
    let not_acquired = across(|program| {
        hand(program, Half::Release, COPY_WRITE, DISPATCH_READ);
        signal(program, DISPATCH_READ);
    });
    assert_eq!(not_acquired, [HazardKind::Owner]);
    let not_released = across(|program| {
        signal(program, DISPATCH_READ);
        hand(program, Half::Acquire, COPY_WRITE, DISPATCH_READ);
    });
    assert_eq!(not_released, [HazardKind::Owner]);
    let kept = across(|program| signal(program, DISPATCH_READ));
    assert_eq!(
        kept,
        [HazardKind::Owner],
        "the semaphore makes the write visible, and the contents are another queue's"
    );
}

#[test]
fn a_barrier_orders_its_own_queue_alone() {
    let barrier_on = |queue: Queue| {
        across(|program| {
            program.queue = queue;
            program.barrier(Dependency::between(COPY_WRITE, DISPATCH_READ), None);
        })
    };
    let hazards = vec![HazardKind::Owner, HazardKind::ReadAfterWrite];
    assert_eq!(barrier_on(Queue::Graphics), hazards);
    assert_eq!(barrier_on(Queue::Compute), hazards);
}

/// Wider rows order all that the table orders, and still frames are not the same to the proof.
#[test]
fn frames_with_wider_rows_have_no_hazard() {
    let carried = [
        (Passes::Subpasses, SyncVersion::One),
        (Passes::LocalRead, SyncVersion::Two),
        (Passes::Stored, SyncVersion::One),
    ];
    for (index, (name, mut plan)) in samples::of_every_kind().into_iter().step_by(7).enumerate() {
        (plan.passes, plan.sync) = carried[index % carried.len()];
        let table = table(&plan);
        let hazards = |rows: &Rows| FrameModel::of(&plan, rows).hazards();
        let all = table.all_widened(&plan);
        assert!(hazards(&all).is_empty(), "{name}: {:?}", hazards(&all));
        for (own, wide) in table.iter().zip(all.iter()) {
            let stays = own.carrier.stays().is_some();
            assert_eq!(own == wide, stays, "{name}: {}", own.name);
            assert_eq!(table.widened(&plan, own.name).is_err(), stays, "{name}: {}", own.name);
            let is_inside = wide.by_region;
            assert!(!is_inside || plan.passes == Passes::LocalRead, "{name}: {}", own.name);
        }
        // One of them at a time is another frame as well.
        let Some(one) = table.iter().filter(|row| row.carrier.stays().is_none()).nth(index % 5) else { continue };
        let widened = table.widened(&plan, one.name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(widened.iter().zip(table.iter()).filter(|(wide, own)| wide != own).count(), 1, "{name}");
        assert!(hazards(&widened).is_empty(), "{name}: {}: {:?}", one.name, hazards(&widened));
    }
}
