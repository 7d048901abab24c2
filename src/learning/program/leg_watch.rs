//! What is seen of one leg while a gait is simulated.

use std::f64::consts::{FRAC_PI_2, TAU};

/// What was seen of one leg.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LegFigures {
    /// Share of the stride for which it stood.
    pub duty: f64,
    /// Touch-down, a circular mean over the strides, parts of a stride.
    pub phase: f64,
    /// How much strides alternate between short and long ones: the standard deviation of their times, parts of a stride. A gait
    /// that is still growing into itself has little of it.
    pub spread: f64,
    /// Peak of its force over that of a half-sine with the same mean and duty factor.
    pub peak: f64,
    /// Extension in the middle of the stance, mean over the stances: a share of its greatest.
    pub extension: f64,
    /// Greatest height of the foot in the swing, mean over the swings, over the hip height.
    pub clearance: f64,
}

/// How a leg is watched.
#[derive(Debug, Clone, Copy)]
pub(super) struct LegRule {
    /// Force above which a foot stands, N.
    pub threshold: f64,
    /// Steps of the shortest swing and the shortest stance; what is shorter is chatter (see
    /// [`Footing`](crate::gait::Footing)).
    pub shortest: usize,
    /// What is left of the smoothed force after a step.
    pub memory: f64,
}

/// Sums over the steps for one leg.
#[derive(Debug, Clone, Default)]
pub(super) struct LegWatch {
    /// Whether it stands, for how many steps, and for how many of them it has not touched the ground since.
    down: bool,
    length: usize,
    gap: usize,
    /// Cosine and sine of the stride's phase when that stance began; `None` where that was before the judged strides.
    begun: Option<[f64; 2]>,
    /// Phase of the last touch-down, and its change since the touch-down before, parts of a stride; later is positive.
    last: Option<(f64, Option<f64>)>,
    /// Extensions seen in that stance, each with the steps from touch-down to it.
    stance: Vec<(usize, f64)>,
    /// Greatest height of the foot in the swing that has begun, over the hip height; `None` before the first.
    lift: Option<f64>,
    /// Force on the foot without impacts, N.
    smooth: f64,
    sums: Sums,
}

/// What is summed up over the judged steps.
#[derive(Debug, Clone, Default)]
struct Sums {
    /// Steps in which it stood.
    stood: usize,
    /// Of the cosine and the sine of the phases of touch-down.
    beat: [f64; 2],
    /// Of the squared changes of the time between touch-downs from one stride to the next, parts of a stride, and their number.
    alternating: f64,
    strides: f64,
    force: f64,
    /// Greatest smoothed force, N.
    peak: f64,
    /// Of the extensions in the middles of stances, and their number.
    extended: f64,
    stances: f64,
    /// Of the lifts of swings, and their number.
    lifted: f64,
    swings: f64,
}

impl LegWatch {
    /// From here on the steps are judged.
    pub(super) fn begin(&mut self) {
        (self.length, self.begun, self.last, self.lift) = (0, None, None, None);
        self.stance.clear();
        self.sums = Sums::default();
    }

    /// Takes in a step with `force` newtons on the foot at the stride's phase with this cosine and sine.
    pub(super) fn step(&mut self, force: f64, beat: [f64; 2], rule: LegRule) {
        self.smooth = rule.memory * self.smooth + (1.0 - rule.memory) * force;
        self.sums.peak = self.sums.peak.max(self.smooth);
        self.sums.force += force;
        if force > rule.threshold {
            if !self.down {
                (self.down, self.length, self.begun) = (true, 0, Some(beat));
            }
            self.length += self.gap + 1;
            self.gap = 0;
        } else if self.down {
            self.gap += 1;
            if self.gap >= rule.shortest {
                self.down = false;
                self.gap = 0;
                self.lifted(rule.shortest);
            }
        }
    }

    /// The foot has left the ground: what it stood on was a stance where it was long enough.
    fn lifted(&mut self, shortest: usize) {
        if self.length >= shortest || self.begun.is_none() {
            self.sums.stood += self.length;
            if let Some([cosine, sine]) = self.begun {
                self.sums.beat[0] += cosine;
                self.sums.beat[1] += sine;
                self.touched_down(sine.atan2(cosine) / TAU);
                if let Some(extension) = at(0.5 * self.length as f64, &self.stance) {
                    self.sums.extended += extension;
                    self.sums.stances += 1.0;
                }
                if let Some(lift) = self.lift {
                    self.sums.lifted += lift;
                    self.sums.swings += 1.0;
                }
            }
            self.lift = Some(0.0);
        }
        self.stance.clear();
    }

    /// Takes in the phase of a touch-down that began a stance, parts of a stride.
    fn touched_down(&mut self, phase: f64) {
        let wrapped = |change: f64| change - change.round();
        if let Some((last, stride)) = self.last {
            let change = wrapped(phase - last);
            if let Some(stride) = stride {
                self.sums.alternating += (change - stride).powi(2);
                self.sums.strides += 1.0;
            }
            self.last = Some((phase, Some(change)));
        } else {
            self.last = Some((phase, None));
        }
    }

    /// Takes in a look at the leg: how far it is extended, and the height of its foot over the hip height.
    pub(super) fn look(&mut self, extension: f64, height: f64) {
        if self.down {
            self.stance.push((self.length + self.gap, extension));
        } else if let Some(lift) = &mut self.lift {
            *lift = lift.max(height);
        }
    }

    /// Greatest force on the foot without impacts, N.
    pub(super) fn peak(&self) -> f64 {
        self.sums.peak
    }

    /// The figures over so many steps.
    pub(super) fn figures(&self, steps: f64) -> LegFigures {
        let Sums {
            stood,
            beat: [cosine, sine],
            alternating,
            strides,
            force,
            peak,
            extended,
            stances,
            lifted,
            swings,
        } = self.sums;
        let standing = if self.down { self.length } else { 0 };
        let duty = (stood + standing) as f64 / steps;
        let usual = force / steps * FRAC_PI_2 / duty.max(f64::MIN_POSITIVE);
        let mean = |sum: f64, count: f64| if count > 0.0 { sum / count } else { 0.0 };
        LegFigures {
            duty,
            phase: (sine.atan2(cosine) / TAU).rem_euclid(1.0),
            spread: 0.5 * mean(alternating, strides).sqrt(),
            peak: if usual > 0.0 && usual.is_finite() { peak / usual } else { 0.0 },
            extension: mean(extended, stances),
            clearance: mean(lifted, swings),
        }
    }
}

/// What was seen after so many steps: between two looks on the straight line from one to the other, outside of them the nearest. A few looks
/// have no middle one that is near enough: feet of fast gaits stand for six of them.
fn at(steps: f64, looks: &[(usize, f64)]) -> Option<f64> {
    let next = looks.partition_point(|(seen, _)| (*seen as f64) < steps);
    let (&(from, first), &(to, second)) = match looks {
        [] => return None,
        _ => (&looks[next.saturating_sub(1)], &looks[next.min(looks.len() - 1)]),
    };
    let share = if to > from { (steps - from as f64) / (to - from) as f64 } else { 0.0 };
    Some(first + share.clamp(0.0, 1.0) * (second - first))
}
