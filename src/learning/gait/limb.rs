//! How far a leg is extended: the distance from its hip to its foot over the greatest that its joints allow.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::foot::FootShape;
use super::footfall::Footing;
use super::stride::mean;
use gaitwright_physics::model::{Body, DofKind, Model};
use gaitwright_physics::playback::Trace;

/// A segment shorter than this share of the leg's longest one belongs to the hip: it only turns the leg out.
const SHORT: f64 = 0.5;
/// A leg is sprawled from this share of sideways distance over height between hip and foot on, about 27°.
const SPRAWLED: f64 = 0.5;
/// Thickness of a sole, share of the leg's length.
pub(crate) const SOLE: f64 = 0.02;
/// Rounds in which one joint after the other is turned to where the leg is longest.
const ROUNDS: usize = 20;

/// A leg from the hip, where its long segments begin, to the foot.
#[derive(Debug, Clone)]
pub(super) struct Limb {
    /// The link whose origin is the hip.
    pub(super) hip: usize,
    /// The link with the foot, and the point in its frame on which the leg stands, m.
    foot: (usize, Point3<f64>),
    /// The greatest distance from hip to foot within the ranges of motion, m.
    greatest: f64,
    /// Whether it is [`sprawled`] in the standing pose.
    pub(super) sprawled: bool,
}

impl Limb {
    /// The leg that stands on the link `support`; `None` where no joint carries it. `standing` are the world frames of all
    /// links in the standing pose.
    pub(super) fn of(model: &Model, support: usize, standing: &[Isometry3<f64>]) -> Option<Self> {
        let place = model.links.get(support)?;
        let children =
            |parent: usize| model.bodies.iter().skip(1).filter(|body| body.parent == parent).count();
        let mut chain = vec![place.body];
        while let Some(&first) = chain.last() {
            if first == 0 {
                return None;
            }
            let parent = model.bodies[first].parent;
            if parent == 0 || children(parent) != 1 {
                break;
            }
            chain.push(parent);
        }
        chain.reverse();

        let first_link = |body: usize| model.links.iter().position(|place| place.body == body);
        let frames = chain
            .iter()
            .map(|&body| Some((first_link(body)?, *standing.get(first_link(body)?)?)))
            .collect::<Option<Vec<_>>>()?;
        let ground_frame = standing.get(support)?;
        let shape = FootShape::of(&model.character.links[support]);
        let size = (frames.first()?.1.translation.vector.z - shape.lowest(ground_frame)).abs();
        let point = shape.sole(ground_frame, SOLE * size);

        let mut joints: Vec<Vector3<f64>> =
            frames.iter().map(|(_, frame)| frame.translation.vector).collect();
        joints.push((ground_frame * point).coords);
        let segments: Vec<f64> = joints.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let first_long = first_long(&segments);
        let distal: Vec<usize> = chain[first_long + 1..].to_vec();
        let greatest = greatest_reach(model, &distal, place.pose * point);
        let hip = frames[first_long];
        let sprawled = sprawled(&((ground_frame * point).coords - hip.1.translation.vector));
        (greatest > 0.0).then_some(Self { hip: hip.0, foot: (support, point), greatest, sprawled })
    }

    /// Share of its greatest length to which the leg is extended in the middle of a stance, mean over the whole stances in
    /// `trace`, 0 to 1; `None` without one.
    pub(super) fn extension(&self, trace: &Trace, footing: &Footing) -> Option<f64> {
        let last = trace.samples.len();
        let shares: Vec<f64> = footing
            .stances()
            .into_iter()
            .filter(|&[from, to]| from > 0 && to < last)
            .filter_map(|[from, to]| {
                let poses = &trace.samples.get((from + to) / 2)?.link_poses;
                let (link, point) = self.foot;
                let away = poses.get(link)? * point - Point3::from(poses.get(self.hip)?.translation.vector);
                Some(away.norm() / self.greatest)
            })
            .collect();
        mean(&shares)
    }
}

