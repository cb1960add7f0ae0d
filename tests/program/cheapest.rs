//! The cheapest scene is cheap: one lambert surface under one light has a forward frame, and nothing exists that it does not need.

use crate::common::gpu::on_gpu_in_both_modes;
use afterlight::gpu::MemoryKind;
use afterlight::scene::{LightPath, OpenOptions, Settings, open};

/// Every object that lives while frames of `builtin:quad` are drawn, and its purpose.
const NEEDED: &[(&str, &str)] = &[
    ("target Depth", "hides what lies behind"),
    ("target Depth", "its view"),
    ("target Output", "the picture"),
    ("target Output", "its view"),
    ("FORWARD pass", "the one render pass"),
    ("framebuffer of the FORWARD pass", "both targets"),
    ("vertex positions", "what is drawn"),
    ("vertex normals", "how it faces the light"),
    ("indices of 16 bits", "its triangles"),
    ("forward layout", "the pipeline's sets and push constants"),
    (
        "forward GeometryKey { textures: TextureMask(0), own_samplers: false, extras: Extras { colors: false, colored_light: false, uv_maps: false, second_uvs: false, looks: false, cells: false, strokes: false }, masked: false, discards: false, two_sided: false, mirrored: false, phong: false, reflectance: false, lobes: LobeMask(0), receives: true, forward: Some(ForwardKey { brdf: Lambert, opacity: Hides, emissive: false }) }",
        "the one pipeline",
    ),
    ("frame set layout", "set 0: camera and light"),
    ("frame 0", "commands, while the other frame is drawn"),
    ("frame 1", "commands, while the other frame is drawn"),
    ("camera of frame 0", "the CPU writes one while the device reads the other"),
    ("camera of frame 1", "the CPU writes one while the device reads the other"),
    ("lights of frame 0", "lights are placed relative to the camera, anew for each frame"),
    ("lights of frame 1", "lights are placed relative to the camera, anew for each frame"),
    ("instances of frame 0", "where the object stands, as a stream of its command"),
    ("instances of frame 1", "where the object stands, as a stream of its command"),
    ("pool of frame 0", "set 0 of the frame"),
    ("pool of frame 1", "set 0 of the frame"),
    ("times of frame 0", "when passes began and ended on the device; FrameTimes tells"),
    ("times of frame 1", "when passes began and ended on the device; FrameTimes tells"),
];

#[test]
fn a_plain_surface_has_one_pipeline_two_targets_and_nothing_that_it_does_not_need() {
    let scene = open("builtin:quad", &OpenOptions::default()).expect("it is built in");
    let size = [320, 180];
    let settings = Settings { size, ..scene.settings.decide() };
    on_gpu_in_both_modes(|gpu| {
        let mut renderer = gpu.renderer(&scene, &settings);
        for _ in 0..3 {
            renderer.render(&scene.camera).expect("a frame");
        }
        renderer.wait().expect("it ends");
        assert_eq!(renderer.plan().light_path, LightPath::ForwardNaive);
        let mut needed: Vec<&str> = NEEDED.iter().map(|&(name, _)| name).collect();
        needed.sort_unstable();
        assert_eq!(gpu.device.live_objects(), needed);
        let report = gpu.device.memory_report();
        let of = |kind| report.kinds.get(&kind).map_or(0, |kind| kind.bytes);
        // Drivers round each image up to pages.
        let pixels = u64::from(size[0] * size[1]);
        let targets = of(MemoryKind::Attachment);
        assert!((8 * pixels..=8 * pixels + 2 * 65536).contains(&targets), "{targets} bytes of {pixels} pixels");
        // Four vertices of 24 bytes and six indices of 2, in three buffers; camera, light and where the object stands in two of each.
        let (geometry, uniform) = (of(MemoryKind::Geometry), of(MemoryKind::Uniform));
        assert!((108..=108 + 3 * 256).contains(&geometry), "{geometry} bytes of vertices and indices");
        assert!(uniform <= 6 * 512, "{uniform} bytes of cameras, lights and instances");
        assert_eq!(report.bytes, targets + geometry + uniform, "{report:#?}");
    });
}
