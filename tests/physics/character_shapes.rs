//! Solids, hulls and meshes: what shapes weigh, and how mesh files become shapes.

use std::fs;
use std::io::{Cursor, Write};

use gaitwright_physics::character::{self, NoteKind, Options, Reading, Shape, Source};
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

fn read_json(document: &serde_json::Value) -> Reading {
    character::read(document.to_string().as_bytes(), Source::Json, Options::default()).unwrap()
}

/// The mass properties that a link of density 1 gets from `shapes`.
fn weighed(shapes: &[serde_json::Value]) -> character::Inertial {
    let document = serde_json::json!({
        "format": "gaitwright/character@1", "name": "solid",
        "links": [{"name": "body", "density": 1.0, "shapes": shapes}]
    });
    read_json(&document).character.links.remove(0).inertial.unwrap()
}

/// Volume, moment across the axis and moment along the axis of a body of revolution about z with the
/// radius `radius(z)` for |z| < `end`, by the midpoint rule over discs.
fn revolved(end: f64, radius: impl Fn(f64) -> f64) -> [f64; 3] {
    let slices = 200_000;
    let thickness = 2.0 * end / f64::from(slices);
    let mut sums = [0.0; 3];
    for slice in 0..slices {
        let z = (f64::from(slice) + 0.5) * thickness - end;
        let square = radius(z).powi(2);
        let volume = std::f64::consts::PI * square * thickness;
        sums[0] += volume;
        sums[1] += volume * (square / 4.0 + z * z);
        sums[2] += volume * square / 2.0;
    }
    sums
}

#[test]
fn round_solids_weigh_what_their_slices_weigh() {
    let (r, l) = (0.3, 0.8);
    let round = |z: f64| (r * r - (z.abs() - l / 2.0).max(0.0).powi(2)).max(0.0).sqrt();
    let solids = [
        (serde_json::json!({"kind": "sphere", "radius": r}), revolved(r, |z| (r * r - z * z).sqrt())),
        (serde_json::json!({"kind": "cylinder", "radius": r, "length": l}), revolved(l / 2.0, |_| r)),
        (serde_json::json!({"kind": "capsule", "radius": r, "length": l}), revolved(l / 2.0 + r, round)),
    ];
    for (shape, [volume, across, along]) in solids {
        let found = weighed(std::slice::from_ref(&shape));
        assert!((found.mass / volume - 1.0).abs() < 1e-8, "{shape}");
        let expected = Matrix3::from_diagonal(&Vector3::new(across, across, along));
        assert!((found.inertia - expected).norm() < 1e-8 * expected.norm(), "{shape}");
        assert_eq!(found.center_of_mass, Point3::origin());
    }
}

fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = Vector3<f64>> {
    [range.clone(), range.clone(), range].prop_map(Vector3::from)
}

fn pose() -> impl Strategy<Value = Isometry3<f64>> {
    (vector(-2.0..2.0), vector(-3.0..3.0)).prop_map(|(position, turn)| {
        Isometry3::from_parts(position.into(), UnitQuaternion::from_scaled_axis(turn))
    })
}

fn corners(half: &Vector3<f64>, pose: &Isometry3<f64>) -> Vec<Point3<f64>> {
    (0..8)
        .map(|corner| {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            pose * Point3::new(sign(0) * half.x, sign(1) * half.y, sign(2) * half.z)
        })
        .collect()
}

fn hull_shape(points: &[Point3<f64>]) -> serde_json::Value {
    let points: Vec<[f64; 3]> = points.iter().map(|point| point.coords.into()).collect();
    serde_json::json!({"kind": "hull", "vertices": points})
}

fn pose_json(pose: &Isometry3<f64>) -> serde_json::Value {
    let q = pose.rotation.quaternion();
    serde_json::json!({
        "position": [pose.translation.x, pose.translation.y, pose.translation.z],
        "orientation": [q.w, q.i, q.j, q.k]
    })
}

