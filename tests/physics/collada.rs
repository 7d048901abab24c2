//! COLLADA meshes: each kind of primitive, nodes and units against boxes computed by hand, and documents with faults.

use gaitwright_physics::character::{self, NoteKind, Options, Reading, Shape, Source};
use gaitwright_physics::fault::{Fault, InputError};
use nalgebra::Vector3;

use crate::character_shapes::zipped;

/// Corner i is at (i & 1, i >> 1 & 1, i >> 2 & 1); seen from outside the faces run anticlockwise.
const FACES: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/// A document with the corners of the unit cube, `primitives` between them and `scene` in its scene.
fn document(primitives: &str, scene: &str) -> String {
    let corners: Vec<String> = (0..8).map(|i| format!("{} {} {}", i & 1, i >> 1 & 1, i >> 2 & 1)).collect();
    format!(
        r##"<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="cube"><mesh>
<source id="corners"><float_array id="array" count="24">{}</float_array>
<technique_common><accessor source="#array" count="8" stride="3"/></technique_common></source>
<vertices id="vertices"><input semantic="POSITION" source="#corners"/></vertices>
{primitives}
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene">{scene}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>"##,
        corners.join(" ")
    )
}

const VERTEX: &str = r##"<input semantic="VERTEX" source="#vertices" offset="0"/>"##;
const NORMAL: &str = r##"<input semantic="NORMAL" source="#nothing" offset="1"/>"##;
const CUBE: &str = r##"<node><instance_geometry url="#cube"/></node>"##;

fn list(indices: impl IntoIterator<Item = u32>) -> String {
    indices.into_iter().map(|index| index.to_string()).collect::<Vec<_>>().join(" ")
}

fn triangles() -> String {
    let corners = FACES.into_iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]);
    format!("<triangles count=\"12\">{VERTEX}<p>{}</p></triangles>", list(corners))
}

fn read_as(dae: &str, purpose: &str) -> Result<Reading, InputError> {
    let urdf = format!(
        r#"<robot name="brick"><link name="body">
          <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
          <{purpose}><geometry><mesh filename="a.dae"/></geometry></{purpose}></link></robot>"#
    );
    let archive = zipped(&[("a.urdf", urdf.as_bytes()), ("a.dae", dae.as_bytes())]);
    character::read(&archive, Source::Zip, Options::default())
}

/// Least and greatest coordinates of what is shown, its volume and its number of triangles.
fn shown(dae: &str) -> ([Vector3<f64>; 2], f64, usize) {
    let character = read_as(dae, "visual").unwrap().character;
    let Shape::Hull { vertices, triangles } = &character.links[0].visuals[0].shape else { panic!() };
    let corner = |index: u32| vertices[index as usize].coords;
    let used = || triangles.iter().flatten().map(|index| corner(*index));
    let low = used().fold(Vector3::repeat(f64::INFINITY), |low, it| low.inf(&it));
    let high = used().fold(Vector3::repeat(f64::NEG_INFINITY), |high, it| high.sup(&it));
    let parts = triangles.iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))));
    ([low, high], parts.sum::<f64>() / 6.0, triangles.len())
}

#[test]
fn every_kind_of_primitive_is_read() {
    // With a normal beside each corner, which stands for an index of its own in <p>.
    let beside = |corners: &[u32]| list(corners.iter().flat_map(|corner| [*corner, 77]));
    let each = |kind: &str, of: fn([u32; 4]) -> [u32; 4]| {
        let lists: String = FACES.iter().map(|face| format!("<p>{}</p>", beside(&of(*face)))).collect();
        format!("<{kind} count=\"6\">{VERTEX}{NORMAL}{lists}</{kind}>")
    };
    let faces = FACES.as_flattened();
    for primitives in [
        triangles(),
        format!(
            "<polylist count=\"6\">{VERTEX}<vcount>4 4 4 4 4 4</vcount><p>{}</p></polylist>",
            list(faces.iter().copied())
        ),
        each("polygons", |face| face),
        each("trifans", |face| face),
        each("tristrips", |[a, b, c, d]| [a, b, d, c]),
    ] {
        let lines = format!("<lines count=\"1\">{VERTEX}<p>0 7</p></lines>");
        let ([low, high], volume, count) = shown(&document(&format!("{primitives}{lines}"), CUBE));
        assert_eq!((low, high), (Vector3::zeros(), Vector3::repeat(0.01)), "{primitives}");
        assert!((volume - 1e-6).abs() < 1e-18 && count == 12, "{primitives}: {volume} m³");
    }
}

