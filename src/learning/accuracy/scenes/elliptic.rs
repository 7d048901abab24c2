//! Jacobi's elliptic functions by the arithmetic-geometric mean.

/// Sine, cosine and delta amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jacobi {
    /// sn(u, k).
    pub sn: f64,
    /// cn(u, k).
    pub cn: f64,
    /// dn(u, k).
    pub dn: f64,
}

/// Halvings after which the mean has converged to rounding, whatever the modulus.
const ROUNDS: usize = 8;

/// The arithmetic-geometric mean of two positive numbers.
pub fn arithmetic_geometric_mean(one: f64, other: f64) -> f64 {
    let (mut a, mut b) = (one, other);
    for _ in 0..ROUNDS {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

impl Jacobi {
    /// At `u`, for the modulus 0 ≤ `k` < 1 (Abramowitz & Stegun 16.4: the amplitude by the descending scale of
    /// means).
    pub fn new(u: f64, k: f64) -> Self {
        let mut means = [(1.0, k); ROUNDS + 1];
        let mut b = (1.0 - k * k).sqrt();
        for round in 1..=ROUNDS {
            let a = means[round - 1].0;
            means[round] = (0.5 * (a + b), 0.5 * (a - b));
            b = (a * b).sqrt();
        }
        let mut amplitude = f64::from(1 << ROUNDS) * means[ROUNDS].0 * u;
        for (a, c) in means[1..].iter().rev() {
            amplitude = 0.5 * (amplitude + (c / a * amplitude.sin()).asin());
        }
        let (sn, cn) = amplitude.sin_cos();
        Self { sn, cn, dn: (1.0 - (k * sn).powi(2)).sqrt() }
    }
}
