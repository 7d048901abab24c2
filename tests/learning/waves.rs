//! Waves along a body without legs: their angles against differences, their mirror image, what drives them, and what an exact
//! solver makes of them.

use std::sync::Arc;

use gaitwright_learning::learn::Task;
use gaitwright_learning::program::gaits::{named, ways};
use gaitwright_learning::program::ring::Wanted;
use gaitwright_learning::program::seeds::Seed;
use gaitwright_learning::program::subject::Subject;
use gaitwright_learning::training::check_task;
use gaitwright_physics::character::read_file;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Scene, SolverChoice, SolverKind};
use gaitwright_physics::stance::Stance;
use serde_json::{Value, json};

const GRAVITY: f64 = 9.81;

/// Sweeps instead of an exact solution.
fn swept(iterations: u32, tolerance: f64) -> Accuracy {
    Accuracy {
        step: 0.004,
        solver: SolverChoice { kind: SolverKind::Pgs, iterations, tolerance },
        ..Accuracy::default()
    }
}

/// The bundled snake, each of its links with this friction of its own if any, that is to go along `direction`.
fn snake(friction: Option<Value>, direction: [f64; 3], accuracy: Accuracy) -> Subject {
    let text = std::fs::read_to_string(crate::common::example_path("snake.json")).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    for link in document["links"].as_array_mut().unwrap() {
        if let Some(friction) = &friction {
            link["friction"] = friction.clone();
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("snake.json");
    std::fs::write(&path, document.to_string()).unwrap();
    let reading = read_file(&path, Default::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    Subject::new(&model, &stance, &scene, &accuracy, direction).unwrap()
}

fn wanted(subject: &Subject, name: &str) -> Wanted {
    Wanted::at_froude(&subject.legs, named(name, &subject.legs).unwrap(), 0.05, GRAVITY)
}

/// Speeds along the direction that the seeds of the waves called `name` reach, m/s.
fn speeds(subject: &Subject, name: &str) -> Vec<f64> {
    let (wanted, arena) = (wanted(subject, name), subject.arena().unwrap());
    let seeds = subject.seeds(&wanted.gait);
    let speed = |seed: &Seed| {
        let (ring, gains) = subject.ring(&wanted, &seed.parameters);
        let figures = arena.run(&ring, &gains, 4);
        assert_eq!(figures.upright, 1.0);
        figures.speed
    };
    seeds.iter().map(speed).collect()
}

fn greatest(speeds: &[f64]) -> f64 {
    speeds.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn waves_lead_along_the_way_that_the_body_points_to_or_across_it() {
    let names = |direction| -> Vec<&str> {
        let subject = snake(None, direction, Accuracy::default());
        ways(&subject.legs).iter().map(|gait| gait.name).collect()
    };
    assert_eq!(names([1.0, 0.0, 0.0]), ["undulation", "crawling"]);
    assert_eq!(names([0.0, 1.0, 0.0]), ["sidewinding"]);
}

#[test]
fn a_task_can_name_a_wave_that_leads_its_way_and_no_other() {
    let Subject { model, stance, scene, .. } = snake(None, [1.0, 0.0, 0.0], Accuracy::default());
    let asked = |gait: &str, direction| {
        check_task(&Task { gait: gait.into(), direction, ..Task::default() }, &model, &stance, &scene)
    };
    assert!(asked("undulation", [1.0, 0.0, 0.0]).is_ok());
    assert!(asked("sidewinding", [0.0, 1.0, 0.0]).is_ok());
    for gait in ["sidewinding", "walk"] {
        let error = asked(gait, [1.0, 0.0, 0.0]).unwrap_err().to_string();
        assert!(error.contains("/task/gait") && error.contains("undulation, crawling"), "{error}");
    }
}

#[test]
fn the_rates_of_a_wave_are_those_of_its_angles() {
    let subject = snake(None, [0.0, 1.0, 0.0], Accuracy::default());
    let wanted = wanted(&subject, "sidewinding");
    for Seed { parameters, .. } in subject.seeds(&wanted.gait) {
        let (ring, _) = subject.ring(&wanted, &parameters);
        let duration = ring.transition_time();
        let count = ring.cycle.len();
        for (index, posture) in ring.cycle.iter().enumerate() {
            let (before, after) =
                (&ring.cycle[(index + count - 1) % count], &ring.cycle[(index + 1) % count]);
            for (joint, rate) in posture.velocities.iter().enumerate() {
                // Of one sine wave, the difference over two of its eighths is exact but for the factor sin(π/4) / (π/4).
                let slope = (after.angles[joint] - before.angles[joint]) / (2.0 * duration);
                let sine = std::f64::consts::FRAC_PI_4;
                assert!((slope - rate * sine.sin() / sine).abs() < 1e-9, "{slope} and {rate}");
            }
        }
    }
}

#[test]
fn a_snake_sidewinds_to_either_side_before_any_search() {
    let fastest = |left: f64| {
        let subject = snake(None, [0.0, left, 0.0], swept(100, 1e-4));
        greatest(&speeds(&subject, "sidewinding"))
    };
    let (left, right) = (fastest(1.0), fastest(-1.0));
    // A fifth of the body's length a second.
    assert!(left > 0.2 * 1.1, "{left} m/s");
    // Both sides are mirror images; the waves start half a period apart, which leaves less than a stride in four of it.
    assert!((left / right - 1.0).abs() < 0.1, "{left} and {right} m/s");
}

#[test]
fn undulation_needs_skin_that_slides_more_easily_along_than_across() {
    // Hu, Nirody, Scott & Shelley 2009, PNAS 106: snakes on cloth slide along their scales at half of what it takes across them, and go
    // nowhere where both are equal.
    let fastest = |friction: Value| {
        let subject = snake(Some(friction), [1.0, 0.0, 0.0], swept(100, 1e-4));
        greatest(&speeds(&subject, "undulation"))
    };
    let scaled = fastest(json!({ "along": 0.1, "across": 0.8, "axis": [1, 0, 0] }));
    let even = fastest(json!(0.8));
    assert!(scaled > 0.2, "{scaled} m/s");
    assert!(even < 0.25 * scaled, "{even} m/s on even ground, {scaled} with scales");
}

#[test]
fn a_few_sweeps_move_a_body_as_far_as_an_exact_solver() {
    let gone = |accuracy: Accuracy| {
        let subject = snake(None, [0.0, 1.0, 0.0], accuracy);
        let wanted = wanted(&subject, "sidewinding");
        let (ring, gains) = subject.ring(&wanted, &subject.seeds(&wanted.gait)[0].parameters);
        subject.arena().unwrap().run(&ring, &gains, 3).speed
    };
    let (rough, exact) = (gone(swept(100, 1e-4)), gone(Accuracy { step: 0.004, ..Accuracy::default() }));
    // Both end their search for forces elsewhere, but the body goes the same way: within a fiftieth.
    assert!((rough / exact - 1.0).abs() < 0.02, "{rough} and {exact} m/s");
}
