//! Characters that cannot be read: each fault is named with its place, and hostile input ends in an
//! error.

use std::io::Cursor;

use gaitwright_physics::character::{self, NoteKind, Options, Source};
use gaitwright_physics::fault::{Fault, InputError};
use serde_json::{Value, json};
use zip::write::{SimpleFileOptions, ZipWriter};

use crate::character_shapes::zipped;

fn refuse(bytes: &[u8], source: Source) -> InputError {
    character::read(bytes, source, Options::default()).expect_err("it is refused")
}

fn impossible(bytes: &[u8], source: Source) -> Vec<Fault> {
    match refuse(bytes, source) {
        InputError::Impossible(faults) => faults,
        other => panic!("well-formed, but refused as {other:?}"),
    }
}

/// Checks that there is exactly one fault, at `place` and saying `reason`.
fn one_fault(faults: &[Fault], place: &str, reason: &str) {
    let [fault] = faults else { panic!("one fault about {reason:?} was expected, not {faults:#?}") };
    assert!(fault.pointer.contains(place), "{fault} is not at {place}");
    assert!(fault.reason.contains(reason), "{fault} does not say {reason:?}");
}

#[test]
fn a_fault_is_seen_from_the_whole_and_from_its_part() {
    let part = InputError::Impossible(vec![
        Fault::new("", "empty"),
        Fault::new("/links/0", "unknown"),
        Fault::new("line 4, link \"shin\"", "heavy"),
    ]);
    let whole = part.clone().under("/character");
    assert_eq!(
        whole.to_string(),
        r#"/character: empty; /character/links/0: unknown; /character: line 4, link "shin": heavy"#
    );
    assert_eq!(whole.within("/character"), Some(part));
    // A place beside it is none within it, however it begins; nor is one of several.
    assert_eq!(InputError::impossible("/characters/0", "").within("/character"), None);
    let both = vec![Fault::new("/character", ""), Fault::new("/seed", "")];
    assert_eq!(InputError::Impossible(both).within("/character"), None);
}

const LEG: &str = r#"<robot name="leg">
<link name="hip"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="shin">
<inertial><origin xyz="0 0 -0.1"/><mass value="0.5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><sphere radius="0.02"/></geometry></collision>
</link>
<joint name="knee" type="revolute">
<parent link="hip"/><child link="shin"/><origin xyz="0 0 -0.2"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="10" velocity="5"/>
<dynamics damping="0.1" friction="0"/>
</joint>
</robot>"#;

#[test]
fn the_leg_itself_is_free_of_faults_and_notes() {
    let reading = character::read(LEG.as_bytes(), Source::Urdf, Options { strict: true }).unwrap();
    assert!(reading.notes.is_empty());
}

