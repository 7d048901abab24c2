//! The questions, and the variants of the search that answer them.

use crate::learn::{Coding, Learning, Mutation, Repair, Repairs, SearchMethod, Trunk};

/// How much longer the long runs are.
const LONGER: f64 = 5.0;
/// Continuous simulation that a behaviour has to pass, s: half of the usual, since budgets are small. For the same reason
/// there is one island, as in the algorithm as published.
const CHECK: f64 = 10.0;
/// States of a subset of the algorithm as published.
const STATES: usize = 6;

/// What is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// One word, which names its plot.
    pub name: &'static str,
    /// The question.
    pub about: &'static str,
    /// Names of the variants that answer it.
    pub variants: Vec<&'static str>,
}

/// A way to search.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Unique.
    pub name: &'static str,
    /// What searches.
    pub search: VariantSearch,
    /// Factor of the simulated time of a run.
    pub length: f64,
}

/// What searches.
#[derive(Debug, Clone, PartialEq)]
pub enum VariantSearch {
    /// QDSEGA with these parameters, its cost of energy times a factor.
    Qdsega {
        /// The parameters; its budget is the study's.
        learning: Box<Learning>,
        /// Factor of the weight of energy.
        energy: f64,
    },
    /// A genetic algorithm on the keyframes of a cycle.
    KeyframeGa(KeyframeStart),
    /// CMA-ES on the keyframes of a cycle.
    KeyframeCma(KeyframeStart),
    /// CMA-ES on leg programs.
    Programs,
}

/// Where a search on keyframes starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyframeStart {
    /// From gaits as the force template has them.
    Seeds,
    /// From the standing pose.
    Nothing,
}

/// All questions.
pub fn questions() -> Vec<Question> {
    let question =
        |name, about, variants: &[&'static str]| Question { name, about, variants: variants.to_vec() };
    let mut left_out = vec!["repaired", "paper"];
    left_out.extend(Repair::ALL.map(without));
    vec![
        question(
            "longer",
            "Does running longer bring animal-like gaits?",
            &["paper", "paper, 5 times as long", "repaired", "repaired, 5 times as long"],
        ),
        question(
            "trunk",
            "Is the locked trunk the cause of unnatural motion?",
            &["paper", "paper, locked trunk"],
        ),
        question(
            "cache",
            "What does the cache save, and does it change what is learned?",
            &["paper", "paper, no cache", "repaired", "repaired, no cache"],
        ),
        question(
            "coding",
            "Which coding is better: a subset an individual, or a state?",
            &["paper", "paper, population", "repaired", "repaired, population"],
        ),
        question("repairs", "Which of the repairs matters how much?", &left_out),
        question(
            "states",
            "How many states should a subset have?",
            &["repaired, 4 states", "repaired", "repaired, 16 states"],
        ),
        question("reward", "Does it matter what energy costs?", &["repaired", "repaired, energy times 10"]),
        question(
            "rivals",
            "How do other searches do?",
            &[
                "repaired",
                "random subsets",
                "keyframes, GA",
                "keyframes, GA, seeds",
                "keyframes, CMA-ES",
                "keyframes, CMA-ES, seeds",
                "leg programs, CMA-ES, seeds",
            ],
        ),
    ]
}

/// The name of the variant that does without a repair.
fn without(repair: Repair) -> &'static str {
    match repair {
        Repair::HeadingFrame => "repaired but heading_frame",
        Repair::WholeCycle => "repaired but whole_cycle",
        Repair::TransitionTimes => "repaired but transition_times",
        Repair::WholeGroups => "repaired but whole_groups",
        Repair::Symmetry => "repaired but symmetry",
        Repair::BestCycle => "repaired but best_cycle",
        Repair::NaturalCost => "repaired but natural_cost",
        Repair::BoundedStart => "repaired but bounded_start",
    }
}

/// All variants, each once.
pub fn variants() -> Vec<Variant> {
    let repaired = || Learning { check_seconds: CHECK, islands: 1, ..Learning::default() };
    let paper = || Learning { search: SearchMethod::Paper, states: STATES, ..repaired() };
    let plain = |name, learning: Learning| Variant {
        name,
        search: VariantSearch::Qdsega { learning: Box::new(learning), energy: 1.0 },
        length: 1.0,
    };
    let longer = |name, learning| Variant { length: LONGER, ..plain(name, learning) };
    let rival = |name, search| Variant { name, search, length: 1.0 };
    let drawn = Mutation { angle: 0.0, velocity: 0.0, time: 0.0, limb: 1.0, state: 1.0 };
    let mut all = vec![
        plain("paper", paper()),
        longer("paper, 5 times as long", paper()),
        plain("paper, locked trunk", Learning { trunk: Trunk::Locked, ..paper() }),
        plain("paper, no cache", Learning { cache_transitions: 0, ..paper() }),
        plain("paper, population", Learning { coding: Coding::Population, ..paper() }),
        plain("repaired", repaired()),
        longer("repaired, 5 times as long", repaired()),
        plain("repaired, no cache", Learning { cache_transitions: 0, ..repaired() }),
        plain("repaired, population", Learning { coding: Coding::Population, ..repaired() }),
    ];
    all.extend(Repair::ALL.map(|repair| {
        plain(without(repair), Learning { repairs: Repairs::default().without(repair), ..repaired() })
    }));
    all.extend([
        Variant {
            name: "repaired, energy times 10",
            search: VariantSearch::Qdsega { learning: Box::new(repaired()), energy: 10.0 },
            length: 1.0,
        },
        plain("repaired, 4 states", Learning { states: 4, ..repaired() }),
        plain("repaired, 16 states", Learning { states: 16, ..repaired() }),
        // Every state of every child is drawn afresh, and which limbs move alike.
        plain("random subsets", Learning { crossover_rate: 0.0, mutation: drawn, ..repaired() }),
        rival("keyframes, GA", VariantSearch::KeyframeGa(KeyframeStart::Nothing)),
        rival("keyframes, GA, seeds", VariantSearch::KeyframeGa(KeyframeStart::Seeds)),
        rival("keyframes, CMA-ES", VariantSearch::KeyframeCma(KeyframeStart::Nothing)),
        rival("keyframes, CMA-ES, seeds", VariantSearch::KeyframeCma(KeyframeStart::Seeds)),
        rival("leg programs, CMA-ES, seeds", VariantSearch::Programs),
    ]);
    all
}
