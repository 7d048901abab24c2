//! Hostile and mistaken inputs: each is refused with its place, and the service goes on.

use serde_json::{Value, json};

use super::client::{Answer, PADDLER, PADDLER_PART, QUADRUPED, Service};

/// The pointers of a problem document, all of them.
fn pointers(problem: &Value) -> Vec<String> {
    let errors = problem["errors"].as_array().unwrap();
    assert_eq!(problem["pointer"], errors[0]["pointer"]);
    errors.iter().map(|error| error["pointer"].as_str().unwrap().to_owned()).collect()
}

fn assert_goes_on(service: &Service) {
    assert_eq!(service.curl("/healthz", &[]).status, 200);
}

fn post_urdf(service: &Service, urdf: &str) -> Answer {
    let answer = service.post("/v1/jobs", "application/xml", urdf.as_bytes());
    assert_goes_on(service);
    answer
}

#[test]
fn faulty_urdf() {
    let service = Service::start();
    // What is replaced in a sound character, by what; the status; what the place has to name.
    let cases = [
        ("xyz=\"0.1 0.18 0\"", "xyz=\"0.1 NaN 0\"", 422, "left_hinge"),
        ("<mass value=\"2\"/>", "<mass value=\"-2\"/>", 422, "plate"),
        (
            "<parent link=\"plate\"/><child link=\"left\"/>",
            "<parent link=\"left\"/><child link=\"left\"/>",
            422,
            "left",
        ),
        (
            "<parent link=\"plate\"/><child link=\"left\"/>",
            "<parent link=\"right\"/><child link=\"right\"/>",
            422,
            "right",
        ),
        ("<link name=\"right\">", "<link name=\"left\">", 422, "left"),
        ("name=\"left_hinge\"", "name=\"right_hinge\"", 422, "right_hinge"),
        ("type=\"revolute\"", "type=\"rubber\"", 422, "left_hinge"),
        ("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>", 422, "left_hinge"),
        ("</robot>", "</robot", 400, "line"),
    ];
    for (sound, faulty, status, place) in cases {
        let answer = post_urdf(&service, &PADDLER.replacen(sound, faulty, 1));
        let problem = answer.problem(status);
        let pointers = pointers(&problem);
        assert!(
            pointers.iter().any(|pointer| pointer.contains("line") && pointer.contains(place)),
            "{faulty}: {problem}"
        );
    }
}

#[test]
fn two_roots() {
    let service = Service::start();
    let urdf = PADDLER.replace("</robot>", "<link name=\"stray\"/></robot>");
    let problem = post_urdf(&service, &urdf).problem(422);
    assert!(problem["detail"].as_str().unwrap().contains("stray"), "{problem}");
}

/// What shows only touches nothing; where there is no ground, nothing has to.
#[test]
fn a_job_for_a_character_without_collision_shapes() {
    let service = Service::start();
    let urdf = PADDLER.replace("<collision", "<visual").replace("</collision", "</visual");
    let problem = post_urdf(&service, &urdf).problem(422);
    assert_eq!(pointers(&problem), ["/character"]);
    assert!(problem["detail"].as_str().unwrap().contains("collision shapes"), "{problem}");
    let floating = json!({ "format": "gaitwright/job@1", "character": { "urdf": urdf },
        "scene": { "ground": null }, "learning": { "generations": 1, "population": 4 } });
    let answer = service.post("/v1/jobs", "application/json", floating.to_string().as_bytes());
    assert_eq!(answer.status, 202, "{}", answer.text());
}

#[test]
fn every_fault_of_a_urdf_is_told() {
    let service = Service::start();
    let urdf = PADDLER.replacen("<mass value=\"2\"/>", "<mass value=\"-2\"/>", 1).replacen(
        "xyz=\"0.1 0.18 0\"",
        "xyz=\"0.1 inf 0\"",
        1,
    );
    let problem = post_urdf(&service, &urdf).problem(422);
    let pointers = pointers(&problem);
    assert!(pointers.iter().any(|pointer| pointer.contains("plate")), "{problem}");
    assert!(pointers.iter().any(|pointer| pointer.contains("left_hinge")), "{problem}");
}

