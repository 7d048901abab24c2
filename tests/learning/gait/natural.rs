//! Whether motions are natural: a trot by construction that is, and for every measure one that breaks it and no other.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;

use gaitwright_learning::gait::{GaitContext, GaitReport, NaturalnessContext, judge, least_travel, measure};
use gaitwright_physics::character::{Character, Limits};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::{MeasureLimit, NaturalnessMeasure};
use gaitwright_physics::playback::{Sample, Trace};
use gaitwright_physics::scene::ActuatorLimits;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::SUPPORT;
use crate::synthetic::{GRAVITY, Gait, foot_link, mass, quadruped, settle_loads};

/// A trot at Froude number 0.18 on legs that are extended to 0.85 of their length.
fn trot() -> Gait {
    Gait { height: 0.36, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) }
}

/// A motion about to be judged.
struct Case {
    character: Character,
    support: Vec<usize>,
    trace: Trace,
    standing: Vec<Isometry3<f64>>,
    direction: [f64; 3],
    speed: Option<f64>,
    asked: Option<&'static str>,
    /// Of one round of the loop, s.
    period: f64,
}

impl Case {
    /// The gait at a cost of transport of 0.3, with the speed asked for that it has.
    fn new(gait: Gait) -> Self {
        let mut trace = gait.trace();
        trace.joint_work = 0.3 * mass() * GRAVITY * gait.speed * gait.seconds;
        Self {
            character: with_motors(),
            support: SUPPORT.to_vec(),
            trace,
            standing: Gait { speed: 0.0, ..gait }.sample(0.1 * gait.stride).link_poses,
            direction: [1.0, 0.0, 0.0],
            speed: Some(gait.speed),
            asked: None,
            period: gait.stride,
        }
    }

    fn judged(&self) -> GaitReport {
        let model = Model::new(Arc::new(self.character.clone()), Base::Floating);
        let gait = GaitContext {
            model: &model,
            support: &self.support,
            standing: &self.standing,
            ground: 0.0,
            mass: mass(),
            gravity: GRAVITY,
            direction: self.direction,
        };
        let actuators = vec![ActuatorLimits { torque: 20.0, speed: 20.0 }; 8];
        let (speed, period) = (self.speed, self.period);
        let mut report = measure(&self.trace, &gait);
        let asked = self.asked;
        let context = NaturalnessContext { gait, actuators: &actuators, speed, asked, period };
        judge(&self.trace, &mut report, &context);
        report
    }

    /// The measures that do not hold.
    fn broken(&self) -> Vec<String> {
        let report = self.judged();
        let measures = &report.naturalness;
        for (name, measure) in measures {
            assert_eq!(measure.limit.judge(measure.value), *measure, "{name}");
        }
        let broken: Vec<String> =
            measures.iter().filter(|(_, measure)| !measure.holds).map(|(name, _)| name.clone()).collect();
        assert_eq!(report.natural, broken.is_empty());
        broken
    }

    fn each(mut self, change: impl Fn(f64, &mut Sample)) -> Self {
        for sample in &mut self.trace.samples {
            change(sample.time, sample);
        }
        self
    }

    /// The motion with other legs at every time.
    fn by(mut self, gait: impl Fn(f64) -> (Gait, f64)) -> Self {
        for sample in &mut self.trace.samples {
            let time = sample.time;
            let (gait, at) = gait(time);
            *sample = gait.sample(at);
            sample.time = time;
        }
        self
    }
}

/// The quadruped with joints of at most 20 rad/s.
fn with_motors() -> Character {
    let mut character = quadruped();
    for joint in character.links.iter_mut().filter_map(|link| link.joint.as_mut()) {
        joint.velocity = Some(20.0);
    }
    character
}

/// Tilts the root of a sample about an axis.
fn tilt(sample: &mut Sample, axis: Vector3<f64>, angle: f64) {
    sample.root.orientation = UnitQuaternion::from_scaled_axis(axis * angle) * sample.root.orientation;
}

