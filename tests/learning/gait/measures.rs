//! Gaits made by construction give back what they were made of.

use std::f64::consts::{FRAC_PI_2, PI};

use gaitwright_learning::gait::{Detection, Footing, Regime, UnnamedBecause, validity};
use gaitwright_physics::playback::Trace;
use gaitwright_physics::scene::ActuatorLimits;
use gaitwright_physics::sim::StepRecord;
use gaitwright_physics::sim::contact::Against;
use nalgebra::Vector3;
use proptest::prelude::*;

use super::{circular, report};
use crate::synthetic::{self, GRAVITY, Gait, LEGS, foot_link, mass, settle_loads};

/// Named gaits with timings and duty factors by hand, in the order LF, LH, RF, RH.
const GAITS: [(&str, [f64; 4], f64); 8] = [
    ("walk", [0.0, 0.77, 0.5, 0.26], 0.7),
    ("trot", [0.0, 0.51, 0.5, 0.02], 0.45),
    ("pace", [0.0, 0.97, 0.5, 0.47], 0.45),
    ("bound", [0.0, 0.52, 0.01, 0.5], 0.35),
    ("canter", [0.0, 0.66, 0.69, 0.34], 0.4),
    ("gallop", [0.0, 0.39, 0.94, 0.34], 0.3),
    ("gallop", [0.0, 0.41, 0.06, 0.36], 0.3),
    ("pronk", [0.0, 0.02, 0.0, 0.01], 0.4),
];

#[test]
fn each_named_gait_gives_back_its_name_phases_and_duty_in_any_heading() {
    for (number, (name, phases, duty)) in GAITS.into_iter().enumerate() {
        let heading = 0.9 * number as f64;
        let gait = Gait { heading, ..Gait::new(phases, duty) };
        let report = report(&gait.trace(), heading);
        assert_eq!((report.gait.as_deref(), report.unnamed_because), (Some(name), None));
        // Sampled every hundredth of the stride: touch-downs are late by at most one sample.
        let resolution = gait.interval / gait.stride;
        assert!((report.stride_period.unwrap() - gait.stride).abs() < 1e-9);
        // 10 s of half a second each, the first and the last not whole.
        assert!((18..=20).contains(&report.strides), "{}", report.strides);
        for (foot, (leg, phase)) in report.feet.iter().zip(LEGS.iter().zip(phases)) {
            assert_eq!(foot.leg.as_deref(), Some(*leg));
            assert_eq!(foot.link, format!("{leg} shank"));
            assert!(circular(foot.phase.unwrap(), phase) <= 1.001 * resolution, "{name} {leg}");
            assert!((foot.duty_factor - duty).abs() <= resolution);
            // The foot's ball is lifted by as much as its centre; its peak may fall between two samples.
            let lifted = foot.clearance.unwrap();
            let step = 0.5 * PI * resolution / (1.0 - duty);
            assert!(lifted <= gait.lift + 1e-9 && lifted >= gait.lift * step.cos() - 1e-9, "{lifted}");
        }
        let walks = duty >= 0.5;
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
    let gait = Gait { heading: FRAC_PI_2, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) };
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
}

#[test]
fn one_foot_that_never_touches_leaves_the_others_their_phases() {
    let mut trace = Gait::new([0.0, 0.5, 0.5, 0.0], 0.45).trace();
    for sample in &mut trace.samples {
        sample.contacts.retain(|contact| contact.link != foot_link(0));
    }
    settle_loads(&mut trace);
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
    settle_loads(&mut trace);
    let detection = Detection { threshold: 1.0, debounce: 0.025 };
    let footing = Footing::detect(&trace, &[foot_link(0)], detection);
    assert_eq!(footing.touch_downs, [landing, landing + 100]);
    let plain = Detection { debounce: 0.0, ..detection };
    assert_eq!(Footing::detect(&trace, &[foot_link(0)], plain).touch_downs.len(), 4);
}

