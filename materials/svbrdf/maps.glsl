// Terms of a surface of maps, twin of map_planes.py: of numbers in `planes`, at `levels`, and in `constants`.

#include "map_numbers.glsl"

// Equal texels need no filter.
#if defined(MIPMAPPED) && defined(USES_UV)
#define FILTERED
#endif

#ifdef FILTERED
uniform float widened;
#endif
#ifdef COAT
uniform float coat_f0;
#endif
#if defined(CUT) && defined(FILTERED)
uniform float own_share;        // see map_planes.OWN_SHARE
float all_there;                // total weight of all places of a sample
bool own_place;                 // true of the point itself, which is no hole whatever its numbers come to
#endif

struct Here {
    vec4 terms[ROWS];
};

// Cosine and sine of an angle from 0 to 4 pi, to about one unit in the last place: GLSL's own may be off by thousands.
// Reduced to [-pi/4, pi/4], then the polynomials of Cephes' sinf and cosf (Moshier).
vec2 cos_sin(float angle) {
    int eighth = int(angle * 1.27323954473516);
    eighth += eighth & 1;
    float y = float(eighth);
    precise float x = ((angle - y * 0.78515625) - y * 2.4187564849853515625e-4) - y * 3.77489497744594108e-8;
    float z = x * x;
    float s = ((-1.9515295891e-4 * z + 8.3321608736e-3) * z - 1.6666654611e-1) * z * x + x;
    float c = ((2.443315711809948e-5 * z - 1.388731625493765e-3) * z + 4.166664568298827e-2) * z * z - 0.5 * z + 1.0;
    int quarter = (eighth >> 1) & 3;
    if (quarter == 1) return vec2(-s, c);
    if (quarter == 2) return vec2(-c, -s);
    return quarter == 3 ? vec2(s, -c) : vec2(c, s);
}

vec3 direction(float theta, float phi) {
    vec2 polar = cos_sin(theta);
    return vec3(polar.y * cos_sin(phi), polar.x);
}

float side(vec3 w, vec3 spread) {
    return w.z + sqrt(w.z * w.z + spread.x * w.x * w.x + 2.0 * spread.y * w.x * w.y + spread.z * w.y * w.y);
}

// D G / (4 cos_i cos_o); see facets.facets.
float facets(vec3 wi, vec3 wo, vec3 spread) {
    vec3 h = wi + wo;
    float determinant = spread.x * spread.z - spread.y * spread.y;
    float level = (spread.z * h.x * h.x - 2.0 * spread.y * h.x * h.y + spread.x * h.y * h.y) / determinant;
    float length2 = dot(h, h), thick = h.z * h.z + level;
    float density = length2 * length2 / (3.14159265358979 * sqrt(determinant) * thick * thick);
    return density / (side(wi, spread) * side(wo, spread));
}

#ifdef FILTERED
// Facets about differing normals, times cos_i, in the frame of their mean; see map_levels.facets_apart.
float facets_apart(vec3 wi, vec3 wo, vec3 spread, vec3 differ) {
    float half_apart = length(vec2(0.5 * (differ.x - differ.z), differ.y)), wide = 0.5 * (differ.x + differ.z) + half_apart;
    float narrow = wide > 0.0 ? clamp((differ.x * differ.z - differ.y * differ.y) / wide, 0.0, wide) : 0.0;
    float turn = half_apart > 0.0 ? 0.5 * atan(2.0 * differ.y, differ.x - differ.z) : 0.0;
    vec2 axis = vec2(cos(turn), sin(turn));
    spread += narrow * vec3(axis.y * axis.y, -axis.x * axis.y, axis.x * axis.x);
    float total = 0.0;
    for (int side = -1; side < 2; side += 2) {
        vec3 normal = normalize(vec3(float(side) * sqrt(wide / widened) * axis, 1.0));
        vec3 to_light = turned_to(normal, wi), to_viewer = turned_to(normal, wo);
        if (to_light.z > 0.0 && to_viewer.z > 0.0) total += 0.5 * facets(to_light, to_viewer, spread) * to_light.z;
    }
    return total;
}
#endif

#ifdef COAT
// Facets of the coat, times cos_i.
float coat_shine(float numbers[PLANES], bool coarse, vec3 wi, vec3 wo) {
    vec3 normal = vec3(NUMBER(COAT_NORMAL, 0, AT_COAT_NORMAL), NUMBER(COAT_NORMAL, 1, AT_COAT_NORMAL), 0.0);
    normal.z = sqrt(max(1.0 - dot(normal.xy, normal.xy), 0.0));
#ifdef FILTERED
    if (coarse) {
        normal.z = NUMBER(COAT_UP, 0, AT_COAT_UP);
        normal = normalize(normal);
    }
#endif
    vec3 to_light = turned_to(normal, wi), to_viewer = turned_to(normal, wo);
    if (!(to_light.z > 0.0) || !(to_viewer.z > 0.0)) return 0.0;
    float alpha2 = NUMBER(COAT_SPREAD, 0, AT_COAT_SPREAD);
    vec3 spread = vec3(alpha2, 0.0, alpha2);
#ifdef FILTERED
    if (coarse)
        return facets_apart(to_light, to_viewer, spread, vec3(NUMBER(COAT_DIFFER, 0, AT_COAT_DIFFER),
            NUMBER(COAT_DIFFER, 1, AT_COAT_DIFFER), NUMBER(COAT_DIFFER, 2, AT_COAT_DIFFER)));
#endif
    return facets(to_light, to_viewer, spread) * to_light.z;
}
#endif

