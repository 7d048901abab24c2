//! The XML document within its bounds, and its elements and attributes as numbers with their places.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Error, Node, ParsingOptions};

use crate::character::draft::{Diagnostics, name_fault};
use crate::character::{About, NoteKind};
use crate::fault::{Fault, InputError};

/// Colours by the name of their material.
pub type Materials = BTreeMap<String, [f32; 4]>;

/// Greatest number of XML nodes (elements, texts, comments).
const NODES: u32 = 200_000;
/// Greatest depth of nesting; URDF needs 6.
const DEPTH: u32 = 64;
/// Greatest size of the mesh files of one document, each counted as often as it is referred to, bytes.
const MESH_BYTES: usize = 128 << 20;

/// Parses `text` within the bounds on nodes and depth.
pub fn parse(text: &str) -> Result<Document<'_>, InputError> {
    let options = ParsingOptions { nodes_limit: NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        Error::NodesLimitReached => {
            InputError::TooLarge(Fault::new("", format!("the document has more than {NODES} XML nodes")))
        }
        Error::DtdDetected => InputError::Malformed(Fault::new("", "document type declarations are refused")),
        error => {
            let position = error.pos();
            let pointer = format!("line {}, column {}", position.row, position.col);
            InputError::Malformed(Fault::new(pointer, format!("not well-formed XML: {error}")))
        }
    })?;
    // Nodes stand in document order, parents before children, so one pass gives every depth.
    let mut depths = Vec::new();
    for node in document.root().descendants() {
        let depth = node.parent().and_then(|parent| depths.get(parent.id().get_usize())).map_or(0, |d| d + 1);
        if depth > DEPTH {
            let line = document.text_pos_at(node.range().start).row;
            let reason = format!("the elements are nested more than {DEPTH} deep");
            return Err(InputError::TooLarge(Fault::new(format!("line {line}"), reason)));
        }
        depths.push(depth);
    }
    Ok(document)
}

/// The named URDF element that an XML node belongs to, for places and notes.
#[derive(Debug, Clone)]
pub enum UrdfElement {
    Link(String),
    Joint(String),
    Robot(String),
}

impl UrdfElement {
    pub fn about(&self) -> About {
        match self {
            Self::Link(name) => About::Link(name.clone()),
            Self::Joint(name) => About::Joint(name.clone()),
            Self::Robot(name) => About::Character(name.clone()),
        }
    }
}

/// What reading a document gathers.
pub struct Context {
    line_starts: Vec<usize>,
    pub diagnostics: Diagnostics,
    /// How often an element was left out, by its parent's name and its own.
    ignored: BTreeMap<(String, String), usize>,
    /// Bytes of mesh files that may still be read.
    mesh_bytes: usize,
}

