//! A stride as a ring of keyframes: foot paths through inverse kinematics into joint targets that lead
//! the posture, and the Hermite splines that fit those best.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use nalgebra::{DMatrix, Vector2, Vector3};

use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Player, Steering, TargetLimits, shape};
use gaitwright_physics::scene::Gains;

use super::closing::Following;
use super::entry::{Entered, LEAST_STRIDES, STEPPING_STRIDES, entry, strides};
use super::gaits::NamedGait;
use super::legs::{LegChain, Legs};
use super::template::{Program, SAMPLES, Step, StrideSample, stride};
use crate::learn::{Behaviour, Posture, Weights};

/// Keyframes of a stride.
pub const KEYFRAMES: usize = 8;
/// Number of a program's parameters. What each of them is: indices, and its unit. Those that make fore legs differ from hind legs are
/// added to the former and taken from the latter; they do nothing where the legs are a single row.
pub const PARAMETERS: usize = 26;
/// Stride time: a fifth more or less.
pub const PERIOD: usize = 0;
/// Duty factor: 0.04.
pub const DUTY: usize = 1;
/// The same of fore legs.
pub const FORE_DUTY: usize = 2;
/// Speed of the program: a tenth more or less.
pub const SPEED: usize = 3;
/// How far ahead of the hips the feet stand: 0.06 hip heights.
pub const FOOTHOLD: usize = 4;
/// The same of fore legs.
pub const FORE_FOOTHOLD: usize = 5;
/// How far apart left and right feet stand: 0.06 hip heights.
pub const WIDTH: usize = 6;
/// The same of fore legs.
pub const FORE_WIDTH: usize = 7;
/// How far to the left all feet stand, 0.06 hip heights; only feedback changes it.
pub const ASIDE: usize = PARAMETERS;
/// Lift of the feet: three tenths more or less.
pub const LIFT: usize = 8;
/// The same of fore legs.
pub const FORE_LIFT: usize = 9;
/// How much of the computed force the legs give: a fifth of it.
pub const PUSH: usize = 10;
/// The same of fore legs.
pub const FORE_PUSH: usize = 11;
/// Extension of the legs: 0.04 of their length.
pub const EXTENSION: usize = 12;
/// Way to the side: 0.03 of the way ahead.
pub const SIDEWAYS: usize = 13;
/// Turn: 0.03 rad in a hip height of the way ahead.
pub const TURN: usize = 14;
/// How much of the computed heave and pitch the trunk has: 0.4 of them.
pub const HEAVE: usize = 15;
/// How much the forces of the feet lean toward the hips: 0.4 of the way there.
pub const LEAN: usize = 16;
/// How much of the computed sway the trunk has: 0.4 of it.
pub const SWAY: usize = 24;
/// How much later fore legs touch down than hind legs: 0.04 of the stride.
pub const APART: usize = 17;
/// How much later left legs touch down than right ones: of all, and of fore legs more than of hind legs; 0.04 of the stride.
pub const ASIDE_LAGS: [usize; 2] = [18, 19];
/// How much of its speed on the ground a foot has before it touches down: 0.4 of it.
pub const RETRACTION: usize = 20;
/// How late the feet are lifted.
pub const SKEW: usize = 21;
/// Stiffness of the legs: a fifth more or less.
pub const STIFFNESS: usize = 22;
/// Damping of the legs: three tenths more or less.
pub const DAMPING: usize = 23;
/// Aim of the forces: a fifth of the way to the centre of mass.
pub const AIM: usize = 25;
/// Extension of the legs in mid-stance as a share of their length: at least, as a seed, and at most.
const EXTENSIONS: [f64; 3] = [0.82, 0.86, 0.95];

