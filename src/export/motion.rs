//! The motion document of a learned behaviour.

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::bend::Bend;
use gaitwright_learning::gait::{Foot, GaitReport};
use gaitwright_learning::learn::{Behaviour, Posture};
use gaitwright_physics::character::Character;
use gaitwright_physics::motion::{
    CharacterRef, Interpolation, Keyframe, Metrics, Motion, MotionFormat, MotionLoop, Provenance,
    RootAdjustment, RootAdvance, RootMotion, RootPose, SampledPose, StanceTime, Validity,
};
use gaitwright_physics::playback::{Sample, Trace};
use gaitwright_physics::scene::{Gains, Ground, Scene};
use gaitwright_physics::sim::Root;

/// A behaviour and what was seen of it in a continuous simulation.
#[derive(Debug, Clone)]
pub struct Performance<'a> {
    /// Whose it is.
    pub character: &'a Character,
    /// Names of the joints in the order of the behaviour and of the trace.
    pub joints: &'a [String],
    /// Target angles of the standing pose that it starts from, rad or m.
    pub standing: &'a [f64],
    /// The behaviour.
    pub behaviour: &'a Behaviour,
    /// The behaviour played by [`gaitwright_physics::motion::Player::from_postures`] from the standing pose at time
    /// 0, entry included.
    pub trace: &'a Trace,
    /// The gait of the looping stretch of the trace.
    pub gait: &'a GaitReport,
    /// How valid the looping stretch of the trace is.
    pub validity: &'a Validity,
    /// The scene it was played in.
    pub scene: &'a Scene,
    /// How strongly the joints followed.
    pub drive: &'a Gains,
    /// How it came about.
    pub provenance: &'a Provenance,
}

/// Writes the motion document of a performance; `None` where the behaviour has no cycle or its
/// character fell before it had gone round it once.
///
/// The root of the keyframes is that of one cycle of the loop, moved along the ground and rotated about z so that
/// it starts where the entry ends: of the cycle whose travel is typical and that comes closest to repeating itself
/// (`best_cycle`). No simulated cycle repeats itself exactly, and none starts quite as the entry ends, so the paths
/// of both are bent to meet, by a cubic that grows from nothing at their start (`Bend`): the cycle's to end where
/// its travel leads from its start, which on level ground is neither up nor down, and the entry's to end where
/// the cycle starts. The most that is added anywhere stands in the document as `root_adjustment`. Angles and
/// velocities of the joints are as they were learned, and the other metrics are those of the simulation.
pub fn motion(performance: &Performance<'_>) -> Option<Motion> {
    let Performance { behaviour, trace, .. } = performance;
    let step = behaviour.transition_time;
    let period = step * behaviour.cycle.len() as f64;
    let lead = step * (behaviour.entry.len() + 1) as f64;
    let level = is_level(performance.scene);
    let cycle = best_cycle(trace, lead, period, level)?;

    let entry_end = root_motion(&at(trace, lead)?.root);
    let moved = ground_frame(&entry_end) * ground_frame(&root_motion(&at(trace, cycle)?.root)).inverse();
    let rest = vec![0.0; performance.standing.len()];
    let first = behaviour.cycle.first()?;

    let start = transformed(&moved, &at(trace, cycle)?.root);
    let end = transformed(&moved, &at(trace, cycle + period)?.root);
    let root_advance = travel(&start, &end, level);
    let closing = Bend::new(period, &end, &root_advance.apply(&start));
    let joining = Bend::new(lead, &entry_end, &start);

    let mut entry = vec![keyframe(0.0, performance.standing, &rest, root_motion(&at(trace, 0.0)?.root))];
    for (index, posture) in behaviour.entry.iter().chain([first]).enumerate() {
        let time = step * (index + 1) as f64;
        entry.push(of_posture(time, posture, joining.at(time, &root_motion(&at(trace, time)?.root))));
    }
    // Rounding must not keep the entry from ending where the loop starts.
    entry.last_mut()?.root = start;
    let mut keyframes = Vec::with_capacity(behaviour.cycle.len() + 1);
    for (index, posture) in behaviour.cycle.iter().enumerate() {
        let time = step * index as f64;
        let root = transformed(&moved, &at(trace, cycle + time)?.root);
        keyframes.push(of_posture(time, posture, closing.at(time, &root)));
    }
    keyframes.push(of_posture(period, first, root_advance.apply(&start)));

    Some(Motion {
        format: MotionFormat::V1,
        character: CharacterRef {
            name: performance.character.name.clone(),
            digest: performance.character.digest.clone(),
        },
        joints: performance.joints.to_vec(),
        interpolation: Interpolation::CubicHermite,
        keyframes,
        cycle: MotionLoop { start: 0.0, end: period, root_advance },
        entry,
        steering: behaviour.steering.clone(),
        drive: performance.drive.clone(),
        metrics: metrics(performance, closing.greatest().max(joining.greatest())),
        scene: performance.scene.clone(),
        provenance: performance.provenance.clone(),
        poses: poses(trace, cycle, (&moved, &closing), period),
        stances: stances(performance.gait, cycle, period),
    })
}