fn assert_same(a: &character::Inertial, b: &character::Inertial, tolerance: f64) {
    assert!((a.mass / b.mass - 1.0).abs() < tolerance, "mass {} and {}", a.mass, b.mass);
    assert!((a.center_of_mass - b.center_of_mass).norm() < tolerance);
    let scale = a.inertia.norm();
    assert!((a.inertia - b.inertia).norm() < tolerance * scale, "inertia {} and {}", a.inertia, b.inertia);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_box_weighs_the_same_as_the_hull_of_its_corners(half in vector(0.05..2.0), pose in pose()) {
        let size = [2.0 * half.x, 2.0 * half.y, 2.0 * half.z];
        let solid = weighed(&[serde_json::json!({"kind": "box", "size": size, "pose": pose_json(&pose)})]);
        assert_same(&weighed(&[hull_shape(&corners(&half, &pose))]), &solid, 1e-9);
    }

    #[test]
    fn a_box_weighs_the_same_as_its_two_halves(half in vector(0.05..2.0), cut in 0.1..0.9, pose in pose()) {
        let piece = |from: f64, to: f64| {
            let place = pose * nalgebra::Translation3::new(half.x * (from + to - 1.0), 0.0, 0.0);
            let size = [2.0 * half.x * (to - from), 2.0 * half.y, 2.0 * half.z];
            serde_json::json!({"kind": "box", "size": size, "pose": pose_json(&place)})
        };
        assert_same(&weighed(&[piece(0.0, cut), piece(cut, 1.0)]), &weighed(&[piece(0.0, 1.0)]), 1e-9);
    }

    #[test]
    fn a_hull_is_closed_convex_and_holds_its_points(
        points in prop::collection::vec(vector(-1.0..1.0), 8..30), size in -3..3,
    ) {
        let scale = 10_f64.powi(size);
        let points: Vec<_> = points.into_iter().map(|point| Point3::from(point * scale)).collect();
        let document = serde_json::json!({
            "format": "gaitwright/character@1", "name": "solid",
            "links": [{"name": "body", "density": 1.0, "shapes": [hull_shape(&points)]}]
        });
        let reading = read_json(&document);
        prop_assert!(reading.notes.is_empty(), "nothing is left out of so few points");
        let Shape::Hull { vertices, triangles } = &reading.character.links[0].collisions[0].shape else {
            panic!("a hull stays a hull");
        };
        prop_assert_eq!(triangles.len(), 2 * vertices.len() - 4, "Euler's formula");
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| vertices[corner as usize]);
            let normal = (b - a).cross(&(c - a)).normalize();
            let outside = points.iter().map(|point| normal.dot(&(point - a))).fold(f64::MIN, f64::max);
            prop_assert!(outside < 1e-8 * scale, "a point lies {} outside", outside);
        }
    }
}

#[test]
fn a_hull_of_many_points_is_thinned_and_says_so() {
    let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
    let points: Vec<_> = (0..2000)
        .map(|index| {
            let z = 1.0 - (2.0 * f64::from(index) + 1.0) / 2000.0;
            let (sin, cos) = (golden * f64::from(index)).sin_cos();
            Point3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
        })
        .collect();
    let document = serde_json::json!({
        "format": "gaitwright/character@1", "name": "ball",
        "links": [{"name": "body", "density": 1.0, "shapes": [hull_shape(&points)]}]
    });
    let Reading { character, notes } = read_json(&document);
    let Shape::Hull { vertices, .. } = &character.links[0].collisions[0].shape else { panic!() };
    assert_eq!(vertices.len(), 32);
    assert!(matches!(&notes[..], [note] if note.kind == NoteKind::Approximated));
    // The best polyhedron of 32 corners in a ball (the pentakis dodecahedron) fills 83 % of it.
    let volume = character.mass() / (4.0 / 3.0 * std::f64::consts::PI);
    assert!((0.65..0.85).contains(&volume), "it fills {volume} of the ball");
}

