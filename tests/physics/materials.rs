//! Friction and restitution by link and by obstacle, against closed forms; joints whose range is a single value.

use std::sync::Arc;

use gaitwright_physics::character::{
    self, About, Friction, NoteKind, Options, Reading, Source, SurfaceMaterial,
};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Coordinates, Obstacle, Scene};
use gaitwright_physics::sim::{Command, Simulator, State};
use serde_json::{Value, json};

use crate::common;

const GRAVITY: f64 = 9.81;

fn read(document: &Value) -> Result<Reading, InputError> {
    character::read(document.to_string().as_bytes(), Source::Json, Options::default())
}

/// One link with one shape of 0.2 m and these fields besides.
fn single(shape: Value, more: Value) -> Arc<Model> {
    let mut link = json!({"name": "it", "density": 250, "shapes": [shape]});
    link.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let document = json!({"format": "gaitwright/character@1", "name": "it", "links": [link]});
    Arc::new(Model::new(Arc::new(read(&document).unwrap().character), Base::Floating))
}

fn cube(more: Value) -> Arc<Model> {
    single(json!({"kind": "box", "size": [0.2, 0.2, 0.2]}), more)
}

/// A table of 0.5 m with these fields besides its shape.
fn table(more: Value) -> Obstacle {
    let mut table = json!({"shape": {"kind": "box", "size": [20, 20, 1]}});
    table.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    serde_json::from_value(table).unwrap()
}

/// How far a cube slides that starts at 2 m/s at `height` (m) over the ground.
fn slides(model: &Arc<Model>, scene: &Scene, height: f64, coordinates: Coordinates) -> f64 {
    let accuracy = Accuracy { step: 0.001, coordinates, ..Accuracy::default() };
    let plan = common::plan(model, scene, &accuracy, None);
    let mut start = State::new(model);
    start.root.position.z = height + 0.1;
    start.root.linear_velocity.x = 2.0;
    let mut simulator = Simulator::new(plan, start);
    for _ in 0..2500 {
        simulator.step(Command::Passive).unwrap();
    }
    assert!(simulator.state().root.linear_velocity.norm() < 1e-9);
    simulator.state().root.position.x
}

#[test]
fn the_smaller_friction_of_both_sides_stops_a_sliding_cube() {
    let on_ground = Scene { friction: 0.8, ..Scene::default() };
    let on_table = |more: Value| Scene { obstacles: vec![table(more)], ground: None, ..on_ground.clone() };
    let plain = json!({});
    for (own, scene, height, wanted) in [
        (json!({"friction": 0.3}), on_ground.clone(), 0.0, 0.3),
        (json!({"friction": 1.5}), on_ground.clone(), 0.0, 0.8),
        (plain.clone(), on_table(json!({"friction": 0.2})), 0.5, 0.2),
        (json!({"friction": 0.5}), on_table(json!({"friction": 0.9})), 0.5, 0.5),
        (plain, on_table(json!({"friction": 0.9})), 0.5, 0.8),
    ] {
        let model = cube(own.clone());
        let expected = 2.0 * 2.0 / (2.0 * wanted * GRAVITY);
        for coordinates in [Coordinates::Reduced, Coordinates::Maximal] {
            // Half a step of 1 ms at 2 m/s is 1 mm: the first step is already slowed down.
            let error = slides(&model, &scene, height, coordinates) - expected;
            assert!(error.abs() < 2e-3, "{own} for friction {wanted}, {coordinates:?}: {error} m");
        }
    }
}

/// Height to which a ball of 0.1 m rises that falls by 1 m onto what is at `height` (m).
fn rises(model: &Arc<Model>, scene: &Scene, height: f64) -> f64 {
    let plan = common::plan(model, scene, &Accuracy { step: 0.0005, ..Accuracy::default() }, None);
    let mut start = State::new(model);
    start.root.position.z = height + 1.1;
    let mut simulator = Simulator::new(plan, start);
    let (mut landed, mut highest) = (false, 0.0_f64);
    for _ in 0..2000 {
        simulator.step(Command::Passive).unwrap();
        let root = simulator.state().root;
        landed |= root.linear_velocity.z > 0.0;
        highest = if landed { highest.max(root.position.z - height - 0.1) } else { highest };
    }
    highest
}

#[test]
fn the_greater_restitution_of_both_sides_throws_a_ball_back() {
    let ball = |more: Value| single(json!({"kind": "sphere", "radius": 0.1}), more);
    let dead = Scene::default();
    let on_table = |more: Value| Scene {
        obstacles: vec![table(more)],
        ground: None,
        restitution: 0.1,
        ..Scene::default()
    };
    for (own, scene, height, wanted) in [
        (json!({"restitution": 0.8}), dead.clone(), 0.0, 0.8),
        (json!({}), on_table(json!({"restitution": 0.6})), 0.5, 0.6),
        (json!({"restitution": 0.7}), on_table(json!({"restitution": 0.3})), 0.5, 0.7),
        (json!({"restitution": 0.0}), on_table(json!({})), 0.5, 0.1),
    ] {
        // A fall of 1 m takes 0.45 s; half a step of it, at 4.4 m/s, is 1 mm.
        let error = rises(&ball(own.clone()), &scene, height) - wanted * wanted;
        assert!(error.abs() < 4e-3, "{own} for restitution {wanted}: {error} m");
    }
}

