//! Biovision hierarchy: every link a joint, one cycle of the loop.

use std::fmt::Write;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::sampled::SampledMotion;
use super::up::y_up;
use gaitwright_physics::character::JointKind;

/// Length of the bone drawn at the end of a limb whose link has no extent, m.
const SHORTEST_BONE: f64 = 0.02;

/// Axes are y up and z forward, lengths metres, angles degrees in the order `Zrotation Xrotation Yrotation`. A joint's
/// frame is its link's, so that the pose of every link follows from the file alone; links that slide have position
/// channels and an offset of 0. The last frame is the first one a cycle later.
pub(super) fn write(sampled: &SampledMotion<'_>, in_place: bool) -> String {
    let mut text = "HIERARCHY\n".to_owned();
    let mut order = Vec::new();
    joint(&mut text, sampled, 0, 0, &mut order);
    let frames = &sampled.cycle.frames;
    // Writing to a string cannot fail.
    let _ = write!(text, "MOTION\nFrames: {}\nFrame Time: {:.9}\n", frames.len(), sampled.cycle.interval());
    let mut before = vec![[0.0; 3]; order.len()];
    for frame in frames {
        let mut numbers = Vec::new();
        for (&link, angles) in order.iter().zip(&mut before) {
            let local = if link == 0 {
                Isometry3::from_parts(Default::default(), y_up()) * frame.placed_root(in_place)
            } else {
                sampled.skeleton.local(link, &frame.angles)
            };
            if has_position(sampled, link) {
                numbers.extend(local.translation.vector.iter().map(|x| format!("{x:.7}")));
            }
            *angles = nearest(euler(&local.rotation), *angles);
            numbers.extend(angles.iter().map(|angle| format!("{:.6}", angle.to_degrees())));
        }
        text += &numbers.join(" ");
        text.push('\n');
    }
    text
}

/// Writes a link and all that it carries, and adds them to `order`, which is that of the channels.
fn joint(text: &mut String, sampled: &SampledMotion<'_>, link: usize, depth: usize, order: &mut Vec<usize>) {
    order.push(link);
    let (indent, inner) = ("  ".repeat(depth), "  ".repeat(depth + 1));
    let own = &sampled.skeleton.character.links[link];
    let kind = if link == 0 { "ROOT" } else { "JOINT" };
    let name: String =
        own.name.chars().map(|letter| if letter.is_whitespace() { '_' } else { letter }).collect();
    let offset = match &own.joint {
        Some(joint) if !has_position(sampled, link) => joint.origin.translation.vector,
        _ => Vector3::zeros(),
    };
    let channels = if has_position(sampled, link) { "6 Xposition Yposition Zposition" } else { "3" };
    let _ = write!(
        text,
        "{indent}{kind} {name}\n{indent}{{\n{inner}OFFSET {}\n{inner}CHANNELS {channels} Zrotation Xrotation Yrotation\n",
        vector(&offset)
    );
    let mut carries = false;
    for child in sampled.skeleton.children(link) {
        carries = true;
        joint(text, sampled, child, depth + 1, order);
    }
    if !carries {
        let center = own.inertial.as_ref().map(|inertial| inertial.center_of_mass.coords);
        let shape = own.collisions.first().map(|placed| placed.pose.translation.vector);
        let end = center.or(shape).map(|middle| middle * 2.0).filter(|end| end.norm() >= SHORTEST_BONE);
        let end = vector(&end.unwrap_or(Vector3::new(0.0, 0.0, -SHORTEST_BONE)));
        let _ = write!(text, "{inner}End Site\n{inner}{{\n{inner}  OFFSET {end}\n{inner}}}\n");
    }
    let _ = writeln!(text, "{indent}}}");
}

fn has_position(sampled: &SampledMotion<'_>, link: usize) -> bool {
    let joint = &sampled.skeleton.character.links[link].joint;
    joint.as_ref().is_none_or(|joint| joint.kind == JointKind::Prismatic)
}

fn vector(v: &Vector3<f64>) -> String {
    format!("{:.7} {:.7} {:.7}", v.x, v.y, v.z)
}

/// Angles z, x, y with R = R_z R_x R_y, rad.
fn euler(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let r = rotation.to_rotation_matrix();
    let r = r.matrix();
    let x = r[(2, 1)].clamp(-1.0, 1.0).asin();
    if x.cos() > 1e-6 {
        [(-r[(0, 1)]).atan2(r[(1, 1)]), x, (-r[(2, 0)]).atan2(r[(2, 2)])]
    } else {
        // z and y turn about one axis: all of it is given to z.
        [r[(1, 0)].atan2(r[(0, 0)]), x, 0.0]
    }
}

/// The angles of the same rotation that are nearest to `before`, so that a player that blends frames takes the short
/// way.
fn nearest([z, x, y]: [f64; 3], before: [f64; 3]) -> [f64; 3] {
    use std::f64::consts::{PI, TAU};
    let near = |angles: [f64; 3]| {
        let mut near = angles;
        for (angle, before) in near.iter_mut().zip(before) {
            *angle -= TAU * ((*angle - before) / TAU).round();
        }
        near
    };
    let distance = |angles: &[f64; 3]| angles.iter().zip(before).map(|(a, b)| (a - b).abs()).sum::<f64>();
    let (one, other) = (near([z, x, y]), near([z + PI, PI - x, y + PI]));
    if distance(&other) < distance(&one) { other } else { one }
}
