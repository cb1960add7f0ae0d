use std::collections::{BTreeMap, BTreeSet};

use super::*;
use crate::frame::edges;
use crate::passes::view;
use crate::plan::{self, Shading, samples};
use crate::shaders::{self, Binding, BindingKind, NumberKind, Variant};
use crate::targets::{COMPOSITE_INPUTS, gbuffer_inputs, light_target};

/// The variant that LIGHTING, or VIEW in its place, takes.
fn lighting_variant(plan: &FramePlan) -> &'static Variant {
    let variant = match plan.shading {
        Shading::Light { .. } => shaders::lighting::variant(lighting::flags(plan)),
        _ => shaders::view::variant(view::flags(plan)),
    };
    variant.expect("a variant of the shader")
}

fn fragment_bindings(variant: &Variant) -> &'static [Binding] {
    variant.fragment().expect("a fragment stage").bindings
}

/// Reflected input attachments: `pInputAttachments` index to binding.
fn reflected_inputs(variant: &Variant) -> BTreeMap<u32, (u32, u32)> {
    let inputs = fragment_bindings(variant).iter().filter_map(|binding| match binding.kind {
        BindingKind::InputAttachment { index } => Some((index, (binding.set, binding.binding))),
        _ => None,
    });
    inputs.collect()
}

/// The targets of a plan's main pass in its order, and its subpasses.
struct References {
    order: Vec<Target>,
    subpasses: Vec<Subpass>,
    absent: Subpass,
}

impl References {
    fn of(plan: &FramePlan) -> Self {
        let order = attachments(plan).iter().map(|attachment| attachment.target).collect();
        Self { order, subpasses: main_subpasses(plan), absent: Subpass::at(Place::Outside) }
    }

    /// A subpass, or one that touches nothing.
    fn at(&self, place: Place) -> &Subpass {
        self.subpasses.iter().find(|own| own.place == place).unwrap_or(&self.absent)
    }

    /// Where samples are resolved to, after whichever subpass.
    fn resolve(&self) -> &Vec<vk::AttachmentReference> {
        let all = self.subpasses.iter().map(|own| &own.resolve);
        all.max_by_key(|resolve| resolve.len()).unwrap_or(&self.absent.resolve)
    }

    /// The subpass that first lights opaque surfaces.
    fn lit(&self) -> &Subpass {
        self.subpasses.iter().find(|own| own.place == Place::Forward).unwrap_or_else(|| self.at(Place::Lighting))
    }
}

fn name_of(refs: &References, reference: &vk::AttachmentReference) -> Option<Target> {
    refs.order.get(reference.attachment as usize).copied()
}

#[test]
fn geometry_writes_exactly_the_attachments_at_its_locations() {
    for (name, plan) in samples::plans() {
        let refs = References::of(&plan);
        let bound: BTreeSet<u32> = (0..)
            .zip(&refs.at(Place::Geometry).color)
            .filter(|(_, reference)| reference.attachment != vk::ATTACHMENT_UNUSED)
            .map(|(location, _)| location)
            .collect();
        assert_eq!(refs.at(Place::Geometry).color.len(), plan.geometry_locations() as usize, "{name}");
        for &key in &plan.geometry {
            let variant = shaders::geometry::variant(geometry::flags(&plan, key)).expect("a variant");
            let outputs = variant.fragment().expect("a fragment stage").fragment_outputs;
            let written: BTreeSet<u32> = outputs.iter().map(|output| output.location).collect();
            assert_eq!(written, bound, "{name} {key:?}");
            for output in outputs {
                let target =
                    name_of(&refs, &refs.at(Place::Geometry).color[output.location as usize]).expect("a target");
                let all = attachments(&plan);
                let format = all.iter().find(|attachment| attachment.target == target).expect("an attachment").format;
                let integer = [vk::Format::R16G16_UINT, vk::Format::R32G32_UINT].contains(&format);
                assert_eq!(output.kind == NumberKind::Uint, integer, "{name}: {target:?}");
                let expected = expected_target(output.name, &plan);
                assert_eq!(target, expected, "{name}: {} goes to another target", output.name);
            }
        }
    }
}

