// Terms of a spectral texture, twin of texture_form.py and texels.py: planes of coefficients, four to a texel.

uniform sampler2D planes;       // fours of planes side by side, levels one below the other
#if LEVELS == 1
uniform vec3 levels;            // width, height and first row
#define LEVEL(number) levels
#else
uniform vec3 levels[LEVELS];
#define LEVEL(number) levels[number]
#endif

struct Four {                   // the texels about a point
    ivec2 first, last;
    vec2 part;
};

struct Here {
    Four fine;
#ifdef MIPMAPPED
    Four coarse;
    float blend;                // how far from the fine level to the coarse one
#endif
    float scale;
};

Four four_about(vec2 uv, vec3 level) {
    vec2 place = vec2(fract(uv.x), 1.0 - fract(uv.y)) * level.xy - 0.5;
    vec2 first = floor(place), next = first + 1.0;
    // Repeated: the texel before the first is the last.
    Four found = Four(ivec2(first - level.xy * floor(first / level.xy)), ivec2(next - level.xy * floor(next / level.xy)),
        place - first);
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

Here here_at(Sample s) {
    Here here;
    here.scale = s.angles.w;
#ifdef MIPMAPPED
    vec2 size = LEVEL(0).xy;
    float longer = max(length(s.footprint[0] * size), length(s.footprint[1] * size));
    float level = clamp(log2(max(longer, 1.0)), 0.0, float(LEVELS - 1));
    int fine = int(level);
    here.fine = four_about(s.uv, LEVEL(fine));
    here.coarse = four_about(s.uv, LEVEL(min(fine + 1, LEVELS - 1)));
    here.blend = level - float(fine);
#else
    here.fine = four_about(s.uv, LEVEL(0));
#endif
    return here;
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 term(Here here, int mixed, int row) {
    vec4 found = between(here.fine, row);
#ifdef MIPMAPPED
    found = mix(found, between(here.coarse, row), here.blend);
#endif
    return found * here.scale;
}
