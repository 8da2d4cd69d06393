// Looks slices of surfaces of maps up, twin of facet_slices.py: at places between viewers and between alphas, under a coat.

// Gaussians of what is below a coat, last in `LOBES`; of a part of the facets, and at one of the alphas on both sides.
#ifdef COAT
#define OWN_LOBES (LOBES - COAT_LOBES)
#define COAT_EACH (coat_alphas > 1 ? COAT_LOBES / 2 : COAT_LOBES)
#else
#define OWN_LOBES LOBES
#endif
#define OF_PART (OWN_LOBES / PARTS)
#if ALPHAS == 1
#define EACH OF_PART
#else
#define EACH (OF_PART / 2)
#endif

uniform sampler2D axes;         // axis of each Gaussian, and the logarithm of 1 / lambda; a row a viewer and alpha
uniform sampler2D slices;       // values of each Gaussian, last the cosine: body, body and facets at grazing in y and w
uniform float last;             // theta_o of the last viewer
uniform float first_alpha;
uniform float steps;            // alphas per unit of their logarithm
uniform int alphas;             // ALPHAS is 1 for one of them, and 2 for more: one shader for all

uniform float logistic;

#ifdef COAT
uniform float coat_f0;
uniform float coat_first_alpha;
uniform int coat_alphas;
uniform int coat_row;           // row of its first slice
float coat_share;               // w, of the texels here
#endif

struct Place {
    int row;                    // row of the smoother alpha, and the viewer below
    vec2 between;               // fractions of the way from there to the next alpha, and to the next viewer
};

// Approximate share of a Gaussian above a horizon, from the height of its axis.
float above(float height, float width) {
    return 1.0 / (1.0 + exp(min(-logistic * height / sqrt(width), 80.0)));
}

// Place in a table of `alphas` alphas.
Place place_among(float theta, float alpha, float first_alpha, int alphas) {
    float rough = clamp(log(alpha / first_alpha) * steps, 0.0, float(alphas - 1));
    int smoother = min(int(rough), max(alphas - 2, 0));
    float place = (1.0 - pow(1.0 - clamp(theta / last, 0.0, 1.0), 2.0 / 3.0)) * float(POLAR - 1);
    int polar = min(int(place), POLAR - 2);
    return Place(smoother * POLAR + polar, vec2(rough - float(smoother), place - float(polar)));
}

Place place_of(float theta, float alpha) {
    return place_among(theta, alpha, first_alpha, alphas);
}

// Columns: axes about a normal whose x is towards the viewer; and the viewer's height above its plane.
mat3 frame_about(vec3 normal, vec3 wo, out float height) {
    height = dot(normal, wo);
    vec3 level_to = wo - height * normal, other = vec3(normal.z, 0.0, -normal.x);
    float across = length(level_to), flatter = length(other);
    vec3 x = across > 0.0 ? level_to / across : flatter > 0.0 ? other / flatter : vec3(1.0, 0.0, 0.0);
    return mat3(x, cross(normal, x), normal);
}

vec4 between_viewers(sampler2D table, Place at, int column, int side) {
    int row = at.row + side * POLAR;
    return mix(texelFetch(table, ivec2(column, row), 0), texelFetch(table, ivec2(column, row + 1), 0), at.between.y);
}

// Column of `slices` as a coat lets it through; see facet_slices.under_coat.
vec4 under_coat(Place at, int column, int side) {
    vec4 found = between_viewers(slices, at, column, side);
#ifdef COAT
    vec2 twice = between_viewers(slices, at, column + COLUMNS, side).xy;
    vec4 falls = vec4(found.y - twice.x, twice.x, found.w - twice.y, twice.y);
    found = (1.0 - coat_f0 * coat_share) * found - (1.0 - coat_f0) * coat_share * falls;
#endif
    return found;
}

// Column between both alphas.
vec4 between_alphas(Place at, int column) {
    vec4 found = under_coat(at, column, 0);
#if ALPHAS > 1
    found = mix(found, under_coat(at, column, 1), at.between.x);
#endif
    return found;
}

// A Gaussian of one part in that part's own frame: those of the smoother alpha, then those of the rougher one.
vec4 own_lobe(Place at, int number) {
    vec4 found = between_viewers(axes, at, number % EACH, number / EACH);
    return vec4(normalize(found.xyz), exp(found.w));
}

vec4 own_value(Place at, int number) {
    int side = number / EACH;
    return under_coat(at, number % EACH, side) * (side == 0 ? 1.0 - at.between.x : at.between.x);
}
