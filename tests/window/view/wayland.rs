//! The window under Wayland: on compositors without a display (Weston, and Sway for scales that are no whole numbers), which return the shown picture
//! as a screenshot.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use image::RgbImage;
use tempfile::TempDir;

use super::harness::{SIZE, end, rendered, size_text, text, until};
use crate::common::program::program;

/// Weston takes this name for its socket. Sway takes the first that is free.
const SOCKET: &str = "afterlight";
const SWAYS_SOCKET: &str = "wayland-1";
/// Weston before this version names its parts otherwise.
const OLD: u32 = 12;

/// The first version of Sway that tells windows a scale that is no whole number (wp_fractional_scale_v1).
const FRACTIONAL: [u32; 2] = [1, 9];

pub struct Compositor {
    process: Child,
    folder: TempDir,
    socket: &'static str,
    /// The program that takes screenshots.
    shooter: &'static str,
}

impl Compositor {
    pub fn start() -> Self {
        Self::start_at(1)
    }

    /// Starts Weston on a display with `scale` pixels to a point. At more than one Weston draws by OpenGL: its other renderer ends with a
    /// segmentation fault there when a window draws its own frame (10.0.1).
    fn start_at(scale: u32) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::set_permissions(folder.path(), Permissions::from_mode(0o700)).expect("its owner's");
        let told = Command::new("weston").arg("--version").output();
        let told = told.unwrap_or_else(|error| panic!("weston does not start (scripts/setup installs it): {error}"));
        let number = |version: &str| version.split('.').next()?.parse::<u32>().ok();
        let version = text(&told.stdout).split_whitespace().last().and_then(number).expect("a version");
        let how = match version < OLD {
            true => ["--backend=headless-backend.so", if scale == 1 { "--use-pixman" } else { "--use-gl" }],
            false => ["--backend=headless", if scale == 1 { "--renderer=pixman" } else { "--renderer=gl" }],
        };
        let mut command = Command::new("weston");
        // --debug lets any program take a screenshot.
        command.args(how).args(["--no-config", "--debug", "--idle-time=0", "--width=800", "--height=600"]);
        command.args([format!("--socket={SOCKET}"), format!("--scale={scale}")]).env("XDG_RUNTIME_DIR", folder.path());
        let process = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it has told its version");
        Self { process, folder, socket: SOCKET, shooter: "weston-screenshooter" }.started()
    }

    /// Starts Sway on a display three times as wide and high as the window, which lies in its middle: on whole pixels at scales of halves. Returns
    /// `None` without Sway or with an older version.
    fn sway(scale: f64) -> Option<Self> {
        let told = Command::new("sway").arg("--version").output().ok()?;
        let version = text(&told.stdout);
        let mut numbers = version.split_whitespace().last()?.split('.').map(str::parse::<u32>);
        if [numbers.next()?.ok()?, numbers.next()?.ok()?] < FRACTIONAL {
            return None;
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::set_permissions(folder.path(), Permissions::from_mode(0o700)).expect("its owner's");
        let [width, height] = SIZE.map(|edge| f64::from(3 * edge) * scale);
        let output = format!("output HEADLESS-1 mode {width}x{height} scale {scale}");
        let rules = "default_border none\nfor_window [title=\".*\"] floating enable";
        let config = folder.path().join("config");
        fs::write(&config, format!("xwayland disable\n{output}\n{rules}\n")).expect("a writable folder");
        let mut command = Command::new("sway");
        command.arg("--config").arg(config).env("XDG_RUNTIME_DIR", folder.path());
        command.envs([("WLR_BACKENDS", "headless"), ("WLR_RENDERER", "pixman"), ("WLR_LIBINPUT_NO_DEVICES", "1")]);
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        let process = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it has told its version");
        Some(Self { process, folder, socket: SWAYS_SOCKET, shooter: "grim" }.started())
    }

    fn started(self) -> Self {
        until("the compositor", || self.folder.path().join(self.socket).exists().then_some(()));
        self
    }

    /// Has a program draw on it, and on nothing else.
    pub fn has_for(&self, command: &mut Command) {
        command.env("XDG_RUNTIME_DIR", self.folder.path()).env("WAYLAND_DISPLAY", self.socket);
        command.env_remove("DISPLAY").env_remove("WAYLAND_SOCKET");
    }

    /// Has Sway do something.
    fn does(&self, words: &str) {
        let entries = fs::read_dir(self.folder.path()).expect("is there").flatten().map(|entry| entry.path());
        let is_its = |path: &PathBuf| path.extension().is_some_and(|own| own == "sock");
        let socket = entries.into_iter().find(is_its).expect("a socket for messages");
        let told = Command::new("swaymsg").arg("--socket").arg(socket).arg(words).output().expect("it comes with Sway");
        assert!(told.status.success(), "{words}: {}{}", text(&told.stdout), text(&told.stderr));
    }

    /// All that it shows, once it can tell.
    fn screenshot(&self) -> Option<RgbImage> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut command = Command::new(self.shooter);
        self.has_for(&mut command);
        let done = command.current_dir(folder.path()).env("XDG_PICTURES_DIR", folder.path()).output();
        done.expect("it comes with weston");
        let picture: PathBuf = fs::read_dir(folder.path()).expect("is there").flatten().next()?.path();
        Some(image::open(picture).ok()?.into_rgb8())
    }

    fn opens(&self, arguments: &[&str]) -> Child {
        let mut command = program();
        self.has_for(&mut command);
        command.args(["view", "builtin:spheres", "--validate", "--size", &size_text(SIZE)]).args(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts")
    }
}

