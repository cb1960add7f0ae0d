//! Opening a device, also where it does not keep a promise: an optional extension that it lists, and that it then fails with.

use std::ffi::CStr;

use super::device::{EnabledFeatures, create};
use super::error::{Error, Result};
use super::instance::Instance;
use super::message::{Message, MessageKind, Severity};
use super::physical::PhysicalDevice;

/// A device that is open, with the features that it is open with.
pub(super) struct Opened {
    pub raw: ash::Device,
    /// The device, as one that does not list the extensions which it failed to open with.
    pub physical: PhysicalDevice,
    pub features: EnabledFeatures,
}

/// Opens a device with all extensions and features that the program has a use for. Where that fails for an extension or a feature that the device lists, opens it
/// without one optional extension, each in turn, so that the log can name the culprit, and at last without all of them: frames are then drawn as on a device that
/// does not list the extension.
///
/// # Errors
/// What the driver reports; [`Error::Unsupported`] where the device does not even open with the `required` extensions alone.
pub(super) fn open(
    instance: &Instance,
    physical: PhysicalDevice,
    queue_family: u32,
    required: &[&'static CStr],
) -> Result<Opened> {
    let attempt = |physical: PhysicalDevice| {
        let features = EnabledFeatures::of(&physical, required);
        let raw = create(instance, &physical, queue_family, &features, required)?;
        Ok(Opened { raw, physical, features })
    };
    let error = match attempt(physical.clone()) {
        Err(error @ Error::Unsupported(_)) => error,
        other => return other,
    };
    for names in &suspects(&physical, required) {
        match attempt(names.iter().fold(physical.clone(), |own, name| own.without(name))) {
            Err(Error::Unsupported(_)) => {}
            Err(error) => return Err(error),
            Ok(opened) => {
                instance.message_log().push(Message {
                    severity: Severity::Warning,
                    kind: MessageKind::General,
                    id_name: "AFTERLIGHT-broken-extension".into(),
                    objects: vec![opened.physical.name.clone()],
                    text: opened.physical.fault().unwrap_or_default(),
                });
                return Ok(opened);
            }
        }
    }
    Err(error)
}

/// The sets of optional extensions to leave out, in the order in which they are tried: the smallest first, since an extension that others need takes them with it, and
/// all of them at last. Of equals the newest come first, which are the likeliest to be at fault.
fn suspects(physical: &PhysicalDevice, required: &[&'static CStr]) -> Vec<Vec<&'static CStr>> {
    let optional_of = |physical: &PhysicalDevice| -> Vec<&'static CStr> {
        let features = EnabledFeatures::of(physical, required);
        let is_optional =
            |name: &&'static CStr| !required.contains(name) && *name != ash::khr::portability_subset::NAME;
        features.extensions().filter(is_optional).collect()
    };
    let mut all = optional_of(physical);
    all.sort_unstable();
    all.dedup();
    let mut sets: Vec<Vec<&'static CStr>> = Vec::new();
    for name in optional_of(physical).into_iter().rev() {
        let left = optional_of(&physical.clone().without(name));
        let set: Vec<_> = all.iter().copied().filter(|own| !left.contains(own)).collect();
        if !sets.contains(&set) {
            sets.push(set);
        }
    }
    sets.sort_by_key(Vec::len);
    sets.push(all);
    sets
}
