//! A job that asks for nothing, driven from outside: its repertoire, and the recording that shows every motion of it.

use std::collections::BTreeSet;
use std::io::Cursor;

use re_sdk::external::re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};
use re_sdk_types::archetypes::TextDocument;
use serde_json::{Value, json};

use super::client::Service;

/// Every text about a motion in a whole recording, in the order in which they were logged.
fn texts(recording: &[u8]) -> Vec<String> {
    let mut texts = Vec::new();
    for message in DecoderApp::decode_lazy(Cursor::new(recording)).map(Result::unwrap) {
        let LogMsg::ArrowMsg(_, arrow) = message else { continue };
        let chunk = Chunk::from_arrow_msg(&arrow).unwrap();
        if chunk.entity_path().to_string() == "/motion" {
            let rows = chunk.iter_slices::<String>(TextDocument::descriptor_text().component);
            texts.extend(rows.flatten().map(|text| text.to_string()));
        }
    }
    texts
}

#[test]
fn a_job_that_asks_for_nothing_leaves_a_repertoire_and_shows_it() {
    let service = Service::start();
    // Two generations for each of the first gaits.
    let path = &service.post_gaits(&json!({}), &json!({ "generations": 4, "gait_generations": 2 }));
    let job = service.wait_for_end(path);
    assert_eq!((&job["state"], &job["ended_by"]), (&json!("succeeded"), &json!("generations")));

    let listed = service.json(&format!("{path}/motions"));
    let motions = listed["motions"].as_array().unwrap();
    assert!(motions.len() >= 2, "{listed}");
    let names: BTreeSet<&str> = motions.iter().map(|entry| entry["name"].as_str().unwrap()).collect();
    assert_eq!(names.len(), motions.len(), "{names:?}");
    let shown = texts(&service.curl(&format!("{path}/recording.rrd"), &[]).body);
    for entry in motions {
        let (number, name, metrics) = (&entry["number"], entry["name"].as_str().unwrap(), &entry["metrics"]);
        let motion = service.json(&format!("{path}/motions/{number}"));
        assert_eq!(motion["metrics"], *metrics);
        let gait = service.json(&format!("{path}/motions/{number}/gait"));
        assert_eq!((&gait["gait"], &gait["natural"]), (&metrics["gait"], &metrics["natural"]));
        // With its name, its gait and its verdict.
        let heading = format!("# {name}\n\n**");
        let text = shown.iter().find(|text| text.starts_with(&heading));
        let text = text.unwrap_or_else(|| panic!("{name} is not shown in {shown:?}"));
        let verdict = text[heading.len()..].split("**").next().unwrap();
        let broken = metrics["naturalness"].as_object().unwrap().iter();
        for (measure, _) in broken.filter(|(_, measure)| measure["holds"] == false) {
            assert!(verdict.contains(measure), "{measure} is missing in {verdict:?}");
        }
        assert_eq!(verdict == "natural", metrics["natural"] == true, "{verdict}");
        assert!(text.contains(&format!("| gait | {} |", metrics["gait"].as_str().unwrap())), "{text}");
    }

    // The job's motion: one that stands, then natural, then valid, then of least cost.
    let rank = |entry: &Value| {
        let (stands, metrics) = (&entry["metrics"]["naturalness"]["upright"]["holds"], &entry["metrics"]);
        let flags = [stands, &metrics["natural"], &metrics["validity"]["valid"]].map(|flag| *flag != true);
        (flags, metrics["cost_of_transport"].as_f64().unwrap_or(f64::INFINITY))
    };
    let best = motions.iter().min_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap()).unwrap();
    assert_eq!(listed["motion"], best["number"]);
    assert_eq!(service.json(&format!("{path}/motion"))["metrics"], best["metrics"]);
}
