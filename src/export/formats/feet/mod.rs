//! Feet that stand, held where they stand: in a loop, and in the entry that leads to it.
//!
//! The sampled poses of a loop are those of one simulated cycle whose root was bent a little to close: by as much its feet
//! slide over the ground, beside what they slip in the simulation itself. Here each foot is led back, through the time
//! in which it stands, to the path on which it rolls without sliding, its lowest point on level ground; while it swings
//! what was added goes over into what is added at its next stance. The joints that carry the feet follow by inverse
//! kinematics, and the root where they cannot reach. An entry is led back in the same way to where its last sample has the
//! feet, which is the first of the loop.

mod reach;
mod slide;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;

use super::ground_travel::GroundTravel;
use super::skeleton::Skeleton;
use gaitwright_physics::character::LoopKind;
use gaitwright_physics::motion::{StanceTime, hermite};
use reach::{PointPair, PointTarget, Pose, reach};
use slide::slide;
pub(super) use slide::sole;

/// How often the feet are looked at and led back: moving a limb turns its foot, which rolls a little then.
const ROUNDS: usize = 20;

/// Distance below which no foot has to be led back, m.
const NEAR: f64 = 1e-5;

/// Height over level ground from which on a foot that carries nothing has left it, m.
pub(super) const LIFTED: f64 = 1e-3;

/// A link that slides by more than this share of the way that the character travels meanwhile does not stand on the
/// ground but is dragged over it.
const DRAGGED: f64 = 0.25;

/// What may be slid in any case without being dragged, m.
const SLIPPED: f64 = 0.005;

/// A figure of the poses as they were simulated, and of those that are exported.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Mended {
    /// Of the simulated poses, once their loop was closed.
    pub simulated: f64,
    /// Of the exported poses.
    pub exported: f64,
}

/// How one link stands on the ground in a loop or an entry.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StandingFoot {
    /// The link.
    pub link: String,
    /// How often it stands in a cycle or in the entry; a stance over the seam of a loop counts once.
    pub stances: usize,
    /// The longest way that it slides in a stance, m.
    pub slide: Mended,
    /// The most by which its lowest point lies off level ground in a stance, m; 0 on other ground.
    pub gap: Mended,
    /// Whether it was held; one that never leaves the ground, or is dragged over it, is left as it was simulated. In an entry
    /// those are held that the loop holds.
    pub held: bool,
}

/// A stretch of poses whose feet are to stand.
pub(super) struct Stretch<'a> {
    pub(super) skeleton: &'a Skeleton<'a>,
    /// s, increasing.
    pub(super) times: Vec<f64>,
    /// The root in the travelling frame.
    pub(super) roots: Vec<Isometry3<f64>>,
    /// rad or m, in the order of the skeleton.
    pub(super) angles: Vec<Vec<f64>>,
    pub(super) course: Course<'a>,
}

/// How a stretch of poses lies in time and over the ground.
pub(super) enum Course<'a> {
    /// It repeats itself: the sample after the last is the first one a period (s) later.
    Loop(&'a GroundTravel, f64),
    /// It is gone through once, in a frame at rest, and its last sample stays as it is.
    Once,
}

/// The links of every sample, in the travelling frame.
type LinkPoses = Vec<Vec<Isometry3<f64>>>;

/// Samples of a foot, first and last of every time in which it stands; in a loop from the number of samples on they are
/// those of the next cycle.
type Runs = Vec<[usize; 2]>;

