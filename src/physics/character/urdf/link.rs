//! `<link>`: inertia, collision shapes and visuals.

use nalgebra::{Matrix3, Point3, Vector3};
use roxmltree::Node;

use super::document::{Context, Materials, UrdfElement, named, tag};
use crate::character::draft::{At, DraftInertial, DraftLink};
use crate::character::supply::{Supply, is_elsewhere};
use crate::character::{NoteKind, Placed, Shape, SurfaceMaterial, mesh};

/// The link that `node` describes; `None` when it has no proper name, which is a fault.
pub fn read(context: &mut Context, node: Node, materials: &Materials, supply: &Supply) -> Option<DraftLink> {
    let name = context.name(node)?;
    let owner = UrdfElement::Link(name.to_owned());
    let mut link = DraftLink {
        name: At::new(name.to_owned(), context.place(node, &owner)),
        inertial: context.only(node, "inertial", &owner).and_then(|node| inertial(context, node, &owner)),
        collisions: Vec::new(),
        surface: At::new(SurfaceMaterial::default(), context.place(node, &owner)),
        visuals: Vec::new(),
        missing_collisions: Vec::new(),
        missing_visuals: Vec::new(),
    };
    for part in node.children().filter(|child| named(*child, "collision")) {
        let place = context.place(part, &owner);
        match geometry(context, part, &owner, supply, Use::Collision) {
            Some(Geometry::Shape(shape)) => {
                let pose = context.origin(part, &owner);
                link.collisions.push(At::new(Placed { pose, shape, color: None }, place));
            }
            Some(Geometry::Missing(why)) => link.missing_collisions.push(At::new(why, place)),
            None => {}
        }
    }
    for part in node.children().filter(|child| named(*child, "visual")) {
        let place = context.place(part, &owner);
        match geometry(context, part, &owner, supply, Use::Visual) {
            Some(Geometry::Shape(shape)) => {
                let pose = context.origin(part, &owner);
                let color = context.only(part, "material", &owner).and_then(|material| {
                    let named = material.attribute("name").and_then(|name| materials.get(name)).copied();
                    color(context, material, &owner).or(named)
                });
                link.visuals.push(At::new(Placed { pose, shape, color }, place));
            }
            Some(Geometry::Missing(why)) => link.missing_visuals.push(At::new(why, place)),
            None => {}
        }
    }
    context.ignore_all_but(node, &["inertial", "collision", "visual"]);
    Some(link)
}

