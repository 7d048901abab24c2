//! The joints' drives, and the loads that they and the joints' own forces are.

use crate::model::Model;
use crate::scene::StepPlan;
use crate::sim::actuator::ActuatorMode;
use crate::sim::joint_load::JointLoad;
use crate::sim::rows::{RowOwner, Rows};
use crate::sim::tracking::{Reference, Spring};

/// After actuators switched this often in a step they do not leave their bounds any more, so that switching ends.
const MAX_RETURNS: u32 = 8;

/// The joints' drives, one a joint each. (drives)
#[derive(Debug, Clone)]
pub struct Drives {
    /// What each joint is driven by.
    pub springs: Vec<Spring>,
    /// Which line the actuator follows, and whether it has a row of its own. (drives, switch_actuators)
    pub actuators: Vec<ActuatorMode>,
    /// How often actuators switched since the drives were set. (drives, switch_actuators)
    switches: u32,
    /// Whether an actuator stays at its bound only because they switched too often. (drives, switch_actuators)
    pub stuck: bool,
    /// Loads, N m and kg m² or N and kg. (loads, friction_loads)
    pub loads: Vec<JointLoad>,
    /// Torques of the actuators, N m or N. (switch_actuators)
    pub torque: Vec<f64>,
    /// Composite-rigid-body inertias along the joints, with all joints beyond at zero, kg m² or kg. (new)
    pub composite_inertia: Vec<f64>,
}

impl Drives {
    /// For joints with these composite inertias.
    pub fn new(composite_inertia: Vec<f64>) -> Self {
        let joints = composite_inertia.len();
        Self {
            springs: vec![Spring::default(); joints],
            actuators: vec![ActuatorMode::default(); joints],
            switches: 0,
            stuck: false,
            loads: vec![JointLoad::default(); joints],
            torque: vec![0.0; joints],
            composite_inertia,
        }
    }

    /// Takes every drive away.
    pub fn release(&mut self) {
        self.springs.fill(Spring::default());
        self.actuators.fill(ActuatorMode::Line);
        self.switches = 0;
        self.stuck = false;
        self.torque.fill(0.0);
    }

    /// Torques of the actuators at the joint velocities `rates` and the forces of `rows`, and which line each of them is to
    /// follow; whether one has to follow another than it did.
    #[inline(always)] // compiled for the processor of `step`
    pub fn switch_actuators(&mut self, plan: &StepPlan, rates: &[f64], rows: &Rows) -> bool {
        for ((torque, spring), rate) in self.torque.iter_mut().zip(&self.springs).zip(rates) {
            *torque = spring.torque(*rate);
        }
        for (owner, force) in rows.owner.iter().zip(&rows.force) {
            if let RowOwner::Torque(joint) = *owner {
                self.torque[joint] = *force;
            }
        }
        let Some(drive) = plan.drive.as_ref().filter(|drive| drive.max_torque.is_some()) else {
            return false;
        };
        self.stuck = false;
        // In most steps no actuator comes near its bounds.
        let actuators = self.actuators.iter().zip(&self.torque).zip(rates).zip(drive.all_limits());
        let within = actuators.fold(true, |within, (((mode, torque), rate), limits)| {
            within & (*mode == ActuatorMode::Line) & limits.surely_has(*torque, *rate)
        });
        if within {
            return false;
        }
        let returns = self.switches < MAX_RETURNS;
        let mut switched = false;
        for (joint, mode) in self.actuators.iter_mut().enumerate() {
            let (spring, limits) = (self.springs[joint], drive.limits(joint));
            let next = mode.next(spring, limits, self.torque[joint], rates[joint]);
            if !returns && mode.is_at_bound() {
                self.stuck |= next != *mode;
                continue;
            }
            switched |= next != *mode;
            *mode = next;
        }
        self.switches += u32::from(switched);
        switched
    }
}

/// The first of the two passes of tracking. (feedforward)
#[derive(Debug, Clone)]
pub struct FeedforwardPass {
    /// J offset torques f₀, N m or N.
    pub torque: Vec<f64>,
    /// Period of the feedforward, s; 0 without. (new)
    pub period: f64,
    /// J motions of the targets, with feedforward. (substep)
    pub reference: Vec<Reference>,
    /// J joint velocities that the targets ask for after the step, rad/s or m/s.
    pub rates: Vec<f64>,
    /// J joint accelerations that lead to them, rad/s² or m/s².
    pub acceleration: Vec<f64>,
    /// The rows of the pass.
    pub rows: Rows,
    /// Whether their forces do not solve their problem.
    pub unsolved: bool,
}

impl FeedforwardPass {
    /// For `model` as `plan` steps it; `inertia` is that along the joints, kg m² or kg, and `rows` are empty.
    pub fn new(model: &Model, plan: &StepPlan, inertia: &[f64], rows: Rows) -> Self {
        let joints = model.joint_count();
        Self {
            torque: vec![0.0; joints],
            period: feedforward_period(plan, inertia),
            reference: vec![Reference::default(); joints],
            rates: vec![0.0; joints],
            acceleration: vec![0.0; joints],
            rows,
            unsolved: false,
        }
    }

    /// What the targets ask for in a step of `step` seconds of joints that move at `rates` before it.
    pub fn ask(&mut self, rates: &[f64], step: f64) {
        for (joint, (rate, reference)) in rates.iter().zip(&self.reference).enumerate() {
            self.rates[joint] = reference.rate_after(*rate, self.period, step);
            self.acceleration[joint] = (self.rates[joint] - rate) / step;
        }
    }
}

/// The period of the feedforward, s; `inertia` is that along the joints, kg m² or kg.
///
/// It is the drive's, T, but no longer than lets an error of velocity decay, together with the damper, as fast as the fastest
/// spring swings: 1 / T ≥ (K / I)^½ − D / I in every joint. The pass cancels Coriolis forces, which leaves
/// ½ q̇ᵀ Ḣ q̇ − q̇ᵀ H q̇ / T of power: more than 0 at joint speeds of about 1 / T and more, which a stiff spring without a damper
/// reaches.
fn feedforward_period(plan: &StepPlan, inertia: &[f64]) -> f64 {
    let Some(drive) = &plan.drive else { return 0.0 };
    let springs = drive.stiffness.iter().zip(&drive.damping).zip(inertia);
    let decays =
        springs.map(|((stiffness, damping), inertia)| (stiffness / inertia).sqrt() - damping / inertia);
    1.0 / decays.fold(1.0 / drive.feedforward_period, f64::max)
}