/// By the names in `shaders/geometry.wgsl`.
fn expected_target(output: &str, plan: &FramePlan) -> Target {
    match output {
        "albedo" => Target::Albedo,
        "normal" => Target::Normal,
        "material" => Target::Material,
        "specular" => Target::Specular,
        "position" => Target::Position,
        "emissive" => light_target(plan),
        // OVERDRAW and TRIANGLE return one plain value.
        _ if plan.shading == Shading::ShowTriangle => Target::Triangle,
        _ => Target::Count,
    }
}

#[test]
fn input_attachments_lie_at_the_index_and_binding_that_the_shader_reads() {
    for (name, plan) in samples::plans() {
        let refs = References::of(&plan);
        let inputs = gbuffer_inputs(&plan);
        let variant = lighting_variant(&plan);
        let reflected = reflected_inputs(variant);
        let described: BTreeMap<u32, (u32, u32)> =
            (0..).zip(&inputs).map(|(index, &(binding, _))| (index, (1, binding))).collect();
        assert_eq!(reflected, described, "{name}");
        assert_eq!(refs.lit().input.len(), inputs.len(), "{name}");
        for ((_, target), reference) in inputs.iter().zip(&refs.lit().input) {
            assert_eq!(name_of(&refs, reference), Some(*target), "{name}");
            assert_eq!(reference.layout, Touch::Input(*target).layout(), "{name}");
        }
        let marked =
            fragment_bindings(variant).iter().filter(|b| matches!(b.kind, BindingKind::InputAttachment { .. }));
        for binding in marked {
            let target = inputs.iter().find(|input| input.0 == binding.binding).expect("described").1;
            let wanted = format!("subpass_{target:?}").to_lowercase();
            assert_eq!(binding.name, wanted, "{name}: another target than the shader means");
        }
    }
}

#[test]
fn tonemap_reads_the_hdr_target_and_writes_the_output() {
    let tonemap = shaders::tonemap::variant(shaders::tonemap::Flags::NONE).expect("a variant");
    assert_eq!(reflected_inputs(tonemap), BTreeMap::from([(0, (0, 0))]));
    for (name, plan) in samples::plans() {
        let refs = References::of(&plan);
        assert_eq!(subpass_index(&plan, Place::Tonemap).is_some(), plan.hdr.is_some(), "{name}");
        let names = |list: &[vk::AttachmentReference]| list.iter().map(|r| name_of(&refs, r)).collect::<Vec<_>>();
        let (input, color) = match plan.hdr {
            Some(_) => (vec![Some(Target::Hdr)], vec![Some(Target::Output)]),
            None => (vec![], vec![]),
        };
        assert_eq!(
            (names(&refs.at(Place::Tonemap).input), names(&refs.at(Place::Tonemap).color)),
            (input, color),
            "{name}"
        );
        assert_eq!(names(&refs.lit().color), [Some(light_target(&plan))], "{name}");
    }
}

