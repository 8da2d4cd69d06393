// Pictures of many planes, four to a texel: between texels, at any level; twin of texels.py.

uniform sampler2D planes;       // fours of planes side by side, levels one below the other
#if LEVELS == 1
uniform vec3 levels;            // width, height and first row
#define LEVEL(number) levels
#else
uniform vec3 levels[LEVELS];
#define LEVEL(number) levels[number]
#endif
// Beyond [0, 1] along u and v: 0 repeated, 1 held, 2 mirrored.
#ifndef WRAP_U
#define WRAP_U 0
#define WRAP_V 0
#endif

struct Four {                   // the texels about a point
    ivec2 first, last;
    vec2 part;
};

float inside(float along, int wrap) {
    if (wrap == 1) return clamp(along, 0.0, 1.0);
    return wrap == 2 ? 1.0 - abs(1.0 - 2.0 * fract(0.5 * along)) : fract(along);
}

// Beside an edge is the texel of the other side where the picture is repeated, else the edge's own. Half a texel keeps
// the quotient away from whole numbers: GPUs divide to within a few units in the last place.
float texel_at(float number, float count, int wrap) {
    return wrap == 0 ? number - count * floor((number + 0.5) / count) : clamp(number, 0.0, count - 1.0);
}

Four four_about(vec2 uv, vec3 level) {
    vec2 place = vec2(inside(uv.x, WRAP_U), 1.0 - inside(uv.y, WRAP_V)) * level.xy - 0.5;
    vec2 first = floor(place), next = first + 1.0;
    Four found = Four(ivec2(texel_at(first.x, level.x, WRAP_U), texel_at(first.y, level.y, WRAP_V)),
        ivec2(texel_at(next.x, level.x, WRAP_U), texel_at(next.y, level.y, WRAP_V)), place - first);
    found.first.y += int(level.z);
    found.last.y += int(level.z);
    return found;
}

vec4 between(Four at, int row) {
    int left = row * int(LEVEL(0).x);
    ivec2 a = at.first + ivec2(left, 0), b = at.last + ivec2(left, 0);
    vec4 above = mix(texelFetch(planes, a, 0), texelFetch(planes, ivec2(b.x, a.y), 0), at.part.x);
    vec4 below = mix(texelFetch(planes, ivec2(a.x, b.y), 0), texelFetch(planes, b, 0), at.part.x);
    return mix(above, below, at.part.y);
}

#ifdef MIPMAPPED
// The level, with its fraction, whose texels are as wide as the longer side of what a sample spans.
float level_at(mat2 footprint) {
    vec2 size = LEVEL(0).xy;
    float longer = max(length(footprint[0] * size), length(footprint[1] * size));
    return clamp(log2(max(longer, 1.0)), 0.0, float(LEVELS - 1));
}
#endif

struct Mixed {                  // the texels about a point, at one level or between two
    Four fine;
#ifdef MIPMAPPED
    Four coarse;
    float blend;                // fraction of the way from the fine level to the coarse one
#endif
};

Mixed mixed_about(vec2 uv, mat2 footprint) {
    Mixed at;
#ifdef MIPMAPPED
    float level = level_at(footprint);
    int fine = int(level);
    at.fine = four_about(uv, LEVEL(fine));
    at.coarse = four_about(uv, LEVEL(min(fine + 1, LEVELS - 1)));
    at.blend = level - float(fine);
#else
    at.fine = four_about(uv, LEVEL(0));
#endif
    return at;
}

vec4 mixed_between(Mixed at, int row) {
    vec4 found = between(at.fine, row);
#ifdef MIPMAPPED
    found = mix(found, between(at.coarse, row), at.blend);
#endif
    return found;
}
