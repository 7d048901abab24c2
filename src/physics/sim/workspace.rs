//! Scratch memory of a step. Nothing here outlives the step but what observers read after it.

use nalgebra::{Point3, Vector3};

use super::actuator::ActuatorMode;
use super::bodies::BodyMotion;
use super::contact::solids::Solids;
use super::contact::{Against, Contact, ContactCandidate, DetectionSettings, ground};
use super::coordinates::reduced::articulated::{Articulated, JointLoad};
use super::coordinates::reduced::displaced::Displaced;
use super::coordinates::reduced::flight::Flight;
use super::coordinates::reduced::kinematics::{composite_inertia, moment_arms};
use super::coordinates::reduced::velocity_control::VelocityControl;
use super::joint_friction::FrictionMode;
use super::lcp::{Counted, Equality, Lemke, Newton, Pgs, Problem, Solution, SolveStatus, Solver};
use super::memory::StepMemory;
use super::restitution;
use super::rows::{ROOT, RowOwner, Rows, contact};
use super::spatial::{SpatialForce, SpatialMotion};
use super::tracking::{Reference, Spring};
use crate::model::{Body, DofKind, Model, SOLID_SLOTS};
use crate::scene::{Coordinates, Feedforward, SolverChoice, SolverKind, StepPlan};

/// After actuators switched this often in a step they do not leave their bounds any more, so that switching ends.
const MAX_RETURNS: u32 = 8;

/// Scratch memory of a step.
///
/// B is the number of bodies, J of joints, L of loops, C of contact candidates and N of rows. Each field gives its
/// meaning, unit and length, and in parentheses the stage (a method of `Stages` unless it has a path) that fills it.
/// Spatial quantities are along the world axes about the common point, rotations in rad/s and N m, translations
/// in m/s and N.
#[derive(Debug, Clone)]
pub(super) struct Workspace {
    /// Common point of the step: the root's origin in the world at its beginning, m. (kinematics)
    pub common_point: Point3<f64>,

    // Bodies.
    /// B poses and inertias (kinematics), and the velocities at which velocity-dependent forces are taken
    /// (kinematics, predict_mean, correct_mean).
    pub bodies: Vec<BodyMotion>,
    /// B velocities at the beginning of the step. (kinematics)
    pub old: Vec<SpatialMotion>,
    /// B velocities after the step if no row acted. (free_velocities, free_motion)
    pub free: Vec<SpatialMotion>,
    /// B changes of velocity by the rows. (response)
    pub changes: Vec<SpatialMotion>,
    /// B velocities after the step. (response)
    pub new: Vec<SpatialMotion>,
    /// Greatest distance of a point of a collision shape from its body's centre of mass, m. (new)
    pub reach: f64,
    /// Greatest distance that a body's centre of mass can have from the root's origin, m. (new)
    pub span: f64,

    // Contact detection.
    /// C contact candidates. (detection, impact_contacts)
    pub candidates: Vec<ContactCandidate>,
    /// Number of candidates that the first detection found; the others came with an impact. (detection)
    pub detected: usize,
    /// The candidates known before the detection was repeated. (detect_again)
    pub known: Vec<ContactCandidate>,
    /// Indices of the shapes that may touch the ground at other points than their candidates. (detect)
    pub close: Vec<usize>,
    /// Detection of contacts between solids, if the plan asks for it. (detect)
    pub solids: Option<Solids>,

