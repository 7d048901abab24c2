//! Characters over HTTP.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::Command;

use base64::Engine;
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use super::client::{PADDLER, QUADRUPED, Service};

#[test]
fn a_character_is_kept_and_serves_in_jobs() {
    let service = Service::start();
    let answer = service.post("/v1/characters", "application/xml", PADDLER.as_bytes());
    assert_eq!(answer.status, 201, "{}", answer.text());
    let character = answer.json();
    assert_eq!(character["format"], "gaitwright/check@1");
    assert_eq!(character["name"], "paddler");
    assert!((character["mass"].as_f64().unwrap() - 2.6).abs() < 1e-12);
    let joints: Vec<_> = character["joints"].as_array().unwrap().iter().map(|joint| &joint["name"]).collect();
    assert_eq!(joints, ["left_hinge", "right_hinge"]);
    assert_eq!(service.json(&answer.headers["location"]), character);

    let id = character["id"].as_str().unwrap();
    assert_eq!(answer.headers["location"], format!("/v1/characters/{id}"));
    let again = service.post("/v1/characters", "text/xml; charset=utf-8", PADDLER.as_bytes()).json();
    assert_eq!(again["id"], character["id"], "the same bytes keep their id");

    let job = json!({ "character": { "id": id }, "learning": { "generations": 1, "population": 4 } });
    let answer = service.post_json("/v1/jobs", &job);
    assert_eq!(answer.status, 202, "{}", answer.text());
    assert_eq!(answer.json()["character"]["digest"], character["digest"]);
    assert_ne!(service.wait_for_end(&answer.headers["location"])["state"], "cancelled");
}

/// A byte order mark is no part of a document, by whatever way that comes.
#[test]
fn a_character_with_a_byte_order_mark_serves_by_its_id() {
    let service = Service::start();
    let snake = std::fs::read(crate::common::example_path("snake.json")).unwrap();
    let marked = [b"\xef\xbb\xbf", &snake[..]].concat();
    let answer = service.post("/v1/characters", "application/json", &marked);
    assert_eq!(answer.status, 201, "{}", answer.text());
    let scenario = json!({ "character": { "id": answer.json()["id"] }, "duration": 0.01 });
    let answer = service.post_json("/v1/simulations", &scenario);
    assert_eq!(answer.status, 200, "{}", answer.text());
}

