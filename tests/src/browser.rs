//! A real browser, without a window, driven over `WebDriver` (W3C) and Chromium's own protocol.

use base64::{Engine as _, engine::general_purpose::STANDARD as BASE64};
use ovtigre_proto::client::tls;
use serde_json::{Value, json};
use std::{
    env, fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};
use tokio::runtime::Runtime;

/// Where chromedriver listens; `tests/services` starts it.
const DRIVER: &str = "OVTIGRE_TEST_BROWSER";
/// The folder of the pictures of what was seen.
const SCREENSHOTS: &str = "OVTIGRE_TEST_SCREENSHOTS";
/// Longest wait for something to be seen.
const PATIENCE: Duration = Duration::from_mins(1);

/// A browser with one tab, closed when it is dropped.
#[derive(Debug)]
pub struct Browser {
    client: reqwest::Client,
    runtime: Runtime,
    session: String,
}

/// What a user likes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// Dark on light.
    Light,
    /// Light on dark.
    Dark,
}

impl Browser {
    /// A new one; `None` where there is no driver, which is said.
    #[expect(clippy::print_stderr, reason = "what a test skips is for people to see")]
    pub fn open(test: &str) -> Option<Self> {
        let Ok(driver) = env::var(DRIVER) else {
            eprintln!("SKIPPED: {test} needs a browser: start it with tests/services");
            return None;
        };
        let runtime = Runtime::new().expect("threads");
        tls::provide();
        let client = reqwest::Client::builder().tls_certs_only([]).build().expect("nothing is encrypted");
        // The sandbox is not there for root, and the page under test is our own.
        let flags = [
            "--headless=new",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--disable-gpu",
            "--hide-scrollbars",
        ];
        let wanted = json!({"capabilities": {"alwaysMatch": {
            "browserName": "chrome",
            "goog:loggingPrefs": {"browser": "ALL"},
            "goog:chromeOptions": {"args": flags},
        }}});
        let mut browser = Self { client, runtime, session: format!("{driver}/session") };
        let made = browser.call(reqwest::Method::POST, "", &wanted);
        let id = made["sessionId"].as_str().expect("a session's name").to_owned();
        browser.session = format!("{}/{id}", browser.session);
        browser.look(1400, 900, Scheme::Light);
        Some(browser)
    }

    fn call(&self, method: reqwest::Method, path: &str, body: &Value) -> Value {
        let get = method == reqwest::Method::GET;
        let request = self.client.request(method, format!("{}{path}", self.session));
        let request = if get { request } else { request.json(body) };
        let answer = self.runtime.block_on(async { request.send().await?.json::<Value>().await });
        let mut answer = answer.expect("the driver answers");
        let value = answer["value"].take();
        assert!(value["error"].is_null(), "{path}: {}: {}", value["error"], value["message"]);
        value
    }

    fn chromium(&self, command: &str, parameters: &Value) {
        self.call(reqwest::Method::POST, "/goog/cdp/execute", &json!({"cmd": command, "params": parameters}));
    }

