//! Where the search for a gait on legs begins.

use super::ends::{BOUNDS, CANTERS, GALLOPS, LEAPS, parameters};
use super::gaits::NamedGait;
use super::ring::{AIM, EXTENSION, HEAVE, LIFT, PERIOD};

/// Where a search may start.
#[derive(Debug, Clone, PartialEq)]
pub struct Seed {
    /// Of the leg program, or of the wave of a body without legs.
    pub parameters: Vec<f64>,
    /// How far the search reaches from there at first, in units of the parameters.
    pub reach: f64,
}

impl Seed {
    /// Reach of a search from where much is still to be found.
    const FAR: f64 = 0.5;
    /// Reach from where others of the same gait ended. One that reaches farther leaves it for worse: bounds of `anymal_b` that began at a
    /// cost of transport of 0.54 ended at 0.62 with [`FAR`](Self::FAR), and at 0.47 and 0.54 with this.
    const NEAR: f64 = 0.2;

    /// A start that is not known to be near to what is looked for.
    pub fn far(parameters: Vec<f64>) -> Self {
        Self { parameters, reach: Self::FAR }
    }

    /// A start where others of the same gait ended.
    pub(super) fn near(parameters: Vec<f64>) -> Self {
        Self { parameters, reach: Self::NEAR }
    }

    /// The same start with other parameters.
    pub fn with(&self, parameters: Vec<f64>) -> Self {
        Self { parameters, ..*self }
    }
}

/// Parameters of a trunk without heave, and of feet that are lifted half as high as usual.
const LEVEL: f64 = -2.5;
const LOW: f64 = -2.0;

/// Where a search for `gait` may start.
pub fn seeds(gait: &NamedGait) -> Vec<Seed> {
    let mut seeds: Vec<Seed> = templates(gait).into_iter().map(Seed::far).collect();
    match gait.gait {
        "canter" => seeds.extend(CANTERS.combinations().into_iter().map(Seed::near)),
        "bound" => seeds.extend(BOUNDS.combinations().into_iter().map(Seed::near)),
        "gallop" => seeds.extend(GALLOPS.combinations().into_iter().map(Seed::near)),
        _ if gait.symmetrical() => {}
        _ => seeds.extend(LEAPS.combinations().into_iter().map(Seed::far)),
    }
    seeds
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
                    seeds.push(parameters(&[
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