#[test]
fn transparent_surfaces_go_over_the_light_or_into_sums_that_composite_reads() {
    let composite = shaders::composite::variant(shaders::composite::Flags::NONE).expect("a variant");
    assert_eq!(reflected_inputs(composite), BTreeMap::from([(0, (0, 0)), (1, (0, 1))]));
    for binding in fragment_bindings(composite) {
        let target = COMPOSITE_INPUTS[binding.binding as usize].1;
        assert_eq!(binding.name, format!("subpass_{target:?}").to_lowercase());
    }
    let mut seen = BTreeSet::new();
    for (name, plan) in samples::plans() {
        let refs = References::of(&plan);
        let names = |list: &[vk::AttachmentReference]| list.iter().map(|r| name_of(&refs, r)).collect::<Vec<_>>();
        let sums = [Some(Target::Accumulation), Some(Target::Weights)];
        let light = [Some(light_target(&plan))];
        let drawn = names(&refs.at(Place::Transparent).color);
        let kept: Vec<_> =
            refs.at(Place::Transparent).preserve.iter().map(|&index| refs.order[index as usize]).collect();
        match plan.transparency {
            Some(Transparency::Sorted) => assert_eq!((drawn, kept), (light.to_vec(), vec![]), "{name}"),
            Some(Transparency::Oit) => assert_eq!((drawn, kept), (sums.to_vec(), vec![light_target(&plan)]), "{name}"),
            None => assert_eq!((drawn, kept), (vec![], vec![]), "{name}"),
        }
        let oit = plan.transparency == Some(Transparency::Oit);
        assert_eq!(names(&refs.at(Place::Composite).input), if oit { sums.to_vec() } else { vec![] }, "{name}");
        assert_eq!(
            [Place::Transparent, Place::Composite].map(|place| subpass_index(&plan, place).is_some()),
            [plan.transparency.is_some(), oit]
        );
        for &key in &plan.transparent {
            let variant = shaders::forward::variant(transparent::flags(&plan, key)).expect("a variant");
            let bindings = fragment_bindings(variant);
            let has = |set, index| bindings.iter().any(|binding| (binding.set, binding.binding) == (set, index));
            assert_eq!((has(0, 1), has(2, 0)), (plan.lights.any(), plan.shadow.is_some()), "{name} {key:?}");
            let textured = bindings.iter().any(|binding| binding.set == 1);
            assert!(!textured || !key.textures.is_empty() && plan.streams.uvs, "{name} {key:?}");
        }
        seen.insert((plan.transparency.is_some(), oit, plan.hdr.is_some()));
    }
    assert_eq!(seen.iter().filter(|(transparent, ..)| *transparent).count(), 4, "{seen:?}");
}

#[test]
fn a_forward_frame_has_nothing_of_a_gbuffer() {
    for (name, plan) in samples::forward_plans() {
        let refs = References::of(&plan);
        let indices = [Place::Geometry, Place::Lighting, Place::Forward].map(|place| subpass_index(&plan, place));
        assert_eq!(indices, [None, None, Some(0)], "{name}");
        assert!(refs.lit().input.is_empty(), "{name}");
        assert!(!plan.geometry.iter().any(|key| key.forward.is_none()), "{name}");
        let allowed =
            [Target::Depth, Target::Accumulation, Target::Weights, Target::Hdr, Target::Samples, Target::Output];
        assert!(refs.order.iter().all(|target| allowed.contains(target)), "{name}: {:?}", refs.order);
        assert_eq!(plan.hdr.is_some(), plan.has_tonemap_subpass(), "{name}");
        let depth = attachments(&plan).into_iter().find(|a| a.target == Target::Depth).expect("depth");
        // The layout that its last subpass uses it in.
        let last = match plan.transparency.is_none() {
            true => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            false => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        };
        assert_eq!(depth.final_layout, last, "{name}");
        for &key in &plan.geometry {
            let variant = shaders::forward::variant(forward::flags(&plan, key)).expect("a variant");
            let bindings = fragment_bindings(variant);
            let has = |set, index| bindings.iter().any(|binding| (binding.set, binding.binding) == (set, index));
            assert_eq!((has(0, 1), has(2, 0)), (plan.lights.any(), plan.shadow.is_some()), "{name} {key:?}");
            assert_eq!(has(0, 2), plan.has_clusters(), "{name} {key:?}");
            let outputs = variant.fragment().expect("a fragment stage").fragment_outputs;
            assert_eq!((outputs.len(), outputs[0].location), (1, 0), "{name} {key:?}");
        }
        let rows = edges::table(&plan).of(Carrier::MainPass).count();
        assert_eq!(dependencies(&plan, &edges::table(&plan), Carrier::MainPass).len(), rows, "{name}");
    }
}

