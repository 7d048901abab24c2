//! Named gaits: when each leg touches down, for how much of the stride it stands, and at which speeds it is used.

use gaitwright_physics::model::Model;
use gaitwright_physics::stance::Stance;

use super::legs::Legs;
use super::no_gaits::NoGaits;
use crate::gait::limits::{GaitLimits, leaps};
use crate::gait::templates;

/// A way of going with a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedGait {
    /// Its own name.
    pub name: &'static str,
    /// Name of the gait that it is a kind of.
    pub gait: &'static str,
    /// Which of several gaits with that name it is, as a gait report calls it.
    pub variant: Option<&'static str>,
    /// Touch-down of each leg after that of the first, parts of a stride; left legs before right ones,
    /// front to back.
    pub phases: &'static [f64],
    /// Distance of a leg's phase from that up to which the gait has its name, parts of a stride.
    pub tolerance: f64,
    /// Share of the stride for which a leg is to stand.
    pub duty_factor: f64,
    /// Froude numbers v² / (g h): the least at which it is used, the usual one, and the greatest.
    pub froude: [f64; 3],
}

impl NamedGait {
    /// Whether left and right legs step half a stride apart.
    pub fn symmetrical(&self) -> bool {
        GaitLimits::of_gait(self.gait).symmetrical
    }

    /// How much later left legs step than right ones, parts of a stride, where the gait is its own mirror image then: at once or half a
    /// stride later.
    pub fn mirrored_after(&self) -> Option<f64> {
        let (left, right) = self.phases.split_at(self.phases.len() / 2);
        [0.0, 0.5].into_iter().find(|later| {
            left.iter().zip(right).all(|(left, right)| {
                let apart = left - right - later;
                (apart - apart.round()).abs() < 1e-6
            })
        })
    }

    /// Whether few searches find it. Leaps pitch, most of them turn, and their legs have times of their own; a run on two legs has
    /// flights between single supports.
    pub fn is_hard(&self) -> bool {
        leaps(self.gait) || self.gait == "run"
    }

    /// How many times the generations of a gait it takes; waves of a body have no template.
    pub fn share(&self) -> u32 {
        match self.is_hard() {
            true => 3,
            false if self.symmetrical() => 1,
            false => 4,
        }
    }

    /// `froude` kept within those at which the gait is used.
    pub fn suited(&self, froude: f64) -> f64 {
        froude.clamp(self.froude[0], self.froude[2])
    }

    /// Whether it is one of the gallops, the fastest of gaits.
    pub fn gallops(&self) -> bool {
        self.gait == "gallop"
    }

    /// Whether it is what a task asks for by this name: its own, or that of the gait that it is a kind of.
    pub fn is_called(&self, asked: &str) -> bool {
        asked == self.name || asked == self.gait
    }

    /// Whether the gait is used at this Froude number.
    pub fn suits(&self, froude: f64) -> bool {
        self.suited(froude) == froude
    }
}

