//! How long things are kept: by age, number and size, and told before they go.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use jiff::{SignedDuration, Timestamp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::text::as_text;

/// How much of one kind is kept. What exceeds one of the limits goes, the oldest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Retention {
    /// Longest time.
    pub age: Option<Duration>,
    /// Greatest number.
    pub number: Option<u64>,
    /// Greatest size of all together, bytes.
    pub bytes: Option<u64>,
}

/// How much is kept of everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RetentionOptions {
    /// Jobs that have ended, with their files; from their end on.
    pub jobs: Retention,
    /// Recordings of jobs that have ended; from their end on.
    pub recordings: Retention,
    /// Characters; from their last use on.
    pub characters: Retention,
    /// How long before it goes each thing says so at least.
    pub notice: Duration,
}

impl Default for RetentionOptions {
    /// Everything, for ever.
    fn default() -> Self {
        let all = Retention::default();
        Self { jobs: all, recordings: all, characters: all, notice: NOTICE }
    }
}

/// How long before it goes a thing says so at least, unless told otherwise.
pub const NOTICE: Duration = Duration::from_secs(3600);

/// When something goes, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Expiry {
    /// When.
    #[schemars(with = "String")]
    pub at: Timestamp,
    /// Which limit it exceeds, or will then exceed.
    pub because: String,
}

/// Limits that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is neither an age (such as 30d, 12h, 90m, 45s), nor a number, nor a size (such as 500MB, 20GB), \
     nor a second one of these, nor `forever`"
)]
pub struct RetentionError(String);

/// Units of ages, s.
const AGES: [(&str, u64); 4] = [("d", 86_400), ("h", 3600), ("m", 60), ("s", 1)];

/// Units of sizes, bytes.
const SIZES: [(&str, u64); 4] =
    [("TB", 1_000_000_000_000), ("GB", 1_000_000_000), ("MB", 1_000_000), ("kB", 1000)];

impl FromStr for Retention {
    type Err = RetentionError;

    /// Reads limits with commas between them: `30d,1000,20GB`, in any order, each at most once; or `forever`.
    fn from_str(text: &str) -> Result<Self, RetentionError> {
        let mut limits = Self::default();
        if text == "forever" {
            return Ok(limits);
        }
        for limit in text.split(',').map(str::trim) {
            let unknown = || RetentionError(limit.to_owned());
            let in_units = |units: &[(&str, u64)]| {
                let (number, unit) =
                    units.iter().find_map(|(name, unit)| Some((limit.strip_suffix(name)?, unit)))?;
                number.parse::<u64>().ok()?.checked_mul(*unit)
            };
            let first = if let Some(bytes) = in_units(&SIZES) {
                limits.bytes.replace(bytes).is_none()
            } else if let Some(seconds) = in_units(&AGES) {
                limits.age.replace(Duration::from_secs(seconds)).is_none()
            } else {
                limits.number.replace(limit.parse().map_err(|_| unknown())?).is_none()
            };
            if !first {
                return Err(unknown());
            }
        }
        Ok(limits)
    }
}

as_text!(Retention, RetentionError);

impl fmt::Display for Retention {
    /// As it is read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let written = |number: u64, units: &[(&str, u64)]| {
            let unit = units.iter().find(|(_, unit)| number.is_multiple_of(*unit) && number > 0);
            unit.map_or(format!("{number}"), |(name, unit)| format!("{}{name}", number / unit))
        };
        let age = self.age.map(|age| match age.as_secs() {
            0 => "0s".to_owned(),
            seconds => written(seconds, &AGES),
        });
        let bytes = self.bytes.map(|bytes| match bytes {
            0 => "0kB".to_owned(),
            bytes => written(bytes, &SIZES),
        });
        let limits: Vec<String> =
            [age, self.number.map(|number| number.to_string()), bytes].into_iter().flatten().collect();
        f.write_str(if limits.is_empty() { "forever" } else { "" })?;
        f.write_str(&limits.join(","))
    }
}

/// Something that is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptThing {
    /// What it is.
    pub id: Uuid,
    /// From when on its age counts.
    pub since: Timestamp,
    /// Its size.
    pub bytes: u64,
    /// What it says about when it goes.
    pub told: Option<Expiry>,
}

/// What is done about something that is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Upkeep {
    /// It says from now on when it goes, or that it stays.
    Tell(Uuid, Option<Expiry>),
    /// It goes now.
    Remove(Uuid),
}

impl Retention {
    /// Whether there is a limit.
    pub fn is_limited(&self) -> bool {
        *self != Self::default()
    }

    /// What is to be done about `things` at the time `now`; each is told at least `notice` before it goes.
    pub fn plan(&self, mut things: Vec<KeptThing>, notice: Duration, now: Timestamp) -> Vec<Upkeep> {
        things.sort_by_key(|thing| std::cmp::Reverse((thing.since, thing.id)));
        let soonest = later(now, notice);
        let (mut upkeep, mut bytes) = (Vec::new(), 0_u64);
        for (index, thing) in (0_u64..).zip(things) {
            bytes = bytes.saturating_add(thing.bytes);
            let due = self.due(&thing, index, bytes, now);
            let told = thing.told.as_ref();
            let expiry = due.map(|due| {
                let allowed = told.map_or(soonest, |told| told.at.min(soonest));
                Expiry { at: due.at.max(allowed), because: due.because }
            });
            match (told, expiry) {
                (Some(told), Some(expiry)) if told.at.max(expiry.at) <= now => {
                    upkeep.push(Upkeep::Remove(thing.id));
                }
                (told, expiry) if told == expiry.as_ref() => {}
                (_, expiry) => upkeep.push(Upkeep::Tell(thing.id, expiry)),
            }
        }
        upkeep
    }

    /// When the thing at `index` of those from the newest on, which together are so large, exceeds a limit, and which.
    fn due(&self, thing: &KeptThing, index: u64, bytes: u64, now: Timestamp) -> Option<Expiry> {
        let only = |limit: Self| limit.to_string();
        if let Some(number) = self.number.filter(|number| index >= *number) {
            let limit = only(Self { number: Some(number), ..Self::default() });
            return Some(Expiry { at: now, because: format!("only the {limit} newest are kept") });
        }
        if let Some(limit) = self.bytes.filter(|limit| bytes > *limit) {
            let limit = only(Self { bytes: Some(limit), ..Self::default() });
            return Some(Expiry { at: now, because: format!("only {limit} are kept, the newest") });
        }
        let age = self.age?;
        let limit = only(Self { age: Some(age), ..Self::default() });
        Some(Expiry { at: later(thing.since, age), because: format!("it is kept for {limit}") })
    }
}

/// So long after `time`; the end of time when that is later.
fn later(time: Timestamp, length: Duration) -> Timestamp {
    let length = SignedDuration::try_from(length).unwrap_or(SignedDuration::MAX);
    time.checked_add(length).unwrap_or(Timestamp::MAX)
}
