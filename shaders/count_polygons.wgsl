// Counts the fragments of every pixel.

@fragment
fn fragment(landed: Landed) {
    atomicAdd(&polygon_words[2u * pixel_of(landed.at) + 1u], 1u);
}
