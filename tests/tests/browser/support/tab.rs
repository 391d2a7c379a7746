//! A browser tab: user input, the picture, and the state and errors of the page.

use std::cell::{Cell, RefCell};
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::thread;

use integration_tests::wait_for;
use serde_json::{Value, json};

use super::camera::Camera;
use super::chromium::BrowserLock;
use super::picture::{Area, Picture};

/// Width and height of the window in CSS pixels: wide enough for the panel beside the picture.
const SIZE: [u32; 2] = [800, 600];
/// Duration of a fling, in s.
const FLING_S: f64 = 0.03;
/// An expression for the state of the page that a failing test prints.
const STATE: &str = "(({ step, frame, framesDrawn, scene, connection, node, paused, torn, banner, notices, faults, \
    unanswered, renderer }) => ({ step, frame, framesDrawn, scene, connection, node, paused, torn, banner, notices, \
    faults, unanswered, renderer }))(window.viewer ?? {})";

/// A mouse button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Button {
    None,
    Left,
    Right,
}

impl Button {
    fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// Bit in the mask of pressed buttons.
    fn bit(self) -> u32 {
        match self {
            Self::None => 0,
            Self::Left => 1,
            Self::Right => 2,
        }
    }
}

/// A tab with its own window and storage. Dropping it closes the tab, and fails the test if the page had
/// errors. If the test is failing, the picture and the console of the page are saved.
pub(crate) struct Tab {
    browser: Rc<BrowserLock>,
    context: String,
    session: String,
    pressed: Cell<Button>,
    /// Parts of errors that the test causes on purpose.
    expected_errors: RefCell<Vec<&'static str>>,
}

impl Tab {
    /// Opens a page and waits until it has drawn.
    pub(crate) fn open(browser: &Rc<BrowserLock>, url: &str) -> Self {
        let tab = Self::blank(browser);
        tab.call("Page.navigate", json!({ "url": url }));
        tab.wait("window.viewer !== undefined && viewer.frame >= 0");
        tab
    }

    /// Opens a page over a line of this many bytes per second, and does not wait for its scene.
    pub(crate) fn open_slowly(browser: &Rc<BrowserLock>, url: &str, bytes_per_s: u32) -> Self {
        let tab = Self::blank(browser);
        tab.call("Network.enable", json!({}));
        let line = json!({ "offline": false, "latency": 0, "downloadThroughput": bytes_per_s,
            "uploadThroughput": -1 });
        tab.call("Network.emulateNetworkConditions", line);
        tab.call("Page.navigate", json!({ "url": url }));
        tab.wait("window.viewer !== undefined");
        tab
    }

