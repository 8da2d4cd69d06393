// A texel of a BTF: its cluster and its weights, and which four lie about a point. `texels` and `size` say where.

// One number of a texel: its cluster, what the cluster's mean counts, and its weights.
float number_of(ivec2 texel, int number) {
    const int quads = (COMPONENTS + 4) / 4;
    return texelFetch(texels, ivec2(texel.x * quads + number / 4, texel.y), 0)[number % 4];
}

ivec2 corner_at(ivec2 first, int corner) {
    ivec2 at = first + ivec2(corner & 1, corner >> 1);
    return at - size * ivec2(floor(vec2(at) / vec2(size)));
}

float share_of(vec2 part, int corner) {
    vec2 share = mix(1.0 - part, part, vec2(corner & 1, corner >> 1));
    return share.x * share.y;
}