/// A way of going: its name, its gait and which variant of that, its duty factor and its Froude numbers.
type Way = (&'static str, &'static str, Option<&'static str>, f64, [f64; 3]);

/// Froude numbers after Alexander & Jayes 1983: horses and dogs change from walk to trot at 0.35 to 0.5, and from trot to
/// gallop at 2 to 3. A canter or a gallop that is a tenth slower than its least Froude number asks is still judged one. The duty
/// factors of the walk and the gallops are those of animals at their speed here, not those of the slowest walk and the fastest gallop.
const FOUR: [Way; 9] = [
    ("walk", "walk", None, 0.65, [0.02, 0.1, 0.5]),
    ("trot", "trot", None, 0.5, [0.1, 0.4, 0.7]),
    ("running trot", "trot", None, 0.4, [0.7, 1.0, 3.0]),
    ("pace", "pace", None, 0.5, [0.1, 0.4, 3.0]),
    ("canter", "canter", None, 0.4, [1.0, 1.0, 3.0]),
    ("bound", "bound", None, 0.4, [0.3, 1.0, 5.0]),
    ("transverse gallop", "gallop", Some("transverse"), 0.38, [1.0, 2.0, 20.0]),
    ("rotary gallop", "gallop", Some("rotary"), 0.38, [1.0, 2.0, 20.0]),
    ("pronk", "pronk", None, 0.4, [0.1, 0.5, 3.0]),
];

const SIX: [Way; 3] = [
    ("wave", "wave", None, 5.0 / 6.0, [0.001, 0.01, 0.05]),
    ("ripple", "ripple", None, 4.0 / 6.0, [0.005, 0.03, 0.15]),
    ("tripod", "tripod", None, 0.52, [0.01, 0.08, 1.0]),
];

/// The usual Froude numbers are those of six legs in the gaits that correspond.
const EIGHT: [Way; 3] = [
    ("wave", "wave", None, 5.0 / 6.0, [0.001, 0.01, 0.05]),
    ("ripple", "ripple", None, 0.72, [0.005, 0.03, 0.15]),
    ("tetrapod", "tetrapod", None, 0.52, [0.01, 0.08, 1.0]),
];

/// People change from a walk to a run at 0.5 (Alexander 1989).
const TWO: [Way; 3] = [
    ("walk", "walk", None, 0.6, [0.02, 0.04, 0.5]),
    ("run", "run", None, 0.4, [0.3, 0.7, 5.0]),
    ("hop", "hop", None, 0.4, [0.1, 0.5, 3.0]),
];

/// The named gaits of a character with `legs` legs, those that are looked for first before others; none for most numbers.
pub fn gaits(legs: usize) -> Vec<NamedGait> {
    let ways: &[Way] = match legs {
        2 => &TWO,
        4 => &FOUR,
        6 => &SIX,
        8 => &EIGHT,
        _ => &[],
    };
    let named = |&(name, gait, variant, duty_factor, froude): &Way| {
        let template =
            templates(legs).iter().find(|template| template.name == gait && template.variant == variant)?;
        let (phases, tolerance) = (template.phases, template.tolerance());
        Some(NamedGait { name, gait, variant, phases, tolerance, duty_factor, froude })
    };
    ways.iter().filter_map(named).collect()
}

/// What waves along a body without legs are called, each with the part of the way that it goes along the body, and the usual Froude
/// number, in which a quarter of the body's length stands in for the height of the hips.
const WAVES: [(&str, [f64; 2], f64); 3] =
    [("sidewinding", [0.0, 0.75], 0.05), ("undulation", [0.75, 1.0], 0.04), ("crawling", [0.75, 1.0], 0.01)];

/// The ways of going of a character: the named gaits of its legs, or the waves along its body that lead along the way.
pub fn ways(legs: &Legs) -> Vec<NamedGait> {
    let Some(spine) = &legs.spine else { return gaits(legs.legs.len()) };
    let along = spine.forward.x.abs();
    let waves = WAVES.iter().filter(|(_, [least, most], _)| (*least..=*most).contains(&along));
    waves
        .map(|&(name, _, usual)| NamedGait {
            name,
            gait: name,
            variant: None,
            phases: &[],
            tolerance: 1.0,
            duty_factor: 1.0,
            froude: [0.0, usual, 1.0],
        })
        .collect()
}

/// The legs, or the body without legs, of a character that has gaits under `gravity`, m/s², for travel along `direction`.
///
/// # Errors
/// Why it has none.
pub fn with_gaits(
    model: &Model,
    stance: &Stance,
    gravity: f64,
    direction: [f64; 3],
) -> Result<Legs, NoGaits> {
    // Without weight there is no stride.
    if gravity == 0.0 {
        return Err(NoGaits::Weightless);
    }
    let legs = Legs::any(model, stance, direction)?;
    if ways(&legs).is_empty() { Err(NoGaits::LegCount { legs: legs.legs.len() }) } else { Ok(legs) }
}

/// What a task can ask for as the gait of a character: its gaits, and of gaits that are used in several ways each by its own name.
pub fn task_gaits(legs: &Legs) -> Vec<&'static str> {
    let mut names: Vec<&str> = Vec::new();
    for name in ways(legs).iter().flat_map(|way| [way.gait, way.name]) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The gait of which `asked`, as a task names it, is a kind.
pub fn gait_of(asked: &str) -> &str {
    let all = [&FOUR[..], &SIX, &EIGHT, &TWO].concat();
    all.iter().find(|(name, ..)| *name == asked).map_or(asked, |(_, gait, ..)| gait)
}

/// The gait called `name` for as many legs as `legs` has.
pub fn named(name: &str, legs: &Legs) -> Option<NamedGait> {
    ways(legs).into_iter().find(|gait| gait.name == name)
}
