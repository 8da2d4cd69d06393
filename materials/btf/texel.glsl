// Texels of a BTF in clusters, of the four about a point each cluster once; twin of corners.by_cluster.

uniform sampler2D texels;

#include "corners.glsl"

// A texel's numbers are its cluster, what the cluster's mean counts, and its weights.
const int QUADS_A_TEXEL = (COMPONENTS + 4) / 4;

struct Clustered {
    int cluster[4];
    ivec2 place[4];
};

Clustered clustered(Four four) {
    Clustered found;
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 texel = corner_at(four, corner);
        found.place[corner] = ivec2(texel.x * QUADS_A_TEXEL, texel.y + four.level.z);
        found.cluster[corner] = int(texelFetch(texels, found.place[corner], 0).x);
    }
    return found;
}

// The sums of weights of all corners in the cluster of this one; false where an earlier corner has it, or nothing is.
bool weights_of(Clustered from, Four four, int corner, out vec4 weights[QUADS_A_TEXEL]) {
    for (int earlier = 0; earlier < corner; ++earlier)
        if (from.cluster[earlier] == from.cluster[corner]) return false;
    for (int quad = 0; quad < QUADS_A_TEXEL; ++quad) weights[quad] = vec4(0.0);
    float total = 0.0;
    for (int other = corner; other < 4; ++other) {
        if (from.cluster[other] != from.cluster[corner]) continue;
        float share = share_of(four, other);
        total += share;
        for (int quad = 0; quad < QUADS_A_TEXEL; ++quad)
            weights[quad] += share * texelFetch(texels, from.place[other] + ivec2(quad, 0), 0);
    }
    return total > 0.0;
}