#[test]
fn inertias_of_urdf_examples_are_those_of_their_shapes() {
    for name in ["quadruped.urdf", "biped.urdf"] {
        let path = crate::common::example_path(name);
        for link in character::read_file(&path, Options { strict: true }).unwrap().character.links {
            let [placed] = &link.collisions[..] else { panic!("{} has one shape", link.name) };
            let (inertial, size) = (link.inertial.unwrap(), placed.shape.clone());
            let shape = match size {
                Shape::Sphere { radius } => serde_json::json!({"kind": "sphere", "radius": radius}),
                Shape::Box { half_extents: half } => {
                    serde_json::json!({"kind": "box", "size": [2.0 * half.x, 2.0 * half.y, 2.0 * half.z]})
                }
                Shape::Cylinder { radius, half_length } => {
                    serde_json::json!({"kind": "cylinder", "radius": radius, "length": 2.0 * half_length})
                }
                other => panic!("{other:?}"),
            };
            let solid = weighed(&[shape]);
            let turn = placed.pose.rotation.to_rotation_matrix();
            let inertia = turn * solid.inertia * turn.transpose() * (inertial.mass / solid.mass);
            assert!((inertia - inertial.inertia).norm() < 1e-4 * inertia.norm(), "{}", link.name);
            assert!((placed.pose.translation.vector - inertial.center_of_mass.coords).norm() < 1e-9);
        }
    }
}

/// A cube from 0 to 1 as triangles.
fn cube() -> Vec<[[f32; 3]; 3]> {
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corner = |index: usize| [(index & 1) as f32, (index >> 1 & 1) as f32, (index >> 2 & 1) as f32];
    faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c].map(corner), [a, c, d].map(corner)]).collect()
}

fn binary_stl(header: &[u8], triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii_stl(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut text = String::from("solid\n");
    for triangle in triangles {
        text += "facet normal 0 0 0\n outer loop\n";
        for [x, y, z] in triangle {
            text += &format!("  vertex {x} {y} {z}\n");
        }
        text += " endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

fn obj(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut text = String::from("mtllib missing.mtl\no cube\nvn 0 0 1\n");
    for (index, triangle) in triangles.iter().enumerate() {
        for [x, y, z] in triangle {
            text += &format!("v {x} {y} {z}\n");
        }
        let first = 3 * index + 1;
        text += &format!("usemtl grey\nf {first}//1 {}//1 {}//1\n", first + 1, first + 2);
    }
    text.into_bytes()
}

/// An archive of these files.
pub fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn with_mesh(file: &str, scale: &str) -> String {
    let mesh = format!(r#"<mesh filename="{file}" scale="{scale}"/>"#);
    format!(
        r#"<robot name="brick"><link name="body">
          <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
          <visual><geometry>{mesh}</geometry></visual><collision><geometry>{mesh}</geometry></collision>
        </link></robot>"#
    )
}

/// The volume within outward triangles.
fn volume(shape: &Shape) -> f64 {
    let Shape::Hull { vertices, triangles } = shape else { panic!("{shape:?} is no hull") };
    let corner = |index: u32| vertices[index as usize].coords;
    triangles.iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c)))).sum::<f64>() / 6.0
}

#[test]
fn meshes_come_from_the_archive_in_every_format() {
    let meshes = [
        ("brick.stl", binary_stl(b"made by hand", &cube())),
        ("brick.STL", binary_stl(b"solid made by hand", &cube())),
        ("brick.stl", ascii_stl(&cube())),
        ("brick.obj", obj(&cube())),
    ];
    for (name, bytes) in &meshes {
        for (reference, path) in [
            (format!("../meshes/{name}"), format!("arm/meshes/{name}")),
            (format!("package://arm/meshes/{name}"), format!("arm/meshes/{name}")),
            (format!("package://other/meshes/{name}"), format!("arm/urdf/meshes/{name}")),
        ] {
            for (scale, expected) in [("1 2 3", 6.0), ("-1 2 0.5", 1.0)] {
                let urdf = with_mesh(&reference, scale);
                let archive = zipped(&[("arm/urdf/arm.urdf", urdf.as_bytes()), (&path, bytes)]);
                let Reading { character, notes } =
                    character::read(&archive, Source::Zip, Options::default()).unwrap();
                let [body] = &character.links[..] else { panic!() };
                let Shape::Hull { vertices, .. } = &body.collisions[0].shape else { panic!() };
                assert_eq!(vertices.len(), 8);
                assert!((volume(&body.collisions[0].shape) - expected).abs() < 1e-9);
                assert!((volume(&body.visuals[0].shape) - expected).abs() < 1e-6, "the mesh faces outward");
                assert!(notes.is_empty(), "a cube is convex: {notes:?}");
            }
        }
    }
}

