//! From a character to a model: rigid parts are merged, shapes become contact candidates.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::collision::convex::Convex;
use super::collision::pairs::PairFinder;
use super::groups::groups;
use super::size::size;
use super::spin::spins;
use super::{Base, Body, DofKind, LinkPlace, LoopJoint, Model, collision};
use crate::character::{Character, Joint, JointKind, Loop};

impl Model {
    /// Compiles `character`.
    ///
    /// A joint of kind fixed gets no degree of freedom: its child link is merged into the parent's body. `base` says
    /// whether the root link can move.
    pub fn new(character: Arc<Character>, base: Base) -> Self {
        let Merged { bodies, links, joints } = merged(&character);
        let loops: Vec<LoopJoint> =
            character.loops.iter().map(|closing| loop_joint(closing, &links)).collect();
        let (ground_shapes, ground_points, ground_slots) = collision::candidates(&character, &links);
        let solids: Vec<Convex> = character
            .links
            .iter()
            .zip(&links)
            .flat_map(|(link, place)| link.collisions.iter().map(|placed| Convex::new(placed, &place.pose)))
            .collect();
        let limits: Vec<Option<[f64; 2]>> =
            joints.iter().map(|joint| joint.limits.map(|range| [range.lower, range.upper])).collect();
        let standing: Vec<f64> = joints.iter().map(|joint| standing_angle(&character, joint)).collect();
        let finder = PairFinder {
            bodies: &bodies,
            loops: &loops,
            limits: &limits,
            shapes: &ground_shapes,
            solids: &solids,
            standing: &standing,
        };
        let pairs = finder.pairs();
        let (groups, slots) = groups(&bodies, &spins(&character, &links, &bodies, &loops));
        Self {
            fixed_base: base == Base::Fixed,
            joint_names: joints.iter().map(|joint| joint.name.clone()).collect(),
            limits,
            driven: joints.iter().map(|joint| joint.driven).collect(),
            effort: joints.iter().map(|joint| joint.effort).collect(),
            speed: joints.iter().map(|joint| joint.velocity).collect(),
            damping: joints.iter().map(|joint| joint.damping).collect(),
            friction: joints.iter().map(|joint| joint.friction).collect(),
            armature: joints.iter().map(|joint| joint.armature).collect(),
            mass: bodies.iter().map(|body| body.mass).sum(),
            size: size(&bodies, base == Base::Fixed),
            outward: groups[1..].iter().flat_map(|group| &group.bodies[..group.count]).copied().collect(),
            slots: slots.into(),
            groups,
            branches: branches(&bodies),
            bodies,
            loops,
            links,
            ground_bodies: collision::ground_bodies(&ground_shapes, base == Base::Fixed),
            ground_shapes,
            ground_points,
            ground_slots,
            solids,
            pairs,
            character,
        }
    }
}

/// The bodies of a character: links that fixed joints join are one.
struct Merged<'a> {
    bodies: Vec<Body>,
    /// Where each link is.
    links: Vec<LinkPlace>,
    /// The movable joints; each carries the body after its own number.
    joints: Vec<&'a Joint>,
}

fn merged(character: &Character) -> Merged<'_> {
    let mut bodies = vec![MergedBody::new(Body {
        parent: 0,
        dof: DofKind::Revolute,
        offset: Vector3::zeros(),
        joint_rotation: Matrix3::identity(),
        joint_rotation_sine: Matrix3::zeros(),
        joint_rotation_versine: Matrix3::zeros(),
        axis: Vector3::z(),
        mass: 0.0,
        center: Vector3::zeros(),
        inertia: Matrix3::zeros(),
    })];
    let mut links: Vec<LinkPlace> = Vec::with_capacity(character.links.len());
    let mut joints = Vec::new();
    for link in &character.links {
        let place = match &link.joint {
            None => LinkPlace { body: 0, pose: Isometry3::identity() },
            Some(joint) => {
                let parent = &links[joint.parent];
                let origin = parent.pose * joint.origin;
                match dof(joint.kind) {
                    None => LinkPlace { body: parent.body, pose: origin },
                    Some(dof) => {
                        bodies.push(MergedBody::new(carried(parent.body, dof, &origin, &joint.axis)));
                        joints.push(joint);
                        LinkPlace { body: bodies.len() - 1, pose: Isometry3::identity() }
                    }
                }
            }
        };
        if let Some(inertial) = &link.inertial {
            let rotation = place.pose.rotation.to_rotation_matrix();
            bodies[place.body].add(
                inertial.mass,
                (place.pose * inertial.center_of_mass).coords,
                rotation.matrix() * inertial.inertia * rotation.matrix().transpose(),
            );
        }
        links.push(place);
    }
    Merged { bodies: bodies.into_iter().map(MergedBody::finish).collect(), links, joints }
}

