//! An X server for a test, the program's window on it, and the actions of a user.

use std::cell::RefCell;
use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::program::{example, program};
use tempfile::TempDir;
use x11rb::connection::Connection;
use x11rb::protocol::res::ConnectionExt as _;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt, EventMask, ImageFormat, InputFocus, MapState,
    Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// The middle of the box before "FXAA", as the panel is laid out in a window of 480x680: each setting before it that the panel shows moves it down by 21 pixels.
pub const FXAA_BOX: [i16; 2] = [44, 588];
/// Nothing here takes longer, on a slow machine with layers on; it only bounds a test that fails.
pub const PATIENCE: Duration = Duration::from_secs(120);
pub const SIZE: [u16; 2] = [160, 90];

/// Key codes of the usual keyboard (evdev's, plus 8).
pub mod key {
    pub const ESCAPE: u8 = 9;
    pub const DIGIT_1: u8 = 10;
    pub const W: u8 = 25;
    pub const B: u8 = 56;
    pub const G: u8 = 42;
    pub const K: u8 = 45;
    pub const F: u8 = 41;
    pub const V: u8 = 55;
    pub const T: u8 = 28;
    pub const R: u8 = 27;
    pub const O: u8 = 32;
    pub const X: u8 = 53;
    pub const Z: u8 = 52;
    pub const P: u8 = 33;
    pub const H: u8 = 43;
    pub const N: u8 = 57;
    pub const ENTER: u8 = 36;
    pub const BRACKET_LEFT: u8 = 34;
    pub const BRACKET_RIGHT: u8 = 35;
    pub const COMMA: u8 = 59;
    pub const PERIOD: u8 = 60;
    pub const CONTROL: u8 = 37;
    pub const SHIFT: u8 = 50;
}

pub const KEY_PRESS: u8 = 2;
pub const KEY_RELEASE: u8 = 3;
pub const BUTTON_PRESS: u8 = 4;
pub const BUTTON_RELEASE: u8 = 5;
pub const MOTION: u8 = 6;

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Waits until `found` finds something.
pub fn until<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "waited in vain for {what}");
        sleep(Duration::from_millis(10));
    }
}

/// Waits for a program that ends by itself, and returns its output.
pub fn end(mut program: Child) -> Output {
    let begun = Instant::now();
    while program.try_wait().expect("can be asked").is_none() {
        if begun.elapsed() > PATIENCE {
            let _ = program.kill();
            panic!("waited in vain for the program's end: {:?}", program.wait_with_output());
        }
        sleep(Duration::from_millis(10));
    }
    program.wait_with_output().expect("it has ended")
}

/// An X server without a screen that anybody sees, and without a window manager.
pub struct Server {
    process: RefCell<Child>,
    display: String,
    pub connection: RustConnection,
    root: Window,
    environment: Vec<(&'static str, OsString)>,
}

impl Server {
    /// Starts a server like most: 8 bits a channel.
    pub fn start() -> Self {
        Self::of_depth(24)
    }

    /// Starts a server with windows of `bits` bits a pixel.
    pub fn of_depth(bits: u32) -> Self {
        let mut command = Command::new("Xvfb");
        let screen = format!("1280x1024x{bits}");
        command.args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp"]);
        let started = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut process =
            started.unwrap_or_else(|error| panic!("Xvfb does not start (scripts/setup installs it): {error}"));
        let mut number = String::new();
        let told = BufReader::new(process.stdout.take().expect("piped")).read_line(&mut number);
        assert!(told.is_ok() && !number.trim().is_empty(), "Xvfb tells no display: {told:?}");
        let display = format!(":{}", number.trim());
        let (connection, screen) = RustConnection::connect(Some(&display)).expect("the server takes connections");
        let root = connection.setup().roots[screen].root;
        Self { process: RefCell::new(process), display, connection, root, environment: Vec::new() }
    }