// With what a level shows at a point, `share` of it; `coarse`: of means of texels.
Here added(Here here, Four at, bool coarse, vec3 wi, vec3 wo, float share) {
    float numbers[PLANES];
    for (int row = 0; row < PLANES / 4; ++row) {
        vec4 four = between(at, row);
        numbers[4 * row] = four.x;
        numbers[4 * row + 1] = four.y;
        numbers[4 * row + 2] = four.z;
        numbers[4 * row + 3] = four.w;
    }
    vec3 normal = vec3(NUMBER(NORMAL, 0, AT_NORMAL), NUMBER(NORMAL, 1, AT_NORMAL), 0.0);
    vec3 spread = vec3(NUMBER(SPREAD_XX, 0, AT_SPREAD), NUMBER(SPREAD_XY, 0, AT_SPREAD + 1),
        NUMBER(SPREAD_YY, 0, AT_SPREAD + 2));
    float covers = NUMBER(COVERS, 0, AT_COVERS), lit = 0.0;
    normal.z = sqrt(max(1.0 - dot(normal.xy, normal.xy), 0.0));
#ifdef FILTERED
    if (coarse) {
        normal.z = NUMBER(UP, 0, AT_UP);
        lit = max(dot(normal, wi), 0.0);
        normal = normalize(normal);
    } else
#endif
    covers = covers >= cutoff ? 1.0 : 0.0;
#ifdef CUT
#ifdef FILTERED
    if (own_place) covers = 1.0;
    all_there += covers * share;
#else
    covers = 1.0;
#endif
#endif
    vec3 d = wi - wo;
    // 1 - cos = sin^2 / (1 + cos), and |wi - wo| = 2 sin: no cancellation near retro-reflection.
    float lost = 0.25 * dot(d, d) / (1.0 + 0.5 * length(wi + wo));
    float fall = lost * lost * lost * lost * lost, under = covers * share;
#ifdef COAT
    // See coat.coat_over.
    float reflected_by_coat = NUMBER(COAT, 0, AT_COAT) * (coat_f0 + (1.0 - coat_f0) * fall);
    here.terms[RANK / 4][RANK % 4] += under * reflected_by_coat * coat_shine(numbers, coarse, wi, wo);
    under *= 1.0 - reflected_by_coat;
#endif
    vec3 to_light = turned_to(normal, wi), to_viewer = turned_to(normal, wo);
    if (!(to_light.z > 0.0) || !(to_viewer.z > 0.0)) return here;
    if (!coarse) lit = to_light.z;
    float shine = 0.0;
#ifdef FILTERED
    if (coarse) {
        vec3 differ = vec3(NUMBER(DIFFER, 0, AT_DIFFER), NUMBER(DIFFER, 1, AT_DIFFER), NUMBER(DIFFER, 2, AT_DIFFER));
        shine = facets_apart(to_light, to_viewer, spread, differ);
    } else
#endif
    shine = facets(to_light, to_viewer, spread) * to_light.z;
    shine *= under;
    lit *= under / 3.14159265358979;
    float through = (1.0 - fall) * lit, rest = fall * lit, reflected = (1.0 - fall) * shine;
    for (int r = 0; r < RANK; ++r)
        here.terms[r / 4][r % 4] += NUMBER(BODY, r, AT_BODY) * through + NUMBER(REST, r, AT_REST) * rest
            + NUMBER(FACET, r, AT_FACET) * reflected;
    here.terms[RANK / 4][RANK % 4] += NUMBER(EDGE, 0, AT_EDGE) * fall * shine;
    return here;
}

Here here_at(Sample s) {
    Here here;
    for (int row = 0; row < ROWS; ++row) here.terms[row] = vec4(0.0);
    vec3 wi = direction(s.angles.x, s.azimuths.x), wo = direction(s.angles.y, s.azimuths.x + s.angles.z);
#ifdef USES_UV
    vec2 uv = s.uv * placement.xy + placement.zw;
#ifdef FILTERED
#ifdef CUT
    all_there = 0.0;
    own_place = false;
#endif
    mat2 spanned = mat2(s.footprint[0] * placement.xy, s.footprint[1] * placement.xy);
    float level = level_at(mat2(spanned[0] / float(TAPS), spanned[1] / float(TAPS)));
    int fine = int(level);
    float part = level - float(fine), share = s.angles.w / float(TAPS * TAPS);
    for (int n = 0; n < TAPS * TAPS; ++n) {
        vec2 tap = (vec2(n % TAPS, n / TAPS) + 0.5) / float(TAPS) - 0.5;
        vec2 place = uv + tap.x * spanned[0] + tap.y * spanned[1];
        here = added(here, four_about(place, LEVEL(fine)), fine > 0, wi, wo, (1.0 - part) * share);
        if (part > 0.0) here = added(here, four_about(place, LEVEL(fine + 1)), true, wi, wo, part * share);
    }
#ifdef CUT
    // The point itself, which is no hole, counts a little; it counts alone if all places are holes.
    own_place = true;
    here = added(here, four_about(uv, LEVEL(0)), false, wi, wo, own_share * share);
    for (int row = 0; row < ROWS; ++row) here.terms[row] *= all_there > 0.0 ? s.angles.w / all_there : 0.0;
#endif
#else
    here = added(here, four_about(uv, LEVEL(0)), false, wi, wo, s.angles.w);
#endif
#else
    here = added(here, four_about(vec2(0.5), LEVEL(0)), false, wi, wo, s.angles.w);
#endif
    return here;
}

int entry(Here here, int mixed) {
    return 0;
}

vec4 term(Here here, int mixed, int row) {
    return row < ROWS ? here.terms[row] : vec4(0.0);
}
