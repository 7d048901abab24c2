//! Reading and writing a motion document, and everything that can be wrong with one.

use std::collections::BTreeSet;

use super::document::{Keyframe, Motion, RootAdvance, RootMotion};
use crate::character::LENGTH;
use crate::fault::{self, Fault, InputError, member};

/// Greatest size of a document that is read, bytes.
const MAX_BYTES: usize = 64 << 20;

/// How far the two ends of the loop, or of the entry, may differ: rad, m and their rates, relative
/// above 1. It leaves room for numbers written with nine digits.
const SEAM: f64 = 1e-6;

/// How far a quaternion's norm may be from 1.
const UNIT: f64 = 1e-6;

impl Motion {
    /// Reads a motion document.
    ///
    /// # Errors
    ///
    /// [`InputError::TooLarge`] beyond 64 MiB; [`InputError::Malformed`] with line and column for
    /// what is not JSON; [`InputError::Impossible`] with JSON pointers for an unknown, missing or
    /// wrongly typed field, and for every fault of [`Motion::faults`].
    pub fn parse(bytes: &[u8]) -> Result<Self, InputError> {
        if bytes.len() > MAX_BYTES {
            let reason = format!("the document has {} bytes, more than {MAX_BYTES}", bytes.len());
            return Err(InputError::TooLarge(Fault::new("", reason)));
        }
        let motion: Self = fault::from_json(bytes)?;
        let faults = motion.faults();
        if faults.is_empty() { Ok(motion) } else { Err(InputError::Impossible(faults)) }
    }

    /// The document as JSON, readable by [`Motion::parse`] to the same numbers.
    ///
    /// # Errors
    ///
    /// [`InputError::Impossible`] for a motion that [`Motion::parse`] would refuse.
    pub fn to_json(&self) -> Result<String, InputError> {
        let faults = self.faults();
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        serde_json::to_string(self).map_err(|error| InputError::impossible("", error.to_string()))
    }

