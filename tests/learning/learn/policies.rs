//! Q-learning against value iteration, and cycles against exhaustive search.

use gaitwright_learning::learn::policy::{ActionPath, greedy_path};
use gaitwright_learning::learn::qlearning::{self, ActionOutcome, Environment, QTable, Rates};
use gaitwright_learning::learn::ratio::{Edge, best_path, greatest_ratio, worth};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What an action earns, where it leads, and how long it takes.
type Move = (f64, Option<usize>, f64);

/// A small deterministic decision process: `moves[s][a]`.
#[derive(Debug, Clone)]
struct Maze {
    moves: Vec<Vec<Move>>,
    forbidden: (usize, usize),
    first: usize,
    here: usize,
}

impl Maze {
    fn random(situations: usize, actions: usize, rng: &mut ChaCha8Rng) -> Self {
        let mut step = |_| {
            let next = if rng.random_bool(0.15) { None } else { Some(rng.random_range(0..situations)) };
            (rng.random_range(-1.0..1.0), next, f64::from(rng.random_range(1..=6)) / 2.0)
        };
        let moves = (0..situations).map(|_| (0..actions).map(&mut step).collect()).collect();
        Self { moves, forbidden: (0, 0), first: 0, here: 0 }
    }

    fn edges(&self) -> Vec<Edge> {
        let mut edges = Vec::new();
        for (from, row) in self.moves.iter().enumerate() {
            for (action, &(reward, next, time)) in row.iter().enumerate() {
                if let (Some(to), true) = (next, self.permits(from, action)) {
                    edges.push(Edge { from, to, action, reward, signed: [0.0; 3], time });
                }
            }
        }
        edges
    }

    /// Q* by value iteration to machine precision.
    fn optimal(&self, discount: f64) -> Vec<Vec<f64>> {
        let mut q = vec![vec![0.0; self.actions()]; self.situations()];
        for _ in 0..2000 {
            let best: Vec<f64> = (0..self.situations())
                .map(|s| {
                    let permitted = (0..self.actions()).filter(|&a| self.permits(s, a));
                    permitted.map(|a| q[s][a]).fold(f64::NEG_INFINITY, f64::max)
                })
                .collect();
            for (s, row) in q.iter_mut().enumerate() {
                for (a, value) in row.iter_mut().enumerate().filter(|(a, _)| self.permits(s, *a)) {
                    let (reward, next, time) = self.moves[s][a];
                    *value = reward + discount.powf(time) * next.map_or(0.0, |next| best[next]);
                }
            }
        }
        q
    }
}

impl Environment for Maze {
    type Break = ();
    fn situations(&self) -> usize {
        self.moves.len()
    }
    fn actions(&self) -> usize {
        self.moves[0].len()
    }
    fn start(&mut self) -> usize {
        // Each episode starts somewhere else, so that every situation is learned.
        self.first = (self.first + 1) % self.moves.len();
        self.here = self.first;
        self.here
    }
    fn permits(&self, situation: usize, action: usize) -> bool {
        (situation, action) != self.forbidden
    }
    fn act(&mut self, action: usize) -> Result<ActionOutcome, ()> {
        let (reward, next, duration) = self.moves[self.here][action];
        if let Some(next) = next {
            self.here = next;
        }
        Ok(ActionOutcome { reward, next, duration })
    }
}

#[test]
fn q_learning_finds_what_value_iteration_finds() {
    for seed in 0..20 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut maze = Maze::random(5, 3, &mut rng);
        let rates =
            Rates { episodes: 4000, episode_length: 20, learning_rate: 0.5, discount: 0.8, exploration: 0.6 };
        let mut table = QTable::new(&maze);
        qlearning::learn(&mut maze, &mut table, &rates, &mut rng).unwrap();
        let optimal = maze.optimal(rates.discount);
        for (s, row) in optimal.iter().enumerate() {
            for (a, value) in row.iter().enumerate() {
                if maze.permits(s, a) {
                    assert!(
                        (table.value(s, a) - value).abs() < 1e-6,
                        "seed {seed}: Q({s}, {a}) = {} and not {value}",
                        table.value(s, a)
                    );
                } else {
                    assert_eq!(table.value(s, a), 0.0, "a forbidden action is never tried");
                }
            }
        }
    }
}

