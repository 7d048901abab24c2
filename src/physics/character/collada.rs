//! Triangles of a COLLADA document (.dae), in which most URDF files have what they show and some what collides.
//!
//! What bears on a shape is read: the meshes of the scene, each placed by its nodes, in metres (`<unit>`). The axis that points up
//! (`<up_axis>`) is left out of account as rviz leaves it, in which authors of URDF files look at their meshes. Elements are those of
//! COLLADA 1.4.1 (Barnes & Levy Finch 2008).

use std::collections::HashMap;
use std::rc::Rc;
use std::str::FromStr;

use nalgebra::{Matrix3, Matrix4, Point3, Rotation3, Translation3, Unit, Vector3};
use roxmltree::{Document, Node, NodeId, ParsingOptions};

/// Greatest number of XML nodes. Numbers stand thousands to a node.
const NODES: u32 = 1_000_000;
/// Greatest depth to which nodes of the scene carry each other, and greatest number of them, those that are referred to counted as
/// often as they are.
const DEPTH: u32 = 64;
const PLACED: usize = 100_000;

/// Why a document cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ColladaError {
    #[error("{0}")]
    Xml(#[from] roxmltree::Error),
    #[error("line {line}: {what}")]
    Wrong { line: u32, what: String },
    /// Right, but not read here.
    #[error("line {line}: <{element}> is not read")]
    Unread { line: u32, element: String },
    #[error("more than {0} triangles, or than three times as many corners")]
    TooMany(usize),
}

