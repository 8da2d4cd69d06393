// Indirect light, linear between sites; twin of lighting.transfer.indirect. Needs located.glsl and turned.glsl.

uniform sampler2D indirect;         // of every site: nine moments, three of the flux, nine of the radiance

const int INDIRECT_TEXELS = 21;

vec4 moments_here[9], flux_here[3], radiance_here[9];
vec3 smooth_normal;                 // without normal mapping

#ifdef MAP_LEVELS
// Incident radiance maps at sites of glossy parts; twin of lighting.transfer.radiance_maps.
uniform sampler2D radiance_maps;    // all levels of a site, one after the other
uniform sampler2D map_of_site;      // of each site: normal and index of its map, -1 for none
uniform vec3 map_levels[MAP_LEVELS];    // sharpness, first texel and side
uniform vec4 map_scale;

mat3 map_axes[3];
float map_share[3];
int map_number[3];

void stand_between_maps(int near[3], float weights[3]) {
    for (int c = 0; c < 3; ++c) {
        map_share[c] = near[c] < 0 ? 0.0 : weights[c];
        int site = max(near[c], 0);
        vec4 found = texelFetch(map_of_site, ivec2(site % ROW_LENGTH, site / ROW_LENGTH), 0);
        map_number[c] = int(found.w);
        vec3 n = found.xyz;
        float side = n.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (side + n.z), b = n.x * n.y * a;
        map_axes[c] = mat3(1.0 + side * n.x * n.x * a, side * b, -side * n.x, b, side + n.y * n.y * a, -n.y, n);
    }
}

vec4 map_texel(int number, int texel) {
    return texelFetch(radiance_maps, ivec2(number % MAPS_A_ROW * MAP_TEXELS + texel, number / MAPS_A_ROW), 0);
}

vec4 map_at(int number, int level, vec2 place) {
    int side = int(map_levels[level].z);
    vec2 at = clamp(0.5 * (place + 1.0) * float(side) - 0.5, vec2(0.0), vec2(float(side - 1)));
    ivec2 corner = min(ivec2(floor(at)), ivec2(side - 2));
    vec2 part = at - vec2(corner);
    int first = int(map_levels[level].y) + corner.y * side + corner.x;
    vec4 above = mix(map_texel(number, first), map_texel(number, first + 1), part.x);
    vec4 below = mix(map_texel(number, first + side), map_texel(number, first + side + 1), part.x);
    return map_scale * mix(above, below, part.y);
}

// Mean radiance under a Gaussian; `blunt` is that of the polynomials.
vec4 in_maps(vec3 to, float lambda, vec4 blunt) {
    if (lambda <= BLUNT) return blunt;
    float wanted = 1.0 / (min(lambda, map_levels[MAP_LEVELS - 1].x) + SOFTENING);
    int finer = 0;
    while (finer + 1 < MAP_LEVELS && map_levels[finer].x <= lambda) ++finer;
    float below = 1.0 / ((finer == 0 ? BLUNT : map_levels[finer - 1].x) + SOFTENING);
    float share = (below - wanted) / (below - 1.0 / (map_levels[finer].x + SOFTENING));
    vec4 found = vec4(0.0);
    for (int c = 0; c < 3; ++c) {
        vec4 seen = blunt;
        if (map_number[c] >= 0) {
            vec3 local = to * map_axes[c];
            float size = abs(local.x) + abs(local.y) + max(local.z, 0.0);
            vec2 place = vec2(local.x + local.y, local.x - local.y) / (size > 0.0 ? size : 1.0);
            if (finer > 0) seen = map_at(map_number[c], finer - 1, place);
            seen = mix(seen, map_at(map_number[c], finer, place), share);
        }
        found += map_share[c] * seen;
    }
    return found;
}
#endif

void stand_at(int number, ivec2 at, vec3 normal) {
    vec4 face;
    int near[3];
    float weights[3];
    sites_near(number, at, face, near, weights);
#ifdef MAP_LEVELS
    stand_between_maps(near, weights);
#endif
    smooth_normal = normal;
    for (int k = 0; k < 9; ++k) moments_here[k] = radiance_here[k] = vec4(0.0);
    for (int k = 0; k < 3; ++k) flux_here[k] = vec4(0.0);
    for (int c = 0; c < 3; ++c) {
        if (near[c] < 0) continue;
        ivec2 first = ivec2(near[c] % INDIRECT_A_ROW * INDIRECT_TEXELS, near[c] / INDIRECT_A_ROW);
        for (int k = 0; k < 9; ++k) {
            moments_here[k] += weights[c] * texelFetch(indirect, first + ivec2(k, 0), 0);
            radiance_here[k] += weights[c] * texelFetch(indirect, first + ivec2(12 + k, 0), 0);
        }
        for (int k = 0; k < 3; ++k) flux_here[k] += weights[c] * texelFetch(indirect, first + ivec2(9 + k, 0), 0);
    }
}

// Illuminance and its moments on a surface, in the axes that are the columns of `frame`, normal last; light_at.
void on_surface(mat3 frame, out vec4 found[BENT]) {
    vec3 n = frame[2], change = n - smooth_normal;
    vec4 more = change.x * flux_here[0] + change.y * flux_here[1] + change.z * flux_here[2]
        + 0.5 * (1.0 - dot(n, smooth_normal)) * moments_here[0];
    vec4 m[BENT];
    m[0] = moments_here[0] + more;
#if BENT > 1
    for (int i = 0; i < 3; ++i) m[1 + i] = moments_here[1 + i] + EVEN_Z * n[i] * more;
    vec4 even = 0.5 * EVEN_ZZ * more;
    m[4] = moments_here[4] + n.x * n.y * even;
    m[5] = moments_here[5] + n.y * n.z * even;
    m[6] = moments_here[6] + n.x * n.z * even;
    m[7] = moments_here[7] + (n.x * n.x - n.y * n.y) * even;
    m[8] = moments_here[8] + (3.0 * n.z * n.z - 1.0) * even;
#endif
    turned(frame, m, found);
}

// Mean radiance under a Gaussian about a direction; `width` is 1 / lambda. under_lobes.
vec4 under_gaussian(vec3 to, float width) {
    float lambda = 1.0 / width, square = lambda * lambda;
    float first = lambda / 3.0 * (1.0 - square / 15.0), second = square / 15.0 * (1.0 - 2.0 * square / 21.0);
    if (lambda >= 0.2) {
        float fall = exp(-2.0 * lambda);
        first = (1.0 + fall) / (1.0 - fall) - width;
        second = 1.0 - 3.0 * first * width;
    }
    vec4 found = radiance_here[0] + first * (to.x * radiance_here[1] + to.y * radiance_here[2] + to.z * radiance_here[3])
        + second * (to.x * to.y * radiance_here[4] + to.y * to.z * radiance_here[5] + to.x * to.z * radiance_here[6]
        + (to.x * to.x - to.y * to.y) * radiance_here[7] + (3.0 * to.z * to.z - 1.0) * radiance_here[8]);
#ifdef MAP_LEVELS
    found = in_maps(to, lambda, found);
#endif
    return found;
}
