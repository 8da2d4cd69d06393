// Ashikhmin and Shirley, "An anisotropic Phong BRDF model", Journal of Graphics Tools 5(2), 2000.

// log(1 - x) for x in [0, 1/2] as -2 atanh(y), y = x / (2 - x) <= 1/3, cut after y^11: the logarithm of GLSL may
// be wrong by 2^-21 near 1, which an exponent of 100000 would blow up.
float ashikhmin_shirley_log1m(float x)
{
    float y = x / (2.0 - x), y2 = y * y;
    return -2.0 * y * (1.0 + y2 * (1.0 / 3.0 + y2 * (0.2 + y2 * (1.0 / 7.0 + y2 * (1.0 / 9.0 + y2 / 11.0)))));
}

// pow() is exp2(log2()), and loses digits near 1.
float ashikhmin_shirley_pow5(float x)
{
    float x2 = x * x;
    return x2 * x2 * x;
}

// Eq. 5: what the coat leaves to the diffuse base in one direction.
float ashikhmin_shirley_leaving(float cosine)
{
    return 1.0 - ashikhmin_shirley_pow5(1.0 - 0.5 * cosine);
}

// f_r in 1/sr at one wavelength: eq. 4 with the Fresnel term of eq. 3, plus eq. 5. u = x, v = y.
float ashikhmin_shirley(
    vec3 wi, vec3 wo, float diffuse, float specular, float exponent_u, float exponent_v)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return 0.0;
    const float PI = 3.14159265358979;
    vec3 h = wi + wo, d = wi - wo;
    float length2 = dot(h, h);
    float cos_d = 0.5 * sqrt(length2);
    // sin^2 of the half vector's angle; from z where that is the smaller part.
    vec2 away = h.xy * h.xy / length2;
    float away2 = away.x + away.y;
    float log2_nh = away2 > 0.5 ? log(h.z * h.z / length2) : ashikhmin_shirley_log1m(away2);
    float slope = away2 > 0.0 ? log2_nh / away2 : -1.0;
    float lobe = exp(0.5 * slope * (exponent_u * away.x + exponent_v * away.y));
    lobe *= sqrt((exponent_u + 1.0) * (exponent_v + 1.0)) / (8.0 * PI);
    lobe /= cos_d * max(wi.z, wo.z);
    // 1 - cos = sin^2 / (1 + cos), and |wi - wo| = 2 sin: no cancellation near retro-reflection.
    float schlick = ashikhmin_shirley_pow5(0.25 * dot(d, d) / (1.0 + cos_d));
    float base = 28.0 / (23.0 * PI) * diffuse * (1.0 - specular);
    return lobe * (specular + (1.0 - specular) * schlick)
        + base * ashikhmin_shirley_leaving(wi.z) * ashikhmin_shirley_leaving(wo.z);
}
