// Illuminance and its moments in other axes, the columns of `frame`, normal last; see
// materials.core.environment_form.bends and lighting.environment.prefiltering.rotate_moments.
void turned(mat3 frame, vec4 m[BENT], out vec4 found[BENT]) {
    found[0] = m[0];
#if BENT > 1
    for (int i = 0; i < 3; ++i) found[1 + i] = frame[i].x * m[1] + frame[i].y * m[2] + frame[i].z * m[3];
    vec4 zz = (m[8] + m[0]) / 3.0, xx = 0.5 * (m[0] - zz + m[7]), yy = 0.5 * (m[0] - zz - m[7]);
    vec4 along[9];              // the symmetric matrix times each axis
    for (int i = 0; i < 3; ++i) {
        vec3 a = frame[i];
        along[3 * i] = a.x * xx + a.y * m[4] + a.z * m[6];
        along[3 * i + 1] = a.x * m[4] + a.y * yy + a.z * m[5];
        along[3 * i + 2] = a.x * m[6] + a.y * m[5] + a.z * zz;
    }
    vec3 x = frame[0], y = frame[1], z = frame[2];
    found[4] = x.x * along[3] + x.y * along[4] + x.z * along[5];
    found[5] = y.x * along[6] + y.y * along[7] + y.z * along[8];
    found[6] = x.x * along[6] + x.y * along[7] + x.z * along[8];
    found[7] = x.x * along[0] + x.y * along[1] + x.z * along[2] - (y.x * along[3] + y.y * along[4] + y.z * along[5]);
    found[8] = 3.0 * (z.x * along[6] + z.y * along[7] + z.z * along[8]) - m[0];
#endif
}
