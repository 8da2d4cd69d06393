// What of a light that spreads is hidden at a sample; twin of gathering._left, lighting.visibility and
// lighting.environment.bright_light. Needs octahedral.glsl.

uniform sampler2D standing;     // of every sample: the weights of its triangle's second and third corner
uniform sampler2D faces;        // of every triangle of the window: its number in the scene; 1 where its back is seen
uniform isampler2D nodes;       // of every triangle of the scene: the vertices that its parts have
uniform isampler2D sites_of;    // of every vertex its site in front and behind, -1 inside of solids
uniform sampler2D sites;        // of every site: codes of its map, and what of the cosine is lost, four a texel
uniform sampler2D map_axes;     // octahedral, with a border: four axes of maps a texel, one four beside the other; mean last
uniform vec4 lost_steps[7];
uniform ivec4 division;         // of the part: first triangle, where its nodes begin, parts a side, nodes a triangle
uniform int bright;             // parts of a light, and fours of codes: numbers that compilers do not unroll
uniform int map_quads;
uniform sampler2D bright_lux;   // rows: what each bright part of amplitude 1 gives a surface, by the cosine to it
uniform vec4 bright_axes[MOST_BRIGHT];      // world, and lambda
uniform vec4 bright_amplitudes[MOST_BRIGHT];// of up to four fields
uniform vec4 rest[25];          // harmonics of all other light, of up to four fields

struct Hiding {
    vec4 codes[MAP_QUADS];
    vec4 lost[7];               // of the clamped cosine, sr, in harmonics
    bool inside;                // a corner lies in a solid: nothing is free
};

// lighting.visibility.harmonics.clamped_cosine, four a vector.
void clamped_cosine(vec3 n, out vec4 found[7]) {
    float xx = n.x * n.x, yy = n.y * n.y, zz = n.z * n.z;
    float one = 2.0 * PI / 3.0 * sqrt(3.0 / (4.0 * PI)), two = 0.25 * PI, four = -PI / 24.0;
    found[0] = vec4(PI * sqrt(1.0 / (4.0 * PI)), one * n.y, one * n.z, one * n.x);
    found[1] = two * vec4(sqrt(15.0 / (4.0 * PI)) * n.x * n.y, sqrt(15.0 / (4.0 * PI)) * n.y * n.z,
        sqrt(5.0 / (16.0 * PI)) * (3.0 * zz - 1.0), sqrt(15.0 / (4.0 * PI)) * n.x * n.z);
    found[2] = vec4(two * sqrt(15.0 / (16.0 * PI)) * (xx - yy), 0.0, 0.0, 0.0);
    found[3] = vec4(0.0);
    found[4] = four * vec4(sqrt(315.0 / (16.0 * PI)) * n.x * n.y * (xx - yy),
        sqrt(315.0 / (32.0 * PI)) * n.y * n.z * (3.0 * xx - yy),
        sqrt(45.0 / (16.0 * PI)) * n.x * n.y * (7.0 * zz - 1.0),
        sqrt(45.0 / (32.0 * PI)) * n.y * n.z * (7.0 * zz - 3.0));
    found[5] = four * vec4(sqrt(9.0 / (256.0 * PI)) * (35.0 * zz * zz - 30.0 * zz + 3.0),
        sqrt(45.0 / (32.0 * PI)) * n.x * n.z * (7.0 * zz - 3.0),
        sqrt(45.0 / (64.0 * PI)) * (xx - yy) * (7.0 * zz - 1.0),
        sqrt(315.0 / (32.0 * PI)) * n.x * n.z * (xx - 3.0 * yy));
    found[6] = vec4(four * sqrt(315.0 / (256.0 * PI)) * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy)), 0.0, 0.0, 0.0);
}

int node(int face, int a, int b) {
    int number = division.y + (face - division.x) * division.w + b * (division.z + 1) - b * (b - 1) / 2 + a;
    return texelFetch(nodes, ivec2(number % ROW_LENGTH, number / ROW_LENGTH), 0).x;
}

