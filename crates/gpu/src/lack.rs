//! What a device lacks for a newer API, in values and in words.

use std::ffi::CStr;
use std::fmt;

/// The requirement of a newer API that a device does not meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lack {
    /// An extension that it does not list.
    Extension(&'static CStr),
    /// A feature that it says it does not have.
    Feature(&'static str),
    /// An extension that it lists and does not open with.
    Broken(&'static CStr),
    /// A queue family for this kind of work alone.
    Family(&'static str),
}

impl fmt::Display for Lack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Lack::Extension(name) => write!(f, "this device lacks {}", name.to_string_lossy()),
            Lack::Feature(name) => write!(f, "this device lacks the feature {name}"),
            Lack::Broken(name) => {
                let name = name.to_string_lossy();
                write!(f, "this device lists {name} and does not open with it, a fault of its driver or of a layer")
            }
            Lack::Family(work) => write!(f, "this device has no queue family for {work} alone"),
        }
    }
}

/// A newer API of a device, or the first requirement that is missing.
pub type Support = Result<(), Lack>;
