//! Where the search for a gait on legs begins.

use super::gaits::NamedGait;
use super::ring::{
    AIM, APART, DUTY, EXTENSION, FOOTHOLD, FORE_LIFT, FORE_PUSH, HEAVE, LIFT, PARAMETERS, PERIOD, PUSH, SKEW,
    SPEED, STIFFNESS,
};

/// Parameters of a trunk without heave, and of feet that are lifted half as high as usual.
const LEVEL: f64 = -2.5;
const LOW: f64 = -2.0;

/// What five searches for bounds of two robots (`a1` and `anymal_b`) came to, in 180 generations each, rounded: feet are lifted late,
/// fore feet higher than hind feet, by legs that give less force than the template says, hind legs less than fore legs, and stand for
/// less of the stride; the trunk heaves less, and the forces of fore and hind legs point toward each other.
const LEAP: [(usize, f64); 7] = [
    (DUTY, -1.0),
    (FORE_LIFT, 1.0),
    (PUSH, -0.8),
    (FORE_PUSH, 0.8),
    (HEAVE, -0.9),
    (SKEW, 3.0),
    (STIFFNESS, -0.8),
];

/// Where a search for `gait` may start.
pub fn seeds(gait: &NamedGait) -> Vec<Vec<f64>> {
    let mut seeds = templates(gait);
    if !gait.symmetrical() {
        let periods = if gait.gallops() { [-1.6, -2.8] } else { [-2.5, -4.0] };
        seeds.extend(leaping(periods));
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

/// The gait as [`LEAP`] has it, with the stride times `periods`, feet that stand far behind the hips, lifted as usual and less, fore and hind legs sent
/// as the gait says, nearer to each other or farther apart, for the speed that is wanted and for a higher one. Where feet land when the
/// trunk pitches, and how much speed that costs, differs most from one body to the next.
fn leaping(periods: [f64; 2]) -> Vec<Vec<f64>> {
    let mut seeds = Vec::new();
    for period in periods {
        for foothold in [-2.5, -4.5] {
            for apart in [-1.0, 0.0, 1.0] {
                for speed in [0.0, 1.5] {
                    for aim in [1.0, 3.0] {
                        for lift in [-1.5, -3.5] {
                            let own = [
                                (PERIOD, period),
                                (FOOTHOLD, foothold),
                                (APART, apart),
                                (SPEED, speed),
                                (AIM, aim),
                                (LIFT, lift),
                            ];
                            seeds.push(seed(&[&LEAP[..], &own].concat()));
                        }
                    }
                }
            }
        }
    }
    seeds
}
