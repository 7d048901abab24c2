//! A job from its posting to its deletion.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::client::{PADDLER, PADDLER_PART, QUADRUPED, Receiver, Service, events};

#[test]
fn a_job_succeeds_and_leaves_everything() {
    let service = Service::start();
    let document = json!({ "character": { "urdf": QUADRUPED }, "seed": 7, "learning": { "generations": 2 },
        "task": { "gait": "trot", "froude": 0.4 } });
    let answer = service.post_json("/v1/jobs", &document);
    assert_eq!(answer.status, 202, "{}", answer.text());
    let path = answer.headers["location"].clone();
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    assert_eq!(job["progress"]["generations"], 2);
    assert_eq!(job["progress"]["fraction"], 1.0);
    assert_eq!(job["ended_by"], "generations");
    assert_eq!(job["seed"], 7);
    assert!(job["learning"]["transition_time"].as_f64().unwrap() > 0.0, "what was left open is decided");
    assert!(job["effects"]["gravity"]["on"].as_bool().unwrap());
    assert!(!job["effects"]["gravity"]["because"].as_str().unwrap().is_empty());

    // Every link leads to something.
    let links = job["links"].as_object().unwrap();
    for (name, link) in links.iter().filter(|(name, _)| *name != "viewer") {
        assert_eq!(service.curl(link.as_str().unwrap(), &[]).status, 200, "{name}");
    }
    let link = |name: &str| links[name].as_str().unwrap();

    let motion = service.json(link("motion"));
    assert_eq!(motion["format"], "gaitwright/motion@1");
    assert_eq!(motion["joints"].as_array().unwrap().len(), 12);
    assert_eq!(motion["metrics"], job["metrics"]);
    assert_eq!(service.json(link("gait"))["format"], "gaitwright/gait@1");
    let report = service.json(link("report"));
    assert_eq!(report["format"], "gaitwright/report@1");
    assert_eq!(report["reproducible"], true);
    assert_eq!(report["metrics"], job["metrics"]);
    // The repertoire, and each motion of it.
    let motions = service.json(link("motions"));
    assert_eq!((&motions["format"], &motions["motion"]), (&json!("gaitwright/motions@1"), &json!(1)));
    assert_eq!(motions["motions"][0]["name"], "trot");
    assert_eq!(motions["motions"][0]["metrics"], job["metrics"]);
    assert_eq!(job["motions"][0]["natural"], job["metrics"]["natural"]);
    let first = format!("{}/1", link("motions"));
    assert_eq!(service.json(&first), motion);
    assert_eq!(service.json(&format!("{first}/gait")), service.json(link("gait")));
    let glb = service.curl(&format!("{first}.glb"), &[]);
    assert_eq!((glb.status, &*glb.headers["content-type"]), (200, "model/gltf-binary"));
    for absent in ["2", "0", "+1", "01", "01.glb", "1.obj", "walk"] {
        service.curl(&format!("{}/{absent}", link("motions")), &[]).problem(404);
    }
    let diagram = service.curl(link("diagram"), &[]);
    assert_eq!(diagram.headers["content-type"], "image/svg+xml");
    assert!(diagram.text().contains("<svg"));

    // The curve as JSON and as CSV.
    let curve = service.json(link("curve"));
    let points = curve["points"].as_array().unwrap();
    assert_eq!(points.len(), 2);
    for (accept, kind) in [
        ("text/csv;q=0", "application/json"),
        ("text/csv;q=0.5, application/json", "application/json"),
        ("application/json;q=0.5, Text/CSV", "text/csv"),
        ("text/*", "text/csv"),
        ("*/*", "application/json"),
    ] {
        let answer = service.curl(link("curve"), &["-H", &format!("accept: {accept}")]);
        assert!(answer.headers["content-type"].starts_with(kind), "{accept}");
    }
    let table = service.curl(link("curve"), &["-H", "accept: text/csv"]);
    assert!(table.headers["content-type"].starts_with("text/csv"));
    let table = table.text();
    let rows: Vec<Vec<&str>> = table.lines().map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 3);
    let best = rows[0].iter().position(|name| *name == "best").unwrap();
    assert_eq!(rows[2][best].parse::<f64>().unwrap(), points[1]["best"].as_f64().unwrap());

    // Events of a job that is over: its whole curve, then the end; or what follows a given event.
    let told = events(&service.curl(link("events"), &[]).body);
    let kinds: Vec<&str> = told.iter().map(|(kind, _)| kind.as_str()).collect();
    assert_eq!(kinds, ["generation", "generation", "end"]);
    assert_eq!(told[0].1, points[0]);
    assert_eq!(told[2].1, job);
    let told = events(&service.curl(link("events"), &["-H", "last-event-id: 0"]).body);
    assert_eq!(told.len(), 2);
    assert_eq!(told[0].1["generation"], 1);

    // Deleted, it is gone with its files.
    assert!(service.folder(&path).is_dir());
    assert_eq!(service.curl(&path, &["-X", "DELETE"]).status, 204);
    service.curl(&path, &[]).problem(404);
    assert!(!service.folder(&path).exists());
}

