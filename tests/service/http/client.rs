//! A service in a process of its own, and `curl` to speak with it.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

/// How long a test waits for something that has to happen.
const DEADLINE: Duration = Duration::from_secs(180);

/// A character that learns fast: a heavy plate that carries itself, with two paddles on hinges.
pub const PADDLER: &str = include_str!("../paddler.urdf");

/// The bundled quadruped.
pub const QUADRUPED: &str = include_str!("../../../examples/quadruped.urdf");

/// The same as a part of a form, for `curl -F`.
pub const PADDLER_PART: &str =
    concat!("character=@", env!("CARGO_MANIFEST_DIR"), "/tests/service/paddler.urdf");

/// A service in a process of its own; killed when dropped.
pub struct Service {
    child: Child,
    base: String,
    data: PathBuf,
    /// What it has said so far on standard error, line by line.
    log: Arc<Mutex<Vec<String>>>,
    /// Removes the data folder in the end, when it is this service's own.
    _folder: Option<TempDir>,
}

impl Service {
    /// A service with a new data folder.
    pub fn start() -> Self {
        Self::with(&[])
    }

    /// A service with a new data folder and further arguments.
    pub fn with(arguments: &[&str]) -> Self {
        let folder = TempDir::new().unwrap();
        let mut service = Self::on(folder.path(), arguments);
        service._folder = Some(folder);
        service
    }

    /// A service on a data folder that may hold jobs already.
    pub fn on(data: &Path, arguments: &[&str]) -> Self {
        Self::spawn(program(), data, arguments, &[])
    }

    /// A service with a new data folder and variables in its environment.
    pub fn with_environment(environment: &[(&str, &str)], arguments: &[&str]) -> Self {
        let folder = TempDir::new().unwrap();
        let mut service = Self::spawn(program(), folder.path(), arguments, environment);
        service._folder = Some(folder);
        service
    }

    /// A service with a new data folder that lets in who brings `token`.
    pub fn with_token(token: &str, arguments: &[&str]) -> Self {
        Self::with_environment(&[("GAITWRIGHT_TOKEN", token)], arguments)
    }

