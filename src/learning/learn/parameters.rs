//! The parameters of the learner, their defaults and their limits.
//!
//! [`Learning`] is the document that is posted, in which some are left open; [`Learning::resolve`] decides those
//! for one character, once, and everything after it works with [`Parameters`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::breeding::{Crossover, Mutation};
use super::budget::Budget;
use super::repairs::{Repair, Repairs};
use super::trunk::Trunk;
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::stance::Stance;

/// Most beats that a transition can take where times are genes: three times T.
const BEATS: u8 = 6;
/// Training time when neither generations nor seconds are given, s.
const DEFAULT_SECONDS: f64 = 180.0;
/// Fewest steps of a transition whose time was left open.
const FEWEST_STEPS: f64 = 20.0;

/// How motions are searched for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SearchMethod {
    /// Gait by gait from seeds, each refined, for a character with two, four, six or eight legs in pairs and for a body whose joints are a
    /// row; otherwise, without seeds, and where no gait stays up, by QDSEGA.
    #[default]
    Natural,
    /// QDSEGA as published (Tokizaki & Hasegawa; Ito & Matsuno 2002), for any character: one population without seeds,
    /// refinement, limbs that follow others, or any of the repairs. `seeds`, `refine`, `repairs`, `islands`, `crossover`
    /// and `mutation.limb` are then what that has, whatever was given.
    Paper,
}

/// What a search starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Seeds {
    /// Gaits as the force template has them.
    #[default]
    Templates,
    /// Nothing: states drawn by chance.
    None,
}

/// What an individual of the genetic algorithm stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Coding {
    /// A whole subset of states; its fitness is what its own greedy behaviour achieves (Tokizaki &
    /// Hasegawa section 2.2, read literally).
    #[default]
    Chromosome,
    /// One state; the population is the subset, so that it has as many individuals as that has states, and `population`
    /// is not used. An individual's fitness joins the values that Q-learning gives to going to it with how often the
    /// greedy behaviour does (Ito & Matsuno 2002).
    Population,
}