#[test]
fn full_screen_passes_write_one_colour() {
    for (name, plan) in samples::plans() {
        let outputs = lighting_variant(&plan).fragment().expect("a fragment stage").fragment_outputs;
        let locations: Vec<u32> = outputs.iter().map(|output| output.location).collect();
        assert_eq!(locations, [0], "{name}");
        assert_eq!(References::of(&plan).lit().color.len(), 1, "{name}");
    }
}

#[test]
fn shaders_bind_the_lights_and_the_shadow_map_where_the_plan_has_them() {
    for (name, plan) in samples::plans() {
        let bindings = fragment_bindings(lighting_variant(&plan));
        let has = |set, index| bindings.iter().any(|binding| (binding.set, binding.binding) == (set, index));
        assert_eq!(has(0, 1), plan.lights.any(), "{name}: lights");
        assert_eq!((has(2, 0), has(2, 1)), (plan.shadow.is_some(), plan.shadow.is_some()), "{name}: shadow maps");
        let lists = has(0, 2) && has(0, 3);
        assert_eq!(lists, plan.lights_by_clusters(), "{name}: clusters");
        assert!(bindings.iter().all(|b| matches!((b.set, b.binding), (0, 0..=3) | (1, _) | (2, 0 | 1))), "{name}");
    }
}

#[test]
fn material_textures_are_bound_by_pipelines_that_sample_some() {
    for (name, plan) in samples::plans() {
        for &key in &plan.geometry {
            let variant = shaders::geometry::variant(geometry::flags(&plan, key)).expect("a variant");
            let textured = fragment_bindings(variant).iter().any(|binding| binding.set == 1);
            assert!(!textured || !key.textures.is_empty(), "{name} {key:?}");
            assert!(!textured || plan.streams.uvs, "{name} {key:?}");
        }
    }
}

#[test]
fn no_attachment_is_missing_unused_or_there_twice() {
    for (name, plan) in samples::plans() {
        let refs = References::of(&plan);
        let distinct: BTreeSet<_> = refs.order.iter().collect();
        assert_eq!(distinct.len(), refs.order.len(), "{name}");
        let lists = [
            &refs.at(Place::Geometry).color,
            &refs.lit().input,
            &refs.lit().color,
            &refs.at(Place::Transparent).color,
            &refs.at(Place::Composite).input,
            refs.resolve(),
            &refs.at(Place::Tonemap).input,
            &refs.at(Place::Tonemap).color,
        ];
        let mut used: BTreeSet<Target> = lists.into_iter().flatten().filter_map(|r| name_of(&refs, r)).collect();
        used.extend(plan.has_geometry().then_some(Target::Depth));
        assert_eq!(used, refs.order.iter().copied().collect(), "{name}");
        // Only GEOMETRY's locations may have gaps.
        let gap = |list: &[vk::AttachmentReference]| list.iter().any(|r| r.attachment == vk::ATTACHMENT_UNUSED);
        assert!(!lists[1..].iter().any(|list| gap(list)), "{name}");
    }
}

#[test]
fn a_gap_between_locations_is_unused_and_not_another_target() {
    let scene = samples::scene(vec![samples::material(crate::scene::Brdf::Phong)], vec![samples::sky()]);
    let plan = FramePlan::of(&scene, &samples::deferred(), &samples::device()).expect("a plan");
    let refs = References::of(&plan);
    let targets: Vec<_> = refs.at(Place::Geometry).color.iter().map(|reference| name_of(&refs, reference)).collect();
    // Location 3 is emissive light's.
    assert_eq!(
        targets,
        [Some(Target::Albedo), Some(Target::Normal), Some(Target::Material), None, Some(Target::Specular)]
    );
}

