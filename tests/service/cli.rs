//! The commands, as a shell sees them: status, standard output, standard error.

use crate::common;

use std::io::{BufRead, BufReader, Cursor, Write};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use re_sdk::StoreKind;
use re_sdk::external::re_log_encoding::DecoderApp;
use serde_json::{Value, json};
use tempfile::TempDir;

/// How long a test waits for something that has to happen.
const DEADLINE: Duration = Duration::from_secs(180);

/// A character that learns fast.
const PADDLER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/service/paddler.urdf");

/// A job that is over soon.
const QUICK: &str = r#"{"task": {"gait": "trot", "froude": 0.4}, "learning": {"generations": 3}}"#;

/// A character that soon trots.
const QUADRUPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/quadruped.urdf");

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright"));
    command.args(arguments);
    command
}

fn run(arguments: &[&str]) -> Output {
    command(arguments).output().unwrap()
}

/// Runs with `input` on standard input.
fn run_with(arguments: &[&str], input: &[u8]) -> Output {
    let mut child = command(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    child.wait_with_output().unwrap()
}

/// Standard output of a command that has to succeed.
fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// The one line on standard error of a command that has to refuse its input.
fn refusal(output: &Output) -> String {
    let message = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "one line: {message}");
    assert!(output.stdout.is_empty());
    message
}

fn write(folder: &Path, name: &str, contents: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, contents).unwrap();
    path.to_str().unwrap().to_owned()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn check_tells_what_it_understood() {
    let text = stdout(&run(&["check", PADDLER]));
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["format"], "gaitwright/check@1");
    assert_eq!(document["links"], json!(["plate", "left", "right"]));
    assert_eq!(document["joints"][0]["limits"], json!([-3.0, 3.0]));
    assert_eq!(document["joints"][0]["effort"], 10.0);
    assert_eq!(document["shapes"][0], json!({ "link": "plate", "kind": "box", "size": [0.4, 0.3, 0.05] }));
    assert_eq!(document["notes"], json!([]));
    let from_input = run_with(&["check", "-"], &std::fs::read(PADDLER).unwrap());
    assert_eq!(stdout(&from_input), text);
}

#[test]
fn check_lists_the_shapes_that_pass_through_each_other() {
    let ball = |radius: f64| json!([{ "kind": "sphere", "radius": radius }]);
    let link = |name: &str, radius: f64| json!({ "name": name, "density": 1000, "shapes": ball(radius) });
    let slide = |child: &str, parent: &str, x: f64| {
        json!({ "name": format!("to_{child}"), "kind": "prismatic", "parent": parent, "child": child,
                "origin": { "position": [x, 0, 0] }, "axis": [1, 0, 0],
                "limits": { "lower": -0.01, "upper": 0.01 } })
    };
    // A ball, another beside it, and on that a small one inside the first, one out of its reach, and one that
    // just reaches it.
    let character = json!({
        "format": "gaitwright/character@1", "name": "balls",
        "links": [link("first", 0.1), link("beside", 0.1), link("inside", 0.05), link("far", 0.05),
                  link("near", 0.05)],
        "joints": [slide("beside", "first", 0.5), slide("inside", "beside", -0.5),
                   slide("far", "beside", 1.0), slide("near", "beside", -0.665)]
    });
    let answer = run_with(&["check", "-"], character.to_string().as_bytes());
    let document: Value = serde_json::from_str(&stdout(&answer)).unwrap();
    // `beside` is joined to all others, and of those only `near` and `first` can meet.
    assert_eq!(
        document["self_collision"],
        json!({ "can_touch": 1, "apart": 4, "joined": 4, "overlapping": [[0, 2]] })
    );
}

/// What `check` states of a file: its mass, kg, and its movable joints, all of them in the standing pose.
fn assert_checked(path: &Path, mass: f64, joints: usize) {
    let document: Value = serde_json::from_str(&stdout(&run(&["check", path.to_str().unwrap()]))).unwrap();
    assert!((document["mass"].as_f64().unwrap() - mass).abs() < 1e-3, "{}", path.display());
    assert_eq!(document["joints"].as_array().unwrap().len(), joints, "{}", path.display());
    assert_eq!(document["standing"]["joints"].as_object().unwrap().len(), joints, "{}", path.display());
}