impl Context {
    pub fn new(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(index, _)| index + 1);
        let line_starts = std::iter::once(0).chain(ends).collect();
        Self {
            line_starts,
            diagnostics: Diagnostics::default(),
            ignored: BTreeMap::new(),
            mesh_bytes: MESH_BYTES,
        }
    }

    /// Whether another mesh file of `bytes` may be read; it is counted.
    pub fn afford(&mut self, bytes: usize) -> bool {
        let left = self.mesh_bytes.checked_sub(bytes);
        self.mesh_bytes = left.unwrap_or(0);
        left.is_some()
    }

    /// Where `node` stands: its line and the link or joint it belongs to.
    pub fn place(&self, node: Node, owner: &UrdfElement) -> String {
        let line = self.line_starts.partition_point(|start| *start <= node.range().start);
        match owner {
            UrdfElement::Link(name) => format!("line {line}, link {name:?}"),
            UrdfElement::Joint(name) => format!("line {line}, joint {name:?}"),
            UrdfElement::Robot(_) => format!("line {line}"),
        }
    }

    pub fn fault(&mut self, node: Node, owner: &UrdfElement, reason: impl Into<String>) {
        let place = self.place(node, owner);
        self.diagnostics.fault(place, reason);
    }

    pub fn note(&mut self, node: Node, owner: &UrdfElement, kind: NoteKind, message: impl Into<String>) {
        let place = self.place(node, owner);
        self.diagnostics.note(place, owner.about(), kind, message);
    }

    /// Counts an element that has no bearing on the character.
    pub fn ignore(&mut self, node: Node) {
        let parent = node.parent().map_or(String::new(), tag);
        *self.ignored.entry((parent, tag(node))).or_default() += 1;
    }

    /// Counts the children of `parent` that are none of `known`.
    pub fn ignore_all_but(&mut self, parent: Node, known: &[&str]) {
        for child in parent.children().filter(Node::is_element) {
            if !known.iter().any(|name| named(child, name)) {
                self.ignore(child);
            }
        }
    }

    /// One note for every kind of element left out.
    pub fn note_ignored(&mut self, robot: Node, owner: &UrdfElement) {
        for ((parent, name), count) in std::mem::take(&mut self.ignored) {
            let times = if count == 1 { "once".to_owned() } else { format!("{count} times") };
            let message = format!("<{name}> in <{parent}> is not used ({times})");
            self.note(robot, owner, NoteKind::Ignored, message);
        }
    }

    /// The name of a link or joint; a fault when it has none that can be used.
    pub fn name<'a>(&mut self, node: Node<'a, '_>) -> Option<&'a str> {
        let nameless = UrdfElement::Robot(String::new());
        let Some(name) = node.attribute("name") else {
            self.fault(node, &nameless, format!("a <{}> has no name", tag(node)));
            return None;
        };
        if let Some(reason) = name_fault(name) {
            self.fault(node, &nameless, format!("<{}>: {reason}", tag(node)));
            return None;
        }
        Some(name)
    }

    /// The only child of `parent` called `name`; of several the first, noted.
    pub fn only<'a, 'i>(
        &mut self,
        parent: Node<'a, 'i>,
        name: &str,
        owner: &UrdfElement,
    ) -> Option<Node<'a, 'i>> {
        let mut found = parent.children().filter(|child| named(*child, name));
        let first = found.next()?;
        if let Some(second) = found.next() {
            let message = format!("<{}> has more than one <{name}>; the first is used", tag(parent));
            self.note(second, owner, NoteKind::Repaired, message);
        }
        Some(first)
    }

    /// The attribute `name` as a finite number, if it is there.
    pub fn number(&mut self, node: Node, name: &str, owner: &UrdfElement) -> Option<f64> {
        let [number] = self.numbers(node, name, owner)?;
        Some(number)
    }

    /// The attribute `name` as a finite number; a fault when it is not there.
    pub fn required(&mut self, node: Node, name: &str, owner: &UrdfElement) -> Option<f64> {
        if node.attribute(name).is_none() {
            self.fault(node, owner, format!("<{}> has no {name}", tag(node)));
        }
        self.number(node, name, owner)
    }

    /// The attribute `name` as `N` finite numbers, if it is there.
    pub fn numbers<const N: usize>(
        &mut self,
        node: Node,
        name: &str,
        owner: &UrdfElement,
    ) -> Option<[f64; N]> {
        let text = node.attribute(name)?;
        let what = format!("{name} of <{}>", tag(node));
        let mut numbers = [0.0; N];
        let mut count = 0;
        for word in text.split_whitespace() {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() => {
                    if let Some(slot) = numbers.get_mut(count) {
                        *slot = number;
                    }
                    count += 1;
                }
                Ok(_) => {
                    self.fault(
                        node,
                        owner,
                        format!("{what} is {text:?}, where {word:?} is not a finite number"),
                    );
                    return None;
                }
                Err(_) => {
                    let hint = if word.contains("${") { "; expand it with xacro first" } else { "" };
                    self.fault(
                        node,
                        owner,
                        format!("{what} is {text:?}, where {word:?} is not a number{hint}"),
                    );
                    return None;
                }
            }
        }
        if count != N {
            self.fault(node, owner, format!("{what} has {count} numbers instead of {N}"));
            return None;
        }
        Some(numbers)
    }

    /// The frame that the child `<origin>` of `parent` gives; the parent's own where there is none.
    /// Roll, pitch and yaw turn about the fixed x, y and z axes, in this order.
    pub fn origin(&mut self, parent: Node, owner: &UrdfElement) -> Isometry3<f64> {
        let Some(node) = self.only(parent, "origin", owner) else { return Isometry3::identity() };
        let position = self.numbers(node, "xyz", owner).unwrap_or_default();
        let [roll, pitch, yaw] = self.numbers(node, "rpy", owner).unwrap_or_default();
        Isometry3::from_parts(
            Translation3::from(Vector3::from(position)),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }
}

/// The name of an element with its prefix's namespace left out.
pub fn tag(node: Node) -> String {
    node.tag_name().name().to_owned()
}

/// Whether `node` is the URDF element called `name`: in the namespace of its parent, so that extensions
/// such as `<drake:joint>` are not taken for it.
pub fn named(node: Node, name: &str) -> bool {
    let tag = node.tag_name();
    let parent = node.parent_element().map(|parent| parent.tag_name());
    node.is_element()
        && tag.name() == name
        && parent.is_none_or(|parent| parent.namespace() == tag.namespace())
}
