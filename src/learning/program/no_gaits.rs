//! Why a character has no gaits with names.

use thiserror::Error;

/// Why a character has no gaits with names, so that QDSEGA is to teach it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NoGaits {
    /// A stride needs weight.
    #[error("nothing pulls it down")]
    Weightless,
    /// As it stands no shape of it touches the ground.
    #[error("nothing of it touches the ground where it stands")]
    NoFeet,
    /// It lies on its root link, and its joints are no row either.
    #[error(
        "it lies on its root link `{link}`, and its joints are not four or more in a row that motors bend"
    )]
    OnRoot {
        /// The root link.
        link: String,
    },
    /// A foot is lifted and set forward by two joints at least.
    #[error("the leg that ends in `{foot}` has one joint, and a leg needs two at least")]
    OneJoint {
        /// The link in which the leg ends.
        foot: String,
    },
    /// A joint of a leg is passive.
    #[error("the leg that ends in `{foot}` has a joint without a motor, `{joint}`")]
    NoMotor {
        /// The link in which the leg ends.
        foot: String,
        /// The joint.
        joint: String,
    },
    /// A leg with closed loops has more freedom, or less, than its motors decide.
    #[error(
        "the motors of the leg that ends in `{foot}` and its closed loops do not decide all of its joints"
    )]
    Undecided {
        /// The link in which the leg ends.
        foot: String,
    },
    /// Legs that branch share the joints above the branching.
    #[error("two legs share the joint `{joint}`")]
    Shared {
        /// The joint.
        joint: String,
    },
    /// Its legs are not pairs.
    #[error(
        "of its feet {left} are on the left of the way, {right} on the right, and {between} on the line between"
    )]
    Unpaired {
        /// Number of feet on the left.
        left: usize,
        /// Number of feet on the right.
        right: usize,
        /// Number of feet on the line between.
        between: usize,
    },
    /// There are no gaits for as many legs.
    #[error("no gaits are known for {legs} legs")]
    LegCount {
        /// How many it has.
        legs: usize,
    },
}
