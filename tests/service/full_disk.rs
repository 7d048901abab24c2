//! Commands on a disk that is full, or gone, and with a log that nothing can be written into.

use std::fs::File;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::json;
use tempfile::TempDir;

use crate::http::client::{FailingWrites, PADDLER, curl};
use crate::http::whole::hasty_task;

/// Longest time to the end of a training that takes a few seconds where nothing fails.
const END: Duration = Duration::from_secs(60);

/// Longest time to the end after SIGTERM.
const TERMINATED: Duration = Duration::from_secs(10);

/// How many places of the training's writes are tried.
const TRIES: i64 = 16;

/// A training of the paddler in `folder`, of so many generations; it finds a motion in two.
fn training(folder: &Path, generations: u32) -> Command {
    let job = json!({
        "task": hasty_task([-1.0, 0.0, 0.0]), "seed": 2,
        "learning": { "population": 4, "islands": 1, "elite": 1, "episodes": 2, "trial_seconds": 0.5,
            "check_seconds": 1.0, "generations": generations },
    });
    std::fs::write(folder.join("paddler.urdf"), PADDLER).unwrap();
    std::fs::write(folder.join("job.json"), job.to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright"));
    command.current_dir(folder).args(["train", "paddler.urdf", "--job", "job.json", "--out", "out"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Waits for the end, which has to come by itself.
fn ended(mut child: Child, within: Duration, what: &str) -> Output {
    let since = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if since.elapsed() > within {
            child.kill().unwrap();
            panic!("{what} has not ended after {within:?}");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().unwrap()
}

fn terminate(child: &Child) {
    let sent = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
}

/// Every file under `folder`, by its path in it.
fn files(folder: &Path) -> Vec<String> {
    let found = Command::new("find").arg(folder).args(["-type", "f", "-printf", "%P\\n"]).output().unwrap();
    String::from_utf8(found.stdout).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn a_training_that_cannot_write_says_so_and_ends() {
    let (folder, writes) = (TempDir::new().unwrap(), FailingWrites::new());
    let run = |allowed: Option<i64>| {
        let _ = std::fs::remove_dir_all(folder.path().join("out"));
        let mut command = training(folder.path(), 2);
        writes.precede(&mut command);
        let before = writes.count();
        writes.allow(allowed);
        let output = ended(command.spawn().unwrap(), END, &format!("a training after {allowed:?} writes"));
        (output, writes.count() - before)
    };
    let (whole, needed) = run(None);
    assert!(whole.status.success(), "{}", String::from_utf8_lossy(&whole.stderr));
    assert!(needed > TRIES, "{needed}");
    for attempt in 0..TRIES {
        let allowed = needed * attempt / TRIES;
        let (output, _) = run(Some(allowed));
        let log = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "after {allowed} of {needed} writes: {log}");
        let message = log.lines().last().unwrap();
        // `out` is the folder itself at the first write, and its place in the names of files after it.
        assert!(message.contains("out") && message.contains("os error"), "{allowed}: {message}");
        assert_eq!(message.matches("os error").count(), 1, "{message}");
        let left = files(&folder.path().join("out"));
        assert!(!left.iter().any(|name| name.contains("unfinished")), "{left:?}");
        for name in left.iter().filter(|name| name.ends_with(".json")) {
            let bytes = std::fs::read(folder.path().join("out").join(name)).unwrap();
            serde_json::from_slice::<serde_json::Value>(&bytes)
                .unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
}

/// What a training that was killed in the middle of a file has left goes with the next one in the same folder.
#[test]
fn a_training_sweeps_what_one_before_it_has_left() {
    let folder = TempDir::new().unwrap();
    std::fs::create_dir_all(folder.path().join("out/motions")).unwrap();
    for name in
        ["out/.gaitwright-unfinishedAbCdEf", "out/motions/.gaitwright-unfinishedAbCdEf", "out/notes.txt"]
    {
        std::fs::write(folder.path().join(name), "half").unwrap();
    }
    let output = ended(training(folder.path(), 2).spawn().unwrap(), END, "a training");
    assert!(output.status.success());
    let left = files(&folder.path().join("out"));
    assert!(!left.iter().any(|name| name.contains("unfinished")), "{left:?}");
    assert!(left.contains(&"notes.txt".to_owned()) && left.contains(&"motion.json".to_owned()), "{left:?}");
}

/// What a training replaces is what one before it has written, and only once it is known that it can begin.
#[test]
fn a_training_takes_away_results_of_trainings_alone() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let train = || ended(training(folder.path(), 2).spawn().unwrap(), END, "a training");
    assert!(train().status.success());
    let own = ["table.json", "notes.txt", "motions/2024-mine.json", "motions/trot.txt"];
    own.iter().for_each(|name| std::fs::write(out.join(name), "mine").unwrap());
    let contents = || -> Vec<(String, Vec<u8>)> {
        let mut names = files(&out);
        names.sort();
        names.into_iter().map(|name| (name.clone(), std::fs::read(out.join(&name)).unwrap())).collect()
    };
    let before = contents();

    let mut refused = training(folder.path(), 2);
    let mut job: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("job.json")).unwrap()).unwrap();
    job["task"]["gait"] = json!("trot");
    std::fs::write(folder.path().join("job.json"), job.to_string()).unwrap();
    let output = ended(refused.spawn().unwrap(), END, "a training that is refused");
    assert!(!output.status.success() && output.stdout.is_empty());
    assert!(String::from_utf8_lossy(&output.stderr).contains("/task/gait"));
    assert!(contents() == before, "{:?}", files(&out));

    assert!(train().status.success());
    for name in own {
        assert_eq!(std::fs::read(out.join(name)).unwrap(), b"mine", "{name}");
    }
}

#[test]
fn a_training_ends_when_it_is_told_to() {
    let folder = TempDir::new().unwrap();
    let child = training(folder.path(), 1_000_000).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(2));
    terminate(&child);
    let output = ended(child, TERMINATED, "a training that was told to");
    let log = String::from_utf8(output.stderr).unwrap();
    assert!(log.contains("stopping"), "{log}");
    assert!(files(&folder.path().join("out")).contains(&"report.json".to_owned()), "{log}");
}

#[test]
fn a_training_ends_when_it_is_told_to_although_its_disk_is_gone() {
    let (folder, writes) = (TempDir::new().unwrap(), FailingWrites::new());
    let mut command = training(folder.path(), 1_000_000);
    writes.precede(&mut command);
    writes.get_stuck();
    writes.allow(Some(40));
    let child = command.spawn().unwrap();
    let since = Instant::now();
    while !writes.failing() {
        assert!(since.elapsed() < END);
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_secs(1));
    terminate(&child);
    assert_eq!(ended(child, TERMINATED, "a training that waits for its disk").status.code(), Some(1));
}

/// Nothing that is said can be written, and everything goes on.
#[test]
fn a_log_on_a_full_disk_stops_nobody() {
    let full = || File::options().write(true).open("/dev/full").unwrap();
    let folder = TempDir::new().unwrap();
    let trained = training(folder.path(), 2).stderr(full()).spawn().unwrap();
    assert!(ended(trained, END, "a training").status.success());

    for format in ["text", "json"] {
        // Free a moment ago, and most likely still.
        let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let data = TempDir::new().unwrap();
        let mut service = Command::new(env!("CARGO_BIN_EXE_gaitwright"));
        service.args(["serve", "--log", "debug", "--log-format", format, "--listen", &address.to_string()]);
        let service = service.arg("--data").arg(data.path()).stderr(full()).spawn().unwrap();
        let base = format!("http://{address}");
        let get =
            |path: &str| curl(&format!("{base}{path}"), &["--retry", "20", "--retry-connrefused"], None);
        assert_eq!(get("/healthz").status, 200, "{format}");
        let body = json!({ "character": { "urdf": PADDLER }, "learning": { "population": 4, "islands": 1, "elite": 1,
            "episodes": 2, "trial_seconds": 0.5, "check_seconds": 1.0, "generations": 1 } });
        let posted = curl(
            &format!("{base}/v1/jobs"),
            &["-H", "content-type: application/json", "-d", &body.to_string()],
            None,
        );
        assert_eq!(posted.status, 202, "{}", posted.text());
        let since = Instant::now();
        let state = || get(&posted.headers["location"]).json()["state"].as_str().unwrap().to_owned();
        while ["queued", "running"].contains(&&*state()) {
            assert!(since.elapsed() < END, "{format}: the job has not ended");
            std::thread::sleep(Duration::from_millis(50));
        }
        assert_eq!(get("/readyz").status, 200, "the worker is there");
        terminate(&service);
        assert!(ended(service, TERMINATED, "a service").status.success(), "{format}");
    }
}
