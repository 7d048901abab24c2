//! The layout a viewer opens the recording with.
//!
//! The SDK's own layout types have no place for a view's eye and what it follows, so the
//! layout's entities are written here as a viewer reads them: `container/<id>`, `view/<id>`,
//! `view/<id>/<property>`, `viewport` and the panels.

use re_sdk::external::re_log_types::BlueprintActivationCommand;

use re_sdk::sink::MemorySink;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamError};
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, TimeAxis,
    TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use re_sdk_types::blueprint::components::{
    BackgroundKind, ContainerKind, Corner2D, Eye3DKind, LoopMode, PanelState, PlayState,
};
use re_sdk_types::components::Plane3D;
use re_sdk_types::datatypes::{TimeInt, TimeRange, TimeRangeBoundary};
use uuid::Uuid;

use super::appearance::Appearance;
use super::paths::APPLICATION;
use super::{paths, scenery};
use gaitwright_learning::learn::reference_gravity;
use gaitwright_physics::scene::Scene;

/// Joints are shown from so long before the time cursor to so long after it, √(size / g).
const SHOWN: [f64; 2] = [-6.0, 2.0];

/// Sends the layout for a character of this appearance through `stream`.
pub(super) fn send(
    stream: &RecordingStream,
    id: &str,
    appearance: &Appearance,
    scene: &Scene,
) -> Result<(), RecordingStreamError> {
    let layout = RecordingStreamBuilder::new(APPLICATION)
        .recording_id(format!("{id}/layout"))
        .enabled(true)
        .blueprint()
        .buffered()?;
    // The sink that the builder's `memory` makes owns its stream, which owns the sink: neither is ever freed, nor do the
    // stream's two threads end.
    let sink = MemorySink::new(layout.clone_weak());
    let messages = sink.buffer();
    layout.set_sink(Box::new(sink));
    layout.set_log_time_enabled(false);
    layout.set_log_tick_enabled(false);
    layout.set_time_sequence("blueprint", 0);

    let mut sheet = Sheet { stream: &layout, used: 0 };
    let root = sheet.everything(appearance, scene)?;
    layout.log("viewport", &ViewportBlueprint::new().with_root_container(root.id))?;
    for panel in ["blueprint_panel", "selection_panel"] {
        layout.log(panel, &PanelBlueprint::new().with_state(PanelState::Hidden))?;
    }
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(paths::SIM_TIME)
        .with_play_state(PlayState::Playing)
        .with_loop_mode(LoopMode::All);
    layout.log("time_panel", &time)?;

    let messages = messages.take();
    if let Some(blueprint_id) = messages.first().map(|message| message.store_id().clone()) {
        let activation = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
        stream.send_blueprint(messages, activation);
    }
    Ok(())
}

/// A container or view of the layout.
struct Part {
    id: Uuid,
    path: String,
}

/// A layout in the making; parts are numbered in the order in which they are made.
struct Sheet<'a> {
    stream: &'a RecordingStream,
    used: u128,
}

