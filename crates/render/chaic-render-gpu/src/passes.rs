//! Compute pipelines of the shaders.

use chaic_core::EntityId;
use chaic_core::geom::Camera;
use chaic_render::LEVEL_RADIUS_PX;
use chaic_render::geometry::N_LEVELS;
use chaic_render::geometry::TILE_TEXELS;

use crate::device::GpuContext;

/// Compute pipelines in execution order.
#[derive(Debug)]
pub(crate) struct Passes {
    pub cull: wgpu::ComputePipeline,
    pub setup: wgpu::ComputePipeline,
    pub tiles: wgpu::ComputePipeline,
    pub shade: wgpu::ComputePipeline,
}

impl Passes {
    pub fn new(context: &GpuContext) -> Passes {
        Passes {
            cull: pipeline(context, "cull", include_str!("shaders/cull.wgsl")),
            setup: pipeline(context, "setup", include_str!("shaders/setup.wgsl")),
            tiles: pipeline(context, "tiles", include_str!("shaders/tiles.wgsl")),
            shade: pipeline(context, "shade", include_str!("shaders/shade.wgsl")),
        }
    }
}

/// Compute pipeline of the shader `name`, which is also its entry point.
fn pipeline(context: &GpuContext, name: &'static str, source: &str) -> wgpu::ComputePipeline {
    let radii = LEVEL_RADIUS_PX.map(|r| format!("{r:?}")).join(", ");
    let constants = format!(
        "const NEAR_M: f32 = {:?};\nconst FAR_M: f32 = {:?};\n\
         const N_LEVELS: u32 = {N_LEVELS}u;\n\
         const LEVEL_RADIUS_PX = array<f32, N_LEVELS>({radii});\n\
         const FLOOR: u32 = {}u;\nconst TILE_TEXELS: u32 = {}u;\nconst LOG2_TILE_TEXELS: u32 = {}u;\n",
        Camera::NEAR_M,
        Camera::FAR_M,
        EntityId::FLOOR.0,
        TILE_TEXELS,
        TILE_TEXELS.ilog2(),
    );
    let source = [&constants, include_str!("shaders/common.wgsl"), source].concat();
    let module = context.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    context.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: None,
        module: &module,
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// Binds buffers to consecutive binding indices.
pub(crate) fn bind(
    context: &GpuContext,
    pipeline: &wgpu::ComputePipeline,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let resources = buffers.iter().map(|buffer| buffer.as_entire_binding());
    let entries: Vec<_> = resources
        .zip(0..)
        .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    context.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    })
}
