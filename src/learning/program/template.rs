//! The force template: what force each leg gives when, and how the trunk moves under these forces.
//!
//! In its stance a leg pushes with half a sine wave of vertical force (Alexander 1984: the first harmonics of
//! measured forces), its mean such that all legs carry the weight and balance about the centre of mass.
//! Along the way the force leans back (with `lean` 1 exactly) to a point above where the foot stands on average, as high as the
//! centre of mass: to the hip, about, which spares it torque and keeps the trunk from pitching (Maus et al. 2010). Height, pitch and way of the trunk follow by integrating
//! Newton's and Euler's equations over the periodic stride. From side to side the trunk sways over the feet that
//! carry it, as a linear inverted pendulum does whose forces do not roll it (Kajita et al. 2001). Foot paths in the trunk's
//! frame follow from all that.

use nalgebra::{DMatrix, DVector, Vector2, Vector3};

use super::legs::Legs;

/// Samples of a stride.
pub const SAMPLES: usize = 64;

/// How one leg takes part in a stride.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Touch-down, parts of a stride.
    pub phase: f64,
    /// Share of the stride for which it stands.
    pub duty: f64,
    /// The middle of the foot's stance, way frame, m.
    pub neutral: Vector2<f64>,
    /// Greatest height of the swinging foot above the ground, m.
    pub lift: f64,
    /// Factor of the force by which the joint targets lead the posture.
    pub push: f64,
}

/// A gait in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// Stride time, s.
    pub period: f64,
    /// m/s.
    pub speed: f64,
    /// To the left, m/s.
    pub sideways: f64,
    /// rad/s, counter-clockwise from above.
    pub turn: f64,
    /// How much higher the trunk is carried than in the standing pose, m.
    pub raise: f64,
    /// How much of the computed heave and pitch the posture follows.
    pub heave: f64,
    /// Share of the lean toward the hip that the legs' forces have.
    pub lean: f64,
    /// Share of the way from straight down to the centre of mass by which the forces of fore and hind legs point to each other,
    /// which spares the trunk pitching.
    pub aim: f64,
    /// How much of the sway that keeps the trunk from rolling it has.
    pub sway: f64,
    /// Speed of a foot against the trunk at touch-down, as a share of that in stance.
    pub retraction: f64,
    /// Exponent of the swing's time in the course of its height: above 1 it lifts late.
    pub skew: f64,
    /// Factor of the springs of the legs.
    pub stiffness: f64,
    /// Of the dampers.
    pub damping: f64,
    /// One for each leg, in the order of [`Legs`].
    pub steps: Vec<Step>,
}

/// One sample of a stride.
#[derive(Debug, Clone, PartialEq)]
pub struct StrideSample {
    /// Of the trunk against its mean: along the way and up, m.
    pub shift: Vector2<f64>,
    /// Of the trunk against its mean: to the left, m.
    pub sway: f64,
    /// Of the trunk: nose down, rad.
    pub pitch: f64,
    /// Foot points in the root's upright frame (way frame), m, one a leg.
    pub feet: Vec<Vector3<f64>>,
    /// Forces of the ground on the feet in the same frame, N.
    pub forces: Vec<Vector3<f64>>,
}

/// Shares of the weight, one a leg, that add up to 1 and balance about the centre of mass where the legs
/// stand at `feet` relative to it (m): of all such the nearest to equal ones. A leg that would have to pull
/// carries nothing.
pub fn shares(feet: &[Vector2<f64>]) -> Vec<f64> {
    let count = feet.len();
    let mut carrying = vec![true; count];
    loop {
        let even = 1.0 / carrying.iter().filter(|carries| **carries).count().max(1) as f64;
        let entry = |row: usize, leg: usize| match (carrying[leg], row) {
            (false, _) => 0.0,
            (_, 0) => 1.0,
            (_, 1) => feet[leg].x,
            _ => feet[leg].y,
        };
        let conditions = DMatrix::from_fn(3, count, entry);
        let start = DVector::from_fn(count, |leg, _| if carrying[leg] { even } else { 0.0 });
        let missing = DVector::from_row_slice(&[1.0, 0.0, 0.0]) - &conditions * &start;
        // The least change that meets the conditions, as far as they can be met.
        let inverse = conditions.clone().pseudo_inverse(1e-9).unwrap_or_else(|_| conditions.transpose());
        let found = start + inverse * missing;
        let pulling = (0..count).filter(|&leg| carrying[leg] && found[leg] < -1e-12);
        match pulling.min_by(|&a, &b| found[a].total_cmp(&found[b])) {
            Some(leg) => carrying[leg] = false,
            None => return found.as_slice().to_vec(),
        }
    }
}

