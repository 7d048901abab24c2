//! The state from which a learner can be resumed.

use serde::{Deserialize, Serialize};

use super::behaviour::Behaviour;
use super::cache::SimulationTotals;
use super::ga::Island;
use super::generation::Generation;
use super::genome::Genome;
use super::grid::Grid;
use super::parameters::{Coding, Learning};
use super::task::Task;
use gaitwright_physics::fault::{Fault, InputError};

/// Everything a resumed job needs besides its setup. It is handed out between generations, when the
/// transition cache is emptied. Randomness needs no state, since every individual of every generation draws from a
/// stream of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Seed of the job.
    pub seed: u64,
    /// Parameters of the job, as used.
    pub learning: Learning,
    /// Task of the job.
    pub task: Task,
    /// Generations done.
    pub generations: u32,
    /// The populations, one an island.
    pub islands: Vec<Island>,
    /// The best behaviour so far.
    pub best: Option<Behaviour>,
    /// Every best behaviour so far, that one included, in the order in which they were found.
    #[serde(default)]
    pub improved: Vec<Behaviour>,
    /// The learning curve so far.
    pub curve: Vec<Generation>,
    /// What was simulated so far; the cache itself is not kept.
    #[serde(rename = "account")]
    pub totals: SimulationTotals,
    /// s of the wall clock spent so far.
    pub elapsed: f64,
}

impl Checkpoint {
    /// Checks that a job with this seed, these parameters, this task and this grid may be resumed from
    /// here. The budgets (generations, seconds) may differ.
    ///
    /// # Errors
    /// What belongs to a different job, with JSON pointers into the checkpoint.
    pub fn fits(&self, seed: u64, learning: &Learning, task: &Task, grid: &Grid) -> Result<(), InputError> {
        let own = (self.seed, &self.learning, &self.task);
        let mut faults = faults_of_origin(own, (seed, learning, task));
        if self.islands.len() != learning.islands {
            faults.push(Fault::new("/islands", format!("there are not {} islands", learning.islands)));
        }
        let drawn = grid.drawn(learning.states);
        let (members, states) = match learning.coding {
            Coding::Chromosome => (learning.population, drawn),
            Coding::Population => (drawn, 1),
        };
        for (index, island) in self.islands.iter().enumerate() {
            let sound = |genome: &Genome| {
                genome.states.len() == states
                    && genome.states.iter().all(|state| state.levels.len() == grid.joints.len())
            };
            // An island that was restarted is empty until the next generation.
            if !(island.members.is_empty() || island.members.len() == members)
                || !island.members.iter().all(|member| sound(&member.genome))
            {
                let reason = "the individuals do not fit the character and the parameters";
                faults.push(Fault::new(format!("/islands/{index}"), reason));
            }
        }
        if faults.is_empty() { Ok(()) } else { Err(InputError::Impossible(faults)) }
    }
}

/// What of a checkpoint with the seed, parameters and task `own` belongs to another job than that with those of `job`; the budgets may
/// differ.
pub(crate) fn faults_of_origin(own: (u64, &Learning, &Task), job: (u64, &Learning, &Task)) -> Vec<Fault> {
    let mut faults = Vec::new();
    if own.0 != job.0 {
        let reason = format!("the checkpoint was made with seed {}, not {}", own.0, job.0);
        faults.push(Fault::new("/seed", reason));
    }
    let budget = |learning: &Learning| Learning { generations: None, seconds: None, ..learning.clone() };
    if budget(own.1) != budget(job.1) {
        faults.push(Fault::new("/learning", "the checkpoint was made with other parameters"));
    }
    if own.2 != job.2 {
        faults.push(Fault::new("/task", "the checkpoint was made for another task"));
    }
    faults
}
