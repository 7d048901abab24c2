//! Points considered before the solve: contacts, and what is about to become one.

use nalgebra::Vector3;

use crate::scene::{PairMaterial, Surfaces};
use crate::sim::spatial::SpatialMotion;

/// Normals with a greater cosine between them, 0.1° apart, are those of one face.
const ONE_FACE: f64 = 1.0 - 1.5e-6;

/// A point considered before the solve: a contact, or a point that may become one within the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactCandidate {
    /// The contact's slot: the place in which a step's forces are remembered for the next.
    pub slot: usize,
    /// Index of the character's link.
    pub link: usize,
    /// Index of the body.
    pub body: usize,
    /// The other side of the contact.
    pub against: Against,
    /// The point of contact, relative to the common point, m.
    pub at: Vector3<f64>,
    /// Unit normal, from the other side into the body, and two tangents, along the world axes. The tangents have unit length but
    /// where friction depends on the direction (see [`super::grip`]).
    pub frame: [Vector3<f64>; 3],
    /// Depth of penetration, m; negative for a gap.
    pub depth: f64,
    /// Least separation speed along the normal if it closes within the step, m/s: 0 without restitution.
    pub rebound: f64,
    /// Coefficients of the pair of surfaces. (ContactDetection::detect)
    pub material: PairMaterial,
}

/// The other side of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// The ground.
    Ground,
    /// An obstacle of the scene, by its index.
    Obstacle(usize),
    /// Another link of the character.
    Link {
        /// Index of the character's link.
        link: usize,
        /// Index of its body.
        body: usize,
    },
}

impl Against {
    /// The other body that moves, if there is one.
    #[inline]
    pub fn body(self) -> Option<usize> {
        match self {
            Self::Ground | Self::Obstacle(_) => None,
            Self::Link { body, .. } => Some(body),
        }
    }

    /// Its coefficients.
    pub fn material(self, surfaces: &Surfaces) -> PairMaterial {
        match self {
            Self::Ground => surfaces.ground,
            Self::Obstacle(index) => surfaces.obstacles[index],
            Self::Link { link, .. } => surfaces.links[link],
        }
    }
}

impl ContactCandidate {
    /// Coefficients of a contact that has none yet.
    pub(in crate::sim) const SMOOTH: PairMaterial = PairMaterial { friction: 0.0, restitution: 0.0 };

    /// Whether `other`, detected from the same positions, is the same contact: points of a pair of shapes are numbered as they are found, and
    /// all faces of a height field below a point share its slot, so that the slot does not tell. Points within `near` m are one.
    pub fn is_same_as(&self, other: &Self, near: f64) -> bool {
        let sides = |candidate: &Self| (candidate.link, candidate.body, candidate.against);
        sides(self) == sides(other)
            && (self.at - other.at).norm() <= near
            && self.frame[0].dot(&other.frame[0]) > ONE_FACE
    }

    /// Velocity of the body at the point of contact relative to the other side, m/s, where `bodies` are
    /// the velocities of all bodies.
    #[inline]
    pub fn slip(&self, bodies: impl Fn(usize) -> SpatialMotion) -> Vector3<f64> {
        let own = bodies(self.body).at(self.at);
        match self.against.body() {
            None => own,
            Some(other) => own - bodies(other).at(self.at),
        }
    }

    /// The force on the body (N, along the world axes) whose components along the frame are `forces`; those
    /// left out are 0.
    #[inline]
    pub fn force(&self, forces: &[f64]) -> Vector3<f64> {
        forces.iter().zip(self.frame).map(|(force, axis)| axis * *force).sum()
    }
}

/// Two unit tangents of a surface with unit normal `up`: along the world's x and y where it is horizontal.
pub(super) fn tangents(up: Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = if up.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    let along = (axis - up * axis.dot(&up)).normalize();
    [along, up.cross(&along)]
}

/// Keeps of the candidates from index `from` on the deepest, the one farthest from it, the one
/// farthest from the line through both, and the farthest on that line's other side.
pub(super) fn keep_four(candidates: &mut Vec<ContactCandidate>, from: usize) {
    let found = &candidates[from..];
    if found.len() <= 4 {
        return;
    }
    let [_, across, beside] = found[0].frame;
    let flat = |candidate: &ContactCandidate| {
        nalgebra::Vector2::new(candidate.at.dot(&across), candidate.at.dot(&beside))
    };
    let best = |score: &dyn Fn(&ContactCandidate) -> f64| {
        let mut winner = 0;
        for index in 1..found.len() {
            if score(&found[index]) > score(&found[winner]) {
                winner = index;
            }
        }
        winner
    };
    let deepest = best(&|candidate| candidate.depth);
    let origin = flat(&found[deepest]);
    let farthest = best(&|candidate| (flat(candidate) - origin).norm_squared());
    let line = flat(&found[farthest]) - origin;
    let side = |candidate: &ContactCandidate| line.perp(&(flat(candidate) - origin));
    let mut kept = [deepest, farthest, best(&side), best(&|candidate| -side(candidate))];
    kept.sort_unstable();
    let mut end = from;
    for (position, index) in kept.into_iter().enumerate() {
        if position == 0 || kept[position - 1] != index {
            candidates[end] = candidates[from + index];
            end += 1;
        }
    }
    candidates.truncate(end);
}
