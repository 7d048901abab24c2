//! A motion being played: the targets of a player, changed by what its steering answers to the trunk.

use super::player::Player;
use super::steering::Changes;
use crate::sim::Root;

/// How far a motion has been played, from the start on in the order of time.
///
/// Without steering it gives what [`Player::targets`] gives, to the last bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Playing {
    /// Where the root was when play started.
    start: Root,
    /// Which segment between two knots is being played, counted from the start over all rounds of the loop.
    segment: u64,
    /// What is added at the segment's beginning and at its end; empty without steering.
    from: Changes,
    to: Changes,
}

impl Playing {
    /// `player` about to be played by a character whose root is at `start`.
    pub fn new(player: &Player, start: &Root) -> Self {
        let none = if player.steering().is_some() {
            Changes::none(player.joint_count())
        } else {
            Changes::default()
        };
        // The change at the end of the first segment is chosen at its start.
        Self { start: *start, segment: u64::MAX, from: none.clone(), to: none }
    }

    /// Writes the target of every joint, rad or m, at `t` seconds since the start of play into `angles`. `t` is not before
    /// the time asked for last; `root` is where the root is at present.
    pub fn targets(&mut self, player: &Player, t: f64, root: &Root, angles: &mut [f64]) {
        player.targets(t, angles);
        let (Some(steering), Some(place)) = (player.steering(), player.place(t)) else { return };
        if place.segment != self.segment {
            self.segment = place.segment;
            std::mem::swap(&mut self.from, &mut self.to);
            self.to = Changes::none(player.joint_count());
            let chosen = (&mut self.to.angles[..], &mut self.to.velocities[..]);
            steering.add(place.next, (root, &self.start), chosen);
        }
        place.add(&self.from, &self.to, angles);
    }
}
