//! What a step leaves for the next one beside positions and velocities.

use super::actuator::ActuatorMode;
use super::contact::ContactCandidate;
use super::rows::{RowOwner, Rows};
use super::spatial::SpatialMotion;

/// An actuator counts as saturated within this share of its greatest torque.
const AT_LIMIT: f64 = 1.0 - 1e-12;

/// The fastest pendulum: a body on its joint under tension.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Pendulum {
    /// Index of the body.
    pub body: usize,
    /// Angular frequency, rad/s.
    pub frequency: f64,
}

/// Mean acceleration over a step.
#[derive(Debug, PartialEq)]
pub(super) struct Acceleration {
    /// Of the root's angular velocity and of its origin's velocity, rad/s² and m/s².
    pub root: SpatialMotion,
    /// Of the joints, rad/s² or m/s².
    pub joints: Vec<f64>,
}

/// Contact forces by their slots.
#[derive(Debug, Default, PartialEq)]
pub struct ContactForces {
    /// Slot, and normal and two tangential forces, N; in the order of the slots.
    slots: Vec<(usize, [f64; 3])>,
}

impl ContactForces {
    /// The forces at `slot`, N; zero where there was no contact.
    #[inline]
    pub fn at(&self, slot: usize) -> [f64; 3] {
        let found = self.slots.binary_search_by_key(&slot, |(slot, _)| *slot);
        found.map_or([0.0; 3], |index| self.slots[index].1)
    }

    /// Keeps the `forces` of `candidates`, of which the tangential ones may be left out.
    pub(super) fn remember<'a>(
        &mut self,
        candidates: &[ContactCandidate],
        forces: impl Iterator<Item = &'a [f64]>,
    ) {
        self.slots.clear();
        self.slots.extend(candidates.iter().zip(forces).map(|(candidate, forces)| {
            // A call of memcpy takes longer than three numbers.
            let mut all = [0.0; 3];
            all.iter_mut().zip(forces).for_each(|(kept, force)| *kept = *force);
            (candidate.slot, all)
        }));
        if !self.slots.is_sorted_by_key(|(slot, _)| *slot) {
            self.slots.sort_unstable_by_key(|(slot, _)| *slot);
        }
    }
}

/// What a step leaves for the next one: warm starts, and what bounds its length.
///
/// J is the number of joints. `commit` fills every field through `Workspace::remember` unless a function is named.
#[derive(Debug, PartialEq)]
pub(super) struct StepMemory {
    /// Forces of the contacts, N.
    pub contacts: ContactForces,
    /// J forces of the limits, N m or N, positive at the lower end and negative at the upper.
    pub limit: Vec<f64>,
    /// J forces of dry friction, N m or N.
    pub dry_friction: Vec<f64>,
    /// J torques of the actuators at their limit, N m or N; 0 for all others.
    pub saturated: Vec<f64>,
    /// J mean velocities of the targets, rad/s or m/s. (remember_targets)
    pub target_rates: Vec<f64>,
    /// Whether those are known: the last step had targets and feedforward. (remember_targets)
    pub has_target_rates: bool,
    /// Mean acceleration, from which the next mean velocity is predicted. (commit)
    pub acceleration: Acceleration,
    /// J squares of the joint tensions, N². (joint_tensions)
    pub tension_squared: Vec<f64>,
    /// The fastest pendulum under those tensions; `None` before the first step. (joint_tensions)
    pub pendulum: Option<Pendulum>,
    /// Length of the next substep under error control, s; 0 for a whole step. (step_within)
    pub next_substep: f64,
}

impl StepMemory {
    /// Nothing remembered of a character with `joints` joints.
    pub fn new(joints: usize) -> Self {
        Self {
            contacts: ContactForces::default(),
            limit: vec![0.0; joints],
            dry_friction: vec![0.0; joints],
            saturated: vec![0.0; joints],
            target_rates: vec![0.0; joints],
            has_target_rates: false,
            acceleration: Acceleration { root: SpatialMotion::ZERO, joints: vec![0.0; joints] },
            tension_squared: vec![0.0; joints],
            pendulum: None,
            next_substep: 0.0,
        }
    }

    /// Forgets everything, without allocating.
    pub fn forget(&mut self) {
        self.contacts.slots.clear();
        self.limit.fill(0.0);
        self.dry_friction.fill(0.0);
        self.saturated.fill(0.0);
        self.target_rates.fill(0.0);
        self.has_target_rates = false;
        self.acceleration.root = SpatialMotion::ZERO;
        self.acceleration.joints.fill(0.0);
        self.tension_squared.fill(0.0);
        self.pendulum = None;
        self.next_substep = 0.0;
    }

    /// Takes the forces of `rows`, of which those of `candidates` come first.
    ///
    /// `greatest` are the greatest torques of the actuators, N m or N, if they have any, and `actuators` the lines that
    /// they follow.
    pub fn remember(
        &mut self,
        rows: &Rows,
        candidates: &[ContactCandidate],
        per_contact: usize,
        greatest: Option<&[f64]>,
        actuators: &[ActuatorMode],
    ) {
        self.contacts.remember(candidates, rows.force.chunks_exact(per_contact));
        self.limit.fill(0.0);
        self.dry_friction.fill(0.0);
        self.saturated.fill(0.0);
        let of_joints = candidates.len() * per_contact..;
        for (owner, force) in rows.owner[of_joints.clone()].iter().zip(&rows.force[of_joints]) {
            match *owner {
                RowOwner::LowerLimit(joint) => self.limit[joint] += force,
                RowOwner::UpperLimit(joint) => self.limit[joint] -= force,
                RowOwner::DryFriction(joint) => self.dry_friction[joint] = *force,
                RowOwner::Torque(joint)
                    if actuators[joint].is_at_bound()
                        || greatest.is_some_and(|it| force.abs() >= it[joint] * AT_LIMIT) =>
                {
                    self.saturated[joint] = *force;
                }
                _ => {}
            }
        }
    }
}

// Derived `Clone` would allocate on `clone_from`; states are copied once a transition.
impl Clone for StepMemory {
    fn clone(&self) -> Self {
        Self {
            contacts: self.contacts.clone(),
            limit: self.limit.clone(),
            dry_friction: self.dry_friction.clone(),
            saturated: self.saturated.clone(),
            target_rates: self.target_rates.clone(),
            has_target_rates: self.has_target_rates,
            acceleration: self.acceleration.clone(),
            tension_squared: self.tension_squared.clone(),
            pendulum: self.pendulum,
            next_substep: self.next_substep,
        }
    }

    fn clone_from(&mut self, source: &Self) {
        self.contacts.clone_from(&source.contacts);
        self.limit.clone_from(&source.limit);
        self.dry_friction.clone_from(&source.dry_friction);
        self.saturated.clone_from(&source.saturated);
        self.target_rates.clone_from(&source.target_rates);
        self.has_target_rates = source.has_target_rates;
        self.acceleration.clone_from(&source.acceleration);
        self.tension_squared.clone_from(&source.tension_squared);
        self.pendulum = source.pendulum;
        self.next_substep = source.next_substep;
    }
}

impl Clone for ContactForces {
    fn clone(&self) -> Self {
        Self { slots: self.slots.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.slots.clone_from(&source.slots);
    }
}

impl Clone for Acceleration {
    fn clone(&self) -> Self {
        Self { root: self.root, joints: self.joints.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.root = source.root;
        self.joints.clone_from(&source.joints);
    }
}