impl Drop for Compositor {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Returns true if the smaller picture is somewhere in the larger one, bit by bit.
fn contains(large: &RgbImage, small: &[u8], [width, height]: [u16; 2]) -> bool {
    let (bytes, row) = (3 * usize::from(width), 3 * large.width() as usize);
    let pixels = large.as_raw();
    let lies_at = |at: usize| {
        let mut rows = small.chunks_exact(bytes).enumerate();
        rows.all(|(y, own)| pixels.get(at + y * row..at + y * row + bytes) == Some(own))
    };
    let places = |y: u32| (0..=large.width().saturating_sub(width.into())).map(move |x| (x, y));
    (0..=large.height().saturating_sub(height.into()))
        .flat_map(places)
        .any(|(x, y)| lies_at(y as usize * row + 3 * x as usize))
}

#[test]
fn a_window_under_wayland_shows_what_render_draws_and_ends_with_its_compositor() {
    let expected = rendered(SIZE, &["builtin:spheres"]);
    for (arguments, what) in [(&[][..], "a still window"), (&["--frames", "1000000"], "one that draws")] {
        let compositor = Compositor::start();
        let mut view = compositor.opens(arguments);
        until("the picture", || {
            assert!(view.try_wait().expect("can be asked").is_none(), "{what} has ended");
            compositor.screenshot().filter(|shot| contains(shot, &expected, SIZE))
        });
        drop(compositor);
        let output = end(view);
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(5), "{what}: {errors}");
        assert!(errors.contains("error: the window system failed: its connection broke"), "{what}: {errors}");
    }
}

#[test]
fn frames_under_wayland_are_drawn_without_a_message() {
    let compositor = Compositor::start();
    let output = end(compositor.opens(&["--frames", "30", "--vsync", "off"]));
    let (told, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success() && told.contains("30 frames shown"), "{told}{errors}");
}

/// The client's library prints each request.
#[test]
fn a_compositor_can_find_the_desktop_entry_of_a_window() {
    let compositor = Compositor::start();
    let mut command = program();
    compositor.has_for(&mut command);
    command.args(["view", "builtin:triangle", "--frames", "1"]).env("WAYLAND_DEBUG", "1");
    let output = end(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts"));
    let errors = text(&output.stderr);
    assert!(output.status.success() && errors.contains("set_app_id(\"afterlight\")"), "{errors}");
    let entry = fs::read_to_string(concat!(env!("AFTERLIGHT_ROOT"), "/assets/afterlight.desktop"));
    let entry = entry.expect("the file with that name");
    assert!(entry.lines().any(|line| line == "StartupWMClass=afterlight"), "{entry}");
}

/// Holds that the window has a pixel of the frame for each pixel of the display.
fn shows_as_many_pixels(compositor: Compositor, scale: f64) {
    // The size is asked for before the window knows its display: it is kept in points.
    let size = SIZE.map(|edge| (f64::from(edge) * scale) as u16);
    let expected = rendered(size, &["builtin:spheres"]);
    let mut view = compositor.opens(&[]);
    until("the picture", || {
        assert!(view.try_wait().expect("can be asked").is_none(), "the window has ended");
        compositor.screenshot().filter(|shot| contains(shot, &expected, size))
    });
    drop(compositor);
    let output = end(view);
    assert_eq!(output.status.code(), Some(5), "{}", text(&output.stderr));
}

#[test]
fn a_window_on_a_display_of_scale_2_has_a_pixel_of_the_frame_for_each_of_its_own() {
    shows_as_many_pixels(Compositor::start_at(2), 2.0);
}

#[test]
fn a_window_under_wayland_that_its_compositor_resizes_shows_the_picture_of_each_size() {
    let Some(compositor) = Compositor::sway(1.0) else {
        eprintln!("NOT RUN: a compositor that resizes windows is Sway {}.{} with grim", FRACTIONAL[0], FRACTIONAL[1]);
        return;
    };
    let mut view = compositor.opens(&[]);
    let [width, height] = SIZE;
    let mut shows = |size: [u16; 2]| {
        let expected = rendered(size, &["builtin:spheres"]);
        until("the picture", || {
            assert!(view.try_wait().expect("can be asked").is_none(), "the window has ended");
            compositor.screenshot().filter(|shot| contains(shot, &expected, size))
        });
    };
    shows(SIZE);
    for [width, height] in [[2 * width + 1, height + 30], [width - 9, 2 * height - 1], SIZE] {
        compositor.does(&format!("resize set width {width} px height {height} px"));
        shows([width, height]);
    }
    drop(compositor);
    let output = end(view);
    assert_eq!(output.status.code(), Some(5), "{}", text(&output.stderr));
}

#[test]
fn a_window_on_a_display_of_scale_1_5_or_2_5_has_a_pixel_of_the_frame_for_each_of_its_own() {
    for scale in [1.5, 2.5] {
        let Some(compositor) = Compositor::sway(scale) else {
            eprintln!(
                "NOT RUN: a display whose scale is no whole number needs Sway {}.{} and grim",
                FRACTIONAL[0], FRACTIONAL[1]
            );
            return;
        };
        shows_as_many_pixels(compositor, scale);
    }
}
