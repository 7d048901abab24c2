//! Replacement shapes for collision meshes that are not supplied.
//!
//! A link gets the box of even density that has its mass and inertia, shrunk by a tenth: for a rod with heavy ends
//! that box is longer than the rod, and it must not overlap the shapes of the neighbouring links. At the end of a
//! limb a small ball is added as its foot.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::draft::{At, Diagnostics};
use super::{About, Inertial, Link, NoteKind, Placed, Shape, inertia};

/// What remains of the fitted box along each edge.
const SHRUNK_TO: f64 = 0.9;
/// No edge of a fitted box is shorter than this part of its longest.
const THINNEST: f64 = 0.05;
/// Radius of a foot over its distance from the joint that moves it.
const FOOT: f64 = 0.1;

/// Gives every link with `missing` collision meshes a shape in their stead where one can be found.
pub fn add(links: &mut [Link], missing: &[Vec<At<String>>], diagnostics: &mut Diagnostics) {
    let bodies = inertia::bodies(links);
    let size = inertia::size(links);
    let mut has_child = vec![false; links.len()];
    for joint in links.iter().filter_map(|link| link.joint.as_ref()) {
        has_child[joint.parent] = true;
    }
    for (index, missing) in missing.iter().enumerate() {
        let Some(At { place, .. }) = missing.first() else { continue };
        let (body, pose) = &bodies[index];
        let link = &mut links[index];
        let mut instead = Vec::new();
        let fitted = massive(link).map(fitted_box);
        if let Some(fitted) = &fitted {
            if let Shape::Box { half_extents } = fitted.shape {
                let [x, y, z] = half_extents.map(|half| half * 200.0).into();
                instead.push(format!("a box of {x:.1} x {y:.1} x {z:.1} cm fitted to its inertia"));
            }
            link.collisions.push(fitted.clone());
        }
        if *body != 0 && !has_child[index] {
            let joint = pose.inverse() * Point3::origin();
            let center = massive(link).map(|inertial| inertial.center_of_mass);
            let foot = foot(&joint, center, fitted.as_ref(), size);
            if let Shape::Sphere { radius } = foot.shape {
                instead.push(format!("a ball of {:.1} cm radius at its far end", radius * 100.0));
            }
            link.collisions.push(foot);
        }
        let why = missing.iter().map(|missing| missing.value.as_str()).collect::<Vec<_>>().join(", ");
        let how = if instead.is_empty() {
            "the link has no mass to fit a shape to and touches nothing there".to_owned()
        } else {
            format!("replaced by {}", instead.join(" and "))
        };
        let about = About::Link(link.name.clone());
        diagnostics.note(place.as_str(), about, NoteKind::Approximated, format!("{why}; {how}"));
    }
}

/// The box of even density with this mass and inertia, shrunk by [`SHRUNK_TO`]. Its edges follow from the principal
/// moments, a² = 6 (I_b + I_c − I_a) / m.
fn fitted_box(inertial: &Inertial) -> Placed {
    let eigen = inertial.inertia.symmetric_eigen();
    let moments = eigen.eigenvalues;
    let squares = (Vector3::repeat(moments.sum()) - moments * 2.0) * (6.0 / inertial.mass);
    let edges = squares.map(|square| square.max(0.0).sqrt());
    // A point mass has no extent of its own.
    let longest = if edges.max() > 0.0 { edges.max() } else { inertia::ball_radius(inertial.mass) };
    let half_extents = edges.map(|edge| edge.max(THINNEST * longest) * SHRUNK_TO / 2.0);
    let mut axes: Matrix3<f64> = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let pose = Isometry3::from_parts(Translation3::from(inertial.center_of_mass.coords), rotation);
    Placed { pose, shape: Shape::Box { half_extents }, color: None }
}

/// The ball at the far end of a link: about the end of its box in the direction from the `joint` that
/// moves it through its `center` of mass, or, for a link without mass, about its own origin: such
/// links are drawn to mark a foot.
fn foot(joint: &Point3<f64>, center: Option<Point3<f64>>, fitted: Option<&Placed>, size: f64) -> Placed {
    let end = match (center, fitted) {
        (Some(center), Some(fitted)) => {
            let along = (center - joint).try_normalize(1e-9).unwrap_or(-Vector3::z());
            center + along * reach(fitted, &along)
        }
        _ => Point3::origin(),
    };
    let distance = (end - joint).norm();
    let radius = FOOT * if distance > 1e-6 * size { distance } else { FOOT * size };
    let pose = Isometry3::from_parts(Translation3::from(end.coords), UnitQuaternion::identity());
    Placed { pose, shape: Shape::Sphere { radius }, color: None }
}

/// How far a box reaches from its centre along the unit vector `along`, within its cross-section there.
fn reach(placed: &Placed, along: &Vector3<f64>) -> f64 {
    let Shape::Box { half_extents } = placed.shape else { return 0.0 };
    let local = placed.pose.rotation.inverse() * along;
    half_extents
        .iter()
        .zip(local.iter())
        .map(|(half, part)| if part.abs() > 1e-12 { half / part.abs() } else { f64::INFINITY })
        .fold(f64::INFINITY, f64::min)
}

/// The link's inertial, if it has a mass.
fn massive(link: &Link) -> Option<&Inertial> {
    link.inertial.as_ref().filter(|inertial| inertial.mass > 0.0)
}
