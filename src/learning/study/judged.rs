//! A run and what it found, judged.

use std::time::Instant;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::arena::StudyArena;
use super::trail::Trail;
use super::variants::{Variant, VariantSearch};
use super::{programs, qdsega, rivals};
use crate::learn::{LearnError, Trunk};

/// A run of a variant with a seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JudgedRun {
    /// The seed.
    pub seed: u64,
    /// The best that was found: of QDSEGA a behaviour that has passed its check, of the other searches the candidate that costs least, whether
    /// it stays upright or not. `null` where there was nothing of the kind.
    pub best: Option<JudgedMotion>,
    /// Simulated time, s, and the natural cost of the best motion from then on, one a motion that was the run's best.
    pub course: Vec<[f64; 2]>,
    /// Simulated time in all, s.
    pub simulated_seconds: f64,
    /// Simulated time that the cache saved, s.
    pub saved_seconds: f64,
    /// Share of the transitions that came from the cache; `null` where there is none.
    pub cache_hit_rate: Option<f64>,
    /// Computing time of the search, s, while other runs took place beside it; not reproducible.
    pub seconds: f64,
}

/// The motion that a run came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JudgedMotion {
    /// What it costs as the named gait that it costs least as (see the guide); 1000 and more where it breaks a constraint.
    pub natural_cost: f64,
    /// Along the direction, m/s.
    pub speed: f64,
    /// ∫ Σ |τ q̇| dt / (m g d); `null` where it does not travel.
    pub cost_of_transport: Option<f64>,
    /// Name of its gait; `null` where gaits of so many legs have none.
    pub gait: Option<String>,
    /// Time of a stride, s; `null` without strides.
    pub stride_period: Option<f64>,
    /// Whether it is natural.
    pub natural: bool,
    /// For how long it stays upright in the check, s: of 20 s, or of twelve cycles after its entry where these take longer.
    pub upright_seconds: f64,
}

/// Runs a variant and judges what it found. With a locked trunk, it is judged so as well.
pub(super) fn judged_run(
    arena: &StudyArena,
    variant: &Variant,
    seed: u64,
    seconds: f64,
) -> Result<JudgedRun, LearnError> {
    let begun = Instant::now();
    let seconds = variant.length * seconds;
    let (trail, trunk) = match &variant.search {
        VariantSearch::Qdsega { learning, energy } => {
            (qdsega::run(arena, learning, *energy, seed, seconds)?, learning.trunk)
        }
        VariantSearch::KeyframeGa(start) => (rivals::genetic(arena, *start, seed, seconds)?, Trunk::Free),
        VariantSearch::KeyframeCma(start) => (rivals::continuous(arena, *start, seed, seconds)?, Trunk::Free),
        VariantSearch::Programs => (programs::run(arena, seed, seconds)?, Trunk::Free),
    };
    let elapsed = begun.elapsed().as_secs_f64();
    let trials = arena.arena(trunk)?;
    let Trail { found, simulated, saved, hit_rate } = trail;
    let costs = found.iter().map(|found| [found.at, arena.natural_cost(&trials, found)]);
    let course: Vec<[f64; 2]> = costs.collect();
    let mut best = None;
    if let (Some(found), Some([_, natural_cost])) = (found.last(), course.last()) {
        let checked = arena.check(trunk, found)?;
        let gait = checked.gait;
        best = Some(JudgedMotion {
            natural_cost: *natural_cost,
            speed: gait.speed,
            cost_of_transport: gait.cost_of_transport,
            gait: gait.gait.clone(),
            stride_period: gait.stride_period,
            natural: gait.natural,
            upright_seconds: checked.trace.samples.last().map_or(0.0, |sample| sample.time),
        });
    }
    Ok(JudgedRun {
        seed,
        best,
        course,
        simulated_seconds: simulated,
        saved_seconds: saved,
        cache_hit_rate: hit_rate,
        seconds: elapsed,
    })
}
