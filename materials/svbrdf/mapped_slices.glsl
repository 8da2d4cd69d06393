// Slices of a surface of maps, twin of mapped_slices.py and facet_slices.py: those of facets and body, at the roughness of
// a texel, times its colours. Its numbers are in `planes`, at `levels`, and in `constants`.

#include "map_numbers.glsl"

#if ALPHAS == 1
#define EACH LOBES
#else
#define EACH (LOBES / 2)
#endif

uniform sampler2D axes;         // of each Gaussian its axis, and the logarithm of 1 / lambda; a row a viewer and alpha
uniform sampler2D slices;       // of each Gaussian, and of the cosine, last: body, body and facets at grazing in y and w
uniform float last;             // theta_o of the last viewer
uniform float first_alpha;
uniform float logistic;
uniform float widened;
uniform float steps;            // of alphas, to one of its logarithm

struct Here {
    int row;                    // of the smoother alpha, and the viewer below
    vec2 between;               // how far from there to the next alpha, and to the next viewer
    mat3 frame;                 // columns: its x above which the viewer is, and the normal of the texel, last
    vec4 body[ROWS], rest[ROWS], facet[ROWS];
    float edge;
};

void numbers_at(Four at, out float numbers[PLANES]) {
    for (int row = 0; row < PLANES / 4; ++row) {
        vec4 four = between(at, row);
        numbers[4 * row] = four.x;
        numbers[4 * row + 1] = four.y;
        numbers[4 * row + 2] = four.z;
        numbers[4 * row + 3] = four.w;
    }
}

