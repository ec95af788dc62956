// Rays in index space, and the part of each that is looked at.

struct Ray {
    // At depth 0, and the step of a pixel of view depth.
    origin: vec3<f32>,
    direction: vec3<f32>,
    // 1 over the direction.
    inverse: vec3<f32>,
}

// Planes that cut the volume open. What is kept is convex: one part of each ray.
override clip_planes: u32 = 0u;

struct Part {
    // Depths in pixels: nothing is there unless the first is less.
    ends: vec2<f32>,
    // It begins where the volume is cut, rather than at its border or at the eye.
    is_cut: bool,
}

// All of a ray.
const ENDLESS: Part = Part(vec2(-1e30, 1e30), false);

// The ray through a point of the screen, pixels from the picture's middle.
fn ray_through(screen: vec2<f32>) -> Ray {
    let across = slabs.right.xyz * screen.x + slabs.up.xyz * screen.y;
    let origin = slabs.base.xyz + across * slabs.right.w;
    let direction = slabs.along.xyz + across * slabs.up.w;
    // A ray along a plane of the lattice is inside it or it is not: no infinities are needed.
    let tiny = abs(direction) < vec3<f32>(1e-20);
    return Ray(origin, direction, 1.0 / select(direction, vec3<f32>(1e-20), tiny));
}

// What of it lies in the lattice, before the eye, and in what is kept.
fn part_of(ray: Ray) -> Part {
    let lower = (vec3<f32>(-0.5) - ray.origin) * ray.inverse;
    let upper = (slabs.end.xyz - ray.origin) * ray.inverse;
    let entries = min(lower, upper);
    let exits = max(lower, upper);
    let enter = max(max(entries.x, entries.y), max(entries.z, slabs.along.w));
    let leave = min(exits.x, min(exits.y, exits.z));
    return kept_of(ray, Part(vec2<f32>(enter, leave), false));
}

// What of a part is not cut away.
fn kept_of(ray: Ray, part: Part) -> Part {
    var kept = part;
    for (var i = 0u; i < clip_planes; i++) {
        let plane = slabs.clip[i];
        let height = dot(plane.xyz, ray.origin) - plane.w;
        let growth = dot(plane.xyz, ray.direction);
        // A ray along a plane is on one side of it.
        let is_along = abs(growth) < 1e-20;
        let t = -height / select(growth, 1.0, is_along);
        let enters = !is_along && growth > 0.0 && t > kept.ends.x;
        kept.is_cut = kept.is_cut || enters;
        kept.ends.x = select(kept.ends.x, t, enters);
        kept.ends.y = select(kept.ends.y, min(kept.ends.y, t), !is_along && growth < 0.0);
        kept.ends.y = select(kept.ends.y, kept.ends.x, is_along && height < 0.0);
    }
    return kept;
}
