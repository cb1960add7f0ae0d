//! The layer in the test's own process: the loader loads it, and the test tells it which calls fail.

use std::env;
use std::ffi::{CStr, CString, OsString, c_char};
use std::process::Command;

use libloading::Library;

use crate::common::failures_layer::LIBRARY;

/// Returns a command that starts one ignored test of this program in a separate process, with this environment, which loads the layer.
pub fn child_of(test: &str, environment: Vec<(&str, OsString)>) -> Command {
    // Not `current_exe`: that may be the dynamic linker (scripts/on-debian13).
    let own = env::args().next().expect("a program has a name");
    let mut command = match env::var_os("AFTERLIGHT_RUNNER") {
        Some(runner) => {
            let mut command = Command::new(runner);
            command.arg(own);
            command
        }
        None => Command::new(own),
    };
    command.args(["--exact", test, "--ignored", "--nocapture", "--test-threads", "1"]);
    // Without words the layer tells which allocation it refuses, also where the refusal ends the child.
    command.envs(environment).env("AFTERLIGHT_FAILURES", "");
    command
}

/// The layer of this process.
pub struct Layer(Library);

impl Layer {
    /// Opens the library that the loader opens, so that both share one state.
    pub fn of_this_process() -> Self {
        let place = env::var_os(LIBRARY).expect("the parent tells where the library is");
        // SAFETY: it is the project's own, and does nothing when it is loaded.
        Self(unsafe { Library::new(place) }.expect("it can be loaded"))
    }

    /// Forgets which calls were to fail, and counts from 0 again.
    pub fn reset(&self) {
        // SAFETY: the type is the function's; here and below.
        unsafe { self.0.get::<extern "C" fn()>(b"afterlight_failures_reset").expect("it is there")() }
    }

    /// Tells which calls fail, in words of `AFTERLIGHT_FAILURES`.
    pub fn tell(&self, words: &str) {
        let text = CString::new(words).expect("no NUL");
        // SAFETY: as above; the text outlives the call.
        let told = unsafe {
            self.0.get::<unsafe extern "C" fn(*const c_char) -> bool>(b"afterlight_failures_tell").expect("it is there")(
                text.as_ptr(),
            )
        };
        assert!(told, "the layer does not understand '{words}'");
    }

    pub fn calls(&self, command: &str) -> u64 {
        let text = CString::new(command).expect("no NUL");
        // SAFETY: as above.
        unsafe {
            self.0.get::<unsafe extern "C" fn(*const c_char) -> u64>(b"afterlight_failures_calls").expect("it is there")(
                text.as_ptr(),
            )
        }
    }

    fn number<T>(&self, name: &[u8]) -> T {
        // SAFETY: as above.
        unsafe { self.0.get::<extern "C" fn() -> T>(name).expect("it is there")() }
    }

    /// Returns the number of calls and allocations that have failed on request.
    pub fn fired(&self) -> u64 {
        self.number(b"afterlight_failures_fired")
    }

    /// Returns the number of allocations of host memory.
    pub fn allocations(&self) -> u64 {
        self.number(b"afterlight_failures_allocations")
    }

    /// Returns the command in which an allocation was refused last, or `None` if that command cannot fail, such as a recording command.
    pub fn refused_in(&self) -> Option<String> {
        let name: *const c_char = self.number(b"afterlight_failures_refused_in");
        // SAFETY: it is null, or a text that lives as long as the library.
        (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_string_lossy().into_owned())
    }

    /// Returns the number of allocations that have not been given back.
    pub fn live_allocations(&self) -> i64 {
        self.number(b"afterlight_failures_live_allocations")
    }
}
