//! How positions are corrected by the rows.

/// How much of a violation is corrected in a step.
pub(super) const SHARE_PER_STEP: f64 = 0.2;

/// The bias of a row that keeps a gap from becoming negative: with w + bias ≥ 0 the new velocities may close a gap
/// `gap` ≥ 0 within the step, but not more.
pub(super) fn gap_bias(gap: f64, step: f64) -> f64 {
    gap.max(0.0) / step
}

/// Speed at which a violated gap opens while positions move: a fifth of the violation each step, but never
/// faster than `fastest`, so that a character that starts deep in the ground rises instead of jumping.
pub(super) fn gap_recovery(gap: f64, step: f64, fastest: f64) -> f64 {
    (SHARE_PER_STEP * (-gap).max(0.0) / step).min(fastest)
}
