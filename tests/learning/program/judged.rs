//! What the search measures of a rollout, against what the judge finds of the same motion.

use gaitwright_learning::check::MotionCheck;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::program::gaits::named;
use gaitwright_learning::program::leg_watch::LegFigures;
use gaitwright_learning::program::ring::{PARAMETERS, Ring, Wanted};
use gaitwright_learning::program::subject::Subject;
use gaitwright_physics::character::{Source, read};
use gaitwright_physics::scene::Gains;
use serde_json::json;

use super::{GRAVITY, brisk, subject, subject_of, trot};

/// The gait of `ring`, driven with `gains`, as a finished motion is judged.
pub(super) fn judged(subject: &Subject, ring: &Ring, gains: &Gains) -> GaitReport {
    let check = MotionCheck {
        model: &subject.model,
        stance: &subject.stance,
        gains,
        scene: &subject.scene,
        accuracy: &subject.accuracy,
        player: &ring.player(&subject.stance.angles),
        direction: subject.direction,
        speed: None,
        gait: None,
    };
    check.run(&|| false).unwrap().gait
}

/// Motors that are too weak for a trot give all that they have at their speed for a part of the time, most of it less than their
/// greatest torque: the search sees that as the judge does.
#[test]
fn the_search_sees_the_torque_that_the_judge_sees() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let (ring, mut gains) = subject.ring(&trot(&subject.legs), &brisk());
    gains.max_torque.fill(Some(9.0));
    let figures = subject.arena().unwrap().run(&ring, &gains, 40);
    let judged = judged(&subject, &ring, &gains).naturalness["torque_saturation"].value;
    assert!(figures.upright >= 1.0 && judged > 0.1, "{judged} of the time at the limit");
    // The judge looks 48 times a loop, which tells how long a joint is at its limit in each to one of them.
    assert!((figures.saturated - judged).abs() < 1.0 / 48.0, "{} seen, {judged} judged", figures.saturated);
}

#[test]
fn the_search_measures_the_hips_where_the_judge_does() {
    for (name, gait) in [
        ("quadruped.urdf", "trot"),
        ("hexapod.json", "tripod"),
        ("spider.json", "tetrapod"),
        ("biped.urdf", "walk"),
    ] {
        measures_the_hips_as_the_judge_does(&subject(name, [1.0, 0.0, 0.0]), gait);
    }
}

/// A leg may be as long as its slide is drawn out: the slide's own frame is at the hip.
#[test]
fn the_search_measures_the_hips_of_telescopic_legs_where_the_judge_does() {
    let leg = |name: &str, x: f64, y: f64| {
        let ball = |radius: f64, z: f64| json!([{ "kind": "sphere", "radius": radius, "pose": { "position": [0, 0, z] } }]);
        let link = |part: &str, radius: f64, z: f64| json!({ "name": format!("{name}_{part}"), "density": 1000, "shapes": ball(radius, z) });
        let joint = |part: &str,
                     parent: String,
                     kind: &str,
                     at: [f64; 3],
                     axis: [f64; 3],
                     [lower, upper]: [f64; 2]| {
            json!({ "name": format!("{name}_to_{part}"), "kind": kind, "parent": parent, "child": format!("{name}_{part}"),
                    "origin": { "position": at }, "axis": axis,
                    "limits": { "lower": lower, "upper": upper }, "actuation": { "max_torque": 100, "max_speed": 10 } })
        };
        let links = [link("thigh", 0.03, 0.0), link("shank", 0.025, 0.0)];
        let hip = joint("thigh", "trunk".into(), "revolute", [x, y, 0.0], [0.0, 1.0, 0.0], [-1.0, 1.0]);
        let slide =
            joint("shank", format!("{name}_thigh"), "prismatic", [0.0; 3], [0.0, 0.0, -1.0], [0.05, 0.35]);
        (links, [hip, slide])
    };
    let legs = [("lf", 0.2, 0.1), ("rf", 0.2, -0.1), ("lh", -0.2, 0.1), ("rh", -0.2, -0.1)]
        .map(|(name, x, y)| leg(name, x, y));
    let trunk =
        json!({ "name": "trunk", "density": 500, "shapes": [{ "kind": "box", "size": [0.5, 0.15, 0.1] }] });
    let links: Vec<_> =
        std::iter::once(trunk).chain(legs.iter().flat_map(|(links, _)| links.clone())).collect();
    let joints: Vec<_> = legs.iter().flat_map(|(_, joints)| joints.clone()).collect();
    let document =
        json!({ "format": "gaitwright/character@1", "name": "telescopic", "links": links, "joints": joints });
    let reading = read(document.to_string().as_bytes(), Source::Json, Default::default()).unwrap();
    let subject = subject_of(reading.character, [1.0, 0.0, 0.0]);
    // Legs of 0.375 m when drawn out stand on more than half of that, though they are drawn at a seventh.
    assert!(subject.legs.hip_height > 0.2, "{} m", subject.legs.hip_height);
    measures_the_hips_as_the_judge_does(&subject, "trot");
}

