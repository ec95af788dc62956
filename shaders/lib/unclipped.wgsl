// Volumes that are not cut open: see lib/clipped.wgsl.

fn kept_of(ray: Ray, part: Part) -> Part {
    return part;
}
