//! What a step's substeps sum to.

use super::contact::Contact;
use super::workspace::Workspace;
use crate::scene::StepPlan;

/// Forces and torques over a step of several substeps, as the means over these. After a step of one substep it is
/// empty, and the workspace holds the values.
#[derive(Debug, PartialEq, Default)]
pub(super) struct StepTotals {
    /// Number of substeps added.
    substeps: usize,
    /// Greatest residual of a substep, m/s or rad/s.
    residual: f64,
    /// Mean torques, N m or N, one a joint.
    torques: Vec<f64>,
    /// Contacts with their slots, in ascending order of slots; forces are means over the step, N.
    contacts: Vec<(usize, Contact)>,
}

impl StepTotals {
    /// Begins another step.
    pub fn clear(&mut self) {
        self.substeps = 0;
        self.residual = 0.0;
        self.torques.clear();
        self.contacts.clear();
    }

    /// Adds the substep that `work` has just computed, whose length is `share` of the step.
    pub fn add(&mut self, work: &Workspace, plan: &StepPlan, share: f64) {
        self.substeps += 1;
        self.residual = self.residual.max(work.residual);
        self.torques.resize(work.torque.len(), 0.0);
        for (mean, torque) in self.torques.iter_mut().zip(&work.torque) {
            *mean += share * torque;
        }
        for (candidate, mut contact) in work.candidates.iter().zip(work.contacts(plan)) {
            contact.force *= share;
            let after = self.contacts.partition_point(|(slot, _)| *slot < candidate.slot);
            let same = self.contacts[after..]
                .iter_mut()
                .take_while(|(slot, _)| *slot == candidate.slot)
                .find(|(_, known)| (known.link, known.against) == (contact.link, contact.against));
            match same {
                Some((_, known)) => join(known, &contact),
                None => self.contacts.insert(after, (candidate.slot, contact)),
            }
        }
    }

    /// The sums, if there were several substeps.
    pub fn of_substeps(&self) -> Option<&Self> {
        (self.substeps > 0).then_some(self)
    }

    /// See [`super::Simulator::residual`].
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// See [`super::Simulator::torques`].
    pub fn torques(&self) -> &[f64] {
        &self.torques
    }

    /// See [`super::Simulator::contacts`].
    pub fn contacts(&self) -> impl Iterator<Item = Contact> + '_ {
        self.contacts.iter().map(|(_, contact)| *contact)
    }
}

impl Clone for StepTotals {
    fn clone(&self) -> Self {
        Self { torques: self.torques.clone(), contacts: self.contacts.clone(), ..*self }
    }

    /// Without allocating where there is room.
    fn clone_from(&mut self, other: &Self) {
        (self.substeps, self.residual) = (other.substeps, other.residual);
        self.torques.clone_from(&other.torques);
        self.contacts.clone_from(&other.contacts);
    }
}

/// Adds the contact `later` of a later substep to `known`: forces add up, and the position is their centre.
fn join(known: &mut Contact, later: &Contact) {
    let [before, now] = [&*known, later].map(|contact| contact.force.dot(&contact.normal).max(0.0));
    let share = if before > 0.0 { now / (before + now) } else { 1.0 };
    let along = known.normal.lerp(&later.normal, share);
    known.position += (later.position - known.position) * share;
    known.normal = along.try_normalize(f64::MIN_POSITIVE).unwrap_or(later.normal);
    known.force += later.force;
    known.velocity = later.velocity;
    known.depth = known.depth.max(later.depth);
}