fn metrics(performance: &Performance<'_>, root_adjustment: RootAdjustment) -> Metrics {
    let (gait, trace) = (performance.gait, performance.trace);
    let end = trace.samples.last().map_or(0.0, |sample| sample.time);
    Metrics {
        speed: gait.speed,
        upright_seconds: trace.fell_at.unwrap_or(end),
        cost_of_transport: gait.cost_of_transport,
        positive_cost_of_transport: gait.positive_cost_of_transport,
        froude: gait.froude,
        gait: gait.gait.clone(),
        duty_factors: gait.feet.iter().map(|foot| (foot.link.clone(), foot.duty_factor)).collect(),
        stride_period: gait.stride_period,
        natural: gait.natural,
        naturalness: gait.naturalness.clone(),
        validity: Validity { root_adjustment, ..performance.validity.clone() },
    }
}

/// Whether nothing can lead up or down for good.
fn is_level(scene: &Scene) -> bool {
    matches!(scene.ground, Some(Ground::Plane { .. })) && scene.obstacles.is_empty()
}

/// The travel from `start` to `end` of a cycle, along the ground alone where that is `level`.
fn travel(start: &RootMotion, end: &RootMotion, level: bool) -> RootAdvance {
    let mut advance = RootAdvance::between(start, end);
    if level {
        advance.translation[2] = 0.0;
    }
    advance
}

/// A whole upright cycle of the loop.
struct Cycle {
    /// When it starts, s.
    start: f64,
    /// Its travel, m and rad.
    travel: [f64; 4],
    /// How far its end is from where its travel leads from its start: squares of metres and of radians.
    open: f64,
}

/// When the cycle starts whose travel is nearest to the mean of all whole upright cycles and whose end is nearest
/// to a repetition of its start, s. The first cycle, which still has something of the entry, counts only where
/// there is no other.
fn best_cycle(trace: &Trace, lead: f64, period: f64, level: bool) -> Option<f64> {
    let end = trace.samples.last()?.time;
    let end = trace.fell_at.map_or(end, |fell| fell.min(end)) + 1e-9;
    if !(period > 0.0 && lead + period <= end) {
        return None;
    }
    let count = ((end - lead) / period).floor() as usize;
    let starts = (usize::from(count > 1)..count).map(|cycle| lead + cycle as f64 * period);
    let cycles: Vec<Cycle> = starts.filter_map(|start| cycle(trace, start, period, level)).collect();
    let mean = |axis: usize| cycles.iter().map(|cycle| cycle.travel[axis]).sum::<f64>() / cycles.len() as f64;
    let means = [mean(0), mean(1), mean(2), mean(3)];
    let off = |cycle: &Cycle| {
        let odd = cycle.travel.iter().zip(&means).map(|(value, mean)| (value - mean).powi(2)).sum::<f64>();
        odd + cycle.open
    };
    cycles.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map(|cycle| cycle.start)
}

fn cycle(trace: &Trace, start: f64, period: f64, level: bool) -> Option<Cycle> {
    let [from, to] = [at(trace, start)?, at(trace, start + period)?].map(|sample| root_motion(&sample.root));
    let advance = travel(&from, &to, level);
    let (found, wanted) = (Root::from(&to), Root::from(&advance.apply(&from)));
    let open = (wanted.position - found.position).norm_squared()
        + wanted.orientation.angle_to(&found.orientation).powi(2);
    let [x, y, z] = advance.translation;
    Some(Cycle { start, travel: [x, y, z, advance.yaw], open })
}

