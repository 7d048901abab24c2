//! The limits of a natural motion. They are ours unless a source is named.

use super::report::{GaitReport, Regime};

/// Least speed along the direction over √(g h): a Froude number of 10⁻⁴.
pub(crate) const TRAVEL: f64 = 0.01;
/// Strides that have to be seen.
pub(crate) const STRIDES: f64 = 10.0;
/// Greatest tilt of the root from its standing orientation, rad.
pub(crate) const TILT: f64 = 0.35;
/// Least height of the root over that of the standing pose.
pub(crate) const HEIGHT: f64 = 0.7;
/// Speed over the one asked for.
pub(crate) const SPEED: [f64; 2] = [0.9, 1.1];
/// Way to the side over the way along the direction.
pub(crate) const DRIFT: f64 = 0.05;
/// Standard deviation of the stride period over its mean; also of the way of each round of the loop where nothing steps,
/// since at a constant speed a stride's way varies as its period does.
pub(crate) const PERIOD_SPREAD: f64 = 0.02;
/// Greatest circular standard deviation of a phase, share of a stride.
pub(crate) const PHASE_SPREAD: f64 = 0.02;
/// |φ_left − φ_right − ½| of symmetrical gaits, half of what Hildebrand (1965) still calls symmetrical.
pub(crate) const ASYMMETRY: f64 = 0.05;
/// Peak force of a foot over that of a half-sine with the same mean and duty factor. A racehorse's fore foot peaks at 2.5
/// body weights.
pub(crate) const PEAK_FORCE: f64 = 1.5;
/// Slip over speed.
pub(crate) const SLIP: f64 = 0.05;
/// Lift of a foot in swing over the hip height.
pub(crate) const CLEARANCE: [f64; 2] = [0.05, 0.35];
/// Share of the time in which something else than a foot touches the ground.
pub(crate) const SCUFFING: f64 = 0.0;
/// Most legs whose extension is judged: more than four have their knees bent in nature.
pub(crate) const UPRIGHT_LEGS: usize = 4;
/// Distance from hip to foot in mid-stance over the greatest possible.
pub(crate) const EXTENSION: [f64; 2] = [0.8, 0.95];
/// Share of joints and time at the torque limit.
pub(crate) const SATURATION: f64 = 0.01;
/// Share of each joint's variance in the first harmonics of the stride ([`harmonics`](super::harmonics::harmonics)).
pub(crate) const SMOOTHNESS: f64 = 0.9;
/// 8° and 20° from least to greatest, rad.
const LEVEL: f64 = 8.0 * std::f64::consts::PI / 180.0;
const ROCKING: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// What a gait may have, by its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GaitLimits {
    /// Froude numbers; `None` for gaits without a row of their own. Horses change from walk to trot at 0.35 to 0.5 and from
    /// trot to gallop at 2 to 3 (Alexander & Jayes 1983).
    pub(crate) froude: Option<[Option<f64>; 2]>,
    /// Duty factor of every foot; `None` for gaits without a row.
    pub(crate) duty_factor: Option<[f64; 2]>,
    /// ∫ Σ |τ q̇| dt / (m g d).
    pub(crate) cost_of_transport: f64,
    /// Height of the trunk from lowest to highest in a stride over the hip height.
    pub(crate) heave: f64,
    /// Pitch and roll from least to greatest in a stride, rad.
    pub(crate) rotation: f64,
    /// Whether left and right legs step half a stride apart.
    pub(crate) symmetrical: bool,
}

const WALK: GaitLimits = GaitLimits {
    froude: Some([None, Some(0.5)]),
    duty_factor: Some([0.55, 0.8]),
    cost_of_transport: 0.5,
    heave: 0.06,
    rotation: LEVEL,
    symmetrical: true,
};
const TROT: GaitLimits =
    GaitLimits { froude: Some([Some(0.1), Some(3.0)]), duty_factor: Some([0.35, 0.65]), heave: 0.12, ..WALK };
const RUN: GaitLimits = GaitLimits {
    froude: None,
    duty_factor: Some([0.2, 0.5]),
    cost_of_transport: 0.8,
    heave: 0.25,
    rotation: LEVEL,
    symmetrical: true,
};
const LEAP: GaitLimits = GaitLimits { symmetrical: false, ..RUN };
const GALLOP: GaitLimits = GaitLimits { froude: Some([Some(0.8), None]), rotation: ROCKING, ..LEAP };

/// Whether legs push together in the gait called `name`: in canter, bound, gallop, pronk and hop.
pub fn leaps(name: &str) -> bool {
    GaitLimits::named(name).is_some_and(|limits| !limits.symmetrical)
}

impl GaitLimits {
    /// Those of the gait of `report`; where it has no name, of walking or running as the duty factor says, and of running
    /// for what has no feet.
    pub(crate) fn of(report: &GaitReport, footed: bool) -> Self {
        let walks = footed && report.regime == Some(Regime::Walk);
        let otherwise = || Self::unnamed(if walks { WALK } else { RUN });
        report.gait.as_deref().and_then(Self::named).unwrap_or_else(otherwise)
    }

    /// Those of the gait called `name`; of running where nothing is called so.
    pub(crate) fn of_gait(name: &str) -> Self {
        Self::named(name).unwrap_or_else(|| Self::unnamed(RUN))
    }

    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "walk" => WALK,
            "trot" | "pace" => TROT,
            "canter" | "gallop" => GALLOP,
            "bound" => Self { froude: None, ..GALLOP },
            "pronk" | "hop" => LEAP,
            "run" => RUN,
            "wave" | "ripple" | "tripod" | "tetrapod" => Self { symmetrical: true, ..Self::unnamed(WALK) },
            _ => return None,
        })
    }

    /// `limits` but for what only a named gait has.
    fn unnamed(limits: Self) -> Self {
        Self { froude: None, duty_factor: None, symmetrical: false, ..limits }
    }
}
