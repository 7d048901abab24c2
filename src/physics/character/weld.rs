//! Joints whose range is a single value are fixed there.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use super::bounds::unit;
use super::draft::{At, Diagnostics, DraftJoint};
use super::{About, JointKind, NoteKind};

/// Makes the joint fixed at the only value of its range, if it has but one; noted.
pub fn weld(joint: &mut DraftJoint, diagnostics: &mut Diagnostics) {
    let Some(At { value: [lower, upper], place }) = &joint.limits else { return };
    if joint.kind == JointKind::Fixed || lower != upper {
        return;
    }
    let axis = unit(joint.axis.value);
    let (moved, in_words) = match joint.kind {
        JointKind::Prismatic => (Translation3::from(*axis * *lower).into(), format!("{lower} m")),
        JointKind::Revolute | JointKind::Fixed => {
            let turned = UnitQuaternion::from_axis_angle(&axis, *lower);
            (Isometry3::from_parts(Translation3::identity(), turned), format!("{lower} rad"))
        }
    };
    let message = format!("the range of the joint is empty ({lower} to {upper}); it is fixed at {in_words}");
    diagnostics.note(place.as_str(), About::Joint(joint.name.value.clone()), NoteKind::Repaired, message);
    joint.origin.value *= moved;
    joint.kind = JointKind::Fixed;
    joint.limits = None;
}
