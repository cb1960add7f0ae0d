//! The functions that stand in for the table's commands.

/// The facts of a command.
macro_rules! command {
    ($name:ident, [$($error:ident),*], [$($success:ident),*]) => {
        $crate::Command {
            name: stringify!($name),
            errors: &[$((stringify!($error), ash::vk::Result::$error)),*],
            successes: &[$((stringify!($success), ash::vk::Result::$success)),*],
        }
    };
}

/// The name of a command as C has it.
macro_rules! c_name {
    ($name:ident) => {
        const {
            match std::ffi::CStr::from_bytes_with_nul(concat!(stringify!($name), "\0").as_bytes()) {
                Ok(name) => name,
                Err(_) => panic!("the only NUL is the one at its end"),
            }
        }
    };
}

/// A function's pointer without its type, as functions are asked for by name.
macro_rules! untyped {
    ($function:expr, $type:ty) => {{
        let function: $type = $function;
        // SAFETY: both are pointers to functions; the caller gives it the type that goes with its name.
        Some(unsafe { std::mem::transmute::<$type, unsafe extern "system" fn()>(function) })
    }};
}

/// True if a call asks for elements of a list.
macro_rules! has_list {
    () => {
        false
    };
    ($count:ident $array:ident) => {
        // SAFETY: the number is the caller's own, and says how much room there is.
        !$array.is_null() && !$count.is_null() && unsafe { $count.read() } > 0
    };
}

/// Commands that can fail: for each a function that counts the call, and makes it or lets it fail.
macro_rules! fallible {
    ($($name:ident: $pfn:ident($first:ident: $first_type:ty $(, $argument:ident: $type:ty)*) {
        errors [$($error:ident),*], successes [$($success:ident),*]
        $(, callbacks $callbacks:ident)? $(, list $count:ident $array:ident)? $(, handles $handles:ident ($length:expr))?
    })*) => {
        pub const FALLIBLE: &[$crate::Command] = &[$(command!($name, [$($error),*], [$($success),*])),*];

        /// The commands' C names, each with true for a device-level command.
        pub const FALLIBLE_NAMES: &[(&std::ffi::CStr, bool)] =
            &[$((c_name!($name), <$first_type as $crate::chain::Level>::OF_A_DEVICE)),*];

        #[allow(non_snake_case, clippy::too_many_arguments)]
        mod functions {
            use std::ffi::{c_char, c_void};

            use ash::vk;

            use $crate::chain::{Level, lose, next};
            use $crate::steering::{CallFate, decide, within};

            $(pub unsafe extern "system" fn $name($first: $first_type $(, $argument: $type)*) -> vk::Result {
                // SAFETY: the handle is the caller's own, and the type is that of the name.
                let Some(function) = (unsafe { next::<vk::$pfn>($first, c_name!($name)) }) else {
                    return vk::Result::ERROR_INITIALIZATION_FAILED;
                };
                $(let $callbacks = $crate::callbacks::of_command(c_name!($name), $callbacks);)?
                // SAFETY: as this function was called.
                let call = || within(c_name!($name), || unsafe { function($first $(, $argument)*) });
                // SAFETY: the handle is the caller's own.
                let device = unsafe { <$first_type as Level>::device_key($first) };
                let failed = match decide(stringify!($name), device, has_list!($($count $array)?)) {
                    CallFate::Pass => return call(),
                    CallFate::After(result) => {
                        let real = call();
                        return if real == vk::Result::SUCCESS { result } else { real };
                    }
                    CallFate::Shortened => {
                        // SAFETY: there is a list, and the number is the caller's own.
                        $(unsafe { $count.write($count.read() - 1) };)?
                        return call();
                    }
                    CallFate::Lost { now } => {
                        if now {
                            lose(device);
                        }
                        vk::Result::ERROR_DEVICE_LOST
                    }
                    CallFate::Instead(result) => result,
                };
                // SAFETY: the caller's own place for so many handles.
                $(unsafe { std::ptr::write_bytes($handles, 0, $length as usize) };)?
                failed
            })*
        }

        /// This layer's function of that name, if it is one of these.
        pub fn fallible(name: &std::ffi::CStr) -> ash::vk::PFN_vkVoidFunction {
            match name.to_bytes() {
                $(own if own == stringify!($name).as_bytes() => untyped!(functions::$name, ash::vk::$pfn),)*
                _ => None,
            }
        }
    };
}

/// Commands that free objects, with the callbacks that the objects were made with.
macro_rules! frees {
    ($($name:ident: $pfn:ident($first:ident: $first_type:ty, $object:ident: $type:ty, $callbacks:ident: $callbacks_type:ty))*) => {
        /// The commands' C names, each with true for a device-level command.
        pub const FREEING_NAMES: &[(&std::ffi::CStr, bool)] =
            &[$((c_name!($name), <$first_type as $crate::chain::Level>::OF_A_DEVICE)),*];

        #[allow(non_snake_case)]
        mod freeing {
            use ash::vk;

            $(pub unsafe extern "system" fn $name($first: $first_type, $object: $type, $callbacks: $callbacks_type) {
                // SAFETY: the handle is the caller's own, and the type is that of the name; as this function was called.
                unsafe {
                    if let Some(function) = $crate::chain::next::<vk::$pfn>($first, c_name!($name)) {
                        let callbacks = $crate::callbacks::of_command(c_name!($name), $callbacks);
                        $crate::steering::within(c_name!($name), || function($first, $object, callbacks));
                    }
                }
            })*
        }

        /// This layer's function of that name, if it is one of these.
        pub fn freeing(name: &std::ffi::CStr) -> ash::vk::PFN_vkVoidFunction {
            match name.to_bytes() {
                $(own if own == stringify!($name).as_bytes() => untyped!(freeing::$name, ash::vk::$pfn),)*
                _ => None,
            }
        }
    };
}

/// Commands whose functions stand in `chain.rs` and in `pre_instance.rs`, and the one of the loader alone.
macro_rules! by_hand {
    ($($name:ident { errors [$($error:ident),*], successes [$($success:ident),*] })*) => {
        pub const BY_HAND: &[$crate::Command] = &[$(command!($name, [$($error),*], [$($success),*])),*];
    };
}
