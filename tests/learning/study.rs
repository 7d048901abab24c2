//! The study of the learning: what it measures against what it runs, and its table.

use gaitwright_learning::learn::{Learning, Repair, Repairs, SearchMethod, Trunk};
use gaitwright_learning::study::arena::{FROUDE, StudyArena};
use gaitwright_learning::study::variants::{
    KeyframeStart, Question, Variant, VariantSearch, questions, variants,
};
use gaitwright_learning::study::{
    JudgedMotion, JudgedRun, LearningStudy, LearningTable, MedianRange, VariantRow, run,
};

use crate::common;

/// QDSEGA with generations of a few simulated seconds.
fn brief() -> Learning {
    Learning {
        population: 4,
        islands: 1,
        states: 4,
        episodes: 3,
        episode_length: 6,
        elite: 1,
        trial_seconds: 0.5,
        check_seconds: 1.0,
        ..Learning::default()
    }
}

fn qdsega(name: &'static str, learning: Learning) -> Variant {
    let learning = Box::new(learning);
    Variant { name, search: VariantSearch::Qdsega { learning, energy: 1.0 }, length: 1.0 }
}

fn tiny(threads: usize) -> LearningStudy {
    let rival = |name, search| Variant { name, search, length: 1.0 };
    let about = "Which is better?";
    LearningStudy {
        arena: StudyArena::new(&common::example("quadruped.urdf")).unwrap(),
        questions: vec![
            Question { name: "ways", about, variants: vec!["paper", "repaired", "locked"] },
            Question {
                name: "rivals",
                about,
                variants: vec!["repaired", "genetic", "continuous", "programs"],
            },
        ],
        variants: vec![
            qdsega("paper", Learning { search: SearchMethod::Paper, ..brief() }),
            Variant { length: 2.0, ..qdsega("repaired", brief()) },
            qdsega("locked", Learning { trunk: Trunk::Locked, ..brief() }),
            rival("genetic", VariantSearch::KeyframeGa(KeyframeStart::Seeds)),
            rival("continuous", VariantSearch::KeyframeCma(KeyframeStart::Nothing)),
            rival("programs", VariantSearch::Programs),
            qdsega("not asked for", Learning { states: 0, ..brief() }),
        ],
        seeds: 2,
        seconds: 12.0,
        threads,
    }
}

/// Without what the wall clock says.
fn timeless(mut table: LearningTable) -> LearningTable {
    for row in &mut table.rows {
        row.seconds = 0.0;
        row.runs.iter_mut().for_each(|run| run.seconds = 0.0);
    }
    table
}

#[test]
fn a_study_is_reproducible_and_its_table_has_every_row() {
    let told = std::sync::Mutex::new(Vec::new());
    let tell = |done: usize, all: usize, what: &str| told.lock().unwrap().push((done, all, what.to_owned()));
    let table = timeless(run(&tiny(2), &tell).unwrap());
    let told = told.into_inner().unwrap();
    assert_eq!(told.len(), 12, "six variants with two seeds, none of them twice");
    assert!(told.iter().all(|(done, all, _)| done < all && *all == 12));
    assert_eq!(timeless(run(&tiny(1), &|_, _, _| {}).unwrap()), table);

    let names: Vec<_> = table.rows.iter().map(|row| (row.question.as_str(), row.variant.as_str())).collect();
    assert_eq!(
        names,
        [
            ("ways", "paper"),
            ("ways", "repaired"),
            ("ways", "locked"),
            ("rivals", "repaired"),
            ("rivals", "genetic"),
            ("rivals", "continuous"),
            ("rivals", "programs")
        ]
    );
    assert_eq!(table.rows[1].runs, table.rows[3].runs);
    assert!((table.task.speed.powi(2) - FROUDE * 9.81 * hip_height()).abs() < 1e-9);
    for row in &table.rows {
        assert_eq!(row.runs.iter().map(|run| run.seed).collect::<Vec<_>>(), [1, 2]);
        let least = if row.variant == "repaired" { 24.0 } else { 12.0 };
        for run in &row.runs {
            assert!(run.simulated_seconds >= least, "{}: {} s", row.variant, run.simulated_seconds);
            assert!(run.course.windows(2).all(|pair| pair[0][0] <= pair[1][0]), "time goes on");
            assert!(run.course.iter().all(|[at, cost]| *at <= run.simulated_seconds && cost.is_finite()));
            let last = run.course.last().map(|[_, cost]| *cost);
            assert_eq!(run.best.as_ref().map(|best| best.natural_cost), last);
            assert_eq!(
                run.cache_hit_rate.is_some(),
                ["paper", "repaired", "locked"].contains(&&*row.variant)
            );
        }
        // What starts from force templates tries those first, for which nothing is drawn, and may find nothing better.
        let seeded = ["genetic", "programs"].contains(&&*row.variant);
        let same = row.runs[0].course == row.runs[1].course;
        assert!(seeded || !same, "{}: another seed is another run", row.variant);
        let gaits: usize = row.gaits.values().sum();
        assert_eq!((row.found, gaits), (row.runs.iter().filter(|run| run.best.is_some()).count(), row.found));
    }
    // What force templates start from walks at once; what starts from nothing does not in twelve seconds.
    let cost = |variant: &str| {
        let row = table.rows.iter().find(|row| row.variant == variant).unwrap();
        row.natural_cost.median.unwrap_or(f64::INFINITY)
    };
    assert!(cost("programs") < cost("continuous"), "{} and {}", cost("programs"), cost("continuous"));

    let text = table.to_csv();
    let mut lines = csv::Reader::from_reader(text.as_bytes());
    let columns = lines.headers().unwrap().clone();
    assert_eq!(
        (&columns[0], &columns[4], &columns[columns.len() - 1]),
        ("question", "natural_cost", "seconds")
    );
    assert_eq!(lines.records().map(Result::unwrap).filter(|line| line.len() == columns.len()).count(), 7);
    let document = serde_json::to_value(&table).unwrap();
    assert_eq!(document["format"], "gaitwright/learning-study@1");
    assert_eq!(serde_json::from_value::<LearningTable>(document).unwrap(), table);
}

