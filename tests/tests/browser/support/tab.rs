//! A tab: what a user does with the page and sees of it, and what the page says of itself.

use std::cell::{Cell, RefCell};
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::thread;

use integration_tests::wait_for;
use serde_json::{Value, json};

use super::camera::Camera;
use super::chromium::Turn;
use super::picture::{Area, Picture};

/// Width and height of the window in CSS pixels: big enough for the panel to be beside the picture.
const SIZE: [u32; 2] = [800, 600];
/// The page's state as a failure shows it.
const STATE: &str = "(({ step, frame, framesDrawn, scene, connection, node, paused, torn, banner, notices, faults, \
    unanswered, renderer }) => ({ step, frame, framesDrawn, scene, connection, node, paused, torn, banner, notices, \
    faults, unanswered, renderer }))(window.viewer ?? {})";

/// A button of the mouse, and its bit among those that are held.
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

    fn bit(self) -> u32 {
        match self {
            Self::None => 0,
            Self::Left => 1,
            Self::Right => 2,
        }
    }
}

/// A tab in a window and with a storage of its own. Dropping it closes it, and fails the test if
/// the page had errors; if the test is failing, keeps what the page looked like and said.
pub(crate) struct Tab {
    turn: Rc<Turn>,
    context: String,
    session: String,
    held: Cell<Button>,
    /// Beginnings of errors that the test itself causes.
    expected_errors: RefCell<Vec<&'static str>>,
}

impl Tab {
    /// Opens a page and waits until it has drawn.
    pub(crate) fn open(turn: &Rc<Turn>, url: &str) -> Self {
        let tab = Self::blank(turn);
        tab.call("Page.navigate", json!({ "url": url }));
        tab.wait("window.viewer !== undefined && viewer.frame >= 0");
        tab
    }

