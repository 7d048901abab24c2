//! Damage to documents: alterations that somebody, or something, may have made to them.

use std::time::{Duration, Instant};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::common;

/// What damage puts into a document.
const PIECES: [&str; 22] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "NaN",
    "inf",
    "1e999",
    "null",
    "true",
    "\"",
    "[",
    "{}",
    "<link/>",
    "</robot>",
    "&amp;",
    "\u{fffd}",
    "\0",
    "\r\n--",
    "PK\u{1}\u{2}",
    "18446744073709551616",
    "<!DOCTYPE a>",
];

/// Numbers of copies to be damaged, each the seed of its damage: `copies` of them, as many as the variable CASES says, or
/// as many as there is time for in the seconds that the variable FUZZ_SECONDS says.
pub fn cases(copies: u64) -> impl Iterator<Item = u64> {
    let copies = common::number("CASES").unwrap_or(copies);
    let until = common::number("FUZZ_SECONDS").map(|seconds| Instant::now() + Duration::from_secs(seconds));
    (0..).take_while(move |case| match until {
        Some(until) => Instant::now() < until,
        None => *case < copies,
    })
}

/// Alters `bytes` in a few places.
pub fn damage(rng: &mut ChaCha8Rng, bytes: &mut Vec<u8>) {
    for _ in 0..rng.random_range(1..4) {
        damage_once(rng, bytes);
    }
}

fn damage_once(rng: &mut ChaCha8Rng, bytes: &mut Vec<u8>) {
    let at = rng.random_range(0..=bytes.len());
    let end = (at + rng.random_range(0..40)).min(bytes.len());
    let piece = PIECES[rng.random_range(0..PIECES.len())].bytes();
    match rng.random_range(0..6) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..end)),
        2 => drop(bytes.splice(at..at, piece)),
        3 => {
            let copied = bytes[at..end].to_vec();
            let to = rng.random_range(0..=bytes.len());
            bytes.splice(to..to, copied);
        }
        4 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << rng.random_range(0..8);
            }
        }
        _ => {
            // A number after this place becomes another.
            let of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
            let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|found| at + found) else {
                return;
            };
            let length = bytes[start..].iter().take_while(|byte| of_number(byte)).count();
            bytes.splice(start..start + length, piece);
        }
    }
}

/// A zip archive of files by their names.
pub fn archive<Contents: AsRef<[u8]>>(files: &[(&str, Contents)]) -> Vec<u8> {
    use std::io::Write;

    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, contents) in files {
        archive.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(contents.as_ref()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// A URDF that has meshes, and the files of its archive: tetrahedra, as STL and as COLLADA.
pub fn meshed() -> [(&'static str, Vec<u8>); 3] {
    let urdf = br#"<robot name="meshed"><link name="body"><inertial><mass value="2"/>
        <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><geometry><mesh filename="meshes/body.stl" scale="0.5 0.5 0.5"/></geometry></collision>
        <collision><geometry><mesh filename="meshes/body.dae"/></geometry></collision></link>
        <link name="leg"><inertial><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="hip" type="revolute"><parent link="body"/><child link="leg"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" effort="5" velocity="8"/></joint></robot>"#;
    let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut mesh = vec![0; 80];
    mesh.extend(4_u32.to_le_bytes());
    for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        mesh.extend([0; 12]);
        mesh.extend(face.iter().flat_map(|corner| corners[*corner]).flat_map(f32::to_le_bytes));
        mesh.extend([0; 2]);
    }
    let document = br##"<COLLADA><asset><unit meter="0.1"/></asset><library_geometries><geometry id="g"><mesh>
        <source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
        <technique_common><accessor source="#a" count="4" stride="3"/></technique_common></source>
        <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
        <triangles count="2"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3</p></triangles>
        <polylist count="2"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3 3</vcount><p>0 3 2 1 2 3</p></polylist>
        </mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">
        <translate>0 0 1</translate><rotate>0 0 1 90</rotate><scale>1 2 1</scale><instance_geometry url="#g"/>
        </node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"##;
    [("robot.urdf", urdf.to_vec()), ("meshes/body.stl", mesh), ("meshes/body.dae", document.to_vec())]
}
