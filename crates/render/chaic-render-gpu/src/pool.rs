//! Arrays on the device that grow, and hand out ranges of themselves.

use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::ops::Range;

use bytemuck::Pod;

use crate::device::Link;
use crate::error::GpuError;

/// Which ranges of an array are free.
#[derive(Debug, Default)]
struct Free {
    /// Length of each free range by its first element; no two touch.
    ranges: BTreeMap<u32, u32>,
    /// Elements past the last one ever handed out are free too.
    end: u32,
}

impl Free {
    /// The first range that is long enough, cut out of what is free.
    fn take(&mut self, n: u32) -> Range<u32> {
        let found = self.ranges.iter().find(|(_, len)| **len >= n).map(|(k, len)| (*k, *len));
        let Some((first, len)) = found else {
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

    fn give_back(&mut self, range: Range<u32>) {
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

/// An array of `T` on the device.
#[derive(Debug)]
pub(crate) struct Pool<T> {
    what: &'static str,
    pub buffer: wgpu::Buffer,
    capacity: u32,
    free: Free,
    of: PhantomData<T>,
}

const USAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_DST)
    .union(wgpu::BufferUsages::COPY_SRC);

impl<T: Pod> Pool<T> {
    /// An empty array with room for so many elements.
    pub fn new(link: &Link, what: &'static str, capacity: u32) -> Result<Pool<T>, GpuError> {
        let bytes = u64::from(capacity) * size_of::<T>() as u64;
        let buffer = link.buffer(what, bytes, USAGE)?;
        Ok(Pool { what, buffer, capacity, free: Free::default(), of: PhantomData })
    }

    /// Copies elements to the device and says where they are.
    pub fn add(&mut self, link: &Link, elements: &[T]) -> Result<Range<u32>, GpuError> {
        let n = u32::try_from(elements.len()).unwrap_or(u32::MAX);
        let range = self.free.take(n);
        if range.end > self.capacity
            && let Err(error) = self.grow(link, u64::from(range.end))
        {
            self.free.give_back(range);
            return Err(error);
        }
        self.write(link, range.start, elements);
        Ok(range)
    }

    /// Puts others in the place of elements.
    pub fn write(&self, link: &Link, first: u32, elements: &[T]) {
        if !elements.is_empty() {
            let offset = u64::from(first) * size_of::<T>() as u64;
            link.queue.write_buffer(&self.buffer, offset, bytemuck::cast_slice(elements));
        }
    }

    /// Lets a range be handed out again.
    pub fn remove(&mut self, range: Range<u32>) {
        self.free.give_back(range);
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.buffer.size()
    }

    fn grow(&mut self, link: &Link, needed: u64) -> Result<(), GpuError> {
        let size = size_of::<T>() as u64;
        let most = link.most_bytes() / size;
        let capacity = needed.max(2 * u64::from(self.capacity)).min(most);
        if capacity < needed {
            return Err(GpuError::OutOfMemory { what: self.what, bytes: needed * size });
        }
        let larger = link.buffer(self.what, capacity * size, USAGE)?;
        let mut encoder = link.encoder();
        encoder.copy_buffer_to_buffer(&self.buffer, 0, &larger, 0, Some(self.buffer.size()));
        link.queue.submit([encoder.finish()]);
        self.buffer = larger;
        self.capacity = capacity as u32;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::rng::Stream;

    #[test]
    fn ranges_never_overlap_and_all_comes_back() {
        let mut rng = Stream::new(1, "ranges", 0);
        let mut free = Free::default();
        let mut taken: Vec<Range<u32>> = Vec::new();
        for _ in 0..2000 {
            if taken.is_empty() || rng.below(5) < 3 {
                let range = free.take(rng.below(9) as u32);
                let is_apart = |r: &Range<u32>| r.end <= range.start || range.end <= r.start;
                assert!(taken.iter().all(|r| r.is_empty() || range.is_empty() || is_apart(r)));
                taken.push(range);
            } else {
                free.give_back(taken.swap_remove(rng.below(taken.len())));
            }
        }
        taken.into_iter().for_each(|range| free.give_back(range));
        assert_eq!((free.end, free.ranges.len()), (0, 0));
    }
}