    fn blank(turn: &Rc<Turn>) -> Self {
        let text = |answer: Value, field: &str| answer[field].as_str().unwrap().to_owned();
        let browser = |method: &str, params: Value| turn.call(None, method, params).unwrap();
        let context = text(browser("Target.createBrowserContext", json!({})), "browserContextId");
        let [width, height] = SIZE;
        let target = json!({ "url": "about:blank", "browserContextId": context, "newWindow": true,
            "width": width, "height": height });
        let target = text(browser("Target.createTarget", target), "targetId");
        let attach = json!({ "targetId": target, "flatten": true });
        let session = text(browser("Target.attachToTarget", attach), "sessionId");
        let tab = Self {
            turn: Rc::clone(turn),
            context,
            session,
            held: Cell::new(Button::None),
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

    /// Calls a method that has to succeed.
    pub(crate) fn call(&self, method: &str, params: Value) -> Value {
        self.turn.call(Some(&self.session), method, params).unwrap()
    }

    /// The value of an expression, or what the promise that it is resolves to.
    pub(crate) fn ask(&self, expression: &str) -> Value {
        self.evaluate(expression).unwrap()
    }

    fn evaluate(&self, expression: &str) -> Result<Value, String> {
        let params = json!({ "expression": expression, "returnByValue": true,
            "awaitPromise": true });
        let mut answer = self.turn.call(Some(&self.session), "Runtime.evaluate", params)?;
        if answer["exceptionDetails"].is_null() {
            Ok(answer["result"]["value"].take())
        } else {
            Err(format!("{expression}: {}", answer["exceptionDetails"]))
        }
    }

    /// The value of an expression that is a number.
    pub(crate) fn number(&self, expression: &str) -> f64 {
        self.ask(expression).as_f64().unwrap()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait(&self, condition: &str) {
        // While a page loads, the answer may be that it is gone.
        wait_for(condition, || (self.evaluate(condition).ok()? == true).then_some(()));
    }

    /// Lets the page have so many turns to draw, whether it does or not.
    pub(crate) fn pass_animation_frames(&self, count: u32) {
        self.ask(&format!(
            "new Promise(done => {{ \
                let left = {count}; \
                const pass = () => left-- > 0 ? requestAnimationFrame(pass) : done(); \
                pass(); }})"
        ));
    }

    /// Notes the number and the step of each picture that the page draws from now on.
    pub(crate) fn note_pictures(&self) {
        self.ask(
            "void (() => { \
                window.pictures = []; \
                const look = () => { \
                    if (viewer.frame !== pictures.at(-1)?.[0]) pictures.push([viewer.frame, viewer.step]); \
                    requestAnimationFrame(look); }; \
                requestAnimationFrame(look); })()",
        );
    }

    /// The noted number and step of each picture after the one of that number, once there is one of
    /// such a step.
    pub(crate) fn pictures_until(&self, last_number: u64, step: u64) -> Vec<[u64; 2]> {
        self.wait(&format!("pictures.some(([, step]) => step >= {step})"));
        let mut pictures: Vec<[u64; 2]> = serde_json::from_value(self.ask("pictures")).unwrap();
        pictures.retain(|[number, _]| *number > last_number);
        pictures
    }

    /// Holds the page's script up, as a long computation does, until it may go on. Returns the
    /// number of the picture that it then shows.
    pub(crate) fn stand_still(&self) -> u64 {
        self.ask(
            "void setTimeout(() => { window.stillNumber = viewer.frame; alert(stillNumber); })",
        );
        wait_for("the page to stand still", || {
            // Events come with answers; this call asks nothing of the page.
            self.turn.call(None, "Browser.getVersion", json!({})).unwrap();
            let events = self.turn.events(&self.session);
            let opening = events.iter().find(|one| one["method"] == "Page.javascriptDialogOpening");
            opening?["params"]["message"].as_str()?.parse().ok()
        })
    }

    pub(crate) fn go_on(&self) {
        self.call("Page.handleJavaScriptDialog", json!({ "accept": true }));
    }

    /// Hides the page behind another tab of its window. Returns the number of the picture that it
    /// then has.
    pub(crate) fn hide(&self) -> u64 {
        // What has the focus is never hidden.
        self.set_focused(false);
        let front = json!({ "url": "about:blank", "browserContextId": self.context });
        self.turn.call(None, "Target.createTarget", front).unwrap();
        self.wait("document.hidden");
        serde_json::from_value(self.ask("viewer.frame")).unwrap()
    }

    /// Brings the page to the front again.
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
        self.held.set(button);
        self.mouse("mousePressed", at, 1);
    }

    pub(crate) fn move_to(&self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
    }

    /// Moves in so many equal parts.
    pub(crate) fn stroke(&self, from: [f64; 2], to: [f64; 2], parts: u32) {
        for part in 1..=parts {
            let share = f64::from(part) / f64::from(parts);
            self.move_to([0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * share));
        }
    }

    pub(crate) fn release(&self, at: [f64; 2]) {
        self.mouse("mouseReleased", at, 1);
        self.held.set(Button::None);
    }

    /// Moves there and lets go in the motion: the page hears of both at once, however busy it is.
    pub(crate) fn fling(&self, at: [f64; 2]) {
        for kind in ["mouseMoved", "mouseReleased"] {
            let event = self.mouse_event(kind, at, u32::from(kind == "mouseReleased"));
            self.turn.post(&self.session, "Input.dispatchMouseEvent", event);
        }
        self.held.set(Button::None);
    }

    pub(crate) fn double_click(&self, at: [f64; 2]) {
        self.held.set(Button::Left);
        for count in [1, 2] {
            self.mouse("mousePressed", at, count);
            self.mouse("mouseReleased", at, count);
        }
        self.held.set(Button::None);
    }

    fn mouse(&self, kind: &str, at: [f64; 2], clicks: u32) {
        self.call("Input.dispatchMouseEvent", self.mouse_event(kind, at, clicks));
    }

    /// `clicks`: which click of a series it is, 0 for a motion.
    fn mouse_event(&self, kind: &str, [x, y]: [f64; 2], clicks: u32) -> Value {
        let button = self.held.get();
        let is_down = kind != "mouseReleased";
        json!({ "type": kind, "x": x, "y": y, "button": button.name(),
            "buttons": if is_down { button.bit() } else { 0 }, "clickCount": clicks })
    }

    /// Clicks the middle of the element of that selector.
    pub(crate) fn click(&self, selector: &str) {
        self.click_within(selector, 0.5);
    }

    /// Clicks an element at that part of its width.
    pub(crate) fn click_within(&self, selector: &str, part: f64) {
        let place = self.place(selector, part);
        self.press(place, Button::Left);
        self.release(place);
    }

    /// The pixel at that part of an element's width, in the middle of its height.
    pub(crate) fn place(&self, selector: &str, part: f64) -> [f64; 2] {
        let place = format!(
            "(({{ x, y, width, height }}) => [x + width * {part}, y + height / 2])(document.querySelector({selector:?}).getBoundingClientRect())"
        );
        serde_json::from_value(self.ask(&place)).unwrap()
    }

    /// Puts a finger down, moves it, or with `None` lifts it.
    pub(crate) fn finger(&self, kind: &str, at: Option<[f64; 2]>) {
        let points: Vec<_> = at.iter().map(|[x, y]| json!({ "x": x, "y": y })).collect();
        self.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": points }));
    }

    /// Strikes a key that types one character.
    pub(crate) fn key(&self, key: char) {
        let key = key.to_string();
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key, "text": key }));
        }
    }

    /// Strikes the key that pauses, and waits until the page knows that the node has.
    pub(crate) fn pause(&self) {
        self.key(' ');
        self.wait("viewer.paused && viewer.unanswered === 0");
    }

    /// How the page looks at the scene now.
    pub(crate) fn camera(&self) -> Camera {
        let camera = self.ask(
            "(({ x, y, width, height }) => ({ matrix: viewer.camera.viewProjection, corner: [x, y], size: [width, height] }))\
             (document.querySelector('#picture-canvas').getBoundingClientRect())",
        );
        Camera::new(&camera)
    }

    /// What the window shows.
    pub(crate) fn screenshot(&self) -> Picture {
        Picture::of_screenshot(&self.call("Page.captureScreenshot", json!({ "format": "png" })))
    }

    /// The drawn picture alone, without what lies over it: a part of the window.
    pub(crate) fn drawn(&self, Area { x, y, width, height }: Area) -> Picture {
        let pixels = self.ask(&format!("viewer.pixels({x}, {y}, {width}, {height})"));
        Picture::of_pixels(&pixels, [x, y])
    }

    /// A number that is the same for the same picture: of all its bytes.
    pub(crate) fn hash(&self) -> Value {
        self.ask(
            "(() => { const { x, y, width, height } = document.querySelector('#picture-canvas').getBoundingClientRect(); \
             let hash = 2166136261; \
             for (const byte of viewer.pixels(x, y, width, height).data) hash = Math.imul(hash ^ byte, 16777619); \
             return hash; })()",
        )
    }

    /// Waits for an error that has this in its text, and allows such errors in this test.
    pub(crate) fn expect_error(&self, part: &'static str) {
        wait_for(part, || self.errors().iter().any(|error| error.contains(part)).then_some(()));
        self.expected_errors.borrow_mut().push(part);
    }

    /// Everything that went wrong in the page: exceptions, console errors and warnings, what could
    /// not be loaded, what the policy refused.
    pub(crate) fn errors(&self) -> Vec<String> {
        let events = self.turn.events(&self.session);
        let mut errors: Vec<_> = events.iter().filter_map(error_in).collect();
        let faults = self.evaluate("window.viewer?.faults ?? []").unwrap_or_default();
        errors.extend(faults.as_array().into_iter().flatten().map(Value::to_string));
        errors
    }

    /// Keeps what may tell why the test fails.
    #[allow(clippy::print_stderr, reason = "what a failing test shows")]
    fn keep(&self) {
        let folder = failures();
        let state = self.evaluate(STATE).unwrap_or_else(Value::from);
        let console: Vec<_> =
            self.turn.events(&self.session).iter().map(Value::to_string).collect();
        let text = format!("{state:#}\n\n{}\n", console.join("\n"));
        let shot = self.turn.call(Some(&self.session), "Page.captureScreenshot", json!({}));
        let name = &self.session[..6.min(self.session.len())];
        let kept = fs::create_dir_all(&folder)
            .and_then(|()| fs::write(folder.join(format!("{name}.txt")), text));
        if let Ok(shot) = shot {
            let _ = fs::write(folder.join(format!("{name}.png")), super::picture::bytes_of(&shot));
        }
        eprintln!("--- page: {state}");
        eprintln!("--- picture and console of the page: {} {kept:?}", folder.display());
    }
}

/// The folder for what this test leaves when it fails.
fn failures() -> PathBuf {
    let test = thread::current().name().unwrap_or("test").replace("::", "-");
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser").join(test)
}

/// What an event says of an error, if it is one.
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
            self.keep();
        }
        // A browser that has ended needs no closing.
        let context = json!({ "browserContextId": self.context });
        let _ended = self.turn.call(None, "Target.disposeBrowserContext", context);
        self.turn.forget(&self.session);
        assert!(errors.is_empty() || thread::panicking(), "the page had errors: {errors:#?}");
    }
}
