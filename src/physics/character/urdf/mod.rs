//! Reads URDF (Unified Robot Description Format) strictly: nothing that is not understood passes in
//! silence, and every fault names its line and its link or joint.
//!
//! What is repaired or ignored follows what real files contain: an effort or velocity of 0 stands for
//! "not given"; a joint whose range has equal ends is fixed there; the friction of a link is taken from its `<gazebo>`; elements for other programs (`<gazebo>`,
//! `<transmission>`, …) are noted once a kind.

mod document;
mod gazebo;
mod joint;
mod link;

use super::NoteKind;
use super::draft::{Draft, name_fault};
use super::supply::Supply;
use crate::fault::{Fault, InputError};
use document::{Context, Materials, UrdfElement, named};

/// What the URDF in `bytes` describes, with its meshes from `supply`.
pub fn draft(bytes: &[u8], supply: &Supply) -> Result<Draft, InputError> {
    let text = super::size::text(bytes)?;
    let document = document::parse(text)?;
    let robot = document.root_element();
    if robot.tag_name().name() != "robot" {
        let reason = format!("the root element is <{}>, not <robot>", robot.tag_name().name());
        return Err(InputError::Malformed(Fault::new("line 1", reason)));
    }
    let mut context = Context::new(text);
    let given = robot.attribute("name").filter(|name| !name.trim().is_empty());
    let name = given.unwrap_or("unnamed").to_owned();
    let owner = UrdfElement::Robot(name.clone());
    if given.is_none() {
        context.note(robot, &owner, NoteKind::Ignored, "the robot has no name and is called \"unnamed\"");
    }
    if let Some(reason) = name_fault(&name) {
        return Err(InputError::impossible("", format!("<robot>: {reason}")));
    }
    for kind in ["link", "joint"] {
        let count = robot.children().filter(|child| named(*child, kind)).count();
        if count > super::LINKS {
            let reason = format!("the robot has {count} {kind}s; at most {} are read", super::LINKS);
            return Err(InputError::TooLarge(Fault::new("", reason)));
        }
    }
    let materials = materials(&mut context, robot, &owner);
    let (mut links, mut joints) = (Vec::new(), Vec::new());
    for child in robot.children().filter(|child| child.is_element()) {
        if named(child, "link") {
            links.extend(link::read(&mut context, child, &materials, supply));
        } else if named(child, "joint") {
            joints.extend(joint::read(&mut context, child));
        } else if !named(child, "material") && !named(child, "gazebo") {
            context.ignore(child);
        }
    }
    for node in robot.children().filter(|child| named(*child, "gazebo")) {
        gazebo::read(&mut context, node, &mut links);
    }
    context.note_ignored(robot, &owner);
    let described = robot.children().filter(|child| named(*child, "link") || named(*child, "joint")).count();
    let complete = links.len() + joints.len() == described;
    Ok(Draft {
        name,
        links,
        joints,
        loops: Vec::new(),
        standing: None,
        complete,
        diagnostics: context.diagnostics,
    })
}

/// Every material with a name and a colour, wherever it is defined; of several the first.
fn materials(context: &mut Context, robot: roxmltree::Node, owner: &UrdfElement) -> Materials {
    let mut materials = Materials::new();
    for node in robot.descendants().filter(|node| named(*node, "material")) {
        if let Some(name) = node.attribute("name").filter(|name| !name.is_empty())
            && !materials.contains_key(name)
            && let Some(color) = link::color(context, node, owner)
        {
            materials.insert(name.to_owned(), color);
        }
    }
    materials
}
