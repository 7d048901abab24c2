//! Scratch memory of a step, in groups by the stage that fills them. Nothing here outlives the step but what observers read
//! after it.

mod detection;
mod drives;
mod problem;
mod velocities;

use nalgebra::Vector3;

pub use detection::ContactDetection;
pub use drives::{Drives, FeedforwardPass};
pub use problem::RowProblem;
pub use velocities::{Placement, Velocities};

use super::contact::Contact;
use super::coordinates::reduced::kinematics::composite_inertia;
use super::joint_friction::FrictionMode;
use super::memory::StepMemory;
use super::per_body::{Motions, PerBody};
use super::rows::{ROOT, Rows, contact};
use super::spatial::SpatialMotion;
use super::step_totals::Counts;
use crate::model::Model;
use crate::scene::{Coordinates, Feedforward, StepPlan, UNLIMITED};

/// Scratch memory of a step, whatever the coordinates.
///
/// B is the number of bodies and J of joints. Each group and each field names, in parentheses, the stage that fills it: a method of
/// `Stages` or of `CoordinateSystem`. Spatial quantities are along the world axes about the common point, rotations in rad/s
/// and N m, translations in m/s and N.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// Where the bodies are and how they move before the step. (place)
    pub placed: Placement,
    /// Contact candidates. (detection, impact_contacts)
    pub detection: ContactDetection,
    /// The joints' drives. (drives, loads)
    pub drives: Drives,
    /// The first of the two passes of tracking. (feedforward)
    pub feedforward: FeedforwardPass,
    /// Dry friction in the joints. (first_friction, friction_gives_way)
    pub friction: DryFriction,
    /// Velocities after the step if no row acted. (free_motion)
    pub free: Velocities,
    /// The rows and their solution. (rows, solve)
    pub problem: RowProblem,
    /// Velocities after the step. (respond)
    pub new: Velocities,
    /// Velocities along which positions move where rows correct them. (recovery)
    pub recovery: Velocities,
    /// Whether rows do. (recovery)
    pub recovers: bool,
    /// B changes of velocity by the rows. (respond, recovery)
    pub changes: Motions,
    /// How often new velocities have been computed since the simulator was made. (velocities_at_mean)
    pub evaluations: u64,
    /// Whether the substep should have been shorter but is the shortest allowed. (judge)
    pub coarse: bool,
}

/// Dry friction in the joints, one a joint each.
#[derive(Debug, Clone)]
pub struct DryFriction {
    /// How it is computed. (first_friction, friction_gives_way, release_stuck)
    pub modes: Vec<FrictionMode>,
    /// Torques without a row, N m or N. (friction_gives_way; of joints that stick, respond)
    pub torque: Vec<f64>,
}

