//! What a job starts from: its character, read, and what is wanted of it.
//!
//! The bytes of a job's character become a [`Reading`] here and nowhere else: when the job is posted, to be refused
//! or queued, and once more when a worker takes it from the store, which keeps bytes. Everything after that shares the
//! order. The command line reads a file, whose meshes lie beside it, and makes its order from that.

use std::sync::Arc;

use super::memory::MemoryEstimate;
use super::request::Settings;
use gaitwright_learning::learn::AskedSpeed;
use gaitwright_learning::training::check_task;
use gaitwright_physics::character::{self, JointKind, Link, Options, Reading, Source};
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::stance::Stance;

/// A job that is known to be possible as far as can be known without simulating.
#[derive(Debug, Clone)]
pub struct Order {
    /// The character, and what was repaired in it.
    pub reading: Reading,
    /// What is wanted of it.
    pub settings: Settings,
}

impl Order {
    /// Reads a character and checks what is wanted of it. Without a `source` its form is detected from
    /// the bytes. Faults of a character document are named from `place` on.
    ///
    /// # Errors
    ///
    /// Every fault of the character, and every fault of what is wanted of it with JSON pointers into
    /// the job document.
    pub fn read(
        bytes: &[u8],
        source: Option<Source>,
        place: &str,
        settings: Settings,
    ) -> Result<Self, InputError> {
        match read_character(bytes, source, Options::default()).map_err(|error| error.under(place)) {
            Ok(reading) => Self::new(reading, settings),
            Err(InputError::Impossible(mut faults)) => {
                faults.extend(settings.faults());
                Err(InputError::Impossible(faults))
            }
            Err(error) => Err(error),
        }
    }

    /// Checks what is wanted of a character.
    ///
    /// # Errors
    ///
    /// Every fault of what is wanted, with JSON pointers into the job document.
    pub fn new(reading: Reading, settings: Settings) -> Result<Self, InputError> {
        let mut faults = settings.faults();
        let movable = |link: &Link| link.joint.as_ref().is_some_and(|joint| joint.kind != JointKind::Fixed);
        if !reading.character.links.iter().any(movable) {
            faults.push(Fault::new("/character", "the character has no joint that could move"));
        }
        if faults.is_empty() { Ok(Self { reading, settings }) } else { Err(InputError::Impossible(faults)) }
    }

    /// Whether the character has the legs for the gait and the speed that are asked for, which takes finding how it stands; `None`
    /// when `stop` returns true before that is known.
    ///
    /// # Errors
    ///
    /// [`InputError::Impossible`] at `/task/gait` and `/task/speed`.
    pub fn check_task(&self, stop: &dyn Fn() -> bool) -> Result<Option<()>, InputError> {
        let Settings { task, scene, .. } = &self.settings;
        if task.any_gait() && !matches!(task.speed, Some(AskedSpeed::Number(_))) {
            return Ok(Some(()));
        }
        let model = Arc::new(Model::new(Arc::new(self.reading.character.clone()), Base::Floating));
        let stance = Stance::find_until(&model, scene, stop);
        if stop() {
            return Ok(None);
        }
        check_task(task, &model, &stance, scene).map(Some)
    }

    /// How much memory it may come to need on so many threads.
    pub fn memory(&self, threads: usize) -> MemoryEstimate {
        MemoryEstimate::of_learning(&self.reading.character, &self.settings, threads)
    }
}

/// Reads a character; without a `source` its form is detected from the bytes.
///
/// # Errors
///
/// Every fault of the character.
pub fn read_character(bytes: &[u8], source: Option<Source>, options: Options) -> Result<Reading, InputError> {
    match source.or_else(|| Source::detect(bytes)) {
        Some(source) => character::read(bytes, source, options),
        None => {
            let reason = "neither a URDF document, nor a character JSON document, nor a zip archive";
            Err(InputError::Malformed(Fault::new("line 1", reason)))
        }
    }
}
