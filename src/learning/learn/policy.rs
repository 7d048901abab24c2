//! From values to behaviour: the cycle in which the greedy policy ends.

use super::qlearning::{Environment, QTable};

/// A sequence of actions: `entry` once, then `cycle` repeated. An empty cycle means that the sequence ends, by a fall or
/// in a situation that permits no action.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ActionPath {
    /// Actions from the start into the cycle.
    pub entry: Vec<usize>,
    /// Actions of the cycle.
    pub cycle: Vec<usize>,
}

impl ActionPath {
    /// Whether both have the same cycle, wherever they enter it.
    pub fn same_cycle(&self, other: &Self) -> bool {
        let (ours, theirs) = (&self.cycle, &other.cycle);
        ours.len() == theirs.len()
            && (0..ours.len().max(1))
                .any(|shift| ours.iter().cycle().skip(shift).zip(theirs).all(|(a, b)| a == b))
    }
}

/// Follows the greedy policy from the start until a situation comes back: with finitely many
/// situations and one action in each, it ends in a cycle.
///
/// # Errors
/// The environment's reason to break off.
pub fn greedy_path<E: Environment>(environment: &mut E, table: &QTable) -> Result<ActionPath, E::Break> {
    let mut first_seen = vec![None; environment.situations()];
    let mut actions = Vec::new();
    let mut situation = environment.start();
    loop {
        if let Some(start) = first_seen[situation] {
            let cycle = actions.split_off(start);
            return Ok(ActionPath { entry: actions, cycle });
        }
        first_seen[situation] = Some(actions.len());
        let Some(action) = table.greedy(environment, situation) else { break };
        actions.push(action);
        match environment.act(action)?.next {
            Some(next) => situation = next,
            None => break,
        }
    }
    Ok(ActionPath { entry: actions, cycle: Vec::new() })
}