Hiding hiding_at(int number, ivec2 sample_at, vec3 normal) {
    vec2 face = texelFetch(faces, ivec2((number - 1) % ROW_LENGTH, (number - 1) / ROW_LENGTH), 0).xy;
    int triangle = int(face.x), k = division.z;
    vec2 place = texelFetch(standing, sample_at, 0).xy * float(k);
    int b = clamp(int(floor(place.y)), 0, k - 1);
    int a = clamp(int(floor(place.x)), 0, k - 1 - b);
    vec2 part = place - vec2(a, b);
    bool upper = part.x + part.y > 1.0;
    int corners[3] = int[3](node(triangle, upper ? a + 1 : a, upper ? b + 1 : b), node(triangle, a + 1, b),
        node(triangle, a, b + 1));
    vec3 weights = upper ? vec3(part.x + part.y - 1.0, 1.0 - part.y, 1.0 - part.x)
        : vec3(1.0 - part.x - part.y, part.x, part.y);
    Hiding at;
    at.inside = false;
    for (int k = 0; k < MAP_QUADS; ++k) at.codes[k] = vec4(0.0);
    for (int k = 0; k < 7; ++k) at.lost[k] = vec4(0.0);
    vec4 whole[7];
    clamped_cosine(normal, whole);
    for (int c = 0; c < 3; ++c) {
        ivec2 both = texelFetch(sites_of, ivec2(corners[c] % ROW_LENGTH, corners[c] / ROW_LENGTH), 0).xy;
        int site = face.y > 0.5 ? both.y : both.x;
        if (site < 0) {
            at.inside = true;
            for (int k = 0; k < 7; ++k) at.lost[k] += weights[c] * whole[k];
            continue;
        }
        ivec2 first = ivec2(site % SITES_A_ROW * (MAP_QUADS + 7), site / SITES_A_ROW);
        for (int k = 0; k < MAP_QUADS; ++k) at.codes[k] += weights[c] * texelFetch(sites, first + ivec2(k, 0), 0);
        for (int k = 0; k < 7; ++k) {
            at.lost[k] += weights[c] * lost_steps[k] * texelFetch(sites, first + ivec2(MAP_QUADS + k, 0), 0);
        }
    }
    return at;
}

float map_texel(Hiding at, ivec2 texel) {
    float found = texelFetch(map_axes, texel + ivec2(MAP_QUADS * (MAP_SIDE + 2), 0), 0).x;
    for (int k = 0; k < map_quads; ++k)
        found += dot(at.codes[k], texelFetch(map_axes, texel + ivec2(k * (MAP_SIDE + 2), 0), 0));
    return found;
}

// The signed angle to the nearest boundary of what is hidden, of a direction of the world.
float signed_distance(Hiding at, vec3 to) {
    float found = -1.0;
    if (!at.inside) {
        vec2 place = 0.5 * (octahedral(to) + 1.0) * float(MAP_SIDE) + 0.5;
        ivec2 corner = clamp(ivec2(floor(place)), ivec2(0), ivec2(MAP_SIDE));
        vec2 part = place - vec2(corner);
        found = mix(mix(map_texel(at, corner), map_texel(at, corner + ivec2(1, 0)), part.x),
            mix(map_texel(at, corner + ivec2(0, 1)), map_texel(at, corner + ivec2(1, 1)), part.x), part.y);
    }
    found = clamp(found, -MOST_BENT, MOST_BENT);
    return clamp(MAP_SOFT * 0.5 * log((1.0 + found) / (1.0 - found)), -0.5 * PI, 0.5 * PI);
}

float error_function(float theta, float k, float c) {
    float x = clamp(k * (theta + c * theta * theta * theta), -6.0, 6.0);
    float y = clamp(x * (1.12838 + 0.10277 * x * x), -20.0, 20.0);
    return tanh(y);
}

// The share of a Gaussian that is free, lighting.visibility.free_share.
float free_share(float angle, float lambda) {
    float k = sqrt(0.5 * lambda * (lambda + 0.2098) / (lambda + 1.2041));
    float c = -lambda / (24.0 * (lambda + 0.3460));
    float theta = clamp(angle, -0.5 * PI, 0.5 * PI);
    return 0.5 + 0.5 * error_function(theta, k, c) / error_function(0.5 * PI, k, c);
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
