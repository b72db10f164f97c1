//! Unique shapes of one frame, for renderers that cache shapes between frames.

use std::collections::BTreeMap;

use chaic_world::{Posture, State};

use crate::Scene;
use crate::geometry::{FINEST_LEVEL, InstanceData, MeshData};
use crate::lighting::Lighting;
use crate::people::Body;
use crate::scene_frame::{SceneFrame, Shape, ShapeKey};

/// Unique shapes and instances of one frame.
pub struct Shapes<'a> {
    /// Instances: structure, then people, then objects.
    pub instances: Vec<InstanceData>,
    shapes: Vec<Shape<'a>>,
    frame: &'a SceneFrame<'a>,
}

/// Key of a catalogue shape: equal only for equal shapes, across all scenes of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ShapeId(ShapeKey);

/// Shape of a body in one posture; its meshes are built on first use.
#[derive(Clone, Debug)]
pub struct BodyShape(Body);

impl BodyShape {
    /// Returns the mesh at a level of detail; levels past the finest give the finest.
    pub fn mesh(&self, level: usize) -> MeshData {
        MeshData::from(self.0.level(level.min(FINEST_LEVEL)))
    }
}

impl Shapes<'_> {
    /// Number of shapes, which instances reference by index.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Returns whether there are no shapes.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Returns the key of a shape; `None` if it is not from the catalogue.
    pub fn shape_id(&self, index: usize) -> Option<ShapeId> {
        match self.shapes.get(index)? {
            Shape::Class(class) => Some(ShapeId(class.key())),
            Shape::Fixed(_) | Shape::Body(_) => None,
        }
    }

    /// Returns whether a shape is structure, which never moves in its scene.
    pub fn is_structure(&self, index: usize) -> bool {
        matches!(self.shapes.get(index), Some(Shape::Fixed(_)))
    }

    /// Returns whether a shape is a body, which is valid for this frame only.
    pub fn is_body(&self, index: usize) -> bool {
        matches!(self.shapes.get(index), Some(Shape::Body(_)))
    }

    /// Returns an owned copy of a body shape; `None` for other shapes.
    pub fn body(&self, index: usize) -> Option<BodyShape> {
        match self.shapes.get(index)? {
            Shape::Body(body) => Some(BodyShape(Body::clone(body))),
            Shape::Fixed(_) | Shape::Class(_) => None,
        }
    }

    /// Returns a shape at a level of detail; levels past the finest give the finest.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn mesh(&self, index: usize, level: usize) -> MeshData {
        MeshData::from(self.shapes[index].mesh(level.min(FINEST_LEVEL)))
    }

    /// Returns the lighting of the frame.
    pub fn lighting(&self) -> Lighting<'_> {
        Lighting::from_light(&self.frame.light)
    }
}

impl Scene {
    /// Calls `visit` with the shapes of a state. `postures` lists the postures of the agents in
    /// order.
    pub fn with_shapes<T>(
        &self,
        state: &State,
        postures: &[Posture],
        visit: impl FnOnce(&Shapes) -> T,
    ) -> T {
        let bodies: Vec<Body> = postures.iter().map(|p| Body::new(p, state.frame)).collect();
        let frame = self.frame(state, &bodies, true);
        let mut shapes: Vec<Shape> = Vec::new();
        let mut indices: BTreeMap<ShapeKey, u32> = BTreeMap::new();
        let mut instances = Vec::with_capacity(frame.instances.len());
        for instance in &frame.instances {
            let next = shapes.len() as u32;
            let mesh = match instance.shape {
                Shape::Class(class) => *indices.entry(class.key()).or_insert(next),
                Shape::Fixed(_) | Shape::Body(_) => next,
            };
            if mesh == next {
                shapes.push(instance.shape);
            }
            instances.push(self.instance_data(instance, mesh));
        }
        let result = visit(&Shapes { instances, shapes, frame: &frame });
        self.recycle_shadows(frame.light);
        result
    }
}
