//! Properties of the table itself. That its rows are enough, and needed, is for the proof.

use std::cell::Cell;
use std::collections::BTreeSet;

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use afterlight::frame::list::StepList;
use afterlight::frame::rows::*;
use afterlight::gpu::sync::Use;
use afterlight::passes::{Resource, UseKind, geometry, lighting};
use afterlight::plan::{FramePlan, samples};

fn each_plan(check: impl Fn(&str, &FramePlan, &Rows)) {
    for (name, plan) in samples::of_every_kind() {
        check(&name, &plan, &table(&plan));
    }
}

#[test]
fn names_are_unique_and_every_row_says_why() {
    each_plan(|name, _, table| {
        let names: BTreeSet<_> = table.iter().map(|row| row.name).collect();
        assert_eq!(names.len(), table.iter().count(), "{name}");
        for row in table.iter() {
            // A pass that gives no reason for a touch leaves its own name alone there.
            let says = |part: &str| part.split(' ').filter(|word| !word.is_empty()).count() > 1;
            assert!(row.why.split("; ").all(says), "{name}: {} says \"{}\"", row.name, row.why);
        }
    });
}

#[test]
fn one_row_a_pair_of_places() {
    each_plan(|name, _, table| {
        for (index, row) in table.iter().enumerate().filter(|(_, row)| row.carrier.is_render_pass()) {
            let same = |other: &&Row| {
                (other.from, other.to) == (row.from, row.to)
                    && std::mem::discriminant(&other.carrier) == std::mem::discriminant(&row.carrier)
            };
            assert_eq!(table.iter().position(|other| same(&other)), Some(index), "{name}: {}", row.name);
        }
    });
}

#[test]
fn every_access_is_one_that_a_stage_of_its_mask_supports_and_every_stage_that_must_wait_has_one() {
    each_plan(|name, _, table| {
        for (row, side) in table.iter().flat_map(|row| [(row, Side::Before), (row, Side::After)]) {
            let one = row.side(side);
            let named = SUPPORTED.iter().filter(|(access, _)| one.access.contains(*access));
            let (mut accesses, mut stages) = (A::empty(), S::empty());
            for &(access, supporting) in named {
                assert!(one.stage.intersects(supporting), "{name}: {}: {access:?} without its stage", row.name);
                (accesses, stages) = (accesses | access, stages | supporting);
            }
            assert_eq!(accesses, one.access, "{name}: {}: an access that the table does not know", row.name);
            // A wait for a stage that only read needs no access, and the CPU frees memory without looking at it.
            // A write after reads alone needs no access either, where another row has made all else visible.
            let bare = side == Side::Before || row.name == RowName::LAST_USE_TO_DESTROY;
            assert!(!one.stage.is_empty(), "{name}: {}: no stage", row.name);
            assert!(bare || stages.contains(one.stage), "{name}: {}: a stage that does nothing", row.name);
            assert!(side == Side::After || one == one.writes(), "{name}: {}: a read made available", row.name);
        }
    });
}

#[test]
fn rows_are_by_region_between_subpasses_and_nowhere_else() {
    each_plan(|name, plan, table| {
        let list = StepList::of(plan);
        for row in table.iter() {
            let ends = [row.from, row.to].map(|place| list.find(place).map(|(pass, _)| pass));
            let is_between = row.carrier.is_render_pass() && ends[0].is_some() && ends[0] == ends[1];
            assert_eq!(row.is_between_subpasses(), is_between, "{name}: {}", row.name);
        }
    });
}

#[test]
fn rows_are_across_samples_where_one_side_reads_them_all_and_both_draw_as_many() {
    let tried = Cell::new(0);
    each_plan(|name, plan, table| {
        let list = StepList::of(plan);
        let reads_all =
            |place| list.passes_at(place).iter().any(|pass| pass.uses(plan).iter().any(|own| own.all_samples));
        let drawn = |place| {
            let touches = list.passes_at(place).into_iter().flat_map(|pass| pass.uses(plan));
            let mut targets = touches.filter_map(|own| match (own.how, own.resource) {
                (UseKind::Color { .. }, Resource::Target(target)) => Some(plan.samples_of(target)),
                _ => None,
            });
            targets.next()
        };
        for row in table.iter() {
            let between = row.is_between_subpasses() && plan.msaa > 1;
            assert!(!row.across_samples || between, "{name}: {}", row.name);
            let expected = between && row.to == lighting::PASS.name && row.from == geometry::PASS.name;
            // Where the two draw different numbers of samples, a region is a pixel with all of them.
            let is_across = reads_all(row.to) && drawn(row.from) == drawn(row.to);
            assert!(!expected || row.across_samples == is_across, "{name}: {}", row.name);
            assert!(!row.across_samples || !row.by_region, "{name}: {}", row.name);
            tried.set(tried.get() + u32::from(expected));
        }
    });
    assert!(tried.get() > 3, "{} rows", tried.get());
}

#[test]
fn a_dropped_dependency_of_a_render_pass_is_gone_and_a_dropped_barrier_orders_nothing() {
    each_plan(|name, _, table| {
        for row in table.iter() {
            let Ok(without) = table.without(row.name) else {
                assert!(row.carrier.stays().is_some(), "{name}: {}", row.name);
                continue;
            };
            assert!(row.carrier.stays().is_none(), "{name}: {}", row.name);
            if row.carrier.is_render_pass() {
                assert!(without.find(row.name).is_none(), "{name}: {}", row.name);
            } else {
                let left = without.find(row.name).expect("a row");
                assert_eq!((left.before, left.after, left.carrier), (Use::START, Use::END, row.carrier), "{name}");
            }
            assert!(
                without
                    .iter()
                    .filter(|other| other.name != row.name)
                    .all(|other| other == table.find(other.name).expect("a row"))
            );
        }
    });
}

#[test]
fn a_bit_goes_with_what_only_it_supports() {
    let (_, plan) = samples::plans().into_iter().find(|(_, plan)| plan.has_geometry()).expect("a G-buffer");
    let table = table(&plan);
    let row = table.find(RowName::Pair(geometry::PASS.name, lighting::PASS.name)).expect("a row");
    let without = |side, stage, access| {
        table
            .without_bits(row.name, side, Use::new(stage, access))
            .expect("a row")
            .find(row.name)
            .expect("a row")
            .clone()
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
    let refused = table.named("picture-to-hosts", |_| true).expect_err("no such row").to_string();
    assert!(refused.contains("did you mean \"picture-to-host\"?"), "{refused}");
    for name in [RowName::HOST_TO_FRAME, RowName::FRAME_TO_HOST, RowName::COPY_TO_HOST, RowName::LAST_USE_TO_DESTROY] {
        let refused = table.without_bits(name, Side::After, Use::END).expect_err("it stays").to_string();
        assert!(refused.contains(name.name()) && refused.contains("cannot be dropped"), "{refused}");
    }
}
