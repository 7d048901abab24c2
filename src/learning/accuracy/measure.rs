//! Measures of error: how far a state is from the true one.

use nalgebra::Matrix3;

use gaitwright_physics::model::{Body, Model};
use gaitwright_physics::sim::State;
use gaitwright_physics::sim::bodies::Bodies;
use gaitwright_physics::sim::coordinates::reduced::kinematics::place;

/// A measure of error.
#[derive(Debug, Clone, Copy)]
pub struct Measure {
    /// What it measures, in words.
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The error of the first state against the second, of the same model.
    pub of: fn(&Model, &State, &State) -> f64,
}

impl Measure {
    /// See [`displacement()`].
    pub const DISPLACEMENT: Self = Self {
        what: "displacement of the bodies: root mean square over the bodies, and over the mass of each",
        unit: "m",
        of: displacement,
    };

    /// Distance between the root's origin and its true position.
    pub(super) const ROOT_POSITION: Self =
        Self { what: "distance of the body from where it should be", unit: "m", of: root_distance };

    /// Angle of the rotation between the root's orientation and its true one.
    pub(super) const ROOT_ORIENTATION: Self =
        Self { what: "angle between the body's orientation and the true one", unit: "rad", of: root_angle };

    /// Greatest error of a joint angle.
    pub(super) const JOINT_ANGLE: Self =
        Self { what: "greatest error of a joint angle", unit: "rad", of: joint_angle };
}

/// Root mean square, over the bodies and over the mass of each, of the distance between where a material
/// point of the body is in `state` and where it is in `truth`, m.
///
/// Every body counts alike, a foot as much as the trunk. Of a body with mass m, inertia I and centre of mass c
/// it is |Δc|² + tr(ΔR S ΔRᵀ) / m with the second moment of its mass S = ½ tr(I) 1 − I, so that position and
/// orientation enter in one unit without a weight to be chosen. Of a massless body it is the distance between
/// its centres.
pub fn displacement(model: &Model, state: &State, truth: &State) -> f64 {
    let (actual, wanted) = (placed(model, state), placed(model, truth));
    let gap = state.root.position - truth.root.position;
    let square = |(index, body): (usize, &Body)| {
        let center = gap + actual.at(index).center - wanted.at(index).center;
        let rotation_error = actual.at(index).rotation - wanted.at(index).rotation;
        let rotational = (rotation_error * second_moment(body) * rotation_error.transpose()).trace().max(0.0);
        center.norm_squared() + rotational
    };
    let sum: f64 = model.bodies.iter().enumerate().map(square).sum();
    (sum / model.bodies.len() as f64).sqrt()
}

/// ∫ r rᵀ dm / m about the centre of mass, along the axes of the body, m².
fn second_moment(body: &Body) -> Matrix3<f64> {
    if body.mass > 0.0 {
        (Matrix3::identity() * (0.5 * body.inertia.trace()) - body.inertia) / body.mass
    } else {
        Matrix3::zeros()
    }
}

fn placed(model: &Model, state: &State) -> Bodies {
    let mut bodies = Bodies::new(model);
    place(model, state, &mut bodies);
    bodies
}

fn root_distance(_: &Model, state: &State, truth: &State) -> f64 {
    (state.root.position - truth.root.position).norm()
}

fn root_angle(_: &Model, state: &State, truth: &State) -> f64 {
    // By the difference of the quaternions, which resolves angles that the cosine cannot distinguish from 0.
    let (own, other) = (state.root.orientation.coords, truth.root.orientation.coords);
    let chord = (own - other).norm().min((own + other).norm());
    4.0 * (0.5 * chord).min(1.0).asin()
}

fn joint_angle(_: &Model, state: &State, truth: &State) -> f64 {
    state.angles.iter().zip(&truth.angles).map(|(angle, wanted)| (angle - wanted).abs()).fold(0.0, f64::max)
}
