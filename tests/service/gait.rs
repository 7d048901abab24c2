//! Gaits made by construction give back what they were made of.

use crate::synthetic;

use gaitwright::export::{Curve, gait_diagram};
use gaitwright_learning::gait::{
    Detection, Footing, GaitContext, GaitReport, Regime, measure, templates, validity,
};
use gaitwright_learning::learn::Generation;
use gaitwright_physics::playback::Trace;
use gaitwright_physics::sim::StepRecord;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use synthetic::{GRAVITY, Gait, LEGS, foot_link, mass, quadruped};

/// Links that carry the quadruped, deliberately not in the order of the legs.
const SUPPORT: [usize; 4] = [8, 2, 6, 4];

/// A standing pose with the given heading.
fn standing(heading: f64) -> Vec<Isometry3<f64>> {
    let gait = Gait { speed: 0.0, seconds: 0.0, heading, ..Gait::new([0.0; 4], 1.0) };
    gait.trace().samples.remove(0).link_poses
}

fn report(trace: &Trace, heading: f64) -> GaitReport {
    let (character, standing) = (quadruped(), standing(heading));
    let setting = GaitContext {
        character: &character,
        support: &SUPPORT,
        standing: &standing,
        ground: 0.0,
        mass: mass(),
        gravity: GRAVITY,
        direction: [2.0 * heading.cos(), 2.0 * heading.sin(), 0.0],
    };
    measure(trace, &setting)
}

fn circular(a: f64, b: f64) -> f64 {
    let difference = a - b;
    (difference - difference.round()).abs()
}

#[test]
fn each_named_gait_gives_back_its_name_phases_and_duty_in_any_heading() {
    for (number, template) in templates(4).iter().enumerate() {
        let phases: [f64; 4] = template.phases.try_into().unwrap();
        let heading = 0.9 * number as f64;
        let gait = Gait { heading, ..Gait::new(phases, template.duty_factor) };
        let report = report(&gait.trace(), heading);
        assert_eq!(report.gait.as_deref(), Some(template.name));
        // Sampled every hundredth of the stride: touch-downs are late by at most one sample.
        let resolution = gait.interval / gait.stride;
        assert!(report.distance.unwrap() <= resolution, "{}: {:?}", template.name, report.distance);
        assert!((report.stride_period.unwrap() - gait.stride).abs() < 1e-9);
        // 10 s of half a second each, the first and the last not whole.
        assert!((18..=20).contains(&report.strides), "{}", report.strides);
        for (foot, (name, phase)) in report.feet.iter().zip(LEGS.iter().zip(phases)) {
            assert_eq!(foot.leg.as_deref(), Some(*name));
            assert_eq!(foot.link, format!("{name} shank"));
            assert!(circular(foot.phase.unwrap(), phase) <= resolution, "{} {name}", template.name);
            assert!((foot.duty_factor - template.duty_factor).abs() <= resolution);
        }
        let walks = template.duty_factor >= 0.5;
        assert_eq!(report.regime, Some(if walks { Regime::Walk } else { Regime::Run }));
        for (pair, row) in report.pairs.iter().zip(0..) {
            let expected = circular(phases[row] - phases[row + 2], 0.5);
            assert!((pair.asymmetry - expected).abs() <= 2.0 * resolution, "{pair:?}");
        }
        let spread = report.spread.unwrap();
        assert!(spread.period < resolution && spread.phase < resolution, "{spread:?}");
    }
}

#[test]
fn the_lateral_sequence_walk_steps_hind_then_fore_on_each_side() {
    let report = report(&Gait::new([0.0, 0.75, 0.5, 0.25], 0.75).trace(), 0.0);
    let mut steps: Vec<(f64, &str)> = Vec::new();
    for foot in &report.feet {
        // The first stance of each foot may have begun before the trace.
        steps.extend(foot.stances.iter().skip(1).map(|stance| (stance[0], foot.leg.as_deref().unwrap())));
    }
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let first = steps.iter().position(|&(_, leg)| leg == "LH").unwrap();
    let order: Vec<&str> = steps[first..first + 8].iter().map(|&(_, leg)| leg).collect();
    assert_eq!(order, ["LH", "LF", "RH", "RF", "LH", "LF", "RH", "RF"]);
}

