//! A headless Chromium, driven over the DevTools protocol through two pipes.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// What Chromium is called.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// For an answer, on a machine that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(120);

/// A page that is open, and the browser around it, which ends with it.
pub(crate) struct Browser {
    child: Child,
    input: ChildStdin,
    messages: Receiver<Value>,
    /// Messages that were not asked for, in the order they came.
    pub(crate) events: Vec<Value>,
    number: u64,
    session: Option<String>,
    profile: PathBuf,
}

impl Browser {
    /// Opens a file in a window of this size; `folder` is for the browser's own files and for downloads.
    pub(crate) fn open(page: &Path, folder: &Path, size: [u32; 2]) -> Self {
        let profile = folder.join("profile");
        std::fs::create_dir_all(&profile).expect("a folder for the profile");
        let mut child = start(&profile);
        let input = child.stdin.take().expect("a pipe");
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        let (send, messages) = channel();
        std::thread::spawn(move || {
            for message in output.split(0).map_while(Result::ok) {
                let message = serde_json::from_slice(&message).expect("Chromium answers in JSON");
                if send.send(message).is_err() {
                    break;
                }
            }
        });
        let mut browser = Self { child, input, messages, events: Vec::new(), number: 0, session: None, profile };
        browser.attach(folder, size);
        let url = format!("file://{}", page.display());
        browser.call("Page.navigate", json!({ "url": url }));
        browser.event("Page.loadEventFired");
        browser.evaluate("ready.then(() => true)");
        browser
    }

