//! Contact candidates: those that the bodies' places and velocities suggest, and those that an impact brings about.

use nalgebra::Vector3;

use super::velocities::Placement;
use crate::model::{DofKind, Model, PAIR_POINTS};
use crate::scene::StepPlan;
use multiversion::multiversion;

use crate::model::wide::LANES;
use crate::sim::bodies::Bodies;
use crate::sim::contact::solids::{Solids, free_slot};
use crate::sim::contact::{Contact, ContactCandidate, DetectionSettings, grip, ground};
use crate::sim::per_body::Motions;
use crate::sim::rows::contact;
use crate::sim::spatial::WideMotion;

/// Points of two detections from the same positions that are nearer than this share of the character's reach are one.
const SAME_POINT: f64 = 1e-6;

/// Contact candidates. (detection, impact_contacts)
///
/// C is the number of candidates.
#[derive(Debug, Clone)]
pub struct ContactDetection {
    /// C contact candidates. (detect, detect_again, add_driven_in)
    pub candidates: Vec<ContactCandidate>,
    /// Number of candidates that the first detection found; the others came with an impact. (detection)
    pub first: usize,
    /// The candidates known before the detection was repeated. (detect_again)
    known: Vec<ContactCandidate>,
    /// Indices of the shapes that may touch the ground at other points than their candidates. (detect)
    close: Vec<usize>,
    /// Finds contacts between solids, if the plan asks for it. (detect)
    solids: Option<Solids>,
    /// Greatest distance of a point of a collision shape from its body's centre of mass, m. (new)
    reach: f64,
    /// Greatest distance that a body's centre of mass can have from the root's origin, m. (new)
    span: f64,
}

impl ContactDetection {
    /// For `model` as `plan` steps it.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let solids = (plan.self_collision || !plan.obstacles.is_empty()).then(|| Solids::new(model, plan));
        let slots = slots(model, plan);
        Self {
            candidates: Vec::with_capacity(slots),
            first: 0,
            known: Vec::with_capacity(slots),
            close: Vec::with_capacity(model.ground_shapes.len()),
            solids,
            reach: reach(model),
            span: span(model),
        }
    }

    /// Detects the contact candidates of a step of `step` seconds; `period` is that of the feedforward, s. `angles` are those of
    /// the joints if the bodies' poses follow from them.
    pub fn detect(
        &mut self,
        model: &Model,
        plan: &StepPlan,
        placed: &Placement,
        angles: Option<&[f64]>,
        period: f64,
        step: f64,
    ) {
        let Self { candidates, close, solids, .. } = self;
        let settings = DetectionSettings {
            step,
            ahead: plan.drive.as_ref().map_or(step, |drive| step.max(0.5 * drive.horizon(period, step))),
            acceleration: plan.units.acceleration,
            gravity: plan.gravity.norm(),
            anticipate: plan.stabilization,
            restitution: plan.restitution.unwrap_or(0.0),
        };
        let origin = placed.common_point.coords;
        candidates.clear();
        if let Some(ground) = &plan.ground {
            ground::detect(model, &placed.bodies, ground, origin, &settings, candidates, close);
        }
        if let Some(solids) = solids {
            solids.detect(model, &placed.bodies, angles, &plan.obstacles, origin, &settings, candidates);
        }
        touch(plan, &placed.bodies, candidates);
    }

    /// Whether the step changes the velocity of a body from its old one to `new` by more than the detection allows for (see
    /// [`DetectionSettings::margin`]): by an impact, or because a support is lost.
    #[inline(always)] // compiled for the processor of `step`
    pub fn is_impact(&self, plan: &StepPlan, placed: &Placement, new: &Motions, step: f64) -> bool {
        if plan.ground.is_none() && self.solids.is_none() {
            return false;
        }
        // Without weight as under standard gravity: or every change of velocity would be an impact.
        let expected = 4.0 * step * plan.units.acceleration;
        // In most steps nothing can change as much, wherever the bodies are.
        let (mut linear, mut angular) = (0.0_f64, 0.0_f64);
        for (new, old) in new.groups.iter().zip(&placed.old.groups) {
            let (of_group, turning) = greatest_change(new, old);
            linear = linear.max(of_group);
            angular = angular.max(turning);
        }
        if linear + angular * (2.0 * self.span + self.reach) <= expected {
            return false;
        }
        (0..new.len()).any(|index| {
            let change = new.at(index).minus(placed.old.at(index));
            change.at(placed.bodies.at(index).center).amax() + change.angular.amax() * self.reach > expected
        })
    }

    /// Detects contacts again at the velocities `new`, and adds those that were not known; whether there are any. The others
    /// as for [`detect`](Self::detect).
    #[allow(clippy::too_many_arguments)] // those of the detection, and the velocities
    pub fn detect_again(
        &mut self,
        model: &Model,
        plan: &StepPlan,
        placed: &mut Placement,
        new: &mut Motions,
        angles: Option<&[f64]>,
        period: f64,
        step: f64,
    ) -> bool {
        placed.exchange_velocities(new);
        self.known.clone_from(&self.candidates);
        self.detect(model, plan, placed, angles, period, step);
        placed.exchange_velocities(new);
        let Self { known, candidates, reach, .. } = self;
        let (count, near) = (known.len(), SAME_POINT * *reach);
        for candidate in candidates.iter() {
            if !known[..count].iter().any(|other| other.is_same_as(candidate, near)) {
                // Points on the ground may share a slot; those of two solids were counted anew.
                let of_solids = candidate.slot >= model.ground_slots;
                let slot = if of_solids { free_slot(known, candidate.slot) } else { candidate.slot };
                known.push(ContactCandidate { slot, rebound: 0.0, ..*candidate });
            }
        }
        std::mem::swap(known, candidates);
        candidates.len() > count
    }

    /// Adds the points that the velocities `new` would drive in during a step of `step` seconds; whether there are any.
    pub fn add_driven_in(
        &mut self,
        model: &Model,
        plan: &StepPlan,
        placed: &Placement,
        new: &Motions,
        step: f64,
    ) -> bool {
        let Self { candidates, close, solids, .. } = self;
        if !plan.stabilization {
            return false;
        }
        let (bodies, origin) = (&placed.bodies, placed.common_point.coords);
        let ground = plan.ground.as_ref();
        let driven = ground.is_some_and(|ground| {
            ground::add_driven_in(model, close, bodies, new, ground, origin, step, candidates)
        });
        let into = solids.as_ref().is_some_and(|solids| {
            solids.add_driven_in(model, bodies, new, &plan.obstacles, origin, step, candidates)
        }) || driven;
        touch(plan, bodies, candidates);
        into
    }

    /// Every candidate with the force that belongs to it in `forces`, those of the rows of contacts; `new` are the bodies'
    /// velocities.
    pub fn contacts<'a>(
        &'a self,
        plan: &StepPlan,
        placed: &'a Placement,
        new: &'a Motions,
        forces: &'a [f64],
    ) -> impl Iterator<Item = Contact> + 'a {
        let rows = contact::rows_per_contact(plan.friction);
        self.candidates.iter().enumerate().map(move |(index, candidate)| Contact {
            link: candidate.link,
            position: placed.common_point + candidate.at,
            against: candidate.against,
            normal: candidate.frame[0],
            force: candidate.force(forces.get(index * rows..(index + 1) * rows).unwrap_or_default()),
            velocity: candidate.slip(|body| new.at(body)),
            depth: candidate.depth,
        })
    }
}

