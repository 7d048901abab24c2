//! Scratch memory of a step. Nothing here outlives the step but what the observers read after it.

use nalgebra::{Point3, Vector3};

use super::bodies::BodyMotion;
use super::contact::solids::Solids;
use super::contact::{Contact, ContactCandidate, DetectionSettings, ground};
use super::coordinates::reduced::articulated::{Articulated, JointLoad};
use super::coordinates::reduced::displaced::Displaced;
use super::coordinates::reduced::kinematics::{composite_inertia, moment_arms};
use super::coordinates::reduced::velocity_control::VelocityControl;
use super::lcp::{Equality, Lemke, Newton, Pgs, Problem, Solution, SolveStatus, Solver};
use super::memory::StepMemory;
use super::rows::{ROOT, Rows, contact};
use super::spatial::{SpatialForce, SpatialMotion};
use super::tracking::Spring;
use crate::model::{Freedom, Model, SOLID_SLOTS};
use crate::scene::{Coordinates, Feedforward, SolverChoice, SolverKind, StepPlan};

/// Scratch memory of a step; each field says which stage fills it.
#[derive(Debug, Clone)]
pub(super) struct Workspace {
    /// Poses of the bodies, and the velocities at which forces of velocity are taken. (kinematics, mean motion)
    pub bodies: Vec<BodyMotion>,
    /// Velocities of the bodies at the beginning of the step. (kinematics)
    pub old: Vec<SpatialMotion>,
    /// Touches that were known before others were looked for. (struck)
    pub known: Vec<ContactCandidate>,
    /// Farthest that a collision shape reaches from the centre of its body's mass, m.
    pub reach: f64,
    /// Farthest that the centre of a body's mass can be from the root's origin, m.
    pub span: f64,
    /// Touches. (detection)
    pub candidates: Vec<ContactCandidate>,
    /// Shapes that may yet touch the ground elsewhere. (detection)
    pub close: Vec<usize>,
    /// How many of them were foreseen; the others came with a blow. (detection)
    pub detected: usize,
    /// What finds touches of solids, if the plan asks for it. (detection)
    pub solids: Option<Solids>,
    /// Common point of the step: the root's origin at its beginning, m. (kinematics)
    pub common_point: Point3<f64>,
    /// Offset torques f₀, N m or N. (velocity control)
    pub feedforward: Vec<f64>,
    /// Drives of the joints. (tracking)
    pub springs: Vec<Spring>,
    /// Joints whose actuator has a row of its own. (tracking, saturation)
    pub saturated: Vec<bool>,
    /// Ends of the joints' ranges, lower and upper, that have rows. (rows, passing)
    pub near_limit: Vec<[bool; 2]>,
    /// Loads of the joints. (tracking)
    pub loads: Vec<JointLoad>,
    /// The factorised mass matrix. (free motion)
    pub articulated: Articulated,
    /// Joint accelerations: as wanted (velocity control), then as they are without rows (free motion).
    pub joint_acceleration: Vec<f64>,
    /// Joint velocities with which forces of velocity are taken. (kinematics, mean motion)
    pub mean_rates: Vec<f64>,
    /// Joint velocities after the step if no row acted. (free motion)
    pub free_rates: Vec<f64>,
    /// Joint velocities after the step. (response)
    pub joint_rates: Vec<f64>,
    /// Velocity of the root along which it moves. (recovery)
    pub recovery_root: SpatialMotion,
    /// Joint velocities along which the joints move. (recovery)
    pub recovery_rates: Vec<f64>,
    /// Change of each body's velocity by rows that also correct positions. (recovery)
    pub recovery_changes: Vec<SpatialMotion>,
    /// Forces of the rows while those of the recovery are looked for. (recovery)
    pub forces: Vec<f64>,
    /// Inertia that each joint carries, kg m² or kg.
    pub composite_inertia: Vec<f64>,
    /// Distance from each joint to the farthest place of its body that pulls at it, m; 0 for a prismatic one.
    pub moment_arms: Vec<f64>,
    /// Force that each body hands on to its parent, N. (pulls)
    pub transmitted_force: Vec<Vector3<f64>>,
    /// What the joint of every loop hands from its first body to its second. (pulls)
    pub loops: Vec<SpatialForce>,
    /// Velocity of each body after the step if no row acted. (free motion)
    pub free: Vec<SpatialMotion>,
    /// Rows and their problem. (rows)
    pub rows: Rows,
    /// The half-solved impulse of all rows. (response)
    pub half: Vec<f64>,
    /// Change of each body's velocity by the rows. (response)
    pub changes: Vec<SpatialMotion>,
    /// Velocity of each body after the step. (response)
    pub new: Vec<SpatialMotion>,
    /// The character half a step away. (balance)
    pub displaced: Displaced,
    /// Torques of the actuators, N m or N. (saturation)
    pub torque: Vec<f64>,
    /// How often new velocities were computed.
    pub evaluations: u64,
    /// Residual of the solution, m/s or rad/s. (solve)
    pub residual: f64,
    /// The rigid character of the first pass, if the plan asks for it and the joints are independent.
    pub control: Option<VelocityControl>,
    /// The rows of the first pass. (velocity control)
    pub control_rows: Rows,
    /// The solver.
    pub solver: Equality<ChosenSolver>,
}

