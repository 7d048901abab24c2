//! What of a motion goes into the recording.

use gaitwright_physics::motion::Player;
use gaitwright_physics::playback::Trace;

/// Longest time between two samples of a recorded motion, s, and fewest samples of one round of its loop.
const RECORDED: f64 = 0.02;
const FEWEST: f64 = 12.0;

/// Most rounds of the loop that are recorded: those of a tiny character are short.
const ROUNDS: f64 = 60.0;

/// What is recorded of `trace`, in which `player` was played: from its start, with at most `looping` seconds of the loop.
pub(super) fn shown(trace: &Trace, player: &Player, looping: f64) -> Trace {
    let seconds = player.lead() + looping.min(ROUNDS * player.period());
    let wanted = RECORDED.min(player.period() / FEWEST);
    let interval = match trace.samples.as_slice() {
        [first, second, ..] => second.time - first.time,
        _ => wanted,
    };
    let stride = (wanted / interval).round().max(1.0) as usize;
    let samples = trace.samples.iter().take_while(|sample| sample.time <= seconds).step_by(stride);
    Trace { samples: samples.cloned().collect(), failure: trace.failure.clone(), ..*trace }
}
