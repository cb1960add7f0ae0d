//! Dependencies, the table's rows and the list of passes agree.

use super::*;

#[test]
fn dependencies_are_the_rows_of_the_table() {
    for (name, plan) in samples::plans() {
        let last = main_pass(&plan).subpasses.len() as u32 - 1;
        let all = dependencies(&plan, main_name(&plan));
        let rows = rows::table(&plan).of(SyncKind::Subpass(main_name(&plan))).count();
        assert_eq!(all.len(), rows, "{name}");
        for &(ref row, [from, to]) in &all {
            let inside = |index| index <= last || index == vk::SUBPASS_EXTERNAL;
            assert!(inside(from) && inside(to) && from != to, "{name}: {from} to {to}");
            assert!(from < to || from == vk::SUBPASS_EXTERNAL, "{name}: {from} to {to}");
            assert!(row.before.stage != vk::PipelineStageFlags2::empty(), "{name}");
        }
        let shadow = dependencies(&plan, SHADOW_PASS);
        assert_eq!(shadow.is_empty(), plan.shadow.is_none(), "{name}");
        // Dependencies lead into the one subpass and out of it.
        let ends: Vec<_> = shadow.iter().map(|&(_, ends)| ends).collect();
        assert!(
            ends.iter().all(|ends| matches!(ends, [vk::SUBPASS_EXTERNAL, 0] | [0, vk::SUBPASS_EXTERNAL])),
            "{name}"
        );
    }
}

#[test]
fn the_list_and_the_rows_of_every_plan_agree() {
    for (name, plan) in samples::of_every_kind() {
        StepList::of(&plan).check(&plan, &rows::table(&plan)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let touched: BTreeSet<Target> = StepList::of(&plan)
            .0
            .iter()
            .flat_map(|step| step.touches(&plan))
            .filter_map(|touch| match touch.resource {
                Resource::Target(target) => Some(target),
                _ => None,
            })
            .collect();
        assert_eq!(touched, plan.targets().collect(), "{name}: a target that no pass touches, or that the plan lacks");
    }
}

/// A render pass of two subpasses with these touches, called GEOMETRY and LIGHTING.
fn two(first: Vec<ResourceUse>, second: Vec<ResourceUse>) -> StepList {
    let subpass = |place, touches| Listed { place, passes: Vec::new(), touches };
    let subpasses = vec![subpass(geometry::PASS.name, first), subpass(lighting::PASS.name, second)];
    StepList(vec![Step::RenderPass(RenderPassName::of(geometry::PASS.name), subpasses)])
}

#[test]
fn passes_that_cannot_be_one_render_pass_are_refused_with_their_names() {
    use ContentsIfFirst::Undefined;
    let (_, plan) =
        samples::plans().into_iter().find(|(_, plan)| plan.gbuffer.is_some() && plan.hdr.is_none()).expect("a plan");
    let rows = rows::formulas();
    let depth = || ResourceUse::depth(ContentsIfFirst::Clear, geometry::DEPTH_TEST);
    let color = |location, target| ResourceUse::color(location, target, Undefined, geometry::COLOR_WRITE);
    let input = |target| ResourceUse::input(0, target, lighting::GBUFFER_READ);
    let (albedo, normal) = (Target::Albedo, Target::Normal);
    let cases = [
        (
            vec![color(0, albedo)],
            vec![ResourceUse::sampled(0, albedo, fxaa::OUTPUT_READ)],
            ["LIGHTING", "neighbours", "albedo"],
        ),
        (vec![color(0, Target::Hdr)], vec![], ["GEOMETRY", "does not have", "hdr"]),
        (vec![color(0, albedo)], vec![input(normal)], ["LIGHTING", "no pass before", "normal"]),
        (vec![], vec![ResourceUse::depth(Undefined, lighting::DEPTH_READ)], ["LIGHTING", "no pass before", "depth"]),
        (vec![color(0, albedo)], vec![input(albedo), color(0, albedo)], ["LIGHTING", "two layouts", "albedo"]),
        (vec![depth()], vec![input(Target::Depth), depth()], ["LIGHTING", "two layouts", "depth"]),
        (vec![color(1, albedo), color(1, normal)], vec![], ["GEOMETRY", "location 1", "normal"]),
        (
            vec![ResourceUse::color(0, albedo, Undefined, lighting::GBUFFER_READ)],
            vec![],
            ["GEOMETRY", "says of its access", "albedo"],
        ),
        (
            vec![color(0, albedo)],
            vec![ResourceUse::input(0, albedo, geometry::COLOR_WRITE)],
            ["LIGHTING", "says of its access", "albedo"],
        ),
    ];
    for (first, second, words) in cases {
        let refused = two(first, second).check(&plan, &rows).expect_err("refused").to_string();
        assert!(words.iter().all(|word| refused.contains(word)), "{refused}");
    }
    let fits = two(vec![depth()], vec![input(Target::Depth), ResourceUse::depth(Undefined, lighting::DEPTH_READ)]);
    fits.check(&plan, &rows).expect("reads what was written");
}

#[test]
fn a_row_that_names_no_pass_of_the_plan_is_refused() {
    let of = |plans: Vec<(String, FramePlan)>| plans.into_iter().next().expect("a plan").1;
    let (forward, deferred) = (of(samples::forward_plans()), of(samples::plans()));
    let tiled = of(samples::tiled_plans());
    // The rows of another plan: of its render pass, and of its barriers.
    for (plan, rows, words) in
        [(&forward, &deferred, ["geometry-reuse", "GEOMETRY"]), (&deferred, &tiled, ["output-reuse", "TILED"])]
    {
        let error = StepList::of(plan).check(plan, &rows::table(rows)).expect_err("rows of another plan").to_string();
        assert!(words.iter().any(|word| error.contains(word)) && error.contains("the row"), "{error}");
    }
}

#[test]
fn every_change_of_layout_is_ordered_by_a_row_between_the_uses_that_it_is_between() {
    let all = samples::of_every_kind();
    for (name, plan) in all {
        let rows = rows::table(&plan);
        let passes = PassDescription::all(&plan, &rows);
        let mut changed = 0;
        for pass in &passes {
            for (ends, change) in pass.layout_changes() {
                let ordered = pass.dependencies.iter().any(|(_, own)| *own == ends);
                assert!(ordered, "{name}: no row of the {} orders {change} between {ends:?}", pass.name);
                changed += 1;
            }
        }
        let of_render_passes = rows.iter().filter(|row| row.carrier.is_render_pass());
        let told: usize = of_render_passes.map(|row| layout_changes(&plan, &rows, row).len()).sum();
        assert_eq!(told, changed, "{name}");
        let read_back = layout_changes(&plan, &rows, rows.find(rows::RowName::READ_BACK).expect("a row"));
        assert_eq!(read_back.last().map(|change| change.new), Some(vk::ImageLayout::TRANSFER_SRC_OPTIMAL), "{name}");
    }
}
