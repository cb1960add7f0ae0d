//! The render passes of sample plans: attachments, references, loads and stores, and the rows that become dependencies.

mod passes_and_rows;

use std::collections::{BTreeMap, BTreeSet};

use ash::vk;

use afterlight::frame::layout_changes;
use afterlight::frame::list::{RenderPassName, SHADOW_PASS, Step, StepList, Subpass as Listed};
use afterlight::frame::render_pass::{PassDescription, SubpassAttachments};
use afterlight::frame::rows::{self, Row, SyncKind};
use afterlight::passes::{
    ContentsIfFirst, Endpoint, Pass, Resource, ResourceUse, UseKind, composite, forward, fxaa, gbuffer_inputs,
    geometry, lighting, tiled, tonemap, transparent, view,
};
use afterlight::plan::{self, FramePlan, Shading, Target, samples};
use afterlight::scene::{Keep, OptionalPart, Settings, Transparency};
use afterlight::shaders::{self, Binding, BindingKind, NumberKind, Variant};

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

/// The targets, in their order, and the subpasses of the render pass that begins with GEOMETRY or FORWARD.
struct References {
    order: Vec<Target>,
    subpasses: Vec<SubpassAttachments>,
    absent: SubpassAttachments,
}

/// The render pass that lights opaque surfaces, or stores them for TILED.
fn main_name(plan: &FramePlan) -> RenderPassName {
    let list = StepList::of(plan);
    let places = [lighting::PASS.name, forward::PASS.name, geometry::PASS.name];
    places.into_iter().find_map(|place| list.find(place)).expect("a main pass").0
}

fn main_pass(plan: &FramePlan) -> PassDescription {
    let found = PassDescription::named(plan, &rows::table(plan), main_name(plan));
    found.expect("a main pass")
}

fn attachments(plan: &FramePlan) -> Vec<(Target, vk::AttachmentDescription)> {
    StepList::of(plan).attachments(plan, main_name(plan))
}

fn has_subpass(plan: &FramePlan, place: Endpoint) -> bool {
    StepList::of(plan).find(place).is_some()
}

fn samples_of(plan: &FramePlan, target: Target) -> vk::SampleCountFlags {
    vk::SampleCountFlags::from_raw(plan.samples_of(target))
}

fn dependencies(plan: &FramePlan, name: RenderPassName) -> Vec<(Row, [u32; 2])> {
    let found = PassDescription::named(plan, &rows::table(plan), name);
    found.map_or_else(Vec::new, |pass| pass.dependencies)
}

impl References {
    fn of(plan: &FramePlan) -> Self {
        let pass = main_pass(plan);
        let absent = SubpassAttachments {
            place: Endpoint::OUTSIDE,
            input: Vec::new(),
            color: Vec::new(),
            resolve: Vec::new(),
            depth: None,
            preserve: Vec::new(),
            touches: Vec::new(),
        };
        Self { order: pass.targets(), subpasses: pass.subpasses, absent }
    }

    /// A subpass, or one that touches nothing.
    fn at(&self, place: Endpoint) -> &SubpassAttachments {
        self.subpasses.iter().find(|own| own.place == place).unwrap_or(&self.absent)
    }

    /// The attachments into which samples are resolved, after whichever subpass.
    fn resolve(&self) -> &Vec<vk::AttachmentReference> {
        let all = self.subpasses.iter().map(|own| &own.resolve);
        all.max_by_key(|resolve| resolve.len()).unwrap_or(&self.absent.resolve)
    }