    /// A service that gets an error, and not a signal that ends it, for a file that is larger than it may be.
    pub fn with_limits(data: &Path, arguments: &[&str]) -> Self {
        let mut shell = Command::new("sh");
        shell.args(["-c", "trap '' XFSZ; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_gaitwright")]);
        Self::spawn(shell, data, arguments, &[])
    }

    /// Bounds the size of the files that the service may write; what is beyond fails as on a full disk.
    pub fn limit_files(&self, bytes: Option<u64>) {
        let limit = bytes.map_or("unlimited".to_owned(), |bytes| bytes.to_string());
        let (id, limit) = (self.child.id().to_string(), format!("--fsize={limit}:unlimited"));
        let set = Command::new("prlimit").args(["--pid", &id, &limit]).status();
        assert!(set.expect("this test needs the program prlimit, which was not found").success());
    }

    /// A service whose writes to files fail when the test says so.
    pub fn with_failing_writes(data: &Path, arguments: &[&str], writes: &FailingWrites) -> Self {
        let mut program = program();
        writes.precede(&mut program);
        Self::spawn(program, data, arguments, &[])
    }

    fn spawn(mut program: Command, data: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Self {
        let listen: &[&str] =
            if arguments.contains(&"--listen") { &[] } else { &["--listen", "127.0.0.1:0"] };
        let mut child = program
            .arg("serve")
            .args(listen)
            .arg("--data")
            .arg(data)
            .args(arguments)
            .env_remove("GAITWRIGHT_TOKEN")
            .envs(environment.iter().copied())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
        let base = lines.by_ref().find_map(|line| address(&line)).expect("the service says where it listens");
        // The log is read on, so that the service never waits for its reader.
        let log = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&log);
        std::thread::spawn(move || lines.for_each(|line| kept.lock().unwrap().push(line)));
        Self { child, base, data: data.to_owned(), log, _folder: None }
    }

    /// Waits until the service has logged a line that satisfies `condition`, and gives it.
    pub fn logged(&self, what: &str, condition: impl Fn(&str) -> bool) -> String {
        let since = Instant::now();
        loop {
            if let Some(line) = self.log.lock().unwrap().iter().find(|line| condition(line)) {
                return line.clone();
            }
            assert!(since.elapsed() < DEADLINE, "{what} was not logged: {:#?}", self.log.lock().unwrap());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// What the service has logged so far, line by line.
    pub fn log(&self) -> Vec<String> {
        self.log.lock().unwrap().clone()
    }

    /// The address of `path`.
    pub fn url(&self, path: &str) -> String {
        format!("{}{path}", self.base)
    }

    /// What `curl` gets from `path`, with further arguments.
    pub fn curl(&self, path: &str, arguments: &[&str]) -> Answer {
        curl(&self.url(path), arguments, None)
    }

    /// The answer to a body sent to `path`.
    pub fn post(&self, path: &str, media_type: &str, body: &[u8]) -> Answer {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), body).unwrap();
        let header = format!("content-type: {media_type}");
        let data = format!("@{}", file.path().display());
        self.curl(path, &["-H", &header, "--data-binary", &data])
    }

    /// The answer to a JSON document sent to `path`.
    pub fn post_json(&self, path: &str, document: &Value) -> Answer {
        self.post(path, "application/json", document.to_string().as_bytes())
    }

    /// The answer to the wish that the job at `path` be cancelled.
    pub fn cancel(&self, path: &str) -> Answer {
        self.curl(&format!("{path}/cancel"), &["-X", "POST"])
    }

    /// The answer to the wish that the job at `path` be tried again.
    pub fn retry(&self, path: &str) -> Answer {
        self.curl(&format!("{path}/retry"), &["-X", "POST"])
    }

    /// Posts a job that soon finds motions that get on: the bundled quadruped, asked to `task`. Gives its path.
    pub fn post_gaits(&self, task: &Value, learning: &Value) -> String {
        let document =
            json!({ "character": { "urdf": QUADRUPED }, "task": task, "learning": learning, "seed": 7 });
        let answer = self.post_json("/v1/jobs", &document);
        assert_eq!(answer.status, 202, "{}", answer.text());
        answer.headers["location"].clone()
    }

    /// Posts two gaits, one after the other with twelve generations each. Gives the job's path.
    pub fn post_two_gaits(&self) -> String {
        self.post_gaits(&json!({ "speed": 0.9 }), &json!({ "generations": 24, "gait_generations": 12 }))
    }

    /// Posts a job for the paddler that is quick unless `learning` says otherwise, and gives its path.
    pub fn post_job(&self, learning: &Value) -> String {
        let mut quick = json!({ "population": 4, "islands": 1, "elite": 1, "episodes": 2, "trial_seconds": 0.5,
            "check_seconds": 1.0 });
        quick.as_object_mut().unwrap().extend(learning.as_object().unwrap().clone());
        let document = json!({ "character": { "urdf": PADDLER }, "learning": quick, "seed": 7 });
        let answer = self.post_json("/v1/jobs", &document);
        assert_eq!(answer.status, 202, "{}", answer.text());
        answer.headers["location"].clone()
    }

    /// The document at `path`.
    pub fn json(&self, path: &str) -> Value {
        let answer = self.curl(path, &[]);
        assert_eq!(answer.status, 200, "{path}: {}", answer.text());
        answer.json()
    }

    /// Waits until `condition` holds.
    pub fn until(what: &str, condition: impl Fn() -> bool) {
        let since = Instant::now();
        while !condition() {
            assert!(since.elapsed() < DEADLINE, "not {what} after {DEADLINE:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until the job at `path` satisfies `condition`, and gives it.
    pub fn wait(&self, path: &str, what: &str, condition: impl Fn(&Value) -> bool) -> Value {
        let since = Instant::now();
        loop {
            let job = self.json(path);
            if condition(&job) {
                return job;
            }
            assert!(since.elapsed() < DEADLINE, "the job is not {what} after {DEADLINE:?}: {job}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until the job at `path` has ended, and gives it.
    pub fn wait_for_end(&self, path: &str) -> Value {
        self.wait(path, "over", |job| !["queued", "running"].contains(&job["state"].as_str().unwrap()))
    }

    /// The folder of the job at `path`.
    pub fn folder(&self, path: &str) -> PathBuf {
        self.data.join("jobs").join(path.rsplit('/').next().unwrap())
    }

    /// The names of the process's threads that are neither its first nor one of those that serve requests and read the
    /// database: those that work at jobs.
    #[cfg(target_os = "linux")]
    pub fn working_threads(&self) -> Vec<String> {
        let threads = std::fs::read_dir(format!("/proc/{}/task", self.child.id())).unwrap();
        // A thread that has ended in the meantime has no name.
        let names =
            threads.filter_map(|thread| std::fs::read_to_string(thread.unwrap().path().join("comm")).ok());
        let of_all_jobs =
            |name: &String| ["gaitwright", "tokio", "sqlx"].iter().any(|of| name.starts_with(of));
        names.filter(|name| !of_all_jobs(name)).map(|name| name.trim().to_owned()).collect()
    }

    /// Sends a signal by its name.
    pub fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.child.id().to_string()]).status();
        assert!(sent.unwrap().success());
    }

    /// Waits until the process has ended, and tells whether it succeeded.
    pub fn wait_for_exit(&mut self) -> bool {
        let since = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.success();
            }
            assert!(since.elapsed() < DEADLINE, "the service has not ended after {DEADLINE:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Where a service listens, from the line of its log that says so.
fn address(line: &str) -> Option<String> {
    if let Some(address) = line.strip_prefix("listening on ") {
        return Some(address.to_owned());
    }
    let event: Value = serde_json::from_str(line).ok()?;
    (event["message"] == "listening").then(|| format!("http://{}", event["address"].as_str().unwrap()))
}

/// Has the writes of a service fail from a certain one on; see `preload/failing_writes.rs`.
pub struct FailingWrites {
    library: PathBuf,
    control: PathBuf,
    _folder: TempDir,
}

impl FailingWrites {
    /// Compiles what is loaded before the C library. All writes succeed at first.
    pub fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let library = folder.path().join("libfailing_writes.so");
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/service/http/preload/failing_writes.rs");
        let compiled = Command::new("rustc")
            .args(["--edition", "2024", "-O", "--crate-type", "cdylib", "-o"])
            .arg(&library)
            .arg(source)
            .status();
        assert!(compiled.expect("this test needs the program rustc, which was not found").success());
        let control = folder.path().join("control");
        std::fs::write(&control, [[0xff; 8], [0; 8], [0; 8]].concat()).unwrap();
        Self { library, control, _folder: folder }
    }

    /// Has the writes of a program fail that is not started yet.
    pub fn precede(&self, program: &mut Command) {
        program.env("LD_PRELOAD", &self.library).env("FAILING_WRITES", &self.control);
    }

    /// Lets so many further writes succeed, and fails all after them; none fails for `None`.
    pub fn allow(&self, writes: Option<i64>) {
        self.set(0, writes.unwrap_or(-1));
    }

    /// Has the writes that would fail never return instead.
    pub fn get_stuck(&self) {
        self.set(16, 1);
    }

    fn set(&self, at: u64, value: i64) {
        use std::os::unix::fs::FileExt;
        let file = std::fs::File::options().write(true).open(&self.control).unwrap();
        file.write_all_at(&value.to_ne_bytes(), at).unwrap();
    }

    /// Whether a write has failed, or the next will.
    pub fn failing(&self) -> bool {
        self.numbers()[0] == 0
    }

    /// How many writes there have been.
    pub fn count(&self) -> i64 {
        self.numbers()[1]
    }

    fn numbers(&self) -> [i64; 2] {
        let bytes = std::fs::read(&self.control).unwrap();
        [0, 8].map(|start| i64::from_ne_bytes(bytes[start..start + 8].try_into().unwrap()))
    }
}

/// The program under test.
fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_gaitwright"))
}

/// An answer.
pub struct Answer {
    pub status: u16,
    /// By lower-case name.
    pub headers: BTreeMap<String, String>,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }

    /// The problem document of an answer that has to be one with the given status.
    pub fn problem(&self, status: u16) -> Value {
        assert_eq!(self.status, status, "{}", self.text());
        assert_eq!(self.headers["content-type"], "application/problem+json");
        let problem = self.json();
        assert_eq!(problem["status"], status);
        for field in ["type", "title", "detail"] {
            assert!(!problem[field].as_str().unwrap().is_empty(), "{problem}");
        }
        problem
    }
}

/// Runs `curl` to its end, within a generous time.
pub fn curl(url: &str, arguments: &[&str], seconds: Option<u32>) -> Answer {
    let folder = TempDir::new().unwrap();
    let (head, body) = (folder.path().join("head"), folder.path().join("body"));
    let output: Output = Command::new("curl")
        .args(["-sS", "--max-time", &seconds.unwrap_or(120).to_string(), "-D"])
        .arg(&head)
        .arg("-o")
        .arg(&body)
        .args(arguments)
        .arg(url)
        .output()
        .expect("these tests need the program curl, which was not found");
    let head = std::fs::read_to_string(&head).unwrap_or_default();
    // A `100 Continue` has a head of its own before the answer's.
    let last = head.trim_end().rsplit("\r\n\r\n").next().unwrap_or_default();
    let mut lines = last.lines();
    let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok());
    let headers = lines.filter_map(|line| line.split_once(": "));
    Answer {
        status: status.unwrap_or_else(|| panic!("{url}: {}", String::from_utf8_lossy(&output.stderr))),
        headers: headers.map(|(name, value)| (name.to_ascii_lowercase(), value.trim().to_owned())).collect(),
        body: std::fs::read(&body).unwrap_or_default(),
    }
}

