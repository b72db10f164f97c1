//! The way to the graphics card.

use crate::error::GpuError;

/// Which adapters will do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adapters {
    /// Graphics cards: discrete, virtual or integrated ones, the first of these kinds there is.
    Cards,
    /// The same, and programs that stand in for a card: for tests.
    AnyKind,
}

impl Adapters {
    /// The kinds in order of preference.
    fn kinds(self) -> &'static [wgpu::DeviceType] {
        use wgpu::DeviceType::{Cpu, DiscreteGpu, IntegratedGpu, Other, VirtualGpu};
        match self {
            Adapters::Cards => &[DiscreteGpu, VirtualGpu, IntegratedGpu],
            Adapters::AnyKind => &[DiscreteGpu, VirtualGpu, IntegratedGpu, Other, Cpu],
        }
    }

    fn names(self) -> &'static str {
        match self {
            Adapters::Cards => "discrete, virtual, integrated",
            Adapters::AnyKind => "discrete, virtual, integrated, other, software",
        }
    }
}

/// Storage buffers that the widest shader binds.
const STORAGE_BUFFERS: u32 = 13;

/// An open device and what it can do.
#[derive(Debug)]
pub(crate) struct Link {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub info: wgpu::AdapterInfo,
    pub limits: wgpu::Limits,
}

impl Link {
    /// Opens the best adapter of these kinds.
    pub fn open(adapters: Adapters) -> Result<Link, GpuError> {
        let mut description = wgpu::InstanceDescriptor::new_without_display_handle();
        description.backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(description);
        let all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let of_kind = |kind: &wgpu::DeviceType| {
            all.iter().find(|adapter| adapter.get_info().device_type == *kind)
        };
        let Some(adapter) = adapters.kinds().iter().find_map(of_kind) else {
            let told = |adapter: &wgpu::Adapter| {
                let info = adapter.get_info();
                format!("{} ({:?})", info.name, info.device_type)
            };
            let found: Vec<String> = all.iter().map(told).collect();
            let found = if found.is_empty() { "none".to_owned() } else { found.join(", ") };
            return Err(GpuError::NoAdapter { wanted: adapters.names(), found });
        };
        Link::to(adapter)
    }

    fn to(adapter: &wgpu::Adapter) -> Result<Link, GpuError> {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        let has = limits.max_storage_buffers_per_shader_stage;
        if has < STORAGE_BUFFERS {
            return Err(GpuError::WeakAdapter {
                name: info.name,
                limit: "max_storage_buffers_per_shader_stage",
                has: u64::from(has),
                needed: u64::from(STORAGE_BUFFERS),
            });
        }
        let description = wgpu::DeviceDescriptor {
            label: Some("chaic"),
            required_limits: limits.clone(),
            ..Default::default()
        };
        match pollster::block_on(adapter.request_device(&description)) {
            Ok((device, queue)) => Ok(Link { device, queue, info, limits }),
            Err(source) => Err(GpuError::Device { name: info.name, source }),
        }
    }

    /// The largest buffer that a shader can see, bytes.
    pub fn most_bytes(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// A buffer of at least 16 bytes.
    pub fn buffer(
        &self,
        what: &'static str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let size = bytes.max(16).next_multiple_of(16);
        let full = GpuError::OutOfMemory { what, bytes: size };
        if size > self.limits.max_buffer_size {
            return Err(full);
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let description =
            wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
        let buffer = self.device.create_buffer(&description);
        match pollster::block_on(scope.pop()) {
            None => Ok(buffer),
            Some(_) => Err(full),
        }
    }

    /// A buffer for shaders to read, with these contents.
    pub fn filled(&self, what: &'static str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::COPY_DST;
        let buffer = self.buffer(what, contents.len() as u64, usage)?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Waits until all that was submitted is done.
    pub fn wait(&self) -> Result<(), GpuError> {
        match self.device.poll(wgpu::PollType::wait_indefinitely()) {
            Ok(_) => Ok(()),
            Err(error) => Err(GpuError::Lost(error.to_string())),
        }
    }

    /// Copies the first bytes of buffers back from the device, in one go.
    pub fn read(&self, buffers: &[(&wgpu::Buffer, u64)]) -> Result<Vec<Vec<u8>>, GpuError> {
        let usage = wgpu::BufferUsages::MAP_READ.union(wgpu::BufferUsages::COPY_DST);
        let mut encoder = self.encoder();
        let mut copies = Vec::with_capacity(buffers.len());
        for (buffer, bytes) in buffers {
            let copy = self.buffer("images on their way back", *bytes, usage)?;
            if *bytes > 0 {
                encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, Some(*bytes));
            }
            copies.push(copy);
        }
        self.queue.submit([encoder.finish()]);
        for copy in &copies {
            // An error shows when the range is asked for.
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
