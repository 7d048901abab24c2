//! Where the character touches the world and itself.

mod field;
pub mod ground;
mod manifold;
pub mod solids;
pub mod travel;

use nalgebra::{Rotation3, Vector3};

use super::reduced::kinematics::BodyMotion;
use super::spatial::Motion;

/// A contact that closes more slowly than this many steps of free fall does not rebound: what the
/// weight adds in each step must not keep a resting contact from resting.
const RESTING_STEPS: f64 = 4.0;

/// A step may drive a point into what it touches by this much, m, before it becomes a touch.
const DRIVEN_IN: f64 = 1e-5;

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
    /// Least speed along the normal with which it leaves if it closes within the step, m/s: 0 without
    /// restitution.
    pub rebound: f64,
}

/// What a link touches.
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

/// How far ahead of a step touches are looked for, and how they rebound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// Length of the step, s.
    pub step: f64,
    /// Magnitude of gravity, m/s².
    pub gravity: f64,
    /// Whether a point that can be reached within two steps is a touch already, so that its row stops it on
    /// the surface instead of in it. Otherwise only points at or below the surface are touches.
    pub anticipate: bool,
    /// Coefficient of restitution.
    pub restitution: f64,
}

impl Outlook {
    /// For what touches at present.
    pub const HERE: Self = Self { step: 0.0, gravity: 0.0, anticipate: false, restitution: 0.0 };

    /// Greatest gap that can be closed within two steps at a present speed of `approach`, m.
    #[inline]
    pub fn margin(&self, approach: f64) -> f64 {
        if self.anticipate {
            4.0 * self.step * self.step * self.gravity + 2.0 * self.step * approach.max(0.0)
        } else {
            0.0
        }
    }

    /// Newton's law of restitution: the speed with which a contact leaves that comes together at `approach`.
    ///
    /// The speed is that at the beginning of the step in which the contact closes. With it, a point that
    /// bounces with coefficient 1 under constant gravity keeps v² / 2 + g z − g h v / 2, which is what
    /// semi-implicit steps of free flight keep, to the last bit of rounding: it never creeps up or down.
    #[inline]
    pub fn rebound(&self, approach: f64) -> f64 {
        if approach > RESTING_STEPS * self.gravity * self.step { self.restitution * approach } else { 0.0 }
    }
}

/// Where a step at a given velocity takes a body.
struct Moved {
    /// Its origin at the beginning, relative to the common point, m.
    origin: Vector3<f64>,
    /// How far that moves, m.
    shift: Vector3<f64>,
    turn: Rotation3<f64>,
}

impl Moved {
    /// For `step` seconds of the velocity `new`.
    fn new(body: &BodyMotion, new: Motion, step: f64) -> Self {
        let shift = new.at(body.origin) * step;
        Self { origin: body.origin, shift, turn: Rotation3::new(new.angular * step) }
    }

    /// Where it takes the point `at` of the body.
    fn point(&self, at: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.shift + self.turn * (at - self.origin)
    }

    /// Which point of the body it takes to `at`.
    fn point_back(&self, at: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.turned_back(at - self.origin - self.shift)
    }

    fn turned(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.turn * direction
    }

    fn turned_back(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.turn.inverse_transform_vector(&direction)
    }
}

/// Two unit tangents of a surface with unit normal `up`: along the world's x and y where it is horizontal.
fn tangents(up: Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = if up.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    let along = (axis - up * axis.dot(&up)).normalize();
    [along, up.cross(&along)]
}

/// Keeps of the touches from index `from` on the deepest, the one farthest from it, the one
/// farthest from the line through both, and the farthest on that line's other side.
fn keep_four(touches: &mut Vec<Touch>, from: usize) {
    let candidates = &touches[from..];
    if candidates.len() <= 4 {
        return;
    }
    let [_, across, beside] = candidates[0].frame;
    let flat = |touch: &Touch| nalgebra::Vector2::new(touch.at.dot(&across), touch.at.dot(&beside));
    let best = |score: &dyn Fn(&Touch) -> f64| {
        let mut winner = 0;
        for index in 1..candidates.len() {
            if score(&candidates[index]) > score(&candidates[winner]) {
                winner = index;
            }
        }
        winner
    };
    let deepest = best(&|touch| touch.depth);
    let origin = flat(&candidates[deepest]);
    let farthest = best(&|touch| (flat(touch) - origin).norm_squared());
    let line = flat(&candidates[farthest]) - origin;
    let side = |touch: &Touch| line.perp(&(flat(touch) - origin));
    let mut kept = [deepest, farthest, best(&side), best(&|touch| -side(touch))];
    kept.sort_unstable();
    let mut end = from;
    for (position, index) in kept.into_iter().enumerate() {
        if position == 0 || kept[position - 1] != index {
            touches[end] = touches[from + index];
            end += 1;
        }
    }
    touches.truncate(end);
}
