//! The walk over the visual scene: every instance, placed in the world.

use super::bindings::Bindings;
use super::camera;
use super::document::{Document, Node};
use super::geometry::{Geometry, Primitive};
use super::instance::Instance;
use super::lamps::Lamp;
use super::lights::{self, Light};
use super::placement::Placement;
use super::transform;
use crate::error::{Note, Result};
use crate::options::Precision;
use crate::scene::description::{AreaLightDescription, MeshDescription, SceneDescription, SphereDescription};
use glam::{DMat4, DVec3};
use roxmltree::NodeId;
use std::collections::{HashMap, HashSet};

/// Deepest nesting of nodes, through instances too.
const MAX_DEPTH: usize = 1024;
/// Most XML nodes met on the walk, counting again what is instanced again.
const MAX_VISITS: usize = 1 << 22;
/// Most meshes and spheres.
const MAX_INSTANCES: usize = 1 << 18;
/// Most triangles after instancing.
const MAX_TRIANGLES: usize = 1 << 25;
/// Most lights: each is compared with each emissive quad.
const MAX_LIGHTS: usize = 1 << 10;

/// Walks the visual scene that the document shows. Returns the scene, and the lights that have no shape.
pub(super) fn walk<'a>(
    document: &Document<'a>,
    (axes, precision): (DMat4, Precision),
    notes: Vec<Note>,
) -> Result<(SceneDescription, Vec<Lamp>)> {
    let mut walk = Walk {
        document,
        in_double: precision == Precision::F64,
        bindings: Bindings::new(document),
        transforms: HashMap::new(),
        targets: HashMap::new(),
        scene: SceneDescription { notes, ..Default::default() },
        lamps: Vec::new(),
        reported: HashSet::new(),
        visits: 0,
        instances: 0,
        triangles: 0,
        degenerate: None,
        cameras: 0,
    };
    let visual_scene = walk.visual_scene()?;
    walk.nodes(visual_scene, axes)?;
    Ok(walk.finish())
}

/// Work that is still to be done.
enum Step<'a> {
    /// Enter a node whose parent has this matrix.
    Enter(Node<'a>, DMat4),
    /// All below this node is done.
    Leave(NodeId),
}

struct Walk<'d, 'a> {
    document: &'d Document<'a>,
    /// Positions are wanted in double precision, too.
    in_double: bool,
    bindings: Bindings<'d, 'a>,
    transforms: HashMap<NodeId, DMat4>,
    targets: HashMap<NodeId, Node<'a>>,
    scene: SceneDescription,
    lamps: Vec<Lamp>,
    /// Elements about which there is a note already.
    reported: HashSet<NodeId>,
    visits: usize,
    instances: usize,
    triangles: usize,
    /// How many triangles were left out, and the line of the first primitive that had some.
    degenerate: Option<(usize, u64)>,
    cameras: usize,
}

