//! The choice of the processor that culls opaque objects: the CPU, or the device by CULL, ARRANGE and FILL. The picture is the same to the last bit.

use std::collections::BTreeSet;

use super::{Basis, Capabilities, Shading, SurfaceRules};
use crate::scene::{Culling, MOST_LEVELS, OptionalPart, Scene, Settings, counted};
use crate::shaders::shared::culling::STEPS;

/// The average number of objects per pair of mesh and material from which the device culls: each pair is a command in every depth step, drawn or not.
const SHARED_BY: usize = 16;

/// Storage buffers that CULL names, with levels of detail and occlusion culling.
pub(crate) const CULL_BUFFERS: u32 = 7;

/// Bytes of shared memory of a CULL work group: two words for each depth step, and for each depth step of each level of detail if meshes have levels.
const CULL_SHARED_BYTES: [u32; 2] = [8 * STEPS, 8 * STEPS * (MOST_LEVELS as u32 + 1)];

/// Returns a warning if culling on the device was asked for and is not done.
pub(super) fn warning(settings: &Settings, culling: &Result<String, String>) -> Option<String> {
    let why = culling.as_ref().err().filter(|_| settings.culling == Culling::Gpu)?;
    Some(format!("--culling gpu is not followed ({why})"))
}

/// Returns `Ok` with the reason if the device culls.
pub(super) fn choose(
    scene: &Scene,
    settings: &Settings,
    device: &Capabilities,
    rules: &SurfaceRules,
    shading: Shading,
    (depth_prepass, shadowed): (bool, bool),
) -> Result<String, String> {
    let asked = settings.culling == Culling::Gpu;
    match shading {
        _ if settings.culling == Culling::Cpu => return Err("the CPU culls, as asked for".into()),
        _ if !device.indirect_draws => return Err("the CPU culls: the device lacks indirect draws".into()),
        _ if device.storage_buffers < CULL_BUFFERS => {
            return Err("the CPU culls: the device's shaders can name too few buffers".into());
        }
        _ if device.shared_memory < CULL_SHARED_BYTES[usize::from(rules.lod > 0.0)] => {
            return Err("the CPU culls: the device's work groups share too little memory".into());
        }
        _ if settings.keep.has(OptionalPart::OffscreenObjects) => {
            return Err("culling is off (`--plan offscreen-objects`)".into());
        }
        _ if depth_prepass => return Err("the CPU culls: a depth pre-pass reverses the draw order".into()),
        Shading::ShowTriangle => return Err("the CPU culls: the view needs each object's number".into()),
        Shading::ShowShadowMap => return Err("no object is drawn".into()),
        _ => {}
    }
    let drawn = || {
        let objects = scene.objects.iter().filter(|object| rules.draws(scene, object));
        objects.filter(|object| !rules.material(object).is_transparent())
    };
    let count = drawn().count();
    let pairs = || drawn().map(|object| (object.mesh, object.material)).collect::<BTreeSet<_>>().len();
    let many = device.costs.culling.many_objects();
    match count {
        0 => Err("no opaque object is drawn".into()),
        _ if asked => Ok("the device culls, as asked for".into()),
        _ if device.software && shadowed => {
            Err("the CPU culls: the device is a CPU, where culling also skips casters of shadows that nobody sees"
                .into())
        }
        _ if many == usize::MAX => Err("the CPU culls: on this device it is faster for any number of objects".into()),
        _ if count < many => {
            let measured =
                if matches!(device.costs.basis, Basis::Kind(_)) { "" } else { ", as measured on this device" };
            Err(format!(
                "the CPU culls: {} drawn, and the device pays from {many} on{measured}",
                counted(count, "opaque object")
            ))
        }
        _ if pairs() * SHARED_BY > count => {
            Err(format!("the CPU culls: on average fewer than {SHARED_BY} objects share a mesh and a material"))
        }
        _ => Ok("the device culls: many objects share few meshes and materials".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{FramePlan, samples};
    use crate::scene::{LightPath, Material, View};

    /// `count` squares that share `materials` pairs of a mesh and a material.
    fn crowd(count: usize, materials: usize) -> Scene {
        let mut scene = samples::scene(vec![Material::default(); materials], vec![samples::sun()]);
        scene.objects = (0..count).map(|index| scene.objects[index % materials].clone()).collect();
        scene
    }

    fn culls(scene: &Scene, settings: &Settings, device: &Capabilities) -> bool {
        FramePlan::of(scene, settings, device).expect("a plan").culls_on_device
    }

    #[test]
    fn a_device_culls_by_itself_where_many_objects_share_few_materials() {
        let (gpu, defaults) = (samples::device(), Settings::default());
        let many = gpu.costs.culling.many_objects();
        assert!(culls(&crowd(many, 4), &defaults, &gpu));
        assert!(!culls(&crowd(many - 1, 4), &defaults, &gpu));
        assert!(!culls(&crowd(many, many / SHARED_BY + 1), &defaults, &gpu));
        let mut slow = gpu;
        slow.costs.culling.device_frame *= 2;
        assert!(!culls(&crowd(many, 4), &defaults, &slow));
        slow.costs.culling.device_object = slow.costs.culling.cpu_object;
        assert!(!culls(&crowd(many, 4), &defaults, &slow));
        // A CPU device culls if no light casts shadows.
        let mut unshadowed = crowd(samples::software().costs.culling.many_objects(), 4);
        assert!(!culls(&unshadowed, &defaults, &samples::software()));
        unshadowed.lights[0].casts_shadow = false;
        assert!(culls(&unshadowed, &defaults, &samples::software()));
    }

    #[test]
    fn what_is_asked_for_is_done_or_a_warning_says_why_not() {
        let asked = Settings { culling: Culling::Gpu, light_path: LightPath::Loop, ..Settings::default() };
        let (scene, gpu) = (crowd(3, 1), samples::device());
        let warned = |settings: &Settings, device: &Capabilities| {
            let plan = FramePlan::of(&scene, settings, device).expect("a plan");
            assert_eq!(plan.culls_on_device, plan.warnings().is_empty(), "{:?}", plan.warnings());
            !plan.culls_on_device
        };
        assert!(!warned(&asked, &gpu) && !warned(&asked, &samples::software()));
        assert!(warned(&asked, &Capabilities { indirect_draws: false, ..gpu }));
        assert!(warned(&Settings { depth_prepass: Some(true), ..asked.clone() }, &gpu));
        assert!(warned(&Settings { view: View::Triangle, ..asked.clone() }, &gpu));
        let cpu = Settings { culling: Culling::Cpu, ..Settings::default() };
        assert!(!culls(&crowd(gpu.costs.culling.many_objects(), 4), &cpu, &gpu));
    }
}
