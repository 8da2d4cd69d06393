// Facets that are wider along one axis, as parts that lean along it, twin of stretched.py: their shadows.

#if PARTS > 1
uniform sampler2D leaning;      // a row a rho: two middles and shares; three widths, and the logarithm of rho
uniform float least_height;
uniform vec2 rings[RINGS];      // rings of half vectors on a disc: radius and share

// See stretched.shadowed.
float shadowed(vec3 w, vec3 spread) {
    float z = max(w.z, least_height);
    return 2.0 * z / (z + sqrt(z * z + spread.x * w.x * w.x + 2.0 * spread.y * w.x * w.y + spread.z * w.y * w.y));
}

// See stretched.sent_on; wo in the axes of the two alphas.
vec2 sent_on(vec2 alphas, vec3 wo) {
    vec3 up = normalize(vec3(alphas * wo.xy, wo.z));
    float across = length(up.xy), half_up = 0.5 * (1.0 + up.z);
    vec3 first = across > 1e-6 ? vec3(-up.y, up.x, 0.0) / across : vec3(1.0, 0.0, 0.0), second = cross(up, first);
    vec2 total = vec2(0.0);
    for (int n = 0; n < RINGS * ROUND; ++n) {
        vec2 ring = rings[n / ROUND];
        float turn = (float(n % ROUND) + 0.5) * 6.28318530717959 / float(ROUND);
        float along = ring.x * cos(turn), over = ring.x * sin(turn);
        over = (1.0 - half_up) * sqrt(1.0 - along * along) + half_up * over;
        vec3 h = along * first + over * second + sqrt(max(1.0 - along * along - over * over, 0.0)) * up;
        h = normalize(vec3(alphas * h.xy, max(h.z, 1e-6)));
        float cosine = clamp(dot(h, wo), 0.0, 1.0);
        vec3 wi = 2.0 * cosine * h - wo;
        vec2 level = alphas * wi.xy;
        float z = max(wi.z, 0.0), seen = 2.0 * z / max(z + sqrt(z * z + dot(level, level)), 1e-12);
        float lost = 1.0 - cosine, fall = lost * lost * lost * lost * lost;
        total += ring.y / float(ROUND) * seen * vec2(1.0 - fall, fall);
    }
    return total;
}
#endif
