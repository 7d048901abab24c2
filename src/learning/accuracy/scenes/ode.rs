//! The classical Runge-Kutta method of fourth order, for equations of motion without a closed solution.

/// Longest step, s. With rates of the order of 10 per second the error of a step is near 1e-20.
const LONGEST: f64 = 5e-5;

/// Integrates y' = `rate`(y) from `start` at time 0; returns y at each of the ascending `times`, s.
pub fn followed<const N: usize>(
    rate: impl Fn(&[f64; N]) -> [f64; N],
    start: [f64; N],
    times: &[f64],
) -> Vec<[f64; N]> {
    let (mut y, mut now) = (start, 0.0);
    let mut reached = Vec::with_capacity(times.len());
    for &time in times {
        let steps = ((time - now) / LONGEST).ceil().max(1.0);
        let step = (time - now) / steps;
        for _ in 0..steps as usize {
            y = stepped(&rate, &y, step);
        }
        now = time;
        reached.push(y);
    }
    reached
}

fn stepped<const N: usize>(rate: impl Fn(&[f64; N]) -> [f64; N], y: &[f64; N], step: f64) -> [f64; N] {
    let along = |slope: &[f64; N], part: f64| std::array::from_fn(|i| y[i] + part * step * slope[i]);
    let first = rate(y);
    let second = rate(&along(&first, 0.5));
    let third = rate(&along(&second, 0.5));
    let fourth = rate(&along(&third, 1.0));
    std::array::from_fn(|i| y[i] + step / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i]))
}
