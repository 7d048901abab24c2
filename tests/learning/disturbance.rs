//! What gaits have to withstand in the search and in the trials, and what it changes.

use std::sync::Arc;

use gaitwright_learning::learn::{Cancel, Stop};
use gaitwright_learning::program::disturbance::{heavier, with_friction};
use gaitwright_learning::program::gaits::named;
use gaitwright_learning::program::ring::{PARAMETERS, PERIOD, Wanted};
use gaitwright_learning::program::rollout::STRIDES;
use gaitwright_learning::program::subject::Subject;
use gaitwright_physics::character::Friction;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Trial;
use gaitwright_physics::scene::{Accuracy, Obstacle, Scene, StepPlan};
use gaitwright_physics::stance::Stance;

use crate::common::example;
use crate::program::brisk;

fn subject(name: &str) -> Subject {
    let (model, scene) = (example(name), Scene::default());
    let stance = Arc::new(Stance::find(&model, &scene));
    Subject::new(&model, &stance, &scene, &Accuracy::default(), [1.0, 0.0, 0.0]).unwrap()
}

#[test]
fn friction_that_links_and_obstacles_have_of_their_own_is_scaled_too() {
    let mut character = (*example("quadruped.urdf").character).clone();
    let feet: Vec<usize> =
        (0..character.links.len()).filter(|&link| character.links[link].name.ends_with("_foot")).collect();
    assert_eq!(feet.len(), 4);
    for &foot in &feet {
        character.links[foot].surface.friction = Some(Friction::Uniform(0.3));
    }
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let step = r#"{"name": "step", "shape": {"kind": "box", "size": [1, 1, 0.1]}, "friction": 0.5}"#;
    let step: Obstacle = serde_json::from_str(step).unwrap();
    let scene = Scene { obstacles: vec![step], ..Scene::default() };
    for factor in [0.6, 1.4] {
        let (scene, model) = with_friction(factor, &scene, &model);
        let plan = StepPlan::compile(&scene, &Accuracy::default(), None, &model).unwrap();
        let surfaces = &plan.surfaces;
        let near = |found: f64, usual: f64| assert!((found - factor * usual).abs() < 1e-15, "{found}");
        near(surfaces.ground.friction, 0.8);
        near(surfaces.obstacles[0].friction, 0.5);
        for (link, surface) in surfaces.links.iter().enumerate() {
            near(surface.friction, if feet.contains(&link) { 0.3 } else { 0.8 });
        }
    }
}

#[test]
fn a_heavier_character_weighs_more_in_all_its_parts() {
    let model = example("quadruped.urdf");
    let heavy = heavier(1.1, &model);
    assert!((heavy.mass / model.mass - 1.1).abs() < 1e-12);
    for (heavy, body) in heavy.bodies.iter().zip(&model.bodies) {
        assert!((heavy.inertia - body.inertia * 1.1).norm() < 1e-12 * body.inertia.norm());
        assert!((heavy.center - body.center).norm() < 1e-12);
    }
}

#[test]
fn a_trial_is_kept_by_who_stays_up_and_goes_on_as_fast() {
    let trial = |upright_seconds: f64, relative_speed: Option<f64>| Trial {
        change: "friction times 0.6".into(),
        upright_seconds,
        speed: 1.0,
        relative_speed,
        tolerance: Trial::usual_tolerance(),
        of_seconds: 20.0,
    };
    for share in [0.81, 1.0, 1.19] {
        assert!(trial(20.0, Some(share)).kept(), "{share} of the speed");
    }
    for share in [Some(0.79), Some(1.21), Some(-1.0), Some(f64::NAN), None] {
        assert!(trial(20.0, share).stood() && !trial(20.0, share).kept(), "{share:?} of the speed");
    }
    // It fell, though fast until then.
    assert!(!trial(19.0, Some(1.0)).kept());
    // A document that says nothing of a tolerance has the usual one; a smaller one is kept to.
    let document = serde_json::to_value(trial(20.0, Some(0.9))).unwrap();
    let mut older = document.clone();
    older.as_object_mut().unwrap().remove("tolerance");
    assert_eq!(serde_json::from_value::<Trial>(older).unwrap(), trial(20.0, Some(0.9)));
    assert!(!Trial { tolerance: 0.05, ..trial(20.0, Some(0.9)) }.kept());
}

