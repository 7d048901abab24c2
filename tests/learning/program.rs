//! Leg programs: forces against hand-computed equilibria, inverse kinematics against forward kinematics and the simulator's own,
//! the evolution strategy on published test functions, and the whole for determinism.

use std::sync::Arc;

use gaitwright_learning::check::MotionCheck;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::Posture;
use gaitwright_learning::program::cma::Cma;
use gaitwright_learning::program::cost::{HOLDS, undisturbed};
use gaitwright_learning::program::figures::RolloutFigures;
use gaitwright_learning::program::gaits::{gaits, named};
use gaitwright_learning::program::leg_watch::LegFigures;
use gaitwright_learning::program::legs::Legs;
use gaitwright_learning::program::ring::{PARAMETERS, PERIOD, Ring, TURN, Wanted, program};
use gaitwright_learning::program::steer;
use gaitwright_learning::program::subject::Subject;
use gaitwright_learning::program::template::{SAMPLES, shares, stride};
use gaitwright_physics::character::{Character, Source, read, read_file};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Player;
use gaitwright_physics::scene::{Accuracy, Gains, Scene};
use gaitwright_physics::sim::{State, link_poses};
use gaitwright_physics::stance::Stance;
use nalgebra::{Vector2, Vector3};
use serde_json::json;

pub const GRAVITY: f64 = 9.81;

pub fn subject(name: &str, direction: [f64; 3]) -> Subject {
    let path = crate::common::example_path(name);
    subject_of(read_file(&path, Default::default()).unwrap().character, direction)
}

fn subject_of(character: Character, direction: [f64; 3]) -> Subject {
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    Subject::new(&model, &stance, &scene, &Accuracy::default(), direction).unwrap()
}

pub fn trot(legs: &Legs) -> Wanted {
    Wanted::at_froude(legs, named("trot", legs).unwrap(), 0.4, GRAVITY)
}

/// The stride time of the trot that stays up on the bundled quadruped.
pub fn brisk() -> Vec<f64> {
    let mut parameters = vec![0.0; PARAMETERS];
    parameters[PERIOD] = -2.0;
    parameters
}

#[test]
fn strides_have_a_least_time_and_canters_and_gallops_a_longer_one() {
    let legs = subject("quadruped.urdf", [1.0, 0.0, 0.0]).legs;
    let mut parameters = vec![0.0; PARAMETERS];
    parameters[PERIOD] = -50.0;
    for (name, least) in [("trot", 0.5), ("bound", 0.5), ("transverse gallop", 0.57), ("rotary gallop", 0.57)]
    {
        let wanted = Wanted::at_froude(&legs, named(name, &legs).unwrap(), 2.0, GRAVITY);
        let share = program(&legs, &wanted, &parameters).period / wanted.usual_period(legs.hip_height);
        assert!((share - least).abs() < 1e-12, "{name}: {share}");
    }
}

#[test]
fn shares_balance_as_a_beam_does() {
    // Fore feet 0.1 m before, hind feet 0.3 m behind the centre of mass: three quarters are in front.
    let feet = [(0.1, 0.2), (-0.3, 0.2), (0.1, -0.2), (-0.3, -0.2)].map(|(x, y)| Vector2::new(x, y));
    for (share, wanted) in shares(&feet).iter().zip([0.375, 0.125, 0.375, 0.125]) {
        assert!((share - wanted).abs() < 1e-12, "{share} instead of {wanted}");
    }
    // All feet before the centre of mass: nothing balances, but nothing pulls and the weight is carried as near as can be.
    let ahead = [(0.1, 0.2), (0.5, 0.2), (0.1, -0.2), (0.5, -0.2)].map(|(x, y)| Vector2::new(x, y));
    assert!(shares(&ahead).iter().all(|share| *share >= -1e-12));
}

