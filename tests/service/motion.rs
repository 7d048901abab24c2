//! Splines, players and the motion document.

use std::sync::Arc;

use crate::synthetic;

use gaitwright::export::{self, Performance};
use gaitwright_learning::gait::{GaitContext, measure};
use gaitwright_learning::learn::{Behaviour, Posture};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::{
    Motion, Player, Playing, RootAdvance, RootMotion, TargetLimits, hermite, hermite_range, hermite_rate,
};
use gaitwright_physics::sim::Root;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use serde_json::{Value, json};
use synthetic::Gait;

fn knot() -> impl Strategy<Value = (f64, f64)> {
    (-3.0..3.0_f64, -20.0..20.0_f64)
}

proptest! {
    #[test]
    fn a_spline_has_the_values_and_rates_of_its_ends(from in knot(), to in knot(), duration in 0.02..2.0_f64) {
        prop_assert!((hermite(from, to, duration, 0.0) - from.0).abs() < 1e-12);
        prop_assert!((hermite(from, to, duration, duration) - to.0).abs() < 1e-12);
        prop_assert!((hermite_rate(from, to, duration, 0.0) - from.1).abs() < 1e-9);
        prop_assert!((hermite_rate(from, to, duration, duration) - to.1).abs() < 1e-9);
    }

    /// The rate against central differences, whose error for a cubic is exactly the third derivative's.
    #[test]
    fn the_rate_is_the_derivative(from in knot(), to in knot(), duration in 0.1..2.0_f64, share in 0.05..0.95_f64) {
        let (t, h) = (share * duration, 1e-4 * duration);
        let slope = (hermite(from, to, duration, t + h) - hermite(from, to, duration, t - h)) / (2.0 * h);
        let third = (12.0 * (from.0 - to.0) / duration + 6.0 * (from.1 + to.1)) / duration.powi(2);
        let rate = hermite_rate(from, to, duration, t);
        prop_assert!((slope - third * h * h / 6.0 - rate).abs() < 1e-6 * (1.0 + rate.abs()), "{slope} {rate}");
    }

    /// The exact range holds every sampled value and is reached by one of them, up to the sampling.
    #[test]
    fn the_range_is_that_of_dense_samples(from in knot(), to in knot(), duration in 0.02..2.0_f64) {
        let (least, greatest) = hermite_range(from, to, duration);
        let values = (0..=4000).map(|index| hermite(from, to, duration, duration * f64::from(index) / 4000.0));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            low = low.min(value);
            high = high.max(value);
        }
        prop_assert!(least <= low + 1e-12 && high <= greatest + 1e-12);
        prop_assert!(low - least < 1e-4 && greatest - high < 1e-4, "{least}..{greatest}, seen {low}..{high}");
    }

    /// Applying an advance leads from a start to the end it was measured by, whatever both are.
    #[test]
    fn a_root_advance_leads_to_where_it_was_measured(
        start in (prop::array::uniform3(-5.0..5.0_f64), -3.0..3.0_f64),
        end in (prop::array::uniform3(-5.0..5.0_f64), -3.0..3.0_f64),
    ) {
        let root = |(position, yaw): ([f64; 3], f64)| RootMotion {
            position,
            orientation: [(yaw / 2.0).cos(), 0.0, 0.0, (yaw / 2.0).sin()],
            linear_velocity: [yaw.cos(), yaw.sin(), 0.0],
            angular_velocity: [0.0; 3],
        };
        let (start, end) = (root(start), root(end));
        let reached = RootAdvance::between(&start, &end).apply(&start);
        for axis in 0..3 {
            prop_assert!((reached.position[axis] - end.position[axis]).abs() < 1e-9);
            prop_assert!((reached.linear_velocity[axis] - end.linear_velocity[axis]).abs() < 1e-9);
        }
    }
}

/// Two joints without limits.
const FREE: [TargetLimits; 2] = [TargetLimits::NONE; 2];