#[test]
fn deeply_nested_urdf() {
    let service = Service::start();
    let urdf = format!("<robot name=\"deep\">{}{}</robot>", "<a>".repeat(4000), "</a>".repeat(4000));
    assert!(urdf.len() < 30_000);
    let answer = post_urdf(&service, &urdf);
    assert!([400, 413, 422].contains(&answer.status), "{}", answer.text());
    let problem = answer.problem(answer.status);
    assert!(pointers(&problem)[0].contains("line"), "{problem}");
}

#[test]
fn deeply_nested_json() {
    let service = Service::start();
    let document = format!("{{\"character\":{}{}}}", "[".repeat(20_000), "]".repeat(20_000));
    let problem = service.post("/v1/jobs", "application/json", document.as_bytes()).problem(400);
    assert!(pointers(&problem)[0].contains("line 1"), "{problem}");
    assert_goes_on(&service);
}

#[test]
fn ten_megabytes_of_rubbish() {
    let service = Service::start();
    // A linear congruential generator (Knuth), for bytes without any order.
    let mut state = 1_u64;
    let rubbish: Vec<u8> = std::iter::repeat_with(|| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    })
    .take(10_000_000)
    .collect();
    for path in ["/v1/jobs", "/v1/characters"] {
        for media_type in ["application/json", "application/xml", "application/zip"] {
            let answer = service.post(path, media_type, &rubbish);
            assert!([400, 413].contains(&answer.status), "{media_type}: {}", answer.text());
            answer.problem(answer.status);
            assert_goes_on(&service);
        }
    }
    service.post("/v1/jobs", "application/octet-stream", &rubbish).problem(415);
    assert_goes_on(&service);
}

#[test]
fn more_than_is_taken() {
    let service = Service::start();
    let body = vec![b' '; 33 << 20];
    let problem = service.post("/v1/characters", "application/json", &body).problem(413);
    assert!(problem["detail"].as_str().unwrap().contains("33554432 bytes"), "{problem}");
    let mut form = tempfile::NamedTempFile::new().unwrap();
    std::io::Write::write_all(&mut form, &body).unwrap();
    let part = format!("character=@{}", form.path().display());
    let problem = service.curl("/v1/characters", &["-F", &part]).problem(413);
    assert!(problem["detail"].as_str().unwrap().contains("33554432 bytes"), "{problem}");
    assert_goes_on(&service);
}

#[test]
fn job_documents() {
    let service = Service::start();
    let character = json!({ "urdf": PADDLER });
    let cases = [
        (json!({ "character": character, "sede": 1 }), vec!["/sede"]),
        (json!({ "character": character, "learning": { "generation": 2 } }), vec!["/learning/generation"]),
        (json!({ "character": character, "scene": { "friction": -1 } }), vec!["/scene/friction"]),
        (json!({ "character": character, "format": "gaitwright/job@9" }), vec!["/format"]),
        (json!({ "character": character, "seed": -1 }), vec!["/seed"]),
        (json!({ "seed": 1 }), vec!["/character"]),
        (
            json!({ "character": character, "scene": { "effects": { "trunk_rotation_lock": "off" } },
                "learning": { "trunk": "locked" } }),
            vec!["/scene/effects/trunk_rotation_lock", "/learning/trunk"],
        ),
        (
            json!({ "character": character, "task": { "direction": [1e308, 1e308, 0], "speed": 1e308,
                "weights": { "energy": 1e308 } } }),
            vec!["/task/direction", "/task/speed", "/task/weights/energy"],
        ),
        (
            json!({ "character": { "id": "01890000-0000-7000-8000-000000000000" }, "learning": { "generations": 0 } }),
            vec!["/character/id", "/learning/generations"],
        ),
        (
            json!({ "character": { "json": { "format": "gaitwright/character@1", "legs": 4 } } }),
            vec!["/character/json"],
        ),
        (json!({ "character": { "path": "/etc/passwd" } }), vec!["/character"]),
        (
            json!({ "character": character, "scene": { "friction": -1 }, "accuracy": { "step": 7 },
                "learning": { "seconds": -1.0 }, "task": { "direction": [0, 0, 0] } }),
            vec!["/scene/friction", "/accuracy/step", "/learning/seconds", "/task/direction"],
        ),
        (
            json!({ "character": character, "sede": 1, "seed": -1, "scene": { "friction": -1 },
                "learning": { "generations": 0 } }),
            vec!["/sede", "/seed", "/scene/friction", "/learning/generations"],
        ),
        (json!({ "seed": -1, "accuracy": { "step": 7 } }), vec!["/character", "/seed", "/accuracy/step"]),
        (
            json!({ "character": { "urdf": PADDLER.replace("\"2\"", "\"-2\"") }, "accuracy": { "step": 7 } }),
            vec!["/character/urdf: line 4, link \"plate\"", "/accuracy/step"],
        ),
    ];
    for (document, places) in cases {
        let problem = service.post_json("/v1/jobs", &document).problem(422);
        let pointers = pointers(&problem);
        for place in places {
            assert!(pointers.iter().any(|pointer| pointer.starts_with(place)), "{place}: {problem}");
        }
    }
    let problem = service.post("/v1/jobs", "application/json", b"[]").problem(422);
    assert_eq!(pointers(&problem), [""]);
    let problem = service.post("/v1/jobs", "application/json", b"{\"character\": }").problem(400);
    assert_eq!(pointers(&problem), ["line 1, column 15"]);
    assert_goes_on(&service);
}

