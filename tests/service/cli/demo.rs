//! The demonstration.

use super::{command, interrupt, json, stdout, wait};

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

use tempfile::TempDir;

#[test]
fn demo_leaves_recording_and_motion() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    // Its service asks for a token, of which the environment has the digest only.
    let digest = format!("sha256:{}", "0".repeat(64));
    let mut demo = command(&["demo", "--exit", "--generations", "2", "--out", out.to_str().unwrap()]);
    let output = demo.env("GAITWRIGHT_TOKENS", format!("anna={digest}")).output().unwrap();
    let text = stdout(&output);
    let paths: Vec<&Path> = text.lines().map(Path::new).collect();
    assert_eq!(paths, [out.join("recording.rrd"), out.join("motion.json")]);
    assert_eq!(&std::fs::read(paths[0]).unwrap()[..4], b"RRF2");
    assert_eq!(json(paths[1])["format"], "gaitwright/motion@1");
    assert!(String::from_utf8(output.stderr).unwrap().contains("http://127.0.0.1:"));
}

#[test]
fn a_demo_that_is_interrupted_before_its_results_ends_at_once_and_says_so() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    let mut child = command(&["demo", "--seconds", "600", "--out", out.to_str().unwrap()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut messages = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    messages.by_ref().find(|line| line.contains("the job:")).unwrap();
    interrupt(&child);
    let said = std::thread::spawn(move || messages.collect::<Vec<_>>().join("\n"));
    assert_eq!(wait(&mut child), Some(1));
    let said = said.join().unwrap();
    assert!(said.contains("interrupted") && !said.contains("until Ctrl-C"), "{said}");
}
