//! `afterlight view` in a real window: on an X server of each test's own (Xvfb), with synthetic keys and mouse, and what the window shows read
//! back from the server. All under core and synchronization validation, of which any message is exit code 1.
#![cfg(all(feature = "window", target_os = "linux"))]

use std::cell::RefCell;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt, EventMask, ImageFormat, InputFocus, MapState,
    Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// Nothing here takes longer, on a slow machine with layers on; it only bounds a test that fails.
const PATIENCE: Duration = Duration::from_secs(120);
const SIZE: [u16; 2] = [160, 90];

/// Key codes of the usual keyboard (evdev's, plus 8).
mod key {
    pub const ESCAPE: u8 = 9;
    pub const DIGIT_1: u8 = 10;
    pub const W: u8 = 25;
    pub const R: u8 = 27;
    pub const O: u8 = 32;
    pub const P: u8 = 33;
    pub const H: u8 = 43;
    pub const CONTROL: u8 = 37;
}

const KEY_PRESS: u8 = 2;
const KEY_RELEASE: u8 = 3;
const BUTTON_PRESS: u8 = 4;
const BUTTON_RELEASE: u8 = 5;
const MOTION: u8 = 6;

/// The program, on whichever Vulkan stack the tests run.
fn program() -> Command {
    let binary = env!("CARGO_BIN_EXE_afterlight");
    match std::env::var_os("AFTERLIGHT_RUNNER") {
        Some(runner) => {
            let mut command = Command::new(runner);
            command.arg(binary);
            command
        }
        None => Command::new(binary),
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Waits until `found` finds something.
fn until<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "waited in vain for {what}");
        sleep(Duration::from_millis(10));
    }
}

/// An X server without a screen that anybody sees, and without a window manager.
struct Server {
    process: RefCell<Child>,
    display: String,
    connection: RustConnection,
    root: Window,
}

impl Server {
    fn start() -> Self {
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]);
        let started = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut process =
            started.unwrap_or_else(|error| panic!("Xvfb does not start (scripts/setup installs it): {error}"));
        let mut number = String::new();
        let told = BufReader::new(process.stdout.take().expect("piped")).read_line(&mut number);
        assert!(told.is_ok() && !number.trim().is_empty(), "Xvfb tells no display: {told:?}");
        let display = format!(":{}", number.trim());
        let (connection, screen) = RustConnection::connect(Some(&display)).expect("the server takes connections");
        let root = connection.setup().roots[screen].root;
        Self { process: RefCell::new(process), display, connection, root }
    }

    fn kill(&self) {
        let mut process = self.process.borrow_mut();
        let _ = process.kill();
        let _ = process.wait();
    }

    /// The mapped window whose name has the program's in it.
    fn find(&self) -> Option<Window> {
        let connection = &self.connection;
        let named = |&window: &Window| {
            let name =
                connection.get_property(false, window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 256).ok()?.reply().ok()?;
            let mapped = connection.get_window_attributes(window).ok()?.reply().ok()?.map_state == MapState::VIEWABLE;
            (mapped && text(&name.value).contains("Afterlight")).then_some(())
        };
        connection.query_tree(self.root).ok()?.reply().ok()?.children.into_iter().find(|window| named(window).is_some())
    }

    fn fake(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        let sent = self.connection.xtest_fake_input(kind, detail, 0, self.root, x, y, 0);
        sent.expect("sent").check().expect("the server has XTEST");
    }

    fn press(&self, key: u8) {
        self.fake(KEY_PRESS, key, [0; 2]);
    }

    fn release(&self, key: u8) {
        self.fake(KEY_RELEASE, key, [0; 2]);
    }

    fn tap(&self, key: u8) {
        self.press(key);
        self.release(key);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.kill();
    }
}

/// The program with its window.
struct View<'a> {
    server: &'a Server,
    process: Option<Child>,
    window: Window,
    folder: TempDir,
}

