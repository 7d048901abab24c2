//! A glTF document as it grows, with its one buffer.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::Glb;
use gltf::binary::Header;
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::animation::{Channel, Interpolation, Property, Sampler, Target};
use gltf::json::buffer::{Buffer, Target as BufferTarget, View};
use gltf::json::material::{AlphaMode, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::scene::UnitQuaternion;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Animation, Asset, Material, Root, Scene, Value};
use nalgebra::Isometry3;
use serde::Serialize;
use serde_json::value::to_raw_value;

use crate::export::formats::tessellation::DisplayMesh;

pub(super) use gltf::json::{Index, Mesh, Node};

/// The buffer of a binary file is the one without an address.
const BUFFER: u32 = 0;

/// The document and the bytes of its buffer.
#[derive(Default)]
pub(super) struct Document {
    root: Root,
    bytes: Vec<u8>,
    /// The material of each colour.
    materials: Vec<([f32; 4], Index<Material>)>,
}

impl Document {
    /// Adds a node that stands at `pose` in its parent's frame.
    pub(super) fn node(
        &mut self,
        name: &str,
        pose: Option<&Isometry3<f64>>,
        mesh: Option<Index<Mesh>>,
        children: Vec<Index<Node>>,
    ) -> Index<Node> {
        self.root.push(Node {
            name: Some(name.to_owned()),
            translation: pose.map(|pose| pose.translation.vector.cast::<f32>().into()),
            rotation: pose.map(|pose| {
                let q = pose.rotation.cast::<f32>();
                UnitQuaternion([q.i, q.j, q.k, q.w])
            }),
            mesh,
            children: (!children.is_empty()).then_some(children),
            ..Node::default()
        })
    }

    /// Puts what a node means beside it, for readers that look for it.
    pub(super) fn describe(&mut self, node: Index<Node>, meaning: &impl Serialize) {
        if let Some(node) = self.root.nodes.get_mut(node.value()) {
            node.extras = to_raw_value(meaning).ok();
        }
    }

    /// Makes the scene, of one root node.
    pub(super) fn scene(&mut self, root: Index<Node>) {
        let scene = Scene { name: None, nodes: vec![root], extensions: None, extras: Default::default() };
        let scene = self.root.push(scene);
        self.root.scene = Some(scene);
    }

    /// Adds a mesh of parts, each of one colour; `None` without any.
    pub(super) fn mesh(&mut self, name: &str, parts: &[([f32; 4], DisplayMesh)]) -> Option<Index<Mesh>> {
        let primitives: Vec<Primitive> =
            parts.iter().map(|(color, part)| self.primitive(*color, part)).collect();
        (!primitives.is_empty()).then(|| {
            self.root.push(Mesh {
                name: Some(name.to_owned()),
                primitives,
                weights: None,
                extensions: None,
                extras: Default::default(),
            })
        })
    }

