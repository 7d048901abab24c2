//! How much memory a job may come to need: products of what was asked for, known before anything is simulated.
//!
//! The figures are upper estimates of what grows with a job; the program itself is not among them. A job that exceeds the
//! budget is refused with them, before it can take the process down and every other job with it.

use gaitwright_learning::check::{CHECKED, ROUNDS};
use gaitwright_learning::learn::{Learning, SearchMethod};
use gaitwright_physics::character::{Character, JointKind, Shape};
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::scene::{AskedAccuracy, Coordinates, Scene};

use super::request::Settings;

/// Greatest transition time that is chosen where none is given, s.
const LONGEST_CHOSEN: f64 = 0.4;

/// Generations in a second of a character that learns as fast as any.
const GENERATIONS_PER_SECOND: f64 = 50.0;

/// Longest time between two samples of a check, s; the shortest is an eighth of it.
const SAMPLED: f64 = 0.005;

/// Best behaviours that a search comes to at most.
const IMPROVEMENTS: f64 = 1000.0;

/// Contacts of a body at once.
const CONTACTS: f64 = 4.0;

/// Contacts of a character at once, in the mean over a motion.
const MOST_CONTACTS: f64 = 24.0;

/// What part of the memory is for, and how much that is.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryShare {
    /// The place in the job document that it grows with.
    pub pointer: &'static str,
    /// What it is for.
    pub what: String,
    /// Bytes.
    pub bytes: f64,
}

/// Everything that a job may come to need, the greatest first.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryEstimate(Vec<MemoryShare>);

/// Sizes of a character.
struct Size {
    links: f64,
    joints: f64,
    shapes: f64,
    vertices: f64,
}

impl Size {
    fn of(character: &Character) -> Self {
        let movable = |kind: JointKind| kind != JointKind::Fixed;
        let links = &character.links;
        let joints = links.iter().filter_map(|link| link.joint.as_ref()).filter(|joint| movable(joint.kind));
        let shapes = links.iter().flat_map(|link| &link.collisions);
        let vertices = |shape: &Shape| match shape {
            Shape::Hull { vertices, .. } => vertices.len(),
            _ => 8,
        };
        Self {
            links: links.len() as f64,
            joints: joints.count() as f64,
            shapes: shapes.clone().count() as f64,
            vertices: shapes.map(|placed| vertices(&placed.shape) as f64).sum(),
        }
    }

    /// The character in the simulator: once, and for each of `threads` what changes.
    fn simulator(&self, scene: &Scene, accuracy: &AskedAccuracy, threads: f64) -> MemoryShare {
        let Self { links, joints, shapes, vertices } = *self;
        let obstacles = scene.obstacles.len() as f64;
        let reduced = match accuracy {
            AskedAccuracy::Settings(accuracy) | AskedAccuracy::StepBySize(accuracy) => {
                accuracy.coordinates == Coordinates::Reduced
            }
            AskedAccuracy::Tolerance(_) => false,
        };
        let maximal = if reduced { 0.0 } else { 6.0 * joints };
        let rows = 3.0 * (self.contacts() + obstacles).min(256.0) + joints.min(64.0) + maximal;
        // Pairs of shapes are listed, and looked at by every simulator; so are those of shapes and obstacles.
        let pairs = 0.5 * shapes * shapes + shapes * obstacles;
        let model = 2000.0 * links + 200.0 * vertices + 20.0 * pairs;
        let one = 2500.0 * links + 16.0 * rows * rows + 100.0 * pairs;
        MemoryShare {
            pointer: "/character",
            what: format!("{links} links with {shapes} shapes in the simulator"),
            bytes: model + (threads + 4.0) * one,
        }
    }

    /// Contacts at once.
    fn contacts(&self) -> f64 {
        CONTACTS * self.shapes
    }

    /// A state of the simulator.
    fn state(&self) -> f64 {
        600.0 + 160.0 * self.joints + 100.0 * self.contacts().min(MOST_CONTACTS)
    }

    /// A sample of a motion that is played.
    fn sample(&self) -> f64 {
        400.0 + 32.0 * self.joints + 64.0 * self.links + 180.0 * self.contacts().min(MOST_CONTACTS)
    }
}

impl MemoryEstimate {
    /// Of a job that learns on `threads` threads.
    pub fn of_learning(character: &Character, settings: &Settings, threads: usize) -> Self {
        let (size, learning) = (Size::of(character), &settings.learning);
        let threads = threads as f64;
        let mut shares = vec![size.simulator(&settings.scene, &settings.accuracy, threads)];
        shares.extend(of_search(&size, learning, threads));
        shares.push(of_check(&size, learning, &settings.accuracy));
        shares.push(of_curve(&size, learning));
        Self::sorted(shares)
    }

    /// Of a character that is simulated without learning.
    pub fn of_simulation(character: &Character, scene: &Scene, accuracy: &AskedAccuracy) -> Self {
        Self::sorted(vec![Size::of(character).simulator(scene, accuracy, 1.0)])
    }

