//! Covariance matrix adaptation: an evolution strategy for some dozens of continuous parameters.
//!
//! The strategy of Hansen 2016, "The CMA Evolution Strategy: A Tutorial" (arXiv 1604.00772), with its default
//! parameters. At first candidates may come in pairs on opposite sides of the mean (Brockhoff et al. 2010, "Mirrored Sampling and
//! Sequential Selection for Evolution Strategies"): one of the two goes the right way. It asks for candidates and is told their costs; who evaluates
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
    /// Of the candidates by rank: of parents above 0 with the sum 1, of all others below 0.
    weights: Vec<f64>,
    candidates: usize,
    generation: u32,
    /// Generations in which candidates come in pairs.
    paired: u32,
    rng: ChaCha8Rng,
}

impl Cma {
    /// Searches around `mean` at first, `sigma` in each direction, with `candidates` (at least 4) a generation.
    pub fn new(mean: &[f64], sigma: f64, candidates: usize, seed: u64) -> Self {
        let n = mean.len();
        Self {
            mean: DVector::from_column_slice(mean),
            sigma,
            covariance: DMatrix::identity(n, n),
            scales: DVector::from_element(n, 1.0),
            axes: DMatrix::identity(n, n),
            path_sigma: DVector::zeros(n),
            path_covariance: DVector::zeros(n),
            weights: weights(candidates, n as f64),
            candidates,
            generation: 0,
            paired: 0,
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// The same with candidates in pairs in the first so many generations; to be called before the first [`ask`](Self::ask). That gets
    /// on sooner, but both of a pair may become parents, whose steps cancel out: the reach shrinks faster than it should, which ends a
    /// long search too soon.
    #[must_use]
    pub fn paired(self, generations: u32) -> Self {
        Self { paired: generations, ..self }
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
        let mut asked = Vec::with_capacity(self.candidates + 1);
        while asked.len() < self.candidates {
            let normal = DVector::from_fn(self.mean.len(), |_, _| gaussian(&mut self.rng));
            let step = &self.axes * self.scales.component_mul(&normal) * self.sigma;
            asked.push((&self.mean + &step).as_slice().to_vec());
            if self.generation < self.paired {
                asked.push((&self.mean - &step).as_slice().to_vec());
            }
        }
        asked.truncate(self.candidates);
        asked
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
            .map(|&index| (DVector::from_column_slice(&candidates[index]) - &self.mean) / self.sigma)
            .collect();
        let parents = &self.weights[..self.candidates / 2];
        let step: DVector<f64> = steps.iter().zip(parents).map(|(step, weight)| step * *weight).sum();

        let effective = effective(parents);
        let rate_sigma = (effective + 2.0) / (n + effective + 5.0);
        let damping = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + rate_sigma;
        let rate_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let [rate_one, rate_mu] = rates(n, effective);
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
        self.covariance *= 1.0 + rate_one * lost - rate_one - rate_mu * self.weights.iter().sum::<f64>();
        self.covariance.ger(rate_one, &self.path_covariance, &self.path_covariance, 1.0);
        for (step, &weight) in steps.iter().zip(&self.weights) {
            // What is taken away in a direction must not be more than there is.
            let length = || self.axes.tr_mul(step).component_div(&self.scales).norm_squared();
            let weight = if weight < 0.0 { weight * n / length().max(f64::MIN_POSITIVE) } else { weight };
            self.covariance.ger(rate_mu * weight, step, step, 1.0);
        }
        self.sigma *= ((rate_sigma / damping) * (length / expected - 1.0)).min(1.0).exp();

        let eigen = SymmetricEigen::new(self.covariance.clone());
        self.scales = eigen.eigenvalues.map(|value| value.max(1e-20).sqrt());
        self.axes = eigen.eigenvectors;
    }
}

/// Weights of so many candidates by rank, for `n` parameters (Hansen 2016, equations 49 to 53).
fn weights(candidates: usize, n: f64) -> Vec<f64> {
    let raw = |rank: usize| (0.5 * (candidates as f64 + 1.0)).ln() - (rank as f64).ln();
    let (parents, others): (Vec<f64>, Vec<f64>) = (1..=candidates).map(raw).partition(|weight| *weight > 0.0);
    let sum = |weights: &[f64]| weights.iter().sum::<f64>().abs().max(f64::MIN_POSITIVE);
    let (positive, negative) = (effective(&parents), effective(&others));
    let [rate_one, rate_mu] = rates(n, positive);
    let most = (1.0 + rate_one / rate_mu)
        .min(1.0 + 2.0 * negative / (positive + 2.0))
        .min((1.0 - rate_one - rate_mu) / (n * rate_mu));
    let (all, against) = (sum(&parents), sum(&others));
    parents
        .iter()
        .map(|weight| weight / all)
        .chain(others.iter().map(|weight| most * weight / against))
        .collect()
}

/// How many candidates of equal weight would scatter as much as those with these `weights`.
fn effective(weights: &[f64]) -> f64 {
    weights.iter().sum::<f64>().powi(2) / weights.iter().map(|weight| weight * weight).sum::<f64>()
}

/// How much of the covariance comes from the path and from the last generation, for `n` parameters and so many effective
/// parents.
fn rates(n: f64, effective: f64) -> [f64; 2] {
    let one = 2.0 / ((n + 1.3).powi(2) + effective);
    let mu = 2.0 * (0.25 + effective + 1.0 / effective - 2.0) / ((n + 2.0).powi(2) + effective);
    [one, mu.min(1.0 - one)]
}

/// A standard normal number (Box & Muller 1958).
fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    // 1 − u lies in (0, 1], where the logarithm is finite.
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