#[test]
fn a_finished_recording_is_served_in_ranges() {
    let service = Service::start();
    let path = service.post_job(&json!({ "generations": 1 }));
    service.wait_for_end(&path);
    let place = format!("{path}/recording.rrd");
    let whole = service.curl(&place, &[]);
    assert_eq!(whole.status, 200);
    assert_eq!(whole.headers["accept-ranges"], "bytes");
    assert_eq!(&whole.body[..4], b"RRF2");
    assert_eq!(whole.body, std::fs::read(service.folder(&path).join("recording.rrd")).unwrap());

    let part = service.curl(&place, &["-H", "range: bytes=100-199"]);
    assert_eq!(part.status, 206);
    assert_eq!(part.headers["content-range"], format!("bytes 100-199/{}", whole.body.len()));
    assert_eq!(part.body, whole.body[100..200]);
    let tail = service.curl(&place, &["-H", "range: bytes=-10"]);
    assert_eq!(tail.body, whole.body[whole.body.len() - 10..]);
    let detail = service.curl(&place, &["-H", "range: bytes=999999999-"]).problem(416)["detail"].clone();
    let detail = detail.as_str().unwrap();
    assert!(detail.contains("bytes=999999999-"), "{detail}");
    assert!(detail.ends_with(&format!("has {} bytes", whole.body.len())), "{detail}");
    let modified = "Thu, 01 Jan 1970 00:00:00 GMT";
    for (name, condition) in [("If-Match", "\"another\""), ("If-Unmodified-Since", modified)] {
        let answer = service.curl(&place, &["-H", &format!("{name}: {condition}")]);
        let detail = answer.problem(412)["detail"].clone();
        let detail = detail.as_str().unwrap();
        assert!(detail.starts_with(name) && detail.ends_with(condition), "{detail}");
    }
    service.curl(&place, &["-H", "range: bytes=99999999999999999999-"]).problem(416);
    assert_eq!(service.curl(&place, &["-H", "range: BYTES=0100-0199"]).body, whole.body[100..200]);
    // What is not one range of bytes is passed over.
    for range in ["items=0-5", "bytes=abc", "bytes=-", "bytes=9-5", "bytes=0-1,4-5", "bytes", "bytes=1-x"] {
        let answer = service.curl(&place, &["-H", &format!("range: {range}")]);
        assert_eq!((answer.status, answer.body.len()), (200, whole.body.len()), "{range}");
    }

    // A range of another version is of no use; one of this version is.
    let other = "if-range: \"0-0\"";
    assert_eq!(service.curl(&place, &["-H", "range: bytes=0-9", "-H", other]).status, 200);
    let (tag, time) = (&whole.headers["etag"], &whole.headers["last-modified"]);
    for (validator, status) in [
        (tag.clone(), 206),
        (time.clone(), 206),
        (format!("W/{tag}"), 200),
        ("Thu, 01 Jan 1970 00:00:00 GMT".to_owned(), 200),
    ] {
        let header = format!("if-range: {validator}");
        let answer = service.curl(&place, &["-H", "range: bytes=0-9", "-H", &header]);
        assert_eq!(answer.status, status, "{validator}");
    }

    let tag = format!("if-none-match: {}", whole.headers["etag"]);
    assert_eq!(service.curl(&place, &["-H", &tag]).status, 304);
    assert_eq!(service.curl(&place, &["-I"]).headers["content-length"], whole.body.len().to_string());
}