impl Stretch<'_> {
    /// Has the feet that stand at the given times stand still, and on the ground where that is level and at `ground`
    /// (m), if they `may` be held. Tells of every link that stands, in the order of the links.
    pub(super) fn plant(
        &mut self,
        stances: &[StanceTime],
        ground: Option<f64>,
        may: impl Fn(&str) -> bool,
    ) -> Vec<StandingFoot> {
        let links = &self.skeleton.character.links;
        let poses = self.poses();
        let mut feet: Vec<(usize, Runs, StandingFoot)> = Vec::new();
        for (index, link) in links.iter().enumerate() {
            let own: Vec<&StanceTime> = stances.iter().filter(|stance| stance.link == link.name).collect();
            let mut runs = self.runs(&own);
            if own.is_empty() || link.collisions.is_empty() {
                continue;
            }
            if let (Course::Once, Some(ground)) = (&self.course, ground) {
                self.stand_to_the_end(&poses, index, &mut runs, ground);
            }
            let [slide, gap] = self.figures(&poses, index, &runs, ground);
            let stands = match self.course {
                Course::Loop(travel, _) => {
                    self.is_lifted(&runs) && slide <= self.stands_up_to(travel.speed(), &runs)
                }
                // Leading an entry to the loop has its feet slide, too.
                Course::Once => true,
            };
            let held = stands && may(&link.name) && self.can_be_moved();
            let mended = |simulated| Mended { simulated, exported: simulated };
            let foot = StandingFoot {
                link: link.name.clone(),
                stances: runs.len(),
                slide: mended(slide),
                gap: mended(gap),
                held,
            };
            feet.push((index, runs, foot));
        }
        let held: Vec<(usize, &Runs)> =
            feet.iter().filter(|(_, _, foot)| foot.held).map(|(link, runs, _)| (*link, runs)).collect();
        for _ in 0..ROUNDS {
            if self.lead_back(&held, ground) < NEAR {
                break;
            }
        }
        let poses = self.poses();
        for (link, runs, foot) in &mut feet {
            [foot.slide.exported, foot.gap.exported] = self.figures(&poses, *link, runs, ground);
        }
        feet.into_iter().map(|(_, _, foot)| foot).collect()
    }

    /// Whether inverse kinematics here keeps every closed chain closed.
    fn can_be_moved(&self) -> bool {
        let points = |kind| matches!(kind, LoopKind::Ball | LoopKind::Revolute);
        self.skeleton.character.loops.iter().all(|closed| points(closed.kind))
    }

    /// Whether a link that stands so in a loop ever leaves the ground.
    fn is_lifted(&self, runs: &Runs) -> bool {
        runs.iter().all(|[first, last]| last - first < self.times.len() - 1)
    }

    /// When a link with these stances stands, of two samples or more.
    fn runs(&self, stances: &[&StanceTime]) -> Runs {
        let count = self.times.len();
        let stands = |index: usize| {
            let time = self.times[index % count];
            stances.iter().any(|stance| (stance.start..=stance.end).contains(&time))
        };
        let swings = match self.course {
            // From a sample at which it does not stand, so that none is cut by the seam; all of them if there is none.
            Course::Loop(..) => match (0..count).find(|&index| !stands(index)) {
                None => return vec![[0, count]],
                Some(swings) => swings,
            },
            Course::Once => 0,
        };
        let mut runs: Runs = Vec::new();
        for index in (swings..swings + count).filter(|&index| stands(index)) {
            match runs.last_mut() {
                Some([_, last]) if *last + 1 == index => *last = index,
                _ => runs.push([index, index]),
            }
        }
        runs.retain(|[first, last]| last > first);
        runs
    }

    /// Has the last stance of a link in an entry last to the end if the link has hardly left the `ground` (m) by then: the loop, which
    /// is held by itself, goes on from a foot that is still down.
    fn stand_to_the_end(&self, poses: &LinkPoses, link: usize, runs: &mut Runs, ground: f64) {
        let end = self.times.len() - 1;
        let down = |index: usize| self.gap(poses, (link, index), Some(ground)) < LIFTED;
        if let Some([_, last]) = runs.last_mut()
            && (*last..=end).all(down)
        {
            *last = end;
        }
    }

    /// The greatest slide at which a link still stands, where the character travels at `speed` (m/s), rather than being
    /// dragged, m.
    fn stands_up_to(&self, speed: f64, runs: &Runs) -> f64 {
        let longest =
            runs.iter().map(|[first, last]| self.time(*last) - self.time(*first)).fold(0.0, f64::max);
        (DRAGGED * speed * longest).max(SLIPPED)
    }

    fn time(&self, index: usize) -> f64 {
        let count = self.times.len();
        match self.course {
            Course::Loop(_, period) => self.times[index % count] + (index / count) as f64 * period,
            Course::Once => self.times[index],
        }
    }

    /// The travelling frame at a sample of this cycle or the next.
    fn frame(&self, index: usize) -> Isometry3<f64> {
        let count = self.times.len();
        match self.course {
            Course::Loop(travel, _) if index < count => travel.frame(self.times[index]),
            Course::Loop(travel, period) => travel.frame(period) * travel.frame(self.times[index % count]),
            Course::Once => Isometry3::identity(),
        }
    }

    fn poses(&self) -> LinkPoses {
        let samples = self.roots.iter().zip(&self.angles);
        samples.map(|(root, angles)| self.skeleton.poses(root, angles)).collect()
    }

    /// How a link slides from each sample of a run to the next, world frame, m.
    fn slides(&self, poses: &LinkPoses, link: usize, [first, last]: [usize; 2]) -> Vec<Vector3<f64>> {
        let place = |index: usize| self.frame(index) * poses[index % poses.len()][link];
        let places: Vec<Isometry3<f64>> = (first..=last).map(place).collect();
        let shapes = &self.skeleton.character.links[link];
        places.windows(2).map(|pair| slide(shapes, &pair[0], &pair[1])).collect()
    }

    /// How high the lowest point of a link lies over the ground, m; 0 where that is not level.
    fn gap(&self, poses: &LinkPoses, (link, index): (usize, usize), ground: Option<f64>) -> f64 {
        let sole = sole(&self.skeleton.character.links[link], &poses[index % poses.len()][link]);
        ground.zip(sole).map_or(0.0, |(ground, sole)| sole.z - ground)
    }

    /// The longest slide and the greatest gap of a link over its stances, m.
    fn figures(&self, poses: &LinkPoses, link: usize, runs: &Runs, ground: Option<f64>) -> [f64; 2] {
        let slide = |run: &[usize; 2]| self.slides(poses, link, *run).iter().map(Vector3::norm).sum::<f64>();
        let gaps = runs.iter().flat_map(|[first, last]| *first..=*last);
        [
            runs.iter().map(slide).fold(0.0, f64::max),
            gaps.map(|index| self.gap(poses, (link, index), ground).abs()).fold(0.0, f64::max),
        ]
    }

    /// What has to be added to the places of a link, sample by sample, in the travelling frame, m.
    fn missing(
        &self,
        poses: &LinkPoses,
        (link, runs): (usize, &Runs),
        ground: Option<f64>,
    ) -> Vec<Vector3<f64>> {
        let count = self.times.len();
        let mut added = vec![Vector3::zeros(); count];
        for [first, last] in runs {
            let mut slid = vec![Vector3::zeros()];
            for step in self.slides(poses, link, [*first, *last]) {
                slid.push(slid[slid.len() - 1] + step);
            }
            // Half-way between the ends of its slide is where it stays. Samples that could not be brought there, since a
            // joint is at its limit, draw that place to themselves with every round.
            let lowest = slid.iter().fold(slid[0], |lowest, slid| lowest.inf(slid));
            let highest = slid.iter().fold(slid[0], |highest, slid| highest.sup(slid));
            let middle = match self.course {
                Course::Once if *last == count - 1 => slid[slid.len() - 1],
                Course::Loop(..) | Course::Once => (lowest + highest) / 2.0,
            };
            for (index, slid) in (*first..=*last).zip(&slid) {
                let up = Vector3::z() * self.gap(poses, (link, index), ground);
                added[index % count] = self.frame(index).rotation.inverse() * (middle - slid) - up;
            }
        }
        for (run, [_, from]) in runs.iter().enumerate() {
            let next = runs.get(run + 1).map(|[next, _]| *next);
            let (to, at_rest) = match self.course {
                Course::Loop(..) => (next.unwrap_or(runs[0][0] + count), false),
                Course::Once => (next.unwrap_or(count - 1), next.is_none()),
            };
            if *from < to {
                self.add_between(&mut added, [*from, to], at_rest);
            }
        }
        if let (Course::Once, Some([first, _])) = (&self.course, runs.first()) {
            let (before, after) = added.split_at_mut(*first);
            before.fill(after[0]);
        }
        added
    }

    /// Fills what is added between two stances, from the end of one to the start of the next, where it goes over smoothly; where
    /// nothing follows it comes to rest at nothing.
    fn add_between(&self, added: &mut [Vector3<f64>], [from, to]: [usize; 2], at_rest: bool) {
        let count = added.len();
        let (start, end) = (self.time(from), self.time(to));
        let at = |index: usize| added[index % count];
        let rate = |one: usize, other: usize| (at(other) - at(one)) / (self.time(other) - self.time(one));
        let last = if at_rest { (Vector3::zeros(), Vector3::zeros()) } else { (at(to), rate(to, to + 1)) };
        let ends = [(at(from), rate(from - 1, from)), last];
        let until = if at_rest { to + 1 } else { to };
        let between: Vec<_> = (from + 1..until)
            .map(|index| {
                let part = |axis: usize| {
                    let [one, other] = ends.map(|(value, rate)| (value[axis], rate[axis]));
                    hermite(one, other, end - start, self.time(index) - start)
                };
                (index % count, Vector3::from_fn(|axis, _| part(axis)))
            })
            .collect();
        between.into_iter().for_each(|(index, value)| added[index] = value);
    }

    /// Leads the held feet back; the most by which one was off.
    fn lead_back(&mut self, held: &[(usize, &Runs)], ground: Option<f64>) -> f64 {
        let all = self.poses();
        let added: Vec<_> = held.iter().map(|&foot| self.missing(&all, foot, ground)).collect();
        let links = &self.skeleton.character.links;
        for (index, poses) in all.iter().enumerate() {
            let target = |(&(link, _), added): (&(usize, &Runs), &Vec<Vector3<f64>>)| {
                let sole = sole(&links[link], &poses[link])?;
                let point = poses[link].inverse() * sole;
                Some(PointTarget { link, point, place: sole + added[index] })
            };
            let targets: Vec<PointTarget> = held.iter().zip(&added).filter_map(target).collect();
            let pairs: Vec<PointPair> = self
                .skeleton
                .character
                .loops
                .iter()
                .map(|closed| {
                    let points = closed.frames.map(|frame| frame.translation.vector.into());
                    let [from, to] = [0, 1].map(|end| poses[closed.links[end]] * points[end]);
                    PointPair { links: closed.links, points, apart: to - from }
                })
                .collect();
            let pose = Pose { root: &mut self.roots[index], angles: &mut self.angles[index] };
            reach(self.skeleton, pose, &targets, &pairs);
        }
        added.iter().flatten().map(Vector3::norm).fold(0.0, f64::max)
    }
}
