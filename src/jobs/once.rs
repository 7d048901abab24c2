//! How a job comes into the queue: who posts it, and whether it may arrive more than once and is to be carried out once.

use sha2::{Digest, Sha256};

/// Longest key, characters.
const LONGEST: usize = 255;

/// What tells two arrivals of one request from two requests: the client's key, and a digest of the request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdempotencyKey {
    pub(super) key: String,
    pub(super) digest: String,
}

/// How a job comes into the queue.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Posting {
    /// Who posts it, as far as clients are told apart: callers take turns.
    pub caller: String,
    /// What it is known by if it comes again.
    pub key: Option<IdempotencyKey>,
}

/// A key that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a key is 1 to {LONGEST} visible ASCII characters")]
pub struct IdempotencyKeyError;

impl IdempotencyKey {
    /// The client's `key` for the request that consists of `pieces`.
    ///
    /// # Errors
    ///
    /// When the key is empty, too long or not of visible ASCII characters.
    pub fn new(key: &[u8], pieces: &[&[u8]]) -> Result<Self, IdempotencyKeyError> {
        let usable = (1..=LONGEST).contains(&key.len()) && key.iter().all(u8::is_ascii_graphic);
        let key = std::str::from_utf8(key).ok().filter(|_| usable).ok_or(IdempotencyKeyError)?;
        let mut digest = Sha256::new();
        for piece in pieces {
            // With its length, so that two divisions of the same bytes differ.
            digest.update((piece.len() as u64).to_le_bytes());
            digest.update(piece);
        }
        let digits: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { key: key.to_owned(), digest: format!("sha256:{digits}") })
    }

    /// The same key as it is `caller`'s: another caller may choose the same.
    #[must_use]
    pub fn of(self, caller: &str) -> Self {
        // No key contains a space.
        let key = if caller.is_empty() { self.key } else { format!("{caller} {}", self.key) };
        Self { key, ..self }
    }
}
