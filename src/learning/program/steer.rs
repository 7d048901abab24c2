//! Feedback of a leg program: the same gait with its feet placed elsewhere, or turning, by the cell of the trunk.

use gaitwright_physics::motion::{KeyframeChange, Steering, SteeringTable, TargetLimits, TrunkMeasure};

use super::legs::Legs;
use super::ring::{ASIDE, FOOTHOLD, KEYFRAMES, PARAMETERS, Ring, TURN, Wanted};
use super::seeds::Seed;

/// Number of a program's parameters with feedback.
pub const STEERED: usize = PARAMETERS + 1 + ANSWERS.len();
/// Cells on either side of the usual one.
const CELLS: i32 = 3;

/// What a leg program answers to, with what: the measure, the width of a cell (rad, or rad times √(g / h)), the parameter
/// that is changed, and by how much for one cell where the answer's strength is 1.
///
/// Stiff legs turn with the trunk about the feet on which they stand, so that its tilt is the angle of an inverted pendulum. A
/// pendulum that leans by θ and goes on leaning at ω comes to rest over a foot that stands h (θ + ω √(h / g)) farther on (Pratt et
/// al. 2006); a trunk that leans by θ carries its feet back by h θ. A heading is taken back in some four strides as long as the
/// legs.
const ANSWERS: [(TrunkMeasure, f64, usize, f64); 5] = [
    (TrunkMeasure::LeftTilt, 0.05, ASIDE, 0.05 / 0.06),
    (TrunkMeasure::LeftTiltRate, 0.05, ASIDE, 0.05 / 0.06),
    (TrunkMeasure::ForwardTilt, 0.05, FOOTHOLD, 0.05 / 0.06),
    (TrunkMeasure::ForwardTiltRate, 0.05, FOOTHOLD, 0.05 / 0.06),
    (TrunkMeasure::Heading, 0.04, TURN, -0.33),
];
/// Which of them keeps the heading.
const HEADING: usize = 4;

/// Strengths of the answers to tilts aside and along the way with which a search may start.
const STRENGTHS: [f64; 4] = [-0.5, 0.0, 0.5, 1.0];
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

/// Whether the gait of `parameters` has feedback that keeps its heading.
pub fn holds_heading(parameters: &[f64]) -> bool {
    parameters.get(PARAMETERS + 1 + HEADING).is_some_and(|strength| *strength > 0.0)
}

/// The feedback that `parameters` ask for, with strengths beyond those of the program itself: `ring_of` gives the ring for
/// others, `base` is that of these. Targets keep to their `limits` in every cell.
pub(super) fn steering(
    (legs, limits): (&Legs, &[TargetLimits]),
    (wanted, direction): (&Wanted, [f64; 2]),
    parameters: &[f64],
    base: &Ring,
    ring_of: impl Fn(&[f64]) -> Ring,
) -> Steering {
    let strengths = &parameters[PARAMETERS + 1..];
    let rate = (wanted.gravity / legs.hip_height).sqrt();
    let tables = ANSWERS.iter().zip(strengths).filter(|(_, strength)| **strength != 0.0);
    let tables = tables.map(|(&(measure, width, parameter, change), strength)| {
        let mut changed = parameters.to_vec();
        changed[parameter] += change;
        let changed = ring_of(&changed);
        let rates = matches!(measure, TrunkMeasure::LeftTiltRate | TrunkMeasure::ForwardTiltRate);
        let width = if rates { width * rate } else { width };
        let ring = |cell: i32| {
            let times = f64::from(cell) * strength;
            let scaled = |changed: &[f64], base: &[f64]| {
                changed.iter().zip(base).map(|(changed, base)| times * (changed - base)).collect()
            };
            let keyframe = |at: usize| KeyframeChange {
                angles: scaled(&changed.cycle[at].angles, &base.cycle[at].angles),
                velocities: scaled(&changed.cycle[at].velocities, &base.cycle[at].velocities),
            };
            (0..KEYFRAMES).map(keyframe).collect()
        };
        SteeringTable {
            measure,
            bounds: (-CELLS..CELLS).map(|cell| (f64::from(cell) + 0.5) * width).collect(),
            rings: (-CELLS..=CELLS).map(ring).collect(),
        }
    });
    let steering = Steering { direction, tables: tables.collect() };
    base.player(&legs.standing).kept_within(steering, limits)
}
