//! Damaged requests: whatever comes, the answer is clear and the service goes on.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::client::{PADDLER, Service};
use crate::common;
use crate::damage::{archive, cases, damage, meshed};

/// Requests unless told otherwise.
const REQUESTS: u64 = 400;

/// A request: path, media type, body.
struct Request {
    path: &'static str,
    media_type: String,
    body: Vec<u8>,
}

/// A form with parts by their names.
fn form(parts: &[(&str, &[u8])]) -> (String, Vec<u8>) {
    let mut body = Vec::new();
    for (name, contents) in parts {
        let head =
            format!("--edge\r\ncontent-disposition: form-data; name=\"{name}\"; filename=\"{name}\"\r\n\r\n");
        body.extend(head.bytes().chain(contents.iter().copied()).chain(*b"\r\n"));
    }
    body.extend(b"--edge--\r\n");
    ("multipart/form-data; boundary=edge".to_owned(), body)
}

/// Requests that are in order.
fn requests() -> Vec<Request> {
    let hexapod = std::fs::read(common::example_path("hexapod.json")).unwrap();
    let scenario = json!({ "format": "gaitwright/scenario@1", "character": { "urdf": PADDLER }, "duration": 0.02,
        "scene": { "friction": 0.8, "effects": { "gravity": "on" } }, "accuracy": { "step": 0.002 },
        "drive": { "kind": "hold", "stiffness": 60, "joints": { "left_hinge": 0.1 } } });
    let job = json!({ "format": "gaitwright/job@1", "character": { "urdf": PADDLER }, "priority": 1, "seed": 3,
        "task": { "direction": [1, 0, 0], "speed": 0.5, "weights": { "energy": 1 } },
        "learning": { "generations": 2, "population": 4, "mutation": { "angle": 0.1 } } });
    let terms = json!({ "learning": { "generations": 2 }, "seed": 1 }).to_string();
    let zip = archive(&meshed());
    let study = json!({ "scenario": scenario, "tolerances": [0.01] });
    let mut requests = Vec::new();
    let mut add = |path, media_type: &str, body: &[u8]| {
        requests.push(Request { path, media_type: media_type.to_owned(), body: body.to_vec() });
    };
    for path in ["/v1/jobs", "/v1/characters"] {
        add(path, "application/xml", PADDLER.as_bytes());
        add(path, "application/zip", &zip);
        let (media_type, body) = form(&[("character", &zip)]);
        add(path, &media_type, &body);
    }
    add("/v1/characters", "application/json", &hexapod);
    add("/v1/jobs", "application/json", job.to_string().as_bytes());
    let (media_type, body) = form(&[("character", PADDLER.as_bytes()), ("job", terms.as_bytes())]);
    add("/v1/jobs", &media_type, &body);
    add("/v1/accuracy", "application/json", study.to_string().as_bytes());
    add("/v1/simulations", "application/json", scenario.to_string().as_bytes());
    requests
}

/// The answer to a request on a connection of its own: status, media type and body; `None` where there is none.
fn send(service: &Service, request: &Request) -> Option<(u16, String, Vec<u8>)> {
    let mut stream = TcpStream::connect(service.url("").trim_start_matches("http://")).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(120))).unwrap();
    let head = format!(
        "POST {} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: {}\r\ncontent-length: {}\r\n\r\n",
        request.path,
        request.media_type,
        request.body.len(),
    );
    stream.write_all(head.as_bytes()).unwrap();
    stream.write_all(&request.body).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).ok()?;
    let end = answer.windows(4).position(|four| four == b"\r\n\r\n")?;
    let head = String::from_utf8_lossy(&answer[..end]).to_ascii_lowercase();
    let status = head.split(' ').nth(1)?.parse().ok()?;
    let media_type = head.lines().find_map(|line| line.strip_prefix("content-type: ")).unwrap_or_default();
    Some((status, media_type.to_owned(), answer[end + 4..].to_vec()))
}

#[test]
fn damaged_requests_get_a_clear_answer() {
    // What is in order is turned away only then, so that no job runs.
    let service = Service::with(&["--queue", "0"]);
    let requests = requests();
    for request in &requests {
        let (status, _, body) = send(&service, request).unwrap();
        let text = String::from_utf8_lossy(&body);
        assert!([200, 201, 429].contains(&status), "{} {}: {text}", request.path, request.media_type);
    }
    let mut refused = 0;
    for case in cases(REQUESTS) {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        let sound = &requests[rng.random_range(0..requests.len())];
        let mut body = sound.body.clone();
        damage(&mut rng, &mut body);
        let damaged = Request { path: sound.path, media_type: sound.media_type.clone(), body };
        let of = || format!("case {case}, {} {}", damaged.path, damaged.media_type);
        let (status, media_type, body) =
            send(&service, &damaged).unwrap_or_else(|| panic!("{}: no answer", of()));
        if [200, 201].contains(&status) {
            continue;
        }
        assert!(
            [400, 413, 415, 422, 429].contains(&status),
            "{}: {status} {}",
            of(),
            String::from_utf8_lossy(&body)
        );
        assert_eq!(media_type, "application/problem+json", "{}", of());
        let problem: Value = serde_json::from_slice(&body).unwrap();
        assert!(!problem["detail"].as_str().unwrap().is_empty(), "{}: {problem}", of());
        if problem["type"] == "urn:gaitwright:input" {
            refused += 1;
            let faults = problem["errors"].as_array().unwrap();
            assert!(!faults.is_empty(), "{}: {problem}", of());
            for fault in faults {
                assert!(!fault["detail"].as_str().unwrap().is_empty(), "{}: {problem}", of());
            }
        }
    }
    assert!(refused > 0, "no damage was noticed");
    assert_eq!(service.curl("/healthz", &[]).status, 200);
    assert_eq!(service.curl("/readyz", &[]).status, 200);
}
