// Volumes that are cut open. What is kept is convex: one part of each ray.

// An override, as it ends a loop.
override clip_planes: u32 = 0u;

fn kept_of(ray: Ray, part: Part) -> Part {
    var kept = part;
    for (var i = 0u; i < clip_planes; i++) {
        let plane = inside.clip[i];
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