    fn sorted(mut shares: Vec<MemoryShare>) -> Self {
        shares.sort_by(|one, other| other.bytes.total_cmp(&one.bytes));
        Self(shares)
    }

    /// All of it, bytes.
    pub fn bytes(&self) -> f64 {
        self.0.iter().map(|share| share.bytes).sum()
    }

    /// Refuses what exceeds `budget` (bytes), at the place that it grows with most.
    ///
    /// # Errors
    ///
    /// With the figures of the greatest shares.
    pub fn check(&self, budget: u64) -> Result<(), InputError> {
        let needed = self.bytes();
        if needed <= budget as f64 {
            return Ok(());
        }
        let greatest: Vec<String> = self
            .0
            .iter()
            .take(3)
            .map(|share| format!("{} for {}", written(share.bytes), share.what))
            .collect();
        let reason = format!(
            "{} of memory may be needed, and {} are allowed (`serve --job-memory`): {}",
            written(needed),
            written(budget as f64),
            greatest.join(", "),
        );
        let pointer = self.0.first().map_or("", |share| share.pointer);
        Err(InputError::Impossible(vec![Fault::new(pointer, reason)]))
    }
}

/// The learner's populations, tables and caches.
fn of_search(size: &Size, learning: &Learning, threads: f64) -> Vec<MemoryShare> {
    let Learning { population, islands, states, episodes, episode_length, trunk_cells, .. } = *learning;
    let islands = if learning.search == SearchMethod::Paper { 1 } else { islands };
    let (individuals, actions) = ((islands * population) as f64, states as f64);
    let cells = f64::from(trunk_cells).powi(2);
    let situations = actions * cells + 1.0;
    let slots = situations * actions;
    let asked = f64::from(episodes) * f64::from(episode_length);
    // Two keys, the terms of the reward and the state after it.
    let transition = 2.0 * (40.0 + 2.0 * size.joints) + 160.0 + size.state();
    let own = slots.min(asked);
    let kept =
        (learning.cache_transitions as f64).min(individuals * own * f64::from(learning.cache_generations));
    let cycles = match learning.search {
        SearchMethod::Natural => 48.0 * situations * situations,
        SearchMethod::Paper => 0.0,
    };
    let genome = actions * (24.0 + 2.0 * size.joints);
    vec![
        MemoryShare {
            pointer: "/learning/states",
            what: format!(
                "the cycles of {states} states in {cells} cells of the trunk, on {threads} threads"
            ),
            bytes: threads * (cycles + 24.0 * slots + 40.0 * own),
        },
        MemoryShare {
            pointer: "/learning/population",
            what: format!("{islands} islands of {population} individuals and the transitions of each"),
            bytes: individuals * (3.0 * genome + own * transition),
        },
        MemoryShare {
            pointer: "/learning/cache_transitions",
            what: format!("{kept} transitions in the cache"),
            bytes: kept * transition,
        },
    ]
}

/// The motion played at length and looked at.
fn of_check(size: &Size, learning: &Learning, accuracy: &AskedAccuracy) -> MemoryShare {
    let transition = learning.transition_time.unwrap_or(LONGEST_CHOSEN);
    let loop_seconds = learning.states as f64 * transition;
    let seconds = CHECKED.max((1.0 + ROUNDS) * loop_seconds);
    // A sample lies on a whole step.
    let interval = match accuracy {
        AskedAccuracy::Settings(accuracy) => accuracy.step.clamp(SAMPLED / 8.0, SAMPLED),
        AskedAccuracy::StepBySize(_) | AskedAccuracy::Tolerance(_) => SAMPLED / 2.0,
    };
    MemoryShare {
        pointer: "/learning/transition_time",
        what: format!("a check of {seconds:.0} s, {ROUNDS} times round {loop_seconds:.1} s"),
        bytes: 3.0 * seconds / interval * size.sample(),
    }
}

/// The curve, in the learner, in its checkpoint and for those who watch.
fn of_curve(size: &Size, learning: &Learning) -> MemoryShare {
    let budget = learning.budget();
    let by_time = budget.seconds().map_or(f64::INFINITY, |seconds| GENERATIONS_PER_SECOND * seconds);
    let generations = budget.generations().map_or(f64::INFINITY, f64::from).min(by_time).max(1.0);
    let behaviour = learning.states as f64 * (100.0 + 60.0 * size.joints);
    MemoryShare {
        pointer: if budget.generations().is_some() { "/learning/generations" } else { "/learning/seconds" },
        what: format!("the curve of {generations:.0} generations"),
        bytes: 1000.0 * generations + 4.0 * behaviour * generations.min(IMPROVEMENTS),
    }
}

/// `bytes` in words.
fn written(bytes: f64) -> String {
    let units = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let (size, unit) = units.into_iter().find(|(size, _)| bytes >= *size).unwrap_or((1.0, "B"));
    format!("{:.1} {unit}", bytes / size)
}