/// Shift of a leg's phase a unit, parts of a stride, and the greatest: more would make another gait of it. Where fore or hind legs
/// push together the pairs may be shifted farther: their feet touch down later than they are sent where the trunk pitches away from
/// them.
const PHASE_SHIFT: f64 = 0.04;
const PAIR_SHIFT: f64 = 0.1;
/// The most by which a stride is slowed down for the sake of the motors' greatest speeds; slower ones take shorter ways.
const SLOWEST: f64 = 4.0;
/// Unit of the parameters that say where feet stand, in hip heights.
pub(super) const FOOTHOLD_UNIT: f64 = 0.06;
/// Least and greatest stride time over that of animals.
const PERIODS: [f64; 2] = [0.5, 2.0];
/// The least of gallops. Leaps end at the least, since the trunk pitches less in shorter strides; gallops at half of animals' kept all
/// trials in two of five runs, and did not hold in another engine. Canters with this least cost `anymal_b` less (0.44 instead of 0.53, the
/// medians of four), and `a1` and the bundled quadruped seem to pay more (0.58 and 0.59, of one each).
const LEAST_OF_GALLOPS: f64 = 0.57;
/// Least and greatest height of a swinging foot, in hip heights.
const LIFTS: [f64; 2] = [0.06, 0.35];

/// [`Wanted::strictness`] early in the search, and late: the late one from the start gave costlier gaits.
const LENIENT: f64 = 20.0;
const STRICT: f64 = 60.0;

/// What is asked of a gait.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Which.
    pub gait: NamedGait,
    /// m/s.
    pub speed: f64,
    /// m/s².
    pub gravity: f64,
    /// How much each cost counts.
    pub weights: Weights,
    /// Cost of being far beyond a limit of natural motion.
    pub strictness: f64,
    /// Whether its way is set straight in the end (see [`straightening`](super::straightening)): turn and drift cost nothing until then as
    /// far as that mends them.
    pub straightened_later: bool,
}

impl Wanted {
    /// `gait` at Froude number v² / (g h), with the standing hip height h.
    pub fn at_froude(legs: &Legs, gait: NamedGait, froude: f64, gravity: f64) -> Self {
        let speed = (froude * gravity * legs.hip_height).sqrt();
        Self {
            gait,
            speed,
            gravity,
            weights: Weights::default(),
            strictness: LENIENT,
            straightened_later: false,
        }
    }

    /// The same, for a search after which the way is set straight.
    pub fn straightened_later(self) -> Self {
        Self { straightened_later: true, ..self }
    }

    /// The same, for a motion whose way stays as it is.
    pub fn as_it_goes(&self) -> Self {
        Self { straightened_later: false, ..self.clone() }
    }

    /// The same, with limits that are to be kept.
    pub fn strictly(self) -> Self {
        Self { strictness: STRICT, ..self }
    }

    /// v² / (g h) of the wanted speed.
    pub fn froude(&self, legs: &Legs) -> f64 {
        self.speed.powi(2) / (self.gravity * legs.hip_height)
    }

    /// The stride time that animals with hips at this height (m) take at this speed, s: 2.3 Fr^0.3 h / v (after Alexander & Jayes
    /// 1983).
    pub fn usual_period(&self, hip_height: f64) -> f64 {
        let froude = self.speed.powi(2) / (self.gravity * hip_height);
        2.3 * froude.powf(0.3) * hip_height / self.speed
    }
}