    /// Everything that keeps the motion from being played, with JSON pointers: arrays of the wrong
    /// length, numbers that are not finite, times that do not increase, loop times without a
    /// keyframe, seams that do not meet, names that repeat.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let mut names = BTreeSet::new();
        for (index, name) in self.joints.iter().enumerate() {
            if !names.insert(name) {
                faults
                    .push(Fault::new(format!("/joints/{index}"), format!("joint \"{name}\" is named twice")));
            }
        }
        keyframe_faults("/keyframes", &self.keyframes, self.joints.len(), &mut faults);
        keyframe_faults("/entry", &self.entry, self.joints.len(), &mut faults);
        self.drive_faults(&mut faults);
        self.pose_faults(&mut faults);
        self.stance_faults(&mut faults);
        self.steering_faults(&mut faults);
        faults.extend(self.scene.faults().into_iter().map(|fault| fault.under("/scene")));
        faults.extend(self.provenance.accuracy.faults().into_iter().map(|f| f.under("/provenance/accuracy")));
        self.metric_faults(&mut faults);
        // Seams are compared only between keyframes that are sound in themselves.
        if faults.is_empty() {
            self.entry_faults(&mut faults);
            self.loop_faults(&mut faults);
        }
        faults
    }

    fn drive_faults(&self, faults: &mut Vec<Fault>) {
        let joints = self.joints.len();
        let drive = &self.drive;
        for (field, length) in [
            ("stiffness", drive.stiffness.len()),
            ("damping", drive.damping.len()),
            ("max_torque", drive.max_torque.len()),
        ] {
            length_fault(&format!("/drive/{field}"), length, joints, faults);
        }
        if !drive.offset.is_empty() {
            length_fault("/drive/offset", drive.offset.len(), joints, faults);
            finite_faults("/drive/offset", &drive.offset, faults);
        }
        let period = drive.feedforward_period;
        if !(period.is_finite() && period >= 0.0) {
            let reason = format!("{period} is not a finite number of at least 0");
            faults.push(Fault::new("/drive/feedforward_period", reason));
        }
        let torques: Vec<f64> = drive.max_torque.iter().map(|limit| limit.unwrap_or(0.0)).collect();
        for (field, values) in
            [("stiffness", &drive.stiffness), ("damping", &drive.damping), ("max_torque", &torques)]
        {
            for (index, value) in values.iter().enumerate() {
                if !(value.is_finite() && *value >= 0.0) {
                    let reason = format!("{value} is not a finite number of at least 0");
                    faults.push(Fault::new(format!("/drive/{field}/{index}"), reason));
                }
            }
        }
    }

    fn pose_faults(&self, faults: &mut Vec<Fault>) {
        let poses = self.poses.as_deref().unwrap_or_default();
        let times: Vec<f64> = poses.iter().map(|pose| pose.time).collect();
        time_faults("/poses", &times, faults);
        for (index, pose) in poses.iter().enumerate() {
            let place = format!("/poses/{index}");
            length_fault(&format!("{place}/angles"), pose.angles.len(), self.joints.len(), faults);
            finite_faults(&format!("{place}/angles"), &pose.angles, faults);
            place_faults(&format!("{place}/root/position"), &pose.root.position, faults);
            unit_fault(&format!("{place}/root/orientation"), &pose.root.orientation, faults);
        }
    }

    fn stance_faults(&self, faults: &mut Vec<Fault>) {
        let period = self.cycle.end - self.cycle.start;
        for (index, stance) in self.stances.iter().enumerate() {
            if !(0.0 <= stance.start && stance.start < stance.end && stance.end <= period) {
                let reason = format!(
                    "a stance from {} s to {} s; it has to lie within the cycle of {period} s",
                    stance.start, stance.end
                );
                faults.push(Fault::new(format!("/stances/{index}"), reason));
            }
        }
    }

    fn steering_faults(&self, faults: &mut Vec<Fault>) {
        let looping = self.keyframes.iter().filter(|keyframe| keyframe.time >= self.cycle.start).count();
        if let Some(steering) = &self.steering {
            let found = steering.faults(looping.saturating_sub(1), self.joints.len());
            faults.extend(found.into_iter().map(|fault| fault.under("/steering")));
        }
    }

    fn metric_faults(&self, faults: &mut Vec<Fault>) {
        let (metrics, validity) = (&self.metrics, &self.metrics.validity);
        let figures = [
            ("speed", metrics.speed),
            ("upright_seconds", metrics.upright_seconds),
            ("cost_of_transport", metrics.cost_of_transport.unwrap_or(0.0)),
            ("positive_cost_of_transport", metrics.positive_cost_of_transport.unwrap_or(0.0)),
            ("froude", metrics.froude.unwrap_or(0.0)),
            ("stride_period", metrics.stride_period.unwrap_or(0.0)),
            ("validity/torque_saturation", validity.torque_saturation),
            ("validity/greatest_limit_violation", validity.greatest_limit_violation),
            ("validity/greatest_penetration", validity.greatest_penetration),
            ("validity/greatest_residual", validity.greatest_residual),
            ("validity/foot_slip", validity.foot_slip),
            ("validity/tracking_error", validity.tracking_error),
            ("validity/root_adjustment/translation", validity.root_adjustment.translation),
            ("validity/root_adjustment/rotation", validity.root_adjustment.rotation),
        ];
        let duties = metrics.duty_factors.iter().map(|(link, duty)| (member("duty_factors", link), *duty));
        let trials = validity.trials.iter().enumerate().flat_map(|(index, trial)| {
            let place = format!("validity/trials/{index}");
            [
                (format!("{place}/upright_seconds"), trial.upright_seconds),
                (format!("{place}/speed"), trial.speed),
                (format!("{place}/relative_speed"), trial.relative_speed.unwrap_or(0.0)),
                (format!("{place}/tolerance"), trial.tolerance),
                (format!("{place}/of_seconds"), trial.of_seconds),
            ]
        });
        let measures = metrics
            .naturalness
            .iter()
            .map(|(name, measure)| (format!("{}/value", member("naturalness", name)), measure.value));
        for (field, value) in figures
            .map(|(field, value)| (field.to_owned(), value))
            .into_iter()
            .chain(duties)
            .chain(trials)
            .chain(measures)
        {
            if !value.is_finite() {
                faults
                    .push(Fault::new(format!("/metrics/{field}"), format!("{value} is not a finite number")));
            }
        }
    }

    fn entry_faults(&self, faults: &mut Vec<Fault>) {
        let (Some(last), Some(first)) = (self.entry.last(), self.keyframes.first()) else { return };
        if self.entry.len() < 2 {
            let reason = "an entry needs at least two keyframes: the standing pose and the motion's first";
            faults.push(Fault::new("/entry", reason));
        }
        let place = format!("/entry/{}", self.entry.len() - 1);
        let expected = "the motion's first keyframe";
        seam_faults(&format!("{place}/angles"), &last.angles, &first.angles, expected, faults);
        seam_faults(&format!("{place}/velocities"), &last.velocities, &first.velocities, expected, faults);
    }

    fn loop_faults(&self, faults: &mut Vec<Fault>) {
        let Some(last) = self.keyframes.last() else {
            faults.push(Fault::new("/keyframes", "a motion needs at least two keyframes"));
            return;
        };
        let advance = &self.cycle.root_advance;
        finite_faults("/loop/root_advance/translation", &advance.translation, faults);
        if !advance.yaw.is_finite() {
            faults.push(Fault::new("/loop/root_advance/yaw", "the yaw is not a finite number"));
        }
        let Some(first) = self.keyframes.iter().find(|keyframe| keyframe.time == self.cycle.start) else {
            let reason = format!("no keyframe has the time {}", self.cycle.start);
            faults.push(Fault::new("/loop/start", reason));
            return;
        };
        if self.cycle.end != last.time {
            let reason = format!("the loop must end at the last keyframe, at {} s", last.time);
            faults.push(Fault::new("/loop/end", reason));
        }
        if self.cycle.start >= last.time {
            faults.push(Fault::new("/loop/start", "the loop must start before its end"));
        }
        if faults.is_empty() {
            loop_seam_faults(self.keyframes.len() - 1, first, last, advance, faults);
        }
    }
}

