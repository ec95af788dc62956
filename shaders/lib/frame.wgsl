// What every pass of one picture shares. Lengths are pixels at the focal plane.
struct Frame {
    // View-space steps of one index along x, y, z.
    view_x: vec4<f32>,
    view_y: vec4<f32>,
    view_z: vec4<f32>,
    // View-space position of the middle of the lattice; w: eye distance, 0 when orthographic.
    view_centre: vec4<f32>,
    // The middle of the lattice in index space; w: |det(view_x, view_y, view_z)|.
    lattice_centre: vec4<f32>,
    // Orthographic footprint of one voxel's unit kernel: lower triangle k11, k21, k22 of the map
    // from unit kernel offsets to pixels, and the depth of its kernel axis, 1 / sqrt(C).
    footprint: vec4<f32>,
    // Half the picture's width and height.
    half_size: vec2<f32>,
    // Kernel radius in voxels.
    radius: f32,
    // Tabulated extinction to extinction per pixel.
    extinction_scale: f32,
    // What a footprint falls to as its kernel is stretched: 1 / s^2, s = E / E0.
    footprint_scale: f32,
    padding0: f32,
    padding1: f32,
    padding2: f32,
}