/// The solver that the plan chose.
#[derive(Debug, Clone)]
pub(super) enum ChosenSolver {
    Newton(Box<Newton>),
    Pgs(Pgs),
    Lemke(Box<Lemke>),
}

impl ChosenSolver {
    fn new(choice: &SolverChoice) -> Self {
        match choice.kind {
            SolverKind::Newton => Self::Newton(Box::new(Newton::new(choice.iterations, choice.tolerance))),
            SolverKind::Pgs => Self::Pgs(Pgs::new(choice.iterations, choice.tolerance)),
            SolverKind::Lemke => Self::Lemke(Box::new(Lemke::new(choice.iterations))),
        }
    }
}

impl Solver for ChosenSolver {
    fn solve(&mut self, problem: &Problem<'_>, force: &mut [f64]) -> Solution {
        match self {
            Self::Newton(newton) => newton.solve(problem, force),
            Self::Pgs(pgs) => pgs.solve(problem, force),
            Self::Lemke(lemke) => lemke.solve(problem, force),
        }
    }
}

impl Workspace {
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let bodies = model.bodies.len();
        let joints = model.joint_count();
        let solids = (plan.self_collision || !plan.obstacles.is_empty())
            .then(|| Solids::new(model, plan.self_collision, plan.obstacles.len()));
        let ground_slots = if plan.ground.is_some() { model.ground_slots } else { 0 };
        let solid_slots = if solids.is_some() { SOLID_SLOTS * model.solids.len() } else { 0 };
        let slots = ground_slots + solid_slots;
        let contact_rows = slots.min(64) * contact::rows_per_contact(plan.friction);
        let feedforward = plan.drive.as_ref().map_or(Feedforward::None, |drive| drive.feedforward);
        let held = feedforward != Feedforward::None && !model.joints_are_independent();
        let control_rows = if feedforward == Feedforward::ContactAware { contact_rows } else { 0 };
        let maximal = plan.accuracy.coordinates == Coordinates::Maximal;
        // Of the rows that the joints themselves have in maximal coordinates, at most six each.
        let (width, velocity_rows) = if maximal { (6 * bodies, 3 + 6 * joints) } else { (ROOT + joints, 0) };
        let loop_rows = 6 * model.loops.len();
        Self {
            bodies: vec![BodyMotion::REST; bodies],
            old: vec![SpatialMotion::ZERO; bodies],
            known: Vec::with_capacity(slots),
            reach: reach(model),
            span: span(model),
            candidates: Vec::with_capacity(slots),
            close: Vec::with_capacity(model.ground_shapes.len()),
            detected: 0,
            solids,
            common_point: Point3::origin(),
            feedforward: vec![0.0; joints],
            springs: vec![Spring::default(); joints],
            saturated: vec![false; joints],
            near_limit: vec![[false; 2]; joints],
            loads: vec![JointLoad::default(); joints],
            articulated: Articulated::new(bodies),
            joint_acceleration: vec![0.0; joints],
            mean_rates: vec![0.0; joints],
            free_rates: vec![0.0; joints],
            joint_rates: vec![0.0; joints],
            recovery_root: SpatialMotion::ZERO,
            recovery_rates: vec![0.0; joints],
            recovery_changes: vec![SpatialMotion::ZERO; bodies],
            forces: Vec::with_capacity(contact_rows + 2 * joints),
            composite_inertia: composite_inertia(model),
            moment_arms: moment_arms(model),
            transmitted_force: vec![Vector3::zeros(); bodies],
            loops: vec![SpatialForce::ZERO; model.loops.len()],
            free: vec![SpatialMotion::ZERO; bodies],
            rows: Rows::new(contact_rows + joint_rows(plan).min(64) + velocity_rows + loop_rows, width),
            half: vec![0.0; width],
            changes: vec![SpatialMotion::ZERO; bodies],
            new: vec![SpatialMotion::ZERO; bodies],
            displaced: Displaced::new(model),
            torque: vec![0.0; joints],
            evaluations: 0,
            residual: 0.0,
            control: (feedforward != Feedforward::None && !held).then(|| VelocityControl::new(bodies)),
            control_rows: match held {
                true => Rows::new(control_rows + loop_rows + joints, width),
                false => Rows::new(control_rows + velocity_rows, if maximal { width } else { ROOT }),
            },
            solver: Equality::new(ChosenSolver::new(&plan.accuracy.solver), plan.accuracy.solver.tolerance),
        }
    }

    /// Finds what the character touches within a step of `step` seconds. `angles` are those of the joints if the bodies
    /// are where they say.
    pub fn detect(&mut self, model: &Model, plan: &StepPlan, angles: Option<&[f64]>, step: f64) {
        let Self { bodies, candidates, close, solids, common_point, .. } = self;
        let settings = DetectionSettings {
            step,
            gravity: plan.gravity.norm(),
            anticipate: plan.stabilization,
            restitution: plan.restitution.unwrap_or(0.0),
        };
        let origin = common_point.coords;
        candidates.clear();
        if let Some(ground) = &plan.ground {
            ground::detect(model, bodies, ground, origin, &settings, candidates, close);
        }
        if let Some(solids) = solids {
            solids.detect(model, bodies, angles, &plan.obstacles, origin, &settings, candidates);
        }
    }

    /// Solves the rows' problem for a step of `step` seconds.
    pub fn solve(&mut self, plan: &StepPlan, step: f64) -> SolveStatus {
        self.residual = 0.0;
        if self.rows.is_empty() {
            return SolveStatus::Solved;
        }
        self.rows.assemble(step);
        let (problem, force) = self.rows.problem(plan.circular_friction());
        let solution = self.solver.solve(&problem, force);
        self.residual = solution.residual;
        solution.status
    }

    /// Solves the problem of the velocities along which positions move, and leaves the half-solved impulse of its
    /// forces in `half`; the rows keep those of the step.
    pub fn solve_recovery(&mut self, plan: &StepPlan, step: f64) -> SolveStatus {
        self.forces.clone_from(&self.rows.force);
        self.rows.ask_for_recovery(true);
        let (problem, force) = self.rows.problem(plan.circular_friction());
        let solution = self.solver.solve(&problem, force);
        self.rows.impulse(step, &mut self.half);
        self.rows.ask_for_recovery(false);
        self.rows.force.clone_from(&self.forces);
        solution.status
    }

    /// New velocities of the bodies from their free ones and the changes by the rows.
    pub fn take_changes(&mut self) {
        for (new, (free, change)) in self.new.iter_mut().zip(self.free.iter().zip(&self.changes)) {
            *new = free.plus(*change);
        }
    }

    /// Marks the ends of the ranges `limits` that joints at `angles` would pass in `step` seconds; whether one of
    /// them had no row.
    pub fn mark_crossed_limits(&mut self, limits: &[Option<[f64; 2]>], angles: &[f64], step: f64) -> bool {
        let mut again = false;
        for (joint, limit) in limits.iter().enumerate() {
            let Some([lower, upper]) = *limit else { continue };
            let end = angles[joint] + step * self.joint_rates[joint];
            for (near, passed) in self.near_limit[joint].iter_mut().zip([end < lower, end > upper]) {
                again |= passed && !*near;
                *near |= passed;
            }
        }
        again
    }

    /// Whether the step changes the velocity of a body by more than touches are looked ahead for (see
    /// [`DetectionSettings::margin`]): by a blow, or because nothing holds it any more.
    pub fn is_impact(&self, plan: &StepPlan, step: f64) -> bool {
        if plan.ground.is_none() && self.solids.is_none() {
            return false;
        }
        let detected = 4.0 * step * plan.gravity.norm();
        // In most steps nothing can change as much, wherever the bodies are.
        let (mut linear, mut angular) = (0.0_f64, 0.0_f64);
        for (new, old) in self.new.iter().zip(&self.old) {
            let change = new.minus(*old);
            linear = linear.max(change.linear.amax());
            angular = angular.max(change.angular.amax());
        }
        if linear + angular * (2.0 * self.span + self.reach) <= detected {
            return false;
        }
        let mut changes = self.new.iter().zip(&self.old).zip(&self.bodies);
        changes.any(|((new, old), body)| {
            let change = new.minus(*old);
            change.at(body.center).amax() + change.angular.amax() * self.reach > detected
        })
    }

    /// Looks for touches again at the new velocities, and keeps those that are known; whether there are
    /// others.
    pub fn detect_again(
        &mut self,
        model: &Model,
        plan: &StepPlan,
        angles: Option<&[f64]>,
        step: f64,
    ) -> bool {
        let Self { bodies, new, known, candidates, .. } = self;
        for (body, new) in bodies.iter_mut().zip(&mut *new) {
            std::mem::swap(&mut body.velocity, new);
        }
        known.clone_from(candidates);
        self.detect(model, plan, angles, step);
        let Self { bodies, new, known, candidates, .. } = self;
        for (body, new) in bodies.iter_mut().zip(new) {
            std::mem::swap(&mut body.velocity, new);
        }
        let count = known.len();
        for candidate in candidates.iter() {
            if known[..count].iter().all(|other| other.slot != candidate.slot) {
                known.push(ContactCandidate { rebound: 0.0, ..*candidate });
            }
        }
        std::mem::swap(known, candidates);
        candidates.len() > count
    }

    /// Makes touches of what the new velocities would drive into what it touches in a step of `step` seconds; whether there
    /// is any.
    pub fn add_driven_in(&mut self, model: &Model, plan: &StepPlan, step: f64) -> bool {
        let Self { bodies, new, candidates, close, solids, common_point, .. } = self;
        if !plan.stabilization {
            return false;
        }
        let origin = common_point.coords;
        let ground = plan.ground.as_ref();
        let driven = ground.is_some_and(|ground| {
            ground::add_driven_in(model, close, bodies, new, ground, origin, step, candidates)
        });
        let into = solids.as_ref();
        into.is_some_and(|solids| {
            solids.add_driven_in(model, bodies, new, &plan.obstacles, origin, step, candidates)
        }) || driven
    }

    /// Keeps in `memory` the forces that the next step starts from.
    pub fn remember(&self, plan: &StepPlan, memory: &mut StepMemory) {
        let per_contact = contact::rows_per_contact(plan.friction);
        let greatest = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_deref());
        memory.remember(&self.rows, &self.candidates, per_contact, greatest);
        let aware = plan.drive.as_ref().is_some_and(|drive| drive.feedforward == Feedforward::ContactAware);
        let candidates = if aware { &self.candidates[..self.detected] } else { &[] };
        let rows =
            self.control_rows.force.chunks_exact(per_contact).zip(self.rows.force.chunks_exact(per_contact));
        // What links do to each other does not show in the first pass, which goes on from what they did in the step.
        let forces =
            candidates.iter().zip(rows).map(|(candidate, (control, step))| match candidate.against.body() {
                Some(_) => step,
                None => control,
            });
        memory.feedforward_contacts.remember(candidates, forces);
    }

    /// Every touch of the last step with its force.
    pub fn contacts(&self, plan: &StepPlan) -> impl Iterator<Item = Contact> + '_ {
        let rows_per_contact = contact::rows_per_contact(plan.friction);
        self.candidates.iter().enumerate().map(move |(index, candidate)| {
            let first = index * rows_per_contact;
            let forces = self.rows.force.get(first..first + rows_per_contact).unwrap_or_default();
            Contact {
                link: candidate.link,
                position: self.common_point + candidate.at,
                against: candidate.against,
                normal: candidate.frame[0],
                force: candidate.force(forces),
                velocity: candidate.slip(|body| self.new[body]),
                depth: candidate.depth,
            }
        })
    }
}