#[test]
fn check_reads_the_examples() {
    for (name, joints) in [("quadruped", 12), ("biped", 8), ("hexapod", 18), ("snake", 11)] {
        let numbers = common::json(&common::reference_path(&format!("{name}.json")));
        let path = common::repository().join(numbers["character"].as_str().unwrap());
        assert_checked(&path, numbers["random_states"][0]["mass"].as_f64().unwrap(), joints);
    }
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn check_reads_robots_from_elsewhere() {
    let folder = common::robots();
    // Name, mass (kg) and number of movable joints as the robots' makers state them.
    for (name, mass, joints) in
        [("a1", 13.741, 12), ("anymal_b", 30.475, 12), ("bolt", 1.254, 6), ("quadruped", 2.772, 8)]
    {
        assert_checked(&folder.join(format!("{name}.urdf")), mass, joints);
    }
}

/// A body without joints.
const BLOCK: &str = r#"<robot name="block"><link name="block"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>"#;

#[test]
fn where_nothing_can_be_left_nothing_is_begun() {
    let folder = TempDir::new().unwrap();
    let file = write(folder.path(), "file", "");
    let out = format!("{file}/out");
    // Each would take minutes.
    for command in [&["study"][..], &["accuracy", "--hard-cases"], &["train", PADDLER]] {
        let answer = run(&[command, &["--out", &out]].concat());
        let message = String::from_utf8(answer.stderr).unwrap();
        assert_eq!(answer.status.code(), Some(1), "{command:?}: {message}");
        assert!(
            message.starts_with(&format!("{out} cannot be made")) && message.lines().count() == 1,
            "{message}"
        );
    }
}

#[test]
fn inputs_are_refused_with_their_place() {
    let folder = TempDir::new().unwrap();
    let urdf = std::fs::read_to_string(PADDLER).unwrap();
    let faulty = write(folder.path(), "faulty.urdf", &urdf.replacen("\"2\"", "\"-2\"", 1));
    let message = refusal(&run(&["check", &faulty]));
    assert!(message.starts_with(&format!("{faulty}: line 4")) && message.contains("plate"), "{message}");

    let message = refusal(&run_with(&["check", "-"], b"neither"));
    assert!(message.starts_with("standard input: "), "{message}");
    let message = refusal(&run(&["check", "no-such-file.urdf"]));
    assert!(message.starts_with("no-such-file.urdf: "), "{message}");

    let job = write(folder.path(), "job.json", r#"{"sede": 1, "scene": {"frictoin": 1}}"#);
    let out = folder.path().join("out");
    let message = refusal(&run(&["train", PADDLER, "--out", out.to_str().unwrap(), "--job", &job]));
    assert!(
        message.starts_with(&job) && message.contains("/sede") && message.contains("/scene/frictoin"),
        "{message}"
    );
    assert!(!out.exists());

    // What is wrong with the character is said of its own file, not of the job's.
    let block = write(folder.path(), "block.urdf", BLOCK);
    let job = write(folder.path(), "job.json", "{}");
    let message = refusal(&run(&["train", &block, "--out", out.to_str().unwrap(), "--job", &job]));
    assert!(message.starts_with(&format!("{block}: ")) && message.contains("no joint"), "{message}");

    let scenario = write(folder.path(), "scenario.json", r#"{"character": "no-such-file.urdf"}"#);
    let message = refusal(&run(&["simulate", &scenario]));
    assert!(message.contains("/character") && message.contains("no-such-file.urdf"), "{message}");
    let motion = write(folder.path(), "motion.json", r#"{"format": "gaitwright/motion@1"}"#);
    let message = refusal(&run(&["gait", &motion]));
    assert!(message.starts_with(&motion), "{message}");

    assert_eq!(run(&["dance"]).status.code(), Some(2));
    assert_eq!(run(&["train", PADDLER]).status.code(), Some(2), "--out is missing");
}

#[test]
fn standard_input_is_read_once() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let export = ["export", "-", "--character", "-", "--format", "glb", "--out", out];
    for (arguments, names) in [
        (&["train", "-", "--job", "-", "--out", out][..], "--job and CHARACTER"),
        (&export, "MOTION and --character"),
        (&["gait", "-", "--character", "-"], "--character and MOTION"),
    ] {
        let message = refusal(&run(arguments));
        assert!(
            message.starts_with(&format!("standard input: can be read once, and {names} are")),
            "{message}"
        );
    }
}

#[test]
fn schema_is_a_json_schema() {
    let schema: Value = serde_json::from_str(&stdout(&run(&["schema"]))).unwrap();
    assert!(schema["$schema"].as_str().unwrap().contains("2020-12"));
    assert!(schema["properties"]["links"].is_object());
}

#[test]
fn simulate_prints_samples_and_a_summary() {
    let folder = TempDir::new().unwrap();
    std::fs::copy(PADDLER, folder.path().join("paddler.urdf")).unwrap();
    let scenario =
        r#"{"character": "paddler.urdf", "scene": {"ground": null}, "duration": 1.0, "sample_every": 0.5}"#;
    let path = write(folder.path(), "scenario.json", scenario);
    let text = stdout(&run(&["simulate", &path]));
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    // In free fall the centre of mass falls by g t²/2, up to the first-order step's g h t/2.
    let height = |line: &Value| line["center_of_mass"][2].as_f64().unwrap();
    let fallen = height(&lines[0]) - height(&lines[2]);
    assert!((fallen - 0.5 * 9.81).abs() <= 0.5 * 9.81 * 0.002 * 1.01, "{fallen}");
    assert_eq!(lines[3]["summary"]["status"], "finished");
    assert_eq!(lines[3]["summary"]["effects"]["ground_contact"]["on"], false);
}

#[test]
fn the_scenes_of_the_catalogue_are_listed_and_run_by_name() {
    let list = stdout(&run(&["simulate", "--list"]));
    let line = list.lines().find(|line| line.starts_with("friction-0 ")).unwrap();
    assert!(line.ends_with("a block slides on ice for ever"), "{line}");

    let lines = stdout(&run(&["simulate", "--scene", "friction-0", "--step", "0.01"]));
    let last: Value = serde_json::from_str(lines.lines().next_back().unwrap()).unwrap();
    assert_eq!(last["summary"]["status"], "finished");
    assert_eq!(last["summary"]["steps"], 1000);
    assert_eq!(last["summary"]["accuracy"]["step"], 0.01);

    assert!(
        refusal(&run(&["simulate", "--scene", "no-such"])).contains("scene no-such: there is no such scene")
    );
    assert!(refusal(&run(&["simulate", "--scene", "friction-0", "--step", "1"])).contains("/accuracy/step"));
    for arguments in [&["simulate"][..], &["simulate", "--list", "--scene", "friction-0"]] {
        assert_eq!(run(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let scenario = json!({ "character": PADDLER, "duration": 100.0, "sample_every": 0.002 }).to_string();
    let mut child = command(&["simulate", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(scenario.as_bytes()).unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(serde_json::from_str::<Value>(&first).is_ok());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn standard_output_that_is_full_is_named() {
    let motion = common::example_path("quadruped-walk.motion.json");
    let motion = motion.to_str().unwrap();
    for arguments in [
        &["check", PADDLER][..],
        &["simulate", "--scene", "friction-0"],
        &["simulate", "--list"],
        &["accuracy", "--list"],
        &["schema"],
        &["export", motion, "--character", QUADRUPED, "--format", "csv", "--out", "-"],
        &["serve", "--print-config"],
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = command(arguments).stdout(full).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        let last = message.lines().next_back().unwrap();
        assert!(
            last.starts_with("standard output cannot be written: No space left"),
            "{arguments:?}: {message}"
        );
    }
}

#[test]
fn train_leaves_everything_and_does_not_depend_on_threads() {
    let folder = TempDir::new().unwrap();
    let job = write(folder.path(), "job.json", QUICK);
    let train = |out: &Path, threads: &str| {
        let out = out.to_str().unwrap();
        run(&["train", QUADRUPED, "--out", out, "--job", &job, "--seed", "5", "--threads", threads])
    };
    let (one, two) = (folder.path().join("one"), folder.path().join("two"));
    let listed = stdout(&train(&one, "1"));
    for name in
        ["recording.rrd", "motion.json", "motions.json", "report.json", "curve.csv", "gait.json", "gait.svg"]
    {
        let path = one.join(name);
        assert!(path.is_file(), "{name}");
        assert!(listed.lines().any(|line| line == path.to_str().unwrap()), "{name} is named");
    }
    stdout(&train(&two, "2"));
    for name in ["motion.json", "gait.json", "report.json"] {
        assert_eq!(json(&one.join(name)), json(&two.join(name)), "{name}");
    }
    // The only motion of its repertoire is the job's.
    assert_eq!(json(&one.join("motions/1-trot.json")), json(&one.join("motion.json")));
    let motion = json(&one.join("motion.json"));
    assert_eq!(motion["provenance"]["seed"], 5);
    assert_eq!(json(&one.join("report.json"))["reproducible"], true);
    let curve = std::fs::read_to_string(one.join("curve.csv")).unwrap();
    assert_eq!(curve.lines().count(), 4);
}

#[test]
fn recordings_of_different_jobs_have_different_names() {
    let folder = TempDir::new().unwrap();
    let name = |out: &str, job: &str| {
        let job = write(folder.path(), "job.json", job);
        let out = folder.path().join(out);
        stdout(&run(&["train", QUADRUPED, "--out", out.to_str().unwrap(), "--job", &job]));
        let bytes = std::fs::read(out.join("recording.rrd")).unwrap();
        let messages = DecoderApp::decode_lazy(Cursor::new(bytes)).map(Result::unwrap);
        let names = messages.filter(|message| message.store_id().kind() == StoreKind::Recording);
        names.map(|message| message.store_id().recording_id().to_string()).next().unwrap()
    };
    let faster = QUICK.replace("0.4", "0.5");
    let plain = name("one", QUICK);
    assert_ne!(plain, name("two", &faster));
    assert_eq!(plain, name("three", QUICK));
}

#[test]
fn budgets_that_make_no_sense_are_refused() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let demo = |option: &str, value: &str| refusal(&run(&["demo", "--exit", "--out", out, option, value]));
    assert!(demo("--seconds", "nan").contains("--seconds: NaN"));
    assert!(demo("--seconds", "0").contains("--seconds: 0 does not"));
    assert!(demo("--generations", "0").contains("--generations: 0 does not"));
    let output = run(&["train", PADDLER, "--out", out, "--threads", "100000"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("--threads"));
    assert!(!Path::new(out).exists(), "nothing was begun");
}

#[test]
fn negative_numbers_are_refused_by_the_option_that_they_are_given_to() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let motion = common::example_path("quadruped-walk.motion.json");
    let train = ["train", PADDLER, "--out", out];
    let export =
        ["export", motion.to_str().unwrap(), "--character", QUADRUPED, "--format", "csv", "--out", out];
    let accuracy = ["accuracy", "--scene", "pendulum", "--out", out];
    let study = ["study", "--out", out];
    let simulate = ["simulate", "--scene", "friction-0"];
    for (command, option, reason) in [
        (&train[..], "--seed", "--seed <SEED>': must be a whole number from 0"),
        (&train, "--generations", "-1 is not in 0..="),
        (&train, "--seconds", "--seconds: -1 does not"),
        (&train, "--threads", "-1 is not in 1..=1024"),
        (&export, "--fps", "--fps: "),
        (&accuracy, "--tolerance", "must be a positive finite number"),
        (&study, "--seeds", "must be a whole number from 1"),
        (&study, "--seconds", "must be a positive number"),
        (&study, "--threads", "-1 is not in 1..=1024"),
        (&simulate, "--step", "/accuracy/step: "),
    ] {
        let output = run(&[command, &[option, "-1"]].concat());
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        let name = option.trim_start_matches('-');
        assert!(message.contains(name) && message.contains(reason), "{option}: {message}");
        assert!(!message.contains("unexpected"), "{option}: {message}");
    }
    assert!(!Path::new(out).exists(), "nothing was begun");
}

#[test]
fn the_gait_of_a_motion_is_that_of_its_training() {
    let folder = TempDir::new().unwrap();
    let job = write(folder.path(), "job.json", QUICK);
    let out = folder.path().join("out");
    stdout(&run(&["train", QUADRUPED, "--out", out.to_str().unwrap(), "--job", &job]));
    let motion = out.join("motion.json");
    let motion = motion.to_str().unwrap();
    let svg = folder.path().join("gait.svg");
    let text = stdout(&run(&["gait", motion, "--character", QUADRUPED, "--svg", svg.to_str().unwrap()]));
    let report: Value = serde_json::from_str(&text).unwrap();
    // The document's times are rounded: targets differ in the last digits.
    assert_close(&report, &json(&out.join("gait.json")));
    assert!(std::fs::read_to_string(svg).unwrap().contains("<svg"));
    let alone: Value = serde_json::from_str(&stdout(&run(&["gait", motion]))).unwrap();
    assert_eq!(
        (&report["format"], &alone["format"]),
        (&json!("gaitwright/gait@1"), &json!("gaitwright/metrics@1"))
    );
    assert_close(&alone["speed"], &report["speed"]);

    let other = std::fs::read_to_string(QUADRUPED).unwrap().replacen("mass value=\"", "mass value=\"1", 1);
    let other = write(folder.path(), "other.urdf", &other);
    let message = refusal(&run(&["gait", motion, "--character", &other]));
    assert!(message.contains("quadruped"), "{message}");
}

/// The same, but for the last digits of numbers.
fn assert_close(one: &Value, other: &Value) {
    match (one, other) {
        (Value::Object(one), Value::Object(other)) => {
            assert!(one.keys().eq(other.keys()));
            one.iter().for_each(|(name, value)| assert_close(value, &other[name]));
        }
        (Value::Array(one), Value::Array(other)) => {
            assert_eq!(one.len(), other.len());
            one.iter().zip(other).for_each(|(one, other)| assert_close(one, other));
        }
        _ => match (one.as_f64(), other.as_f64()) {
            (Some(one), Some(other)) => {
                assert!((one - other).abs() <= 1e-7 * one.abs().max(1e-3), "{one} and {other}")
            }
            _ => assert_eq!(one, other),
        },
    }
}

/// The bundled walk, changed, played with the bundled quadruped.
fn gait_of_changed_walk(change: impl FnOnce(&mut Value)) -> Output {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let mut motion = json(&Path::new(examples).join("quadruped-walk.motion.json"));
    change(&mut motion);
    let quadruped = format!("{examples}/quadruped.urdf");
    run_with(&["gait", "-", "--character", &quadruped], motion.to_string().as_bytes())
}

/// The one line on standard error of a command that has to fail at work.
fn failure(output: &Output) -> String {
    let message = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "one line: {message}");
    message
}

#[test]
fn the_gait_of_a_motion_that_breaks_off_is_not_told() {
    let broken = gait_of_changed_walk(|motion| {
        motion["scene"]["effects"] = json!({ "torque_limits": "off" });
        motion["drive"]["offset"] = json!(vec![1e300; 12]);
    });
    let message = failure(&broken);
    assert!(message.starts_with("standard input: ") && message.contains("broke off"), "{message}");
    assert!(message.contains(" s (") && broken.stdout.is_empty(), "{message}");
}

#[test]
fn the_gait_of_a_motion_that_ends_in_a_fall_says_so() {
    // The ground tilted against gravity: by little, and by more than it can stand on.
    let fallen = gait_of_changed_walk(|motion| motion["scene"]["gravity"] = json!([0, 2, -9]));
    let report: Value = serde_json::from_str(&stdout(&fallen)).unwrap();
    let (fell, seen) = (report["fell_at"].as_f64().unwrap(), report["span"][1].as_f64().unwrap());
    assert!(seen <= fell && fell < seen + 0.01 && fell < 20.0, "{fell} {seen}");
    assert!(String::from_utf8(fallen.stderr).unwrap().contains("fell after"));

    let at_once = gait_of_changed_walk(|motion| motion["scene"]["gravity"] = json!([0, 20, -9]));
    assert!(failure(&at_once).contains("fell after") && at_once.stdout.is_empty());

    let upright: Value = serde_json::from_str(&stdout(&gait_of_changed_walk(|_| ()))).unwrap();
    assert!(upright.get("fell_at").is_none());
}

#[test]
fn a_scene_that_cannot_be_simulated_is_a_failure_at_work_everywhere() {
    let folder = TempDir::new().unwrap();
    let mut document = json!({ "character": PADDLER, "duration": 0.5,
        "scene": { "effects": { "torque_limits": "off" } },
        "drive": { "kind": "torque", "joints": { "left_hinge": 1e200 } } });
    let path = write(folder.path(), "scenario.json", &document.to_string());
    assert!(failure(&run(&["simulate", &path])).contains("could not go on"));
    let study = run(&["accuracy", &path, "--out", folder.path().to_str().unwrap()]);
    assert_eq!(study.status.code(), Some(1));
    assert!(String::from_utf8(study.stderr).unwrap().contains("broke off"));
    document["accuracy"] = json!({ "tolerance": 1e-3 });
    let message = failure(&run_with(&["simulate", "-"], document.to_string().as_bytes()));
    assert!(message.contains("broke off"), "{message}");
}

#[test]
fn a_step_does_not_go_with_a_tolerance() {
    let document = json!({ "character": PADDLER, "accuracy": { "tolerance": 0.1 } }).to_string();
    let message = refusal(&run_with(&["simulate", "-", "--step", "0.002"], document.as_bytes()));
    assert!(message.contains("/accuracy: `tolerance`") && message.contains("--step"), "{message}");
}

#[test]
fn an_interrupted_training_writes_what_was_found() {
    let folder = TempDir::new().unwrap();
    let job = write(folder.path(), "job.json", r#"{"learning": {"gait_generations": 6}}"#);
    let out = folder.path().join("out");
    let mut child = command(&["train", QUADRUPED, "--out", out.to_str().unwrap(), "--job", &job])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut messages = BufReader::new(child.stderr.take().unwrap()).lines();
    messages.by_ref().map(Result::unwrap).find(|line| line.starts_with("motion 1, ")).unwrap();
    interrupt(&child);
    std::thread::spawn(move || messages.for_each(drop));
    assert_eq!(wait(&mut child), Some(0));
    assert_eq!(json(&out.join("report.json"))["ended_by"], "cancelled");
    assert!(out.join("recording.rrd").is_file());
    assert!(out.join("motion.json").is_file());
}

#[test]
fn a_command_line_that_cannot_be_used_is_told_in_one_line() {
    for (arguments, what) in [
        (&["train", "robot.urdf"][..], "--out"),
        (&["train", "robot.urdf", "--out", "there", "--sede", "7"], "--seed"),
        (&["weave"], "weave"),
        (&["export", "motion.json"], "--character"),
    ] {
        let output = run(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(message.starts_with("the command line: ") && message.contains(what), "{message}");
    }
    let help = run(&["train", "--help"]);
    assert!(help.status.success() && stdout(&help).lines().count() > 10);
}

#[test]
fn demo_leaves_recording_and_motion() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    // Its service asks for a token, of which the environment has the digest only.
    let digest = format!("sha256:{}", "0".repeat(64));
    let mut demo = command(&["demo", "--exit", "--generations", "2", "--out", out.to_str().unwrap()]);
    let output = demo.env("GAITWRIGHT_TOKENS", format!("anna={digest}")).output().unwrap();
    let text = stdout(&output);
    let paths: Vec<&Path> = text.lines().map(Path::new).collect();
    assert_eq!(paths, [out.join("recording.rrd"), out.join("motion.json")]);
    assert_eq!(&std::fs::read(paths[0]).unwrap()[..4], b"RRF2");
    assert_eq!(json(paths[1])["format"], "gaitwright/motion@1");
    assert!(String::from_utf8(output.stderr).unwrap().contains("http://127.0.0.1:"));
}

#[test]
fn a_demo_that_is_interrupted_before_its_results_ends_at_once_and_says_so() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    let mut child = command(&["demo", "--seconds", "600", "--out", out.to_str().unwrap()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut messages = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    messages.by_ref().find(|line| line.contains("the job:")).unwrap();
    interrupt(&child);
    let said = std::thread::spawn(move || messages.collect::<Vec<_>>().join("\n"));
    assert_eq!(wait(&mut child), Some(1));
    let said = said.join().unwrap();
    assert!(said.contains("interrupted") && !said.contains("until Ctrl-C"), "{said}");
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

/// The exit status of a process that has to end.
fn wait(child: &mut Child) -> Option<i32> {
    let since = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        assert!(since.elapsed() < DEADLINE, "it has not ended after {DEADLINE:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}