/// The gait that the parameters ask for. All 0 is the seed: each is in units of a change that matters.
pub fn program(legs: &Legs, wanted: &Wanted, parameters: &[f64]) -> Program {
    let p = |index: usize| parameters.get(index).copied().unwrap_or(0.0);
    let (size, speed) = (legs.hip_height, wanted.speed);
    let rows = legs.rows();
    // A gait that is its own mirror image stays so.
    let mirrored = wanted.gait.mirrored_after().is_some();
    let steps = legs.legs.iter().enumerate().map(|(index, leg)| {
        // From fore (+1) to hind (−1); all in the middle where there is one row only.
        let fore = if rows > 1 { 1.0 - 2.0 * leg.row as f64 / (rows - 1) as f64 } else { 0.0 };
        let side = if leg.left { 1.0 } else { -1.0 };
        let shift = |index: usize| PHASE_SHIFT * p(index).clamp(-1.0, 1.0);
        let aside =
            if mirrored { 0.0 } else { shift(ASIDE_LAGS[0]) * side + shift(ASIDE_LAGS[1]) * side * fore };
        let farthest = if wanted.gait.symmetrical() { PHASE_SHIFT } else { PAIR_SHIFT };
        let apart = (PHASE_SHIFT * p(APART)).clamp(-farthest, farthest);
        let phase = wanted.gait.phases[index] + apart * fore + aside;
        // A single row of legs has to stand below the centre of mass.
        let below = match rows {
            1 => legs.center.x,
            _ if leg.sprawled => leg.foot.x,
            _ => leg.hip.x,
        };
        let neutral = Vector2::new(
            below + FOOTHOLD_UNIT * size * (p(FOOTHOLD) + p(FORE_FOOTHOLD) * fore),
            leg.foot.y + FOOTHOLD_UNIT * size * (p(ASIDE) + side * (p(WIDTH) + p(FORE_WIDTH) * fore)),
        );
        Step {
            phase,
            duty: (wanted.gait.duty_factor + 0.04 * (p(DUTY) + p(FORE_DUTY) * fore)).clamp(0.15, 0.92),
            neutral,
            lift: size * (0.15 * (0.3 * (p(LIFT) + p(FORE_LIFT) * fore)).exp()).clamp(LIFTS[0], LIFTS[1]),
            push: 1.0 + 0.2 * (p(PUSH) + p(FORE_PUSH) * fore),
        }
    });
    let stood = legs.legs.iter().map(|leg| (leg.hip.z - leg.foot.z) / leg.length).sum::<f64>()
        / legs.legs.len() as f64;
    // Sprawled legs carry the trunk as high as they stand.
    let usual = if legs.legs.iter().any(|leg| leg.sprawled) { stood } else { EXTENSIONS[1] };
    let least = if wanted.gait.gallops() { LEAST_OF_GALLOPS } else { PERIODS[0] };
    let extension = (usual + 0.04 * p(EXTENSION)).clamp(EXTENSIONS[0].min(usual), EXTENSIONS[2].max(usual));
    Program {
        period: wanted.usual_period(size) * (0.2 * p(PERIOD)).exp().clamp(least, PERIODS[1]),
        speed: speed * (0.1 * p(SPEED)).exp(),
        sideways: 0.03 * speed * p(SIDEWAYS),
        turn: 0.03 * speed / size * p(TURN),
        raise: (extension - stood) * legs.length,
        heave: 1.0 + 0.4 * p(HEAVE),
        lean: 1.0 + 0.4 * p(LEAN),
        aim: 0.2 * p(AIM),
        sway: 1.0 + 0.4 * p(SWAY),
        retraction: 1.0 + 0.4 * p(RETRACTION),
        skew: (0.2 * p(SKEW)).exp(),
        stiffness: (0.2 * p(STIFFNESS)).exp(),
        damping: (0.3 * p(DAMPING)).exp(),
        steps: steps.collect(),
    }
}

/// A ring of keyframes and what leads from the standing pose into it.
#[derive(Debug, Clone, PartialEq)]
pub struct Ring {
    /// Stride time, s: the program's, or longer where the motors are too slow for that.
    pub period: f64,
    /// Visited once, from the standing pose.
    pub entry: Vec<Posture>,
    /// Visited over and over, evenly spaced.
    pub cycle: Vec<Posture>,
    /// Greatest distance by which a foot misses its path, m.
    pub missed: f64,
    /// How it is changed by what the trunk does.
    pub steering: Option<Steering>,
}

impl Ring {
    /// Time between two keyframes, s.
    pub fn transition_time(&self) -> f64 {
        self.period / self.cycle.len() as f64
    }