/// Angle of `joint` in the standing pose that the author gave, or at 0, within its range.
fn standing_angle(character: &Character, joint: &Joint) -> f64 {
    let given = character.standing.iter().flatten().find(|(name, _)| *name == joint.name);
    let angle = given.map_or(0.0, |(_, angle)| *angle);
    joint.limits.map_or(angle, |range| angle.clamp(range.lower, range.upper))
}

fn loop_joint(closing: &Loop, links: &[LinkPlace]) -> LoopJoint {
    let end = |end: usize| {
        let place = &links[closing.links[end]];
        (place.body, place.pose * closing.frames[end])
    };
    let [(first, own), (second, other)] = [end(0), end(1)];
    LoopJoint {
        kind: closing.kind,
        bodies: [first, second],
        origins: [own, other].map(|frame| frame.translation.vector),
        rotations: [own, other].map(|frame| *frame.rotation.to_rotation_matrix().matrix()),
        axis: *closing.axis,
    }
}

fn dof(kind: JointKind) -> Option<DofKind> {
    match kind {
        JointKind::Fixed => None,
        JointKind::Revolute => Some(DofKind::Revolute),
        JointKind::Prismatic => Some(DofKind::Prismatic),
    }
}

/// The body on the way from each of `bodies` to the root that hangs on the root.
fn branches(bodies: &[Body]) -> Vec<usize> {
    let mut branches = vec![0; bodies.len()];
    for (index, body) in bodies.iter().enumerate().skip(1) {
        branches[index] = if body.parent == 0 { index } else { branches[body.parent] };
    }
    branches
}

/// A body, still without mass, carried by `parent` through a joint at `origin` with `axis`.
fn carried(parent: usize, dof: DofKind, origin: &Isometry3<f64>, axis: &Vector3<f64>) -> Body {
    let joint_rotation = *origin.rotation.to_rotation_matrix().matrix();
    let cross = match dof {
        DofKind::Revolute => axis.cross_matrix(),
        DofKind::Prismatic => Matrix3::zeros(),
    };
    Body {
        parent,
        dof,
        offset: origin.translation.vector,
        joint_rotation,
        joint_rotation_sine: joint_rotation * cross,
        joint_rotation_versine: joint_rotation * cross * cross,
        axis: *axis,
        mass: 0.0,
        center: Vector3::zeros(),
        inertia: Matrix3::zeros(),
    }
}

/// A body that gathers the inertias of its links about its own origin.
struct MergedBody {
    body: Body,
    mass: f64,
    first_moment: Vector3<f64>,
    parts: Vec<(f64, Vector3<f64>, Matrix3<f64>)>,
}

impl MergedBody {
    fn new(body: Body) -> Self {
        Self { body, mass: 0.0, first_moment: Vector3::zeros(), parts: Vec::new() }
    }

    fn add(&mut self, mass: f64, center: Vector3<f64>, inertia: Matrix3<f64>) {
        self.mass += mass;
        self.first_moment += center * mass;
        self.parts.push((mass, center, inertia));
    }

    /// Sums the links' inertias about their common centre of mass: exact for a single link, and without the
    /// cancellation that summing about the body's origin would bring for several.
    fn finish(self) -> Body {
        let mut body = self.body;
        if self.mass > 0.0 {
            body.mass = self.mass;
            body.center = self.first_moment / self.mass;
            for (mass, center, inertia) in self.parts {
                let arm = center - body.center;
                body.inertia +=
                    inertia + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * mass;
            }
        }
        body
    }
}
