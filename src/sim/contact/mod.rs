//! Where the character touches the world and itself.

pub mod ground;

use nalgebra::Vector3;

use super::spatial::Motion;

/// A place at which the character touches something, or is about to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The contact's slot: the place in which a step's forces are remembered for the next.
    pub slot: usize,
    /// Index of the character's link.
    pub link: usize,
    /// Index of the body.
    pub body: usize,
    /// What it touches.
    pub against: Against,
    /// The point of contact, relative to the common point, m.
    pub at: Vector3<f64>,
    /// Unit normal, from what is touched into the body, and two tangents, along the world axes.
    pub frame: [Vector3<f64>; 3],
    /// Depth of penetration, m; negative for a gap.
    pub depth: f64,
}

/// What a link touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// The ground.
    Ground,
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
            Self::Ground => None,
            Self::Link { body, .. } => Some(body),
        }
    }
}

impl Touch {
    /// Velocity of the body at the point of contact against what it touches, m/s, where `bodies` are
    /// the velocities of all bodies.
    #[inline]
    pub fn slip(&self, bodies: impl Fn(usize) -> Motion) -> Vector3<f64> {
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
