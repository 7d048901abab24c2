//! `<gazebo reference="link">`: what the simulator of that name reads beside the URDF. The friction of a link is taken from it:
//! `mu1` along the direction `fdir1` of its collisions' frames, and `mu2` across it.

use roxmltree::Node;

use nalgebra::{Unit, Vector3};

use super::document::{Context, UrdfElement, named};
use crate::character::bounds::{check_axis, unit};
use crate::character::draft::{At, DraftLink};
use crate::character::{Friction, NoteKind};

/// The elements with a coefficient of friction: along a first direction (or any), and across it.
const FRICTION: [&str; 3] = ["mu1", "mu", "mu2"];
/// The element with the first direction.
const DIRECTION: &str = "fdir1";

/// Collision frames whose axes differ by less than this sine have the same.
const SAME_AXIS: f64 = 1e-6;

/// Gives the link that `node` refers to, if it is one of `links`, its friction. The rest is left out.
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
        numbers(context, node, &owner).map(|[number]| number)
    });
    let direction = context.only(node, DIRECTION, &owner).and_then(|node| {
        let direction = At::new(Vector3::from(numbers(context, node, &owner)?), context.place(node, &owner));
        check_axis(&direction, &mut context.diagnostics);
        Some(direction.value)
    });
    let taken = match (first.or(any), second) {
        (Some(along), Some(across)) if along != across => {
            match direction.and_then(|direction| in_link(link, direction)) {
                Some(axis) => Some(Friction::Directional { along, across, axis }),
                None => {
                    let least = along.min(across);
                    let message = format!(
                        "<gazebo> has the friction {along} along and {across} across, without one <{DIRECTION}> for all \
                         collisions; {least} is taken for both"
                    );
                    context.note(node, &owner, NoteKind::Approximated, message);
                    Some(Friction::Uniform(least))
                }
            }
        }
        (along, across) => along.or(across).map(Friction::Uniform),
    };
    link.surface = At::new(link.surface.value, context.place(node, &owner));
    link.surface.value.friction = taken.or(link.surface.value.friction);
    context.ignore_all_but(node, &[&FRICTION[..], &[DIRECTION]].concat());
}

/// The axis in the frame of `link` that `direction` in the frames of its collisions is, if it is the same in all.
fn in_link(link: &DraftLink, direction: Vector3<f64>) -> Option<Unit<Vector3<f64>>> {
    let mut axes = link.collisions.iter().map(|collision| collision.value.pose.rotation * unit(direction));
    let first = axes.next()?;
    axes.all(|axis| axis.cross(&first).norm() < SAME_AXIS).then_some(first)
}

/// The numbers in the text of `node`, or in its attribute `value`, as older files have it.
fn numbers<const N: usize>(context: &mut Context, node: Node, owner: &UrdfElement) -> Option<[f64; N]> {
    if node.attribute("value").is_some() {
        return context.numbers(node, "value", owner);
    }
    let text = node.text().unwrap_or_default().trim();
    let words: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    match <[f64; N]>::try_from(words) {
        Ok(numbers)
            if numbers.iter().all(|number| number.is_finite()) && text.split_whitespace().count() == N =>
        {
            Some(numbers)
        }
        _ => {
            let wanted = if N == 1 { "a finite number".to_owned() } else { format!("{N} finite numbers") };
            let tag = node.tag_name().name();
            context.fault(node, owner, format!("<{tag}> is {text:?}, which is not {wanted}"));
            None
        }
    }
}