#[test]
fn forces_carry_the_weight_and_the_trunk_obeys_newton_and_euler() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let legs = &subject.legs;
    for gait in gaits(4) {
        let wanted = Wanted::at_froude(legs, gait, 0.4, GRAVITY);
        let program = program(legs, &wanted, &[]);
        let moments = stride(legs, &program, GRAVITY);
        let count = SAMPLES as f64;
        // Back from the root's axes, which are pitched.
        let level = |sample: usize| -> Vec<Vector3<f64>> {
            let (sine, cosine) = moments[sample].pitch.sin_cos();
            let turned = moments[sample].forces.iter();
            turned.map(|f| Vector3::new(cosine * f.x + sine * f.z, f.y, cosine * f.z - sine * f.x)).collect()
        };
        let total = |sample: usize| level(sample).iter().sum::<Vector3<f64>>();
        let mean = (0..SAMPLES).map(total).sum::<Vector3<f64>>() / count;
        assert!((mean.z / (legs.mass * GRAVITY) - 1.0).abs() < 1e-9, "{}: {mean}", gait.name);
        // Central differences of the course are the accelerations that the forces give.
        let dt = program.period / count;
        for sample in 0..SAMPLES {
            let [before, after] = [(sample + SAMPLES - 1) % SAMPLES, (sample + 1) % SAMPLES];
            let second =
                (moments[before].shift + moments[after].shift - 2.0 * moments[sample].shift) / (dt * dt);
            // The trapezoidal rule averages the force over three samples.
            let force = (total(before) + 2.0 * total(sample) + total(after)) / 4.0;
            let wanted = Vector2::new(force.x - mean.x, force.z - mean.z) / legs.mass;
            assert!((second - wanted).norm() < 1e-6 * GRAVITY, "{}: {second} instead of {wanted}", gait.name);
        }
        // A foot that stands moves back at the trunk's speed.
        for (leg, step) in program.steps.iter().enumerate() {
            for sample in 1..SAMPLES {
                let since = |sample: usize| (sample as f64 / count - step.phase).rem_euclid(1.0);
                if since(sample) >= step.duty || since(sample - 1) >= since(sample) {
                    continue;
                }
                let foot = |sample: usize| {
                    let moment = &moments[sample];
                    let (sine, cosine) = moment.pitch.sin_cos();
                    let at = moment.feet[leg] - legs.center;
                    let level = Vector2::new(cosine * at.x + sine * at.z, cosine * at.z - sine * at.x);
                    level + moment.shift
                };
                let moved = (foot(sample) - foot(sample - 1)) / dt;
                assert!(
                    (moved.x + program.speed).abs() < 1e-9 && moved.y.abs() < 1e-9,
                    "{}: {moved}",
                    gait.name
                );
            }
        }
    }
}

#[test]
fn the_trunk_sways_as_its_forces_push_it_and_is_not_rolled() {
    for (name, gait, froude) in
        [("quadruped.urdf", "walk", 0.1), ("quadruped.urdf", "pace", 0.4), ("biped.urdf", "walk", 0.1)]
    {
        let subject = subject(name, [1.0, 0.0, 0.0]);
        let legs = &subject.legs;
        let wanted = Wanted::at_froude(legs, named(gait, legs).unwrap(), froude, GRAVITY);
        let program = program(legs, &wanted, &[]);
        let moments = stride(legs, &program, GRAVITY);
        let weight = legs.mass * GRAVITY;
        let height = legs.center.z + program.raise
            - legs.legs.iter().map(|leg| leg.foot.z - leg.radius).sum::<f64>() / legs.legs.len() as f64;
        let greatest = moments.iter().map(|moment| moment.sway.abs()).fold(0.0, f64::max);
        assert!(greatest > 0.005 * height, "{name}: {greatest} m");
        let dt = program.period / SAMPLES as f64;
        for sample in 0..SAMPLES {
            let moment = &moments[sample];
            let lateral: f64 = moment.forces.iter().map(|force| force.y).sum();
            let vertical: f64 = moment
                .forces
                .iter()
                .map(|force| moment.pitch.cos() * force.z - moment.pitch.sin() * force.x)
                .sum();
            // About the length of the trunk through the centre of mass: r_y F_z − r_z F_y. What the pendulum leaves out is
            // that the vertical force differs from the weight.
            let level = |force: &Vector3<f64>| moment.pitch.cos() * force.z - moment.pitch.sin() * force.x;
            let rolling: f64 = moment
                .forces
                .iter()
                .zip(&program.steps)
                .map(|(force, step)| (step.neutral.y - legs.center.y - moment.sway) * level(force))
                .sum::<f64>()
                + height * lateral;
            let left_out = moment.sway * (weight - vertical);
            assert!(
                (rolling - left_out).abs() < 1e-9 * weight * height,
                "{name}: {rolling} and {left_out} N m"
            );
            // Newton, by central differences: of second order in the sampling.
            let [before, after] = [(sample + SAMPLES - 1) % SAMPLES, (sample + 1) % SAMPLES];
            let second = (moments[before].sway + moments[after].sway - 2.0 * moment.sway) / (dt * dt);
            assert!(
                (legs.mass * second - lateral).abs() < 0.02 * weight,
                "{name}: {second} m/s², {lateral} N"
            );
        }
    }
}

