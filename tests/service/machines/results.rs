//! What a job has left, as any server gives it, to the last bit.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::http::client::Service;
use crate::http::whole::rows;

/// Everything that a service gives of a job that has ended, but for times, and the rows of its recording.
#[derive(Debug, PartialEq)]
pub struct Results {
    state: String,
    error: Value,
    documents: BTreeMap<String, Vec<u8>>,
    rows: BTreeMap<String, usize>,
}

impl Results {
    /// Of the job at `path`.
    pub fn by(service: &Service, path: &str) -> Self {
        let job = service.json(path);
        let mut documents = BTreeMap::new();
        let numbers = 1..=job["motions"].as_array().unwrap().len();
        let of_motions = numbers.flat_map(|number| {
            [format!("motions/{number}"), format!("motions/{number}/gait"), format!("motions/{number}.glb")]
        });
        let names = ["report", "motion", "motions", "gait", "gait.svg", "motion.bvh"].map(str::to_owned);
        for name in names.into_iter().chain(of_motions) {
            let answer = service.curl(&format!("{path}/{name}"), &[]);
            assert!([200, 409].contains(&answer.status), "{name}: {}", answer.text());
            if answer.status == 200 {
                documents.insert(name, answer.body);
            }
        }
        let mut curve = service.json(&format!("{path}/curve"));
        // The time that a generation took.
        for point in curve["points"].as_array_mut().unwrap() {
            assert!(point.as_object_mut().unwrap().remove("elapsed").is_some(), "{point}");
        }
        documents.insert("curve".to_owned(), curve.to_string().into_bytes());
        let recording = service.curl(&format!("{path}/recording.rrd"), &[]);
        assert_eq!(recording.status, 200, "{}", recording.text());
        Self {
            state: job["state"].as_str().unwrap().to_owned(),
            error: job["error"].clone(),
            documents,
            rows: rows(&recording.body),
        }
    }

    /// Where these differ from others.
    pub fn difference(&self, other: &Self) -> String {
        let names: BTreeSet<&String> = self.documents.keys().chain(other.documents.keys()).collect();
        let differ = |name: &&&String| self.documents.get(**name) != other.documents.get(**name);
        let documents: Vec<_> = names.iter().filter(differ).collect();
        format!(
            "{}, {} and {}, {}; documents {documents:?}; rows {:?} and {:?}",
            self.state, self.error, other.state, other.error, self.rows, other.rows
        )
    }

    /// Whether there is a motion.
    pub fn has_motion(&self) -> bool {
        self.documents.contains_key("motion")
    }
}
