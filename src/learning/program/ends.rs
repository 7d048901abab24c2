//! Where searches for leaps and for balances ended, which is where others begin.
//!
//! Numbers are in the units of the parameters in [`ring`](super::ring), costs are costs of transport.

use super::ring::{
    AIM, APART, ASIDE_LAGS, DAMPING, DUTY, EXTENSION, FOOTHOLD, FORE_DUTY, FORE_FOOTHOLD, FORE_LIFT,
    FORE_PUSH, FORE_WIDTH, HEAVE, LEAN, LIFT, PARAMETERS, PERIOD, PUSH, RETRACTION, SKEW, SPEED, STIFFNESS,
    SWAY, WIDTH,
};

/// Numbers on which searches agreed, rounded, and numbers in which they differed, with values of each: others begin at every combination
/// of these.
pub(super) struct Ends {
    agreed: &'static [(usize, f64)],
    differed: &'static [(usize, &'static [f64])],
}

/// Of five bounds of two robots (`a1` and `anymal_b`), in 180 generations each: feet stand far behind the hips, are lifted late, fore feet
/// higher than hind feet, by legs that give less force than the template says, hind legs less than fore legs, and stand for less of the
/// stride; the trunk heaves less, and the forces of fore and hind legs point toward each other. Where feet land when the trunk pitches, and
/// how much speed that costs, differs most from one body to the next.
pub(super) const LEAPS: Ends = Ends {
    agreed: &[
        (DUTY, -1.0),
        (FORE_LIFT, 1.0),
        (PUSH, -0.8),
        (FORE_PUSH, 0.8),
        (HEAVE, -0.9),
        (SKEW, 3.0),
        (STIFFNESS, -0.8),
    ],
    differed: &[
        (PERIOD, &[-2.5, -4.0]),
        (FOOTHOLD, &[-2.5, -4.5]),
        (APART, &[-1.0, 0.0, 1.0]),
        (SPEED, &[0.0, 1.5]),
        (AIM, &[1.0, 3.0]),
        (LIFT, &[-1.5, -3.5]),
    ],
};

/// Of seven canters (four of the bundled quadruped, three of `anymal_b`) that cost 0.36 to 0.43. Nine that began at [`LEAPS`] had cost 0.38
/// to 0.52.
pub(super) const CANTERS: Ends = Ends {
    agreed: &[
        (PERIOD, -3.8),
        (DUTY, -1.9),
        (FORE_DUTY, 0.5),
        (SPEED, -0.5),
        (FORE_WIDTH, -0.8),
        (FORE_PUSH, 0.3),
        (EXTENSION, -0.4),
        (HEAVE, -0.9),
        (APART, 0.3),
        (ASIDE_LAGS[0], 1.1),
        (SKEW, 3.05),
        (STIFFNESS, 0.95),
        (SWAY, -2.2),
        (AIM, 0.4),
    ],
    differed: &[
        (FOOTHOLD, &[-1.8, -4.1]),
        (LIFT, &[-1.2, -2.4]),
        (PUSH, &[-1.0, -4.2]),
        (RETRACTION, &[0.3, 1.8]),
        (DAMPING, &[0.0, -1.9]),
    ],
};

/// Of six bounds (four of the bundled quadruped, two of `anymal_b`) that cost 0.44 to 0.54. Ten that began at [`LEAPS`] had cost 0.48 to
/// 0.70; in the dearest the legs gave all the force of the template and more, and the feet stood nearer to the hips.
pub(super) const BOUNDS: Ends = Ends {
    agreed: &[
        (PERIOD, -3.6),
        (DUTY, -2.3),
        (FORE_DUTY, -0.3),
        (FORE_LIFT, 1.1),
        (PUSH, -1.5),
        (FORE_PUSH, 2.0),
        (HEAVE, -1.2),
        (SKEW, 4.8),
        (STIFFNESS, -1.7),
        (DAMPING, -0.5),
        (AIM, 1.3),
    ],
    differed: &[
        (FOOTHOLD, &[-4.5, -5.6]),
        (LIFT, &[-2.8, -4.3]),
        (RETRACTION, &[-0.4, 2.1]),
        (SPEED, &[-0.4, 0.6]),
        (APART, &[-0.3, 0.4]),
    ],
};

/// Of eight gallops (five of the bundled quadruped, three of `anymal_b`) that cost 0.57 to 0.65. Eight that began at [`LEAPS`] had cost
/// 0.62 to 0.73.
pub(super) const GALLOPS: Ends = Ends {
    agreed: &[
        (PERIOD, -2.9),
        (SPEED, 0.25),
        (FORE_FOOTHOLD, 1.2),
        (FORE_LIFT, 1.7),
        (PUSH, -1.6),
        (EXTENSION, 0.2),
        (HEAVE, -1.1),
        (LEAN, 0.4),
        (ASIDE_LAGS[0], 0.1),
        (SKEW, 4.3),
        (STIFFNESS, -2.2),
        (DAMPING, -2.0),
        (SWAY, -1.8),
    ],
    differed: &[
        (DUTY, &[-2.2, -3.4]),
        (FORE_DUTY, &[-0.7, -1.8]),
        (FOOTHOLD, &[-2.0, -3.2]),
        (LIFT, &[-0.8, -2.6]),
        (RETRACTION, &[-1.0, 0.3]),
        (AIM, &[1.2, 2.2]),
    ],
};

/// Of six searches for a walk of `bolt` on point feet, with [`STRENGTHS_OF_BALANCES`] of their feedback: short strides of wide steps, a trunk
/// that hardly heaves, soft legs. The cells of how fast the trunk leans were fifteen then.
pub(super) const BALANCES: Ends = Ends {
    agreed: &[
        (PERIOD, -2.4),
        (DUTY, 2.4),
        (SPEED, -3.5),
        (FOOTHOLD, -1.1),
        (WIDTH, 0.95),
        (HEAVE, -0.9),
        (RETRACTION, 1.9),
        (SKEW, 0.7),
        (STIFFNESS, -1.2),
        (DAMPING, -0.95),
        (AIM, -0.35),
    ],
    differed: &[
        (LIFT, &[-2.4, -0.7]),
        (EXTENSION, &[-3.0, -1.2]),
        (SWAY, &[-2.3, -4.2]),
        (LEAN, &[0.0, 1.7]),
    ],
};

/// In the order of what feedback answers to: leaning aside and how fast, leaning forward and how fast, the heading.
pub(super) const STRENGTHS_OF_BALANCES: [f64; 5] = [1.1, 0.75, 2.1, 1.3, 2.3];

impl Ends {
    /// Parameters of every combination.
    pub(super) fn combinations(&self) -> Vec<Vec<f64>> {
        let mut all = vec![parameters(self.agreed)];
        for &(index, values) in self.differed {
            let with = |own: &Vec<f64>, value: f64| {
                let mut own = own.clone();
                own[index] = value;
                own
            };
            all = all.iter().flat_map(|own| values.iter().map(|&value| with(own, value))).collect();
        }
        all
    }
}

/// Parameters with these values; all others are those of the template.
pub(super) fn parameters(values: &[(usize, f64)]) -> Vec<f64> {
    let mut parameters = vec![0.0; PARAMETERS];
    for &(index, value) in values {
        parameters[index] = value;
    }
    parameters
}