#[test]
fn a_mesh_with_a_hollow_or_without_a_volume_is_approximated_and_noted() {
    // Two cubes that touch at a corner, and the bottom of a cube alone.
    let moved = cube().into_iter().map(|triangle| triangle.map(|corner| corner.map(|x| x + 1.0)));
    let pair: Vec<_> = cube().into_iter().chain(moved).collect();
    let bottom: Vec<_> =
        cube().into_iter().filter(|triangle| triangle.iter().all(|corner| corner[2] == 0.0)).collect();
    // The hull of the pair is the zonotope of the edges and the diagonal: the four determinants of three
    // of these vectors are 1 each.
    for (triangles, expected, reason) in [
        (pair, 4.0, "is replaced by its convex hull"),
        (bottom, 1.01 * 1.01 * 0.01, "is flat; it is given a thickness of 10.00 mm"),
    ] {
        let stl = binary_stl(b"", &triangles);
        let archive = zipped(&[("a.urdf", with_mesh("a.stl", "1 1 1").as_bytes()), ("a.stl", &stl)]);
        let Reading { character, notes } =
            character::read(&archive, Source::Zip, Options::default()).unwrap();
        assert!((volume(&character.links[0].collisions[0].shape) - expected).abs() < 1e-6);
        let [note] = &notes[..] else { panic!("{notes:?}") };
        assert!(note.kind == NoteKind::Approximated && note.message.contains(reason), "{note:?}");
        let Shape::Hull { triangles: shown, .. } = &character.links[0].visuals[0].shape else { panic!() };
        assert_eq!(shown.len(), triangles.len(), "the visual is the mesh itself");
    }
}

#[test]
fn meshes_on_disk_are_found_beside_and_above_the_urdf_but_not_for_bytes_alone() {
    let folder = tempfile::tempdir().unwrap();
    let package = folder.path().join("arm");
    fs::create_dir_all(package.join("urdf")).unwrap();
    fs::create_dir_all(package.join("meshes")).unwrap();
    fs::write(package.join("meshes/brick.stl"), binary_stl(b"", &cube())).unwrap();
    for reference in ["../meshes/brick.stl", "package://arm/meshes/brick.stl"] {
        let path = package.join("urdf/arm.urdf");
        fs::write(&path, with_mesh(reference, "1 1 1")).unwrap();
        let found = character::read_file(&path, Options::default()).unwrap();
        assert!(matches!(found.character.links[0].collisions[0].shape, Shape::Hull { .. }));
        let bytes = fs::read(&path).unwrap();
        let alone = character::read(&bytes, Source::Urdf, Options::default()).unwrap();
        assert!(matches!(alone.character.links[0].collisions[0].shape, Shape::Box { .. }));
        assert_eq!(alone.character.digest, found.character.digest);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_meshes_are_read_or_refused(
        format in 0..3_usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>(), any::<u8>()), 1..8),
    ) {
        let (name, mut bytes) = [
            ("brick.stl", binary_stl(b"", &cube())),
            ("brick.stl", ascii_stl(&cube())),
            ("brick.obj", obj(&cube())),
        ][format].clone();
        for (place, digit, value) in edits {
            let place = place.index(bytes.len());
            bytes[place] = if digit { b"0123456789 -/e.\n"[usize::from(value) % 16] } else { value };
        }
        let archive = zipped(&[("a.urdf", with_mesh(name, "1 1 1").as_bytes()), (name, &bytes)]);
        match character::read(&archive, Source::Zip, Options::default()) {
            Ok(reading) => {
                let solid = volume(&reading.character.links[0].collisions[0].shape);
                prop_assert!(solid.is_finite() && solid > 0.0, "a collision shape has a volume");
            }
            Err(error) => prop_assert!(error.faults()[0].pointer.contains("link \"body\""), "{}", error),
        }
    }

    #[test]
    fn mutated_archives_are_read_or_refused(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let urdf = with_mesh("brick.stl", "1 1 1");
        let mut archive = zipped(&[("a.urdf", urdf.as_bytes()), ("brick.stl", &binary_stl(b"", &cube()))]);
        for (place, value) in edits {
            let place = place.index(archive.len());
            archive[place] = value;
        }
        if let Err(error) = character::read(&archive, Source::Zip, Options::default()) {
            prop_assert!(!error.faults().is_empty());
        }
    }
}