/// A motion of two joints: from standing through one keyframe into a loop of two.
fn document() -> Value {
    let root = |x: f64| json!({ "position": [x, 0, 0.3], "orientation": [1, 0, 0, 0] });
    json!({
        "format": "gaitwright/motion@1",
        "character": { "name": "two", "digest": "sha256:0" },
        "joints": ["a", "b"],
        "interpolation": "cubic-hermite",
        "keyframes": [
            { "time": 0.0, "angles": [0.2, -0.1], "velocities": [1.0, 0.5], "root": root(0.1) },
            { "time": 0.25, "angles": [-0.3, 0.4], "velocities": [-1.0, 0.0], "root": root(0.2) },
            { "time": 0.5, "angles": [0.2, -0.1], "velocities": [1.0, 0.5], "root": root(0.3) },
        ],
        "loop": { "start": 0.0, "end": 0.5, "root_advance": { "translation": [0.2, 0, 0], "yaw": 0.0 } },
        "entry": [
            { "time": 0.0, "angles": [0.0, 0.0], "velocities": [0.0, 0.0], "root": root(0.0) },
            { "time": 0.25, "angles": [0.2, -0.1], "velocities": [1.0, 0.5], "root": root(0.1) },
        ],
        "drive": { "stiffness": [50, 60], "damping": [1, 2], "max_torque": [10, null], "feedforward": "none" },
        "metrics": {
            "speed": 0.4, "upright_seconds": 20, "cost_of_transport": null, "froude": null,
            "gait": "unclassified", "duty_factors": {},
            "validity": { "torque_saturation": 0, "greatest_limit_violation": 0, "greatest_penetration": 0,
                          "foot_slip": 0, "tracking_error": 0, "upright_cycles": 40 },
        },
        "scene": {},
        "provenance": { "program": "gaitwright", "version": "0", "seed": 1, "learning": {}, "task": {},
                        "accuracy": {}, "effects": {} },
    })
}

fn parse(document: &Value) -> Result<Motion, InputError> {
    Motion::parse(document.to_string().as_bytes())
}

#[test]
fn a_document_is_read_and_written_to_the_same_motion() {
    let motion = parse(&document()).unwrap();
    assert_eq!(Motion::parse(motion.to_json().unwrap().as_bytes()).unwrap(), motion);
}

#[test]
fn a_player_goes_through_the_entry_once_and_round_the_loop_for_ever() {
    let motion = parse(&document()).unwrap();
    let player = Player::new(&motion, &["b".to_owned(), "a".to_owned()], &FREE).unwrap();
    assert_eq!((player.lead(), player.period()), (0.25, 0.5));
    let at = |t: f64| {
        let mut angles = [f64::NAN; 2];
        player.targets(t, &mut angles);
        angles
    };
    // Targets stand in the order asked for.
    assert_eq!(at(0.0), [0.0, 0.0]);
    for turn in 0..5 {
        let start = 0.25 + 0.5 * f64::from(turn);
        for (t, wanted) in [(start, [-0.1, 0.2]), (start + 0.25, [0.4, -0.3])] {
            let found = at(t);
            assert!(
                (found[0] - wanted[0]).abs() < 1e-12 && (found[1] - wanted[1]).abs() < 1e-12,
                "{found:?} at {t}"
            );
        }
        let middle = hermite((-0.1, 0.5), (0.4, 0.0), 0.25, 0.1);
        assert!((at(start + 0.1)[0] - middle).abs() < 1e-9);
    }
}

#[test]
fn postures_are_played_as_the_document_made_of_them() {
    let motion = parse(&document()).unwrap();
    let names = motion.joints.clone();
    let of_document = Player::new(&motion, &names, &FREE).unwrap();
    let cycle = motion.keyframes[..2].iter().map(|key| (&key.angles[..], &key.velocities[..]));
    let of_postures = Player::from_postures(&[0.0, 0.0], std::iter::empty(), cycle, 0.25);
    for index in 0..2000 {
        let t = 0.0013 * f64::from(index);
        let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
        of_document.targets(t, &mut a);
        of_postures.targets(t, &mut b);
        assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12, "{t}");
    }
}

/// The same, leaning in joint a and back in b where it has turned to the right.
fn steered() -> Value {
    let change = |a: f64, b: f64| json!({ "angles": [a, b], "velocities": [0.0, 2.0 * b] });
    let mut document = document();
    document["steering"] = json!({
        "direction": [1, 0],
        "tables": [{
            "measure": "heading",
            "bounds": [-0.1],
            "rings": [[change(0.1, -0.2), change(0.0, 0.3)], [change(0.0, 0.0), change(0.0, 0.0)]],
        }],
    });
    document
}

