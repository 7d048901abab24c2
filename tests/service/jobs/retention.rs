//! What goes when, by simulating days of keeping house.

use std::collections::BTreeMap;
use std::time::Duration;

use gaitwright::jobs::{Expiry, KeptThing, Retention, Upkeep};
use jiff::{SignedDuration, Timestamp};
use proptest::prelude::*;
use uuid::Uuid;

fn at(minute: i64) -> Timestamp {
    Timestamp::from_second(1_700_000_000 + 60 * minute).unwrap()
}

fn minutes(minutes: u64) -> Duration {
    Duration::from_secs(60 * minutes)
}

#[test]
fn limits_are_written_as_they_are_read() {
    for text in ["forever", "30d", "36h", "90m,17", "1000,20GB", "1d,1,1TB", "5s", "0", "0s,0,0kB", "1500MB"]
    {
        let limits: Retention = text.parse().unwrap();
        assert_eq!(limits.to_string(), text);
        assert_eq!(limits.is_limited(), text != "forever");
    }
    let limits: Retention = "20GB, 1000, 30d".parse().unwrap();
    assert_eq!(limits.age, Some(Duration::from_secs(30 * 86_400)));
    assert_eq!((limits.number, limits.bytes), (Some(1000), Some(20_000_000_000)));
    for text in ["", "x", "1d,2d", "1,2", "1GB,2MB", "-1", "1.5d", "99999999999999999999", "d", "30D"] {
        assert!(text.parse::<Retention>().is_err(), "{text}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// Minute by minute, things come and house is kept. Nothing goes without having said so for the time of notice;
    /// once that is over, all limits hold; and nothing goes without a limit.
    #[test]
    fn things_say_so_before_they_go(
        arrivals in prop::collection::vec((0_i64..200, 1_u64..50), 1..40),
        age in prop::option::of(0_u64..150),
        number in prop::option::of(0_u64..20),
        bytes in prop::option::of(0_u64..300),
        notice in 0_u64..30,
    ) {
        let limits = Retention { age: age.map(minutes), number, bytes };
        let mut kept: BTreeMap<Uuid, KeptThing> = BTreeMap::new();
        let mut told_at: BTreeMap<Uuid, i64> = BTreeMap::new();
        let newest = arrivals.iter().map(|(minute, _)| *minute).max().unwrap();
        for minute in 0..newest + 200 {
            for (index, (_, size)) in arrivals.iter().enumerate().filter(|(_, (when, _))| *when == minute) {
                let id = Uuid::from_u128(index as u128);
                kept.insert(id, KeptThing { id, since: at(minute), bytes: *size, told: None });
            }
            let upkeep = limits.plan(kept.values().cloned().collect(), minutes(notice), at(minute));
            for upkeep in upkeep {
                match upkeep {
                    Upkeep::Tell(id, expires) => {
                        match &expires {
                            Some(Expiry { at: when, .. }) => {
                                let first = *told_at.entry(id).or_insert(minute);
                                prop_assert!(*when >= at(first) + SignedDuration::from_mins(notice as i64));
                            }
                            None => { told_at.remove(&id); }
                        }
                        kept.get_mut(&id).unwrap().told = expires;
                    }
                    Upkeep::Remove(id) => {
                        let thing = kept.remove(&id).unwrap();
                        prop_assert!(minute - told_at[&id] >= notice as i64, "{thing:?} at {minute}");
                        prop_assert!(thing.told.unwrap().at <= at(minute));
                        prop_assert!(limits.is_limited());
                    }
                }
            }
        }
        // Long after the last has come, everything has had its notice.
        let end = at(newest + 199);
        prop_assert!(number.is_none_or(|number| kept.len() as u64 <= number));
        prop_assert!(bytes.is_none_or(|bytes| kept.values().map(|thing| thing.bytes).sum::<u64>() <= bytes));
        if let Some(age) = age {
            let slack = SignedDuration::from_mins(age as i64 + notice as i64 + 2);
            prop_assert!(kept.values().all(|thing| thing.since + slack >= end));
        }
        if !limits.is_limited() {
            prop_assert_eq!(kept.len(), arrivals.len());
        }
        // The newest that go are older than the oldest that stay, unless age alone decides, which comes to the same.
        let oldest = kept.values().map(|thing| (thing.since, thing.id)).min();
        let went = (0..arrivals.len())
            .map(|index| (at(arrivals[index].0), Uuid::from_u128(index as u128)))
            .filter(|(_, id)| !kept.contains_key(id));
        prop_assert!(went.max().is_none_or(|went| oldest.is_none_or(|oldest| went < oldest)));
    }
}