/// Farthest that a collision shape reaches from the centre of its body's mass, m.
fn reach(model: &Model) -> f64 {
    let reaches = model.ground_shapes.iter().map(|shape| {
        let from_center = shape.center - model.bodies[shape.body].center;
        from_center.norm() + shape.reach
    });
    reaches.fold(0.0, f64::max)
}

/// Farthest that the centre of a body's mass can be from the root's origin, m.
fn span(model: &Model) -> f64 {
    let mut origins = vec![0.0; model.bodies.len()];
    for (index, body) in model.bodies.iter().enumerate().skip(1) {
        let slide = match body.freedom {
            Freedom::Revolute => 0.0,
            Freedom::Prismatic => f64::INFINITY,
        };
        origins[index] = origins[body.parent] + body.offset.norm() + slide;
    }
    origins.iter().zip(&model.bodies).map(|(origin, body)| origin + body.center.norm()).fold(0.0, f64::max)
}

/// How many rows of joints `plan` can call for, each limited joint being near one end of its range.
fn joint_rows(plan: &StepPlan) -> usize {
    let limits = plan.limits.iter().flatten().flatten().count();
    let friction = plan.dry_friction.iter().flatten().filter(|friction| **friction > 0.0).count();
    let torques = plan.drive.iter().filter_map(|drive| drive.max_torque.as_ref()).flatten();
    limits + friction + torques.filter(|limit| limit.is_finite()).count()
}