/// Whether a leg stands with its foot beside its hip, as a lizard's or a spider's does, rather than below it; `leg` leads from the
/// hip to the foot in the standing pose, z up. Such legs keep their knees bent.
pub(crate) fn sprawled(leg: &Vector3<f64>) -> bool {
    leg.xy().norm() > SPRAWLED * leg.z.abs()
}

/// Index of the first of a leg's `segments` (lengths from the trunk on, m) that does not belong to the hip.
pub(crate) fn first_long(segments: &[f64]) -> usize {
    let longest = segments.iter().copied().fold(0.0, f64::max);
    segments.iter().position(|segment| *segment > SHORT * longest).unwrap_or(0)
}

/// The greatest distance, m, of `foot`, a point in the frame of the last of the bodies `distal` (each the parent of the
/// next), from the origin of the body that carries the first of them, over the ranges of motion of their joints.
///
/// With all other joints still, the square of the distance is a + b cos q + c sin q in a revolute joint's angle q, so that
/// the best angle is known; the joints are turned one after the other until nothing is gained, from several starts.
pub(crate) fn greatest_reach(model: &Model, distal: &[usize], foot: Point3<f64>) -> f64 {
    let limits: Vec<Option<[f64; 2]>> = distal.iter().map(|&body| model.limits[body - 1]).collect();
    let bodies: Vec<&Body> = distal.iter().map(|&body| &model.bodies[body]).collect();
    let starts = [0.0, 0.5, 1.0].map(|share| -> Vec<f64> {
        limits
            .iter()
            .map(|limits| limits.map_or(share - 0.5, |[lower, upper]| lower + share * (upper - lower)))
            .collect()
    });
    let mut greatest: f64 = 0.0;
    for mut angles in starts {
        for _ in 0..ROUNDS {
            for joint in 0..angles.len() {
                let (axis, origin, end) = placed(&bodies, &angles, foot, joint);
                let candidates = match bodies[joint].dof {
                    DofKind::Revolute => {
                        let arm = end - origin;
                        let across = arm - axis * axis.dot(&arm);
                        let best = angles[joint] + origin.dot(&axis.cross(&arm)).atan2(origin.dot(&across));
                        let turns = [-1.0, 0.0, 1.0].map(|turn| best + std::f64::consts::TAU * turn);
                        [&turns[..], &limits[joint].unwrap_or([best; 2])].concat()
                    }
                    DofKind::Prismatic => limits[joint].map_or(vec![angles[joint]], |ends| ends.to_vec()),
                };
                let allowed =
                    |angle: &f64| limits[joint].is_none_or(|[lower, upper]| (lower..=upper).contains(angle));
                let length = |angle: f64| {
                    let mut angles = angles.clone();
                    angles[joint] = angle;
                    placed(&bodies, &angles, foot, joint).2.norm()
                };
                let longest =
                    candidates.into_iter().filter(allowed).max_by(|a, b| length(*a).total_cmp(&length(*b)));
                angles[joint] = longest.unwrap_or(angles[joint]);
            }
        }
        let reached = match bodies.is_empty() {
            true => foot.coords.norm(),
            false => placed(&bodies, &angles, foot, 0).2.norm(),
        };
        greatest = greatest.max(reached);
    }
    greatest
}

/// Axis and origin of the joint of `bodies[joint]`, and the foot, with the joints at `angles`, in the frame of the body that
/// carries the first.
fn placed(
    bodies: &[&Body],
    angles: &[f64],
    foot: Point3<f64>,
    joint: usize,
) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let mut frame = (Matrix3::identity(), Vector3::zeros());
    let (mut axis, mut at) = (Vector3::zeros(), Vector3::zeros());
    for (index, (body, &angle)) in bodies.iter().zip(angles).enumerate() {
        frame = body.carried_by(frame, angle);
        if index == joint {
            (axis, at) = (frame.0 * body.axis, frame.1);
        }
    }
    let (rotation, origin) = frame;
    (axis, at, origin + rotation * foot.coords)
}
