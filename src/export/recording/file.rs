//! The file that a recording is written into.
//!
//! The SDK's own sink for files hands every message to a thread of its own and waits for it without a limit; once a write
//! has failed that thread is gone, and a flush that was on its way to it is never answered. This one writes on the thread
//! that brings the message, keeps the first error, and waits for nobody.

use std::fs::File;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use re_sdk::external::re_log_encoding::{EncodeError, Encoder, EncodingOptions};
use re_sdk::log::LogMsg;
use re_sdk::sink::{LogSink, SinkFlushError};

/// A file that messages are written into; clones share it.
#[derive(Clone)]
pub(super) struct RecordingFile(Arc<Mutex<Written>>);

struct Written {
    encoder: Encoder<File>,
    /// Why nothing more is written, once that is so.
    failure: Option<String>,
}

impl RecordingFile {
    /// Creates (or overwrites) the file at `path`.
    ///
    /// # Errors
    ///
    /// When it cannot be created or written.
    pub(super) fn create(path: &Path) -> Result<Self, EncodeError> {
        let version = re_sdk::build_info().version;
        let encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, File::create(path)?)?;
        Ok(Self(Arc::new(Mutex::new(Written { encoder, failure: None }))))
    }

    /// Writes the end, by which a reader finds its way faster. Nothing can be written after it.
    ///
    /// # Errors
    ///
    /// When something, the end or what came before it, has not been written.
    pub(super) fn finish(&self) -> Result<(), SinkFlushError> {
        let mut written = self.written();
        written.attempt(Encoder::finish);
        written.outcome()
    }

    fn written(&self) -> MutexGuard<'_, Written> {
        // A message that broke off by a panic leaves what a full disk leaves: nothing after it counts.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Written {
    /// Writes unless that has failed before: after a part of a message no other can be read.
    fn attempt<T>(&mut self, write: impl FnOnce(&mut Encoder<File>) -> Result<T, EncodeError>) {
        if self.failure.is_some() {
            return;
        }
        if let Err(error) = write(&mut self.encoder) {
            // When it is dropped, the encoder would write an end all the same.
            self.encoder.do_not_emit_footer();
            self.failure = Some(error.to_string());
        }
    }

    fn outcome(&self) -> Result<(), SinkFlushError> {
        match &self.failure {
            None => Ok(()),
            Some(reason) => Err(SinkFlushError::failed(reason)),
        }
    }
}

impl LogSink for RecordingFile {
    fn send(&self, message: LogMsg) {
        self.written().attempt(|encoder| encoder.append(&message));
    }

    fn flush_blocking(&self, _: Duration) -> Result<(), SinkFlushError> {
        let mut written = self.written();
        written.attempt(Encoder::flush_blocking);
        written.outcome()
    }
}
