// Texels about a point, at one level or between two, and their weights; twin of corners.py.

#ifdef LEVELS
uniform vec3 levels[LEVELS];    // width, height, and where its texels begin
#define LOOKS 2
#else
uniform ivec2 size;
#define LOOKS 1
#endif

struct Four {                   // the texels about a point at a level
    ivec2 first;
    vec2 part;
    ivec3 level;
};

struct Corners {
    Four four[LOOKS];
    float share[LOOKS];
};

Four four_about(vec2 uv, ivec3 level) {
    vec2 place = vec2(uv.x, 1.0 - uv.y) * vec2(level.xy) - 0.5;
    vec2 first = floor(place);
    return Four(ivec2(first), place - first, level);
}

Corners corners_about(vec2 uv, mat2 footprint) {
    Corners found;
#ifdef LEVELS
    // The level, with its fraction, whose texels are as wide as the longer side of what a sample spans.
    vec2 size = levels[0].xy;
    float longer = max(length(footprint[0] * size), length(footprint[1] * size));
    float level = clamp(log2(max(longer, 1.0)), 0.0, float(LEVELS - 1));
    int fine = int(level), coarse = min(fine + 1, LEVELS - 1);
    found.four[0] = four_about(uv, ivec3(levels[fine]));
    found.four[1] = four_about(uv, ivec3(levels[coarse]));
    found.share[1] = level - float(fine);
    found.share[0] = 1.0 - found.share[1];
#else
    found.four[0] = four_about(uv, ivec3(size, 0));
    found.share[0] = 1.0;
#endif
    return found;
}

ivec2 corner_at(Four four, int corner) {
    ivec2 at = four.first + ivec2(corner & 1, corner >> 1);
    // Half a texel keeps the quotient away from whole numbers: GPUs divide to within a few units in the last place.
    return at - four.level.xy * ivec2(floor((vec2(at) + 0.5) / vec2(four.level.xy)));
}

float share_of(Four four, int corner) {
    vec2 share = mix(1.0 - four.part, four.part, vec2(corner & 1, corner >> 1));
    return share.x * share.y;
}
