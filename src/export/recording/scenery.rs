//! The ground and the obstacles of the scene, recorded once.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use re_sdk::{RecordingStream, RecordingStreamError};
use re_sdk_types::archetypes::{LineStrips3D, Mesh3D, Points3D, ViewCoordinates};

use super::appearance::Appearance;
use super::paths;
use super::shapes::{float, log_shapes};
use gaitwright_physics::scene::{HeightField, Scene, Terrain};

/// Half of the edge of the ground that is shown, m.
const GROUND_REACH: f32 = 200.0;

/// Of the character's size.
const RING_RADIUS: f64 = 0.9;
const RING_POINTS: u32 = 96;
const RING_COLOR: [u8; 4] = [120, 130, 145, 255];

const GROUND_COLOR: [u8; 4] = [58, 64, 72, 255];

/// Colour of an obstacle that has none of its own.
const OBSTACLE_COLOR: [u8; 4] = [112, 116, 124, 255];

/// Logs the ground, the obstacles and the ring that the eye follows, for all times.
pub(super) fn log(
    stream: &RecordingStream,
    appearance: &Appearance,
    scene: &Scene,
) -> Result<(), RecordingStreamError> {
    stream.log_static(paths::world(), &ViewCoordinates::RIGHT_HAND_Z_UP())?;
    let mesh = scene.ground.as_ref().map(|ground| match Terrain::new(ground) {
        Terrain::Plane { height } => {
            // A thousandth of the character's size lower: the view's grid lies at the height itself, and
            // the two would flicker.
            let (r, z) = (GROUND_REACH, (height - 1e-3 * appearance.size) as f32);
            Mesh3D::new([[-r, -r, z], [r, -r, z], [r, r, z], [-r, r, z]])
                .with_triangle_indices([[0, 1, 2], [0, 2, 3]])
                .with_vertex_normals([[0.0, 0.0, 1.0]; 4])
        }
        Terrain::Field(field) => surface(&field),
    });
    if let Some(mesh) = mesh {
        stream.log_static(paths::ground(), &mesh.with_albedo_factor(GROUND_COLOR))?;
    }
    for (index, obstacle) in scene.obstacles.iter().enumerate() {
        // A scene with faulty obstacles is refused long before anything is recorded of it.
        let Ok(placed) = obstacle.placed() else { continue };
        log_shapes(stream, &paths::obstacle(&obstacle.name(index)), &[placed], OBSTACLE_COLOR)?;
    }
    log_ring(stream, appearance, scene)
}

/// Logs the ring on the ground below the centre of mass. The view's eye follows it, and a viewer
/// stands off from what it follows in proportion to its extent, so the ring is as large as what is
/// to be seen.
fn log_ring(
    stream: &RecordingStream,
    appearance: &Appearance,
    scene: &Scene,
) -> Result<(), RecordingStreamError> {
    let (radius, z) = (RING_RADIUS * appearance.size, ground_height(scene) + 2e-3 * appearance.size);
    let points = (0..=RING_POINTS).map(|point| {
        let (y, x) = (TAU * f64::from(point) / f64::from(RING_POINTS)).sin_cos();
        float(&Vector3::new(radius * x, radius * y, z))
    });
    let ring = LineStrips3D::new([points.collect::<Vec<_>>()])
        .with_colors([RING_COLOR])
        .with_radii([4e-3 * appearance.size as f32]);
    // A point too small to be seen above the ring lifts the middle of the extent to the character's.
    let above = Points3D::new([[0.0, 0.0, (z + 2.0 * appearance.height) as f32]]).with_radii([1e-6]);
    stream.log_static(paths::ring(), &above)?;
    stream.log_static(paths::ring(), &ring)
}

/// z of the ground at the world's origin, m; 0 where there is none.
pub(super) fn ground_height(scene: &Scene) -> f64 {
    scene.ground.as_ref().map_or(0.0, |ground| Terrain::new(ground).height(0.0, 0.0))
}

/// The triangles of a height field, each point once.
fn surface(field: &HeightField) -> Mesh3D {
    let (corners, columns) = field.corners();
    let corners: Vec<[f32; 3]> = corners.map(|corner| float(&corner)).collect();
    let row = columns as u32;
    let cells = (0..corners.len() as u32 - row).filter(|corner| corner % row + 1 < row);
    let triangles = cells.flat_map(|a| {
        let [b, c, d] = [a + 1, a + row + 1, a + row];
        [[a, b, c], [a, c, d]]
    });
    Mesh3D::new(corners).with_triangle_indices(triangles.collect::<Vec<_>>())
}
