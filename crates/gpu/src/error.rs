//! Errors of work on the GPU. Each variant says which operation failed.

use ash::vk;

/// The result of this module's fallible functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A failure, with the operation that failed. Displays as one line; the command line picks its exit code from the variant.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The Vulkan loader library is not there or does not work.
    #[error("no Vulkan loader: {reason}; {hint}")]
    NoLoader {
        /// The system's message.
        reason: String,
        /// The variable that hides it, or the way to install it on this system.
        hint: String,
    },
    /// The loader works, but it found no driver, or none with a usable device.
    #[error("no usable Vulkan driver: {reason}; {hint}")]
    NoDriver {
        /// The loader's message.
        reason: String,
        /// The variable that hides it, or the way to install it on this system.
        hint: String,
    },
    /// No device has the number or the name asked for.
    #[error("no Vulkan device matches '{wanted}'; there {}", list_devices(.available))]
    NoSuchDevice {
        /// The choice as it was written.
        wanted: String,
        /// The names of all devices, in the loader's order.
        available: Vec<String>,
    },
    /// Validation was asked for, and its layer is not installed.
    #[error("the Vulkan layer {layer} is not installed; {hint}")]
    MissingLayer {
        /// The layer's name.
        layer: String,
        /// The variable that hides it, or the way to install it on this system.
        hint: String,
    },
    /// The device is lost, and with it every object made on it: they can only be dropped.
    #[error("{doing}: the device is lost (its driver gave up or was reset); what was drawn on it has to be made anew")]
    DeviceLost {
        /// The operation during which the driver reported it.
        doing: String,
    },
    /// A Vulkan call failed.
    #[error("{doing}: Vulkan says {result:?} ({result})")]
    Vulkan {
        /// The operation and its command, as "creating the image 'albedo' by vkCreateImage".
        doing: String,
        /// The driver's result code.
        result: vk::Result,
    },
    /// Host or device memory ran out.
    #[error("{doing}: out of memory{}", asked_bytes(*.bytes))]
    OutOfMemory {
        /// The operation that failed.
        doing: String,
        /// The size asked for, if it is known.
        bytes: Option<u64>,
    },
    /// More than the device's limit was asked for.
    #[error("{what} is {asked}, but this device allows at most {limit}")]
    TooLarge {
        /// The thing and its unit, as "the width of the image 'output' in pixels".
        what: String,
        /// The requested amount.
        asked: u64,
        /// The device's limit.
        limit: u64,
    },
    /// The device or the system lacks something that was asked for.
    #[error("{0}")]
    Unsupported(String),
    /// The memory allocator failed, other than by running out.
    #[error("{doing}: the memory allocator failed: {source}")]
    Allocator {
        /// The operation that failed.
        doing: String,
        /// The allocator's own error.
        source: gpu_allocator::AllocationError,
    },
    /// A rule of this module was broken; a mistake in the program, not of its user.
    #[error("internal error: {0}")]
    Misuse(String),
}

fn list_devices(available: &[String]) -> String {
    match available {
        [] => "is none".to_owned(),
        [only] => format!("is only 0: {only}"),
        several => {
            let list: Vec<String> =
                several.iter().enumerate().map(|(index, name)| format!("{index}: {name}")).collect();
            format!("are {}", list.join(", "))
        }
    }
}

fn asked_bytes(bytes: Option<u64>) -> String {
    bytes.map_or_else(String::new, |bytes| format!(" ({bytes} bytes asked for)"))
}

impl Error {
    /// Makes an error from the result of a Vulkan command; running out of memory and losing the device have their own variants.
    pub(super) fn vulkan(command: &str, doing: impl Into<String>, result: vk::Result) -> Error {
        let doing = by(command, &doing.into());
        match result {
            vk::Result::ERROR_OUT_OF_HOST_MEMORY
            | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
            | vk::Result::ERROR_OUT_OF_POOL_MEMORY => Error::OutOfMemory { doing, bytes: None },
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { doing },
            result => Error::Vulkan { doing, result },
        }
    }
}

/// An operation, and the Vulkan command that it uses.
pub(super) fn by(command: &str, doing: &str) -> String {
    format!("{doing} by {command}")
}

/// Names the operation and the command when a Vulkan command failed. The text is only made on failure.
pub(super) trait Doing<T> {
    /// Turns the error into [`Error::Vulkan`], [`Error::OutOfMemory`] or [`Error::DeviceLost`].
    fn doing<S: Into<String>>(self, command: &str, text: impl FnOnce() -> S) -> Result<T>;
}

impl<T> Doing<T> for ash::prelude::VkResult<T> {
    fn doing<S: Into<String>>(self, command: &str, text: impl FnOnce() -> S) -> Result<T> {
        self.map_err(|result| Error::vulkan(command, text(), result))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_error_is_one_line_that_names_the_thing() {
        let errors = [
            Error::NoSuchDevice { wanted: "voodoo".into(), available: vec!["a".into(), "b".into()] },
            Error::vulkan("vkCreateImage", "creating the image 'albedo'", vk::Result::ERROR_DEVICE_LOST),
            Error::vulkan("vkCreateImage", "creating the image 'albedo'", vk::Result::ERROR_OUT_OF_DEVICE_MEMORY),
            Error::TooLarge { what: "the width of 'output'".into(), asked: 9, limit: 8 },
        ];
        for (error, part) in errors.iter().zip([
            "0: a, 1: b",
            "'albedo' by vkCreateImage: the device is lost",
            "out of memory",
            "at most 8",
        ]) {
            let text = error.to_string();
            assert!(text.contains(part) && !text.contains('\n'), "{text}");
        }
    }
}
