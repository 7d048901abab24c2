//! What tells a learner the time.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// A clock; clones show the same time. By default the wall clock.
#[derive(Debug, Clone)]
pub struct Clock(Source);

#[derive(Debug, Clone)]
enum Source {
    /// The wall clock, from here on.
    Wall(Instant),
    /// How often it was read, and what it advances by each time.
    Readings(Arc<AtomicU32>, Duration),
}

impl Clock {
    /// A clock that advances by `tick` whenever it is read. The search gait by gait looks at its clock at every step of the
    /// simulation, so that by this clock the same work of it takes the same time on every machine.
    pub fn of_readings(tick: Duration) -> Self {
        Self(Source::Readings(Arc::default(), tick))
    }

    /// Time since the clock was made.
    pub(crate) fn now(&self) -> Duration {
        match &self.0 {
            Source::Wall(start) => start.elapsed(),
            Source::Readings(readings, tick) => *tick * readings.fetch_add(1, Ordering::Relaxed),
        }
    }

    /// s since `then`, which this clock has shown.
    pub(crate) fn since(&self, then: Duration) -> f64 {
        self.now().saturating_sub(then).as_secs_f64()
    }
}

impl Default for Clock {
    fn default() -> Self {
        Self(Source::Wall(Instant::now()))
    }
}