/// Whatever is wrong with the character does not hide what else is.
#[test]
fn scenarios_with_several_faults() {
    let service = Service::start();
    let scenario =
        json!({ "character": { "urdf": "<robot/>" }, "duration": -1, "scene": { "friction": -2 } });
    let problem = service.post_json("/v1/simulations", &scenario).problem(422);
    let places = pointers(&problem);
    for place in ["/character", "/duration", "/scene/friction"] {
        assert!(places.iter().any(|pointer| pointer.starts_with(place)), "{place}: {problem}");
    }
    let study = json!({ "scenario": scenario, "tolerances": [0.0, 1e-3, -1.0], "tolerence": 1 });
    let problem = service.post_json("/v1/accuracy", &study).problem(422);
    let places = pointers(&problem);
    for place in ["/tolerence", "/scenario/duration", "/tolerances/2"] {
        assert!(places.iter().any(|pointer| pointer == place), "{place}: {problem}");
    }
    let study = json!({ "scenario": scenario, "tolerances": [0.0, 1e-3, -1.0] });
    let problem = service.post_json("/v1/accuracy", &study).problem(422);
    let places = pointers(&problem);
    for place in [
        "/scenario/character",
        "/scenario/duration",
        "/scenario/scene/friction",
        "/tolerances/0",
        "/tolerances/2",
    ] {
        assert!(places.iter().any(|pointer| pointer.starts_with(place)), "{place}: {problem}");
    }
}

#[test]
fn values_of_the_wrong_type() {
    let service = Service::start();
    let character = json!({ "urdf": PADDLER });
    let simulate = |field: &str, value: Value| {
        let document = json!({ "character": character, "duration": 0.01, field: value });
        pointers(&service.post_json("/v1/simulations", &document).problem(422))
    };
    assert_eq!(simulate("scene", json!({ "effects": { "gravity": true } })), ["/scene/effects/gravity"]);
    assert_eq!(simulate("scene", json!({ "gravity": [0, 0, -9.81, 0] })), ["/scene/gravity"]);
    assert_eq!(simulate("drive", json!({ "kind": "hold", "max_torque": "foo" })), ["/drive/max_torque"]);
    assert_eq!(simulate("character", json!({ "foo": 1 })), ["/character/foo"]);
    assert_eq!(simulate("scene", json!({ "ground": { "kind": 0 } })), ["/scene/ground/kind"]);
    assert_eq!(simulate("drive", json!({ "kind": 0 })), ["/drive/kind"]);
    assert_goes_on(&service);
}

#[test]
fn bodies_that_are_not_what_they_are_said_to_be() {
    let service = Service::start();
    for path in ["/v1/jobs", "/v1/characters"] {
        service.post(path, "application/xml", b" {\"links\": []}").problem(415);
        service.post(path, "text/xml", b"PK\x03\x04").problem(415);
        service.post(path, "application/zip", PADDLER.as_bytes()).problem(415);
    }
    assert_eq!(service.post("/v1/characters", "Application/XML", PADDLER.as_bytes()).status, 201);
    assert_goes_on(&service);
}

