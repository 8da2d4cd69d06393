// Softbox seen from each sample; twin of lighting.environment.panel and polygon, with the same names.

uniform sampler2D position;         // of every sample
uniform vec3 panel_corners[4];
uniform vec3 panel_cells[PANEL_CELLS];
uniform vec3 panel_facing;
uniform float panel_luminance;
uniform float panel_cell_area;
uniform vec2 panel_nodes[PANEL_NODES];      // quadrature on edges: node from -1 to 1, and weight

vec3 panel_from;                    // position of the sample
vec3 towards[4];                    // corners relative to it
bool in_front;
float omega;                        // solid angle

// Solid angle of a triangle seen from the origin.
float solid_angle(vec3 a, vec3 b, vec3 c) {
    float x = length(a), y = length(b), z = length(c);
    return 2.0 * atan(dot(a, cross(b - a, c - a)), x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y);
}

void stand_at(int number, ivec2 at, vec3 normal) {
    panel_from = texelFetch(position, at, 0).xyz;
    for (int k = 0; k < 4; ++k) towards[k] = panel_corners[k] - panel_from;
    in_front = dot(towards[0], panel_facing) < 0.0;
    omega = solid_angle(towards[0], towards[1], towards[2]) + solid_angle(towards[0], towards[2], towards[3]);
}

// h(c) / (1 - c^2) at y = 1 - c.
float smooth_edge(float y, float lambda, float whole) {
    float x = lambda * y;
    float fall = x > 0.03 ? (1.0 - exp(-x)) / y : lambda * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0)));
    float other = 2.0 - y;
    return other > 1e-3 ? (fall - 0.5 * whole) / other : 0.25 * (whole - 2.0 * lambda * exp(-2.0 * lambda));
}

// Mean luminance under a Gaussian about a direction; `width` is 1 / lambda.
vec4 under_gaussian(vec3 to, float width) {
    if (!in_front) return vec4(0.0);
    float lambda = 1.0 / width, whole = 1.0 - exp(-2.0 * lambda), total = 0.0, nearest = 2.0;
    bool inside = true;
    for (int k = 0; k < 4; ++k) {
        vec3 here = towards[k], there = towards[(k + 1) % 4], crossing = cross(here, there - here);
        float size = length(crossing);
        vec3 pole = crossing / (size > 0.0 ? size : 1.0);
        float spanned = atan(size, dot(here, there));
        float sine = clamp(dot(to, pole), -1.0, 1.0), cosine = sqrt(1.0 - sine * sine);
        inside = inside && sine >= 0.0;
        float first = -atan(dot(to, cross(pole, here)), dot(to, here)), last = first + spanned;
        float low = sine * sine / (1.0 + cosine);
        float off = first <= 0.0 && last >= 0.0 ? 0.0 : sin(0.5 * min(abs(first), abs(last)));
        nearest = min(nearest, low + 2.0 * cosine * off * off);
        float broad = sqrt(sine * sine + width);
        float from = atan(first / broad), end = atan(last / broad), edge = 0.0;
        for (int n = 0; n < PANEL_NODES; ++n) {
            float slope = tan(0.5 * (end + from) + 0.5 * (end - from) * panel_nodes[n].x);
            float turned = sin(0.5 * broad * slope);
            edge += panel_nodes[n].y * (1.0 + slope * slope)
                * smooth_edge(low + 2.0 * cosine * turned * turned, lambda, whole);
        }
        total += 0.5 * (end - from) * broad * sine * edge;
    }
    float most = omega * (inside ? 1.0 : exp(-lambda * nearest)) * lambda / (2.0 * PI * whole);
    float share = omega / (4.0 * PI) + total / (2.0 * PI * whole);
    return vec4(panel_luminance * clamp(share, 0.0, min(most, 1.0)), 0.0, 0.0, 0.0);
}

vec3 t1;                            // sums over edges, see polygon.surface_moments
#if BENT > 1
float t0;
vec3 lines;
mat3 squares;
#endif

void add_edge(vec3 start, vec3 end, vec3 first) {
    vec3 crossing = cross(start, end - start);
    float size = length(crossing), angle = atan(size, dot(start, end));
    if (size == 0.0) return;
    vec3 pole = crossing / size, along = normalize(start), ahead = cross(pole, along);
    t1 += 0.5 * angle * pole;
#if BENT > 1
    float s = sin(angle), c = cos(angle);
    t0 += solid_angle(first, start, end);
    lines += pole.z * (s * along + (1.0 - c) * ahead);
    mat3 mixed = outerProduct(along, ahead);
    squares += pole.z * (0.5 * (angle + s * c) * outerProduct(along, along)
        + 0.5 * (angle - s * c) * outerProduct(ahead, ahead) + 0.5 * s * s * (mixed + transpose(mixed)));
#endif
}

// Illuminance and its moments on a surface, in the axes that are the columns of `frame`, normal last.
void on_surface(mat3 frame, out vec4 found[BENT]) {
    for (int b = 0; b < BENT; ++b) found[b] = vec4(0.0);
    if (!in_front) return;
    bool mirrored = determinant(frame) < 0.0;
    vec3 local[4];
    for (int k = 0; k < 4; ++k) local[k] = towards[mirrored ? 3 - k : k] * frame;
    vec3 first = local[0], leaves = vec3(0.0), enters = vec3(0.0);
    for (int k = 1; k < 4; ++k) first = local[k].z > first.z ? local[k] : first;
    t1 = vec3(0.0);
#if BENT > 1
    t0 = 0.0;
    lines = vec3(0.0);
    squares = mat3(0.0);
#endif
    bool crossed = false;
    for (int k = 0; k < 4; ++k) {
        vec3 here = local[k], there = local[(k + 1) % 4];
        bool up = here.z > 0.0, next_up = there.z > 0.0;
        if (!up && !next_up) continue;
        if (up != next_up) {
            vec3 cut = here + here.z / (here.z - there.z) * (there - here);
            cut.z = 0.0;
            crossed = true;
            if (up) leaves = there = cut;
            else enters = here = cut;
        }
        add_edge(here, there, first);
    }
    if (crossed) add_edge(leaves, enters, first);
    float lux = max(t1.z, 0.0);
    found[0].x = panel_luminance * lux;
#if BENT > 1
    vec3 second = (vec3(0.0, 0.0, t0) + lines) / 3.0;
    vec3 third = vec3(squares[0][1], (t1.y + squares[1][2]), (t1.x + squares[0][2])) / 4.0;
    float xx = squares[0][0] / 4.0, yy = squares[1][1] / 4.0, zz = (2.0 * t1.z + squares[2][2]) / 4.0;
    float moments[8] = float[8](second.x, second.y, second.z, third.x, third.y, third.z, xx - yy, 3.0 * zz - t1.z);
    for (int b = 1; b < BENT; ++b) found[b].x = panel_luminance * moments[b - 1];
#endif
}