    fn attach(&mut self, folder: &Path, [width, height]: [u32; 2]) {
        let target = self.call("Target.createTarget", json!({ "url": "about:blank" }));
        let session = self.call("Target.attachToTarget", json!({ "targetId": target["targetId"], "flatten": true }));
        self.session = session["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Network", "Runtime", "DOM", "Log"] {
            self.call(&format!("{domain}.enable"), json!({}));
        }
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500 });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let downloads = json!({ "behavior": "allow", "downloadPath": folder, "eventsEnabled": true });
        self.call("Browser.setDownloadBehavior", downloads);
    }

    /// Calls a method and waits for its result.
    pub(crate) fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.number += 1;
        let mut message = json!({ "id": self.number, "method": method, "params": parameters });
        if let Some(session) = &self.session
            && !method.starts_with("Browser.")
        {
            message["sessionId"] = json!(session);
        }
        let mut line = message.to_string().into_bytes();
        line.push(0);
        self.input.write_all(&line).expect("Chromium listens");
        loop {
            let answer = self.next(method);
            if answer["id"] == self.number {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    /// Waits for an event of this name, and takes it out of the list.
    pub(crate) fn event(&mut self, name: &str) -> Value {
        loop {
            if let Some(found) = self.events.iter().position(|event| event["method"] == name) {
                return self.events.remove(found)["params"].clone();
            }
            let message = self.next(name);
            self.events.push(message);
        }
    }

    fn next(&self, for_what: &str) -> Value {
        self.messages.recv_timeout(PATIENCE).unwrap_or_else(|why| panic!("no answer to {for_what}: {why}"))
    }

    /// The value of an expression, awaited if it is a promise.
    pub(crate) fn evaluate(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let found = self.call("Runtime.evaluate", parameters);
        assert!(found["exceptionDetails"].is_null(), "{expression}: {}", found["exceptionDetails"]);
        found["result"]["value"].clone()
    }

    /// An expression's numbers.
    pub(crate) fn numbers(&mut self, expression: &str) -> Vec<f64> {
        let found = self.evaluate(&format!("Array.from({expression})"));
        found.as_array().expect("an array").iter().map(|value| value.as_f64().expect("a number")).collect()
    }

    /// Waits until what changed is drawn.
    pub(crate) fn settle(&mut self) {
        let frame = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))";
        self.evaluate(frame);
    }

    /// Waits until an expression is true.
    pub(crate) fn until(&mut self, expression: &str) {
        let start = Instant::now();
        while self.evaluate(expression) != json!(true) {
            assert!(start.elapsed() < PATIENCE, "never true: {expression}");
            self.settle();
        }
    }

    /// Presses and releases a key; `name` as in `KeyboardEvent.key`.
    pub(crate) fn key(&mut self, name: &str) {
        let code = match name {
            "Tab" => 9,
            "Escape" => 27,
            "End" => 35,
            "Home" => 36,
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            _ => 0,
        };
        let text = if name.chars().count() == 1 { name } else { "" };
        let down = json!({ "type": "keyDown", "key": name, "windowsVirtualKeyCode": code, "text": text });
        self.call("Input.dispatchKeyEvent", down);
        self.call("Input.dispatchKeyEvent", json!({ "type": "keyUp", "key": name, "windowsVirtualKeyCode": code }));
    }

    /// Types text into what has the focus.
    pub(crate) fn type_text(&mut self, text: &str) {
        self.call("Input.insertText", json!({ "text": text }));
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], buttons: u32) {
        let button = if kind == "mouseMoved" && buttons == 0 { "none" } else { "left" };
        let event = json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Middle of the element that an expression gives, brought into the window, moved by shares of its size.
    pub(crate) fn place(&mut self, element: &str, [u, v]: [f64; 2]) -> [f64; 2] {
        let corner = format!(
            "(element => {{ element.scrollIntoView({{ block: 'center' }}); const box = element.getBoundingClientRect(); \
             return [box.left + {u} * box.width, box.top + {v} * box.height]; }})({element})"
        );
        let found = self.numbers(&corner);
        [found[0], found[1]]
    }

    /// Clicks the middle of an element.
    pub(crate) fn click(&mut self, element: &str) {
        let at = self.place(element, [0.5, 0.5]);
        self.click_at(at);
    }

    /// Clicks a place in the window.
    pub(crate) fn click_at(&mut self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
        self.mouse("mousePressed", at, 1);
        self.mouse("mouseReleased", at, 0);
        self.settle();
    }

    /// Drags with the left button from one place in the window to another.
    pub(crate) fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.mouse("mouseMoved", from, 0);
        self.mouse("mousePressed", from, 1);
        for step in 1..=4 {
            let share = f64::from(step) / 4.0;
            let between = [0, 1].map(|i| from[i] + share * (to[i] - from[i]));
            self.mouse("mouseMoved", between, 1);
        }
        self.mouse("mouseReleased", to, 0);
        self.settle();
    }

    /// Gives a file to the file input that a selector names.
    pub(crate) fn choose_file(&mut self, selector: &str, file: &Path) {
        let root = self.call("DOM.getDocument", json!({}))["root"]["nodeId"].clone();
        let found = self.call("DOM.querySelector", json!({ "nodeId": root, "selector": selector }));
        self.call("DOM.setFileInputFiles", json!({ "files": [file], "nodeId": found["nodeId"] }));
    }

    /// Drops a file on a place in the window.
    pub(crate) fn drop_file(&mut self, file: &Path, [x, y]: [f64; 2]) {
        let data = json!({ "items": [], "files": [file], "dragOperationsMask": 1 });
        for kind in ["dragEnter", "dragOver", "drop"] {
            let event = json!({ "type": kind, "x": x, "y": y, "data": data });
            self.call("Input.dispatchDragEvent", event);
        }
    }

    /// Writes a picture of the window, for a person to look at.
    pub(crate) fn screenshot(&mut self, file: &Path) {
        use base64::Engine;
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let data = shot["data"].as_str().expect("base64");
        let png = base64::engine::general_purpose::STANDARD.decode(data).expect("base64");
        std::fs::write(file, png).expect("room for a picture");
    }

    /// Addresses the page asked for so far.
    pub(crate) fn requests(&self) -> Vec<String> {
        let sent = self.events.iter().filter(|event| event["method"] == "Network.requestWillBeSent");
        sent.map(|event| event["params"]["request"]["url"].as_str().unwrap_or_default().to_owned()).collect()
    }

    /// What the script threw so far.
    pub(crate) fn exceptions(&self) -> Vec<&Value> {
        self.events.iter().filter(|event| event["method"] == "Runtime.exceptionThrown").collect()
    }

    /// What the browser complained of in the console so far.
    pub(crate) fn complaints(&self) -> Vec<&Value> {
        let is_error = |event: &&Value| {
            event["method"] == "Log.entryAdded" && event["params"]["entry"]["level"] == "error"
                || event["method"] == "Runtime.consoleAPICalled" && event["params"]["type"] == "error"
        };
        self.events.iter().filter(is_error).collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may be gone already; then nothing is left to end.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.profile);
    }
}

/// Starts Chromium with its protocol on the descriptors 3 and 4, which a shell makes of our pipes.
fn start(profile: &Path) -> Child {
    let program =
        std::env::var("CHROMIUM").ok().or_else(|| NAMES.iter().find(|name| is_there(name)).map(|&s| s.into()));
    let program = program.expect("Chromium is installed: scripts/setup.sh chromium");
    let redirect = "exec \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1";
    Command::new("sh")
        .args(["-c", redirect, "sh", &program])
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"])
        .args(["--hide-scrollbars", "--disable-background-networking", "--remote-debugging-pipe"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg("about:blank")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("a shell")
}

fn is_there(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).exists())
}