/// The stride of `program`, [`SAMPLES`] moments evenly spaced from phase 0. `gravity` in m/s².
pub fn stride(legs: &Legs, program: &Program, gravity: f64) -> Vec<StrideSample> {
    let Program { period, lean, aim, sway, .. } = *program;
    let count = legs.legs.len();
    let center = legs.center.xy();
    let neutral: Vec<Vector2<f64>> = program.steps.iter().map(|step| step.neutral - center).collect();
    let shares = shares(&neutral);
    let height = legs.center.z + program.raise
        - legs.legs.iter().map(|leg| leg.foot.z - leg.radius).sum::<f64>() / count as f64;

    let steps = program.steps.iter().zip(&shares);
    let vertical: Vec<[f64; SAMPLES]> =
        steps.map(|(step, share)| vertical(step, share * legs.mass * gravity)).collect();
    let ground: Vec<Vec<(Vector2<f64>, f64)>> =
        (0..SAMPLES).map(|sample| (0..count).map(|leg| foot(program, leg, sample)).collect()).collect();
    let along = |leg: usize, sample: usize| {
        let back = ground[sample][leg].0.x - program.steps[leg].neutral.x;
        let ahead = program.steps[leg].neutral.x - center.x;
        -(lean * back + aim * ahead) * vertical[leg][sample] / height
    };

    let sum = |of: &dyn Fn(usize) -> f64| (0..count).map(of).sum::<f64>();
    let dt = period / SAMPLES as f64;
    let mut way = [0.0; SAMPLES];
    let mut up = [0.0; SAMPLES];
    let mut nodding = [0.0; SAMPLES];
    for sample in 0..SAMPLES {
        way[sample] = sum(&|leg| along(leg, sample)) / legs.mass;
        up[sample] = sum(&|leg| vertical[leg][sample]) / legs.mass - gravity;
        // Of r × F with r from the centre of mass to the foot.
        let moment = |leg: usize| {
            let ahead = ground[sample][leg].0.x - center.x;
            -height * along(leg, sample) - ahead * vertical[leg][sample]
        };
        nodding[sample] = sum(&moment) / legs.inertia[(1, 1)];
    }
    let [way, up, nodding] = [way, up, nodding].map(|course| twice_integrated(&course, dt));
    // Where the weight is carried, to the left of the centre of mass.
    let mut carried: [f64; SAMPLES] = std::array::from_fn(|sample| {
        sum(&|leg| (ground[sample][leg].0.y - center.y) * vertical[leg][sample]) / (legs.mass * gravity)
    });
    let mean = carried.iter().sum::<f64>() / SAMPLES as f64;
    carried.iter_mut().for_each(|at| *at -= mean);
    let rate = (gravity / height).sqrt();
    let swayed = swaying(&carried, rate * dt);
    let aside = |leg: usize, sample: usize| {
        let share = vertical[leg][sample] / sum(&|leg| vertical[leg][sample]).max(f64::MIN_POSITIVE);
        sway * share * legs.mass * rate * rate * (swayed[sample] - carried[sample])
    };

    (0..SAMPLES)
        .map(|sample| {
            let shift = Vector2::new(way[sample], program.heave * up[sample]);
            let pitch = program.heave * nodding[sample];
            let (sine, cosine) = pitch.sin_cos();
            // From level axes to those of the root, which is pitched nose down.
            let to_root = |at: Vector3<f64>| {
                Vector3::new(cosine * at.x - sine * at.z, at.y, sine * at.x + cosine * at.z)
            };
            let trunk = Vector3::new(center.x + shift.x, center.y + sway * swayed[sample], height + shift.y);
            let feet = (0..count).map(|leg| {
                let (at, clearance) = ground[sample][leg];
                let foot = Vector3::new(at.x, at.y, clearance + legs.legs[leg].radius);
                legs.center + to_root(foot - trunk)
            });
            let force =
                |leg: usize| Vector3::new(along(leg, sample), aside(leg, sample), vertical[leg][sample]);
            let forces = (0..count).map(|leg| to_root(force(leg)));
            let sway = sway * swayed[sample];
            StrideSample { shift, sway, pitch, feet: feet.collect(), forces: forces.collect() }
        })
        .collect()
}

