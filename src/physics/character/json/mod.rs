//! Reads `gaitwright/character@1`, the project's own description of a character.

mod wire;

pub use wire::ShapeDocument;
use wire::{DirectionalFriction, FrictionDocument};

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::bounds::{LENGTH, check_axis, shape_fault, unit};
use super::draft::{
    At, Diagnostics, Draft, DraftInertial, DraftJoint, DraftLink, DraftLoop, is_long, name_fault,
};
use super::solid::Solid;
use super::{About, Friction, JointKind, LoopKind, NoteKind, Placed, Shape, SurfaceMaterial, mesh};
use crate::fault::{self, Fault, InputError};

/// Greatest number of points of one hull.
const POINTS: usize = 100_000;

/// The JSON Schema of `gaitwright/character@1` documents.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(wire::Document).to_value()
}

/// What the document in `bytes` describes.
pub fn draft(bytes: &[u8]) -> Result<Draft, InputError> {
    let document: wire::Document = fault::from_json(super::size::text(bytes)?.as_bytes())?;
    for (what, count) in
        [("links", document.links.len()), ("joints", document.joints.len()), ("loops", document.loops.len())]
    {
        if count > super::LINKS {
            let reason = format!("the character has {count} {what}; at most {} are read", super::LINKS);
            return Err(InputError::TooLarge(Fault::new(format!("/{what}"), reason)));
        }
    }
    let faults = names(&document)
        .filter_map(|(place, name)| name_fault(name).map(|reason| Fault::new(place, reason)))
        .collect();
    // What is told of the rest would repeat them.
    if names(&document).any(|(_, name)| is_long(name)) {
        return Err(InputError::Impossible(faults));
    }
    let mut diagnostics = Diagnostics { faults, ..Diagnostics::default() };
    let links = document
        .links
        .into_iter()
        .enumerate()
        .map(|(index, link)| read_link(&mut diagnostics, index, link))
        .collect();
    let joints = document
        .joints
        .into_iter()
        .enumerate()
        .map(|(index, joint)| read_joint(&mut diagnostics, index, joint))
        .collect();
    let loops = document
        .loops
        .into_iter()
        .enumerate()
        .map(|(index, closing)| read_loop(&mut diagnostics, index, closing))
        .collect();
    let standing = document.standing.map(|angles| {
        angles
            .into_iter()
            .map(|(name, angle)| {
                let place = fault::member("/standing", &name);
                (At::new(name, place), angle)
            })
            .collect()
    });
    Ok(Draft { name: document.name, links, joints, loops, standing, complete: true, diagnostics })
}

/// The document's names, each with its place.
fn names(document: &wire::Document) -> impl Iterator<Item = (String, &String)> {
    let links = document.links.iter().enumerate().map(|(i, link)| (format!("/links/{i}/name"), &link.name));
    let joints =
        document.joints.iter().enumerate().map(|(i, joint)| (format!("/joints/{i}/name"), &joint.name));
    let loops =
        document.loops.iter().enumerate().map(|(i, closing)| (format!("/loops/{i}/name"), &closing.name));
    std::iter::once(("/name".to_owned(), &document.name)).chain(links).chain(joints).chain(loops)
}

fn read_link(diagnostics: &mut Diagnostics, index: usize, link: wire::LinkDocument) -> DraftLink {
    let place = format!("/links/{index}");
    let about = About::Link(link.name.clone());
    let collisions = read_shapes(diagnostics, &format!("{place}/shapes"), &about, link.shapes);
    let visuals = read_shapes(diagnostics, &format!("{place}/visuals"), &about, link.visuals);
    let inertia = link.inertia.map(|i| Matrix3::new(i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz));
    let center_of_mass = link.center_of_mass.map_or(Point3::origin(), Point3::from);
    let inertial = match (link.density, link.mass) {
        (Some(_), Some(_)) => {
            diagnostics.fault(format!("{place}/density"), "give either density or mass, not both");
            None
        }
        (None, None) => {
            if inertia.is_some() || link.center_of_mass.is_some() {
                diagnostics.fault(place.as_str(), "an inertia or a centre of mass is given without a mass");
            }
            None
        }
        (None, Some(mass)) => {
            if mass > 0.0 && inertia.is_none() {
                diagnostics.fault(place.as_str(), "a mass is given without an inertia; give that as well, or `density` in place of the mass");
            }
            Some(At::new(DraftInertial { mass, center_of_mass, inertia }, format!("{place}/mass")))
        }
        (Some(density), None) => {
            let place = format!("{place}/density");
            if inertia.is_some() || link.center_of_mass.is_some() {
                let reason = "the shapes give centre of mass and inertia where a density is given";
                diagnostics.fault(place.as_str(), reason);
            }
            if density > 0.0 {
                weighed(diagnostics, &place, density, &collisions)
            } else {
                diagnostics.fault(place, "the density must be positive");
                None
            }
        }
    };
    DraftLink {
        name: At::new(link.name, format!("{place}/name")),
        inertial,
        collisions,
        surface: At::new(
            SurfaceMaterial {
                friction: link.friction.map(|document| friction(diagnostics, &place, document)),
                restitution: link.restitution,
            },
            place.clone(),
        ),
        visuals,
        missing_collisions: Vec::new(),
        missing_visuals: Vec::new(),
    }
}

