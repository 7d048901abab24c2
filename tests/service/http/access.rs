//! Who may come in, by which name, how many at once, and for how long they may stay silent.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::client::{PADDLER, Receiver, Service, events};

const TOKEN: &str = "correct-horse-battery-staple";

#[test]
fn another_address_needs_a_token_or_an_explicit_wish() {
    let data = TempDir::new().unwrap();
    let refused = |token: Option<&str>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright"));
        command.args(["serve", "--listen", "0.0.0.0:0", "--data"]).arg(data.path());
        command.env_remove("GAITWRIGHT_TOKEN").envs(token.map(|token| ("GAITWRIGHT_TOKEN", token)));
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    let message = refused(None);
    for way in ["0.0.0.0", "GAITWRIGHT_TOKEN", "--insecure"] {
        assert!(message.contains(way), "{message}");
    }
    assert!(refused(Some("")).contains("empty"));
    let open = Service::with(&["--listen", "0.0.0.0:0", "--insecure"]);
    assert_eq!(open.curl("/v1/jobs", &[]).status, 200);
}

#[test]
fn a_token_opens_everything_but_the_probes() {
    let service = Service::with_token(TOKEN, &["--listen", "0.0.0.0:0"]);
    for path in ["/healthz", "/readyz"] {
        assert_eq!(service.curl(path, &[]).status, 200, "{path}");
    }
    let half = &TOKEN[..10];
    let longer = format!("{TOKEN}x");
    for path in ["/", "/v1/jobs", "/metrics", "/openapi.json", "/viewer/", "/nothing"] {
        let answer = service.curl(path, &[]);
        answer.problem(401);
        assert!(answer.headers.contains_key("www-authenticate"), "{path}");
        for wrong in [half, &longer, "", "correct-horse-battery-stapla"] {
            let header = format!("authorization: Bearer {wrong}");
            service.curl(path, &["-H", &header]).problem(401);
            service.curl(path, &["-u", &format!("anybody:{wrong}")]).problem(401);
        }
        service.curl(path, &["-H", &format!("authorization: {TOKEN}")]).problem(401);
    }
    let bearer = format!("authorization: Bearer {TOKEN}");
    for path in ["/", "/v1/jobs", "/metrics", "/openapi.json"] {
        assert_eq!(service.curl(path, &["-H", &bearer]).status, 200, "{path}");
        // A browser asks its user for a name and a password, and sends them with everything, events too.
        assert_eq!(service.curl(path, &["-u", &format!("anybody:{TOKEN}")]).status, 200, "{path}");
    }
    let body = json!({ "character": { "urdf": PADDLER } }).to_string();
    let post = |arguments: &[&str]| {
        let request = ["-H", "content-type: application/json", "-d", &body];
        service.curl("/v1/jobs", &[&request[..], arguments].concat())
    };
    post(&[]).problem(401);
    assert_eq!(post(&["-H", &bearer]).status, 202);
}

#[test]
fn a_service_answers_to_its_own_names_only() {
    let service = Service::with(&["--allow-host", "Robots.Example"]);
    let called = |host: &str| service.curl("/v1/jobs", &["-H", &format!("host: {host}")]);
    for host in [
        "localhost",
        "LOCALHOST:8080",
        "127.0.0.1",
        "127.0.0.1:1",
        "[::1]:80",
        "robots.example",
        "ROBOTS.example:443",
    ] {
        assert_eq!(called(host).status, 200, "{host}");
    }
    for host in [
        "evil.example",
        "evil.example:8080",
        "localhost.evil.example",
        "127.0.0.1.evil.example",
        "evil.example@localhost.evil.example",
        "192.0.2.7",
        "0.0.0.0",
    ] {
        called(host).problem(421);
    }
    // What is no name at all, or none (RFC 9112, section 3.2).
    called("a b").problem(400);
    // A page that was made to lead here has the origin that it names; that its two names agree proves nothing.
    let rebound = [
        "-H",
        "host: evil.example",
        "-H",
        "origin: http://evil.example",
        "-H",
        "sec-fetch-site: same-origin",
        "-X",
        "POST",
    ];
    service.curl("/v1/jobs", &rebound).problem(421);
    service.curl("/", &["-H", "host: evil.example"]).problem(421);
    service.curl("/healthz", &["-H", "host;"]).problem(400);
}

/// Sends `text` on a connection of its own, which stays open.
fn say(service: &Service, text: &str) -> TcpStream {
    let address = service.url("");
    let mut stream = TcpStream::connect(address.trim_start_matches("http://")).unwrap();
    stream.write_all(text.as_bytes()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream
}

/// The value of a figure without labels.
fn figure(service: &Service, name: &str) -> f64 {
    let text = service.curl("/metrics", &[]).text();
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' ')?.parse().ok());
    line.unwrap_or_default()
}