/// The vertical force of a leg, N: half a sine while it stands, with exactly `mean` as mean over the samples.
fn vertical(step: &Step, mean: f64) -> [f64; SAMPLES] {
    let standing = |sample: usize| {
        let since = since_touch_down(sample, step);
        if since < step.duty { (std::f64::consts::PI * since / step.duty).sin() } else { 0.0 }
    };
    let course: [f64; SAMPLES] = std::array::from_fn(standing);
    let found = course.iter().sum::<f64>() / SAMPLES as f64;
    let scale = if found > 0.0 { mean / found } else { 0.0 };
    course.map(|force| force * scale)
}

/// Parts of a stride since a leg's last touch-down, at a sample.
fn since_touch_down(sample: usize, step: &Step) -> f64 {
    (sample as f64 / SAMPLES as f64 - step.phase).rem_euclid(1.0)
}

/// Where the foot of a leg is at a sample, in a level frame that goes along with the trunk's mean (m), and its
/// height above the ground on which it stands, m.
fn foot(program: &Program, leg: usize, sample: usize) -> (Vector2<f64>, f64) {
    let step = &program.steps[leg];
    let since = since_touch_down(sample, step);
    // Against the trunk the ground moves back, and about it.
    let velocity = Vector2::new(
        program.speed - program.turn * step.neutral.y,
        program.sideways + program.turn * step.neutral.x,
    );
    let way = velocity * program.period;
    if since < step.duty {
        return (step.neutral + way * (0.5 * step.duty - since), 0.0);
    }
    let swing = 1.0 - step.duty;
    let s = (since - step.duty) / swing;
    let end = 3.0 * s * s - 2.0 * s * s * s;
    let (leaving, landing) = (s * (1.0 - s) * (1.0 - s), -s * s * (1.0 - s));
    let at = step.neutral + way * (step.duty * (end - 0.5))
        - way * (swing * (leaving + program.retraction * landing));
    let late = s.powf(program.skew);
    (at, step.lift * 16.0 * (late * (1.0 - late)).powi(2))
}

/// The periodic solution y of ÿ = ω² (y − c) for the course c, sampled every `turn` / ω seconds: how an
/// inverted pendulum moves that is carried at c. It is c folded with the decaying answer to a single push either way.
fn swaying(course: &[f64; SAMPLES], turn: f64) -> [f64; SAMPLES] {
    let half = 0.5 * SAMPLES as f64;
    // cosh(ω (T/2 − t)) over the samples, scaled so that the answers add up to 1 and no exponent overflows.
    let answer: [f64; SAMPLES] = std::array::from_fn(|sample| {
        let away = (half - sample as f64).abs();
        (turn * (away - half)).exp() + (-turn * (away + half)).exp()
    });
    let total = answer.iter().sum::<f64>();
    std::array::from_fn(|sample| {
        let at = |before: usize| course[(sample + SAMPLES - before) % SAMPLES];
        answer.iter().enumerate().map(|(before, answer)| answer * at(before)).sum::<f64>() / total
    })
}

/// The periodic course with zero mean whose second derivative is `course` less its mean: of a function sampled every
/// `dt` seconds, by the trapezoidal rule.
fn twice_integrated(course: &[f64; SAMPLES], dt: f64) -> [f64; SAMPLES] {
    integrated(&integrated(course, dt), dt)
}

fn integrated(rate: &[f64; SAMPLES], dt: f64) -> [f64; SAMPLES] {
    let mean = rate.iter().sum::<f64>() / SAMPLES as f64;
    let mut sums = [0.0; SAMPLES];
    for sample in 1..SAMPLES {
        sums[sample] = sums[sample - 1] + 0.5 * dt * (rate[sample - 1] + rate[sample] - 2.0 * mean);
    }
    let mean = sums.iter().sum::<f64>() / SAMPLES as f64;
    sums.map(|sum| sum - mean)
}