    fn primitive(&mut self, color: [f32; 4], part: &DisplayMesh) -> Primitive {
        let target = Some(BufferTarget::ArrayBuffer);
        let positions = self.floats(&part.positions, Type::Vec3, target);
        let normals = self.floats(&part.normals, Type::Vec3, target);
        let bytes: Vec<u8> = part.indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(BufferTarget::ElementArrayBuffer));
        let indices = self.accessor(view, part.indices.len(), ComponentType::U32, Type::Scalar, None);
        Primitive {
            attributes: BTreeMap::from([
                (Checked::Valid(Semantic::Positions), positions),
                (Checked::Valid(Semantic::Normals), normals),
            ]),
            indices: Some(indices),
            material: Some(self.material(color)),
            mode: Checked::Valid(Mode::Triangles),
            targets: None,
            extensions: None,
            extras: Default::default(),
        }
    }

    fn material(&mut self, color: [f32; 4]) -> Index<Material> {
        if let Some((_, material)) = self.materials.iter().find(|(other, _)| *other == color) {
            return *material;
        }
        let [red, green, blue, opacity] = color;
        let material = self.root.push(Material {
            // Colours of characters are meant for the screen; those of glTF are linear.
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor([linear(red), linear(green), linear(blue), opacity]),
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(0.7),
                ..Default::default()
            },
            alpha_mode: Checked::Valid(if opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque }),
            ..Default::default()
        });
        self.materials.push((color, material));
        material
    }

    /// Begins an animation whose keys have the given times, s.
    pub(super) fn animation(&mut self, name: &str, times: impl Iterator<Item = f32>) -> AnimationKeys<'_> {
        let times: Vec<[f32; 1]> = times.map(|time| [time]).collect();
        let times = self.floats(&times, Type::Scalar, None);
        AnimationKeys {
            document: self,
            name: name.to_owned(),
            times,
            channels: Vec::new(),
            samplers: Vec::new(),
        }
    }

    /// Adds vectors, with the least and greatest value of each component.
    fn floats<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        kind: Type,
        target: Option<BufferTarget>,
    ) -> Index<Accessor> {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, target);
        let extreme = |pick: fn(f32, f32) -> f32| {
            let first = values.first().copied().unwrap_or([0.0; N]);
            let all = values
                .iter()
                .fold(first, |found, value| std::array::from_fn(|at| pick(found[at], value[at])));
            Value::from(all.to_vec())
        };
        let extremes = Some((extreme(f32::min), extreme(f32::max)));
        self.accessor(view, values.len(), ComponentType::F32, kind, extremes)
    }

    fn view(&mut self, bytes: &[u8], target: Option<BufferTarget>) -> Index<View> {
        let offset = self.bytes.len();
        // Every number has four bytes, so that each view starts where its numbers may.
        self.bytes.extend_from_slice(bytes);
        self.root.push(View {
            buffer: Index::new(BUFFER),
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(offset)),
            byte_stride: None,
            target: target.map(Checked::Valid),
            name: None,
            extensions: None,
            extras: Default::default(),
        })
    }

    fn accessor(
        &mut self,
        view: Index<View>,
        count: usize,
        component: ComponentType,
        kind: Type,
        extremes: Option<(Value, Value)>,
    ) -> Index<Accessor> {
        let (min, max) = extremes.unzip();
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Checked::Valid(GenericComponentType(component)),
            type_: Checked::Valid(kind),
            min,
            max,
            name: None,
            normalized: false,
            sparse: None,
            extensions: None,
            extras: Default::default(),
        })
    }

    /// The file.
    ///
    /// # Errors
    ///
    /// When it is too large for its format.
    pub(super) fn finish(mut self, scene: &str) -> Result<Vec<u8>, gltf::Error> {
        self.root.asset = Asset {
            generator: Some(concat!("gaitwright ", env!("CARGO_PKG_VERSION")).to_owned()),
            ..Asset::default()
        };
        if let Some(first) = self.root.scenes.first_mut() {
            first.name = Some(scene.to_owned());
        }
        self.root.buffers.push(Buffer {
            byte_length: USize64::from(self.bytes.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: Default::default(),
        });
        let json = self.root.to_vec()?;
        // The length is filled in when it is written.
        let header = Header { magic: *b"glTF", version: 2, length: 0 };
        Glb { header, json: Cow::Owned(json), bin: Some(Cow::Owned(self.bytes)) }.to_vec()
    }
}

/// An animation that is being written.
pub(super) struct AnimationKeys<'a> {
    document: &'a mut Document,
    name: String,
    times: Index<Accessor>,
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

impl AnimationKeys<'_> {
    /// Moves a node, m, one position a key.
    pub(super) fn translation(&mut self, node: Index<Node>, positions: &[[f32; 3]]) {
        let output = self.document.floats(positions, Type::Vec3, None);
        self.channel(node, Property::Translation, output);
    }

    /// Turns a node, one quaternion x, y, z, w a key.
    pub(super) fn rotation(&mut self, node: Index<Node>, quaternions: &[[f32; 4]]) {
        let output = self.document.floats(quaternions, Type::Vec4, None);
        self.channel(node, Property::Rotation, output);
    }

    fn channel(&mut self, node: Index<Node>, path: Property, output: Index<Accessor>) {
        let sampler = Index::push(
            &mut self.samplers,
            Sampler {
                input: self.times,
                interpolation: Checked::Valid(Interpolation::Linear),
                output,
                extensions: None,
                extras: Default::default(),
            },
        );
        let target =
            Target { node, path: Checked::Valid(path), extensions: None, extras: Default::default() };
        self.channels.push(Channel { sampler, target, extensions: None, extras: Default::default() });
    }

    /// Adds it to the document, with what is to be known of it for readers that look for it.
    pub(super) fn finish(self, meaning: Option<&impl Serialize>) {
        self.document.root.push(Animation {
            name: Some(self.name),
            channels: self.channels,
            samplers: self.samplers,
            extensions: None,
            extras: meaning.and_then(|meaning| to_raw_value(meaning).ok()),
        });
    }
}

/// The linear intensity of a component of an sRGB colour.
fn linear(component: f32) -> f32 {
    if component <= 0.04045 { component / 12.92 } else { ((component + 0.055) / 1.055).powf(2.4) }
}