#[test]
fn a_pair_of_legs_under_the_centre_of_mass_carries_half_each() {
    let subject = subject("biped.urdf", [1.0, 0.0, 0.0]);
    let legs = &subject.legs;
    let wanted = Wanted::at_froude(legs, gaits(2)[0], 0.1, GRAVITY);
    let program = program(legs, &wanted, &[]);
    let moments = stride(legs, &program, GRAVITY);
    // Half the weight over a share β of the stride, as a half-sine, has the peak m g π / (4 β).
    let duty = program.steps[0].duty;
    let peak = moments.iter().map(|moment| moment.forces[0].norm()).fold(0.0, f64::max);
    let wanted = legs.mass * GRAVITY * std::f64::consts::PI / (4.0 * duty);
    assert!((peak / wanted - 1.0).abs() < 0.02, "{peak} instead of {wanted}");
}

#[test]
fn legs_are_where_the_simulator_has_them() {
    for name in ["quadruped.urdf", "biped.urdf", "hexapod.json"] {
        let subject = subject(name, [1.0, 0.0, 0.0]);
        for leg in &subject.legs.legs {
            let mut state = State::new(&subject.model);
            let angles: Vec<f64> = leg.standing.iter().map(|angle| angle + 0.1).collect();
            state.angles.copy_from_slice(&subject.stance.angles);
            for (&joint, &angle) in leg.joints.iter().zip(&angles) {
                state.angles[joint] = angle;
            }
            let poses = link_poses(&subject.model, &state);
            let place = leg.place(&angles);
            // The foot's body turned as the simulator turns it.
            let body = subject.model.links[leg.links[0]].body;
            let link = subject.model.links.iter().position(|link| link.body == body).unwrap();
            let body = poses[link] * subject.model.links[link].pose.inverse();
            let wanted = body.rotation.to_rotation_matrix();
            assert!((place.rotation - wanted.matrix()).amax() < 1e-12, "{name}");
            // The last joint sits where the body's origin is.
            let origin = place.origin(leg.joints.len() - 1);
            assert!((origin - body.translation.vector).norm() < 1e-12, "{name}");
        }
    }
}

#[test]
fn inverse_kinematics_finds_what_forward_kinematics_gave() {
    for name in ["quadruped.urdf", "biped.urdf", "hexapod.json"] {
        let subject = subject(name, [1.0, 0.0, 0.0]);
        for leg in &subject.legs.legs {
            for change in [-0.15, 0.1, 0.2] {
                let mut wanted: Vec<f64> = leg.standing.iter().map(|angle| angle + change).collect();
                for (&joint, angle) in leg.joints.iter().zip(&mut wanted) {
                    let [lower, upper] = subject.model.limits[joint].unwrap_or([f64::MIN, f64::MAX]);
                    *angle = angle.clamp(lower, upper);
                }
                let goal = leg.place(&wanted);
                let mut found = leg.standing.clone();
                let left = leg.reach(&mut found, goal.foot, goal.up);
                assert!(left < 1e-4 * leg.length, "{name}: {left} m");
                assert!((leg.place(&found).foot - goal.foot).norm() < 1e-4 * leg.length);
            }
            // What cannot be reached is approached, within the ranges of motion.
            let mut found = leg.standing.clone();
            let left = leg.reach(&mut found, leg.hip - Vector3::z() * (2.0 * leg.length), Vector3::z());
            assert!(left > 0.5 * leg.length);
            for (&joint, angle) in leg.joints.iter().zip(&found) {
                let [lower, upper] = subject.model.limits[joint].unwrap_or([f64::MIN, f64::MAX]);
                assert!((lower..=upper).contains(angle));
            }
        }
    }
}