impl Sheet<'_> {
    fn everything(&mut self, appearance: &Appearance, scene: &Scene) -> Result<Part, RecordingStreamError> {
        let world = self.world(appearance, scene)?;
        let gait = self.view("StateTimeline", "Gait: who stands when", &["+ /gait/**"])?;
        let stage = self.container(ContainerKind::Vertical, "Motion", &[world, gait], &[3.0, 1.0])?;

        let fitness = self.view(
            "TimeSeries",
            "Fitness",
            &["+ /learning/best", "+ /learning/mean", "+ /learning/spread"],
        )?;
        self.legend(&fitness)?;
        let cache = self.view("TimeSeries", "Transition cache", &["+ /learning/cache_hits"])?;
        self.legend(&cache)?;
        let curves = self.container(ContainerKind::Tabs, "Learning", &[fitness, cache], &[])?;

        let angles = self.joints((appearance, scene), "Angles and targets, rad", &["angle", "target"])?;
        let torques = self.joints((appearance, scene), "Torques, N m", &["torque"])?;
        let joints = self.container(ContainerKind::Tabs, "Joints", &[angles, torques], &[])?;

        let motion = self.view("TextDocument", "Motion", &["+ /motion"])?;
        let job = self.view("TextDocument", "Job", &["+ /job"])?;
        let about = self.container(ContainerKind::Tabs, "About", &[motion, job], &[])?;
        let figures =
            self.container(ContainerKind::Vertical, "Figures", &[about, curves, joints], &[1.0, 1.0, 1.0])?;
        self.container(ContainerKind::Horizontal, "gaitwright", &[stage, figures], &[1.7, 1.0])
    }

    /// The character on its ground, seen from behind its right shoulder; the eye goes with it.
    fn world(&mut self, appearance: &Appearance, scene: &Scene) -> Result<Part, RecordingStreamError> {
        let view = self.view("3D", "Character", &["+ /world/**"])?;
        let size = appearance.size;
        let height = scenery::ground_height(scene);
        let eye = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position([-1.4 * size, -2.2 * size, height + 1.3 * size])
            .with_look_target([0.0, 0.0, height + 0.3 * size])
            .with_eye_up([0.0, 0.0, 1.0])
            .with_tracking_entity(paths::ring().to_string());
        self.property(&view, "EyeControls3D", &eye)?;
        let background = Background::new(BackgroundKind::SolidColor).with_color([24, 27, 32, 255]);
        self.property(&view, "Background", &background)?;
        let grid = LineGrid3D::new()
            .with_visible(scene.ground.is_some())
            .with_spacing(grid_spacing(size) as f32)
            .with_plane(Plane3D::new([0.0, 0.0, 1.0], height as f32))
            .with_stroke_width(1.0)
            .with_color([150, 160, 175, 70]);
        self.property(&view, "LineGrid3D", &grid)?;
        Ok(view)
    }

    fn joints(
        &mut self,
        (appearance, scene): (&Appearance, &Scene),
        name: &str,
        quantities: &[&str],
    ) -> Result<Part, RecordingStreamError> {
        let contents: Vec<String> = appearance
            .joints
            .iter()
            .flat_map(|joint| {
                quantities.iter().map(move |quantity| format!("+ {}", paths::joint(joint, quantity)))
            })
            .collect();
        let view = self.view("TimeSeries", name, &contents)?;
        self.property(&view, "PlotLegend", &PlotLegend::new().with_visible(false))?;
        let unit = (appearance.size / reference_gravity(scene)).sqrt();
        let [start, end] = SHOWN
            .map(|units| TimeRangeBoundary::CursorRelative(TimeInt((1e9 * units * unit).round() as i64)));
        self.property(&view, "TimeAxis", &TimeAxis::new().with_view_range(TimeRange { start, end }))?;
        Ok(view)
    }

    fn legend(&self, view: &Part) -> Result<(), RecordingStreamError> {
        self.property(view, "PlotLegend", &PlotLegend::new().with_corner(Corner2D::LeftTop))
    }

    fn view(
        &mut self,
        class: &str,
        name: &str,
        contents: &[impl AsRef<str>],
    ) -> Result<Part, RecordingStreamError> {
        let view = self.part("view");
        let queries = contents.iter().map(|query| query.as_ref());
        self.property(&view, "ViewContents", &ViewContents::new(queries))?;
        let blueprint = ViewBlueprint::new(class).with_display_name(name).with_space_origin("/");
        self.stream.log(EntityPath::from(view.path.as_str()), &blueprint)?;
        Ok(view)
    }

    /// `shares` are the children's parts of the height or width; empty for tabs.
    fn container(
        &mut self,
        kind: ContainerKind,
        name: &str,
        children: &[Part],
        shares: &[f32],
    ) -> Result<Part, RecordingStreamError> {
        let container = self.part("container");
        let mut blueprint = ContainerBlueprint::new(kind)
            .with_display_name(name)
            .with_contents(children.iter().map(|child| child.path.as_str()));
        if let Some(first) = children.first() {
            blueprint = blueprint.with_active_tab(first.path.as_str());
        }
        if kind == ContainerKind::Horizontal {
            blueprint = blueprint.with_col_shares(shares.iter().copied());
        } else {
            blueprint = blueprint.with_row_shares(shares.iter().copied());
        }
        self.stream.log(EntityPath::from(container.path.as_str()), &blueprint)?;
        Ok(container)
    }

    fn property(
        &self,
        view: &Part,
        name: &str,
        property: &dyn re_sdk::AsComponents,
    ) -> Result<(), RecordingStreamError> {
        self.stream.log(EntityPath::from(format!("{}/{name}", view.path)), property)
    }

    fn part(&mut self, kind: &str) -> Part {
        self.used += 1;
        let id = Uuid::from_u128(self.used);
        Part { id, path: format!("{kind}/{id}") }
    }
}

/// The power of ten times 1, 2 or 5 next below the character's size, m.
fn grid_spacing(size: f64) -> f64 {
    let decade = 10_f64.powf(size.log10().floor());
    [5.0, 2.0].iter().map(|factor| factor * decade).find(|&spacing| spacing <= size).unwrap_or(decade)
}
