//! The recording is read back message by message and compared with what went in.

use crate::synthetic;

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use gaitwright::export::{Recording, RecordingError, RecordingSubject};
use gaitwright_learning::gait::Detection;
use gaitwright_learning::learn::Generation;
use gaitwright_physics::playback::Trace;
use gaitwright_physics::scene::Scene;
use re_sdk::external::re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};
use re_sdk::{StoreKind, TimelineName};
use synthetic::Gait;

const TROT: [f64; 4] = [0.0, 0.5, 0.5, 0.0];

const DETECTION: Detection = Detection { threshold: 1.0, debounce: 0.025 };

fn figures(generation: u32) -> Generation {
    Generation {
        generation,
        gait: None,
        best: f64::from(generation),
        mean: 0.5 * f64::from(generation),
        spread: 0.1,
        cache_hit_rate: 0.25,
        simulated_seconds: 10.0,
        saved_seconds: 2.5,
        elapsed: 1.0,
    }
}

fn trot(seconds: f64) -> Trace {
    Gait { seconds, interval: 0.02, ..Gait::new(TROT, 0.45) }.trace()
}

fn create(path: &Path) -> Result<Recording, RecordingError> {
    let step = r#"{"name": "step", "shape": {"kind": "box", "size": [1, 1, 0.1]}}"#;
    let scene = Scene { obstacles: vec![serde_json::from_str(step).unwrap()], ..Scene::default() };
    let character = synthetic::quadruped();
    let joints = synthetic::joint_names();
    let subject = RecordingSubject {
        id: "test",
        title: "synthetic quadruped",
        character: &character,
        joints: &joints,
        scene: &scene,
    };
    Recording::create(path, subject)
}

/// Two motions of 2 s and 1 s, five generations.
fn record(path: &Path) {
    let mut recording = create(path).unwrap();
    recording.job("# A trot\n\nmade by construction").unwrap();
    for generation in 1..=5 {
        recording.generation(&figures(generation)).unwrap();
        match generation {
            2 => recording.motion((generation, "# trot"), (&trot(2.0), DETECTION)).unwrap(),
            4 => recording.motion((generation, "# trot"), (&trot(1.0), DETECTION)).unwrap(),
            _ => {}
        }
    }
    recording.finish().unwrap();
}

/// What a file holds, by entity.
#[derive(Default)]
struct Content {
    chunks: BTreeMap<String, Vec<Chunk>>,
    layout: Vec<String>,
    activated: bool,
}

fn read(bytes: &[u8]) -> Content {
    let mut content = Content::default();
    // A file that ends in the middle of a message ends the iteration with an error.
    for message in DecoderApp::decode_lazy(Cursor::new(bytes)).map_while(Result::ok) {
        match message {
            LogMsg::ArrowMsg(store, arrow) => {
                let chunk = Chunk::from_arrow_msg(&arrow).unwrap();
                let path = chunk.entity_path().to_string();
                if store.kind() == StoreKind::Blueprint {
                    content.layout.push(path);
                } else {
                    content.chunks.entry(path).or_default().push(chunk);
                }
            }
            LogMsg::BlueprintActivationCommand(_) => content.activated = true,
            LogMsg::SetStoreInfo(_) => {}
        }
    }
    content
}

impl Content {
    /// Times of all rows of an entity on a timeline, in order; s for `sim_time`.
    fn times(&self, entity: &str, timeline: &str) -> Vec<f64> {
        let name = TimelineName::try_new(timeline).unwrap();
        let unit = if timeline == "sim_time" { 1e-9 } else { 1.0 };
        let chunks = self.chunks.get(entity).into_iter().flatten();
        let mut times: Vec<f64> = chunks
            .filter_map(|chunk| chunk.timelines().get(&name))
            .flat_map(|column| column.times_raw().to_vec())
            .map(|time| time as f64 * unit)
            .collect();
        times.sort_by(f64::total_cmp);
        times
    }