    /// The ring as the learner's behaviours are, with a fitness and the number of generations before it.
    pub fn behaviour(&self, fitness: f64, generation: u32) -> Behaviour {
        let transition_time = self.transition_time();
        let (entry, cycle, steering) = (self.entry.clone(), self.cycle.clone(), self.steering.clone());
        Behaviour { fitness, generation, transition_time, entry, cycle, steering }
    }

    /// Its targets over time, from the pose `standing` on.
    pub fn player(&self, standing: &[f64]) -> Player {
        let [entry, cycle] = [&self.entry, &self.cycle].map(|postures| postures.iter().map(Posture::parts));
        Player::from_postures(standing, entry, cycle, self.transition_time()).steered(self.steering.clone())
    }

    /// When the entry is over, s from the start of play: the time of the cycle's first keyframe.
    pub fn lead(&self) -> f64 {
        self.transition_time() * (self.entry.len() + 1) as f64
    }
}

/// The ring of `program` for joints driven with `gains`. Its targets stay within the joints' ranges and speeds. Where it `steps_at_once`
/// it is entered by stepping on the spot.
pub fn ring(
    model: &Model,
    legs: &Legs,
    program: &Program,
    gains: &Gains,
    (wanted, steps_at_once): (&Wanted, bool),
) -> Ring {
    let (cycle, missed) = cycle(model, legs, program, gains, wanted.gravity);
    let still = || Program { speed: 0.0, sideways: 0.0, turn: 0.0, ..program.clone() };
    let on_the_spot = steps_at_once.then(|| self::cycle(model, legs, &still(), gains, wanted.gravity).0);
    let moved = Wanted { speed: program.speed, ..wanted.clone() };
    let ring = within_joint_limits(model, &legs.standing, (cycle, on_the_spot), program.period, &moved);
    Ring { missed, ..ring }
}

/// The postures of one stride of `program`, and the greatest distance by which a foot misses its path, m.
fn cycle(model: &Model, legs: &Legs, program: &Program, gains: &Gains, gravity: f64) -> (Vec<Posture>, f64) {
    let moments = stride(legs, program, gravity);
    let dt = program.period / SAMPLES as f64;
    let (paths, mut missed) = foot_paths(legs, &moments);
    let mut cycle = vec![Posture::resting(&legs.standing); KEYFRAMES];
    for (index, leg) in legs.legs.iter().enumerate() {
        let (loads, left) = loads(model, legs, index, &moments, &paths[index]);
        missed = missed.max(left);
        for (place, joint) in leg.moved().enumerate() {
            let (stiffness, damping) = (gains.stiffness[joint], gains.damping[joint]);
            let mut course = [0.0; SAMPLES];
            if stiffness > 0.0 {
                for sample in 0..SAMPLES {
                    course[sample] = program.steps[index].push * loads[sample].torques[place] / stiffness;
                }
                course = followed(&course, damping / stiffness / dt);
            }
            for sample in 0..SAMPLES {
                course[sample] += loads[sample].angles[place];
            }
            let knots = fitted(&course, program.period);
            for (posture, [angle, velocity]) in cycle.iter_mut().zip(knots) {
                posture.angles[joint] = angle;
                posture.velocities[joint] = velocity;
            }
        }
    }
    (cycle, missed)
}

