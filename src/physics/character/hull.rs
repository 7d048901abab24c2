//! Convex hulls of points, thinned to few corners.
//!
//! Quickhull (Barber, Dobkin & Huhdanpaa 1996) that always adds the point farthest outside of the hull
//! so far and stops at a number of corners, so that the volume it leaves out is small and its greatest distance known. Visibility is
//! decided by a flood over neighbouring faces with an explicit stack, and a point whose horizon is not
//! one simple loop is skipped: whatever the points of a mesh, the stack does not overflow, and the result is a
//! closed convex body or `None`.

use nalgebra::{Point3, Vector3};

/// The convex hull of given points, or a body within it of fewer corners: closed and convex.
#[derive(Debug, Clone, PartialEq)]
pub struct ThinnedHull {
    pub vertices: Vec<Point3<f64>>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Greatest distance of a given point outside of the body, m: 0 when nothing was left out.
    pub left_out: f64,
}

struct Face {
    corners: [usize; 3],
    normal: Vector3<f64>,
    offset: f64,
    /// Points outside of this face that have not been added to the hull, with their distances, in the hull's units.
    outside: Vec<(usize, f64)>,
}

impl Face {
    fn new(points: &[Point3<f64>], corners: [usize; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| points[corner]);
        let normal = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE)?;
        Some(Self { corners, normal, offset: normal.dot(&a.coords), outside: Vec::new() })
    }

    fn distance(&self, point: &Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) - self.offset
    }

    fn edges(&self) -> [(usize, usize); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
    }
}

/// The convex hull of `points` (finite numbers), with at most `most` corners, at least 4. `None` when
/// they lie within a plane, up to a millionth of their spread.
pub fn convex_hull(points: &[Point3<f64>], most: usize) -> Option<ThinnedHull> {
    let first = points.first()?;
    let spread = points.iter().map(|point| (point - first).norm()).fold(0.0, f64::max);
    if !(spread.is_finite() && spread > 0.0) {
        return None;
    }
    // In units of the spread and about the first point, so that one tolerance suits every size.
    let scaled: Vec<Point3<f64>> =
        points.iter().map(|point| Point3::from((point - first) / spread)).collect();
    let tolerance = 1e-9;
    let mut faces = tetrahedron(&scaled)?;
    assign(&scaled, &mut faces, 0..scaled.len(), tolerance);
    let mut skipped: f64 = 0.0;
    // Points whose horizon is no simple loop cost a round each; the bound keeps the work linear.
    for _ in 0..4 * most {
        // Euler: a closed body of F triangles has F / 2 + 2 corners.
        if faces.len() / 2 + 2 >= most {
            break;
        }
        let Some((face, place, distance)) = farthest(&faces) else { break };
        let (point, _) = faces[face].outside.swap_remove(place);
        if let Some((seen, new)) = extension(&scaled, &faces, face, point, tolerance) {
            let mut orphans = Vec::new();
            let mut kept = Vec::with_capacity(faces.len() + new.len());
            for (index, old) in faces.into_iter().enumerate() {
                if seen[index] {
                    orphans.extend(old.outside.into_iter().map(|(point, _)| point));
                } else {
                    kept.push(old);
                }
            }
            let from = kept.len();
            kept.extend(new);
            assign(&scaled, &mut kept[from..], orphans.into_iter(), tolerance);
            faces = kept;
        } else {
            skipped = distance.max(skipped);
        }
    }
    let waiting = farthest(&faces).map_or(0.0, |(_, _, distance)| distance);
    let left_out = waiting.max(skipped) * spread;

    let mut used: Vec<usize> = faces.iter().flat_map(|face| face.corners).collect();
    used.sort_unstable();
    used.dedup();
    let triangles = faces
        .iter()
        .map(|face| face.corners.map(|corner| used.partition_point(|other| *other < corner) as u32))
        .collect();
    Some(ThinnedHull {
        vertices: used.into_iter().map(|corner| points[corner]).collect(),
        triangles,
        left_out,
    })
}

/// The first four corners: two far apart, one far from their line, one far from their plane.
fn tetrahedron(points: &[Point3<f64>]) -> Option<Vec<Face>> {
    let greatest = |measure: &dyn Fn(&Point3<f64>) -> f64| {
        points
            .iter()
            .map(measure)
            .enumerate()
            .max_by(|(_, a), (_, b)| a.total_cmp(b))
            .filter(|(_, value)| *value > 1e-6)
            .map(|(index, _)| index)
    };
    let a = 0;
    let b = greatest(&|point| (point - points[a]).norm())?;
    let line = (points[b] - points[a]).normalize();
    let c = greatest(&|point| (point - points[a]).cross(&line).norm())?;
    let plane = line.cross(&(points[c] - points[a])).normalize();
    let d = greatest(&|point| (point - points[a]).dot(&plane).abs())?;
    let (b, c) = if (points[d] - points[a]).dot(&plane) < 0.0 { (b, c) } else { (c, b) };
    [[a, b, c], [a, c, d], [c, b, d], [b, a, d]]
        .map(|corners| Face::new(points, corners))
        .into_iter()
        .collect()
}

/// Gives each of the `waiting` points to the face it is farthest outside of.
fn assign(points: &[Point3<f64>], faces: &mut [Face], waiting: impl Iterator<Item = usize>, tolerance: f64) {
    for point in waiting {
        let best = faces
            .iter()
            .enumerate()
            .map(|(index, face)| (index, face.distance(&points[point])))
            .max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some((face, distance)) = best.filter(|(_, distance)| *distance > tolerance) {
            faces[face].outside.push((point, distance));
        }
    }
}

/// The waiting point farthest outside: its face, its place in that face's list, its distance.
fn farthest(faces: &[Face]) -> Option<(usize, usize, f64)> {
    faces
        .iter()
        .enumerate()
        .flat_map(|(face, held)| {
            held.outside.iter().enumerate().map(move |(place, (_, distance))| (face, place, *distance))
        })
        .max_by(|(_, _, a), (_, _, b)| a.total_cmp(b))
}

/// Which faces `point` sees, starting from the one it lies outside of, and the faces that join it to
/// their horizon; `None` when the horizon is not one simple loop of proper faces. A neighbour in whose
/// plane the point lies counts as seen, so that no new face is a sliver.
fn extension(
    points: &[Point3<f64>],
    faces: &[Face],
    start: usize,
    point: usize,
    tolerance: f64,
) -> Option<(Vec<bool>, Vec<Face>)> {
    let across = |(a, b): (usize, usize)| faces.iter().position(|face| face.edges().contains(&(b, a)));
    let mut seen = vec![false; faces.len()];
    seen[start] = true;
    let mut stack = vec![start];
    let mut horizon = Vec::new();
    while let Some(face) = stack.pop() {
        for edge in faces[face].edges() {
            let next = across(edge)?;
            if !seen[next] && faces[next].distance(&points[point]) > -tolerance {
                seen[next] = true;
                stack.push(next);
            }
        }
    }
    for (face, _) in seen.iter().enumerate().filter(|(_, seen)| **seen) {
        for edge in faces[face].edges() {
            if !seen[across(edge)?] {
                horizon.push(edge);
            }
        }
    }
    let (start, mut end) = *horizon.first()?;
    for _ in 1..horizon.len() {
        if end == start {
            return None;
        }
        end = horizon.iter().find(|(from, _)| *from == end)?.1;
    }
    if end != start {
        return None;
    }
    let new = horizon.iter().map(|&(a, b)| Face::new(points, [a, b, point])).collect::<Option<Vec<_>>>()?;
    Some((seen, new))
}
