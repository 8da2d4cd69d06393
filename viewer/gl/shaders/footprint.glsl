// Footprint of a sample in each angle, for averaging mip-mapped factors; twin of footprints.py.

// Largest ratio of depth at a side of a sample to that at its centre for the side to be used.
const float DEEPEST = 10.0;
// |l + v|^2 below which the half vector has no direction.
const float LEAST_HALF = 1e-12;

struct Directions {
    vec4 theta;         // theta_i, theta_o, theta_h, theta_d
    vec4 azimuth;       // phi, phi_i, phi_d, phi_h
    vec3 apart[4];      // light, viewer and half vector minus the normal, and light minus half vector, all unit
    float whole;        // see surface.glsl
    bool met;           // whether the half vector has a direction
};

Directions directions_of(Surface at, vec3 to_light, vec3 wi, vec3 wo) {
    Directions here;
    vec3 middle = to_light + at.to_viewer;
    float squared = dot(middle, middle);
    here.whole = at.whole;
    here.met = squared > LEAST_HALF;
    if (!here.met) return here;
    vec3 half_way = middle / sqrt(squared);
    vec3 in_io = io_angles(wi, wo), in_hd = hd_angles(wi, wo);
    vec2 turns = azimuths(wi, wo);
    here.theta = vec4(in_io.xy, in_hd.xy);
    here.azimuth = vec4(in_io.z, turns.x, in_hd.z, turns.y);
    here.apart[0] = to_light - at.normal;
    here.apart[1] = at.to_viewer - at.normal;
    here.apart[2] = half_way - at.normal;
    here.apart[3] = to_light - half_way;
    return here;
}

Directions directions_at(int number, vec2 point) {
    Surface at = surface_at(number, point);
    vec3 to_light = normalize(offset_at(at));
    return directions_of(at, to_light, to_local(at, to_light), to_local(at, at.to_viewer));
}

void footprint(int number, Surface at, vec3 to_light, vec3 wi, vec3 wo, out vec4 io_span, out vec4 hd_span) {
    Directions here = directions_of(at, to_light, wi, wo);
    vec4 along = vec4(0.0), apart = vec4(0.0), around = vec4(0.0);
    for (int axis = 0; axis < 2; ++axis) {
        vec2 step_to = 0.5 * SUBSTEPS * vec2(1 - axis, axis);
        Directions first = directions_at(number, gl_FragCoord.xy * SUBSTEPS + step_to);
        Directions second = directions_at(number, gl_FragCoord.xy * SUBSTEPS - step_to);
        bool one = first.met && DEEPEST * first.whole * here.whole > here.whole * here.whole;
        bool other = second.met && DEEPEST * second.whole * here.whole > here.whole * here.whole;
        // A single side counts twice; without any, the differences are zero.
        float scale = one && other ? 1.0 : 2.0;
        if (!one) first = here;
        if (!other) second = here;
        vec4 changed = scale * (first.theta - second.theta);
        along += changed * changed;
        for (int k = 0; k < 4; ++k) {
            vec3 moved = scale * (first.apart[k] - second.apart[k]);
            apart[k] += 0.5 * dot(moved, moved);
        }
        vec4 turned = first.azimuth - second.azimuth;
        turned = scale * (turned - TAU * floor(turned / TAU + 0.5));
        around += turned * turned;
    }
    // Change of theta far from the pole, of the direction at the pole.
    vec4 squared = here.theta * here.theta;
    vec4 total = squared + apart;
    vec4 share = vec4(1.0);
    for (int k = 0; k < 4; ++k) if (total[k] > 0.0) share[k] = squared[k] / total[k];
    vec4 polar = sqrt(share * along + (1.0 - share) * apart);
    vec4 azimuthal = min(sqrt(around), TAU);
    io_span = vec4(polar.xy, azimuthal.xy);
    hd_span = vec4(polar.zw, azimuthal.zw);
}