#[test]
fn nodes_place_their_meshes() {
    // (x, y, z) becomes (100 - 2 y, x, 3 z) cm.
    let turned = r##"<node><translate>100 0 0</translate><rotate>0 0 1 90</rotate><scale>1 2 3</scale>
        <node><instance_geometry url="#cube"/></node></node>"##;
    // The same by a matrix, as a row of its rows, and mirrored at x = 0.
    let mirrored = r##"<node><matrix>0 2 0 -100 1 0 0 0 0 0 3 0 0 0 0 1</matrix><instance_geometry url="#cube"/></node>"##;
    let both = format!("{turned}{mirrored}");
    let near = |found: Vector3<f64>, expected: [f64; 3]| (found - Vector3::from(expected)).amax() < 1e-15;
    for (scene, low, high, times) in [
        (turned, [0.98, 0.0, 0.0], [1.0, 0.01, 0.03], 1),
        (mirrored, [-1.0, 0.0, 0.0], [-0.98, 0.01, 0.03], 1),
        (&both, [-1.0, 0.0, 0.0], [1.0, 0.01, 0.03], 2),
    ] {
        let ([lowest, highest], volume, count) = shown(&document(&triangles(), scene));
        assert!(near(lowest, low) && near(highest, high), "{lowest:?} to {highest:?}");
        assert_eq!(count, 12 * times);
        assert!((volume - 6e-6 * times as f64).abs() < 1e-16, "it faces outward: {volume} m³");
    }
    let hull = read_as(&document(&triangles(), turned), "collision").unwrap().character;
    let Shape::Hull { vertices, .. } = &hull.links[0].collisions[0].shape else { panic!() };
    assert_eq!(vertices.len(), 8);
}

#[test]
fn documents_with_faults_are_refused_with_their_line() {
    let cube = triangles();
    let doubling: String = (0..40)
        .map(|at| {
            format!(
                "<node id=\"n{at}\"><instance_node url=\"#n{0}\"/><instance_node url=\"#n{0}\"/></node>",
                at + 1
            )
        })
        .collect();
    for (document, reason) in [
        (document(&cube, CUBE).replace("</scene>", ""), "in the COLLADA file"),
        (document(&cube, CUBE).replace("<p>0 2", "<p>8 2"), "line 8: <p> refers to position 8 of 8"),
        (document(&cube, CUBE).replace("<p>0 2", "<p>2"), "line 8: <p> ends within a triangle"),
        (document(&cube, CUBE).replace("<p>0 2", "<p>zero 2"), "line 8: <p> has \"zero\" for a number"),
        (
            document(&cube, CUBE).replace("stride=\"3\"", "stride=\"2\""),
            "line 6: positions have less than three",
        ),
        (document(&cube, CUBE).replace(">0 0 0 1", ">0 0 1e999 1"), "not finite"),
        (document(&cube, CUBE).replace("#cube", "#cubes"), "line 10: url \"#cubes\" leads to nothing"),
        (document("", CUBE), "has no triangles"),
        (document(&cube, "<node id=\"a\"><instance_node url=\"#a\"/></node>"), "nodes that carry themselves"),
        (document(&cube, &doubling.replace("#n40", "#cube")), "too many nodes"),
        (document(&cube, "<node><matrix>1 0 0</matrix></node>"), "<matrix> has 3 numbers instead of 16"),
    ] {
        let faults: Vec<Fault> = match read_as(&document, "visual") {
            Err(InputError::Impossible(faults)) => faults,
            other => panic!("{reason}: {other:?}"),
        };
        let [fault] = &faults[..] else { panic!("{faults:?}") };
        assert!(fault.reason.contains(reason) && fault.pointer.contains("body"), "{reason}: {fault:?}");
    }
}

/// What COLLADA allows and is not read is noted, and the character is read without it.
#[test]
fn what_is_not_read_is_noted() {
    let skewed =
        document(&triangles(), "<node><skew>45 0 1 0 1 0 0</skew><instance_geometry url=\"#cube\"/></node>");
    for (purpose, kind) in [("visual", NoteKind::Ignored), ("collision", NoteKind::Approximated)] {
        let notes = read_as(&skewed, purpose).unwrap().notes;
        let [note] = &notes[..] else { panic!("{notes:?}") };
        assert!(note.kind == kind && note.message.contains("line 10: <skew> is not read"), "{note:?}");
    }
}
