//! `<gazebo reference="link">`: what the simulator of that name reads beside the URDF. The friction of a link is taken from it.

use roxmltree::Node;

use super::document::{Context, UrdfElement, named};
use crate::character::NoteKind;
use crate::character::draft::{At, DraftLink};

/// The elements with a coefficient of friction: along a first direction (or any), and across it.
const FRICTION: [&str; 3] = ["mu1", "mu", "mu2"];

/// Gives the link that `node` refers to, if it is one of `links`, its coefficient of friction. The rest is left out.
pub fn read(context: &mut Context, node: Node, links: &mut [DraftLink]) {
    let reference = node.attribute("reference").unwrap_or_default();
    let link = links.iter_mut().find(|link| link.name.value == reference);
    let has_friction = node.children().any(|child| FRICTION.iter().any(|name| named(child, name)));
    let Some(link) = link.filter(|_| has_friction) else {
        context.ignore(node);
        return;
    };
    let owner = UrdfElement::Link(reference.to_owned());
    let [first, any, second] = FRICTION.map(|name| {
        let node = context.only(node, name, &owner)?;
        number(context, node, &owner)
    });
    let along = first.or(any);
    let taken = match (along, second) {
        (Some(along), Some(across)) if along != across => {
            let least = along.min(across);
            let message = format!(
                "<gazebo> has the friction {along} along and {across} across; {least} is taken for both"
            );
            context.note(node, &owner, NoteKind::Approximated, message);
            Some(least)
        }
        (along, across) => along.or(across),
    };
    link.surface = At::new(link.surface.value, context.place(node, &owner));
    link.surface.value.friction = taken.or(link.surface.value.friction);
    context.ignore_all_but(node, &FRICTION);
}

/// The number in the text of `node`, or in its attribute `value`, as older files have it.
fn number(context: &mut Context, node: Node, owner: &UrdfElement) -> Option<f64> {
    if node.attribute("value").is_some() {
        return context.number(node, "value", owner);
    }
    let text = node.text().unwrap_or_default().trim();
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Some(number),
        _ => {
            context.fault(
                node,
                owner,
                format!("<{}> is {text:?}, which is not a finite number", node.tag_name().name()),
            );
            None
        }
    }
}
