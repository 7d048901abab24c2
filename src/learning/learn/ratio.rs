//! The cycle of greatest reward per time among known transitions.

use std::collections::VecDeque;

use super::policy::ActionPath;

/// Rounds in which prices for what cancels out are looked for.
const ROUNDS: u32 = 16;
/// Share of the greatest weight of an edge that counts as nothing.
const ROUNDING: f64 = 1e-13;
/// Edges walked at most in the search of what prices leave open.
const WALKED: u32 = 20_000;

/// A known transition from one situation to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Situation before.
    pub from: usize,
    /// Situation after.
    pub to: usize,
    /// Action that leads there.
    pub action: usize,
    /// What it earns for itself.
    pub reward: f64,
    /// What is charged by the size of its sum over a whole cycle.
    pub signed: [f64; 3],
    /// How long it takes, positive.
    pub time: f64,
}

/// What a cycle of these edges earns per time: Σ reward − Σᵢ |Σ signedᵢ|, over Σ time.
pub fn worth(cycle: &[Edge]) -> f64 {
    let reward: f64 = cycle.iter().map(|edge| edge.reward).sum();
    let charged: f64 = sums(cycle).map(f64::abs).iter().sum();
    (reward - charged) / time(cycle)
}

fn sums(cycle: &[Edge]) -> [f64; 3] {
    std::array::from_fn(|index| cycle.iter().map(|edge| edge.signed[index]).sum())
}

fn time(cycle: &[Edge]) -> f64 {
    cycle.iter().map(|edge| edge.time).sum()
}

/// The cycle of greatest worth that is found among those that can be reached from `start` over `edges`, with the shortest
/// path into it; `None` if no cycle can be reached.
///
/// Where nothing is charged by its size over the cycle, it is the best of all ([`greatest_ratio`]). Otherwise |s| is the
/// greatest of p s for prices p from −1 to 1, so that the best ratio at any prices is at least the best worth (Lagrange's
/// bound). Prices are moved against what the best cycle at them sums up to, until a cycle's worth is its ratio, which no
/// other can exceed, or for a few rounds. What the least bound leaves open is then searched cycle by cycle, so that the best
/// of all is found unless there are too many left.
pub fn best_path(situations: usize, edges: &[Edge], start: usize) -> Option<ActionPath> {
    let paths = shortest_paths(situations, edges, start);
    let reached: Vec<Edge> = edges.iter().filter(|edge| paths[edge.from].is_some()).copied().collect();
    let cycle = best_cycle(situations, &reached)?;
    let entry = |node: usize| paths[node].as_ref().map(|path| path.len());
    let (first, _) = cycle.iter().enumerate().min_by_key(|(_, edge)| entry(edge.from))?;
    let actions: Vec<usize> = cycle[first..].iter().chain(&cycle[..first]).map(|edge| edge.action).collect();
    Some(ActionPath { entry: paths[cycle[first].from].clone()?, cycle: actions })
}

fn best_cycle(situations: usize, edges: &[Edge]) -> Option<Vec<Edge>> {
    let mut prices = [0.0; 3];
    let mut best: Option<(f64, Vec<Edge>)> = None;
    let mut least: Option<(f64, [f64; 3])> = None;
    for round in 1..=ROUNDS {
        let priced = |edge: &Edge| {
            let charged: f64 = prices.iter().zip(edge.signed).map(|(price, signed)| price * signed).sum();
            edge.reward - charged
        };
        let cycle = greatest_ratio(situations, edges, priced)?;
        let bound = cycle.iter().map(priced).sum::<f64>() / time(&cycle);
        let (own, sums) = (worth(&cycle), sums(&cycle));
        if best.as_ref().is_none_or(|(known, _)| own > *known) {
            best = Some((own, cycle));
        }
        if own >= bound - ROUNDING * bound.abs() {
            least = None;
            break;
        }
        if least.is_none_or(|(known, _)| bound < known) {
            least = Some((bound, prices));
        }
        for (price, sum) in prices.iter_mut().zip(sums) {
            if sum != 0.0 {
                *price = (*price + sum.signum() / f64::from(round)).clamp(-1.0, 1.0);
            }
        }
    }
    let (worth, cycle) = best?;
    let Some((bound, prices)) = least else { return Some(cycle) };
    let mut rest = Rest::new(situations, edges, (bound, prices), (worth, cycle));
    for start in 0..situations {
        rest.extend(start, start, (0.0, 0.0));
    }
    Some(rest.best.1)
}

/// What is left to be searched where the best cycle at some prices is worth less than their bound.
struct Rest<'a> {
    /// Edges that leave each situation, with what each takes from the bound.
    leaving: Vec<Vec<(&'a Edge, f64)>>,
    bound: f64,
    /// Greatest time of an edge.
    longest: f64,
    /// Worth and edges.
    best: (f64, Vec<Edge>),
    walk: Vec<Edge>,
    visited: Vec<bool>,
    /// Edges that may still be walked.
    left: u32,
}