    fn has_static(&self, entity: &str, component: &str) -> bool {
        self.chunks
            .get(entity)
            .into_iter()
            .flatten()
            .any(|chunk| chunk.is_static() && chunk.components().keys().any(|name| *name == component))
    }
}

fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 2e-9, "{found} instead of {expected}");
    }
}

#[test]
fn everything_that_went_in_is_read_back_on_both_timelines() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.rrd");
    record(&path);
    let content = read(&std::fs::read(path).unwrap());

    // 101 samples of the first motion from 0 s on, 51 of the second one sample after its end.
    let times: Vec<f64> =
        (0..=100).map(|k| 0.02 * f64::from(k)).chain((0..=50).map(|k| 2.02 + 0.02 * f64::from(k))).collect();
    let generations: Vec<f64> = [vec![2.0; 101], vec![4.0; 51]].concat();
    let mut sampled = vec!["/world/character/trunk".to_owned()];
    for leg in synthetic::LEGS {
        // Names with a space are escaped by the viewer's rules.
        sampled.extend(["thigh", "shank"].map(|part| format!("/world/character/{leg}\\ {part}")));
        sampled.push(format!("/world/character/{leg}\\ shank/contact"));
        for joint in ["hip", "knee"] {
            sampled.extend(["angle", "target", "torque"].map(|what| format!("/joints/{leg}_{joint}/{what}")));
        }
    }
    for entity in &sampled {
        assert_close(&content.times(entity, "sim_time"), &times);
        assert_close(&content.times(entity, "generation"), &generations);
    }

    for figure in ["best", "mean", "spread", "cache_hits"] {
        let entity = format!("/learning/{figure}");
        assert_close(&content.times(&entity, "generation"), &[1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_close(&content.times(&entity, "sim_time"), &[0.0, 0.0, 2.02, 2.02, 3.04]);
    }
    assert_close(&content.times("/world/path", "sim_time"), &[0.0, 2.02]);
    // Trot of half a second a stride: a foot changes between stance and swing about eight times in
    // two seconds, and its state at the start of each motion is recorded.
    for leg in synthetic::LEGS {
        let changes = content.times(&format!("/gait/{leg}\\ shank"), "sim_time");
        assert!((10..=14).contains(&changes.len()), "{changes:?}");
    }

    assert!(content.has_static("/world/ground", "Mesh3D:vertex_positions"));
    assert!(content.has_static("/world/obstacles/step", "Boxes3D:half_sizes"));
    assert!(content.has_static("/world/character/trunk", "Boxes3D:half_sizes"));
    assert!(content.has_static("/world/character/LF\\ thigh", "Capsules3D:lengths"));
    assert!(content.has_static("/world/character/LF\\ shank", "Cylinders3D:lengths"));
    assert!(content.has_static("/world/character/LF\\ shank", "Ellipsoids3D:half_sizes"));
    assert!(content.has_static("/job", "TextDocument:text"));

    assert!(content.activated, "the layout is not activated");
    for part in ["/viewport", "/time_panel"] {
        assert!(content.layout.iter().any(|path| path == part), "no {part} in the layout");
    }
    for (property, of) in [("EyeControls3D", 1), ("LineGrid3D", 1), ("TimeAxis", 2), ("ViewContents", 8)] {
        let found = content.layout.iter().filter(|path| path.ends_with(property)).count();
        assert_eq!(found, of, "{property}");
    }

    // Only these timelines: the wall clock would make equal jobs differ.
    for chunk in content.chunks.values().flatten().filter(|chunk| !chunk.is_static()) {
        let names: Vec<String> = chunk.timelines().keys().map(ToString::to_string).collect();
        assert_eq!(names.len(), 2, "{names:?}");
    }
}

#[test]
fn a_file_cut_anywhere_still_reads_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.rrd");
    record(&path);
    let bytes = std::fs::read(path).unwrap();
    let whole = read(&bytes).chunks.values().map(Vec::len).sum::<usize>();
    let mut before = 0;
    for tenths in 1..10 {
        let chunks = read(&bytes[..bytes.len() * tenths / 10]).chunks.values().map(Vec::len).sum::<usize>();
        assert!(chunks >= before && chunks <= whole);
        before = chunks;
    }
    assert!(before > whole / 2, "{before} of {whole} chunks in nine tenths of the file");
}

