//! Characters over HTTP.

use std::collections::BTreeMap;
use std::process::Command;

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
    let path = service.post_job(&json!({ "generations": 1 }));
    let links = service.json(&path)["links"].clone();
    let file = service.curl(links["character"].as_str().unwrap(), &[]);
    assert_eq!(
        (file.body.as_slice(), &*file.headers["content-type"]),
        (PADDLER.as_bytes(), "application/xml")
    );

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