/// Every measure of a trot, and a motion that breaks it.
fn one_for_each_measure() -> Vec<(&'static str, Case)> {
    let plain = || Case::new(trot());
    let of = |gait: Gait| Case::new(gait);
    let walk = Gait { height: 0.36, ..Gait::new([0.0, 0.75, 0.5, 0.25], 0.7) };
    let wave = |time: f64| (2.0 * PI * time / trot().stride).sin();
    let mut cases: Vec<(&'static str, Case)> = vec![
        // Half-way between a trot and a walk in diagonal sequence.
        ("named", of(Gait { phases: [0.0, 0.36, 0.5, 0.86], ..trot() })),
        ("strides", of(Gait { seconds: 4.0, ..trot() })),
        // A walk on the spot, at a sixth of the speed that is a way at all.
        ("travel", of(Gait { speed: 0.003, ..walk })),
        ("speed", Case { speed: Some(1.0), ..plain() }),
        ("asked_gait", Case { asked: Some("pace"), ..plain() }),
        ("drift", Case { direction: [0.1_f64.cos(), 0.1_f64.sin(), 0.0], ..plain() }),
        ("froude", of(Gait { speed: 0.3, ..trot() })),
        ("duty_factor", of(Gait { duty: 0.3, ..trot() })),
        ("clearance", of(Gait { lift: 0.006, ..trot() })),
        ("extension", of(Gait { height: 0.3, ..trot() })),
        ("symmetry", of(Gait { phases: [0.0, 0.5, 0.57, 0.07], ..trot() })),
        ("pitch", plain().each(|time, sample| tilt(sample, Vector3::y(), 0.1 * wave(time)))),
        ("roll", plain().each(|time, sample| tilt(sample, Vector3::x(), 0.1 * wave(time)))),
        ("heave", plain().each(|time, sample| sample.root.position.z += 0.03 * wave(time))),
        // Feet that slide by an eighth of the speed.
        (
            "slip",
            plain().each(|_, sample| {
                sample.contacts.iter_mut().for_each(|contact| contact.velocity = Vector3::new(0.1, 0.0, 0.3));
            }),
        ),
        // A tremor.
        ("smoothness", plain().each(|time, sample| sample.angles[2] += 0.2 * (16.0 * PI * time / 0.5).sin())),
        // Strides of 0.475 and 0.525 s in turn; each leg at the same share of them.
        ("period_spread", plain().by(|time| (trot(), time + 0.0125 * (PI * time / 0.5).cos()))),
        // One leg strays by 0.035 of a stride to either side, over ten strides.
        (
            "phase_spread",
            plain().by(|time| {
                let late = 0.035 * (2.0 * PI * time / 5.0).sin();
                (Gait { phases: [0.0, 0.5, 0.5, late], ..trot() }, time)
            }),
        ),
    ];
    let mut fallen = plain();
    fallen.trace.fell_at = fallen.trace.samples.last().map(|sample| sample.time);
    cases.push(("upright", fallen));
    let mut costly = plain();
    costly.trace.joint_work *= 2.0;
    cases.push(("cost_of_transport", costly));
    let mut tilted = plain();
    tilt(&mut tilted.trace.samples[333], Vector3::x(), 0.4);
    cases.push(("tilt", tilted));
    let mut low = plain();
    low.trace.samples[333].root.position.z *= 0.6;
    cases.push(("height", low));
    let mut knee = plain();
    knee.trace.samples[333].loads[3] = 0.05 * mass() * GRAVITY;
    cases.push(("scuffing", knee));
    // Every foot lands with six times its usual force for 10 ms.
    let mut hard = plain();
    for at in 1..hard.trace.samples.len() {
        for leg in 0..4 {
            let link = foot_link(leg);
            let landed = (1..=2).any(|ago| at >= ago && hard.trace.samples[at - ago].loads[link] == 0.0);
            for contact in &mut hard.trace.samples[at].contacts {
                if contact.link == link && landed {
                    contact.force *= 6.0;
                }
            }
        }
    }
    settle_loads(&mut hard.trace);
    cases.push(("peak_force", hard));
    let mut strained = plain();
    for sample in strained.trace.samples.iter_mut().step_by(20) {
        sample.torques.fill(-20.0);
    }
    cases.push(("torque_saturation", strained));
    let mut fast = plain();
    fast.trace.samples[333].velocities[5] = -21.0;
    cases.push(("joint_speed", fast));
    cases
}