#[test]
fn a_running_job_is_followed_and_cancelled() {
    let service = Service::start();
    let path = service.post_job(&json!({ "generations": 100_000 }));
    let stream = Receiver::start(&service.url(&format!("{path}/events")));
    let recording = Receiver::start(&service.url(&format!("{path}/recording.rrd")));
    service.wait(&path, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 3);
    service.curl(&format!("{path}/motion"), &[]).problem(409);
    let head = service.curl(&format!("{path}/recording.rrd"), &["-I"]);
    assert_eq!(head.headers["accept-ranges"], "none");
    assert!(!head.headers.contains_key("content-length"), "nobody knows how much there will be");
    for _ in 0..10 {
        assert_eq!(service.curl("/healthz", &[]).status, 200);
        assert_eq!(service.curl("/v1/jobs", &[]).status, 200);
    }

    let answer = service.cancel(&path);
    assert_eq!(answer.status, 202);
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "cancelled");
    assert_eq!(job["ended_by"], "cancelled");

    // The events end with the job, and have missed none of its generations.
    let told = events(&stream.finish());
    let (last, others) = told.split_last().unwrap();
    assert_eq!(last.0, "end");
    assert_eq!(last.1["state"], "cancelled");
    let generations: Vec<u64> = others
        .iter()
        .filter(|(kind, _)| kind == "generation")
        .map(|(_, figures)| figures["generation"].as_u64().unwrap())
        .collect();
    assert!(generations.len() >= 3);
    assert!(generations.iter().copied().eq(0..generations.len() as u64), "{generations:?}");
    assert_eq!(service.json(&format!("{path}/curve"))["points"].as_array().unwrap().len(), generations.len());

    // The recording that was followed while it grew is the one that is left. A request from before
    // the job was taken up is told so instead.
    let followed = recording.finish();
    if !followed.starts_with(b"{") {
        assert_eq!(followed, std::fs::read(service.folder(&path).join("recording.rrd")).unwrap());
    }
}

#[test]
fn a_growing_recording_is_followed_to_its_end() {
    let service = Service::start();
    let path = service.post_job(&json!({ "generations": 12 }));
    service.wait(&path, "running", |job| job["state"] != "queued");
    let followed = Receiver::start(&service.url(&format!("{path}/recording.rrd"))).finish();
    service.wait_for_end(&path);
    assert_eq!(followed, service.curl(&format!("{path}/recording.rrd"), &[]).body);
}

/// Learning that would take hours for its first individual, nearly all of it with transitions that are known.
fn tireless() -> Value {
    json!({ "generations": 5, "episodes": 100_000, "episode_length": 100_000 })
}

#[test]
fn a_job_keeps_to_its_time_whatever_it_is_about() {
    let service = Service::start();
    let mut learning = tireless();
    learning["seconds"] = json!(1.0);
    let path = service.post_job(&learning);
    service.wait(&path, "learning", |job| job["stage"] == "learning");
    let since = Instant::now();
    let job = service.wait_for_end(&path);
    assert!(since.elapsed() < Duration::from_secs(5), "{:?}", since.elapsed());
    assert_eq!(job["ended_by"], "seconds");
}

