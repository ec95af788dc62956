// Surfaces that are polygons alone: see lib/met.wgsl.

const MOST_MET: u32 = 1u;

fn surface_count() -> u32 {
    return 0u;
}

struct Met {
    surfaces: array<Surface, MOST_MET>,
    done: f32,
    polygons: PolygonRay,
}

fn met_along(ray: Ray, part: Part, pixel: vec2<u32>) -> Met {
    var met: Met;
    met.polygons = polygon_ray(pixel, kept_of(ray, ENDLESS).ends);
    return met;
}

fn next_met(met: ptr<function, Met>, end: f32) -> u32 {
    return MOST_MET;
}
