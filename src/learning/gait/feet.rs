//! Feet: which of the links that carry a character stand together on one leg.

use gaitwright_physics::model::Model;

/// The feet of a character that stands on the links `support`: of each its links, the one nearest to the trunk first. What stands on
/// a body that another foot carries is part of that foot: a toe.
///
/// Where the root itself carries the character (a snake's) every link stands alone.
pub(crate) fn feet(model: &Model, support: &[usize]) -> Vec<Vec<usize>> {
    let body = |link: usize| model.links.get(link).map_or(0, |place| place.body);
    if support.iter().any(|&link| body(link) == 0) {
        return support.iter().map(|&link| vec![link]).collect();
    }
    // Bodies come after those that carry them.
    let mut links = support.to_vec();
    links.sort_by_key(|&link| (body(link), link));
    let mut feet: Vec<Vec<usize>> = Vec::new();
    for link in links {
        let carried = |foot: &&mut Vec<usize>| carries(model, body(foot[0]), body(link));
        match feet.iter_mut().find(carried) {
            Some(foot) => foot.push(link),
            None => feet.push(vec![link]),
        }
    }
    // In the order of `support`, in which those with the same phases are compared.
    feet.sort_by_key(|foot| support.iter().position(|link| *link == foot[0]));
    feet
}

/// Whether `body` is `other`, or carries it.
fn carries(model: &Model, body: usize, other: usize) -> bool {
    let mut place = other;
    while place > body {
        place = model.bodies[place].parent;
    }
    place == body
}
