//! A job as a Rerun recording: how the character moves and how it came to.
//!
//! | entity | holds |
//! |---|---|
//! | `/world/ground` | the ground, once |
//! | `/world/obstacles/<name>` | an obstacle of the scene, once |
//! | `/world/character/<link>` | the link's shapes once, its frame in the world sample by sample |
//! | `/world/character/<link>/contact` | forces on the link as arrows, in the link's frame; the character's weight is as long as the character is large |
//! | `/world/path` | path of the centre of mass over a recorded motion |
//! | `/world/center_of_mass` | a ring on the ground below it, which the viewer's eye follows |
//! | `/gait/<link>` | `stance` or `swing` of every link that ever carried the character |
//! | `/joints/<name>/{angle,target,torque}` | rad (m), rad (m), N m (N) |
//! | `/learning/{best,mean,spread,cache_hits}` | the learning curve, see [`Generation`] |
//! | `/motion` | what the motion shown is and how it is judged, as Markdown |
//! | `/job` | what the job is, as Markdown |
//!
//! Every row is on both timelines, because all views of the viewer follow the active one.
//! `generation` is the learner's generation: at generation g the viewer shows the end of the last
//! motion recorded up to then and the whole of its path. `sim_time` is the clock of the recorded
//! motions, one after the other: a motion of 4 s that starts at 8 s is followed by the next at 12 s,
//! and a point of the learning curve lies where the clock stood when it was made. Neither depends on
//! the wall clock.
//!
//! The file is written while the job runs: rows reach it within about a second, and what is there
//! can be read at any time, whether the writer goes on, has ended or was killed.

mod appearance;
mod file;
mod layout;
mod motion;
mod paths;
mod scenery;
mod shapes;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

use re_sdk::external::re_log_encoding::EncodeError;
use re_sdk::log::ChunkBatcherConfig;
use re_sdk::sink::SinkFlushError;
use re_sdk::{RecordingStream, RecordingStreamBuilder, RecordingStreamError};
use re_sdk_types::archetypes::{Scalars, TextDocument};

use appearance::Appearance;
pub use appearance::RecordingSubject;
pub(super) use appearance::limb_colors;
use file::RecordingFile;
use gaitwright_learning::gait::Detection;
use gaitwright_learning::learn::Generation;
use gaitwright_physics::playback::Trace;
use paths::{APPLICATION, GENERATION, SIM_TIME};

/// How long rows that come one by one are gathered before they are written.
const GATHER: Duration = Duration::from_secs(1);

/// A recording in the making.
///
/// Dropping it ends the file as [`Recording::finish`] does, but reports no errors.
pub struct Recording {
    stream: RecordingStream,
    file: RecordingFile,
    /// What the file is called in errors.
    path: PathBuf,
    appearance: Appearance,
    /// Where the next motion starts on `sim_time`, s.
    clock: f64,
    /// The generation recorded last.
    generation: u32,
    /// Links that have carried force so far, by index.
    touched: BTreeSet<usize>,
}

/// A recording that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be created.
    #[error("cannot create the recording {}: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Why.
        source: EncodeError,
    },
    /// A row cannot be encoded.
    #[error("cannot record: {0}")]
    Log(#[from] RecordingStreamError),
    /// What was recorded cannot be written to the file.
    #[error("cannot write the recording {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: SinkFlushError,
    },
}

impl Recording {
    /// Creates (or overwrites) the file at `path` with the layout, the ground and the character's
    /// shapes in it.
    ///
    /// # Errors
    ///
    /// [`RecordingError`] when the file cannot be created or written.
    pub fn create(path: &Path, subject: RecordingSubject<'_>) -> Result<Self, RecordingError> {
        let file = RecordingFile::create(path)
            .map_err(|source| RecordingError::Create { path: path.to_owned(), source })?;
        let gather = ChunkBatcherConfig { flush_tick: GATHER, ..ChunkBatcherConfig::DEFAULT };
        let builder =
            RecordingStreamBuilder::new(APPLICATION).recording_id(subject.id).batcher_config(gather);
        let (_, store, about, gather, hooks, _) = builder.into_args();
        let stream = RecordingStream::new(store, about, gather, hooks, Box::new(file.clone()))?;
        // Times of the wall clock and counters of the logging would make equal jobs differ.
        stream.set_log_time_enabled(false);
        stream.set_log_tick_enabled(false);
        stream.send_recording_name(subject.title)?;

        let appearance = Appearance::new(&subject);
        layout::send(&stream, subject.id, &appearance, subject.scene)?;
        scenery::log(&stream, &appearance, subject.scene)?;
        shapes::log(&stream, subject.character, &appearance)?;
        motion::log_styles(&stream, &appearance)?;
        log_curve_styles(&stream)?;
        let path = path.to_owned();
        let recording =
            Self { stream, file, path, appearance, clock: 0.0, generation: 0, touched: BTreeSet::new() };
        recording.flush()?;
        Ok(recording)
    }