/// A cube of 0.2 m as a mesh, on which a leg turns, in an archive.
fn archive() -> Vec<u8> {
    let corners = (0..8).map(|corner| [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { -0.1 } else { 0.1 }));
    let faces = [
        "1 3 4", "1 4 2", "5 6 8", "5 8 7", "1 2 6", "1 6 5", "3 7 8", "3 8 4", "1 5 7", "1 7 3", "2 4 8",
        "2 8 6",
    ];
    let mesh: String = corners
        .map(|[x, y, z]| format!("v {x} {y} {z}\n"))
        .chain(faces.iter().map(|face| format!("f {face}\n")))
        .collect();
    let urdf = r#"<robot name="meshed"><link name="body"><inertial><mass value="1"/>
        <inertia ixx="0.007" ixy="0" ixz="0" iyy="0.007" iyz="0" izz="0.007"/></inertial>
        <collision><geometry><mesh filename="cube.obj"/></geometry></collision></link>
        <link name="paddle"><inertial><mass value="0.1"/>
        <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
        <joint name="hinge" type="revolute"><parent link="body"/><child link="paddle"/><axis xyz="0 1 0"/>
        <origin xyz="0 0.15 0"/><limit lower="-1" upper="1" effort="5" velocity="5"/></joint></robot>"#;
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, text) in [("meshed.urdf", urdf), ("cube.obj", &mesh)] {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(text.as_bytes()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// A character of any form that has been posted serves in scenarios, a zip with its meshes too.
#[test]
fn scenarios_take_characters_that_are_kept() {
    let service = Service::start();
    let kept = service.post("/v1/characters", "application/zip", &archive()).json();
    let id = &kept["id"];
    let scenario = json!({ "character": { "id": id }, "duration": 0.5, "sample_every": 0.1 });
    let simulated = service.post_json("/v1/simulations", &scenario);
    assert_eq!(simulated.status, 200, "{}", simulated.text());
    let lines: Vec<Value> =
        simulated.text().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    // At rest on the face of its mesh it weighs what it weighs.
    let force: f64 = lines[5]["contacts"]
        .as_array()
        .unwrap()
        .iter()
        .map(|contact| contact["force"][2].as_f64().unwrap())
        .sum();
    assert!((force - 1.1 * 9.81).abs() < 0.05 * force, "{}", lines[5]);

    // The same inline, and the one that came as a URDF.
    let archive = base64::prelude::BASE64_STANDARD.encode(archive());
    let inline = json!({ "character": { "zip": archive }, "duration": 0.5, "sample_every": 0.1 });
    let again = service.post_json("/v1/simulations", &inline).text();
    assert_eq!(again.lines().nth(3), simulated.text().lines().nth(3));
    let paddler = service.post("/v1/characters", "application/xml", PADDLER.as_bytes()).json();
    let of_id = json!({ "character": { "id": paddler["id"] }, "duration": 0.02 });
    let of_text = json!({ "character": { "urdf": PADDLER }, "duration": 0.02 });
    let [one, other] =
        [of_id, of_text].map(|scenario| service.post_json("/v1/simulations", &scenario).text());
    assert_eq!(one.lines().nth(1), other.lines().nth(1));

    let study = json!({ "scenario": { "character": { "id": id }, "duration": 0.05 }, "tolerances": [1e-2] });
    let posted = service.post_json("/v1/accuracy", &study);
    assert_eq!(posted.status, 202, "{}", posted.text());
    let ended = service.wait_for_end(&posted.headers["location"]);
    assert_eq!(ended["state"], "succeeded", "{ended}");

    for id in ["01890000-0000-7000-8000-000000000000", "no id"] {
        let scenario = json!({ "character": { "id": id }, "duration": 0.1 });
        let problem = service.post_json("/v1/simulations", &scenario).problem(422);
        assert_eq!(problem["errors"][0]["pointer"], "/character/id", "{problem}");
        let study = json!({ "scenario": scenario });
        let problem = service.post_json("/v1/accuracy", &study).problem(422);
        assert_eq!(problem["errors"][0]["pointer"], "/scenario/character/id", "{problem}");
    }
}

#[test]
fn the_service_and_the_command_understand_the_same() {
    let service = Service::start();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), PADDLER).unwrap();
    let form = format!("character=@{}", file.path().display());
    let mut kept = service.curl("/v1/characters", &["-F", &form]).json();
    kept.as_object_mut().unwrap().remove("id");
    let output =
        Command::new(env!("CARGO_BIN_EXE_gaitwright")).arg("check").arg(file.path()).output().unwrap();
    let checked: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(kept, checked);
}

#[test]
fn the_schema_is_that_of_the_command() {
    let service = Service::start();
    let output = Command::new(env!("CARGO_BIN_EXE_gaitwright")).arg("schema").output().unwrap();
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(service.json("/v1/schemas/character"), printed);
    assert!(printed["$schema"].as_str().unwrap().contains("2020-12"));
}

/// World frames of every node, by name, and the joint that each one's `extras` name.
fn nodes(file: &gltf::Gltf) -> (BTreeMap<String, Isometry3<f64>>, BTreeMap<String, Value>) {
    fn visit(
        node: &gltf::Node<'_>,
        parent: &Isometry3<f64>,
        found: &mut (BTreeMap<String, Isometry3<f64>>, BTreeMap<String, Value>),
    ) {
        let (translation, [x, y, z, w], _) = node.transform().decomposed();
        let rotation = Quaternion::new(w, x, y, z).cast::<f64>();
        let pose = parent
            * Isometry3::from_parts(
                Translation3::from(Vector3::from(translation).cast::<f64>()),
                UnitQuaternion::from_quaternion(rotation),
            );
        let name = node.name().unwrap().to_owned();
        if let Some(extras) = node.extras() {
            found.1.insert(name.clone(), serde_json::from_str(extras.get()).unwrap());
        }
        node.children().for_each(|child| visit(&child, &pose, found));
        found.0.insert(name, pose);
    }
    let mut found = (BTreeMap::new(), BTreeMap::new());
    for node in file.default_scene().unwrap().nodes() {
        visit(&node, &Isometry3::identity(), &mut found);
    }
    found
}

