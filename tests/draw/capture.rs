//! Tools that capture a program without a window learn from its submissions where a frame ends.

use std::sync::{Mutex, OnceLock, PoisonError};

use crate::common::gpu::on_prepared_gpu;
use crate::common::stage::{open, own};
use afterlight::gpu::{Device, vk};
use afterlight::scene::{LightPath, Settings};
use vk::Handle;

/// The number of the frame that a submission ends, and the images that it names.
type Mark = (u64, Vec<u64>);

/// The marks of all submissions since the test began; most have none.
static SUBMISSIONS: Mutex<Vec<Option<Mark>>> = Mutex::new(Vec::new());
static REAL_SUBMISSION: OnceLock<vk::PFN_vkQueueSubmit> = OnceLock::new();

unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    infos: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    // SAFETY: a caller of vkQueueSubmit promises so many structures.
    let infos = unsafe { std::slice::from_raw_parts(infos, count as usize) };
    let marks = infos.iter().map(|info| {
        // SAFETY: a structure of a chain begins as this one does.
        let kind = unsafe { info.p_next.cast::<vk::BaseInStructure<'_>>().as_ref() }.map(|first| first.s_type);
        (kind == Some(vk::StructureType::FRAME_BOUNDARY_EXT)).then(|| {
            // SAFETY: its type says that it is one, and it has as many images as it says.
            let (mark, images) = unsafe {
                let mark = &*info.p_next.cast::<vk::FrameBoundaryEXT<'_>>();
                (mark, std::slice::from_raw_parts(mark.p_images, mark.image_count as usize))
            };
            assert_eq!(mark.flags, vk::FrameBoundaryFlagsEXT::FRAME_END);
            (mark.frame_id, images.iter().map(|image| image.as_raw()).collect())
        })
    });
    SUBMISSIONS.lock().unwrap_or_else(PoisonError::into_inner).extend(marks);
    // The driver may lack the extension: it is shown none of it.
    let bare: Vec<_> = infos.iter().map(|&info| vk::SubmitInfo { p_next: std::ptr::null(), ..info }).collect();
    // SAFETY: the caller's own arguments are passed on, with copies of its structures that live as long as the call.
    unsafe { REAL_SUBMISSION.get().expect("set")(queue, count, bare.as_ptr(), fence) }
}

/// A device that seems to have the extension.
fn listen(device: &mut Device) {
    let raw = &device.raw;
    let mut functions = raw.fp_v1_0().clone();
    REAL_SUBMISSION.get_or_init(|| functions.queue_submit);
    functions.queue_submit = submit;
    let (second, third, fourth) = (raw.fp_v1_1().clone(), raw.fp_v1_2().clone(), raw.fp_v1_3().clone());
    let handle = raw.handle();
    device.raw.intercept(ash::Device::from_parts_1_3(handle, functions, second, third, fourth));
    device.features.frame_boundary = true;
}

#[test]
fn each_frame_ends_with_one_submission_that_says_so_and_names_the_picture() {
    on_prepared_gpu(listen, |gpu| {
        let scene = open("builtin:spheres");
        let taken = || std::mem::take(&mut *SUBMISSIONS.lock().unwrap_or_else(PoisonError::into_inner));
        for light_path in [LightPath::Loop, LightPath::Compute] {
            let settings = Settings { light_path, ..own(&scene, 32, 18) };
            let mut renderer = gpu.renderer(&scene, &settings);
            assert!(taken().iter().all(Option::is_none), "uploads are no frames");
            (0..3).for_each(|_| renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}")));
            let marks: Vec<_> = taken().into_iter().map(|mark| mark.expect("each submission is a frame")).collect();
            assert!(marks.len() == 3 && marks.is_sorted_by(|a, b| a.0 < b.0), "{marks:?}");
            assert!(marks.iter().all(|(_, images)| images.len() == 1 && *images == marks[0].1), "{marks:?}");
            renderer.read_back().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(taken(), [None], "a copy to the CPU is no frame");
        }
    });
}