#[test]
fn impossible_materials_are_refused_with_their_place() {
    let link = |more: Value| {
        let mut link = json!({"name": "it", "density": 250, "shapes": [{"kind": "sphere", "radius": 0.1}]});
        link.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        read(&json!({"format": "gaitwright/character@1", "name": "it", "links": [link]}))
    };
    for (more, reason) in [
        (json!({"friction": -0.1}), "must be a finite number of at least 0"),
        (json!({"restitution": 1.5}), "must lie between 0 and 1"),
    ] {
        let faults = link(more.clone()).unwrap_err();
        let faults = faults.faults();
        assert_eq!((faults.len(), faults[0].pointer.as_str()), (1, "/links/0"));
        assert!(faults[0].reason.contains(reason), "{faults:?}");
        let scene = Scene { obstacles: vec![table(more)], ..Scene::default() };
        let faults = scene.faults();
        assert_eq!(faults.len(), 1);
        assert!(faults[0].pointer.starts_with("/obstacles/0/") && faults[0].reason.contains(reason));
    }
}

const LEG: &str = r#"<robot name="leg">
<link name="hip"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="shin">
<inertial><origin xyz="0 0 -0.1"/><mass value="0.5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><sphere radius="0.02"/></geometry></collision>
</link>
<joint name="knee" type="revolute">
<parent link="hip"/><child link="shin"/><origin xyz="0 0 -0.2" rpy="0.1 0 0.3"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="10" velocity="5"/>
</joint>
</robot>"#;

fn leg(gazebo: &str) -> Result<Reading, InputError> {
    let text = LEG.replace("</robot>", &format!("{gazebo}</robot>"));
    character::read(text.as_bytes(), Source::Urdf, Options::default())
}

#[test]
fn a_link_takes_its_friction_from_gazebo() {
    let shin = |gazebo: &str| leg(gazebo).unwrap().character.links[1].surface;
    let of =
        |friction: f64| SurfaceMaterial { friction: Some(Friction::Uniform(friction)), restitution: None };
    assert_eq!(shin(r#"<gazebo reference="shin"><mu1>0.6</mu1><mu2>0.6</mu2></gazebo>"#), of(0.6));
    assert_eq!(shin(r#"<gazebo reference="shin"><mu> 0.3 </mu></gazebo>"#), of(0.3));
    assert_eq!(shin(r#"<gazebo reference="shin"><mu1 value="0.9"/></gazebo>"#), of(0.9));
    assert_eq!(shin(r#"<gazebo reference="nobody"><mu1>0.6</mu1></gazebo>"#), SurfaceMaterial::default());
    let reading =
        leg(r#"<gazebo reference="shin"><mu1>0.6</mu1><mu2>0.4</mu2><kp>1e6</kp></gazebo>"#).unwrap();
    assert_eq!(reading.character.links[1].surface, of(0.4));
    let notes: Vec<(NoteKind, &str)> =
        reading.notes.iter().map(|note| (note.kind, note.message.as_str())).collect();
    assert_eq!(
        notes,
        [
            (
                NoteKind::Approximated,
                "<gazebo> has the friction 0.6 along and 0.4 across, without one <fdir1> for all collisions; \
                 0.4 is taken for both"
            ),
            (NoteKind::Ignored, "<kp> in <gazebo> is not used (once)"),
        ]
    );
    let faults = leg(r#"<gazebo reference="shin"><mu1>rough</mu1></gazebo>"#).unwrap_err();
    assert!(faults.to_string().contains("<mu1> is \"rough\", which is not a finite number"), "{faults}");
    assert!(leg(r#"<gazebo reference="shin"><mu1>-1</mu1></gazebo>"#).is_err());
}

/// A hinge whose range is one angle is the fixed joint turned by that angle, and a slide likewise.
#[test]
fn a_range_of_one_value_fixes_the_joint_there() {
    for kind in ["revolute", "prismatic"] {
        let free = LEG.replace("revolute", kind);
        let welded = free.replace(r#"lower="-1" upper="1""#, r#"lower="0.4" upper="0.4""#);
        let read = |text: &str| character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
        let Reading { character, notes } = read(&welded);
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert_eq!(notes[0].about, About::Joint("knee".into()));
        assert!(notes[0].message.contains("it is fixed at 0.4"), "{notes:?}");
        let fixed = Model::new(Arc::new(character), Base::Floating);
        assert_eq!(fixed.joint_count(), 0);
        let moving = Arc::new(Model::new(Arc::new(read(&free).character), Base::Floating));
        let mut bent = State::new(&moving);
        bent.angles[0] = 0.4;
        let [own, other] = [(&fixed, &State::new(&fixed)), (&*moving, &bent)]
            .map(|(model, state)| gaitwright_physics::sim::link_poses(model, state)[1]);
        let apart = own.inverse() * other;
        assert!(apart.translation.vector.norm() < 1e-12 && apart.rotation.angle() < 1e-12, "{kind}: {apart}");
    }
}

#[test]
fn a_json_joint_with_a_range_of_one_value_is_fixed_too() {
    let ball =
        |name: &str| json!({"name": name, "density": 250, "shapes": [{"kind": "sphere", "radius": 0.1}]});
    let document = |upper: f64| {
        json!({"format": "gaitwright/character@1", "name": "pair", "links": [ball("a"), ball("b")],
            "joints": [{"name": "j", "kind": "revolute", "parent": "a", "child": "b", "axis": [0, 1, 0],
                        "origin": {"position": [0, 0, -0.5]}, "limits": {"lower": 0.2, "upper": upper}}],
            "standing": {"j": 0.2}})
    };
    let Reading { character, notes } = read(&document(0.2)).unwrap();
    assert_eq!((notes.len(), notes[0].kind), (1, NoteKind::Repaired));
    // What the standing pose says of it is said by the joint itself.
    assert_eq!(character.standing, Some(Vec::new()));
    assert_eq!(Model::new(Arc::new(character), Base::Floating).joint_count(), 0);
    assert!(read(&document(0.1)).is_err());
}