#[test]
fn what_nothing_reads_after_the_pass_is_transient_and_only_the_output_is_kept() {
    for (name, plan) in samples::plans() {
        for attachment in attachments(&plan) {
            let kept = attachment.target == Target::Output;
            let transient = vk::ImageUsageFlags::TRANSIENT_ATTACHMENT;
            assert_eq!(attachment.usage.contains(transient), !kept, "{name} {:?}", attachment.target);
            let stored = attachment.store == vk::AttachmentStoreOp::STORE;
            assert_eq!(stored, kept, "{name} {:?}", attachment.target);
            // Transient images may have no usage beyond attachments (VUID-VkImageCreateInfo-usage-00963).
            let others = attachment.usage
                & !(transient
                    | vk::ImageUsageFlags::COLOR_ATTACHMENT
                    | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
                    | vk::ImageUsageFlags::INPUT_ATTACHMENT);
            assert!(kept || others.is_empty(), "{name} {:?}", attachment.target);
        }
        let lights = [Target::Hdr, Target::Samples, Target::Output];
        let bytes: u32 = attachments(&plan)
            .iter()
            .filter(|a| {
                plan.gbuffer.is_some()
                    && !matches!(a.target, Target::Accumulation | Target::Weights)
                    && !lights.contains(&a.target)
            })
            .map(|a| crate::gpu::format_bytes(a.format) * samples_of(&plan, a.target).as_raw())
            .sum();
        assert_eq!(bytes, plan.gbuffer_bytes_per_pixel(), "{name}");
    }
}

#[test]
fn what_is_blended_or_shown_over_nothing_starts_cleared() {
    for (name, plan) in samples::plans() {
        let load = |target| attachments(&plan).iter().find(|a| a.target == target).map(|a| a.load);
        let clear = Some(vk::AttachmentLoadOp::CLEAR);
        assert_eq!(load(Target::Depth).is_some(), plan.has_geometry(), "{name}");
        let lights = [Target::Hdr, Target::Samples, Target::Accumulation, Target::Weights];
        for target in [Target::Depth, Target::Count].into_iter().chain(lights) {
            assert!(load(target).is_none() || load(target) == clear, "{name} {target:?}");
        }
        // TONEMAP and a resolve write every pixel themselves.
        assert_eq!(load(Target::Output) == clear, !plan.has_tonemap_subpass() && !plan.resolves_output(), "{name}");
    }
}

#[test]
fn a_tiled_frame_stores_what_its_compute_shader_binds_and_no_more() {
    for (name, plan) in samples::tiled_plans() {
        let flags = crate::passes::tiled::flags(&plan);
        let entry = shaders::tiled::variant(flags).and_then(|variant| variant.compute()).expect("a variant");
        let bound: BTreeMap<u32, BindingKind> =
            entry.bindings.iter().filter(|b| b.set == 1).map(|b| (b.binding, b.kind)).collect();
        let mut stored: BTreeSet<Target> = BTreeSet::new();
        for (binding, target) in crate::targets::stored_inputs(&plan) {
            assert_eq!(bound.get(&binding), Some(&BindingKind::SampledImage), "{name} {target:?}");
            stored.insert(target);
        }
        stored.extend(plan.emissive.then_some(Target::Hdr));
        assert_eq!(bound.contains_key(&crate::passes::tiled::EMISSIVE), plan.emissive, "{name}");
        // Those and the output.
        assert_eq!(bound.len(), stored.len() + 1, "{name}");
        let attached: BTreeSet<Target> = attachments(&plan).iter().map(|attachment| attachment.target).collect();
        assert_eq!(stored, attached, "{name}");
        for attachment in attachments(&plan) {
            assert_eq!(attachment.store, vk::AttachmentStoreOp::STORE, "{name}");
            assert!(attachment.usage.contains(vk::ImageUsageFlags::SAMPLED), "{name}");
            // Transient images may not be sampled (VUID-VkImageCreateInfo-usage-00963).
            assert!(!attachment.usage.contains(vk::ImageUsageFlags::TRANSIENT_ATTACHMENT), "{name}");
        }
        assert_eq!(dependencies(&plan, &edges::table(&plan), Carrier::MainPass).len(), 2, "{name}");
    }
}

