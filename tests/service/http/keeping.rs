//! What is kept and for how long; and what clients keep: tags, compression.

use serde_json::{Value, json};
use tempfile::TempDir;

use super::client::{Answer, PADDLER, QUADRUPED, Service};

fn quick() -> Value {
    json!({ "generations": 1 })
}

#[test]
fn jobs_say_when_they_go_and_go() {
    let service = Service::with(&["--keep-jobs", "2", "--keep-recordings", "1", "--keep-notice", "3"]);
    let mut posted = Vec::new();
    for _ in 0..3 {
        let path = service.post_job(&quick());
        let job = service.wait_for_end(&path);
        assert!(job["storage"]["bytes"].as_u64() > job["storage"]["recording_bytes"].as_u64(), "{job}");
        assert_eq!(
            job["storage"]["recording_bytes"].as_u64().unwrap(),
            std::fs::metadata(service.folder(&path).join("recording.rrd")).unwrap().len()
        );
        posted.push(path);
    }
    // Told first: the oldest goes for its number, and its recording no later.
    let job = service.wait(&posted[0], "told", |job| !job["storage"]["expires"].is_null());
    let expiry = &job["storage"]["expires"];
    assert!(expiry["because"].as_str().unwrap().contains("2 newest"), "{expiry}");
    let at = |text: &Value| text.as_str().unwrap().parse::<jiff::Timestamp>().unwrap();
    let told = at(&expiry["at"]);
    let gone = |path: &str| service.curl(path, &[]).status == 404;
    Service::until("gone", || gone(&posted[0]));
    assert!(jiff::Timestamp::now() >= told, "it goes no earlier than it has said");
    // The record goes first, then what it spoke of.
    let folder = service.folder(&posted[0]);
    Service::until("without a folder", || !folder.exists());
    assert!(jiff::Timestamp::now() < told + jiff::SignedDuration::from_secs(120), "it goes too late");

    // The second keeps its place but for its recording.
    let recording = format!("{}/recording.rrd", posted[1]);
    let job = service.wait(&posted[1], "without recording", |job| job["storage"]["recording_bytes"] == 0);
    assert!(!job["storage"]["recording_removed"].is_null());
    assert!(job["storage"]["expires"].is_null());
    let file = service.folder(&posted[1]).join("recording.rrd");
    Service::until("without the file", || !file.exists());
    let detail = service.curl(&recording, &[]).problem(410)["detail"].as_str().unwrap().to_owned();
    assert!(detail.contains("was removed at"), "{detail}");
    assert_eq!(service.curl(&format!("{}/curve", posted[1]), &[]).status, 200);
    assert_eq!(service.curl(&format!("{}/recording.rrd", posted[2]), &[]).status, 200);
}

/// A job that was deleted goes with all its files, if need be at the next start. Those of a job that the database has never heard of
/// are somebody's: the database may be another than the one that they were made with.
#[test]
fn a_start_removes_what_is_left_of_deleted_jobs_and_nothing_else() {
    let data = TempDir::new().unwrap();
    let mut service = Service::on(data.path(), &[]);
    let [deleted, kept] = [(); 2].map(|()| service.post_job(&quick()));
    for path in [&deleted, &kept] {
        service.wait_for_end(path);
    }
    assert_eq!(service.curl(&deleted, &["-X", "DELETE"]).status, 204);
    let left = service.folder(&deleted);
    let stranger = data.path().join("jobs/01890000-0000-7000-8000-000000000000");
    for folder in [&left, &stranger] {
        std::fs::create_dir(folder).unwrap();
        std::fs::write(folder.join("motion.json"), "{}").unwrap();
    }
    service.signal("TERM");
    assert!(service.wait_for_exit());

    let mut service = Service::on(data.path(), &[]);
    service
        .logged("what is unknown stays", |line| line.contains("files of jobs that this store does not know"));
    assert!(!left.exists());
    assert!(stranger.join("motion.json").exists());
    assert_eq!(service.curl(&format!("{kept}/recording.rrd"), &[]).status, 200);
    service.signal("TERM");
    assert!(service.wait_for_exit());

    // Without its database a service knows none of the jobs.
    for name in ["gaitwright.db", "gaitwright.db-wal", "gaitwright.db-shm"] {
        let _ = std::fs::remove_file(data.path().join(name));
    }
    let service = Service::on(data.path(), &[]);
    service
        .logged("what is unknown stays", |line| line.contains("files of jobs that this store does not know"));
    assert!(service.folder(&kept).join("recording.rrd").exists());
}