    // Joints.
    /// J joint velocities at which velocity-dependent forces are taken, rad/s or m/s.
    /// (kinematics, predict_mean, correct_mean)
    pub mean_rates: Vec<f64>,
    /// J joint velocities after the step if no row acted, rad/s or m/s. (free_velocities)
    pub free_rates: Vec<f64>,
    /// J joint velocities after the step, rad/s or m/s: those of the feedforward pass (velocity_control), then the new
    /// ones (response).
    pub joint_rates: Vec<f64>,
    /// J joint accelerations, rad/s² or m/s²: those that the targets ask for (velocity_control), then those
    /// without rows (free_velocities).
    pub joint_acceleration: Vec<f64>,
    /// J offset torques f₀, N m or N. (velocity_control)
    pub feedforward: Vec<f64>,
    /// Period of the feedforward, s; 0 without. (new)
    pub feedforward_period: f64,
    /// J motions of the targets, with feedforward. (substep)
    pub reference: Vec<Reference>,
    /// J drives. (drives)
    pub springs: Vec<Spring>,
    /// J: which line the actuator follows, and whether it has a row of its own. (drives, switch_actuators)
    pub actuators: Vec<ActuatorMode>,
    /// How often actuators switched in this evaluation. (drives, switch_actuators)
    pub switches: u32,
    /// J: whether the lower and the upper end of the range have rows. (rows, crosses_limit)
    pub near_limit: Vec<[bool; 2]>,
    /// J: how dry friction is computed. (first_friction, friction_gives_way, release_stuck)
    pub friction_modes: Vec<FrictionMode>,
    /// J torques of dry friction without a row, N m or N. (friction_gives_way)
    pub friction: Vec<f64>,
    /// B wrenches that bodies transmit to their parents. (sticking_torques)
    pub wrenches: Vec<SpatialForce>,
    /// J loads, N m and kg m² or N and kg. (loads, friction_loads)
    pub loads: Vec<JointLoad>,
    /// J torques of the actuators, N m or N. (switch_actuators)
    pub torque: Vec<f64>,
    /// J: what a joint's displacement counts, 1 for a rotation and 1/ℓ for a translation, 1/m. (new)
    pub per_unit: Vec<f64>,
    /// J composite-rigid-body inertias along the joints, with all joints beyond at zero, kg m² or kg. (new)
    pub composite_inertia: Vec<f64>,
    /// The factorised mass matrix. (factorise)
    pub articulated: Articulated,

    // Rows and their solution.
    /// N rows and their problem. (rows, solve)
    pub rows: Rows,
    /// The half-solved impulse of all rows, 6 + J numbers (6 B in maximal coordinates). (response)
    pub half: Vec<f64>,
    /// Residual of the solution, m/s or rad/s. (solve)
    pub residual: f64,
    /// Whether the forces or those that correct positions do not solve their problem. (solve, solve_recovery)
    pub unsolved: bool,
    /// How often new velocities have been computed since the simulator was made. (velocities_at_mean)
    pub evaluations: u64,
    /// The solver that the plan chose. (new)
    pub solver: Counted<Equality<ChosenSolver>>,

    // Correction of positions.
    /// Velocity of the root along which its position moves. (recovery)
    pub recovery_root: SpatialMotion,
    /// J joint velocities along which the joint positions move, rad/s or m/s. (recovery)
    pub recovery_rates: Vec<f64>,
    /// B changes of velocity by rows that also correct positions. (recovery)
    pub recovery_changes: Vec<SpatialMotion>,
    /// N forces kept while others are solved for, N or N m. (solve, solve_recovery)
    pub forces: Vec<f64>,

    /// The bodies of the state that a step in flight began from or ended in. (step, commit)
    pub flight: Flight,

    // Step control.
    /// Whether the substep should have been shorter but is the shortest allowed. (shorter_step)
    pub coarse: bool,
    /// The character half a step away. (shorter_step)
    pub displaced: Displaced,
    /// J moment arms, m: the distance from the joint to the farthest of its body's centre of mass and of the next
    /// joints; 0 for a prismatic joint. (new)
    pub moment_arms: Vec<f64>,
    /// B forces that bodies transmit to their parents, N. (joint_tensions)
    pub transmitted_force: Vec<Vector3<f64>>,
    /// L wrenches that the loops' joints transmit from their first to their second body. (joint_tensions)
    pub loops: Vec<SpatialForce>,

