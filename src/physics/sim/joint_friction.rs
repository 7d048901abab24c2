//! Dry friction in joints, as what it is in most steps: a torque that is known, or a joint that does not move.
//!
//! Of the new velocity q̇⁺ and the torque λ Coulomb's law asks for one of three things, with f the greatest torque:
//! q̇⁺ ≥ 0 and λ = −f; q̇⁺ ≤ 0 and λ = f; or q̇⁺ = 0 and |λ| ≤ f. Each of them is linear and needs no row: sliding is a
//! constant torque, and a joint that sticks is given the acceleration −q̇ / h, which takes it out of the mass matrix
//! (hybrid dynamics, Featherstone 2008, section 9.2). The last step tells which one to try first, and the inequality
//! whether it holds. A joint for which it does not gets a row with the bounds ±f in the complementarity problem, which
//! decides among the three whatever the others do.

/// A joint is tried as sticking below this share of its greatest friction in the last step.
const FIRMLY: f64 = 0.95;

/// How the dry friction of a joint is computed in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FrictionMode {
    /// There is none.
    #[default]
    None,
    /// The joint slides in its positive direction under the torque −f.
    Forward,
    /// It slides in its negative direction under the torque f.
    Backward,
    /// It does not move.
    Stuck,
    /// It has a row: any of the three.
    Row,
}

impl FrictionMode {
    /// The first to be tried for a joint with the greatest friction `most` (N m or N), of which the last step's was `last`.
    /// It moves at `rate` and would at `expected` after this step if it went on as in the last one, rad/s or m/s.
    pub fn first(most: f64, last: f64, rate: f64, expected: f64) -> Self {
        // Without a last step, as at that velocity.
        let sliding = if last == 0.0 {
            rate
        } else if last.abs() >= most {
            -last
        } else {
            0.0
        };
        if sliding * expected > 0.0 {
            if sliding > 0.0 { Self::Forward } else { Self::Backward }
        } else if sliding == 0.0 && last.abs() <= FIRMLY * most {
            Self::Stuck
        } else {
            Self::Row
        }
    }

    /// The torque of a joint that slides, 0 in the other modes; N m or N.
    pub fn sliding_torque(self, most: f64) -> f64 {
        match self {
            Self::Forward => -most,
            Self::Backward => most,
            Self::None | Self::Stuck | Self::Row => 0.0,
        }
    }

    /// Whether the new velocity `rate` and the torque `torque` are what the mode stands for.
    pub fn holds(self, most: f64, torque: f64, rate: f64) -> bool {
        match self {
            Self::Forward => rate >= 0.0,
            Self::Backward => rate <= 0.0,
            Self::Stuck => torque.abs() <= most,
            Self::None | Self::Row => true,
        }
    }
}