Here here_at(Gathered s) {
    float numbers[PLANES], covers, shorter = 1.0;
    vec3 normal, wider = vec3(0.0);
#ifdef USES_UV
    vec2 uv = s.uv * placement.xy + placement.zw;
#else
    vec2 uv = vec2(0.5);
#endif
#if defined(MIPMAPPED) && defined(USES_UV)
    mat2 spanned = mat2(s.footprint[0] * placement.xy, s.footprint[1] * placement.xy);
    float level = level_at(mat2(spanned[0] / float(TAPS), spanned[1] / float(TAPS))), total[PLANES], coarse[PLANES];
    int fine = int(level);
    float part = level - float(fine), there = 0.0;
    vec3 first = vec3(0.0), second = vec3(0.0);     // moments of normals
    for (int k = 0; k < PLANES; ++k) total[k] = 0.0;
    for (int n = 0; n < TAPS * TAPS; ++n) {
        vec2 tap = (vec2(n % TAPS, n / TAPS) + 0.5) / float(TAPS) - 0.5;
        vec2 place = uv + tap.x * spanned[0] + tap.y * spanned[1];
        numbers_at(four_about(place, LEVEL(fine)), numbers);
        numbers_at(four_about(place, LEVEL(min(fine + 1, LEVELS - 1))), coarse);
        float share = 1.0;
#if COVERS >= 0
        if (fine == 0) numbers[COVERS] = numbers[COVERS] >= cutoff ? 1.0 : 0.0;
        share = mix(numbers[COVERS], coarse[COVERS], part);
#endif
        for (int k = 0; k < PLANES; ++k) numbers[k] = mix(numbers[k], coarse[k], part);
        for (int k = 0; k < PLANES; ++k) total[k] += share * numbers[k];
        vec3 mean = vec3(NUMBER(NORMAL, 0, AT_NORMAL), NUMBER(NORMAL, 1, AT_NORMAL), NUMBER(UP, 0, AT_UP));
        first += share * mean;
        second += share * vec3(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
        there += share;
    }
    bool some = there > 0.0;
    for (int k = 0; k < PLANES; ++k) numbers[k] = total[k] / (some ? there : 1.0);
    normal = some ? first / there : vec3(0.0, 0.0, 1.0);
#if NORMAL >= 0
    // See map_levels.wider.
    second = some ? second / there : vec3(0.0);
    vec3 covariance = second - vec3(normal.x * normal.x, normal.x * normal.y, normal.y * normal.y);
    vec3 up = normalize(normal);
    float flatter_up = max(up.z, 1e-3);
    mat2 turn = mat2(turned_to(up, vec3(1.0, 0.0, -up.x / flatter_up)).xy,
        turned_to(up, vec3(0.0, 1.0, -up.y / flatter_up)).xy);
    mat2 turned = turn * mat2(covariance.xy, covariance.yz) * transpose(turn);
    wider = widened * vec3(max(turned[0][0], 0.0), turned[0][1], max(turned[1][1], 0.0));
    float most = sqrt(wider.x * wider.z);
    wider.y = clamp(wider.y, -most, most);
#endif
    shorter = length(normal);
    normal /= shorter;
    covers = COVERS >= 0 ? there / float(TAPS * TAPS) : NUMBER(COVERS, 0, AT_COVERS);
#else
    numbers_at(four_about(uv, LEVEL(0)), numbers);
    normal = vec3(NUMBER(NORMAL, 0, AT_NORMAL), NUMBER(NORMAL, 1, AT_NORMAL), 0.0);
    normal.z = sqrt(max(1.0 - dot(normal.xy, normal.xy), 0.0));
    covers = NUMBER(COVERS, 0, AT_COVERS) >= cutoff ? 1.0 : 0.0;
#endif

    Here here;
    float height = dot(normal, s.wo);
    vec3 level_to = s.wo - height * normal, other = vec3(normal.z, 0.0, -normal.x);
    float across = length(level_to), flatter = length(other);
    vec3 x = across > 0.0 ? level_to / across : flatter > 0.0 ? other / flatter : vec3(1.0, 0.0, 0.0);
    here.frame = mat3(x, cross(normal, x), normal);

    vec3 spread = vec3(NUMBER(SPREAD_XX, 0, AT_SPREAD), NUMBER(SPREAD_XY, 0, AT_SPREAD + 1),
        NUMBER(SPREAD_YY, 0, AT_SPREAD + 2)) + wider;
    float alpha = sqrt(sqrt(spread.x * spread.z - spread.y * spread.y));
    // Where nothing is there, alpha does not matter but must be some.
    float rough = covers > 0.0 ? clamp(log(alpha / first_alpha) * steps, 0.0, float(ALPHAS - 1)) : 0.0;
    int smoother = min(int(rough), max(ALPHAS - 2, 0));
    float place = (1.0 - pow(1.0 - clamp(atan(across, height) / last, 0.0, 1.0), 2.0 / 3.0)) * float(POLAR - 1);
    int polar = min(int(place), POLAR - 2);
    here.row = smoother * POLAR + polar;
    here.between = vec2(rough - float(smoother), place - float(polar));

    // Of a body, whose texels together gather what their mean normal does, that is shorter.
    float seen = height > 0.0 ? covers : 0.0, dull = seen * shorter;
    for (int row = 0; row < ROWS; ++row) here.body[row] = here.rest[row] = here.facet[row] = vec4(0.0);
    for (int r = 0; r < RANK; ++r) {
        here.body[r / 4][r % 4] = dull * NUMBER(BODY, r, AT_BODY);
        here.rest[r / 4][r % 4] = dull * NUMBER(REST, r, AT_REST);
        here.facet[r / 4][r % 4] = seen * NUMBER(FACET, r, AT_FACET);
    }
    here.edge = seen * NUMBER(EDGE, 0, AT_EDGE);
    return here;
}

mat3 frame_of(Here here) {
    return here.frame;
}

vec4 between_viewers(sampler2D table, Here here, int column, int side) {
    int row = here.row + side * POLAR;
    return mix(texelFetch(table, ivec2(column, row), 0), texelFetch(table, ivec2(column, row + 1), 0), here.between.y);
}

// Those of the smoother alpha, then those of the rougher one.
vec4 lobe(Here here, int number) {
    vec4 found = between_viewers(axes, here, number % EACH, number / EACH);
    return vec4(normalize(found.xyz), exp(found.w));
}

// About what share of a Gaussian is above a horizon, where its axis is so high.
float above(float height, float width) {
    return 1.0 / (1.0 + exp(min(-logistic * height / sqrt(width), 80.0)));
}

vec4 value(Here here, int number, int row) {
    if (row >= ROWS) return vec4(0.0);
    vec4 found;
    if (number < LOBES) {
        int side = number / EACH;
        found = between_viewers(slices, here, number % EACH, side) * (side == 0 ? 1.0 - here.between.x : here.between.x);
    } else {
        int bend = number - LOBES + EACH;
        found = between_viewers(slices, here, bend, 0);
#if ALPHAS > 1
        found = mix(found, between_viewers(slices, here, bend, 1), here.between.x);
#endif
    }
    // What lies below the mesh's own horizon.
    vec3 up = vec3(here.frame[0].z, here.frame[1].z, here.frame[2].z);
    if (up.z < 1.0) {
        if (number < LOBES) {
            vec4 axis = lobe(here, number);
            found *= min(above(dot(axis.xyz, up), axis.w) / above(axis.z, axis.w), 1.0);
        } else {
            found *= 0.5 * (1.0 + up.z);
        }
    }
    vec4 total = found.x * here.body[row] + found.y * here.rest[row] + found.z * here.facet[row];
    if (row == RANK / 4) total[RANK % 4] += found.w * here.edge;
    return total;
}
