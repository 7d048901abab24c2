//! Feedback of a leg program: the same gait with its feet placed elsewhere, or turning, by the cell of the trunk.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use gaitwright_physics::motion::{KeyframeChange, Steering, SteeringTable, TargetLimits, TrunkMeasure};

use super::ends::{BALANCES, STRENGTHS_OF_BALANCES};
use super::legs::Legs;
use super::ring::{ASIDE, FOOTHOLD, FOOTHOLD_UNIT, KEYFRAMES, PARAMETERS, Ring, TURN, Wanted};
use super::searched::searched;
use super::seeds::Seed;
use super::template::Step;

/// Number of a program's parameters with feedback.
pub const STEERED: usize = PARAMETERS + 1 + ANSWERS.len();

/// What a leg program answers to, with what.
struct Answer {
    measure: TrunkMeasure,
    /// Of a cell, rad, or rad times √(g / h).
    width: f64,
    /// On either side of the usual one.
    cells: i32,
    /// What is changed, and by how much for one cell where the answer's strength is 1.
    parameter: usize,
    change: f64,
}

impl Answer {
    /// To a trunk that leans. Cells of 0.05 rad, 3 on either side, were too coarse: a foot that is misplaced by half a cell is taken for
    /// another lean one step later. With these one of 4000 random programs of `bolt` stayed up for 15 strides, with those none of 8000, whose
    /// strengths were drawn from a somewhat other range.
    const fn to_tilt(measure: TrunkMeasure, parameter: usize) -> Self {
        Self { measure, width: 0.02, cells: 7, parameter, change: 0.02 / FOOTHOLD_UNIT }
    }

    /// To how fast a trunk leans. It rocks with every step: nine tenths of the time within 0.16 √(g / h) in a walk of `bolt`, on soft ground
    /// within 0.27. Where the cells ended at 0.15 it went up to half as fast again when its legs were weaker, and fell.
    const fn to_rate(measure: TrunkMeasure, parameter: usize) -> Self {
        Self { measure, width: 0.025, cells: 11, parameter, change: 0.025 / FOOTHOLD_UNIT }
    }
}

/// Stiff legs turn with the trunk about the feet on which they stand, so that its tilt is the angle of an inverted pendulum. A
/// pendulum that leans by θ and goes on leaning at ω comes to rest over a foot that stands h (θ + ω √(h / g)) farther on (Pratt et
/// al. 2006); a trunk that leans by θ carries its feet back by h θ. A heading is taken back in some four strides as long as the
/// legs.
const ANSWERS: [Answer; 5] = [
    Answer::to_tilt(TrunkMeasure::LeftTilt, ASIDE),
    Answer::to_rate(TrunkMeasure::LeftTiltRate, ASIDE),
    Answer::to_tilt(TrunkMeasure::ForwardTilt, FOOTHOLD),
    Answer::to_rate(TrunkMeasure::ForwardTiltRate, FOOTHOLD),
    Answer { measure: TrunkMeasure::Heading, width: 0.04, cells: 3, parameter: TURN, change: -0.33 },
];
/// Which of them keeps the heading; those before it balance.
const HEADING: usize = 4;

/// Strengths of the answers to tilts aside and along the way with which a search may start, and the most with which one is drawn.
const STRENGTHS: [f64; 3] = [0.5, 1.0, 1.5];
const GREATEST_STRENGTH: f64 = 2.5;
/// How far from a seed a program is drawn, in units of its parameters.
const FARTHEST: f64 = 1.5;
/// Strengths of the answer to the heading that are tried on a gait that has none.
const BY_HEADING: [f64; 3] = [0.5, 1.0, 2.0];

/// Where a search may start that would start from `seed`: there, or with feedback.
pub fn starts(seed: &Seed, steered: bool) -> Vec<Seed> {
    let mut own = seed.parameters.clone();
    if !steered {
        own.truncate(PARAMETERS);
        return vec![seed.with(own)];
    }
    if own.len() == STEERED {
        return vec![seed.clone()];
    }
    own.resize(PARAMETERS + 1, 0.0);
    let strengths =
        STRENGTHS.iter().flat_map(|aside| STRENGTHS.map(|along| [*aside, *aside, along, along, 1.0]));
    strengths.map(|strengths| seed.with([&own[..], &strengths].concat())).collect()
}

/// Where searches for a balance ended.
pub fn ends() -> Vec<Seed> {
    let steered = |own: Vec<f64>| Seed::near([&own[..], &[0.0], &STRENGTHS_OF_BALANCES].concat());
    BALANCES.combinations().into_iter().map(steered).collect()
}

