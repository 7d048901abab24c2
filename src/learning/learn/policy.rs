//! From values to behaviour: the cycle in which the greedy policy ends, and the cycle of greatest mean reward.

use std::collections::VecDeque;

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

/// A known transition from one situation to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Situation before.
    pub from: usize,
    /// Situation after.
    pub to: usize,
    /// Action that leads there.
    pub action: usize,
    /// Its reward.
    pub reward: f64,
}

/// The cycle of maximum mean reward among those that can be reached from `start` over `edges`, with
/// the shortest path into it (Karp 1978, "A characterization of the minimum cycle mean in a digraph").
/// `None` if no cycle can be reached. Exact up to rounding; O(situations × edges).
pub fn best_path(situations: usize, edges: &[Edge], start: usize) -> Option<ActionPath> {
    let paths = shortest_paths(situations, edges, start);
    let reached: Vec<Edge> = edges.iter().filter(|edge| paths[edge.from].is_some()).copied().collect();
    let walk = extreme_walk(situations, &reached)?;
    let cycle = best_cycle_in(&walk)?;
    let entry = |node: usize| paths[node].as_ref().map(|path| path.len());
    let (first, _) = cycle.iter().enumerate().min_by_key(|(_, edge)| entry(edge.from))?;
    let actions: Vec<usize> = cycle[first..].iter().chain(&cycle[..first]).map(|edge| edge.action).collect();
    Some(ActionPath { entry: paths[cycle[first].from].clone()?, cycle: actions })
}

/// Mean reward of consecutive edges.
fn mean(edges: &[Edge]) -> f64 {
    edges.iter().map(|edge| edge.reward).sum::<f64>() / edges.len() as f64
}

/// Actions of a shortest path from `start` to every situation; `None` where there is none (breadth-first search).
fn shortest_paths(situations: usize, edges: &[Edge], start: usize) -> Vec<Option<Vec<usize>>> {
    let mut leaving = vec![Vec::new(); situations];
    for edge in edges {
        leaving[edge.from].push(edge);
    }
    let mut paths: Vec<Option<Vec<usize>>> = vec![None; situations];
    paths[start] = Some(Vec::new());
    let mut queue = VecDeque::from([(start, Vec::new())]);
    while let Some((node, path)) = queue.pop_front() {
        for edge in &leaving[node] {
            if paths[edge.to].is_none() {
                let mut longer = path.clone();
                longer.push(edge.action);
                paths[edge.to] = Some(longer.clone());
                queue.push_back((edge.to, longer));
            }
        }
    }
    paths
}

/// The walk of n edges, n being the number of situations, at whose end Karp's quotient min over k < n of
/// (Dₙ − Dₖ) / (n − k) is greatest; Dₖ is the greatest reward of a walk of k edges to there. A cycle on it has the
/// maximum mean reward.
fn extreme_walk(situations: usize, edges: &[Edge]) -> Option<Vec<Edge>> {
    // best[k][v]: greatest reward of a walk of k edges that ends in v, wherever it starts.
    let mut best = vec![vec![0.0; situations]];
    let mut last = Vec::with_capacity(situations);
    for _ in 0..situations {
        let shorter = &best[best.len() - 1];
        let mut longer = vec![f64::NEG_INFINITY; situations];
        let mut through: Vec<Option<Edge>> = vec![None; situations];
        for edge in edges {
            let reward = shorter[edge.from] + edge.reward;
            if reward > longer[edge.to] {
                longer[edge.to] = reward;
                through[edge.to] = Some(*edge);
            }
        }
        best.push(longer);
        last.push(through);
    }
    let quotient = |v: usize| {
        let whole = best[situations][v];
        (0..situations)
            .filter(|&k| best[k][v] > f64::NEG_INFINITY)
            .map(|k| (whole - best[k][v]) / (situations - k) as f64)
            .fold(f64::INFINITY, f64::min)
    };
    let ends = (0..situations).filter(|&v| best[situations][v] > f64::NEG_INFINITY);
    let mut node = ends.max_by(|&a, &b| quotient(a).total_cmp(&quotient(b)))?;
    let mut walk = Vec::with_capacity(situations);
    for through in last.iter().rev() {
        let edge = through[node]?;
        walk.push(edge);
        node = edge.from;
    }
    walk.reverse();
    Some(walk)
}

/// The simple cycle of greatest mean reward that the walk contains.
fn best_cycle_in(walk: &[Edge]) -> Option<Vec<Edge>> {
    let mut open: Vec<Edge> = Vec::new();
    let mut best: Option<Vec<Edge>> = None;
    for edge in walk {
        open.push(*edge);
        if let Some(start) = open.iter().position(|earlier| earlier.from == edge.to) {
            let cycle = open.split_off(start);
            if best.as_ref().is_none_or(|known| mean(&cycle) > mean(known)) {
                best = Some(cycle);
            }
        }
    }
    best
}