#[test]
fn a_character_stands_in_its_file_of_shapes() {
    let service = Service::start();
    let character = service.post("/v1/characters", "application/xml", QUADRUPED.as_bytes()).json();
    let path = format!("/v1/characters/{}", character["id"].as_str().unwrap());
    let answer = service.curl(&format!("{path}/standing.glb"), &[]);
    assert_eq!((answer.status, &*answer.headers["content-type"]), (200, "model/gltf-binary"));
    let file = gltf::Gltf::from_slice(&answer.body).unwrap();
    assert_eq!(file.animations().count(), 0);
    let (frames, extras) = nodes(&file);
    // y is up: every foot is on the ground, and the trunk as high as was found.
    for foot in character["standing"]["support"].as_array().unwrap() {
        let foot = &frames[foot.as_str().unwrap()];
        // The balls of the feet have a radius of 22 mm.
        assert!((foot.translation.y - 0.022).abs() < 5e-3, "{foot}");
    }
    let height = character["standing"]["root_height"].as_f64().unwrap();
    assert!((frames["trunk"].translation.y - height).abs() < 1e-6);
    // With name, axis and angle of its joint a reader can bend it: straightened, every link lies in its parent as the
    // URDF has it.
    let joints = character["joints"].as_array().unwrap();
    assert_eq!(extras.len(), joints.len());
    let document = roxmltree::Document::parse(QUADRUPED).unwrap();
    for joint in document.root_element().children().filter(|node| node.has_tag_name("joint")) {
        let name = |tag: &str| {
            joint.children().find(|node| node.has_tag_name(tag)).unwrap().attribute("link").unwrap()
        };
        let (parent, child) = (name("parent"), name("child"));
        let Some(told) = extras.get(child) else {
            assert_eq!(joint.attribute("type"), Some("fixed"));
            continue;
        };
        assert_eq!(told["joint"].as_str(), joint.attribute("name"));
        assert_eq!(told["kind"], "revolute");
        let angle = told["angle"].as_f64().unwrap();
        assert_eq!(character["standing"]["settled"][told["joint"].as_str().unwrap()], angle);
        let axis: [f64; 3] = serde_json::from_value(told["axis"].clone()).unwrap();
        let bent = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis.into()), angle);
        let straight = frames[parent].inverse() * frames[child] * bent.inverse();
        let origin = joint.children().find(|node| node.has_tag_name("origin")).unwrap();
        let numbers = |name: &str| -> [f64; 3] {
            let text = origin.attribute(name).unwrap_or("0 0 0");
            let numbers: Vec<f64> = text.split_whitespace().map(|part| part.parse().unwrap()).collect();
            numbers.try_into().unwrap()
        };
        let [roll, pitch, yaw] = numbers("rpy");
        assert!((straight.translation.vector - Vector3::from(numbers("xyz"))).norm() < 1e-6, "{child}");
        let turned = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        assert!(straight.rotation.angle_to(&turned) < 1e-6, "{child}");
    }
    service.curl("/v1/characters/01890000-0000-7000-8000-000000000000/standing.glb", &[]).problem(404);
}

#[test]
fn a_character_is_given_back_as_it_was_posted() {
    let service = Service::start();
    let character = service.post("/v1/characters", "application/xml", PADDLER.as_bytes()).json();
    let file = service.curl(&format!("/v1/characters/{}/file", character["id"].as_str().unwrap()), &[]);
    assert_eq!(
        (file.body.as_slice(), &*file.headers["content-type"]),
        (PADDLER.as_bytes(), "application/xml")
    );
    // XML may contain scripts, which a browser would run in the service's name.
    let policy = &file.headers["content-security-policy"];
    assert!(policy.contains("default-src 'none'") && policy.contains("sandbox"), "{policy}");
    let path = service.post_job(&json!({ "generations": 1 }));
    let links = service.json(&path)["links"].clone();
    let link = links["character"].as_str().unwrap();
    let file = service.curl(link, &[]);
    assert_eq!(
        (file.body.as_slice(), &*file.headers["content-type"]),
        (PADDLER.as_bytes(), "application/xml")
    );
    let known = service.curl(link, &["-H", &format!("if-none-match: {}", file.headers["etag"])]);
    assert_eq!((known.status, known.body.len()), (304, 0));

    let snake = std::fs::read(crate::common::example_path("snake.json")).unwrap();
    let character = service.post("/v1/characters", "application/json", &snake).json();
    let file = service.curl(&format!("/v1/characters/{}/file", character["id"].as_str().unwrap()), &[]);
    assert_eq!((file.body, &*file.headers["content-type"]), (snake, "application/json"));

    let study =
        json!({ "scenario": { "character": { "urdf": PADDLER }, "duration": 0.01 }, "tolerances": [1e-2] });
    let study = service.post_json("/v1/accuracy", &study).json();
    assert!(study["links"].get("character").is_none());
    service.curl(&format!("/v1/jobs/{}/character", study["id"].as_str().unwrap()), &[]).problem(404);
    service.curl("/v1/characters/01890000-0000-7000-8000-000000000000/file", &[]).problem(404);
}
