//! Finished motions, checked: what is kept of each, and which is the job's.

use std::path::Path;

use serde::Serialize;

use super::document::document;
use super::error::RunError;
use super::finished::Finished;
use super::outcome::Unsuccessful;
use super::prepared::PreparedRun;
use crate::export::gait_diagram;
use crate::jobs::files::{Artefact, Shelf};
use crate::jobs::live::OnTheWay;
use crate::jobs::order::Order;
use crate::jobs::repertoire::{Repertoire, RepertoireEntry};
use gaitwright_learning::check::CheckedMotion;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::LearningSetup;
use gaitwright_learning::training::LearnedMotion;
use gaitwright_physics::motion::Metrics;

/// What a run has finished so far.
#[derive(Debug)]
pub(super) struct Shelved {
    repertoire: Repertoire,
    /// The job's motion and its gait.
    best: Option<(LearnedMotion, GaitReport)>,
    /// Why the motion checked last was not kept, or why there is none yet.
    refused: Unsuccessful,
}

impl Shelved {
    /// Nothing yet of what `setup` is to teach.
    pub(super) fn nothing(setup: &LearningSetup) -> Self {
        let may_stand = setup.stance.stable || setup.scene.ground.is_none();
        let refused = if may_stand { Unsuccessful::NothingLearned } else { Unsuccessful::NothingStands };
        Self { repertoire: Repertoire::default(), best: None, refused }
    }

    /// Every motion, in figures.
    pub(super) fn repertoire(&self) -> &Repertoire {
        &self.repertoire
    }

    /// The job's motion.
    pub(super) fn motion(&self) -> Option<&LearnedMotion> {
        self.best.as_ref().map(|(motion, _)| motion)
    }

    /// Fitness of the job's motion.
    pub(super) fn fitness(&self) -> Option<f64> {
        self.motion().map(|motion| motion.behaviour.fitness)
    }

    /// Gait of the job's motion.
    pub(super) fn gait(&self) -> Option<&GaitReport> {
        self.best.as_ref().map(|(_, gait)| gait)
    }

    /// Figures of the job's motion, or why there is none.
    pub(super) fn outcome(&self) -> Result<Metrics, Unsuccessful> {
        self.repertoire.chosen().map(|entry| entry.metrics.clone()).ok_or(self.refused)
    }

    /// Takes note that a motion was not kept.
    pub(super) fn refuse(&mut self, reason: Unsuccessful) {
        self.refused = reason;
    }

    /// The files of a motion on the way, as those of the job's motion are once it has one; none once it has, or where it fell.
    ///
    /// # Errors
    ///
    /// When its gait cannot be drawn.
    pub(super) fn on_the_way(
        &self,
        (order, prepared): (&Order, &PreparedRun),
        learned: &LearnedMotion,
        checked: &CheckedMotion,
    ) -> Result<Option<OnTheWay>, RunError> {
        let document = self.best.is_none().then(|| document(order, prepared, learned, checked)).flatten();
        let Some(document) = document else { return Ok(None) };
        let [motion, gait, diagram] = [
            (Artefact::Motion, document.to_json()?.into_bytes()),
            (Artefact::Gait, json(&checked.gait)?),
            (Artefact::Diagram, gait_diagram(&checked.gait)?.into_bytes()),
        ]
        .map(|(artefact, contents)| (artefact.file_name(), contents));
        Ok(Some(OnTheWay::from([motion, gait, diagram])))
    }

    /// Writes a motion and its gait into `folder`, and what the job shows as its own if it is the best so far. Gives
    /// the motion in figures; `None` for one that fell.
    ///
    /// # Errors
    ///
    /// When a file cannot be written.
    pub(super) fn add(
        &mut self,
        folder: &Path,
        learned: &LearnedMotion,
        finished: &Finished,
    ) -> Result<Option<&RepertoireEntry>, RunError> {
        let Finished { document, gait, .. } = finished;
        let Some(document) = document else {
            self.refuse(Unsuccessful::Fell);
            return Ok(None);
        };
        let asked = (learned.gait.clone(), learned.speed);
        let (number, best) = self.repertoire.add(&learned.name, asked, document.metrics.clone());
        let Some(entry) = self.repertoire.entry(number) else { return Ok(None) };
        let (motion, report) = (document.to_json()?, json(gait)?);
        Shelf::Motions.publish(folder, &entry.file, motion.as_bytes())?;
        Shelf::Gaits.publish(folder, &entry.file, &report)?;
        if best {
            Artefact::Motion.publish(folder, motion.as_bytes())?;
            Artefact::Gait.publish(folder, &report)?;
            Artefact::Diagram.publish(folder, gait_diagram(gait)?.as_bytes())?;
            self.best = Some((learned.clone(), gait.clone()));
        }
        Artefact::Motions.publish(folder, &json(&self.repertoire)?)?;
        Ok(self.repertoire.entry(number))
    }
}

/// A document as its file holds it.
pub(super) fn json<T: Serialize>(document: &T) -> Result<Vec<u8>, RunError> {
    Ok(serde_json::to_vec_pretty(document).map_err(std::io::Error::from)?)
}
