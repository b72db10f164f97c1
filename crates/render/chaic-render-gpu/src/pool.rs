//! Growable device arrays with range allocation.

use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::ops::Range;

use bytemuck::Pod;

use crate::device::GpuContext;
use crate::error::GpuError;

/// Free ranges of an array.
#[derive(Debug, Default)]
struct FreeRanges {
    /// Length of each free range by its first element; adjacent ranges are merged.
    ranges: BTreeMap<u32, u32>,
    /// End of the last allocated range; all later elements are free too.
    end: u32,
}

impl FreeRanges {
    /// Allocates the first free range of at least `n` elements.
    fn allocate(&mut self, n: u32) -> Range<u32> {
        let fit = self.ranges.iter().find(|(_, len)| **len >= n).map(|(k, len)| (*k, *len));
        let Some((first, len)) = fit else {
            let first = self.end;
            self.end = self.end.saturating_add(n);
            return first..self.end;
        };
        self.ranges.remove(&first);
        if len > n {
            self.ranges.insert(first + n, len - n);
        }
        first..first + n
    }

    fn release(&mut self, range: Range<u32>) {
        let Range { mut start, mut end } = range;
        if start == end {
            return;
        }
        if let Some((first, len)) = self.ranges.range(..start).next_back().map(|(k, n)| (*k, *n))
            && first + len == start
        {
            self.ranges.remove(&first);
            start = first;
        }
        if let Some(len) = self.ranges.remove(&end) {
            end += len;
        }
        if end == self.end {
            self.end = start;
        } else {
            self.ranges.insert(start, end - start);
        }
    }
}

/// A growable array of `T` on the device.
#[derive(Debug)]
pub(crate) struct Pool<T> {
    label: &'static str,
    pub buffer: wgpu::Buffer,
    capacity: u32,
    free: FreeRanges,
    element: PhantomData<T>,
}

const USAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_DST)
    .union(wgpu::BufferUsages::COPY_SRC);

impl<T: Pod> Pool<T> {
    /// Creates an empty array with this capacity in elements.
    pub fn new(
        context: &GpuContext,
        label: &'static str,
        capacity: u32,
    ) -> Result<Pool<T>, GpuError> {
        let bytes = u64::from(capacity) * size_of::<T>() as u64;
        let buffer = context.buffer(label, bytes, USAGE)?;
        Ok(Pool { label, buffer, capacity, free: FreeRanges::default(), element: PhantomData })
    }

    /// Uploads elements; returns their range.
    pub fn add(&mut self, context: &GpuContext, elements: &[T]) -> Result<Range<u32>, GpuError> {
        let n = u32::try_from(elements.len()).unwrap_or(u32::MAX);
        let range = self.free.allocate(n);
        if range.end > self.capacity
            && let Err(error) = self.grow(context, u64::from(range.end))
        {
            self.free.release(range);
            return Err(error);
        }
        self.write(context, range.start, elements);
        Ok(range)
    }

    /// Overwrites elements from `first`.
    pub fn write(&self, context: &GpuContext, first: u32, elements: &[T]) {
        if !elements.is_empty() {
            let offset = u64::from(first) * size_of::<T>() as u64;
            context.queue.write_buffer(&self.buffer, offset, bytemuck::cast_slice(elements));
        }
    }

    /// Frees a range.
    pub fn remove(&mut self, range: Range<u32>) {
        self.free.release(range);
    }

    /// Size on the device, bytes.
    pub fn bytes(&self) -> u64 {
        self.buffer.size()
    }

    fn grow(&mut self, context: &GpuContext, needed: u64) -> Result<(), GpuError> {
        let size = size_of::<T>() as u64;
        let max = context.max_buffer_bytes() / size;
        let capacity = needed.max(2 * u64::from(self.capacity)).min(max);
        if capacity < needed {
            return Err(GpuError::OutOfMemory { purpose: self.label, bytes: needed * size });
        }
        let larger = context.buffer(self.label, capacity * size, USAGE)?;
        let mut encoder = context.encoder();
        encoder.copy_buffer_to_buffer(&self.buffer, 0, &larger, 0, Some(self.buffer.size()));
        context.queue.submit([encoder.finish()]);
        self.buffer = larger;
        self.capacity = capacity as u32;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::rng::RngStream;

    #[test]
    fn ranges_never_overlap_and_all_comes_back() {
        let mut rng = RngStream::new(1, "ranges", 0);
        let mut free = FreeRanges::default();
        let mut allocated: Vec<Range<u32>> = Vec::new();
        for _ in 0..2000 {
            if allocated.is_empty() || rng.below(5) < 3 {
                let range = free.allocate(rng.below(9) as u32);
                let is_apart = |r: &Range<u32>| r.end <= range.start || range.end <= r.start;
                assert!(allocated.iter().all(|r| r.is_empty() || range.is_empty() || is_apart(r)));
                allocated.push(range);
            } else {
                free.release(allocated.swap_remove(rng.below(allocated.len())));
            }
        }
        allocated.into_iter().for_each(|range| free.release(range));
        assert_eq!((free.end, free.ranges.len()), (0, 0));
    }
}