fn keyframe_faults(place: &str, keyframes: &[Keyframe], joints: usize, faults: &mut Vec<Fault>) {
    let times: Vec<f64> = keyframes.iter().map(|keyframe| keyframe.time).collect();
    time_faults(place, &times, faults);
    for (index, keyframe) in keyframes.iter().enumerate() {
        let place = format!("{place}/{index}");
        for (field, values) in [("angles", &keyframe.angles), ("velocities", &keyframe.velocities)] {
            length_fault(&format!("{place}/{field}"), values.len(), joints, faults);
            finite_faults(&format!("{place}/{field}"), values, faults);
        }
        let root = &keyframe.root;
        place_faults(&format!("{place}/root/position"), &root.position, faults);
        unit_fault(&format!("{place}/root/orientation"), &root.orientation, faults);
        finite_faults(&format!("{place}/root/linear_velocity"), &root.linear_velocity, faults);
        finite_faults(&format!("{place}/root/angular_velocity"), &root.angular_velocity, faults);
    }
}

fn time_faults(place: &str, times: &[f64], faults: &mut Vec<Fault>) {
    if let Some(&first) = times.first()
        && first != 0.0
    {
        faults.push(Fault::new(format!("{place}/0/time"), format!("the first time is {first}, not 0")));
    }
    for (index, pair) in times.windows(2).enumerate() {
        // Written so that a time that is not a number is a fault, too.
        if !(pair[1] > pair[0] && pair[1].is_finite()) {
            let reason = format!("time {} does not come after {}", pair[1], pair[0]);
            faults.push(Fault::new(format!("{place}/{}/time", index + 1), reason));
        }
    }
}

fn length_fault(place: &str, length: usize, joints: usize, faults: &mut Vec<Fault>) {
    if length != joints {
        faults.push(Fault::new(place, format!("{length} numbers for {joints} joints")));
    }
}

fn finite_faults(place: &str, values: &[f64], faults: &mut Vec<Fault>) {
    for (index, value) in values.iter().enumerate() {
        if !value.is_finite() {
            faults.push(Fault::new(format!("{place}/{index}"), format!("{value} is not a finite number")));
        }
    }
}

fn place_faults(place: &str, position: &[f64; 3], faults: &mut Vec<Fault>) {
    for (index, coordinate) in position.iter().enumerate() {
        if coordinate.is_nan() || coordinate.abs() > LENGTH {
            let reason = format!("{coordinate} m is not finite and within {LENGTH:e} m");
            faults.push(Fault::new(format!("{place}/{index}"), reason));
        }
    }
}

fn unit_fault(place: &str, quaternion: &[f64; 4], faults: &mut Vec<Fault>) {
    let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
    if norm.is_nan() || (norm - 1.0).abs() > UNIT {
        faults.push(Fault::new(place, format!("the quaternion has norm {norm}, not 1")));
    }
}

fn seam_faults(place: &str, found: &[f64], wanted: &[f64], of: &str, faults: &mut Vec<Fault>) {
    for (index, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        if (found - wanted).abs() > SEAM * wanted.abs().max(1.0) {
            let reason = format!("{found} does not meet {of}, which has {wanted}");
            faults.push(Fault::new(format!("{place}/{index}"), reason));
        }
    }
}

fn loop_seam_faults(
    index: usize,
    first: &Keyframe,
    last: &Keyframe,
    advance: &RootAdvance,
    faults: &mut Vec<Fault>,
) {
    let place = format!("/keyframes/{index}");
    let expected = "the loop's start";
    seam_faults(&format!("{place}/angles"), &last.angles, &first.angles, expected, faults);
    seam_faults(&format!("{place}/velocities"), &last.velocities, &first.velocities, expected, faults);
    let expected = "the loop's start moved on by root_advance";
    let wanted = advance.apply(&first.root);
    for (field, found, wanted) in [
        ("position", last.root.position, wanted.position),
        ("linear_velocity", last.root.linear_velocity, wanted.linear_velocity),
        ("angular_velocity", last.root.angular_velocity, wanted.angular_velocity),
    ] {
        seam_faults(&format!("{place}/root/{field}"), &found, &wanted, expected, faults);
    }
    let same = same_side(&last.root, &wanted);
    seam_faults(&format!("{place}/root/orientation"), &same, &wanted.orientation, expected, faults);
}

/// The orientation of `root` with the sign that puts it on the side of `other`: q and −q are the
/// same rotation.
fn same_side(root: &RootMotion, other: &RootMotion) -> [f64; 4] {
    let dot: f64 = root.orientation.iter().zip(&other.orientation).map(|(a, b)| a * b).sum();
    root.orientation.map(|x| if dot < 0.0 { -x } else { x })
}
