//! The grid of all states: how angles, velocities and times are discretised.

use nalgebra::Vector3;

use super::behaviour::Posture;
use super::limb::{JointChain, Sagittal, limbs};
use super::parameters::Parameters;
use super::repairs::Repair;
use super::symmetry::Symmetry;
use gaitwright_physics::model::{DofKind, Model};
use gaitwright_physics::motion::TargetLimits;
use gaitwright_physics::stance::Stance;

pub use super::levels::{GridState, JointGrid, Level};

/// The grids of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// One a joint of the model.
    pub joints: Vec<JointGrid>,
    /// Limbs, in the order of the model's joints.
    pub limbs: Vec<JointChain>,
    /// Greatest number of beats of a transition, at least 1.
    pub beats: u8,
    /// What subsets are closed under; `None` where they are not.
    pub symmetry: Option<Symmetry>,
}

impl Grid {
    /// Discretises the joints of `model` around its standing pose, for travel along `direction` (world frame; only x and
    /// y count). A joint without an actuator has one level only, its standing angle at rest.
    pub fn new(model: &Model, stance: &Stance, direction: [f64; 3], parameters: &Parameters) -> Self {
        let limits = TargetLimits::of(&model.character);
        let joints = (0..model.joint_count()).map(|joint| {
            let reach = match model.bodies[joint + 1].dof {
                DofKind::Revolute => parameters.reach,
                // The arc of the same angle at a radius of half the standing height.
                DofKind::Prismatic => parameters.reach * 0.5 * model.height_scale(stance.root_height),
            };
            let crossing = parameters.swing * reach / parameters.transition_time;
            // A joint without an actuator has no targets to choose from.
            let levels = match model.driven[joint] {
                true => (parameters.angle_levels, parameters.velocity_levels),
                false => (1, 1),
            };
            let speed = model.speed[joint].map_or(crossing, |limit| limit.min(crossing));
            let grid = JointGrid::new(
                stance.angles[joint],
                model.limits[joint],
                speed,
                reach,
                levels,
                parameters.transition_time,
            );
            JointGrid { limits: limits[joint], ..grid }
        });
        let joints: Vec<JointGrid> = joints.collect();
        let to_root = stance.state.root.orientation.inverse();
        let [x, y, _] = direction;
        let plane = Sagittal::new(to_root * Vector3::new(x, y, 0.0), to_root * Vector3::z());
        let limbs = limbs(model, &stance.angles, plane);
        let closed = parameters.repairs.has(Repair::Symmetry);
        let symmetry = closed.then(|| Symmetry::of(&limbs, &joints)).flatten();
        Self { joints, limbs, beats: parameters.greatest_beats(), symmetry }
    }

    /// Angles and velocities of a state.
    pub fn posture(&self, state: &GridState) -> Posture {
        let places = self.joints.iter().zip(&state.levels).map(|(joint, level)| joint.place(*level));
        let (angles, velocities) = places.unzip();
        Posture { angles, velocities }
    }

    /// The standing pose at rest.
    pub fn standing(&self) -> Posture {
        Posture::resting(&self.joints.iter().map(|joint| joint.standing).collect::<Vec<_>>())
    }

    /// Number of states that have to be drawn for a subset of `states` states: all others follow by symmetry.
    pub fn drawn(&self, states: usize) -> usize {
        let images = self.symmetry.as_ref().map_or(1, Symmetry::images);
        states.div_ceil(images).max(1)
    }
}