impl<'a> Rest<'a> {
    fn new(
        situations: usize,
        edges: &'a [Edge],
        (bound, prices): (f64, [f64; 3]),
        best: (f64, Vec<Edge>),
    ) -> Self {
        // At the bound no cycle has a positive weight, so that the greatest weights of walks settle.
        let weight = |edge: &Edge| {
            let charged: f64 = prices.iter().zip(edge.signed).map(|(price, signed)| price * signed).sum();
            edge.reward - charged - bound * edge.time
        };
        let mut greatest = vec![0.0_f64; situations];
        for _ in 0..situations {
            for edge in edges {
                greatest[edge.to] = greatest[edge.to].max(greatest[edge.from] + weight(edge));
            }
        }
        let mut leaving = vec![Vec::new(); situations];
        for edge in edges {
            let taken = greatest[edge.to] - greatest[edge.from] - weight(edge);
            leaving[edge.from].push((edge, taken.max(0.0)));
        }
        let longest = edges.iter().map(|edge| edge.time).fold(0.0, f64::max);
        let visited = vec![false; situations];
        Self { leaving, bound, longest, best, walk: Vec::new(), visited, left: WALKED }
    }

    /// Every cycle through `start` and situations after it that begins with the present walk, which ends in `node` and has
    /// taken so much from the bound in so much time, and which can be better than the best.
    fn extend(&mut self, start: usize, node: usize, (taken, time): (f64, f64)) {
        self.visited[node] = true;
        for index in 0..self.leaving[node].len() {
            let (edge, more) = self.leaving[node][index];
            if self.left == 0 || edge.to < start || (self.visited[edge.to] && edge.to != start) {
                continue;
            }
            let (taken, time) = (taken + more, time + edge.time);
            // A cycle is worth at most the bound less what is taken from it per time.
            let most = time + self.longest * (self.visited.len() - self.walk.len()) as f64;
            if taken >= (self.bound - self.best.0) * most {
                continue;
            }
            self.left -= 1;
            self.walk.push(*edge);
            if edge.to == start {
                let own = worth(&self.walk);
                if own > self.best.0 {
                    self.best = (own, self.walk.clone());
                }
            } else {
                self.extend(start, edge.to, (taken, time));
            }
            self.walk.pop();
        }
        self.visited[node] = false;
    }
}

/// The cycle whose sum of `reward` over its sum of time is greatest; `None` where there is no cycle.
///
/// Lawler 1967 ("Optimal cycles in doubly weighted directed linear graphs"): a cycle of a greater ratio than λ is one of
/// positive Σ (reward − λ time), which Bellman's and Ford's relaxation finds. λ is then that cycle's own ratio (Newton's
/// step, Dinkelbach 1967), so that it grows from one cycle's ratio to another's until none is greater: exact up to
/// rounding.
pub fn greatest_ratio(situations: usize, edges: &[Edge], reward: impl Fn(&Edge) -> f64) -> Option<Vec<Edge>> {
    let ratio = |cycle: &[Edge]| cycle.iter().map(&reward).sum::<f64>() / time(cycle);
    // Below the ratio of every edge, and so of every cycle.
    let least = edges.iter().map(|edge| reward(edge) / edge.time).fold(f64::INFINITY, f64::min);
    let mut best = positive_cycle(situations, edges, |edge| reward(edge) - (least - 1.0) * edge.time)?;
    loop {
        let known = ratio(&best);
        match positive_cycle(situations, edges, |edge| reward(edge) - known * edge.time) {
            Some(cycle) if ratio(&cycle) > known => best = cycle,
            _ => return Some(best),
        }
    }
}

/// A cycle of positive weight, if there is one.
fn positive_cycle(situations: usize, edges: &[Edge], weight: impl Fn(&Edge) -> f64) -> Option<Vec<Edge>> {
    let weights: Vec<f64> = edges.iter().map(weight).collect();
    // A cycle whose weight is nothing but rounding must not hide one that has some.
    let rounding = ROUNDING * weights.iter().map(|weight| weight.abs()).fold(0.0, f64::max);
    // The greatest weight of a walk that ends in a situation, and its last edge.
    let mut greatest = vec![0.0; situations];
    let mut last: Vec<Option<usize>> = vec![None; situations];
    let mut changed = None;
    for _ in 0..=situations {
        changed = None;
        for (index, (edge, weight)) in edges.iter().zip(&weights).enumerate() {
            let through = greatest[edge.from] + weight;
            if through > greatest[edge.to] + rounding {
                greatest[edge.to] = through;
                last[edge.to] = Some(index);
                changed = Some(edge.to);
            }
        }
        changed?;
    }
    // After as many rounds as there are situations, what still grows does so round a cycle.
    let mut node = changed?;
    for _ in 0..situations {
        node = edges[last[node]?].from;
    }
    let mut cycle = Vec::new();
    let end = node;
    loop {
        let edge = edges[last[node]?];
        cycle.push(edge);
        node = edge.from;
        if node == end {
            cycle.reverse();
            return Some(cycle);
        }
    }
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
