// Angles of a direction pair in the io and hd frames; twin of materials/core/directions.py.
// GLSL's atan may be off by 4096 units in the last place, and Mesa's is by thousands, which would be visible in sharp
// lobes.

const float TAU = 6.28318530717958648;

// atan2 to about one unit in the last place: reduced to [0, tan(pi/8)], then the polynomial of Cephes' atanf (Moshier).
// 0 at the origin, where the azimuth is undefined.
float arc(float y, float x) {
    float larger = max(abs(x), abs(y));
    float smaller = min(abs(x), abs(y));
    if (larger == 0.0) return 0.0;
    bool upper = smaller > 0.41421356 * larger;
    float t = upper ? (smaller - larger) / (smaller + larger) : smaller / larger;
    float z = t * t;
    float r = (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * t + t;
    if (upper) r += 0.125 * TAU;
    if (abs(y) > abs(x)) r = 0.25 * TAU - r;
    if (x < 0.0) r = 0.5 * TAU - r;
    return y < 0.0 ? -r : r;
}

// Map an angle of arc() to [0, 2 pi).
float turn(float phi) {
    return phi < 0.0 ? phi + TAU : phi;
}

float polar(vec3 w) {
    return arc(length(w.xy), w.z);
}

// theta_i, theta_o and phi_o - phi_i in [0, 2 pi).
vec3 io_angles(vec3 wi, vec3 wo) {
    float phi = arc(wi.x * wo.y - wi.y * wo.x, dot(wi.xy, wo.xy));
    return vec3(polar(wi), polar(wo), turn(phi));
}

// theta_h, theta_d and phi_d in [0, 2 pi) (Rusinkiewicz 1998, section 3).
vec3 hd_angles(vec3 wi, vec3 wo) {
    vec3 h = wi + wo;
    vec3 d = wi - wo;
    float sine = length(h.xy);
    vec2 azimuth = sine > 0.0 ? h.xy / sine : vec2(1.0, 0.0);
    vec3 binormal = vec3(-azimuth.y, azimuth.x, 0.0);
    vec3 tangent = vec3(azimuth * h.z, -sine) / length(h);
    float phi_d = arc(dot(d, binormal), dot(d, tangent));
    return vec3(arc(sine, h.z), arc(length(d), length(h)), turn(phi_d));
}

// phi_i and phi_h in [0, 2 pi), for anisotropic materials.
vec2 azimuths(vec3 wi, vec3 wo) {
    vec3 h = wi + wo;
    return vec2(turn(arc(wi.y, wi.x)), turn(arc(h.y, h.x)));
}
