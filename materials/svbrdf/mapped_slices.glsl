// Slices of a surface of maps, twin of mapped_slices.py and facet_slices.py: those of facets and body, at the roughness of
// a texel, times its colours. Its numbers are in `planes`, at `levels`, and in `constants`.

#include "map_numbers.glsl"
#include "facet_slices.glsl"
#include "stretched.glsl"

uniform float widened;
#ifdef CUT
uniform float own_share;        // see map_planes.OWN_SHARE
#endif

struct Here {
    Place at[PARTS];
#if PARTS > 1
    mat3 frames[PARTS];         // frames of the leaning parts of facets, as `frame`
    float shares[PARTS];        // shares of the parts in what is seen
    float alphas[PARTS];
    vec3 spread;
    vec2 whole;                 // energy sent on by all over that of the parts: facets, and facets at grazing
#endif
    mat3 frame;                 // columns: its x above which the viewer is, and the normal of the texel, last
    vec4 body[ROWS], rest[ROWS], facet[ROWS];
    float edge;
#ifdef COAT
    Place coat_at;
    mat3 coat_frame;            // as `frame`, of the coat's own normal
    float coat;                 // share of the coat that is seen
#endif
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

#ifdef COAT
// The same of the coat itself.
vec4 coat_lobe(Here here, int number) {
    vec4 found = between_viewers(axes, here.coat_at, number % COAT_EACH, number / COAT_EACH);
    return vec4(normalize(found.xyz), exp(found.w));
}

// Value of a Gaussian of the coat; with `bend`, of its cosine, whose columns lie behind the Gaussians of one alpha.
float coat_value(Here here, int number, bool bend) {
    float part = coat_alphas > 1 ? here.coat_at.between.x : 0.0, height = here.coat_frame[2].z;
    vec4 found;
    if (bend) {
        found = between_viewers(slices, here.coat_at, COAT_EACH + number, 0);
        if (coat_alphas > 1) found = mix(found, between_viewers(slices, here.coat_at, COAT_EACH + number, 1), part);
        found *= 0.5 * (1.0 + height);
    } else {
        int side = number / COAT_EACH;
        found = between_viewers(slices, here.coat_at, number % COAT_EACH, side) * (side == 0 ? 1.0 - part : part);
        vec4 axis = coat_lobe(here, number);
        float free = above((here.coat_frame * axis.xyz).z, axis.w) / above(axis.z, axis.w);
        found *= min(free, 1.0);
    }
    return here.coat * (coat_f0 * found.z + found.w);
}
#endif

#if PARTS > 1
// Share of a part's Gaussian left by the shadows of all facets, over that left by the part's own.
float shadowed_more(Here here, int part, vec3 axis) {
    float alpha2 = here.alphas[part] * here.alphas[part];
    vec3 local = turned_to(here.frame[2], here.frames[part] * axis);
    return shadowed(local, here.spread) / shadowed(axis, vec3(alpha2, 0.0, alpha2));
}

// See stretched.parts_of, and mapped_slices.MappedSlices._stretched.
Here lean(Here here, vec3 spread, vec3 normal, vec3 wo, float theta) {
    float along = 0.5 * (spread.x - spread.z), half_apart = length(vec2(along, spread.y));
    float wide = 0.5 * (spread.x + spread.z) + half_apart;
    float narrow = min((spread.x * spread.z - spread.y * spread.y) / wide, wide);
    float turn = half_apart > 0.0 ? 0.5 * atan(spread.y, along) : 0.0;
    float ratio = 0.5 * log(wide / narrow);
    int row = 0;
    while (row < RATIOS - 2 && texelFetch(leaning, ivec2(1, row + 1), 0).w < ratio) ++row;
    float low = texelFetch(leaning, ivec2(1, row), 0).w, high = texelFetch(leaning, ivec2(1, row + 1), 0).w;
    float part = clamp((ratio - low) / (high - low), 0.0, 1.0);
    vec4 first = mix(texelFetch(leaning, ivec2(0, row), 0), texelFetch(leaning, ivec2(0, row + 1), 0), part);
    vec4 second = mix(texelFetch(leaning, ivec2(1, row), 0), texelFetch(leaning, ivec2(1, row + 1), 0), part);
    float across = length(normal.yz);
    vec2 up = across > 0.0 ? normal.zy / across : vec2(1.0, 0.0);
    vec3 level = cos(turn) * vec3(across, -normal.x * up.y, -normal.x * up.x) + sin(turn) * vec3(0.0, up.x, -up.y);
    float middles[5] = float[5](0.0, first.x, -first.x, first.y, -first.y), all = 0.0;
    float shares[5] = float[5](1.0 - 2.0 * (first.z + first.w), first.z, first.z, first.w, first.w);
    float widths[5] = float[5](second.x, second.y, second.y, second.z, second.z);
    for (int k = 0; k < PARTS; ++k) {
        float slope = middles[k] * sqrt(wide), longer = sqrt(1.0 + slope * slope), height;
        vec3 own = (normal + slope * level) / longer;
        here.frames[k] = frame_about(own, wo, height);
        float leans = min(atan(length(wo - height * own), height), 1.5707963267949);
        here.alphas[k] = widths[k] * sqrt(narrow) / longer;
        here.at[k] = place_of(leans, here.alphas[k]);
        here.shares[k] = shares[k] * longer * max(height, 0.0);
        all += here.shares[k];
    }
    here.spread = spread;
    vec2 total = vec2(0.0);
    for (int k = 0; k < PARTS; ++k) {
        here.shares[k] = all > 0.0 ? here.shares[k] / all : 0.0;
        vec2 sent = between_alphas(here.at[k], EACH + BENT).zw;
        for (int q = 0; q < OF_PART; ++q) {
            vec4 axis = own_lobe(here.at[k], q);
            float stays = above(dot(here.frames[k] * axis.xyz, normal), axis.w) / above(axis.z, axis.w);
            stays = min(stays, 1.0) * shadowed_more(here, k, axis.xyz);
            sent -= (1.0 - stays) * own_value(here.at[k], q).zw;
        }
        total += here.shares[k] * sent;
    }
    float mean = sqrt(0.5 * (spread.x + spread.z));
    vec2 goal = between_alphas(place_of(theta, mean), EACH + BENT).zw;
    vec3 to = turned_to(normal, wo);
    vec2 axis = vec2(cos(turn), sin(turn));
    to = vec3(dot(axis, to.xy), axis.x * to.y - axis.y * to.x, max(to.z, 1e-4));
    goal *= sent_on(vec2(sqrt(wide), sqrt(narrow)), to) / sent_on(vec2(mean), to);
    here.whole = vec2(total.x > 0.0 ? goal.x / total.x : 0.0, total.y > 0.0 ? goal.y / total.y : 0.0);
    return here;
}
#endif

#if defined(MIPMAPPED) && defined(USES_UV)
// Widening of the spread about a mean of differing normals, from the means of x, y, z and of xx, xy, yy; see
// map_levels.wider.
vec3 wider_by(vec3 mean, vec3 second) {
    vec3 covariance = second - vec3(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
    vec3 up = normalize(mean);
    float flatter_up = max(up.z, 1e-3);
    mat2 turn = mat2(turned_to(up, vec3(1.0, 0.0, -up.x / flatter_up)).xy,
        turned_to(up, vec3(0.0, 1.0, -up.y / flatter_up)).xy);
    mat2 turned = turn * mat2(covariance.xy, covariance.yz) * transpose(turn);
    vec3 more = widened * vec3(max(turned[0][0], 0.0), turned[0][1], max(turned[1][1], 0.0));
    float most = sqrt(more.x * more.z);
    return vec3(more.x, clamp(more.y, -most, most), more.z);
}
#endif

Here here_at(Gathered s) {
    float numbers[PLANES], covers, shorter = 1.0;
    vec3 normal, wider = vec3(0.0);
#ifdef COAT
    vec3 coat_normal, coat_wider = vec3(0.0);
#endif
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
#ifdef COAT
    vec3 coat_first = vec3(0.0), coat_second = vec3(0.0);
#endif
    for (int k = 0; k < PLANES; ++k) total[k] = 0.0;
#ifdef CUT
    // Last what the point itself shows, which is there.
    for (int n = 0; n <= TAPS * TAPS; ++n) {
        bool own = n == TAPS * TAPS;
#else
    for (int n = 0; n < TAPS * TAPS; ++n) {
        const bool own = false;
#endif
        vec2 tap = own ? vec2(0.0) : (vec2(n % TAPS, n / TAPS) + 0.5) / float(TAPS) - 0.5;
        vec2 place = uv + tap.x * spanned[0] + tap.y * spanned[1];
        if (own) fine = 0, part = 0.0;
        numbers_at(four_about(place, LEVEL(fine)), numbers);
        numbers_at(four_about(place, LEVEL(min(fine + 1, LEVELS - 1))), coarse);
        float share = 1.0;
#if COVERS >= 0
        if (fine == 0) numbers[COVERS] = numbers[COVERS] >= cutoff ? 1.0 : 0.0;
        share = mix(numbers[COVERS], coarse[COVERS], part);
#endif
#ifdef CUT
        if (own) share = own_share;
#endif
        for (int k = 0; k < PLANES; ++k) numbers[k] = mix(numbers[k], coarse[k], part);
        for (int k = 0; k < PLANES; ++k) total[k] += share * numbers[k];
        vec3 mean = vec3(NUMBER(NORMAL, 0, AT_NORMAL), NUMBER(NORMAL, 1, AT_NORMAL), NUMBER(UP, 0, AT_UP));
        first += share * mean;
        second += share * vec3(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
#ifdef COAT
        mean = vec3(NUMBER(COAT_NORMAL, 0, AT_COAT_NORMAL), NUMBER(COAT_NORMAL, 1, AT_COAT_NORMAL),
            NUMBER(COAT_UP, 0, AT_COAT_UP));
        coat_first += share * mean;
        coat_second += share * vec3(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
#endif
        there += share;
    }
    bool some = there > 0.0;
    for (int k = 0; k < PLANES; ++k) numbers[k] = total[k] / (some ? there : 1.0);
    normal = some ? first / there : vec3(0.0, 0.0, 1.0);
    wider = vec3(NUMBER(DIFFER, 0, AT_DIFFER), NUMBER(DIFFER, 1, AT_DIFFER), NUMBER(DIFFER, 2, AT_DIFFER));
#if NORMAL >= 0
    wider += wider_by(normal, some ? second / there : vec3(0.0));
#endif
#ifdef COAT
    coat_normal = some ? coat_first / there : vec3(0.0, 0.0, 1.0);
    coat_wider = vec3(NUMBER(COAT_DIFFER, 0, AT_COAT_DIFFER), NUMBER(COAT_DIFFER, 1, AT_COAT_DIFFER),
        NUMBER(COAT_DIFFER, 2, AT_COAT_DIFFER));
#if COAT_NORMAL >= 0
    coat_wider += wider_by(coat_normal, some ? coat_second / there : vec3(0.0));
#endif
    coat_normal = normalize(coat_normal);
#endif
    shorter = length(normal);
    normal /= shorter;
    covers = COVERS >= 0 ? there / float(TAPS * TAPS) : NUMBER(COVERS, 0, AT_COVERS);
#else
    numbers_at(four_about(uv, LEVEL(0)), numbers);
    normal = vec3(NUMBER(NORMAL, 0, AT_NORMAL), NUMBER(NORMAL, 1, AT_NORMAL), 0.0);
    normal.z = sqrt(max(1.0 - dot(normal.xy, normal.xy), 0.0));
    covers = NUMBER(COVERS, 0, AT_COVERS) >= cutoff ? 1.0 : 0.0;
#ifdef COAT
    coat_normal = vec3(NUMBER(COAT_NORMAL, 0, AT_COAT_NORMAL), NUMBER(COAT_NORMAL, 1, AT_COAT_NORMAL), 0.0);
    coat_normal.z = sqrt(max(1.0 - dot(coat_normal.xy, coat_normal.xy), 0.0));
#endif
#endif

#ifdef CUT
    covers = 1.0;
#endif

    Here here;
    float height;
    here.frame = frame_about(normal, s.wo, height);
    float theta = atan(length(s.wo - height * normal), height);
    vec3 spread = vec3(NUMBER(SPREAD_XX, 0, AT_SPREAD), NUMBER(SPREAD_XY, 0, AT_SPREAD + 1),
        NUMBER(SPREAD_YY, 0, AT_SPREAD + 2)) + wider;
    // Placeholder alpha in a hole, where its weight is 0.
    if (!(covers > 0.0)) spread = vec3(first_alpha * first_alpha, 0.0, first_alpha * first_alpha);
#ifdef COAT
    coat_share = NUMBER(COAT, 0, AT_COAT);
#endif
#if PARTS > 1
    here = lean(here, spread, normal, s.wo, theta);
#else
    here.at[0] = place_of(theta, sqrt(sqrt(spread.x * spread.z - spread.y * spread.y)));
#endif

    // The texels of a body together gather as their mean normal, which is shorter.
    float seen = height > 0.0 ? covers : 0.0, dull = seen * shorter;
    for (int row = 0; row < ROWS; ++row) here.body[row] = here.rest[row] = here.facet[row] = vec4(0.0);
    for (int r = 0; r < RANK; ++r) {
        here.body[r / 4][r % 4] = dull * NUMBER(BODY, r, AT_BODY);
        here.rest[r / 4][r % 4] = dull * NUMBER(REST, r, AT_REST);
        here.facet[r / 4][r % 4] = seen * NUMBER(FACET, r, AT_FACET);
    }
    here.edge = seen * NUMBER(EDGE, 0, AT_EDGE);
#ifdef COAT
    here.coat_frame = frame_about(coat_normal, s.wo, height);
    theta = min(atan(length(s.wo - height * coat_normal), height), 1.5707963267949);
    float alpha2 = NUMBER(COAT_SPREAD, 0, AT_COAT_SPREAD);
    spread = vec3(alpha2, 0.0, alpha2) + coat_wider;
    if (!(covers > 0.0)) spread = vec3(1.0, 0.0, 1.0);
    float alpha = sqrt(sqrt(spread.x * spread.z - spread.y * spread.y));
    here.coat_at = place_among(theta, alpha, coat_first_alpha, coat_alphas);
    here.coat_at.row += coat_row;
    here.coat = height > 0.0 ? covers * coat_share : 0.0;
#endif
    return here;
}

mat3 frame_of(Here here) {
    return here.frame;
}

vec4 lobe(Here here, int number) {
#ifdef COAT
    if (number >= OWN_LOBES) {
        vec4 over = coat_lobe(here, number - OWN_LOBES);
        return vec4((here.coat_frame * over.xyz) * here.frame, over.w);
    }
#endif
    vec4 own = own_lobe(here.at[number / OF_PART], number % OF_PART);
#if PARTS > 1
    own.xyz = (here.frames[number / OF_PART] * own.xyz) * here.frame;
#endif
    return own;
}

vec4 value(Here here, int number, int row) {
    if (row >= ROWS) return vec4(0.0);
    vec4 found = vec4(0.0);
    float over = 0.0;
#ifdef COAT
    if (number >= OWN_LOBES) over = coat_value(here, number - (number < LOBES ? OWN_LOBES : LOBES), number >= LOBES);
    if (number >= OWN_LOBES && number < LOBES) {
        if (row == RANK / 4) found[RANK % 4] = over;
        return found;
    }
#endif
    vec3 up = vec3(here.frame[0].z, here.frame[1].z, here.frame[2].z);
    if (number < OWN_LOBES) {
        int part = number / OF_PART;
        found = own_value(here.at[part], number % OF_PART);
        vec4 axis = own_lobe(here.at[part], number % OF_PART);
        // Remove the share below the mesh's own horizon; of leaning parts, below the texel's as well.
#if PARTS > 1
        vec3 to = here.frames[part] * axis.xyz;
        float free = min(above(to.z, axis.w), above(dot(to, here.frame[2]), axis.w)) / above(axis.z, axis.w);
        found *= here.shares[part] * min(free, 1.0);
        found.zw *= shadowed_more(here, part, axis.xyz);
#else
        if (up.z < 1.0) found *= min(above(dot(axis.xyz, up), axis.w) / above(axis.z, axis.w), 1.0);
#endif
    } else {
        int bend = number - LOBES + EACH;
#if PARTS > 1
        for (int k = 0; k < PARTS; ++k) found += here.shares[k] * between_alphas(here.at[k], bend);
#else
        found = between_alphas(here.at[0], bend);
#endif
        if (up.z < 1.0) found *= 0.5 * (1.0 + up.z);
    }
#if PARTS > 1
    found.zw *= here.whole;
#endif
    vec4 total = found.x * here.body[row] + found.y * here.rest[row] + found.z * here.facet[row];
    if (row == RANK / 4) total[RANK % 4] += found.w * here.edge + over;
    return total;
}
