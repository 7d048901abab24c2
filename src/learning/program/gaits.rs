//! Named gaits: when each leg touches down, and for how much of the stride it stands.

use super::legs::Legs;

/// A gait by name, for as many legs as it has phases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedGait {
    /// Its name.
    pub name: &'static str,
    /// Touch-down of each leg after that of the first, parts of a stride; left legs before right ones,
    /// front to back.
    pub phases: &'static [f64],
    /// Usual share of the stride for which a leg stands.
    pub duty_factor: f64,
}

/// LF, LH, RF, RH (Hildebrand 1965, 1989; Alexander 1984 for the fast gaits). The canter and the gallops
/// lead with the left fore leg, which lands last of the fore legs.
const FOUR: [NamedGait; 9] = [
    NamedGait { name: "walk", phases: &[0.0, 0.75, 0.5, 0.25], duty_factor: 0.65 },
    NamedGait { name: "trot", phases: &[0.0, 0.5, 0.5, 0.0], duty_factor: 0.5 },
    NamedGait { name: "running trot", phases: &[0.0, 0.5, 0.5, 0.0], duty_factor: 0.4 },
    NamedGait { name: "pace", phases: &[0.0, 0.0, 0.5, 0.5], duty_factor: 0.5 },
    NamedGait { name: "bound", phases: &[0.0, 0.5, 0.0, 0.5], duty_factor: 0.4 },
    NamedGait { name: "canter", phases: &[0.0, 0.67, 0.67, 0.33], duty_factor: 0.4 },
    NamedGait { name: "transverse gallop", phases: &[0.0, 0.4, 0.95, 0.35], duty_factor: 0.3 },
    NamedGait { name: "rotary gallop", phases: &[0.0, 0.4, 0.05, 0.35], duty_factor: 0.3 },
    NamedGait { name: "pronk", phases: &[0.0, 0.0, 0.0, 0.0], duty_factor: 0.4 },
];

/// LF, LM, LH, RF, RM, RH (Wilson 1966).
const SIX: [NamedGait; 3] = [
    NamedGait {
        name: "wave",
        phases: &[2.0 / 6.0, 1.0 / 6.0, 0.0, 5.0 / 6.0, 4.0 / 6.0, 3.0 / 6.0],
        duty_factor: 5.0 / 6.0,
    },
    NamedGait {
        name: "ripple",
        phases: &[4.0 / 6.0, 2.0 / 6.0, 0.0, 1.0 / 6.0, 5.0 / 6.0, 3.0 / 6.0],
        duty_factor: 4.0 / 6.0,
    },
    NamedGait { name: "tripod", phases: &[0.0, 0.5, 0.0, 0.5, 0.0, 0.5], duty_factor: 0.52 },
];

/// L, R.
const TWO: [NamedGait; 3] = [
    NamedGait { name: "walk", phases: &[0.0, 0.5], duty_factor: 0.6 },
    NamedGait { name: "run", phases: &[0.0, 0.5], duty_factor: 0.4 },
    NamedGait { name: "hop", phases: &[0.0, 0.0], duty_factor: 0.4 },
];

/// The named gaits of a character with `legs` legs; none for most numbers.
pub fn gaits(legs: usize) -> &'static [NamedGait] {
    match legs {
        2 => &TWO,
        4 => &FOUR,
        6 => &SIX,
        _ => &[],
    }
}

/// The gait called `name` for as many legs as `legs` has.
pub fn named(name: &str, legs: &Legs) -> Option<NamedGait> {
    gaits(legs.legs.len()).iter().find(|gait| gait.name == name).copied()
}
