//! Servers and workers in processes of their own, over a database and files that they share.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::postgres::Database;
use crate::http::client::Service;

/// How long a test waits for something that has to happen.
const DEADLINE: Duration = Duration::from_secs(180);

/// What servers and workers share.
pub struct Cluster {
    pub database: Database,
    /// Where the files are, as the option `--files` has it.
    files: String,
    /// The lease, s.
    lease: &'static str,
    /// What every process has in its environment.
    environment: Vec<(String, String)>,
    folder: TempDir,
}

impl Cluster {
    /// With files in a folder.
    pub fn new(database: Database) -> Self {
        let folder = TempDir::new().unwrap();
        let files = format!("file://{}", folder.path().join("objects").display());
        Self { database, files, lease: "2", environment: Vec::new(), folder }
    }

    /// With files elsewhere, for which every process has this environment.
    pub fn with_files(database: Database, files: &str, environment: Vec<(String, String)>) -> Self {
        Self { files: files.to_owned(), environment, ..Self::new(database) }
    }

    /// With the lease that a shared store has unless told otherwise.
    pub fn with_usual_lease(database: Database) -> Self {
        Self { lease: "20", ..Self::new(database) }
    }

    fn environment(&self) -> Vec<(&str, &str)> {
        self.environment.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect()
    }

    /// A server that leaves the work to others.
    pub fn server(&self) -> Service {
        let store = self.database.url();
        let arguments = ["--workers", "0", "--store", &store, "--files", &self.files, "--lease", self.lease];
        Service::with_environment(&self.environment(), &arguments)
    }

    /// A worker.
    pub fn worker(&self) -> Worker {
        self.worker_at(&self.database.url())
    }

    /// A worker that reaches the database at a URL of its own.
    pub fn worker_at(&self, store: &str) -> Worker {
        self.worker_with(store, &[])
    }

    /// A worker that tells how it is at an address of this machine.
    pub fn worker_with_status(&self) -> Worker {
        self.worker_with(&self.database.url(), &["--status", "127.0.0.1:0"])
    }

    fn worker_with(&self, store: &str, arguments: &[&str]) -> Worker {
        let data = self.folder.path().join("scratch");
        let mut child = Command::new(env!("CARGO_BIN_EXE_gaitwright"))
            .arg("work")
            .args(["--store", store, "--files", &self.files, "--lease", self.lease, "--data"])
            .arg(data)
            .args(arguments)
            .envs(self.environment())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
        let log = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&log);
        std::thread::spawn(move || lines.for_each(|line| kept.lock().unwrap().push(line)));
        let worker = Worker { child, log };
        worker.logged("that it works", |line| line.contains("working"));
        worker
    }
}

/// A worker in a process of its own; killed when dropped.
pub struct Worker {
    child: Child,
    /// What it has said so far on standard error, line by line.
    log: Arc<Mutex<Vec<String>>>,
}

impl Worker {
    /// Ends it at once.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Asks it to end, and waits until it has; whether it succeeded.
    pub fn leave(mut self) -> bool {
        let sent = Command::new("kill").args(["-TERM", &self.child.id().to_string()]).status();
        assert!(sent.unwrap().success());
        self.child.wait().unwrap().success()
    }

    /// Waits until it has logged a line that satisfies `condition`, and gives the first.
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

    /// The URL of `path` of a worker that tells how it is.
    pub fn url(&self, path: &str) -> String {
        let line = self.logged("where it listens", |line| line.starts_with("listening on "));
        line.replace("listening on ", "") + path
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
