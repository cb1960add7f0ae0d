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
    /// Without the extensions that it does not open with.
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
    let features = EnabledFeatures::of(&physical, required);
    let is_optional = |name: &&'static CStr| !required.contains(name) && *name != ash::khr::portability_subset::NAME;
    let mut optional: Vec<&'static CStr> = features.extensions().filter(is_optional).collect();
    // The newest come last in their list, and are the likeliest to be at fault.
    optional.reverse();
    for names in optional.iter().map(std::slice::from_ref).chain([&optional[..]]) {
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
