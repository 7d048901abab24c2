//! Round shapes fall as they like and do not sink into what they fall on: their lowest point runs round a rim faster than the
//! body turns.

use gaitwright_physics::scene::{Ground, Scene};
use gaitwright_physics::sim::State;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{body, obstacle, read, simulator};
use gaitwright_physics::character::Source;
use gaitwright_physics::sim::Command;

fn three(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-size..size))
}

/// A disc of the same size with 32 corners on each rim.
fn polygon() -> String {
    let corners: Vec<String> = (0..64)
        .map(|corner| {
            let angle = f64::from(corner / 2) * std::f64::consts::TAU / 32.0;
            let side = if corner % 2 == 0 { 0.025 } else { -0.025 };
            format!("[{}, {}, {side}]", 0.1 * angle.cos(), 0.1 * angle.sin())
        })
        .collect();
    format!(
        r#"{{"format": "gaitwright/character@1", "name": "disc", "links": [{{"name": "disc", "density": 1000,
            "shapes": [{{"kind": "hull", "vertices": [{}]}}]}}]}}"#,
        corners.join(", ")
    )
}

#[test]
fn discs_that_wobble_do_not_sink() {
    let cylinder = body(r#"<cylinder radius="0.1" length="0.05"/>"#);
    let models = [cylinder, read(&polygon(), Source::Json)];
    let floor = obstacle(r#"{"kind": "box", "size": [20, 20, 1], "pose": {"position": [0, 0, -0.5]}}"#);
    let scenes = [
        Scene { ground: Some(Ground::Plane { height: 0.0 }), ..Scene::default() },
        Scene { ground: None, obstacles: vec![floor], ..Scene::default() },
    ];
    // The step is an order more exact than its length, and what it lets sink in is a fifth of a millimetre.
    for (step, bound) in [(0.002, 2e-4), (0.008, 8e-4)] {
        let mut rng = ChaCha8Rng::seed_from_u64(17);
        for case in 0..40 {
            let mut start = State::new(&models[0]);
            start.root.position = Point3::new(0.0, 0.0, rng.random_range(0.15..1.0));
            start.root.orientation = UnitQuaternion::new(three(&mut rng, 3.0));
            start.root.linear_velocity = three(&mut rng, 3.0);
            let spin = if case < 20 { 20.0 } else { 3.0 };
            start.root.angular_velocity = three(&mut rng, spin);
            let mut scene = scenes[case / 2 % 2].clone();
            scene.friction = [0.8, 0.0][case / 4 % 2];
            let mut simulator = simulator(&models[case % 2], &scene, step, start);
            let mut touched = false;
            for index in 0..(1.5 / step) as usize {
                simulator.step(Command::Passive).unwrap();
                touched |= simulator.contacts().next().is_some();
                let depth = simulator.contacts().map(|contact| contact.depth).fold(0.0, f64::max);
                assert!(depth < bound, "case {case}, step {index} of {step} s: {depth} m deep");
            }
            assert!(touched);
        }
    }
}
