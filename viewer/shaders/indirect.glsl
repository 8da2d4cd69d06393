// Light by way of other surfaces, linear between sites; twin of lighting.transfer.indirect. Needs located.glsl and
// turned.glsl.

uniform sampler2D indirect;         // of every site: nine moments, three of the flux, nine of the radiance

const int INDIRECT_TEXELS = 21;

vec4 moments_here[9], flux_here[3], radiance_here[9];
vec3 smooth_normal;                 // before a texture's own

void stand_at(int number, ivec2 at, vec3 normal) {
    vec4 face;
    int near[3];
    float weights[3];
    sites_near(number, at, face, near, weights);
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
    return radiance_here[0] + first * (to.x * radiance_here[1] + to.y * radiance_here[2] + to.z * radiance_here[3])
        + second * (to.x * to.y * radiance_here[4] + to.y * to.z * radiance_here[5] + to.x * to.z * radiance_here[6]
        + (to.x * to.x - to.y * to.y) * radiance_here[7] + (3.0 * to.z * to.z - 1.0) * radiance_here[8]);
}
