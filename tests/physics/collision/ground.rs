//! No place of a surface that is near the ground is passed over: against a look at every point of every shape.

use std::collections::BTreeSet;

use gaitwright_physics::model::{Model, Surface};
use gaitwright_physics::scene::Terrain;
use gaitwright_physics::sim::State;
use gaitwright_physics::sim::bodies::Bodies;
use gaitwright_physics::sim::contact::{DetectionSettings, ground};
use gaitwright_physics::sim::coordinates::reduced::kinematics::place;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::common;

/// Height of the ground, m.
const HEIGHT: f64 = 0.3;

/// Slots of all points that can reach the ground within the margin, found without any bound of bodies or shapes; but for those of
/// cylinders and of shapes with many corners.
fn near(model: &Model, bodies: &Bodies, origin: f64, settings: &DetectionSettings) -> BTreeSet<usize> {
    let mut slots = BTreeSet::new();
    for shape in &model.ground_shapes {
        let Surface::Points { first, count, radius } = shape.surface else { continue };
        let body = bodies.at(shape.body);
        for (index, point) in model.ground_points[first..first + count].iter().enumerate() {
            let at = body.point(*point) - Vector3::z() * radius;
            let approach = -(body.velocity.linear + body.velocity.angular.cross(&at)).z;
            let gap = at.z + origin - HEIGHT;
            if count <= ground::CORNERS_KEPT_WHOLE && gap <= settings.margin(approach) {
                slots.insert(shape.first_slot + index);
            }
        }
    }
    slots
}

#[test]
fn no_point_near_the_ground_is_passed_over() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let models = ["quadruped.urdf", "hexapod.json", "biped.urdf", "snake.json"].map(common::example);
    let mut kept = [0; 4];
    for case in 0..4000 {
        let model = &models[case % 4];
        let mut state = State::new(model);
        state.root.position.z = HEIGHT + rng.random_range(0.0..2.0) * model.size;
        let turn = Vector3::from_fn(|_, _| rng.random_range(-3.0..3.0));
        state.root.orientation = UnitQuaternion::new(turn);
        state.root.linear_velocity = Vector3::from_fn(|_, _| rng.random_range(-5.0..5.0));
        state.root.angular_velocity = Vector3::from_fn(|_, _| rng.random_range(-10.0..10.0));
        state.angles.fill_with(|| rng.random_range(-2.0..2.0));
        state.velocities.fill_with(|| rng.random_range(-10.0..10.0));
        let mut bodies = Bodies::new(model);
        place(model, &state, &mut bodies);
        let step = 10f64.powf(rng.random_range(-4.0..-1.5));
        let settings = DetectionSettings {
            step,
            ahead: step,
            acceleration: 9.81,
            gravity: 9.81,
            anticipate: true,
            restitution: 0.0,
        };
        let (mut candidates, mut close) = (Vec::new(), Vec::new());
        let terrain = Terrain::Plane { height: HEIGHT };
        let origin = state.root.position.coords;
        ground::detect(model, &bodies, &terrain, origin, &settings, &mut candidates, &mut close);
        let expected = near(model, &bodies, origin.z, &settings);
        let whole = |slot: usize| {
            model.ground_shapes.iter().any(|shape| match shape.surface {
                Surface::Points { count, .. } => {
                    count <= ground::CORNERS_KEPT_WHOLE
                        && (shape.first_slot..shape.first_slot + count).contains(&slot)
                }
                Surface::Cylinder { .. } => false,
            })
        };
        let found: BTreeSet<usize> =
            candidates.iter().map(|candidate| candidate.slot).filter(|slot| whole(*slot)).collect();
        assert_eq!(found, expected, "case {case}: {}", model.character.name);
        kept[case % 4] += expected.len();
    }
    // Near the ground is neither nothing nor everything.
    for (model, kept) in models.iter().zip(kept) {
        let points = 1000 * model.ground_points.len();
        assert!(kept > 0 && 2 * kept < points, "{}: {kept} of {points}", model.character.name);
    }
}
