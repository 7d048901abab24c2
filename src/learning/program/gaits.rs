//! Named gaits: when each leg touches down, for how much of the stride it stands, and at which speeds it is used.

use super::legs::Legs;

/// A way of going with a name, for as many legs as it has phases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedGait {
    /// Its own name.
    pub name: &'static str,
    /// Name of the gait that it is a kind of.
    pub gait: &'static str,
    /// Touch-down of each leg after that of the first, parts of a stride; left legs before right ones,
    /// front to back.
    pub phases: &'static [f64],
    /// Usual share of the stride for which a leg stands.
    pub duty_factor: f64,
    /// Froude numbers v² / (g l): the least at which it is used, the usual one, and the greatest.
    pub froude: [f64; 3],
}

impl NamedGait {
    /// `froude` kept within those at which the gait is used.
    pub fn suited(&self, froude: f64) -> f64 {
        froude.clamp(self.froude[0], self.froude[2])
    }

    /// Whether the gait is used at this Froude number.
    pub fn suits(&self, froude: f64) -> bool {
        self.suited(froude) == froude
    }
}

const TROT: [f64; 4] = [0.0, 0.5, 0.5, 0.0];

/// LF, LH, RF, RH (Hildebrand 1965, 1989; Alexander 1984 for the fast gaits). The canter and the gallops
/// lead with the left fore leg, which lands last of the fore legs. Froude numbers after Alexander & Jayes 1983: horses
/// and dogs change from walk to trot at 0.35 to 0.5, and from trot to gallop at 2 to 3.
const FOUR: [NamedGait; 9] = [
    entry("walk", "walk", &[0.0, 0.75, 0.5, 0.25], 0.65, [0.02, 0.1, 0.5]),
    entry("trot", "trot", &TROT, 0.5, [0.1, 0.4, 0.7]),
    entry("running trot", "trot", &TROT, 0.4, [0.7, 1.0, 3.0]),
    entry("pace", "pace", &[0.0, 0.0, 0.5, 0.5], 0.5, [0.1, 0.4, 3.0]),
    entry("canter", "canter", &[0.0, 0.67, 0.67, 0.33], 0.4, [0.8, 1.0, 3.0]),
    entry("bound", "bound", &[0.0, 0.5, 0.0, 0.5], 0.4, [0.3, 1.0, 5.0]),
    entry("transverse gallop", "gallop", &[0.0, 0.4, 0.95, 0.35], 0.3, [0.8, 2.0, 20.0]),
    entry("rotary gallop", "gallop", &[0.0, 0.4, 0.05, 0.35], 0.3, [0.8, 2.0, 20.0]),
    entry("pronk", "pronk", &[0.0, 0.0, 0.0, 0.0], 0.4, [0.1, 0.5, 3.0]),
];

/// LF, LM, LH, RF, RM, RH (Wilson 1966): the slower, the longer the stance and the later each leg after that behind it.
const SIX: [NamedGait; 3] = [
    entry(
        "wave",
        "wave",
        &[2.0 / 6.0, 1.0 / 6.0, 0.0, 5.0 / 6.0, 4.0 / 6.0, 3.0 / 6.0],
        5.0 / 6.0,
        [0.001, 0.01, 0.05],
    ),
    entry(
        "ripple",
        "ripple",
        &[4.0 / 6.0, 2.0 / 6.0, 0.0, 1.0 / 6.0, 5.0 / 6.0, 3.0 / 6.0],
        4.0 / 6.0,
        [0.005, 0.03, 0.15],
    ),
    entry("tripod", "tripod", &[0.0, 0.5, 0.0, 0.5, 0.0, 0.5], 0.52, [0.01, 0.08, 1.0]),
];

/// L, R.
const TWO: [NamedGait; 3] = [
    entry("walk", "walk", &[0.0, 0.5], 0.6, [0.02, 0.1, 0.5]),
    entry("run", "run", &[0.0, 0.5], 0.4, [0.3, 0.7, 5.0]),
    entry("hop", "hop", &[0.0, 0.0], 0.4, [0.1, 0.5, 3.0]),
];

const fn entry(
    name: &'static str,
    gait: &'static str,
    phases: &'static [f64],
    duty_factor: f64,
    froude: [f64; 3],
) -> NamedGait {
    NamedGait { name, gait, phases, duty_factor, froude }
}

/// The named gaits of a character with `legs` legs, the slowest first; none for most numbers.
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
