// Occlusion of an area or environment light at a sample; twin of environment_light._left, lighting.visibility and
// lighting.environment.bright_light. Needs octahedral.glsl and located.glsl.

uniform sampler2D sites;        // codes of each site's map, four per texel
uniform sampler2D map_axes;     // octahedral, with a border: four axes of maps per texel, side by side; mean last
uniform int map_quads;          // number of fours of codes, a uniform to prevent unrolling
#ifndef PANEL
// Only for environments; softboxes have cells, see panel_hidden.glsl.
uniform sampler2D site_light;   // of each site, except narrow parts: 9 moments of occluded light, unoccluded lux
uniform int bright;             // number of bright parts, and of narrow ones, likewise
uniform int narrow;
uniform sampler2D bright_maps;  // rows: axes of maps in the direction of each bright part, and the mean
uniform sampler2D bright_lux;   // rows: illuminance by each bright part at amplitude 1, by the cosine to its axis
uniform vec4 bright_axes[MOST_BRIGHT];      // world, and lambda
uniform vec4 bright_amplitudes[MOST_BRIGHT];// of up to four fields

const int LIGHT_TEXELS = 10;
#endif

struct Hiding {
    vec4 codes[MAP_QUADS];
#ifndef PANEL
    vec4 lost[BENT];            // occluded light except narrow parts: lux and its moments, world axes
    vec4 whole;                 // its unoccluded illuminance, lux
#endif
    vec3 facet;                 // triangle normal
    float dark;                 // weight of the corners inside a solid, which are fully hidden
};

Hiding hiding_at(int number, ivec2 sample_at) {
    vec4 face;
    int near[3];
    float weights[3];
    sites_near(number, sample_at, face, near, weights);
    Hiding at;
    at.facet = face.yzw;
    at.dark = 0.0;
    for (int k = 0; k < MAP_QUADS; ++k) at.codes[k] = vec4(0.0);
#ifndef PANEL
    at.whole = vec4(0.0);
    for (int k = 0; k < BENT; ++k) at.lost[k] = vec4(0.0);
#endif
    for (int c = 0; c < 3; ++c) {
        int site = near[c];
        if (site < 0) {
            at.dark += weights[c];
            continue;
        }
        ivec2 first = ivec2(site % SITES_A_ROW * MAP_QUADS, site / SITES_A_ROW);
        for (int k = 0; k < map_quads; ++k) at.codes[k] += weights[c] * texelFetch(sites, first + ivec2(k, 0), 0);
#ifndef PANEL
        first = ivec2(site % LIT_A_ROW * LIGHT_TEXELS, site / LIT_A_ROW);
        for (int k = 0; k < BENT; ++k) at.lost[k] += weights[c] * texelFetch(site_light, first + ivec2(k, 0), 0);
        at.whole += weights[c] * texelFetch(site_light, first + ivec2(LIGHT_TEXELS - 1, 0), 0);
#endif
    }
    return at;
}

float map_texel(Hiding at, ivec2 texel) {
    float found = texelFetch(map_axes, texel + ivec2(MAP_QUADS * (MAP_SIDE + 2), 0), 0).x;
    for (int k = 0; k < map_quads; ++k)
        found += dot(at.codes[k], texelFetch(map_axes, texel + ivec2(k * (MAP_SIDE + 2), 0), 0));
    return found;
}

// Signed angle of a compressed distance.
float straight(float value) {
    float held = clamp(value, -MOST_BENT, MOST_BENT);
    return clamp(MAP_SOFT * 0.5 * log((1.0 + held) / (1.0 - held)), -0.5 * PI, 0.5 * PI);
}

// Signed angle from a unit world direction to the nearest occlusion boundary, and its gradient: a vector across the
// direction that points away from the occluder.
float boundary(Hiding at, vec3 to, out vec3 slope) {
    slope = vec3(0.0);
    if (at.dark > 0.0) return -0.5 * PI;
    vec2 place = 0.5 * (octahedral(to) + 1.0) * float(MAP_SIDE) + 0.5;
    ivec2 corner = clamp(ivec2(floor(place)), ivec2(0), ivec2(MAP_SIDE));
    vec2 part = place - vec2(corner);
    float a = map_texel(at, corner), b = map_texel(at, corner + ivec2(1, 0));
    float c = map_texel(at, corner + ivec2(0, 1)), d = map_texel(at, corner + ivec2(1, 1));
    float bent = mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
    if (abs(bent) < MOST_BENT) {
        // Derivative of the position in the map with respect to the direction: octahedral.slopes.
        float length = abs(to.x) + abs(to.y) + abs(to.z);
        vec3 signs = vec3(to.x < 0.0 ? -1.0 : 1.0, to.y < 0.0 ? -1.0 : 1.0, to.z < 0.0 ? -1.0 : 1.0), on = to / length;
        vec3 of_x = (vec3(1.0, 0.0, 0.0) - on.x * signs) / length, of_z = (vec3(0.0, 0.0, 1.0) - on.z * signs) / length;
        float turned = -signs.x * signs.z;
        bool below = to.y < 0.0;
        vec3 across = below ? turned * of_z : of_x, along = below ? turned * of_x : of_z;
        slope = (mix(b - a, d - c, part.y) * across + mix(c - a, d - b, part.x) * along)
            * (0.5 * float(MAP_SIDE) * MAP_SOFT / (1.0 - bent * bent));
    }
    return straight(bent);
}

