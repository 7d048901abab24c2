//! A quantity of each body, kept side by side in the groups of the model.

use std::sync::Arc;

use super::spatial::{SpatialForce, SpatialMotion};
use crate::model::wide::{LANES, Numbers, Wide};
use crate::model::{BodyGroup, Model, Parents, Slot};

/// A quantity of each body of a model.
#[derive(Debug, Clone)]
pub struct PerBody<T, const N: usize> {
    slots: Arc<[Slot]>,
    /// One for each of the model's groups.
    pub groups: Vec<Wide<T, N>>,
    /// Those of parents that do not stand side by side.
    gathered: Wide<T, N>,
}

/// A velocity, or another motion, of each body.
pub type Motions = PerBody<SpatialMotion, 6>;

/// A force on each body.
pub type Forces = PerBody<SpatialForce, 6>;

impl<T: Numbers<N>, const N: usize> PerBody<T, N> {
    /// `value` for every body of `model`.
    pub fn new(model: &Model, value: T) -> Self {
        Self {
            slots: model.slots.clone(),
            groups: vec![Wide::all(value); model.groups.len()],
            gathered: Wide::all(value),
        }
    }

    /// Number of bodies.
    #[allow(clippy::len_without_is_empty)] // there is always the root
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// That of body `index`.
    #[inline(always)] // a number of it is often all that is wanted
    pub fn at(&self, index: usize) -> T {
        let Slot { group, lane } = self.slots[index];
        self.groups[group].at(lane % LANES)
    }

    /// Sets that of body `index`.
    #[inline(always)] // part of the kernels
    pub fn set(&mut self, index: usize, value: T) {
        let Slot { group, lane } = self.slots[index];
        self.groups[group].set(lane % LANES, value);
    }

    /// Sets the root's.
    #[inline(always)] // part of the kernels
    pub fn set_root(&mut self, value: T) {
        self.groups[0] = Wide::all(value);
    }

    /// Those of all bodies, in their order.
    pub fn iter(&self) -> impl Iterator<Item = T> + '_ {
        (0..self.len()).map(|index| self.at(index))
    }

    /// Takes those of `other`, which is of the same model.
    #[inline]
    pub fn copy_from(&mut self, other: &Self) {
        self.groups.copy_from_slice(&other.groups);
    }

    /// Those of the parents of the bodies of `group`, which is the one at `index`, and its own.
    #[inline(always)] // part of the kernels
    pub fn outward(&mut self, index: usize, group: &BodyGroup) -> (&Wide<T, N>, &mut Wide<T, N>) {
        let (before, rest) = self.groups.split_at_mut(index);
        let parents = match &group.parents {
            Parents::Beside(parents) => &before[*parents],
            Parents::Each(slots) => {
                for (lane, slot) in slots.iter().enumerate() {
                    self.gathered.copy_lane(lane, &before[slot.group], slot.lane % LANES);
                }
                &self.gathered
            }
        };
        (parents, &mut rest[0])
    }

    /// Adds `own`, a quantity of `group`'s bodies, to that of their parents. The lanes of the root's group then hold parts of a sum, if
    /// it began with [`part_root`](Self::part_root).
    #[inline(always)] // part of the kernels
    pub fn add_to_parents(&mut self, group: &BodyGroup, own: &Wide<T, N>) {
        match &group.parents {
            Parents::Beside(parents) => self.groups[*parents].add(own),
            Parents::Each(slots) => {
                for (lane, slot) in slots.iter().enumerate().take(group.count) {
                    self.groups[slot.group].add_lane(slot.lane % LANES, own, lane);
                }
            }
        }
    }

    /// Sets the first lane of the root's group to `value` and the others to zero.
    #[inline(always)] // part of the kernels
    pub fn part_root(&mut self, value: T) {
        self.groups[0] = Wide::ZERO;
        self.groups[0].set(0, value);
    }

    /// The sum over the lanes of the root's group.
    #[inline(always)] // part of the kernels
    pub fn root_sum(&self) -> T {
        self.groups[0].sum()
    }
}