#[test]
fn compressed_bodies() {
    let service = Service::start();
    let post = |coding: &str, body: &[u8]| {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), body).unwrap();
        let data = format!("@{}", file.path().display());
        let coding = format!("content-encoding: {coding}");
        let xml = "content-type: application/xml";
        service.curl("/v1/characters", &["-H", xml, "-H", &coding, "--data-binary", &data])
    };
    let gzip = |body: &[u8]| {
        use std::io::Write;
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(body).unwrap();
        encoder.finish().unwrap()
    };
    assert_eq!(post("gzip", &gzip(PADDLER.as_bytes())).status, 201);
    assert_eq!(post("identity", PADDLER.as_bytes()).status, 201);
    post("gzip", PADDLER.as_bytes()).problem(400);
    // What counts is what comes out.
    let bomb = gzip(&vec![b' '; 40 << 20]);
    assert!(bomb.len() < 1 << 20);
    post("gzip", &bomb).problem(413);
    let answer = post("br", PADDLER.as_bytes());
    let detail = answer.problem(415)["detail"].clone();
    assert!(detail.as_str().unwrap().contains("coding br"), "{detail}");
    assert_eq!(answer.headers["accept-encoding"], "gzip");
    assert_goes_on(&service);
}

#[test]
fn forms() {
    let service = Service::start();
    let post = |parts: &[&str]| {
        let arguments: Vec<&str> = parts.iter().flat_map(|part| ["-F", part]).collect();
        service.curl("/v1/jobs", &arguments)
    };
    assert_eq!(pointers(&post(&["job={}"]).problem(422)), ["part \"character\""]);
    assert_eq!(pointers(&post(&[PADDLER_PART, "jab={}"]).problem(422)), ["part \"jab\""]);
    assert_eq!(pointers(&post(&[PADDLER_PART, "job={\"sede\":1}"]).problem(422)), ["/sede"]);
    // Both parts have lines, and either may be a JSON document: what is wrong says in which of them.
    let rest = "job={\"learning\":{\"seconds\":-1.0}}";
    let cases: [(&[&str], u16, &[&str]); 5] = [
        (&[PADDLER_PART, "job={\"a\": }"], 400, &["part \"job\": line 1, column 7"]),
        (&[PADDLER_PART, "job=[]"], 422, &["part \"job\""]),
        (&["character={\"a\": }", "job={}"], 400, &["/character: line 1, column 7"]),
        (&["character=neither", "job={}"], 400, &["/character: line 1"]),
        (&["character={\"name\":\"x\",\"joints\":1}", rest], 422, &["/character", "/learning/seconds"]),
    ];
    for (parts, status, places) in cases {
        let pointers = pointers(&post(parts).problem(status));
        for place in places {
            assert!(pointers.iter().any(|pointer| pointer.starts_with(place)), "{parts:?}: {pointers:?}");
        }
        assert!(pointers.iter().all(|pointer| places.iter().any(|place| pointer.starts_with(place))));
    }
    service.post("/v1/jobs", "multipart/form-data", b"no boundary").problem(400);
    assert_goes_on(&service);
}

