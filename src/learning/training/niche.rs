//! Niches: the ways of going and the speeds that a task calls for.

use crate::learn::{Pace, Task};
use crate::program::gaits::{NamedGait, ways};
use crate::program::subject::Subject;

/// Factors of the usual Froude number at which the speed that costs least is looked for as well.
const COMFORT: [f64; 2] = [0.6, 1.6];
/// Most ways of going that compete where a speed is asked for and no gait.
const RIVALS: usize = 4;

/// What one motion of the repertoire is to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Niche {
    /// What it is called: unique among the niches of a task.
    pub name: String,
    /// How to go.
    pub gait: NamedGait,
    /// How fast.
    pub pace: NichePace,
}

/// How fast the motion of a niche is to be.
#[derive(Debug, Clone, PartialEq)]
pub enum NichePace {
    /// At the one of these Froude numbers that costs least.
    Cheapest {
        /// The one that is looked at first.
        first: f64,
        /// All others.
        others: Vec<f64>,
    },
    /// As fast as can be.
    Fastest {
        /// The Froude number from which on greater ones are tried.
        first: f64,
    },
}

impl Niche {
    fn comfortable(gait: NamedGait) -> Self {
        let [_, first, _] = gait.froude;
        let others = COMFORT.map(|factor| gait.suited(factor * first));
        let others = others.into_iter().filter(|&froude| froude != first).collect();
        Self { name: gait.name.to_owned(), gait, pace: NichePace::Cheapest { first, others } }
    }

    fn at(gait: NamedGait, froude: f64) -> Self {
        Self {
            name: gait.name.to_owned(),
            gait,
            pace: NichePace::Cheapest { first: froude, others: Vec::new() },
        }
    }

    fn fastest(gait: NamedGait) -> Self {
        let [_, first, _] = gait.froude;
        Self { name: format!("fastest {}", gait.name), gait, pace: NichePace::Fastest { first } }
    }
}

/// The niches of `task`, in the order in which they are to be learned: what most users look for first. The gait of the
/// task, if it names one, is one of this character's.
pub fn niches(task: &Task, subject: &Subject) -> Vec<Niche> {
    let hip = subject.gravity() * subject.legs.hip_height;
    let all = ways(&subject.legs);
    let pace = task.pace(hip);
    let asked: Vec<NamedGait> =
        all.iter().filter(|gait| task.any_gait() || gait.is_called(&task.gait)).copied().collect();
    match pace {
        Pace::Comfortable if task.any_gait() => {
            let fastest = runner(&all).map(Niche::fastest);
            asked.into_iter().map(Niche::comfortable).chain(fastest).collect()
        }
        Pace::Comfortable => asked.into_iter().take(1).map(Niche::comfortable).collect(),
        Pace::At(speed) => {
            let froude = speed * speed / hip;
            // How far the speed is from those at which the gait is used, then how far from its usual one.
            let off = |gait: &NamedGait| {
                let [_, usual, _] = gait.froude;
                [(gait.suited(froude) / froude).ln().abs(), (usual / froude).ln().abs()]
            };
            // Nobody travels by leaps of all legs at once unless asked to.
            let leaps = |gait: &NamedGait| matches!(gait.gait, "pronk" | "hop");
            let mut rivals = asked;
            rivals.retain(|gait| !task.any_gait() || !leaps(gait));
            rivals.sort_by(|a, b| {
                let ([a, c], [b, d]) = (off(a), off(b));
                a.total_cmp(&b).then(c.total_cmp(&d))
            });
            let used = rivals.iter().filter(|gait| gait.suits(froude)).count();
            let count = if task.any_gait() { used.clamp(1, RIVALS) } else { 1 };
            rivals.into_iter().take(count).map(|gait| Niche::at(gait, froude)).collect()
        }
        Pace::Fastest if task.any_gait() => runner(&all).into_iter().map(Niche::fastest).collect(),
        Pace::Fastest => asked.last().copied().into_iter().map(Niche::fastest).collect(),
    }
}

/// The gait with which the greatest speed is looked for: the steadiest of those that run, or the first way of going of a body without
/// legs.
fn runner(all: &[NamedGait]) -> Option<NamedGait> {
    let runs = |gait: &&NamedGait| matches!(gait.name, "running trot" | "run" | "tripod" | "tetrapod");
    all.iter().find(runs).or(all.first().filter(|way| way.phases.is_empty())).copied()
}
