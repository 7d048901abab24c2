//! Gait diagrams, and gait report and learning curve as documents.

use std::sync::Arc;

use crate::synthetic;

use gaitwright::export::{Curve, gait_diagram};
use gaitwright_learning::gait::{GaitContext, GaitReport, measure};
use gaitwright_learning::learn::Generation;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::playback::Trace;
use synthetic::{GRAVITY, Gait, LEGS, mass, quadruped};

fn report(trace: &Trace) -> GaitReport {
    let model = Model::new(Arc::new(quadruped()), Base::Floating);
    let standing = Gait { speed: 0.0, ..Gait::new([0.0; 4], 1.0) }.sample(0.0).link_poses;
    let setting = GaitContext {
        model: &model,
        support: &[2, 4, 6, 8],
        standing: &standing,
        ground: 0.0,
        mass: mass(),
        gravity: GRAVITY,
        direction: [1.0, 0.0, 0.0],
    };
    measure(trace, &setting)
}

#[test]
fn nothing_at_all_has_a_diagram() {
    assert!(gait_diagram(&report(&Trace::default())).is_ok());
}

#[test]
fn the_diagram_has_a_bar_for_every_stance_it_shows() {
    let report = report(&Gait::new([0.0, 0.75, 0.5, 0.25], 0.75).trace());
    let svg = gait_diagram(&report).unwrap();
    let tree = roxmltree::Document::parse(&svg).unwrap();
    let texts: Vec<&str> = tree.descendants().filter_map(|node| node.text().map(str::trim)).collect();
    assert!(texts.iter().any(|text| text.starts_with("walk, 0.80 m/s")), "{texts:?}");
    for (name, phase) in LEGS.iter().zip(["0.00", "0.75", "0.50", "0.25"]) {
        assert!(texts.iter().any(|text| *text == format!("{name} shank {name}")), "{texts:?}");
        assert!(texts.iter().any(|text| *text == format!("β 0.75   φ {phase}")), "{texts:?}");
    }
    // Five strides are shown, from 7.5 s on; the ground is a rectangle, too.
    let [from, to] = [report.span[1] - 2.5, report.span[1]];
    let shown = report.feet.iter().flat_map(|foot| &foot.stances);
    let shown = shown.filter(|stance| stance[1] > from && stance[0] < to).count();
    let bars = tree.descendants().filter(|node| node.has_tag_name("rect")).count();
    assert_eq!(bars, shown + 1);
    assert!((20..=24).contains(&shown));
}

#[test]
fn names_from_users_cannot_break_the_diagram() {
    let mut report = report(&Gait::new([0.0; 4], 0.4).trace());
    report.feet[0].link = "<script>&\"'".into();
    report.feet[1].link = "ein sehr langer Name für ein Bein".into();
    let svg = gait_diagram(&report).unwrap();
    roxmltree::Document::parse(&svg).unwrap();
    assert!(!svg.contains("<script>"));
}

#[test]
fn the_report_and_the_curve_are_documents() {
    let report = report(&Gait::new([0.0, 0.5, 0.5, 0.0], 0.45).trace());
    let json = serde_json::to_string(&report).unwrap();
    assert!(json.starts_with(r#"{"format":"gaitwright/gait@1","gait":"trot""#), "{json}");
    assert_eq!(serde_json::from_str::<GaitReport>(&json).unwrap(), report);

    let point = Generation {
        generation: 7,
        gait: Some("running trot".into()),
        best: 0.1 + 0.2,
        mean: -1.5,
        spread: 1e-12,
        cache_hit_rate: 0.25,
        simulated_seconds: 12.0,
        saved_seconds: 3.0,
        elapsed: 1.25,
    };
    let curve = Curve::new(&[point.clone(), Generation { generation: 8, ..point }]);
    let csv = curve.to_csv();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 3);
    let fields: Vec<&str> = lines[1].split(',').collect();
    let numbers: Vec<f64> = fields.iter().filter_map(|field| field.parse().ok()).collect();
    assert_eq!(numbers, [7.0, 0.1 + 0.2, -1.5, 1e-12, 0.25, 12.0, 3.0, 1.25]);
    assert_eq!(fields[7], "running trot");
    assert_eq!(lines[0].split(',').count(), fields.len());
    let json = serde_json::to_string(&curve).unwrap();
    assert!(json.starts_with(r#"{"format":"gaitwright/curve@1","points":[{"#));
    assert_eq!(serde_json::from_str::<Curve>(&json).unwrap(), curve);
}

/// The same report gives the same picture, and another gait another one. `SCRATCH_SVG=path` keeps one to look at.
#[test]
fn the_diagram_depends_on_its_report_alone() {
    let diagram = |phases: [f64; 4]| gait_diagram(&report(&Gait::new(phases, 0.75).trace())).unwrap();
    let walk = diagram([0.0, 0.75, 0.5, 0.25]);
    assert_eq!(diagram([0.0, 0.75, 0.5, 0.25]), walk);
    assert_ne!(diagram([0.0, 0.5, 0.5, 0.0]), walk);
    if let Ok(path) = std::env::var("SCRATCH_SVG") {
        std::fs::write(path, walk).unwrap();
    }
}