#[test]
fn left_and_fore_follow_the_direction_of_travel() {
    let ahead = subject("quadruped.urdf", [1.0, 0.0, 0.0]).legs;
    let back = subject("quadruped.urdf", [-1.0, 0.0, 0.0]).legs;
    // LF, LH, RF, RH: the other way round, left fore is what was right hind.
    for (leg, other) in [(0, 3), (1, 2), (2, 1), (3, 0)] {
        assert_eq!(ahead.legs[leg].joints, back.legs[other].joints);
        assert!((ahead.legs[leg].hip + back.legs[other].hip).xy().norm() < 1e-12);
    }
    assert!(ahead.legs[0].hip.x > 0.0 && ahead.legs[0].hip.y > 0.0);
    // The mass and its inertia are those of the character.
    assert!((ahead.mass - 12.0).abs() < 1e-9);
    assert!((ahead.inertia[(1, 1)] - back.inertia[(1, 1)]).abs() < 1e-12);
}

#[test]
fn keyframes_stay_within_the_ranges_of_motion_and_repeat() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let wanted = trot(&subject.legs);
    // Far out, where the legs do not reach.
    let (ring, _) = subject.ring(&wanted, &[3.0; PARAMETERS]);
    let player = Player::from_postures(
        &subject.stance.angles,
        ring.entry.iter().map(|posture| posture.parts()),
        ring.cycle.iter().map(|posture| posture.parts()),
        ring.transition_time(),
    );
    assert!((player.lead() - ring.lead()).abs() < 1e-12);
    assert!((player.period() - ring.period).abs() < 1e-12);
    let mut angles = vec![0.0; subject.model.joint_count()];
    for sample in 0..=400 {
        player.targets(ring.lead() + ring.period * f64::from(sample) / 400.0, &mut angles);
        for (angle, limits) in angles.iter().zip(&subject.model.limits) {
            let [lower, upper] = limits.unwrap();
            assert!((lower - 1e-9..=upper + 1e-9).contains(angle));
        }
    }
}

#[test]
fn the_mirrored_half_of_a_trot_follows_half_a_stride_later() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let (ring, _) = subject.ring(&trot(&subject.legs), &brisk());
    let legs = &subject.legs.legs;
    let half = ring.cycle.len() / 2;
    for row in 0..2 {
        let (left, right) = (&legs[row], &legs[row + 2]);
        for (knot, posture) in ring.cycle.iter().enumerate() {
            let later = &ring.cycle[(knot + half) % ring.cycle.len()];
            for (place, (&a, &b)) in left.joints.iter().zip(&right.joints).enumerate() {
                // Abduction is mirrored; swing and knee are the same on both sides.
                let sign = if place == 0 { -1.0 } else { 1.0 };
                let apart = posture.angles[a] - sign * later.angles[b];
                assert!(apart.abs() < 1e-3, "row {row}, joint {place}: {apart} rad");
            }
        }
    }
}

/// Minimises `function` from 3 in each of `n` dimensions and gives the least value of a generation's best.
fn minimised(function: impl Fn(&[f64]) -> f64, n: usize, generations: u32) -> f64 {
    let mut search = Cma::new(&vec![3.0; n], 1.0, 16, 5);
    let mut least = f64::INFINITY;
    for _ in 0..generations {
        let asked = search.ask();
        let costs: Vec<f64> = asked.iter().map(|x| function(x)).collect();
        least = costs.iter().copied().fold(least, f64::min);
        search.tell(&asked, &costs);
    }
    least
}

