//! Loads and pushes of motions that are played: against weight and free flight.

use std::sync::Arc;

use gaitwright_physics::character::{Options, read_file};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Player;
use gaitwright_physics::playback::{Playback, Push, Trace};
use gaitwright_physics::scene::{Accuracy, Scene, StepPlan};
use gaitwright_physics::stance::{Stance, Upright};
use nalgebra::Vector3;

use crate::common;

/// The bundled quadruped, moving its legs to and fro for `seconds` in `scene`.
fn played(scene: &Scene, seconds: f64, sample_every: f64, push: Option<Push>) -> (Trace, f64) {
    let character = read_file(&common::example_path("quadruped.urdf"), Options::default()).unwrap().character;
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    let plan = StepPlan::compile(scene, &Accuracy::default(), Some(&stance.gains), &model).unwrap();
    let bent: Vec<f64> = stance.angles.iter().map(|angle| angle + 0.05).collect();
    let rest = vec![0.0; bent.len()];
    let cycle = [(&bent[..], &rest[..]), (&stance.angles[..], &rest[..])];
    let player = Player::from_postures(&stance.angles, std::iter::empty(), cycle, 0.2);
    let playback = Playback {
        model: &model,
        plan: &Arc::new(plan),
        start: &stance.state,
        player: &player,
        upright: &Upright::new(&model, &stance, scene),
        seconds,
        sample_every,
    };
    (playback.run_pushed(push, || false), model.mass)
}

/// The loads of a sample are the means of those of all steps since the one before, and together they carry the weight, but
/// for what the centre of mass has gained in momentum.
#[test]
fn loads_are_means_over_all_steps_and_carry_the_weight() {
    let step = Accuracy::default().step;
    let (fine, mass) = played(&Scene::default(), 1.0, step, None);
    let (coarse, _) = played(&Scene::default(), 1.0, 10.0 * step, None);
    for (sample, steps) in coarse.samples[1..].iter().zip(fine.samples[1..].chunks(10)) {
        for (link, load) in sample.loads.iter().enumerate() {
            let mean = steps.iter().map(|sample| sample.loads[link]).sum::<f64>() / 10.0;
            assert!((load - mean).abs() < 1e-9 * (1.0 + mean), "link {link}: {load} N instead of {mean} N");
        }
    }
    let total = |sample: &gaitwright_physics::playback::Sample| sample.loads.iter().sum::<f64>();
    let mean = fine.samples[1..].iter().map(total).sum::<f64>() / (fine.samples.len() - 1) as f64;
    // The velocity of the centre of mass at the end, over the second that it took, is its mean acceleration.
    let [.., a, b] = &fine.samples[..] else { panic!("no samples") };
    let gained = (b.center_of_mass.z - a.center_of_mass.z) / step;
    assert!((mean / mass - 9.81 - gained).abs() < 0.02, "{} m/s²", mean / mass);
}

/// In free flight a push changes nothing but the velocity of the whole: Galilei's transformation.
#[test]
fn a_push_moves_the_whole_character() {
    let scene = Scene { ground: None, ..Scene::default() };
    let push = Push { time: 0.3, velocity: Vector3::new(0.1, -0.4, 0.2) };
    let (plain, _) = played(&scene, 0.6, 0.02, None);
    let (pushed, _) = played(&scene, 0.6, 0.02, Some(push));
    assert_eq!(plain.samples.len(), pushed.samples.len());
    let step = Accuracy::default().step;
    for (a, b) in plain.samples.iter().zip(&pushed.samples) {
        // It acts at the beginning of the step that ends at its time.
        let since = (a.time - push.time + step).max(0.0);
        let apart = b.center_of_mass - a.center_of_mass - push.velocity * since;
        assert!(apart.norm() < 1e-9, "{apart:?} at {} s", a.time);
        for (angle, other) in a.angles.iter().zip(&b.angles) {
            assert!((angle - other).abs() < 1e-9);
        }
    }
}