#[test]
fn a_job_is_cancelled_within_a_second_whatever_it_is_about() {
    let service = Service::start();
    let chain = json!({ "accuracy": { "tolerance": 1e-4 } });
    let file = |name: &str| std::fs::read_to_string(crate::common::example_path(name)).unwrap();
    let snake: serde_json::Value = serde_json::from_str(&file("snake.json")).unwrap();
    for (character, learning, settings, stage) in [
        (json!({ "urdf": PADDLER }), tireless(), json!({}), "learning"),
        (json!({ "urdf": chain_urdf(50) }), json!({}), chain, "standing"),
        (json!({ "urdf": file("biped.urdf") }), json!({}), json!({}), "learning"),
        (json!({ "json": snake }), json!({}), json!({}), "learning"),
    ] {
        let mut document = json!({ "character": character, "learning": learning });
        document.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
        let answer = service.post_json("/v1/jobs", &document);
        assert_eq!(answer.status, 202, "{}", answer.text());
        let path = &answer.headers["location"];
        service.wait(path, stage, |job| job["stage"] == stage);
        std::thread::sleep(Duration::from_millis(300));
        let since = Instant::now();
        assert_eq!(service.cancel(path).status, 202);
        assert_eq!(service.wait_for_end(path)["state"], "cancelled", "{stage}");
        // A second, and as much again for a busy machine.
        assert!(since.elapsed() < Duration::from_secs(2), "{stage}: {:?}", since.elapsed());
    }
}

/// A chain of `links` balls on hinges.
fn chain_urdf(links: usize) -> String {
    let ball = "<inertial><mass value=\"0.1\"/><inertia ixx=\"1e-4\" ixy=\"0\" ixz=\"0\" iyy=\"1e-4\" iyz=\"0\" \
        izz=\"1e-4\"/></inertial><collision><geometry><sphere radius=\"0.02\"/></geometry></collision>";
    let link = |index: usize| format!("<link name=\"l{index}\">{ball}</link>");
    let joint = |index: usize| {
        let parent = index - 1;
        format!(
            "<joint name=\"j{index}\" type=\"revolute\"><parent link=\"l{parent}\"/><child link=\"l{index}\"/>\
             <origin xyz=\"0.06 0 0\"/><axis xyz=\"0 0 1\"/>\
             <limit lower=\"-1\" upper=\"1\" effort=\"5\" velocity=\"5\"/></joint>"
        )
    };
    let links_text: String = (0..links).map(link).collect();
    let joints: String = (1..links).map(joint).collect();
    format!("<robot name=\"chain\">{links_text}{joints}</robot>")
}

#[test]
fn a_waiting_job_is_cancelled_at_once() {
    let service = Service::start();
    let first = service.post_job(&json!({ "generations": 100_000 }));
    service.wait(&first, "running", |job| job["state"] == "running");
    let second = service.post_job(&json!({ "generations": 1 }));
    service.curl(&format!("{second}/recording.rrd"), &[]).problem(409);
    let answer = service.cancel(&second);
    assert_eq!(answer.status, 202);
    assert_eq!(answer.json()["state"], "cancelled");
    let told = events(&service.curl(&format!("{second}/events"), &[]).body);
    assert_eq!(told.len(), 1);
    assert_eq!(told[0].0, "end");
}

