//! One motion: everything that is recorded sample by sample.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Vector3};
use re_sdk::log::TimeColumn;
use re_sdk::{
    EntityPath, RecordingStream, RecordingStreamError, SerializationResult, SerializedComponentColumn,
};
use re_sdk_types::archetypes::{
    Arrows3D, LineStrips3D, Scalars, SeriesLines, StateChange, StateConfiguration, Transform3D,
};

use super::appearance::Appearance;
use super::paths::{self, GENERATION, SIM_TIME};
use super::shapes::{float, quaternion};
use gaitwright_learning::gait::{Detection, Footing};
use gaitwright_physics::playback::{Sample, Trace};

/// Of the character's size.
const FORCE_RADIUS: f32 = 0.012;

const FORCE_COLOR: [u8; 4] = [255, 92, 92, 255];
const PATH_COLOR: [u8; 4] = [255, 214, 102, 255];
const SWING_COLOR: [u8; 4] = [48, 52, 58, 255];

/// Columns of an archetype, or why they cannot be encoded.
type Columns<I> = SerializationResult<I>;

/// Logs what the curves of the joints are called, for all times.
pub(super) fn log_styles(
    stream: &RecordingStream,
    appearance: &Appearance,
) -> Result<(), RecordingStreamError> {
    for name in &appearance.joints {
        for (quantity, width) in [("angle", 1.5), ("target", 0.7), ("torque", 1.2)] {
            let label = if quantity == "torque" { name.clone() } else { format!("{name} {quantity}") };
            let style = SeriesLines::new().with_names([label]).with_widths([width]);
            stream.log_static(paths::joint(name, quantity), &style)?;
        }
    }
    Ok(())
}

/// Logs what the forces on a link and its stances look like, for all times.
fn log_contact_styles(
    stream: &RecordingStream,
    appearance: &Appearance,
    link: usize,
) -> Result<(), RecordingStreamError> {
    let name = &appearance.links[link];
    let arrows = Arrows3D::update_fields()
        .with_colors([FORCE_COLOR])
        .with_radii([FORCE_RADIUS * appearance.size as f32]);
    stream.log_static(paths::contact(name), &arrows)?;
    let states = StateConfiguration::new()
        .with_values(["stance", "swing"])
        .with_labels([" ", " "])
        .with_colors([appearance.colors[link], SWING_COLOR]);
    stream.log_static(paths::gait(name), &states)
}

/// Sends every sample of `trace`, a column for each quantity: the motion of a generation that starts when `sim_time`
/// is at `clock` (s), with its footfalls told by `detection`. Adds the links that carry force in it to `touched`.
pub(super) fn send(
    stream: &RecordingStream,
    appearance: &Appearance,
    touched: &mut BTreeSet<usize>,
    (generation, clock): (u32, f64),
    (trace, detection): (&Trace, Detection),
) -> Result<(), RecordingStreamError> {
    let Some(first) = trace.samples.first() else { return Ok(()) };
    let offset = clock - first.time;
    for contact in trace.samples.iter().flat_map(|sample| &sample.contacts) {
        if contact.link < appearance.links.len() && touched.insert(contact.link) {
            log_contact_styles(stream, appearance, contact.link)?;
        }
    }
    let sheet = Sheet {
        stream,
        generation: i64::from(generation),
        times: trace.samples.iter().map(|sample| offset + sample.time).collect(),
        samples: &trace.samples,
    };
    for (index, name) in appearance.links.iter().enumerate() {
        sheet.link(index, name)?;
    }
    let meters_per_newton = appearance.size / appearance.weight.max(f64::MIN_POSITIVE);
    for &link in &*touched {
        let name = &appearance.links[link];
        sheet.contact(link, name, meters_per_newton)?;
        sheet.gait(name, &Footing::detect(trace, &[link], detection))?;
    }
    for (joint, name) in appearance.joints.iter().enumerate() {
        sheet.scalars(&paths::joint(name, "angle"), |sample| sample.angles.get(joint))?;
        sheet.scalars(&paths::joint(name, "target"), |sample| sample.targets.get(joint))?;
        sheet.scalars(&paths::joint(name, "torque"), |sample| sample.torques.get(joint))?;
    }
    sheet.center_of_mass(appearance.size)
}

/// The rows of one motion, on both timelines.
struct Sheet<'a> {
    stream: &'a RecordingStream,
    generation: i64,
    /// On `sim_time`, s, one a sample.
    times: Vec<f64>,
    samples: &'a [Sample],
}

