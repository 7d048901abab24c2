//! Callers told apart, and what each may have of what all share.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::json;
use tempfile::TempDir;

use super::client::{Answer, PADDLER, Receiver, Service};

const ANNA: &str = "authorization: Bearer correct-horse-battery-staple";
const BERT: &str = "authorization: Bearer tr0ub4dor&3";

/// A service that knows two callers.
fn service(arguments: &[&str]) -> Service {
    let tokens = "anna=correct-horse-battery-staple,bert=tr0ub4dor&3";
    Service::with_environment(&[("GAITWRIGHT_TOKENS", tokens)], arguments)
}

fn assert_refused_for_now(answer: &Answer) {
    answer.problem(429);
    assert!(answer.headers["retry-after"].parse::<u32>().unwrap() > 0);
}

#[test]
fn requests_are_limited_by_caller() {
    let service = service(&["--request-rate", "1"]);
    let get = |header: &str| service.curl("/v1/jobs", &["-H", header]);
    // Ten at once; the time that they take may allow a few more.
    let answers: Vec<Answer> = (0..60).map(|_| get(ANNA)).collect();
    let allowed = answers.iter().take_while(|answer| answer.status == 200).count();
    assert!((10..60).contains(&allowed), "{allowed}");
    assert_refused_for_now(&answers[allowed]);
    assert_eq!(get(BERT).status, 200, "another caller is not held up");
    assert_eq!(service.curl("/healthz", &[]).status, 200);
    // Whoever tries tokens is a caller by the address.
    let tried: Vec<Answer> =
        (0..60).map(|number| get(&format!("authorization: Bearer wrong{number}"))).collect();
    let counted = tried.iter().take_while(|answer| answer.status == 401).count();
    assert!((10..60).contains(&counted), "{counted}");
    assert_refused_for_now(&tried[counted]);
}

#[test]
fn streams_are_shared_out() {
    let service = service(&["--streams", "3", "--caller-streams", "2"]);
    let body =
        json!({ "character": { "urdf": PADDLER }, "learning": { "generations": 100_000 } }).to_string();
    let posted = service.curl("/v1/jobs", &["-H", ANNA, "-H", "content-type: application/json", "-d", &body]);
    let path = posted.headers["location"].clone();
    let events = service.url(&format!("{path}/events"));
    let _streams: Vec<Receiver> = (0..2).map(|_| Receiver::with(&events, &["-H", ANNA])).collect();
    let follow = |header: &str| service.curl(&format!("{path}/events"), &["-H", header, "--max-time", "20"]);
    assert_refused_for_now(&follow(ANNA));
    let _other = Receiver::with(&events, &["-H", BERT]);
    follow(BERT).problem(503);
}

#[test]
fn simulations_are_shared_out() {
    let service = service(&["--simulations", "3", "--caller-simulations", "2"]);
    let simulation = |duration: f64, every: f64| {
        json!({ "character": { "urdf": PADDLER }, "duration": duration, "sample_every": every }).to_string()
    };
    // Nobody reads all of them, so that they go on.
    let long = simulation(1999.0, 0.01);
    let json = ["-H", "content-type: application/json", "-d"];
    let run = |header: &str, body: &str| {
        service.curl("/v1/simulations", &[&["-H", header][..], &json, &[body]].concat())
    };
    let hold = |header: &str| {
        Receiver::with(&service.url("/v1/simulations"), &[&["-H", header][..], &json, &[&long]].concat())
    };
    let held: Vec<Receiver> = (0..2).map(|_| hold(ANNA)).collect();
    let short = simulation(0.1, 0.1);
    assert_refused_for_now(&run(ANNA, &short));
    assert_eq!(run(BERT, &short).status, 200, "another caller has a place");
    let other = hold(BERT);
    assert_refused_for_now(&run(BERT, &short));
    held.into_iter().chain([other]).for_each(Receiver::leave);
}