#[test]
fn the_evolution_strategy_solves_the_published_test_functions() {
    // Hansen 2016 and Hansen & Ostermeier 2001: sphere, ellipsoid of condition 10⁶, Rosenbrock's valley.
    let sphere = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let ellipsoid =
        |x: &[f64]| x.iter().enumerate().map(|(i, x)| 10f64.powf(6.0 * i as f64 / 9.0) * x * x).sum::<f64>();
    let rosenbrock = |x: &[f64]| {
        x.windows(2).map(|p| 100.0 * (p[1] - p[0] * p[0]).powi(2) + (1.0 - p[0]).powi(2)).sum::<f64>()
    };
    assert!(minimised(sphere, 10, 200) < 1e-10);
    assert!(minimised(ellipsoid, 10, 600) < 1e-8);
    assert!(minimised(rosenbrock, 8, 800) < 1e-8);
    // It depends on the order of the costs alone, and what is not a number ranks last.
    let mut searches = [(); 2].map(|()| Cma::new(&[1.0; 4], 0.5, 8, 9).paired(3));
    for generation in 0..5 {
        let [a, b] = &mut searches;
        let (asked, same) = (a.ask(), b.ask());
        assert_eq!(asked, same);
        // In the first generations each has its counterpart on the other side of the mean.
        for pair in asked.chunks(2) {
            let off = pair[0].iter().zip(&pair[1]).zip(a.mean()).map(|((x, y), mean)| x + y - 2.0 * mean);
            let mirrored = off.fold(0.0, |most, off| f64::max(most, off.abs())) < 1e-12;
            assert_eq!(mirrored, generation < 3);
        }
        let mut costs: Vec<f64> = asked.iter().map(|x| sphere(x)).collect();
        let squashed: Vec<f64> = costs.iter().map(|cost| cost.ln()).collect();
        b.tell(&same, &squashed);
        // The worst of them is not among the parents either way.
        let worst = (0..8).max_by(|&i, &j| costs[i].total_cmp(&costs[j])).unwrap();
        costs[worst] = f64::NAN;
        a.tell(&asked, &costs);
        assert_eq!((a.mean(), a.sigma()), (b.mean(), b.sigma()));
    }
}

#[test]
fn what_breaks_a_constraint_costs_more_than_all_that_holds_and_limits_come_before_effort() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let legs = &subject.legs;
    let wanted = trot(legs);
    let leg = |phase: f64| LegFigures {
        duty: 0.5,
        phase,
        spread: 0.0,
        peak: 1.0,
        extension: 0.88,
        clearance: 0.15,
    };
    let good = RolloutFigures {
        upright: 1.0,
        speed: wanted.speed,
        cost_of_transport: 0.3,
        smoothness: 1.0,
        legs: wanted.gait.phases.iter().map(|&phase| leg(phase)).collect(),
        ..RolloutFigures::default()
    };
    let period = wanted.usual_period(legs.hip_height);
    let cost = |figures: &RolloutFigures| undisturbed(&wanted, period, legs, figures);
    let bent = |extension: f64| RolloutFigures {
        legs: good.legs.iter().map(|leg| LegFigures { extension, ..*leg }).collect(),
        ..good.clone()
    };
    // Energy saved by going beyond a limit is not worth it; within the limits it is all that counts.
    let saved = |figures: RolloutFigures| RolloutFigures { cost_of_transport: 0.25, ..figures };
    assert!(cost(&saved(bent(0.7))) > cost(&good));
    assert!(cost(&saved(bent(0.88))) < cost(&good));
    assert_eq!(cost(&bent(0.88)), cost(&bent(0.87)));
    // Falling, the wrong speed and the wrong way are worse than everything that is merely unnatural.
    let worst = RolloutFigures { cost_of_transport: 50.0, pitch: 1.0, slip: 5.0, ..bent(0.3) };
    assert!(cost(&worst) < HOLDS);
    for broken in [
        RolloutFigures { upright: 0.99, ..good.clone() },
        RolloutFigures { speed: 0.85 * wanted.speed, ..good.clone() },
        RolloutFigures { yaw: 0.1, ..good.clone() },
        RolloutFigures { sideways: 0.1, ..good.clone() },
    ] {
        assert!(cost(&broken) > HOLDS, "{broken:?}");
    }
}