#[test]
fn jobs_are_listed_page_by_page() {
    let service = Service::start();
    let first = service.post_job(&json!({ "generations": 100_000 }));
    service.wait(&first, "running", |job| job["state"] == "running");
    let mut posted = vec![first];
    posted.extend((0..4).map(|_| service.post_job(&json!({ "generations": 1 }))));
    assert_eq!(service.cancel(&posted[4]).status, 202);

    let mut seen = Vec::new();
    let mut next = Some("/v1/jobs?limit=2".to_owned());
    while let Some(page) = next {
        let page = service.json(&page);
        let jobs = page["jobs"].as_array().unwrap();
        assert!((1..=2).contains(&jobs.len()));
        seen.extend(jobs.iter().map(|job| job["links"]["self"].as_str().unwrap().to_owned()));
        next = page["next"].as_str().map(str::to_owned);
    }
    assert!(seen.iter().eq(posted.iter().rev()), "the newest first, each once: {seen:?}");

    let states = |state: &str| -> BTreeSet<String> {
        let page = service.json(&format!("/v1/jobs?state={state}"));
        page["jobs"].as_array().unwrap().iter().map(|job| job["state"].as_str().unwrap().to_owned()).collect()
    };
    for state in ["running", "queued", "cancelled"] {
        assert_eq!(states(state), BTreeSet::from([state.to_owned()]));
    }
    assert!(states("failed").is_empty());
    let metrics = service.curl("/metrics", &[]).text();
    assert!(metrics.contains("gaitwright_jobs{state=\"queued\"} 3"), "{metrics}");
    assert!(metrics.contains("gaitwright_jobs{state=\"running\"} 1"), "{metrics}");
}

#[test]
fn a_form_brings_character_and_settings() {
    let service = Service::start();
    let job = r#"job={"seed":3,"learning":{"generations":1,"population":4,"trunk":"locked"}}"#;
    let answer = service.curl("/v1/jobs", &["-F", PADDLER_PART, "-F", job]);
    assert_eq!(answer.status, 202, "{}", answer.text());
    let job: Value = service.wait_for_end(&answer.headers["location"]);
    assert_eq!(job["seed"], 3);
    assert_eq!(job["effects"]["trunk_rotation_lock"]["on"], true);
    assert_eq!(job["progress"]["generations"], 1);
}

/// How far a job is can be seen long before its first generation is whole: from the candidates that it has tried.
#[test]
fn candidates_are_counted_as_they_are_tried() {
    let service = Service::start();
    let path = service.post_job(&json!({ "population": 2000, "generations": 1 }));
    let stream = Receiver::start(&service.url(&format!("{path}/events")));
    let tried = |job: &Value| job["progress"]["evaluations"].as_u64().unwrap();
    let first = service.wait(&path, "trying", |job| tried(job) > 0);
    let second = service.wait(&path, "trying more", |job| tried(job) > tried(&first));
    assert_eq!(second["progress"]["generations"], 0, "{second}");
    assert_eq!(second["state"], "running");
    // Those who follow are told once a second.
    std::thread::sleep(Duration::from_millis(2500));
    service.cancel(&path);
    let told = events(&stream.finish());
    let of =
        |kind: &str| told.iter().filter(|(found, _)| found == kind).map(|(_, data)| data).collect::<Vec<_>>();
    let counts: Vec<u64> = of("progress").iter().map(|data| data["evaluations"].as_u64().unwrap()).collect();
    assert!(counts.len() >= 2 && counts.windows(2).all(|pair| pair[0] < pair[1]), "{counts:?}");
    assert!(of("generation").is_empty());
}

/// What a job's time was spent on is all of its time, and what checks motions between two generations is no learning.
#[test]
fn the_times_of_a_job_add_up() {
    let service = Service::start();
    let path = service.post_two_gaits();
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    let timings = &job["timings"];
    let spent = |name: &str| timings[name].as_f64().unwrap();
    let at = |name: &str| timings[name].as_str().unwrap().parse::<jiff::Timestamp>().unwrap();
    let whole = at("ended").duration_since(at("started")).as_secs_f64();
    let told = spent("standing_seconds") + spent("learning_seconds") + spent("checking_seconds");
    assert!(told <= whole && told > 0.9 * whole - 0.5, "{told} s of {whole} s: {timings}");
    for part in ["standing_seconds", "learning_seconds", "checking_seconds"] {
        assert!(spent(part) > 0.0, "{timings}");
    }
    // Every motion shown is played for as long as a finished one.
    assert!(spent("checking_seconds") > 0.05 * whole, "{timings}");
}