/// Declares both forms of the parameters with each parameter written once. Documents show them in this order,
/// with the transition time between the two groups.
macro_rules! parameters {
    (
        $($(#[$about:meta])* $name:ident: $type:ty = $default:expr;)*
        [transition_time]
        $($(#[$more_about:meta])* $more:ident: $more_type:ty = $more_default:expr;)*
    ) => {
        /// Parameters of the search as asked for. What is `null` is chosen to suit the character; the other
        /// defaults were found by measurement, since the sources give no numbers.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct Learning {
            /// Greatest number of generations; unlimited where only `seconds` is given.
            pub generations: Option<u32>,
            /// Greatest training time, s of the wall clock; unlimited where only `generations` is given, 180
            /// where neither is. A result limited by it is not reproducible and is marked so.
            pub seconds: Option<f64>,
            $($(#[$about])* pub $name: $type,)*
            /// T, s: from one state to the next; rounded to whole steps of the simulation. Where times are genes, what
            /// they are multiples of is the half of T. Where `null`, the half of √(h/g), the time scale of a pendulum as
            /// long as the root stands high.
            pub transition_time: Option<f64>,
            $($(#[$more_about])* pub $more: $more_type,)*
        }

        impl Default for Learning {
            fn default() -> Self {
                Self {
                    generations: None,
                    seconds: None,
                    $($name: $default,)*
                    transition_time: None,
                    $($more: $more_default,)*
                }
            }
        }

        /// The parameters as used on one character: nothing is left open.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Parameters {
            /// When the learning ends.
            pub budget: Budget,
            $($(#[$about])* pub $name: $type,)*
            /// T, s: from one state to the next, a whole number of beats.
            pub transition_time: f64,
            /// Steps of the simulation in T.
            pub transition_steps: u64,
            $($(#[$more_about])* pub $more: $more_type,)*
        }

        impl Parameters {
            fn decided(learning: &Learning, transition_time: f64, transition_steps: u64) -> Self {
                Self {
                    budget: learning.budget(),
                    $($name: learning.$name,)*
                    transition_time,
                    transition_steps,
                    $($more: learning.$more,)*
                }
            }
        }

        /// The document that asks for exactly these parameters.
        impl From<&Parameters> for Learning {
            fn from(parameters: &Parameters) -> Self {
                Self {
                    generations: parameters.budget.generations(),
                    seconds: parameters.budget.seconds(),
                    $($name: parameters.$name,)*
                    transition_time: Some(parameters.transition_time),
                    $($more: parameters.$more,)*
                }
            }
        }
    };
}

parameters! {
    /// How motions are searched for.
    search: SearchMethod = SearchMethod::default();
    /// What the search starts from.
    seeds: Seeds = Seeds::default();
    /// Whether gaits from seeds are refined; without it each is the best of its seeds.
    refine: bool = true;
    /// Generations for which a walk or a trot is refined; leaps and runs on two legs have three times as many, waves and balances four
    /// times.
    gait_generations: u32 = 60;
    /// What is changed in the algorithm as published.
    repairs: Repairs = Repairs::default();
    /// Individuals of each island.
    population: usize = 12;
    /// States of a subset; rounded up to what symmetry makes of the states that are drawn.
    states: usize = 8;

    [transition_time]

    /// Episodes of Q-learning an individual is given.
    episodes: u32 = 12;
    /// Whether the trunk may rotate.
    trunk: Trunk = Trunk::default();
    /// Levels into which roll and pitch of a free trunk are divided each, as part of the Q-learner's
    /// state; 1 for none, otherwise odd.
    trunk_cells: u8 = 1;
    /// What an individual stands for.
    coding: Coding = Coding::default();
    /// Populations side by side.
    islands: usize = 4;
    /// Generations from one migration (of each island's best to the next island) to another.
    migration: u32 = 10;
    /// In so many generations from its last progress, that one included, an island has to make another, or it is drawn afresh, unless it
    /// is the one with the best behaviour.
    patience: u32 = 20;
    /// Best individuals of an island that are kept as they are.
    elite: usize = 2;
    /// Individuals drawn for each selection of a parent; the fittest is taken.
    tournament: usize = 3;
    /// Probability that a child has two parents and not one.
    crossover_rate: f64 = 0.6;
    /// Kinds of crossover.
    crossover: Crossover = Crossover::default();
    /// Kinds of mutation.
    mutation: Mutation = Mutation::default();
    /// Transitions after which an episode of Q-learning ends.
    episode_length: u32 = 24;
    /// α of Q-learning.
    learning_rate: f64 = 0.5;
    /// γ of Q-learning, a transition.
    discount: f64 = 0.9;
    /// ε of Q-learning: probability of an action drawn at random.
    exploration: f64 = 0.3;
    /// Angles are divided within this distance of the standing pose, rad (of prismatic joints, times
    /// half the standing height, m).
    reach: f64 = 0.6;
    /// Levels of angle over twice the reach; odd.
    angle_levels: u8 = 9;
    /// Levels of velocity in the middle of the range; odd.
    velocity_levels: u8 = 5;
    /// Greatest velocity on the grid, in reaches a transition time (and never above the joint's own
    /// limit).
    swing: f64 = 1.0;
    /// Continuous simulation by which every individual is judged, s.
    trial_seconds: f64 = 1.5;
    /// Continuous simulation that a behaviour has to pass, upright, to become the best of its island, s:
    /// from the standing pose, and after a small push to either side.
    check_seconds: f64 = 20.0;
    /// Generations after which the transition cache starts afresh. A checkpoint is handed out then, so
    /// that it need not hold the cache to be resumed to the same result.
    cache_generations: u32 = 5;
    /// Most transitions the cache holds; when it is full, new ones are not kept. With 0 there is no cache at all: every
    /// transition is simulated whenever it is chosen.
    cache_transitions: usize = 100_000;
}

impl Parameters {
    /// Whether gaits are searched for one by one, for a character that has legs in pairs or a body whose joints are a row.
    pub fn gait_by_gait(&self) -> bool {
        self.search == SearchMethod::Natural && self.seeds == Seeds::Templates
    }

    /// Steps of the simulation in a beat, of which every transition takes a whole number.
    pub fn beat_steps(&self) -> u64 {
        self.transition_steps / beats_of(self.repairs)
    }

    /// s in a beat.
    pub fn beat(&self) -> f64 {
        self.transition_time / beats_of(self.repairs) as f64
    }

    /// Most beats that a transition can take; 1 where all take the same time.
    pub fn greatest_beats(&self) -> u8 {
        if self.repairs.has(Repair::TransitionTimes) { BEATS } else { 1 }
    }

    /// Whether limbs may follow others.
    pub fn coupled(&self) -> bool {
        self.mutation.limb > 0.0
    }
}

/// Beats in T.
fn beats_of(repairs: Repairs) -> u64 {
    if repairs.has(Repair::TransitionTimes) { 2 } else { 1 }
}

impl Learning {
    /// Decides what was left open for a character that stands as in `stance` under `gravity` (m/s²), simulated in steps
    /// of `step` seconds, and rounds the transition time to whole steps.
    ///
    /// # Errors
    /// Every parameter that makes no sense, with JSON pointers into this document.
    pub fn resolve(&self, stance: &Stance, gravity: f64, step: f64) -> Result<Parameters, InputError> {
        self.resolve_with(default_time(stance.root_height, gravity).max(FEWEST_STEPS * step), step)
    }

    /// As [`Learning::resolve`], with `default_time` (s) for a transition time that was left open.
    ///
    /// # Errors
    /// As [`Learning::resolve`].
    pub fn resolve_with(&self, default_time: f64, step: f64) -> Result<Parameters, InputError> {
        let faults = self.faults();
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        let published = self.published();
        let learning = if self.search == SearchMethod::Paper { &published } else { self };
        let wanted = self.transition_time.unwrap_or(default_time);
        let beats = beats_of(learning.repairs);
        let steps = beats as f64 * (wanted / (beats as f64 * step)).round().max(1.0);
        Ok(Parameters::decided(learning, step * steps, steps as u64))
    }

    /// The same with what was added to the published algorithm left out.
    fn published(&self) -> Self {
        Self {
            seeds: Seeds::None,
            refine: false,
            repairs: Repairs::NONE,
            islands: 1,
            crossover: Crossover { uniform: 1.0, limb: 0.0, neighbouring: 0.0 },
            mutation: Mutation { limb: 0.0, ..self.mutation },
            ..self.clone()
        }
    }

    /// When the learning is to end.
    pub fn budget(&self) -> Budget {
        match (self.generations, self.seconds) {
            (None, None) => Budget::Seconds(DEFAULT_SECONDS),
            (None, Some(seconds)) => Budget::Seconds(seconds),
            (Some(generations), None) => Budget::Generations(generations),
            (Some(generations), Some(seconds)) => Budget::Either { generations, seconds },
        }
    }

    /// Everything impossible in the parameters, with JSON pointers into this document.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Faults(Vec::new());
        faults.count("/gait_generations", self.gait_generations.into(), 1, 100_000);
        faults.count("/generations", self.generations.map_or(1, u64::from), 1, 1_000_000);
        faults.real("/seconds", self.seconds.unwrap_or(1.0), 0.001, 1e7);
        faults.count("/population", self.population as u64, 2, 10_000);
        faults.count("/islands", self.islands as u64, 1, 1_000);
        faults.count("/states", self.states as u64, 2, 200);
        faults.count("/episodes", self.episodes.into(), 1, 100_000);
        faults.count("/episode_length", self.episode_length.into(), 1, 100_000);
        faults.count("/migration", self.migration.into(), 1, 1_000_000);
        faults.count("/patience", self.patience.into(), 1, 1_000_000);
        // Of a population that cannot be there is nothing more to say.
        if self.population >= 2 {
            faults.count("/elite", self.elite as u64, 1, self.population as u64 - 1);
            faults.count("/tournament", self.tournament as u64, 1, self.population as u64);
        }
        faults.count("/cache_generations", self.cache_generations.into(), 1, 1_000_000);
        faults.count("/cache_transitions", self.cache_transitions as u64, 0, 100_000_000);
        faults.odd("/trunk_cells", self.trunk_cells, 1, 15);
        faults.odd("/angle_levels", self.angle_levels, 3, 101);
        faults.odd("/velocity_levels", self.velocity_levels, 1, 101);
        faults.real("/transition_time", self.transition_time.unwrap_or(1.0), 0.001, 10.0);
        faults.real("/reach", self.reach, 0.001, 3.2);
        faults.real("/swing", self.swing, 0.001, 100.0);
        faults.real("/trial_seconds", self.trial_seconds, 0.01, 1000.0);
        faults.real("/check_seconds", self.check_seconds, self.trial_seconds, 10_000.0);
        faults.real("/learning_rate", self.learning_rate, 0.001, 1.0);
        faults.real("/discount", self.discount, 0.0, 0.999);
        faults.real("/exploration", self.exploration, 0.0, 1.0);
        faults.real("/crossover_rate", self.crossover_rate, 0.0, 1.0);
        let Crossover { uniform, limb, neighbouring } = self.crossover;
        for (name, weight) in [("uniform", uniform), ("limb", limb), ("neighbouring", neighbouring)] {
            faults.real(&format!("/crossover/{name}"), weight, 0.0, 1e6);
        }
        if uniform + limb + neighbouring == 0.0 {
            faults.add("/crossover", "at least one kind of crossover must have a positive share");
        }
        let Mutation { angle, velocity, state, limb, time } = self.mutation;
        let rates =
            [("angle", angle), ("velocity", velocity), ("state", state), ("limb", limb), ("time", time)];
        for (name, rate) in rates {
            faults.real(&format!("/mutation/{name}"), rate, 0.0, 1.0);
        }
        faults.0
    }
}

/// Half of √(h/g), s.
fn default_time(root_height: f64, gravity: f64) -> f64 {
    0.5 * (root_height.max(0.0) / gravity).sqrt()
}

/// Faults found so far.
struct Faults(Vec<Fault>);

impl Faults {
    fn add(&mut self, pointer: &str, reason: impl Into<String>) {
        self.0.push(Fault::new(pointer, reason));
    }

    fn count(&mut self, pointer: &str, value: u64, least: u64, most: u64) {
        if !(least..=most).contains(&value) {
            self.add(pointer, format!("{value} does not lie between {least} and {most}"));
        }
    }

    fn odd(&mut self, pointer: &str, value: u8, least: u8, most: u8) {
        if !(least..=most).contains(&value) || value.is_multiple_of(2) {
            self.add(pointer, format!("{value} is not an odd number between {least} and {most}"));
        }
    }

    fn real(&mut self, pointer: &str, value: f64, least: f64, most: f64) {
        if !(least..=most).contains(&value) {
            self.add(pointer, format!("{value} does not lie between {least} and {most}"));
        }
    }
}
