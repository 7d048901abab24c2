//! Q-learning against value iteration, and cycles against exhaustive search.

use gaitwright_learning::learn::policy::{ActionPath, Edge, best_path, greedy_path};
use gaitwright_learning::learn::qlearning::{self, ActionOutcome, Environment, QTable, Rates};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A small deterministic decision process: `moves[s][a]` is the reward and the next situation.
#[derive(Debug, Clone)]
struct Maze {
    moves: Vec<Vec<(f64, Option<usize>)>>,
    forbidden: (usize, usize),
    first: usize,
    here: usize,
}

impl Maze {
    fn random(situations: usize, actions: usize, rng: &mut ChaCha8Rng) -> Self {
        let mut step = |_| {
            let next = if rng.random_bool(0.15) { None } else { Some(rng.random_range(0..situations)) };
            (rng.random_range(-1.0..1.0), next)
        };
        let moves = (0..situations).map(|_| (0..actions).map(&mut step).collect()).collect();
        Self { moves, forbidden: (0, 0), first: 0, here: 0 }
    }

    fn edges(&self) -> Vec<Edge> {
        let mut edges = Vec::new();
        for (from, row) in self.moves.iter().enumerate() {
            for (action, &(reward, next)) in row.iter().enumerate() {
                if let (Some(to), true) = (next, self.permits(from, action)) {
                    edges.push(Edge { from, to, action, reward });
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
                    let (reward, next) = self.moves[s][a];
                    *value = reward + discount * next.map_or(0.0, |next| best[next]);
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
        let (reward, next) = self.moves[self.here][action];
        if let Some(next) = next {
            self.here = next;
        }
        Ok(ActionOutcome { reward, next })
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

/// All simple cycles that can be reached from `start`, by depth-first search: mean reward of each.
fn cycle_means(edges: &[Edge], start: usize, situations: usize) -> Vec<f64> {
    let mut reached = vec![false; situations];
    let mut open = vec![start];
    while let Some(node) = open.pop() {
        if !std::mem::replace(&mut reached[node], true) {
            open.extend(edges.iter().filter(|edge| edge.from == node).map(|edge| edge.to));
        }
    }
    fn extend(edges: &[Edge], walk: &mut Vec<Edge>, means: &mut Vec<f64>) {
        let (first, last) = (walk[0].from, walk[walk.len() - 1].to);
        if first == last {
            means.push(walk.iter().map(|edge| edge.reward).sum::<f64>() / walk.len() as f64);
            return;
        }
        for edge in edges.iter().filter(|edge| edge.from == last) {
            // Each cycle is found from its smallest situation only.
            if edge.to >= first && walk.iter().all(|earlier| earlier.from != edge.to || edge.to == first) {
                walk.push(*edge);
                extend(edges, walk, means);
                walk.pop();
            }
        }
    }
    let mut means = Vec::new();
    for edge in edges.iter().filter(|edge| reached[edge.from] && edge.to >= edge.from) {
        extend(edges, &mut vec![*edge], &mut means);
    }
    means
}

/// Mean reward of a path's cycle, after checking that the path can be walked.
fn walk(maze: &Maze, path: &ActionPath, start: usize) -> f64 {
    let mut here = start;
    let mut go = |action: usize| {
        assert!(maze.permits(here, action));
        let (reward, next) = maze.moves[here][action];
        here = next.expect("a path never walks into an end");
        (reward, here)
    };
    let entered = path.entry.iter().fold(start, |_, &action| go(action).1);
    let total: f64 = path.cycle.iter().map(|&action| go(action).0).sum();
    assert_eq!(here, entered, "a cycle ends where it began");
    total / path.cycle.len() as f64
}

#[test]
fn best_path_is_the_best_of_all_cycles() {
    let mut with_cycle = 0;
    for seed in 0..300 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let size = rng.random_range(1..=5);
        let actions = rng.random_range(1..=3);
        let maze = Maze::random(size, actions, &mut rng);
        let best = cycle_means(&maze.edges(), 0, size).into_iter().reduce(f64::max);
        let found = best_path(size, &maze.edges(), 0);
        assert_eq!(best.is_some(), found.is_some(), "seed {seed}");
        if let (Some(best), Some(found)) = (best, found) {
            assert!((walk(&maze, &found, 0) - best).abs() < 1e-12, "seed {seed}");
            with_cycle += 1;
        }
    }
    assert!(with_cycle > 100, "most of these mazes have a cycle");
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
        walk(&maze, &path, 0);
        // Following it for ever earns what value iteration says the start is worth.
        let optimal = maze.optimal(rates.discount);
        let worth = (0..3).filter(|&a| maze.permits(0, a)).map(|a| optimal[0][a]).fold(f64::MIN, f64::max);
        let (mut here, mut earned, mut factor) = (0, 0.0, 1.0);
        for &action in path.entry.iter().chain(path.cycle.iter().cycle().take(400)) {
            let (reward, next) = maze.moves[here][action];
            earned += factor * reward;
            factor *= rates.discount;
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