/// A trot with its feet sent to the left of where the trunk goes, which turns it, goes straight on when its heading is answered to.
#[test]
fn a_trot_that_turns_is_steered_straight() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let arena = subject.arena().unwrap();
    let wanted = trot(&subject.legs);
    let mut turning = brisk();
    // Less than the half that three cells of the weakest answer take back.
    turning[TURN] = 0.4;
    let heading = |parameters: &[f64]| {
        let (ring, gains) = subject.ring(&wanted, parameters);
        let figures = arena.run(&ring, &gains, 60);
        assert_eq!(figures.upright, 1.0);
        (60.0 * figures.yaw, figures.speed)
    };
    let (_, speed) = heading(&brisk());
    let (astray, _) = heading(&turning);
    assert!(astray.abs() > 0.5, "{astray} rad in 60 strides");
    // It turns on until it is a few cells of 0.04 rad off, whose answer makes up for the turn.
    let steered: Vec<(f64, f64)> = steer::by_heading(&turning).iter().map(|it| heading(it)).collect();
    for (off, kept) in &steered {
        assert!((kept / speed - 1.0).abs() < 0.1, "{kept} m/s instead of {speed}");
        assert!(off * astray > 0.0 || off.abs() < 0.1, "{off} rad, {astray} without");
    }
    // The stronger the answer, the fewer cells.
    let (weak, strong) = (steered[0].0.abs(), steered[steered.len() - 1].0.abs());
    assert!(weak < 0.5 * astray.abs() && strong < 0.12 && strong <= weak + 0.02, "{steered:?} of {astray}");
    // What the document holds is what was tried: the same rings for each measure, as many as there are cells.
    let (ring, _) = subject.ring(&wanted, &steer::by_heading(&turning)[1]);
    let steering = ring.steering.unwrap();
    assert_eq!(steering.tables.len(), 1);
    assert_eq!(steering.tables[0].rings.len(), steering.tables[0].bounds.len() + 1);
    // Straight on, nothing is changed.
    let middle = &steering.tables[0].rings[steering.tables[0].rings.len() / 2];
    assert!(middle.iter().all(|change| change.angles.iter().chain(&change.velocities).all(|it| *it == 0.0)));
}

/// The gait of `ring`, driven with `gains`, as a finished motion is judged.
fn judged(subject: &Subject, ring: &Ring, gains: &Gains) -> GaitReport {
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
            joint("shank", format!("{name}_thigh"), "prismatic", [0.0; 3], [0.0, 0.0, -1.0], [0.2, 0.35]);
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
    assert!(subject.legs.hip_height > 0.2, "{} m", subject.legs.hip_height);
    measures_the_hips_as_the_judge_does(&subject, "trot");
}

/// A leg of three joints that all turn about one axis keeps its sole level with the joint that its foot's place leaves.
#[test]
fn soles_of_planar_legs_are_kept_level() {
    let mut links = vec![
        json!({ "name": "trunk", "density": 300, "shapes": [{ "kind": "box", "size": [0.2, 0.3, 0.2] }] }),
    ];
    let mut joints = Vec::new();
    for (side, y) in [("left", 0.1), ("right", -0.1)] {
        let mut parent = "trunk".to_owned();
        for (part, down) in
            [("thigh", [0.0, y, -0.1]), ("shank", [0.0, 0.0, -0.3]), ("foot", [0.0, 0.0, -0.3])]
        {
            let child = format!("{side}_{part}");
            let shape = match part {
                "foot" => {
                    json!({ "kind": "box", "size": [0.2, 0.08, 0.02], "pose": { "position": [0.03, 0, -0.03] } })
                }
                _ => {
                    json!({ "kind": "capsule", "radius": 0.03, "length": 0.2, "pose": { "position": [0, 0, -0.15] } })
                }
            };
            links.push(json!({ "name": child, "density": 500, "shapes": [shape] }));
            joints.push(json!({ "name": format!("{child}_joint"), "kind": "revolute", "parent": parent, "child": child,
                "origin": { "position": down }, "axis": [0, 1, 0], "limits": { "lower": -1.5, "upper": 1.5 },
                "actuation": { "max_torque": 100, "max_speed": 10 } }));
            parent = child;
        }
    }
    let document =
        json!({ "format": "gaitwright/character@1", "name": "planar", "links": links, "joints": joints });
    let reading = read(document.to_string().as_bytes(), Source::Json, Default::default()).unwrap();
    let subject = subject_of(reading.character, [1.0, 0.0, 0.0]);
    assert_eq!(subject.legs.legs.len(), 2);
    for leg in &subject.legs.legs {
        assert_eq!(leg.level, 1);
        for [ahead, up] in [[0.1, 0.03], [-0.1, 0.05], [0.0, 0.1]] {
            let mut angles = leg.standing.clone();
            let target = leg.foot + Vector3::new(ahead, 0.0, up);
            assert!(leg.reach(&mut angles, target, Vector3::z()) < 1e-4);
            assert!(leg.place(&angles).up.angle(&Vector3::z()) < 1e-3, "{ahead} m ahead, {up} m up");
        }
    }
    // The bundled biped has a joint more, which moves its feet to the side.
    let biped = self::subject("biped.urdf", [1.0, 0.0, 0.0]);
    assert!(biped.legs.legs.iter().all(|leg| leg.joints.len() == 4 && leg.level == 1));
}

