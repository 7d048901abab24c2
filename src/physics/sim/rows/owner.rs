//! What a row belongs to.

/// What a row belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowOwner {
    /// A contact of a link: its normal row, or a tangential one.
    Contact {
        /// Index of the character's link.
        link: usize,
    },
    /// The lower end of a joint's range.
    LowerLimit(usize),
    /// The upper end of a joint's range.
    UpperLimit(usize),
    /// The dry friction of a joint.
    DryFriction(usize),
    /// The actuator of a joint, within its greatest torque.
    Torque(usize),
    /// What drives a joint without bounds, and its damping and rotor, where they have a row.
    Drive(usize),
    /// What holds the two bodies of a joint together.
    Joint(usize),
    /// What closes a loop.
    Loop(usize),
    /// The lock of the root's rotation.
    TrunkLock,
}

impl RowOwner {
    /// Whether its force is that of an impact, which may do no positive work: of what can strike, and of what rubs there. All others
    /// are motors, and what holds bodies together.
    pub fn is_impact(self) -> bool {
        matches!(
            self,
            Self::Contact { .. } | Self::LowerLimit(_) | Self::UpperLimit(_) | Self::DryFriction(_)
        )
    }
}