impl<'a> Walk<'_, 'a> {
    /// The `<visual_scene>` that `<scene>` instances, else the first.
    fn visual_scene(&mut self) -> Result<Node<'a>> {
        let document = self.document;
        let root = document.root();
        if let Some(instance) = document.descend(root, &["scene", "instance_visual_scene"]) {
            return document.resolve(instance, "url", "visual_scene");
        }
        let libraries = document.children(root, "library_visual_scenes");
        let Some(first) = libraries.into_iter().find_map(|library| document.child(library, "visual_scene")) else {
            return Err(document.expected(root, "the document shows no scene", "a <visual_scene>"));
        };
        let text = format!("no <scene>: the first visual scene, {}, is shown", document.name(first));
        self.scene.notes.push(Note::info(text));
        Ok(first)
    }

    /// Visits all nodes in document order, without recursion.
    fn nodes(&mut self, visual_scene: Node<'a>, axes: DMat4) -> Result<()> {
        let mut open = HashSet::new();
        let mut steps = Vec::new();
        self.push_children(visual_scene, axes, &mut steps)?;
        while let Some(step) = steps.pop() {
            match step {
                Step::Leave(id) => {
                    open.remove(&id);
                }
                Step::Enter(node, parent) => {
                    if !open.insert(node.id()) {
                        let what = format!("node {} contains itself through <instance_node>", self.document.name(node));
                        return Err(self.document.expected(node, what, "instances that do not form a cycle"));
                    }
                    if open.len() > MAX_DEPTH {
                        let what = format!("nodes are nested more than {MAX_DEPTH} deep");
                        return Err(self.document.expected(node, what, "a hierarchy that is less deep"));
                    }
                    steps.push(Step::Leave(node.id()));
                    let to_world = parent * self.local_transform(node)?;
                    self.instances_of(node, to_world)?;
                    self.push_children(node, to_world, &mut steps)?;
                }
            }
        }
        Ok(())
    }

    fn local_transform(&mut self, node: Node<'a>) -> Result<DMat4> {
        if let Some(matrix) = self.transforms.get(&node.id()) {
            return Ok(*matrix);
        }
        let matrix = transform::local(self.document, node)?;
        self.transforms.insert(node.id(), matrix);
        Ok(matrix)
    }

    /// Queues the nodes below, the first one on top.
    fn push_children(&mut self, node: Node<'a>, to_world: DMat4, steps: &mut Vec<Step<'a>>) -> Result<()> {
        let first = steps.len();
        for child in node.children() {
            self.visits += 1;
            if self.visits > MAX_VISITS {
                let what = format!("instances unfold to more than {MAX_VISITS} elements");
                return Err(self.document.expected(node, what, "a scene that unfolds to fewer"));
            }
            if !child.is_element() {
                continue;
            }
            match child.tag_name().name() {
                "node" => steps.push(Step::Enter(child, to_world)),
                "instance_node" => steps.push(Step::Enter(self.target(child, "node")?, to_world)),
                _ => {}
            }
        }
        steps[first..].reverse();
        Ok(())
    }

    /// What an instance element refers to.
    fn target(&mut self, instance: Node<'a>, kind: &'static str) -> Result<Node<'a>> {
        if let Some(target) = self.targets.get(&instance.id()) {
            return Ok(*target);
        }
        let target = self.document.resolve(instance, "url", kind)?;
        self.targets.insert(instance.id(), target);
        Ok(target)
    }

    /// Geometries, lights and cameras directly in a node.
    fn instances_of(&mut self, node: Node<'a>, to_world: DMat4) -> Result<()> {
        for child in node.children().filter(|child| child.is_element()) {
            match child.tag_name().name() {
                "instance_geometry" => self.geometry(node, child, to_world)?,
                "instance_light" => self.light(node, child, to_world)?,
                "instance_camera" => self.camera(node, child, to_world)?,
                "instance_controller" => {
                    let (line, name) = (self.document.line(child), self.document.name(node));
                    let text = format!("line {line}: node {name} instances a skin or morph controller: left out");
                    self.note_once(child, Note::warning(text));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn note_once(&mut self, element: Node<'a>, note: Note) {
        if self.reported.insert(element.id()) {
            self.scene.notes.push(note);
        }
    }

    /// Counts an instance that takes memory.
    fn count_instance(&mut self, instance: Node<'a>) -> Result<()> {
        self.instances += 1;
        if self.instances > MAX_INSTANCES {
            let what = format!("instances unfold to more than {MAX_INSTANCES} meshes and spheres");
            return Err(self.document.expected(instance, what, "a scene that unfolds to fewer"));
        }
        Ok(())
    }

    fn geometry(&mut self, node: Node<'a>, instance: Node<'a>, to_world: DMat4) -> Result<()> {
        let bound = self.bindings.get(instance, &mut self.scene.notes)?;
        let placement = Placement::new(to_world);
        match &*bound.geometry {
            Geometry::Sphere { radius } => {
                self.count_instance(instance)?;
                self.sphere(node, instance, *radius, bound.materials[0], &placement)
            }
            Geometry::Mesh(primitives) => {
                for (primitive, material) in primitives.iter().zip(&bound.materials) {
                    self.count_instance(instance)?;
                    self.mesh(node, instance, primitive, *material, &placement)?;
                }
                Ok(())
            }
        }
    }

    fn sphere(
        &mut self,
        node: Node<'a>,
        instance: Node<'a>,
        radius: f64,
        material: u32,
        placement: &Placement,
    ) -> Result<()> {
        let Some(scale) = placement.uniform_scale() else {
            let what = format!("the transform of node {} does not keep a sphere round", self.document.name(node));
            return Err(self.document.expected(instance, what, "a uniform scale above 0"));
        };
        let radius = radius * scale;
        let double = self.in_double.then(|| (placement.in_double(DVec3::ZERO), radius));
        let radius = radius as f32;
        match placement.position(DVec3::ZERO) {
            Some(center) if radius > 0.0 && radius.is_finite() => {
                let (name, at) = (self.document.name(node), self.document.at(instance));
                self.scene.spheres.push(SphereDescription { name, at, center, radius, double, material });
                Ok(())
            }
            _ => Err(self.not_finite(node, instance)),
        }
    }

    fn mesh(
        &mut self,
        node: Node<'a>,
        instance: Node<'a>,
        primitive: &Primitive<'a>,
        material: u32,
        placement: &Placement,
    ) -> Result<()> {
        self.triangles += primitive.triangles.len();
        if self.triangles > MAX_TRIANGLES {
            let what = format!("instances unfold to more than {MAX_TRIANGLES} triangles");
            return Err(self.document.expected(instance, what, "a scene that unfolds to fewer"));
        }
        let emissive = self.bindings.materials.emits(material);
        let Some(placed) = Instance::new(primitive, placement, emissive, self.in_double) else {
            return Err(self.not_finite(node, instance));
        };
        let name = self.document.name(node);
        if placed.left_out > 0 {
            let (count, _) = self.degenerate.get_or_insert_with(|| (0, self.document.line(primitive.node)));
            *count += placed.left_out;
        }
        if placed.turned {
            let line = self.document.line(primitive.node);
            let text = format!("line {line}: emissive mesh {name} is turned to face where its vertex normals point");
            self.note_once(primitive.node, Note::info(text));
        }
        let Instance { positions, double, normals, triangles, .. } = placed;
        if !triangles.is_empty() {
            let at = primitive.at;
            self.scene.meshes.push(MeshDescription { name, at, positions, double, normals, triangles, material });
        }
        Ok(())
    }

    fn not_finite(&self, node: Node<'a>, instance: Node<'a>) -> crate::error::Error {
        let what = format!(
            "the transform of node {} takes its geometry beyond the range of numbers",
            self.document.name(node)
        );
        self.document.expected(instance, what, "finite positions and sizes")
    }

    fn light(&mut self, node: Node<'a>, instance: Node<'a>, to_world: DMat4) -> Result<()> {
        let light = self.target(instance, "light")?;
        if self.lamps.len() + self.scene.area_lights.len() >= MAX_LIGHTS {
            return Err(self.document.expected(instance, format!("more than {MAX_LIGHTS} lights"), "fewer"));
        }
        match lights::read(self.document, light, node, instance, to_world)? {
            Light::Area(light) => {
                let double = self.in_double.then(|| to_world.transform_point3(DVec3::ZERO));
                self.scene.area_lights.push(AreaLightDescription { double, ..light });
            }
            Light::Lamp(lamp) => self.lamps.push(lamp),
        }
        Ok(())
    }

    /// The first perspective camera is the scene's.
    fn camera(&mut self, node: Node<'a>, instance: Node<'a>, to_world: DMat4) -> Result<()> {
        let document = self.document;
        let element = self.target(instance, "camera")?;
        let Some(lens) = document.descend(element, &["optics", "technique_common", "perspective"]) else {
            let (line, name) = (document.line(element), document.name(element));
            let text = format!("line {line}: camera {name} is not a perspective camera: left out");
            self.note_once(element, Note::info(text));
            return Ok(());
        };
        self.cameras += 1;
        if self.cameras == 1 {
            self.scene.camera = Some(camera::read(document, lens, node, instance, to_world)?);
        }
        Ok(())
    }

    /// The scene, with the notes that count things.
    fn finish(self) -> (SceneDescription, Vec<Lamp>) {
        let mut scene = self.scene;
        scene.materials = self.bindings.materials.descriptions;
        if let Some((count, line)) = self.degenerate {
            let text = format!("{count} triangles without area are left out; the first in the mesh at line {line}");
            scene.notes.push(Note::warning(text));
        }
        let crossing = self.bindings.geometries.crossing_polygons();
        if crossing > 0 {
            scene.notes.push(Note::warning(format!("{crossing} polygons cross themselves: their split is a guess")));
        }
        if let Some(camera) = &scene.camera
            && self.cameras > 1
        {
            let text = format!("the file has {} cameras: {}, the first, is used", self.cameras, camera.name);
            scene.notes.push(Note::info(text));
        }
        (scene, self.lamps)
    }
}
