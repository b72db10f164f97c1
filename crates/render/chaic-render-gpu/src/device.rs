//! Connection to the GPU device.

use crate::error::GpuError;

/// Allowed kinds of adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adapters {
    /// GPUs: the first discrete, virtual or integrated one.
    Hardware,
    /// GPUs, and software implementations for tests.
    Any,
}

impl Adapters {
    /// Kinds in order of preference.
    fn kinds(self) -> &'static [wgpu::DeviceType] {
        use wgpu::DeviceType::{Cpu, DiscreteGpu, IntegratedGpu, Other, VirtualGpu};
        match self {
            Adapters::Hardware => &[DiscreteGpu, VirtualGpu, IntegratedGpu],
            Adapters::Any => &[DiscreteGpu, VirtualGpu, IntegratedGpu, Other, Cpu],
        }
    }

    fn kind_names(self) -> &'static str {
        match self {
            Adapters::Hardware => "discrete, virtual, integrated",
            Adapters::Any => "discrete, virtual, integrated, other, software",
        }
    }
}

/// Maximum number of storage buffers that a shader binds.
const STORAGE_BUFFERS: u32 = 13;

/// An open device and its limits.
#[derive(Debug)]
pub(crate) struct GpuContext {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub info: wgpu::AdapterInfo,
    pub limits: wgpu::Limits,
}

impl GpuContext {
    /// Opens the best adapter of the allowed kinds.
    pub fn open(adapters: Adapters) -> Result<GpuContext, GpuError> {
        let mut description = wgpu::InstanceDescriptor::new_without_display_handle();
        description.backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(description);
        let all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let with_kind = |kind: &wgpu::DeviceType| {
            all.iter().find(|adapter| adapter.get_info().device_type == *kind)
        };
        let Some(adapter) = adapters.kinds().iter().find_map(with_kind) else {
            let describe = |adapter: &wgpu::Adapter| {
                let info = adapter.get_info();
                format!("{} ({:?})", info.name, info.device_type)
            };
            let found: Vec<String> = all.iter().map(describe).collect();
            let found = if found.is_empty() { "none".to_owned() } else { found.join(", ") };
            return Err(GpuError::NoAdapter { requested: adapters.kind_names(), found });
        };
        GpuContext::connect(adapter)
    }

    fn connect(adapter: &wgpu::Adapter) -> Result<GpuContext, GpuError> {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        let value = limits.max_storage_buffers_per_shader_stage;
        if value < STORAGE_BUFFERS {
            return Err(GpuError::WeakAdapter {
                name: info.name,
                limit: "max_storage_buffers_per_shader_stage",
                value: u64::from(value),
                required: u64::from(STORAGE_BUFFERS),
            });
        }
        let description = wgpu::DeviceDescriptor {
            label: Some("chaic"),
            required_limits: limits.clone(),
            ..Default::default()
        };
        match pollster::block_on(adapter.request_device(&description)) {
            Ok((device, queue)) => Ok(GpuContext { device, queue, info, limits }),
            Err(source) => Err(GpuError::Device { name: info.name, source }),
        }
    }

    /// Maximum size of a storage buffer, bytes.
    pub fn max_buffer_bytes(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// Creates a buffer of at least 16 bytes.
    pub fn buffer(
        &self,
        label: &'static str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let size = bytes.max(16).next_multiple_of(16);
        let full = GpuError::OutOfMemory { purpose: label, bytes: size };
        if size > self.limits.max_buffer_size {
            return Err(full);
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let description =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        let buffer = self.device.create_buffer(&description);
        match pollster::block_on(scope.pop()) {
            None => Ok(buffer),
            Some(_) => Err(full),
        }
    }

    /// Creates a read-only buffer with these contents.
    pub fn buffer_with(
        &self,
        label: &'static str,
        contents: &[u8],
    ) -> Result<wgpu::Buffer, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::COPY_DST;
        let buffer = self.buffer(label, contents.len() as u64, usage)?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Waits until all submitted work is done.
    pub fn wait(&self) -> Result<(), GpuError> {
        match self.device.poll(wgpu::PollType::wait_indefinitely()) {
            Ok(_) => Ok(()),
            Err(error) => Err(GpuError::Lost(error.to_string())),
        }
    }

    /// Reads the first bytes of several buffers from the device.
    pub fn read(&self, buffers: &[(&wgpu::Buffer, u64)]) -> Result<Vec<Vec<u8>>, GpuError> {
        let usage = wgpu::BufferUsages::MAP_READ.union(wgpu::BufferUsages::COPY_DST);
        let mut encoder = self.encoder();
        let mut copies = Vec::with_capacity(buffers.len());
        for (buffer, bytes) in buffers {
            let copy = self.buffer("readback buffers", *bytes, usage)?;
            if *bytes > 0 {
                encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, Some(*bytes));
            }
            copies.push(copy);
        }
        self.queue.submit([encoder.finish()]);
        for copy in &copies {
            // Errors appear when the range is requested.
            copy.map_async(wgpu::MapMode::Read, .., |_| {});
        }
        self.wait()?;
        let contents = copies.iter().zip(buffers).map(|(copy, (_, bytes))| {
            let range = copy.get_mapped_range(..).map_err(|e| GpuError::Lost(e.to_string()))?;
            Ok(range[..*bytes as usize].to_vec())
        });
        contents.collect()
    }
}