#[test]
fn a_natural_trot_is_natural_by_every_measure() {
    let report = Case { asked: Some("trot"), ..Case::new(trot()) }.judged();
    assert!(report.natural, "{:#?}", report.naturalness);
    assert_eq!(report.gait.as_deref(), Some("trot"));
    let value = |name: &str| report.naturalness[name].value;
    // By construction: hips at 0.36 m, balls of 2 cm on legs of 0.4 m, and half of the weight on a foot that carries a
    // quarter of it in the mean, less what the tenth of the time aloft takes.
    assert!((value("extension") - 0.34 / 0.4).abs() < 2e-3, "{}", value("extension"));
    assert!((value("clearance") - 0.06 / 0.36).abs() < 2e-3);
    assert!((value("peak_force") - 2.0 / PI).abs() < 0.02, "{}", value("peak_force"));
    assert!((value("froude") - 0.64 / (GRAVITY * 0.36)).abs() < 1e-9);
    assert!((value("travel") - 0.8 / (GRAVITY * 0.36).sqrt()).abs() < 1e-9);
    assert!((value("cost_of_transport") - 0.3).abs() < 1e-9 && (value("speed") - 1.0).abs() < 1e-9);
    assert_eq!((value("scuffing"), value("slip"), value("torque_saturation")), (0.0, 0.0, 0.0));
}

