//! What trainings leave.

use super::{PADDLER, QUADRUPED, QUICK, command, interrupt, json, refusal, run, stdout, wait, write};

use std::io::{BufRead, BufReader, Cursor};
use std::path::Path;
use std::process::Stdio;

use re_sdk::StoreKind;
use re_sdk::external::re_log_encoding::DecoderApp;
use tempfile::TempDir;

#[test]
fn train_leaves_everything_and_does_not_depend_on_threads() {
    let folder = TempDir::new().unwrap();
    let job = write(folder.path(), "job.json", QUICK);
    let train = |out: &Path, threads: &str| {
        let out = out.to_str().unwrap();
        run(&["train", QUADRUPED, "--out", out, "--job", &job, "--seed", "5", "--threads", threads])
    };
    let (one, two) = (folder.path().join("one"), folder.path().join("two"));
    let listed = stdout(&train(&one, "1"));
    for name in
        ["recording.rrd", "motion.json", "motions.json", "report.json", "curve.csv", "gait.json", "gait.svg"]
    {
        let path = one.join(name);
        assert!(path.is_file(), "{name}");
        assert!(listed.lines().any(|line| line == path.to_str().unwrap()), "{name} is named");
    }
    stdout(&train(&two, "2"));
    for name in ["motion.json", "gait.json", "report.json"] {
        assert_eq!(json(&one.join(name)), json(&two.join(name)), "{name}");
    }
    // The only motion of its repertoire is the job's.
    assert_eq!(json(&one.join("motions/1-trot.json")), json(&one.join("motion.json")));
    let motion = json(&one.join("motion.json"));
    assert_eq!(motion["provenance"]["seed"], 5);
    assert_eq!(json(&one.join("report.json"))["reproducible"], true);
    let curve = std::fs::read_to_string(one.join("curve.csv")).unwrap();
    assert_eq!(curve.lines().count(), 4);
}

#[test]
fn recordings_of_different_jobs_have_different_names() {
    let folder = TempDir::new().unwrap();
    let name = |out: &str, job: &str| {
        let job = write(folder.path(), "job.json", job);
        let out = folder.path().join(out);
        stdout(&run(&["train", QUADRUPED, "--out", out.to_str().unwrap(), "--job", &job]));
        let bytes = std::fs::read(out.join("recording.rrd")).unwrap();
        let messages = DecoderApp::decode_lazy(Cursor::new(bytes)).map(Result::unwrap);
        let names = messages.filter(|message| message.store_id().kind() == StoreKind::Recording);
        names.map(|message| message.store_id().recording_id().to_string()).next().unwrap()
    };
    let faster = QUICK.replace("0.4", "0.5");
    let plain = name("one", QUICK);
    assert_ne!(plain, name("two", &faster));
    assert_eq!(plain, name("three", QUICK));
}

/// Motors that cannot carry the quadruped teach it nothing however long they are searched with, which the message does not suggest.
#[test]
fn a_character_that_cannot_stand_is_told_where_to_look() {
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(QUADRUPED).unwrap();
    let weak = write(folder.path(), "weak.urdf", &text.replace("effort=\"30\"", "effort=\"0.1\""));
    let job = r#"{ "task": { "gait": "trot" }, "learning": { "generations": 1 } }"#;
    let job = write(folder.path(), "job.json", job);
    let out = folder.path().join("out");
    let answer = run(&["train", &weak, "--out", out.to_str().unwrap(), "--job", &job]);
    let message = String::from_utf8(answer.stderr).unwrap();
    assert_eq!(answer.status.code(), Some(1), "{message}");
    let last = message.lines().next_back().unwrap();
    assert!(last.contains("no pose was found") && last.contains("motors"), "{message}");
    let report = json(&out.join("report.json"));
    assert_eq!(report["standing"]["stable"], false);
    assert!(report["unsuccessful"].as_str().unwrap().contains("no pose was found"), "{report}");
}

#[test]
fn budgets_that_make_no_sense_are_refused() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let demo = |option: &str, value: &str| refusal(&run(&["demo", "--exit", "--out", out, option, value]));
    assert!(demo("--seconds", "nan").contains("--seconds: NaN"));
    assert!(demo("--seconds", "0").contains("--seconds: 0 does not"));
    assert!(demo("--generations", "0").contains("--generations: 0 does not"));
    let output = run(&["train", PADDLER, "--out", out, "--threads", "100000"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("--threads"));
    assert!(!Path::new(out).exists(), "nothing was begun");
}

#[test]
fn an_interrupted_training_writes_what_was_found() {
    let folder = TempDir::new().unwrap();
    let job = write(folder.path(), "job.json", r#"{"learning": {"gait_generations": 6}}"#);
    let out = folder.path().join("out");
    let mut child = command(&["train", QUADRUPED, "--out", out.to_str().unwrap(), "--job", &job])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut messages = BufReader::new(child.stderr.take().unwrap()).lines();
    messages.by_ref().map(Result::unwrap).find(|line| line.starts_with("motion 1, ")).unwrap();
    interrupt(&child);
    std::thread::spawn(move || messages.for_each(drop));
    assert_eq!(wait(&mut child), Some(0));
    assert_eq!(json(&out.join("report.json"))["ended_by"], "cancelled");
    assert!(out.join("recording.rrd").is_file());
    assert!(out.join("motion.json").is_file());
}