#[test]
fn every_fault_of_a_urdf_is_named_with_its_line_and_element() {
    let shin = r#"line 4, link "shin""#;
    let knee = r#"line 7, joint "knee""#;
    let cases = [
        (r#"<mass value="0.5"/>"#, r#"<mass value="-0.5"/>"#, shin, "the mass is -0.5 kg"),
        (r#"<mass value="0.5"/>"#, r#"<mass value="NaN"/>"#, shin, "not a finite number"),
        (r#"<mass value="0.5"/>"#, r#"<mass value="inf"/>"#, shin, "not a finite number"),
        (r#"<mass value="0.5"/>"#, r#"<mass value="1e999"/>"#, shin, "not a finite number"),
        (r#"<mass value="0.5"/>"#, r#"<mass value="half"/>"#, shin, "not a number"),
        (r#"<mass value="0.5"/>"#, r#"<mass value="${m}"/>"#, shin, "xacro"),
        (r#"<mass value="0.5"/>"#, r#"<mass value="1 2"/>"#, shin, "2 numbers instead of 1"),
        (r#"<mass value="0.5"/>"#, "<mass/>", shin, "has no value"),
        (r#"<mass value="0.5"/>"#, "", shin, "no <mass>"),
        (r#"xyz="0 0 -0.1""#, r#"xyz="0 0""#, shin, "2 numbers instead of 3"),
        (r#"xyz="0 0 -0.1""#, r#"rpy="0 0 0 1""#, shin, "4 numbers instead of 3"),
        (r#"xyz="0 0 -0.1""#, r#"xyz="0 0 1e9""#, shin, "the centre of mass must be finite and within"),
        (r#"<sphere radius="0.02"/>"#, "", r#"line 5, link "shin""#, "<geometry> is empty"),
        (r#"<sphere radius="0.02"/>"#, "<cone/>", r#"line 5, link "shin""#, "<cone> is not a known shape"),
        (r#"radius="0.02""#, r#"radius="0""#, r#"line 5, link "shin""#, "must be positive"),
        (r#"<geometry><sphere radius="0.02"/></geometry>"#, "", r#"line 5, link "shin""#, "no <geometry>"),
        (r#"radius="0.02""#, "", r#"line 5, link "shin""#, "no radius"),
        (r#"<sphere radius="0.02"/>"#, "<mesh/>", r#"line 5, link "shin""#, "no filename"),
        (
            r#"<sphere radius="0.02"/>"#,
            r#"<mesh filename="a.stl" scale="1 0 1"/>"#,
            r#"line 5, link "shin""#,
            "has a zero",
        ),
        (r#"type="revolute""#, r#"type="ball""#, knee, "not a known type"),
        (r#"type="revolute""#, r#"type="planar""#, knee, r#""planar" are not supported"#),
        (r#"type="revolute""#, r#"type="floating""#, knee, r#""floating" are not supported"#),
        (r#"type="revolute""#, "", knee, "no type"),
        (r#"name="knee" "#, "", "line 7", "a <joint> has no name"),
        (r#"<parent link="hip"/>"#, "", knee, "no <parent>"),
        (
            r#"<parent link="hip"/>"#,
            r#"<parent link="hop"/>"#,
            r#"line 8, joint "knee""#,
            r#""hop" does not exist"#,
        ),
        (
            r#"<child link="shin"/>"#,
            r#"<child link="chin"/>"#,
            r#"line 8, joint "knee""#,
            r#""chin" does not exist"#,
        ),
        (r#"<child link="shin"/>"#, "<child/>", r#"line 8, joint "knee""#, "names no link"),
        (r#"<axis xyz="0 1 0"/>"#, r#"<axis xyz="0 0 0"/>"#, r#"line 8, joint "knee""#, "the axis is zero"),
        (
            r#"<axis xyz="0 1 0"/>"#,
            r#"<axis xyz="0 1"/>"#,
            r#"line 8, joint "knee""#,
            "2 numbers instead of 3",
        ),
        (
            r#"lower="-1" upper="1""#,
            r#"lower="1" upper="-1""#,
            r#"line 9, joint "knee""#,
            "must not be greater than",
        ),
        (r#"effort="10""#, r#"effort="-10""#, r#"line 9, joint "knee""#, "must be positive"),
        (r#"velocity="5""#, r#"velocity="-5""#, r#"line 9, joint "knee""#, "must be positive"),
        (r#"damping="0.1""#, r#"damping="-0.1""#, r#"line 10, joint "knee""#, "must not be negative"),
        (r#"friction="0""#, r#"friction="-1""#, r#"line 10, joint "knee""#, "must not be negative"),
        (
            "</robot>",
            r#"<joint name="more" type="fixed"><parent link="shin"/><child link="hip"/></joint></robot>"#,
            "link \"",
            "joined in a cycle",
        ),
        (
            "</robot>",
            r#"<joint name="more" type="fixed"><parent link="hip"/><child link="shin"/></joint></robot>"#,
            r#"line 12, joint "more""#,
            r#"child of joint "knee" already"#,
        ),
        ("</robot>", r#"<link name="lone"/></robot>"#, r#"line 12, link "lone""#, "both have no parent"),
        ("</robot>", r#"<link name="shin"/></robot>"#, r#"line 12, link "shin""#, "another link"),
        (
            "</robot>",
            r#"<link name="toe"/><joint name="knee" type="fixed"><parent link="shin"/><child link="toe"/></joint></robot>"#,
            r#"line 12, joint "knee""#,
            "another joint",
        ),
        ("</robot>", "<link/></robot>", "line 12", "a <link> has no name"),
        ("</robot>", "<link name=\" \"/></robot>", "line 12", "the name is empty"),
    ];
    for (from, to, place, reason) in cases {
        assert_eq!(LEG.matches(from).count(), 1, "{from}");
        let text = LEG.replace(from, to);
        let faults = impossible(text.as_bytes(), Source::Urdf);
        one_fault(&faults, place, reason);
    }
}

#[test]
fn all_faults_are_found_and_not_only_the_first() {
    let text = LEG
        .replace(r#"<mass value="0.5"/>"#, r#"<mass value="-0.5"/>"#)
        .replace(r#"radius="0.02""#, r#"radius="-1""#)
        .replace(r#"<axis xyz="0 1 0"/>"#, r#"<axis xyz="0 0 0"/>"#)
        .replace(r#"damping="0.1""#, r#"damping="none""#)
        .replace(r#"lower="-1" upper="1""#, r#"lower="1" upper="-1""#);
    assert_eq!(impossible(text.as_bytes(), Source::Urdf).len(), 5);

    let mut changed = document();
    changed["name"] = json!("");
    changed["links"][0]["mass"] = json!(-1);
    changed["joints"][0]["axis"] = json!([0, 0, 0]);
    let faults = impossible(changed.to_string().as_bytes(), Source::Json);
    let places: Vec<&str> = faults.iter().map(|fault| fault.pointer.as_str()).collect();
    assert_eq!(places, ["/name", "/links/0/mass", "/joints/0/axis"]);
}

#[test]
fn a_character_without_mass_or_links_is_impossible() {
    let massless = r#"<robot name="ghost"><link name="a"/></robot>"#;
    one_fault(&impossible(massless.as_bytes(), Source::Urdf), "", "no link has a mass");
    one_fault(&impossible(b"<robot name=\"nothing\"/>", Source::Urdf), "", "there is no link");
    let circle = r#"<robot name="circle"><link name="a"/>
        <joint name="j" type="fixed"><parent link="a"/><child link="a"/></joint></robot>"#;
    one_fault(&impossible(circle.as_bytes(), Source::Urdf), "link \"a\"", "joins the link \"a\" to itself");
}

#[test]
fn a_document_that_is_no_urdf_is_malformed() {
    for (text, place, reason) in [
        ("<robot name=\"a\"><link></robot>", "line 1, column", "not well-formed XML"),
        ("\n<sdf><link/></sdf>", "line", "the root element is <sdf>"),
        ("<!DOCTYPE r [<!ENTITY a \"b\">]><robot>&a;</robot>", "", "document type"),
        ("", "", "not well-formed XML"),
    ] {
        let InputError::Malformed(fault) = refuse(text.as_bytes(), Source::Urdf) else { panic!("{text}") };
        assert!(fault.pointer.starts_with(place) && fault.reason.contains(reason), "{fault}");
    }
    let InputError::Malformed(fault) = refuse(b"<robot>\n\xff</robot>", Source::Urdf) else { panic!() };
    assert_eq!((fault.pointer.as_str(), fault.reason.as_str()), ("line 2", "the document is not UTF-8 text"));
}

#[test]
fn strictness_turns_repairs_into_faults() {
    let strict = |from: &str, to: &str, place: &str, reason: &str| {
        assert_eq!(LEG.matches(from).count(), 1, "{from}");
        let text = LEG.replace(from, to);
        assert!(character::read(text.as_bytes(), Source::Urdf, Options::default()).is_ok(), "{reason}");
        match character::read(text.as_bytes(), Source::Urdf, Options { strict: true }) {
            Err(InputError::Impossible(faults)) => one_fault(&faults, place, reason),
            other => panic!("{reason}: {other:?}"),
        }
    };
    let limit = r#"line 9, joint "knee""#;
    strict(r#"effort="10" "#, "", limit, "no effort");
    strict(r#"effort="10""#, r#"effort="0""#, limit, "effort of <limit> is 0");
    strict(r#"velocity="5""#, r#"velocity="0""#, limit, "velocity of <limit> is 0");
    strict(r#"lower="-1" upper="1""#, "", limit, "no range");
    strict(r#"lower="-1" upper="1""#, r#"lower="1" upper="1""#, limit, "is empty");
    strict(r#"lower="-1" upper="1""#, r#"upper="1""#, limit, "no lower");
    strict("</joint>", r#"<mimic joint="x"/></joint>"#, r#"line 11, joint "knee""#, "moves on its own");
    strict(
        "</joint>",
        r#"<limit lower="0" upper="1" effort="1" velocity="1"/></joint>"#,
        r#"line 11, joint "knee""#,
        "more than one <limit>",
    );
    strict(
        r#"<sphere radius="0.02"/>"#,
        r#"<mesh filename="a.dae"/>"#,
        r#"line 5, link "shin""#,
        "not supplied",
    );
}

#[test]
fn elements_for_other_programs_are_noted_once_a_kind() {
    let text = LEG.replace("</robot>", "<gazebo/><gazebo><kp/></gazebo><transmission/></robot>");
    let text = text.replace("</joint>", "<safety_controller/><calibration/></joint>");
    let text = text.replace(
        "<sphere radius=\"0.02\"/></geometry>",
        "<sphere radius=\"0.02\"/></geometry><origin xyz=\"0 0 1\"/>",
    );
    let text = text.replace("</link>\n<joint", "<visual><geometry><box size=\"1 1 1\"/></geometry><material name=\"m\"><texture/></material></visual></link>\n<joint");
    let reading = character::read(text.as_bytes(), Source::Urdf, Options { strict: true }).unwrap();
    let messages: Vec<_> = reading.notes.iter().map(|note| note.message.as_str()).collect();
    assert_eq!(messages.len(), 4, "{messages:?}");
    assert!(messages.contains(&"<gazebo> in <robot> is not used (2 times)"), "{messages:?}");
    assert_eq!(reading.character.links[1].collisions[0].pose.translation.z, 1.0);
}

fn document() -> Value {
    json!({
        "format": "gaitwright/character@1", "name": "leg",
        "links": [
            {"name": "hip", "mass": 1.0, "inertia": {"xx": 1, "yy": 1, "zz": 1}},
            {"name": "shin", "density": 1000, "shapes": [{"kind": "sphere", "radius": 0.05}]}
        ],
        "joints": [
            {"name": "knee", "kind": "revolute", "parent": "hip", "child": "shin", "axis": [0, 1, 0],
             "limits": {"lower": -1, "upper": 1}, "actuation": {"max_torque": 10, "max_speed": 5}, "damping": 0.1}
        ],
        "standing": {"knee": 0.5}
    })
}

#[test]
fn every_fault_of_a_json_character_is_named_with_its_pointer() {
    assert!(
        character::read(document().to_string().as_bytes(), Source::Json, Options { strict: true }).is_ok()
    );
    let cases = [
        ("/format", json!("gaitwright/character@2"), "/format", "expected `gaitwright/character@1`"),
        ("/links/0/mass", json!(-1), "/links/0/mass", "the mass is -1.0 kg"),
        ("/links/0/mass", json!("one"), "/links/0/mass", "invalid type"),
        ("/links/0/mass", json!(1e300), "/links/0/mass", "must be from 0"),
        ("/links/0/density", json!(1.0), "/links/0/density", "not both"),
        ("/links/0/inertia", Value::Null, "/links/0", "without an inertia"),
        ("/links/0/weight", json!(1), "/links/0", "unknown field `weight`"),
        ("/links/1/density", json!(0), "/links/1/density", "must be positive"),
        ("/links/1/density", Value::Null, "/links/1/density", ""),
        ("/links/1/center_of_mass", json!([0, 0, 1]), "/links/1/density", "where a density is given"),
        ("/links/1/shapes", json!([]), "/links/1/density", "no shape with a volume"),
        ("/links/1/shapes/0/radius", json!(-0.05), "/links/1/", ""),
        ("/links/1/shapes/0/kind", json!("cone"), "/links/1/shapes/0", "unknown variant `cone`"),
        (
            "/links/1/shapes/0/pose",
            json!({"orientation": [0, 0, 0, 0]}),
            "/links/1/shapes/0/pose/orientation",
            "no length",
        ),
        (
            "/links/1/shapes/0/pose",
            json!({"orientation": [1, 0, 0, 0], "rpy": [0, 0, 0]}),
            "/links/1/shapes/0/pose",
            "not both",
        ),
        ("/links/1/name", json!("hip"), "/links/1/name", "another link"),
        ("/links/1/name", json!(" "), "/links/1/name", "empty"),
        ("/joints/0/parent", json!("hop"), "/joints/0/parent", "does not exist"),
        ("/joints/0/child", json!("hip"), "", ""),
        ("/joints/0/kind", json!("planar"), "/joints/0/kind", "unknown variant `planar`"),
        ("/joints/0/kind", json!("continuous"), "/joints/0/limits", "has no limits"),
        ("/joints/0/axis", json!([0, 0, 0]), "/joints/0/axis", "the axis is zero"),
        ("/joints/0/axis", json!([0, 0]), "/joints/0/axis", "invalid length 2"),
        ("/joints/0/limits/lower", json!(2), "/joints/0/limits", "must not be greater than"),
        ("/joints/0/actuation/max_torque", json!(0), "/joints/0/actuation/max_torque", "must be positive"),
        ("/joints/0/actuation/max_speed", json!(-1), "/joints/0/actuation/max_speed", "must be positive"),
        ("/joints/0/damping", json!(-1), "/joints/0/damping", "must not be negative"),
        ("/joints/0/friction", json!(-1), "/joints/0/friction", "must not be negative"),
        ("/joints/0/armature", json!(-1), "/joints/0/armature", "must not be negative"),
        ("/standing/knee", json!(1.5), "/standing/knee", "outside of the joint's range"),
        ("/standing/a~1b", json!(0), "/standing/a~1b", "there is no joint \"a/b\""),
    ];
    for (path, value, place, reason) in cases {
        let mut changed = document();
        let (parent, key) = path.rsplit_once('/').unwrap();
        let key = key.replace("~1", "/");
        changed.pointer_mut(parent).unwrap()[key] = value;
        let text = changed.to_string();
        if path == "/links/1/density" && reason.is_empty() {
            // Neither density nor mass: a link without mass at the end of a joint is mended, noted.
            let reading = character::read(text.as_bytes(), Source::Json, Options::default()).unwrap();
            assert_eq!(reading.notes.len(), 1);
            continue;
        }
        let faults = impossible(text.as_bytes(), Source::Json);
        assert!(faults[0].pointer.starts_with(place), "{path}: {faults:?}");
        assert!(faults.iter().any(|fault| fault.reason.contains(reason)), "{path}: {faults:?}");
    }
}

#[test]
fn json_that_is_none_is_malformed_with_line_and_column() {
    for text in ["{\"format\": \n nope}", "{", "{\"format\": NaN}", ""] {
        let InputError::Malformed(fault) = refuse(text.as_bytes(), Source::Json) else { panic!("{text}") };
        assert!(fault.pointer.starts_with("line ") && fault.pointer.contains("column"), "{fault}");
    }
    // More than a double holds, and something after the document.
    let text = document().to_string();
    for text in [text.replace("1000", "1e999"), format!("{text} {{}}")] {
        assert!(matches!(refuse(text.as_bytes(), Source::Json), InputError::Malformed(_)), "{text}");
    }
    let nested = format!("{{\"links\": {}", "[".repeat(100_000));
    assert!(!refuse(nested.as_bytes(), Source::Json).faults().is_empty());
}

#[test]
fn deeply_nested_xml_is_refused_with_its_line() {
    // 30 kB nested 4000 deep, which overflows the stack of readers that recurse.
    let text = format!("<robot>\n{}{}</robot>", "<a>".repeat(4000), "</a>".repeat(4000));
    let InputError::TooLarge(fault) = refuse(text.as_bytes(), Source::Urdf) else { panic!() };
    assert_eq!(fault.pointer, "line 2");
    assert!(fault.reason.contains("64 deep"), "{fault}");
    let deepest = format!("<robot>{}{}</robot>", "<a>".repeat(1_000_000), "</a>".repeat(1_000_000));
    assert!(matches!(refuse(deepest.as_bytes(), Source::Urdf), InputError::TooLarge(_)));
}

#[test]
fn too_much_of_anything_is_refused() {
    let large = |bytes: &[u8], source| assert!(matches!(refuse(bytes, source), InputError::TooLarge(_)));
    let rubbish: Vec<u8> = (0..10_000_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    large(&rubbish, Source::Urdf);
    large(&rubbish, Source::Json);
    large(&[b' '; 33 << 20], Source::Zip);
    assert!(matches!(refuse(&rubbish, Source::Zip), InputError::Malformed(_)));
    let links: String = (0..1001).map(|i| format!("<link name=\"{i}\"/>")).collect();
    large(format!("<robot name=\"many\">{links}</robot>").as_bytes(), Source::Urdf);
    // Every pair of shapes is looked at.
    let shapes = r#"{"kind": "sphere", "radius": 1},"#.repeat(4001);
    let ball = format!(r#"{{"name": "ball", "density": 1, "shapes": [{}]}}"#, shapes.trim_end_matches(','));
    let many =
        format!(r#"{{"format": "gaitwright/character@1", "name": "many", "links": [{ball}], "joints": []}}"#);
    large(many.as_bytes(), Source::Json);
    let mut many = document();
    many["links"] = (0..1001).map(|i| json!({"name": i.to_string()})).collect();
    large(many.to_string().as_bytes(), Source::Json);
    let nodes = format!("<robot name=\"many\">{}</robot>", "<a/>".repeat(250_000));
    large(nodes.as_bytes(), Source::Urdf);
}

#[test]
fn long_names_are_refused_before_they_are_repeated() {
    // One name of 1 MB and 10 000 faults that would each repeat it.
    let name = "n".repeat(1 << 20);
    let parts = "<collision/>".repeat(10_000);
    let text = format!("<robot name=\"r\"><link name=\"{name}\">{parts}</link></robot>");
    let faults = impossible(text.as_bytes(), Source::Urdf);
    one_fault(&faults[..1], "line 1", "the name is 1048576 bytes long");
    assert!(faults.iter().map(|fault| fault.to_string().len()).sum::<usize>() < 1000);
    let robot = format!("<robot name=\"{name}\"/>");
    one_fault(&impossible(robot.as_bytes(), Source::Urdf), "", "the name is 1048576 bytes long");
    let mut long = document();
    long["links"][1]["name"] = name.into();
    one_fault(&impossible(long.to_string().as_bytes(), Source::Json), "/links/1/name", "bytes long");
}

#[test]
fn a_chain_of_a_thousand_links_is_read() {
    let link = |i: usize| {
        format!(
            "<link name=\"l{i}\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>"
        )
    };
    let joint = |i: usize| {
        format!(
            "<joint name=\"j{i}\" type=\"continuous\"><parent link=\"l{}\"/><child link=\"l{i}\"/></joint>",
            i - 1
        )
    };
    let parts: String = (0..1000).map(link).chain((1..1000).rev().map(joint)).collect();
    let text = format!("<robot name=\"chain\">{parts}</robot>");
    let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
    assert!(reading.character.links.iter().enumerate().all(|(i, link)| link.name == format!("l{i}")));
}

fn with_mesh(file: &str) -> String {
    LEG.replace(r#"<sphere radius="0.02"/>"#, &format!(r#"<mesh filename="{file}"/>"#))
}

#[test]
fn an_archive_that_inflates_without_end_is_refused() {
    let zeros = vec![0; 80 << 20];
    let bomb = zipped(&[("leg.urdf", LEG.as_bytes()), ("bomb.stl", &zeros)]);
    assert!(bomb.len() < 1 << 20, "it is small itself");
    let InputError::TooLarge(fault) = refuse(&bomb, Source::Zip) else { panic!() };
    assert!(fault.pointer.contains("bomb.stl"), "{fault}");
    // Noise does not deflate: the bound on the sum of all files.
    let noise: Vec<u8> =
        (0..(11_u32 << 20)).map(|i| (i.wrapping_mul(2_654_435_761) >> 20) as u8 & 15).collect();
    let names = ["a", "b", "c", "d", "e", "f", "g"];
    let heavy = zipped(&names.map(|name| (name, noise.as_slice())));
    match refuse(&heavy, Source::Zip) {
        InputError::TooLarge(fault) => assert!(fault.reason.contains("inflates to more than"), "{fault}"),
        other => panic!("{other}"),
    }
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for index in 0..2001 {
        writer.start_file(index.to_string(), SimpleFileOptions::default()).unwrap();
    }
    let crowd = writer.finish().unwrap().into_inner();
    assert!(matches!(refuse(&crowd, Source::Zip), InputError::TooLarge(_)));
}

#[test]
fn paths_out_of_an_archive_are_refused() {
    for name in ["../evil.stl", "a/../../evil.stl", "/etc/passwd", "C:\\evil.stl", "..\\evil.stl"] {
        let archive = zipped(&[("leg.urdf", LEG.as_bytes()), (name, b"x")]);
        let faults = impossible(&archive, Source::Zip);
        one_fault(&faults, "entry", "leads out of the archive");
    }
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    writer.add_symlink("link.stl", "/etc/passwd", SimpleFileOptions::default()).unwrap();
    let archive = writer.finish().unwrap().into_inner();
    one_fault(&impossible(&archive, Source::Zip), "link.stl", "symbolic links");
}

#[test]
fn meshes_from_elsewhere_are_refused_and_named() {
    let references =
        ["http://example.com/a.stl", "file:///etc/passwd", "/etc/passwd", "C:\\a.stl", "model://a/a.stl"];
    for reference in references {
        let text = with_mesh(reference);
        for (bytes, source) in
            [(text.clone().into_bytes(), Source::Urdf), (zipped(&[("a.urdf", text.as_bytes())]), Source::Zip)]
        {
            one_fault(&impossible(&bytes, source), r#"line 5, link "shin""#, "URL or an absolute path");
        }
    }
    for reference in ["../../a.stl", "package://leg/../../../a.stl"] {
        let archive = zipped(&[("leg/leg.urdf", with_mesh(reference).as_bytes())]);
        one_fault(&impossible(&archive, Source::Zip), r#"line 5, link "shin""#, "leads out of the archive");
    }
}

#[test]
fn broken_meshes_are_named() {
    let mut hostile = vec![b' '; 80];
    hostile.extend(u32::MAX.to_le_bytes());
    let infinite = b"v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3\n";
    let meshes: [(&str, &[u8], &str); 6] = [
        ("a.stl", &hostile, "neither an ASCII one nor as long as its triangle count says"),
        ("a.stl", b"solid x\nfacet normal 0 0", "bad STL file"),
        ("a.stl", b"", "neither an ASCII one"),
        ("a.obj", b"v 0 0 0\nf 1 2 3\n", "bad OBJ file"),
        ("a.obj", b"v 0 0 0\n", "no triangles"),
        ("a.obj", infinite, "not finite"),
    ];
    for (name, bytes, reason) in meshes {
        let archive = zipped(&[("leg.urdf", with_mesh(name).as_bytes()), (name, bytes)]);
        let faults = impossible(&archive, Source::Zip);
        one_fault(&faults, r#"line 5, link "shin""#, reason);
        one_fault(&faults, "", &format!("the mesh {name:?}: "));
    }
}

#[test]
fn one_large_mesh_referred_to_a_hundred_times_is_refused() {
    let count = 40_000_u32;
    let mut mesh = vec![b' '; 80];
    mesh.extend(count.to_le_bytes());
    // Bytes below 64, so that every number is finite.
    mesh.extend((0..50 * count).map(|i| (i.wrapping_mul(2_654_435_761) >> 20) as u8 & 63));
    let visual = r#"<visual><geometry><mesh filename="a.stl"/></geometry></visual>"#;
    let text = LEG.replace("</link>\n<joint", &format!("{}</link>\n<joint", visual.repeat(100)));
    let faults = impossible(&zipped(&[("leg.urdf", text.as_bytes()), ("a.stl", &mesh)]), Source::Zip);
    assert!(faults.iter().all(|fault| fault.reason.contains("too large altogether")), "{faults:?}");
    assert!(faults[0].pointer.contains(r#"link "shin""#));
}

#[test]
fn an_archive_holds_one_urdf() {
    one_fault(&impossible(&zipped(&[("a.txt", b"")]), Source::Zip), "", "no .urdf file");
    let two = zipped(&[("a.urdf", LEG.as_bytes()), ("b.urdf", LEG.as_bytes())]);
    one_fault(&impossible(&two, Source::Zip), "", "several .urdf files (a.urdf, b.urdf)");
    let nested = zipped(&[("leg/a.urdf", LEG.as_bytes()), ("leg/old/b.urdf", b"<robot/>")]);
    assert!(character::read(&nested, Source::Zip, Options { strict: true }).is_ok());
    // What macOS packs beside every file.
    let forks = [("leg/a.urdf", LEG.as_bytes()), ("__MACOSX/leg/._a.urdf", b"\0\x05\x16\x07")];
    assert!(character::read(&zipped(&forks), Source::Zip, Options { strict: true }).is_ok());
}

/// Another kind of document is told by its format, not by the first field that a character does not have.
#[test]
fn a_document_of_another_kind_is_named() {
    let scenario = json!({ "format": "gaitwright/scenario@1", "character": {}, "duration": 1 });
    let faults = impossible(scenario.to_string().as_bytes(), Source::Json);
    one_fault(
        &faults,
        "/format",
        "says that it is `gaitwright/scenario@1`, expected `gaitwright/character@1`",
    );
    let InputError::Malformed(fault) = refuse(LEG.as_bytes(), Source::Json) else { panic!() };
    assert!(fault.reason.contains("begins as XML does"), "{fault}");
}

/// The notes of `text`, by what they are about, that keep something as given.
fn kept(text: &str) -> Vec<String> {
    let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
    let kept = reading.notes.iter().filter(|note| note.kind == NoteKind::Kept);
    kept.map(|note| format!("{:?}: {}", note.about, note.message)).collect()
}

#[test]
fn degrees_and_millimetres_are_kept_and_told() {
    assert_eq!(LEG.matches(r#"lower="-1" upper="1""#).count(), 1, "the leg's range");
    let ranged = |range: [f64; 2]| {
        let [lower, upper] = range;
        kept(&LEG.replace(r#"lower="-1" upper="1""#, &format!(r#"lower="{lower}" upper="{upper}""#)))
    };
    for degrees in [[-90.0, 90.0], [0.0, 180.0], [-360.0, 360.0]] {
        let notes = ranged(degrees);
        assert!(notes.len() == 1 && notes[0].contains("are these degrees?"), "{notes:?}");
    }
    // Of radians, and of no limit at all.
    for radians in [[-6.3, 6.3], [-12.0, 0.0], [-1e6, 1e6]] {
        assert!(ranged(radians).is_empty(), "{radians:?}");
    }
    let balls = |radius: f64| kept(&LEG.replace(r#"radius="0.02""#, &format!(r#"radius="{radius}""#)));
    assert!(balls(0.02).is_empty() && balls(20.0).is_empty());
    let notes = balls(200.0);
    assert!(notes.len() == 1 && notes[0].contains("shin") && notes[0].contains("millimetres"), "{notes:?}");
}

#[test]
fn a_file_that_is_no_character_is_malformed() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none.urdf");
    let Err(InputError::Malformed(fault)) = character::read_file(&missing, Options::default()) else {
        panic!()
    };
    // Whoever named the file names it in the message.
    assert!(fault.pointer.is_empty() && fault.reason.contains("cannot be read"), "{fault}");
    let empty = folder.path().join("empty.urdf");
    std::fs::write(&empty, "").unwrap();
    let Err(InputError::Malformed(fault)) = character::read_file(&empty, Options::default()) else {
        panic!()
    };
    assert_eq!(fault.reason, "is empty");
    let text = folder.path().join("text.txt");
    std::fs::write(&text, "hello").unwrap();
    let Err(InputError::Malformed(fault)) = character::read_file(&text, Options::default()) else { panic!() };
    assert!(fault.reason.contains("neither a URDF"), "{fault}");
}
