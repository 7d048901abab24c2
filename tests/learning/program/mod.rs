//! Leg programs: forces against hand-computed equilibria, inverse kinematics against forward kinematics and the simulator's own,
//! the evolution strategy on published test functions, and the whole for determinism.

mod entry;
mod judged;
mod legs;

use std::sync::Arc;

use gaitwright_learning::learn::Stop;
use gaitwright_learning::program::cma::Cma;
use gaitwright_learning::program::cost::{HOLDS, undisturbed};
use gaitwright_learning::program::figures::RolloutFigures;
use gaitwright_learning::program::gaits::{gaits, named};
use gaitwright_learning::program::leg_watch::LegFigures;
use gaitwright_learning::program::legs::{LegChain, Legs};
use gaitwright_learning::program::no_gaits::NoGaits;
use gaitwright_learning::program::refine::Refinement;
use gaitwright_learning::program::ring::{PARAMETERS, PERIOD, TURN, Wanted, program};
use gaitwright_learning::program::rollout::STEERED_STRIDES;
use gaitwright_learning::program::seeds::Seed;
use gaitwright_learning::program::starts::Starts;
use gaitwright_learning::program::steer;
use gaitwright_learning::program::subject::Subject;
use gaitwright_learning::program::template::{SAMPLES, shares, stride};
use gaitwright_physics::character::{Character, read_file};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::{Player, TrunkMeasure};
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;

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

/// The middle legs of a hexapod that goes sideways stand on the line between left and right: rounding does not tell on which side.
#[test]
fn legs_on_the_line_between_are_shared_out_and_a_biped_does_not_walk_sideways() {
    let named = |direction: [f64; 3]| -> Vec<(bool, String)> {
        let Subject { model, legs, .. } = subject("hexapod.json", direction);
        let name = |leg: &LegChain| model.character.links[leg.links[0]].name.replace("_tibia", "");
        legs.legs.iter().map(|leg| (leg.left, name(leg))).collect()
    };
    let expected = |names: [&str; 6]| -> Vec<(bool, String)> {
        names.iter().enumerate().map(|(index, name)| (index < 3, (*name).to_owned())).collect()
    };
    // To the left the left legs are in front, of which the middle one reaches farthest, and the hind legs on the left; the other way
    // round to the right.
    assert_eq!(named([0.0, 1.0, 0.0]), expected(["LM", "LH", "RH", "LF", "RF", "RM"]));
    assert_eq!(named([0.0, -1.0, 0.0]), expected(["RM", "RF", "LF", "RH", "LH", "LM"]));
    let Subject { model, stance, .. } = subject("biped.urdf", [1.0, 0.0, 0.0]);
    let sideways = Legs::of(&model, &stance, [0.0, 1.0, 0.0]);
    assert!(matches!(sideways, Err(NoGaits::Unpaired { left: 0, right: 0, between: 2 })), "{sideways:?}");
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

/// A trunk that leans changes where the feet land, and nothing about the legs that stand: those turn back, within a keyframe, to where
/// they stand without feedback. Whoever held a foot forward while it stands would push the trunk over.
#[test]
fn feedback_places_the_feet_that_swing_and_leaves_those_alone_that_stand() {
    for (name, gait, froude) in [("biped.urdf", "walk", 0.05), ("quadruped.urdf", "trot", 0.4)] {
        let subject = subject(name, [1.0, 0.0, 0.0]);
        let legs = &subject.legs;
        let wanted = Wanted::at_froude(legs, named(gait, legs).unwrap(), froude, GRAVITY);
        let seeds = subject.seeds(&wanted.gait);
        let starts = steer::starts(&seeds[0], true);
        let drawn = steer::drawn(legs, &wanted, &starts, 20, 3);
        assert_eq!(drawn, steer::drawn(legs, &wanted, &starts, 20, 3));
        assert_ne!(drawn, steer::drawn(legs, &wanted, &starts, 20, 4));
        for seed in starts.iter().chain(&drawn) {
            let steps = program(legs, &wanted, &seed.parameters).steps;
            let (ring, _) = subject.ring(&wanted, &seed.parameters);
            let steering = ring.steering.unwrap();
            assert_eq!(steering.tables.len(), 5);
            for table in &steering.tables {
                let heading = table.measure == TrunkMeasure::Heading;
                for (leg, step) in legs.legs.iter().zip(&steps) {
                    let changed = |at: usize| {
                        let [least, greatest] = [&table.rings[0], table.rings.last().unwrap()].map(|ring| {
                            leg.joints.iter().map(|&joint| ring[at].angles[joint].abs()).fold(0.0, f64::max)
                        });
                        least.max(greatest)
                    };
                    let since = |at: usize| (at as f64 / 8.0 - step.phase).rem_euclid(1.0);
                    let standing = (0..8).filter(|&at| (0.125..step.duty).contains(&since(at)));
                    assert!(standing.map(changed).all(|change| heading || change == 0.0));
                    let landing = (0..8).filter(|&at| since(at) > 0.8).map(changed).sum::<f64>();
                    assert!(heading || landing > 0.0, "{name}: {landing} rad for {:?}", table.measure);
                }
            }
        }
    }
}

/// On points nothing stands still: a search finds programs that go on for 15 strides with feedback, and none without.
#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn feedback_balances_on_points() {
    let file = read_file(&crate::common::robots().join("bolt.urdf"), Default::default()).unwrap();
    let subject = subject_of(file.character, [1.0, 0.0, 0.0]);
    let accuracy = Accuracy { step: 0.004, ..subject.accuracy };
    let arena = Subject { accuracy, ..subject.clone() }.arena().unwrap();
    let legs = &subject.legs;
    let wanted = Wanted::at_froude(legs, named("walk", legs).unwrap(), 0.05, GRAVITY);
    let pool = rayon::ThreadPoolBuilder::new().build().unwrap();
    let seeds: Vec<Seed> =
        subject.seeds(&wanted.gait).iter().flat_map(|it| steer::starts(it, true)).collect();
    let upright = |steered: bool| {
        let mut drawn = steer::drawn(legs, &wanted, &seeds, 2000, 1);
        if !steered {
            drawn.iter_mut().for_each(|seed| seed.parameters.truncate(PARAMETERS));
        }
        let here = (&pool, &Stop::default());
        let starts = Starts::new(here, &subject, &arena, &wanted, &drawn, STEERED_STRIDES).unwrap();
        let mut refinement = Refinement::new(&subject, &wanted, (&starts, 0), (STEERED_STRIDES, 0, 1));
        for _ in 0..60 {
            refinement.generation(here, &subject, &arena, &wanted).unwrap();
        }
        refinement.best().figures.upright
    };
    let [alone, steered] = [false, true].map(upright);
    assert!(alone < 0.9, "{alone} of {STEERED_STRIDES} strides without feedback");
    assert_eq!(steered, 1.0, "and {alone} without feedback");

    // About where searches ended it takes few programs to find one that goes on.
    let about_ends = steer::drawn(legs, &wanted, &steer::ends(), 200, 1);
    let stands = |seed: &Seed| {
        let (ring, gains) = subject.ring(&wanted, &seed.parameters);
        arena.run(&ring, &gains, STEERED_STRIDES).upright == 1.0
    };
    let count = pool.install(|| about_ends.par_iter().filter(|seed| stands(seed)).count());
    assert!(count >= 5, "{count} of 200 about where searches ended");
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
