//! What can be seen at one moment, shape by shape: for those who keep shapes from moment to moment.

use std::collections::BTreeMap;

use chaic_world::{Posture, State};

use crate::Scene;
use crate::frame::{Frame, Shape, ShapeKey};
use crate::geometry::{FINEST, InstanceData, MeshData};
use crate::lighting::Lighting;
use crate::people::Body;

/// What can be seen at one moment.
pub struct Shapes<'a> {
    /// What there is: structure, then people, then things.
    pub instances: Vec<InstanceData>,
    shapes: Vec<Shape<'a>>,
    frame: &'a Frame<'a>,
}

/// A shape of the catalogue: equal for equal shapes only, in any scene of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ShapeName(ShapeKey);

/// A body in one posture; its meshes are made when they are asked for.
#[derive(Clone, Debug)]
pub struct BodyShape(Body);

impl BodyShape {
    /// The mesh at a level of detail; levels past the finest are the finest.
    pub fn mesh(&self, level: usize) -> MeshData {
        MeshData::from(self.0.level(level.min(FINEST)))
    }
}

impl Shapes<'_> {
    /// Number of shapes; those that instances name by their index.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Whether nothing can be seen.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// The name of a shape, if it is one of the catalogue.
    pub fn name(&self, index: usize) -> Option<ShapeName> {
        match self.shapes.get(index)? {
            Shape::Class(class) => Some(ShapeName(class.key())),
            Shape::Fixed(_) | Shape::Body(_) => None,
        }
    }

    /// Whether a shape is a piece of structure: in the same place of every moment of its scene.
    pub fn is_structure(&self, index: usize) -> bool {
        matches!(self.shapes.get(index), Some(Shape::Fixed(_)))
    }

    /// Whether a shape is a body: that of no other moment.
    pub fn is_body(&self, index: usize) -> bool {
        matches!(self.shapes.get(index), Some(Shape::Body(_)))
    }

    /// A shape that is a body, to be kept.
    pub fn body(&self, index: usize) -> Option<BodyShape> {
        match self.shapes.get(index)? {
            Shape::Body(body) => Some(BodyShape(Body::clone(body))),
            Shape::Fixed(_) | Shape::Class(_) => None,
        }
    }

    /// A shape at a level of detail; levels past the finest are the finest.
    ///
    /// # Panics
    /// If there is no shape of this index.
    pub fn mesh(&self, index: usize, level: usize) -> MeshData {
        MeshData::from(self.shapes[index].mesh(level.min(FINEST)))
    }

    /// What shines on them.
    pub fn lighting(&self) -> Lighting<'_> {
        Lighting::of(&self.frame.light)
    }
}

impl Scene {
    /// Looks at a moment shape by shape. `postures` are those of the agents in order.
    pub fn with_shapes<T>(
        &self,
        state: &State,
        postures: &[Posture],
        look: impl FnOnce(&Shapes) -> T,
    ) -> T {
        let bodies: Vec<Body> = postures.iter().map(|p| Body::new(p, state.frame)).collect();
        let frame = self.frame(state, &bodies, true);
        let mut shapes: Vec<Shape> = Vec::new();
        let mut known: BTreeMap<ShapeKey, u32> = BTreeMap::new();
        let mut instances = Vec::with_capacity(frame.instances.len());
        for instance in &frame.instances {
            let next = shapes.len() as u32;
            let mesh = match instance.shape {
                Shape::Class(class) => *known.entry(class.key()).or_insert(next),
                Shape::Fixed(_) | Shape::Body(_) => next,
            };
            if mesh == next {
                shapes.push(instance.shape);
            }
            instances.push(self.instance_data(instance, mesh));
        }
        let result = look(&Shapes { instances, shapes, frame: &frame });
        self.recycle(frame.light);
        result
    }
}