fn inertial(context: &mut Context, node: Node, owner: &UrdfElement) -> Option<At<DraftInertial>> {
    let pose = context.origin(node, owner);
    let inertia = context.only(node, "inertia", owner).and_then(|node| {
        let mut moment = |name: &str| {
            let diagonal = matches!(name, "ixx" | "iyy" | "izz");
            if diagonal {
                context.required(node, name, owner)
            } else if node.attribute(name).is_none() {
                Some(0.0)
            } else {
                context.number(node, name, owner)
            }
        };
        let [xx, xy, xz, yy, yz, zz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(&mut moment);
        let (xx, xy, xz, yy, yz, zz) = (xx?, xy?, xz?, yy?, yz?, zz?);
        let rotation = pose.rotation.to_rotation_matrix();
        let given = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Some(if rotation.matrix() == &Matrix3::identity() {
            given
        } else {
            rotation * given * rotation.transpose()
        })
    });
    let Some(mass) = context.only(node, "mass", owner) else {
        context.fault(node, owner, "<inertial> has no <mass>");
        return None;
    };
    let value = context.required(mass, "value", owner)?;
    let center_of_mass = Point3::from(pose.translation.vector);
    let place = context.place(node, owner);
    Some(At::new(DraftInertial { mass: value, center_of_mass, inertia }, place))
}

/// What a geometry is for.
#[derive(Clone, Copy, PartialEq)]
enum Use {
    Collision,
    Visual,
}

enum Geometry {
    Shape(Shape),
    /// A mesh that cannot be had, and why.
    Missing(String),
}

fn geometry(
    context: &mut Context,
    part: Node,
    owner: &UrdfElement,
    supply: &Supply,
    purpose: Use,
) -> Option<Geometry> {
    let Some(geometry) = context.only(part, "geometry", owner) else {
        context.fault(part, owner, format!("<{}> has no <geometry>", tag(part)));
        return None;
    };
    let Some(node) = geometry.children().find(Node::is_element) else {
        context.fault(geometry, owner, "<geometry> is empty");
        return None;
    };
    let shape = match node.tag_name().name() {
        "sphere" => Shape::Sphere { radius: context.required(node, "radius", owner)? },
        "box" => {
            if node.attribute("size").is_none() {
                context.fault(node, owner, "<box> has no size");
            }
            let size = context.numbers(node, "size", owner)?;
            Shape::Box { half_extents: Vector3::from(size) / 2.0 }
        }
        kind @ ("cylinder" | "capsule") => {
            let (radius, length) =
                (context.required(node, "radius", owner), context.required(node, "length", owner));
            let (radius, half_length) = (radius?, length? / 2.0);
            if kind == "capsule" {
                Shape::Capsule { radius, half_length }
            } else {
                Shape::Cylinder { radius, half_length }
            }
        }
        "mesh" => return mesh_geometry(context, node, owner, supply, purpose),
        other => {
            context.fault(node, owner, format!("<{other}> is not a known shape"));
            return None;
        }
    };
    Some(Geometry::Shape(shape))
}

fn mesh_geometry(
    context: &mut Context,
    node: Node,
    owner: &UrdfElement,
    supply: &Supply,
    purpose: Use,
) -> Option<Geometry> {
    let Some(name) = node.attribute("filename").map(str::trim).filter(|name| !name.is_empty()) else {
        context.fault(node, owner, "<mesh> has no filename");
        return None;
    };
    let scale = match node.attribute("scale") {
        Some(_) => Vector3::from(context.numbers(node, "scale", owner)?),
        None => Vector3::repeat(1.0),
    };
    if scale.product() == 0.0 {
        context.fault(node, owner, "the scale of <mesh> has a zero");
        return None;
    }
    let bytes = match supply.find(name) {
        Ok(Some(bytes)) => bytes,
        Ok(None) => {
            let not_followed =
                if is_elsewhere(name) { "; absolute paths and URLs are not followed" } else { "" };
            return Some(Geometry::Missing(format!("the mesh {name:?} is not supplied{not_followed}")));
        }
        Err(error) => {
            context.fault(node, owner, error.to_string());
            return None;
        }
    };
    if !mesh::supported(name) {
        return Some(Geometry::Missing(format!(
            "the mesh {name:?} is neither an STL nor an OBJ nor a COLLADA file"
        )));
    }
    if !context.afford(bytes.len()) {
        context.fault(node, owner, "the meshes are too large altogether; share or simplify them");
        return None;
    }
    let mesh = match mesh::read(name, &bytes, &scale) {
        Ok(mesh) => mesh,
        Err(error) if error.is_unread() => {
            return Some(Geometry::Missing(format!("the mesh {name:?}: {error}")));
        }
        Err(error) => {
            context.fault(node, owner, format!("the mesh {name:?}: {error}"));
            return None;
        }
    };
    if purpose == Use::Visual {
        return Some(Geometry::Shape(mesh.surface()));
    }
    let solid = mesh.solid();
    if let Some(how) = solid.approximation {
        let message = format!("the collision mesh {name:?} is {how}");
        context.note(node, owner, NoteKind::Approximated, message);
    }
    Some(Geometry::Shape(solid.shape))
}

/// The colour that `<material>` itself gives.
pub fn color(context: &mut Context, material: Node, owner: &UrdfElement) -> Option<[f32; 4]> {
    let node = material.children().find(|child| named(*child, "color"))?;
    let color = context.numbers(node, "rgba", owner)?;
    Some(color.map(|part| part.clamp(0.0, 1.0) as f32))
}
