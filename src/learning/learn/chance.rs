//! Split randomness: every decision draws from a stream of its own.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What a stream is drawn for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Making an individual's genome.
    Breeding,
    /// An individual's episodes.
    Episodes,
}

/// The stream of one individual in one generation. Different arguments give different ChaCha8 keys,
/// so no order of evaluation can shift what an individual draws.
pub fn stream(seed: u64, purpose: Purpose, generation: u32, island: usize, individual: usize) -> ChaCha8Rng {
    let what = (purpose as u64) << 32 | u64::from(generation);
    let mut key = [0; 32];
    for (bytes, word) in key.chunks_exact_mut(8).zip([seed, what, island as u64, individual as u64]) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    ChaCha8Rng::from_seed(key)
}
