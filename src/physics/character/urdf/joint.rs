//! `<joint>`.

use nalgebra::Vector3;
use roxmltree::Node;

use super::document::{Context, UrdfElement, named};
use crate::character::draft::{At, DraftJoint};
use crate::character::{JointKind, NoteKind};

const KNOWN: [&str; 9] =
    ["origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller"];

/// The joint that `node` describes; `None` after a fault that leaves nothing to build.
pub fn read(context: &mut Context, node: Node) -> Option<DraftJoint> {
    let name = context.name(node)?;
    let owner = UrdfElement::Joint(name.to_owned());
    let (kind, endless) = match node.attribute("type") {
        Some("fixed") => (Some(JointKind::Fixed), false),
        Some("revolute") => (Some(JointKind::Revolute), false),
        Some("continuous") => (Some(JointKind::Revolute), true),
        Some("prismatic") => (Some(JointKind::Prismatic), false),
        Some(kind @ ("planar" | "floating")) => {
            let reason = format!(
                "joints of type {kind:?} are not supported; only fixed, revolute, continuous and prismatic ones"
            );
            context.fault(node, &owner, reason);
            (None, false)
        }
        Some(other) => {
            context.fault(node, &owner, format!("{other:?} is not a known type of joint"));
            (None, false)
        }
        None => {
            context.fault(node, &owner, "<joint> has no type");
            (None, false)
        }
    };
    let mut end = |tag: &str| {
        let Some(end) = context.only(node, tag, &owner) else {
            context.fault(node, &owner, format!("<joint> has no <{tag}>"));
            return None;
        };
        let Some(link) = end.attribute("link") else {
            context.fault(end, &owner, format!("<{tag}> names no link"));
            return None;
        };
        Some(At::new(link.to_owned(), context.place(end, &owner)))
    };
    let (parent, child) = (end("parent"), end("child"));
    let place = context.place(node, &owner);
    let origin = At::new(context.origin(node, &owner), place.clone());
    let axis = match context.only(node, "axis", &owner) {
        Some(axis) => {
            let direction = context.numbers(axis, "xyz", &owner).unwrap_or([1.0, 0.0, 0.0]);
            At::new(Vector3::from(direction), context.place(axis, &owner))
        }
        None => At::new(Vector3::x(), place.clone()),
    };
    let dynamics = context.only(node, "dynamics", &owner);
    let mut loss = |name: &str| match dynamics {
        Some(dynamics) => {
            let value = context.number(dynamics, name, &owner).unwrap_or(0.0);
            At::new(value, context.place(dynamics, &owner))
        }
        None => At::new(0.0, place.clone()),
    };
    let (damping, friction) = (loss("damping"), loss("friction"));
    let movable = matches!(kind, Some(JointKind::Revolute | JointKind::Prismatic));
    let limit = if movable { limit(context, node, &owner, endless) } else { Limit::default() };
    if movable && let Some(mimic) = context.only(node, "mimic", &owner) {
        let message = "<mimic> is not supported; the joint moves on its own";
        context.note(mimic, &owner, NoteKind::Approximated, message);
    }
    for tag in ["calibration", "safety_controller"] {
        node.children().filter(|child| named(*child, tag)).for_each(|child| context.ignore(child));
    }
    context.ignore_all_but(node, &KNOWN);
    Some(DraftJoint {
        name: At::new(name.to_owned(), place.clone()),
        kind: kind?,
        parent: parent?,
        child: child?,
        origin,
        axis,
        limits: limit.range,
        driven: true,
        effort: limit.effort,
        velocity: limit.velocity,
        damping,
        friction,
        armature: At::new(0.0, place),
    })
}

#[derive(Default)]
struct Limit {
    range: Option<At<[f64; 2]>>,
    effort: Option<At<f64>>,
    velocity: Option<At<f64>>,
}

/// Range, effort and velocity of a movable joint; an `endless` one has no range.
fn limit(context: &mut Context, joint: Node, owner: &UrdfElement, endless: bool) -> Limit {
    let Some(node) = context.only(joint, "limit", owner) else {
        if !endless {
            let message = "<joint> has no <limit>; its range, effort and velocity are unlimited";
            context.note(joint, owner, NoteKind::Repaired, message);
        }
        return Limit::default();
    };
    let place = context.place(node, owner);
    let mut most = |name: &str| {
        if node.attribute(name).is_none() {
            let message = format!("<limit> has no {name}, which is taken as unbounded");
            context.note(node, owner, NoteKind::Repaired, message);
            return None;
        }
        let value = context.number(node, name, owner)?;
        if value == 0.0 {
            let message = format!("the {name} of <limit> is 0, which is taken as not given: unbounded");
            context.note(node, owner, NoteKind::Repaired, message);
            return None;
        }
        Some(At::new(value, place.clone()))
    };
    let (effort, velocity) = (most("effort"), most("velocity"));
    Limit { range: range(context, node, owner, endless).map(|range| At::new(range, place)), effort, velocity }
}

fn range(context: &mut Context, node: Node, owner: &UrdfElement, endless: bool) -> Option<[f64; 2]> {
    let given = ["lower", "upper"].map(|name| node.attribute(name).is_some());
    let [lower, upper] = ["lower", "upper"].map(|name| context.number(node, name, owner));
    if endless {
        return None;
    }
    match given {
        [false, false] => {
            let message = "<limit> has no range; the joint is unlimited";
            context.note(node, owner, NoteKind::Repaired, message);
            return None;
        }
        [true, true] => {}
        [has_lower, _] => {
            let missing = if has_lower { "upper" } else { "lower" };
            let message = format!("<limit> has no {missing}, which the format then takes as 0");
            context.note(node, owner, NoteKind::Repaired, message);
        }
    }
    // A number that cannot be read is a fault already.
    let end = |given: bool, value: Option<f64>| if given { value } else { Some(0.0) };
    let (lower, upper) = (end(given[0], lower)?, end(given[1], upper)?);
    // Some exporters fill in what they do not know with zeros; a joint that is to be fixed has a motor or none.
    let zero = |name: &str| node.attribute(name).and_then(|text| text.trim().parse().ok()) == Some(0.0);
    if ["lower", "upper", "effort", "velocity"].into_iter().all(zero) {
        let message = "every number of <limit> is 0, which is taken as not given; the joint is unlimited";
        context.note(node, owner, NoteKind::Repaired, message);
        return None;
    }
    Some([lower, upper])
}