#[test]
fn limits_of_what_is_kept_are_read_or_refused() {
    for limits in ["30", "1d,2d", "5 GB", "-1", "", "1d,", "7w"] {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_gaitwright"))
            .args(["serve", "--keep-jobs", limits, "--listen", "127.0.0.1:0", "--data", "/dev/null/none"])
            .output()
            .unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        // Sound limits get as far as the data folder, which cannot be made there.
        let expected = if limits == "30" { 1 } else { 2 };
        assert_eq!(output.status.code(), Some(expected), "{limits}: {message}");
    }
}

#[test]
fn characters_are_listed_and_deleted() {
    let service = Service::start();
    let mut kept = Vec::new();
    for number in 0..5 {
        let text = PADDLER.replace("paddler", &format!("paddler-{number}"));
        kept.push(service.post("/v1/characters", "application/xml", text.as_bytes()).json());
    }
    let mut seen = Vec::new();
    let mut next = Some("/v1/characters?limit=2".to_owned());
    while let Some(page) = next {
        let page = service.json(&page);
        assert_eq!(page["format"], "gaitwright/characters@1");
        for character in page["characters"].as_array().unwrap() {
            assert!(character["bytes"].as_u64().unwrap() > 1000 && character["expires"].is_null());
            seen.push((character["id"].clone(), character["name"].clone(), character["digest"].clone()));
        }
        next = page["next"].as_str().map(str::to_owned);
    }
    let about = |body: &Value| (body["id"].clone(), body["name"].clone(), body["digest"].clone());
    assert!(seen.iter().eq(kept.iter().rev().map(about).collect::<Vec<_>>().iter()), "the newest first");
    service.curl("/v1/characters?limit=0", &[]).problem(400);
    service.curl("/v1/characters?order=name", &[]).problem(400);

    // Needed by a job until that has ended.
    let place = |index: usize| format!("/v1/characters/{}", kept[index]["id"].as_str().unwrap());
    let job = json!({ "character": { "id": kept[0]["id"] }, "learning": { "generations": 100_000 } });
    let path = service.post_json("/v1/jobs", &job).headers["location"].clone();
    let detail = service.curl(&place(0), &["-X", "DELETE"]).problem(409)["detail"].clone();
    assert!(detail.as_str().unwrap().contains(path.rsplit('/').next().unwrap()), "{detail}");
    assert_eq!(service.curl(&place(1), &["-X", "DELETE"]).status, 204);
    service.curl(&place(1), &["-X", "DELETE"]).problem(404);
    service.curl(&place(1), &[]).problem(404);
    service.cancel(&path);
    service.wait_for_end(&path);
    assert_eq!(service.curl(&place(0), &["-X", "DELETE"]).status, 204);
    // The job keeps what it was posted with.
    assert_eq!(service.retry(&path).status, 202);
    service.wait(&path, "running", |job| job["state"] == "running");
}

#[test]
fn characters_that_are_not_used_go() {
    let service = Service::with(&["--keep-characters", "1", "--keep-notice", "2"]);
    let post = |name: &str| {
        let text = PADDLER.replace("paddler", name);
        service.post("/v1/characters", "application/xml", text.as_bytes()).headers["location"].clone()
    };
    let (older, newer) = (post("older"), post("newer"));
    // Whatever happens has house kept.
    service.wait_for_end(&service.post_job(&quick()));
    let expires = || {
        let page = service.json("/v1/characters");
        let listed = page["characters"].as_array().unwrap().clone();
        listed.iter().find(|body| body["name"] == "older").map(|body| body["expires"].clone())
    };
    Service::until("told", || expires().is_none_or(|expires| !expires.is_null()));
    assert!(expires().is_none_or(|expires| expires["because"].as_str().unwrap().contains("1 newest")));
    Service::until("gone", || {
        service.wait_for_end(&service.post_job(&quick()));
        service.curl(&older, &[]).status == 404
    });
    assert_eq!(service.curl(&newer, &[]).status, 200);
}