impl<'a> View<'a> {
    /// Opens a window and waits for it.
    fn open(server: &'a Server, arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut command = program();
        command.env("DISPLAY", &server.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.current_dir(folder.path()).args(["view", "--validate"]).args(arguments);
        command.stdout(Stdio::piped()).stderr(fs::File::create(folder.path().join("errors")).expect("a file"));
        let process = command.spawn().expect("the program starts");
        let mut view = Self { server, process: Some(process), window: 0, folder };
        view.window = until("the window", || {
            view.assert_running();
            server.find()
        });
        // Without a window manager nobody else gives it the keys.
        let focused = server.connection.set_input_focus(InputFocus::PARENT, view.window, x11rb::CURRENT_TIME);
        focused.expect("sent").check().expect("the window takes the keys");
        view
    }

    fn assert_running(&mut self) {
        let process = self.process.as_mut().expect("started");
        if let Some(status) = process.try_wait().expect("can be asked") {
            panic!("it has ended with {status}: {}", self.errors());
        }
    }

    /// What it has told so far.
    fn errors(&self) -> String {
        fs::read_to_string(self.folder.path().join("errors")).unwrap_or_default()
    }

    fn size(&self) -> [u16; 2] {
        let geometry = self.server.connection.get_geometry(self.window).expect("sent").reply().expect("a window");
        [geometry.width, geometry.height]
    }

    /// What the window shows, RGB.
    fn pixels(&self) -> Vec<u8> {
        let [width, height] = self.size();
        let asked = self.server.connection.get_image(ImageFormat::Z_PIXMAP, self.window, 0, 0, width, height, !0);
        let image = asked.expect("sent").reply().expect("the window is visible");
        assert!(image.depth == 24 || image.depth == 32, "{}", image.depth);
        // Little-endian words of 0x00RRGGBB.
        image.data.as_chunks::<4>().0.iter().flat_map(|&[b, g, r, _]| [r, g, b]).collect()
    }

    /// Waits until the window shows this.
    fn shows(&mut self, expected: &[u8], what: &str) {
        let begun = Instant::now();
        loop {
            self.assert_running();
            let pixels = self.pixels();
            if pixels == expected {
                return;
            }
            if begun.elapsed() > PATIENCE {
                let different = pixels.iter().zip(expected).filter(|(own, other)| own != other).count();
                let most = pixels.iter().zip(expected).map(|(own, other)| own.abs_diff(*other)).max();
                panic!("{what}: {different} of {} bytes differ, by up to {most:?}; {}", pixels.len(), self.errors());
            }
            sleep(Duration::from_millis(20));
        }
    }

    /// Waits until the picture stands still, and is another one.
    fn settles_elsewhere(&mut self, before: &[u8]) -> Vec<u8> {
        until("another picture", || (self.pixels() != before).then_some(()));
        let mut last = self.pixels();
        until("a still picture", || {
            sleep(Duration::from_millis(400));
            let next = std::mem::replace(&mut last, self.pixels());
            (next == last).then_some(())
        });
        self.assert_running();
        last
    }

    fn waits_to_tell(&mut self, word: &str) {
        until(word, || self.errors().contains(word).then_some(()));
    }

    fn resize(&self, [width, height]: [u32; 2]) {
        let to = ConfigureWindowAux::new().width(width).height(height);
        self.server.connection.configure_window(self.window, &to).expect("sent").check().expect("a window");
    }

    /// Closes the window as a window manager does.
    fn close(&self) {
        let atom =
            |name: &[u8]| self.server.connection.intern_atom(false, name).expect("sent").reply().expect("an atom").atom;
        let message =
            ClientMessageEvent::new(32, self.window, atom(b"WM_PROTOCOLS"), [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0]);
        let sent = self.server.connection.send_event(false, self.window, EventMask::NO_EVENT, message);
        sent.expect("sent").check().expect("a window");
    }

    /// Waits for the end.
    fn ends(mut self) -> (Option<i32>, String, String) {
        let process = self.process.as_mut().expect("started");
        let status = until("the program's end", || process.try_wait().expect("can be asked"));
        let process = self.process.take().expect("started");
        let Output { stdout, .. } = process.wait_with_output().expect("it has ended");
        (status.code(), text(&stdout), self.errors())
    }

    fn ends_well(self) -> String {
        let (code, output, errors) = self.ends();
        assert_eq!(code, Some(0), "{output}{errors}");
        output
    }

    /// Seconds of CPU time that it has used.
    fn cpu_seconds(&self) -> f64 {
        let pid = self.process.as_ref().expect("started").id();
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).expect("it runs");
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
        // proc(5): utime and stime, in hundredths of a second, are the 14th and 15th field; the 3rd is the first here.
        [11, 12].iter().map(|&index| fields[index].parse::<f64>().expect("a number") / 100.0).sum()
    }
}

