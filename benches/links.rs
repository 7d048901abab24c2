//! What a step costs as a chain grows: nanoseconds per step and per link, and the slope of time over links
//! in a double logarithmic plot, which is 1 where the work grows with the number of links. A long chain that whirls
//! moves faster at its ends, so that its velocities are found more often in a step; the slope of the time of finding them
//! once stands beside.

mod common;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Feedforward, Gains, Scene, StepPlan};
use gaitwright_physics::sim::{Command, Simulator, State};

const LINKS: [usize; 7] = [5, 10, 20, 50, 100, 200, 500];

/// s.
const STEP: f64 = 0.001;

/// A chain and what it does.
struct Case {
    name: &'static str,
    model: fn(usize) -> Arc<Model>,
    /// Height of the root, m.
    height: f64,
    /// Angle at the start of every joint, rad.
    bend: f64,
    /// Rate at the start of every joint, rad/s.
    rate: f64,
    /// Springs that hold the joints, N m/rad; without them the joints are passive.
    stiffness: f64,
}

const CASES: [Case; 3] = [
    Case {
        name: "hanging, bolted at one end",
        model: |links| common::chain(links, None, true),
        height: 0.0,
        bend: 0.05,
        rate: 0.0,
        stiffness: 0.0,
    },
    Case {
        name: "whirling in the air",
        model: |links| common::chain(links, None, false),
        height: 100.0,
        bend: 0.05,
        rate: 0.1,
        stiffness: 0.0,
    },
    Case {
        name: "lying on five balls, held by springs",
        model: |links| common::chain(links, Some(links.div_ceil(4).min(links - 1)), false),
        height: 0.05,
        bend: 0.0,
        rate: 0.0,
        stiffness: 100.0,
    },
];

/// What a chain of some links takes.
struct Cost {
    links: usize,
    /// Nanoseconds a step.
    time: f64,
    /// How often new velocities are found in a step.
    evaluations: f64,
}

fn cost(case: &Case, links: usize) -> Cost {
    let model = (case.model)(links);
    let joints = model.joint_count();
    let gains = Gains {
        stiffness: vec![case.stiffness; joints],
        damping: vec![0.05 * case.stiffness; joints],
        max_torque: vec![None; joints],
        feedforward: Feedforward::None,
        ..Gains::default()
    };
    let accuracy = Accuracy { step: STEP, ..Accuracy::default() };
    let plan = StepPlan::compile(&Scene::default(), &accuracy, Some(&gains), &model).expect("a sound plan");
    let mut state = State::new(&model);
    state.root.position.z = case.height;
    state.angles.fill(case.bend);
    state.velocities.fill(case.rate);
    let targets = vec![state.angles.clone(); 51];
    let rounds = if common::measuring() { 2_000 / links + 20 } else { 1 };
    let mut simulator = Simulator::new(Arc::new(plan), state);
    let time = common::nanoseconds(&simulator, &targets, rounds);
    for pair in targets.windows(2) {
        simulator.step(Command::Track { now: &pair[0], next: &pair[1] }).expect("a step");
    }
    let evaluations = simulator.evaluations() as f64 / (targets.len() - 1) as f64;
    Cost { links, time, evaluations }
}

/// Slope of the line of least squares through the logarithms of `points`.
fn slope(points: &[(usize, f64)]) -> f64 {
    let logarithms: Vec<[f64; 2]> =
        points.iter().map(|(links, time)| [(*links as f64).ln(), time.ln()]).collect();
    let count = logarithms.len() as f64;
    let mean = |axis: usize| logarithms.iter().map(|point| point[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let above: f64 = logarithms.iter().map(|point| (point[0] - x) * (point[1] - y)).sum();
    let below: f64 = logarithms.iter().map(|point| (point[0] - x).powi(2)).sum();
    above / below
}

fn main() {
    for case in CASES {
        println!("{}", case.name);
        println!("{:>8} {:>12} {:>12} {:>12}", "links", "ns per step", "evaluations", "ns per link");
        let costs = LINKS.map(|links| cost(&case, links));
        for Cost { links, time, evaluations } in &costs {
            println!("{links:>8} {time:>12.0} {evaluations:>12.2} {:>12.1}", time / *links as f64);
        }
        let steps = costs.each_ref().map(|cost| (cost.links, cost.time));
        let each = costs.each_ref().map(|cost| (cost.links, cost.time / cost.evaluations));
        for (what, points) in [("step", steps), ("evaluation", each)] {
            println!(
                "slope of the time of one {what}: {:.2} over all, {:.2} from 50 links on",
                slope(&points),
                slope(&points[3..])
            );
        }
        println!();
    }
}