/// Of large bodies a caller may send eight at once; the next waits until one of them is through or has been given up.
#[test]
fn large_bodies_wait_for_their_turns() {
    let service = service(&[]);
    let address = service.url("");
    let large = 300 << 10;
    let begin = |header: &str| {
        let mut stream = TcpStream::connect(address.trim_start_matches("http://")).unwrap();
        let head = format!(
            "POST /v1/characters HTTP/1.1\r\nhost: localhost\r\n{header}\r\nexpect: 100-continue\r\n\
             content-type: application/xml\r\ncontent-length: {large}\r\nconnection: close\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).unwrap();
        stream
    };
    // A server that is asked to says when it begins to read a body (RFC 9110, section 10.1.1).
    let is_read = |stream: &mut TcpStream, patience: Duration| {
        let expected = b"HTTP/1.1 100 Continue\r\n\r\n";
        let mut answer = [0; 25];
        stream.set_read_timeout(Some(patience)).unwrap();
        stream.read_exact(&mut answer).is_ok_and(|()| &answer == expected)
    };
    let (soon, long) = (Duration::from_secs(2), Duration::from_secs(30));
    let refused = |mut stream: TcpStream| {
        // No URDF, and refused for that as soon as it has been read.
        stream.write_all(&vec![b' '; large]).unwrap();
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).unwrap();
        assert_eq!(&answer, b"HTTP/1.1 400");
    };
    let mut held: Vec<TcpStream> = (0..8).map(|_| begin(ANNA)).collect();
    for stream in &mut held {
        assert!(is_read(stream, long), "one of eight is not read");
    }
    let mut ninth = begin(ANNA);
    assert!(!is_read(&mut ninth, soon), "a ninth is read");
    let mut another_callers = begin(BERT);
    assert!(is_read(&mut another_callers, long), "another caller waits");
    refused(another_callers);
    let small =
        service.curl("/v1/characters", &["-H", ANNA, "-H", "content-type: application/xml", "-d", "x"]);
    small.problem(400);
    drop(held.pop());
    assert!(is_read(&mut ninth, long), "a place is free");
    refused(ninth);
    refused(held.remove(0));
}

#[test]
fn a_browser_asks_for_name_and_password() {
    let service = service(&[]);
    let answer = service.curl("/", &[]);
    answer.problem(401);
    let challenges = service.curl("/", &["-u", "anybody:wrong"]).headers["www-authenticate"].clone();
    assert!(challenges.contains("Basic"), "{challenges}");
    for user in ["anna", "", "somebody else"] {
        let pair = format!("{user}:tr0ub4dor&3");
        assert_eq!(service.curl("/", &["-u", &pair]).status, 200, "{user}");
        assert_eq!(service.curl("/v1/jobs", &["-u", &pair]).status, 200, "{user}");
    }
    for odd in ["Basic", "Basic !!!", "Basic YW5uYQ==", "Bearer", "Digest x", "basic"] {
        service.curl("/", &["-H", &format!("authorization: {odd}")]).problem(401);
    }
}

#[test]
fn a_digest_stands_for_its_token() {
    let data = TempDir::new().unwrap();
    let file = data.path().join("settings.toml");
    // printf correct-horse-battery-staple | sha256sum
    let digest = "sha256:87cbebfeebc05f7c54ac9336c4b4bbec831227a641951a4bde7edd56020f8590";
    std::fs::write(&file, format!("[tokens]\nanna = \"{digest}\"\n")).unwrap();
    let service = Service::with(&["--config", file.to_str().unwrap()]);
    assert_eq!(service.curl("/v1/jobs", &["-H", ANNA]).status, 200);
    service.curl("/v1/jobs", &["-H", &format!("authorization: Bearer {digest}")]).problem(401);
    service.curl("/v1/jobs", &["-H", BERT]).problem(401);
}

#[test]
fn the_queue_is_shared_out() {
    let service = service(&["--queue", "3", "--caller-queue", "2"]);
    let post = |header: &str, key: &str| {
        let job = json!({ "character": { "urdf": PADDLER }, "learning": { "generations": 100_000 }, "priority": 1 });
        let (key, body) = (format!("idempotency-key: {key}"), job.to_string());
        let arguments = ["-H", header, "-H", &key, "-H", "content-type: application/json", "-d", &body];
        service.curl("/v1/jobs", &arguments)
    };
    let running = post(ANNA, "first");
    assert_eq!(running.status, 202, "{}", running.text());
    assert_eq!(running.json()["priority"], 1);
    let look = |path: &str| service.curl(path, &["-H", ANNA]).json();
    let path = &running.headers["location"];
    let since = std::time::Instant::now();
    while look(path)["state"] != "running" {
        assert!(since.elapsed().as_secs() < 180);
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    for key in ["second", "third"] {
        assert_eq!(post(ANNA, key).status, 202);
    }
    assert_refused_for_now(&post(ANNA, "fourth"));
    assert_eq!(&post(ANNA, "first").headers["location"], path, "the same job takes no place");
    // The same key of another caller is another key.
    let other = post(BERT, "first");
    assert_eq!(other.status, 202, "{}", other.text());
    assert_ne!(&other.headers["location"], path);
    assert_eq!(look(&other.headers["location"])["caller"], "token bert");
    assert_refused_for_now(&post(BERT, "second"));
}
