//! How far shapes move is never underestimated: against where their points are.

use gaitwright_physics::model::Model;
use gaitwright_physics::sim::State;
use gaitwright_physics::sim::bodies::Bodies;
use gaitwright_physics::sim::contact::DetectionSettings;
use gaitwright_physics::sim::contact::travel::Travel;
use gaitwright_physics::sim::coordinates::reduced::kinematics::place;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::common;
use super::itself::sliding_arm;

/// Of distances of about a metre, m.
const ROUNDING: f64 = 1e-12;

fn vector(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-size..size))
}

fn placed(model: &Model, state: &State) -> Bodies {
    let mut bodies = Bodies::new(model);
    place(model, state, &mut bodies);
    bodies
}

/// Bodies and points on the balls of their shapes, in the frames of the bodies.
fn points(model: &Model, rng: &mut ChaCha8Rng) -> Vec<(usize, Vector3<f64>)> {
    let shapes = model.ground_shapes.iter().flat_map(|shape| [shape; 8]);
    shapes.map(|shape| (shape.body, shape.center + vector(rng, 1.0).normalize() * shape.reach)).collect()
}

#[test]
fn no_two_points_come_nearer_than_their_travel_allows() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let models = [common::example("quadruped.urdf"), common::example("snake.json"), sliding_arm()];
    for (case, world) in [false, true].repeat(150).into_iter().enumerate() {
        let model = &models[case % 3];
        let points = points(model, &mut rng);
        let mut state = State::new(model);
        // Far outside of the limits, too.
        state.angles.fill_with(|| rng.random_range(-3.0..3.0));
        let mut travel = Travel::new(model, world);
        let origin = |state: &State| state.root.position.coords;
        let bodies = placed(model, &state);
        assert!(travel.update(model, &bodies, origin(&state), None).is_infinite());
        assert!(travel.update(model, &bodies, origin(&state), Some(&state.angles)).is_infinite());
        assert!(travel.nearer(0, None).is_infinite());
        let size = 10f64.powf(rng.random_range(-6.0..0.0));
        travel.measure(model, size);
        let at = |state: &State| -> Vec<Vector3<f64>> {
            let bodies = placed(model, state);
            points.iter().map(|(body, point)| bodies.at(*body).point(*point) + origin(state)).collect()
        };
        let before = at(&state);
        for _ in 0..4 {
            // No joint by more than it was said to slide in all; as a rule, one or two of them alone.
            let share = rng.random_range(0.0..1.0);
            for angle in &mut state.angles {
                if rng.random_bool(share) {
                    *angle += size / 4.0 * rng.random_range(-1.0..1.0_f64).signum();
                }
            }
            state.root.position += vector(&mut rng, size) * share;
            state.root.orientation =
                UnitQuaternion::new(vector(&mut rng, size) * share) * state.root.orientation;
            let bodies = placed(model, &state);
            let farthest = travel.update(model, &bodies, origin(&state), Some(&state.angles));
            let now = at(&state);
            for (index, (body, _)) in points.iter().enumerate() {
                assert!(travel.nearer(*body, None) <= farthest);
                if world {
                    let moved = (now[index] - before[index]).norm();
                    assert!(moved <= travel.nearer(*body, None) + ROUNDING, "case {case}: {moved} m");
                }
                for (other, (bound, _)) in points[..index].iter().enumerate() {
                    let change = (now[index] - now[other]).norm() - (before[index] - before[other]).norm();
                    let travelled = travel.nearer(*body, Some(*bound));
                    assert!(change.abs() <= travelled + ROUNDING, "case {case}: {change} m of {travelled} m");
                }
            }
        }
    }
}

/// An arm swings its farthest point along the arc, a slide goes where it goes, and the root carries all of it.
#[test]
fn travel_is_what_the_joints_turn_times_how_far_the_shapes_reach() {
    let model = sliding_arm();
    let mut state = State::new(&model);
    let mut travel = Travel::new(&model, false);
    let mut look = |angles: [f64; 4]| {
        state.angles.copy_from_slice(&angles);
        let bodies = placed(&model, &state);
        let farthest = travel.update(&model, &bodies, Vector3::zeros(), Some(&state.angles));
        travel.measure(&model, 0.01);
        farthest
    };
    let half = |size: [f64; 3]| Vector3::from(size).norm() / 2.0;
    let (post, hand) = (half([0.05, 0.05, 0.3]), half([0.1, 0.1, 0.04]));
    look([0.0, 0.0, 0.1, 0.0]);
    let mut check = |angles, travelled: f64| {
        let found = look(angles);
        assert!((found - travelled).abs() < ROUNDING, "{found} m instead of {travelled} m");
    };
    check([0.2, 0.0, 0.1, 0.0], 0.2 * post);
    check([0.2, 0.1, 0.1, 0.0], 0.1 * (0.1 + 0.1 + 0.01 + 0.12 + hand));
    check([0.2, 0.1, 0.105, 0.0], 0.005);
    check([0.2, 0.1, 0.105, 0.3], 0.3 * hand);
    check([0.1, 0.1, 0.105, 0.301], f64::max(0.1 * post, 0.001 * hand));
}

#[test]
fn no_two_points_close_faster_than_foreseen() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let models = [common::example("quadruped.urdf"), common::example("snake.json"), sliding_arm()];
    for (case, world) in [false, true].repeat(150).into_iter().enumerate() {
        let model = &models[case % 3];
        let points = points(model, &mut rng);
        let mut state = State::new(model);
        state.angles.fill_with(|| rng.random_range(-1.0..1.0));
        state.velocities.fill_with(|| rng.random_range(-5.0..5.0));
        state.root.linear_velocity = vector(&mut rng, 3.0);
        state.root.angular_velocity = vector(&mut rng, 3.0);
        let bodies = placed(model, &state);
        let outlook = DetectionSettings {
            step: 0.002,
            ahead: 0.002,
            acceleration: 9.81,
            gravity: 9.81,
            anticipate: true,
            restitution: 0.0,
        };
        let mut travel = Travel::new(model, world);
        let most = travel.measure_speeds(&bodies, &outlook);
        let moving: Vec<_> = points
            .iter()
            .map(|(body, point)| {
                let at = bodies.at(*body).point(*point);
                (*body, at, bodies.at(*body).velocity.at(at))
            })
            .collect();
        for (index, (body, at, velocity)) in moving.iter().enumerate() {
            for (bound, other, others) in &moving[..index] {
                let speed = (velocity - others).dot(&(other - at).normalize());
                let within = travel.within(*body, Some(*bound), &outlook);
                assert!(
                    outlook.margin(speed) <= within + ROUNDING && within <= most,
                    "case {case}: {speed} m/s"
                );
            }
            if world {
                assert!(
                    outlook.margin(velocity.norm()) <= travel.within(*body, None, &outlook) + ROUNDING,
                    "case {case}"
                );
            }
        }
    }
}
