//! Names of gaits: the named gait that every leg fits.

use super::legs::Leg;
use super::stride::apart;

/// Greatest distance of a leg's phase from that of a named gait, share of a stride: Hildebrand (1965) divides the
/// circle of phases into eight classes, so that each reaches a sixteenth of the stride to either side. It is also half
/// of the distance between a walk and a trot.
const FARTHEST: f64 = 1.0 / 16.0;

/// What a gait is called that has no name.
pub const UNCLASSIFIED: &str = "unclassified";

/// A named gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Template {
    /// Its name.
    pub name: &'static str,
    /// Which of several gaits with the same name it is.
    pub variant: Option<&'static str>,
    /// Touch-down of each leg after that of the first, shares of a stride; legs in the order left before right, front to
    /// back.
    pub phases: &'static [f64],
    /// Usual duty factor. It decides only between names with the same phases.
    pub duty_factor: f64,
}

/// A gait without variants.
const fn single(name: &'static str, phases: &'static [f64], duty_factor: f64) -> Template {
    Template { name, variant: None, phases, duty_factor }
}

/// One of the two gallops.
const fn gallop(variant: &'static str, phases: &'static [f64]) -> Template {
    Template { name: "gallop", variant: Some(variant), phases, duty_factor: 0.3 }
}

/// LF, LH, RF, RH; after Hildebrand 1965 and 1989. The canter and the gallops lead with the left fore leg, which lands
/// last: RH, LH and RF together, LF; RH LH RF LF; RH LH LF RF (where the right fore leg lands last).
const FOUR_LEGS: [Template; 8] = [
    single("walk", &[0.0, 0.75, 0.5, 0.25], 0.75),
    single("trot", &[0.0, 0.5, 0.5, 0.0], 0.45),
    single("pace", &[0.0, 0.0, 0.5, 0.5], 0.45),
    single("bound", &[0.0, 0.5, 0.0, 0.5], 0.4),
    single("canter", &[0.0, 0.67, 0.67, 0.33], 0.4),
    gallop("transverse", &[0.0, 0.4, 0.95, 0.35]),
    gallop("rotary", &[0.0, 0.4, 0.05, 0.35]),
    single("pronk", &[0.0, 0.0, 0.0, 0.0], 0.4),
];

/// LF, LM, LH, RF, RM, RH; after Wilson 1966, "Insect walking": waves of steps run from hind to fore
/// on each side, the sides half a stride apart, and overlap the more the faster the insect goes.
const SIX_LEGS: [Template; 3] = [
    single("wave", &[2.0 / 6.0, 1.0 / 6.0, 0.0, 5.0 / 6.0, 4.0 / 6.0, 3.0 / 6.0], 5.0 / 6.0),
    single("ripple", &[4.0 / 6.0, 2.0 / 6.0, 0.0, 1.0 / 6.0, 5.0 / 6.0, 3.0 / 6.0], 4.0 / 6.0),
    single("tripod", &[0.0, 0.5, 0.0, 0.5, 0.0, 0.5], 0.5),
];

/// L1 to L4 from fore to hind, R1 to R4. The tetrapod is that of Wilson 1967, "Stepping patterns in tarantula spiders"; wave and ripple
/// carry the rule of six legs over to eight: each leg steps the later after the one behind it the less of the stride it stands.
const EIGHT_LEGS: [Template; 3] = [
    single(
        "wave",
        &[3.0 / 8.0, 2.0 / 8.0, 1.0 / 8.0, 0.0, 7.0 / 8.0, 6.0 / 8.0, 5.0 / 8.0, 4.0 / 8.0],
        7.0 / 8.0,
    ),
    single("ripple", &[0.75, 0.5, 0.25, 0.0, 0.25, 0.0, 0.75, 0.5], 0.75),
    single("tetrapod", &[0.0, 0.5, 0.0, 0.5, 0.5, 0.0, 0.5, 0.0], 0.5),
];

/// L, R. Walking and running differ in the duty factor alone.
const TWO_LEGS: [Template; 3] =
    [single("walk", &[0.0, 0.5], 0.6), single("run", &[0.0, 0.5], 0.35), single("hop", &[0.0, 0.0], 0.4)];

/// The named gaits of a character with `legs` legs; none for most numbers.
pub fn templates(legs: usize) -> &'static [Template] {
    match legs {
        2 => &TWO_LEGS,
        4 => &FOUR_LEGS,
        6 => &SIX_LEGS,
        8 => &EIGHT_LEGS,
        _ => &[],
    }
}

