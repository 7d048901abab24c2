//! What is seen of a motion of a niche in one continuous simulation.

use crate::check::CheckedMotion;
use crate::program::gaits::NamedGait;
use crate::training::motion::LearnedMotion;
use crate::training::shared::Shared;

/// What was seen of a motion in one continuous simulation.
pub(super) struct Judged {
    pub(super) checked: CheckedMotion,
    /// Whether it is natural and goes by the name of its niche's gait.
    pub(super) natural: bool,
}

impl Judged {
    pub(super) fn stood(&self) -> bool {
        self.checked.trace.fell_at.is_none()
    }

    /// s that were simulated.
    pub(super) fn seconds(&self) -> f64 {
        self.checked.trace.samples.last().map_or(0.0, |sample| sample.time)
    }
}

/// Simulates `motion`. Which variant of `gait` it is matters unless the task asks for the gait, whichever way it goes.
pub(super) fn judge(shared: &Shared<'_>, gait: &NamedGait, motion: &LearnedMotion) -> Option<Judged> {
    let player = motion.player(&shared.setup.stance.angles);
    let check = motion.check(shared.setup, &player);
    let stopped = || shared.stop.check().is_err();
    let checked = check.run(&stopped).ok().filter(|_| !stopped())?;
    let named = checked.gait.gait.as_deref();
    let any_variant = shared.setup.task.gait == gait.gait;
    let same_variant = any_variant || checked.gait.variant.as_deref() == gait.variant;
    let as_wanted = named.is_none() || (named == Some(gait.gait) && same_variant);
    let natural = checked.gait.natural && as_wanted;
    Some(Judged { checked, natural })
}
