//! What a job starts from: its character, read, and what is wanted of it.
//!
//! The bytes of a job's character become a [`Reading`] here and nowhere else: when the job is posted, to be refused
//! or queued, and once more when a worker takes it from the store, which keeps bytes. Everything after that shares the
//! order. The command line reads a file, whose meshes lie beside it, and makes its order from that.

use std::sync::Arc;

use super::memory::MemoryEstimate;
use super::request::Settings;
use gaitwright_learning::learn::AskedSpeed;
use gaitwright_learning::training;
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
        Self::new(reading((bytes, source, place), &settings)?, settings)
    }

    /// The same for a job that is posted, with what takes finding how the character stands: whether it has the legs for the gait and
    /// the speed that are asked for. A job that may come to need more than `budget` bytes of memory on `threads` threads is
    /// refused; `None` when `stop` returns true before all is known.
    ///
    /// # Errors
    ///
    /// As [`Order::read`], and at `/task/gait` and `/task/speed`.
    pub fn read_posted(
        document: (&[u8], Option<Source>, &str),
        settings: Settings,
        (threads, budget): (usize, u64),
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Self>, InputError> {
        let reading = reading(document, &settings)?;
        let mut faults = faults(&reading, &settings);
        if faults.is_empty() {
            let order = Self { reading, settings };
            order.memory(threads).check(budget)?;
            return Ok(check_task(&order.reading, &order.settings, stop)?.map(|()| order));
        }
        // All faults are told at once, as far as the others leave it open how the character stands.
        let Settings { scene, task, accuracy, .. } = &settings;
        let stands = scene.faults().is_empty() && task.faults().is_empty();
        let memory = MemoryEstimate::of_simulation(&reading.character, scene, accuracy);
        if stands
            && memory.check(budget).is_ok()
            && let Err(InputError::Impossible(of_task)) = check_task(&reading, &settings, stop)
        {
            faults.extend(of_task);
        }
        Err(InputError::Impossible(faults))
    }

    /// Checks what is wanted of a character.
    ///
    /// # Errors
    ///
    /// Every fault of what is wanted, with JSON pointers into the job document.
    pub fn new(reading: Reading, settings: Settings) -> Result<Self, InputError> {
        let faults = faults(&reading, &settings);
        if faults.is_empty() { Ok(Self { reading, settings }) } else { Err(InputError::Impossible(faults)) }
    }

    /// How much memory it may come to need on so many threads.
    pub fn memory(&self, threads: usize) -> MemoryEstimate {
        MemoryEstimate::of_learning(&self.reading.character, &self.settings, threads)
    }
}

/// Reads the character of a job.
///
/// # Errors
///
/// Every fault of the character, and those of `settings` as well.
fn reading(
    (bytes, source, place): (&[u8], Option<Source>, &str),
    settings: &Settings,
) -> Result<Reading, InputError> {
    match read_character(bytes, source, Options::default()).map_err(|error| error.under(place)) {
        Err(InputError::Impossible(mut faults)) => {
            faults.extend(settings.faults());
            Err(InputError::Impossible(faults))
        }
        read => read,
    }
}

/// What is impossible in an order, as far as can be known without simulating.
fn faults(reading: &Reading, settings: &Settings) -> Vec<Fault> {
    let mut faults = settings.faults();
    let movable = |link: &Link| link.joint.as_ref().is_some_and(|joint| joint.kind != JointKind::Fixed);
    if !reading.character.links.iter().any(movable) {
        faults.push(Fault::new("/character", "the character has no joint that could move"));
    }
    let touches = |link: &Link| !link.collisions.is_empty();
    if settings.scene.ground.is_some() && !reading.character.links.iter().any(touches) {
        let reason = "the character has no collision shapes, and would fall through the ground";
        faults.push(Fault::new("/character", reason));
    }
    faults
}

/// Whether a character has the legs for the gait and the speed that are asked for; `None` when `stop` returns true before
/// that is known.
///
/// # Errors
///
/// [`InputError::Impossible`] at `/task/gait` and `/task/speed`.
fn check_task(
    reading: &Reading,
    Settings { task, scene, .. }: &Settings,
    stop: &dyn Fn() -> bool,
) -> Result<Option<()>, InputError> {
    if task.any_gait() && !matches!(task.speed, Some(AskedSpeed::Number(_))) {
        return Ok(Some(()));
    }
    let model = Arc::new(Model::new(Arc::new(reading.character.clone()), Base::Floating));
    let stance = Stance::find_until(&model, scene, stop);
    if stop() {
        return Ok(None);
    }
    training::check_task(task, &model, &stance, scene).map(Some)
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