#[test]
fn each_disturbance_is_a_run_of_its_own() {
    let subject = subject("quadruped.urdf");
    let trot = named("trot", &subject.legs).unwrap();
    let wanted = Wanted::at_froude(&subject.legs, trot, 0.4, subject.gravity());
    let mut parameters = vec![0.0; PARAMETERS];
    parameters[PERIOD] = -1.5;
    let (ring, gains) = subject.ring(&wanted, &parameters);
    let arena = subject.arena().unwrap();
    let plain = arena.run(&ring, &gains, STRIDES);
    assert_eq!(plain.upright, 1.0);
    let disturbed = arena.run_disturbed(&plain, &ring, &gains, STRIDES);
    let [weak, soft] = &disturbed[..] else { panic!("{} runs", disturbed.len()) };
    // The peaks are taken from the forces by soft ground, and softer springs get elsewhere.
    assert!(soft.peak < plain.peak, "{} of {}", soft.peak, plain.peak);
    assert!((weak.speed / plain.speed - 1.0).abs() > 0.01, "{} of {} m/s", weak.speed, plain.speed);
    assert_ne!(weak.peak, soft.peak);

    // The ground is less soft where the gait leaps.
    let [leaping, trotting] = ["bound", "trot"].map(|name| {
        let arena = arena.clone().suited(&named(name, &subject.legs).unwrap());
        arena.run_disturbed(&plain, &ring, &gains, STRIDES).swap_remove(1)
    });
    assert_eq!(&trotting, soft);
    assert!(soft.peak < leaping.peak && leaping.peak < plain.peak, "{} of {}", leaping.peak, plain.peak);

    // The legs are not softer on little friction where the gait leaps: made as soft beforehand, they do what those of others do.
    let mut soft_legs = gains.clone();
    soft_legs.stiffness.iter_mut().chain(&mut soft_legs.damping).for_each(|gain| *gain *= 0.75);
    let bounding = arena.clone().suited(&named("bound", &subject.legs).unwrap());
    assert_eq!(bounding.run_disturbed(&plain, &ring, &soft_legs, STRIDES)[0], *weak);
    assert_ne!(bounding.run_disturbed(&plain, &ring, &gains, STRIDES)[0], *weak);

    // Where it gallops, the same ground is slippery, too.
    let arena_of = |name: &str| arena.clone().suited(&named(name, &subject.legs).unwrap());
    let galloping = arena_of("transverse gallop").run_disturbed(&plain, &ring, &gains, STRIDES);
    assert_ne!(galloping[1], leaping);
    let scene = Scene { friction: 0.7 * subject.scene.friction, ..subject.scene.clone() };
    let slippery = Subject { scene, ..subject.clone() }.arena().unwrap();
    let bounding = slippery.suited(&named("bound", &subject.legs).unwrap());
    assert_eq!(bounding.run_disturbed(&plain, &ring, &gains, STRIDES)[1], galloping[1]);

    // Where the scene is as soft already, that is no disturbance.
    for (contact_time_constant, [trots, bounds]) in [(0.1, [1, 1]), (0.018, [2, 1]), (0.003, [2, 2])] {
        let scene = Scene { contact_time_constant, ..Scene::default() };
        let softer = Subject { scene, ..subject.clone() }.arena().unwrap();
        let plain = softer.run(&ring, &gains, STRIDES);
        for (name, runs) in [("trot", trots), ("bound", bounds)] {
            let softer = softer.clone().suited(&named(name, &subject.legs).unwrap());
            assert_eq!(softer.run_disturbed(&plain, &ring, &gains, STRIDES).len(), runs);
        }
    }
}

/// What balances is pushed on soft ground too, while it sets out, and its legs are weak there and on usual ground instead of on slippery
/// ground. It sets out three times more, which takes no more than the first strides.
#[test]
fn what_balances_is_pushed_on_soft_ground_by_weaker_legs_and_sets_out_again() {
    let subject = subject("quadruped.urdf");
    let trot = named("trot", &subject.legs).unwrap();
    let wanted = Wanted::at_froude(&subject.legs, trot, 0.4, subject.gravity());
    let (ring, gains) = subject.ring(&wanted, &brisk());
    let arena = subject.arena().unwrap();
    let accuracy = Accuracy { step: 2.0 * subject.accuracy.step, ..subject.accuracy };
    let longer = Subject { accuracy, ..subject.clone() }.arena().unwrap();
    let plain = arena.run(&ring, &gains, STRIDES);
    let usual = arena.run_disturbed(&plain, &ring, &gains, STRIDES);
    let arena = arena.balancing(&longer);
    assert_eq!(arena.run(&ring, &gains, STRIDES), plain);
    let balancing = arena.run_disturbed(&plain, &ring, &gains, STRIDES);
    assert_eq!(balancing.len(), 6);
    assert!(usual.iter().zip(&balancing).all(|(usual, balancing)| usual != balancing));
    // The legs on slippery ground are those of leaps there, and the push is the same.
    let bounding = subject.arena().unwrap().suited(&named("bound", &subject.legs).unwrap());
    assert_eq!(bounding.run_disturbed(&plain, &ring, &gains, STRIDES)[0], balancing[0]);
    // What is seen while it sets out differs each time, and does not depend on how long the other runs are.
    let setting_out = &balancing[3..];
    for (index, figures) in setting_out.iter().enumerate() {
        assert!(figures.upright == 1.0 && *figures != plain);
        assert!(setting_out[..index].iter().all(|other| other != figures));
    }
    let long = arena.run_disturbed(&plain, &ring, &gains, 2 * STRIDES);
    assert_eq!(&long[3..], setting_out);
    assert!(long[..3].iter().zip(&balancing).all(|(long, short)| long.seconds > 1.5 * short.seconds));
    // One of them takes the longer step, the others do not.
    let as_long = subject.arena().unwrap().balancing(&subject.arena().unwrap());
    let as_long = as_long.run_disturbed(&plain, &ring, &gains, STRIDES);
    let same: Vec<bool> = balancing.iter().zip(&as_long).map(|(one, other)| one == other).collect();
    assert_eq!(same, [true, true, true, false, true, true]);
}

#[test]
fn a_run_that_is_called_off_ends_at_once() {
    let subject = subject("quadruped.urdf");
    let cancel = Cancel::default();
    let stop = Stop::new(&cancel, None);
    let arena = subject.arena().unwrap().until(&stop);
    let trot = named("trot", &subject.legs).unwrap();
    let wanted = Wanted::at_froude(&subject.legs, trot, 0.4, subject.gravity());
    let (ring, gains) = subject.ring(&wanted, &[0.0; PARAMETERS]);
    let run = || arena.run(&ring, &gains, STRIDES).seconds;
    assert!(stop.whole(run).is_ok_and(|seconds| seconds > 0.0));
    cancel.cancel();
    assert_eq!(run(), 0.0);
    assert!(stop.whole(run).is_err());
}
