//! Feet: which of the links that carry a character stand together on one leg.

use crate::model::Model;

/// The feet of a character that stands on the links `support`: of each its links, the one nearest to the trunk first. What stands on
/// a body that another of them carries is part of that one's foot: a toe.
///
/// Where the root itself carries the character (a snake's) every link stands alone.
pub fn feet(model: &Model, support: &[usize]) -> Vec<Vec<usize>> {
    grouped(model, support, |link| model.links[link].body)
}

/// How many feet the bodies are that stand on the ground.
pub(super) fn count(model: &Model, standing: &[usize]) -> usize {
    grouped(model, standing, |body| body).len()
}

/// The parts that stand on the ground, each of the body that `body` gives, foot by foot, in the order of the first part of each.
fn grouped(model: &Model, parts: &[usize], body: impl Fn(usize) -> usize) -> Vec<Vec<usize>> {
    if parts.iter().any(|&part| body(part) == 0) {
        return parts.iter().map(|&part| vec![part]).collect();
    }
    // Bodies come after those that carry them.
    let mut outward = parts.to_vec();
    outward.sort_by_key(|&part| (body(part), part));
    let mut feet: Vec<Vec<usize>> = Vec::new();
    for part in outward {
        match feet.iter_mut().find(|foot| model.carries(body(foot[0]), body(part))) {
            Some(foot) => foot.push(part),
            None => feet.push(vec![part]),
        }
    }
    feet.sort_by_key(|foot| parts.iter().position(|part| *part == foot[0]));
    feet
}
