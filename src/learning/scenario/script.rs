//! The commands to the joints as a function of time.

use gaitwright_physics::motion::{Player, Playing};
use gaitwright_physics::sim::{Command, Root};

/// What drives the joints over a whole simulation.
#[derive(Debug, Clone, PartialEq)]
pub enum Script {
    /// Nothing: the joints are passive.
    Passive,
    /// Constant torques, N m or N, one a joint.
    Torque(Vec<f64>),
    /// Constant velocities, rad/s or m/s, one a joint; passive where `None`.
    Velocity(Vec<Option<f64>>),
    /// Fixed targets, rad or m, one a joint.
    Hold(Vec<f64>),
    /// Targets that follow a motion.
    Track(Player),
}

impl Script {
    /// Whether joints are driven toward targets.
    pub fn has_targets(&self) -> bool {
        matches!(self, Self::Hold(_) | Self::Track(_))
    }

    /// What is known of a motion while it is played from a root at `start` on; `None` where there is no motion.
    pub fn playing(&self, start: &Root) -> Option<Playing> {
        if let Self::Track(player) = self { Some(Playing::new(player, start)) } else { None }
    }

    /// Writes the targets at `time` (s since the start of the simulation) into `targets`, rad or m, one a joint, steered by
    /// a root that is at `root`. Times are asked for in their order.
    pub fn steered_targets(
        &self,
        playing: &mut Option<Playing>,
        time: f64,
        root: &Root,
        targets: &mut [f64],
    ) {
        match (self, playing) {
            (Self::Track(player), Some(playing)) => playing.targets(player, time, root, targets),
            _ => self.targets(time, targets),
        }
    }

    /// Writes the targets at `time` (s since the start of the simulation) into `targets`, rad or m, one a
    /// joint, without any steering. Where there are none, `targets` stays as it is.
    pub fn targets(&self, time: f64, targets: &mut [f64]) {
        match self {
            Self::Passive | Self::Torque(_) | Self::Velocity(_) => {}
            Self::Hold(held) => targets.copy_from_slice(held),
            Self::Track(player) => player.targets(time, targets),
        }
    }

    /// The command of a step at whose beginning and end the targets are `now` and `next`.
    pub fn command<'a>(&'a self, now: &'a [f64], next: &'a [f64]) -> Command<'a> {
        match self {
            Self::Passive => Command::Passive,
            Self::Torque(torque) => Command::Torque(torque),
            Self::Velocity(wanted) => Command::Velocity(wanted),
            Self::Hold(_) | Self::Track(_) => Command::Track { now, next },
        }
    }
}
