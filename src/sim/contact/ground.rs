//! Contact with a horizontal plane.

use nalgebra::Vector3;

use super::{Against, Touch};
use crate::model::{CYLINDER_SLOTS, GroundShape, Model, Surface};
use crate::sim::reduced::kinematics::BodyMotion;

/// Normal and tangents of a horizontal plane.
const FRAME: [Vector3<f64>; 3] =
    [Vector3::new(0.0, 0.0, 1.0), Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];

/// A corner-only shape of more corners than this is represented by its deepest and widest four.
const CORNERS_KEPT_WHOLE: usize = 8;

/// Finds all touches of the ground at `height` above the common point (m, normally negative), in the
/// order of the model's slots.
///
/// A point in the air is a touch when it can reach the ground within two steps of `step` seconds
/// at its present velocity and under `gravity` (m/s²): its row then stops it on the ground instead of
/// in it. With `anticipate` off only points at or below the surface are touches.
pub fn detect(
    model: &Model,
    bodies: &[BodyMotion],
    height: f64,
    step: f64,
    gravity: f64,
    anticipate: bool,
    touches: &mut Vec<Touch>,
) {
    touches.clear();
    let falling = 4.0 * step * step * gravity;
    for shape in &model.ground_shapes {
        if model.fixed_base && shape.body == 0 {
            continue;
        }
        let body = &bodies[shape.body];
        let margin = |at: Vector3<f64>| {
            if anticipate { falling + 2.0 * step * (-body.velocity.at(at).z).max(0.0) } else { 0.0 }
        };
        let lowest = body.point(shape.center).z - shape.reach - height;
        if anticipate {
            // The fastest point of the shape is no faster than its centre plus the ball's rim.
            let rim = body.velocity.angular.norm() * shape.reach;
            if lowest > margin(body.point(shape.center)) + 2.0 * step * rim {
                continue;
            }
        } else if lowest > 0.0 {
            continue;
        }
        let mut add = |slot: usize, at: Vector3<f64>| {
            let depth = height - at.z;
            if depth >= -margin(at) {
                let against = Against::Ground;
                touches.push(Touch {
                    slot,
                    link: shape.link,
                    body: shape.body,
                    against,
                    at,
                    frame: FRAME,
                    depth,
                });
            }
        };
        match shape.surface {
            Surface::Points { first, count, radius } => {
                let start = shape.first_slot;
                let drop = Vector3::new(0.0, 0.0, radius);
                for index in 0..count {
                    add(start + index, body.point(model.ground_points[first + index]) - drop);
                }
                if count > CORNERS_KEPT_WHOLE {
                    let kept =
                        touches.iter().rposition(|touch| touch.slot < start).map_or(0, |last| last + 1);
                    keep_four(touches, kept);
                }
            }
            Surface::Cylinder { axis, across, radius, half_length } => {
                let points = rim_points(body, shape, axis, across, radius, half_length);
                for (index, at) in points.into_iter().enumerate() {
                    add(shape.first_slot + index, at);
                }
            }
        }
    }
}

/// The lowest point of each rim and the two points a third of a turn away from it.
fn rim_points(
    body: &BodyMotion,
    shape: &GroundShape,
    axis: Vector3<f64>,
    across: Vector3<f64>,
    radius: f64,
    half_length: f64,
) -> [Vector3<f64>; CYLINDER_SLOTS] {
    let axis = body.rotation * axis;
    let downward = axis * axis.z - Vector3::z();
    let steepness = downward.norm();
    // An upright cylinder has no lowest point of its rim; any direction that turns with it will do.
    let lowest = if steepness > 1e-9 { downward / steepness } else { body.rotation * across };
    let sideways = axis.cross(&lowest);
    let center = body.point(shape.center);
    let third = 3.0_f64.sqrt() / 2.0;
    let rim = [lowest, sideways * third - lowest * 0.5, -sideways * third - lowest * 0.5];
    let mut points = [center; CYLINDER_SLOTS];
    for (end, direction) in [axis * half_length, -axis * half_length].into_iter().enumerate() {
        for (corner, rim) in rim.iter().enumerate() {
            points[3 * end + corner] += direction + rim * radius;
        }
    }
    points
}

/// Keeps of the touches from index `from` on the deepest, the one farthest from it, the one
/// farthest from the line through both, and the farthest on that line's other side.
fn keep_four(touches: &mut Vec<Touch>, from: usize) {
    let candidates = &touches[from..];
    if candidates.len() <= 4 {
        return;
    }
    let flat = |touch: &Touch| nalgebra::Vector2::new(touch.at.x, touch.at.y);
    let best = |score: &dyn Fn(&Touch) -> f64| {
        let mut winner = 0;
        for index in 1..candidates.len() {
            if score(&candidates[index]) > score(&candidates[winner]) {
                winner = index;
            }
        }
        winner
    };
    let deepest = best(&|touch| touch.depth);
    let origin = flat(&candidates[deepest]);
    let farthest = best(&|touch| (flat(touch) - origin).norm_squared());
    let line = flat(&candidates[farthest]) - origin;
    let side = |touch: &Touch| line.perp(&(flat(touch) - origin));
    let mut kept = [deepest, farthest, best(&side), best(&|touch| -side(touch))];
    kept.sort_unstable();
    let mut end = from;
    for (position, index) in kept.into_iter().enumerate() {
        if position == 0 || kept[position - 1] != index {
            touches[end] = touches[from + index];
            end += 1;
        }
    }
    touches.truncate(end);
}