/// Corners, m, and the triangles between them.
#[derive(Debug, Default)]
pub struct Triangles {
    pub vertices: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

/// The triangles of the scene in `bytes`, at most `most`.
///
/// # Errors
///
/// [`ColladaError`], with its line where it has one.
pub fn read(bytes: &[u8], most: usize) -> Result<Triangles, ColladaError> {
    let text = String::from_utf8_lossy(bytes);
    let options = ParsingOptions { nodes_limit: NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options)?;
    let root = document.root_element();
    let ids = document.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let all = Triangles::default();
    let mut reader = Reader { ids, geometries: HashMap::new(), arrays: HashMap::new(), all, most, placed: 0 };
    let unit = match descend(root, &["asset", "unit"]).and_then(|unit| Some((unit, unit.attribute("meter")?)))
    {
        Some((unit, meter)) => number(unit, meter)?,
        None => 1.0,
    };
    let scale = Matrix4::new_scaling(unit);
    let scene = match descend(root, &["scene", "instance_visual_scene"]) {
        Some(instance) => Some(reader.referred(instance, "url")?),
        None => descend(root, &["library_visual_scenes", "visual_scene"]),
    };
    match scene {
        Some(scene) => reader.place(scene, scale, 0)?,
        None => {
            for geometry in document.descendants().filter(|node| is(*node, "geometry")) {
                reader.add(geometry, scale)?;
            }
        }
    }
    Ok(reader.all)
}

/// Whether `node` is the element `name` in whatever namespace: COLLADA's differs from version to version.
fn is(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

fn children<'a, 'i>(node: Node<'a, 'i>, name: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| is(*child, name))
}

/// The first element along a way of names.
fn descend<'a, 'i>(node: Node<'a, 'i>, names: &[&str]) -> Option<Node<'a, 'i>> {
    names.iter().try_fold(node, |node, name| children(node, name).next())
}

fn line(node: Node) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

fn wrong(node: Node, what: impl Into<String>) -> ColladaError {
    ColladaError::Wrong { line: line(node), what: what.into() }
}

fn number<T: FromStr>(node: Node, text: &str) -> Result<T, ColladaError> {
    text.trim()
        .parse()
        .map_err(|_| wrong(node, format!("<{}> has {text:?} for a number", node.tag_name().name())))
}

/// The numbers in the text of an element.
fn numbers<T: FromStr>(node: Node) -> Result<Vec<T>, ColladaError> {
    node.text().unwrap_or_default().split_ascii_whitespace().map(|text| number(node, text)).collect()
}

fn exactly<const N: usize>(node: Node) -> Result<[f64; N], ColladaError> {
    let given = numbers(node)?;
    let count = given.len();
    given
        .try_into()
        .map_err(|_| wrong(node, format!("<{}> has {count} numbers instead of {N}", node.tag_name().name())))
}

fn attribute_or(node: Node, name: &str, otherwise: usize) -> Result<usize, ColladaError> {
    node.attribute(name).map_or(Ok(otherwise), |text| number(node, text))
}

struct Reader<'a, 'i> {
    ids: HashMap<&'a str, Node<'a, 'i>>,
    /// Geometries in their own frames.
    geometries: HashMap<NodeId, Rc<Triangles>>,
    /// Arrays of numbers, of which each is read once however often it is referred to.
    arrays: HashMap<NodeId, Rc<[f64]>>,
    all: Triangles,
    most: usize,
    placed: usize,
}

impl<'a, 'i> Reader<'a, 'i> {
    /// What the attribute `name` of `node` refers to within the document.
    fn referred(&self, node: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, ColladaError> {
        let url = node.attribute(name).unwrap_or_default();
        let found = url.strip_prefix('#').and_then(|id| self.ids.get(id));
        found.copied().ok_or_else(|| wrong(node, format!("{name} {url:?} leads to nothing in the document")))
    }

    /// Adds what a node of the scene carries, the node's own frame at `frame`.
    fn place(&mut self, node: Node<'a, 'i>, mut frame: Matrix4<f64>, depth: u32) -> Result<(), ColladaError> {
        self.placed += 1;
        if depth > DEPTH || self.placed > PLACED {
            return Err(wrong(node, "too many nodes, or nodes that carry themselves"));
        }
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "matrix" => frame *= Matrix4::from_row_slice(&exactly::<16>(child)?),
                "translate" => frame *= Translation3::from(exactly::<3>(child)?).to_homogeneous(),
                "scale" => frame *= Matrix4::new_nonuniform_scaling(&Vector3::from(exactly::<3>(child)?)),
                "rotate" => {
                    let [x, y, z, degrees] = exactly(child)?;
                    // About no axis at all nothing turns.
                    if let Some(axis) = Unit::try_new(Vector3::new(x, y, z), 0.0) {
                        frame *= Rotation3::from_axis_angle(&axis, degrees.to_radians()).to_homogeneous();
                    }
                }
                "node" => self.place(child, frame, depth + 1)?,
                "instance_node" => self.place(self.referred(child, "url")?, frame, depth + 1)?,
                "instance_geometry" => self.add(self.referred(child, "url")?, frame)?,
                element @ ("skew" | "lookat" | "instance_controller") => {
                    return Err(ColladaError::Unread { line: line(child), element: element.to_owned() });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds a geometry, its frame at `frame`.
    fn add(&mut self, geometry: Node<'a, 'i>, frame: Matrix4<f64>) -> Result<(), ColladaError> {
        let own = match self.geometries.get(&geometry.id()) {
            Some(own) => Rc::clone(own),
            None => {
                let own = Rc::new(self.geometry(geometry)?);
                self.geometries.insert(geometry.id(), Rc::clone(&own));
                own
            }
        };
        let first = self.all.vertices.len();
        if self.all.triangles.len() + own.triangles.len() > self.most
            || first + own.vertices.len() > 3 * self.most
        {
            return Err(ColladaError::TooMany(self.most));
        }
        let linear: Matrix3<f64> = frame.fixed_view::<3, 3>(0, 0).into_owned();
        let translation: Vector3<f64> = frame.fixed_view::<3, 1>(0, 3).into_owned();
        self.all.vertices.extend(own.vertices.iter().map(|vertex| linear * vertex + translation));
        let mirrored = linear.determinant() < 0.0;
        self.all.triangles.extend(own.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| first as u32 + corner);
            if mirrored { [a, c, b] } else { [a, b, c] }
        }));
        Ok(())
    }

    /// The triangles of a geometry in its own frame; lines and points are none.
    fn geometry(&mut self, geometry: Node<'a, 'i>) -> Result<Triangles, ColladaError> {
        let mut own = Triangles::default();
        // Where the positions of an accessor begin, and how many they are.
        let mut added = HashMap::new();
        for primitives in children(geometry, "mesh").flat_map(|mesh| mesh.children()) {
            let kind = primitives.tag_name().name();
            if !matches!(kind, "triangles" | "polylist" | "polygons" | "tristrips" | "trifans") {
                continue;
            }
            let Some((accessor, offset, stride)) = self.corners(primitives)? else { continue };
            let (first, count) = match added.get(&accessor.id()) {
                Some(known) => *known,
                None => {
                    let first = own.vertices.len();
                    own.vertices.extend(self.positions(accessor)?);
                    if own.vertices.len() > 3 * self.most {
                        return Err(ColladaError::TooMany(self.most));
                    }
                    let known = (first as u32, (own.vertices.len() - first) as u32);
                    added.insert(accessor.id(), known);
                    known
                }
            };
            let lists = children(primitives, "p").map(|list| {
                let corners = picked(list, (offset, stride), count)?;
                Ok((list, corners.into_iter().map(|corner| first + corner).collect::<Vec<u32>>()))
            });
            for (list, corners) in lists.collect::<Result<Vec<_>, ColladaError>>()? {
                own.triangles.extend(faces(primitives, list, &corners)?);
            }
        }
        Ok(own)
    }

