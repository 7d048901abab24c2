//! Names of gaits: the named gait whose phases are nearest on the circle.

use super::legs::Leg;

/// Mean distance of the phases beyond which a gait is `unclassified`, share of a stride.
pub const MAX_DISTANCE: f64 = 0.075;

/// A named gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Template {
    /// Its name.
    pub name: &'static str,
    /// Touch-down of each leg after that of the first, shares of a stride; legs in the order left before right, front to
    /// back.
    pub phases: &'static [f64],
    /// Usual duty factor. It decides only between names with the same phases.
    pub duty_factor: f64,
}

/// LF, LH, RF, RH; after Hildebrand 1965 and 1989.
const FOUR_LEGS: [Template; 7] = [
    Template { name: "walk", phases: &[0.0, 0.75, 0.5, 0.25], duty_factor: 0.75 },
    Template { name: "trot", phases: &[0.0, 0.5, 0.5, 0.0], duty_factor: 0.45 },
    Template { name: "pace", phases: &[0.0, 0.0, 0.5, 0.5], duty_factor: 0.45 },
    Template { name: "bound", phases: &[0.0, 0.5, 0.0, 0.5], duty_factor: 0.4 },
    Template { name: "canter", phases: &[0.0, 0.33, 0.33, 0.66], duty_factor: 0.4 },
    Template { name: "gallop", phases: &[0.0, 0.4, 0.05, 0.35], duty_factor: 0.3 },
    Template { name: "pronk", phases: &[0.0, 0.0, 0.0, 0.0], duty_factor: 0.4 },
];

/// LF, LM, LH, RF, RM, RH; after Wilson 1966, "Insect walking": waves of steps run from hind to fore
/// on each side, the sides half a stride apart, and overlap the more the faster the insect goes.
const SIX_LEGS: [Template; 3] = [
    Template {
        name: "wave",
        phases: &[2.0 / 6.0, 1.0 / 6.0, 0.0, 5.0 / 6.0, 4.0 / 6.0, 3.0 / 6.0],
        duty_factor: 5.0 / 6.0,
    },
    Template {
        name: "ripple",
        phases: &[4.0 / 6.0, 2.0 / 6.0, 0.0, 1.0 / 6.0, 5.0 / 6.0, 3.0 / 6.0],
        duty_factor: 4.0 / 6.0,
    },
    Template { name: "tripod", phases: &[0.0, 0.5, 0.0, 0.5, 0.0, 0.5], duty_factor: 0.5 },
];

/// L, R. Walking and running differ in the duty factor alone.
const TWO_LEGS: [Template; 3] = [
    Template { name: "walk", phases: &[0.0, 0.5], duty_factor: 0.6 },
    Template { name: "run", phases: &[0.0, 0.5], duty_factor: 0.35 },
    Template { name: "hop", phases: &[0.0, 0.0], duty_factor: 0.4 },
];

/// The named gaits of a character with `legs` legs; none for most numbers.
pub fn templates(legs: usize) -> &'static [Template] {
    match legs {
        2 => &TWO_LEGS,
        4 => &FOUR_LEGS,
        6 => &SIX_LEGS,
        _ => &[],
    }
}

/// The name of a gait, and its distance from the named gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Classified {
    /// Name of the nearest gait, or `unclassified` when that is further than [`MAX_DISTANCE`].
    pub name: &'static str,
    /// Mean distance of the phases to those of the nearest named gait, share of a stride, 0 to ½.
    pub distance: f64,
}

/// Names the gait with these phases (shares of a stride) of these legs, in any order, and this mean
/// duty factor; `None` where gaits of so many legs have no names.
///
/// The distance to a template is the mean over the legs of the distance on the circle, for the
/// reference that fits best, so it does not depend on the foot that phases are counted from. Gaits
/// led from the left and from the right have the same name. Names with the same phases are distinguished by the duty
/// factor: at least one half is the slower of the two.
pub fn classify(feet: &[(Leg, f64)], duty_factor: f64) -> Option<Classified> {
    let mut feet = feet.to_vec();
    feet.sort_by_key(|&(leg, _)| leg);
    let phases: Vec<f64> = feet.iter().map(|&(_, phase)| phase).collect();
    // The mirrored gait: left and right legs exchanged.
    let rows = phases.len() / 2;
    let mirrored: Vec<f64> = phases[rows..].iter().chain(&phases[..rows]).copied().collect();
    templates(phases.len())
        .iter()
        .filter(|template| {
            let twins = templates(phases.len()).iter().filter(|twin| twin.phases == template.phases).count();
            twins == 1 || (template.duty_factor >= 0.5) == (duty_factor >= 0.5)
        })
        .map(|template| {
            let distance = distance(&phases, template.phases).min(distance(&mirrored, template.phases));
            Classified { name: template.name, distance }
        })
        .min_by(|a, b| a.distance.total_cmp(&b.distance))
        .map(|nearest| {
            let name = if nearest.distance <= MAX_DISTANCE { nearest.name } else { "unclassified" };
            Classified { name, ..nearest }
        })
}

/// Mean distance on the circle between two sets of phases, for the shift of the second that fits best.
///
/// The mean of absolute distances is piecewise linear in the shift and has its minimum where one of the legs fits
/// exactly, so trying these suffices.
fn distance(phases: &[f64], template: &[f64]) -> f64 {
    let differences: Vec<f64> = phases.iter().zip(template).map(|(phase, wanted)| phase - wanted).collect();
    let mean = |shift: f64| {
        differences.iter().map(|difference| apart(difference - shift)).sum::<f64>() / differences.len() as f64
    };
    differences.iter().map(|&shift| mean(shift)).fold(f64::INFINITY, f64::min)
}

/// Distance of a phase from 0 on the circle, share of a stride, 0 to ½.
pub(super) fn apart(phase: f64) -> f64 {
    (phase - phase.round()).abs()
}
