//! Covariance matrix adaptation: an evolution strategy for some dozens of continuous parameters.
//!
//! The strategy of Hansen 2016, "The CMA Evolution Strategy: A Tutorial" (arXiv 1604.00772), with its default
//! parameters and without negative weights. It asks for candidates and is told their costs; who evaluates
//! them, and on how many threads, is not its affair, so its result depends on seed and costs alone.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The state of a search.
#[derive(Debug, Clone)]
pub struct Cma {
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    /// Square root of the covariance's eigenvalues, and its eigenvectors.
    scales: DVector<f64>,
    axes: DMatrix<f64>,
    path_sigma: DVector<f64>,
    path_covariance: DVector<f64>,
    weights: Vec<f64>,
    candidates: usize,
    generation: u32,
    rng: ChaCha8Rng,
}

impl Cma {
    /// Searches around `mean` at first, `sigma` in each direction, with `candidates` (at least 4) a generation.
    pub fn new(mean: &[f64], sigma: f64, candidates: usize, seed: u64) -> Self {
        let n = mean.len();
        let parents = candidates / 2;
        let raw = (1..=parents).map(|rank| (parents as f64 + 0.5).ln() - (rank as f64).ln());
        let sum: f64 = raw.clone().sum();
        Self {
            mean: DVector::from_column_slice(mean),
            sigma,
            covariance: DMatrix::identity(n, n),
            scales: DVector::from_element(n, 1.0),
            axes: DMatrix::identity(n, n),
            path_sigma: DVector::zeros(n),
            path_covariance: DVector::zeros(n),
            weights: raw.map(|weight| weight / sum).collect(),
            candidates,
            generation: 0,
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// The middle of the search.
    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    /// How far the search reaches at present.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The candidates of the next generation.
    pub fn ask(&mut self) -> Vec<Vec<f64>> {
        (0..self.candidates)
            .map(|_| {
                let normal = DVector::from_fn(self.mean.len(), |_, _| gaussian(&mut self.rng));
                let step = &self.axes * self.scales.component_mul(&normal);
                (&self.mean + step * self.sigma).as_slice().to_vec()
            })
            .collect()
    }

    /// Takes in the costs of the candidates of the last [`Cma::ask`], in their order. A cost that is not a
    /// number ranks last.
    pub fn tell(&mut self, candidates: &[Vec<f64>], costs: &[f64]) {
        let n = self.mean.len() as f64;
        let mut order: Vec<usize> = (0..candidates.len()).collect();
        let key = |index: usize| if costs[index].is_nan() { f64::INFINITY } else { costs[index] };
        order.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
        let steps: Vec<DVector<f64>> = order
            .iter()
            .take(self.weights.len())
            .map(|&index| (DVector::from_column_slice(&candidates[index]) - &self.mean) / self.sigma)
            .collect();
        let step: DVector<f64> = steps.iter().zip(&self.weights).map(|(step, weight)| step * *weight).sum();

        let effective = 1.0 / self.weights.iter().map(|weight| weight * weight).sum::<f64>();
        let rate_sigma = (effective + 2.0) / (n + effective + 5.0);
        let damping = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + rate_sigma;
        let rate_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let rate_one = 2.0 / ((n + 1.3).powi(2) + effective);
        let rate_mu =
            (2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0).powi(2) + effective)).min(1.0 - rate_one);
        let expected = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));

        self.mean += &step * self.sigma;
        self.generation += 1;
        let whitened = &self.axes * (self.axes.tr_mul(&step)).component_div(&self.scales);
        self.path_sigma = &self.path_sigma * (1.0 - rate_sigma)
            + whitened * (rate_sigma * (2.0 - rate_sigma) * effective).sqrt();
        let length = self.path_sigma.norm();
        let settled = (1.0 - (1.0 - rate_sigma).powi(2 * self.generation as i32)).sqrt();
        let moving = f64::from(u8::from(length / settled < (1.4 + 2.0 / (n + 1.0)) * expected));
        self.path_covariance = &self.path_covariance * (1.0 - rate_path)
            + &step * (moving * (rate_path * (2.0 - rate_path) * effective).sqrt());
        let lost = (1.0 - moving) * rate_path * (2.0 - rate_path);
        self.covariance *= 1.0 + rate_one * lost - rate_one - rate_mu;
        self.covariance.ger(rate_one, &self.path_covariance, &self.path_covariance, 1.0);
        for (step, weight) in steps.iter().zip(&self.weights) {
            self.covariance.ger(rate_mu * weight, step, step, 1.0);
        }
        self.sigma *= ((rate_sigma / damping) * (length / expected - 1.0)).min(1.0).exp();

        let eigen = SymmetricEigen::new(self.covariance.clone());
        self.scales = eigen.eigenvalues.map(|value| value.max(1e-20).sqrt());
        self.axes = eigen.eigenvectors;
    }
}

/// A standard normal number (Box & Muller 1958).
fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    // 1 − u lies in (0, 1], where the logarithm is finite.
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