impl Template {
    /// Greatest distance of a leg's phase from this gait's at which it still has its name, share of a stride: half of
    /// the distance to the nearest gait with another name and other phases, so that no phases fit two names, and at most
    /// a sixteenth (Hildebrand 1965).
    ///
    /// For four legs that is 0.0375 for the bound and the transverse gallop, 0.05 for the rotary gallop, and a sixteenth
    /// for all others.
    pub fn tolerance(&self) -> f64 {
        templates(self.phases.len())
            .iter()
            .filter(|other| other.name != self.name && other.phases != self.phases)
            .map(|other| 0.5 * Fit::of(other.phases, self).greatest)
            .fold(FARTHEST, f64::min)
    }
}

/// The name of a gait, and its distance from the named gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Classified {
    /// Name of the gait, or `unclassified` where a leg is farther from the nearest one than its
    /// [`tolerance`](Template::tolerance).
    pub name: &'static str,
    /// Which of several gaits with the same name it is.
    pub variant: Option<&'static str>,
    /// Mean distance of the phases to those of the nearest named gait, share of a stride, 0 to ½.
    pub distance: f64,
    /// Distance of the leg that fits it least, share of a stride, 0 to ½, where phases are counted from the moment that
    /// makes it least.
    pub greatest_distance: f64,
    /// What `greatest_distance` may be for the name.
    pub tolerance: f64,
}

/// Names the gait with these phases (shares of a stride) of these legs, in any order, and this mean
/// duty factor; `None` where gaits of so many legs have no names.
///
/// The nearest gait is the one to which the leg that fits least is nearest, for the reference that fits best, so it does
/// not depend on the foot that phases are counted from. Gaits led from the left and from the right have the same name.
/// Names with the same phases are distinguished by the duty factor: at least one half is the slower of the two.
pub fn classify(feet: &[(Leg, f64)], duty_factor: f64) -> Option<Classified> {
    let mut feet = feet.to_vec();
    feet.sort_by_key(|&(leg, _)| leg);
    let phases: Vec<f64> = feet.iter().map(|&(_, phase)| phase).collect();
    let named = templates(phases.len());
    named
        .iter()
        .filter(|template| {
            let twins = named.iter().filter(|twin| twin.phases == template.phases).count();
            twins == 1 || (template.duty_factor >= 0.5) == (duty_factor >= 0.5)
        })
        .map(|template| (template, Fit::of(&phases, template)))
        .min_by(|(_, a), (_, b)| a.greatest.total_cmp(&b.greatest))
        .map(|(template, fit)| {
            let tolerance = template.tolerance();
            let fits = fit.greatest <= tolerance;
            Classified {
                name: if fits { template.name } else { UNCLASSIFIED },
                variant: template.variant.filter(|_| fits),
                distance: fit.mean,
                greatest_distance: fit.greatest,
                tolerance,
            }
        })
}

/// How far phases are from those of a named gait, shares of a stride.
#[derive(Debug, Clone, Copy)]
struct Fit {
    /// Of the leg that fits least.
    greatest: f64,
    /// Mean over the legs.
    mean: f64,
}

impl Fit {
    /// For the better of the gait led from the left and led from the right.
    fn of(phases: &[f64], template: &Template) -> Self {
        // The mirrored gait: left and right legs exchanged.
        let rows = phases.len() / 2;
        let mirrored: Vec<f64> = phases[rows..].iter().chain(&phases[..rows]).copied().collect();
        let [plain, mirrored] = [phases, &mirrored[..]].map(|phases| Self::of_order(phases, template.phases));
        if mirrored.greatest < plain.greatest { mirrored } else { plain }
    }

    /// Greatest and mean distance on the circle between two sets of phases, each for the shift of the second that makes
    /// it least.
    ///
    /// The differences of the phases are points on the circle. The greatest distance from a common point is least from the
    /// middle of the shortest arc that holds them all, the circle without the widest gap between two neighbours. The mean
    /// of distances is piecewise linear in the shift and has its minimum where one of the legs fits exactly.
    fn of_order(phases: &[f64], template: &[f64]) -> Self {
        let mut differences: Vec<f64> =
            phases.iter().zip(template).map(|(phase, wanted)| (phase - wanted).rem_euclid(1.0)).collect();
        differences.sort_by(f64::total_cmp);
        let first = differences.first().copied().unwrap_or(0.0);
        let later = differences.iter().skip(1).copied().chain([first + 1.0]);
        let widest = differences.iter().zip(later).map(|(a, b)| b - a).fold(0.0, f64::max);
        let mean = |shift: f64| {
            differences.iter().map(|difference| apart(difference - shift)).sum::<f64>()
                / differences.len() as f64
        };
        Self {
            greatest: (0.5 * (1.0 - widest)).max(0.0),
            mean: differences.iter().map(|&shift| mean(shift)).fold(f64::INFINITY, f64::min),
        }
    }
}