#[test]
fn steering_is_read_written_and_played_in_the_order_of_the_joints() {
    let motion = parse(&steered()).unwrap();
    assert_eq!(Motion::parse(motion.to_json().unwrap().as_bytes()).unwrap(), motion);
    let player = Player::new(&motion, &["b".to_owned(), "a".to_owned()], &FREE).unwrap();
    let root = |heading: f64| Root {
        position: Point3::origin(),
        orientation: UnitQuaternion::from_scaled_axis(Vector3::z() * heading),
        linear_velocity: Vector3::zeros(),
        angular_velocity: Vector3::zeros(),
    };
    let mut playing = Playing::new(&player, &root(0.0));
    let mut at = |t: f64, heading: f64| {
        let mut angles = [f64::NAN; 2];
        playing.targets(&player, t, &root(heading), &mut angles);
        angles
    };
    at(0.0, 0.0);
    assert_eq!(at(0.25, -0.2), [-0.1, 0.2], "it did not turn before");
    let [b, a] = at(0.5, 0.0);
    assert!((b - (0.4 + 0.3)).abs() < 1e-12 && (a + 0.3).abs() < 1e-12, "{b}, {a}");
    let [b, a] = at(0.6, 0.0);
    let wanted = hermite((0.7, 0.6), (-0.1, 0.5), 0.25, 0.1);
    assert!((b - wanted).abs() < 1e-12, "{b} is not {wanted}");
    assert!((a - hermite((-0.3, -1.0), (0.2, 1.0), 0.25, 0.1)).abs() < 1e-12);
}

#[test]
fn faults_of_steering_are_named() {
    let mut faulty = steered();
    faulty["steering"]["direction"] = json!([1, 1]);
    let table = &mut faulty["steering"]["tables"][0];
    table["bounds"] = json!([0.1, 0.1]);
    table["rings"][1] = json!([{ "angles": [0.0, 0.0], "velocities": [0.0] }]);
    let InputError::Impossible(faults) = parse(&faulty).unwrap_err() else { panic!("well-formed") };
    for place in [
        "direction",
        "tables/0/bounds",
        "tables/0/rings",
        "tables/0/rings/1",
        "tables/0/rings/1/0/velocities",
    ] {
        let place = format!("/steering/{place}");
        assert!(faults.iter().any(|fault| fault.pointer == place), "{place} is not among {faults:?}");
    }
    // What one ring could add takes joint b out of a range that its keyframes keep to.
    let motion = parse(&steered()).unwrap();
    let within = |most: f64| {
        let limits = [TargetLimits::NONE, TargetLimits { range: Some([-2.0, most]), speed: None }];
        Player::new(&motion, &motion.joints, &limits)
    };
    // The greatest of b's spline is 0.4 and something; the changes at its ends are 0.2 and 0.3, with rates of 0.4 and 0.6.
    assert!(within(0.9).is_ok());
    let InputError::Impossible(faults) = within(0.6).unwrap_err() else { panic!("well-formed") };
    assert_eq!(faults.len(), 1);
    assert!(faults[0].pointer == "/steering" && faults[0].reason.contains("\"b\""), "{faults:?}");
}

#[test]
fn every_fault_of_a_document_is_named() {
    let mut faulty = document();
    faulty["keyframes"][1]["angles"] = json!([0.0]);
    faulty["keyframes"][2]["time"] = json!(0.2);
    faulty["drive"]["damping"] = json!([1, -2]);
    faulty["joints"][1] = json!("a");
    // Finite, but no 32-bit number, as exports have them.
    faulty["keyframes"][1]["root"]["position"][0] = json!(1e40);
    faulty["scene"]["ground"] = json!({ "kind": "plane", "height": 1e16 });
    let InputError::Impossible(faults) = parse(&faulty).unwrap_err() else { panic!("well-formed") };
    for place in [
        "/keyframes/1/angles",
        "/keyframes/1/root/position/0",
        "/keyframes/2/time",
        "/drive/damping/1",
        "/joints/1",
        "/scene/ground/height",
    ] {
        assert!(faults.iter().any(|fault| fault.pointer == place), "{place} is not among {faults:?}");
    }
}

#[test]
fn a_loop_has_to_close() {
    let mut open = document();
    open["keyframes"][2]["angles"] = json!([0.2, -0.2]);
    assert!(parse(&open).is_err());
    let mut off = document();
    off["loop"]["end"] = json!(0.4);
    assert!(parse(&off).is_err());
}

#[test]
fn unknown_fields_and_other_formats_are_refused_by_name() {
    let mut unknown = document();
    unknown["keyframes"][0]["colour"] = json!("red");
    let message = parse(&unknown).unwrap_err().to_string();
    assert!(message.contains("colour") && message.contains("/keyframes/0"), "{message}");
    let mut other = document();
    other["format"] = json!("gaitwright/motion@2");
    assert!(parse(&other).unwrap_err().to_string().contains("/format"));
    assert!(matches!(Motion::parse(b"{"), Err(InputError::Malformed(_))));
}

#[test]
fn a_player_names_the_joints_that_do_not_match() {
    let motion = parse(&document()).unwrap();
    let message = Player::new(&motion, &["a".to_owned(), "c".to_owned()], &FREE).unwrap_err().to_string();
    assert!(message.contains("\"c\"") && message.contains("\"b\""), "{message}");
}