#[test]
fn every_measure_has_a_motion_that_breaks_it_and_no_other() {
    let cases = one_for_each_measure();
    let tried: BTreeSet<String> = cases.iter().map(|(name, _)| (*name).to_owned()).collect();
    let asked = Case { asked: Some("trot"), ..Case::new(trot()) };
    let measures: BTreeSet<String> = asked.judged().naturalness.into_keys().collect();
    assert_eq!(tried, measures);
    let wrong: Vec<String> = cases
        .iter()
        .filter(|(name, case)| case.broken() != [*name])
        .map(|(name, case)| {
            let report = case.judged();
            let values: Vec<String> = case
                .broken()
                .iter()
                .chain([&(*name).to_owned()])
                .map(|name| format!("{name} {:?}", report.naturalness.get(name)))
                .collect();
            format!("{name}: {} {:?}", values.join(", "), report.unnamed_because)
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// One foot of a trot that touches down once a fifth of a stride late stumbles: the gait keeps its name, and is not regular.
#[test]
fn a_stumble_leaves_a_gait_its_name_and_is_not_natural() {
    let stumble = Case::new(trot()).by(|time| {
        let late = if (5.0..5.5).contains(&time) { 0.2 } else { 0.0 };
        (Gait { phases: [0.0, 0.5, 0.5, late], ..trot() }, time)
    });
    let report = stumble.judged();
    assert_eq!(report.gait.as_deref(), Some("trot"), "{:?}", report.unnamed_because);
    // Circular standard deviation of n touch-downs of which one is d of a stride beside the others. One sample is a hundredth of a
    // stride, of which the deviation changes by a quarter at most.
    let count = f64::from(report.feet[3].strides);
    let turn = 2.0 * PI * 0.2_f64;
    let length = (count - 1.0 + turn.cos()).hypot(turn.sin()) / count;
    let spread = report.naturalness["phase_spread"];
    let expected = (-2.0 * length.ln()).sqrt() / (2.0 * PI);
    assert!((spread.value - expected).abs() < 2.5e-3, "{spread:?}, not {expected}");
    assert!(!spread.holds && !report.natural);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Trots of many speeds, strides and heights, in any direction, are natural.
    #[test]
    fn trots_within_all_limits_are_natural(
        speed in 0.65..1.1_f64,
        duty in 0.4..0.5_f64,
        stride in 0.4..0.6_f64,
        height in 0.35..0.37_f64,
        lift in 0.03..0.08_f64,
        heading in -3.0..3.0_f64,
    ) {
        let gait = Gait { speed, duty, stride, height, lift, heading, ..trot() };
        let case = Case { direction: [heading.cos(), heading.sin(), 0.0], ..Case::new(gait) };
        prop_assert_eq!(case.broken(), Vec::<String>::new());
    }

    /// Peak force, mean share and duty factor as they are defined: a half-sine has 1 however long and strong it is, less what
    /// its own measurement takes. A stance is seen from where the force exceeds the threshold, and to whole samples; the mean
    /// over the time constant τ lowers a sine of the angular frequency ω as a filter of first order does.
    #[test]
    fn a_half_sine_of_force_has_the_usual_peak(duty in 0.3..0.6_f64, strength in 0.2..3.0_f64) {
        let gait = Gait { duty, ..trot() };
        let mut case = Case::new(gait);
        let weight = mass() * GRAVITY;
        for sample in &mut case.trace.samples {
            for leg in 0..4 {
                let part = (sample.time / gait.stride - gait.phases[leg] + 1e-9).rem_euclid(1.0) / duty;
                let force = if part < 1.0 { strength * weight * (PI * part).sin() } else { 0.0 };
                sample.loads[foot_link(leg)] = force;
            }
        }
        let peak = case.judged().naturalness["peak_force"].value;
        let stance = duty * gait.stride;
        let seen = 1.0 - 2.0 / PI * (0.01 / strength).asin();
        let unit_time = (gait.height / GRAVITY).sqrt();
        let (memory, turn) = ((-gait.interval / (0.05 * unit_time)).exp(), PI * gait.interval / stance);
        let gain = (1.0 - memory) / (1.0 - 2.0 * memory * turn.cos() + memory * memory).sqrt();
        // The count of samples is off by less than one. The highest sample is within half of one of the peak, and the sum
        // over the samples differs from the integral by at most (ω interval)² / 8 as well.
        let bound = gait.interval / (stance * seen) + turn * turn / 4.0;
        prop_assert!((peak / (gain * seen) - 1.0).abs() < bound, "{} of {}", peak, gain * seen);
    }
}

/// How smooth a walk is whose joints all follow `course` over the part of the stride, 0 to 1, on feet that stand for `duty` of it.
fn smoothness(duty: f64, course: impl Fn(f64) -> f64) -> NaturalnessMeasure {
    let walk = Gait { height: 0.36, speed: 0.4, ..Gait::new([0.0, 0.75, 0.5, 0.25], duty) };
    let case = Case::new(walk).each(|time, sample| sample.angles.fill(course((time / walk.stride).fract())));
    case.judged().naturalness["smoothness"]
}

/// The longer feet stand, the shorter is the swing into which a joint has to put its motion: one that swings as smoothly as it can is
/// smooth at every duty factor of a walk, one that trembles at none, not even if it trembles in its swing alone.
#[test]
fn a_short_swing_is_smooth_and_a_tremor_is_not() {
    for duty in [0.55, 0.6, 0.65, 0.7, 0.75, 0.8] {
        let swing = 1.0 - duty;
        let lift = |part: f64| if part < swing { 1.0 - (2.0 * PI * part / swing).cos() } else { 0.0 };
        let smooth = smoothness(duty, lift);
        assert!(smooth.holds, "{duty}: {}", smooth.value);
        let trembling = smoothness(duty, |part| lift(part) + 0.5 * (2.0 * PI * 8.0 * part).sin());
        assert!(!trembling.holds, "{duty}: {}", trembling.value);
        let twitching = smoothness(duty, |part| lift(part) * (6.0 * PI * part / swing).cos());
        assert!(!twitching.holds, "{duty}: {}", twitching.value);
    }
}

/// What lies on its trunk has no feet: it is judged by what does not need any, and may be natural without a name.
#[test]
fn what_lies_on_its_root_is_judged_without_feet() {
    // Two and four feet would have names.
    for support in [vec![0, 2], vec![0, 2, 4, 6]] {
        let report = Case { support, ..Case::new(trot()) }.judged();
        assert!(report.natural && report.gait.is_none(), "{:#?}", report.naturalness);
    }
    let mut case = Case { support: vec![0, 2, 4], ..Case::new(trot()) };
    let report = case.judged();
    assert!(report.natural && report.gait.is_none(), "{:#?}", report.naturalness);
    let names: Vec<&str> = report.naturalness.keys().map(String::as_str).collect();
    let expected = [
        "cost_of_transport",
        "drift",
        "joint_speed",
        "smoothness",
        "speed",
        "strides",
        "tilt",
        "torque_saturation",
        "travel",
        "travel_spread",
        "upright",
    ];
    assert_eq!(names, expected);
    assert!((report.naturalness["strides"].value - 20.0).abs() < 1e-9);
    // Rounds of 0.42 and 0.38 m in turn.
    for sample in &mut case.trace.samples {
        sample.center_of_mass.x -= 0.01 * (2.0 * PI * sample.time).cos();
    }
    let spread = case.judged().naturalness["travel_spread"];
    assert!((spread.value - 0.02 / 0.4).abs() < 1e-9 && !spread.holds, "{spread:?}");
}

/// The length of a leg is what its ranges of motion allow: with the knee at least half a radian bent, by the law of cosines.
#[test]
fn a_knee_that_cannot_be_straight_makes_a_shorter_leg() {
    let mut case = Case::new(trot());
    for link in case.character.links.iter_mut().filter(|link| link.name.ends_with("shank")) {
        link.joint.as_mut().unwrap().limits = Some(Limits { lower: -2.6, upper: -0.5 });
    }
    let length = (2.0 * 0.2 * 0.2 * (1.0 + 0.5_f64.cos())).sqrt();
    let extension = case.judged().naturalness["extension"].value;
    assert!((extension - 0.34 / length).abs() < 2e-3, "{extension}");
}

/// A leg with its foot beside the hip has its knee bent at any height, and is not judged by it.
#[test]
fn the_extension_of_sprawled_legs_is_not_judged() {
    let bent = Gait { height: 0.3, ..trot() };
    assert_eq!(Case::new(bent).broken(), ["extension"]);
    // Hips moved towards the middle, first until the legs still stand below them, then farther.
    for (inward, judged) in [(0.1, true), (0.2, false)] {
        let mut case = Case::new(bent);
        let thighs = [1, 3, 5, 7];
        let moved = |poses: &mut Vec<Isometry3<f64>>| {
            for thigh in thighs {
                let y = &mut poses[thigh].translation.y;
                *y -= inward * y.signum();
            }
        };
        moved(&mut case.standing);
        case.trace.samples.iter_mut().for_each(|sample| moved(&mut sample.link_poses));
        let report = case.judged();
        assert_eq!(report.naturalness.contains_key("extension"), judged, "{inward} m");
        assert!(judged || report.natural);
    }
}

/// Nothing that rests is natural, and what has no names may be.
#[test]
fn what_stands_or_was_not_simulated_is_not_natural() {
    let still = Case::new(Gait { speed: 0.0, ..Gait::new([0.0; 4], 1.0) });
    let broken = still.broken();
    for name in ["named", "travel", "strides"] {
        assert!(broken.iter().any(|broken| broken == name), "{broken:?}");
    }
    let mut nothing = Case::new(trot());
    nothing.trace = Trace::default();
    let report = nothing.judged();
    assert!(!report.natural && report.naturalness.is_empty());
}

#[test]
fn limits_are_numbers_or_pairs_in_json() {
    let json = |limit: MeasureLimit| serde_json::to_value(limit.judge(0.4)).unwrap();
    assert_eq!(
        json(MeasureLimit::AtMost(0.5)),
        serde_json::json!({ "value": 0.4, "limit": 0.5, "holds": true })
    );
    assert_eq!(json(MeasureLimit::within([0.5, 0.8]))["limit"], serde_json::json!([0.5, 0.8]));
    let low = json(MeasureLimit::at_least(0.5));
    assert_eq!((&low["limit"], &low["holds"]), (&serde_json::json!([0.5, null]), &false.into()));
    for limit in [MeasureLimit::AtMost(0.5), MeasureLimit::within([0.1, 0.2]), MeasureLimit::at_least(0.3)] {
        let text = serde_json::to_string(&limit).unwrap();
        assert_eq!(serde_json::from_str::<MeasureLimit>(&text).unwrap(), limit);
    }
    assert!(!MeasureLimit::AtMost(0.5).judge(f64::NAN).holds);
    assert!(!MeasureLimit::within([0.1, 0.5]).judge(f64::NAN).holds);
}

/// A hundredth of √(g h): a Froude number of 10⁻⁴.
#[test]
fn the_least_way_grows_with_the_size() {
    let speed = least_travel(0.4, 10.0);
    assert!((speed * speed / (10.0 * 0.4) - 1e-4).abs() < 1e-12);
}
