// Scenes without polygons: see lib/polygons.wgsl.

const POLYGONS: bool = false;

struct PolygonRay {
    nothing: u32,
}

fn polygon_ray(pixel: vec2<u32>, kept: vec2<f32>) -> PolygonRay {
    return PolygonRay(0u);
}

fn polygons_left(ray: PolygonRay) -> u32 {
    return 0u;
}

fn polygon_depth(ray: PolygonRay) -> f32 {
    return 0.0;
}

fn is_polygon_next(ray: PolygonRay, end: f32, t: f32, is_alone: bool) -> bool {
    return false;
}

fn lay_polygon(light: ptr<function, Gathered>, met: ptr<function, Met>) {}