#[test]
fn half_sent_heads_give_way() {
    let service = Service::with(&["--connections", "16"]);
    let held: Vec<TcpStream> =
        (0..40).map(|_| say(&service, "GET /healthz HTTP/1.1\r\nhost: localhost\r\nx-slow:")).collect();
    for _ in 0..5 {
        assert_eq!(service.curl("/healthz", &[]).status, 200);
    }
    // Those that were not ended for others would have been by the time that a head may take.
    let ended = figure(&service, "gaitwright_connections_ended_total");
    assert!(ended >= 24.0, "{ended} gave way");
    for mut stream in held {
        let mut left = Vec::new();
        // The service closes it, with or without a word.
        let _ = stream.read_to_end(&mut left);
        assert!(!left.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&left));
    }
}

#[test]
fn an_answer_under_way_does_not_give_way() {
    let service = Service::with(&["--connections", "4"]);
    let path = service.post_job(&json!({ "generations": 100_000 }));
    service.wait(&path, "running", |job| job["state"] == "running");
    let stream = Receiver::start(&service.url(&format!("{path}/events")));
    for _ in 0..12 {
        say(&service, "GET /healthz HTTP/1.1\r\n");
        assert_eq!(service.curl("/healthz", &[]).status, 200);
    }
    service.cancel(&path);
    let events = events(&stream.finish());
    assert_eq!(events.last().unwrap().0, "end");
}

#[test]
fn an_answer_that_nobody_takes_is_given_up() {
    let service = Service::start();
    let mut stream = say(&service, "GET /viewer/re_viewer_bg.wasm HTTP/1.1\r\nhost: localhost\r\n\r\n");
    std::thread::sleep(Duration::from_secs(45));
    let mut taken = Vec::new();
    let _ = stream.read_to_end(&mut taken);
    let whole = service.curl("/viewer/re_viewer_bg.wasm", &[]).body.len();
    assert!(taken.len() < whole, "{} of {whole} bytes", taken.len());
}

#[test]
fn heads_have_an_end() {
    let service = Service::start();
    let head = format!("GET /healthz HTTP/1.1\r\nhost: localhost\r\nx-long: {}\r\n\r\n", "x".repeat(1 << 20));
    let mut stream = say(&service, "");
    // The service may close before it has read all.
    let _ = stream.write_all(head.as_bytes());
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    assert!(!answer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&answer));
}

#[test]
fn a_body_that_stops_coming_is_given_up() {
    let service = Service::start();
    let head = "POST /v1/jobs HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n\
        content-length: 1000\r\n\r\n{";
    let since = Instant::now();
    let mut stream = say(&service, head);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let answer = String::from_utf8_lossy(&answer);
    assert!(answer.starts_with("HTTP/1.1 408"), "{answer}");
    assert!(answer.contains("application/problem+json"), "{answer}");
    assert!(since.elapsed() < Duration::from_secs(40), "{:?}", since.elapsed());
}

#[test]
fn streams_are_counted() {
    let service = Service::with(&["--streams", "2"]);
    let path = service.post_job(&json!({ "generations": 100_000 }));
    service.wait(&path, "running", |job| job["state"] == "running");
    let events = format!("{path}/events");
    let streams: Vec<Receiver> = (0..2).map(|_| Receiver::start(&service.url(&events))).collect();
    for stream in [&events, &format!("{path}/recording.rrd")] {
        let answer = service.curl(stream, &["--max-time", "20"]);
        answer.problem(503);
        assert!(answer.headers["retry-after"].parse::<u32>().unwrap() > 0);
    }
    assert_eq!(service.json(&path)["state"], "running", "all else goes on");
    service.cancel(&path);
    for stream in streams {
        stream.finish();
    }
    // They have made room.
    assert_eq!(service.curl(&events, &[]).status, 200);
}

#[test]
fn lists_of_faults_and_request_ids_are_bounded() {
    let service = Service::start();
    let unknown: serde_json::Map<String, Value> =
        (0..250).map(|index| (format!("x{index}"), json!(1))).collect();
    let mut document = json!({ "character": { "urdf": PADDLER } });
    document.as_object_mut().unwrap().extend(unknown);
    let problem = service.post_json("/v1/jobs", &document).problem(422);
    assert_eq!(problem["errors"].as_array().unwrap().len(), 100);
    assert_eq!(problem["errors_left_out"], 150, "{problem}");
    assert!(problem["detail"].as_str().unwrap().ends_with("and 150 more"), "{problem}");
    let long = json!({ "x".repeat(1 << 20): 1, "character": { "urdf": PADDLER } });
    let answer = service.post_json("/v1/jobs", &long);
    answer.problem(422);
    assert!(answer.body.len() < 10_000, "{} bytes", answer.body.len());
    let few = service.post_json("/v1/jobs", &json!({ "x": 1 })).problem(422);
    assert!(few.get("errors_left_out").is_none(), "{few}");

    let id = |sent: &str| {
        service.curl("/healthz", &["-H", &format!("x-request-id: {sent}")]).headers["x-request-id"].clone()
    };
    assert_eq!(id("mine"), "mine");
    assert_eq!(id(&"m".repeat(128)), "m".repeat(128));
    for sent in ["m".repeat(129), "m".repeat(5000), "two words".to_owned()] {
        let given = id(&sent);
        assert_ne!(given, sent);
        assert!(given.len() <= 128);
    }
}