/// The friction that `document` of the link at `place` describes.
fn friction(diagnostics: &mut Diagnostics, place: &str, document: FrictionDocument) -> Friction {
    match document {
        FrictionDocument::Uniform(coefficient) => Friction::Uniform(coefficient),
        FrictionDocument::Directional(DirectionalFriction { along, across, axis }) => {
            let axis = At::new(Vector3::from(axis), format!("{place}/friction/axis"));
            check_axis(&axis, diagnostics);
            Friction::Directional { along, across, axis: unit(axis.value) }
        }
    }
}

/// Mass and inertia of shapes of one density.
fn weighed(
    diagnostics: &mut Diagnostics,
    place: &str,
    density: f64,
    shapes: &[At<Placed>],
) -> Option<At<DraftInertial>> {
    let Some(solid) = Solid::of_all(shapes.iter().map(|shape| &shape.value)) else {
        diagnostics.fault(place, "a density is given, but no shape with a volume");
        return None;
    };
    let inertial = DraftInertial {
        mass: density * solid.volume,
        center_of_mass: solid.centroid,
        inertia: Some(solid.inertia * density),
    };
    Some(At::new(inertial, place))
}

/// The shape that `document` describes, by itself.
///
/// # Errors
///
/// Every fault, with JSON pointers into the shape.
pub fn read_shape(document: &wire::ShapeDocument) -> Result<Placed, Vec<Fault>> {
    let mut diagnostics = Diagnostics::default();
    let about = About::Character(String::new());
    let placed = read_shapes(&mut diagnostics, "", &about, vec![document.clone()]).pop();
    let mut faults: Vec<Fault> = diagnostics
        .faults
        .into_iter()
        .map(|fault| Fault { pointer: fault.pointer.trim_start_matches("/0").to_owned(), ..fault })
        .collect();
    if let Some(At { value, .. }) = &placed {
        faults.extend(placement_fault(&value.pose));
        faults
            .extend(shape_fault(&value.shape).map(|(field, reason)| Fault::new(format!("/{field}"), reason)));
    }
    match placed {
        Some(placed) if faults.is_empty() => Ok(placed.value),
        _ => Err(faults),
    }
}

/// Why a shape cannot be at `pose`.
fn placement_fault(pose: &Isometry3<f64>) -> Option<Fault> {
    let far = !pose.translation.vector.iter().all(|length| length.abs() <= LENGTH);
    far.then(|| Fault::new("/pose/position", format!("every coordinate must be within {LENGTH:e} m")))
}

fn read_shapes(
    diagnostics: &mut Diagnostics,
    place: &str,
    about: &About,
    shapes: Vec<wire::ShapeDocument>,
) -> Vec<At<Placed>> {
    let mut placed = Vec::new();
    for (index, shape) in shapes.into_iter().enumerate() {
        let place = format!("{place}/{index}");
        let (shape, pose, color) = match shape {
            wire::ShapeDocument::Sphere { radius, pose, color } => (Shape::Sphere { radius }, pose, color),
            wire::ShapeDocument::Box { size, pose, color } => {
                (Shape::Box { half_extents: Vector3::from(size) / 2.0 }, pose, color)
            }
            wire::ShapeDocument::Cylinder { radius, length, pose, color } => {
                (Shape::Cylinder { radius, half_length: length / 2.0 }, pose, color)
            }
            wire::ShapeDocument::Capsule { radius, length, pose, color } => {
                (Shape::Capsule { radius, half_length: length / 2.0 }, pose, color)
            }
            wire::ShapeDocument::Hull { vertices, pose, color } => {
                let Some(hull) = read_hull(diagnostics, &place, about, vertices) else { continue };
                (hull, pose, color)
            }
        };
        let pose = read_pose(diagnostics, &format!("{place}/pose"), pose);
        let color = color.map(|color| color.map(|part| part.clamp(0.0, 1.0)));
        placed.push(At::new(Placed { pose, shape, color }, place));
    }
    placed
}

