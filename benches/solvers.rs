//! Time of one solve of the four-footed contact problem (12 rows), by solver, motion and start.

#[path = "../tests/common/contacts.rs"]
mod contacts;

use contacts::{Motion, Numbers, quadruped};
use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use gaitwright_physics::sim::lcp::{Lemke, Newton, Pgs, Solver};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const ITERATIONS: u32 = 50;
const TOLERANCE: f64 = 1e-9;

/// Problems a benchmark goes round, so that it does not time one lucky case.
const PROBLEMS: usize = 32;

fn solvers() -> [(&'static str, Box<dyn Solver>); 3] {
    [
        ("pgs", Box::new(Pgs::new(ITERATIONS, TOLERANCE))),
        ("newton", Box::new(Newton::new(ITERATIONS, TOLERANCE))),
        ("lemke", Box::new(Lemke::new(500))),
    ]
}

/// A problem and a start for it.
type Case = (Numbers, Vec<f64>);

/// Cold: from zero. Warm: from the solution of a problem with velocities that differ by 2 %.
fn cases(motion: Motion, ratio: f64, cone: bool, warm: bool) -> Vec<Case> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    (0..PROBLEMS)
        .map(|_| {
            let mut numbers = quadruped(&mut rng, motion, ratio, 0.7);
            let mut start = vec![0.0; 12];
            if warm {
                Newton::new(1_000, TOLERANCE).solve(&numbers.problem(cone), &mut start);
                numbers.offset.iter_mut().for_each(|velocity| *velocity = 1.02 * *velocity + 1e-3);
            }
            (numbers, start)
        })
        .collect()
}

fn solve(criterion: &mut Criterion) {
    for (name, mut solver) in solvers() {
        let mut group = criterion.benchmark_group(name);
        for motion in [Motion::Sticking, Motion::Sliding, Motion::Opening] {
            for ratio in [1.0, 1e6] {
                for cone in [true, false] {
                    for warm in [true, false] {
                        if (cone || warm) && name == "lemke" {
                            continue;
                        }
                        let shape = if cone { "cone" } else { "pyramid" };
                        let start = if warm { "warm" } else { "cold" };
                        let case = format!("{motion:?}, mass ratio {ratio:e}, {shape}, {start}");
                        let cases = cases(motion, ratio, cone, warm);
                        let mut turn = 0;
                        group.bench_function(BenchmarkId::from_parameter(case), |bencher| {
                            bencher.iter_batched_ref(
                                || {
                                    turn = (turn + 1) % PROBLEMS;
                                    (turn, cases[turn].1.clone())
                                },
                                |(turn, lambda)| solver.solve(&cases[*turn].0.problem(cone), lambda),
                                BatchSize::SmallInput,
                            );
                        });
                    }
                }
            }
        }
        group.finish();
    }
}

criterion_group!(benches, solve);
criterion_main!(benches);
