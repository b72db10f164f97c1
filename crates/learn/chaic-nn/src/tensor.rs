//! Feature maps.

/// How large feature maps are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// How many maps.
    pub n: usize,
    /// Rows of each.
    pub height: usize,
    /// Columns of each.
    pub width: usize,
    /// Channels of each pixel.
    pub channels: usize,
}

impl Shape {
    /// Pixels of all maps.
    pub fn pixels(&self) -> usize {
        self.n * self.height * self.width
    }

    /// Numbers of all maps.
    pub fn numbers(&self) -> usize {
        self.pixels() * self.channels
    }

    /// Numbers of one map.
    pub fn of_one(&self) -> usize {
        self.height * self.width * self.channels
    }
}

/// Feature maps, shape [n, height, width, channels].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tensor {
    /// How large they are.
    pub shape: Shape,
    /// Their numbers.
    pub data: Vec<f32>,
}

impl Tensor {
    /// Of zeros.
    pub fn zeros(shape: Shape) -> Tensor {
        Tensor { shape, data: vec![0.0; shape.numbers()] }
    }

    /// Becomes zeros of this shape, in the memory that it has.
    pub fn reset(&mut self, shape: Shape) {
        self.reshape(shape);
        self.data.fill(0.0);
    }

    /// Gets this shape; its numbers are whatever they were.
    pub fn reshape(&mut self, shape: Shape) {
        self.shape = shape;
        self.data.resize(shape.numbers(), 0.0);
    }
}