float signed_distance(Hiding at, vec3 to) {
    vec3 slope;
    return boundary(at, to, slope);
}

float error_function(float theta, float k, float c) {
    float x = clamp(k * (theta + c * theta * theta * theta), -6.0, 6.0);
    float y = clamp(x * (1.12838 + 0.10277 * x * x), -20.0, 20.0);
    return tanh(y);
}

// k and c of lighting.visibility.free_share.
vec2 steepness(float lambda) {
    return vec2(sqrt(0.5 * lambda * (lambda + 0.2098) / (lambda + 1.2041)), -lambda / (24.0 * (lambda + 0.3460)));
}

// Free share of a Gaussian.
float free_share(float angle, float lambda) {
    vec2 of = steepness(lambda);
    float theta = clamp(angle, -0.5 * PI, 0.5 * PI);
    return 0.5 + 0.5 * error_function(theta, of.x, of.y) / error_function(0.5 * PI, of.x, of.y);
}

// Gaussian cut by a boundary, see lighting.visibility.cut_lobe: remaining share, angle of its mean direction towards
// the free side, and sharpness.
vec3 cut_lobe(float angle, float slope, float lambda) {
    vec2 of = steepness(lambda);
    float k = of.x, c = of.y, right = 0.5 * PI;
    float theta = clamp(angle, -right, right), u = k * (theta + c * theta * theta * theta);
    float last = k * (right + c * right * right * right);
    float rise = exp(-u * u) * (1.0 + 3.0 * c * theta * theta) - exp(-last * last) * (1.0 + 3.0 * c * right * right);
    float whole = error_function(right, k, c), share = 0.5 + 0.5 * error_function(theta, k, c) / whole;
    float across = slope * k / (sqrt(PI) * whole) * max(rise, 0.0) / (lambda * max(share, 1e-3));
    float alone = lambda < 0.01 ? 0.5 + lambda / 12.0 : 1.0 / (1.0 - exp(-lambda)) - 1.0 / lambda;
    float along = max(alone + 0.5 * theta * across, 0.0), spread = 1.0 - sqrt(across * across + along * along);
    float sharper = clamp((1.0 - alone) / max(spread, 0.5 * (1.0 - alone)), 1.0, 2.0);
    return vec3(share, atan(across, along), lambda * sharper);
}

// Irradiance by a Gaussian above a line `to` below its axis, up to a factor.
float sent_above(float to, float axis) {
    return exp(-0.5 * to * to) / sqrt(2.0 * PI) + axis * (0.5 + 0.5 * error_function(to * sqrt(0.5), 1.0, 0.0));
}

// Share of a Gaussian's light from above the triangle's plane, see lighting.visibility.free_share.
float share_above(float facet, float shading, float lambda) {
    float axis = max(shading * sqrt(lambda), -2.0), edge = axis + min((facet - shading) * sqrt(lambda), 0.0);
    return clamp(sent_above(edge, axis) / sent_above(axis, axis), 0.0, 1.0);
}

#ifndef PANEL
// `signed_distance` of a bright part's axis.
float part_distance(Hiding at, int part) {
    if (at.dark > 0.0) return -0.5 * PI;
    float found = texelFetch(bright_maps, ivec2(MAP_QUADS, part), 0).x;
    for (int k = 0; k < map_quads; ++k) found += dot(at.codes[k], texelFetch(bright_maps, ivec2(k, part), 0));
    return straight(found);
}

// Light except the narrow parts after occlusion, with the relative loss at the vertices.
void left_of(vec4 others[BENT], Hiding at, mat3 to_world, out vec4 left[BENT]) {
    vec4 lost[BENT], share = vec4(0.0);
    turned(to_world, at.lost, lost);
    for (int k = 0; k < 4; ++k)
        if (at.lost[0][k] > 0.0) share[k] = max(others[0][k], 0.0) / max(at.whole[k], at.lost[0][k]);
    for (int b = 0; b < BENT; ++b) left[b] = (others[b] - lost[b] * share) * (1.0 - at.dark);
}

float bright_under(vec3 to, float lambda, vec4 bright) {
    float both = lambda + bright.w;
    vec3 apart = to - bright.xyz;
    float product = lambda * bright.w * 0.5 * dot(apart, apart);
    float length = sqrt(max(both * both - 2.0 * product, 1e-30));
    float inner = (1.0 - exp(-2.0 * length)) / length * exp(-2.0 * product / (length + both));
    return inner * lambda / (1.0 - exp(-2.0 * lambda));
}

float bright_on(vec3 normal, int part) {
    float last = float(textureSize(bright_lux, 0).x - 1);
    float place = (clamp(dot(normal, bright_axes[part].xyz), -1.0, 1.0) + 1.0) * 0.5 * last;
    int below = min(int(place), int(last) - 1);
    return mix(texelFetch(bright_lux, ivec2(below, part), 0).x, texelFetch(bright_lux, ivec2(below + 1, part), 0).x,
        place - float(below));
}
#endif