/// `count` programs with feedback about `seeds`, of which there is at least one, for a search of what is `wanted`.
pub fn drawn(legs: &Legs, wanted: &Wanted, seeds: &[Seed], count: usize, chances: u64) -> Vec<Seed> {
    let mut rng = ChaCha8Rng::seed_from_u64(chances);
    let searched = searched(legs, wanted, PARAMETERS);
    let around = |seed: &Seed| {
        let mut parameters = seed.parameters.clone();
        searched.iter().for_each(|&index| parameters[index] += rng.random_range(-FARTHEST..FARTHEST));
        let balancing = &mut parameters[PARAMETERS + 1..][..HEADING];
        balancing.iter_mut().for_each(|strength| *strength = rng.random_range(0.0..GREATEST_STRENGTH));
        seed.with(parameters)
    };
    seeds.iter().cycle().take(count).map(around).collect()
}

/// The gait of `parameters`, which has no feedback, with feedback of the heading alone.
pub fn by_heading(parameters: &[f64]) -> Vec<Vec<f64>> {
    let with = |strength: &f64| {
        let mut steered = parameters.to_vec();
        steered.resize(STEERED, 0.0);
        steered[PARAMETERS + 1 + HEADING] = *strength;
        steered
    };
    BY_HEADING.iter().map(with).collect()
}

/// Whether the gait of `parameters` has feedback by which it balances.
pub fn balances(parameters: &[f64]) -> bool {
    parameters.iter().skip(PARAMETERS + 1).take(HEADING).any(|strength| *strength != 0.0)
}

/// Whether the gait of `parameters` has feedback that keeps its heading.
pub fn holds_heading(parameters: &[f64]) -> bool {
    parameters.get(PARAMETERS + 1 + HEADING).is_some_and(|strength| *strength > 0.0)
}

/// The feedback that `parameters` ask for, with strengths beyond those of the program itself, whose legs take these `steps`: `ring_of`
/// gives the ring for others, `base` is that of these. Targets keep to their `limits` in every cell.
pub(super) fn steering(
    (legs, limits, steps): (&Legs, &[TargetLimits], &[Step]),
    (wanted, direction): (&Wanted, [f64; 2]),
    parameters: &[f64],
    base: &Ring,
    ring_of: impl Fn(&[f64]) -> Ring,
) -> Steering {
    let strengths = &parameters[PARAMETERS + 1..];
    let rate = (wanted.gravity / legs.hip_height).sqrt();
    let tables = ANSWERS.iter().zip(strengths).filter(|(_, strength)| **strength != 0.0);
    let tables = tables.map(|(answer, strength)| {
        let &Answer { measure, width, cells, parameter, change } = answer;
        let mut changed = parameters.to_vec();
        changed[parameter] += change;
        let changed = ring_of(&changed);
        let rates = matches!(measure, TrunkMeasure::LeftTiltRate | TrunkMeasure::ForwardTiltRate);
        let width = if rates { width * rate } else { width };
        let shares = (0..KEYFRAMES).map(|at| match measure {
            TrunkMeasure::Heading => vec![1.0; legs.standing.len()],
            _ => placed(legs, steps, at),
        });
        let shares: Vec<Vec<f64>> = shares.collect();
        let ring = |cell: i32| {
            let times = f64::from(cell) * strength;
            let keyframe = |at: usize| {
                let scaled = |changed: &[f64], base: &[f64]| {
                    let both = shares[at].iter().zip(changed.iter().zip(base));
                    both.map(|(share, (changed, base))| share * times * (changed - base)).collect()
                };
                KeyframeChange {
                    angles: scaled(&changed.cycle[at].angles, &base.cycle[at].angles),
                    velocities: scaled(&changed.cycle[at].velocities, &base.cycle[at].velocities),
                }
            };
            (0..KEYFRAMES).map(keyframe).collect()
        };
        SteeringTable {
            measure,
            bounds: (-cells..cells).map(|cell| (f64::from(cell) + 0.5) * width).collect(),
            rings: (-cells..=cells).map(ring).collect(),
        }
    });
    let steering = Steering { direction, tables: tables.collect() };
    base.player(&legs.standing).kept_within(steering, limits)
}

/// The share of a changed foothold in each joint's target at a keyframe. A leg takes its foot there while it swings. Then it turns
/// back, within the time of a keyframe, to the angle at which it stands without feedback, and takes the trunk upright with it. A foot that
/// stands and is sent forward because the trunk leans forward turns the trunk farther forward, which would send it farther still.
fn placed(legs: &Legs, steps: &[Step], keyframe: usize) -> Vec<f64> {
    let mut shares = vec![0.0; legs.standing.len()];
    for (leg, step) in legs.legs.iter().zip(steps) {
        let since = (keyframe as f64 / KEYFRAMES as f64 - step.phase).rem_euclid(1.0);
        let share = match since < step.duty {
            true => (1.0 - since * KEYFRAMES as f64).max(0.0),
            false => (since - step.duty) / (1.0 - step.duty),
        };
        leg.moved().for_each(|joint| shares[joint] = share);
    }
    shares
}
