//! What a step's substeps sum to.

use super::contact::Contact;

/// What a substep leaves to be counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    /// Residual, m/s or rad/s.
    pub residual: f64,
    /// Greatest depth of a contact at its beginning, m.
    pub depth: f64,
    /// Whether its forces do not solve its problem.
    pub unsolved: bool,
    /// Whether it was too coarse and was accepted.
    pub coarse: bool,
}

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
    /// Whether the shortest substep or trial allowed was too coarse and was accepted.
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

    /// Counts a substep.
    pub fn count(&mut self, substep: Counts) {
        self.substeps += 1;
        self.residual = self.residual.max(substep.residual);
        self.depth = self.depth.max(substep.depth);
        self.unsolved |= substep.unsolved;
        self.coarse |= substep.coarse;
    }

    /// Notes that the shortest trial allowed missed the error tolerance and was accepted.
    pub fn accept_coarse(&mut self) {
        self.coarse = true;
    }

    /// Adds the `torques` (N m or N, one a joint) and `contacts` with their slots of that substep, whose length is `share` of the
    /// step.
    pub fn add_forces(
        &mut self,
        torques: &[f64],
        contacts: impl Iterator<Item = (usize, Contact)>,
        share: f64,
    ) {
        self.torques.resize(torques.len(), 0.0);
        for (mean, torque) in self.torques.iter_mut().zip(torques) {
            *mean += share * torque;
        }
        for (slot, mut contact) in contacts {
            contact.force *= share;
            let after = self.contacts.partition_point(|(known, _)| *known < slot);
            let same = self.contacts[after..]
                .iter_mut()
                .take_while(|(known, _)| *known == slot)
                .find(|(_, known)| (known.link, known.against) == (contact.link, contact.against));
            match same {
                Some((_, known)) => join(known, &contact),
                None => self.contacts.insert(after, (slot, contact)),
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