proptest! {
    #[test]
    fn names_survive_chatter_stray_touches_and_weak_forces(
        choice in 0..8_usize,
        strays in prop::collection::vec((0..4_usize, 0..2000_usize), 40),
        gaps in prop::collection::vec((0..4_usize, 0..2000_usize), 40),
    ) {
        let (name, phases, duty) = GAITS[choice];
        let mut trace = Gait::new(phases, duty).trace();
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
        settle_loads(&mut trace);
        let report = report(&trace, 0.0);
        prop_assert_eq!((report.gait.as_deref(), report.unnamed_because), (Some(name), None));
        for (foot, phase) in report.feet.iter().zip(phases) {
            prop_assert!(circular(foot.phase.unwrap(), phase) < 0.03, "{:?}", foot.phase);
            prop_assert!((foot.duty_factor - duty).abs() < 0.05);
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
    let mut actuators = vec![ActuatorLimits { torque: 20.0, speed: f64::INFINITY }; joints];
    actuators[1].torque = f64::INFINITY;
    // At half of its greatest speed an actuator has half of its torque in that direction, and all of it in the other.
    actuators[2].speed = 8.0;
    for (at, torque) in [(40, 10.0), (41, 9.0), (42, -10.0), (43, -20.0)] {
        trace.samples[at].velocities[2] = 4.0;
        trace.samples[at].torques[2] = torque;
    }
    let validity = validity(&trace, &limits, &actuators, gait.stride);
    assert!((validity.greatest_limit_violation - 0.2).abs() < 1e-12);
    assert!((validity.tracking_error - 0.1).abs() < 1e-12);
    assert!((validity.greatest_penetration - 0.004).abs() < 1e-12);
    assert!((validity.torque_saturation - 3.0 / (samples * (joints - 1)) as f64).abs() < 1e-12);
    assert_eq!(validity.upright_cycles, 6);
    assert_eq!(validity.foot_slip, 0.0);
    assert!(!validity.valid, "it fell");
}

#[test]
fn a_motion_with_unsolved_steps_is_not_valid() {
    let gait = Gait { seconds: 2.0, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.45) };
    let mut trace = gait.trace();
    let joints = synthetic::joint_names().len();
    let free = ActuatorLimits { torque: f64::INFINITY, speed: f64::INFINITY };
    let judged = |trace: &Trace| validity(trace, &vec![None; joints], &vec![free; joints], gait.stride);
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

/// Names are those of the direction of travel: the same character sent to its left or backward has other legs in front.
#[test]
fn legs_are_called_by_the_direction_of_travel() {
    let trace = Gait::new([0.0, 0.5, 0.5, 0.0], 0.45).trace();
    let names = |direction: [f64; 3]| -> Vec<(String, String)> {
        let report = super::report_toward(&trace, 0.0, direction);
        report.feet.iter().map(|foot| (foot.leg.clone().unwrap(), foot.link.replace(" shank", ""))).collect()
    };
    let expected = |links: [&str; 4]| -> Vec<(String, String)> {
        LEGS.iter().zip(links).map(|(leg, link)| ((*leg).to_owned(), link.to_owned())).collect()
    };
    // What is called …            LF    LH    RF    RH
    let cases = [
        ([1.0, 0.0, 0.0], ["LF", "LH", "RF", "RH"]),
        ([0.0, 1.0, 0.0], ["LH", "RH", "LF", "RF"]),
        ([0.0, -3.0, 0.0], ["RF", "LF", "RH", "LH"]),
        ([-1.0, 0.0, 0.5], ["RH", "RF", "LH", "LF"]),
    ];
    for (direction, links) in cases {
        assert_eq!(names(direction), expected(links), "{direction:?}");
    }
}

/// A walk in lateral sequence that goes backward has the hind feet in front: its sequence is the diagonal one, which has no
/// name; a trot stays one.
#[test]
fn a_walk_in_reverse_is_no_walk() {
    let backward =
        |phases, duty| super::report_toward(&Gait::new(phases, duty).trace(), 0.0, [-1.0, 0.0, 0.0]).gait;
    assert_eq!(backward([0.0, 0.75, 0.5, 0.25], 0.7).as_deref(), Some("unclassified"));
    assert_eq!(backward([0.0, 0.5, 0.5, 0.0], 0.45).as_deref(), Some("trot"));
}

/// Steps with the phases of a trot or a walk that are neither: why they have no name.
#[test]
fn what_is_no_gait_has_no_name() {
    let trot = Gait::new([0.0, 0.5, 0.5, 0.0], 0.45);
    let reason = |trace: &Trace| {
        let report = report(trace, 0.0);
        assert_eq!(report.gait.as_deref(), Some("unclassified"));
        report.unnamed_because
    };
    assert_eq!(report(&trot.trace(), 0.0).unnamed_because, None);

    // The right hind leg comes 0.15 of a stride late.
    let late = Gait { phases: [0.0, 0.5, 0.5, 0.15], ..trot };
    assert_eq!(reason(&late.trace()), Some(UnnamedBecause::Phases));

    // It comes in time, but hardly stands: after a third of its stance the leg is relieved.
    let mut relieved = trot.trace();
    for (at, sample) in relieved.samples.iter_mut().enumerate() {
        if at % 100 > 15 && at % 100 < 50 {
            sample.contacts.retain(|contact| contact.link != foot_link(3));
        }
    }
    settle_loads(&mut relieved);
    assert_eq!(reason(&relieved), Some(UnnamedBecause::Limping));

    // Feet leave the ground for a twentieth of the stride.
    let shuffle = Gait { stride: 1.0, speed: 0.2, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.95) };
    assert_eq!(reason(&shuffle.trace()), Some(UnnamedBecause::Shuffling));

    // A stance that vibrates: strides of 60 ms, hardly a way, feet that are off the ground by a millimetre.
    let buzz = Gait { stride: 0.06, speed: 0.02, interval: 0.002, ..Gait::new([0.0, 0.5, 0.5, 0.0], 0.5) };
    assert_eq!(reason(&buzz.trace()), Some(UnnamedBecause::Vibrating));
    assert_eq!(reason(&Gait { lift: 0.001, ..trot }.trace()), Some(UnnamedBecause::Vibrating));

    // Every second stride a fifth longer: the clock of the whole runs unevenly.
    let mut uneven = trot.trace();
    for (at, sample) in uneven.samples.iter_mut().enumerate() {
        let time = at as f64 * trot.interval;
        *sample = trot.sample(time + 0.05 * (PI * time / trot.stride).cos());
        sample.time = time;
    }
    assert_eq!(reason(&uneven), Some(UnnamedBecause::Irregular));

    // One stride alone: only the right hind foot touches down twice.
    let once = Gait { seconds: 0.65, ..Gait::new([0.0, 0.75, 0.5, 0.25], 0.7) };
    assert_eq!(reason(&once.trace()), Some(UnnamedBecause::TooFewStrides));
}

/// Bellies count as touching the ground, and obstacles and other links do not.
#[test]
fn what_else_touches_the_ground_is_no_flight() {
    let gait = Gait::new([0.0, 0.0, 0.0, 0.0], 0.4);
    let plain = report(&gait.trace(), 0.0);
    assert!(
        (plain.aerial_fraction - 0.6).abs() < 0.011 && plain.scuffing == 0.0,
        "{}",
        plain.aerial_fraction
    );
    let solid = gait.sample(0.0).contacts[0];
    let touched = |link: usize, against: Against| {
        let mut trace = gait.trace();
        for (at, sample) in trace.samples.iter_mut().enumerate() {
            // In the first half of every flight.
            if (40..70).contains(&(at % 100)) {
                sample.contacts.push(gaitwright_physics::sim::Contact { link, against, ..solid });
            }
        }
        settle_loads(&mut trace);
        let report = report(&trace, 0.0);
        (report.aerial_fraction, report.scuffing)
    };
    for link in [0, 1] {
        let (aerial, scuffing) = touched(link, Against::Ground);
        assert!(
            (aerial - 0.3).abs() < 0.011 && (scuffing - 0.3).abs() < 0.011,
            "link {link}: {aerial} {scuffing}"
        );
    }
    for against in [Against::Obstacle(0), Against::Link { link: 4, body: 4 }] {
        let (aerial, scuffing) = touched(foot_link(0), against);
        assert!((aerial - 0.6).abs() < 0.011 && scuffing == 0.0, "{against:?}: {aerial} {scuffing}");
    }
}
