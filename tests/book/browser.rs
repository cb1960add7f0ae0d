//! Headless Chromium, driven through a pipe by the DevTools protocol, with a reader's screen sizes, keys and touches.
//!
//! The protocol: <https://chromedevtools.github.io/devtools-protocol>. Through `--remote-debugging-pipe` the browser reads messages from descriptor 3 and writes them
//! to 4; each ends with a zero byte.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use base64::Engine;
use image::RgbImage;
use serde_json::{Value, json};
use tempfile::TempDir;

/// The names that Chromium has.
const NAMES: [&str; 3] = ["chromium", "google-chrome", "chromium-browser"];

/// A browser with one page.
pub struct Browser {
    process: Child,
    messages: File,
    answers: BufReader<File>,
    last: u64,
    session: Option<String>,
    /// Holds the profile and the pipes.
    _folder: TempDir,
}

impl Browser {
    /// Starts Chromium with an empty page. Returns `None` if it is not installed.
    pub fn start() -> Option<Self> {
        let is_there =
            |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
        let name = NAMES.into_iter().find(is_there)?;
        let folder = tempfile::tempdir().expect("a temporary folder");
        let pipes = ["messages", "answers"].map(|name| folder.path().join(name));
        assert!(Command::new("mkfifo").args(&pipes).status().expect("it comes with coreutils").success());
        let mut command = Command::new("bash");
        command.args([
            "-c",
            r#"exec "$0" "$@" 3<messages 4>answers"#,
            name,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
        ]);
        command.args([
            "--no-first-run",
            "--disable-background-networking",
            "--hide-scrollbars",
            "--remote-debugging-pipe",
        ]);
        command.arg(format!("--user-data-dir={}", folder.path().join("profile").display()));
        let process = command.current_dir(folder.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        // Each waits for the other end, in the order in which bash opens them.
        let messages = File::options().write(true).open(&pipes[0]).expect("a pipe");
        let answers = BufReader::new(File::open(&pipes[1]).expect("a pipe"));
        let mut browser =
            Self { process: process.expect("bash starts"), messages, answers, last: 0, session: None, _folder: folder };
        let target = browser.ask("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let session =
            browser.ask("Target.attachToTarget", json!({ "targetId": target, "flatten": true }))["sessionId"].clone();
        browser.session = session.as_str().map(str::to_owned);
        browser.ask("Page.enable", json!({}));
        let nothing = json!({ "offline": true, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0 });
        browser.ask("Network.emulateNetworkConditions", nothing);
        Some(browser)
    }

    fn next_message(&mut self) -> Value {
        let mut bytes = Vec::new();
        self.answers.read_until(0, &mut bytes).expect("the browser's answer");
        assert_eq!(bytes.pop(), Some(0), "the browser has ended");
        serde_json::from_slice(&bytes).expect("an answer is JSON")
    }

    /// Calls a method and returns its result.
    pub fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.last += 1;
        let mut message = json!({ "id": self.last, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.messages.write_all(format!("{message}\0").as_bytes()).expect("the browser listens");
        loop {
            let mut answer = self.next_message();
            if answer["id"] == self.last {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].take();
            }
        }
    }

    /// Opens a page on a screen of this size (a phone's if it is narrow) and waits until the page has loaded.
    pub fn open(&mut self, page: &Path, [width, height]: [u32; 2]) {
        let is_phone = width < 500;
        let screen = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": is_phone });
        self.ask("Emulation.setDeviceMetricsOverride", screen);
        self.ask("Emulation.setTouchEmulationEnabled", json!({ "enabled": is_phone }));
        let opened = self.ask("Page.navigate", json!({ "url": format!("file://{}", page.display()) }));
        assert!(opened["errorText"].is_null(), "{}: {}", page.display(), opened["errorText"]);
        while self.next_message()["method"] != "Page.loadEventFired" {}
    }

    /// Evaluates JavaScript in the page, as text.
    pub fn evaluate(&mut self, script: &str) -> String {
        let found =
            self.ask("Runtime.evaluate", json!({ "expression": format!("String({script})"), "returnByValue": true }));
        assert!(found["exceptionDetails"].is_null(), "{script}: {}", found["exceptionDetails"]);
        found["result"]["value"].as_str().unwrap_or_default().to_owned()
    }

    /// Presses a key where the focus is, which goes to the first element that the selector finds.
    pub fn press(&mut self, selector: &str, key: &str, code: u32) {
        self.evaluate(&format!("document.querySelector({selector:?}).focus()"));
        for kind in ["rawKeyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code });
            self.ask("Input.dispatchKeyEvent", event);
        }
    }

    /// The pixels of the page at this share of the width and height of the first element that the selector finds, scrolled into view.
    fn place(&mut self, selector: &str, [x, y]: [f64; 2]) -> [f64; 2] {
        let script = format!(
            "(() => {{ const found = document.querySelector({selector:?}); found.scrollIntoView({{ block: 'center' }});
                const box = found.getBoundingClientRect(); return [box.left + box.width * {x}, box.top + box.height * {y}]; }})()"
        );
        let told = self.evaluate(&script);
        let (x, y) = told.split_once(',').expect("two numbers");
        [x, y].map(|number| number.parse().expect("a number"))
    }

    /// Puts a finger there and lifts it.
    pub fn touch(&mut self, selector: &str, share: [f64; 2]) {
        let [x, y] = self.place(selector, share);
        self.ask("Input.dispatchTouchEvent", json!({ "type": "touchStart", "touchPoints": [{ "x": x, "y": y }] }));
        self.ask("Input.dispatchTouchEvent", json!({ "type": "touchEnd", "touchPoints": [] }));
    }

    /// Moves the mouse there with its button up.
    pub fn point(&mut self, selector: &str, share: [f64; 2]) {
        let [x, y] = self.place(selector, share);
        self.ask("Input.dispatchMouseEvent", json!({ "type": "mouseMoved", "x": x, "y": y }));
    }

    /// Presses the mouse's button at one share of an element, drags it to another, and lets go.
    pub fn drag(&mut self, selector: &str, from: [f64; 2], to: [f64; 2]) {
        for (kind, share, buttons) in [("mousePressed", from, 1), ("mouseMoved", to, 1), ("mouseReleased", to, 0)] {
            let [x, y] = self.place(selector, share);
            let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
            self.ask("Input.dispatchMouseEvent", event);
        }
    }

    /// All that the screen shows.
    pub fn screenshot(&mut self) -> RgbImage {
        let told = self.ask("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = base64::engine::general_purpose::STANDARD.decode(told["data"].as_str().expect("a picture"));
        image::load_from_memory(&bytes.expect("base64")).expect("a PNG").into_rgb8()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
