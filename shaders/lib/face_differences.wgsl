// Faces of any field: values, and their growth between half a sample before and half a sample on,
// because the derivative of tents, boxes and normalised kernels jumps.

fn face(position: vec3<f32>) -> Face {
    var found = Face(value(position), vec3<f32>(0.0));
    if uses_gradient {
        // A loop, so that adapters compile `value` once.
        for (var axis = 0u; axis < 3u; axis++) {
            let offset = 0.5 * vec3<f32>(vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
            let past = value(position + offset).x;
            let before = value(position - offset).x;
            let growth = select(past - before, 0.0, past == NOTHING || before == NOTHING);
            found.gradient += 2.0 * offset * growth;
        }
    }
    return found;
}