/// A `curl` that goes on receiving while the test does something else.
pub struct Receiver {
    child: Child,
    received: Vec<u8>,
}

impl Receiver {
    /// Starts it, and waits until the service has begun to answer.
    pub fn start(url: &str) -> Self {
        Self::with(url, &[])
    }

    /// The same with further arguments for `curl`.
    pub fn with(url: &str, arguments: &[&str]) -> Self {
        let mut child = Command::new("curl")
            .args(["-sS", "-N", "--max-time", "300", url])
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .expect("these tests need the program curl, which was not found");
        let mut received = vec![0];
        child.stdout.as_mut().unwrap().read_exact(&mut received).expect("the service answers");
        Self { child, received }
    }

    /// Leaves before the end.
    pub fn leave(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Receives until the service breaks the answer off: what has come is not all.
    pub fn breaks_off(mut self) {
        self.child.stdout.take().unwrap().read_to_end(&mut self.received).unwrap();
        assert!(!self.child.wait().unwrap().success(), "the stream ended as if it were whole");
    }

    /// Everything received until the service ends the answer.
    pub fn finish(mut self) -> Vec<u8> {
        self.child.stdout.take().unwrap().read_to_end(&mut self.received).unwrap();
        assert!(self.child.wait().unwrap().success(), "the stream broke off");
        self.received
    }
}

/// The events of a stream: kind and document.
pub fn events(stream: &[u8]) -> Vec<(String, Value)> {
    let text = String::from_utf8(stream.to_vec()).unwrap();
    let field = |event: &str, name: &str| {
        event.lines().find_map(|line| line.strip_prefix(name)).map(|value| value.trim().to_owned())
    };
    text.split("\n\n")
        .filter_map(|event| {
            let data = field(event, "data:")?;
            Some((field(event, "event:").unwrap(), serde_json::from_str(&data).unwrap()))
        })
        .collect()
}
