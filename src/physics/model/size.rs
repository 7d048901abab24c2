//! How large a character's bodies are: the unit of length in which its simulation counts.

use super::Body;

/// Root mean square distance of the mass of `bodies` from the origin of the body that it belongs to (of the root: from its
/// centre of mass), m. Origins are the joints, so that a chain of many short links counts as small, like each of its
/// pendulums. The root is left out where it is `fixed` to the world and other bodies have mass.
pub fn size(bodies: &[Body], fixed: bool) -> f64 {
    let of = |from: usize| {
        let (mut mass, mut moment) = (0.0, 0.0);
        for (index, body) in bodies.iter().enumerate().skip(from) {
            let arm = if index == 0 { 0.0 } else { body.center.norm_squared() };
            // Half the trace of the inertia is the moment of the mass about a point.
            moment += body.mass * arm + 0.5 * body.inertia.trace();
            mass += body.mass;
        }
        (moment / mass).sqrt()
    };
    let usable = |size: &f64| size.is_finite() && *size > 0.0;
    [of(usize::from(fixed)), of(0)].into_iter().find(usable).unwrap_or(1.0)
}
