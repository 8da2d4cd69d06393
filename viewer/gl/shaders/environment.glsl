// Prefiltered environment light; twin of lighting.environment.prefiltering. Octahedral maps with a border of one texel,
// one below the other; up to four fields a texel.

uniform sampler2D pyramid;          // levels of ascending sharpness
uniform sampler2D irradiance;       // lux by normal, and its moments, side by side
uniform sampler2D fields;           // the map itself, latitude-longitude
uniform vec2 environment_levels[ENVIRONMENT_LEVELS];        // first row and side of each level
uniform float environment_sharpness[ENVIRONMENT_LEVELS];    // ascending; the first is 0

vec4 between_octahedral(sampler2D map, vec2 place, int first_row, int side) {
    vec2 at = 0.5 * (place + 1.0) * float(side) + 0.5;
    ivec2 corner = clamp(ivec2(floor(at)), ivec2(0), ivec2(side));
    vec2 part = at - vec2(corner);
    corner.y += first_row;
    vec4 above = mix(texelFetch(map, corner, 0), texelFetch(map, corner + ivec2(1, 0), 0), part.x);
    vec4 below = mix(texelFetch(map, corner + ivec2(0, 1), 0), texelFetch(map, corner + ivec2(1, 1), 0), part.x);
    return mix(above, below, part.y);
}

vec4 pyramid_at(vec2 place, int level) {
    return between_octahedral(pyramid, place, int(environment_levels[level].x), int(environment_levels[level].y));
}

// The map itself, linear between texel centres.
vec4 map_at(vec3 to) {
    ivec2 size = textureSize(fields, 0);
    float row = clamp(atan(length(to.xz), to.y) / PI * float(size.y) - 0.5, 0.0, float(size.y - 1));
    float turn = atan(to.x, -to.z) / (2.0 * PI);
    float column = (turn - floor(turn)) * float(size.x) - 0.5;
    int top = int(floor(row)), left = int(floor(column));
    int below = min(top + 1, size.y - 1), right = (left + 1) % size.x;
    float across = column - float(left);
    left = (left + size.x) % size.x;
    vec4 above = mix(texelFetch(fields, ivec2(left, top), 0), texelFetch(fields, ivec2(right, top), 0), across);
    vec4 under = mix(texelFetch(fields, ivec2(left, below), 0), texelFetch(fields, ivec2(right, below), 0), across);
    return mix(above, under, row - float(top));
}

// Mean luminance under a Gaussian about a direction; `width` is 1 / lambda.
vec4 under_gaussian(vec3 to, float width) {
    float lambda = 1.0 / width;
    int low = 0;
    while (low + 1 < ENVIRONMENT_LEVELS && environment_sharpness[low + 1] <= lambda) ++low;
    vec2 place = octahedral(to);
    vec4 found = pyramid_at(place, low);
    float below = 1.0 / (environment_sharpness[low] + SOFTENING), wanted = 1.0 / (lambda + SOFTENING);
    if (low + 1 < ENVIRONMENT_LEVELS) {
        float above = 1.0 / (environment_sharpness[low + 1] + SOFTENING);
        return mix(found, pyramid_at(place, low + 1), (below - wanted) / (below - above));
    }
    return lambda > environment_sharpness[low] ? mix(found, map_at(to), 1.0 - wanted / below) : found;
}

// Illuminance and its moments on a surface, in the axes that are the columns of `frame`.
void on_surface(mat3 frame, out vec4 found[BENT]) {
    vec2 at = 0.5 * (octahedral(frame[2]) + 1.0) * float(IRRADIANCE_SIDE) + 0.5;
    ivec2 corner = clamp(ivec2(floor(at)), ivec2(0), ivec2(IRRADIANCE_SIDE));
    vec2 part = at - vec2(corner);
    vec4 m[BENT];
    for (int k = 0; k < BENT; ++k) {
        ivec2 to = corner + ivec2(k * (IRRADIANCE_SIDE + 2), 0);
        vec4 above = mix(texelFetch(irradiance, to, 0), texelFetch(irradiance, to + ivec2(1, 0), 0), part.x);
        vec4 below = mix(texelFetch(irradiance, to + ivec2(0, 1), 0), texelFetch(irradiance, to + ivec2(1, 1), 0), part.x);
        m[k] = mix(above, below, part.y);
    }
    turned(frame, m, found);
}

// Independent of position.
void stand_at(int number, ivec2 at, vec3 normal) {
}