impl Workspace {
    /// For `model` as `plan` steps it.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let bodies = model.bodies.len();
        let joints = model.joint_count();
        let composite = composite_inertia(model);
        let slots = detection::slots(model, plan);
        let contact_rows = slots.min(64) * contact::rows_per_contact(plan.friction);
        let feedforward = plan.feedforward();
        let held = feedforward != Feedforward::None && !model.joints_are_independent();
        let control_rows = if feedforward == Feedforward::ContactAware { contact_rows } else { 0 };
        let maximal = plan.accuracy.coordinates == Coordinates::Maximal;
        // Of the rows that the joints themselves have in maximal coordinates, at most six each.
        let (width, velocity_rows) = if maximal { (6 * bodies, 3 + 6 * joints) } else { (ROOT + joints, 0) };
        let loop_rows = 6 * model.loops.len();
        let lasting_rows = joint_rows(plan).min(64) + velocity_rows + loop_rows;
        let mut rows = Rows::new(contact_rows + lasting_rows, width);
        if plan.restitution.is_some() {
            rows.reserve_rebounds(slots);
        }
        let of_feedforward = match held {
            true => Rows::new(control_rows + loop_rows + joints, width),
            false => Rows::new(control_rows + velocity_rows, if maximal { width } else { ROOT }),
        };
        Self {
            placed: Placement::new(model),
            detection: ContactDetection::new(model, plan),
            feedforward: FeedforwardPass::new(model, plan, &composite, of_feedforward),
            drives: Drives::new(composite),
            friction: DryFriction { modes: vec![FrictionMode::default(); joints], torque: vec![0.0; joints] },
            free: Velocities::new(model),
            problem: RowProblem::new(plan, rows, (width, joints), (contact_rows + 2 * joints, lasting_rows)),
            new: Velocities::new(model),
            recovery: Velocities::new(model),
            recovers: false,
            changes: PerBody::new(model, SpatialMotion::ZERO),
            evaluations: 0,
            coarse: false,
        }
    }

    /// Whether no force acts on the character from outside but its weight, at the step's solution. Contacts between its own
    /// links do not count.
    pub fn is_in_flight(&self, plan: &StepPlan) -> bool {
        let normals = self.problem.rows.force.iter().step_by(contact::rows_per_contact(plan.friction));
        let mut contacts = self.detection.candidates.iter().zip(normals);
        contacts.all(|(candidate, force)| *force == 0.0 || candidate.against.body().is_some())
    }

    /// The sum of the forces of ground and obstacles on the character, N.
    pub fn outer_force(&self, plan: &StepPlan) -> Vector3<f64> {
        let forces = self.problem.rows.force.chunks_exact(contact::rows_per_contact(plan.friction));
        let candidates = self.detection.candidates.iter().zip(forces);
        let outer = candidates.filter(|(candidate, _)| candidate.against.body().is_none());
        outer.map(|(candidate, forces)| candidate.force(forces)).sum()
    }

    /// The power that contacts give to the bodies, at the sum of the velocities before and after the step, W. Contacts that take power
    /// do not count.
    pub fn power_of_contacts(&self, plan: &StepPlan) -> f64 {
        let forces = self.problem.rows.force.chunks_exact(contact::rows_per_contact(plan.friction));
        let slips = self.detection.candidates.iter().zip(forces).map(|(candidate, forces)| {
            let slip = candidate.slip(|body| self.placed.old.at(body).plus(self.new.bodies.at(body)));
            candidate.force(forces).dot(&slip).max(0.0)
        });
        slips.sum()
    }

    /// Velocities along which positions move.
    pub fn moving(&self) -> &Velocities {
        if self.recovers { &self.recovery } else { &self.new }
    }

    /// What the step's totals count of it.
    pub(in crate::sim) fn counts(&self) -> Counts {
        let depths = self.detection.candidates.iter().map(|candidate| candidate.depth);
        Counts {
            residual: self.problem.residual,
            depth: depths.fold(0.0, f64::max),
            unsolved: self.problem.unsolved || self.feedforward.unsolved || self.drives.stuck,
            coarse: self.coarse,
        }
    }

    /// Keeps in `memory` the forces that warm-start the next step.
    pub(in crate::sim) fn remember(&self, plan: &StepPlan, memory: &mut StepMemory) {
        let Self { detection, problem, drives, .. } = self;
        let per_contact = contact::rows_per_contact(plan.friction);
        let greatest = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_deref());
        memory.remember(&problem.rows, &detection.candidates, per_contact, greatest, &drives.actuators);
        self.friction.remember(memory);
    }

    /// Every contact candidate of the last step with its force.
    pub fn contacts<'a>(&'a self, plan: &StepPlan) -> impl Iterator<Item = Contact> + 'a {
        let Self { detection, placed, new, problem, .. } = self;
        detection.contacts(plan, placed, &new.bodies, &problem.rows.force)
    }
}

impl DryFriction {
    /// Keeps in `memory` the dry friction of the joints that have no row for it.
    fn remember(&self, memory: &mut StepMemory) {
        for (kept, (mode, torque)) in memory.dry_friction.iter_mut().zip(self.modes.iter().zip(&self.torque))
        {
            if !matches!(mode, FrictionMode::None | FrictionMode::Row) {
                *kept = *torque;
            }
        }
    }
}

/// Greatest number of joint rows under `plan`, with each limited joint near one end of its range.
fn joint_rows(plan: &StepPlan) -> usize {
    let limits = plan.limits.iter().flatten().filter(|range| **range != UNLIMITED).count();
    let friction = plan.dry_friction.iter().flatten().filter(|friction| **friction > 0.0).count();
    let torques = plan.drive.iter().filter_map(|drive| drive.max_torque.as_ref()).flatten();
    limits + friction + torques.filter(|limit| limit.is_finite()).count()
}