impl Drop for View<'_> {
    fn drop(&mut self) {
        if let Some(mut process) = self.process.take() {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

fn size_text([width, height]: [u16; 2]) -> String {
    format!("{width}x{height}")
}

fn rgb(path: &Path) -> Vec<u8> {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgb8().into_raw()
}

/// The same picture without a window.
fn rendered(size: [u16; 2], arguments: &[&str]) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path: PathBuf = folder.path().join("rendered.png");
    let mut command = program();
    command
        .arg("render")
        .args(arguments)
        .args(["--samples", "1", "--quiet", "--size", &size_text(size), "-o"])
        .arg(&path);
    let output = command.output().expect("the program starts");
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    rgb(&path)
}

/// Each way in which the last pass writes the picture: LIGHTING, FORWARD, TONEMAP after blending, a resolve, FXAA's pass, and the copy of what
/// a compute pass wrote.
const WAYS: &[&[&str]] = &[
    &["builtin:hall", "--light-path", "loop"],
    &["builtin:spheres", "--light-path", "forward"],
    &["builtin:layers"],
    &["builtin:spheres", "--msaa", "4"],
    &["builtin:spheres", "--fxaa", "on"],
    &["builtin:spheres", "--light-path", "compute"],
];

#[test]
fn the_window_shows_bit_by_bit_what_render_draws_and_so_does_a_screenshot() {
    let server = Server::start();
    for arguments in WAYS {
        let expected = rendered(SIZE, arguments);
        let size = size_text(SIZE);
        let mut view = View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat());
        view.shows(&expected, &format!("{arguments:?}"));
        server.tap(key::P);
        view.waits_to_tell("screenshot: ");
        let kept = rgb(&view.folder.path().join("afterlight-0001.png"));
        assert!(kept == expected, "{arguments:?}: the screenshot is another picture");
        server.tap(key::ESCAPE);
        view.ends_well();
    }
}

#[test]
fn keys_and_the_mouse_move_the_camera_and_bring_it_back() {
    let server = Server::start();
    let size = size_text(SIZE);
    let scene = ["builtin:spheres"];
    let first = rendered(SIZE, &scene);
    let mut view = View::open(&server, &[scene[0], "--size", &size]);
    view.shows(&first, "before anything is pressed");

    server.press(key::W);
    sleep(Duration::from_millis(300));
    server.release(key::W);
    let nearer = view.settles_elsewhere(&first);
    server.press(key::CONTROL);
    server.tap(key::DIGIT_1);
    server.release(key::CONTROL);
    view.waits_to_tell("camera 1 is kept");

    server.fake(MOTION, 0, [40, 40]);
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    server.fake(MOTION, 0, [60, 45]);
    server.fake(MOTION, 0, [70, 45]);
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    let turned = view.settles_elsewhere(&nearer);
    // Without a button the mouse only passes by.
    server.fake(MOTION, 0, [100, 60]);
    sleep(Duration::from_millis(300));
    assert!(view.pixels() == turned, "the mouse turns the camera without a button");

    server.tap(key::DIGIT_1);
    view.shows(&nearer, "where a camera was kept");
    server.tap(key::R);
    view.shows(&first, "after a reset");
    server.tap(key::O);
    view.waits_to_tell("camera: orbit");
    server.tap(key::H);
    view.waits_to_tell("Ctrl+1 to Ctrl+9");
    view.close();
    view.ends_well();
}

