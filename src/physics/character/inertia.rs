//! Repairs inertias that cannot be simulated as given, and keeps all others.
//!
//! Links joined by fixed joints move as one rigid body, and only the inertia of that body enters the
//! equations of motion. So a link without mass, or with the inertia of a point or a rod, is harmless as
//! long as its body as a whole has a positive definite inertia; it is then kept as it is, so that
//! results can be compared with other programs'. Otherwise it is repaired.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::draft::Diagnostics;
use super::solid::{Solid, parallel_axis};
use super::{About, Inertial, JointKind, Link, NoteKind};

/// Below this ratio of the smallest to the greatest principal moment, an inertia counts as singular.
const SINGULAR: f64 = 1e-12;
/// A smallest principal moment below zero by at most this share of the greatest counts as the rounding of printed
/// digits; by more, the inertia is indefinite.
const ROUNDING: f64 = 1e-6;
/// Water: the density of a ball that stands for a link of which only the mass is known, kg/m³.
const DENSITY: f64 = 1000.0;
/// A massless body at the end of a movable joint gets this share of the total mass and, as its radius of
/// gyration, `LEAST_RADIUS` of the character's size. The mass matrix then has a condition number of at
/// most some 1e8, half of the digits of double precision.
const LEAST_MASS: f64 = 1e-5;
const LEAST_RADIUS: f64 = 0.03;

/// For every link, the first link of the rigid body it belongs to and its frame in that link's frame.
pub fn bodies(links: &[Link]) -> Vec<(usize, Isometry3<f64>)> {
    let mut bodies: Vec<(usize, Isometry3<f64>)> = Vec::with_capacity(links.len());
    for (index, link) in links.iter().enumerate() {
        let body = match &link.joint {
            Some(joint) if joint.kind == JointKind::Fixed => {
                let (first, pose) = bodies[joint.parent];
                (first, pose * joint.origin)
            }
            _ => (index, Isometry3::identity()),
        };
        bodies.push(body);
    }
    bodies
}

/// Repairs inertias where necessary, so that every rigid body has a positive mass and a positive definite
/// inertia. `places` are the places of the links. At least one link has a mass.
pub fn repair_all(links: &mut [Link], places: &[String], diagnostics: &mut Diagnostics) {
    let singular: Vec<bool> =
        (0..links.len()).map(|index| is_singular(&mut links[index], &places[index], diagnostics)).collect();
    let bodies = bodies(links);
    let total: f64 = links.iter().filter_map(|link| link.inertial.as_ref()).map(|it| it.mass).sum();
    let size = size(links);
    for first in 0..links.len() {
        if bodies[first].0 != first {
            continue;
        }
        let members: Vec<usize> = (first..links.len()).filter(|link| bodies[*link].0 == first).collect();
        let body = composite(members.iter().map(|link| (&links[*link], &bodies[*link].1)));
        let about = |link: usize, links: &[Link]| About::Link(links[link].name.clone());
        let Some(body) = body else {
            let mass = LEAST_MASS * total;
            let rotational_inertia =
                rotational_inertia(members.iter().map(|link| (&links[*link], &bodies[*link].1)));
            let own = links[first].inertial.take();
            let message = if smallest_ratio(&rotational_inertia) > SINGULAR {
                let center_of_mass = own.as_ref().map_or(Point3::origin(), |own| own.center_of_mass);
                let inertia = own.map_or(Matrix3::zeros(), |own| own.inertia);
                links[first].inertial = Some(Inertial { mass, center_of_mass, inertia });
                format!(
                    "has an inertia but no mass, nor has any link fixed to it; it is given {mass:.3e} kg so that it can be \
                     simulated, and the inertia is kept as given"
                )
            } else {
                let inertia = Matrix3::identity() * (mass * (LEAST_RADIUS * size).powi(2));
                links[first].inertial = Some(Inertial { mass, center_of_mass: Point3::origin(), inertia });
                format!(
                    "has no mass, nor has any link fixed to it; it is given {mass:.3e} kg so that it can be simulated"
                )
            };
            diagnostics.note(places[first].as_str(), about(first, links), NoteKind::Repaired, message);
            continue;
        };
        let sound = smallest_ratio(&body.inertia) > SINGULAR;
        for &link in &members {
            if links[link].inertial.as_ref().is_some_and(|inertial| inertial.mass <= 0.0) {
                let message = "has an inertia but no mass; both are kept as given";
                diagnostics.note(places[link].as_str(), about(link, links), NoteKind::Kept, message);
            } else if links[link].inertial.is_none() {
                let message = "has no mass; it is carried by the links fixed to it";
                diagnostics.note(places[link].as_str(), about(link, links), NoteKind::Ignored, message);
            } else if singular[link] && sound {
                let message = "its inertia is singular; it is kept as given, \
                               since the links fixed to it make the inertia of the whole positive definite";
                diagnostics.note(places[link].as_str(), about(link, links), NoteKind::Kept, message);
            } else if singular[link] {
                repair(&mut links[link], &places[link], "singular", diagnostics);
            }
        }
    }
}

