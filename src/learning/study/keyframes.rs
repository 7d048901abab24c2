//! Cyclic keyframes: half a ring in numbers, of which the mirrored half follows.

use gaitwright_physics::scene::Gains;

use super::arena::StudyArena;
use super::trail::Found;
use crate::learn::grid::Grid;
use crate::learn::{Behaviour, LearnError, Learning, Posture, Repair, Repairs, reference_gravity};
use crate::program::entry::{Entered, entry, strides};
use crate::program::ring::{KEYFRAMES, PERIOD, Ring};
use crate::program::seeds::Seed;

/// Keyframes of half a ring.
pub(super) const HALF: usize = KEYFRAMES / 2;
/// Unit of an angle, rad or m, and of the logarithm of the period.
const ANGLE: f64 = 0.2;
const LOG_PERIOD: f64 = 0.2;
/// The stride time in units of the seeds' parameter from which searches start, where they do not know better.
const USUAL: f64 = -1.5;

/// What rings of keyframes are made of.
pub(super) struct Keyframes<'a> {
    arena: &'a StudyArena,
    /// Ranges of motion, limbs, and which joint mirrors which.
    grid: Grid,
    /// Stride time in the middle of the search, s.
    pub(super) period: f64,
}

impl<'a> Keyframes<'a> {
    pub(super) fn new(arena: &'a StudyArena) -> Result<Self, LearnError> {
        let subject = &arena.subject;
        let usual = arena.gaits().first().map_or(0.5, |gait| {
            arena.wanted(*gait).usual_period(subject.legs.hip_height) * (0.2 * USUAL).exp()
        });
        let grid = fine_grid(arena, usual / KEYFRAMES as f64)?;
        Ok(Self { arena, grid, period: usual })
    }

    /// As many numbers as a ring takes: the period's, then of each keyframe of a half every joint's angle and rate.
    pub(super) fn dimension(&self) -> usize {
        1 + HALF * 2 * self.grid.joints.len()
    }

    /// How joints are divided for searches on a grid.
    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The ring of `numbers`, each in units of a change that matters; the standing pose where all are 0.
    pub(super) fn ring(&self, numbers: &[f64]) -> Ring {
        let period = self.period * (LOG_PERIOD * numbers[0]).exp();
        let joints = self.grid.joints.len();
        let rate = ANGLE * std::f64::consts::TAU / period;
        let half = numbers[1..].chunks(2 * joints).map(|part| {
            let (angles, rates) = part.split_at(joints);
            let angles = self.grid.joints.iter().zip(angles).map(|(joint, number)| {
                let angle = joint.standing + ANGLE * number;
                joint.limits.range.map_or(angle, |[lower, upper]| angle.clamp(lower, upper))
            });
            Posture {
                angles: angles.collect(),
                velocities: rates.iter().map(|number| rate * number).collect(),
            }
        });
        self.closed(half.collect(), period)
    }

    /// The ring of which `half` is the first half.
    pub(super) fn closed(&self, half: Vec<Posture>, period: f64) -> Ring {
        let mirrored: Vec<Posture> = half.iter().map(|posture| self.mirrored(posture)).collect();
        let cycle: Vec<Posture> = half.into_iter().chain(mirrored).collect();
        let standing = &self.arena.subject.stance.angles;
        let strides = strides(self.arena.speed, self.arena.subject.gravity(), period);
        let entered = [Entered { cycle: &cycle, strides }];
        let entry = entry(standing, &entered, period / cycle.len() as f64);
        Ring { period, entry, cycle, missed: 0.0, steering: None }
    }

    fn mirrored(&self, posture: &Posture) -> Posture {
        let Some(symmetry) = &self.grid.symmetry else { return posture.clone() };
        let standing = |joint: usize| self.grid.joints[joint].standing;
        let sources = || symmetry.mirror().sources().iter().enumerate();
        Posture {
            angles: sources()
                .map(|(joint, &(from, sign))| {
                    standing(joint) + f64::from(sign) * (posture.angles[from] - standing(from))
                })
                .collect(),
            velocities: sources()
                .map(|(_, &(from, sign))| f64::from(sign) * posture.velocities[from])
                .collect(),
        }
    }

    /// The first halves of gaits as the force template has them: of those that are used at the speed asked for and are
    /// the same in the mirror half a stride later. With their stride times, s.
    pub(super) fn seeds(&self) -> Vec<(Vec<Posture>, f64)> {
        let mut found = Vec::new();
        for gait in self.arena.gaits() {
            if gait.mirrored_after() != Some(0.5) {
                continue;
            }
            for Seed { mut parameters, .. } in self.arena.subject.seeds(&gait) {
                // On a grid all rings take the same time.
                parameters[PERIOD] = USUAL;
                let (ring, _) = self.arena.subject.ring(&self.arena.wanted(gait), &parameters);
                let half = ring.cycle[..HALF].to_vec();
                if !found.iter().any(|(known, _)| *known == half) {
                    found.push((half, ring.period));
                }
            }
        }
        found
    }

    /// The numbers of a half ring.
    pub(super) fn numbers(&self, half: &[Posture], period: f64) -> Vec<f64> {
        let rate = ANGLE * std::f64::consts::TAU / period;
        let mut numbers = vec![(period / self.period).ln() / LOG_PERIOD];
        for Posture { angles, velocities } in half {
            let places = self.grid.joints.iter().zip(angles);
            numbers.extend(places.map(|(joint, angle)| (angle - joint.standing) / ANGLE));
            numbers.extend(velocities.iter().map(|velocity| velocity / rate));
        }
        numbers
    }

    /// The ring as a motion that was found after so much simulated time.
    pub(super) fn found(&self, ring: &Ring, cost: f64, at: f64) -> Found {
        let behaviour: Behaviour = ring.behaviour(-cost, 0);
        Found { at, behaviour, gains: self.gains().clone() }
    }

    pub(super) fn gains(&self) -> &Gains {
        &self.arena.subject.gains
    }
}

/// 65 angles within 0.8 rad, 33 rates: fine enough not to ruin a gait that is rounded to it.
fn fine_grid(arena: &StudyArena, transition_time: f64) -> Result<Grid, LearnError> {
    let subject = &arena.subject;
    let learning = Learning {
        transition_time: Some(transition_time),
        repairs: Repairs::default().without(Repair::TransitionTimes),
        angle_levels: 65,
        velocity_levels: 33,
        reach: 0.8,
        swing: 0.8,
        ..Learning::default()
    };
    let gravity = reference_gravity(&subject.scene);
    let parameters = learning.resolve(&subject.stance, gravity, subject.accuracy.step)?;
    Ok(Grid::new(&subject.model, &subject.stance, subject.direction, &parameters))
}