/// Greatest component of the changes of linear and of angular velocity of a group of bodies.
#[multiversion(targets("x86_64+avx2"))]
fn greatest_change(new: &WideMotion, old: &WideMotion) -> (f64, f64) {
    let (mut linear, mut angular) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let change = new.at(lane).minus(old.at(lane));
        linear[lane] = greater(change.linear);
        angular[lane] = greater(change.angular);
    }
    (linear.into_iter().fold(0.0, f64::max), angular.into_iter().fold(0.0, f64::max))
}

/// The greatest component of `vector`, without branches.
#[inline(always)] // part of a loop over lanes
fn greater(vector: Vector3<f64>) -> f64 {
    vector.x.abs().max(vector.y.abs()).max(vector.z.abs())
}

/// Room for the candidates of `model` under `plan`: every place on the ground, and as many solids in contact as there are.
pub fn slots(model: &Model, plan: &StepPlan) -> usize {
    let ground = if plan.ground.is_some() { model.ground_slots } else { 0 };
    let solid = plan.self_collision || !plan.obstacles.is_empty();
    ground + if solid { PAIR_POINTS * model.solids.len() } else { 0 }
}

/// Greatest distance of a point of a collision shape from its body's centre of mass, m.
fn reach(model: &Model) -> f64 {
    let reaches = model.ground_shapes.iter().map(|shape| {
        let from_center: Vector3<f64> = shape.center - model.bodies[shape.body].center;
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
/// coefficient their own; where friction depends on the direction also the tangents, by the poses of `bodies`.
fn touch(plan: &StepPlan, bodies: &Bodies, candidates: &mut [ContactCandidate]) {
    let surfaces = &plan.surfaces;
    for candidate in candidates {
        let material = surfaces.links[candidate.link].with(candidate.against.material(surfaces));
        if let Some(greatest) = plan.restitution
            && candidate.material == ContactCandidate::SMOOTH
            && material.restitution < greatest
        {
            candidate.rebound *= material.restitution / greatest;
        }
        candidate.material = material;
        if surfaces.has_grains() {
            grip::align(candidate, surfaces, bodies);
        }
    }
}
