//! Feature maps.

/// Shape of feature maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// Number of maps.
    pub n: usize,
    /// Rows of each map.
    pub height: usize,
    /// Columns of each map.
    pub width: usize,
    /// Channels of each pixel.
    pub channels: usize,
}

impl Shape {
    /// Returns the number of pixels of all maps.
    pub fn pixels(&self) -> usize {
        self.n * self.height * self.width
    }

    /// Returns the number of elements of all maps.
    pub fn len(&self) -> usize {
        self.pixels() * self.channels
    }

    /// Returns whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of elements of one map.
    pub fn len_per_item(&self) -> usize {
        self.height * self.width * self.channels
    }
}

/// Borrowed feature maps, shape [n, height, width, channels].
#[derive(Clone, Copy, Debug)]
pub struct TensorView<'a> {
    /// Elements.
    pub data: &'a [f32],
    /// Shape.
    pub shape: Shape,
}

impl<'a> TensorView<'a> {
    /// Creates a view of elements with this shape.
    pub fn new(data: &'a [f32], shape: Shape) -> TensorView<'a> {
        TensorView { data, shape }
    }
}

/// Feature maps, shape [n, height, width, channels].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tensor {
    /// Shape.
    pub shape: Shape,
    /// Elements.
    pub data: Vec<f32>,
}

impl Tensor {
    /// Borrows the tensor.
    pub fn view(&self) -> TensorView<'_> {
        TensorView::new(&self.data, self.shape)
    }

    /// Creates a tensor of zeros.
    pub fn zeros(shape: Shape) -> Tensor {
        Tensor { shape, data: vec![0.0; shape.len()] }
    }

    /// Sets the shape and zeroes all elements, reusing the memory.
    pub fn reset(&mut self, shape: Shape) {
        self.reshape(shape);
        self.data.fill(0.0);
    }

    /// Sets the shape; elements are unspecified.
    pub fn reshape(&mut self, shape: Shape) {
        self.shape = shape;
        self.data.resize(shape.len(), 0.0);
    }
}