    fn blank(browser: &Rc<BrowserLock>) -> Self {
        let text = |answer: Value, field: &str| answer[field].as_str().unwrap().to_owned();
        let call = |method: &str, params: Value| browser.call(None, method, params).unwrap();
        let context = text(call("Target.createBrowserContext", json!({})), "browserContextId");
        let [width, height] = SIZE;
        let target = json!({ "url": "about:blank", "browserContextId": context, "newWindow": true,
            "width": width, "height": height });
        let target = text(call("Target.createTarget", target), "targetId");
        let attach = json!({ "targetId": target, "flatten": true });
        let session = text(call("Target.attachToTarget", attach), "sessionId");
        let tab = Self {
            browser: Rc::clone(browser),
            context,
            session,
            pressed: Cell::new(Button::None),
            expected_errors: RefCell::default(),
        };
        for domain in ["Page", "Runtime", "Log", "Audits"] {
            tab.call(&format!("{domain}.enable"), json!({}));
        }
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1,
            "mobile": false });
        tab.call("Emulation.setDeviceMetricsOverride", metrics);
        tab.set_focused(true);
        let light = json!([{ "name": "prefers-color-scheme", "value": "light" }]);
        tab.call("Emulation.setEmulatedMedia", json!({ "features": light }));
        tab
    }

    /// Calls a method that must succeed.
    pub(crate) fn call(&self, method: &str, params: Value) -> Value {
        self.browser.call(Some(&self.session), method, params).unwrap()
    }

    /// Evaluates an expression, and awaits it if it is a promise.
    pub(crate) fn evaluate(&self, expression: &str) -> Value {
        self.try_evaluate(expression).unwrap()
    }

    fn try_evaluate(&self, expression: &str) -> Result<Value, String> {
        let params = json!({ "expression": expression, "returnByValue": true,
            "awaitPromise": true });
        let mut answer = self.browser.call(Some(&self.session), "Runtime.evaluate", params)?;
        if answer["exceptionDetails"].is_null() {
            Ok(answer["result"]["value"].take())
        } else {
            Err(format!("{expression}: {}", answer["exceptionDetails"]))
        }
    }

    /// Evaluates an expression that is a number.
    pub(crate) fn number(&self, expression: &str) -> f64 {
        self.evaluate(expression).as_f64().unwrap()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait(&self, condition: &str) {
        // Evaluation fails while a page loads.
        wait_for(condition, || (self.try_evaluate(condition).ok()? == true).then_some(()));
    }

    /// Waits for `count` animation frames of the page.
    pub(crate) fn pass_animation_frames(&self, count: u32) {
        self.evaluate(&format!(
            "new Promise(done => {{ \
                let left = {count}; \
                const pass = () => left-- > 0 ? requestAnimationFrame(pass) : done(); \
                pass(); }})"
        ));
    }

    /// Starts to log the number and step of each picture that the page draws.
    pub(crate) fn log_pictures(&self) {
        self.evaluate(
            "void (() => { \
                window.pictures = []; \
                const look = () => { \
                    if (viewer.frame !== pictures.at(-1)?.[0]) pictures.push([viewer.frame, viewer.step]); \
                    requestAnimationFrame(look); }; \
                requestAnimationFrame(look); })()",
        );
    }

    /// Waits for a picture of `step` or later. Returns the number and step of each logged picture after
    /// number `last_number`.
    pub(crate) fn pictures_until(&self, last_number: u64, step: u64) -> Vec<[u64; 2]> {
        self.wait(&format!("pictures.some(([, step]) => step >= {step})"));
        let mut pictures: Vec<[u64; 2]> =
            serde_json::from_value(self.evaluate("pictures")).unwrap();
        pictures.retain(|[number, _]| *number > last_number);
        pictures
    }

    /// Blocks the script of the page, as a long computation does. Returns the number of the picture that
    /// it shows meanwhile.
    pub(crate) fn block_script(&self) -> u64 {
        self.evaluate(
            "void setTimeout(() => { window.stillNumber = viewer.frame; alert(stillNumber); })",
        );
        wait_for("the page to block", || {
            // Events arrive along with answers; this call does not involve the page.
            self.browser.call(None, "Browser.getVersion", json!({})).unwrap();
            let events = self.browser.events(&self.session);
            let opening = events.iter().find(|one| one["method"] == "Page.javascriptDialogOpening");
            opening?["params"]["message"].as_str()?.parse().ok()
        })
    }

    pub(crate) fn unblock_script(&self) {
        self.call("Page.handleJavaScriptDialog", json!({ "accept": true }));
    }

    /// Hides the page behind another tab of its window. Returns the number of the picture that it shows
    /// then.
    pub(crate) fn hide(&self) -> u64 {
        // A page with focus is never hidden.
        self.set_focused(false);
        let front = json!({ "url": "about:blank", "browserContextId": self.context });
        self.browser.call(None, "Target.createTarget", front).unwrap();
        self.wait("document.hidden");
        serde_json::from_value(self.evaluate("viewer.frame")).unwrap()
    }

    /// Brings the page back to the front.
    pub(crate) fn show(&self) {
        self.call("Page.bringToFront", json!({}));
        self.set_focused(true);
        self.wait("!document.hidden");
    }

    fn set_focused(&self, is_focused: bool) {
        self.call("Emulation.setFocusEmulationEnabled", json!({ "enabled": is_focused }));
    }

    pub(crate) fn press(&self, at: [f64; 2], button: Button) {
        self.mouse("mouseMoved", at, 0);
        self.pressed.set(button);
        self.mouse("mousePressed", at, 1);
    }

    pub(crate) fn move_to(&self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
    }

    /// Moves the pointer in `parts` equal parts.
    pub(crate) fn stroke(&self, from: [f64; 2], to: [f64; 2], parts: u32) {
        for part in 1..=parts {
            let fraction = f64::from(part) / f64::from(parts);
            self.move_to([0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * fraction));
        }
    }

    pub(crate) fn release(&self, at: [f64; 2]) {
        self.mouse("mouseReleased", at, 1);
        self.pressed.set(Button::None);
    }

    /// Moves the pointer within [`FLING_S`] and releases the button in motion. The events carry their times, so that
    /// the velocity does not depend on how busy the page is.
    pub(crate) fn fling(&self, from: [f64; 2], to: [f64; 2]) {
        let begin_s = self.number("(performance.timeOrigin + performance.now()) / 1000");
        let event = |kind, at, clicks, seconds: f64| {
            let mut event = self.mouse_event(kind, at, clicks);
            event["timestamp"] = json!(begin_s + seconds);
            event
        };
        self.call("Input.dispatchMouseEvent", event("mouseMoved", from, 0, 0.0));
        // The page receives both together.
        for (kind, clicks) in [("mouseMoved", 0), ("mouseReleased", 1)] {
            let event = event(kind, to, clicks, FLING_S);
            self.browser.post(&self.session, "Input.dispatchMouseEvent", event);
        }
        self.pressed.set(Button::None);
    }

    pub(crate) fn double_click(&self, at: [f64; 2]) {
        self.pressed.set(Button::Left);
        for count in [1, 2] {
            self.mouse("mousePressed", at, count);
            self.mouse("mouseReleased", at, count);
        }
        self.pressed.set(Button::None);
    }

    fn mouse(&self, kind: &str, at: [f64; 2], clicks: u32) {
        self.call("Input.dispatchMouseEvent", self.mouse_event(kind, at, clicks));
    }

    /// Describes a mouse event. `clicks` is the number of the click in a series, or 0 for a motion.
    fn mouse_event(&self, kind: &str, [x, y]: [f64; 2], clicks: u32) -> Value {
        let button = self.pressed.get();
        let is_down = kind != "mouseReleased";
        json!({ "type": kind, "x": x, "y": y, "button": button.name(),
            "buttons": if is_down { button.bit() } else { 0 }, "clickCount": clicks })
    }

    /// Clicks the center of the element with a selector.
    pub(crate) fn click(&self, selector: &str) {
        self.click_at(selector, 0.5);
    }

    /// Clicks an element at a fraction of its width.
    pub(crate) fn click_at(&self, selector: &str, fraction: f64) {
        let at = self.pixel(selector, fraction);
        self.press(at, Button::Left);
        self.release(at);
    }

    /// Returns the pixel at a fraction of the width of an element, at half its height.
    pub(crate) fn pixel(&self, selector: &str, fraction: f64) -> [f64; 2] {
        let pixel = format!(
            "(({{ x, y, width, height }}) => [x + width * {fraction}, y + height / 2])(document.querySelector({selector:?}).getBoundingClientRect())"
        );
        serde_json::from_value(self.evaluate(&pixel)).unwrap()
    }

    /// Presses or moves a finger, or lifts it with `None`.
    pub(crate) fn finger(&self, kind: &str, at: Option<[f64; 2]>) {
        let points: Vec<_> = at.iter().map(|[x, y]| json!({ "x": x, "y": y })).collect();
        self.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": points }));
    }

    /// Presses a finger and moves it at once: on a busy machine, the answer to the press could take as long as a
    /// long press.
    pub(crate) fn drag_finger(&self, from: [f64; 2], to: [f64; 2]) {
        let touch = |kind: &str, [x, y]: [f64; 2]| json!({ "type": kind, "touchPoints": [{ "x": x, "y": y }] });
        let method = "Input.dispatchTouchEvent";
        self.browser.post(&self.session, method, touch("touchStart", from));
        self.call(method, touch("touchMove", to));
    }

    /// Presses and releases the key of a character.
    pub(crate) fn key(&self, key: char) {
        let key = key.to_string();
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key, "text": key }));
        }
    }

    /// Presses and releases a key that types no character.
    pub(crate) fn named_key(&self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key }));
        }
    }

    /// Presses and releases a key together with Ctrl.
    pub(crate) fn ctrl_key(&self, key: char) {
        let key = key.to_string();
        for kind in ["rawKeyDown", "keyUp"] {
            // Bit 1 of the modifiers is Ctrl.
            self.call(
                "Input.dispatchKeyEvent",
                json!({ "type": kind, "key": key, "modifiers": 2 }),
            );
        }
    }

    /// Clicks a text field, replaces its text, and confirms it.
    pub(crate) fn type_into(&self, selector: &str, text: &str) {
        self.evaluate(&format!("document.querySelector({selector:?}).scrollIntoView()"));
        self.click(selector);
        self.call("Input.insertText", json!({ "text": text }));
        self.named_key("Enter");
    }

    /// Goes to a scene of the menu by its digit, and loads it.
    pub(crate) fn load_by_digit(&self, digit: char, scene: &str) {
        self.key(digit);
        self.wait(&format!("document.activeElement.dataset.scene === '{scene}'"));
        self.evaluate("document.activeElement.click()");
    }

    /// Presses the pause key, and waits until the page knows that the node is paused.
    pub(crate) fn pause(&self) {
        self.key(' ');
        self.wait("viewer.paused && viewer.unanswered === 0");
    }

    /// Returns the current projection of the page.
    pub(crate) fn camera(&self) -> Camera {
        let camera = self.evaluate(
            "(({ x, y, width, height }) => ({ matrix: viewer.camera.viewProjection, corner: [x, y], size: [width, height] }))\
             (document.querySelector('#picture-canvas').getBoundingClientRect())",
        );
        Camera::new(&camera)
    }

    /// Returns a screenshot of the window.
    pub(crate) fn screenshot(&self) -> Picture {
        Picture::from_screenshot(&self.call("Page.captureScreenshot", json!({ "format": "png" })))
    }

    /// Returns an area of the drawn picture, without the elements above it.
    pub(crate) fn drawn(&self, Area { x, y, width, height }: Area) -> Picture {
        let pixels = self.evaluate(&format!("viewer.pixels({x}, {y}, {width}, {height})"));
        Picture::from_pixels(&pixels, [x, y])
    }

    /// Returns a hash of all pixels of the picture.
    pub(crate) fn hash(&self) -> Value {
        self.evaluate(
            "(() => { const { x, y, width, height } = document.querySelector('#picture-canvas').getBoundingClientRect(); \
             let hash = 2166136261; \
             for (const byte of viewer.pixels(x, y, width, height).data) hash = Math.imul(hash ^ byte, 16777619); \
             return hash; })()",
        )
    }

    /// Waits for an error that contains a text, and allows such errors in this test.
    pub(crate) fn expect_error(&self, part: &'static str) {
        wait_for(part, || self.errors().iter().any(|error| error.contains(part)).then_some(()));
        self.expected_errors.borrow_mut().push(part);
    }

    /// Returns all errors of the page: exceptions, console errors and warnings, failed requests, and
    /// violations of the content security policy.
    pub(crate) fn errors(&self) -> Vec<String> {
        let events = self.browser.events(&self.session);
        let mut errors: Vec<_> = events.iter().filter_map(error_in).collect();
        let faults = self.try_evaluate("window.viewer?.faults ?? []").unwrap_or_default();
        errors.extend(faults.as_array().into_iter().flatten().map(Value::to_string));
        errors
    }

    /// Saves the state, console and picture of the page of a failing test.
    #[allow(clippy::print_stderr, reason = "the output of a failing test")]
    fn save(&self) {
        let folder = failures();
        let state = self.try_evaluate(STATE).unwrap_or_else(Value::from);
        let console: Vec<_> =
            self.browser.events(&self.session).iter().map(Value::to_string).collect();
        let text = format!("{state:#}\n\n{}\n", console.join("\n"));
        let shot = self.browser.call(Some(&self.session), "Page.captureScreenshot", json!({}));
        let name = &self.session[..6.min(self.session.len())];
        let saved = fs::create_dir_all(&folder)
            .and_then(|()| fs::write(folder.join(format!("{name}.txt")), text));
        if let Ok(shot) = shot {
            let _ =
                fs::write(folder.join(format!("{name}.png")), super::picture::data_bytes(&shot));
        }
        eprintln!("--- page: {state}");
        eprintln!("--- picture and console of the page: {} {saved:?}", folder.display());
    }
}