    // Feedforward.
    /// The rigid character of the feedforward pass, if the plan asks for it and the joints are independent.
    /// (velocity_control)
    pub control: Option<VelocityControl>,
    /// The rows of the feedforward pass. (velocity_control)
    pub control_rows: Rows,
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
        let composite = composite_inertia(model);
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
        let mut rows = Rows::new(contact_rows + joint_rows(plan).min(64) + velocity_rows + loop_rows, width);
        if plan.restitution.is_some() {
            rows.reserve_rebounds(slots);
        }
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
            feedforward_period: feedforward_period(plan, &composite),
            reference: vec![Reference::default(); joints],
            springs: vec![Spring::default(); joints],
            actuators: vec![ActuatorMode::default(); joints],
            switches: 0,
            near_limit: vec![[false; 2]; joints],
            friction_modes: vec![FrictionMode::default(); joints],
            friction: vec![0.0; joints],
            wrenches: vec![SpatialForce::ZERO; bodies],
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
            per_unit: per_unit(model, plan),
            composite_inertia: composite,
            moment_arms: moment_arms(model),
            transmitted_force: vec![Vector3::zeros(); bodies],
            loops: vec![SpatialForce::ZERO; model.loops.len()],
            free: vec![SpatialMotion::ZERO; bodies],
            rows,
            half: vec![0.0; width],
            changes: vec![SpatialMotion::ZERO; bodies],
            new: vec![SpatialMotion::ZERO; bodies],
            flight: Flight::new(model),
            displaced: Displaced::new(model),
            torque: vec![0.0; joints],
            evaluations: 0,
            residual: 0.0,
            unsolved: false,
            coarse: false,
            control: (feedforward != Feedforward::None && !held).then(|| VelocityControl::new(bodies)),
            control_rows: match held {
                true => Rows::new(control_rows + loop_rows + joints, width),
                false => Rows::new(control_rows + velocity_rows, if maximal { width } else { ROOT }),
            },
            solver: Counted::new(Equality::new(
                ChosenSolver::new(&plan.accuracy.solver),
                plan.accuracy.solver.tolerance,
            )),
        }
    }

    /// Detects the contact candidates of a step of `step` seconds. `angles` are those of the joints if the bodies' poses
    /// follow from them.
    pub fn detect(&mut self, model: &Model, plan: &StepPlan, angles: Option<&[f64]>, step: f64) {
        let Self { bodies, candidates, close, solids, common_point, feedforward_period, .. } = self;
        let settings = DetectionSettings {
            step,
            ahead: plan
                .drive
                .as_ref()
                .map_or(step, |drive| step.max(0.5 * drive.horizon(*feedforward_period, step))),
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
        touch(plan, candidates);
    }

    /// Solves the rows' problem for a step of `step` seconds.
    pub fn solve(&mut self, plan: &StepPlan, step: f64) -> SolveStatus {
        (self.residual, self.unsolved) = (0.0, false);
        if self.rows.is_empty() {
            return SolveStatus::Solved;
        }
        self.rows.assemble(step);
        let (problem, force) = self.rows.problem(plan.circular_friction());
        let mut solution = self.solver.solve(&problem, force);
        if self.rows.has_rebounds() {
            let Self { rows, solver, forces, candidates, .. } = self;
            let rebounding = candidates.iter().filter(|candidate| candidate.rebound > 0.0);
            let restitution = rebounding.map(|it| it.material.restitution).fold(0.0, f64::max);
            let cone = plan.circular_friction();
            solution = restitution::bound(rows, solver, cone, restitution, solution, forces);
        }
        self.residual = solution.residual;
        self.unsolved = solution.status != SolveStatus::Solved;
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
        self.unsolved |= solution.status != SolveStatus::Solved;
        solution.status
    }

    /// New velocities of the bodies from their free ones and the changes by the rows.
    pub fn take_changes(&mut self) {
        for (new, (free, change)) in self.new.iter_mut().zip(self.free.iter().zip(&self.changes)) {
            *new = free.plus(*change);
        }
    }

    /// Torques of the actuators at the new velocities, and which line each of them is to follow; whether one has to follow
    /// another than it did.
    pub fn switch_actuators(&mut self, plan: &StepPlan) -> bool {
        for (joint, torque) in self.torque.iter_mut().enumerate() {
            *torque = self.springs[joint].torque(self.joint_rates[joint]);
        }
        for (owner, force) in self.rows.owner.iter().zip(&self.rows.force) {
            if let RowOwner::Torque(joint) = *owner {
                self.torque[joint] = *force;
            }
        }
        let Some(drive) = plan.drive.as_ref().filter(|drive| drive.max_torque.is_some()) else {
            return false;
        };
        let returns = self.switches < MAX_RETURNS;
        let mut switched = false;
        for (joint, mode) in self.actuators.iter_mut().enumerate() {
            let (spring, limits) = (self.springs[joint], drive.limits(joint));
            let next = mode.next(spring, limits, self.torque[joint], self.joint_rates[joint], returns);
            switched |= next != *mode;
            *mode = next;
        }
        self.switches += u32::from(switched);
        switched
    }

    /// Marks the ends of the ranges `limits` that joints at `angles` would cross in `step` seconds; whether one of
    /// them had no row.
    pub fn mark_crossed_limits(&mut self, limits: &[Option<[f64; 2]>], angles: &[f64], step: f64) -> bool {
        let mut again = false;
        for (joint, limit) in limits.iter().enumerate() {
            let Some([lower, upper]) = *limit else { continue };
            let end = angles[joint] + step * self.joint_rates[joint];
            for (near, crossed) in self.near_limit[joint].iter_mut().zip([end < lower, end > upper]) {
                again |= crossed && !*near;
                *near |= crossed;
            }
        }
        again
    }

    /// Whether the step changes the velocity of a body by more than the detection allows for (see
    /// [`DetectionSettings::margin`]): by an impact, or because a support is lost.
    pub fn is_impact(&self, plan: &StepPlan, step: f64) -> bool {
        if plan.ground.is_none() && self.solids.is_none() {
            return false;
        }
        let expected = 4.0 * step * plan.gravity.norm();
        // In most steps nothing can change as much, wherever the bodies are.
        let (mut linear, mut angular) = (0.0_f64, 0.0_f64);
        for (new, old) in self.new.iter().zip(&self.old) {
            let change = new.minus(*old);
            linear = linear.max(change.linear.amax());
            angular = angular.max(change.angular.amax());
        }
        if linear + angular * (2.0 * self.span + self.reach) <= expected {
            return false;
        }
        let mut changes = self.new.iter().zip(&self.old).zip(&self.bodies);
        changes.any(|((new, old), body)| {
            let change = new.minus(*old);
            change.at(body.center).amax() + change.angular.amax() * self.reach > expected
        })
    }

    /// Detects contacts again at the new velocities, and adds those that were not known; whether there are any.
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

    /// Adds the points that the new velocities would drive in during a step of `step` seconds; whether there are any.
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
        let into = solids.as_ref().is_some_and(|solids| {
            solids.add_driven_in(model, bodies, new, &plan.obstacles, origin, step, candidates)
        }) || driven;
        touch(plan, candidates);
        into
    }

    /// Whether no force acts on the character from outside but its weight, at the step's solution. Contacts between its own
    /// links do not count.
    pub fn is_in_flight(&self, plan: &StepPlan) -> bool {
        let normals = self.rows.force.iter().step_by(contact::rows_per_contact(plan.friction));
        let mut contacts = self.candidates.iter().zip(normals);
        contacts.all(|(candidate, force)| *force == 0.0 || candidate.against.body().is_some())
    }

    /// The sum of the forces of ground and obstacles on the character, N.
    pub fn outer_force(&self, plan: &StepPlan) -> Vector3<f64> {
        let forces = self.rows.force.chunks_exact(contact::rows_per_contact(plan.friction));
        let outer =
            self.candidates.iter().zip(forces).filter(|(candidate, _)| candidate.against.body().is_none());
        outer.map(|(candidate, forces)| candidate.force(forces)).sum()
    }

    /// Keeps in `memory` the forces that warm-start the next step.
    pub fn remember(&self, plan: &StepPlan, memory: &mut StepMemory) {
        let per_contact = contact::rows_per_contact(plan.friction);
        let greatest = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_deref());
        memory.remember(&self.rows, &self.candidates, per_contact, greatest, &self.actuators);
        let aware = plan.drive.as_ref().is_some_and(|drive| drive.feedforward == Feedforward::ContactAware);
        let candidates = if aware { &self.candidates[..self.detected] } else { &[] };
        let rows =
            self.control_rows.force.chunks_exact(per_contact).zip(self.rows.force.chunks_exact(per_contact));
        // Forces between links do not appear in the feedforward pass: its warm start takes those of the step.
        let forces =
            candidates.iter().zip(rows).map(|(candidate, (control, step))| match candidate.against.body() {
                Some(_) => step,
                None => control,
            });
        memory.feedforward_contacts.remember(candidates, forces);
    }

    /// Keeps in `memory` the dry friction of the joints that have no row for it.
    pub fn remember_friction(&self, memory: &mut StepMemory) {
        let joints = self.friction_modes.iter().zip(&self.friction);
        for (kept, (mode, torque)) in memory.dry_friction.iter_mut().zip(joints) {
            if !matches!(mode, FrictionMode::None | FrictionMode::Row) {
                *kept = *torque;
            }
        }
    }

    /// Every contact candidate of the last step with its force.
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