impl Sheet<'_> {
    /// Where a link is.
    fn link(&self, index: usize, name: &str) -> Result<(), RecordingStreamError> {
        let poses: Vec<(f64, &Isometry3<f64>)> = self
            .times
            .iter()
            .zip(self.samples)
            .filter_map(|(&time, sample)| Some((time, sample.link_poses.get(index)?)))
            .collect();
        let columns = Transform3D::update_fields()
            .with_many_translation(poses.iter().map(|(_, pose)| float(&pose.translation.vector)))
            .with_many_quaternion(poses.iter().map(|(_, pose)| quaternion(pose)))
            .columns_of_unit_batches();
        self.rows(&paths::link(name), poses.iter().map(|&(time, _)| time), columns)
    }

    /// Forces on a link, in its own frame.
    fn contact(&self, link: usize, name: &str, scale: f64) -> Result<(), RecordingStreamError> {
        let (mut origins, mut vectors, mut counts) = (Vec::new(), Vec::new(), Vec::new());
        for sample in self.samples {
            let pose = sample.link_poses.get(link).copied().unwrap_or_default();
            let before = origins.len();
            for contact in sample.contacts.iter().filter(|contact| contact.link == link) {
                origins.push(float(&pose.inverse_transform_point(&contact.position).coords));
                vectors.push(float(&(pose.inverse_transform_vector(&contact.force) * scale)));
            }
            counts.push(origins.len() - before);
        }
        let path = paths::contact(name);
        let style = Arrows3D::update_fields().with_colors([FORCE_COLOR]);
        self.stream.log_static(path.clone(), &style)?;
        let columns = Arrows3D::update_fields().with_vectors(vectors).with_origins(origins).columns(counts);
        self.rows(&path, self.times.iter().copied(), columns)
    }

    /// Stance and swing of a link, at the start and wherever it changes.
    fn gait(&self, name: &str, footing: &Footing) -> Result<(), RecordingStreamError> {
        let changes: Vec<usize> = (0..footing.stance.len())
            .filter(|&at| at == 0 || footing.stance[at] != footing.stance[at - 1])
            .collect();
        let states = changes.iter().map(|&at| if footing.stance[at] { "stance" } else { "swing" });
        let columns = StateChange::update_fields().with_state(states).columns_of_unit_batches();
        self.rows(&paths::gait(name), changes.iter().map(|&at| self.times[at]), columns)
    }

    /// A number of every sample that has it.
    fn scalars(
        &self,
        path: &EntityPath,
        value: impl Fn(&Sample) -> Option<&f64>,
    ) -> Result<(), RecordingStreamError> {
        let values: Vec<(f64, f64)> = self
            .times
            .iter()
            .zip(self.samples)
            .filter_map(|(&time, sample)| Some((time, *value(sample)?)))
            .collect();
        let columns = Scalars::update_fields()
            .with_scalars(values.iter().map(|&(_, value)| value))
            .columns_of_unit_batches();
        self.rows(path, values.iter().map(|&(time, _)| time), columns)
    }

    /// The path of the centre of mass over the whole motion, from its start on, and the ring below it.
    fn center_of_mass(&self, size: f64) -> Result<(), RecordingStreamError> {
        let below = self.samples.iter().map(|sample| {
            let center = sample.center_of_mass.coords;
            float(&Vector3::new(center.x, center.y, 0.0))
        });
        let columns = Transform3D::update_fields().with_many_translation(below).columns_of_unit_batches();
        self.rows(&paths::ring(), self.times.iter().copied(), columns)?;

        let points = self.samples.iter().map(|sample| float(&sample.center_of_mass.coords));
        let columns = LineStrips3D::update_fields()
            .with_strips([points.collect::<Vec<_>>()])
            .with_colors([PATH_COLOR])
            .with_radii([0.006 * size as f32])
            .columns_of_unit_batches();
        self.rows(&paths::travel(), self.times.iter().copied().take(1), columns)
    }

    fn rows<I: Iterator<Item = SerializedComponentColumn>>(
        &self,
        path: &EntityPath,
        times: impl Iterator<Item = f64> + Clone,
        columns: Columns<I>,
    ) -> Result<(), RecordingStreamError> {
        let indexes = [
            TimeColumn::new_sequence(GENERATION, times.clone().map(|_| self.generation)),
            TimeColumn::new_duration_secs(SIM_TIME, times),
        ];
        self.stream.send_columns(path.clone(), indexes, columns?)
    }
}
