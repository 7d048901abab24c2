//! Triangle meshes from STL, OBJ and COLLADA files, as shapes.

use std::io::Cursor;

use nalgebra::{Point3, Vector3};

use super::bounds::LENGTH;
use super::collada::{self, ColladaError, Triangles};
use super::solid::Solid;
use super::{Shape, hull};

/// Greatest number of triangles in one mesh.
const TRIANGLES: usize = 1_000_000;
/// Greatest number of corners of a collision hull; more would slow contact detection without changing contacts noticeably.
const CORNERS: usize = 32;
/// A mesh whose volume differs from its hull's by at most this part is convex, up to single precision.
const CONVEX: f64 = 1e-5;

/// Triangles over shared vertices, in the units and frame of the link's shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// A collision shape made from a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Solidified {
    pub shape: Shape,
    /// What was done to the mesh, worded to follow "the mesh is"; `None` where the shape is the mesh itself.
    pub approximation: Option<String>,
}

/// Why a mesh file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    #[error("it has no triangles")]
    Empty,
    #[error("it has a corner that is not finite or much too far away")]
    Corner,
    #[error("the STL file is neither an ASCII one nor as long as its triangle count says")]
    StlLength,
    #[error("bad STL file: {0}")]
    Stl(#[from] std::io::Error),
    #[error("the STL file has more than {TRIANGLES} triangles")]
    StlTooLong,
    #[error("the {format} file has {count} triangles; at most {TRIANGLES} are read")]
    TooManyTriangles { format: &'static str, count: u64 },
    #[error("bad OBJ file: {0}")]
    Obj(#[from] tobj::LoadError),
    #[error("in the COLLADA file: {0}")]
    Collada(#[from] ColladaError),
}

impl MeshError {
    /// Whether the file may be right, and is only not read here.
    pub fn is_unread(&self) -> bool {
        matches!(self, Self::Collada(ColladaError::Unread { .. }))
    }
}

/// The name's ending in lower case, without the stop.
fn extension(name: &str) -> String {
    name.rsplit_once('.').map_or(String::new(), |(_, ending)| ending.to_ascii_lowercase())
}

/// Whether meshes in files called like `name` can be read.
pub fn supported(name: &str) -> bool {
    matches!(extension(name).as_str(), "stl" | "obj" | "dae")
}

/// Reads the mesh file called `name`, scaled along each axis.
///
/// # Errors
///
/// [`MeshError`], whose text is a sentence for the file's author.
pub fn read(name: &str, bytes: &[u8], scale: &Vector3<f64>) -> Result<Mesh, MeshError> {
    let mut mesh = match extension(name).as_str() {
        "obj" => read_obj(bytes)?,
        "dae" => {
            let Triangles { vertices, triangles } = collada::read(bytes, TRIANGLES)?;
            Mesh { vertices, triangles }
        }
        _ => read_stl(bytes)?,
    };
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    for vertex in &mut mesh.vertices {
        vertex.coords.component_mul_assign(scale);
        if !vertex.iter().all(|x| x.is_finite() && x.abs() <= LENGTH) {
            return Err(MeshError::Corner);
        }
    }
    if scale.product() < 0.0 {
        // A mirrored mesh is seen from the other side.
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    Ok(mesh)
}

fn read_stl(bytes: &[u8]) -> Result<Mesh, MeshError> {
    let count = bytes
        .get(80..84)
        .map_or(0, |count| count.iter().rev().fold(0_u64, |number, byte| number << 8 | u64::from(*byte)));
    let binary = bytes.len() as u64 == 84 + 50 * count;
    let mut stream = bytes.to_vec();
    if binary {
        // The header is free text; one that begins with "solid" would pass for an ASCII file.
        stream[..5].fill(b' ');
    } else if let Some(end) = bytes.iter().position(|byte| *byte == b'\n')
        && bytes.starts_with(b"solid")
    {
        // The name after "solid" is optional.
        stream.splice(..end, *b"solid mesh");
    } else {
        return Err(MeshError::StlLength);
    }
    if count as usize > TRIANGLES && binary {
        return Err(MeshError::TooManyTriangles { format: "STL", count });
    }
    let mut cursor = Cursor::new(stream);
    let reader = stl_io::create_stl_reader(&mut cursor)?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for triangle in reader {
        let triangle = triangle?;
        if triangles.len() == TRIANGLES {
            return Err(MeshError::StlTooLong);
        }
        let first = vertices.len() as u32;
        triangles.push([first, first + 1, first + 2]);
        for vertex in triangle.vertices {
            vertices.push(Point3::from(<[f32; 3]>::from(vertex).map(f64::from)));
        }
    }
    Ok(Mesh { vertices, triangles })
}

fn read_obj(bytes: &[u8]) -> Result<Mesh, MeshError> {
    let text = String::from_utf8_lossy(bytes);
    // Only corners and faces bear on the shape: no materials, normals or textures are loaded.
    let shape: String = text
        .lines()
        .filter(|line| line.trim_start().starts_with("v ") || line.trim_start().starts_with("f "))
        .flat_map(|line| [line, "\n"])
        .collect();
    // Counted before reading, because a face of many corners becomes many triangles.
    let faces = shape.lines().filter(|line| line.trim_start().starts_with('f'));
    let count: usize = faces.map(|line| line.split_whitespace().count().saturating_sub(3)).sum();
    if count > TRIANGLES {
        return Err(MeshError::TooManyTriangles { format: "OBJ", count: count as u64 });
    }
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let (models, _) =
        tobj::load_obj_buf(&mut shape.as_bytes(), &options, |_| Err(tobj::LoadError::GenericFailure))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for model in models {
        let first = vertices.len() as u32;
        let corners = model.mesh.positions.chunks_exact(3);
        vertices.extend(corners.map(|corner| Point3::new(corner[0], corner[1], corner[2]).map(f64::from)));
        let faces = model.mesh.indices.chunks_exact(3);
        triangles.extend(faces.map(|face| [first + face[0], first + face[1], first + face[2]]));
    }
    Ok(Mesh { vertices, triangles })
}

impl Mesh {
    /// The mesh itself, as a visual shape.
    pub fn surface(self) -> Shape {
        Shape::Hull { vertices: self.vertices, triangles: self.triangles }
    }

    /// The mesh's convex hull, as a collision shape; a thin box around a flat mesh.
    pub fn solid(self) -> Solidified {
        let Some(mut hull) = hull(&self.vertices) else { return plate(&self.vertices) };
        if hull.approximation.is_none() {
            let within = Solid::of(&hull.shape).volume;
            let own = Solid::of(&self.surface()).volume;
            let convex = (own - within).abs() <= CONVEX * within;
            hull.approximation = (!convex).then(|| "replaced by its convex hull".to_owned());
        }
        hull
    }
}

/// The convex hull of `points`, thinned to at most 32 corners; `None` when they lie in one plane.
pub fn hull(points: &[Point3<f64>]) -> Option<Solidified> {
    let hull = hull::convex_hull(points, CORNERS)?;
    let approximation = (hull.left_out > 0.0).then(|| {
        let (corners, left_out) = (hull.vertices.len(), hull.left_out * 1e3);
        format!("replaced by a convex hull of {corners} corners, which leaves out up to {left_out:.2} mm")
    });
    let shape = Shape::Hull { vertices: hull.vertices, triangles: hull.triangles };
    Some(Solidified { shape, approximation })
}

/// The box along the axes around points that lie within a plane, thickened by a hundredth of its length,
/// as a hull of eight corners.
fn plate(points: &[Point3<f64>]) -> Solidified {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for point in points {
        low = low.inf(&point.coords);
        high = high.sup(&point.coords);
    }
    let thickness = ((high - low).max() * 0.01).max(1e-4);
    let (low, high) = (low - Vector3::repeat(thickness / 2.0), high + Vector3::repeat(thickness / 2.0));
    let corner = |x: usize, y: usize, z: usize| {
        let ends = [low, high];
        Point3::new(ends[x].x, ends[y].y, ends[z].z)
    };
    let corners: Vec<_> =
        [0, 1].into_iter().flat_map(|x| [0, 1].map(|y| [0, 1].map(|z| corner(x, y, z)))).flatten().collect();
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Solidified {
        shape: Shape::Hull { vertices: corners, triangles },
        approximation: Some(format!("flat; it is given a thickness of {:.2} mm", thickness * 1e3)),
    }
}