/// The angles of each leg's joints, from the trunk outward, with which its foot keeps to its path, at each moment of a stride; and the greatest
/// distance by which one misses it, m.
fn foot_paths(legs: &Legs, moments: &[StrideSample]) -> (Vec<Vec<Vec<f64>>>, f64) {
    let mut missed: f64 = 0.0;
    let path = |(index, leg): (usize, &LegChain)| {
        let mut postures = vec![leg.standing.clone(); SAMPLES];
        // A ball rolls: its centre goes on by its radius times the angle by which the leg turns over it.
        let mut rolled = [0.0; SAMPLES];
        for pass in 0..2 {
            let mut angles = postures[SAMPLES - 1].clone();
            for sample in 0..SAMPLES {
                let moment = &moments[sample];
                let target = moment.feet[index] + Vector3::x() * rolled[sample];
                let tilt = Vector3::new(-moment.pitch.sin(), 0.0, moment.pitch.cos());
                let left = leg.reach(&mut angles, target, tilt);
                if pass == 1 {
                    missed = missed.max(left);
                }
                if !leg.keeps_level() {
                    let up = leg.place(&angles).up;
                    rolled[sample] = leg.radius * (up.x.atan2(up.z) + moment.pitch);
                }
                postures[sample].copy_from_slice(&angles);
            }
        }
        postures
    };
    let paths = legs.legs.iter().enumerate().map(path).collect();
    (paths, missed)
}

/// The joints of a leg and those that follow them, at one moment of a stride.
struct LegLoad {
    /// Where they are while the foot keeps to its path, rad or m.
    angles: Vec<f64>,
    /// What they give against the ground's force on the foot, N m or N.
    torques: Vec<f64>,
}

/// The loads of the leg of this index at each moment of a stride with its joints on `path`; and the most by which its closed loops are
/// open, m or rad.
fn loads(
    model: &Model,
    legs: &Legs,
    index: usize,
    moments: &[StrideSample],
    path: &[Vec<f64>],
) -> (Vec<LegLoad>, f64) {
    let leg = &legs.legs[index];
    let mut open: f64 = 0.0;
    let mut followers: Vec<f64> = leg.followers.iter().map(|&joint| legs.standing[joint]).collect();
    let load = |(moment, own): (&StrideSample, &Vec<f64>)| {
        let placed = leg.place(own);
        let contact = placed.foot - Vector3::z() * leg.radius;
        let torque = |place| -placed.column(place, contact).dot(&moment.forces[index]);
        let torques: Vec<f64> = (0..own.len()).map(torque).collect();
        if leg.followers.is_empty() {
            return LegLoad { angles: own.clone(), torques };
        }
        let mut whole = legs.standing.clone();
        leg.moved().zip(own.iter().chain(&followers)).for_each(|(joint, &angle)| whole[joint] = angle);
        let following = Following::new(model, &whole, &leg.joints, &leg.followers);
        let carried = following.and_then(|found| Some((found.carried(&torques)?, found)));
        let torques = match carried {
            Some((carried, found)) => {
                open = open.max(found.open);
                followers = found.angles;
                carried
            }
            // In a singular posture no torques of the motors carry the force. Such a ring is as good as one that misses its path by a leg.
            None => {
                open = open.max(leg.length);
                vec![0.0; own.len() + followers.len()]
            }
        };
        LegLoad { angles: [&own[..], &followers[..]].concat(), torques }
    };
    let loads = moments.iter().zip(path).map(load).collect();
    (loads, open)
}

/// The ring of a `cycle` of `period` seconds, entered from the pose `standing`, with targets that stay within the joints' ranges
/// and speeds: ways are shortened, or all is slowed down. With a second cycle, `on_the_spot`, the entry steps there at first.
pub fn within_joint_limits(
    model: &Model,
    standing: &[f64],
    (mut cycle, mut on_the_spot): (Vec<Posture>, Option<Vec<Posture>>),
    period: f64,
    wanted: &Wanted,
) -> Ring {
    let duration = period / KEYFRAMES as f64;
    let limits = TargetLimits::of(&model.character);
    for (joint, limits) in limits.iter().enumerate() {
        if let Some(speed) = limits.speed {
            let cycles = std::iter::once(&mut cycle).chain(&mut on_the_spot);
            cycles.for_each(|cycle| shorten(cycle, joint, standing[joint], speed, duration));
        }
    }
    let strides = strides(wanted.speed, wanted.gravity, period);
    let on_the_spot = on_the_spot.iter().map(|cycle| Entered { cycle, strides: STEPPING_STRIDES });
    let entered: Vec<Entered<'_>> = on_the_spot.chain([Entered { cycle: &cycle, strides }]).collect();
    let mut entry = entry(standing, &entered, duration);
    let first = entry.len();
    let mut postures: Vec<_> = entry.iter_mut().chain(&mut cycle).map(Posture::parts_mut).collect();
    let slowed = shape(standing, &mut postures, first, duration, &limits);
    // The period as it was where nothing had to be slowed down: as a product it may differ in the last digit.
    let period = if slowed > duration { slowed * KEYFRAMES as f64 } else { period };
    Ring { period, entry, cycle, missed: 0.0, steering: None }
}