/// The bundled biped with the front third of each sole on a joint of its own.
fn toed() -> Character {
    let mut urdf = std::fs::read_to_string(crate::common::example_path("biped.urdf")).unwrap();
    let sole = r#"<origin xyz="0.02 0 -0.028"/>
      <geometry><box size="0.18 0.09 0.024"/></geometry>"#;
    let heel = r#"<origin xyz="-0.01 0 -0.028"/>
      <geometry><box size="0.12 0.09 0.024"/></geometry>"#;
    assert_eq!(urdf.matches(sole).count(), 4, "seen and touching, of two feet");
    urdf = urdf.replace(sole, heel);
    for side in ["L", "R"] {
        let toe = format!(
            r#"<joint name="{side}_toe_joint" type="revolute"><parent link="{side}_foot"/><child link="{side}_toe"/>
            <origin xyz="0.05 0 -0.028"/><axis xyz="0 1 0"/><limit lower="-0.5" upper="0.5" effort="10" velocity="12"/></joint>
            <link name="{side}_toe"><inertial><origin xyz="0.03 0 0"/><mass value="0.1"/>
            <inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.0001"/></inertial>
            <collision><origin xyz="0.03 0 0"/><geometry><box size="0.06 0.09 0.024"/></geometry></collision></link></robot>"#
        );
        urdf = urdf.replace("</robot>", &toe);
    }
    read(urdf.as_bytes(), Source::Urdf, Default::default()).unwrap().character
}

#[test]
fn a_toe_is_part_of_its_foot() {
    // As the bundled biped stands, with its toes straight.
    let biped = subject("biped.urdf", [1.0, 0.0, 0.0]);
    let joints = biped.model.joint_names.iter().cloned().zip(biped.stance.angles.iter().copied());
    let subject = subject_of(Character { standing: Some(joints.collect()), ..toed() }, [1.0, 0.0, 0.0]);
    assert!(subject.stance.stable);
    assert_eq!(subject.stance.support.len(), 4, "heels and toes");
    assert_eq!(subject.legs.legs.len(), 2);
    let name = |link: &usize| subject.model.character.links[*link].name.as_str();
    let feet: Vec<Vec<&str>> =
        subject.legs.legs.iter().map(|leg| leg.links.iter().map(name).collect()).collect();
    assert_eq!(feet, [["L_foot", "L_toe"], ["R_foot", "R_toe"]]);
    measures_the_hips_as_the_judge_does(&subject, "walk");
    // A leg program leaves the toes as they stand.
    let wanted = Wanted::at_froude(&subject.legs, named("walk", &subject.legs).unwrap(), 0.05, GRAVITY);
    let (ring, _) = subject.ring(&wanted, &[0.0; PARAMETERS]);
    for (joint, name) in subject.model.joint_names.iter().enumerate().filter(|(_, name)| name.contains("toe"))
    {
        let still = ring.cycle.iter().all(|posture| posture.angles[joint] == subject.stance.angles[joint]);
        assert!(still, "{name}");
    }
    // The judge sees two feet, of which neither scuffs with its toe.
    let cycle = vec![Posture::resting(&subject.stance.angles); ring.cycle.len()];
    let report = judged(&subject, &Ring { entry: Vec::new(), cycle, ..ring }, &subject.stance.gains);
    assert_eq!(report.feet.iter().map(|foot| foot.link.as_str()).collect::<Vec<_>>(), ["L_foot", "R_foot"]);
    assert_eq!((report.fell_at, report.scuffing, report.aerial_fraction), (None, 0.0, 0.0));
}

fn measures_the_hips_as_the_judge_does(subject: &Subject, gait: &str) {
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
    let smoothness = judged(&subject, &ring, &gains).naturalness["smoothness"].value;
    let seen = subject.arena().unwrap().run(&ring, &gains, 40).smoothness;
    assert!((seen - smoothness).abs() < 0.01, "smoothness: {seen} seen, {smoothness} judged");
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
}
