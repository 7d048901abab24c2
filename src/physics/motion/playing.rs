//! A motion being played: the targets of a player, changed by what its steering answers to the trunk.

use super::player::Player;
use super::steering::KeyframeChange;
use crate::sim::Root;

/// How far a motion has been played, from the start on in the order of time.
///
/// Without steering it gives what [`Player::targets`] gives, to the last bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Playing {
    /// Where the root was when play started.
    start: Root,
    /// Which segment between two knots is being played; `None` before the first.
    segment: Option<u64>,
    /// As which keyframe of the loop its end counts.
    ends: Option<usize>,
    /// What is added at the segment's beginning and at its end.
    from: KeyframeChange,
    to: KeyframeChange,
}

impl Playing {
    /// `player` about to be played by a character whose root is at `start`.
    pub fn new(player: &Player, start: &Root) -> Self {
        let none = KeyframeChange::none(player.joint_count());
        Self { start: *start, segment: None, ends: None, from: none.clone(), to: none }
    }

    /// Writes the target of every joint, rad or m, at `t` seconds since the start of play into `angles`. `t` is not before
    /// the time asked for last; `root` is where the root is at present.
    pub fn targets(&mut self, player: &Player, t: f64, root: &Root, angles: &mut [f64]) {
        player.targets(t, angles);
        let (Some(steering), Some(place)) = (player.steering(), player.place(t)) else { return };
        if self.segment != Some(place.segment) {
            let change = |keyframe| steering.change(keyframe, root, &self.start, player.joint_count());
            // A step may be longer than a segment, whose end was not seen then.
            if let Some(begins) = place.begins
                && self.ends.is_some_and(|ends| ends != begins)
            {
                self.to = change(begins);
            }
            self.from = std::mem::replace(&mut self.to, change(place.next));
            (self.segment, self.ends) = (Some(place.segment), Some(place.next));
        }
        place.add(&self.from, &self.to, angles);
    }
}