/// The periodic solution e of e + τ ė = `course`, with the time constant τ in samples: the lead of a spring and damper
/// whose torque is to be that of the spring alone at `course`.
fn followed(course: &[f64; SAMPLES], constant: f64) -> [f64; SAMPLES] {
    let decay = (-1.0 / constant.max(1e-6)).exp();
    let mut lead = [0.0; SAMPLES];
    let mut now = 0.0;
    for asked in course {
        now = decay * now + (1.0 - decay) * asked;
    }
    // What one turn leaves of its start is known, so the periodic start is, too.
    now /= 1.0 - decay.powi(SAMPLES as i32);
    for (lead, asked) in lead.iter_mut().zip(course) {
        now = decay * now + (1.0 - decay) * asked;
        *lead = now;
    }
    lead
}

/// Angles and rates of the [`KEYFRAMES`] knots whose splines fit `course` best, in the sense of least squares.
fn fitted(course: &[f64; SAMPLES], period: f64) -> [[f64; 2]; KEYFRAMES] {
    static FIT: OnceLock<DMatrix<f64>> = OnceLock::new();
    let fit = FIT.get_or_init(|| {
        let mut shapes = DMatrix::zeros(SAMPLES, 2 * KEYFRAMES);
        for sample in 0..SAMPLES {
            let place = sample as f64 * KEYFRAMES as f64 / SAMPLES as f64;
            let (from, s) = (place as usize, place.fract());
            let to = (from + 1) % KEYFRAMES;
            shapes[(sample, 2 * from)] += 1.0 - 3.0 * s * s + 2.0 * s * s * s;
            shapes[(sample, 2 * from + 1)] += s * (1.0 - s) * (1.0 - s);
            shapes[(sample, 2 * to)] += 3.0 * s * s - 2.0 * s * s * s;
            shapes[(sample, 2 * to + 1)] -= s * s * (1.0 - s);
        }
        shapes.pseudo_inverse(1e-12).unwrap_or_else(|_| DMatrix::zeros(2 * KEYFRAMES, SAMPLES))
    });
    let duration = period / KEYFRAMES as f64;
    std::array::from_fn(|knot| {
        let value = |row: usize| (0..SAMPLES).map(|sample| fit[(row, sample)] * course[sample]).sum::<f64>();
        [value(2 * knot), value(2 * knot + 1) / duration]
    })
}

/// Makes a joint's way smaller where its motor would need more than [`SLOWEST`] times the `duration` between two keyframes
/// for it, so that no stride takes arbitrarily long.
fn shorten(cycle: &mut [Posture], joint: usize, standing: f64, speed: f64, duration: f64) {
    let angle = |knot: usize| cycle[knot % cycle.len()].angles[joint];
    // On the entry its distance from the standing pose grows at this rate as well.
    let growing = 0.25 * TAU / (LEAST_STRIDES * cycle.len() as f64);
    let way = |knot| (angle(knot + 1) - angle(knot)).abs() + growing * (angle(knot) - standing).abs();
    let farthest = (0..cycle.len()).map(way).fold(0.0, f64::max);
    let share = SLOWEST * duration * speed / (1.5 * farthest);
    if share < 1.0 {
        for posture in cycle {
            posture.angles[joint] = standing + share * (posture.angles[joint] - standing);
            posture.velocities[joint] *= share;
        }
    }
}
