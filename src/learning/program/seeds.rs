//! Where the search for a gait on legs begins.

use super::gaits::NamedGait;
use super::ring::{
    AIM, APART, ASIDE_LAGS, EXTENSION, FOOTHOLD, FORE_DUTY, HEAVE, LIFT, PARAMETERS, PERIOD, SKEW,
};

/// Parameters of a trunk without heave, and of feet that are lifted half as high as usual.
const LEVEL: f64 = -2.5;
const LOW: f64 = -2.0;

/// What ten searches for bounds and gallops of two robots (the bundled quadruped and `a1`) came to from the template alone, in 60 to 240
/// generations each, rounded: fore legs stand for less of the stride than hind legs, feet stand behind the hips and are lifted late, the forces of
/// fore and hind legs point toward each other, and the trunk heaves less than the template says.
const LEAP: [(usize, f64); 5] = [(FORE_DUTY, -1.5), (FOOTHOLD, -2.0), (HEAVE, -1.0), (SKEW, 3.0), (AIM, 3.0)];
/// Difference of the phases of left and right, parts of a stride, that has the whole of [`ASIDE_LAGS`] as a seed: legs of a pair that
/// are sent so shortly after each other touch down nearly together.
const LAG: f64 = 0.05;

/// Where a search for `gait` may start.
pub fn seeds(gait: &NamedGait) -> Vec<Vec<f64>> {
    let mut seeds = templates(gait);
    if !gait.symmetrical() {
        seeds.extend(leaping(gait));
    }
    seeds
}

fn seed(parameters: &[(usize, f64)]) -> Vec<f64> {
    let mut seed = vec![0.0; PARAMETERS];
    for &(index, value) in parameters {
        seed[index] = value;
    }
    seed
}

/// The gait as the template has it, with stride times from the usual down to half of it, with legs as long as usual and shorter. Small
/// characters tip over within the usual time.
///
/// Where fore or hind legs push together, the forces may spare the trunk pitching, and the legs are as long as usual or longer: they
/// carry the more while they stand, and give way by more. Legs that walk may carry the trunk level as well, on feet that are
/// lifted little: the template's forces heave the trunk as running does, the more the longer a stride takes.
fn templates(gait: &NamedGait) -> Vec<Vec<f64>> {
    let level: &[[f64; 2]] = &[[0.0, 0.0], [LEVEL, LOW]];
    let courses = if gait.symmetrical() && gait.duty_factor > 0.5 { level } else { &level[..1] };
    let (aims, extensions): (&[f64], _) =
        if gait.symmetrical() { (&[0.0], [0.0, -1.0]) } else { (&[0.0, 2.0], [0.0, 1.0]) };
    let mut seeds = Vec::new();
    for &aim in aims {
        for &[heave, lift] in courses {
            for period in [0.0, -1.0, -2.0, -3.0] {
                for extension in extensions {
                    seeds.push(seed(&[
                        (PERIOD, period),
                        (EXTENSION, extension),
                        (AIM, aim),
                        (HEAVE, heave),
                        (LIFT, lift),
                    ]));
                }
            }
        }
    }
    seeds
}

/// The gait as [`LEAP`] has it, with short stride times, legs as long as usual and longer, feet lifted as usual and less. Fore and hind
/// legs are sent as the gait says or farther from each other, those of a pair as it says or as many times later as it takes them
/// to touch down one after the other.
fn leaping(gait: &NamedGait) -> Vec<Vec<f64>> {
    let rows = gait.phases.len() / 2;
    let lag = |row: usize| {
        let apart = gait.phases[row] - gait.phases[row + rows];
        ((apart - apart.round()) / LAG).clamp(-1.0, 1.0)
    };
    // Of all left legs, and of the left fore legs more than of the left hind legs.
    let (fore, hind) = (lag(0), lag(rows - 1));
    let lags = [0.5 * (fore + hind), 0.5 * (fore - hind)];
    let asides = if lags == [0.0; 2] { &[0.0][..] } else { &[0.0, 1.0] };
    let mut seeds = Vec::new();
    for period in [-2.0, -3.5] {
        for extension in [0.0, 1.0] {
            for apart in [0.0, -1.0] {
                for aside in asides {
                    for lift in [0.0, -1.5] {
                        let own = [
                            (PERIOD, period),
                            (EXTENSION, extension),
                            (APART, apart),
                            (ASIDE_LAGS[0], aside * lags[0]),
                            (ASIDE_LAGS[1], aside * lags[1]),
                            (LIFT, lift),
                        ];
                        seeds.push(seed(&[&LEAP[..], &own].concat()));
                    }
                }
            }
        }
    }
    seeds
}