/// Whether the link's inertia is singular. An indefinite one is repaired, a doubtful one noted.
fn is_singular(link: &mut Link, place: &str, diagnostics: &mut Diagnostics) -> bool {
    let Some(inertial) = &link.inertial else { return false };
    let mut moments: [f64; 3] = inertial.inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    let [least, middle, most] = moments;
    if least < -ROUNDING * most.abs() {
        repair(link, place, "not positive definite", diagnostics);
        return false;
    }
    if least <= SINGULAR * most {
        return true;
    }
    if least + middle < most * (1.0 - ROUNDING) {
        let message = format!(
            "its principal moments of inertia ({least:.4e}, {middle:.4e}, {most:.4e} kg m²) break the triangle \
             inequality, which no rigid body does; they are kept as given"
        );
        diagnostics.note(place, About::Link(link.name.clone()), NoteKind::Kept, message);
    }
    false
}

/// Replaces the inertia by that of the link's collision shapes filled evenly with its mass, or by that
/// of a ball where it has none.
fn repair(link: &mut Link, place: &str, fault: &str, diagnostics: &mut Diagnostics) {
    let Some(inertial) = &mut link.inertial else { return };
    let solid = Solid::of_all(&link.collisions)
        .map(|solid| solid.inertia * (inertial.mass / solid.volume))
        .filter(|inertia| smallest_ratio(inertia) > SINGULAR);
    let what = if solid.is_some() { "its collision shapes" } else { "a ball of its mass" };
    inertial.inertia = solid.unwrap_or_else(|| ball(inertial.mass));
    let message = format!("its inertia is {fault}; it is replaced by that of {what}");
    diagnostics.note(place, About::Link(link.name.clone()), NoteKind::Repaired, message);
}

/// Radius of a ball of water of `mass` kg, m.
pub fn ball_radius(mass: f64) -> f64 {
    (0.75 * mass / (PI * DENSITY)).cbrt()
}

fn ball(mass: f64) -> Matrix3<f64> {
    Matrix3::identity() * (0.4 * mass * ball_radius(mass).powi(2))
}

/// The smallest principal moment over the greatest; 0 for a matrix of zeros.
fn smallest_ratio(inertia: &Matrix3<f64>) -> f64 {
    let moments = inertia.symmetric_eigenvalues();
    if moments.max() > 0.0 { moments.min() / moments.max() } else { 0.0 }
}

/// The inertia of links fixed to each other, each with its frame in their common frame; `None` without
/// mass.
fn composite<'a>(members: impl Iterator<Item = (&'a Link, &'a Isometry3<f64>)> + Clone) -> Option<Inertial> {
    let parts = members.filter_map(|(link, pose)| link.inertial.as_ref().map(|inertial| (inertial, pose)));
    let mass: f64 = parts.clone().map(|(part, _)| part.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let first: Vector3<f64> =
        parts.clone().map(|(part, pose)| (pose * part.center_of_mass).coords * part.mass).sum();
    let center_of_mass = Point3::from(first / mass);
    let inertia = parts
        .map(|(part, pose)| {
            let rotation = pose.rotation.to_rotation_matrix();
            let offset = pose * part.center_of_mass - center_of_mass;
            rotation * part.inertia * rotation.transpose() + parallel_axis(part.mass, offset)
        })
        .fold(Matrix3::zeros(), |sum, inertia| sum + inertia);
    Some(Inertial { mass, center_of_mass, inertia })
}

/// Sum of the rotational inertias of links fixed to each other, along the axes of their common frame and without the
/// parallel-axis terms of their masses.
fn rotational_inertia<'a>(members: impl Iterator<Item = (&'a Link, &'a Isometry3<f64>)>) -> Matrix3<f64> {
    let inertias = members.filter_map(|(link, pose)| {
        let rotation = pose.rotation.to_rotation_matrix();
        link.inertial.as_ref().map(|inertial| rotation * inertial.inertia * rotation.transpose())
    });
    inertias.fold(Matrix3::zeros(), |sum, inertia| sum + inertia)
}

/// The diagonal of the box around all link frames and centres of mass with every joint at 0, m; never
/// less than 1 mm.
pub fn size(links: &[Link]) -> f64 {
    let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(links.len());
    let mut low = Vector3::zeros();
    let mut high = Vector3::zeros();
    for link in links {
        let pose =
            link.joint.as_ref().map_or(Isometry3::identity(), |joint| poses[joint.parent] * joint.origin);
        let center = link.inertial.as_ref().map_or(Point3::origin(), |inertial| inertial.center_of_mass);
        for point in [pose.translation.vector, (pose * center).coords] {
            low = low.inf(&point);
            high = high.sup(&point);
        }
        poses.push(pose);
    }
    (high - low).norm().max(1e-3)
}