#[test]
fn a_running_recording_is_already_readable() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.rrd");
    let mut recording = create(&path).unwrap();
    recording.motion((1, "# trot"), (&trot(1.0), DETECTION)).unwrap();
    let content = read(&std::fs::read(&path).unwrap());
    assert_eq!(content.times("/world/character/trunk", "sim_time").len(), 51);
    assert!(content.has_static("/world/ground", "Mesh3D:vertex_positions"));
    recording.finish().unwrap();
}

#[test]
fn a_link_that_lifts_off_loses_its_arrow() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.rrd");
    let mut recording = create(&path).unwrap();
    recording.motion((1, "# trot"), (&trot(1.0), DETECTION)).unwrap();
    let mut flight = trot(1.0);
    flight.samples.iter_mut().for_each(|sample| sample.contacts.clear());
    synthetic::settle_loads(&mut flight);
    recording.motion((2, "# trot"), (&flight, DETECTION)).unwrap();
    recording.finish().unwrap();
    let content = read(&std::fs::read(&path).unwrap());
    // The second motion has a row without arrows for each sample: 51 of each motion.
    assert_eq!(content.times("/world/character/LF\\ shank/contact", "sim_time").len(), 102);
    assert_eq!(
        content.times("/gait/LF\\ shank", "sim_time").last().map(|time| (time * 100.0).round()),
        Some(102.0)
    );
}

#[test]
fn an_empty_trace_and_a_place_that_cannot_be_written_are_no_accidents() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.rrd");
    let mut recording = create(&path).unwrap();
    recording.motion((1, "# trot"), (&Trace::default(), DETECTION)).unwrap();
    recording.finish().unwrap();
    assert!(!read(&std::fs::read(&path).unwrap()).chunks.contains_key("/world/path"));

    let nowhere = folder.path().join("missing").join("recording.rrd");
    let Err(error) = create(&nowhere) else { panic!("created {}", nowhere.display()) };
    assert!(matches!(error, RecordingError::Create { .. }), "{error}");
    assert!(error.to_string().contains("missing"), "{error}");
}

/// Thirty generations, of which every seventh brings a motion of 3 s. `SCRATCH_RRD=path` keeps the file to look at.
#[test]
fn a_long_recording_holds_every_generation_and_every_motion() {
    let folder = tempfile::tempdir().unwrap();
    let path = std::env::var("SCRATCH_RRD").map_or_else(|_| folder.path().join("recording.rrd"), Into::into);
    let mut recording = create(&path).unwrap();
    recording.job("# Trot of a synthetic quadruped\n\nmade *by construction*\n\n| figure | value |\n|---|---|\n| speed | 0.8 m/s |\n| duty | 0.45 |").unwrap();
    for generation in 1..=30 {
        recording.generation(&figures(generation)).unwrap();
        if generation % 7 == 2 {
            recording.motion((generation, "# trot"), (&trot(3.0), DETECTION)).unwrap();
        }
    }
    recording.finish().unwrap();
    let content = read(&std::fs::read(&path).unwrap());
    let generations: Vec<f64> = (1..=30).map(f64::from).collect();
    assert_close(&content.times("/learning/best", "generation"), &generations);
    // A motion of 151 samples begins one sample after the end of the one before.
    assert_close(&content.times("/world/path", "generation"), &[2.0, 9.0, 16.0, 23.0, 30.0]);
    assert_close(&content.times("/world/path", "sim_time"), &[0.0, 3.02, 6.04, 9.06, 12.08]);
    assert_eq!(content.times("/world/character/trunk", "sim_time").len(), 5 * 151);
}
