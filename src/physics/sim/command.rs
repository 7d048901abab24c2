//! Commands to the joints.

/// Command to the joints for one step.
#[derive(Debug, Clone, Copy)]
pub enum Command<'a> {
    /// No actuation.
    Passive,
    /// Prescribed torques, N m or N, one a joint, within the plan's torque limits.
    Torque(&'a [f64]),
    /// Wanted velocities, rad/s or m/s, one a joint, within the plan's torque limits; `None` leaves a joint passive
    /// (velocity control, Tokizaki & Hasegawa eq. 17).
    Velocity(&'a [Option<f64>]),
    /// Targets at the beginning and at the end of the step, rad or m, one a joint. Joints are passive
    /// if the plan has no drive.
    Track {
        /// At the beginning.
        now: &'a [f64],
        /// At the end.
        next: &'a [f64],
    },
}