fn gunzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Read;
    let mut text = Vec::new();
    flate2::read::GzDecoder::new(bytes).read_to_end(&mut text).unwrap();
    text
}

#[test]
fn finished_results_have_tags_and_text_is_compressed() {
    let service = Service::start();
    let document = json!({ "character": { "urdf": QUADRUPED }, "seed": 7, "learning": { "generations": 2 },
        "task": { "gait": "trot", "froude": 0.4 } });
    let path = service.post_json("/v1/jobs", &document).headers["location"].clone();
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    let natural = job["metrics"]["natural"].as_bool().unwrap();
    assert_eq!(job["outcome"], if natural { "natural" } else { "not_natural" });

    for result in [
        "motion",
        "motions",
        "motions/1",
        "motions/1/gait",
        "gait",
        "gait.svg",
        "curve",
        "report",
        "motion.glb",
        "motion.csv",
        "motion.yaml",
        "motion.xml",
    ] {
        let place = format!("{path}/{result}");
        let whole = service.curl(&place, &[]);
        let tag = whole.headers["etag"].clone();
        assert_eq!((whole.status, &*whole.headers["cache-control"]), (200, "no-cache"), "{result}");
        let asked = |tag: &str| service.curl(&place, &["-H", &format!("if-none-match: {tag}")]);
        let strong = tag.trim_start_matches("W/");
        for known in [&tag, strong, "*", &format!("\"other\", {tag}")] {
            let answer = asked(known);
            assert_eq!((answer.status, answer.body.len()), (304, 0), "{result}: {known}");
            assert_eq!(answer.headers["etag"], tag);
            // By what another answer comes is said whether it is sent or not.
            let by = match result {
                "motion.glb" => None,
                "curve" => Some("accept, accept-encoding"),
                _ => Some("accept-encoding"),
            };
            for answer in [&whole, &answer] {
                assert_eq!(answer.headers.get("vary").map(String::as_str), by, "{result}");
            }
        }
        assert_eq!(asked("\"other\"").body, whole.body, "{result}");

        let compressed = service.curl(&place, &["-H", "accept-encoding: gzip"]);
        if result == "motion.glb" {
            assert!(!compressed.headers.contains_key("content-encoding"));
        } else {
            assert_eq!(compressed.headers["content-encoding"], "gzip", "{result}");
            // A curve of two points is too short for more.
            let share = if result == "curve" { 1 } else { 2 };
            assert!(compressed.body.len() < whole.body.len() / share, "{result}");
            assert_eq!(gunzip(&compressed.body), whole.body, "{result}");
            assert_eq!(compressed.headers["etag"], tag, "{result}");
        }
    }
    let tag = |answer: &Answer| answer.headers["etag"].clone();
    let export = |query: &str| tag(&service.curl(&format!("{path}/motion.csv{query}"), &[]));
    assert_ne!(export(""), export("?fps=30"));

    // The page, its viewer and lists; but nothing that has to arrive at once.
    let gzip = ["-H", "accept-encoding: gzip"];
    for place in ["/", "/app.js", "/style.css", "/viewer/re_viewer_bg.wasm", "/openapi.json", "/v1/jobs"] {
        let compressed = service.curl(place, &gzip);
        assert_eq!(compressed.headers["content-encoding"], "gzip", "{place}");
        assert_eq!(gunzip(&compressed.body), service.curl(place, &[]).body, "{place}");
    }
    for place in [format!("{path}/events"), format!("{path}/recording.rrd")] {
        assert!(!service.curl(&place, &gzip).headers.contains_key("content-encoding"), "{place}");
    }
    let viewer = service.curl("/viewer/re_viewer_bg.wasm", &gzip);
    assert_eq!(viewer.headers["vary"], "accept-encoding");
    assert!(viewer.body.len() < 20_000_000, "{} bytes", viewer.body.len());
    let known = format!("if-none-match: {}", tag(&viewer));
    assert_eq!(service.curl("/viewer/re_viewer_bg.wasm", &["-H", &known]).status, 304);
}
