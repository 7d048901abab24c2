//! The cubic Hermite spline between two keyframes.

/// Value at time `t` of the cubic through `from` at time 0 and `to` at time `duration`, each a pair
/// of value and rate.
///
/// Units are those of the arguments: value in rad or m, rate in its unit per second, times in s;
/// `duration` is positive. Outside `[0, duration]` the cubic is continued.
pub fn hermite(from: (f64, f64), to: (f64, f64), duration: f64, t: f64) -> f64 {
    let s = t / duration;
    let s2 = s * s;
    let s3 = s2 * s;
    let (q0, v0) = from;
    let (q1, v1) = to;
    let end = 3.0 * s2 - 2.0 * s3;
    q0 + (q1 - q0) * end + duration * (v0 * (s3 - 2.0 * s2 + s) + v1 * (s3 - s2))
}

/// Rate at time `t` of the cubic described at [`hermite`], in the value's unit per second.
pub fn hermite_rate(from: (f64, f64), to: (f64, f64), duration: f64, t: f64) -> f64 {
    let s = t / duration;
    let s2 = s * s;
    let (q0, v0) = from;
    let (q1, v1) = to;
    6.0 * (s - s2) * (q1 - q0) / duration + v0 * (3.0 * s2 - 4.0 * s + 1.0) + v1 * (3.0 * s2 - 2.0 * s)
}

/// Smallest and greatest value that the cubic described at [`hermite`] takes between its two ends.
///
/// The extremes are the values at the ends and at the roots of the cubic's derivative between them,
/// so they are exact up to rounding. Between two values inside a range of motion a spline may still
/// leave the range; this shows whether it does.
pub fn hermite_range(from: (f64, f64), to: (f64, f64), duration: f64) -> (f64, f64) {
    let (q0, v0) = from;
    let (q1, v1) = to;
    let (m0, m1, rise) = (duration * v0, duration * v1, q1 - q0);
    // dq/ds = a s² + b s + c over s = t / duration.
    let a = 3.0 * (m0 + m1 - 2.0 * rise);
    let b = 2.0 * (3.0 * rise - 2.0 * m0 - m1);
    let c = m0;
    let mut range = (q0.min(q1), q0.max(q1));
    let discriminant = b * b - 4.0 * a * c;
    if discriminant > 0.0 {
        // Of the two textbook formulas each root takes the one without cancellation; a vanishing
        // denominator gives a root that is not inside (0, 1), as it should.
        let half = -0.5 * (b + discriminant.sqrt().copysign(b));
        for s in [half / a, c / half] {
            if s > 0.0 && s < 1.0 {
                let value = hermite(from, to, duration, s * duration);
                range = (range.0.min(value), range.1.max(value));
            }
        }
    }
    range
}

/// Smallest and greatest rate of the cubic described at [`hermite`] between its two ends: those at the ends and at the
/// vertex of the rate's parabola, exact up to rounding.
pub fn hermite_rate_range(from: (f64, f64), to: (f64, f64), duration: f64) -> (f64, f64) {
    let (q0, v0) = from;
    let (q1, v1) = to;
    let mean = (q1 - q0) / duration;
    let mut range = (v0.min(v1), v0.max(v1));
    // The parabola's vertex, in parts of the duration. A straight line has none: the quotient is then not inside (0, 1).
    let vertex = (3.0 * mean - 2.0 * v0 - v1) / (6.0 * mean - 3.0 * v0 - 3.0 * v1);
    if vertex > 0.0 && vertex < 1.0 {
        let rate = hermite_rate(from, to, duration, vertex * duration);
        range = (range.0.min(rate), range.1.max(rate));
    }
    range
}
