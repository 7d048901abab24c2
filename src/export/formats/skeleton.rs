//! Forward kinematics of a character: joint angles to link poses.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use gaitwright_physics::character::{Character, Joint, JointKind};

/// A character's tree with the place of each joint's angle.
#[derive(Debug, Clone)]
pub(super) struct Skeleton<'a> {
    pub(super) character: &'a Character,
    /// Names of the movable joints in the order of the links; the order of every array of angles.
    pub(super) joints: Vec<String>,
    /// Place of the angle of each link's joint; `None` for the root and for links that are fixed.
    pub(super) angle_of: Vec<Option<usize>>,
}

impl<'a> Skeleton<'a> {
    pub(super) fn new(character: &'a Character) -> Self {
        let mut joints = Vec::new();
        let angle_of = character.links.iter().map(|link| {
            let joint = link.joint.as_ref().filter(|joint| joint.kind != JointKind::Fixed)?;
            joints.push(joint.name.clone());
            Some(joints.len() - 1)
        });
        let angle_of = angle_of.collect();
        Self { character, joints, angle_of }
    }

    /// The joint of each angle.
    pub(super) fn movable(&self) -> impl Iterator<Item = &'a Joint> {
        let joints = self.character.links.iter().filter_map(|link| link.joint.as_ref());
        joints.filter(|joint| joint.kind != JointKind::Fixed)
    }

    /// Whether a link turns against its parent; otherwise it slides or is fixed.
    pub(super) fn turns(&self, link: usize) -> bool {
        self.character.links[link].joint.as_ref().is_some_and(|joint| joint.kind == JointKind::Revolute)
    }

    /// Frame of a link in its parent's frame, rad and m; of the root link, the identity.
    pub(super) fn local(&self, link: usize, angles: &[f64]) -> Isometry3<f64> {
        let Some(joint) = &self.character.links[link].joint else { return Isometry3::identity() };
        let angle = self.angle_of[link].map_or(0.0, |place| angles[place]);
        joint.origin
            * match joint.kind {
                JointKind::Fixed => Isometry3::identity(),
                JointKind::Revolute => Isometry3::from_parts(
                    Translation3::identity(),
                    UnitQuaternion::from_axis_angle(&joint.axis, angle),
                ),
                JointKind::Prismatic => Translation3::from(joint.axis.into_inner() * angle).into(),
            }
    }

    /// Frames of all links with the root link at `root`, in the frame in which that is given.
    pub(super) fn poses(&self, root: &Isometry3<f64>, angles: &[f64]) -> Vec<Isometry3<f64>> {
        let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(self.character.links.len());
        for (index, link) in self.character.links.iter().enumerate() {
            let parent = link.joint.as_ref().map_or(root, |joint| &poses[joint.parent]);
            poses.push(parent * self.local(index, angles));
        }
        poses
    }

    /// Links carried by `link`.
    pub(super) fn children(&self, link: usize) -> impl Iterator<Item = usize> + '_ {
        let carries = move |child: &usize| {
            self.character.links[*child].joint.as_ref().is_some_and(|joint| joint.parent == link)
        };
        (link + 1..self.character.links.len()).filter(carries)
    }
}
