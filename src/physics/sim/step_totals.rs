//! What a step's substeps sum to.

use super::contact::Contact;
use super::workspace::Workspace;
use crate::scene::StepPlan;

/// What the substeps of a step sum to. Forces and torques are the means over several substeps; after a step of one substep the
/// workspace holds them.
#[derive(Debug, PartialEq, Default)]
pub(super) struct StepTotals {
    /// Number of substeps counted.
    substeps: u64,
    /// Greatest residual of a substep, m/s or rad/s.
    residual: f64,
    /// Greatest depth of a contact at the beginning of a substep, m.
    depth: f64,
    /// Whether the forces of a substep do not solve its problem.
    unsolved: bool,
    /// Whether the shortest substep allowed was too coarse and was accepted.
    coarse: bool,
    /// Mean torques, N m or N, one a joint.
    torques: Vec<f64>,
    /// Contacts with their slots, in ascending order of slots; forces are means over the step, N.
    contacts: Vec<(usize, Contact)>,
}

impl StepTotals {
    /// Begins another step.
    pub fn clear(&mut self) {
        (self.substeps, self.residual, self.depth) = (0, 0.0, 0.0);
        (self.unsolved, self.coarse) = (false, false);
        self.torques.clear();
        self.contacts.clear();
    }

    /// Counts the substep that `work` has just computed.
    pub fn count(&mut self, work: &Workspace) {
        self.substeps += 1;
        self.residual = self.residual.max(work.problem.residual);
        let candidates = &work.detection.candidates;
        self.depth = candidates.iter().map(|candidate| candidate.depth).fold(self.depth, f64::max);
        self.unsolved |= work.problem.unsolved;
        self.coarse |= work.coarse;
    }

    /// Adds the forces and torques of that substep, whose length is `share` of the step.
    pub fn add_forces(&mut self, work: &Workspace, plan: &StepPlan, share: f64) {
        self.torques.resize(work.drives.torque.len(), 0.0);
        for (mean, torque) in self.torques.iter_mut().zip(&work.drives.torque) {
            *mean += share * torque;
        }
        for (candidate, mut contact) in work.detection.candidates.iter().zip(work.contacts(plan)) {
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
        (self.substeps > 1).then_some(self)
    }

    /// See [`super::Simulator::residual`].
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Number of substeps.
    pub fn substeps(&self) -> u64 {
        self.substeps
    }

    /// Greatest depth of a contact at the beginning of a substep, m.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// See [`StepRecord::unsolved_steps`](super::StepRecord).
    pub fn is_unsolved(&self) -> bool {
        self.unsolved
    }

    /// See [`StepRecord::coarse_steps`](super::StepRecord).
    pub fn is_coarse(&self) -> bool {
        self.coarse
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
        (self.substeps, self.residual, self.depth) = (other.substeps, other.residual, other.depth);
        (self.unsolved, self.coarse) = (other.unsolved, other.coarse);
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