    /// Sets the size of the window's inside and what the user likes.
    pub fn look(&self, width: u32, height: u32, scheme: Scheme) {
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600});
        self.chromium("Emulation.setDeviceMetricsOverride", &size);
        let value = if scheme == Scheme::Dark { "dark" } else { "light" };
        let features = json!({"features": [{"name": "prefers-color-scheme", "value": value}]});
        self.chromium("Emulation.setEmulatedMedia", &features);
    }

    /// Opens an address.
    pub fn go(&self, address: &str) {
        self.call(reqwest::Method::POST, "/url", &json!({"url": address}));
    }

    /// Runs the body of an asynchronous function with `arguments`, which are `a[0]`, `a[1]` …; what it returns.
    pub fn run(&self, body: &str, arguments: &[Value]) -> Value {
        let script = format!(
            "const done = arguments[arguments.length - 1]; const a = arguments;
             (async () => {{ {body} }})().then((value) => done({{ value }}), (e) => done({{ error: `${{e}} ${{e.stack}}` }}));"
        );
        let mut answer =
            self.call(reqwest::Method::POST, "/execute/async", &json!({"script": script, "args": arguments}));
        assert!(answer["error"].is_null(), "{body}: {}", answer["error"]);
        answer["value"].take()
    }

    /// The value of an expression.
    pub fn value(&self, expression: &str) -> Value {
        self.run(&format!("return ({expression});"), &[])
    }

    /// Waits until an expression is true.
    pub fn until(&self, expression: &str) -> Value {
        let start = Instant::now();
        loop {
            let value = self
                .value(&format!("(() => {{ try {{ return {expression}; }} catch {{ return null; }} }})()"));
            if !matches!(value, Value::Null | Value::Bool(false)) {
                return value;
            }
            if start.elapsed() > PATIENCE {
                let file = self.screenshot("failed");
                let text = self.value("document.body.innerText");
                panic!("not seen: {expression}; see {}; the page says: {text}", file.display());
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    fn element(&self, css: &str) -> String {
        let found =
            self.call(reqwest::Method::POST, "/element", &json!({"using": "css selector", "value": css}));
        let id = found.as_object().and_then(|of| of.values().next()).and_then(Value::as_str);
        format!("/element/{}", id.expect("an element's name"))
    }

    /// Clicks, as a user would.
    pub fn click(&self, css: &str) {
        self.until(&format!("!!document.querySelector({})", json!(css)));
        self.call(reqwest::Method::POST, &format!("{}/click", self.element(css)), &json!({}));
    }

    /// Clicks the button or link of that text.
    pub fn press(&self, text: &str) {
        let all = "[...document.querySelectorAll('button, a, summary, label.button')].filter((e) => e.offsetParent !== null || e.closest('dialog'))";
        let one = format!("{all}.findLast((e) => e.textContent.trim() === {} && !e.disabled)", json!(text));
        self.until(&format!("!!{one}"));
        self.run(&format!("document.querySelectorAll('[data-press]').forEach((e) => e.removeAttribute('data-press')); {one}.setAttribute('data-press', '');"), &[]);
        self.click("[data-press]");
    }

    /// Carries files or folders of this machine over an element, as from another window.
    pub fn carry(&self, css: &str, files: &[&Path]) {
        self.drag("dragEnter", css, files);
        self.drag("dragOver", css, files);
    }

    /// Carries them there and lets them go.
    pub fn let_go(&self, css: &str, files: &[&Path]) {
        self.carry(css, files);
        self.drag("drop", css, files);
    }

    fn drag(&self, kind: &str, css: &str, files: &[&Path]) {
        self.until(&format!("!!document.querySelector({})", json!(css)));
        let middle = "const e = document.querySelector(a[0]); e.scrollIntoView({ block: 'center' });
            const b = e.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2];";
        let middle = self.run(middle, &[json!(css)]);
        let data = json!({"items": [], "files": files, "dragOperationsMask": 1});
        self.chromium(
            "Input.dispatchDragEvent",
            &json!({"type": kind, "x": middle[0], "y": middle[1], "data": data}),
        );
    }

    /// Lets the page ask for files without a window of the system's in front of it; a test gives them by [`Self::write`].
    pub fn without_file_windows(&self) {
        self.chromium("Page.setInterceptFileChooserDialog", &json!({"enabled": true}));
    }

    /// Types into an element; the path of a file for one that takes files.
    pub fn write(&self, css: &str, text: &str) {
        self.until(&format!("!!document.querySelector({})", json!(css)));
        self.call(reqwest::Method::POST, &format!("{}/value", self.element(css)), &json!({"text": text}));
    }

    /// Replaces what is in a field.
    pub fn rewrite(&self, css: &str, text: &str) {
        self.until(&format!("!!document.querySelector({})", json!(css)));
        let fill = "const e = document.querySelector(a[0]); e.value = a[1];
            e.dispatchEvent(new Event('input', { bubbles: true })); e.dispatchEvent(new Event('change', { bubbles: true }));";
        self.run(fill, &[json!(css), json!(text)]);
    }

    /// Keeps a picture of the whole page; its file.
    pub fn screenshot(&self, name: &str) -> PathBuf {
        let folder = env::var_os(SCREENSHOTS).map_or_else(
            || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target/screenshots"),
            PathBuf::from,
        );
        fs::create_dir_all(&folder).expect("the folder can be made");
        let size = "return [innerWidth, Math.min(4000, Math.max(innerHeight, document.documentElement.scrollHeight)), innerHeight];";
        let size = self.run(size, &[]);
        let set = |height: &Value| {
            let mobile = size[0].as_u64().is_some_and(|w| w < 600);
            let size = json!({"width": size[0], "height": height, "deviceScaleFactor": 1, "mobile": mobile});
            self.chromium("Emulation.setDeviceMetricsOverride", &size);
        };
        set(&size[1]);
        let taken = self.call(reqwest::Method::GET, "/screenshot", &Value::Null);
        set(&size[2]);
        let file = folder.join(format!("{name}.png"));
        fs::write(&file, BASE64.decode(taken.as_str().expect("a text")).expect("base64"))
            .expect("the folder can be written to");
        file
    }

    /// Errors of scripts and refusals of the page's policy that the browser told since it was asked last.
    pub fn complaints(&self) -> Vec<String> {
        let all = self.call(reqwest::Method::POST, "/se/log", &json!({"type": "browser"}));
        let bad = |entry: &&Value| entry["level"] == "SEVERE" && entry["source"] != "network";
        let entries = all.as_array().map(Vec::as_slice).unwrap_or_default();
        entries.iter().filter(bad).map(|entry| entry["message"].to_string()).collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let close = self.client.delete(&self.session).send();
        // It may be gone already: that is what is wanted.
        let _ = self.runtime.block_on(close);
    }
}
