//! From keyframes to the joint targets of any moment.

use super::document::{Keyframe, Motion};
use super::limits::{TargetLimits, limit_faults};
use super::spline::hermite;
use super::steering::{KeyframeChange, Steering};
use super::steering_limits::PlainSegment;
use crate::fault::{Fault, InputError};

/// Joint targets as a function of the time since the start of play: the entry once, then the loop over and over.
///
/// Between two knots a target is the cubic Hermite spline of [`hermite`]; it is continuous with its
/// rate everywhere, across the seam of the loop too. Any time can be asked for in any order, and
/// the same time gives the same bits. A motion's [`Steering`] is answered to by [`Playing`](super::Playing) only.
#[derive(Debug, Clone, PartialEq)]
pub struct Player {
    joints: usize,
    /// Time of each knot since the start of play, s, increasing from 0.
    times: Vec<f64>,
    /// Angle of every joint, knot by knot.
    angles: Vec<f64>,
    /// Rate of every joint, knot by knot.
    velocities: Vec<f64>,
    /// The knot at which the loop starts; it ends at the last knot.
    loop_start: usize,
    steering: Option<Steering>,
}

/// Where a time falls among the knots.
pub(super) struct Place {
    /// A number that no other segment has, over all rounds of the loop.
    pub(super) segment: u64,
    /// As which keyframes of the loop its beginning and its end count.
    pub(super) begins: Option<usize>,
    pub(super) next: usize,
    /// Duration of the segment and time since its beginning, s.
    duration: f64,
    since: f64,
}

impl Place {
    /// Adds to the targets `angles` the spline between changes at the two ends of the segment.
    pub(super) fn add(&self, from: &KeyframeChange, to: &KeyframeChange, angles: &mut [f64]) {
        for (joint, angle) in angles.iter_mut().enumerate() {
            *angle += hermite(
                (from.angles[joint], from.velocities[joint]),
                (to.angles[joint], to.velocities[joint]),
                self.duration,
                self.since,
            );
        }
    }
}

impl Player {
    /// Plays a motion document: its `entry`, then its `keyframes` up to the loop's end, then the
    /// loop over and over. Without an entry it starts at the first keyframe.
    ///
    /// `joints` names the joints in the order in which targets are wanted (that of the model); `limits` holds for each
    /// what its targets must keep to ([`TargetLimits::of`]).
    ///
    /// # Errors
    ///
    /// [`InputError::Impossible`] when the document is not sound ([`Motion::faults`]), when it
    /// and `joints` do not name the same joints (every joint without a counterpart is named), or when the splines
    /// between its keyframes break `limits` (of each joint and limit the worst place, with the value).
    pub fn new(motion: &Motion, joints: &[String], limits: &[TargetLimits]) -> Result<Self, InputError> {
        let mut faults = motion.faults();
        let column = |name: &String| motion.joints.iter().position(|own| own == name);
        faults.extend(
            joints
                .iter()
                .filter(|name| column(name).is_none())
                .map(|name| Fault::new("/joints", format!("the character's joint \"{name}\" is missing"))),
        );
        faults.extend(motion.joints.iter().enumerate().filter(|(_, name)| !joints.contains(name)).map(
            |(index, name)| {
                Fault::new(format!("/joints/{index}"), format!("the character has no joint \"{name}\""))
            },
        ));
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        let order: Vec<usize> = joints.iter().filter_map(column).collect();
        for (&own, (name, limits)) in order.iter().zip(joints.iter().zip(limits)) {
            for (place, keyframes) in [("/entry", &motion.entry), ("/keyframes", &motion.keyframes)] {
                limit_faults(place, keyframes, (own, name), limits, &mut faults);
            }
        }
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }

        let mut player = Self::empty(order.len());
        let mut push = |time: f64, keyframe: &Keyframe| {
            player.times.push(time);
            player.angles.extend(order.iter().map(|&joint| keyframe.angles[joint]));
            player.velocities.extend(order.iter().map(|&joint| keyframe.velocities[joint]));
        };
        // The entry's last keyframe is the first of `keyframes`, and is pushed as that.
        let (lead, offset) = match motion.entry.split_last() {
            Some((last, lead)) => (lead, last.time),
            None => (&[][..], 0.0),
        };
        for keyframe in lead {
            push(keyframe.time, keyframe);
        }
        for keyframe in &motion.keyframes {
            push(offset + keyframe.time, keyframe);
        }
        let before = motion.keyframes.iter().position(|keyframe| keyframe.time == motion.cycle.start);
        player.loop_start = lead.len() + before.unwrap_or(0);
        if let Some(steering) = &motion.steering {
            let steering = steering.reordered(&order);
            for (joint, (name, limits)) in joints.iter().zip(limits).enumerate() {
                let share = player.share_of(&steering, joint, limits);
                // Room for numbers written with nine digits.
                if share < 1.0 - 1e-6 {
                    let reason = format!(
                        "the changes of the joint \"{name}\" could take it beyond its range of motion or its greatest speed: they \
                         keep to both when multiplied by {share}"
                    );
                    faults.push(Fault::new("/steering", reason));
                }
            }
            player.steering = Some(steering);
        }
        if faults.is_empty() { Ok(player) } else { Err(InputError::Impossible(faults)) }
    }

    /// The same with `steering`, whose changes are of joints in this player's order, one for each keyframe of the loop.
    pub fn steered(self, steering: Option<Steering>) -> Self {
        Self { steering, ..self }
    }

    /// `steering` for this player, with its changes reduced in each joint until the targets keep to the joint's `limits` in every cell.
    pub fn kept_within(&self, mut steering: Steering, limits: &[TargetLimits]) -> Steering {
        for (joint, limits) in limits.iter().enumerate() {
            let share = self.share_of(&steering, joint, limits);
            if share < 1.0 {
                steering.scale(joint, share);
            }
        }
        steering
    }

    /// What [`Steering::share_within`] gives for a joint on all segments, those of the entry as well.
    fn share_of(&self, steering: &Steering, joint: usize, limits: &TargetLimits) -> f64 {
        let end = |knot: usize| {
            let at = knot * self.joints + joint;
            (self.angles[at], self.velocities[at])
        };
        // The pose from which play starts is changed by nothing, unless the loop comes back to it.
        let changed = |knot: usize| self.keyframe(knot).filter(|_| knot > 0 || self.loop_start == 0);
        let segments = (1..self.times.len()).map(|knot| PlainSegment {
            ends: [end(knot - 1), end(knot)],
            keyframes: [changed(knot - 1), changed(knot)],
            duration: self.times[knot] - self.times[knot - 1],
        });
        steering.share_within(joint, segments, limits)
    }

    /// As which keyframe of the loop a knot counts; the entry counts back from the loop's start. `None` without a loop.
    fn keyframe(&self, knot: usize) -> Option<usize> {
        let count = self.times.len().checked_sub(self.loop_start + 1).filter(|count| *count > 0)?;
        Some((knot as isize - self.loop_start as isize).rem_euclid(count as isize) as usize)
    }

    /// The feedback that [`Playing`](super::Playing) answers to.
    pub fn steering(&self) -> Option<&Steering> {
        self.steering.as_ref()
    }

    /// Where `t` falls; `None` after the last knot of a motion without a loop.
    pub(super) fn place(&self, t: f64) -> Option<Place> {
        let (knot, since) = self.locate(t)?;
        let next = self.keyframe(knot + 1)?;
        // Rounding may put a time at the loop's seam to either side of it, so the round is counted from the segment's start.
        let round = if t < self.times[self.times.len() - 1] {
            0.0
        } else {
            ((t - since - self.times[knot]) / self.period()).round()
        };
        Some(Place {
            segment: knot as u64 + round as u64 * self.times.len() as u64,
            begins: self.keyframe(knot),
            next,
            duration: self.times[knot + 1] - self.times[knot],
            since,
        })
    }

    /// Plays postures that are `transition_time` seconds apart: from `start` (at rest) through every
    /// posture of `entry` once, then through `cycle` over and over; its last posture is followed by its
    /// first.
    ///
    /// A posture is a pair of angles (rad or m) and rates (per second), one a joint, all of the
    /// length of `start`. An empty cycle holds the last posture there is. `transition_time` is
    /// positive.
    pub fn from_postures<'a>(
        start: &[f64],
        entry: impl IntoIterator<Item = (&'a [f64], &'a [f64])>,
        cycle: impl IntoIterator<Item = (&'a [f64], &'a [f64])>,
        transition_time: f64,
    ) -> Self {
        let mut player = Self::empty(start.len());
        player.angles.extend_from_slice(start);
        player.velocities.resize(start.len(), 0.0);
        let mut knots = 1;
        for (angles, velocities) in entry {
            player.angles.extend_from_slice(angles);
            player.velocities.extend_from_slice(velocities);
            knots += 1;
        }
        let first = knots;
        for (angles, velocities) in cycle {
            player.angles.extend_from_slice(angles);
            player.velocities.extend_from_slice(velocities);
            knots += 1;
        }
        if knots > first {
            let posture = first * start.len()..(first + 1) * start.len();
            player.angles.extend_from_within(posture.clone());
            player.velocities.extend_from_within(posture);
            player.loop_start = first;
            knots += 1;
        } else {
            player.loop_start = knots - 1;
        }
        // From the start of the loop on as a document counts them, so that both play the same to the last bit.
        let time = |knots: usize| knots as f64 * transition_time;
        player.times = (0..knots)
            .map(|knot| time(knot.min(player.loop_start)) + time(knot.saturating_sub(player.loop_start)))
            .collect();
        player
    }

    fn empty(joints: usize) -> Self {
        let (times, angles, velocities) = (Vec::new(), Vec::new(), Vec::new());
        Self { joints, times, angles, velocities, loop_start: 0, steering: None }
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.joints
    }

    /// Time from the start of play to the first start of the loop, s.
    pub fn lead(&self) -> f64 {
        self.times.get(self.loop_start).copied().unwrap_or(0.0)
    }

    /// Duration of the loop, s; 0 when there is none.
    pub fn period(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0) - self.lead()
    }

    /// Writes the target of every joint, rad or m, at `t` seconds since the start of play into
    /// `angles`, one a joint. Before the start it is the first knot's.
    pub fn targets(&self, t: f64, angles: &mut [f64]) {
        debug_assert_eq!(angles.len(), self.joints, "one target a joint");
        let n = self.joints;
        let Some((knot, since)) = self.locate(t) else {
            let held = self.angles.len().saturating_sub(n);
            angles.iter_mut().zip(&self.angles[held..]).for_each(|(target, &angle)| *target = angle);
            return;
        };
        let duration = self.times[knot + 1] - self.times[knot];
        let (from, to) = (knot * n, (knot + 1) * n);
        for (joint, target) in angles.iter_mut().enumerate().take(n) {
            *target = hermite(
                (self.angles[from + joint], self.velocities[from + joint]),
                (self.angles[to + joint], self.velocities[to + joint]),
                duration,
                since,
            );
        }
    }

    /// The knot that begins the segment in which `t` falls, and the time since it, s; `None` after
    /// the last knot of a motion without a loop.
    ///
    /// Rounding may put a time that lies on a knot to either side of it. That does no harm: both
    /// segments have the knot's value there.
    fn locate(&self, t: f64) -> Option<(usize, f64)> {
        let (&end, start) = (self.times.last()?, self.lead());
        let period = end - start;
        let t = if t < end {
            t.max(0.0)
        } else if period > 0.0 {
            let cycles = ((t - start) / period).floor();
            (t - cycles * period).clamp(start, end)
        } else {
            return None;
        };
        let segments = self.times.len() - 1;
        let knot = self.times.partition_point(|&time| time <= t).clamp(1, segments) - 1;
        Some((knot, t - self.times[knot]))
    }
}
