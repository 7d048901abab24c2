//! The page in a real browser: headless Chromium, led by playwright-core.
//!
//! Each test starts a service and runs one scenario of `scenarios.cjs` beside this file, which ends with an error where
//! the page is not as it should be, where it logs an error, and where a request fails. With the variable `SCREENSHOTS`
//! the scenarios leave pictures in the folder that it names.

use std::process::Command;

use crate::common::repository;
use crate::http::client::Service;

fn run(scenario: &str) {
    let service = Service::start();
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new("node")
        .arg(repository().join("tests/service/browser/scenarios.cjs"))
        .args([scenario, &service.url("/")])
        .arg(repository().join("examples"))
        .arg(folder.path())
        .output()
        .expect("this test needs the program node, which was not found");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}\n{}", String::from_utf8_lossy(&output.stderr));
    // A scenario that ended early would have said nothing.
    assert_eq!(told.lines().last(), Some("done"));
}

#[test]
#[ignore = "needs Chromium and playwright-core: apt-get install chromium, npm install playwright-core, and NODE_PATH"]
fn a_character_is_uploaded_trained_watched_played_and_downloaded() {
    run("train");
}

#[test]
#[ignore = "needs Chromium and playwright-core: apt-get install chromium, npm install playwright-core, and NODE_PATH"]
fn the_page_works_by_keyboard_alone() {
    run("keyboard");
}

#[test]
#[ignore = "needs Chromium and playwright-core: apt-get install chromium, npm install playwright-core, and NODE_PATH"]
fn the_page_is_legible_at_phone_width_in_the_dark_and_in_the_light() {
    run("looks");
}

#[test]
#[ignore = "needs Chromium and playwright-core: apt-get install chromium, npm install playwright-core, and NODE_PATH"]
fn a_zip_with_meshes_is_dropped() {
    run("drop");
}

#[test]
#[ignore = "needs Chromium and playwright-core: apt-get install chromium, npm install playwright-core, and NODE_PATH"]
fn a_study_is_shown_and_the_viewer_sends_nothing_elsewhere() {
    run("study");
}
