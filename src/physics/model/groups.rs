//! Bodies side by side: groups of bodies at the same depth of the tree, which kernels move together.

use nalgebra::Matrix3;

use super::body::{Body, DofKind};
use super::spin::Spin;
use super::wide::{LANES, Lanes, Wide, WideMatrix, WideVector};

/// Where a body stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    /// Index of its group.
    pub group: usize,
    /// Its lane in the group.
    pub lane: usize,
}

/// Where the parents of a group's bodies stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parents {
    /// In the same lanes of one group. The root stands in all lanes of its own.
    Beside(usize),
    /// One here, one there.
    Each([Slot; LANES]),
}

/// Up to [`LANES`] bodies at the same depth, and what is constant of them, side by side (see [`Body`]).
///
/// In lanes that are left stands a body without mass that is fixed to the parent of the first: it adds nothing to any sum and moves
/// no faster than that, so that kernels need not leave it out.
#[derive(Debug, Clone)]
pub struct BodyGroup {
    /// Their indices, which lanes that are left repeat.
    pub bodies: [usize; LANES],
    /// How many there are.
    pub count: usize,
    /// Where their parents stand; the root's is itself.
    pub parents: Parents,
    pub offset: WideVector,
    pub joint_rotation: WideMatrix,
    pub joint_rotation_sine: WideMatrix,
    pub joint_rotation_versine: WideMatrix,
    pub axis: WideVector,
    /// 1 where the joint slides, 0 where it rotates.
    pub slides: Lanes,
    /// Axis of each body's spin that does not show, zero where there is none (see `spin.rs`).
    pub spin_axis: WideVector,
    /// 0 where no rotation shows, 1 where some does.
    pub shows: Lanes,
    /// 1 in lanes that are left, 0 in the others.
    pub empty: Lanes,
    pub mass: Lanes,
    pub center: WideVector,
    pub inertia: WideMatrix,
}

impl BodyGroup {
    fn new(indices: &[usize], bodies: &[Body], spins: &[Spin], parents: Parents) -> Self {
        let mut group = Self {
            bodies: std::array::from_fn(|lane| indices.get(lane).copied().unwrap_or(indices[0])),
            count: indices.len(),
            parents,
            offset: Wide::ZERO,
            joint_rotation: Wide::all(Matrix3::identity()),
            joint_rotation_sine: Wide::ZERO,
            joint_rotation_versine: Wide::ZERO,
            axis: Wide::ZERO,
            slides: [0.0; LANES],
            spin_axis: Wide::ZERO,
            shows: [0.0; LANES],
            empty: [1.0; LANES],
            mass: [0.0; LANES],
            center: Wide::ZERO,
            inertia: Wide::ZERO,
        };
        for (lane, index) in indices.iter().enumerate() {
            let (body, spin) = (&bodies[*index], spins[*index]);
            group.shows[lane] = if spin == Spin::Any { 0.0 } else { 1.0 };
            if let Spin::About(axis) = spin {
                group.spin_axis.set(lane, axis);
            }
            group.offset.set(lane, body.offset);
            group.joint_rotation.set(lane, body.joint_rotation);
            group.joint_rotation_sine.set(lane, body.joint_rotation_sine);
            group.joint_rotation_versine.set(lane, body.joint_rotation_versine);
            group.axis.set(lane, body.axis);
            group.slides[lane] = if body.dof == DofKind::Prismatic { 1.0 } else { 0.0 };
            group.empty[lane] = 0.0;
            group.mass[lane] = body.mass;
            group.center.set(lane, body.center);
            group.inertia.set(lane, body.inertia);
        }
        group
    }

    /// Indices of the bodies' joints. Not for the root.
    #[inline(always)] // part of the kernels
    pub fn joints(&self) -> impl Iterator<Item = usize> {
        self.bodies.into_iter().take(self.count).map(|body| body - 1)
    }

    /// The numbers of `of_joints` that belong to the bodies' joints. Not for the root.
    #[inline(always)] // part of the kernels
    pub fn of_joints<T: Copy>(&self, of_joints: &[T]) -> [T; LANES] {
        self.bodies.map(|body| of_joints[body - 1])
    }

    /// Puts `numbers` where those of the bodies' joints are in `of_joints`. Not for the root.
    #[inline(always)] // part of the kernels
    pub fn put(&self, numbers: Lanes, of_joints: &mut [f64]) {
        for (joint, number) in self.joints().zip(numbers) {
            of_joints[joint] = number;
        }
    }
}

/// Groups of `bodies`, whose `spins` do not show, the root's first and each after those of its parents, and the slot of each body.
pub fn groups(bodies: &[Body], spins: &[Spin]) -> (Vec<BodyGroup>, Vec<Slot>) {
    let mut depths = vec![0; bodies.len()];
    for (index, body) in bodies.iter().enumerate().skip(1) {
        depths[index] = depths[body.parent] + 1;
    }
    let here = Slot { group: 0, lane: 0 };
    let mut slots = vec![here; bodies.len()];
    let mut groups = vec![BodyGroup::new(&[0], bodies, spins, Parents::Beside(0))];
    for depth in 1..=depths.iter().copied().max().unwrap_or(0) {
        let mut level: Vec<usize> = (1..bodies.len()).filter(|index| depths[*index] == depth).collect();
        let place_of_parent = |index: &usize| {
            let Slot { group, lane } = slots[bodies[*index].parent];
            (group, lane)
        };
        level.sort_by_key(place_of_parent);
        for members in level.chunks(LANES) {
            let group = groups.len();
            let parents = parents(members, bodies, &slots, &groups);
            for (lane, index) in members.iter().enumerate() {
                slots[*index] = Slot { group, lane };
            }
            groups.push(BodyGroup::new(members, bodies, spins, parents));
        }
    }
    (groups, slots)
}

/// Where the parents of `members` stand.
fn parents(members: &[usize], bodies: &[Body], slots: &[Slot], groups: &[BodyGroup]) -> Parents {
    let each = std::array::from_fn(|lane| slots[bodies[*members.get(lane).unwrap_or(&members[0])].parent]);
    let Slot { group, .. } = each[0];
    let beside = members.len() == groups[group].count
        && each.iter().take(members.len()).enumerate().all(|(lane, slot)| *slot == Slot { group, lane });
    if beside || group == 0 { Parents::Beside(group) } else { Parents::Each(each) }
}