#[test]
fn routes_methods_and_queries() {
    let service = Service::start();
    service.curl("/v2/jobs", &[]).problem(404);
    service.curl("/v1/jobs/not-an-id", &[]).problem(404);
    service.curl("/v1/jobs/01890000-0000-7000-8000-000000000000", &[]).problem(404);
    service.curl("/v1/jobs/01890000-0000-7000-8000-000000000000", &["-X", "DELETE"]).problem(404);
    service.curl("/v1/jobs/01890000-0000-7000-8000-000000000000/recording.rrd", &[]).problem(404);
    service.curl("/v1/characters/01890000-0000-7000-8000-000000000000", &[]).problem(404);
    let answer = service.curl("/v1/jobs", &["-X", "PUT"]);
    answer.problem(405);
    assert!(answer.headers["allow"].contains("POST"));
    service.curl("/v1/jobs", &["-d", "seed=1"]).problem(415);
    let refused = |path: &str, query: &str, reason: &str| {
        let problem = service.curl(&format!("{path}?{query}"), &[]).problem(400);
        let (detail, name) = (problem["detail"].as_str().unwrap(), query.split('=').next().unwrap());
        assert!(detail.starts_with(&format!("{name}: ")) && detail.contains(reason), "{query}: {problem}");
    };
    for (query, reason) in [
        ("limit=0", "must lie between 1 and 200"),
        ("limit=many", "must be a whole number"),
        ("limit=", "must be a whole number"),
        ("state=lost", "expected one of `queued`"),
        ("after=yesterday", "UUID"),
        ("page=2", "unknown parameter `page`, expected one of `limit`"),
    ] {
        refused("/v1/jobs", query, reason);
    }
    let motion = "/v1/jobs/01890000-0000-7000-8000-000000000000/motion.glb";
    refused(motion, "fps=fast", "must be a number");
    refused(motion, "in_place=yes", "must be true or false");
    let job = "/v1/jobs/01890000-0000-7000-8000-000000000000";
    for path in [
        job,
        &format!("{job}/curve"),
        &format!("{job}/events"),
        &format!("{job}/character"),
        &format!("{job}/recording.rrd"),
    ] {
        refused(path, "bogus=1", "unknown parameter `bogus`, none is taken here");
        service.curl(&format!("{path}?"), &[]).problem(404);
    }
    service.curl(&format!("{job}/cancel?bogus=1"), &["-X", "POST"]).problem(400);
    service.post("/v1/jobs", "application/xml", b"").problem(400);
    let foreign =
        ["-H", "origin: http://elsewhere.example", "-H", "sec-fetch-site: cross-site", "-F", PADDLER_PART];
    service.curl("/v1/jobs", &foreign).problem(403);
}

#[test]
fn a_full_queue() {
    let service = Service::with(&["--queue", "1"]);
    let long = json!({ "generations": 100_000 });
    let running = service.post_job(&long);
    service.wait(&running, "running", |job| job["state"] == "running");
    service.post_job(&long);
    let answer =
        service.post_json("/v1/jobs", &json!({ "character": { "urdf": PADDLER }, "learning": long }));
    answer.problem(429);
    assert!(answer.headers["retry-after"].parse::<u32>().unwrap() > 0);
}

/// A gait that the character cannot have, or that there is not, is refused at once and by the field that asks for it.
#[test]
fn gaits_without_the_legs_for_them_are_refused() {
    let service = Service::start();
    let refused = [
        ("snake.json", "trot"),
        ("quadruped.urdf", "tripod"),
        ("quadruped.urdf", "moonwalk"),
        ("biped.urdf", "gallop"),
        ("hexapod.json", "walk"),
    ];
    for (name, gait) in refused {
        let text = std::fs::read_to_string(crate::common::example_path(name)).unwrap();
        let character = match name.ends_with(".json") {
            true => json!({ "json": serde_json::from_str::<serde_json::Value>(&text).unwrap() }),
            false => json!({ "urdf": text }),
        };
        let document = json!({ "character": character, "task": { "gait": gait } });
        let problem = service.post_json("/v1/jobs", &document).problem(422);
        assert_eq!(problem["errors"][0]["pointer"], "/task/gait", "{name}, {gait}: {problem}");
        let reason = problem["errors"][0]["detail"].as_str().unwrap();
        assert!(reason.contains(gait), "{name}: {reason}");
    }
    // It is told together with whatever else is wrong.
    let document = json!({ "character": { "urdf": QUADRUPED }, "task": { "gait": "tripod", "speed": 1e3 },
        "learning": { "seconds": -1.0 }, "accuracy": { "step": 7 } });
    let problem = service.post_json("/v1/jobs", &document).problem(422);
    assert_eq!(pointers(&problem), ["/learning/seconds", "/accuracy/step", "/task/gait", "/task/speed"]);
    assert!(service.json("/v1/jobs")["jobs"].as_array().unwrap().is_empty());
    let fine = json!({ "character": { "urdf": QUADRUPED }, "task": { "gait": "trot" }, "learning": { "generations": 1 } });
    assert_eq!(service.post_json("/v1/jobs", &fine).status, 202);
}
