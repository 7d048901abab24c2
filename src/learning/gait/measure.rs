//! The gait report of a simulated loop.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};

use super::foot::{FootShape, clearance};
use super::footfall::{Detection, Footing};
use super::legs::{self, Leg, PlacedFoot, Side};
use super::name::{Classified, UNCLASSIFIED, classify, templates};
use super::report::{Foot, GaitFormat, GaitReport, Pair, Regime};
use super::stride::{Phase, Strides, apart, mean};
use super::unnamed::unnamed;
use gaitwright_physics::character::Character;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::ahead;
use gaitwright_physics::playback::Trace;
use gaitwright_physics::sim::contact::Against;
use gaitwright_physics::stance;

/// What a gait is measured with, beside its trace.
#[derive(Debug, Clone, Copy)]
pub struct GaitContext<'a> {
    /// The character that moved, compiled.
    pub model: &'a Model,
    /// Indices of the links that carry it.
    pub support: &'a [usize],
    /// World frames of all links in the standing pose, m.
    pub standing: &'a [Isometry3<f64>],
    /// Height of the ground, m.
    pub ground: f64,
    /// Total mass, kg.
    pub mass: f64,
    /// Magnitude of the gravitational acceleration, m/s².
    pub gravity: f64,
    /// The task's direction of travel in the world frame, of any length; z is ignored.
    pub direction: [f64; 3],
}

impl GaitContext<'_> {
    /// Whether it stands on feet: a root that carries the character (a snake's) leaves no legs to judge.
    pub(super) fn has_feet(&self) -> bool {
        let carried_by_root = |link: usize| self.model.links.get(link).is_none_or(|place| place.body == 0);
        !self.support.is_empty() && !self.support.iter().any(|&link| carried_by_root(link))
    }

    /// Mean height of the hips over the ground in the standing pose, m: of where the long segments of the legs begin; `None` where
    /// nothing but the root carries.
    pub(super) fn hip_height(&self) -> Option<f64> {
        legs::hip_height(self.model, self.support, self.standing, self.ground)
    }

    /// Standing height of the hips over the ground, or what [stands in for it](Model::height_scale) where there are none, m.
    pub(super) fn size(&self) -> f64 {
        let root = || self.standing.first().map_or(0.0, |root| root.translation.z - self.ground);
        let hips = self.hip_height().filter(|height| *height > 0.0);
        hips.unwrap_or_else(|| self.model.height_scale(root()))
    }

    /// How stances are told from swings.
    pub(crate) fn detection(&self) -> Detection {
        let height = self.size();
        let unit_time = if self.gravity > 0.0 { (height / self.gravity).sqrt() } else { 0.0 };
        Detection::of(self.mass * self.gravity, unit_time)
    }
}

/// Measures the gait in `trace`, which should consist of at least ten cycles of a looping motion. A trace without steps
/// gives a report without phases.
pub fn measure(trace: &Trace, setting: &GaitContext<'_>) -> GaitReport {
    let character = &*setting.model.character;
    let detection = setting.detection();
    let standing_on = stance::feet(setting.model, setting.support);
    let legs = legs::place(character, standing_on, setting.standing, setting.direction);
    let footings: Vec<Footing> =
        legs.iter().map(|(links, _)| Footing::detect(trace, links, detection)).collect();
    let times: Vec<f64> = trace.samples.iter().map(|sample| sample.time).collect();
    let strides = Strides::of(&footings, &times);
    let duty = mean(&strides.duties);
    let clearances: Vec<Option<f64>> = footings
        .iter()
        .map(|footing| {
            let shape = |&link: &usize| Some(FootShape::of(character.links.get(link)?));
            let shapes: Option<Vec<FootShape>> = footing.links.iter().map(shape).collect();
            clearance(trace, footing, &shapes?, setting.ground)
        })
        .collect();

    let feet = feet(character, &legs, (&footings, &strides), &clearances, &times);
    let named = named(&legs, &strides, duty);
    let hip_height = setting.hip_height();
    let has_names = setting.has_feet() && !templates(legs.len()).is_empty();
    let unnamed_because = has_names
        .then(|| unnamed(&strides, &clearances, (hip_height, setting.gravity), named.as_ref()))
        .flatten();
    let name = match (named, unnamed_because) {
        (Some(named), None) => named.name,
        _ => UNCLASSIFIED,
    };
    let gait = has_names.then_some(name);
    let stepping = feet.iter().filter(|foot| foot.phase.is_some());

    let (aerial_fraction, scuffing) = off_the_feet(trace, &footings, detection.threshold);
    let travel = Travel::of(trace, setting.direction);
    let froude = hip_height
        .filter(|&height| height * setting.gravity > 0.0)
        .map(|height| travel.horizontal_speed.powi(2) / (setting.gravity * height));
    let cost = |work: f64| {
        let least = 0.1 * setting.size();
        let resistance = setting.mass * setting.gravity * travel.distance;
        (travel.distance > least && resistance > 0.0).then(|| work / resistance)
    };
    GaitReport {
        format: GaitFormat::V1,
        gait: gait.map(str::to_owned),
        variant: named
            .filter(|_| unnamed_because.is_none())
            .and_then(|named| named.variant)
            .map(str::to_owned),
        distance: named.map(|named| named.distance),
        greatest_distance: named.map(|named| named.greatest_distance),
        unnamed_because,
        regime: duty
            .filter(|_| strides.period.is_some())
            .map(|duty| if duty >= 0.5 { Regime::Walk } else { Regime::Run }),
        stride_period: strides.period,
        strides: stepping.map(|foot| foot.strides).min().unwrap_or(0),
        pairs: pairs(character, &legs, &strides.phases),
        aerial_fraction,
        scuffing,
        spread: strides.spread,
        speed: travel.speed,
        sideways_speed: travel.sideways_speed,
        froude,
        cost_of_transport: cost(trace.joint_work),
        positive_cost_of_transport: cost(trace.positive_work),
        stance_slip: stance_slip(trace),
        natural: false,
        naturalness: BTreeMap::new(),
        hip_height,
        fell_at: trace.fell_at,
        span: [times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0)],
        feet,
    }
}