/// Returns the folder for the output of this test if it fails.
fn failures() -> PathBuf {
    let test = thread::current().name().unwrap_or("test").replace("::", "-");
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser").join(test)
}

/// Returns the text of an event if it is an error.
fn error_in(event: &Value) -> Option<String> {
    let params = &event["params"];
    let is_error = match event["method"].as_str()? {
        "Runtime.exceptionThrown" => true,
        "Runtime.consoleAPICalled" => {
            ["error", "warning", "assert"].contains(&params["type"].as_str()?)
        }
        "Log.entryAdded" => ["error", "warning"].contains(&params["entry"]["level"].as_str()?),
        "Audits.issueAdded" => params["issue"]["code"] == "ContentSecurityPolicyIssue",
        _ => false,
    };
    is_error.then(|| params.to_string())
}

impl Drop for Tab {
    fn drop(&mut self) {
        let mut errors = self.errors();
        let expected = self.expected_errors.borrow();
        errors.retain(|error| !expected.iter().any(|part| error.contains(part)));
        if thread::panicking() {
            self.save();
        }
        // Fails if the browser has ended, which closes the tab too.
        let context = json!({ "browserContextId": self.context });
        let _ended = self.browser.call(None, "Target.disposeBrowserContext", context);
        self.browser.forget(&self.session);
        assert!(errors.is_empty() || thread::panicking(), "the page had errors: {errors:#?}");
    }
}