/// All simple cycles that can be reached from `start`, by depth-first search.
fn cycles(edges: &[Edge], start: usize, situations: usize) -> Vec<Vec<Edge>> {
    let mut reached = vec![false; situations];
    let mut open = vec![start];
    while let Some(node) = open.pop() {
        if !std::mem::replace(&mut reached[node], true) {
            open.extend(edges.iter().filter(|edge| edge.from == node).map(|edge| edge.to));
        }
    }
    fn extend(edges: &[Edge], walk: &mut Vec<Edge>, found: &mut Vec<Vec<Edge>>) {
        let (first, last) = (walk[0].from, walk[walk.len() - 1].to);
        if first == last {
            found.push(walk.clone());
            return;
        }
        for edge in edges.iter().filter(|edge| edge.from == last) {
            // Each cycle is found from its smallest situation only.
            if edge.to >= first
                && edge.to != last
                && walk.iter().all(|earlier| earlier.from != edge.to || edge.to == first)
            {
                walk.push(*edge);
                extend(edges, walk, found);
                walk.pop();
            }
        }
    }
    let mut found = Vec::new();
    for edge in edges.iter().filter(|edge| reached[edge.from] && edge.to >= edge.from) {
        extend(edges, &mut vec![*edge], &mut found);
    }
    found
}

/// The edges of a path's cycle, after checking that the path can be walked.
fn walk(edges: &[Edge], path: &ActionPath, start: usize) -> Vec<Edge> {
    let mut here = start;
    let mut go = |action: &usize| {
        let edge = edges.iter().find(|edge| edge.from == here && edge.action == *action);
        let edge = *edge.expect("a path never walks into an end");
        here = edge.to;
        edge
    };
    let entered = path.entry.iter().map(&mut go).last().map_or(start, |edge| edge.to);
    let cycle: Vec<Edge> = path.cycle.iter().map(&mut go).collect();
    assert_eq!(here, entered, "a cycle ends where it began");
    cycle
}

#[test]
fn best_path_is_the_best_of_all_cycles() {
    let mut with_cycle = 0;
    for seed in 0..400 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let size = rng.random_range(1..=6);
        let actions = rng.random_range(1..=3);
        let edges = Maze::random(size, actions, &mut rng).edges();
        let best = cycles(&edges, 0, size).iter().map(|cycle| worth(cycle)).reduce(f64::max);
        let found = best_path(size, &edges, 0);
        assert_eq!(best.is_some(), found.is_some(), "seed {seed}");
        if let (Some(best), Some(found)) = (best, found) {
            let own = worth(&walk(&edges, &found, 0));
            assert!((own - best).abs() < 1e-11, "seed {seed}: {own} instead of {best}");
            with_cycle += 1;
        }
    }
    assert!(with_cycle > 150, "most of these mazes have a cycle");
}

#[test]
fn the_ratio_is_of_sums_and_not_a_mean_of_ratios() {
    let edge = |from, to, reward, time| Edge { from, to, action: to, reward, signed: [0.0; 3], time };
    // 0 → 1 → 0 earns 1 + 1 in 1 + 1; 0 → 2 → 0 earns 0 + 5 in 0.5 + 4; 2 → 2 earns 1 in 1.
    let edges = [
        edge(0, 1, 1.0, 1.0),
        edge(1, 0, 1.0, 1.0),
        edge(0, 2, 0.0, 0.5),
        edge(2, 0, 5.0, 4.0),
        edge(2, 2, 1.0, 1.0),
    ];
    let found = best_path(3, &edges, 0).unwrap();
    assert_eq!((found.entry.as_slice(), found.cycle.as_slice()), (&[][..], &[2, 0][..]));
    assert!((worth(&edges[2..4]) - 5.0 / 4.5).abs() < 1e-15);
    // Charged by the size of a sum, what cancels out costs nothing, and what does not costs what it is.
    let mut swaying = edges;
    swaying[0].signed = [0.5, 0.0, -0.4];
    swaying[1].signed = [-0.5, 0.1, 0.4];
    swaying[2].signed = [-0.3, 0.2, 0.0];
    swaying[3].signed = [-0.3, 0.2, 0.0];
    assert!((worth(&swaying[..2]) - 1.9 / 2.0).abs() < 1e-15);
    assert!((worth(&swaying[2..4]) - 4.0 / 4.5).abs() < 1e-15);
    let alone = best_path(3, &swaying[..4], 0).unwrap();
    assert_eq!(alone.cycle.len(), 2);
    assert!((worth(&walk(&swaying, &alone, 0)) - 0.95).abs() < 1e-12, "the one that sways and comes back");
}

