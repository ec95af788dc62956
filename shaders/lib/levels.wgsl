// Isosurfaces: where the field passes a level between two slab faces. What passes it twice between
// them is not met; more slabs meet it.

// Times that the field is asked where it passes: by the secant, of whose ends the older counts for half
// once the other was moved twice (the Illinois rule).
const ROOT_STEPS: u32 = 7u;
// Times that a slab is halved then, where the field does not have the level at the place that was found.
const HALVINGS: u32 = 20u;
// Cells of the table by which single precision may be off.
const ROUNDING: f32 = 1e-3;
// Less than any value: where cells leave a gap there is none.
const FAR_BELOW: f32 = -1e30;

override levels: u32 = 0u;
// Whether the field is of cells with values on their points, which may jump past levels that it has nowhere.
override may_jump: bool = false;

fn level_count() -> u32 {
    return levels;
}

// Notes the levels that are passed from one depth to the other, with these values; whether there are
// any.
fn meet_levels(
    met: ptr<function, Met>,
    ray: Ray,
    u: vec2<f32>,
    ts: vec2<f32>,
    screen: vec2<f32>,
) -> bool {
    var is_met = false;
    for (var i = 0u; i < levels; i++) {
        let level = slabs.levels[i];
        let passes = (u.x < level.w) != (u.y < level.w) && u.x != NOTHING && u.y != NOTHING;
        if passes {
            var begin = vec2<f32>(ts.x, u.x - level.w);
            var end = vec2<f32>(ts.y, u.y - level.w);
            var t = 0.0;
            var side = 0;
            var here: Face;
            var in_cell = InCell(0u, vec3<f32>(0.0));
            var is_had = !may_jump;
            // One loop, so that a compiler holds the search for a cell once.
            for (var n = 0u; n < ROOT_STEPS + select(0u, HALVINGS, may_jump); n++) {
                t = begin.x - begin.y * (end.x - begin.x) / (end.y - begin.y);
                if may_jump {
                    if n == ROOT_STEPS {
                        begin = vec2<f32>(ts.x, u.x - level.w);
                        end = vec2<f32>(ts.y, u.y - level.w);
                    }
                    t = select(t, 0.5 * (begin.x + end.x), n >= ROOT_STEPS);
                }
                let place = ray.origin + ray.direction * t;
                if may_jump {
                    in_cell = cell_at(place);
                    here = face_in(in_cell, place, ray.direction);
                    here.value.x = max(here.value.x, FAR_BELOW);
                } else {
                    here = face(place, ray.direction);
                }
                let off = here.value.x - level.w;
                // Nested, so that it is left out of what never jumps.
                if may_jump {
                    if n + 1u >= ROOT_STEPS {
                        is_had = abs(off) <= abs(slabs.table.y) * slack_in(in_cell) + ROUNDING;
                        if is_had {
                            break;
                        }
                    }
                }
                let before = (off < 0.0) == (begin.y < 0.0);
                end.y = select(end.y, 0.5 * end.y, before && side == 1);
                begin.y = select(begin.y, 0.5 * begin.y, !before && side == -1);
                begin = select(begin, vec2<f32>(t, off), before);
                end = select(end, vec2<f32>(t, off), !before);
                side = select(-1, 1, before);
                if off == 0.0 {
                    is_had = true;
                    break;
                }
            }
            if !is_had {
                continue;
            }
            let in_hole = has_holes && is_hole(ray.origin + ray.direction * t);
            if growth == OF_LIT_CELLS {
                // A surface of values is turned as these grow, at the border, too.
                if !may_jump {
                    in_cell = cell_at(ray.origin + ray.direction * t);
                }
                here.gradient = slabs.table.y * growth_in(in_cell);
            }
            if growth == OF_LIT_ELLIPSOIDS {
                here.gradient = slabs.table.y * sum_of_functions(ray.origin + ray.direction * t).xyz;
            }
            let found = facing(here.gradient);
            let along = (shade.right.xyz * screen.x + shade.up.xyz * screen.y) * shade.up.w;
            let light = lit_by(found.normal, -normalize(shade.forward.xyz + along), found.share);
            let colour = level.rgb * light.colour + light.mirrored;
            let at = 1u + slices + i;
            (*met).surfaces[at] = Surface(t, select(slabs.opacities[i].x, 0.0, in_hole), colour);
            is_met = true;
        }
    }
    return is_met;
}