fn read_hull(
    diagnostics: &mut Diagnostics,
    place: &str,
    about: &About,
    vertices: Vec<[f64; 3]>,
) -> Option<Shape> {
    let place = format!("{place}/vertices");
    if vertices.len() > POINTS {
        diagnostics
            .fault(place, format!("the hull has {} points; at most {POINTS} are read", vertices.len()));
        return None;
    }
    if vertices.iter().flatten().any(|x| x.abs() > LENGTH) {
        diagnostics.fault(place, format!("every point must be within {LENGTH:e} m"));
        return None;
    }
    let points: Vec<_> = vertices.into_iter().map(Point3::from).collect();
    let Some(solid) = mesh::hull(&points) else {
        diagnostics.fault(place, "the points of a hull must not all lie in one plane");
        return None;
    };
    if let Some(how) = solid.approximation {
        diagnostics.note(
            place,
            about.clone(),
            NoteKind::Approximated,
            format!("the hull of these points is {how}"),
        );
    }
    Some(solid.shape)
}

fn read_pose(diagnostics: &mut Diagnostics, place: &str, pose: wire::PoseDocument) -> Isometry3<f64> {
    let rotation = match (pose.orientation, pose.rpy) {
        (Some(_), Some(_)) => {
            diagnostics.fault(place, "give either orientation or rpy, not both");
            UnitQuaternion::identity()
        }
        (Some([w, x, y, z]), None) => {
            let quaternion = Quaternion::new(w, x, y, z);
            UnitQuaternion::try_new(quaternion, 1e-6).unwrap_or_else(|| {
                diagnostics.fault(format!("{place}/orientation"), "the quaternion has no length");
                UnitQuaternion::identity()
            })
        }
        (None, Some([roll, pitch, yaw])) => UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        (None, None) => UnitQuaternion::identity(),
    };
    Isometry3::from_parts(Translation3::from(Vector3::from(pose.position)), rotation)
}

fn read_joint(diagnostics: &mut Diagnostics, index: usize, joint: wire::JointDocument) -> DraftJoint {
    let place = format!("/joints/{index}");
    let part = |name: &str| format!("{place}/{name}");
    let kind = match joint.kind {
        wire::JointKindDocument::Fixed => JointKind::Fixed,
        wire::JointKindDocument::Revolute | wire::JointKindDocument::Continuous => JointKind::Revolute,
        wire::JointKindDocument::Prismatic => JointKind::Prismatic,
    };
    if joint.limits.is_some()
        && matches!(joint.kind, wire::JointKindDocument::Fixed | wire::JointKindDocument::Continuous)
    {
        diagnostics.fault(part("limits"), "a fixed or continuous joint has no limits");
    }
    let bound = |name: &str, value: Option<f64>| {
        value.map(|value| At::new(value, part(&format!("actuation/{name}"))))
    };
    DraftJoint {
        kind,
        origin: At::new(read_pose(diagnostics, &part("origin"), joint.origin), part("origin")),
        axis: At::new(Vector3::from(joint.axis), part("axis")),
        limits: joint.limits.map(|limits| At::new([limits.lower, limits.upper], part("limits"))),
        driven: joint.actuation.is_some(),
        effort: bound("max_torque", joint.actuation.and_then(|actuator| actuator.max_torque)),
        velocity: bound("max_speed", joint.actuation.and_then(|actuator| actuator.max_speed)),
        damping: At::new(joint.damping, part("damping")),
        friction: At::new(joint.friction, part("friction")),
        armature: At::new(joint.armature, part("armature")),
        parent: At::new(joint.parent, part("parent")),
        child: At::new(joint.child, part("child")),
        name: At::new(joint.name, part("name")),
    }
}

fn read_loop(diagnostics: &mut Diagnostics, index: usize, closing: wire::LoopDocument) -> DraftLoop {
    let part = |part: &str| format!("/loops/{index}/{part}");
    let kind = match closing.kind {
        wire::LoopKindDocument::Ball => LoopKind::Ball,
        wire::LoopKindDocument::Revolute => LoopKind::Revolute,
        wire::LoopKindDocument::Prismatic => LoopKind::Prismatic,
        wire::LoopKindDocument::Fixed => LoopKind::Fixed,
    };
    DraftLoop {
        name: At::new(closing.name, part("name")),
        kind,
        ends: [At::new(closing.a, part("a")), At::new(closing.b, part("b"))],
        origin: At::new(read_pose(diagnostics, &part("origin"), closing.origin), part("origin")),
        origin_in_second: closing
            .origin_in_b
            .map(|pose| At::new(read_pose(diagnostics, &part("origin_in_b"), pose), part("origin_in_b"))),
        axis: At::new(Vector3::from(closing.axis), part("axis")),
    }
}