    /// Takes note of another name of the file, by which errors name it from now on.
    pub fn set_path(&mut self, path: &Path) {
        self.path = path.to_owned();
    }

    fn flush(&self) -> Result<(), RecordingError> {
        self.stream.flush_blocking().map_err(|source| self.unwritten(source))
    }

    fn unwritten(&self, source: SinkFlushError) -> RecordingError {
        RecordingError::Write { path: self.path.clone(), source }
    }

    /// Adds a point to the learning curve.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Log`] when it cannot be encoded.
    pub fn generation(&mut self, figures: &Generation) -> Result<(), RecordingError> {
        self.generation = figures.generation;
        self.stream.set_time_sequence(GENERATION, i64::from(figures.generation));
        self.stream.set_duration_secs(SIM_TIME, self.clock);
        for (name, value) in [
            ("best", figures.best),
            ("mean", figures.mean),
            ("spread", figures.spread),
            ("cache_hits", figures.cache_hit_rate),
        ] {
            self.stream.log(paths::learning(name), &Scalars::single(value))?;
        }
        Ok(())
    }

    /// Records a motion found after `generation` generations, with what is said about it in Markdown; it follows the
    /// motions before it on `sim_time`. Its footfalls are told by `detection`, as whoever judges it tells them.
    ///
    /// Some 100 kB for a trace of 4 s at 50 samples a second of a character with 12 joints. A trace
    /// without samples records nothing.
    ///
    /// # Errors
    ///
    /// [`RecordingError`] when it cannot be encoded, or when what was recorded so far could not be
    /// written.
    pub fn motion(
        &mut self,
        (generation, markdown): (u32, &str),
        (trace, detection): (&Trace, Detection),
    ) -> Result<(), RecordingError> {
        let (Some(first), Some(last)) = (trace.samples.first(), trace.samples.last()) else { return Ok(()) };
        let duration = last.time - first.time;
        self.stream.set_time_sequence(GENERATION, i64::from(generation));
        self.stream.set_duration_secs(SIM_TIME, self.clock);
        self.stream.log(paths::motion(), &TextDocument::from_markdown(markdown))?;
        let place = (generation, self.clock);
        motion::send(&self.stream, &self.appearance, &mut self.touched, place, (trace, detection))?;
        let interval = duration / (trace.samples.len().max(2) - 1) as f64;
        self.clock += duration + interval;
        self.flush()
    }

    /// Sets the text about the job, in Markdown, for all times.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Log`] when it cannot be encoded.
    pub fn job(&mut self, markdown: &str) -> Result<(), RecordingError> {
        Ok(self.stream.log_static(paths::job(), &TextDocument::from_markdown(markdown))?)
    }

    /// Ends the file. A reader finds its way in an ended file faster, but needs no end.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Write`] when not everything recorded has reached the file.
    pub fn finish(self) -> Result<(), RecordingError> {
        self.flush()?;
        self.file.finish().map_err(|source| self.unwritten(source))
    }
}

/// Names and colours of the learning curves.
fn log_curve_styles(stream: &RecordingStream) -> Result<(), RecordingStreamError> {
    use re_sdk_types::archetypes::SeriesLines;
    for (name, label, color, width) in [
        ("best", "best", [46, 204, 113, 255], 2.5),
        ("mean", "mean", [52, 152, 219, 255], 1.5),
        ("spread", "spread", [149, 165, 166, 255], 1.0),
        ("cache_hits", "share from the cache", [241, 196, 15, 255], 1.5),
    ] {
        let style = SeriesLines::new().with_names([label]).with_colors([color]).with_widths([width]);
        stream.log_static(paths::learning(name), &style)?;
    }
    Ok(())
}