pub(super) fn measures_the_hips_as_the_judge_does(subject: &Subject, gait: &str) {
    let gait = named(gait, &subject.legs).unwrap();
    let wanted = Wanted::at_froude(&subject.legs, gait, 0.1, GRAVITY);
    let (ring, gains) = subject.ring(&wanted, &[0.0; PARAMETERS]);
    let judged = judged(subject, &ring, &gains).hip_height.unwrap();
    let (searched, name) = (subject.legs.hip_height, &subject.model.character.name);
    assert!((searched / judged - 1.0).abs() < 0.005, "{name}: {searched} and {judged} m");
}

#[test]
fn the_search_sees_the_steps_that_the_judge_sees() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let (ring, gains) = subject.ring(&trot(&subject.legs), &brisk());
    sees_as_the_judge_does(&subject, &ring, &gains);
}

/// What a short search for a bound of the bundled quadruped came to, and a whole one for a gallop that keeps its course by itself.
#[rustfmt::skip]
const LEAPS: [(&str, f64, [f64; PARAMETERS]); 2] = [
    ("bound", 1.0, [
        -4.26, -1.19, -2.23, 1.12, -2.73, 2.49, -1.92, -0.25, -4.22, 2.58, -2.22, 1.34, 0.50, 0.00, 0.00, -0.24, -0.29, 0.40, 0.00, 0.00,
        0.18, 3.94, -2.24, -0.18, 0.00, 2.68,
    ]),
    ("transverse gallop", 2.0, [
        -3.50, -0.48, -0.82, 0.15, -2.17, 1.65, -0.53, -0.61, -2.11, 1.99, -1.38, 1.49, -0.36, 3.23, -0.75, -0.87, -1.05, -0.66, 0.39, 0.29,
        -0.41, 4.77, -0.63, -0.46, -1.30, 3.77,
    ]),
];

/// Feet of leaps stand for less than a twentieth of a second: where the middle of that is matters.
#[test]
fn the_search_sees_the_leaps_that_the_judge_sees() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    for (name, froude, parameters) in LEAPS {
        let gait = named(name, &subject.legs).unwrap();
        let wanted = Wanted::at_froude(&subject.legs, gait, froude, GRAVITY);
        let (ring, gains) = subject.ring(&wanted, &parameters);
        sees_as_the_judge_does(&subject, &ring, &gains);
    }
}

fn sees_as_the_judge_does(subject: &Subject, ring: &Ring, gains: &Gains) {
    let figures = subject.arena().unwrap().run(ring, gains, 40);
    let judged = judged(subject, ring, gains);
    let near = |seen: f64, judged: f64, bound: f64, what: &str| {
        assert!((seen - judged).abs() < bound, "{what}: {seen} seen, {judged} judged");
    };
    let cost = judged.cost_of_transport.unwrap();
    near(figures.speed / judged.speed, 1.0, 0.02, "speed");
    near(figures.cost_of_transport / cost, 1.0, 0.02, "cost of transport");
    // The judge samples every 5 ms: a fiftieth of this stride.
    let first = (figures.legs[0].phase, judged.feet[0].phase.unwrap());
    for (leg, foot) in figures.legs.iter().zip(&judged.feet) {
        near(leg.duty, foot.duty_factor, 0.02, "duty factor");
        let apart = leg.phase - first.0 - (foot.phase.unwrap() - first.1);
        near(apart - apart.round(), 0.0, 0.02, "phase");
        near(leg.clearance, foot.clearance.unwrap() / judged.hip_height.unwrap(), 0.02, "clearance");
    }
    let worst = |of: fn(&LegFigures) -> f64| figures.legs.iter().map(of).fold(f64::INFINITY, f64::min);
    near(worst(|leg| leg.extension), judged.naturalness["extension"].value, 0.01, "extension");
    let smoothness = judged.naturalness["smoothness"].value;
    near(figures.smoothness, smoothness, 0.01, "smoothness");
    // A search looks at few strides, which are no whole number of looks.
    near(
        subject.arena().unwrap().run(ring, gains, 5).smoothness,
        smoothness,
        0.03,
        "smoothness of few strides",
    );
}
