//! Motions found another way: Lagrange's equations of planar chains and Euler's of a rigid body, in
//! coordinates of their own, integrated by the classical Runge-Kutta method.

use nalgebra::{DMatrix, DVector, Quaternion, UnitQuaternion, Vector3};

use super::bodies::Bar;

pub const GRAVITY: f64 = 9.81;

/// Step of the Runge-Kutta method, s: its error is of the order of rounding on the scenes here.
const STEP: f64 = 2e-4;

/// `y` after `seconds` under y' = `slope`(t, y).
pub fn integrate(
    mut y: DVector<f64>,
    seconds: f64,
    slope: impl Fn(f64, &DVector<f64>) -> DVector<f64>,
) -> DVector<f64> {
    let count = (seconds / STEP).round();
    let h = seconds / count;
    for index in 0..count as usize {
        let t = index as f64 * h;
        let k1 = slope(t, &y);
        let k2 = slope(t + 0.5 * h, &(&y + &k1 * (0.5 * h)));
        let k3 = slope(t + 0.5 * h, &(&y + &k2 * (0.5 * h)));
        let k4 = slope(t + h, &(&y + &k3 * h));
        y += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    y
}

/// A planar chain in the angles θ of its bars against the vertical:
/// Σⱼ Cᵢⱼ (cos(θᵢ − θⱼ) θ̈ⱼ + sin(θᵢ − θⱼ) θ̇ⱼ²) + g wᵢ sin θᵢ = moment on bar i.
pub struct Chain {
    pub coupling: DMatrix<f64>,
    /// First moment of the weight that each bar carries, kg m.
    pub weight: DVector<f64>,
}

impl Chain {
    /// A chain that hangs from the world.
    pub fn hanging(bars: &[Bar]) -> Self {
        let arm = |body: usize, bar: usize| match bar.cmp(&body) {
            std::cmp::Ordering::Less => bars[bar].length,
            std::cmp::Ordering::Equal => bars[bar].center,
            std::cmp::Ordering::Greater => 0.0,
        };
        let count = bars.len();
        let coupling = DMatrix::from_fn(count, count, |i, j| {
            let own = if i == j { bars[i].inertia } else { 0.0 };
            own + (0..count).map(|body| bars[body].mass * arm(body, i) * arm(body, j)).sum::<f64>()
        });
        let weight =
            DVector::from_fn(count, |i, _| (0..count).map(|body| bars[body].mass * arm(body, i)).sum());
        Self { coupling, weight }
    }

    /// Two bars that fly: relative to their common centre of mass they move as one reduced mass would.
    pub fn flying(bars: &[Bar; 2]) -> Self {
        let [first, second] = bars;
        let reduced = first.mass * second.mass / (first.mass + second.mass);
        let arms = [first.length - first.center, second.center];
        let coupling = DMatrix::from_fn(2, 2, |i, j| {
            reduced * arms[i] * arms[j] + if i == j { bars[i].inertia } else { 0.0 }
        });
        Self { coupling, weight: DVector::zeros(2) }
    }

    /// θ̈ under the moments that the joints exert, where joint i turns bar i against bar i − 1.
    pub fn accelerate(&self, angles: &[f64], rates: &[f64], torque: &[f64]) -> DVector<f64> {
        let count = angles.len();
        let mass =
            DMatrix::from_fn(count, count, |i, j| self.coupling[(i, j)] * (angles[i] - angles[j]).cos());
        let moment = DVector::from_fn(count, |i, _| {
            let whirl: f64 = (0..count)
                .map(|j| self.coupling[(i, j)] * (angles[i] - angles[j]).sin() * rates[j] * rates[j])
                .sum();
            let passed_on = torque.get(i + 1).copied().unwrap_or(0.0);
            torque[i] - passed_on - whirl - GRAVITY * self.weight[i] * angles[i].sin()
        });
        mass.lu().solve(&moment).expect("a mass matrix is regular")
    }

    /// Joint angles and rates after `seconds`, under joint torques that depend on time, angles and rates.
    pub fn swing(
        &self,
        angles: &[f64],
        rates: &[f64],
        seconds: f64,
        torque: impl Fn(f64, &[f64], &[f64]) -> Vec<f64>,
    ) -> Vec<f64> {
        let count = angles.len();
        let cumulative = |values: &[f64]| -> Vec<f64> {
            values
                .iter()
                .scan(0.0, |sum, value| {
                    *sum += value;
                    Some(*sum)
                })
                .collect()
        };
        let start =
            DVector::from_iterator(2 * count, cumulative(angles).into_iter().chain(cumulative(rates)));
        let end = integrate(start, seconds, |t, y| {
            let (angles, rates) = (&y.as_slice()[..count], &y.as_slice()[count..]);
            let torque = torque(t, &differences(angles), &differences(rates));
            let acceleration = self.accelerate(angles, rates, &torque);
            DVector::from_iterator(2 * count, rates.iter().copied().chain(acceleration.iter().copied()))
        });
        let (angles, rates) = (&end.as_slice()[..count], &end.as_slice()[count..]);
        differences(angles).into_iter().chain(differences(rates)).collect()
    }
}

fn differences(values: &[f64]) -> Vec<f64> {
    (0..values.len()).map(|i| if i == 0 { values[0] } else { values[i] - values[i - 1] }).collect()
}

/// Orientation of a free body after `seconds`, by Euler's equations along its principal axes.
/// `spin` is the angular velocity in the body frame.
pub fn tumble(
    orientation: UnitQuaternion<f64>,
    spin: Vector3<f64>,
    principal: Vector3<f64>,
    seconds: f64,
) -> (UnitQuaternion<f64>, Vector3<f64>) {
    let start = DVector::from_iterator(7, orientation.coords.iter().chain(spin.iter()).copied());
    let end = integrate(start, seconds, |_, y| {
        let turned = Quaternion::new(y[3], y[0], y[1], y[2]);
        let spin = Vector3::new(y[4], y[5], y[6]);
        let rate = turned * Quaternion::from_imag(spin) * 0.5;
        let change = -spin.cross(&principal.component_mul(&spin)).component_div(&principal);
        DVector::from_iterator(7, rate.coords.iter().chain(change.iter()).copied())
    });
    let turned = UnitQuaternion::new_normalize(Quaternion::new(end[3], end[0], end[1], end[2]));
    (turned, turned * Vector3::new(end[4], end[5], end[6]))
}

/// A cart that slides under Coulomb friction in +x with a bar hanging from it: x, θ, ẋ, θ̇ after `seconds`.
pub fn slide(cart: f64, bar: Bar, friction: f64, start: [f64; 4], seconds: f64) -> Vec<f64> {
    let Bar { mass, center, inertia, .. } = bar;
    let end = integrate(DVector::from_column_slice(&start), seconds, |_, y| {
        let (theta, speed, rate) = (y[1], y[2], y[3]);
        assert!(speed > 0.0, "the cart has stopped");
        let (sine, cosine) = theta.sin_cos();
        // Unknowns ẍ, θ̈ and the ground's force N: balance of forces across, along, and of moments.
        let matrix = nalgebra::Matrix3::new(
            cart + mass,
            mass * center * cosine,
            friction,
            0.0,
            mass * center * sine,
            -1.0,
            mass * center * cosine,
            inertia + mass * center * center,
            0.0,
        );
        let right = Vector3::new(
            mass * center * sine * rate * rate,
            -(cart + mass) * GRAVITY - mass * center * cosine * rate * rate,
            -mass * GRAVITY * center * sine,
        );
        let solution = matrix.lu().solve(&right).expect("the balance has one solution");
        DVector::from_column_slice(&[speed, rate, solution.x, solution.y])
    });
    end.as_slice().to_vec()
}
