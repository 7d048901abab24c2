//! The client for Python, driven by a program of its own against a service of its own.

use std::process::Command;

use crate::common::repository;
use crate::http::client::Service;

/// Runs the program beside this file; it ends with an error where an answer is not as it should be.
#[test]
fn the_python_client_submits_follows_and_fetches() {
    let service = Service::start();
    let folder = tempfile::tempdir().unwrap();
    let examples = repository().join("examples");
    let output = Command::new("python3")
        .arg(repository().join("tests/service/python/drive.py"))
        .arg(service.url(""))
        .arg(examples.join("quadruped.urdf"))
        .arg(folder.path())
        .env("PYTHONPATH", examples.join("python"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .expect("this test needs the program python3, which was not found");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}\n{}", String::from_utf8_lossy(&output.stderr));
    // A program that ended early would have said nothing.
    assert_eq!(told.lines().last(), Some("done"));
}