    /// Adds variables to the environment of the programs that open their windows here.
    pub fn with_environment(mut self, environment: Vec<(&'static str, OsString)>) -> Self {
        self.environment = environment;
        self
    }

    /// Has a program open its windows here.
    pub fn serves(&self, command: &mut Command) {
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.envs(self.environment.iter().cloned());
    }

    pub fn kill(&self) {
        let mut process = self.process.borrow_mut();
        let _ = process.kill();
        let _ = process.wait();
    }

    /// The mapped window whose name has the program's in it.
    pub fn find(&self) -> Option<Window> {
        let connection = &self.connection;
        let named = |&window: &Window| {
            let name =
                connection.get_property(false, window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 256).ok()?.reply().ok()?;
            let mapped = connection.get_window_attributes(window).ok()?.reply().ok()?.map_state == MapState::VIEWABLE;
            (mapped && text(&name.value).contains("Afterlight")).then_some(())
        };
        connection.query_tree(self.root).ok()?.reply().ok()?.children.into_iter().find(|window| named(window).is_some())
    }

    /// Returns the number of connections; the test's own is one.
    pub fn connections(&self) -> usize {
        self.connection.res_query_clients().expect("sent").reply().expect("the server has X-Resource").clients.len()
    }

    pub fn fake(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        let sent = self.connection.xtest_fake_input(kind, detail, 0, self.root, x, y, 0);
        sent.expect("sent").check().expect("the server has XTEST");
    }

    pub fn press(&self, key: u8) {
        self.fake(KEY_PRESS, key, [0; 2]);
    }

    pub fn release(&self, key: u8) {
        self.fake(KEY_RELEASE, key, [0; 2]);
    }

    pub fn tap(&self, key: u8) {
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
pub struct View<'a> {
    server: &'a Server,
    process: Option<Child>,
    pub window: Window,
    pub folder: TempDir,
}

impl<'a> View<'a> {
    /// Opens a window, under validation, and waits for it.
    pub fn open(server: &'a Server, arguments: &[&str]) -> Self {
        Self::start(server, &[&["--validate"], arguments].concat())
    }

    /// Opens a window and waits for it.
    pub fn start(server: &'a Server, arguments: &[&str]) -> Self {
        let mut command = program();
        command.arg("view").args(arguments);
        if !arguments.contains(&"--messages") {
            // Messages go after some seconds; most tests wait for the picture without them.
            command.args(["--messages", "off"]);
        }
        if !arguments.contains(&"--dynamic-resolution") {
            // Pictures that depend on the machine's speed have separate tests.
            command.args(["--dynamic-resolution", "off"]);
        }
        Self::of(server, command)
    }

    /// Opens a window of an example and waits for it.
    pub fn example(server: &'a Server, name: &str, arguments: &[&str]) -> Self {
        let mut command = example(name);
        command.args(arguments);
        Self::of(server, command)
    }

    fn of(server: &'a Server, mut command: Command) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        server.serves(&mut command);
        command.current_dir(folder.path());
        command.stdout(Stdio::piped()).stderr(fs::File::create(folder.path().join("errors")).expect("a file"));
        let process = command.spawn().expect("the program starts");
        let mut view = Self { server, process: Some(process), window: 0, folder };
        view.window = until("the window", || {
            view.assert_running();
            server.find()
        });
        // No window manager gives the window the keyboard focus.
        let focused = server.connection.set_input_focus(InputFocus::PARENT, view.window, x11rb::CURRENT_TIME);
        focused.expect("sent").check().expect("the window takes the keys");
        view
    }

    pub fn assert_running(&mut self) {
        let process = self.process.as_mut().expect("started");
        if let Some(status) = process.try_wait().expect("can be asked") {
            panic!("it has ended with {status}: {}", self.errors());
        }
    }

    /// Returns the program's standard error so far.
    pub fn errors(&self) -> String {
        fs::read_to_string(self.folder.path().join("errors")).unwrap_or_default()
    }

    pub fn size(&self) -> [u16; 2] {
        let geometry = self.server.connection.get_geometry(self.window).expect("sent").reply().expect("a window");
        [geometry.width, geometry.height]
    }

    /// Returns the window's pixels, RGB.
    pub fn pixels(&self) -> Vec<u8> {
        self.part([0; 2], self.size())
    }

    /// Returns the window's pixels on a server of depth 30: RGB, 0 to 1023.
    pub fn codes_of_10_bits(&self) -> Vec<u16> {
        let (depth, words) = self.image([0; 2], self.size());
        assert_eq!(depth, 30);
        // Little-endian words, blue in the lowest bits.
        let words = words.as_chunks::<4>().0.iter().map(|&bytes| u32::from_le_bytes(bytes));
        words.flat_map(|word| [20, 10, 0].map(|shift| (word >> shift & 0x3ff) as u16)).collect()
    }

    fn image(&self, [x, y]: [i16; 2], [width, height]: [u16; 2]) -> (u8, Vec<u8>) {
        let asked = self.server.connection.get_image(ImageFormat::Z_PIXMAP, self.window, x, y, width, height, !0);
        let image = asked.expect("sent").reply().expect("the window is visible");
        (image.depth, image.data)
    }

    /// A rectangle of the pixels, by its upper left corner and its size.
    pub fn part(&self, corner: [i16; 2], size: [u16; 2]) -> Vec<u8> {
        let (depth, data) = self.image(corner, size);
        assert!(depth == 24 || depth == 32, "{depth}");
        // Little-endian words of 0x00RRGGBB.
        data.as_chunks::<4>().0.iter().flat_map(|&[b, g, r, _]| [r, g, b]).collect()
    }

    /// Waits until the window shows this.
    pub fn shows(&mut self, expected: &[u8], what: &str) {
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

    /// Waits until the picture is another one, and returns one that is.
    pub fn moves_on(&mut self, before: &[u8]) -> Vec<u8> {
        until("another picture", || Some(self.pixels()).filter(|pixels| pixels != before))
    }

    /// Waits until the picture is another one, and the program draws no more.
    pub fn settles_elsewhere(&mut self, before: &[u8]) -> Vec<u8> {
        until("another picture", || (self.pixels() != before).then_some(()));
        self.rests();
        self.pixels()
    }

    /// Moves the camera forward so long, and returns the picture there.
    pub fn goes_nearer(&mut self, before: &[u8], time: Duration) -> Vec<u8> {
        self.server.press(key::W);
        sleep(time);
        self.server.release(key::W);
        self.settles_elsewhere(before)
    }

    /// Has the program keep its camera under 1.
    pub fn keeps_camera_1(&mut self) {
        self.server.press(key::CONTROL);
        self.server.tap(key::DIGIT_1);
        self.server.release(key::CONTROL);
        self.waits_to_tell("camera 1 is kept");
    }

    /// Waits until the program has done all that it was asked for, and draws no more.
    pub fn rests(&mut self) {
        until("the program's rest", || {
            self.assert_running();
            self.rests_for(Duration::from_millis(250)).then_some(())
        });
    }

    /// Returns true if nothing is drawn or computed all that time. On a busy machine a program at work may get little of the processor, so a thread
    /// that is ready to run is not at rest.
    fn rests_for(&self, time: Duration) -> bool {
        let (begun, used) = (Instant::now(), self.cpu_seconds());
        while begun.elapsed() < time {
            if self.states().contains('R') || self.cpu_seconds() > used {
                return false;
            }
            sleep(Duration::from_millis(10));
        }
        true
    }

    /// A letter for each of its threads (proc(5)): R runs or is ready to.
    fn states(&self) -> String {
        let pid = self.process.as_ref().expect("started").id();
        let tasks = fs::read_dir(format!("/proc/{pid}/task")).map(|tasks| tasks.flatten().collect::<Vec<_>>());
        let state = |task: &fs::DirEntry| {
            let stat = fs::read_to_string(task.path().join("stat")).ok()?;
            stat.rsplit(')').next()?.trim().chars().next()
        };
        tasks.unwrap_or_default().iter().filter_map(state).collect()
    }

    pub fn waits_to_tell(&mut self, word: &str) {
        until(word, || {
            self.assert_running();
            self.errors().contains(word).then_some(())
        });
    }

    pub fn resize(&self, [width, height]: [u32; 2]) {
        let to = ConfigureWindowAux::new().width(width).height(height);
        self.server.connection.configure_window(self.window, &to).expect("sent").check().expect("a window");
    }

    /// Closes the window as a window manager does.
    pub fn close(&self) {
        let atom =
            |name: &[u8]| self.server.connection.intern_atom(false, name).expect("sent").reply().expect("an atom").atom;
        let message =
            ClientMessageEvent::new(32, self.window, atom(b"WM_PROTOCOLS"), [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0]);
        let sent = self.server.connection.send_event(false, self.window, EventMask::NO_EVENT, message);
        sent.expect("sent").check().expect("a window");
    }

    /// Waits for the end.
    pub fn ends(mut self) -> (Option<i32>, String, String) {
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = self.process.as_mut().expect("started").try_wait().expect("can be asked") {
                break status;
            }
            assert!(
                begun.elapsed() < PATIENCE,
                "it does not end; its threads:\n{}it told: {}",
                self.threads(),
                self.errors()
            );
            sleep(Duration::from_millis(10));
        };
        let process = self.process.take().expect("started");
        let Output { stdout, .. } = process.wait_with_output().expect("it has ended");
        (status.code(), text(&stdout), self.errors())
    }

    /// Closes the window, and returns the program's output.
    pub fn closes_well(self) -> String {
        self.close();
        self.ends_well()
    }

    pub fn ends_well(self) -> String {
        let (code, output, errors) = self.ends();
        assert_eq!(code, Some(0), "{output}{errors}");
        output
    }

    /// As [`View::ends_well`], but returns the standard error.
    pub fn ends_telling(self) -> String {
        let (code, output, errors) = self.ends();
        assert_eq!(code, Some(0), "{output}{errors}");
        errors
    }

    /// Describes each thread, for a test that waits in vain: name, state, where in the kernel it sleeps, system call.
    fn threads(&self) -> String {
        let pid = self.process.as_ref().expect("started").id();
        let tasks = fs::read_dir(format!("/proc/{pid}/task")).map(|tasks| tasks.flatten().collect::<Vec<_>>());
        let told = |task: &fs::DirEntry| {
            let read = |name: &str| fs::read_to_string(task.path().join(name)).unwrap_or_default();
            let status = read("status");
            let state = status.lines().find(|line| line.starts_with("State:")).unwrap_or_default();
            format!("{}: {state}, {}, {}\n", read("comm").trim(), read("wchan"), read("syscall").trim())
        };
        tasks.unwrap_or_default().iter().map(told).collect()
    }

    /// Seconds of CPU time that it has used.
    pub fn cpu_seconds(&self) -> f64 {
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

pub fn size_text([width, height]: [u16; 2]) -> String {
    format!("{width}x{height}")
}

pub fn rgb(path: &Path) -> Vec<u8> {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgb8().into_raw()
}

pub fn floats(path: &Path) -> Vec<f32> {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgb32f().into_raw()
}

/// Returns the picture that the program draws without a window.
pub fn rendered(size: [u16; 2], arguments: &[&str]) -> Vec<u8> {
    rgb(&render(size, arguments, "rendered.png").path().join("rendered.png"))
}

/// Draws a picture into a file of the folder that it returns.
pub fn render(size: [u16; 2], arguments: &[&str], file: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = program();
    command.current_dir(folder.path()).arg("render").args(arguments);
    command.args(["--samples", "1", "--quiet", "--size", &size_text(size), "-o", file]);
    let output = command.output().expect("the program starts");
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    folder
}
