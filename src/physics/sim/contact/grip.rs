//! Friction that depends on the direction of sliding.
//!
//! A link whose coefficients are μ_∥ along the axis a and μ_⊥ across it (see [`Grain`]) bears, on a surface with unit normal n,
//! friction within an ellipse: the projection, onto the tangent plane, of the ellipsoid with semi-axis μ_∥ along a and μ_⊥ across it.
//! With p = a − (a · n) n, t = p / |p| and c = |p| its semi-axes are √(c² μ_∥² + (1 − c²) μ_⊥²) along t and μ_⊥ along n × t. Where
//! a lies in the plane they are the coefficients themselves; where a is normal to it, every direction is across. In between they
//! change continuously, so that a round body that rolls does not meet a jump.
//!
//! Of the two sides of a contact, the one whose semi-axes differ more by their ratio gives both directions (the first link where
//! they differ alike), and in each of them the smaller coefficient of both sides holds, as where neither depends on the direction.
//!
//! The friction of the contact is the force λ_n (μ₁ s₁ t₁ + μ₂ s₂ t₂) with s in the unit disc (or, for the pyramid, in the unit
//! square) that takes the most power from the sliding (Michalowski & Mróz 1978): against the velocity v it is along
//! −(μ₁² v₁ t₁ + μ₂² v₂ t₂), not along −v. Written for t₁ and (μ₂ / μ₁) t₂, with μ₁ the greater, that is the law for a circular cone
//! with the coefficient μ₁: so the second tangent of the contact's frame is shortened by that ratio, and nothing after the
//! detection knows of directions.

use nalgebra::Vector3;

use super::candidate::{Against, ContactCandidate, tangents};
use crate::scene::{Grain, Surfaces};
use crate::sim::bodies::{Bodies, BodyMotion};

/// Below this sine between the axis and the normal the axis has no direction in the tangent plane.
const UPRIGHT: f64 = 1e-9;

/// The friction that one side of a contact bears.
#[derive(Debug, Clone, Copy)]
enum Grip {
    /// The same in all directions: the coefficient.
    Uniform(f64),
    /// Within an ellipse.
    Ellipse {
        /// Orthogonal unit tangents.
        axes: [Vector3<f64>; 2],
        /// The coefficient along each.
        coefficients: [f64; 2],
    },
}

impl Grip {
    /// Of a link with `grain` on a body in this `motion`, on a surface with unit normal `up`.
    fn of(grain: &Grain, motion: &BodyMotion, up: Vector3<f64>) -> Self {
        let axis = motion.rotation * grain.axis;
        let flat = axis - up * axis.dot(&up);
        let sine = flat.norm();
        if sine < UPRIGHT {
            return Self::Uniform(grain.across);
        }
        let first = flat / sine;
        let along = (sine * grain.along).hypot((1.0 - sine * sine).max(0.0).sqrt() * grain.across);
        Self::Ellipse { axes: [first, up.cross(&first)], coefficients: [along, grain.across] }
    }

    /// The greatest friction that it bears in the direction of a unit tangent, as a share of the normal force.
    fn toward(&self, direction: Vector3<f64>) -> f64 {
        match self {
            Self::Uniform(coefficient) => *coefficient,
            Self::Ellipse { axes: [first, second], coefficients: [along, across] } => {
                (along * first.dot(&direction)).hypot(across * second.dot(&direction))
            }
        }
    }

    /// The ratio of the smaller coefficient to the greater.
    fn evenness(&self) -> f64 {
        match *self {
            Self::Uniform(_) => 1.0,
            Self::Ellipse { coefficients: [along, across], .. } => {
                ratio(along.min(across), along.max(across))
            }
        }
    }
}

/// Aligns the tangents of `candidate`, and sets its coefficient, where a side of it has a grain; its normal is as detected, and its
/// coefficient the smaller of both sides.
pub fn align(candidate: &mut ContactCandidate, surfaces: &Surfaces, bodies: &Bodies) {
    let up = candidate.frame[0];
    let grip =
        |link: usize, body: usize| surfaces.grain(link).map(|grain| Grip::of(grain, &bodies.at(body), up));
    let own = grip(candidate.link, candidate.body);
    let other = match candidate.against {
        Against::Ground | Against::Obstacle(_) => None,
        Against::Link { link, body } => grip(link, body),
    };
    if own.is_none() && other.is_none() {
        return;
    }
    let own = own.unwrap_or(Grip::Uniform(surfaces.links[candidate.link].friction));
    let other = other.unwrap_or(Grip::Uniform(candidate.against.material(surfaces).friction));
    let (leading, limiting) = if other.evenness() < own.evenness() { (other, own) } else { (own, other) };
    let Grip::Ellipse { axes: [first, second], coefficients: [along, across] } = leading else {
        // Neither side depends on the direction here.
        let [any, _] = tangents(up);
        candidate.material.friction = own.toward(any).min(other.toward(any));
        return;
    };
    let along = along.min(limiting.toward(first));
    let across = across.min(limiting.toward(second));
    candidate.material.friction = along.max(across);
    if along == across {
        [candidate.frame[1], candidate.frame[2]] = tangents(up);
    } else if along > across {
        [candidate.frame[1], candidate.frame[2]] = [first, second * ratio(across, along)];
    } else {
        [candidate.frame[1], candidate.frame[2]] = [second, first * -ratio(along, across)];
    }
}

/// `less` as a share of `more`, of two coefficients; 1 where both are 0.
fn ratio(less: f64, more: f64) -> f64 {
    if more > 0.0 { less / more } else { 1.0 }
}