fn hip_height() -> f64 {
    StudyArena::new(&common::example("quadruped.urdf")).unwrap().subject.legs.hip_height
}

#[test]
fn a_character_without_legs_is_not_studied() {
    assert!(StudyArena::new(&common::example("snake.json")).is_none());
}

#[test]
fn every_question_is_answered_by_variants_that_differ() {
    let (questions, variants) = (questions(), variants());
    for (index, variant) in variants.iter().enumerate() {
        assert!(
            questions.iter().any(|question| question.variants.contains(&variant.name)),
            "{}",
            variant.name
        );
        for other in &variants[..index] {
            assert_ne!(variant.name, other.name);
            let same = variant.search == other.search && variant.length == other.length;
            assert!(!same, "{} is {}", variant.name, other.name);
        }
        if let VariantSearch::Qdsega { learning, .. } = &variant.search {
            assert_eq!(learning.faults(), []);
        }
    }
    for question in &questions {
        assert!(question.variants.len() >= 2);
        for name in &question.variants {
            assert!(variants.iter().any(|variant| variant.name == *name), "{name} in {}", question.name);
        }
    }
    let repairs = questions.iter().find(|question| question.name == "repairs").unwrap();
    let one_left_out = variants.iter().filter(|variant| {
        let VariantSearch::Qdsega { learning, .. } = &variant.search else { return false };
        let left = std::collections::BTreeSet::from(learning.repairs).len();
        repairs.variants.contains(&variant.name) && left + 1 == Repair::ALL.len()
    });
    assert_eq!(one_left_out.count(), Repair::ALL.len());
    assert_ne!(Repairs::default(), Repairs::NONE);
}

#[test]
fn medians_and_ranges_are_those_of_the_runs() {
    let of = |values: &[Option<f64>]| {
        let MedianRange { median, least, greatest } = MedianRange::of(values.iter().copied());
        [median, least, greatest]
    };
    assert_eq!(of(&[Some(3.0), Some(1.0), Some(2.0)]), [Some(2.0), Some(1.0), Some(3.0)]);
    assert_eq!(of(&[None, Some(1.0), Some(2.0)]), [Some(2.0), Some(1.0), None]);
    assert_eq!(of(&[None, Some(1.0), None]), [None, Some(1.0), None]);
    assert_eq!(of(&[]), [None; 3]);
    let judged = |seed: u64, course: &[[f64; 2]]| JudgedRun {
        seed,
        best: course.last().map(|[_, natural_cost]| JudgedMotion {
            natural_cost: *natural_cost,
            speed: 1.0,
            cost_of_transport: None,
            gait: Some("trot".into()),
            stride_period: None,
            natural: seed == 1,
            upright_seconds: 20.0,
        }),
        course: course.to_vec(),
        simulated_seconds: 50.0,
        saved_seconds: 0.0,
        cache_hit_rate: None,
        seconds: 1.0,
    };
    let runs =
        vec![judged(1, &[[1.0, 9.0], [5.0, 3.0]]), judged(2, &[[2.0, 8.0], [20.0, 4.0]]), judged(3, &[])];
    let row = VariantRow::new("question", "variant", runs);
    assert_eq!((row.found, row.natural, row.gaits["trot"]), (2, 1, 2));
    assert_eq!(row.natural_cost, MedianRange { median: Some(4.0), least: Some(3.0), greatest: None });
    assert_eq!(row.cost_after(0.5).least, None);
    assert_eq!(row.cost_after(2.0), MedianRange { median: Some(9.0), least: Some(8.0), greatest: None });
    assert_eq!(row.cost_after(10.0), MedianRange { median: Some(8.0), least: Some(3.0), greatest: None });
}