/// The poses of one cycle, as dense as the trace.
fn poses(
    trace: &Trace,
    cycle: f64,
    (moved, closing): (&Isometry3<f64>, &Bend),
    period: f64,
) -> Option<Vec<SampledPose>> {
    let interval = trace.samples.get(1)?.time - trace.samples.first()?.time;
    let count = (period / interval).round().max(1.0) as usize;
    (0..=count)
        .map(|index| {
            let time = period * index as f64 / count as f64;
            let sample = at(trace, cycle + time)?;
            let root = closing.at(time, &transformed(moved, &sample.root));
            let root = RootPose { position: root.position, orientation: root.orientation };
            Some(SampledPose { time, angles: sample.angles, root })
        })
        .collect()
}

/// When each foot stands in one cycle.
fn stances(gait: &GaitReport, cycle: f64, period: f64) -> Vec<StanceTime> {
    let of_foot = |foot: &Foot| {
        let link = foot.link.clone();
        let within = foot.stances.iter().map(move |[start, end]| StanceTime {
            link: link.clone(),
            start: (start - cycle).max(0.0),
            end: (end - cycle).min(period),
        });
        within.filter(|stance| stance.start < stance.end).collect::<Vec<_>>()
    };
    gait.feet.iter().flat_map(of_foot).collect()
}

/// Angles and root at one time, between two samples.
struct Instant {
    angles: Vec<f64>,
    root: Root,
}

/// The trace at `time`, linear between its samples; `None` outside it by more than rounding.
fn at(trace: &Trace, time: f64) -> Option<Instant> {
    let (first, last) = (trace.samples.first()?, trace.samples.last()?);
    if !(first.time - 1e-6..=last.time + 1e-6).contains(&time) {
        return None;
    }
    let after = trace.samples.partition_point(|sample| sample.time <= time).clamp(1, trace.samples.len() - 1);
    let (a, b): (&Sample, &Sample) = (trace.samples.get(after - 1)?, trace.samples.get(after)?);
    let part = ((time - a.time) / (b.time - a.time)).clamp(0.0, 1.0);
    let angles = a.angles.iter().zip(&b.angles).map(|(a, b)| a + (b - a) * part).collect();
    let root = Root {
        position: a.root.position + (b.root.position - a.root.position) * part,
        orientation: a.root.orientation.nlerp(&b.root.orientation, part),
        linear_velocity: a.root.linear_velocity.lerp(&b.root.linear_velocity, part),
        angular_velocity: a.root.angular_velocity.lerp(&b.root.angular_velocity, part),
    };
    Some(Instant { angles, root })
}

fn of_posture(time: f64, posture: &Posture, root: RootMotion) -> Keyframe {
    keyframe(time, &posture.angles, &posture.velocities, root)
}

fn keyframe(time: f64, angles: &[f64], velocities: &[f64], root: RootMotion) -> Keyframe {
    Keyframe { time, angles: angles.to_vec(), velocities: velocities.to_vec(), root }
}

fn root_motion(root: &Root) -> RootMotion {
    let q = root.orientation;
    RootMotion {
        position: root.position.coords.into(),
        orientation: [q.w, q.i, q.j, q.k],
        linear_velocity: root.linear_velocity.into(),
        angular_velocity: root.angular_velocity.into(),
    }
}

/// The frame on the ground below a root, with its heading.
fn ground_frame(root: &RootMotion) -> Isometry3<f64> {
    let [x, y, _] = root.position;
    let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), root.heading());
    Isometry3::from_parts(Translation3::new(x, y, 0.0), UnitQuaternion::from_rotation_matrix(&yaw))
}

fn transformed(by: &Isometry3<f64>, root: &Root) -> RootMotion {
    root_motion(&Root {
        position: by * root.position,
        orientation: by.rotation * root.orientation,
        linear_velocity: by * root.linear_velocity,
        angular_velocity: by * root.angular_velocity,
    })
}
