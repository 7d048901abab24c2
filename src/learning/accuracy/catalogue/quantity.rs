//! The quantities that are measured of a run.

use nalgebra::Vector3;
use serde::Serialize;

use crate::scenario::{SampleLine, Scenario, Summary};
use gaitwright_physics::motion::RootMotion;
use gaitwright_physics::scene::{Drive, MaxTorque};

/// A finished run of a scenario.
#[derive(Debug)]
pub struct CaseRun<'a> {
    /// What was run.
    pub scenario: &'a Scenario,
    /// Its samples, the first at the start.
    pub samples: &'a [SampleLine],
    /// Its summary.
    pub summary: &'a Summary,
}

/// What can be measured of a run. Samples before the time `after` (s) are ignored.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "of", rename_all = "snake_case")]
pub enum Quantity {
    /// Greatest excess over the start of kinetic, potential and spring energy, less the work of prescribed torques, J.
    /// In a scene with fixed targets it cannot exceed 0 but by numerical errors.
    EnergyGain,
    /// The same as a share of the energy at the start, 1.
    EnergyGainShare,
    /// Greatest change of the same energy in either direction, J.
    EnergyChange,
    /// Greatest change of the momentum, kg m/s.
    MomentumChange,
    /// Greatest change of the angular momentum about the centre of mass, kg m²/s.
    AngularMomentumChange,
    /// Greatest distance of a joint from its range of motion, or of a loop's two ends from each other, rad or m.
    LimitOvershoot,
    /// Greatest depth of a contact, m.
    Penetration,
    /// Greatest excess of a drive's torque over its limit, N m or N.
    TorqueExcess,
    /// Greatest speed of the root's origin, m/s.
    RootSpeed {
        /// s.
        after: f64,
    },
    /// Greatest speed of a joint, rad/s or m/s.
    JointSpeed {
        /// s.
        after: f64,
    },
    /// Greatest distance of the root's origin from where it was at that time, m.
    Creep {
        /// s.
        after: f64,
    },
    /// Greatest height of the root's origin over a level, m.
    Rise {
        /// The level, m.
        over: f64,
    },
    /// Distance of a joint at the end from where it has to be, rad or m.
    FinalAngle {
        /// Name of the joint.
        joint: String,
        /// Where it has to be, rad or m.
        wanted: f64,
    },
    /// Distance of the root's origin at the end from where it has to be, m.
    FinalPosition {
        /// Where it has to be, m.
        wanted: [f64; 3],
    },
    /// Difference between the sum of the contact forces along z at the end and a weight, N.
    FinalWeight {
        /// The weight, N.
        wanted: f64,
    },
}