    /// The subpass that first lights opaque surfaces.
    fn lit(&self) -> &SubpassAttachments {
        self.subpasses
            .iter()
            .find(|own| own.place == forward::PASS.name)
            .unwrap_or_else(|| self.at(lighting::PASS.name))
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
            .zip(&refs.at(geometry::PASS.name).color)
            .filter(|(_, reference)| reference.attachment != vk::ATTACHMENT_UNUSED)
            .map(|(location, _)| location)
            .collect();
        assert_eq!(refs.at(geometry::PASS.name).color.len(), plan.geometry_locations() as usize, "{name}");
        for &key in &plan.geometry {
            let variant = shaders::geometry::variant(geometry::flags(&plan, key)).expect("a variant");
            let outputs = variant.fragment().expect("a fragment stage").fragment_outputs;
            let written: BTreeSet<u32> = outputs.iter().map(|output| output.location).collect();
            assert_eq!(written, bound, "{name} {key:?}");
            for output in outputs {
                let target =
                    name_of(&refs, &refs.at(geometry::PASS.name).color[output.location as usize]).expect("a target");
                let all = attachments(&plan);
                let format = all.iter().find(|(own, _)| *own == target).expect("an attachment").1.format;
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
        "emissive" => plan.light_target(),
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
            let depth = *target == Target::Depth;
            let layout = if depth { "DEPTH_STENCIL_READ_ONLY_OPTIMAL" } else { "SHADER_READ_ONLY_OPTIMAL" };
            assert_eq!(format!("{:?}", reference.layout), layout, "{name}");
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
        assert_eq!(has_subpass(&plan, tonemap::PASS.name), plan.hdr.is_some(), "{name}");
        let names = |list: &[vk::AttachmentReference]| list.iter().map(|r| name_of(&refs, r)).collect::<Vec<_>>();
        let (input, color) = match plan.hdr {
            Some(_) => (vec![Some(Target::Hdr)], vec![Some(Target::Output)]),
            None => (vec![], vec![]),
        };
        assert_eq!(
            (names(&refs.at(tonemap::PASS.name).input), names(&refs.at(tonemap::PASS.name).color)),
            (input, color),
            "{name}"
        );
        assert_eq!(names(&refs.lit().color), [Some(plan.light_target())], "{name}");
    }
}

#[test]
fn transparent_surfaces_go_over_the_light_or_into_sums_that_composite_reads() {
    let composite = shaders::composite::variant(shaders::composite::Flags::NONE).expect("a variant");
    assert_eq!(reflected_inputs(composite), BTreeMap::from([(0, (0, 0)), (1, (0, 1))]));
    for binding in fragment_bindings(composite) {
        let target = [Target::Accumulation, Target::Weights][binding.binding as usize];
        assert_eq!(binding.name, format!("subpass_{target:?}").to_lowercase());
    }
    let mut seen = BTreeSet::new();
    for (name, plan) in samples::plans() {
        let refs = References::of(&plan);
        let names = |list: &[vk::AttachmentReference]| list.iter().map(|r| name_of(&refs, r)).collect::<Vec<_>>();
        let sums = [Some(Target::Accumulation), Some(Target::Weights)];
        let light = [Some(plan.light_target())];
        let drawn = names(&refs.at(transparent::PASS.name).color);
        let kept: Vec<_> =
            refs.at(transparent::PASS.name).preserve.iter().map(|&index| refs.order[index as usize]).collect();
        match plan.transparency {
            Some(Transparency::Sorted) => assert_eq!((drawn, kept), (light.to_vec(), vec![]), "{name}"),
            Some(Transparency::Oit) => assert_eq!((drawn, kept), (sums.to_vec(), vec![plan.light_target()]), "{name}"),
            None => assert_eq!((drawn, kept), (vec![], vec![]), "{name}"),
        }
        let oit = plan.transparency == Some(Transparency::Oit);
        assert_eq!(names(&refs.at(composite::PASS.name).input), if oit { sums.to_vec() } else { vec![] }, "{name}");
        assert_eq!(
            [transparent::PASS.name, composite::PASS.name].map(|place| has_subpass(&plan, place)),
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
        let indices =
            [geometry::PASS.name, lighting::PASS.name, forward::PASS.name].map(|place| StepList::of(&plan).find(place));
        assert_eq!(indices, [None, None, Some((main_name(&plan), 0))], "{name}");
        assert!(refs.lit().input.is_empty(), "{name}");
        assert!(!plan.geometry.iter().any(|key| key.forward.is_none()), "{name}");
        let allowed =
            [Target::Depth, Target::Accumulation, Target::Weights, Target::Hdr, Target::Samples, Target::Output];
        assert!(refs.order.iter().all(|target| allowed.contains(target)), "{name}: {:?}", refs.order);
        assert_eq!(plan.hdr.is_some(), plan.has_tonemap_subpass(), "{name}");
        let (_, depth) = attachments(&plan).into_iter().find(|(own, _)| *own == Target::Depth).expect("depth");
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
        assert!((0..2).all(|index| has(2, index) == plan.shadow.is_some()), "{name}: shadow maps");
        // The view of the maps looks at no tints.
        assert!(!has(2, 2) || plan.shadow.is_some(), "{name}: tints");
        let lists = has(0, 2) && has(0, 3);
        assert_eq!(lists, plan.lights_by_clusters(), "{name}: clusters");
        assert!(bindings.iter().all(|b| matches!((b.set, b.binding), (0, 0..=3) | (1, _) | (2, 0..=2))), "{name}");
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
            &refs.at(geometry::PASS.name).color,
            &refs.lit().input,
            &refs.lit().color,
            &refs.at(transparent::PASS.name).color,
            &refs.at(composite::PASS.name).input,
            refs.resolve(),
            &refs.at(tonemap::PASS.name).input,
            &refs.at(tonemap::PASS.name).color,
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
    let scene = samples::scene(vec![samples::material(afterlight::scene::Brdf::Phong)], vec![samples::sky()]);
    let plan = FramePlan::of(&scene, &samples::deferred(), &samples::device()).expect("a plan");
    let refs = References::of(&plan);
    let targets: Vec<_> =
        refs.at(geometry::PASS.name).color.iter().map(|reference| name_of(&refs, reference)).collect();
    // Location 3 is emissive light's.
    assert_eq!(
        targets,
        [Some(Target::Albedo), Some(Target::Normal), Some(Target::Material), None, Some(Target::Specular)]
    );
}

#[test]
fn what_nothing_reads_after_the_pass_is_transient_and_only_the_output_is_kept() {
    for (name, plan) in samples::plans() {
        let list = StepList::of(&plan);
        for (target, attachment) in attachments(&plan) {
            let kept = target == Target::Output;
            let (usage, transient) = (list.usage(&plan, target), vk::ImageUsageFlags::TRANSIENT_ATTACHMENT);
            assert_eq!(usage.contains(transient), !kept, "{name} {target:?}");
            let stored = attachment.store_op == vk::AttachmentStoreOp::STORE;
            assert_eq!(stored, kept, "{name} {target:?}");
            // Transient images may have no usage beyond attachments (VUID-VkImageCreateInfo-usage-00963).
            let others = usage
                & !(transient
                    | vk::ImageUsageFlags::COLOR_ATTACHMENT
                    | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
                    | vk::ImageUsageFlags::INPUT_ATTACHMENT);
            assert!(kept || others.is_empty(), "{name} {target:?}");
        }
    }
}

#[test]
fn a_gbuffer_that_is_stored_lies_between_two_render_passes_and_nothing_else_changes() {
    let keep = Keep::NONE.with(OptionalPart::StoredGbuffer);
    let mut seen = 0;
    for (name, scene) in samples::scenes() {
        for msaa in [1, 4] {
            let settings = Settings { msaa, ..samples::deferred() };
            let of = |keep| FramePlan::of(&scene, &Settings { keep, ..settings.clone() }, &samples::device());
            let (Ok(whole), Ok(parted)) = (of(Keep::NONE), of(keep)) else { continue };
            assert!(!whole.stores_gbuffer && parted.stores_gbuffer, "{name}");
            let (list, rows) = (StepList::of(&parted), rows::table(&parted));
            let first = list.attachments(&parted, RenderPassName::of(geometry::PASS.name));
            let second = list.attachments(&parted, RenderPassName::of(lighting::PASS.name));
            for (target, description) in &first {
                assert_eq!(description.store_op, vk::AttachmentStoreOp::STORE, "{name} {target:?}");
                let usage = list.usage(&parted, *target);
                assert!(!usage.contains(vk::ImageUsageFlags::TRANSIENT_ATTACHMENT), "{name} {target:?}");
                let (_, loaded) = second.iter().find(|(own, _)| own == target).expect("read again");
                assert_eq!(loaded.load_op, vk::AttachmentLoadOp::LOAD, "{name} {target:?}");
                assert_eq!(loaded.initial_layout, description.final_layout, "{name} {target:?}");
            }
            // In the second pass, the loads of targets that it touches first, and all stores, are as in one pass.
            for (target, description) in attachments(&whole) {
                let (_, own) = second.iter().find(|(own, _)| *own == target).expect("in both");
                assert_eq!(
                    (own.store_op, own.final_layout),
                    (description.store_op, description.final_layout),
                    "{name}"
                );
                let is_first = !first.iter().any(|(own, _)| *own == target);
                assert!(!is_first || own.load_op == description.load_op, "{name} {target:?}");
            }
            let passes = PassDescription::all(&parted, &rows);
            let subpasses: Vec<_> = passes.iter().flat_map(|pass| &pass.subpasses).map(|own| own.place).collect();
            let of_whole = PassDescription::all(&whole, &rows::table(&whole));
            let wanted: Vec<_> = of_whole.iter().flat_map(|pass| &pass.subpasses).map(|own| own.place).collect();
            assert_eq!(subpasses, wanted, "{name}");
            seen += 1;
        }
    }
    assert!(seen > 4, "{seen}");
}

#[test]
fn what_is_blended_or_shown_over_nothing_starts_cleared() {
    for (name, plan) in samples::plans() {
        let load = |target| attachments(&plan).iter().find(|(own, _)| *own == target).map(|(_, own)| own.load_op);
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
        let flags = afterlight::passes::tiled::flags(&plan);
        let entry = shaders::tiled::variant(flags).and_then(|variant| variant.compute()).expect("a variant");
        let bound: BTreeMap<u32, BindingKind> =
            entry.bindings.iter().filter(|b| b.set == 1).map(|b| (b.binding, b.kind)).collect();
        let mut stored: BTreeSet<Target> = BTreeSet::new();
        for (binding, target) in tiled::stored_inputs(&plan) {
            assert_eq!(bound.get(&binding), Some(&BindingKind::SampledImage), "{name} {target:?}");
            stored.insert(target);
        }
        assert_eq!(bound.contains_key(&afterlight::passes::tiled::EMISSIVE), plan.emissive, "{name}");
        // The shader binds the stored targets and the output.
        assert_eq!(bound.len(), stored.len() + 1, "{name}");
        let attached: BTreeSet<Target> = attachments(&plan).iter().map(|(target, _)| *target).collect();
        assert_eq!(stored, attached, "{name}");
        for (target, attachment) in attachments(&plan) {
            assert_eq!(attachment.store_op, vk::AttachmentStoreOp::STORE, "{name}");
            let usage = StepList::of(&plan).usage(&plan, target);
            assert!(usage.contains(vk::ImageUsageFlags::SAMPLED), "{name}");
            // Transient images may not be sampled (VUID-VkImageCreateInfo-usage-00963).
            assert!(!usage.contains(vk::ImageUsageFlags::TRANSIENT_ATTACHMENT), "{name}");
        }
        let outside = |(_, ends): &(Row, [u32; 2])| ends.contains(&vk::SUBPASS_EXTERNAL);
        assert!(dependencies(&plan, main_name(&plan)).iter().all(outside), "{name}");
    }
}

#[test]
fn the_shadow_pass_stores_its_map_and_leaves_it_readable() {
    let plans = samples::plans();
    let (_, plan) = plans.iter().find(|(_, plan)| plan.shadow.is_some()).expect("a plan with maps");
    let pass = PassDescription::named(plan, &rows::table(plan), SHADOW_PASS).expect("maps");
    let (_, attachment) = pass.attachments[0];
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
            assert!(counts(&refs.at(geometry::PASS.name).color).is_subset(&many), "{name}");
        }
        // VIEW shows all samples at once, and then has no depth to test against.
        let lit = if plan.lighting_tests_depth() { many } else { BTreeSet::from([vk::SampleCountFlags::TYPE_1]) };
        assert_eq!(counts(&refs.lit().color), lit, "{name}");
        assert!(
            counts(&refs.at(tonemap::PASS.name).color).iter().all(|count| *count == vk::SampleCountFlags::TYPE_1),
            "{name}"
        );
        let resolved: Vec<_> = refs.resolve().iter().map(|reference| name_of(&refs, reference)).collect();
        assert_eq!(resolved, if plan.resolves_output() { vec![Some(Target::Output)] } else { vec![] }, "{name}");
        // A pass resolves each target of several samples.
        assert!(
            plan.msaa == 1 || plan.resolves_output() || plan.hdr.is_some() || !plan.lighting_tests_depth(),
            "{name}"
        );
    }
}

#[test]
fn pictures_that_are_drawn_anew_have_the_numbers_of_their_passes_in_the_order() {
    let (_, mut scene) = samples::scenes().into_iter().find(|(name, _)| *name == "sunlit").expect("a scene");
    let mut settings = samples::deferred();
    for variation in afterlight::plan::variations() {
        (variation.scene)(&mut scene);
        (variation.settings)(&mut settings);
    }
    let plan = samples::plan(&scene, &settings);
    let drawn = |pass: &'static Pass| {
        let colors = pass.uses(&plan).into_iter().filter(|touch| matches!(touch.how, UseKind::Color { .. }));
        colors.filter_map(|touch| match touch.resource {
            Resource::Target(target @ Target::Redrawn(_)) => Some(target),
            _ => None,
        })
    };
    let targets: Vec<Target> = StepList::of(&plan).passes().flat_map(drawn).collect();
    assert!(targets.len() >= 2 && targets.is_sorted(), "{targets:?}");
}

#[test]
fn the_render_pass_stores_light_that_is_spread_and_the_next_one_loads_it_for_tonemap() {
    let passes = |plan: &FramePlan| StepList::of(plan).passes().map(|pass| pass.name.name()).collect::<Vec<_>>();
    let is_alone = |plan: &FramePlan| plan.effects.bloom.is_some() && plan.effects.taa.is_none() && !plan.reflects();
    let plans: Vec<_> = samples::plans_of_effects().into_iter().filter(|(_, plan)| is_alone(plan)).collect();
    assert!(plans.len() > 100, "only {} plans", plans.len());
    for (name, plan) in plans {
        let (list, all) = (StepList::of(&plan), passes(&plan));
        let at = all.iter().position(|own| *own == "BLOOM").unwrap_or_else(|| panic!("{name}: {all:?}"));
        assert_eq!(all[at..at + 4], ["BLOOM", "SPREAD", "SPREAD", "TONEMAP"], "{name}");
        let hdr = |pass| {
            let all = list.attachments(&plan, pass);
            all.into_iter().find(|(target, _)| *target == Target::Hdr).expect("the light").1
        };
        let (main, next) = (hdr(main_name(&plan)), hdr(RenderPassName::of(tonemap::PASS.name)));
        let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        assert_eq!((main.store_op, main.final_layout), (vk::AttachmentStoreOp::STORE, read), "{name}");
        assert_eq!((next.load_op, next.initial_layout), (vk::AttachmentLoadOp::LOAD, read), "{name}");
        assert_eq!(next.store_op, vk::AttachmentStoreOp::DONT_CARE, "{name}");
        assert!(!list.usage(&plan, Target::Hdr).contains(vk::ImageUsageFlags::TRANSIENT_ATTACHMENT), "{name}");
    }
    let none = samples::plans().into_iter().chain(samples::forward_plans()).chain(samples::tiled_plans());
    for (name, plan) in none {
        assert!(!passes(&plan).iter().any(|own| ["BLOOM", "SPREAD"].contains(own)), "{name}");
        assert!(
            StepList::of(&plan).render_passes().all(|(own, _)| own != RenderPassName::of(tonemap::PASS.name)),
            "{name}"
        );
    }
}
