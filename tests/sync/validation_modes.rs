//! Messages of layers beyond core and synchronization checks: checks on the GPU, and advice on best practices.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::common::gpu::{advice_on, on_gpu_assisted};
use crate::common::scenes::{draw_everything, draw_with_each_list, exercise, one_of_each, small, with_transparent};
use afterlight::gpu::{Message, vk};
use afterlight::scene::{LightPath, Settings};

/// `on_gpu_assisted` first proves that the layer notices a mistake which only the content of memory shows. Several tests, so that they share the
/// time.
#[test]
fn nothing_is_accessed_out_of_bounds_with_a_gbuffer() {
    on_gpu_assisted(|gpu| {
        draw_with_each_list(gpu, &[LightPath::Loop, LightPath::PerLight, LightPath::Volumes, LightPath::Clustered]);
    });
}

#[test]
fn nothing_is_accessed_out_of_bounds_by_compute_and_without_a_gbuffer() {
    on_gpu_assisted(|gpu| draw_with_each_list(gpu, &[LightPath::Compute, LightPath::Forward]));
}

#[test]
#[ignore = "test-all: the longest shader compiles for a minute with the layer's checks; other paths stay"]
fn nothing_is_accessed_out_of_bounds_where_surfaces_are_looked_up() {
    on_gpu_assisted(|gpu| {
        let mut scene = one_of_each();
        scene.lights.truncate(1);
        if gpu.takes(LightPath::Visibility, &scene) {
            exercise(gpu, &scene, &Settings { light_path: LightPath::Visibility, ..small(&scene) });
        }
    });
}

#[test]
fn nothing_is_accessed_out_of_bounds_through_textures_and_sorted_indices() {
    on_gpu_assisted(|gpu| {
        let mut scene = with_transparent(one_of_each());
        scene.lights.truncate(1);
        exercise(gpu, &scene, &Settings { fxaa: true, ..small(&scene) });
    });
}

/// Advice that is not followed, and why.
struct Declined {
    /// The name of the rule, without the `UNASSIGNED-` of old layers.
    rule: &'static str,
    /// A part of the message, where a rule has several.
    about: &'static str,
    /// Minor and patch version of the first layer of Vulkan 1 that gives it, and of the first that no longer does.
    given_by: Range<(u32, u32)>,
    why: &'static str,
}

/// Layers of Vulkan 1.3 and 1.4. 1.4.309 gives some advice that 1.4.363 no longer gives; the version that dropped it is not known.
const OLD: Range<(u32, u32)> = (0, 0)..(4, 0);
const NEW: Range<(u32, u32)> = (4, 0)..(u32::MAX, 0);
const TAKEN_BACK: Range<(u32, u32)> = (4, 0)..(4, 363);

const DECLINED: &[Declined] = &[
    Declined {
        rule: "BestPractices-vkCreateInstance-specialuse-extension-debugging",
        about: "VK_EXT_debug_utils",
        given_by: OLD,
        why: "it names every object and collects these messages; without a layer or a debugger it costs a call an object",
    },
    Declined {
        rule: "BestPractices-specialuse-extension",
        about: "VK_EXT_debug_utils",
        given_by: TAKEN_BACK,
        why: "as above",
    },
    Declined {
        rule: "BestPractices-vkCreateInstance-specialuse-extension-debugging",
        about: "VK_EXT_validation_features",
        given_by: OLD,
        why: "this is the request for the advice itself",
    },
    Declined {
        rule: "BestPractices-deprecated-extension",
        about: "VK_EXT_descriptor_indexing",
        given_by: TAKEN_BACK,
        why: "devices of Vulkan 1.1 have indices that differ from invocation to invocation by the extension alone, and newer ones by the extension as well",
    },
    Declined {
        rule: "BestPractices-vkCreateDevice-deprecated-extension",
        about: "VK_KHR_maintenance4",
        given_by: OLD,
        why: "the instance is of Vulkan 1.1, where the extension alone lets layouts go before their pipelines",
    },
    Declined {
        rule: "BestPractices-deprecated-extension",
        about: "VK_KHR_maintenance4",
        given_by: TAKEN_BACK,
        why: "as above",
    },
    Declined {
        rule: "BestPractices-vkCreateDevice-physical-device-features-not-retrieved",
        about: "",
        given_by: TAKEN_BACK,
        why: "they were: 1.4.309 says so also right after vkGetPhysicalDeviceFeatures and vkGetPhysicalDeviceFeatures2 of the same device",
    },
    Declined {
        rule: "BestPractices-vkCreateGraphicsPipelines-too-many-instanced-vertex-buffers",
        about: "using 2 instanced vertex buffers",
        given_by: OLD,
        why: "the view of triangles alone reads the number of each object besides its rows, and no other frame has the buffer",
    },
    Declined {
        rule: "BestPractices-vkCreateGraphicsPipelines-too-many-instanced-vertex-buffers",
        about: "using 2 instanced vertex buffers",
        given_by: NEW,
        why: "as above",
    },
];

/// Each piece of advice is followed, or declined for a reason; and no reason is kept for advice that is no longer given.
#[test]
fn advice_is_followed_or_declined_for_a_reason() {
    let mut version = 0;
    let messages = advice_on(|gpu| {
        version = gpu.device.instance.validation_layer().expect("the layer is on");
        draw_everything(gpu);
    });
    let version = (vk::api_version_minor(version), vk::api_version_patch(version));
    let applies = |declined: &&Declined| declined.given_by.contains(&version);
    let answers = |declined: &Declined, message: &Message| {
        message.id_name.trim_start_matches("UNASSIGNED-") == declined.rule && message.text.contains(declined.about)
    };
    let declined: Vec<&Declined> = DECLINED.iter().filter(applies).collect();
    let mut open: BTreeMap<&str, (usize, &str)> = BTreeMap::new();
    for message in messages.iter().filter(|message| !declined.iter().any(|declined| answers(declined, message))) {
        open.entry(&message.id_name).or_insert((0, &message.text)).0 += 1;
    }
    assert!(open.is_empty(), "neither followed nor declined, with how often and the first of them: {open:#?}");
    for declined in declined {
        let given = messages.iter().any(|message| answers(declined, message));
        assert!(given, "no longer given: {} ({}; {})", declined.rule, declined.about, declined.why);
    }
}
