//! Tiny jobs, and what they leave when nothing disturbs them, to the last bit.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use re_sdk::external::re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};
use serde_json::{Value, json};

use super::client::{PADDLER, Service};

/// A job for the paddler that takes a second or so: with seeds 1 and 2 it comes to a motion, with seed 3 it does not.
pub fn tiny_job(seed: u64) -> Value {
    short_job(seed, 2)
}

/// The same of so many generations, with a checkpoint after each.
pub fn short_job(seed: u64, generations: u32) -> Value {
    let learning = json!({ "population": 4, "islands": 1, "elite": 1, "episodes": 2, "trial_seconds": 0.5,
        "check_seconds": 1.0, "generations": generations, "cache_generations": 1 });
    json!({ "character": { "urdf": PADDLER }, "task": hasty_task([-1.0, 0.0, 0.0]), "learning": learning,
        "seed": seed })
}

/// In a few generations something is found that moves, if jerks and impacts cost nothing.
pub fn hasty_task(direction: [f64; 3]) -> Value {
    json!({ "direction": direction, "weights": { "impact": 0, "smoothness": 0, "posture": 0 } })
}

/// Everything that a job has left: its state, its files but for the recording, and the rows of that.
#[derive(Debug, PartialEq)]
pub struct Left {
    state: String,
    error: Value,
    files: BTreeMap<String, Vec<u8>>,
    rows: BTreeMap<String, usize>,
}

impl Left {
    /// By the job at `path`, which has ended.
    pub fn by(service: &Service, path: &str) -> Self {
        let job = service.json(path);
        let folder = service.folder(path);
        let mut files = BTreeMap::new();
        gather(&folder, &folder, &mut files);
        files.remove("checkpoint.json");
        let recording = files.remove("recording.rrd").expect("a job that has ended has a recording");
        // The time that a generation took is the last column.
        if let Some(curve) = files.get_mut("curve.csv") {
            let text = String::from_utf8(curve.clone()).unwrap();
            let header = text.lines().next().unwrap();
            assert!(header.ends_with(",elapsed"), "{header}");
            let rows = text.lines().map(|row| row.rsplit_once(',').unwrap().0);
            *curve = rows.collect::<Vec<_>>().join("\n").into_bytes();
        }
        Self {
            state: job["state"].as_str().unwrap().to_owned(),
            error: job["error"].clone(),
            files,
            rows: rows(&recording),
        }
    }

    /// Whether there is a motion.
    pub fn has_motion(&self) -> bool {
        self.files.contains_key("motion.json")
    }
}

fn gather(root: &Path, folder: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            gather(root, &path, files);
        } else {
            let name = path.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
            assert!(!name.contains("unfinished"), "{name} is left over: {:?}", std::fs::metadata(&path));
            files.insert(name, std::fs::read(&path).unwrap());
        }
    }
}

/// How many rows a whole recording holds of every entity.
pub fn rows(recording: &[u8]) -> BTreeMap<String, usize> {
    let mut rows = BTreeMap::new();
    for message in DecoderApp::decode_lazy(Cursor::new(recording)).map(Result::unwrap) {
        if let LogMsg::ArrowMsg(_, arrow) = message {
            let chunk = Chunk::from_arrow_msg(&arrow).unwrap();
            *rows.entry(chunk.entity_path().to_string()).or_default() += chunk.num_rows();
        }
    }
    rows
}

/// Number of messages in the beginning of a recording, which may break off in the middle of one but is sound up to there.
pub fn sound_messages(beginning: &[u8]) -> usize {
    let mut sound = 0;
    let mut broken = false;
    for message in DecoderApp::decode_lazy(Cursor::new(beginning)) {
        assert!(!broken, "there is something after what cannot be read");
        match message {
            Ok(_) => sound += 1,
            Err(_) => broken = true,
        }
    }
    sound
}