/// Greatest distance of a point of a collision shape from its body's centre of mass, m.
fn reach(model: &Model) -> f64 {
    let reaches = model.ground_shapes.iter().map(|shape| {
        let from_center = shape.center - model.bodies[shape.body].center;
        from_center.norm() + shape.reach
    });
    reaches.fold(0.0, f64::max)
}

/// Greatest distance that a body's centre of mass can have from the root's origin, m.
fn span(model: &Model) -> f64 {
    let mut origins = vec![0.0; model.bodies.len()];
    for (index, body) in model.bodies.iter().enumerate().skip(1) {
        let slide = match body.dof {
            DofKind::Revolute => 0.0,
            DofKind::Prismatic => f64::INFINITY,
        };
        origins[index] = origins[body.parent] + body.offset.norm() + slide;
    }
    origins.iter().zip(&model.bodies).map(|(origin, body)| origin + body.center.norm()).fold(0.0, f64::max)
}

/// Gives the candidates the coefficients of their surfaces, and the rebounds of those that were detected with the greatest
/// coefficient their own.
fn touch(plan: &StepPlan, candidates: &mut [ContactCandidate]) {
    let surfaces = &plan.surfaces;
    for candidate in candidates {
        let other = match candidate.against {
            Against::Ground => surfaces.ground,
            Against::Obstacle(index) => surfaces.obstacles[index],
            Against::Link { link, .. } => surfaces.links[link],
        };
        let material = surfaces.links[candidate.link].with(other);
        if let Some(greatest) = plan.restitution
            && candidate.material == ContactCandidate::SMOOTH
            && material.restitution < greatest
        {
            candidate.rebound *= material.restitution / greatest;
        }
        candidate.material = material;
    }
}

/// What a displacement of each joint counts in units of the character.
fn per_unit(model: &Model, plan: &StepPlan) -> Vec<f64> {
    let of = |body: &Body| match body.dof {
        DofKind::Revolute => 1.0,
        DofKind::Prismatic => 1.0 / plan.units.length,
    };
    model.bodies.iter().skip(1).map(of).collect()
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

/// Greatest number of joint rows under `plan`, with each limited joint near one end of its range.
fn joint_rows(plan: &StepPlan) -> usize {
    let limits = plan.limits.iter().flatten().flatten().count();
    let friction = plan.dry_friction.iter().flatten().filter(|friction| **friction > 0.0).count();
    let torques = plan.drive.iter().filter_map(|drive| drive.max_torque.as_ref()).flatten();
    limits + friction + torques.filter(|limit| limit.is_finite()).count()
}