    /// The accessor of the positions that `primitives` refer to, at which place of each corner's indices theirs stands, and how many
    /// those are; `None` for primitives without positions.
    fn corners(
        &self,
        primitives: Node<'a, 'i>,
    ) -> Result<Option<(Node<'a, 'i>, usize, usize)>, ColladaError> {
        let (mut stride, mut found) = (0, None);
        for input in children(primitives, "input") {
            let offset = attribute_or(input, "offset", 0)?;
            stride = stride.max(offset.saturating_add(1));
            if input.attribute("semantic") == Some("VERTEX") {
                let vertices = self.referred(input, "source")?;
                let position =
                    children(vertices, "input").find(|it| it.attribute("semantic") == Some("POSITION"));
                found = position.map(|position| (position, offset));
            }
        }
        let Some((position, offset)) = found else { return Ok(None) };
        let source = self.referred(position, "source")?;
        let accessor = descend(source, &["technique_common", "accessor"]);
        let accessor = accessor.ok_or_else(|| wrong(source, "<source> has no accessor"))?;
        Ok(Some((accessor, offset, stride)))
    }

    /// The points of an accessor.
    fn positions(&mut self, accessor: Node<'a, 'i>) -> Result<Vec<Point3<f64>>, ColladaError> {
        let array = self.referred(accessor, "source")?;
        let values = match self.arrays.get(&array.id()) {
            Some(values) => Rc::clone(values),
            None => {
                let values: Rc<[f64]> = numbers(array)?.into();
                self.arrays.insert(array.id(), Rc::clone(&values));
                values
            }
        };
        let (from, step) = (attribute_or(accessor, "offset", 0)?, attribute_or(accessor, "stride", 1)?);
        if step < 3 {
            return Err(wrong(accessor, "positions have less than three numbers each"));
        }
        let given = values.get(from..).unwrap_or_default().chunks(step).filter(|it| it.len() >= 3);
        Ok(given.map(|it| Point3::new(it[0], it[1], it[2])).collect())
    }
}

/// The positions to which the corners of a list `<p>` refer, of which there are `count`: each corner has `stride` indices, that of its
/// position at `offset`.
fn picked(list: Node, (offset, stride): (usize, usize), count: u32) -> Result<Vec<u32>, ColladaError> {
    let indices: Vec<u32> = numbers(list)?;
    let corners = indices.chunks_exact(stride);
    if !corners.remainder().is_empty() {
        return Err(wrong(list, "<p> ends within a corner"));
    }
    let picked: Vec<u32> = corners.map(|corner| corner[offset]).collect();
    match picked.iter().find(|index| **index >= count) {
        Some(index) => Err(wrong(list, format!("<p> refers to position {index} of {count}"))),
        None => Ok(picked),
    }
}

/// The triangles of `primitives` between the `corners` of one of their lists `<p>`.
fn faces(primitives: Node, list: Node, corners: &[u32]) -> Result<Vec<[u32; 3]>, ColladaError> {
    Ok(match primitives.tag_name().name() {
        "triangles" => {
            let (whole, rest) = corners.as_chunks::<3>();
            if !rest.is_empty() {
                return Err(wrong(list, "<p> ends within a triangle"));
            }
            whole.to_vec()
        }
        "polylist" => {
            let counts = children(primitives, "vcount").next();
            let counts: Vec<usize> = counts.map_or(Ok(Vec::new()), numbers)?;
            let (mut triangles, mut rest) = (Vec::new(), corners);
            for count in counts {
                let Some((polygon, others)) = rest.split_at_checked(count) else {
                    return Err(wrong(list, "<p> has fewer corners than <vcount> says"));
                };
                triangles.extend(fan(polygon));
                rest = others;
            }
            triangles
        }
        "tristrips" => {
            // Every other triangle of a strip is seen from the other side.
            let turned = |(at, it): (usize, &[u32])| {
                if at % 2 == 0 { [it[0], it[1], it[2]] } else { [it[1], it[0], it[2]] }
            };
            corners.windows(3).enumerate().map(turned).collect()
        }
        _ => fan(corners).collect(),
    })
}

/// Triangles of a polygon about its first corner.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let pairs = corners.get(1..).unwrap_or_default().windows(2);
    pairs.map(|pair| [corners[0], pair[0], pair[1]])
}