/// What is seen of each foot.
fn feet(
    character: &Character,
    legs: &[PlacedFoot],
    (footings, strides): (&[Footing], &Strides),
    clearances: &[Option<f64>],
    times: &[f64],
) -> Vec<Foot> {
    let foot = |(index, ((links, leg), footing)): (usize, (&PlacedFoot, &Footing))| Foot {
        link: link_name(character, links[0]),
        leg: leg.map(|leg| leg.to_string()),
        duty_factor: strides.duties[index],
        phase: strides.phases[index].map(|phase| phase.mean),
        strides: footing.touch_downs.len().saturating_sub(1) as u32,
        clearance: clearances[index],
        stances: footing
            .stances()
            .into_iter()
            // A stance ends at the first sample without it, or with the trace.
            .map(|[from, to]| [times[from], times[to.min(times.len() - 1)]])
            .collect(),
    };
    legs.iter().zip(footings).enumerate().map(foot).collect()
}

/// The gait that the phases of `legs` are nearest to; `None` where a leg has no place or no phase.
fn named(legs: &[PlacedFoot], strides: &Strides, duty: Option<f64>) -> Option<Classified> {
    let placed: Option<Vec<(Leg, f64)>> = legs
        .iter()
        .zip(&strides.phases)
        .map(|((_, leg), phase)| Some(((*leg)?, phase.as_ref()?.mean)))
        .collect();
    classify(&placed?, duty.unwrap_or(1.0))
}

/// Shares of the samples in which nothing, and in which something else than a foot is on the ground, with more than
/// `threshold` newtons.
fn off_the_feet(trace: &Trace, footings: &[Footing], threshold: f64) -> (f64, f64) {
    let (mut aerial, mut scuffing) = (0, 0);
    for (at, sample) in trace.samples.iter().enumerate() {
        let other = sample.loads.iter().enumerate().any(|(link, &load)| {
            load > threshold && footings.iter().all(|footing| !footing.links.contains(&link))
        });
        scuffing += usize::from(other);
        aerial += usize::from(!other && footings.iter().all(|footing| !footing.stance[at]));
    }
    let share = |count: usize| count as f64 / trace.samples.len().max(1) as f64;
    (share(aerial), share(scuffing))
}

/// The left and right legs of each row that both step.
fn pairs(character: &Character, legs: &[PlacedFoot], phases: &[Option<Phase>]) -> Vec<Pair> {
    let find = |side: Side, row: usize| {
        let index =
            legs.iter().position(|(_, leg)| leg.is_some_and(|leg| leg.side == side && leg.row == row))?;
        Some((link_name(character, legs[index].0[0]), phases[index]?.mean))
    };
    (0..legs.len() / 2)
        .filter_map(|row| {
            let ((left, of_left), (right, of_right)) = (find(Side::Left, row)?, find(Side::Right, row)?);
            Some(Pair { left, right, asymmetry: apart(of_left - of_right - 0.5) })
        })
        .collect()
}

/// Mean tangential speed of the contacts with the ground and with obstacles, weighted by their normal force, m/s.
pub(super) fn stance_slip(trace: &Trace) -> f64 {
    let (mut slip, mut load) = (0.0, 0.0);
    let contacts = trace.samples.iter().flat_map(|sample| &sample.contacts);
    for contact in contacts.filter(|contact| !matches!(contact.against, Against::Link { .. })) {
        let force = contact.force.dot(&contact.normal).max(0.0);
        let along = contact.velocity - contact.normal * contact.velocity.dot(&contact.normal);
        slip += force * along.norm();
        load += force;
    }
    if load > 0.0 { slip / load } else { 0.0 }
}

/// Travel of the centre of mass over a trace.
struct Travel {
    /// Horizontal distance from the first sample to the last, m.
    distance: f64,
    /// Mean horizontal speed, m/s.
    horizontal_speed: f64,
    /// Mean speed along the task's direction, m/s.
    speed: f64,
    /// Mean speed to the left of it, m/s.
    sideways_speed: f64,
}

impl Travel {
    fn of(trace: &Trace, direction: [f64; 3]) -> Self {
        let (mut way, mut duration) = (Vector3::zeros(), 0.0);
        if let (Some(first), Some(last)) = (trace.samples.first(), trace.samples.last()) {
            way = last.center_of_mass - first.center_of_mass;
            duration = last.time - first.time;
        }
        way.z = 0.0;
        let rate = if duration > 0.0 { way / duration } else { Vector3::zeros() };
        let forward = ahead(direction);
        let left = Vector3::z().cross(&forward);
        Self {
            distance: way.norm(),
            horizontal_speed: rate.norm(),
            speed: rate.dot(&forward),
            sideways_speed: rate.dot(&left),
        }
    }
}

fn link_name(character: &Character, link: usize) -> String {
    character.links.get(link).map_or_else(String::new, |link| link.name.clone())
}