#[test]
fn dependencies_are_the_rows_of_the_table() {
    for (name, plan) in samples::plans() {
        let last = main_subpasses(&plan).len() as u32 - 1;
        let all = dependencies(&plan, &edges::table(&plan), Carrier::MainPass);
        let rows = edges::table(&plan).of(Carrier::MainPass).count();
        assert_eq!(all.len(), rows, "{name}");
        for &(ref edge, [from, to]) in &all {
            let inside = |index| index <= last || index == vk::SUBPASS_EXTERNAL;
            assert!(inside(from) && inside(to) && from != to, "{name}: {from} to {to}");
            assert!(from < to || from == vk::SUBPASS_EXTERNAL, "{name}: {from} to {to}");
            assert!(edge.before.stage != vk::PipelineStageFlags::empty(), "{name}");
        }
        let shadow = dependencies(&plan, &edges::table(&plan), Carrier::ShadowPass);
        assert_eq!(shadow.len(), 2 * usize::from(plan.shadow.is_some()), "{name}");
        // Into the one subpass and out of it.
        let ends: Vec<_> = shadow.iter().map(|&(_, ends)| ends).collect();
        assert!(
            ends.iter().all(|ends| matches!(ends, [vk::SUBPASS_EXTERNAL, 0] | [0, vk::SUBPASS_EXTERNAL])),
            "{name}"
        );
    }
}

#[test]
fn the_shadow_pass_stores_its_map_and_leaves_it_readable() {
    let attachment = shadow::attachment();
    assert_eq!((attachment.format, attachment.store_op), (plan::DEPTH, vk::AttachmentStoreOp::STORE));
    assert_eq!(attachment.load_op, vk::AttachmentLoadOp::CLEAR);
    let readable = vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL;
    assert_eq!((attachment.initial_layout, attachment.final_layout), (readable, readable));
}

#[test]
fn subpasses_write_attachments_of_one_sample_count_and_resolve_into_the_output() {
    for (name, plan) in samples::plans() {
        let refs = References::of(&plan);
        let count =
            |reference: &vk::AttachmentReference| name_of(&refs, reference).map(|target| samples_of(&plan, target));
        let counts = |list: &[vk::AttachmentReference]| list.iter().filter_map(count).collect::<BTreeSet<_>>();
        let many = BTreeSet::from([plan.sample_count()]);
        if plan.has_geometry() {
            assert!(counts(&refs.at(Place::Geometry).color).is_subset(&many), "{name}");
        }
        // VIEW shows all samples at once, and then has no depth to test against.
        let lit = if plan.lighting_tests_depth() { many } else { BTreeSet::from([vk::SampleCountFlags::TYPE_1]) };
        assert_eq!(counts(&refs.lit().color), lit, "{name}");
        assert!(
            counts(&refs.at(Place::Tonemap).color).iter().all(|count| *count == vk::SampleCountFlags::TYPE_1),
            "{name}"
        );
        let resolved: Vec<_> = refs.resolve().iter().map(|reference| name_of(&refs, reference)).collect();
        assert_eq!(resolved, if plan.resolves_output() { vec![Some(Target::Output)] } else { vec![] }, "{name}");
        // Someone resolves whatever has several samples.
        assert!(
            plan.msaa == 1 || plan.resolves_output() || plan.hdr.is_some() || !plan.lighting_tests_depth(),
            "{name}"
        );
    }
}

