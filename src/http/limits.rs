//! What one caller may have of what all share, so that nobody takes all of it.

use std::collections::HashMap;
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use governor::clock::{Clock, DefaultClock};
use governor::{DefaultKeyedRateLimiter, Quota};
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};

use super::caller::Caller;

/// Seconds of the greatest rate that a caller may use up at once.
const BURST: NonZeroU32 = NonZeroU32::new(10).unwrap();

/// How many requests a caller may send: so many a second over time, and ten seconds' worth at once.
#[derive(Debug)]
pub(super) struct RequestRate {
    limiter: DefaultKeyedRateLimiter<Caller>,
    clock: DefaultClock,
}

impl RequestRate {
    /// At most `rate` requests a second.
    pub(super) fn new(rate: NonZeroU32) -> Self {
        let quota = Quota::per_second(rate).allow_burst(rate.saturating_mul(BURST));
        Self { limiter: DefaultKeyedRateLimiter::keyed(quota), clock: DefaultClock::default() }
    }

    /// Counts a request.
    ///
    /// # Errors
    ///
    /// The time until the caller may send the next one, when this is one too many.
    pub(super) fn count(&self, caller: &Caller) -> Result<(), Duration> {
        self.limiter.check_key(caller).map_err(|until| until.wait_time_from(self.clock.now()))
    }

    /// Forgets callers that have sent nothing for so long that it makes no difference.
    pub(super) fn forget_silent(&self) {
        self.limiter.retain_recent();
        self.limiter.shrink_to_fit();
    }
}

/// Places of which every caller may have a share.
#[derive(Debug)]
pub(super) struct Places {
    free: Arc<Semaphore>,
    share: usize,
    /// Places that a caller has, for those who have any.
    taken: Mutex<HashMap<Caller, usize>>,
    /// Told when a place has been given back.
    freed: Notify,
}

/// A place, given back when it is dropped.
#[derive(Debug)]
pub(super) struct Place {
    places: Arc<Places>,
    caller: Caller,
    permit: Option<OwnedSemaphorePermit>,
}

/// Why there is no place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoPlace {
    /// The caller has its share.
    ForCaller,
    /// All are taken.
    ForAnyone,
}

impl Places {
    /// So many places, of which one caller may have `share`.
    pub(super) fn new(places: usize, share: usize) -> Self {
        Self { free: Arc::new(Semaphore::new(places)), share, taken: Mutex::default(), freed: Notify::new() }
    }

    /// A place for `caller`.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub(super) fn take(self: &Arc<Self>, caller: Caller) -> Result<Place, NoPlace> {
        let mut taken = self.taken();
        let own = taken.get(&caller).copied().unwrap_or_default();
        // First, so that whoever has its share takes no place from others, not even for a moment.
        if own >= self.share {
            let none_left = self.free.available_permits() == 0;
            return Err(if none_left { NoPlace::ForAnyone } else { NoPlace::ForCaller });
        }
        let permit = Arc::clone(&self.free).try_acquire_owned().map_err(|_| NoPlace::ForAnyone)?;
        taken.insert(caller.clone(), own + 1);
        drop(taken);
        Ok(Place { places: Arc::clone(self), caller, permit: Some(permit) })
    }

    /// A place for `caller`, as soon as there is one.
    pub(super) async fn wait(self: &Arc<Self>, caller: Caller) -> Place {
        loop {
            // Asked for before the places are looked at, so that none is given back unnoticed in between.
            let freed = self.freed.notified();
            if let Ok(place) = self.take(caller.clone()) {
                return place;
            }
            freed.await;
        }
    }

    fn taken(&self) -> MutexGuard<'_, HashMap<Caller, usize>> {
        // Nobody panics while holding it; a count would at worst be one too high.
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.taken();
        if let Some(own) = taken.get_mut(&self.caller) {
            *own -= 1;
            if *own == 0 {
                taken.remove(&self.caller);
            }
        }
        drop(taken);
        // Those who wait are told only when there is a place for them.
        self.permit = None;
        self.places.freed.notify_waiters();
    }
}