impl Quantity {
    /// Its unit. Joints that slide are counted in m where others are in rad.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::EnergyGain | Self::EnergyChange => "J",
            Self::EnergyGainShare => "1",
            Self::MomentumChange => "kg m/s",
            Self::AngularMomentumChange => "kg m²/s",
            Self::LimitOvershoot | Self::FinalAngle { .. } => "rad",
            Self::Penetration | Self::Creep { .. } | Self::Rise { .. } | Self::FinalPosition { .. } => "m",
            Self::RootSpeed { .. } => "m/s",
            Self::JointSpeed { .. } => "rad/s",
            Self::TorqueExcess => "N m",
            Self::FinalWeight { .. } => "N",
        }
    }

    /// The quantity of `run` in its unit; NaN where a number of the run is not finite or nothing can be
    /// measured.
    pub fn of(&self, run: &CaseRun<'_>) -> f64 {
        let samples = run.samples;
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return f64::NAN };
        let late = |after: f64| samples.iter().filter(move |sample| sample.time >= after - 1e-9);
        match self {
            Self::EnergyGain => greatest(changes(run, first)),
            Self::EnergyGainShare => greatest(changes(run, first)) / stored(run.scenario, first).abs(),
            Self::EnergyChange => greatest(changes(run, first).map(f64::abs)),
            Self::MomentumChange => {
                greatest(samples.iter().map(|sample| distance(sample.momentum.linear, first.momentum.linear)))
            }
            Self::AngularMomentumChange => greatest(
                samples.iter().map(|sample| distance(sample.momentum.angular, first.momentum.angular)),
            ),
            Self::LimitOvershoot => run.summary.greatest_joint_error,
            Self::Penetration => run.summary.record.greatest_penetration,
            Self::TorqueExcess => {
                let Drive::Hold { max_torque: MaxTorque::All(most), .. } = run.scenario.drive else {
                    return f64::NAN;
                };
                let torques = samples.iter().flat_map(|sample| sample.joints.values());
                greatest(torques.map(|joint| joint.torque.abs() - most))
            }
            Self::RootSpeed { after } => {
                greatest(late(*after).map(|sample| length(sample.root.linear_velocity)))
            }
            Self::JointSpeed { after } => {
                let joints = late(*after).flat_map(|sample| sample.joints.values());
                greatest(joints.map(|joint| joint.velocity.abs()))
            }
            Self::Creep { after } => {
                let Some(start) = late(*after).next() else { return f64::NAN };
                greatest(late(*after).map(|sample| apart(&sample.root, &start.root)))
            }
            Self::Rise { over } => greatest(samples.iter().map(|sample| sample.root.position[2] - over)),
            Self::FinalAngle { joint, wanted } => {
                last.joints.get(joint).map_or(f64::NAN, |joint| (joint.angle - wanted).abs())
            }
            Self::FinalPosition { wanted } => distance(last.root.position, *wanted),
            Self::FinalWeight { wanted } => {
                let carried: f64 = last.contacts.iter().map(|contact| contact.force[2]).sum();
                (carried - wanted).abs()
            }
        }
    }
}

/// The excess of the stored energy over that at the start, at every sample, J.
fn changes<'a>(run: &'a CaseRun<'_>, first: &SampleLine) -> impl Iterator<Item = f64> + use<'a> {
    let start = stored(run.scenario, first);
    let scenario = run.scenario;
    run.samples.iter().map(move |sample| stored(scenario, sample) - start)
}

/// Kinetic, potential and spring energy of `sample`, less the work of prescribed torques since angle 0, J.
///
/// A spring of stiffness K whose torque is limited to τ acts with the constant torque τ beyond the displacement τ/K, and
/// stores energy accordingly. Its damper only dissipates, whether the torque is limited or not.
fn stored(scenario: &Scenario, sample: &SampleLine) -> f64 {
    let angle = |name: &String| sample.joints.get(name).map_or(0.0, |joint| joint.angle);
    let driven: f64 = match &scenario.drive {
        Drive::Hold { stiffness: Some(stiffness), max_torque, joints, .. } => {
            let most = match max_torque {
                MaxTorque::All(most) => *most,
                MaxTorque::Character | MaxTorque::Unlimited => f64::INFINITY,
            };
            joints.iter().map(|(name, target)| spring(*stiffness, most, angle(name) - target)).sum()
        }
        Drive::Torque { joints } => joints.iter().map(|(name, torque)| -torque * angle(name)).sum(),
        Drive::None {} | Drive::Velocity { .. } | Drive::Hold { .. } | Drive::Track { .. } => 0.0,
    };
    sample.energy.kinetic + sample.energy.potential + driven
}

/// Energy of a spring whose torque is limited to `most`, J.
fn spring(stiffness: f64, most: f64, displacement: f64) -> f64 {
    let displacement = displacement.abs();
    if stiffness * displacement <= most {
        0.5 * stiffness * displacement * displacement
    } else {
        most * (displacement - 0.5 * most / stiffness)
    }
}

/// The greatest value; NaN if one of them is, or there is none.
fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    let greater = |most: f64, value: f64| if value.is_nan() || value > most { value } else { most };
    values.reduce(greater).unwrap_or(f64::NAN)
}

fn length(vector: [f64; 3]) -> f64 {
    Vector3::from(vector).norm()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (Vector3::from(a) - Vector3::from(b)).norm()
}

fn apart(a: &RootMotion, b: &RootMotion) -> f64 {
    distance(a.position, b.position)
}