#[test]
fn a_cycle_charged_as_a_whole_is_the_best_of_all() {
    let mut all = 0;
    for seed in 0..300 {
        let mut rng = ChaCha8Rng::seed_from_u64(3000 + seed);
        let size = rng.random_range(2..=6);
        let mut edges = Maze::random(size, 3, &mut rng).edges();
        for edge in &mut edges {
            edge.signed = std::array::from_fn(|_| rng.random_range(-0.5..0.5));
        }
        let Some(found) = best_path(size, &edges, 0) else { continue };
        let best = cycles(&edges, 0, size).iter().map(|cycle| worth(cycle)).fold(f64::MIN, f64::max);
        let own = worth(&walk(&edges, &found, 0));
        assert!((own - best).abs() < 1e-11, "seed {seed}: {own} instead of {best}");
        // At no prices is the best ratio less than the best worth.
        for _ in 0..5 {
            let prices: [f64; 3] = std::array::from_fn(|_| rng.random_range(-1.0..=1.0));
            let priced = |edge: &Edge| {
                edge.reward
                    - prices.iter().zip(edge.signed).map(|(price, signed)| price * signed).sum::<f64>()
            };
            let cycle = greatest_ratio(size, &edges, priced).unwrap();
            let bound =
                cycle.iter().map(priced).sum::<f64>() / cycle.iter().map(|edge| edge.time).sum::<f64>();
            // Cycles that cannot be reached count for the bound alone.
            assert!(bound >= best - 1e-11, "seed {seed}");
        }
        all += 1;
    }
    assert!(all > 200, "most of these mazes have a cycle");
}

#[test]
fn the_greedy_path_of_optimal_values_is_an_optimal_path() {
    let mut cyclic = 0;
    for seed in 0..50 {
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        let mut maze = Maze::random(5, 3, &mut rng);
        let rates =
            Rates { episodes: 3000, episode_length: 20, learning_rate: 1.0, discount: 0.9, exploration: 0.8 };
        let mut table = QTable::new(&maze);
        qlearning::learn(&mut maze, &mut table, &rates, &mut rng).unwrap();
        maze.first = maze.moves.len() - 1; // so that the path starts at 0
        let path = greedy_path(&mut maze, &table).unwrap();
        if path.cycle.is_empty() {
            continue;
        }
        cyclic += 1;
        walk(&maze.edges(), &path, 0);
        // Following it for ever earns what value iteration says the start is worth.
        let optimal = maze.optimal(rates.discount);
        let worth = (0..3).filter(|&a| maze.permits(0, a)).map(|a| optimal[0][a]).fold(f64::MIN, f64::max);
        let (mut here, mut earned, mut factor) = (0, 0.0, 1.0);
        for &action in path.entry.iter().chain(path.cycle.iter().cycle().take(1000)) {
            let (reward, next, time) = maze.moves[here][action];
            earned += factor * reward;
            factor *= rates.discount.powf(time);
            here = next.unwrap();
        }
        assert!((earned - worth).abs() < 1e-9, "seed {seed}: {earned} instead of {worth}");
    }
    assert!(cyclic > 20);
}

#[test]
fn cycles_are_compared_wherever_they_start() {
    let path = |cycle: &[usize]| ActionPath { entry: vec![0], cycle: cycle.to_vec() };
    assert!(path(&[1, 2, 3]).same_cycle(&path(&[3, 1, 2])));
    assert!(!path(&[1, 2, 3]).same_cycle(&path(&[1, 3, 2])));
    assert!(!path(&[1, 2]).same_cycle(&path(&[1, 2, 1, 2])));
}