#[test]
fn a_hundred_resizes_end_in_the_picture_of_the_last_size() {
    let server = Server::start();
    let scene = ["builtin:spheres"];
    let size = size_text(SIZE);
    let mut view = View::open(&server, &[scene[0], "--size", &size]);
    view.shows(&rendered(SIZE, &scene), "as it was opened");
    let mut random = fastrand::Rng::with_seed(7);
    for number in 0..100 {
        let size = match number {
            10 | 60 => [1, 1],
            20 => [1, 300],
            30 => [300, 1],
            _ => [random.u32(1..400), random.u32(1..300)],
        };
        view.resize(size);
        // Some come while a frame is drawn, some after it.
        sleep(Duration::from_millis(random.u64(0..60)));
        view.assert_running();
    }
    let last = [200u16, 120];
    view.resize(last.map(u32::from));
    view.shows(&rendered(last, &scene), "after a hundred resizes");
    view.close();
    view.ends_well();
}

#[test]
fn a_hidden_or_still_window_draws_nothing_and_comes_back_as_it_was() {
    let server = Server::start();
    let scene = ["builtin:spheres"];
    let expected = rendered(SIZE, &scene);
    let size = size_text(SIZE);
    let mut view = View::open(&server, &[scene[0], "--size", &size]);
    view.shows(&expected, "as it was opened");
    let idles = |view: &View, what: &str| {
        sleep(Duration::from_millis(500));
        let before = view.cpu_seconds();
        sleep(Duration::from_secs(2));
        let used = view.cpu_seconds() - before;
        assert!(used < 0.2, "{what} window took {used} s of CPU time in 2 s");
    };
    idles(&view, "a still");
    server.connection.unmap_window(view.window).expect("sent").check().expect("a window");
    idles(&view, "a hidden");
    server.connection.map_window(view.window).expect("sent").check().expect("a window");
    view.shows(&expected, "when it is back");
    view.close();
    view.ends_well();
}

#[test]
fn a_number_of_frames_is_drawn_timed_and_then_the_window_closes() {
    let server = Server::start();
    let size = size_text(SIZE);
    let view = View::open(&server, &["builtin:spheres", "--size", &size, "--frames", "30", "--vsync", "off"]);
    let output = view.ends_well();
    assert!(output.contains("30 frames shown") && output.contains("from frame to frame, median"), "{output}");
}

#[test]
fn a_window_that_is_closed_while_it_draws_ends_well() {
    let server = Server::start();
    let size = size_text(SIZE);
    let view = View::open(&server, &["builtin:spheres", "--size", &size, "--frames", "1000000"]);
    sleep(Duration::from_millis(500));
    view.close();
    view.ends_well();
}

#[test]
fn a_server_that_goes_away_is_an_error_and_no_panic() {
    let server = Server::start();
    let size = size_text(SIZE);
    let mut view = View::open(&server, &["builtin:spheres", "--size", &size, "--frames", "1000000"]);
    sleep(Duration::from_millis(500));
    view.assert_running();
    server.kill();
    let (code, _, errors) = view.ends();
    assert_eq!(code, Some(5), "{errors}");
    assert!(errors.contains("error: the window system failed"), "{errors}");
}

#[test]
fn without_a_display_it_says_so_and_names_render() {
    for display in [None, Some(":7654")] {
        let mut command = program();
        command.arg("view").env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.envs(display.map(|display| ("DISPLAY", display)));
        let output = command.output().expect("the program starts");
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(5), "{errors}");
        assert!(
            errors.starts_with("error: no window can be opened here: ") && errors.contains("`afterlight render`"),
            "{errors}"
        );
        assert!(!errors.contains(".rs"), "{errors}");
    }
}