#[test]
fn speed_froude_number_cost_aerial_time_and_slip_follow_their_definitions() {
    let gait = Gait { speed: 1.5, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) };
    let mut trace = gait.trace();
    trace.joint_work = 300.0;
    trace.positive_work = 200.0;
    for contact in trace.samples.iter_mut().flat_map(|sample| &mut sample.contacts) {
        // 3-4-5: half a metre a second along the ground, and a part along the normal that is no slip.
        contact.velocity = Vector3::new(0.3, 0.4, 0.2);
    }
    let report = report(&trace, 0.0);
    assert!((report.speed - 1.5).abs() < 1e-9);
    assert!(report.sideways_speed.abs() < 1e-9);
    // Hips at the height of the root.
    assert!((report.hip_height.unwrap() - synthetic::HEIGHT).abs() < 1e-12);
    assert!((report.froude.unwrap() - 1.5 * 1.5 / (GRAVITY * synthetic::HEIGHT)).abs() < 1e-9);
    let resistance = mass() * GRAVITY * 15.0;
    assert!((report.cost_of_transport.unwrap() - 300.0 / resistance).abs() < 1e-9);
    assert!((report.positive_cost_of_transport.unwrap() - 200.0 / resistance).abs() < 1e-9);
    // Two diagonal pairs, each 0.45 of the stride: 0.1 of it aloft, two samples of a hundred unsure.
    assert!((report.aerial_fraction - 0.1).abs() <= 0.021, "{}", report.aerial_fraction);
    assert!((report.stance_slip - 0.5).abs() < 1e-9);
}

#[test]
fn sideways_travel_counts_as_distance_but_not_as_speed() {
    let gait = Gait { heading: std::f64::consts::FRAC_PI_2, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) };
    let mut trace = gait.trace();
    trace.joint_work = 100.0;
    // Asked to go along +x, it goes along +y.
    let report = report(&trace, 0.0);
    assert!(report.speed.abs() < 1e-9);
    assert!((report.sideways_speed - gait.speed).abs() < 1e-9);
    let expected = 100.0 / (mass() * GRAVITY * gait.speed * gait.seconds);
    assert!((report.cost_of_transport.unwrap() - expected).abs() < 1e-9);
}

#[test]
fn standing_still_and_nothing_at_all_have_figures_but_no_gait() {
    let still = report(&Gait { speed: 0.0, ..Gait::new([0.0; 4], 1.0) }.trace(), 0.0);
    assert_eq!(still.gait.as_deref(), Some("unclassified"));
    assert_eq!((still.stride_period, still.regime, still.cost_of_transport), (None, None, None));
    assert!(still.feet.iter().all(|foot| foot.duty_factor == 1.0 && foot.phase.is_none()));

    let nothing = report(&Trace::default(), 0.0);
    assert_eq!((nothing.strides, nothing.aerial_fraction, nothing.speed), (0, 0.0, 0.0));
    assert!(gait_diagram(&nothing).is_ok());
}

#[test]
fn one_foot_that_never_touches_leaves_the_others_their_phases() {
    let mut trace = Gait::new([0.0, 0.5, 0.5, 0.0], 0.45).trace();
    for sample in &mut trace.samples {
        sample.contacts.retain(|contact| contact.link != foot_link(0));
    }
    let report = report(&trace, 0.0);
    assert_eq!(report.gait.as_deref(), Some("unclassified"));
    assert_eq!(report.feet[0].phase, None);
    // Phases now count from the left hind foot.
    let phases: Vec<f64> = report.feet[1..].iter().map(|foot| foot.phase.unwrap()).collect();
    for (phase, expected) in phases.iter().zip([0.0, 0.0, 0.5]) {
        assert!(circular(*phase, expected) < 0.011, "{phases:?}");
    }
}

#[test]
fn a_foot_that_chatters_has_one_touch_down() {
    let gait = Gait { seconds: 1.0, ..Gait::new([0.5, 0.0, 0.0, 0.5], 0.4) };
    let mut trace = gait.trace();
    let landing = (0.25 / gait.interval) as usize;
    // Down, up for two samples, down for one, up for three, down: 10 and 15 ms aloft.
    for aloft in [1, 2, 4, 5, 6] {
        trace.samples[landing + aloft].contacts.retain(|contact| contact.link != foot_link(0));
    }
    let detection = Detection { threshold: 1.0, debounce: 0.025 };
    let footing = Footing::detect(&trace, foot_link(0), detection);
    assert_eq!(footing.touch_downs, [landing, landing + 100]);
    let plain = Detection { debounce: 0.0, ..detection };
    assert_eq!(Footing::detect(&trace, foot_link(0), plain).touch_downs.len(), 4);
}