/// A trot whose root sinks, rolls over slowly and starts too high.
fn sinking(heading: f64) -> gaitwright_physics::playback::Trace {
    let mut trace = Gait { heading, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) }.trace();
    for sample in &mut trace.samples {
        let (t, root) = (sample.time, &mut sample.root);
        root.position.z += 0.08 * (-2.0 * t).exp() - 0.02 * t;
        root.linear_velocity.z = -0.16 * (-2.0 * t).exp() - 0.02;
        root.orientation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.03 * t) * root.orientation;
        root.angular_velocity.x = 0.03;
    }
    trace
}

fn assert_same(found: &RootMotion, wanted: &RootMotion) {
    let numbers = |root: &RootMotion| {
        let RootMotion { position, orientation, linear_velocity, angular_velocity } = *root;
        let sign = orientation[0].signum();
        [&position[..], &orientation.map(|q| q * sign), &linear_velocity, &angular_velocity].concat()
    };
    for (found, wanted) in numbers(found).into_iter().zip(numbers(wanted)) {
        assert!((found - wanted).abs() < 1e-12, "{found} instead of {wanted}");
    }
}

#[test]
fn a_published_loop_closes_on_level_ground_and_the_entry_joins_it() {
    let (plain, heading) = (parse(&document()).unwrap(), 0.3);
    let (trace, character, joints) = (sinking(heading), synthetic::quadruped(), synthetic::joint_names());
    let standing = vec![0.0; joints.len()];
    let posture = |angle: f64| Posture { angles: vec![angle; 8], velocities: vec![1.0; 8] };
    let behaviour = Behaviour {
        fitness: 0.0,
        generation: 0,
        transition_time: 0.25,
        entry: vec![posture(0.3)],
        cycle: vec![posture(0.1), posture(0.2)],
        steering: None,
    };
    let model = Model::new(Arc::new(character.clone()), Base::Floating);
    let setting = GaitContext {
        model: &model,
        support: &[2, 4, 6, 8],
        standing: &trace.samples[0].link_poses,
        ground: 0.0,
        mass: synthetic::mass(),
        gravity: synthetic::GRAVITY,
        direction: [1.0, 0.0, 0.0],
    };
    let made = |scene: &gaitwright_physics::scene::Scene| {
        export::motion(&Performance {
            character: &character,
            joints: &joints,
            standing: &standing,
            behaviour: &behaviour,
            trace: &trace,
            gait: &measure(&trace, &setting),
            validity: &plain.metrics.validity,
            scene,
            drive: &gaitwright_physics::scene::Gains {
                stiffness: vec![1.0; 8],
                damping: vec![1.0; 8],
                max_torque: vec![None; 8],
                ..plain.drive.clone()
            },
            provenance: &plain.provenance,
        })
        .unwrap()
    };
    let motion = made(&plain.scene);
    motion.to_json().unwrap();
    let advance = motion.cycle.root_advance;
    assert_eq!(advance.translation[2], 0.0);
    assert!((advance.translation[0] - 0.4).abs() < 1e-4, "0.8 m/s for half a second: {advance:?}");
    let (first, last) = (&motion.keyframes[0], motion.keyframes.last().unwrap());
    assert_same(&last.root, &advance.apply(&first.root));
    assert_same(&motion.entry.last().unwrap().root, &first.root);
    assert_same(&motion.entry[0].root, &RootMotion::from(&trace.samples[0].root));

    // The dense poses close as well, and go evenly.
    let poses = motion.poses.as_ref().unwrap();
    let end = advance.apply(&first.root).position;
    assert!((0..3).all(|axis| (poses.last().unwrap().root.position[axis] - end[axis]).abs() < 1e-9));
    let steps = poses.windows(2).map(|pair| (pair[1].root.position[2] - pair[0].root.position[2]).abs());
    assert!(steps.fold(0.0, f64::max) < 1e-3);

    // Half a second of sinking and rolling over had to be made up for, and the height that the entry had lost.
    let adjusted = motion.metrics.validity.root_adjustment;
    assert!((0.02..0.2).contains(&adjusted.translation), "{adjusted:?}");
    assert!((0.015..0.4).contains(&adjusted.rotation), "{adjusted:?}");
    let targets: Vec<f64> = motion.keyframes.iter().map(|keyframe| keyframe.angles[0]).collect();
    assert_eq!(targets, [0.1, 0.2, 0.1]);

    // Where something may lead down, it does.
    let free = made(&gaitwright_physics::scene::Scene { ground: None, ..plain.scene.clone() });
    assert!((free.cycle.root_advance.translation[2] + 0.01).abs() < 2e-3, "{:?}", free.cycle.root_advance);
}
