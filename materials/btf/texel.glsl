// A texel of a BTF: its cluster and its weights. `texels` and `size` say where.

#include "corners.glsl"

// One number of a texel: its cluster, what the cluster's mean counts, and its weights.
float number_of(ivec2 texel, int number) {
    const int quads = (COMPONENTS + 4) / 4;
    return texelFetch(texels, ivec2(texel.x * quads + number / 4, texel.y), 0)[number % 4];
}
