//! Contact with the ground.

use multiversion::multiversion;
use nalgebra::Vector3;

use super::field;
use super::{Against, Outlook, Touch, keep_four};
use crate::model::{CYLINDER_SLOTS, GroundShape, Model, Surface};
use crate::scene::Terrain;
use crate::sim::reduced::kinematics::BodyMotion;

/// Normal and tangents of a horizontal plane.
const FRAME: [Vector3<f64>; 3] =
    [Vector3::new(0.0, 0.0, 1.0), Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];

/// A corner-only shape of more corners than this is represented by its deepest and widest four.
const CORNERS_KEPT_WHOLE: usize = 8;

/// Adds all touches of `ground` to `touches`, in the order of the model's slots. `origin` is the common
/// point in the world.
#[multiversion(targets("x86_64+avx2"))]
pub fn detect(
    model: &Model,
    bodies: &[BodyMotion],
    ground: &Terrain,
    origin: Vector3<f64>,
    outlook: &Outlook,
    touches: &mut Vec<Touch>,
) {
    let highest = ground.highest() - origin.z;
    let mut present = usize::MAX;
    let (mut moving, mut turning) = (0.0, 0.0);
    for shape in &model.ground_shapes {
        if model.fixed_base && shape.body == 0 {
            continue;
        }
        let body = &bodies[shape.body];
        if shape.body != present {
            present = shape.body;
            // Sums are no less than the norms and take no roots.
            moving = body.velocity.at(body.origin).abs().sum();
            turning = body.velocity.angular.abs().sum();
        }
        // No point of the shape is faster than its body's origin and the turn of the farthest point about that.
        let farthest = outlook.margin(moving + turning * shape.farthest);
        let center = body.origin.z + (body.rotation.row(2) * shape.center)[0];
        if center - shape.reach - highest > farthest {
            continue;
        }
        let from = touches.len();
        let mut add = |slot: usize, frame: [Vector3<f64>; 3], at: Vector3<f64>, gap: f64| {
            let approach = -frame[0].dot(&body.velocity.at(at));
            if gap <= outlook.margin(approach) {
                touches.push(Touch {
                    slot,
                    link: shape.link,
                    body: shape.body,
                    against: Against::Ground,
                    at,
                    frame,
                    depth: -gap,
                    rebound: outlook.rebound(approach),
                });
            }
        };
        let mut meet = |slot: usize, middle: Vector3<f64>, radius: f64| match ground {
            Terrain::Plane { height } => {
                let at = middle - Vector3::new(0.0, 0.0, radius);
                add(slot, FRAME, at, at.z - (height - origin.z));
            }
            Terrain::Field(heights) => {
                let velocity = body.velocity.at(middle);
                field::meet(heights, middle + origin, radius, velocity, outlook, |spot| {
                    add(slot, spot.frame, middle - spot.frame[0] * radius, spot.gap);
                });
            }
        };
        match shape.surface {
            Surface::Points { first, count, radius } => {
                let upright = body.rotation.row(2);
                let lowest = highest + farthest + radius - body.origin.z;
                for (index, point) in model.ground_points[first..first + count].iter().enumerate() {
                    // Most corners are too high whatever their speed.
                    if upright[0] * point.x + upright[1] * point.y + upright[2] * point.z <= lowest {
                        meet(shape.first_slot + index, body.point(*point), radius);
                    }
                }
                if count > CORNERS_KEPT_WHOLE {
                    keep_four(touches, from);
                }
            }
            Surface::Cylinder { axis, across, radius, half_length } => {
                let points = rim_points(body, shape, axis, across, radius, half_length);
                for (index, at) in points.into_iter().enumerate() {
                    meet(shape.first_slot + index, at, 0.0);
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
