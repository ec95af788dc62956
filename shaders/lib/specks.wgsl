// Matter of a few samples among the many that a mean is of, where rays look for small things.
//
// Between means, a mean and the width about it sink together: the highest value is reached in the middle
// of a group alone, and half of it half-way to the next. What begins to show late would be lost. Here the
// groups about a place keep their highest and lowest values, and of what is there it is as large a part as
// would make the mean that is found: m = beside + part · (end − beside).

// A slab of what is found about its middle, and at least of what a few values of the means there make of
// it: those from the mean beside to the farthest, as a single sample passes through them.
fn with_specks(found: Halves, position: vec3<f32>) -> Halves {
    let floored = floor(position);
    let f = position - floored;
    let i = stored_index(vec3<i32>(floored));
    let row = slabs.stored.x;
    let plane = row * slabs.stored.y;
    let a = mean_and_width(i);
    let b = mean_and_width(i + 1u);
    let c = mean_and_width(i + row);
    let d = mean_and_width(i + row + 1u);
    let e = mean_and_width(i + plane);
    let g = mean_and_width(i + plane + 1u);
    let h = mean_and_width(i + plane + row);
    let j = mean_and_width(i + plane + row + 1u);
    let near = vec4<f32>(a.x, b.x, c.x, d.x);
    let far = vec4<f32>(e.x, g.x, h.x, j.x);
    let near_width = vec4<f32>(a.y, b.y, c.y, d.y);
    let far_width = vec4<f32>(e.y, g.y, h.y, j.y);
    let across = mix(near, far, f.z);
    let along = mix(across.xy, across.zw, f.y);
    let mean = mix(along.x, along.y, f.x);
    let least_mean = least(min(near, far));
    let greatest_mean = -least(-max(near, far));
    let lowest = least(min(near - near_width, far - far_width));
    let highest = -least(-max(near + near_width, far + far_width));
    let up = few_of(mean, least_mean, highest);
    let down = few_of(mean, greatest_mean, lowest);
    let few = select(down, up, up.w >= down.w);
    let is_more = few.w > max(found.near.w, found.far.w);
    return Halves(select(found.near, few, is_more), select(found.far, few, is_more));
}

fn least(four: vec4<f32>) -> f32 {
    let two = min(four.xy, four.zw);
    return min(two.x, two.y);
}

// Mean colour and weight of the values from a mean beside to one that few samples have, as many as their
// mean says.
fn few_of(mean: f32, beside: f32, end: f32) -> vec4<f32> {
    let part = (mean - beside) / select(end - beside, 1.0, end == beside);
    let ends = vec2<f32>(slabs.table.x) + slabs.table.y * vec2<f32>(beside, end);
    let low = floor(min(ends.x, ends.y) + 0.5);
    let high = floor(max(ends.x, ends.y) + 0.5);
    let all = mean_of(fetched(high, false) - fetched(low, false), high - low);
    return vec4<f32>(all.rgb, all.w * clamp(part, 0.0, 1.0));
}