proptest! {
    #[test]
    fn names_survive_chatter_stray_touches_and_weak_forces(
        choice in 0..8_usize,
        strays in prop::collection::vec((0..4_usize, 0..2000_usize), 40),
        gaps in prop::collection::vec((0..4_usize, 0..2000_usize), 40),
    ) {
        let template = templates(4)[choice];
        let mut trace = Gait::new(template.phases.try_into().unwrap(), template.duty_factor).trace();
        let solid = trace.samples.iter().flat_map(|sample| &sample.contacts).next().copied().unwrap();
        // Single samples of false contact, and gaps of three samples where a foot stands.
        for (leg, at) in strays {
            let link = foot_link(leg);
            if trace.samples[at].contacts.iter().all(|contact| contact.link != link) {
                trace.samples[at].contacts.push(gaitwright_physics::sim::Contact { link, ..solid });
            }
        }
        for (leg, at) in gaps {
            for sample in trace.samples.iter_mut().skip(at).take(3) {
                sample.contacts.retain(|contact| contact.link != foot_link(leg));
            }
        }
        // A brush of a thousandth of the weight is no stance.
        for sample in &mut trace.samples {
            for leg in 0..4 {
                let force = Vector3::z() * (1e-3 * mass() * GRAVITY);
                let brush = gaitwright_physics::sim::Contact { link: foot_link(leg), force, ..solid };
                sample.contacts.push(brush);
            }
        }
        let report = report(&trace, 0.0);
        prop_assert_eq!(report.gait.as_deref(), Some(template.name));
        for (foot, phase) in report.feet.iter().zip(template.phases) {
            prop_assert!(circular(foot.phase.unwrap(), *phase) < 0.03, "{:?}", foot.phase);
            prop_assert!((foot.duty_factor - template.duty_factor).abs() < 0.05);
        }
    }
}

#[test]
fn validity_counts_what_breaks_the_rules() {
    let gait = Gait { seconds: 5.0, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) };
    let mut trace = gait.trace();
    let joints = synthetic::joint_names().len();
    let samples = trace.samples.len();
    trace.fell_at = Some(3.3);
    for sample in &mut trace.samples {
        sample.angles = vec![0.5; joints];
        sample.targets = vec![0.4; joints];
        sample.torques = vec![1.0; joints];
    }
    trace.samples[10].angles[3] = 2.0;
    trace.samples[10].targets[3] = 2.0 - 0.1;
    trace.samples[20].torques[0] = -20.0;
    trace.samples[30].torques[1] = 1e6;
    trace.samples[0].contacts[0].depth = 0.004;
    let mut limits = vec![Some([-1.8, 1.8]); joints];
    limits[5] = None;
    let mut torques = vec![Some(20.0); joints];
    torques[1] = None;
    let validity = validity(&trace, &limits, &torques, gait.stride);
    assert!((validity.greatest_limit_violation - 0.2).abs() < 1e-12);
    assert!((validity.tracking_error - 0.1).abs() < 1e-12);
    assert!((validity.greatest_penetration - 0.004).abs() < 1e-12);
    assert!((validity.torque_saturation - 1.0 / (samples * (joints - 1)) as f64).abs() < 1e-12);
    assert_eq!(validity.upright_cycles, 6);
    assert_eq!(validity.foot_slip, 0.0);
    assert!(!validity.valid, "it fell");
}

#[test]
fn a_motion_with_unsolved_steps_is_not_valid() {
    let gait = Gait { seconds: 2.0, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) };
    let mut trace = gait.trace();
    let joints = synthetic::joint_names().len();
    let judged = |trace: &Trace| validity(trace, &vec![None; joints], &vec![None; joints], gait.stride);
    assert!(judged(&trace).valid);
    trace.record = StepRecord {
        greatest_residual: 0.25,
        unsolved_steps: 3,
        divided_steps: 40,
        coarse_steps: 2,
        greatest_substeps: 17,
        greatest_penetration: 0.02,
    };
    let found = judged(&trace);
    assert!(!found.valid);
    let record = StepRecord {
        greatest_residual: found.greatest_residual,
        unsolved_steps: found.unsolved_steps,
        divided_steps: found.divided_steps,
        coarse_steps: found.coarse_steps,
        greatest_substeps: found.greatest_substeps,
        greatest_penetration: found.greatest_penetration,
    };
    assert_eq!(record, trace.record);
    trace.record.unsolved_steps = 0;
    assert!(judged(&trace).valid, "divided steps alone are not a fault");
}

#[test]
fn the_diagram_has_a_bar_for_every_stance_it_shows() {
    let report = report(&Gait::new([0.0, 0.75, 0.5, 0.25], 0.75).trace(), 0.0);
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
    let mut report = report(&Gait::new([0.0; 4], 0.4).trace(), 0.0);
    report.feet[0].link = "<script>&\"'".into();
    report.feet[1].link = "ein sehr langer Name für ein Bein".into();
    let svg = gait_diagram(&report).unwrap();
    roxmltree::Document::parse(&svg).unwrap();
    assert!(!svg.contains("<script>"));
}

#[test]
fn the_report_and_the_curve_are_documents() {
    let report = report(&Gait::new([0.0, 0.5, 0.5, 0.0], 0.45).trace(), 0.0);
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
    let diagram = |phases: [f64; 4]| gait_diagram(&report(&Gait::new(phases, 0.75).trace(), 0.0)).unwrap();
    let walk = diagram([0.0, 0.75, 0.5, 0.25]);
    assert_eq!(diagram([0.0, 0.75, 0.5, 0.25]), walk);
    assert_ne!(diagram([0.0, 0.5, 0.5, 0.0]), walk);
    if let Ok(path) = std::env::var("SCRATCH_SVG") {
        std::fs::write(path, walk).unwrap();
    }
}