#[test]
fn every_plan_can_be_one_render_pass() {
    for (name, plan) in [samples::plans(), samples::forward_plans(), samples::tiled_plans()].concat() {
        check(&plan, &edges::table(&plan)).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn passes_that_cannot_be_one_render_pass_are_refused_with_their_names() {
    use Target::{Albedo, Depth, Hdr, Normal, Output};
    let order = [Depth, Albedo, Normal, Hdr];
    let geometry = || (Place::Geometry, vec![Touch::DepthWrite, Touch::Color(0, Albedo)]);
    let cases = [
        (vec![geometry(), (Place::Fxaa, vec![Touch::Sampled(Albedo)])], ["FXAA", "neighbours", "Albedo"]),
        (vec![geometry(), (Place::Tonemap, vec![Touch::Color(0, Output)])], ["TONEMAP", "does not have", "Output"]),
        (vec![geometry(), (Place::Lighting, vec![Touch::Input(Hdr)])], ["LIGHTING", "no subpass before", "Hdr"]),
        (vec![(Place::Lighting, vec![Touch::DepthTest])], ["LIGHTING", "no subpass before", "Depth"]),
        (
            vec![geometry(), (Place::Lighting, vec![Touch::Input(Albedo), Touch::Color(0, Albedo)])],
            ["LIGHTING", "two layouts", "Albedo"],
        ),
        (vec![geometry(), (Place::Forward, vec![Touch::Input(Depth), Touch::DepthWrite])], ["FORWARD", "two", "Depth"]),
        (
            vec![(Place::Geometry, vec![Touch::Color(1, Albedo), Touch::Color(1, Normal)])],
            ["GEOMETRY", "location 1", "Normal"],
        ),
    ];
    for (declared, words) in cases {
        let sentence = refusal(&order, &declared).unwrap_or_else(|| panic!("{declared:?} is not refused"));
        assert!(words.iter().all(|word| sentence.contains(word)), "{sentence}");
    }
    assert_eq!(refusal(&order, &[geometry(), (Place::Lighting, vec![Touch::Input(Depth), Touch::DepthTest])]), None);
}

#[test]
fn a_row_of_the_main_pass_that_names_no_subpass_of_it_is_refused() {
    let of = |plans: Vec<(String, FramePlan)>| plans.into_iter().next().expect("a plan").1;
    let (forward, deferred) = (of(samples::forward_plans()), of(samples::plans()));
    // The rows of another plan.
    let error =
        check(&forward, &edges::table(&deferred)).expect_err("rows of subpasses that are not there").to_string();
    assert!(error.contains("gbuffer-reuse") && error.contains("GEOMETRY"), "{error}");
}

#[test]
fn every_change_of_layout_is_ordered_by_a_row_between_the_uses_that_it_is_between() {
    let all = [samples::plans(), samples::forward_plans(), samples::tiled_plans()].concat();
    for (name, plan) in all {
        let edges = edges::table(&plan);
        let mut passes = vec![PassDescription::main(&plan, &edges)];
        passes.extend(plan.shadow.is_some().then(|| PassDescription::shadow(&plan, &edges)));
        passes.extend(plan.fxaa.then(|| PassDescription::fxaa(&plan, &edges)));
        let mut changed = 0;
        for pass in &passes {
            for (ends, change) in pass.layout_changes() {
                let ordered = pass.dependencies.iter().any(|(_, own)| *own == ends);
                assert!(ordered, "{name}: no row of the {} orders {change} between {ends:?}", pass.name);
                changed += 1;
            }
        }
        let rows = edges.iter().filter(|edge| edge.carrier.is_render_pass());
        let told: usize = rows.map(|edge| layout_changes(&plan, &edges, edge).len()).sum();
        assert_eq!(told, changed, "{name}");
        let read_back = layout_changes(&plan, &edges, edges.find(edges::RowName::ReadBack).expect("a row"));
        assert_eq!(read_back.last().map(|change| change.new), Some(vk::ImageLayout::TRANSFER_SRC_OPTIMAL), "{name}");
    }
}
