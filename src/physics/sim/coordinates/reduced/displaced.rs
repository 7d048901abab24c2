//! The character half a step away from where forces are taken.

use super::kinematics::place;
use nalgebra::Vector3;

use crate::model::Model;
use crate::sim::bodies::Bodies;
use crate::sim::energy::kinetic_energy;
use crate::sim::integrate::advance;
use crate::sim::momentum::Composite;
use crate::sim::spatial::SpatialMotion;
use crate::sim::state::State;

/// How the character moves half a step away.
#[derive(Debug, Clone, Copy)]
pub struct RelativeMotion {
    /// Kinetic energy, less that of the centre of mass, J.
    pub kinetic: f64,
    /// Velocity of the centre of mass, m/s.
    pub center: Vector3<f64>,
}

/// The character half a step away from where forces are taken.
#[derive(Debug, Clone)]
pub struct Displaced {
    state: State,
    pub bodies: Bodies,
}

impl Displaced {
    /// Room for `model`.
    pub fn new(model: &Model) -> Self {
        Self { state: State::new(model), bodies: Bodies::new(model) }
    }

    /// The character of `from` moved for `time` seconds along the velocity `root` of its root and the joint
    /// velocities `rates`, with which it moves there too. The motion given is relative to the centre of mass, or to the world
    /// where the root is fixed to it.
    pub fn displace(
        &mut self,
        model: &Model,
        from: &State,
        root: SpatialMotion,
        rates: &[f64],
        time: f64,
    ) -> RelativeMotion {
        let Self { state, bodies } = self;
        state.root = from.root;
        state.root.linear_velocity = root.linear;
        state.root.angular_velocity = root.angular;
        state.angles.copy_from_slice(&from.angles);
        state.velocities.copy_from_slice(rates);
        advance(state, root, rates, time);
        place(model, state, bodies);
        let kinetic = kinetic_energy(model, bodies, rates);
        if model.fixed_base {
            return RelativeMotion { kinetic, center: Vector3::zeros() };
        }
        // Of these bodies the root moves already.
        let momentum = Composite::new(bodies).momentum(SpatialMotion::ZERO).linear;
        let center = momentum / model.mass;
        RelativeMotion { kinetic: kinetic - 0.5 * momentum.dot(&center), center }
    }
}
